"""Gesture patterns: scoped and typed, and brought into the form that the artifact keeps.

In: a pattern's tree and the scope that it is written in. Out: a `CheckedGesture`: its truths as typed expressions
and its shape as JSON, in which a truth is its index. What `&`, `|` and `not` make of truths alone is one truth; a
gesture's name stands for its pattern in brackets, seen in the scope where that is written.

The shapes::

    {"truth": 0}                                          begins an episode
    {"enter": 0}, {"leave": 0}                            moments
    {"held": 0, "least": 0.5, "most": null}               `for 0.5 s`; "decided" is "start" for `for d`, else "end"
    {"sequence": [shape, …], "by": ["->", …]}
    {"choice": [shape, …]}
    {"repeat": shape, "least": 2, "most": null}
    {"within": shape, "time": 1.5}

Times are in seconds.
"""
# A hole is None, and what reports a mistake returns it.
# mypy: disable-error-code="func-returns-value"

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Final, NamedTuple

from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.expressions import scope, tree
from gesturec.language.expressions.check import check
from gesturec.language.expressions.constant import interval_of, number_of
from gesturec.language.expressions.typed import TRUTH, Typed
from gesturec.language.expressions.units import TIME
from gesturec.language.findings import Findings
from gesturec.language.limits import raised_by

Shape = dict[str, Any]

# Words that a pattern knows and no scope does.
OTHER_WORDS: Final = frozenset(("still", "root", "world", "prev", "next"))
# A bare time beyond this, in s, is rather one in ms.
LONGEST_BARE_TIME: Final = 60.0
# Relative; sums of times are a few roundings off.
ROUNDING: Final = 1e-9


class CheckedGesture(NamedTuple):
    """A pattern's truths, and its shape over them; `places` are those of the shape's `leaves`."""

    truths: tuple[Typed, ...]
    shape: Shape
    span: Span
    places: tuple[Span, ...] = ()

    @property
    def is_truth(self) -> bool:
        """Whether it is one truth, which lasts as long as its episode."""
        return "truth" in self.shape


def check_gesture(pattern: tree.Pattern, place: scope.Scope, findings: Findings) -> CheckedGesture | None:
    """The checked form of a pattern, or None after a finding."""
    walk = Patterns(findings)
    made = walk.check(pattern, place)
    if made is None:
        return None
    if least_steps(made.shape) == 0:
        message = "the pattern can be met by nothing happening"
        return findings.report("bad-pattern", message, pattern.span, "every step may be left out")
    suspect(walk, made, findings)
    shape = walk.finished(made)
    places = tuple(walk.places[id(leaf)] for leaf in leaves(shape))
    return CheckedGesture(tuple(walk.truths), shape, pattern.span, places)


class Part(NamedTuple):
    """A part of a pattern: a truth that is still to be joined with others, or a shape."""

    span: Span
    truth: Typed | None = None
    inner: Shape | None = None

    @property
    def shape(self) -> Shape:
        """The shape, of a truth not yet numbered too."""
        return self.inner if self.inner is not None else {"truth": self.truth}


