"""OUT.jsonl: everything of a frame is there, agrees with the steps, and is said in words."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_model
from gesturec.recordings.reasons import reason_of
from gesturec.recordings.results import write_lines
from gesturec.runtime.decode import decode
from gesturec.runtime.session import Session
from gesturec.runtime.status import STATUSES
from gesturec.runtime.step import Decoding, GestureEvent, MachineWhy
from tests.runtime.conftest import make_take

ROOT = Path(__file__).resolve().parents[2]
WHY = MachineWhy("ok", 2, 3.25, 16.3, 9, 2)


@pytest.fixture(scope="module")
def hand() -> Artifact:
    return compile_model(ROOT / "models" / "hand.yaml").artifact


@pytest.fixture(scope="module")
def take(hand: Artifact) -> Any:
    """The index' tip is hidden for a while, nothing at all is seen once, and one time comes twice."""
    take = make_take(hand, frames=40, noise=0.002)
    take.points[14:24, take.names.index("index.tip")] = np.nan
    take.points[30] = np.nan
    take.time[35] = take.time[34]
    return take


def lines_of(hand: Artifact, decoding: Decoding) -> list[dict[str, Any]]:
    stream = io.StringIO()
    write_lines(hand, decoding, stream)
    return [json.loads(line) for line in stream.getvalue().splitlines()]


def test_candidates_are_those_of_the_steps_with_their_probabilities(hand: Artifact, take: Any) -> None:
    lines = lines_of(hand, decode(hand, take))
    session, told = Session(hand, names=take.names, rate=25.0), []
    for points, time in zip(take.points, take.time, strict=True):
        told.append(session.step(points, time))
    for line, step in zip(lines, told, strict=True):
        for machine, names in step.candidates.items():
            found = line["candidates"][machine]
            if found != "any" and names:
                assert tuple(found) == names
                posterior = line["posterior"][machine]
                assert all(posterior["states"][name] == share for name, share in found.items())
                assert sum(posterior["states"].values()) + posterior["rest"] == pytest.approx(1, abs=1e-4)
                assert sum(found.values()) >= 0.9 - 1e-4


def test_every_frame_has_its_evidence_and_a_refused_one_says_why(hand: Artifact, take: Any) -> None:
    lines = lines_of(hand, decode(hand, take, lag=0.08))
    assert [line["frame"] for line in lines] == list(range(40))
    assert {line["status"] for line in lines} <= {status.name for status in STATUSES}
    refused = lines[35]
    assert refused["status"] == "time-refused" and "does not come after" in refused["message"]
    assert refused["tokens"] == {} == refused["why"]
    seen = lines[10]["tokens"]["index.tip"]
    assert seen["track"] == "confirmed" and len(seen["velocity"]) == len(seen["innovation"]) == 3
    hidden = lines[16]["tokens"]["index.tip"]
    assert (hidden["track"], hidden["innovation"], hidden["residual"]) == ("coasting", None, None)
    for line in lines[2:35]:
        for machine, why in line["why"].items():
            told = {"status", "seen", "chi_square", "limit", "reachable", "delay", "leaned", "reason"}
            assert told <= why.keys()
            state = line["states"][machine]
            assert state is None or state in why["reason"]
            assert f"{why['reachable']} of" in why["reason"]


def test_an_event_stands_in_the_frame_that_decided_it(hand: Artifact, take: Any) -> None:
    events = (GestureEvent("grab", 0.1, None, 0.5, float("nan")), GestureEvent("late", 0.1, 0.2, 99.0, 1.0))
    lines = lines_of(hand, replace(decode(hand, take), events=events))
    at = {event["gesture"]: line["frame"] for line in lines for event in line["events"]}
    assert at == {"grab": int(np.argmax(take.time >= 0.5 - 1e-9)), "late": 39}
    grab = next(event for line in lines for event in line["events"] if event["gesture"] == "grab")
    assert grab == {"gesture": "grab", "start": 0.1, "end": None, "decided": 0.5, "confidence": None}


@pytest.mark.parametrize(
    ("why", "state", "share", "said"),
    [
        (WHY, 0, [0.9, 0.1, 0], "chosen: a (90 %), before b (10 %); 2 of its tokens were seen, chi-square 3.25 of "
                                "at most 16.3; 9 of 3 states within reach; decided 2 frames later"),
        (WHY._replace(seen=0, chi_square=np.nan, status="coasting", delay=0), 1, [0, 1, 0],
         "carried on: b (100 %); none of its tokens was seen; 9 of 3 states within reach"),
        (WHY._replace(seen=1, chi_square=99.0, status="misfit"), -1, [0.4, 0.3, 0.3],
         "refused: no state fits what was measured; 1 of its tokens was seen, chi-square 99 beyond the limit of 16.3; "
         "9 of 3 states within reach"),
        (WHY._replace(limit=np.inf, status="undecided"), -1, [0.2, 0.4, 0.4],
         "not decided: the most probable is b (40 %); 2 of its tokens were seen, chi-square 3.25; "
         "9 of 3 states within reach"),
        (WHY._replace(seen=0, chi_square=np.nan, status="coasting", delay=0, leaned=0.4), 1, [0, 1, 0],
         "carried on: b (100 %); none of its tokens was seen; 9 of 3 states within reach; "
         "the pose of the other limbs moved 40 % of the probability"),
        (WHY._replace(seen=0, status="any"), -1, [0, 0, 0],
         "not decided: no state is known to be possible; none of its tokens was seen; 9 of 3 states within reach"),
    ],
)  # fmt: skip
def test_the_reason_reads_out_the_numbers(why: MachineWhy, state: int, share: list[float], said: str) -> None:
    assert reason_of(why, state, ("a", "b", "c"), np.array(share, np.float32)) == said


def test_the_page_of_results_names_every_key_of_a_line_and_every_status(hand: Artifact, take: Any) -> None:
    page = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w-]+)`", page))
    keys: set[str] = set()
    for line in lines_of(hand, decode(hand, take)):
        keys |= line.keys() | line["why"].get("index", {}).keys() | line["posterior"]["index"].keys()
        keys |= line["tokens"].get("index.tip", {}).keys() | (line["pose"] or {}).keys()
    assert not keys - named
    assert not {status.name for status in STATUSES} - named
