"""Files of strangers: a malformed or hostile one is one message with file and line; nothing is dropped in silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.compile import compile_artifact
from gesturec.diagnostics.errors import InputError
from gesturec.diagnostics.source import Source
from gesturec.scaffold.bvh import read_bvh
from gesturec.scaffold.mjcf import read_mjcf
from gesturec.scaffold.new import READERS, BadNameError, FileKind, model_from_file, new_model
from gesturec.scaffold.urdf import read_urdf
from gesturec.scaffold.xml_tree import MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS

from . import sources

LINKS = '<link name="a"/><link name="b"/><link name="c"/>'
LIMIT = '<limit lower="0" upper="1"/>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = LIMIT) -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def urdf(*parts: str) -> str:
    return "<robot>\n" + "\n".join(parts) + "\n</robot>"


def second(kind: str = "revolute", inside: str = LIMIT) -> str:
    """A robot of two joints, `k` in line 4 as asked for."""
    return urdf(LINKS, joint("j", "a", "b"), joint("k", "b", "c", kind, inside))


def write(folder: Path, text: str) -> Path:
    path = folder / "source.xml"
    path.write_text(text, encoding="utf-8")
    return path


def refused(folder: Path, text: str, kind: FileKind, line: int | None, *words: str) -> None:
    """The whole way to a model's text ends in one located message that has these words."""
    path = write(folder, text)
    with pytest.raises(InputError) as caught:
        model_from_file("body", path, kind)
    message = str(caught.value)
    assert (caught.value.path, caught.value.row) == (str(path), line), message
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("<robot>\n<link name='a'>\n</robot>", 3, ["not XML"]),
        ("", 1, ["not XML"]),
        ("<sdf/>", 1, ["`sdf`"]),
        (urdf("<xacro:macro xmlns:xacro='x' name='m'/>"), 2, ["xacro"]),
        (urdf(), 1, ["no link"]),
        (urdf("<link/>"), 2, ["without a name"]),
        (urdf("<link name='a'/>", "<link name='a'/>"), 3, ["`a`", "twice", "line 2"]),
        (urdf(LINKS, joint("j", "a", "b")), 2, ["`a` and `c`", "no parent"]),
        (urdf(LINKS, joint("j", "a", "b"), joint("k", "c", "b")), 4, ["two parents", "`j` and `k`"]),
        (urdf(LINKS, joint("j", "a", "b"), joint("k", "b", "c"), joint("l", "c", "a")), 1, ["circle"]),
        (
            urdf("<link name='o'/>", LINKS, joint("j", "a", "b"), joint("k", "b", "a"), joint("l", "o", "c")),
            None,
            ["circle"],
        ),
        (urdf(LINKS, joint("j", "a", "b"), joint("k", "b", "d")), 4, ["`k`", "`d`"]),
        (
            urdf(LINKS, joint("j", "a", "b"), '<joint name="k" type="fixed"><parent link="b"/></joint>'),
            4,
            ["no `child`"],
        ),
        (second("floating"), 4, ["`k`", "`floating`", "revolute"]),
        (second("planar"), 4, ["`k`", "`planar`"]),
        (second(inside=""), 4, ["`k`", "no `limit`"]),
        (
            urdf(LINKS, joint("j", "a", "b"), joint("k", "b", "c", inside='<limit lower="2" upper="1"/>')),
            4,
            ["reversed"],
        ),
        (
            urdf(LINKS, joint("j", "a", "b"), joint("k", "b", "c", inside='<limit lower="nan"/>')),
            4,
            ["`nan`", "`lower`"],
        ),
        (second(inside='<axis xyz="0 0 0"/>' + LIMIT), 4, ["zero"]),
        (
            urdf(LINKS, joint("j", "a", "b"), joint("k", "b", "c", inside='<origin xyz="1 2"/>' + LIMIT)),
            4,
            ["3 numbers"],
        ),
        (
            urdf(LINKS, joint("j", "a", "b"), joint("k", "b", "c", inside='<origin xyz="1 2 1e300"/>' + LIMIT)),
            4,
            ["limit"],
        ),
        (second(inside='<mimic joint="m"/>'), 4, ["`k`", "`m`"]),
        (second(inside="<mimic/>"), 4, ["names no joint"]),
        (
            urdf(
                LINKS,
                joint("j", "a", "b", inside='<mimic joint="k"/>'),
                joint("k", "b", "c", inside='<mimic joint="j"/>'),
            ),
            3,
            ["circle", "j -> k -> j"],
        ),
    ],
)
def test_a_wrong_urdf_is_one_message_with_its_line(
    tmp_path: Path, text: str, line: int | None, words: list[str]
) -> None:
    refused(tmp_path, text, "urdf", line, *words)