@dataclass
class Patterns:
    """The walk over one pattern and the gestures that it names."""

    findings: Findings
    truths: list[Typed] = field(default_factory=list)
    open: list[str] = field(default_factory=list)
    limbs: list[str | None] = field(default_factory=list)
    places: dict[int, Span] = field(default_factory=dict)  # by the id of a leaf's mapping
    steps: int = 0

    def check(self, node: tree.Pattern, place: scope.Scope) -> Part | None:
        """A pattern in its scope."""
        if self.steps > self.findings.limits.steps:
            return None
        match node:
            case tree.Path():
                return self.path(node, place)
            case tree.Expression():
                return self.truth(check(node.expression, place, TRUTH, self.findings))
            case tree.Moment():
                truth = self.truth(check_truth(node.truth, place, self.findings))
                return truth and Part(node.span, None, self.leaf({node.edge: self.number(truth)}, node.span))
            case tree.Negation():
                truth = self.must_be_truth(self.check(node.operand, place), "`not`")
                return truth and self.joined("not", [truth], node.span)
            case tree.Both():
                return self.both(node, place)
            case tree.Either():
                return self.either(node, place)
            case tree.Repeat():
                inner = self.check(node.operand, place)
                return inner and Part(
                    node.span, None, {"repeat": self.finished(inner), "least": node.least, "most": node.most}
                )
            case tree.Held():
                return self.held(node, place)
            case tree.Sequence():
                return self.sequence(node, place)
            case tree.Within():
                return self.within(node, place)

    def path(self, node: tree.Path, place: scope.Scope) -> Part | None:
        """A pose, state or phase, or a gesture."""
        words = tuple(name.text for name in node.names)
        symbol = scope.Hole() if node.parameter else place.resolve(words)
        if isinstance(symbol, scope.Unknown) and words[0] not in OTHER_WORDS:
            return self.unknown(symbol, node, place)
        if not isinstance(symbol, scope.Gesture):
            return self.truth(check(node, place, TRUTH, self.findings))
        if symbol.full in self.open:
            message = f"the gesture `{symbol.full}` is made of itself"
            return self.findings.report(
                "circular-reference", message, node.span, "", " -> ".join([*self.open, symbol.full])
            )
        if symbol.pattern is None:
            return None
        limits = self.findings.limits
        if len(self.open) > limits.nesting:
            self.steps = limits.steps + 1  # nothing more is looked at: there may be two ways on at every step
            message = f"gestures are made of gestures more than {limits.nesting} deep"
            return self.findings.report_once("limit-exceeded", message, node.span, raised_by("nesting"))
        self.open.append(symbol.full)
        self.limbs.append(symbol.limb)
        part = self.check(symbol.pattern, symbol.scope)
        self.limbs.pop()
        self.open.pop()
        return part and Part(node.span, part.truth, part.inner)

    def unknown(self, symbol: scope.Unknown, node: tree.Path, place: scope.Scope) -> None:
        """The finding for a name that is not there; what is suggested may stand in a pattern."""
        words = tuple(name.text for name in node.names)
        before = words[: symbol.position]
        found = {word: place.resolve((*before, word)) for word in symbol.known}
        known = [w for w, each in found.items() if may_stand(each) or isinstance(each, scope.Hole) or w == "still"]
        name = node.names[symbol.position]
        self.findings.report(symbol.rule, symbol.message, name.span, "", symbol.help or did_you_mean(name.text, known))

    def seen(self, typed: Typed) -> Typed:
        """A truth with the limb in whose mirrors it is seen, where that is a named gesture's and not the pattern's."""
        limb = next((limb for limb in reversed(self.limbs) if limb is not None), None)
        if limb is None or typed.op == "pose" or typed.constant is not None:
            return typed
        return Typed("seen_from", TRUTH, typed.span, (typed,), (scope.SeenFrom(limb),))

    def truth(self, typed: Typed | None) -> Part | None:
        """A truth; counts as a step."""
        self.steps += 1
        most = self.findings.limits.steps
        if self.steps == most + 1 and typed is not None:
            message = f"the pattern, with the gestures that it names, has more than {most:,} steps"
            self.findings.report_once("limit-exceeded", message, typed.span, raised_by("steps"))
        if typed is None or self.steps > most:
            return None
        return Part(typed.span, self.seen(typed))

    def number(self, part: Part) -> int:
        """The index of a truth, the same for the same truth."""
        assert part.truth is not None
        key = same(part.truth)
        for i, truth in enumerate(self.truths):
            if same(truth) == key:
                return i
        self.truths.append(part.truth)
        return len(self.truths) - 1

    def finished(self, part: Part) -> Shape:
        """The shape of a part, its truth numbered."""
        return part.inner if part.inner is not None else self.leaf({"truth": self.number(part)}, part.span)

    def leaf(self, shape: Shape, span: Span) -> Shape:
        """A step's shape, and where the step is written."""
        self.places[id(shape)] = span
        return shape

    def must_be_truth(self, part: Part | None, taker: str) -> Part | None:
        """A part that must be a truth."""
        if part is None or part.truth is not None:
            return part
        message = f"{taker} takes a truth, and this is {what_it_is(part.shape)}"
        return self.findings.report("not-a-truth", message, part.span, "not a truth")

    def joined(self, op: str, parts: list[Part], span: Span) -> Part:
        """What `&`, `|` or `not` makes of truths alone."""
        return Part(span, Typed(op, TRUTH, span, tuple(part.truth for part in parts if part.truth is not None)))

    def both(self, node: tree.Both, place: scope.Scope) -> Part | None:
        """`p & q`"""
        parts = [self.must_be_truth(self.check(operand, place), "`&`") for operand in node.operands]
        there = [part for part in parts if part is not None]
        return self.joined("and", there, node.span) if len(there) == len(parts) else None

    def either(self, node: tree.Either, place: scope.Scope) -> Part | None:
        """`p | q`: of truths alone a truth, else a choice."""
        parts = [self.check(operand, place) for operand in node.operands]
        there = [part for part in parts if part is not None]
        if len(there) < len(parts):
            return None
        if all(part.truth is not None for part in there):
            return self.joined("or", there, node.span)
        return Part(node.span, None, {"choice": [self.finished(part) for part in there]})

    def held(self, node: tree.Held, place: scope.Scope) -> Part | None:
        """`p for d`, `p for a .. b`"""
        part = self.must_be_truth(self.check(node.operand, place), "`for`")
        self.suspect_time(node.time)
        if isinstance(node.time, tree.Interval):
            ends = interval_of(node.time, place, TIME, self.findings)
            decided = "end"
        else:
            least = number_of(node.time, place, TIME, self.findings)
            ends, decided = (None if least is None else (least, math.inf)), "start"
        if part is None or ends is None:
            return None
        low, high = max(ends[0], 0.0), ends[1]
        if (decided == "start" and ends[0] <= 0.0) or high <= 0.0 or (ends[0] < 0.0 and math.isfinite(ends[0])):
            return self.findings.report(
                "value-out-of-range",
                f"`{node.time.span.text}` is no time that something can last",
                node.time.span,
                "must be above zero",
            )
        shape = {
            "held": self.number(part),
            "least": low,
            "most": high if math.isfinite(high) else None,
            "decided": decided,
        }
        return Part(node.span, None, self.leaf(shape, node.span))

    def suspect_time(self, time: tree.Expr | tree.Interval) -> None:
        """Warn of a bare time that is longer than a gesture is: it is in s, and ms were probably meant."""
        numbers = tree.children(time) if isinstance(time, tree.Interval) else (time,)
        bare = [node.value for node in numbers if isinstance(node, tree.Number) and node.unit is None]
        if bare and max(bare) > LONGEST_BARE_TIME:
            message = f"`{time.span.text}` is {max(bare):g} s: bare times are in s"
            help = f"write the unit: `{max(bare):g} ms`, or `{max(bare):g} s` if this is meant"
            self.findings.report("time-suspected", message, time.span, "seconds", help)

    def sequence(self, node: tree.Sequence, place: scope.Scope) -> Part | None:
        """`a -> b ->> c`"""
        parts = [self.check(step, place) for step in node.steps]
        there = [part for part in parts if part is not None]
        if len(there) < len(parts):
            return None
        return Part(node.span, None, {"sequence": [self.finished(part) for part in there], "by": list(node.operators)})

    def within(self, node: tree.Within, place: scope.Scope) -> Part | None:
        """`p within d`"""
        part = self.check(node.operand, place)
        self.suspect_time(node.time)
        time = number_of(node.time, place, TIME, self.findings)
        if part is None or time is None:
            return None
        if time <= 0.0:
            return self.findings.report(
                "value-out-of-range",
                f"`{node.time.span.text}` is no time to do something in",
                node.time.span,
                "must be above zero",
            )
        if part.truth is not None:
            message = "`within` bounds the time of several steps, and this is one truth"
            return self.findings.report(
                "bad-pattern", message, node.span, "", "`for a .. b` bounds how long a truth holds"
            )
        return Part(node.span, None, {"within": self.finished(part), "time": time})


