"""`gesturec simulate --hide`: what hides nothing is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from gesturec.cli.main import main


def test_a_time_after_the_take_is_warned_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    take = ["simulate", "hand", "--path", "flat", "--duration", "0.2s", "-o", str(tmp_path / "take.csv")]
    assert main([*take, "--hide", "index.tip@5-6"]) == 0
    assert "`index.tip@5-6` begins after the take, which lasts 0.2 s" in capsys.readouterr().err
    assert main([*take, "--hide", "index.tip@0.1-6", "--hide", "thumb"]) == 0
    assert capsys.readouterr().err == ""
