"""A model's own tests: what passes, what fails with a reason, and what is honestly not run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from gesturec.cli.main import main
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source
from gesturec.modeltests.run import Outcome, run_tests, within_level
from gesturec.scaffold import new_model

BODY = new_model("body", "finger").split("tests:")[0]


def outcomes(*tests: str) -> tuple[Outcome, ...]:
    lines = "".join(f"  - {test}\n" for test in tests)
    return run_tests(compile_artifact(Source("body.yaml", f"{BODY}tests:\n{lines}")))


def test_a_clean_take_is_within_one_level() -> None:
    (outcome,) = outcomes("{name: bends, path: open -> bent, duration: 1 s, rate: 25, noise: 1 mm, within_level: 95 %}")
    assert (outcome.status, outcome.why, outcome.wanted) == ("passed", "", pytest.approx(0.95))
    assert outcome.frames == 26
    assert outcome.within_level >= 0.95


def test_a_hidden_finger_fails_with_both_numbers() -> None:
    hidden = "hide: {index.tip: 0 s .. 2 s, index.middle: 0 s .. 2 s}"
    (outcome,) = outcomes(f"{{name: blind, path: open -> bent, {hidden}, within_level: 100 %}}")
    assert outcome.status == "failed"
    assert "100 % are wanted" in outcome.why
    assert f"{100 * outcome.within_level:.2f} %" in outcome.why


def test_gestures_that_are_expected_or_must_not_be() -> None:
    first, second, third, fourth = outcomes(
        "{name: a, path: open -> bent, duration: 2 s, expect: [hold]}",
        "{name: b, path: open -> bent, duration: 2 s, never: [hold], within_level: 1 %}",
        "{name: c, path: open, never: [hold]}",
        "{path: open -> bent}",
    )
    assert (first.status, first.why, first.gestures) == ("passed", "", ("hold",))
    assert (second.status, second.why) == ("failed", "`hold` was found and must not be")
    assert (third.status, third.gestures) == ("passed", ())
    assert (fourth.name, fourth.status) == ("test 4", "not run")
    assert "asks for nothing" in fourth.why


def test_a_gesture_that_is_missing_fails_with_what_was_found() -> None:
    (outcome,) = outcomes("{name: a, path: open, expect: [hold]}")
    assert (outcome.status, outcome.why) == ("failed", "`hold` was expected and not found; found was nothing")


def test_within_level_by_hand() -> None:
    text = BODY.split("    constraints:")[0]
    artifact = compile_artifact(Source("body.yaml", text))
    names = artifact.manifest.states["index"]
    truth = np.array([[names.index("0/30/30")]] * 5, dtype=np.int32)
    out = np.array(
        [[names.index(name)] for name in ("0/30/30", "45/60/0", "0/90/30", "0/30/90")] + [[-1]], dtype=np.int32
    )
    assert within_level(artifact, out, truth) == pytest.approx(2 / 5)
    assert math.isnan(within_level(artifact, truth[:, :0], truth[:, :0]))


def test_the_command_tells_and_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "body.yaml"
    path.write_text(new_model("body", "finger"), encoding="utf-8")
    assert main(["test", str(path)]) == 0
    assert "1 passed, 0 failed, 0 not run" in capsys.readouterr().out
    path.write_text(f"{BODY}tests:\n  - {{name: x, path: open -> bent, noise: 80 mm, within_level: 100 %}}\n")
    assert main(["test", str(path), "--json"]) == 1
    (plain,) = json.loads(capsys.readouterr().out)
    assert (plain["name"], plain["status"]) == ("x", "failed")
    path.write_text(BODY)
    assert main(["test", str(path)]) == 0
    assert "no tests" in capsys.readouterr().out


@pytest.mark.parametrize("form", [[], ["--json"]])
def test_a_file_of_which_nothing_was_run_is_not_green(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], form: list[str]
) -> None:
    silent = "  - {name: a, path: open -> bent}\n  - {name: b, path: open -> bent}\n"
    nothing = "it asks for nothing: no expect, never or within_level"
    path = tmp_path / "body.yaml"
    path.write_text(f"{BODY}tests:\n{silent}", encoding="utf-8")
    assert main(["test", str(path), *form]) == 1
    assert capsys.readouterr().err == f"error: NO TEST WAS RUN of 2: {nothing}\n"
    passes = "  - {name: c, path: open -> bent, within_level: 1 %}\n"
    path.write_text(f"{BODY}tests:\n{silent}{passes}", encoding="utf-8")
    assert main(["test", str(path), *form]) == 0
    assert capsys.readouterr().err == f"warning: 2 of 3 tests were NOT RUN: {nothing}\n"
    fails = "  - {name: d, path: open -> bent, noise: 80 mm, within_level: 100 %}\n"
    path.write_text(f"{BODY}tests:\n{silent}{fails}", encoding="utf-8")
    assert main(["test", str(path), *form]) == 1
