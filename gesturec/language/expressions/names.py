"""Paths to typed leaves: parameters, fold variables, `prev.` and `next.`, the body's and the world's axes, symbols.

In: a path and the checker that met it. Out: a `Typed`, or None after a finding. What the body has is asked of
the `Scope`; what every expression has in common is known here.
"""

# A hole is None, and what reports a mistake returns it.
# mypy: disable-error-code="func-returns-value"
from __future__ import annotations

from typing import TYPE_CHECKING, Final

from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.expressions import constants, scope, tree
from gesturec.language.expressions.typed import TRUTH, Type, Typed
from gesturec.language.expressions.units import LENGTH, PURE, SPEED

if TYPE_CHECKING:
    from gesturec.language.expressions.check import Checker

AXES: Final = ("x", "y", "z")
WORLD: Final = ("x", "y", "z", "up")
RATES: Final = ("x", "y", "z", "speed")


def path(checker: Checker, node: tree.Path) -> Typed | None:
    """What a path is, as a typed leaf."""
    if node.parameter:
        return parameter(checker, node)
    words = tuple(name.text for name in node.names)
    if checker.rates is not None:
        return rate(checker, node, words)
    if words[0] in ("root", "world") and words[0] not in checker.loops:
        return axis(checker, node, words)
    if words == ("still",):
        return still(checker, node)
    if words[0] in ("prev", "next"):
        return step(checker, node, words)
    return checked_leaf(checker, node, words, 0)


def checked_leaf(checker: Checker, node: tree.Path, words: tuple[str, ...], skipped: int) -> Typed | None:
    """A thing of the body; in a rule it must say whether before or after the step."""
    typed = resolved(checker, node, words, skipped)
    if typed is None or not checker.scope.steps or typed.constant is not None:
        return typed
    help = f"write `next.{node.text}` or `prev.{node.text}`"
    return checker.report(
        "misplaced-name", f"a rule speaks of two states, and `{node.text}` does not say of which", node.span, "", help
    )


def parameter(checker: Checker, node: tree.Path) -> Typed | None:
    """`$name`, `$vector.x`, or `$limb.joint` where the parameter is a name."""
    value = checker.scope.parameter(node.names[0].text)
    match value:
        case scope.Hole():
            return None
        case scope.Unknown():
            rule = value.rule if value.rule != "unknown-name" else "unknown-parameter"
            help = value.help or did_you_mean(node.names[0].text, value.known)
            return checker.report(rule, value.message, node.names[0].span, "", help)
        case scope.Whole():
            message = f"`${node.names[0].text}` is {value.description}, which is no value of an expression"
            return checker.report("wrong-type", message, node.span)
        case scope.Words():
            words = (*value.text.split("."), *(name.text for name in node.names[1:]))
            names = tuple(tree.Name(word, node.span) for word in words)
            return path(checker, tree.Path(names, node.span))
        case bool():
            typed = constants.truth(value, node.span)
        case scope.Quantity():
            typed = constants.given(value, node.span)
    return components(checker, typed, node, 1)


def components(checker: Checker, typed: Typed, node: tree.Path, used: int) -> Typed | None:
    """`.x` after what the first words of a path are; anything more is a mistake."""
    rest = node.names[used:]
    if not rest:
        return typed
    if typed.type.what != "vector" or len(rest) > 1:
        what = "a component" if typed.type.what == "vector" else str(typed.type)
        name = rest[0] if typed.type.what != "vector" else rest[1]
        return checker.report("unknown-name", f"{what} has no part `{name.text}`", name.span)
    return checker.axis(typed, rest[0], node.span)


def rate(checker: Checker, node: tree.Path, words: tuple[str, ...]) -> Typed | None:
    """`x`, `world.x` or `speed` in the brackets of `moving` and `turning`."""
    assert checker.rates is not None
    op = "body_rate"
    if words[0] == "world" and len(words) == 2:
        op, words = "world_rate", words[1:]
    known = RATES if op == "body_rate" else AXES
    if len(words) != 1 or words[0] not in known:
        message = f"`{node.text}` is no rate of the body"
        return checker.report(
            "unknown-name",
            message,
            node.span,
            "",
            "in these brackets there is `x y z speed` and `world.x world.y world.z`",
        )
    which = 0 if checker.rates == SPEED else 1
    vector = Typed(op, Type("vector", checker.rates), node.span, argument=which)
    number = Type("number", checker.rates)
    if words[0] == "speed":
        return Typed("norm", number, node.span, (vector,))
    return Typed("component", number, node.span, (vector,), argument=AXES.index(words[0]))


def has_motion(checker: Checker, node: tree.Path | tree.Call, word: str) -> bool:
    """Whether things of motion and the world may be said here; a finding if not."""
    if not checker.scope.motion:
        message = f"`{word}` is known only while recording; it may stand in poses and gestures"
        checker.report("misplaced-name", message, node.span)
    return checker.scope.motion


def axis(checker: Checker, node: tree.Path, words: tuple[str, ...]) -> Typed | None:
    """`root.x`, `world.up`."""
    known = AXES if words[0] == "root" else WORLD
    if len(words) < 2 or words[1] not in known:
        name = node.names[min(1, len(words) - 1)]
        message = f"`{node.text}` is no direction"
        return checker.report(
            "unknown-name", message, name.span, "", "there is " + ", ".join(f"`{words[0]}.{each}`" for each in known)
        )
    if not has_motion(checker, node, node.text):
        return None
    op = "root_axis" if words[0] == "root" else "world_axis"
    typed = Typed(op, Type("vector", PURE), node.span, argument=known.index(words[1]))
    return components(checker, typed, node, 2)


