"""A real walk of the shipped model of gait: the legs are told, and feet strike and leave when force plates say so."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import gesturec
from gesturec.recordings.read import read
from gesturec.runtime.decode import decode

ROOT = Path(__file__).parents[2]
NEAR = 0.05  # s; measured: all 35 moments of seven walks lie within it (benchmarks/gait.py)
BEGINS = {"stance": "foot_strike", "swing": "foot_off"}


@pytest.mark.parametrize("walk", ["gait_opensim/subject01_walk1"])
def test_feet_strike_and_leave_when_plates_say_so(walk: str, shared_data: Path) -> None:
    artifact = gesturec.compile_model(ROOT / "models" / "gait.yaml").artifact
    decoding = decode(artifact, read(shared_data / f"{walk}.trc"), lag=0.08)
    assert (decoding.state >= 0).all()
    # metres by the pelvis, whose proportions differ from person to person
    assert 0.9 < np.nanmedian(decoding.scale) < 1.1
    with (shared_data / f"{walk}.events.csv").open(encoding="utf-8", newline="") as stream:
        listed = list(csv.DictReader(stream))
    for machine, states in zip(artifact.manifest.machines, decoding.state.T, strict=True):
        (walking,) = artifact.manifest.phases[machine]
        for part in walking["parts"]:
            inside = np.isin(states, part["states"])
            entered = decoding.time[1:][inside[1:] & ~inside[:-1]]
            for event in listed:
                if event["side"] == machine[0] and event["event"] == BEGINS[part["name"]]:
                    assert np.abs(entered - float(event["time"])).min() <= NEAR, event
