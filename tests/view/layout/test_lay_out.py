"""Layouts: circles do not cover each other, and neighbours in the picture are neighbours of the body."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source
from gesturec.view.layout import GraphLayout, Text, layout_graph
from gesturec.view.layout.plane import tip_positions
from gesturec.view.layout.trellis import split_axes
from gesturec.view.layout.types import text_width

LAMP = """gesturec: 1
name: lamp
units: {length: cm, angle: deg}
root: {name: foot, tokens: {left: [0, 0, -8], right: [0, 0, 8], front: [10, 0, 0]}}
limbs:
  arm:
    chain:
      - {joint: swivel, axis: y, range: -180 .. 180, every: 45, wrap: true}
      - {joint: lift, axis: z, range: 0 .. 90, every: 30}
      - {token: knee, at: [30, 0, 0]}
      - {joint: elbow, at: [30, 0, 0], axis: -z, range: 0 .. 120, every: 30}
      - {token: neck, at: [25, 0, 0]}
      - {joint: head, at: [25, 0, 0], axis: -z, levels: [0, 45]}
      - {token: bulb, at: [8, 2, 0]}
  eye:
    chain:
      - {joint: pan, at: [5, 0, 0], axis: y, levels: [0, 30, 60, 90]}
      - {joint: tilt, axis: z, levels: [0, 30, 60]}
      - {token: pupil, at: [5, 0, 0]}
"""


@pytest.fixture(scope="module")
def lamp() -> Artifact:
    return compile_artifact(Source("lamp.yaml", LAMP))


def test_every_column_of_a_trellis_has_its_level_also_where_the_joints_name_does_not_fit(lamp: Artifact) -> None:
    layout = layout_graph(lamp, number(lamp, "arm"))
    heads = [text for text in layout.texts if text.y < min(panel.y for panel in layout.panels) and text.x > 0]
    assert [text.text for text in heads] == ["-180°", "-135°", "-90°", "-45°", "0°", "45°", "90°", "135°"]
    assert any(text.text == "swivel: the columns" for text in layout.texts)
    assert "swivel wraps: 135° is next to -180°" in layout.caption


def test_tips_of_joints_about_different_axes_are_not_said_to_be_in_a_plane(hand: Artifact, lamp: Artifact) -> None:
    eye, index = layout_graph(lamp, number(lamp, "eye")), layout_graph(hand, number(hand, "index"))
    assert eye.kind == index.kind == "plane"
    assert "flexion plane" not in eye.caption and "pressed into the plane" in eye.caption
    assert "flexion plane" in index.caption and "lines move one joint by one level inside a slice" in index.caption


def number(artifact: Artifact, name: str) -> int:
    return artifact.manifest.machines.index(name)


def distances(places: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return np.linalg.norm(places[:, None] - places[None], axis=-1)


@pytest.mark.parametrize("name", ["index", "middle", "ring", "little", "thumb"])
def test_circles_do_not_cover_each_other(hand: Artifact, name: str) -> None:
    layout = layout_graph(hand, number(hand, name))
    apart = distances(layout.position) + 1e9 * np.eye(len(layout.position))
    assert apart.min() >= 2 * layout.radius


def test_a_finger_is_drawn_in_its_flexion_plane_by_abduction(hand: Artifact) -> None:
    layout = layout_graph(hand, number(hand, "index"))
    assert layout.kind == "plane"
    assert [panel.title for panel in layout.panels] == ["abduction 0°", "abduction 45°"]
    for k, panel in enumerate(layout.panels):
        inside = layout.position[layout.panel == k] - [panel.x, panel.y]
        assert (inside >= layout.radius).all()
        assert (inside <= np.array([panel.width, panel.height]) - layout.radius).all()


def test_places_in_the_plane_are_the_tips_up_to_the_pushing_apart(hand: Artifact) -> None:
    machine = number(hand, "middle")
    layout, tip = layout_graph(hand, machine), tip_positions(hand, hand.machine(machine))
    for k in range(len(layout.panels)):
        inside = layout.panel == k
        drawn, true = distances(layout.position[inside]), distances(tip[inside])
        scale = np.median(drawn[true > 0] / true[true > 0])
        # a circle moves by less than its own width, and so do two of them together at twice that
        assert np.abs(drawn - scale * true).max() < 4 * layout.radius


def test_the_straight_finger_is_on_the_right_and_the_bent_one_on_the_left_as_in_the_papers_figure(
    hand: Artifact,
) -> None:
    layout = layout_graph(hand, number(hand, "index"))
    names = hand.manifest.states["index"]
    straight, folded, bent = (layout.position[names.index(name)] for name in ("0/0/0", "0/90/90", "0/90/0"))
    assert straight[0] == layout.position[layout.panel == 0, 0].max()
    assert folded[0] < straight[0] - 200
    assert bent[1] == layout.position[layout.panel == 0, 1].min()


def test_four_joints_are_a_trellis_with_every_joint_in_its_direction(hand: Artifact) -> None:
    layout = layout_graph(hand, number(hand, "thumb"))
    assert layout.kind == "trellis"
    assert len(layout.panels) == 8
    angle = np.asarray(hand.machine(number(hand, "thumb")).angle)
    for panel in range(8):
        inside = layout.panel == panel
        # across is the outermost joint, down the one before it, the other two are the panel's own
        assert np.ptp(angle[inside][:, :2], axis=0).max() == 0
        assert np.corrcoef(layout.position[inside, 0], angle[inside, 3])[0, 1] > 0.99
        assert np.corrcoef(layout.position[inside, 1], angle[inside, 2])[0, 1] > 0.99


@pytest.mark.parametrize("name", ["index", "thumb"])
def test_drawn_arcs_are_transitions_of_one_joint_by_one_level(hand: Artifact, name: str) -> None:
    tables, layout = hand.machine(number(hand, name)), layout_graph(hand, number(hand, name))
    assert len(layout.arcs)
    step = np.deg2rad(30)
    for source, target, both in layout.arcs.tolist():
        row = tables.transition_target[tables.transition_start[source] : tables.transition_start[source + 1]]
        back = tables.transition_target[tables.transition_start[target] : tables.transition_start[target + 1]]
        assert target in row
        assert (source in back) == bool(both)
        moved = np.abs(tables.angle[source] - tables.angle[target])
        assert layout.panel[source] == layout.panel[target]
        assert np.isclose(moved[moved > 1e-9], step).all()


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        ((4,), ((0,), None, ())),
        ((4, 5), ((0, 1), None, ())),
        ((2, 4, 5), ((1, 2), 0, ())),
        ((2, 4, 4, 4), ((2, 3), 1, (0,))),
        ((3, 7, 9, 4, 7), ((3, 4), 2, (0, 1))),
    ],
)
def test_the_joint_with_most_levels_makes_the_columns(counts: tuple[int, ...], expected: object) -> None:
    assert split_axes(counts) == expected


def test_every_layout_has_a_colour_a_label_and_a_place_for_each_state(hand: Artifact) -> None:
    for machine in range(hand.n_machine):
        layout: GraphLayout = layout_graph(hand, machine)
        count = len(hand.machine(machine).state_names)
        assert layout.position.shape == (count, 2)
        assert len(layout.colors) == len(layout.labels) == len(layout.panel) == count
        assert np.isfinite(layout.position).all()


SHAPES = """gesturec: 1
name: shapes
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm:
    chain:
      - {joint: lift, axis: z, levels: {lowest: -60, lower: -30, level: 0, higher: 30, highest: 60, topmost: 90}}
      - {joint: wag, axis: y, levels: {far_right: -60, right: -30, middle: 0, left: 30, far_left: 60, beyond: 90}}
      - {token: tip, at: [-280, 0, 0]}
  tail:
    chain:
      - {joint: lift, axis: -z, levels: {low: -60, level: 0, high: 60}}
      - {joint: wag, axis: y, levels: {to_right: -40, middle: 0, to_left: 40}}
      - {token: tip, at: [-280, 0, 0]}
  face:
    chain:
      - {joint: p, type: slide, axis: x, spread: 1}
      - {joint: q, type: slide, axis: y, spread: 1}
      - {token: tip}
    machine:
      states: {STATES}