def still(checker: Checker, node: tree.Path) -> Typed | None:
    """`still`"""
    return Typed("still", TRUTH, node.span) if has_motion(checker, node, "still") else None


def step(checker: Checker, node: tree.Path, words: tuple[str, ...]) -> Typed | None:
    """`prev.pip` and `next.pip` of a rule."""
    if not checker.scope.steps:
        message = f"`{words[0]}.` stands for a side of a step, and only a rule is about a step"
        return checker.report("misplaced-name", message, node.names[0].span)
    if len(words) == 1:
        return checker.report("unknown-name", f"`{words[0]}` needs what it is about, as in `{words[0]}.pip`", node.span)
    typed = resolved(checker, node, words[1:], 1)
    return typed if typed is None or words[0] == "next" else before(typed)


def before(typed: Typed) -> Typed:
    """The same thing before the step."""
    if typed.constant is not None:
        return typed
    if typed.operands:
        return Typed(
            typed.op, typed.type, typed.span, tuple(before(each) for each in typed.operands), (), typed.argument
        )
    return Typed("prev_" + typed.op, typed.type, typed.span, (), typed.symbols, typed.argument)


def resolved(checker: Checker, node: tree.Path, words: tuple[str, ...], skipped: int) -> Typed | None:
    """A thing of the body, after `skipped` words of the path; the variable of a fold stands for its member."""
    symbol, found, component = look_up(checker, words)
    if isinstance(symbol, scope.Hole):
        return None
    if isinstance(symbol, scope.Unknown):
        return unknown(checker, node, symbol, words, found, skipped)
    typed = leaf(checker, symbol, node)
    if typed is None or component is None:
        return typed
    return checker.axis(typed, node.names[-1], node.span)


def look_up(checker: Checker, words: tuple[str, ...]) -> tuple[scope.Symbol, tuple[str, ...], str | None]:
    """The symbol of a path, the path with its fold variable replaced, and the component that its last word is."""
    member = checker.loops.get(words[0])
    full = (*member, *words[1:]) if member is not None else words
    symbol = checker.scope.resolve(full)
    if isinstance(symbol, scope.Unknown) and len(full) > 1:
        vector = checker.scope.resolve(full[:-1])
        if isinstance(vector, scope.Token) or (isinstance(vector, scope.Hole) and full[-1] in AXES):
            return vector, full, full[-1]
    return symbol, full, None


def unknown(
    checker: Checker,
    node: tree.Path,
    symbol: scope.Unknown,
    words: tuple[str, ...],
    full: tuple[str, ...],
    skipped: int,
) -> None:
    """The finding for a name that is not there; of a fold's member, it says which lacks it."""
    position = max(0, symbol.position - (len(full) - len(words))) + skipped
    name = node.names[min(position, len(node.names) - 1)]
    word = full[min(symbol.position, len(full) - 1)]
    message = symbol.message
    related: tuple[Related, ...] = ()
    if words[0] in checker.loops:
        message = f"`{'.'.join(checker.loops[words[0]])}`, which `{words[0]}` stands for, lacks it: {message}"
    checker.report(symbol.rule, message, name.span, "", symbol.help or did_you_mean(word, symbol.known), *related)


def leaf(checker: Checker, symbol: scope.Symbol, node: tree.Path) -> Typed | None:
    """The typed leaf of a symbol."""
    span = node.span
    match symbol:
        case scope.Joint():
            return Typed("joint", Type("number", symbol.kind), span, symbols=(symbol,))
        case scope.Token():
            return Typed("local_token" if symbol.local else "token", Type("vector", LENGTH), span, symbols=(symbol,))
        case scope.LevelTest():
            return level_test(symbol, span)
        case scope.StateTest():
            return Typed("state_in", TRUTH, span, symbols=(symbol,))
        case scope.CycleAt():
            return Typed("cycle_at", Type("number", PURE), span, symbols=(symbol,))
        case scope.Pose():
            if symbol.in_motion and not has_motion(checker, node, node.text):
                return None
            return Typed("pose", TRUTH, span, symbols=(symbol,))
        case scope.Gesture():
            return checker.report(
                "wrong-type", f"`{node.text}` is a gesture, which has no value in an expression", span
            )
        case scope.Limb():
            return checker.report(
                "wrong-type", f"`{node.text}` is a {symbol.what}, which has no value itself", span, "name a part of it"
            )
        case scope.Group():
            help = f"a fold asks all of them, as in `all(a… for a in {node.text})`"
            return checker.report("wrong-type", f"`{node.text}` is a group, which has no value itself", span, "", help)
        case _:
            return None


def level_test(symbol: scope.LevelTest, span: Span) -> Typed:
    """`index.abduction.spread` as a comparison with the level's value."""
    joint = Typed("joint", Type("number", symbol.kind), span, symbols=(scope.Joint(symbol.joint, symbol.kind),))
    return Typed("equal", TRUTH, span, (joint, constants.quantity(symbol.value, symbol.kind, span)))
