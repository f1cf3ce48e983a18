"""Write limbs as a model's text, with comments that teach and TODOs where only the author can decide.

In: a `Skeleton`. Out: YAML in mm and degrees, every number so that it reads back as the same float.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Final

import numpy as np

from gesturec.scaffold.limbs import Limb, Moved, Step, all_parts, cut_into_limbs
from gesturec.scaffold.naming import Taken, comment_text, legal
from gesturec.scaffold.numbers import axis_text, degrees, millimetres, number, rest_of_matrix, vector
from gesturec.scaffold.ranges import Cut, cut_dofs
from gesturec.scaffold.tree import ORIGIN, Coupling, Dof, Floats, Rest, Skeleton, Token

WIDTH: Final = 120
SCHEMA_FILE: Final = "gesturec.schema.json"
MODELINE: Final = f"# yaml-language-server: $schema={SCHEMA_FILE}\n"
ON_AXIS: Final = 1e-6  # m; a point nearer to a hinge's axis does not show its angle

Keys = list[tuple[str, str]]


@dataclass
class _Names:
    """What the parts of the source are called in the model."""

    top: Taken = field(default_factory=Taken)
    limb: dict[int, str] = field(default_factory=dict)  # id of a part: its limb
    joint: dict[int, str] = field(default_factory=dict)  # id of a part: its joint, within the limb
    tokens: list[tuple[str, str]] = field(default_factory=list)  # full name and the source's, as they are written
    source: dict[str, Moved] = field(default_factory=dict)  # joint of the source: its part


def skeleton_text(name: str, skeleton: Skeleton) -> str:
    """The model that a skeleton makes, called `name`."""
    root, limbs = cut_into_limbs(skeleton)
    names = _Names(source={part.moving.name: part for part in all_parts(root)[1:]})
    for limb in limbs:
        _name_parts(limb, names)
    lines = [*_head(name, skeleton), *_root_lines(root, skeleton, names)]
    if limbs:
        lines += ["", "limbs:                               # chains of joints; each becomes a machine of its own"]
    for limb in limbs:
        lines += _limb_lines(limb, skeleton, names)
    return "\n".join([*lines, *_binding_lines(skeleton, names), *_foot(limbs, names)]) + "\n"


def _head(name: str, skeleton: Skeleton) -> Iterator[str]:
    yield MODELINE.rstrip()
    source = comment_text(skeleton.path.replace("\\", "/").rsplit("/", 1)[-1])
    yield f"# Made by `gesturec new` from {source} ({skeleton.kind}). `gesturec check` tells what is wrong with it."
    for note in skeleton.notes:
        said = comment_text(note, 10 * WIDTH)
        yield from wrap(said, WIDTH, initial_indent="# - ", subsequent_indent="#   ", break_long_words=False)
    yield from ("gesturec: 1", f"name: {name}", f"description: Made from a file in {skeleton.kind}.")
    yield "units: {length: mm, angle: deg}      # of every bare number below"


def _root_lines(root: Moved, skeleton: Skeleton, names: _Names) -> Iterator[str]:
    yield ""
    yield "root:                                # the part whose frame is the body's own"
    yield f"  name: {Taken().add(skeleton.root.name)}"
    points = np.array([token.at for token in root.tokens]).reshape(-1, 3)
    if len(points) < 3 or np.linalg.matrix_rank(points - points[0], tol=ON_AXIS) < 2:
        yield "  # TODO: three measured points of this part, not on a line, are what shows where the body is"
    yield "  tokens:" if root.tokens else "  tokens: {}"
    for token in root.tokens:
        called = token.name if legal(token.name) not in names.top else f"{token.name}_base"
        called = names.top.add(called)
        names.tokens.append((called, token.name))
        yield f"    {called}: {vector(token.at)}{_comment(token.comment)}"


def _name_parts(limb: Limb, names: _Names) -> None:
    """Name the limb after its first part, and its joints after the source's."""
    first = limb.parts()[0]
    limb_name = names.top.add(first.name)
    taken = Taken()
    for part in limb.parts():
        names.limb[id(part)] = limb_name
        names.joint[id(part)] = taken.add(part.moving.name)


