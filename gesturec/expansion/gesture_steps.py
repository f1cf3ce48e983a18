"""What the states of a body say of its gestures: truths that never hold, and steps that have begun too early.

In: the lowered patterns, the states of all machines and the relations across them. Out: findings. A truth is
seen as a row of each machine's states; a part of it that spans machines or speaks of motion says nothing of
them, so a row takes in every state in which the truth may hold. All that is reported is therefore certain.

A step happens when its truth's episode begins. Where `b` holds in every state in which `a` does, it has begun
before `a` or with it; in `a -> b` it begins anew only after it is left, and `a` before it or with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.programs import evaluate_checked
from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.diagnostics.source import Span
from gesturec.expansion.consistency import possible_states
from gesturec.expansion.depend import conjuncts, dependence, last_operands
from gesturec.expansion.empty import asked_of, spanning
from gesturec.expansion.environment import Body, SetTable, state_environment
from gesturec.expansion.poses import UNKNOWN
from gesturec.expansion.relations import Relation
from gesturec.language.expressions.gestures import ROUNDING, least_steps, least_time, leaves, steps_of, time_after
from gesturec.lowering.lowered import LoweredPattern, Operation, Program

Codes = NDArray[np.uint8]
Operations = tuple[Operation, ...]
Shape = dict[str, Any]


class Step(NamedTuple):
    """A step of a pattern: its shape (one of the leaves) and where it is written."""

    shape: Shape
    place: Span

    @property
    def truth(self) -> int:
        """The number of its truth."""
        return int(next(self.shape[key] for key in ("truth", "enter", "leave", "held") if key in self.shape))

    @property
    def begins(self) -> bool:
        """Whether it happens when an episode begins."""
        return "truth" in self.shape or "enter" in self.shape

    @property
    def holds(self) -> bool:
        """Whether its truth holds at its moment."""
        return self.begins or self.shape.get("decided") == "start"


class Pair(NamedTuple):
    """A step, and all that surely has come right before it, one of them."""

    before: tuple[Step, ...]
    step: Step


# Steps that may be the last so far; None where there may be none.
Ends = tuple[Step | None, ...]


@dataclass(eq=False)
class Truths:
    """Truths over the states of a body; a part that several truths have is looked at once."""

    body: Body
    found: dict[Operations, tuple[int, Codes] | None] = field(default_factory=dict)

    def part(self, part: Operations) -> tuple[int, Codes] | None:
        """The one machine that a part speaks of, and what it says of its states; None where it is not one."""
        if part not in self.found:
            depends = dependence(self.body.model, part)
            machines = sorted(depends.machines(self.body.model))
            self.found[part] = None if depends.motion or len(machines) != 1 else self.row(machines[0], part)
        return self.found[part]

    def row(self, machine: int, part: Operations) -> tuple[int, Codes]:
        """A part's truth in every state of a machine: 1 holds, 0 not, 2 unknown."""
        states = self.body.states[machine]
        value, undefined = evaluate_checked(self.body.sets.resolve(part), state_environment(self.body, states))
        unknown = np.isnan(value) if undefined is None else np.isnan(value) | undefined
        codes = np.where(unknown, UNKNOWN, np.asarray(value) != 0).astype(np.uint8)
        return machine, np.broadcast_to(codes, (states.count,))

    def may_hold(self, operations: Operations) -> dict[int, NDArray[np.bool_]]:
        """States of the machines that a truth speaks of in which it may hold."""
        rows: dict[int, NDArray[np.bool_]] = {}
        for part in conjuncts(operations):
            if (known := self.part(part)) is not None:
                machine, codes = known
                rows[machine] = rows.get(machine, True) & (codes != 0)
        return rows

    def implies(self, one: Operations, other: Operations) -> bool:
        """Whether it is certain that `other` holds wherever `one` does."""
        return self.holds_in(self.may_hold(one), frozenset(conjuncts(one)), other)

    def holds_in(self, rows: Mapping[int, NDArray[np.bool_]], given: frozenset[Operations], truth: Operations) -> bool:
        """Whether a truth surely holds in all states of `rows`, where the truths `given` hold."""
        if truth in given or truth == (Operation("constant", 0, 1.0),):
            return True
        if (known := self.part(truth)) is not None:
            machine, codes = known
            return bool((codes[rows[machine]] == 1).all()) if machine in rows else bool((codes == 1).all())
        match truth[-1].name:
            case "and":
                return all(self.holds_in(rows, given, part) for part in conjuncts(truth))
            case "or":
                return any(self.holds_in(rows, given, part) for part in last_operands(truth))
            case "not":
                return not overlap(rows, self.may_hold(truth[:-1]))
        return False


def overlap(one: Mapping[int, NDArray[np.bool_]], other: Mapping[int, NDArray[np.bool_]]) -> bool:
    """Whether two truths may hold together."""
    return all((row & other[machine]).any() for machine, row in one.items() if machine in other)


