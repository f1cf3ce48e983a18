"""Gestures: patterns parsed, scoped and typed; what they are run by is the runtime's.

In: the gestures' blocks of limbs and of the top. Out: `BodyGesture` with its truths typed and its shape as JSON.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from gesturec.checks import values
from gesturec.checks.body import BodyGesture, BodyLimb, ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.checks.order import inner_first
from gesturec.checks.plausible import LONGEST_PAUSE, suspect_time
from gesturec.checks.scopes import BodyScope, Names
from gesturec.language.document import Text
from gesturec.language.expressions import tree
from gesturec.language.expressions.gestures import check_gesture
from gesturec.language.expressions.parse import ExpressionError, parse_gesture
from gesturec.language.expressions.scope import Gesture as GestureSymbol
from gesturec.language.expressions.scope import Hole, Symbol
from gesturec.language.expressions.units import TIME
from gesturec.language.schema.blocks import Gesture
from gesturec.language.schema.leaf import is_passed

COOLDOWN, PATIENCE = 0.0, 0.3  # s, as the language says


class WrittenGesture(NamedTuple):
    """A gesture as written: its limb (None at the top), key and block, and what it sees."""

    full: str
    limb: BodyLimb | None
    key: Text
    block: Gesture | None  # None: reported already
    environment: Environment


@dataclass(eq=False)
class Gestures:
    """Every gesture of the body; patterns are parsed when first asked for."""

    body: ResolvedBody
    names: Names
    written: dict[str, WrittenGesture]
    parsed: dict[str, tree.Pattern | None] = field(default_factory=dict)
    wrong: set[str] = field(default_factory=set)

    def look_up(self, full: str) -> Symbol | None:
        """A gesture as a symbol; a hole where its pattern is wrong, None where there is none."""
        written = self.written.get(full)
        if written is None:
            return None
        pattern = None if full in self.wrong else self.pattern(written)
        return (
            Hole()
            if pattern is None
            else GestureSymbol(
                full, pattern, self.scope(written), written.limb.name if written.limb is not None else None
            )
        )

    def scope(self, written: WrittenGesture) -> BodyScope:
        """What a gesture sees."""
        return BodyScope(self.body, self.names, written.environment, written.limb, motion=True)

    def pattern(self, written: WrittenGesture) -> tree.Pattern | None:
        """The tree of a gesture's pattern."""
        if written.full not in self.parsed:
            self.parsed[written.full] = self.parse(written)
        return self.parsed[written.full]

    def parse(self, written: WrittenGesture) -> tree.Pattern | None:
        node = written.block.pattern if written.block is not None else None
        if is_passed(node):
            assert node is not None
            found, _ = values.whole(node, written.environment)
            node = found if isinstance(found, Text) else None
        if node is None:
            return None
        try:
            return parse_gesture(node)
        except ExpressionError as error:
            written.environment.findings.add(error.diagnostic)
            return None

    def build(self) -> None:
        """Check every gesture, those that others name before them."""
        patterns = {full: written.block.pattern if written.block else None for full, written in self.written.items()}
        built: dict[str, BodyGesture] = {}
        for full in dict.fromkeys((*inner_first(patterns), *self.written)):
            gesture = self.one(self.written[full])
            if gesture is None:
                self.wrong.add(full)
            else:
                built[full] = gesture
        self.body.gestures = {full: built[full] for full in self.written if full in built}

    def one(self, written: WrittenGesture) -> BodyGesture | None:
        """Check one gesture."""
        environment, block = written.environment, written.block
        if block is None:
            return None
        cooldown = values.positive(block.cooldown, environment, TIME, zero=True)
        patience = values.positive(block.patience, environment, TIME, zero=True)
        suspect_time(block.cooldown, environment, (cooldown,), LONGEST_PAUSE)
        suspect_time(block.patience, environment, (patience,), LONGEST_PAUSE)
        pattern = self.pattern(written)
        checked = None if pattern is None else check_gesture(pattern, self.scope(written), environment.findings)
        if checked is None or block.pattern is None:
            return None
        return BodyGesture(
            written.full,
            written.limb.name if written.limb is not None else None,
            checked,
            str(block.pattern),
            COOLDOWN if cooldown is None else cooldown,
            PATIENCE if patience is None else patience,
            written.key.span,
        )


def written_gestures(body: ResolvedBody, environment: Environment) -> dict[str, WrittenGesture]:
    """Every gesture of limbs and of the top, by full name; of two with one name the first."""
    found: dict[str, WrittenGesture] = {}
    for limb in body.limbs.values():
        for section in limb.sections:
            for key, block in section.block.gestures.items():
                full = f"{limb.name}.{key}"
                found.setdefault(full, WrittenGesture(full, limb, key, block, section.environment))
    for key, block in body.model.main.block.gestures.items():
        found.setdefault(str(key), WrittenGesture(str(key), None, key, block, environment))
    return found
