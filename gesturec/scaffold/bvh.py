"""Read the hierarchy of a BVH: offsets and channels in their order, and how far the channels went in its take.

In: a path. Out: a `Skeleton`. Every rotation channel becomes a hinge at its joint's offset, in the order of the
channels, as far as the take shows it or by default 90 degrees to either side; the channels of the root are the body's
own motion. BVH names no unit: metres, as `gesturec` reads its recordings. Position channels of other joints stay at
zero, which is how the format is nearly always used; so do the channels of helper joints, which sit at their parent's
place and never move in the take.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from gesturec.diagnostics.errors import InputError
from gesturec.scaffold.numbers import parse_number
from gesturec.scaffold.tree import ORIGIN, Dof, Floats, Node, Skeleton, Token
from gesturec.scaffold.xml_tree import read_bytes

MAX_BYTES: Final = 256 << 20  # an hour of 60 joints at 120 Hz
MAX_DEPTH: Final = 200
DEFAULT: Final = math.pi / 2  # a rotation channel goes so far to either side, unless a take shows how far it goes
LEVEL: Final = 15  # deg; what a take shows is rounded outwards to multiples
CHANNELS: Final = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")


class _Word(NamedTuple):
    text: str
    line: int


@dataclass
class _Reader:
    """Words of the file one after the other, and the channels in the order of the motion's columns."""

    path: str
    words: Iterator[_Word]
    line: int = 1  # of the last word
    channels: list[tuple[Node, str]] = field(default_factory=list)
    positions: list[str] = field(default_factory=list)  # joints whose position channels are left out

    def next(self) -> _Word:
        word = next(self.words, None)
        if word is None:
            raise InputError("ends in the middle of its hierarchy", self.path, self.line)
        self.line = word.line
        return word

    def expect(self, *texts: str) -> _Word:
        word = self.next()
        if word.text.upper() not in {text.upper() for text in texts}:
            raise InputError(f"`{word.text[:40]}` where {' or '.join(texts)} was expected", self.path, word.line)
        return word

    def offset(self) -> Floats:
        self.expect("OFFSET")
        words = [self.next() for _ in range(3)]
        return np.array([parse_number(word.text, "an OFFSET", self.path, word.line) for word in words])


def read_bvh(path: Path) -> Skeleton:
    """The tree of a BVH file.

    Raises
    ------
    InputError
        With the line of what is wrong.
    """
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("is not text in UTF-8", path) from error
    lines = text.splitlines()
    reader = _Reader(str(path), (_Word(word, k) for k, line in enumerate(lines, 1) for word in line.split()))
    reader.expect("HIERARCHY")
    reader.expect("ROOT")
    root = _joint(reader, 0, is_root=True)
    seen = _seen_ranges(reader, lines)
    helpers = _rigid_helpers(reader.channels, seen)
    _put_ranges(reader.channels, seen)
    notes = ["BVH names no unit: metres are taken, as for recordings; `--set scale=0.01` makes them centimetres"]
    if any(node.dof is not None and node.dof.comment for node, _ in reader.channels):
        notes.append(f"ranges are what this take shows, rounded to {LEVEL} degrees: widen them to what the body can do")
    if helpers:
        notes.append(f"at their parent's place and still through the take, so rigid: {', '.join(helpers)}")
    if root.at.any():
        notes.append("the root's OFFSET is its own motion and left out")
        root.at = ORIGIN
    if reader.positions:
        notes.append(f"position channels are taken to stay at zero: {', '.join(reader.positions)}")
    return Skeleton(root, str(path), "BVH", tuple(notes), limb_per_node=True, endless=False, binding="bvh")


def _joint(reader: _Reader, depth: int, *, is_root: bool = False) -> Node:
    """A ROOT or JOINT after its keyword: the first of its nodes, one a channel; the last carries its children."""
    name = reader.next()
    if depth > MAX_DEPTH:
        raise InputError(f"joints are nested more than {MAX_DEPTH} deep, the limit", reader.path, name.line)
    reader.expect("{")
    first = last = Node(name.text, name.line, reader.offset())
    reader.expect("CHANNELS")
    for kind in _channels(reader):
        node = Node(name.text, name.line, is_helper=not first.at.any())
        if kind.endswith("rotation") and not is_root:
            axis = np.eye(3)["XYZ".index(kind[0])]
            node.dof = Dof(f"turn_{kind[0].lower()}", "hinge", axis)
            last.children.append(node)
            last = node
        elif not is_root and name.text not in reader.positions:
            reader.positions.append(name.text)
        reader.channels.append((node, kind))
    last.tokens.append(Token(name.text))
    _children(reader, last, depth)
    return first


