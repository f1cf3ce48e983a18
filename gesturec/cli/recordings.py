"""Options that say what a recording does not say itself, shared by the commands that read one."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from gesturec.cli.usage import count, positive

if TYPE_CHECKING:
    from gesturec.recordings.recording import Recording


def add_recording_options(parser: ArgumentParser) -> None:
    """`--units`, `--rig`, `--noise-px`, `--max-values`."""
    parser.add_argument(
        "--units", metavar="UNIT", help="unit of the recording's lengths (default: what it states, else m)"
    )
    parser.add_argument(
        "--rig", metavar="RIG.yaml", help="cameras of a folder of labelled pixels (default: its rig.yaml)"
    )
    parser.add_argument("--noise-px", type=positive, metavar="PX", help="standard deviation of a pixel coordinate")
    parser.add_argument("--max-values", type=count, metavar="N", help="most numbers that are read from a recording")


def read_recording(path: str, options: Namespace) -> Recording:
    """Read the recording that an argument names."""
    from gesturec.recordings.limits import DEFAULT_MAX_VALUES
    from gesturec.recordings.read import read

    return read(
        path,
        options.units,
        rig=options.rig,
        noise_px=options.noise_px,
        max_values=options.max_values or DEFAULT_MAX_VALUES,
    )
