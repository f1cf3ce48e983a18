"""What the page knows: a compiled model and a decoded take in, one JSON-ready dictionary out.

The page's code reads nothing else, so this is its interface. Lengths are m, angles rad, times s; `packed` is what
`packing` makes.

==============  ====================================================================================================
key             value
==============  ====================================================================================================
title, facts    what the header says: a text, and a list of `[text, hint]`
model           `{name, description, digest}`
up              the world's upward direction `[x, y, z]`, or null where nobody said it
frames          `{count, every, time, rate, status, pose, scale}`: `every` k says that every k-th frame of the take is
                here; `pose` packed (frame, 12), rotation by rows then translation, NaN unknown
statuses        `[[name, doc, help], ...]`; `frames.status` counts in them
camera          from where the body is first looked at, `camera.first_camera`
body            `{nodes, machine, bones, whisker, hulls, owner}`, nodes packed points (frame, node, 3), intrinsic frame,
                scaled; of several bodies in the world, with `frames.pose` none, `frames.located` packed (frame, body)
                and `owner` the body of each node; `hulls` the root part's nodes of each
tokens          `{names, colors, node, machine, measured}`, a color null where none is given, measured packed points
                (frame, token, 3) in the world
machines        list of `{name, states, colors, joints, state, status, fit, candidate, probability, possible, inside,
                graph}`; `candidate` (frame, 6) the most probable states, -1 none; `probability` in 255ths; `possible`
                how many there are; `inside` how many of them the 90 % set has; `fit` (frame, 5) chi-square, its limit,
                frames until decided, tokens seen, states within reach
machine.graph   null if there are too many states, else the layout (`layout.types.GraphLayout`) with `successors`
events          `[{name, start, end, decided, confidence}]`
poses           `[{name, value: packed (frame,)}]` of poses that hold in some frame
==============  ====================================================================================================
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.kinematics import chain_of, complete_angles
from gesturec.runtime.decision import SET_MASS
from gesturec.runtime.status import STATUS_ID, STATUSES
from gesturec.view.camera import first_camera
from gesturec.view.colors import machine_color
from gesturec.view.facts import header_facts, rate_of
from gesturec.view.layout import GraphLayout, layout_graph
from gesturec.view.packing import Packed, pack, pack_points
from gesturec.view.several import filled, no_pose, nodes_in_world, pack_located
from gesturec.view.skeleton import Skeleton, build_skeleton, node_positions

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact, MachineTables
    from gesturec.runtime.step import Decoding, GestureEvent

Floats = NDArray[np.float64]

# Most bytes of base64 that positions may take; beyond, frames are thinned out, so that a page opens at once
POSITION_BUDGET: Final = 6_000_000
# Candidates told of a frame; the probability of the others is what is missing to one
MOST_CANDIDATES: Final = 6
# States of a machine whose graph the page draws: beyond, circles are smaller than a finger's tip on the screen
MOST_GRAPH_STATES: Final = 2000
# Transitions that the page holds, for the successors of the current state
MOST_TRANSITIONS: Final = 200_000
# A candidate less probable than this is not counted as possible
FIT: Final = ("chi_square", "limit", "delay", "seen", "reachable", "leaned")  # of `MachineWhy`, in the order of why.js
LEAST_PROBABILITY: Final = 1e-3
# What a sum of single-precision probabilities is off by at most
ROUNDING: Final = 1e-6
# States of each machine from which it is told where its limbs mostly are
SAMPLED_STATES: Final = 64

_AXES: Final = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}


def page_payload(artifact: Artifact, decoding: Decoding, title: str, up: str | None = None) -> dict[str, Any]:
    """Everything that the page shows; `up` is the world's upward axis (`y`, `-z`), by default what decoding knew."""
    up = up or decoding.report.get("up")
    skeleton = build_skeleton(artifact)
    every = _thinning(len(decoding.time), len(skeleton.node_segment) + len(artifact.manifest.tokens))
    frames = np.arange(0, len(decoding.time), every)
    angles, _ = drawn_angles(artifact, decoding, frames)
    nodes = _drawn_nodes(node_positions(artifact, skeleton, angles), skeleton, decoding, frames)
    manifest = artifact.manifest
    return {
        "title": title,
        "facts": header_facts(artifact, decoding),
        "model": {"name": manifest.name, "description": manifest.description, "digest": manifest.digest},
        "up": None if up is None else _AXES[up],
        "frames": _frames(decoding, frames, every),
        "statuses": [[status.name, status.doc, status.help] for status in STATUSES],
        "camera": _camera(artifact, skeleton, decoding, nodes, None if up is None else np.array(_AXES[up])),
        "body": _body(skeleton, nodes),
        "tokens": _tokens(artifact, skeleton, decoding, frames),
        "machines": [_machine(artifact, decoding, frames, machine) for machine in range(artifact.n_machine)],
        "events": [_event(event) for event in decoding.events],
        "poses": _poses(artifact, decoding, frames),
    }


