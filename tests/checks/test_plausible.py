"""What is legal and probably not meant is warned of where it stands, once, and not where a unit says it is meant."""

from __future__ import annotations

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.source import Source

WALKER = """gesturec: 1
name: walker
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm:
    chain:
      - {joint: p, axis: z, levels: [0, 30, 60], max_speed: 100}
      - {joint: q, at: [50, 0, 0], axis: z, follows: p}
      - {joint: r, at: [50, 0, 0], axis: z, value: 20}
      - {token: hand, at: [40, 0, 0]}
    machine: {tick: 40 ms, dwell: 40 ms .. 4 s}
  leg:
    chain:
      - {joint: knee, axis: z}
      - {token: foot, at: [0, -90, 0]}
    machine: {cycle: {period: 0.5 .. 2, samples: 4, keys: {knee: {0: 5, 30: 60, 60: 20}}}}
poses:
  up: {arm: {p: 60}}
  down: {arm: {p: 0}}
gestures:
  lift: {pattern: down -> up within 3, cooldown: 1, patience: 0.2}
tests:
  - {path: down -> up, duration: 2, expect: [lift]}
"""


def warnings(old: str = "", new: str = "") -> list[tuple[str, str]]:
    """Rule and marked text of every finding."""
    assert old in WALKER
    found = findings_of(Source("walker.yaml", WALKER.replace(old, new, 1)))
    return [(finding.rule, finding.span.text if finding.span else "") for finding in found]


def test_the_walker_is_plausible() -> None:
    assert warnings() == []


@pytest.mark.parametrize(
    ("old", "new", "rule", "marked"),
    [
        ("[0, 30, 60]", "[0, 30, 60, 450]", "beyond-a-turn", "[0, 30, 60, 450]"),
        ("[0, 30, 60]", "[-200, 0, 60, 200]", "beyond-a-turn", "[-200, 0, 60, 200]"),
        ("value: 20", "value: 400", "beyond-a-turn", "400"),
        ("30: 60", "30: 600", "beyond-a-turn", "{0: 5, 30: 600, 60: 20}"),
        ("5, 30: 60, 60: 20", "0.1, 30: 1.2, 60: 0.3", "radians-suspected", "{0: 0.1, 30: 1.2, 60: 0.3}"),
        ("tick: 40 ms", "tick: 40", "time-suspected", "40"),
        ("40 ms .. 4 s", "40 .. 400", "time-suspected", "40 .. 400"),
        ("0.5 .. 2", "500 .. 2000", "time-suspected", "500 .. 2000"),
        ("0.5 .. 2", "700", "time-suspected", "700"),
        ("within 3", "within 3000", "time-suspected", "3000"),
        ("down -> up", "down for 500 -> up", "time-suspected", "500"),
        ("cooldown: 1", "cooldown: 500", "time-suspected", "500"),
        ("patience: 0.2", "patience: 200", "time-suspected", "200"),
        ("duration: 2", "duration: 2000", "time-suspected", "2000"),
        ("follows: p", "follows: p, max_speed: 100", "ignored-key", "max_speed"),
        ("value: 20", "value: 20, max_speed: 100", "ignored-key", "max_speed"),
        ("up: {arm: {p: 60}}", "up: {arm: {p: 60}}\n  any: {}", "empty-value", "any"),
        ("up: {arm: {p: 60}}", "up: {arm: {p: 60}}\n  any: {arm: {}}", "empty-value", "arm"),
        ("poses:", "groups: {}\nposes:", "empty-value", "groups"),
        ("poses:", "constraints: []\nposes:", "empty-value", "constraints"),
    ],
)
def test_what_is_suspected(old: str, new: str, rule: str, marked: str) -> None:
    found = [item for item in warnings(old, new) if item[0] not in ("equal-states", "never-matches")]
    assert found == [(rule, marked)]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("tick: 40 ms", "tick: 40 s"),
        ("0.5 .. 2", "500 s .. 2000 s"),
        ("within 3", "within 3000 s"),
        ("[0, 30, 60]", "[-180, 0, 180]"),
        ("[0, 30, 60]", "[0, 30, 360]"),
    ],
)
def test_what_is_meant(old: str, new: str) -> None:
    assert not {rule for rule, _ in warnings(old, new)} & {"time-suspected", "beyond-a-turn"}


def test_degrees_in_a_file_of_radians() -> None:
    text = WALKER.replace("angle: deg", "angle: rad").replace("max_speed: 100", "max_speed: 2")
    found = {finding.rule: finding.help for finding in findings_of(Source("walker.yaml", text))}
    assert found["beyond-a-turn"] == "write the unit: `60 deg`"
