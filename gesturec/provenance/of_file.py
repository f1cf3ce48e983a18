"""What a file says of no part of the body: its units, what holds for all transitions, and its tests.

In: a body, and how to follow what was written. Out: things that can be asked about, each with its origins: `units`,
`transitions` and each of its rules, `tests` and each `tests.NAME`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from gesturec.checks.body import ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.language import document
from gesturec.language.schema.block import Block
from gesturec.language.schema.blocks import ModelTest, Transitions
from gesturec.provenance.follow import Follow
from gesturec.provenance.record import Origin, Trace
from gesturec.provenance.values import Shown

DEFAULT = Trace("not written: the language's default")
# What holds for all machines where no file says it.
STEPS = {"step": "adjacent", "tick": "the session's period", "exclusive": "nothing"}
TESTS = "tests"

Thing = tuple[str, Callable[[], Iterable[Origin]]]


def file_things(body: ResolvedBody, follow: Follow, shown: Shown) -> Iterator[Thing]:
    """What can be asked about a file."""
    yield "units", lambda: units(body)
    yield "transitions", lambda: transitions(body, follow)
    top = body.model.main.block.transitions
    for rule in top.rules if top is not None else ():
        if rule.name is not None:
            yield str(rule.name), lambda rule=rule: [as_written(str(rule.name), "rule", rule, rule.name.span)]  # type: ignore[misc]
    blocks = list(zip(body.model.main.block.tests, body.tests, strict=True))
    yield TESTS, lambda: (as_written(TESTS, test["name"], block, block.start) for block, test in blocks)
    for block, test in blocks:
        yield f"{TESTS}.{test['name']}", lambda block=block, test=test: test_of(block, test, body, follow, shown)  # type: ignore[misc]


def as_written(path: str, key: str, block: Block, place: Any) -> Origin:
    """A block as its author wrote it."""
    return Origin(path, key, said(block), (Trace("as written", place),))


def units(body: ResolvedBody) -> Iterator[Origin]:
    """The units of bare numbers, and the included files that have others."""
    main, *others = body.model.parts
    for key in ("length", "angle"):
        unit = getattr(main.units, key)
        traces = [Trace(f"`{key}: {unit}`", place_of(main.block.units, key))]
        for part in others:
            other = getattr(part.units, key)
            if other != unit:
                traces.append(Trace(f"an included file has `{other}` for its own", place_of(part.block.units, key)))
        yield Origin("units", key, unit, tuple(traces))


def place_of(block: Block | None, key: str) -> Any:
    """The place of a key, where its block could be read."""
    return None if block is None else block.key(key)


def transitions(body: ResolvedBody, follow: Follow) -> Iterator[Origin]:
    """What holds for the steps of all machines: the file's own words, else those of the files that have it."""
    for key, default in STEPS.items():
        found = next(((block, inner) for block, inner in said_of_all(body) if block.has(key)), None)
        node = None if found is None else node_of(found[0], key)
        if found is None or node is None or (key == "exclusive" and found[0] is not body.model.main.block.transitions):
            yield Origin("transitions", key, default, (DEFAULT,))
            continue
        yield Origin("transitions", key, said(node), tuple(follow.written(key, node, found[1])))
    top = body.model.main.block.transitions
    if top is not None and top.rules:
        names = ", ".join(str(rule.name) for rule in top.rules)
        yield Origin("transitions", "rules", names, (Trace("as written", top.key("rules")),))


def said_of_all(body: ResolvedBody) -> Iterator[tuple[Transitions, Environment]]:
    """What files say of all machines, the one that counts first."""
    own = body.model.main.block.transitions
    if own is not None:
        yield own, body.environment
    yield from reversed(body.outer)


def test_of(
    block: ModelTest, test: Mapping[str, Any], body: ResolvedBody, follow: Follow, shown: Shown
) -> Iterator[Origin]:
    """Every key of a test."""
    for key, value in shown.test(test).items():
        node = node_of(block, key)
        traces = (DEFAULT,) if node is None else tuple(follow.written(key, node, body.environment))
        yield Origin(f"{TESTS}.{test['name']}", key, value, traces)


def node_of(block: Block, key: str) -> document.Node | None:
    """What stands under a key, as read."""
    mapping = block.written
    found = mapping.key(key)
    return None if found is None else mapping[found]


def said(block: object) -> str:
    """A block or node as written, on one line."""
    span = getattr(block, "span", None)
    return "" if span is None else " ".join(span.text.split())