def _limb_lines(limb: Limb, skeleton: Skeleton, names: _Names) -> Iterator[str]:
    parts = limb.parts()
    free = [part for part in parts if part.moving.value is None and part.moving.coupling is None]
    cuts = dict(zip(map(id, free), cut_dofs([part.moving for part in free], skeleton), strict=True))
    counts = [cut.levels for cut in cuts.values()]
    if len(counts) > 1:
        yield f"  # {' x '.join(map(str, counts))} levels = {int(np.prod(counts))} states"
    elif counts:
        yield f"  # {counts[0]} states"
    yield f"  {names.limb[id(parts[0])]}:"
    if limb.parent.dof is not None:
        yield f"    parent: {names.limb[id(limb.parent)]}.{names.joint[id(limb.parent)]}"
    yield "    chain:"
    taken = Taken(*(names.joint[id(part)] for part in parts))
    for keys, comment in _entries(limb, cuts, names, taken):
        yield from _entry_lines(keys, comment)
    hidden = [names.joint[id(part)] for part in free if part.moving.type == "hinge" and not _is_shown(part)]
    if hidden:
        yield f"      # TODO: no token shows the angle of {', '.join(hidden)}: add one off its axis"


def _entries(limb: Limb, cuts: dict[int, Cut], names: _Names, taken: Taken) -> Iterator[tuple[Keys, str]]:
    """The chain's entries in order, each with its comment."""
    for step in limb.steps:
        if step.back:
            yield from _back_entries(step, names, taken)
            continue
        part = step.part
        for at, rest in part.frames:
            keys = _place(at, rest)
            if keys:
                yield keys, ""
        yield _joint_entry(part, cuts.get(id(part)), names)
        for token in part.tokens:
            keys, comment = _token_entry(token, taken)
            names.tokens.append((f"{names.limb[id(part)]}.{keys[0][1]}", token.name))
            yield keys, comment


def _joint_entry(part: Moved, cut: Cut | None, names: _Names) -> tuple[Keys, str]:
    dof = part.moving
    keys = [("joint", names.joint[id(part)]), *_place(part.at, part.rest), *_motion(dof)]
    comment = dof.comment
    if cut is not None:
        keys += cut.keys
        comment = cut.comment
    elif dof.coupling is not None:
        keys.append(("follows", _follows(dof.coupling, dof, names)))
    else:
        keys.append(("value", _value(dof, float(dof.value or 0.0))))
    if np.isfinite(dof.max_speed) and cut is not None:
        speed = degrees(dof.max_speed) + " deg/s" if dof.type == "hinge" else millimetres(dof.max_speed) + " mm/s"
        keys.append(("max_speed", speed))
    return keys, comment


def _token_entry(token: Token, taken: Taken) -> tuple[Keys, str]:
    keys = [("token", taken.add(token.name))]
    if vector(token.at) != "[0, 0, 0]":
        keys.append(("at", vector(token.at)))
    return keys, token.comment


def _back_entries(step: Step, names: _Names, taken: Taken) -> Iterator[tuple[Keys, str]]:
    """Exactly back: the joint the other way round, then its place and the frames before it undone."""
    part = step.part
    dof, name = part.moving, names.joint[id(part)]
    keys = [("joint", taken.add(f"{name}_back")), *_motion(dof)]
    if dof.value is not None:
        keys.append(("value", _value(dof, -dof.value)))
    elif dof.coupling is None:
        keys.append(("follows", f"-1 * {name}"))
    else:
        opposite = Coupling(dof.coupling.other, tuple(-c for c in dof.coupling.coefficients))
        keys.append(("follows", _follows(opposite, dof, names)))
    yield keys, f"back along `{name}`, to where the next joint hangs from"
    for at, rest in [(part.at, part.rest), *reversed(part.frames)]:
        turned = rest.matrix.T
        entry = _place(-(turned @ at), rest_of_matrix(turned) if rest.text else rest)
        if entry:
            yield entry, ""


def _motion(dof: Dof) -> Keys:
    keys = [("type", "slide")] if dof.type == "slide" else []
    return [*keys, ("axis", axis_text(dof.axis))]


