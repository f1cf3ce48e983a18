"""Options that say what a recording does not say itself, shared by the commands that read one."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from gesturec.cli.usage import count, positive, ratio

if TYPE_CHECKING:
    from gesturec.recordings.recording import Recording

LIMITS = ("max_values", "max_points", "max_line")


def add_recording_options(parser: ArgumentParser) -> None:
    """`--units`, `--rig`, `--noise-px`, `--aspect`, and the limits `--max-values`, `--max-points`, `--max-line`."""
    parser.add_argument(
        "--units", metavar="UNIT", help="unit of the recording's lengths (default: what it states, else m)"
    )
    parser.add_argument(
        "--rig", metavar="RIG.yaml", help="cameras of a folder of labelled pixels (default: its rig.yaml)"
    )
    parser.add_argument("--noise-px", type=positive, metavar="PX", help="standard deviation of a pixel coordinate")
    parser.add_argument(
        "--aspect",
        type=ratio,
        metavar="W:H",
        help="shape of the picture whose shares x and y are, like 16:9 (default: 1:1)",
    )
    parser.add_argument("--max-values", type=count, metavar="N", help="most numbers that are read from a recording")
    parser.add_argument("--max-points", type=count, metavar="N", help="most points of a recording")
    parser.add_argument("--max-line", type=count, metavar="N", help="most characters of a line of a recording's text")


def read_recording(path: str, options: Namespace) -> Recording:
    """Read the recording that an argument names."""
    from gesturec.recordings.read import read

    return read(
        path,
        options.units,
        rig=options.rig,
        noise_px=options.noise_px,
        aspect=options.aspect,
        **{name: given for name in LIMITS if (given := getattr(options, name)) is not None},
    )