def may_stand(symbol: scope.Symbol) -> bool:
    """Whether a name is a truth or gesture, or has some in it."""
    return isinstance(symbol, scope.Pose | scope.StateTest | scope.LevelTest | scope.Gesture | scope.Limb)


def check_truth(node: tree.Expr, place: scope.Scope, findings: Findings) -> Typed | None:
    """The truth in the brackets of `enter` and `leave`."""
    return check(node, place, TRUTH, findings)


def same(typed: Typed) -> tuple[Any, ...]:
    """What makes two truths the same wherever they are written."""
    return (typed.op, typed.argument, typed.symbols, typed.constant, tuple(same(operand) for operand in typed.operands))


def what_it_is(shape: Shape) -> str:
    """What a shape is called in messages."""
    words = {
        "sequence": "a sequence",
        "choice": "a choice with moments or sequences",
        "repeat": "a repetition",
        "within": "a bounded sequence",
    }
    words |= {"held": "a truth held for a time", "enter": "a moment", "leave": "a moment"}
    return next(word for key, word in words.items() if key in shape)


def leaves(shape: Shape) -> Iterator[Shape]:
    """The steps of a shape, from left to right."""
    match shape:
        case {"sequence": parts} | {"choice": parts}:
            for part in parts:
                yield from leaves(part)
        case {"repeat": inner} | {"within": inner}:
            yield from leaves(inner)
        case _:
            yield shape


