"""`gesturec fit MODEL RECORDING... -o PROFILE.yaml`: one person's lengths and rests, the noise, how limbs move."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gesturec.cli.models import add_model_options, load_artifact
from gesturec.cli.output import check_folder, text_output
from gesturec.cli.progress import progress
from gesturec.cli.recordings import add_recording_options, read_recording
from gesturec.cli.usage import UsageError, count, counted
from gesturec.diagnostics.errors import InputError

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact
    from gesturec.fit.person import Fit
    from gesturec.profile.profile import Profile

ODD_SIZE = 2.0  # infants' hands are 0.4, giants' 1.2 times a grown-up's
MUCH_RESIDUAL = 0.06  # of the reach of the root's tokens: 5 mm on a hand, more than any tracker's jitter

EPILOG = """The recordings are of one person. What they do not show stays the model's. PROFILE.yaml is given to compile
or decode with --profile, beside the same --set; its own comments say what stands in it."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, .gcm, a shipped name)")
    parser.add_argument("recordings", metavar="RECORDING", nargs="+", help="a recording; - is CSV on standard input")
    parser.add_argument("-o", "--output", required=True, metavar="PROFILE.yaml", help="the file (- is standard output)")
    add_model_options(parser)
    add_recording_options(parser)
    parser.add_argument(
        "--bind", metavar="NAME|MAP.yaml", help="whose names the points have (default: the one that fits)"
    )
    parser.add_argument("--frames", type=count, metavar="N", help="most frames adjusted together (default: 250)")
    parser.add_argument(
        "--costs", action="store_true", help="costs of transitions for grids too, then decoded on their levels alone"
    )
    parser.add_argument("--json", action="store_true", help="the summary as JSON")


def run(options: Namespace) -> int:
    """Fit, write, and say what was found."""
    from gesturec.profile.write import profile_text

    if options.output != "-":
        check_folder(Path(options.output))
    artifact = load_artifact(options.model, options)
    if artifact.manifest.profile:
        raise UsageError("the model has a fitted body already; fit starts from the model as it was written")
    if artifact.manifest.bodies:
        raise UsageError("the model has several bodies; fit each by its own model, with a recording of it alone")
    fit = _fit(artifact, options)
    with text_output(options.output) as stream:
        stream.write(profile_text(fit.profile))
    _report(fit, options)
    return 0


def _fit(artifact: Artifact, options: Namespace) -> Fit:
    from gesturec.fit.frames import MAX_FRAMES
    from gesturec.fit.person import fit_profile

    recordings = [read_recording(path, options) for path in options.recordings]
    with progress(1 + len(recordings), "fitting") as advance:
        try:
            return fit_profile(
                artifact,
                recordings,
                bind=_binding(options.bind),
                parameters=_parameters(options),
                with_costs=options.costs,
                most_frames=options.frames or MAX_FRAMES,
                advance=advance,
            )
        except ValueError as error:
            raise InputError(str(error), " ".join(options.recordings)) from error


def _binding(bind: str | None) -> Any:
    """A binding's name, or the mapping in its file."""
    if bind is None or Path(bind).suffix not in (".yaml", ".yml"):
        return bind
    from gesturec.recordings.plain_yaml import load_plain_yaml

    found = load_plain_yaml(bind)
    if not isinstance(found, dict):
        raise UsageError(f"{bind} is not a binding: a mapping of our tokens to their names")
    return found


def _parameters(options: Namespace) -> dict[str, str]:
    """What the model was compiled with: the settings, over those of a profile of parameters."""
    if options.profile is None:
        return dict(options.settings)
    from gesturec.language.findings import Findings
    from gesturec.profile.read import read_profile

    located = read_profile(options.profile, Findings())  # the compile has found its faults
    return {**(located.profile.parameters if located is not None else {}), **dict(options.settings)}


def facts(profile: Profile) -> dict[str, Any]:
    """What was found, as plain data; lengths in m, times in s."""
    return {
        "model": profile.model,
        "digest": profile.digest,
        "scale": profile.scale,
        "scale_error": profile.scale_error,
        "noise": profile.noise,
        "held_out": None if profile.held_out is None else {**vars(profile.held_out)},
        "joints": len(profile.joints),
        "tokens": len(profile.tokens),
        "recordings": [{**vars(take)} for take in profile.takes],
        "motion": {
            name: {"hold": m.hold, "move": m.move, "crossing": m.crossing, "seconds": m.seconds}
            for name, m in profile.motion.items()
        },
    }


def _report(fit: Fit, options: Namespace) -> None:
    stream = sys.stderr if options.output == "-" else sys.stdout
    profile = fit.profile
    warnings = warnings_of(fit)
    if options.json:
        summary = {**facts(profile), "warnings": warnings, "file": options.output}
        print(json.dumps(summary, indent=2, ensure_ascii=False), file=stream)
        return
    for warning in warnings:
        print(warning, file=sys.stderr)
    used = sum(take.used for take in profile.takes)
    noise = 1e3 * fit.adjusted.noise
    told = f"{len(profile.joints)} joints and {len(profile.tokens)} tokens placed from {counted(used, 'frame')}"
    print(
        f"{profile.model}: size {profile.scale:.4g}, {told}, noise {noise:.2g} mm -> {options.output}",
        file=stream,
    )
    if profile.held_out is not None:
        model, own = 1e3 * profile.held_out.model, 1e3 * profile.held_out.profile
        print(f"  frames held out: {own:.3g} mm left by fitted lengths, {model:.3g} mm by the model's", file=stream)


def warnings_of(fit: Fit) -> list[str]:
    """What makes a profile doubtful: a size or residuals that no person explains."""
    profile, reach = fit.profile, fit.layout.reach * fit.profile.scale
    warnings = []
    if not 1 / ODD_SIZE < profile.scale < ODD_SIZE:
        warnings.append(
            f"warning: SIZE: the body comes out {profile.scale:.3g} times the model's; is the recording's unit right "
            "(--units), and is it metric in every direction?"
        )
    left = profile.held_out
    if left is None:
        warnings.append("warning: NOT CHECKED: too few frames to hold some out; whether the profile helps is not known")
    elif not left.is_better:
        warnings.append(
            f"warning: NOT BETTER: frames that were held out are left with {1e3 * left.profile:.3g} mm a coordinate "
            f"by fitted lengths and {1e3 * left.model:.3g} mm by the model's: the profile keeps the size alone"
        )
    if fit.adjusted.noise > MUCH_RESIDUAL * reach:
        warnings.append(
            f"warning: MISFIT: residuals of {1e3 * fit.adjusted.noise:.2g} mm a coordinate are left; another body, the "
            "other hand (--set side=...), another binding (--bind), or points that no rigid segments carry?"
        )
    return warnings
