"""`gesturec simulate MODEL --path "flat -> fist" -o TAKE.csv`: a take, and beside it TAKE.truth.csv."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from gesturec.cli.models import add_model_options, load_artifact
from gesturec.cli.output import binary_output, check_folder, text_output
from gesturec.cli.usage import UsageError, counted, length, positive, positive_duration, positive_length

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact
    from gesturec.recordings.rig import Rig
    from gesturec.simulate.simulation import SimulateOptions, Simulation

EPILOG = (
    'example: gesturec simulate hand --path "flat -> fist -> flat" --noise 2mm --hide index.tip@0.3-0.6 -o take.csv'
)


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, .gcm, a shipped name)")
    add_model_options(parser)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--path", metavar='"A -> B -> C"', help="poses to go through")
    what.add_argument("--gesture", metavar="NAME", help="a gesture of the model that is a path of poses")
    what.add_argument("--random", action="store_true", help="random configurations")
    parser.add_argument("--duration", type=positive_duration, default=1.0, metavar="TIME", help="length (default: 1s)")
    parser.add_argument("--rate", type=positive, default=25.0, metavar="HZ", help="frames a second (default: 25)")
    parser.add_argument(
        "--noise", type=length, default=0.0, metavar="LENGTH", help="noise of every coordinate, like 2mm"
    )
    parser.add_argument("--rig", metavar="RIG.yaml", help="cameras; the take is then a folder with their pixels")
    parser.add_argument("--noise-px", type=positive, metavar="PX", help="noise of every pixel coordinate (with --rig)")
    parser.add_argument(
        "--hide", action="append", default=[], metavar="TOKEN@0.3-0.6", help="tokens not seen, and when (s)"
    )
    parser.add_argument(
        "--apart", type=positive_length, metavar="LENGTH", help="from each of several bodies to the next, like 40cm"
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of all that is random (default: 1)")
    parser.add_argument(
        "-o", "--output", required=True, metavar="TAKE.csv", help="the take: .csv, .npz, - or, with --rig, a folder"
    )
    parser.add_argument("--json", action="store_true", help="say what was made as JSON")


def run(options: Namespace) -> int:
    """Simulate and write."""
    from gesturec.recordings.rig import load_rig
    from gesturec.simulate.simulation import simulate

    output = Path(options.output)
    _check_usage(options, output)
    artifact = load_artifact(options.model, options)
    rig = None if options.rig is None else load_rig(options.rig)
    settings = _simulate_options(artifact, options)
    _warn_of_late(settings, options.hide)
    take = simulate(artifact, settings, rig)
    written = (
        _write_folder(artifact, take, rig, options) if rig is not None else _write_file(artifact, take, options.output)
    )
    frames, points = take.recording.points.shape[:2]
    if options.json:
        facts = {"frames": frames, "points": points, "files": written}
        print(json.dumps(facts, indent=2), file=sys.stderr if options.output == "-" else sys.stdout)
    elif options.output != "-":
        print(f"{counted(frames, 'frame')} of {counted(points, 'point')} -> {', '.join(written)}")
    return 0


def _check_usage(options: Namespace, output: Path) -> None:
    """What argparse cannot see."""
    if options.noise < 0:
        raise UsageError("--noise is negative")
    if options.seed < 0:
        raise UsageError("--seed is negative")
    if options.rig is not None:
        if options.noise:
            raise UsageError("with --rig the noise is that of pixels: --noise-px")
        if output.suffix or options.output == "-":
            raise UsageError("with --rig the take is a folder: -o takes a name without a suffix")
        return
    if options.noise_px is not None:
        raise UsageError("--noise-px needs --rig")
    if options.output != "-":
        if output.suffix not in (".csv", ".npz"):
            raise UsageError(f"-o takes `.csv` or `.npz`, not `{output.suffix}`")
        check_folder(output)


def _warn_of_late(settings: SimulateOptions, given: list[str]) -> None:
    """Say which `--hide` begins after the take has ended, and so hides nothing."""
    for text, hidden in zip(given, settings.hidden, strict=True):
        if hidden.start > settings.duration:
            print(
                f"warning: --hide: `{text}` begins after the take, which lasts {settings.duration:g} s", file=sys.stderr
            )


def _simulate_options(artifact: Artifact, options: Namespace) -> SimulateOptions:
    """The command line as `SimulateOptions`."""
    from gesturec.simulate.hiding import parse_hidden
    from gesturec.simulate.paths import gesture_path, parse_path
    from gesturec.simulate.simulation import SimulateOptions

    path: tuple[str, ...] = ()
    if options.path is not None:
        path = parse_path(options.path)
    elif options.gesture is not None:
        path = gesture_path(artifact.manifest, options.gesture)
    return SimulateOptions(
        path=path,
        duration=options.duration,
        rate=options.rate,
        noise=options.noise,
        noise_px=options.noise_px or 0.0,
        hidden=tuple(parse_hidden(text, artifact.manifest) for text in options.hide),
        seed=options.seed,
        apart=options.apart,
    )


def _write_file(artifact: Artifact, take: Simulation, output: str) -> list[str]:
    """The take and, beside a file, its truth."""
    from gesturec.recordings.npz import save_npz
    from gesturec.recordings.results import write_states
    from gesturec.recordings.wide_csv import write_csv

    if output == "-":
        write_csv(take.recording, sys.stdout)
        return ["-"]
    truth = truth_path(Path(output))
    with ExitStack() as files:
        write_states(artifact, take.truth, files.enter_context(text_output(truth)))
        if Path(output).suffix == ".npz":
            save_npz(take.recording, files.enter_context(binary_output(output)))
        else:
            write_csv(take.recording, files.enter_context(text_output(output)))
    return [output, str(truth)]


def _write_folder(artifact: Artifact, take: Simulation, rig: Rig, options: Namespace) -> list[str]:
    """A folder with a table of pixels a camera and the rig, and the truth beside it."""
    from gesturec.recordings.results import write_states
    from gesturec.recordings.wide_csv import write_table

    assert take.pixels is not None
    folder = Path(options.output)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder} exists already and is not an empty folder")
    rig_text = Path(options.rig).read_bytes()
    folder.mkdir(exist_ok=True)
    truth = truth_path(folder)
    with ExitStack() as files:
        files.enter_context(binary_output(folder / "rig.yaml")).write(rig_text)
        for camera, pixels in zip(rig.cameras, take.pixels, strict=True):
            stream = files.enter_context(text_output(folder / f"{camera.name}.csv"))
            write_table(stream, take.recording.time, take.recording.names, ("u", "v"), pixels)
        write_states(artifact, take.truth, files.enter_context(text_output(truth)))
    return [str(folder), str(truth)]


def truth_path(take: Path) -> Path:
    """TAKE.truth.csv of TAKE.csv, TAKE.npz or the folder TAKE."""
    return take.with_name(f"{take.stem if take.suffix else take.name}.truth.csv")
