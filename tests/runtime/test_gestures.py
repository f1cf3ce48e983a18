"""Gestures by hand: every sentence of the language page's section about them, over truths that are given."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.cli.main import main
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source
from gesturec.modeltests.run import run_tests
from gesturec.runtime.decode import decode
from gesturec.runtime.gestures import automaton, matching
from gesturec.runtime.gestures.run import GestureRun
from gesturec.runtime.gestures.truths import Degree
from gesturec.runtime.session import Session
from gesturec.simulate.simulation import SimulateOptions, simulate

BODY = """gesturec: 1
name: body
units: {length: mm, angle: deg}
root: {name: palm, tokens: {a: [0, 0, 0], b: [90, 0, 20], c: [75, 0, -35], d: [20, 8, 30]}}
limbs:
  finger:
    chain:
      - {joint: mcp, at: [90, 0, 20], axis: z, levels: [0, 30, 60, 90]}
      - {token: tip, at: [40, 0, 0]}
poses: {p: finger.mcp == 0, q: finger.mcp == 30, r: finger.mcp == 60, s: finger.mcp == 90}
gestures:
  g: PATTERN
"""
SIGNS = {"1": 1, "0": 0, "?": 2}
Event = tuple[float, float | None, float]


def found(pattern: str, dt: float = 0.1, **truths: str) -> list[Event]:
    """Start, end and decision of every event of a pattern over poses; `p="0011?"` is a frame a sign, missing ones 0."""
    gesture = compile_artifact(Source("body.yaml", BODY.replace("PATTERN", pattern))).manifest.gestures[0]
    run = GestureRun(gesture)
    n_frame = max(map(len, truths.values()))
    rows = [truths.get(truth["pose"], "0" * n_frame) for truth in gesture["truths"]]
    events: list[Any] = []
    for frame in range(n_frame):
        time = round(frame * dt, 6)
        seen = run.take([Degree(SIGNS[row[frame]], 0.9) for row in rows], time, time)
        events.extend(seen.events)
        for ended in seen.ended:
            events[events.index(ended._replace(end=None))] = ended
    return [(round(e.start, 6), None if e.end is None else round(e.end, 6), round(e.decided, 6)) for e in events]


def test_a_pose_is_met_when_its_episode_begins_and_lasts_as_long() -> None:
    assert found("p", p="0011100") == [(0.2, 0.4, 0.2)]
    assert found("p", p="1100") == [(0.0, 0.1, 0.0)]
    assert found("p", p="0011") == [(0.2, None, 0.2)]
    assert found("enter(p)", p="0011100") == [(0.2, 0.2, 0.2)]
    assert found("leave(p)", p="0011100") == [(0.5, 0.5, 0.5)]


def test_a_held_pose_fires_once_when_it_has_held() -> None:
    assert found("p for 0.3 s", p="0111111111100") == [(0.1, 1.0, 0.4)]
    assert found("p for 0.3 s", p="01110") == []
    assert found("p for 0.3 s ..", p="01111100") == [(0.1, 0.5, 0.6)]
    assert found("p for 0.2 s .. 0.3 s", p="011101111101100") == [(0.1, 0.3, 0.4)]


def test_what_a_pattern_does_not_name_is_passed_over() -> None:
    assert found("p -> q", p="1100000", q="0000011", r="0011000") == [(0.1, 0.5, 0.5)]


def test_one_two_three_is_not_met_by_one_three_two_three() -> None:
    times = {"p": "10000000", "r": "00100010", "q": "00001000"}
    assert found("p -> q -> r", **times) == []
    assert found("p ->> q -> r", **times) == [(0.0, 0.6, 0.6)]


def test_a_hand_may_rest_open_for_an_hour() -> None:
    assert found("p -> q within 0.3 s", p="1" * 600 + "000", q="0" * 602 + "1") == [(59.9, 60.2, 60.2)]
    assert found("p -> q within 0.2 s", p="1" * 600 + "000", q="0" * 602 + "1") == []
    assert found("enter(p) -> q within 0.3 s", p="1" * 600 + "000", q="0" * 602 + "1") == []


def test_unknown_begins_nothing_and_ends_an_episode_only_after_patience() -> None:
    assert found("p", p="0?110") == [(0.2, 0.3, 0.2)]
    assert found("p", p="11???110") == [(0.0, 0.6, 0.0)]
    assert found("p", p="11????110") == [(0.0, 0.1, 0.0), (0.6, 0.7, 0.6)]
    assert found("p -> q", p="11???00", q="0000001") == [(0.1, 0.6, 0.6)]
    assert found("p -> q", p="11?????", q="0000001") == []
    assert found("{pattern: p -> q, patience: 1 s}", p="11?????", q="0000001") == [(0.1, 0.6, 0.6)]


def test_for_counts_from_the_step_before_where_that_is_later() -> None:
    assert found("p -> q for 0.3 s", p="0010000000", q="1111111111") == [(0.2, 0.5, 0.5)]
    assert found("p -> q for 0.3 s", p="0010000000", q="0000011111") == [(0.2, 0.8, 0.8)]


def test_steps_of_one_frame_happened_in_the_order_that_is_asked() -> None:
    assert found("p -> q -> r", p="0100", q="0010", r="0010") == [(0.1, 0.2, 0.2)]
    assert found("p -> q -> r", p="0100", q="0100", r="0100") == [(0.1, 0.1, 0.1)]
    assert found("r -> q -> p", p="0100", q="0100", r="0100") == [(0.1, 0.1, 0.1)]


def test_counts_are_joined_by_arrows_and_met_as_soon_as_can_be() -> None:
    assert found("(p -> q){2}", p="1010000", q="0101000") == [(0.0, 0.3, 0.3)]
    assert found("(p -> q){2..}", p="10101010", q="01010101") == [(0.0, 0.3, 0.3), (0.4, 0.7, 0.7)]
    assert found("p -> q{2..3} -> r", p="100000000", q="010101000", r="000000001") == [(0.0, 0.8, 0.8)]
    assert found("p -> q{2} -> r", p="100000000", q="010101000", r="000000001") == []
    assert found("p -> q? -> r", p="1000", q="0000", r="0001") == [(0.0, 0.3, 0.3)]


def test_the_last_step_may_begin_the_next_match() -> None:
    assert found("enter(p) -> enter(p)", p="10100100") == [(0.0, 0.2, 0.2), (0.2, 0.5, 0.5)]
    assert found("p -> q", p="10000", q="01010") == [(0.0, 0.1, 0.1)]


def test_it_fires_with_the_latest_start() -> None:
    assert found("p ->> q", p="1010100", q="0000001") == [(0.4, 0.6, 0.6)]


def test_choices_negations_and_conjunctions() -> None:
    assert found("p -> enter(q) | enter(r)", p="1000", r="0010") == [(0.0, 0.2, 0.2)]
    gesture = compile_artifact(Source("b.yaml", BODY.replace("PATTERN", "p & not q"))).manifest.gestures[0]
    assert [truth.get("program") is not None for truth in gesture["truths"]] == [True]


def test_after_a_cooldown_it_is_found_again() -> None:
    assert found("p", p="101001") == [(0.0, 0.0, 0.0), (0.2, 0.2, 0.2), (0.5, None, 0.5)]
    assert found("{pattern: p, cooldown: 0.3 s}", p="101001") == [(0.0, 0.0, 0.0), (0.5, None, 0.5)]
    assert found("{pattern: p, cooldown: 0.3 s}", p="1111101") == [(0.0, 0.4, 0.0)]


def test_a_within_inside_a_pattern_bounds_its_own_steps() -> None:
    times = {"p": "10000000", "q": "00010000", "r": "00000001"}
    assert found("(p -> q within 0.3 s) -> r", **times) == [(0.0, 0.7, 0.7)]
    assert found("(p -> q within 0.2 s) -> r", **times) == []


def test_a_pattern_that_is_too_large_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    artifact = compile_artifact(Source("body.yaml", BODY.replace("PATTERN", "(p -> q){30}")))
    Session(artifact)
    monkeypatch.setattr(automaton, "MOST_STEPS", 50)
    with pytest.raises(ValueError, match=r"the gesture `g` has more than 50 steps"):
        Session(artifact)


def test_a_limit_on_what_is_begun_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    pattern = "(p | enter(q) | enter(r)){2..} ->> s"
    gesture = compile_artifact(Source("b.yaml", BODY.replace("PATTERN", pattern))).manifest.gestures[0]
    for most, dropped in ((2_000, False), (3, True)):
        monkeypatch.setattr(matching, "MOST_WALKS", most)
        run = GestureRun(gesture)
        for frame in range(6):
            run.take([Degree(frame % 2, 1.0)] * 3 + [Degree(0, 1.0)], frame * 0.1, 0.0)
        assert (run.threads.dropped > 0) is dropped


def test_an_open_count_needs_no_more_threads_than_positions() -> None:
    gesture = compile_artifact(Source("b.yaml", BODY.replace("PATTERN", "p ->> q ->> r ->> s"))).manifest.gestures[0]
    run = GestureRun(gesture)
    for frame in range(400):
        run.take([Degree(int(frame % 3 == k), 1.0) for k in range(3)] + [Degree(0, 1.0)], frame * 0.1, 0.0)
    assert 0 < len(run.threads.begun) <= 3
    assert run.threads.dropped == 0


@pytest.mark.parametrize("lag", [0.0, 0.2, "offline"])
def test_a_grab_is_found_by_every_lag_and_a_batch_equals_a_stream(hand: Artifact, lag: Any) -> None:
    take = simulate(hand, SimulateOptions(path=("flat", "fist"), duration=1.0, rate=25.0, noise=0.002, seed=1))
    recording = take.recording
    decoding = decode(hand, recording, lag=lag, noise=0.002)
    session = Session(hand, lag=lag, noise=0.002, names=tuple(recording.names), rate=25.0, up=recording.up)
    steps = [session.step(p, t) for p, t in zip(recording.points, recording.time, strict=True)] + session.finish()
    assert tuple(e for step in steps for e in step.events) == tuple(decoding.events)
    (grab,) = [event for event in decoding.events if event.name == "grab"]
    fist = decoding.poses[:, hand.manifest.poses.index("fist")]
    assert abs(grab.end - recording.time[np.flatnonzero(fist == 1)[0]]) < 0.1
    waited = {0.0: grab.end, 0.2: grab.end + 0.2, "offline": recording.time[-1]}[lag]
    assert grab.decided == pytest.approx(waited)
    assert 0 < grab.confidence <= 1


def test_a_session_begins_anew_after_finish(hand: Artifact) -> None:
    take = simulate(
        hand, SimulateOptions(path=("flat", "fist"), duration=1.0, rate=25.0, noise=0.002, seed=1)
    ).recording
    session = Session(hand, noise=0.002, names=tuple(take.names), rate=25.0)
    told = []
    for _ in range(2):
        steps = [session.step(p, t) for p, t in zip(take.points, take.time, strict=True)] + session.finish()
        told.append([event for step in steps for event in step.events])
    assert told[0] == told[1]
    assert told[0]


def test_the_hand_passes_its_own_tests(hand: Artifact) -> None:
    assert [outcome.why for outcome in run_tests(hand)] == ["", ""]


def test_a_simulated_gesture_is_found_in_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    take, out = tmp_path / "take.csv", tmp_path / "out"
    assert main(["simulate", "hand", "--gesture", "grab", "--noise", "1mm", "-o", str(take)]) == 0
    assert main(["decode", "hand", str(take), "-o", str(out)]) == 0
    assert "gestures: grab 1" in capsys.readouterr().out
    rows = (tmp_path / "out.events.csv").read_text().splitlines()
    assert [row.split(",")[0] for row in rows] == ["gesture", "grab"]
    truth = tmp_path / "events.csv"
    truth.write_text("\n".join(rows) + "\n")
    assert main(["score", str(tmp_path / "out.events.csv"), str(truth)]) == 0