def _place(at: Floats, rest: Rest) -> Keys:
    keys = [("at", vector(at))] if vector(at) != "[0, 0, 0]" else []
    return keys + ([("rest", rest.text)] if rest.text else [])


def _value(dof: Dof, value: float) -> str:
    return degrees(value) if dof.type == "hinge" else millimetres(value)


def _follows(coupling: Coupling, dof: Dof, names: _Names) -> str:
    """The coupling as an expression; one that is not linear or joins two kinds counts in radians and metres."""
    part = names.source[coupling.other]
    other, other_type = names.joint[id(part)], part.moving.type
    if len(coupling.coefficients) <= 2 and other_type == dof.type:
        offset, factor = (*coupling.coefficients, 0.0)[:2]
        product = other if factor == 1 else f"{number(factor)} * {other}"
        if offset == 0:
            return product
        unit = "deg" if dof.type == "hinge" else "mm"
        return f"{product} {'-' if offset < 0 else '+'} {_value(dof, abs(offset))} {unit}"
    pure = f"({other} / 1 {_si(other_type)})"
    terms = [
        number(c) if k == 0 else f"{number(c)} * {pure}" + (f" ** {k}" if k > 1 else "")
        for k, c in enumerate(coupling.coefficients)
        if c != 0
    ]
    return f"({' + '.join(terms) or '0'}) * 1 {_si(dof.type)}"


def _si(kind: str) -> str:
    return "rad" if kind == "hinge" else "m"


def _is_shown(part: Moved) -> bool:
    """Whether some token that the hinge moves is off its axis while all that follows is at zero."""
    waiting = [(part, np.eye(3), ORIGIN)]
    while waiting:
        moved, rotation, translation = waiting.pop()
        for token in moved.tokens:
            if np.linalg.norm(np.cross(part.moving.axis, translation + rotation @ token.at)) > ON_AXIS:
                return True
        for child in moved.children:
            turned, shifted = rotation, translation
            for at, rest in [*child.frames, (child.at, child.rest)]:
                turned, shifted = turned @ rest.matrix, shifted + turned @ at
            waiting.append((child, turned, shifted))
    return False


def _comment(text: str) -> str:
    return f"  # {comment_text(text)}" if text else ""


def _entry_lines(keys: Keys, comment: str) -> Iterator[str]:
    """One line in flow style where it fits, else a block."""
    flow = "      - {" + ", ".join(f"{key}: {value}" for key, value in keys) + "}"
    if len(flow) <= WIDTH:
        yield flow + _comment(comment)
        return
    for k, (key, value) in enumerate(keys):
        yield f"      {'- ' if k == 0 else '  '}{key}: {value}" + (_comment(comment) if k == 0 else "")


def _binding_lines(skeleton: Skeleton, names: _Names) -> Iterator[str]:
    """The names that recordings of the same origin give to the tokens."""
    if skeleton.binding is None or not names.tokens:
        return
    yield from (
        "",
        "bindings:                            # what recordings call these tokens",
        f"  {skeleton.binding}:",
    )
    yield "    tokens:"
    for name, theirs in names.tokens:
        quoted = theirs.replace("\\", "\\\\").replace('"', '\\"')
        yield f'      {name}: "{quoted}"' if legal(theirs) != theirs else f"      {name}: {theirs}"


def _foot(limbs: list[Limb], names: _Names) -> Iterator[str]:
    """What to write next, with this body's own names."""
    free = [
        part for limb in limbs for part in limb.parts() if part.moving.value is None and part.moving.coupling is None
    ]
    if not free:
        return
    limb, joint = names.limb[id(free[0])], names.joint[id(free[0])]
    yield from (
        "",
        "# What to say next, where you need it:",
        "# constraints:                       # combinations of levels that the body cannot take, or seldom takes",
        f"#   - {{name: shy, prefer: abs({limb}.{joint}) <= 60 deg, cost: 1}}",
        "# poses:                             # names for what you look for",
        f"#   ready: {{{limb}: {{{joint}: 0 +- 30}}}}",
        "# gestures:",
        "#   rest: ready for 0.5 s",
    )
