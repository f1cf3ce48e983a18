"""`python -m gesturec` is the command line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "gesturec", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)


def test_the_package_runs_as_the_command() -> None:
    done = run("--help")
    assert done.returncode == 0
    assert done.stdout.startswith("usage: gesturec COMMAND")


def test_its_exit_code_is_the_command_s() -> None:
    done = run("decod")
    assert done.returncode == 2
    assert "did you mean `decode`" in done.stderr