def _drawn_nodes(nodes: Floats, skeleton: Skeleton, decoding: Decoding, frames: NDArray[np.int64]) -> Floats:
    """Nodes at the body's size in its own frame; those of several bodies in the world."""
    if decoding.places is not None:
        return nodes_in_world(nodes, skeleton.node_body, decoding.places, frames)
    return nodes * _drawn_scale(decoding.scale[frames])[:, None, None]


def _thinning(n_frame: int, n_point: int) -> int:
    size = n_frame * n_point * 3 * 2 * 4 / 3
    return max(1, math.ceil(size / POSITION_BUDGET))


def drawn_angles(artifact: Artifact, decoding: Decoding, frames: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Joint values to draw, shape (n, n_joint), and the state that each machine is drawn in, shape (n, n_machine).

    An undecided machine is drawn in its most probable candidate, or in the last state that was drawn where none
    is known; the page marks it as undecided by `Decoding.state`, which stays as it was.
    """
    chain = chain_of(artifact.columns)
    angles = np.asarray(decoding.joint_angle[frames], float).copy()
    drawn = np.asarray(decoding.state[frames], np.int64).copy()
    for machine in range(artifact.n_machine):
        tables = artifact.machine(machine)
        probability = decoding.probability[frames, artifact.states(machine)]
        drawn[:, machine] = _filled(drawn[:, machine], probability)
        block = angles[:, tables.joints]
        angles[:, tables.joints] = np.where(np.isnan(block), tables.angle[drawn[:, machine]], block)
    return np.nan_to_num(complete_angles(chain, angles)), drawn


def _filled(state: NDArray[np.int64], probability: NDArray[np.float32]) -> NDArray[np.int64]:
    """States with -1 replaced by the most probable one, else by the last before, else by the first state."""
    if not len(state):
        return state
    likely = np.nan_to_num(probability).max(axis=1) > 0
    best = np.where(likely, np.nan_to_num(probability).argmax(axis=1), -1)
    filled = np.where(state >= 0, state, best)
    known = np.where(filled >= 0, np.arange(len(filled)), -1)
    last = np.maximum.accumulate(known)
    return np.where(last >= 0, filled[np.maximum(last, 0)], 0)


def _drawn_scale(scale: Floats) -> Floats:
    """The scale with gaps filled by the median of what is known."""
    known = scale[np.isfinite(scale)]
    return np.where(np.isfinite(scale), scale, np.median(known) if len(known) else 1.0)


def _frames(decoding: Decoding, frames: NDArray[np.int64], every: int) -> dict[str, Any]:
    rotation = np.asarray(decoding.pose_rotation[frames]).reshape(-1, 9)
    pose = np.concatenate([rotation, decoding.pose_translation[frames]], axis=1)
    if decoding.places is not None:
        pose = no_pose(decoding.places, frames)
    return {
        "count": len(frames),
        "every": every,
        "rate": rate_of(decoding.time),
        "time": pack(decoding.time[frames], "f8"),
        "status": pack(decoding.status[frames], "u1"),
        "pose": pack(pose, "f4"),
        "scale": pack(decoding.scale[frames], "f4"),
        "located": pack_located(decoding.places, frames),
    }


def _body(skeleton: Skeleton, nodes: Floats) -> dict[str, Any]:
    return {
        "nodes": pack_points(nodes),
        "machine": skeleton.node_machine.tolist(),
        "bones": skeleton.bones.tolist(),
        "whisker": [int(w) for w in skeleton.whisker],
        "hulls": skeleton.hulls,
        "owner": skeleton.node_body.tolist(),
    }


def _camera(
    artifact: Artifact, skeleton: Skeleton, decoding: Decoding, nodes: Floats, up: Floats | None
) -> dict[str, Any]:
    if decoding.places is not None:
        shown = filled(nodes)
        return first_camera(shown[0] if len(shown) else shown.reshape(0, 3), shown, skeleton.hull, None, up)
    rest = node_positions(artifact, skeleton, complete_angles(chain_of(artifact.columns), _rest_angles(artifact)))
    known = np.flatnonzero(np.isfinite(decoding.pose_rotation).all(axis=(1, 2)))
    rotation = decoding.pose_rotation[known[0]] if len(known) else None
    size = float(np.nanmedian(decoding.scale)) if np.isfinite(decoding.scale).any() else 1.0
    states = node_positions(artifact, skeleton, complete_angles(chain_of(artifact.columns), _sampled_angles(artifact)))
    return first_camera(rest * size, nodes, skeleton.hull, rotation, up, states.mean(axis=0) * size)


def _sampled_angles(artifact: Artifact) -> Floats:
    """Joint values of states spread evenly over each machine's, shape (n_sample, n_joint); the others' are zero."""
    angles = np.zeros((SAMPLED_STATES, len(artifact.manifest.joints)))
    for tables in artifact.machines():
        angles[:, tables.joints] = tables.angle[np.arange(SAMPLED_STATES) * len(tables.angle) // SAMPLED_STATES]
    return angles


def _rest_angles(artifact: Artifact) -> Floats:
    """Joint values of the first state of every machine; what else is there is zero."""
    angles = np.zeros(len(artifact.manifest.joints))
    for tables in artifact.machines():
        angles[tables.joints] = tables.angle[0]
    return angles


def _tokens(artifact: Artifact, skeleton: Skeleton, decoding: Decoding, frames: NDArray[np.int64]) -> dict[str, Any]:
    names = artifact.manifest.tokens
    machine = artifact.columns["token_machine"].tolist()
    colors = artifact.manifest.token_colors
    return {
        "names": list(names),
        "colors": [colors.get(name) for name in names],
        "node": skeleton.token_node.tolist(),
        "machine": machine,
        "measured": pack_points(np.asarray(decoding.measured[frames], float)),
    }


def _machine(artifact: Artifact, decoding: Decoding, frames: NDArray[np.int64], machine: int) -> dict[str, Any]:
    tables = artifact.machine(machine)
    candidate, probability, possible = _candidates(decoding.probability[frames, artifact.states(machine)])
    graph = layout_graph(artifact, machine) if len(tables.state_names) <= MOST_GRAPH_STATES else None
    return {
        "name": tables.name,
        "color": machine_color(machine),
        "kind": tables.kind,
        "states": list(tables.state_names),
        "colors": list(graph.colors) if graph else [],
        "joints": [artifact.manifest.joints[joint] for joint in tables.joints],
        "state": pack(decoding.state[frames, machine], "i4"),
        "candidate": pack(candidate, "i4"),
        "probability": pack(probability, "u1"),
        "possible": pack(np.minimum(possible, 65535), "u2"),
        "inside": pack(np.minimum(_set_sizes(decoding.probability[frames, artifact.states(machine)]), 65535), "u2"),
        **_why(tables, decoding, frames),
        "graph": None if graph is None else _graph(graph, tables),
    }


def _candidates(probability: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """The most probable states of each frame (-1: no more), their probabilities in 255ths, how many are possible."""
    known = np.nan_to_num(probability)
    order = np.argsort(-known, axis=1, kind="stable")[:, :MOST_CANDIDATES]
    value = np.take_along_axis(known, order, axis=1)
    order = np.where(value >= LEAST_PROBABILITY, order, -1)
    return order, np.round(255 * np.clip(value, 0, 1)), (known >= LEAST_PROBABILITY).sum(axis=1)


def _set_sizes(probability: NDArray[np.float32]) -> NDArray[np.int64]:
    """How many states the 90 % set of every frame has; 0 where nothing is known."""
    ranked = -np.sort(-np.nan_to_num(probability).astype(float), axis=1)
    before = np.cumsum(ranked, axis=1) - ranked
    return np.asarray(((before < SET_MASS - ROUNDING) & (ranked > 0)).sum(axis=1))


def _why(tables: MachineTables, decoding: Decoding, frames: NDArray[np.int64]) -> dict[str, Packed]:
    """The machine's own status in each frame (255: none told), and what its answer rests on."""
    told = [decoding.why[frame].get(tables.name) if frame < len(decoding.why) else None for frame in frames.tolist()]
    nothing = (math.nan,) * len(FIT)
    fit = [nothing if why is None else tuple(getattr(why, name) for name in FIT) for why in told]
    return {
        "status": pack([255 if why is None else STATUS_ID.get(why.status, 255) for why in told], "u1"),
        "fit": pack(np.array(fit, float).reshape(-1, len(FIT)), "f4"),
    }


def _graph(graph: GraphLayout, tables: MachineTables) -> dict[str, Any]:
    few = len(tables.transition_target) <= MOST_TRANSITIONS
    return {
        "kind": graph.kind,
        "caption": graph.caption,
        "size": [graph.width, graph.height],
        "position": np.round(graph.position, 1).tolist(),
        "panel": graph.panel.tolist(),
        "panels": [panel._asdict() for panel in graph.panels],
        "radius": round(graph.radius, 2),
        "labels": list(graph.labels),
        "arcs": graph.arcs.tolist(),
        "texts": [text._asdict() for text in graph.texts],
        "shapes": [shape._asdict() for shape in graph.shapes],
        "successors": _successors(tables) if few else None,
    }


def _successors(tables: MachineTables) -> dict[str, Packed]:
    return {"start": pack(tables.transition_start, "i4"), "target": pack(tables.transition_target, "i4")}


def _event(event: GestureEvent) -> dict[str, Any]:
    """An event with null for what is not known."""
    told = event._asdict().items()
    return {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in told}


def _poses(artifact: Artifact, decoding: Decoding, frames: NDArray[np.int64]) -> list[dict[str, Any]]:
    """Poses that hold in some frame, or may."""
    poses = decoding.poses[frames]
    return [
        {"name": name, "value": pack(poses[:, pose], "u1")}
        for pose, name in enumerate(artifact.manifest.poses)
        if (poses[:, pose] != 0).any()
    ]
