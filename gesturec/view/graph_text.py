"""A machine's graph for other tools: DOT (Graphviz), GraphML, Mermaid, SCXML, JSON.

Each function takes a compiled model and a machine's id and returns the whole file. Angles are rad and lengths m.
"""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import numpy as np

from gesturec.view.layout import MOST_STATES, layout_graph
from gesturec.view.layout.arcs import merge_ways, transition_pairs
from gesturec.view.layout.types import Floats
from gesturec.view.markup import element, number, text

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact, MachineTables

_MERMAID_PLAIN = re.compile(r"[^A-Za-z0-9_./ -]")


def graph_dot(artifact: Artifact, machine: int) -> str:
    """Graphviz; `neato -n` keeps the places, two ways are one edge."""
    tables, place = artifact.machine(machine), _places(artifact, machine)
    lines = [f"digraph {_dot(tables.name)} {{", '  node [shape=circle, fontsize=9, fontname="sans-serif"];']
    for state, name in enumerate(tables.state_names):
        where = "" if place is None else f', pos="{place[state, 0]:.1f},{-place[state, 1]:.1f}"'
        lines.append(f"  s{state} [label={_dot(name)}{where}];")
    for source, target, both in merge_ways(*transition_pairs(tables), len(tables.state_names)).tolist():
        lines.append(f"  s{source} -> s{target}{' [dir=both]' if both else ''};")
    stays = [f"  s{state} -> s{state};" for state in _stays(tables)]
    return "\n".join([*lines, *stays, "}"]) + "\n"


def graph_graphml(artifact: Artifact, machine: int) -> str:
    """GraphML with the states' names, places, costs and joint values, and the transitions' costs."""
    tables, place = artifact.machine(machine), _places(artifact, machine)
    joints = [artifact.manifest.joints[joint] for joint in tables.joints]
    kinds = {"name": "string", "cost": "double", **dict.fromkeys(joints, "double")}
    if place is not None:
        kinds |= {"x": "double", "y": "double"}
    keys = [_graphml_key(f"n{k}", "node", name, kind) for k, (name, kind) in enumerate(kinds.items())]
    keys.append(_graphml_key("e0", "edge", "cost", "double"))
    nodes = []
    for state, name in enumerate(tables.state_names):
        values = [name, repr(float(tables.cost[state])), *map(repr, np.asarray(tables.angle[state], float).tolist())]
        values += [] if place is None else [number(place[state, 0]), number(place[state, 1])]
        cells = "".join(element("data", text(value), key=f"n{k}") for k, value in enumerate(values))
        nodes.append(element("node", cells, id=f"s{state}"))
    edges = [
        element("edge", element("data", repr(cost), key="e0"), source=f"s{source}", target=f"s{target}")
        for source, target, cost in _transitions(tables)
    ]
    graph = element("graph", "\n".join(["", *nodes, *edges, ""]), id=tables.name, edgedefault="directed")
    space = "http://graphml.graphdrawing.org/xmlns"
    return _XML + element("graphml", "\n".join(["", *keys, graph, ""]), xmlns=space) + "\n"


def graph_mermaid(artifact: Artifact, machine: int) -> str:
    """A Mermaid state diagram; stays are left out."""
    tables = artifact.machine(machine)
    lines = ["stateDiagram-v2", *(f"  s{state} : {_mermaid(name)}" for state, name in enumerate(tables.state_names))]
    lines += [f"  s{source} --> s{target}" for source, target, _ in _transitions(tables) if source != target]
    return "\n".join(lines) + "\n"


def graph_scxml(artifact: Artifact, machine: int) -> str:
    """SCXML (W3C, 2015): every state takes the event `enter.sN` for each of its successors."""
    tables = artifact.machine(machine)
    moves: list[list[str]] = [[] for _ in tables.state_names]
    for source, target, _ in _transitions(tables):
        moves[source].append(element("transition", event=f"enter.s{target}", target=f"s{target}"))
    states = [
        element("state", "".join(moves[state]), id=f"s{state}", **{"gesturec:name": name})
        for state, name in enumerate(tables.state_names)
    ]
    names = {"xmlns": "http://www.w3.org/2005/07/scxml", "xmlns:gesturec": "urn:gesturec"}
    label = re.sub(r"[^A-Za-z0-9_.-]", "_", tables.name)
    return (
        _XML + element("scxml", "\n".join(["", *states, ""]), version="1.0", initial="s0", name=label, **names) + "\n"
    )


def graph_json(artifact: Artifact, machine: int) -> str:
    """States with joint values and places, transitions as `[source, target, cost]`."""
    tables, place = artifact.machine(machine), _places(artifact, machine)
    joints = [artifact.manifest.joints[joint] for joint in tables.joints]
    states = [
        {
            "name": name,
            "joints": dict(zip(joints, np.asarray(tables.angle[state], float).tolist(), strict=True)),
            "cost": float(tables.cost[state]),
            "place": None if place is None else [round(v, 1) for v in place[state].tolist()],
        }
        for state, name in enumerate(tables.state_names)
    ]
    graph = {
        "model": artifact.manifest.name,
        "machine": tables.name,
        "kind": tables.kind,
        "units": {"length": "m", "angle": "rad"},
        "states": states,
        "transitions": [list(transition) for transition in _transitions(tables)],
    }
    return json.dumps(graph, indent=1, allow_nan=False) + "\n"


_XML = '<?xml version="1.0" encoding="UTF-8"?>\n'


def _places(artifact: Artifact, machine: int) -> Floats | None:
    """Where the picture has the states, px; None where there are too many for one."""
    few = len(artifact.machine(machine).state_names) <= MOST_STATES
    return layout_graph(artifact, machine).position if few else None


def _transitions(tables: MachineTables) -> list[tuple[int, int, float]]:
    start = np.asarray(tables.transition_start, np.int64)
    source = np.repeat(np.arange(len(start) - 1), start[1:] - start[:-1])
    target, cost = np.asarray(tables.transition_target), np.asarray(tables.transition_cost, float)
    return list(zip(source.tolist(), target.tolist(), cost.tolist(), strict=True))


def _stays(tables: MachineTables) -> list[int]:
    return [source for source, target, _ in _transitions(tables) if source == target]


def _dot(label: str) -> str:
    escaped = label.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\0", "")
    return f'"{escaped}"'


def _mermaid(label: str) -> str:
    """Characters that Mermaid might read are its own numbered entities."""
    return _MERMAID_PLAIN.sub(lambda found: f"#{ord(found.group())};", label)


def _graphml_key(key: str, owner: str, name: str, kind: str) -> str:
    return element("key", id=key, **{"for": owner, "attr.name": name, "attr.type": kind})
