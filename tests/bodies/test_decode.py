"""Two hands in one recording: each is found and decoded by itself, and what spans them is told."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.diagnostics.errors import InputError
from gesturec.modeltests.run import within_level
from gesturec.recordings.results import table_of_decoding, write_lines, write_states
from gesturec.runtime.bodies import BodiesSession
from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding
from gesturec.score.tables import Rows, parse_states
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate
from gesturec.view.payload import page_payload
from tests.bodies.takes import apart_by, gap_at

Take = tuple[gesturec.Recording, Simulation]


@pytest.fixture(scope="module")
def decoded(hands: Artifact, clap: Take) -> Decoding:
    return decode(hands, clap[0], decoder="viterbi", lag=0.2, noise=0.002)


def close(hands: Artifact, decoding: Decoding) -> np.ndarray:
    return decoding.poses[:, hands.manifest.poses.index("close")]


def test_both_hands_are_within_a_level_in_a_clap(hands: Artifact, clap: Take, decoded: Decoding) -> None:
    for first in (0, 5):
        mine, truth = decoded.state.copy(), clap[1].truth.state
        mine[:, 5 - first : 10 - first] = truth[:, 5 - first : 10 - first]  # the other hand's count as right
        share = 2 * within_level(hands, mine, truth) - 1
        assert share >= 0.95


def test_sessions_share_the_tables_of_each_body(hands: Artifact) -> None:
    one, other = (BodiesSession(hands) for _ in range(2))
    assert all(a.artifact is b.artifact for a, b in zip(one.parts, other.parts, strict=True))


def test_each_body_has_its_own_place_and_size(clap: Take, decoded: Decoding) -> None:
    assert decoded.places is not None
    gap = decoded.places.translation[:, 1] - decoded.places.translation[:, 0]
    np.testing.assert_allclose(gap[:, 2], gap_at(clap[0].time), atol=0.006)
    np.testing.assert_allclose(gap[:, :2], 0, atol=0.006)
    np.testing.assert_allclose(decoded.places.scale[-1], 1, atol=0.03)
    assert np.isnan(decoded.pose_translation).all() and np.isnan(decoded.scale).all()


def test_a_pose_of_both_holds_where_their_tokens_in_the_world_say_so(
    hands: Artifact, clap: Take, decoded: Decoding
) -> None:
    # the palms are mirrored in z, so that the middle fingers' bases are 2 x 4 mm further from each other
    distance = gap_at(clap[0].time) + 0.008
    sure = np.abs(distance - 0.060) > 0.008
    np.testing.assert_array_equal(close(hands, decoded)[sure], (distance <= 0.060)[sure])
    assert {0, 1} <= set(close(hands, decoded)[sure].tolist())


def test_a_pose_of_both_is_unknown_where_one_is_not_there(hands: Artifact, clap: Take) -> None:
    recording = clap[0]
    right = [place for place, name in enumerate(recording.names) if name.startswith("right.")]
    alone = replace(recording, names=tuple(recording.names[p] for p in right), points=recording.points[:, right])
    decoding = decode(hands, alone, noise=0.002)
    assert set(close(hands, decoding).tolist()) == {2}
    assert (decoding.state[:, :5] == -1).all() and (decoding.state[:, 5:] >= 0).mean() > 0.9
    assert decoding.report["status"] == {"pose-unknown": len(recording.time)}


def test_a_frame_without_any_body_says_so(hands: Artifact, clap: Take) -> None:
    points = clap[0].points.copy()
    points[10] = np.nan
    decoding = decode(hands, replace(clap[0], points=points), noise=0.002)
    steps = list(decoding.report["status"])
    assert decoding.report["status"]["no-tokens"] == 1 and "ok" in steps


def test_each_hand_is_decoded_as_if_it_were_alone(
    hands: Artifact, singles: dict[str, Artifact], clap: Take, decoded: Decoding
) -> None:
    recording = clap[0]
    for body, (name, single) in enumerate(singles.items()):
        own = [place for place, each in enumerate(recording.names) if each.startswith(f"{name}.")]
        names = tuple(recording.names[place].removeprefix(f"{name}.") for place in own)
        alone = replace(recording, names=names, points=recording.points[:, own])
        decoding = decode(single, alone, decoder="viterbi", lag=0.2, noise=0.002)
        np.testing.assert_array_equal(decoded.state[:, 5 * body : 5 * body + 5], decoding.state)
        assert decoded.places is not None
        np.testing.assert_array_equal(decoded.places.translation[:, body], decoding.pose_translation)


@pytest.mark.parametrize("lag", [0.0, 0.2, "offline"])
def test_steps_and_batch_agree(hands: Artifact, clap: Take, lag: float | str) -> None:
    recording = replace(clap[0], time=clap[0].time[:12], points=clap[0].points[:12])
    batch = decode(hands, recording, lag=lag, noise=0.002)
    session = gesturec.Session(hands, lag=lag, noise=0.002, rate=recording.rate)
    assert isinstance(session, BodiesSession)
    steps = [
        session.step(dict(zip(recording.names, recording.points[n], strict=True)), t)
        for n, t in enumerate(recording.time)
    ]
    steps = [step for step in [*steps, *session.finish()] if step.record is not None]
    assert [step.frame_index for step in steps] == list(range(12))
    for n, step in enumerate(steps):
        assert step.record is not None
        np.testing.assert_array_equal(step.record.state, batch.state[n])
        np.testing.assert_array_equal(step.record.poses, batch.poses[n])


def test_a_step_names_things_with_their_body_in_front(hands: Artifact, clap: Take) -> None:
    session = gesturec.Session(hands, noise=0.002)
    step = session.step(dict(zip(clap[0].names, clap[0].points[0], strict=True)), 0.0)
    assert {"left.index", "right.index"} < set(step.states) and step.pose is None
    assert set(step.body_poses) == set(step.body_scales) == {"left", "right"}
    state = step.states["left.index"]
    assert state is None or "left.index.mcp" in state.angles
    assert step.is_located


def test_a_repeated_time_changes_nothing(hands: Artifact, clap: Take) -> None:
    session = gesturec.Session(hands, noise=0.002)
    points = dict(zip(clap[0].names, clap[0].points[0], strict=True))
    session.step(points, 0.0)
    assert session.step(points, 0.0).status == "time-refused"
    assert session.step(clap[0].points[0][:3], 0.1).status == "input-refused"
    assert session.step(points, 0.04).frame_index == 1


def test_a_take_begins_in_a_pose_of_one_body(hands: Artifact) -> None:
    gesturec.Session(hands, start="left.fist")
    with pytest.raises(ValueError, match="pose of one"):
        gesturec.Session(hands, start="close")


def test_points_are_bound_by_the_names_of_another_tool(hands: Artifact, clap: Take) -> None:
    binding = next(each for each in hands.manifest.bindings if each["name"] == "mediapipe_hands")
    theirs = {ours: next(iter(names)) for ours, names in binding["tokens"].items() if len(names) == 1}
    named = [place for place, name in enumerate(clap[0].names) if name in theirs]
    names = tuple(theirs[clap[0].names[place]] for place in named)
    decoding = decode(hands, replace(clap[0], names=names, points=clap[0].points[:, named]), noise=0.002)
    assert decoding.report["binding"] == "mediapipe_hands"
    assert (decoding.state >= 0).mean() > 0.5


def test_the_states_file_has_a_pose_a_body_and_one_status(hands: Artifact, clap: Take, decoded: Decoding) -> None:
    stream = io.StringIO()
    write_states(hands, table_of_decoding(decoded), stream)
    header, *rows = csv.reader(stream.getvalue().splitlines())
    assert header[2] == "left.index" and "right.index.mcp" in header and header[-1] == "status"
    for body in ("left", "right"):
        assert [f"{body}.{name}" in header for name in ("pose.x", "pose.qw", "scale")] == [True] * 3
    assert "pose.x" not in header and "scale" not in header
    gap = [float(row[header.index("right.pose.z")]) - float(row[header.index("left.pose.z")]) for row in rows]
    np.testing.assert_allclose(gap, gap_at(clap[0].time), atol=0.006)


def test_score_takes_the_places_of_bodies_for_no_machine(hands: Artifact, decoded: Decoding) -> None:
    stream = io.StringIO()
    write_states(hands, table_of_decoding(decoded), stream)
    header, *rows = csv.reader(stream.getvalue().splitlines())
    table = parse_states(Rows("states", tuple(header), rows, list(range(2, len(rows) + 2))))
    assert table.machines == hands.manifest.machines and table.joints == hands.manifest.joints


def test_the_lines_tell_each_bodys_pose(hands: Artifact, decoded: Decoding) -> None:
    stream = io.StringIO()
    write_lines(hands, decoded, stream)
    frame = json.loads(stream.getvalue().splitlines()[-1])
    assert frame["pose"] is None and set(frame["bodies"]) == {"left", "right"}
    assert frame["bodies"]["left"]["scale"] == pytest.approx(1, abs=0.03)


def test_the_page_draws_both_where_they_are(hands: Artifact, decoded: Decoding) -> None:
    payload = page_payload(hands, decoded, "clap")
    body = payload["body"]
    assert len(body["hulls"]) == 2 and all(len(hull) > 2 for hull in body["hulls"])
    assert len(payload["machines"]) == 10 and sorted(set(body["owner"])) == [0, 1]
    nodes = len(body["machine"])
    assert all(0 <= node < nodes for bone in body["bones"] for node in bone)
    assert all(body["owner"][a] == body["owner"][b] for a, b in body["bones"])
    assert any("left 1.0" in text or "left 0.9" in text for text, _ in payload["facts"])
    json.dumps(payload, allow_nan=False)


def test_bodies_are_simulated_as_far_apart_as_is_said(hands: Artifact, singles: dict[str, Artifact]) -> None:
    take = simulate(hands, SimulateOptions(path=("left.fist",), apart=0.3))
    assert take.truth.places is not None
    away = take.truth.places.translation[0, 1] - take.truth.places.translation[0, 0]
    assert np.linalg.norm(away) == pytest.approx(0.3)
    wrists = [take.recording.names.index(f"{body}.wrist") for body in ("left", "right")]
    np.testing.assert_allclose(np.linalg.norm(np.diff(take.recording.points[:, wrists], axis=1), axis=-1), 0.3)
    with pytest.raises(InputError, match="one body"):
        simulate(singles["right"], SimulateOptions(path=("fist",), apart=0.3))


def test_bodies_stand_clear_of_one_another_where_nobody_says_how_far(hands: Artifact) -> None:
    take = simulate(hands, SimulateOptions(path=("left.flat", "right.fist")))
    left = np.array([name.startswith("left.") for name in take.recording.names])
    points = take.recording.points
    assert (points[:, left].max(axis=(0, 1)) < points[:, ~left].min(axis=(0, 1))).any()


def test_the_same_place_is_told_apart(hands: Artifact, clap: Take) -> None:
    """Labelled points never mix the hands up, even where both are in one place."""
    take = clap[1]
    together = apart_by(take, np.zeros(len(take.recording.time)))
    decoding = decode(hands, together, decoder="viterbi", lag=0.2, noise=0.002)
    assert within_level(hands, decoding.state, take.truth.state) >= 0.95