def world(*parts: str) -> str:
    return "<mujoco>\n<worldbody>\n" + "\n".join(parts) + "\n</worldbody>\n</mujoco>"


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("<robot/>", 1, ["`robot`"]),
        ("<mujoco/>", 1, ["worldbody"]),
        ("<mujoco>\n<include file='/etc/passwd'/>\n</mujoco>", 2, ["`include`"]),
        (world("<body name='a'>", "<joint name='j' type='gimbal'/></body>"), 4, ["`j`", "`gimbal`", "hinge", "ball"]),
        (
            world("<body name='a'>", "<joint name='j' type='ball' limited='true' range='0 0'/></body>"),
            4,
            ["`j`", "nowhere"],
        ),
        (world("<body><joint axis='0 0 0'/></body>"), 3, ["zero"]),
        (world("<body><joint range='1 0'/></body>"), 3, ["reversed"]),
        (world("<body><joint name='j' limited='true'/></body>"), 3, ["`j`", "no `range`"]),
        (world("<body quat='0 0 0 0'/>"), 3, ["zero"]),
        (world("<body quat='1 0 0 0' euler='1 2 3'/>"), 3, ["`quat` and `euler`"]),
        (world("<body><joint class='soft'/></body>"), 3, ["`soft`", "not declared"]),
        (world("<body><body>", "<freejoint name='f'/></body></body>"), 4, ["`f`", "free"]),
        (world("<body name='a'><freejoint/></body>", "<body name='b'><freejoint/></body>"), None, ["`a`, `b`"]),
        (world("<body><frame>", "<joint name='j'/></frame></body>"), 4, ["`joint`", "`frame`"]),
        (world("<replicate count='9'><body/></replicate>"), 3, ["`replicate`"]),
        ("<mujoco><compiler eulerseq='xyw'/><worldbody><body/></worldbody></mujoco>", 1, ["eulerseq"]),
        (
            "<mujoco>\n<worldbody><body><joint name='j'/></body></worldbody>\n"
            "<equality><joint joint1='j' joint2='k'/></equality></mujoco>",
            3,
            ["`k`"],
        ),
    ],
)
def test_a_wrong_mjcf_is_one_message_with_its_line(
    tmp_path: Path, text: str, line: int | None, words: list[str]
) -> None:
    refused(tmp_path, text, "mjcf", line, *words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("HIERARCHY", "HIERACHY", ["`HIERACHY`", "HIERARCHY"]),
        ("OFFSET 0.01 0.3", "OFFSET nan 0.3", ["`nan`"]),
        ("OFFSET 0.01 0.3 -0.02\n", "OFFSET 0.01 0.3 ", ["`CHANNELS`"]),
        ("CHANNELS 1 X", "CHANNELS 9 X", ["`9`"]),
        ("CHANNELS 1 X", "CHANNELS 1 W", ["`Wrotation`"]),
        ("CHANNELS 3 Xrotation", "CHANNELS 3 Zrotation", ["twice"]),
        ("9  -20", "9", ["15 values", "16 channels"]),
        ("9  -20", "9  -2o", ["`-2o`"]),
        ("9  -20", "9  inf", ["finite"]),
        ("MOTION", "ROOT Other", ["second ROOT"]),
        ("JOINT Leg", "LIMB Leg", ["`LIMB`", "JOINT"]),
    ],
)
def test_a_wrong_bvh_is_one_message_with_its_line(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    before, after = sources.STICK.split(old)
    refused(tmp_path, before + new + after, "bvh", before.count("\n") + 1, *words)


def test_a_cut_bvh_is_an_error_at_every_length(tmp_path: Path) -> None:
    hierarchy = sources.STICK.split("MOTION")[0].split()
    for length in range(len(hierarchy)):
        with pytest.raises(InputError):
            read_bvh(write(tmp_path, " ".join(hierarchy[:length])))
    read_bvh(write(tmp_path, " ".join(hierarchy)))


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_hostile_xml_is_refused_before_it_grows(tmp_path: Path, kind: FileKind) -> None:
    bomb = '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
    outside = '<!DOCTYPE robot SYSTEM "file:///etc/passwd">'
    for text in (f"{bomb}<robot>&b;</robot>", f"{outside}<robot/>"):
        refused(tmp_path, text, kind, 1, "DTD")
    refused(tmp_path, "<a>" * (MAX_DEPTH + 1) + "</a>" * (MAX_DEPTH + 1), kind, 1, "deep")
    refused(tmp_path, "<a>" + "<b/>" * MAX_ELEMENTS + "</a>", kind, 1, "elements")
    (tmp_path / "big.xml").write_bytes(b" " * (MAX_BYTES + 1))
    for path in (tmp_path / "big.xml", tmp_path, tmp_path / "none.xml"):
        with pytest.raises(InputError):
            READERS[kind](path)
    (tmp_path / "odd.xml").write_bytes(b'<?xml version="1.0" encoding="x-none"?><robot/>')
    with pytest.raises(InputError, match="not XML"):
        READERS[kind](tmp_path / "odd.xml")


def test_a_coupling_is_never_dropped(tmp_path: Path) -> None:
    text = model_from_file("body", write(tmp_path, sources.ARM), "urdf")
    assert "joint: level" in text
    assert "follows: -0.75 * bend + 11.459155902616466 deg" in text
    both = model_from_file("body", write(tmp_path, sources.GRIPPER), "urdf")
    for name in ("left_tip", "other", "right_tip"):
        assert f"{{joint: {name}," in both.replace("- joint: ", "- {joint: ").replace("\n", ",")
    assert both.count("follows: ") >= 3
    assert "parent: palm.turn" in both  # the thumb is free, so it keeps a limb of its own


def test_a_coupling_that_no_chain_can_hold_is_named(tmp_path: Path) -> None:
    links = "".join(f'<link name="{name}"/>' for name in "abcdefg")
    text = urdf(
        links,
        joint("left", "a", "b"),
        joint("left_far", "b", "c"),
        joint("left_other", "b", "d"),
        joint("right", "a", "e"),
        joint("right_far", "e", "f", inside=LIMIT + '<mimic joint="left_far"/>'),
        joint("right_other", "e", "g"),
    )
    refused(tmp_path, text, "urdf", 7, "`right_far`", "`left_far`", "one chain")


def test_classes_of_mjcf_inherit(tmp_path: Path) -> None:
    text = (
        "<mujoco><compiler angle='degree'/><default><joint axis='1 0 0' range='0 90'/>"
        "<default class='soft'><joint range='0 45'/></default></default>"
        "<worldbody><body name='a' childclass='soft'><joint name='j'/><body name='b'><joint name='k' class='main'/>"
        "<site name='s' pos='0 1 0'/></body></body></worldbody></mujoco>"
    )
    dofs = {node.dof.name: node.dof for node in read_mjcf(write(tmp_path, text)).root.walk() if node.dof}
    assert {name: dof.high for name, dof in dofs.items()} == {
        "j": pytest.approx(0.25 * 3.14159265),
        "k": pytest.approx(1.57079633),
    }
    assert all(dof.axis.tolist() == [1, 0, 0] for dof in dofs.values())


@pytest.mark.parametrize(
    ("compiler", "limits", "x", "y"),
    [
        ("angle='degree'", "range='0 60' limited='true'", 60, 60),
        ("angle='radian' autolimits='true'", "range='0 2'", np.degrees(2), 90),
        ("", "", 180, 90),
    ],
    ids=["degrees", "radians", "free"],
)
def test_a_ball_is_three_hinges_that_reach_its_cone(
    tmp_path: Path, compiler: str, limits: str, x: float, y: float
) -> None:
    text = (
        f"<mujoco><compiler {compiler}/><worldbody><body name='a'><body name='b' pos='0 0 1'>"
        f"<joint name='j' type='ball' pos='0 0.1 0' {limits}/><site name='s' pos='0 1 0'/>"
        "</body></body></worldbody></mujoco>"
    )
    path = write(tmp_path, text)
    skeleton = read_mjcf(path)
    dofs = [node.dof for node in skeleton.root.walk() if node.dof]
    assert [(dof.name, dof.axis.tolist()) for dof in dofs] == [
        ("j_x", [1, 0, 0]),
        ("j_y", [0, 1, 0]),
        ("j_z", [0, 0, 1]),
    ]
    assert np.degrees([dof.high for dof in dofs]) == pytest.approx([x, y, x])
    assert np.degrees([dof.low for dof in dofs]) == pytest.approx([-x, -y, -x])
    assert any("ball joint `j`" in note for note in skeleton.notes)
    compile_artifact(Source("ball.yaml", model_from_file("ball", path, "mjcf")))


def test_a_switched_off_coupling_is_told(tmp_path: Path) -> None:
    text = sources.CRAWLER.replace('joint1="curl"', 'active="false" joint1="curl"')
    assert any("`curl`" in note for note in read_mjcf(write(tmp_path, text)).notes)


def test_a_take_gives_ranges_and_none_gives_the_default(tmp_path: Path) -> None:
    text = model_from_file("body", write(tmp_path, sources.STICK), "bvh")
    # Arm's first channel goes from 4 to 100 degrees, Leg's from -20 to 30; the others stay at 1 to 9
    assert "joint: turn_y, axis: y, range: 0 .. 105, every: 15}  # in the take 4 to 100" in text
    assert "axis: x, range: -30 .. 30, every: 15}  # in the take -20 to 30" in text
    assert "joint: turn_z, axis: z, range: -15 .. 15, every: 15}  # in the take 1 to 1" in text
    bare = model_from_file("body", write(tmp_path, sources.STICK.split("MOTION")[0]), "bvh")
    assert bare.count("range: -90 .. 90") == 10


def test_a_joint_that_only_the_format_needs_is_rigid(tmp_path: Path) -> None:
    still = sources.STICK.replace("OFFSET 0.01 0.3 -0.02", "OFFSET 0 0 0").replace("0  1 2 3  ", "0  0 0 0  ")
    text = model_from_file("body", write(tmp_path, still), "bvh")
    assert "still through the take, so rigid: Chest" in text
    assert "  Chest:\n    chain" not in text
    assert "Chest: [0, 0, 0]" in text


def test_names_become_names_of_the_language_once_each(tmp_path: Path) -> None:
    parts = [joint("1 st", "a", "b"), joint("in", "b", "c", inside="<axis xyz='0 0 1'/>" + LIMIT)]
    text = model_from_file("body", write(tmp_path, urdf(LINKS, *parts)), "urdf")
    assert "joint: _1_st" in text
    assert "joint: in_" in text


def test_a_path_cannot_write_into_the_models_comments(tmp_path: Path) -> None:
    path = tmp_path / "a\nname: evil.urdf"
    path.write_text(sources.ARM)
    assert "\nname: evil" not in model_from_file("body", path, "urdf")
    assert read_urdf(path).root.name == "base_link"


def test_a_models_name_is_one() -> None:
    for name in ("", "2nd", "a-b", "root", "a/b"):
        with pytest.raises(BadNameError, match="not a name"):
            new_model(name)
    with pytest.raises(BadNameError, match="minimal, finger"):
        new_model("body", "hand")


def test_the_modeline_is_the_first_line(tmp_path: Path) -> None:
    for text in (new_model("body"), model_from_file("body", write(tmp_path, sources.ARM), "urdf")):
        assert text.startswith("# yaml-language-server: $schema=gesturec.schema.json\n")
