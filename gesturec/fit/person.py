"""From recordings of one person to a profile: the table of contents of the fit.

`fit_profile`: frames are chosen → a first guess of size, poses and angles → bundle adjustment of the person's places,
rests and size → the same fit to some of the frames is tried on the others (`held_out`), and where it does no better
there than the model, the size alone is kept → what was really told by the frames is kept → noise from the residuals
→ the takes are decoded with the new body, and how its limbs hold and move is counted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.fit.adjust import HUBER, Adjusted, Guess, Joints, Measured, adjust, free_joints
from gesturec.fit.frames import MAX_FRAMES, Frames, choose_frames, first_guess, seen_tokens
from gesturec.fit.motion import StatePath, motions
from gesturec.fit.parameters import Layout, chain_at, lay_out, right_jacobian, size_alone
from gesturec.profile.apply import with_profile
from gesturec.profile.profile import HeldOut, Part, Profile, Take, Vector
from gesturec.recordings.recording import Recording
from gesturec.runtime.decode import decode

Array = NDArray[np.float64]

TOLD: Final = 0.7  # of the prior's deviation: an estimate that is not sharper was not told by the recordings
MOTION_FRAMES: Final = 10_000  # that are decoded to see how limbs move: minutes of film, and a minute or two of work
BLOCKS: Final = 8  # of each take, every other one held out: neighbouring frames are too alike to test each other
FEWEST_FRAMES: Final = 10  # below, angles and lengths cannot be told apart


class FitError(ValueError):
    """The recordings do not determine a body; the message says why."""


class Fit(NamedTuple):
    """A profile, and what it rests on."""

    profile: Profile
    layout: Layout
    joints: Joints
    frames: Frames
    adjusted: Adjusted


def fit_profile(
    artifact: Artifact,
    recordings: Sequence[Recording],
    bind: object = None,
    parameters: Mapping[str, str] | None = None,
    with_costs: bool = False,
    most_frames: int = MAX_FRAMES,
    advance: Callable[[], None] = lambda: None,
) -> Fit:
    """Fit a person's profile.

    Parameters
    ----------
    artifact
        The compiled model.
    recordings
        Takes of one person.
    bind
        A binding's name or mapping; None: the one that fits each recording's names.
    parameters
        What the model was compiled with, which the profile repeats.
    with_costs
        Whether costs of transitions are given for grids too.
    most_frames
        Frames that are adjusted together.
    advance
        Called after the adjustment and after each recording's decoding.

    Raises
    ------
    FitError, ValueError
        Too little is seen; names that fit no binding.
    """
    frames = choose_frames(artifact, recordings, bind, most_frames)
    if len(frames.measured) < FEWEST_FRAMES:
        count = len(frames.measured)
        raise FitError(f"{count} frames show three root tokens off a line; a fit needs {FEWEST_FRAMES} or more")
    seen = seen_tokens(frames.measured)
    layout = lay_out(artifact, np.asarray(seen.any(axis=0)))
    columns = artifact.columns
    joints = free_joints(layout, columns["joint_low"], columns["joint_high"], len(frames.measured))
    guess = first_guess(artifact, frames.measured)
    held = held_out(layout, joints, frames, guess)
    if held is not None and not held.is_better:
        layout = size_alone(layout)
    adjusted = adjust(layout, joints, Measured(frames.measured, frames.whitener), guess)
    advance()
    profile = replace(profile_of(artifact, recordings, frames, layout, adjusted), held_out=held)
    person = with_profile(artifact, profile)
    paths = []
    for recording in recordings:
        decoding = decode(person, beginning(recording, MOTION_FRAMES // len(recordings)), bind=bind)
        paths.append(StatePath(decoding.time, decoding.state))
        advance()
    motion = motions(artifact, paths, with_costs)
    profile = replace(profile, parameters=dict(parameters or {}), motion=motion)
    return Fit(profile, layout, joints, frames, adjusted)


def held_out(layout: Layout, joints: Joints, frames: Frames, guess: Guess) -> HeldOut | None:
    """How a fit to every other block of the takes does on the blocks between; None where they are too short."""
    order = np.concatenate([np.arange(n) * BLOCKS // max(n, 1) for n in np.bincount(frames.take)])
    test = order % 2 == 1
    if min(test.sum(), (~test).sum()) < FEWEST_FRAMES:
        return None
    trained = adjust(layout, joints, frames.part(~test), guess.part(~test))
    seen = 3 * int(seen_tokens(frames.measured[test]).sum())
    left = []
    for parameters in (np.zeros(layout.size), trained.parameters):
        body = size_alone(layout._replace(chain=chain_at(layout, parameters)))  # free in size, as while decoding
        size = guess.size / np.exp(parameters[0])
        found = adjust(body, joints, frames.part(test), guess.part(test)._replace(size=size), trained.noise)
        left.append(trained.noise * float(np.sqrt((found.cost - wild_cost(found)) / seen)))
    return HeldOut(*left)


def wild_cost(found: Adjusted) -> float:
    """What points cost beyond `HUBER` deviations: no body explains an outlier, so none is judged by how far it is."""
    cost = found.weight * np.square(found.residual).sum(axis=-1) / found.noise**2
    return float(np.maximum(cost - 3 * HUBER**2, 0).sum())


def beginning(recording: Recording, frames: int) -> Recording:
    """The first frames of a recording."""
    covariance = None if recording.covariance is None else recording.covariance[:frames]
    first = recording.time[:frames], recording.points[:frames]
    return Recording(recording.name, first[0], recording.names, first[1], recording.up, recording.rate, covariance)


def profile_of(
    artifact: Artifact, recordings: Sequence[Recording], frames: Frames, layout: Layout, adjusted: Adjusted
) -> Profile:
    """What the adjustment found, by name."""
    manifest = artifact.manifest
    joints, tokens = _places(artifact, layout, adjusted)
    for joint, turn, error in _turns(layout, adjusted):
        name = manifest.joints[joint]
        part = joints.get(name, Part())
        joints[name] = Part(part.at, part.at_error, turn, error)
    seen = seen_tokens(frames.measured)
    spread = token_noise(adjusted, seen)
    measured = np.flatnonzero(seen.any(axis=0))
    return Profile(
        model=manifest.name,
        digest=manifest.digest,
        name=", ".join(Path(recording.name).stem for recording in recordings),
        scale=float(np.exp(adjusted.parameters[0])),
        scale_error=float(np.exp(adjusted.parameters[0]) * np.sqrt(adjusted.covariance[0, 0])),
        joints={name: joints[name] for name in manifest.joints if name in joints},
        tokens=tokens,
        noise=None if frames.has_covariance else adjusted.noise,
        token_noise={manifest.tokens[token]: float(spread[token]) for token in measured if not frames.has_covariance},
        takes=tuple(_take(recordings, frames, adjusted, number) for number in range(len(recordings))),
    )


def _places(artifact: Artifact, layout: Layout, adjusted: Adjusted) -> tuple[dict[str, Part], dict[str, Part]]:
    """Joints and tokens whose place the frames have told."""
    joints: dict[str, Part] = {}
    tokens: dict[str, Part] = {}
    size = float(np.exp(adjusted.parameters[0]))
    for item, place in enumerate(layout.places):
        own = layout.part(adjusted.parameters, item)
        at = size * place.moved(own)
        jacobian = np.zeros((3, layout.size))
        jacobian[:, 0] = at
        jacobian[:, layout.starts[item] : layout.starts[item + 1]] = size * place.derivative(own)
        error = np.sqrt(np.einsum("ip,pq,iq->i", jacobian, adjusted.covariance, jacobian))
        believed = np.sqrt(((jacobian * layout.deviation) ** 2).sum(axis=1))
        if np.linalg.norm(error) > TOLD * np.linalg.norm(believed):
            continue
        part = Part(_vector(at), _vector(error))
        joints |= {artifact.manifest.joints[joint]: part for joint in place.joints}
        tokens |= {artifact.manifest.tokens[token]: part for token in place.tokens}
    return joints, tokens


def _turns(layout: Layout, adjusted: Adjusted) -> list[tuple[int, Vector, Vector]]:
    """Joints, turns and errors that the frames have told."""
    found = []
    for item, turn in enumerate(layout.turns, start=len(layout.places)):
        columns = slice(layout.starts[item], layout.starts[item + 1])
        part, covariance = adjusted.parameters[columns], adjusted.covariance[columns, columns]
        if np.sqrt(np.diag(covariance)).min() > TOLD * turn.deviation:
            continue
        spread = right_jacobian(turn.axes @ part) @ turn.axes
        error = np.sqrt(np.einsum("ip,pq,iq->i", spread, covariance, spread))
        found.append((turn.joint, _vector(turn.axes @ part), _vector(error)))
    return found


def token_noise(adjusted: Adjusted, seen: NDArray[np.bool_]) -> Array:
    """Standard deviation of a coordinate of every token (n_token,), m; NaN where it was never seen."""
    weight = np.where(seen, adjusted.weight, 0.0)
    square = (weight[..., None] * adjusted.residual**2).sum(axis=(0, -1))
    total = 3 * weight.sum(axis=0)
    # the degrees of freedom that poses, angles and lengths have taken, shared alike
    share = adjusted.noise**2 * total.sum() / max(float(square.sum()), 1e-30)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.sqrt(square * share / total)
    return np.asarray(np.where(total > 0, np.maximum(own, adjusted.noise / 2), np.nan))


def _take(recordings: Sequence[Recording], frames: Frames, adjusted: Adjusted, number: int) -> Take:
    recording, own = recordings[number], frames.take == number
    residual = adjusted.residual[own][seen_tokens(frames.measured[own])]
    deviation = float(np.sqrt(np.square(residual).mean())) if residual.size else 0.0
    name, used = Path(recording.name).name, int(own.sum())
    return Take(name, len(recording.time), frames.usable[number], used, deviation or None)


def _vector(array: Array) -> Vector:
    x, y, z = array.tolist()
    return (x, y, z)
