"""What a step says when it can say little: refused frames, unsure states, a limb that fits nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import gesturec
from gesturec.runtime.session import Session
from gesturec.runtime.sight import Sight
from gesturec.runtime.status import STATUSES
from gesturec.runtime.window import WindowDecoder
from gesturec.simulate.simulation import SimulateOptions, simulate


def test_every_step_has_every_machine_whatever_was_refused() -> None:
    session = gesturec.load("hand").session(rate=25)
    fed: list[tuple[Any, Any]] = [
        ({}, 0.0),
        ({"wrist": (0, 0, 0)}, 0.0),
        ({"wrist": (0, 0, 0)}, float("nan")),
        ({"wrist": "abc"}, 1.0),
        ({"wrist": (1, 2)}, 2.0),
        (np.zeros((2, 2)), 3.0),
    ]
    steps = [session.step(points, time) for points, time in fed]
    assert [step.status for step in steps] == ["no-tokens", *["time-refused"] * 2, *["input-refused"] * 3]
    assert all(set(step.states) == set(step.candidates) == set(session.artifact.manifest.machines) for step in steps)
    assert "`wrist` is 'abc'" in steps[3].message
    assert "`wrist` has the shape (2,)" in steps[4].message


def test_a_state_is_told_only_when_it_is_as_sure_as_asked() -> None:
    model = gesturec.load("hand")
    take = simulate(model.artifact, SimulateOptions(("flat", "fist"), noise=0.01, seed=4)).recording
    for decoder in ("nearest", "forward"):
        told = {sure: gesturec.decode(model, take, decoder=decoder, sure=sure, noise=0.01) for sure in (0.0, 0.9)}
        assert (told[0.0].state >= 0).mean() > (told[0.9].state >= 0).mean() > 0
        best = np.stack([told[0.9].probability[:, :32].max(1)])
        assert not ((told[0.9].state[:, 0] >= 0) & (best[0] < 0.9)).any()


def test_one_limb_that_fits_nothing_is_told_as_that() -> None:
    model = gesturec.load("hand")
    take = simulate(model.artifact, SimulateOptions(("flat",), noise=0.001, seed=4)).recording
    thumb = [take.names.index(name) for name in ("thumb.joint", "thumb.ip_centre", "thumb.tip")]
    points = take.points.copy()
    points[:, thumb] += 0.3
    decoding = gesturec.decode(model, replace(take, points=points), noise=0.001)
    assert {STATUSES[status].name for status in decoding.status[10:]} == {"partly-misfit"}
    assert (decoding.state[10:, :4] >= 0).all()


def test_outliers_in_the_first_frames_are_no_verdict_on_the_limb() -> None:
    model = gesturec.load("hand")
    take = simulate(model.artifact, SimulateOptions(("flat", "fist"), noise=0.001, seed=4)).recording
    tips = [take.names.index(f"{finger}.tip") for finger in ("index", "middle", "ring", "little")]
    points = take.points.copy()
    points[:2, tips] += 0.2
    for decoder in ("forward", "viterbi"):
        clean = gesturec.decode(model, take, noise=0.001, decoder=decoder, lag=0.08)
        hit = gesturec.decode(model, replace(take, points=points), noise=0.001, decoder=decoder, lag=0.08)
        np.testing.assert_array_equal(hit.state[:, :4], clean.state[:, :4])
        assert (clean.state[:, :4] >= 0).all()


def test_a_limb_that_never_fits_is_told_so_from_the_third_frame() -> None:
    model = gesturec.load("hand")
    take = simulate(model.artifact, SimulateOptions(("flat",), noise=0.001, seed=4)).recording
    points = take.points.copy()
    points[:, [n for n, name in enumerate(take.names) if name.startswith("index.")]] += 0.3
    decoding = gesturec.decode(model, replace(take, points=points), noise=0.001)
    index = model.artifact.manifest.machines.index("index")
    assert [why["index"].status for why in decoding.why[2:]] == ["misfit"] * (len(decoding.time) - 2)
    assert (decoding.state[2:, index] == -1).all()


def test_a_limb_that_is_hidden_for_long_is_lost_and_found_again() -> None:
    model = gesturec.load("hand")
    take = simulate(model.artifact, SimulateOptions(("flat", "flat"), duration=5, noise=0.001, seed=4)).recording
    points = take.points.copy()
    index = [take.names.index(name) for name in take.names if name.startswith("index.")]
    points[5:110, index] = np.nan
    for decoder in ("forward", "viterbi", "nearest"):
        decoding = gesturec.decode(model, replace(take, points=points), noise=0.001, decoder=decoder)
        words = [why["index"].status for why in decoding.why]
        assert words[6:15] == ["coasting"] * 9
        assert set(words[90:110]) == {"lost"}
        assert (decoding.state[90:110, 0] == -1).all()
        assert set(words[115:]) == {"ok"}


def test_a_start_that_was_told_holds_for_the_first_frame_alone() -> None:
    """What cannot follow what was believed begins anew from any state, not from the pose in which the take began."""
    model = gesturec.load("hand")
    decoder = Session(model.artifact, start="flat", noise=0.001, rate=25)
    take = simulate(model.artifact, SimulateOptions(("fist",), noise=0.001, seed=4)).recording
    decoder.step(take.points[0], 0.0)
    first = next(d for d in decoder._decoders if isinstance(d, WindowDecoder))
    nothing = first.advance(None, Sight(0.0, None, None))
    gone = nothing._replace(aged=nothing.aged._replace(mass=np.zeros_like(nothing.aged.mass)))
    states = first.states(first.advance(gone, Sight(0.04, None, None)), None)
    assert (states > 0).all()
    assert (first.states(nothing, None) > 0).sum() < len(states)


def test_a_limb_that_was_never_seen_is_any_of_its_states() -> None:
    model = gesturec.load("hand")
    take = simulate(model.artifact, SimulateOptions(("flat", "fist"), noise=0.001, seed=4)).recording
    points = take.points.copy()
    points[:, [take.names.index(name) for name in take.names if name.startswith("index.")]] = np.nan
    for decoder in ("forward", "viterbi", "fuzzy", "nearest"):
        decoding = gesturec.decode(model, replace(take, points=points), noise=0.001, decoder=decoder)
        assert {why["index"].status for why in decoding.why} == {"any"}
        assert (decoding.state[:, 0] == -1).all()
