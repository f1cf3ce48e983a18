"""What would part states that merge: a token to see, a point to mark, or levels to give up.

In: the pairs that merge with some tokens hidden. Out: remedies, those that part the most pairs first. Tokens
that the model has but that are hidden (or virtual) are tried as they are; a new one is tried on every part
that the machine moves, beside its origin, and told with the direction that parts most. What a token would tell
is computed as the compiler would: its moments over the two states' cells, with those of what is seen already.
"""

from __future__ import annotations

from collections import Counter
from typing import Final, NamedTuple

import numpy as np

from gesturec.analysis.report import Remedy
from gesturec.analysis.separation import Clouds, Floats, Ints, Pairs, clouds, separations
from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.bake import state_moments
from gesturec.artifact.kinematics import Chain

TRIED: Final = 60  # of the merging pairs, the worst, on which remedies are tried
TOLD: Final = 4
BESIDE: Final = 0.25  # of the body's reach: how far from a part's origin a new marker is tried
LONGEST: Final = 0.03  # m: but no further than this, a marker's stalk


class Case(NamedTuple):
    """One machine as it is seen: what remedies are tried on."""

    artifact: Artifact
    chain: Chain
    tables: MachineTables
    seen: Ints  # of the machine's tokens
    deviation: Floats  # of the seen tokens' noise, m
    noise: float  # of a token that is added, m


class Candidate(NamedTuple):
    """A point that might be seen besides, and how to say so; of those with one key the best is told."""

    key: str | int
    segment: int
    at: Floats
    text: str


def remedies(case: Case, pairs: Pairs, enough: float) -> tuple[Remedy, ...]:
    """What parts the pairs: brings their separation above `enough`."""
    worst = np.argsort(pairs.separation, kind="stable")[:TRIED]
    tried = Pairs(pairs.first[worst], pairs.second[worst], pairs.separation[worst])
    if not len(worst):
        return ()
    best: dict[str | int, Remedy] = {}
    for candidate in _candidates(case):
        remedy, key = _tried(case, candidate, tried, enough), candidate.key
        if remedy.pairs > (best[key].pairs if key in best else 0):
            best[key] = remedy
    found = sorted(best.values(), key=lambda each: -each.pairs)[:TOLD]
    return tuple(found) + _coarser(case, pairs) + _fewer(case, pairs)


def _candidates(case: Case) -> list[Candidate]:
    """Tokens that are not seen, and points beside the parts that the machine moves."""
    names = case.artifact.manifest.tokens
    hidden = [int(token) for row, token in enumerate(case.tables.tokens) if row not in set(case.seen.tolist())]
    chain = case.chain
    known = [
        Candidate(names[t], int(chain.token_segment[t]), chain.token_at[t], f"seeing `{names[t]}`") for t in hidden
    ]
    return known + _beside(case)


def _beside(case: Case) -> list[Candidate]:
    """A point on each moved part along each of its axes, a marker's stalk away."""
    reach = float(np.abs(case.tables.token - case.tables.token.mean(axis=0)).max(initial=0.0))
    stalk = min(BESIDE * reach, LONGEST) or LONGEST
    found = []
    for joint in case.tables.joints.tolist():
        for axis, offset in enumerate(np.eye(3) * stalk):
            name = case.artifact.manifest.joints[joint]
            text = f"a token on the part that `{name}` moves, {1000 * stalk:.0f} mm along its {'xyz'[axis]}"
            found.append(Candidate(joint, joint + 1, offset, text))
    return found


def _tried(case: Case, candidate: Candidate, pairs: Pairs, enough: float) -> Remedy:
    rows, place = np.unique(np.concatenate([pairs.first, pairs.second]), return_inverse=True)
    first, second = np.split(place.reshape(-1), 2)
    apart = separations(_clouds_with(case, candidate, rows), first, second)
    return Remedy("token", candidate.text, int((apart > enough).sum()))


def _clouds_with(case: Case, candidate: Candidate, rows: Ints) -> Clouds:
    """Clouds of some states with one more token."""
    chain, tables = case.chain, case.tables
    longer = chain._replace(
        token_segment=np.append(chain.token_segment, np.int32(candidate.segment)),
        token_at=np.concatenate([chain.token_at, candidate.at[None]]),
    )
    tokens = [*(int(t) for t in tables.tokens[case.seen]), len(chain.token_segment)]
    joints = [int(joint) for joint in tables.joints]
    spread = case.artifact.columns["joint_spread"]
    moments = state_moments(longer, spread, joints, tables.low[rows], tables.high[rows], tokens, tables.parent)
    deviation = np.append(case.deviation, case.noise)
    return clouds(moments.mean, moments.covariance, np.arange(len(tokens)), deviation)


def _coarser(case: Case, pairs: Pairs) -> tuple[Remedy, ...]:
    """Joints that alone tell merging states apart: with coarser levels these pairs would be one state."""
    differ = case.tables.angle[pairs.first] != case.tables.angle[pairs.second]
    free = case.artifact.columns["joint_level_count"][case.tables.joints] > 0
    alone = Counter(np.argmax(differ[(differ & free).sum(axis=1) == 1] & free, axis=1).tolist())
    manifest = case.artifact.manifest
    told = []
    for column, count in alone.most_common(TOLD):
        name = manifest.joints[int(case.tables.joints[column])]
        text = f"coarser levels of `{name}` ({', '.join(manifest.levels[name])}): these pairs differ in it alone"
        told.append(Remedy("coarser", text, count))
    return tuple(told)


def _fewer(case: Case, pairs: Pairs) -> tuple[Remedy, ...]:
    """Samples of a cycle or path that are too near along it: with fewer of them most of these pairs would be one."""
    on = np.isfinite(case.tables.at)
    samples, both = int(on.sum()), on[pairs.first] & on[pairs.second]
    if not both.any():
        return ()
    place = np.cumsum(on) - 1
    apart = np.abs(place[pairs.first] - place[pairs.second])[both]
    if case.tables.kind == "cycle":
        apart = np.minimum(apart, samples - apart)
    most = int(np.sort(apart)[(len(apart) - 1) // 2])  # half of them are no further apart than this
    fewer = samples // (most + 1)
    if fewer < 2:
        return ()
    what = "1 sample" if most == 1 else f"{most} samples"
    text = f"`samples: {fewer}` in place of {samples}: these pairs are at most {what} apart"
    return (Remedy("coarser", text, int((apart <= most).sum())),)
