"""What the tests of pictures share: the shipped hand, takes of it that are made by hand, a headless browser."""

from __future__ import annotations

import dataclasses
import fcntl
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.runtime.status import STATUS_ID
from gesturec.runtime.step import Decoding, GestureEvent, MachineWhy
from gesturec.runtime.tracker import TRACK_STATES

ROOT = Path(__file__).parents[2]
RIGID = """
gesturec: 1
name: head
units: {length: mm, angle: deg}
root:
  name: head
  tokens: {nose: [110, 0, 0], crown: [0, 120, 0], ear_right: [0, 0, 75], ear_left: [0, 0, -75]}
"""
MakeTake = Callable[..., Decoding]


def compiled(path: Path) -> Artifact:
    model = gesturec.compile_model(str(path))
    return getattr(model, "artifact", model)


@pytest.fixture(scope="session")
def hand() -> Artifact:
    return compiled(ROOT / "models" / "hand.yaml")


@pytest.fixture(scope="session")
def rigid(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    path = tmp_path_factory.mktemp("rigid") / "head.yaml"
    path.write_text(RIGID)
    return compiled(path)


@pytest.fixture(scope="session")
def rename() -> Callable[[Artifact, Callable[[str], str]], Artifact]:
    return with_names


@pytest.fixture(scope="session")
def make_take() -> MakeTake:
    return walk_through_states


def walk_through_states(
    artifact: Artifact, n_frame: int, undecided: slice = slice(0), hidden: slice = slice(0)
) -> Decoding:
    """Every machine goes through its states in turn; all are undecided in some frames, and no token seen in others."""
    frames = np.arange(n_frame)
    sizes = [len(tables.state_names) for tables in artifact.machines()]
    state = np.stack([frames % size for size in sizes], axis=1) if sizes else np.zeros((n_frame, 0), np.int64)
    angle = np.zeros((n_frame, len(artifact.manifest.joints)))
    probability = np.zeros((n_frame, sum(sizes)), np.float32)
    for machine, tables in enumerate(artifact.machines()):
        angle[:, tables.joints] = tables.angle[state[:, machine]]
        probability[frames, artifact.states(machine).start + state[:, machine]] = 1
    angle = complete_angles(chain_of(artifact.columns), angle)
    measured = token_positions(chain_of(artifact.columns), angle) + np.array([0.1, 0.2, 0.3])
    measured[hidden] = np.nan
    for machine, size in enumerate(sizes):
        start = artifact.states(machine).start
        probability[undecided, start : start + size] = 1 / size
    state[undecided] = -1
    angle[undecided] = np.nan
    status = np.full(n_frame, STATUS_ID["ok"], np.int32)
    status[undecided] = STATUS_ID["undecided"]
    why = MachineWhy("ok", 3, 1.0, 16.0, 9, 2, 0.25)
    return Decoding(
        time=frames / 25,
        status=status,
        state=state.astype(np.int32),
        probability=probability,
        pose_rotation=np.tile(np.eye(3), (n_frame, 1, 1)),
        pose_translation=np.tile([0.1, 0.2, 0.3], (n_frame, 1)),
        scale=np.ones(n_frame),
        joint_angle=angle,
        joint_mean=angle,
        measured=measured,
        filtered=measured,
        velocity=np.zeros(measured.shape),
        innovation=np.zeros(measured.shape),
        track=np.full(measured.shape[:2], TRACK_STATES.index("confirmed"), np.int32),
        decided_frame=np.where(state >= 0, frames[:, None], -1).astype(np.int32),
        root_residual=np.zeros(n_frame),
        events=(GestureEvent("grab", 0.1, 0.3, 0.3, 0.9),) if n_frame > 10 else (),
        poses=np.ones((n_frame, len(artifact.manifest.poses)), np.uint8),
        why=tuple({tables.name: why for tables in artifact.machines()} for _ in frames),
        report={},
        manifest=artifact.manifest,
        name="walk",
    )


def with_names(artifact: Artifact, change: Callable[[str], str]) -> Artifact:
    """The same model with other names of machines, states and tokens."""
    manifest = artifact.manifest
    machines = tuple(map(change, manifest.machines))
    states = {change(name): tuple(map(change, manifest.states[name])) for name in manifest.machines}
    renamed = dataclasses.replace(
        manifest,
        machines=machines,
        states=states,
        tokens=tuple(map(change, manifest.tokens)),
        name=change(manifest.name),
    )
    return Artifact(renamed, artifact.columns)


def _high(descriptor: int) -> int:
    """The same pipe above the numbers that the browser wants, so that none is overwritten on the way."""
    moved = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 10)
    os.close(descriptor)
    return moved


class Browser:
    """Headless Chromium, spoken to over a pipe: what a user of the page does, and what then stands in it.

    The protocol is one JSON object after another, each ended by a zero byte, on file descriptors 3 and 4.
    """

    def __init__(self, program: str, profile: Path) -> None:
        to_read, self._to = map(_high, os.pipe())
        self._from, to_write = map(_high, os.pipe())
        flags = "--headless --no-sandbox --disable-gpu --disable-background-networking --disable-component-update"
        flags += " --disable-sync --no-first-run --remote-debugging-pipe --window-size=1280,800"
        shuffle = f"exec {program} {flags} --user-data-dir='{profile}' 3<&{to_read} 4>&{to_write}"
        command = ["bash", "-c", shuffle]
        quiet = subprocess.DEVNULL
        self._process = subprocess.Popen(command, pass_fds=(to_read, to_write), stdout=quiet, stderr=quiet)
        os.close(to_read)
        os.close(to_write)
        self._rest, self._number, self.requests = b"", 0, list[str]()
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.send("Network.enable")
        self.send("Page.enable")

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if hasattr(self, "_session"):
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("method") == "Network.requestWillBeSent":
                self.requests.append(answer["params"]["request"]["url"])
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            part = os.read(self._from, 1 << 16)
            assert part, "the browser ended"
            self._rest += part
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)

    def open(self, path: Path, hash: str = "") -> None:
        self.requests.clear()
        self.send("Page.navigate", url="about:blank")
        self.send("Page.navigate", url=path.as_uri() + hash)
        for _ in range(200):
            told = "document.documentElement?.dataset.ready || document.documentElement?.dataset.error"
            if self.run(told):
                return
            time.sleep(0.02)
        raise AssertionError("the page neither started nor failed")

    def run(self, expression: str) -> Any:
        answer = self.send("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def press(self, key: str) -> None:
        self.send("Input.dispatchKeyEvent", type="keyDown", key=key)
        self.send("Input.dispatchKeyEvent", type="keyUp", key=key)

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(10)
        os.close(self._to)
        os.close(self._from)


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("no Chromium on this machine: the page was not driven")
    opened = Browser(program, tmp_path_factory.mktemp("browser"))
    yield opened
    opened.close()


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Any:
    """Write a page, open it, and fail on any fault of its script."""

    def open_page(text: str, hash: str = "") -> Any:
        path = tmp_path / "page.html"
        path.write_text(text, encoding="utf-8")
        browser.open(path, hash)
        assert browser.run("document.documentElement.dataset.error || null") is None
        return browser

    return open_page