def gesture_findings(body: Body, relations: Sequence[Relation], said: frozenset[str]) -> list[Diagnostic]:
    """What is wrong with the steps of the gestures, each place once; of the poses `said` it is known already."""
    # sets of its own: those of the body are written into the artifact
    truths = Truths(Body(body.model, body.chain, SetTable(), body.states))
    found: dict[tuple[str, Span], Diagnostic] = {}
    for pattern in body.model.patterns:
        never = [may_never(truths, relations, truth.program) for truth in pattern.truths]
        told = [bool(truth.poses & said) for truth in pattern.truths]
        steps = [Step(*pair) for pair in zip(leaves(pattern.shape), pattern.places, strict=True)]
        fresh = [step for step in steps if never[step.truth] and not told[step.truth]]
        usable = [pair for pair in pairs(pattern) if not any(never[each.truth] for each in (*pair.before, pair.step))]
        late = late_steps(truths, pattern, [step for step in steps if not never[step.truth]])
        for finding in (*map(never_true, fresh), *early_steps(truths, pattern, usable), *late):
            assert finding.span is not None
            found.setdefault((finding.rule, finding.span), finding)
    return list(found.values())


def may_never(truths: Truths, relations: Sequence[Relation], program: Program) -> bool:
    """Whether there surely is no state of the body in which a truth holds."""
    rows = truths.may_hold(program.operations)
    if not all(row.any() for row in rows.values()):
        return True
    own = [*spanning(truths.body, "", program.operations, program.span)]
    asked = [*asked_of(relations), *own]
    return bool(asked) and not all(row.any() for row in possible_states(truths.body, asked, rows).values())


def never_true(step: Step) -> Diagnostic:
    """The finding for a truth that holds nowhere."""
    message = f"`{step.place.text}` can never happen: what it asks for holds in no state of the body"
    return Diagnostic("never-matches", message, step.place)


def late_steps(truths: Truths, pattern: LoweredPattern, steps: Sequence[Step]) -> Iterator[Diagnostic]:
    """A finding for each second step that lasts longer than its `within`, which its first cannot last into."""
    written = {id(step.shape): step for step in steps}
    for inner, time in bounded(pattern.shape):
        first, second = (written.get(id(shape)) for shape in (*islice(steps_of(inner), 2), None, None)[:2])
        if first is None or second is None or "truth" not in first.shape or time_after(inner)[0] > time:
            continue
        one, other = (truths.may_hold(pattern.truths[step.truth].program.operations) for step in (first, second))
        if least_time(inner) > time * (1 + ROUNDING) and not overlap(one, other):
            message = (
                f"after `{first.place.text}` it takes at least {least_time(inner):g} s, and `within` allows {time:g} s"
            )
            yield Diagnostic("never-matches", message, second.place, "", None, (Related("from here", first.place),))


def bounded(shape: Shape) -> Iterator[tuple[Shape, float]]:
    """What stands in each `within` of a shape, and its time, s."""
    match shape:
        case {"within": inner, "time": time}:
            yield inner, time
            yield from bounded(inner)
        case {"repeat": inner}:
            yield from bounded(inner)
        case {"sequence": parts} | {"choice": parts}:
            for part in parts:
                yield from bounded(part)


def early_steps(truths: Truths, pattern: LoweredPattern, found: Sequence[Pair]) -> Iterator[Diagnostic]:
    """A finding for each step that has begun before each that may come before it, and does not begin with it."""

    @cache
    def implies(one: int, other: int) -> bool:
        return truths.implies(pattern.truths[one].program.operations, pattern.truths[other].program.operations)

    for before, step in found:
        if all(implies(each.truth, step.truth) and not implies(step.truth, each.truth) for each in before):
            yield early(before[-1], step)


def early(before: Step, step: Step) -> Diagnostic:
    """The finding for a step that has begun before another."""
    return Diagnostic(
        "step-already-true",
        f"`{step.place.text}` holds wherever `{before.place.text}` does, so it has begun when its turn comes",
        step.place,
        "begins anew only after it and the step before are left",
        f"`-> leave({step.place.text}) -> {step.place.text}` if it shall begin anew" if "truth" in step.shape else None,
        (Related("the step before", before.place),),
    )


def pairs(pattern: LoweredPattern) -> list[Pair]:
    """Steps that happen when an episode begins, with what may come before, where that surely holds then."""
    places = iter(pattern.places)
    found: list[Pair] = []
    join(pattern.shape, (None,), places, found)
    return [pair for pair in found if pair.step.begins and pair.before and all(each.holds for each in pair.before)]


def join(shape: Shape, before: Ends, places: Iterator[Span], found: list[Pair]) -> Ends:
    """Note the pairs of a shape that follows one of `before`; returns the steps that may be its last.

    A repetition is not followed by itself: `(near -> nearer){2}` says that one goes away between.
    """
    match shape:
        case {"sequence": parts}:
            for part in parts:
                before = join(part, before, places, found)
            return before
        case {"choice": parts}:
            return tuple(end for part in parts for end in join(part, before, places, found))
        case {"repeat": inner} | {"within": inner}:
            last = join(inner, before, places, found)
            return last if least_steps(shape) else (*before, *last)
    step = Step(shape, next(places))
    if None not in before:
        found.append(Pair(tuple(each for each in before if each is not None), step))
    return (step,)
