"""What the page's header says of a take: counts and shares as text, each with a sentence that explains it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact
    from gesturec.runtime.step import Decoding

Fact = tuple[str, str]

_MOST_NAMES = 12  # tokens that a hint lists


def rate_of(time: NDArray[np.float64]) -> float | None:
    """Frames a second: the inverse of the median of what rises between them; None where nothing does."""
    dt = np.diff(time)
    rising = dt[np.isfinite(dt) & (dt > 0)]
    return float(1 / np.median(rising)) if len(rising) else None


def header_facts(artifact: Artifact, decoding: Decoding) -> list[Fact]:
    """The header's line, piece by piece."""
    return [
        (f"model {artifact.manifest.name}", _model_hint(artifact)),
        (_frames_text(decoding), "frames of the take, and their median rate"),
        *_share_facts(decoding),
        *_hidden_facts(artifact, decoding),
        *_scale_facts(artifact, decoding),
        *_event_facts(decoding),
    ]


def _model_hint(artifact: Artifact) -> str:
    machines = artifact.machines()
    sizes = ", ".join(f"{tables.name} {len(tables.state_names):,}" for tables in machines)
    return f"states: {sizes}" if machines else "a rigid body: no machines"


def _frames_text(decoding: Decoding) -> str:
    rate = rate_of(decoding.time)
    count = len(decoding.time)
    return f"{count:,} frame{'s' * (count != 1)}" + (f" @ {rate:.4g} Hz" if rate else "")


def _share_facts(decoding: Decoding) -> list[Fact]:
    """Shares of frames and machines that are decided, were decided late, are a misfit."""
    facts = []
    if decoding.state.size:
        decided = decoding.state >= 0
        facts.append((f"{_percent(decided.mean())} decided", "share of machines and frames with one state"))
        late = decided & (decoding.decided_frame > np.arange(len(decoding.state))[:, None])
        if late.any():
            facts.append(
                (f"{_percent(late.mean())} settled by later frames", "share of machines and frames, of the decided")
            )
    told = [why.status for frame in decoding.why for why in frame.values()]
    misfit = told.count("misfit") / len(told) if told else 0.0
    if misfit > 0:
        facts.append((f"{_percent(misfit)} misfit", "share of machines and frames whose tokens fit no state"))
    told_of = decoding.pose_translation if decoding.places is None else decoding.places.translation
    located = np.isfinite(told_of).all(axis=-1)
    unknown = 1.0 - float(located.mean()) if len(decoding.time) else 0.0
    if unknown > 0:
        facts.append((f"{_percent(unknown)} without a pose", "share of frames in which the body's place is not known"))
    return facts


def _hidden_facts(artifact: Artifact, decoding: Decoding) -> list[Fact]:
    """How much of the tokens that were ever seen is hidden."""
    share = seen_share(decoding)
    used = np.flatnonzero(share > 0)
    if not len(used):
        return []
    gaps = [artifact.manifest.tokens[token] for token in used if share[token] < 1]
    more = " …" if len(gaps) > _MOST_NAMES else ""
    hint = f"hidden at times: {', '.join(gaps[:_MOST_NAMES])}{more}" if gaps else "every token is seen in every frame"
    return [(f"{len(used)} tokens, {_percent(1 - share[used].mean())} hidden", hint)]


def seen_share(decoding: Decoding) -> NDArray[np.float64]:
    """In which share of the frames each token is seen, shape (n_token,)."""
    seen = np.asarray(np.isfinite(decoding.measured).all(axis=-1), float)
    return np.asarray(seen.mean(axis=0)) if len(seen) else np.zeros(seen.shape[1])


def _scales_fact(artifact: Artifact, scale: NDArray[np.float64]) -> list[Fact]:
    """The last size known of each of several bodies."""
    last = {body["name"]: each[np.isfinite(each)] for body, each in zip(artifact.manifest.bodies, scale.T, strict=True)}
    told = [f"{name} {known[-1]:.3f}" for name, known in last.items() if len(known)]
    return [(f"scale {', '.join(told)}", "size of each body over its model's")] if told else []


def _scale_facts(artifact: Artifact, decoding: Decoding) -> list[Fact]:
    if decoding.places is not None:
        return _scales_fact(artifact, decoding.places.scale)
    known = decoding.scale[np.isfinite(decoding.scale)]
    return [(f"scale {known[-1]:.3f}", "size of the body over the model's")] if len(known) else []


def _event_facts(decoding: Decoding) -> list[Fact]:
    count = len(decoding.events)
    names = ", ".join(sorted({event.name for event in decoding.events}))
    return [(f"{count} gesture{'s' * (count != 1)}", names)] if count else []


def _percent(share: float) -> str:
    """A share in per cent; never 0 % or 100 % of what is neither."""
    percent = 100 * float(share)
    if 0 < percent < 0.1:
        return "< 0.1 %"
    if 99.9 < percent < 100:
        return "> 99.9 %"
    return f"{percent:.3g} %"
