"""The paper's hand as an artifact, laid out by hand from `paper-hand.md`: the runtime's tests need no compiler.

Every finger: abduction, mcp, pip, dip (follows pip), tokens pip_centre, dip_centre, tip. Thumb: abduction,
cmc, mcp, ip, tokens joint, ip_centre, tip. Root: the palm's tokens. `side=-1` mirrors it at z = 0.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.columns import COLUMNS
from gesturec.artifact.kinematics import chain_of, complete_angles, positions_in
from gesturec.artifact.manifest import Manifest
from gesturec.artifact.programs import OPS

MM, DEG = 1e-3, np.pi / 180
FLEX, SPREAD = (0, 30, 60, 90), (0, 45)
ROOT = {
    "wrist": (0, 0, 0),
    "wrist_radial": (0, 0, 24),
    "wrist_ulnar": (0, 0, -24),
    "index_base": (88, 0, 26),
    "middle_base": (90, 0, 4),
    "ring_base": (84, 0, -16),
    "little_base": (76, 0, -34),
    "thumb_base": (22, 6, 24),
    "palm_centre": (70, 0, 2),
}
FINGERS = {
    "index": ((88, 0, 26), (39.8, 22.4, 19.6), -1),
    "middle": ((90, 0, 4), (44.6, 26.3, 21.4), -1),
    "ring": ((84, 0, -16), (41.4, 25.7, 21.3), 1),
    "little": ((76, 0, -34), (32.7, 18.1, 19.7), 1),
}
THUMB_REST = (
    (0.7404878902641793, 0.37205234600975645, -0.5596916438546685),
    (0.3420201433256687, 0.5082677358688384, 0.7903708814438026),
    (0.5785325452656868, -0.776685882775914, 0.24911670671595912),
)
PAPER = ("index.tip", "middle.tip", "ring.tip", "little.tip", "thumb.tip", "thumb.joint",
         "wrist_radial", "wrist_ulnar", "index_base", "little_base")  # fmt: skip
MEDIAPIPE_ROOT = ("wrist", "thumb_base", "index_base", "middle_base", "ring_base", "little_base")
LEAP = {"palm_centre": "palm", "thumb_base": "thumb_mcp", "thumb.joint": "thumb_pip", "thumb.ip_centre": "thumb_dip",
        "thumb.tip": "thumb_tip"} | {ours: theirs for a, b in
        (("index", "index"), ("middle", "middle"), ("ring", "ring"), ("little", "pinky"))
        for ours, theirs in ((f"{a}_base", f"{b}_mcp"), (f"{a}.pip_centre", f"{b}_pip"),
                             (f"{a}.dip_centre", f"{b}_dip"), (f"{a}.tip", f"{b}_tip"))}  # fmt: skip
Z = (0, 0, 1)


def _chain(side: int):
    """Joints (name, parent name, at, rest, axis, levels or followed joint) and tokens (name, segment, at)."""
    joints, tokens = [], [(name, None, at) for name, at in ROOT.items()]
    eye = np.eye(3)
    for name, (base, (a, b, c), turn) in FINGERS.items():
        j = [f"{name}.{x}" for x in ("abduction", "mcp", "pip", "dip")]
        joints += [(j[0], None, base, eye, (0, turn, 0), SPREAD), (j[1], j[0], (0, 0, 0), eye, Z, FLEX),
                   (j[2], j[1], (a, 0, 0), eye, Z, FLEX), (j[3], j[2], (b, 0, 0), eye, Z, j[2])]  # fmt: skip
        tokens += [(f"{name}.pip_centre", j[2], (0, 0, 0)), (f"{name}.dip_centre", j[3], (0, 0, 0)), (f"{name}.tip", j[3], (c, 0, 0))]
    t = [f"thumb.{x}" for x in ("abduction", "cmc", "mcp", "ip")]
    joints += [(t[0], None, (22, 6, 24), np.array(THUMB_REST), (0, -1, 0), SPREAD), (t[1], t[0], (0, 0, 0), eye, Z, FLEX),
               (t[2], t[1], (46.2, 0, 0), eye, Z, FLEX), (t[3], t[2], (31.6, 0, 0), eye, Z, FLEX)]  # fmt: skip
    tokens += [("thumb.joint", t[1], (46.2, 0, 0)), ("thumb.ip_centre", t[3], (0, 0, 0)), ("thumb.tip", t[3], (25.4, 0, 0))]
    m = np.diag([1, 1, side])
    joints = [(n, p, m @ np.array(at), m @ rest @ m, side * m @ np.array(axis, float), levels) for n, p, at, rest, axis, levels in joints]
    return joints, [(n, s, m @ np.array(at)) for n, s, at in tokens]


def hand_artifact(side: int = 1) -> Artifact:
    """The hand; fingers of 32 states, the thumb of 128; adjacent steps of 40 ms; moments over cells."""
    joints, tokens = _chain(side)
    names = [j[0] for j in joints]
    machines = [*FINGERS, "thumb"]
    machine_joints = [[i for i, n in enumerate(names) if n.startswith(m + ".")] for m in machines]
    machine_tokens = [[i for i, (n, _, _) in enumerate(tokens) if n.startswith(m + ".")] for m in machines]
    free = [not isinstance(j[5], str) for j in joints]
    low_of = {0: (0, 15, 45, 75), 1: (0, 22.5)}
    high_of = {0: (15, 45, 75, 90), 1: (22.5, 45)}
    columns = {c.name: np.zeros([0 for _ in c.shape] if "3" not in c.shape else [3 if s == "3" else 0 for s in c.shape], c.dtype)
               for c in COLUMNS}
    levels = [[(v * DEG, low_of[len(j[5]) == 2][i] * DEG, high_of[len(j[5]) == 2][i] * DEG) for i, v in enumerate(j[5])]
              if f else [] for j, f in zip(joints, free, strict=True)]  # fmt: skip
    flat = [x for each in levels for x in each]
    code = [op.name for op in OPS].index("joint")
    coupled = [i for i, f in enumerate(free) if not f]
    columns |= dict(
        limb_parent=np.zeros(5), limb_machine=np.arange(5),
        segment_limb=np.array([-1, *[next(m for m, js in enumerate(machine_joints) if i in js) for i in range(len(joints))]]),
        joint_parent=np.array([0 if j[1] is None else names.index(j[1]) + 1 for j in joints]),
        joint_type=np.zeros(len(joints)), joint_source=np.array([0 if f else 1 for f in free]),
        joint_at=np.array([j[2] for j in joints]) * MM, joint_rest=np.array([j[3] for j in joints]),
        joint_axis=np.array([j[4] for j in joints]), joint_value=np.zeros(len(joints)),
        joint_program=np.array([-1 if f else coupled.index(i) for i, f in enumerate(free)]),
        joint_low=np.array([0.0 if f else -np.inf for f in free]),
        joint_high=np.array([max(j[5]) * DEG if f else np.inf for j, f in zip(joints, free, strict=True)]),
        joint_wrap=np.zeros(len(joints)), joint_spread=np.zeros(len(joints)),
        joint_max_speed=np.full(len(joints), np.inf), joint_radius=np.zeros(len(joints)),
        joint_level_start=np.cumsum([0, *map(len, levels)])[:-1], joint_level_count=np.array([len(each) for each in levels]),
        level_value=np.array([x[0] for x in flat]), level_low=np.array([x[1] for x in flat]), level_high=np.array([x[2] for x in flat]),
        token_segment=np.array([0 if s is None else names.index(s) + 1 for _, s, _ in tokens]),
        token_machine=np.array([-1 if s is None else machines.index(s.split(".")[0]) for _, s, _ in tokens]),
        token_at=np.array([at for _, _, at in tokens]) * MM, token_noise=np.full(len(tokens), np.nan),
        token_virtual=np.zeros(len(tokens)),
        program_start=np.arange(len(coupled)), program_count=np.ones(len(coupled)),
        op_code=np.full(len(coupled), code), op_argument=np.array([names.index(joints[i][5]) for i in coupled]),
        op_value=np.zeros(len(coupled)),
    )  # fmt: skip
    dtypes = {c.name: c.dtype for c in COLUMNS}
    columns = {k: np.asarray(v).astype(dtypes[k]) for k, v in columns.items()}
    columns |= _machine_columns(columns, joints, machine_joints, machine_tokens, levels, dtypes)
    for values in columns.values():
        values.setflags(write=False)
    counts = columns["machine_state_count"]
    state_names = {m: _state_names(joints, machine_joints[i]) for i, m in enumerate(machines)}
    assert all(len(state_names[m]) == n for m, n in zip(machines, counts, strict=True))
    manifest = Manifest(
        name="hand", joints=tuple(names), tokens=tuple(n for n, _, _ in tokens), limbs=tuple(machines), machines=tuple(machines),
        states=state_names, units={"length": "mm", "angle": "deg"}, root="palm",
        bindings=({"name": "paper", "tokens": {n: {n: 1.0} for n in PAPER}, "order": (), "up": None},
                  {"name": "leap", "tokens": {k: {v: 1.0} for k, v in LEAP.items()}, "order": (), "up": "y"}),
    )  # fmt: skip
    return Artifact(manifest, columns)


def _state_names(joints, machine) -> tuple[str, ...]:
    free = [joints[j][5] for j in machine if not isinstance(joints[j][5], str)]
    return tuple("/".join(map(str, combo)) for combo in product(*free))


def _machine_columns(columns, joints, machine_joints, machine_tokens, levels, dtypes):
    chain = chain_of(columns)
    blocks = {k: [] for k in ("state_angle", "state_low", "state_high", "state_token", "state_mean", "state_covariance",
                              "transition_target", "transition_start")}  # fmt: skip
    counts, arcs = [], 0
    node, weight = np.polynomial.legendre.leggauss(3)
    for own, seen in zip(machine_joints, machine_tokens, strict=True):
        free = [j for j in own if levels[j]]
        combos = list(product(*[range(len(levels[j])) for j in free]))
        counts.append(len(combos))
        edges = np.array([[levels[j][i] for j, i in zip(free, c, strict=True)] for c in combos])  # state, joint, 3
        whole = np.zeros((len(combos), 3, chain.n_joint))
        whole[:, :, free] = np.swapaxes(edges, 1, 2)
        whole = complete_angles(chain, whole)
        mid = positions_in(chain, whole[:, 0], 0)[:, seen]
        nodes = np.array(list(product(range(3), repeat=len(free))))
        mass = np.prod(weight[nodes] / 2, axis=1)
        inside = np.zeros((len(combos), len(nodes), chain.n_joint))
        inside[:, :, free] = edges[:, None, :, 1] + (edges[:, None, :, 2] - edges[:, None, :, 1]) * (node[nodes] + 1) / 2
        cloud = positions_in(chain, complete_angles(chain, inside), 0)[:, :, seen].reshape(len(combos), len(nodes), -1)
        mean = np.einsum("q,sqi->si", mass, cloud)
        spread = cloud - mean[:, None]
        blocks["state_covariance"].append(np.einsum("q,sqi,sqj->sij", mass, spread, spread).ravel())
        blocks["state_mean"].append(mean.ravel())
        blocks["state_token"].append(mid.ravel())
        for k, column in enumerate(("state_angle", "state_low", "state_high")):
            blocks[column].append(whole[:, k][:, own].ravel())
        index = np.array(combos)
        near = (np.abs(index[:, None] - index).max(-1)) <= 1
        blocks["transition_target"].append(np.concatenate([np.flatnonzero(row) for row in near]))
        blocks["transition_start"].append(arcs + np.cumsum([0, *near.sum(1)])[:-1])
        arcs += int(near.sum())
    starts = {k: np.cumsum([0, *[len(b) for b in blocks[k]]])[:-1] for k in ("state_angle", "state_token", "state_covariance")}
    n_state = sum(counts)
    raw = {k: np.concatenate(v) for k, v in blocks.items()} | dict(
        machine_kind=np.zeros(5), machine_step=np.zeros(5), machine_tick=np.full(5, 0.04), machine_parent=np.zeros(5),
        machine_shortest=np.full(5, np.nan), machine_longest=np.full(5, np.nan),
        machine_joint_start=np.cumsum([0, *map(len, machine_joints)])[:-1], machine_joint_count=np.array([*map(len, machine_joints)]),
        machine_joint=np.concatenate(machine_joints),
        machine_token_start=np.cumsum([0, *map(len, machine_tokens)])[:-1], machine_token_count=np.array([*map(len, machine_tokens)]),
        machine_token=np.concatenate(machine_tokens),
        machine_state_start=np.cumsum([0, *counts])[:-1], machine_state_count=np.array(counts),
        machine_angle_start=starts["state_angle"], machine_position_start=starts["state_token"],
        machine_covariance_start=starts["state_covariance"], state_cost=np.zeros(n_state), state_at=np.full(n_state, np.nan),
        transition_cost=np.zeros(arcs), pose_state=np.zeros((0, n_state)),
    )  # fmt: skip
    raw["transition_start"] = np.append(raw["transition_start"], arcs)
    return {k: np.asarray(v).astype(dtypes[k]) for k, v in raw.items()}