def least_steps(shape: Shape) -> int:
    """How many steps at least must happen for a shape to be met."""
    match shape:
        case {"sequence": steps}:
            return sum(map(least_steps, steps))
        case {"choice": options}:
            return min(map(least_steps, options))
        case {"repeat": inner, "least": least}:
            return int(least) * least_steps(inner)
        case {"within": inner}:
            return least_steps(inner)
        case _:
            return 1


def least_time(shape: Shape) -> float:
    """A bound from below on the time between the step before a shape and its last step, s."""
    match shape:
        case {"held": _, "least": least}:
            return float(least)
        case {"sequence": steps}:
            return sum(map(least_time, steps))
        case {"choice": options}:
            return min(map(least_time, options))
        case {"repeat": inner, "least": least}:
            return int(least) * least_time(inner)
        case {"within": inner}:
            return least_time(inner)
        case _:
            return 0.0


def steps_of(shape: Shape) -> Iterator[Shape]:
    """The steps that a shape takes at least, a choice as one."""
    match shape:
        case {"sequence": steps}:
            for step in steps:
                yield from steps_of(step)
        case {"repeat": inner, "least": least}:
            for _ in range(int(least)):
                yield from steps_of(inner)
        case {"within": inner}:
            yield from steps_of(inner)
        case _:
            yield shape


def time_after(shape: Shape) -> tuple[float, str]:
    """The least time from where `within` counts to the last step, s, and the step that it counts from.

    A first step that is a moment is where it counts from; any other may last until the second has happened.
    """
    before = list(islice(steps_of(shape), 2))
    is_moment = bool(before) and ("enter" in before[0] or "leave" in before[0])
    counted = before[:1] if is_moment else before
    return least_time(shape) - sum(map(least_time, counted)), "first" if is_moment else "second"


def suspect(walk: Patterns, made: Part, findings: Findings) -> None:
    """Warn of a pattern that can never be met: a truth that is false, or a time too short for its steps."""
    for truth in walk.truths if made.truth is None else [made.truth]:
        if truth.constant is not None and truth.constant.value == 0.0:
            findings.report("never-matches", f"`{truth.span.text}` is never true", truth.span)
    too_short(made.shape, made.span, findings)


def too_short(shape: Shape, span: Span, findings: Findings) -> None:
    """Warn of a `within` into which the steps that it counts cannot fit, here or further in."""
    match shape:
        case {"within": inner, "time": time}:
            needed, after = time_after(inner)
            if needed > time * (1 + ROUNDING):
                message = f"the steps after the {after} take at least {needed:g} s, and `within` allows {time:g} s"
                findings.report("never-matches", message, span)
            too_short(inner, span, findings)
        case {"repeat": inner}:
            too_short(inner, span, findings)
        case {"sequence": parts} | {"choice": parts}:
            for part in parts:
                too_short(part, span, findings)
