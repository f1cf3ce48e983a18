"""Small robots and skeletons written for the tests."""

from typing import Final

ARM: Final = """<?xml version="1.0"?>
<robot name="arm">
  <!-- every kind of joint, a turn about all three axes, an oblique axis, a coupling in the same chain -->
  <link name="base_link"/>
  <link name="upper-arm"/>
  <link name="bracket"><visual><geometry><mesh filename="package://a/b.stl"/></geometry></visual></link>
  <link name="forearm"/>
  <link name="slider"/>
  <link name="camera"/>
  <link name="tool">
    <collision>
      <origin xyz="0.01 0 0.06" rpy="0.3 0 0"/>
      <geometry><cylinder radius="0.01" length="0.12"/></geometry>
    </collision>
  </link>
  <joint name="swing" type="continuous">
    <parent link="base_link"/><child link="upper-arm"/>
    <origin xyz="0.1 -0.02 0.333" rpy="0.3 -0.7 2.1"/><axis xyz="1 2 -2"/>
    <limit effort="1" velocity="2.5"/>
  </joint>
  <joint name="weld" type="fixed">
    <parent link="upper-arm"/><child link="bracket"/><origin xyz="0.0123456789 0 0.25" rpy="0 1.5707963267948966 0"/>
  </joint>
  <joint name="bend" type="revolute">
    <parent link="bracket"/><child link="forearm"/>
    <origin xyz="0 0.05 0" rpy="0.1 0 0"/><axis xyz="0 -1 0"/><limit lower="-2.0943951" upper="1.5707963" effort="9"/>
  </joint>
  <joint name="reach" type="prismatic">
    <parent link="forearm"/><child link="slider"/>
    <origin xyz="0.3 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.4" effort="9" velocity="0.5"/>
  </joint>
  <joint name="eye" type="fixed"><parent link="slider"/><child link="camera"/><origin xyz="0 0 0.07"/></joint>
  <joint name="level" type="revolute">
    <parent link="slider"/><child link="tool"/>
    <origin xyz="0.05 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9"/>
    <mimic joint="bend" multiplier="-0.75" offset="0.2"/>
  </joint>
</robot>
"""

GRIPPER: Final = """<robot name="gripper">
  <link name="wrist"/><link name="palm"/><link name="left"/><link name="left_pad"/><link name="right"/>
  <link name="right_pad"/><link name="thumb"/>
  <joint name="turn" type="revolute">
    <parent link="wrist"/><child link="palm"/><origin xyz="0 0 0.1" rpy="0 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="-1.5707963267948966" upper="1.5707963267948966" effort="1" velocity="1"/>
  </joint>
  <joint name="drive" type="revolute">
    <parent link="palm"/><child link="left"/><origin xyz="0.02 0.03 0.05" rpy="0.2 0.1 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.8" effort="1" velocity="1"/>
  </joint>
  <joint name="left_tip" type="revolute">
    <parent link="left"/><child link="left_pad"/><origin xyz="0 0.01 0.04"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="0" effort="1" velocity="1"/><mimic joint="drive" multiplier="-1"/>
  </joint>
  <joint name="other" type="revolute">
    <parent link="palm"/><child link="right"/><origin xyz="0.02 -0.03 0.05" rpy="-0.2 0.1 0"/><axis xyz="1 0 0"/>
    <limit lower="-0.8" upper="0" effort="1" velocity="1"/><mimic joint="left_tip" offset="0.01"/>
  </joint>
  <joint name="right_tip" type="prismatic">
    <parent link="right"/><child link="right_pad"/><origin xyz="0 -0.01 0.04"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.02" effort="1" velocity="1"/><mimic joint="drive" multiplier="0.02" offset="0.001"/>
  </joint>
  <joint name="oppose" type="revolute">
    <parent link="palm"/><child link="thumb"/><origin xyz="-0.03 0 0.02"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
"""

CRAWLER: Final = """<mujoco model="crawler">
  <compiler angle="radian" eulerseq="XYZ"/>
  <worldbody>
    <body name="trunk" pos="0 0 1">
      <freejoint name="loose"/>
      <site name="nose" pos="0.2 0 0.05"/><site name="left_eye" pos="0.15 0.05 0.1"/><site name="tail" pos="-0.3 0 0"/>
      <body name="hip" pos="0.1 0.2 -0.05" quat="0.9 0.1 -0.2 0.3">
        <joint name="swing" axis="0 0 1" pos="0.01 0.02 0.03" range="-0.7 0.7"/>
        <joint name="lift" axis="1 1 0" pos="-0.01 0 0.02" range="-0.5 1.1" ref="0.3"/>
        <geom type="capsule" fromto="0 0 0 0 0.2 0" size="0.02"/>
        <body name="shin" pos="0 0.2 0" euler="0.2 -0.4 0.6">
          <joint name="knee" axis="1 0 0" pos="0 0 0.01" range="-1.5 0" limited="true"/>
          <joint name="spring" type="slide" axis="0 0 -1" range="0 0.05" ref="0.01"/>
          <site name="foot" pos="0 0 -0.25"/>
          <body name="claw" pos="0 0.02 -0.25">
            <joint name="curl" axis="0 1 0" range="-2 2"/>
            <site name="claw_tip" pos="0.06 0 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality>
    <joint joint1="curl" joint2="knee" polycoef="0.1 -0.5 0.25 0 0"/>
  </equality>
</mujoco>
"""

STICK: Final = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Chest
  {
    OFFSET 0.01 0.3 -0.02
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Arm
    {
      OFFSET 0.2 0.1 0
      CHANNELS 3 Yrotation Zrotation Xrotation
      End Site
      {
        OFFSET 0.5 0 0.01
      }
    }
    JOINT Head
    {
      OFFSET 0 0.25 0.03
      CHANNELS 3 Xrotation Yrotation Zrotation
      End Site
      {
        OFFSET 0 0.2 0
      }
    }
  }
  JOINT Leg
  {
    OFFSET 0.1 -0.05 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -0.9 0.1
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0083333
0 1 0 0 0 0  1 2 3  4 5 6  7 8 9  -20
0 1 0 0 0 0  1 2 3  100 5 6  7 8 9  30
"""
