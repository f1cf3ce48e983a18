"""Graphs in every format: all states and transitions are there, and no name gets out of its quotes."""

from __future__ import annotations

import json
import re
from typing import Any
from xml.etree import ElementTree

import networkx
import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.diagnostics.errors import GesturecError, LimitError
from gesturec.view.graph import FORMATS, draw_graph

SVG = "{http://www.w3.org/2000/svg}"
GRAPHML = "{http://graphml.graphdrawing.org/xmlns}"
SCXML = "{http://www.w3.org/2005/07/scxml}"


def moves(artifact: Artifact, machine: int) -> int:
    tables = artifact.machine(machine)
    source = np.repeat(np.arange(len(tables.state_names)), np.diff(tables.transition_start))
    return int((source != tables.transition_target).sum())


@pytest.fixture
def nasty(hand: Artifact, rename: Any) -> Artifact:
    renamed: Artifact = rename(hand, lambda name: f'<a href="x">\\"]; {name} & --> \x01]]>\n')
    return renamed


@pytest.mark.parametrize("machine", range(5))
def test_svg_has_a_circle_and_a_name_for_each_state(hand: Artifact, machine: int) -> None:
    root = ElementTree.fromstring(draw_graph(hand, machine, "svg"))
    titles = [circle.findtext(f"{SVG}title") for circle in root.iter(f"{SVG}circle")]
    assert titles == list(hand.machine(machine).state_names)


def test_svg_keeps_everything_inside_its_frame(hand: Artifact) -> None:
    for machine in range(hand.n_machine):
        root = ElementTree.fromstring(draw_graph(hand, machine, "svg"))
        left, top, width, height = map(float, root.attrib["viewBox"].split())
        group = root.find(f"{SVG}g")
        assert group is not None
        dx, dy = map(float, re.findall(r"[-\d.]+", group.attrib["transform"]))
        for circle in group.iter(f"{SVG}circle"):
            x, y, r = (float(circle.attrib[key]) for key in ("cx", "cy", "r"))
            assert left <= x + dx - r and x + dx + r <= left + width
            assert top <= y + dy - r and y + dy + r <= top + height


def test_graphml_has_every_state_and_transition(hand: Artifact) -> None:
    root = ElementTree.fromstring(draw_graph(hand, "index", "graphml"))
    tables = hand.machine(hand.manifest.machines.index("index"))
    assert len(list(root.iter(f"{GRAPHML}node"))) == len(tables.state_names)
    edges = [(edge.attrib["source"], edge.attrib["target"]) for edge in root.iter(f"{GRAPHML}edge")]
    assert len(set(edges)) == len(edges) == len(tables.transition_target)


@pytest.mark.parametrize("name", ["index", "thumb"])
def test_networkx_reads_the_graph_that_the_tables_have(hand: Artifact, name: str) -> None:
    """An independent reader: GraphML gives the states by name, their angles, and the transitions."""
    tables = hand.machine(hand.manifest.machines.index(name))
    graph = networkx.parse_graphml(draw_graph(hand, name, "graphml"))
    assert [data["name"] for _, data in graph.nodes(data=True)] == list(tables.state_names)
    for (_, data), angle in zip(graph.nodes(data=True), tables.angle, strict=True):
        joints = [hand.manifest.joints[joint] for joint in tables.joints]
        assert np.allclose([data[joint] for joint in joints], angle)
    start = tables.transition_start
    wanted = {(s, t) for s in range(len(start) - 1) for t in tables.transition_target[start[s] : start[s + 1]].tolist()}
    assert {(int(s[1:]), int(t[1:])) for s, t in graph.edges()} == wanted


def test_scxml_names_targets_that_exist(hand: Artifact) -> None:
    root = ElementTree.fromstring(draw_graph(hand, "thumb", "scxml"))
    ids = {state.attrib["id"] for state in root.iter(f"{SCXML}state")}
    targets = [transition.attrib["target"] for transition in root.iter(f"{SCXML}transition")]
    assert root.attrib["initial"] in ids
    assert set(targets) <= ids
    assert len(targets) == len(hand.machine(hand.manifest.machines.index("thumb")).transition_target)


def test_json_says_what_the_tables_say(hand: Artifact) -> None:
    graph = json.loads(draw_graph(hand, "index", "json"))
    tables = hand.machine(hand.manifest.machines.index("index"))
    assert [state["name"] for state in graph["states"]] == list(tables.state_names)
    assert np.allclose([list(state["joints"].values()) for state in graph["states"]], tables.angle)
    rows = [[] for _ in tables.state_names]  # type: ignore[var-annotated]
    for source, target, _ in graph["transitions"]:
        rows[source].append(target)
    assert [target for row in rows for target in row] == list(tables.transition_target)


def test_dot_and_mermaid_have_every_move(hand: Artifact) -> None:
    dot, mermaid = draw_graph(hand, "index", "dot"), draw_graph(hand, "index", "mmd")
    machine = hand.manifest.machines.index("index")
    ways = [2 if "dir=both" in line else 1 for line in dot.splitlines() if re.match(r"  s(\d+) -> s(?!\1;)", line)]
    assert sum(ways) == moves(hand, machine)
    assert len(re.findall(r"^  s\d+ --> s\d+$", mermaid, re.M)) == moves(hand, machine)


@pytest.mark.parametrize("format", ["svg", "graphml", "scxml"])
def test_hostile_names_leave_xml_well_formed(nasty: Artifact, format: str) -> None:
    text = draw_graph(nasty, 0, format)
    root = ElementTree.fromstring(text)
    assert not [element for element in root.iter() if element.tag.endswith("}a")]


def test_hostile_names_stay_in_their_line(nasty: Artifact) -> None:
    dot, mermaid = draw_graph(nasty, 0, "dot"), draw_graph(nasty, 0, "mmd")
    assert all(re.fullmatch(r'(digraph ".*" \{|  .*;|\})', line) for line in dot.splitlines())
    assert all(
        re.fullmatch(r"stateDiagram-v2|  s\d+ : [\w./ #;-]*|  s\d+ --> s\d+", line) for line in mermaid.splitlines()
    )
    assert json.loads(draw_graph(nasty, 0, "json"))["machine"] == nasty.manifest.machines[0]


def test_an_unknown_machine_or_format_is_told_with_what_there_is(hand: Artifact, rigid: Artifact) -> None:
    with pytest.raises(GesturecError, match=r"no machine `elbow`; there are .*thumb"):
        draw_graph(hand, "elbow", "svg")
    with pytest.raises(GesturecError, match="no machine `5`"):
        draw_graph(hand, 5, "svg")
    with pytest.raises(GesturecError, match="rigid"):
        draw_graph(rigid, 0, "svg")
    with pytest.raises(GesturecError, match="no graph format `png`; there are svg"):
        draw_graph(hand, 0, "png")


def test_too_many_states_or_transitions_are_refused_by_count(hand: Artifact, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gesturec.view.layout.lay_out.MOST_STATES", 100)
    with pytest.raises(LimitError, match=r"128 states.* at most 100"):
        draw_graph(hand, "thumb", "svg")
    monkeypatch.setattr("gesturec.view.graph.MOST_TRANSITIONS", 100)
    with pytest.raises(LimitError, match="at most 100"):
        draw_graph(hand, "index", "dot")


def test_pictures_are_the_same_every_time(hand: Artifact) -> None:
    for format in FORMATS:
        assert draw_graph(hand, "index", format) == draw_graph(hand, "index", format)
