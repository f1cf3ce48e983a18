"""`gesturec demo`: the whole way once, from the shipped hand to a page, in a few seconds."""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any, Final

from gesturec.cli.output import check_folder, text_output
from gesturec.shipped import shipped_models

PATH: Final = ("flat", "fist", "flat")
DURATION: Final = 3.0  # s: each way takes as long as the paper's fist
NOISE: Final = 0.002  # m, of every coordinate: what two cameras a metre away see
SURE: Final = 0.5  # a state is told when it is likelier than not; else it is hatched
LAG: Final = 0.08  # s: the default of `gesturec decode`
# Long enough for a hidden finger's state to become a guess, so that the page shows what is deferred.
HIDDEN: Final = ("index@0.6-2.3", "little@1.0-2.5", "thumb.tip@1.8-2.1")
UNSEEN: Final = "coasting"  # status of a machine whose last state is carried on


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--no-open", action="store_true", help="do not open the page in a browser")
    parser.add_argument(
        "-o", "--output", metavar="F.html", help="where to write the page (default: a new folder for such)"
    )
    parser.add_argument("--json", action="store_true", help="say what was done as JSON")


def run(options: Namespace) -> int:
    """Compile, simulate, decode, show."""
    if options.output is not None:
        check_folder(Path(options.output))
    began = time.perf_counter()
    facts, page = _demo()
    output = options.output or str(Path(tempfile.mkdtemp(prefix="gesturec-demo-")) / "demo.html")
    with text_output(output) as stream:
        stream.write(page)
    facts |= {"page": output, "seconds": round(time.perf_counter() - began, 3)}
    if options.json:
        print(json.dumps(facts, indent=2))
    else:
        _tell(facts)
    if not options.no_open:
        _open(output)
    return 0


def _demo() -> tuple[dict[str, Any], str]:
    """What was done, and the page."""
    import numpy as np

    from gesturec.compile import compile_artifact
    from gesturec.runtime.decode import decode
    from gesturec.simulate.hiding import parse_hidden
    from gesturec.simulate.simulation import SimulateOptions, simulate
    from gesturec.view.page import render_page

    artifact = compile_artifact(shipped_models()["hand"])
    hidden = tuple(parse_hidden(text, artifact.manifest) for text in HIDDEN)
    take = simulate(artifact, SimulateOptions(PATH, DURATION, noise=NOISE, hidden=hidden, seed=1))
    decoding = decode(artifact, take.recording, lag=LAG, sure=SURE)
    decided = decoding.state >= 0
    exact = decoding.state == take.truth.state
    machines = artifact.manifest.machines
    carried = np.array([[frame[name].status == UNSEEN for name in machines] for frame in decoding.why])
    facts = {
        "machines": list(machines),
        "states": int(artifact.columns["machine_state_count"].sum()),
        "frames": len(decoding.time),
        "hidden": list(HIDDEN),
        "noise": NOISE,
        "decided": float(decided.mean()),
        "deferred": {name: float(share) for name, share in zip(machines, (~decided).mean(0), strict=True)},
        "carried": float((decided & carried).mean()),
        "exact": float(exact[decided].mean()),
        "exact_seen": float(exact[decided & ~carried].mean()),
        "exact_carried": float(exact[decided & carried].mean()),
    }
    return facts, render_page(artifact, decoding, "a noisy fist, with fingers hidden")


def _tell(facts: dict[str, Any]) -> None:
    """The facts as text."""
    print(f"compiled  the shipped hand: {len(facts['machines'])} machines, {facts['states']:,} states")
    noise = f"{facts['noise'] * 1000:g} mm noise"
    print(f"simulated {' -> '.join(PATH)}: {facts['frames']} frames, {noise}, hidden {', '.join(HIDDEN)}")
    seen = facts["decided"] - facts["carried"]
    print(
        f"decoded   {seen:.1%} of all states from what is seen, {facts['exact_seen']:.1%} of them exactly as simulated"
    )
    carried = f"{facts['exact_carried']:.1%} of them exactly"
    print(f"carried   {facts['carried']:.1%} on from before their finger was hidden, {carried}")
    most = ", ".join(f"{name} {share:.1%}" for name, share in facts["deferred"].items() if share)
    print(f"undecided {1 - facts['decided']:.1%}, hatched on the page: {most}")
    print(f"page      {facts['page']}  ({facts['seconds']:g} s in all)")


def _open(page: str) -> None:
    """Show the page where there is something to show it on."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        print("          (no display here: open it in a browser)", file=sys.stderr)
        return
    import webbrowser

    webbrowser.open(Path(page).resolve().as_uri())
