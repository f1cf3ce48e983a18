"""Small bodies to have several of: an arm of two limbs, a pair of such arms, and two pairs."""

from __future__ import annotations

from pathlib import Path

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact

ARM = """
gesturec: 1
name: arm
units: {length: m, angle: rad}
parameters: {reach: 0.3, thick: 0.02}
mirror: {across: z, side: [right, left]}
root: {name: base, tokens: {a: [0, 0, 0], b: [0, 0, 0.1], c: [0.1, 0, 0], d: [0, 0.05, 0.03]}}
limbs:
  lower:
    chain:
      - {joint: bend, axis: y, levels: {flat: 0, half: 0.8, steep: 1.6}, radius: $thick}
      - {token: tip, at: [$reach, 0, 0]}
  upper:
    chain:
      - {joint: turn, at: [0, 0, 0.08], axis: z, levels: [0, 0.6, 1.2]}
      - {joint: lift, axis: y, levels: [0, 0.6, 1.2]}
      - {token: tip, at: [0.2, 0, 0]}
poses:
  flat: {lower: {bend: flat}}
  steep: {lower: {bend: steep}}
gestures:
  dip: flat -> steep within 2 s
"""
PAIR = """
gesturec: 1
name: pair
units: {length: mm, angle: deg}
bodies:
  left: {model: arm.yaml, set: {side: left}}
  right: {model: arm.yaml}
poses:
  both_flat: left.flat and right.flat
  touching: distance(left.lower.tip, right.lower.tip) < 60 mm
gestures:
  meet: enter(touching)
  dips: left.dip | right.dip
"""
PEOPLE = """
gesturec: 1
name: people
units: {length: cm, angle: deg}
bodies:
  anna: {model: pair.yaml, set: {left.reach: 20, scale: 0.5}}
  ben: {model: pair.yaml}
groups:
  tips: [anna.left.lower.tip, ben.right.lower.tip]
poses:
  all_flat: {anna: both_flat, ben: both_flat}
  anna_down: {anna: left.steep, ben.right: flat}
  one_bent: {ben.right.lower: {bend: steep}, anna.left.lower: {bend: flat}}
  near: any(distance(a, b) < 16 cm for a in tips for b in tips)
gestures:
  all_meet: anna.meet | ben.meet
  anna_dips: anna.dips within 3 s
tests:
  - {path: all_flat -> one_bent, within_level: 90 %, noise: 1 mm}
  - {path: anna.left.flat -> anna.left.steep, hide: {ben.left.upper.tip: 0.2 s .. 0.4 s}, within_level: 80 %}
"""


def written(folder: Path, pair: str = "", people: str = "") -> Path:
    """The three files in a folder, the last two with something more at their ends."""
    (folder / "arm.yaml").write_text(ARM)
    (folder / "pair.yaml").write_text(PAIR + pair)
    (folder / "people.yaml").write_text(PEOPLE + people)
    return folder


def pair_with(folder: Path, more: str, **settings: object) -> Artifact:
    """The compiled pair with something more in its file."""
    return compile_artifact(written(folder, more) / "pair.yaml", set=settings)
