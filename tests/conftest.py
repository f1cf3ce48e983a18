"""What tests share: where the real recordings are, the compiled hand, once a session, and how many run at once."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

ROOT = Path(__file__).parent.parent

# How long an example takes says how busy the machine is, nothing of the code.
settings.register_profile("gesturec", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True)
settings.load_profile("gesturec")


def pytest_addoption(parser: pytest.Parser) -> None:
    """`pytest --update-golden` rewrites what golden tests compare with."""
    parser.addoption("--update-golden", action="store_true", help="rewrite the golden files")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """All tests run on every core where pytest-xdist is installed; those of a room, or with `-n 0`, in one process."""
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not hasattr(config, "workerinput")
    if whole and getattr(config.option, "numprocesses", 0) is None:
        config.option.numprocesses, config.option.dist = "auto", "worksteal"


@pytest.fixture
def update_golden(request: pytest.FixtureRequest) -> bool:
    """Whether golden files are rewritten."""
    return bool(request.config.getoption("--update-golden"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The real recordings; a user's machine does not have them."""
    folder = Path(os.environ.get("GESTUREC_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder} (GESTUREC_DATA)")
    return folder


@pytest.fixture(scope="session")
def hand() -> Artifact:
    """The shipped hand, compiled."""
    from gesturec.compile import compile_artifact
    from gesturec.shipped import shipped_models

    return compile_artifact(shipped_models()["hand"])