"""


def named(count: int, name: str = "shape") -> Artifact:
    rng = np.random.default_rng(4)
    states = [f"{name}_{k}: {{p: {p}, q: {q}}}" for k, (p, q) in enumerate(rng.integers(-50, 50, (count, 2)))]
    return compile_artifact(Source("shapes.yaml", SHAPES.replace("{STATES}", "{" + ", ".join(states) + "}")))


def box(text: Text) -> tuple[float, float, float, float]:
    width = text_width(text.text)
    left = text.x - {"start": 0, "middle": width / 2, "end": width}[text.anchor]
    return left, text.y - 9, left + width, text.y + 3


def assert_readable(layout: GraphLayout) -> None:
    """No text covers another, and all are inside the picture."""
    boxes = [box(text) for text in layout.texts]
    for k, (left, top, right, bottom) in enumerate(boxes):
        assert left >= -1e-9 and right <= layout.width + 1e-9 and bottom <= layout.height + 9
        for other in boxes[:k]:
            assert right <= other[0] or other[2] <= left or bottom <= other[1] or other[3] <= top, layout.texts[k]


def test_names_that_would_cover_each_other_make_a_trellis_of_a_plane() -> None:
    artifact = named(3)
    arm, tail = layout_graph(artifact, number(artifact, "arm")), layout_graph(artifact, number(artifact, "tail"))
    assert (arm.kind, tail.kind) == ("trellis", "plane")
    assert {text.text for text in tail.texts} == set(artifact.manifest.states["tail"])
    assert_readable(arm)
    assert_readable(tail)


@pytest.mark.parametrize(
    ("count", "name"), [(5, "shape"), (20, "a_shape_with_a_name_that_is_far_too_long"), (200, "shape")]
)
def test_named_states_are_named_beside_or_numbered_and_listed(count: int, name: str) -> None:
    artifact = named(count, name)
    layout, names = layout_graph(artifact, number(artifact, "face")), artifact.manifest.states["face"]
    assert_readable(layout)
    if count == 5:
        assert [text.text for text in layout.texts] == list(names)
    else:
        assert list(layout.labels) == [str(k + 1) for k in range(count)]
        assert [text.text.split() for text in layout.texts] == [[str(k + 1), each] for k, each in enumerate(names)]