def _channels(reader: _Reader) -> list[str]:
    word = reader.next()
    if not word.text.isascii() or not word.text.isdigit() or len(word.text) > 1 or int(word.text) > 6:
        raise InputError(f"`{word.text[:40]}` is no number of channels (0 to 6)", reader.path, word.line)
    kinds = []
    for _ in range(int(word.text)):
        channel = reader.next()
        kind = channel.text[:1].upper() + channel.text[1:].lower()
        if kind not in CHANNELS:
            raise InputError(f"`{channel.text[:40]}` is no channel", reader.path, channel.line)
        if kind in kinds:
            raise InputError(f"channel `{kind}` is there twice", reader.path, channel.line)
        kinds.append(kind)
    return kinds


def _children(reader: _Reader, node: Node, depth: int) -> None:
    while True:
        word = reader.expect("JOINT", "End", "}")
        if word.text == "}":
            return
        if word.text.upper() == "JOINT":
            node.children.append(_joint(reader, depth + 1))
            continue
        reader.expect("Site")
        reader.expect("{")
        node.tokens.append(Token(f"{node.name}_end", reader.offset()))
        reader.expect("}")


def _seen_ranges(reader: _Reader, lines: list[str]) -> Floats | None:
    """Lowest and highest value of every column in the file's units, shape (2, n); None without frames."""
    word = next(reader.words, None)
    if word is None:
        return None
    if word.text.upper() == "ROOT":
        raise InputError("a second ROOT: a model is one body", reader.path, word.line)
    if word.text.upper() != "MOTION":
        raise InputError(f"`{word.text[:40]}` where MOTION was expected", reader.path, word.line)
    reader.expect("Frames:")
    reader.next()
    reader.expect("Frame")
    reader.expect("Time:")
    first = reader.next().line
    n_column = len(reader.channels)
    low, high = np.full(n_column, np.inf), np.full(n_column, -np.inf)
    for row, line in enumerate(lines[first:], first + 1):
        if not line.strip():
            continue
        values = _frame(line, n_column, reader.path, row)
        low, high = np.minimum(low, values), np.maximum(high, values)
    return np.stack([low, high]) if np.isfinite(low).all() else None


def _frame(line: str, n_column: int, path: str, row: int) -> Floats:
    words = line.split()
    if len(words) != n_column:
        raise InputError(f"{len(words)} values where the hierarchy has {n_column} channels", path, row)
    try:
        values = np.array(words, dtype=np.float64)
    except ValueError:
        values = np.array([parse_number(word, "a frame", path, row) for word in words])
    if not np.isfinite(values).all():
        raise InputError("a value of the frame is not finite", path, row)
    return values


def _rigid_helpers(channels: list[tuple[Node, str]], seen: Floats | None) -> list[str]:
    """Names of joints that only the format needs: at their parent's place, and at zero while others move."""
    if seen is None or not seen.any():
        return []
    moved = {node.name for (node, _), column in zip(channels, seen.T, strict=True) if column.any()}
    helpers = []
    for node, _ in channels:
        if node.dof is not None and node.is_helper and node.name not in moved:
            node.dof = None
            if node.name not in helpers:
                helpers.append(node.name)
    return helpers


def _put_ranges(channels: list[tuple[Node, str]], seen: Floats | None) -> None:
    """What the take shows, rounded outwards, or the default range where there is no take in which anything moves."""
    is_take = seen is not None and bool((seen[0] != seen[1]).any())
    for column, (node, _) in enumerate(channels):
        if node.dof is None:
            continue
        low, high, comment = -DEFAULT, DEFAULT, ""
        if seen is not None and is_take:
            low, high = _rounded(float(seen[0, column]), float(seen[1, column]))
            comment = f"in the take {seen[0, column]:.0f} to {seen[1, column]:.0f}"
        node.dof = replace(node.dof, low=low, high=high, comment=comment)


def _rounded(low: float, high: float) -> tuple[float, float]:
    """A range in degrees, rounded outwards to whole levels, in rad; at least a level to either side of its middle."""
    middle = round((low + high) / 2 / LEVEL)
    first = min(math.floor(low / LEVEL), middle - 1)
    last = max(math.ceil(high / LEVEL), middle + 1)
    if (last - first) * LEVEL >= 360:
        return -math.pi, math.pi
    return math.radians(first * LEVEL), math.radians(last * LEVEL)
