"""The page's data: what is packed can be unpacked, and what is undecided is not shown as decided."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.step import GestureEvent
from gesturec.view import payload
from gesturec.view.packing import UNKNOWN, pack, pack_points
from gesturec.view.payload import drawn_angles, page_payload


def unpack(packed: dict[str, Any]) -> np.ndarray:  # type: ignore[type-arg]
    raw = np.frombuffer(base64.b64decode(packed["base64"]), np.dtype(packed["dtype"]).newbyteorder("<"))
    return raw.reshape(packed["shape"])


@pytest.mark.parametrize("dtype", ["u1", "u2", "i2", "i4", "f4", "f8"])
def test_arrays_come_back(dtype: str) -> None:
    values = np.arange(12).reshape(3, 4)
    assert (unpack(pack(values, dtype)) == values).all()


def test_points_come_back_to_half_a_step_and_unknown_ones_as_unknown() -> None:
    points = np.random.default_rng(1).normal(0, 0.5, (40, 6, 3))
    points[3, 2] = np.nan
    packed = pack_points(points)
    steps = unpack(packed)
    assert (steps[3, 2] == UNKNOWN).all()
    back = np.where(steps == UNKNOWN, np.nan, steps * packed["step"] + packed["offset"])
    assert np.nanmax(np.abs(back - points)) <= packed["step"] / 2 * (1 + 1e-9)
    assert packed["step"] < 1e-4


def test_nothing_known_can_be_packed() -> None:
    assert (unpack(pack_points(np.full((2, 3, 3), np.nan))) == UNKNOWN).all()
    assert unpack(pack_points(np.zeros((0, 3, 3)))).shape == (0, 3, 3)


def test_an_undecided_machine_is_drawn_in_its_most_probable_state_and_told_as_undecided(
    hand: Artifact, make_take: Any
) -> None:
    take = make_take(hand, 12, undecided=slice(4, 6))
    states = hand.states(0)
    take.probability[4:6, states] = 0
    take.probability[4, states.start + 9] = 0.6
    take.probability[4, states.start + 2] = 0.4
    _, drawn = drawn_angles(hand, take, np.arange(12))
    assert drawn[4, 0] == 9
    # nothing is known of frame 5: what was drawn last stays
    assert drawn[5, 0] == 9
    machine = page_payload(hand, take, "t")["machines"][0]
    assert unpack(machine["state"])[4:6].tolist() == [-1, -1]
    assert unpack(machine["candidate"])[4].tolist() == [9, 2, -1, -1, -1, -1]
    assert unpack(machine["probability"])[4, :2].tolist() == [153, 102]
    assert unpack(machine["possible"])[4:6].tolist() == [2, 0]
    assert unpack(machine["inside"])[3:6].tolist() == [1, 2, 0]
    assert unpack(machine["fit"])[4].tolist() == [1.0, 16.0, 2.0, 3.0, 9.0, 0.25]


def test_the_payload_is_json_without_nan(hand: Artifact, make_take: Any) -> None:
    take = make_take(hand, 6, undecided=slice(None), hidden=slice(None))
    text = json.dumps(page_payload(hand, take, "t", up="-z"), allow_nan=False)
    assert json.loads(text)["up"] == [0, 0, -1]


def test_the_header_counts_what_the_arrays_say(hand: Artifact, make_take: Any) -> None:
    take = make_take(hand, 20, undecided=slice(0, 5), hidden=slice(0, 2))
    facts = [text for text, _ in page_payload(hand, take, "t")["facts"]]
    assert "20 frames @ 25 Hz" in facts
    assert "75 % decided" in facts
    assert f"{len(hand.manifest.tokens)} tokens, 10 % hidden" in facts


def test_every_key_of_the_payload_is_documented(hand: Artifact, make_take: Any) -> None:
    told = re.findall(r"^(\w[\w, ]*?)  +\S", str(payload.__doc__).split("=\n", 2)[2], re.M)
    names = {name for entry in told for name in entry.split(", ")}
    assert set(page_payload(hand, make_take(hand, 3), "t")) == names


def test_an_event_of_unknown_confidence_is_null(hand: Artifact, make_take: Any) -> None:
    take = dataclasses.replace(make_take(hand, 12), events=(GestureEvent("grab", 0.1, None, 0.2, float("nan")),))
    event = page_payload(hand, take, "t")["events"][0]
    assert (event["end"], event["confidence"]) == (None, None)
