"""A `Profile` as readable YAML: mm, degrees and seconds, every estimate with its standard error."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping

from gesturec.profile.profile import Motion, Part, Profile, Vector

MM = 1e3
DEG = 180 / math.pi

HEADER = """\
# A person's profile, for `--profile` of gesturec's compile and decode. `at`: where a joint or token sits in the frame
# of the part that carries it, at this person's own size. `turn`: rotation vector by which a joint's rest is turned,
# in its rest frame. `_error`: standard errors, which take frames as independent and so are a lower bound. What is
# not listed could not be told from the recordings and stays the model's, times `scale`.
"""


def profile_text(profile: Profile) -> str:
    """The file's text."""
    return HEADER + "\n".join(_lines(profile)) + "\n"


def _lines(profile: Profile) -> Iterator[str]:
    yield "gesturec: 1"
    yield f"name: {quoted(profile.name)}"
    if profile.description:
        yield f"description: {quoted(profile.description)}"
    yield f"model: {{name: {quoted(profile.model)}, digest: {quoted(profile.digest)}}}"
    yield "units: {length: mm, angle: deg, time: s}"
    if profile.parameters:
        yield "parameters:"
        yield from (f"  {quoted(name)}: {quoted(value)}" for name, value in profile.parameters.items())
    if profile.takes:
        yield "recordings:"
        for take in profile.takes:
            residual = "" if take.residual is None else f", residual: {number(take.residual * MM)}"
            counts = f"frames: {take.frames}, usable: {take.usable}, used: {take.used}"
            yield f"  - {{file: {quoted(take.name)}, {counts}{residual}}}"
    if profile.held_out is not None:
        model, own = (number(value * MM) for value in (profile.held_out.model, profile.held_out.profile))
        yield f"held_out: {{model: {model}, profile: {own}}}"
    yield "body:"
    yield f"  scale: {number(profile.scale, 7)}"
    if profile.scale_error is not None:
        yield f"  scale_error: {number(profile.scale_error)}"
    for key, parts in (("joints", profile.joints), ("tokens", profile.tokens)):
        if parts:
            yield f"  {key}:"
            yield from (f"    {quoted(name)}: {_part(part)}" for name, part in parts.items())
    yield from _noise(profile)
    yield from _motion(profile.motion)


def _part(part: Part) -> str:
    given = [("at", part.at, MM, 6), ("at_error", part.at_error, MM, 3)]
    given += [("turn", part.turn, DEG, 6), ("turn_error", part.turn_error, DEG, 3)]
    said = [f"{key}: {_vector(value, unit, digits)}" for key, value, unit, digits in given if value is not None]
    return "{" + ", ".join(said) + "}"


def _noise(profile: Profile) -> Iterator[str]:
    if profile.noise is None and not profile.token_noise:
        return
    yield "noise:"
    if profile.noise is not None:
        yield f"  points: {number(profile.noise * MM)}"
    if profile.token_noise:
        yield "  tokens:"
        yield from (f"    {quoted(name)}: {number(value * MM)}" for name, value in profile.token_noise.items())


def _motion(motions: Mapping[str, Motion]) -> Iterator[str]:
    if motions:
        yield "motion:"
    for machine, motion in motions.items():
        yield f"  {quoted(machine)}:"
        for key in ("hold", "move", "crossing", "seconds"):
            if getattr(motion, key):
                yield f"    {key}: {number(getattr(motion, key))}"
        if motion.costs:
            yield "    costs:"
            for (source, target), cost in motion.costs.items():
                yield f"      {quoted(f'{source} -> {target}')}: {number(cost)}"


def quoted(text: str) -> str:
    """A text as it may stand in YAML: plain where it is a plain name, else in double quotes."""
    plain = text.replace(".", "").replace("_", "")
    is_name = bool(text) and plain.isascii() and plain.isalnum() and text[0].isalpha()
    return text if is_name and text not in ("null", "Null", "NULL") else json.dumps(text, ensure_ascii=False)


def number(value: float, digits: int = 4) -> str:
    """A number of so many digits."""
    return f"{value:.{digits}g}"


def _vector(vector: Vector, unit: float, digits: int) -> str:
    return "[" + ", ".join(number(component * unit, digits) for component in vector) + "]"
