"""Bindings: the names that other tools give to our tokens, and with what weights.

In: the binding blocks of the model and its includes. Out: `BodyBinding` by full names of tokens.
"""

from __future__ import annotations

from collections.abc import Iterator

from gesturec.checks import values
from gesturec.checks.body import BodyBinding, BodyToken, ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.checks.names import tokens_of
from gesturec.checks.parameters import Settled
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Node, Sequence, Text
from gesturec.language.expressions.units import PURE
from gesturec.language.findings import Findings
from gesturec.language.schema.blocks import Binding

# Weights typed with a few digits, as 0.33 and 0.67 are; what is used is divided by their sum.
WEIGHT_SLACK = 0.011
Theirs = tuple[tuple[str, float], ...]


def build_bindings(body: ResolvedBody, settled: Settled, findings: Findings) -> tuple[BodyBinding, ...]:
    """Every binding; a name twice is an error."""
    tokens = tokens_of(body)
    found: dict[str, tuple[Text, BodyBinding]] = {}
    for part in body.model.parts:
        for key, block in part.block.bindings.items():
            if key in found:
                related = (Related("first here", found[key][0].span),)
                findings.report("duplicate-name", f"two bindings are called `{key}`", key.span, "", None, related)
            else:
                found[str(key)] = key, binding_of(key, block, tokens, body, settled.of(part))
    return tuple(binding for _, binding in found.values())


def binding_of(
    key: Text, block: Binding, tokens: dict[str, BodyToken], body: ResolvedBody, environment: Environment
) -> BodyBinding:
    """One binding."""
    bound: list[tuple[str, Theirs]] = []
    for ours, given in pairs_of(block.tokens):
        theirs, _ = values.whole(given, environment)
        if theirs is not None and check_token(ours, tokens, body, environment.findings):
            weights = weights_of(theirs, environment)
            bound.append((str(ours), weights))
            check_order(block, theirs, weights, environment.findings)
    order = tuple(str(name) for name in block.order or ())
    report_doubles(block, environment.findings)
    return BodyBinding(str(key), tuple(bound), order, None if block.up is None else str(block.up), key.span)


def pairs_of(node: Sequence | Mapping | None) -> Iterator[tuple[Text, Node]]:
    """Ours with theirs; a list is of names that are the same."""
    if isinstance(node, Mapping):
        yield from ((key, value) for key, value in node.items() if not key.startswith("x-"))
    elif node is not None:
        yield from ((item, item) for item in node if isinstance(item, Text))


def check_token(ours: Text, tokens: dict[str, BodyToken], body: ResolvedBody, findings: Findings) -> bool:
    """Whether a name is a token of ours that can be measured."""
    token = tokens.get(ours)
    if token is None:
        limb = body.limbs.get(ours.partition(".")[0])
        is_hole = body.root_is_hole if "." not in ours else limb is not None and limb.is_hole
        if not is_hole:
            help = did_you_mean(ours, tokens)
            findings.report("unknown-token", f"there is no token `{ours}` to bind", ours.span, "no such token", help)
        return False
    if token.virtual:
        message = f"token `{ours}` is virtual and never measured, so nothing is bound to it"
        findings.report("never-measured", message, ours.span)
    return True


def weights_of(node: Node, environment: Environment) -> Theirs:
    """Their names with weights: one, the mean of a list, or as given."""
    if isinstance(node, Text):
        return ((str(node), 1.0),)
    if isinstance(node, Sequence):
        if not node:
            environment.findings.report("empty-group", "a token is bound to an empty list", node.span)
        return tuple((str(item), 1.0 / len(node)) for item in node)
    weights = [(str(key), values.number(value, environment, PURE)) for key, value in node.items()]
    known = [(name, weight) for name, weight in weights if weight is not None]
    total = sum(weight for _, weight in known)
    if len(known) == len(weights) and abs(total - 1.0) > WEIGHT_SLACK:
        message = f"the weights of a bound token sum to {total:.4g} and not to 1"
        environment.findings.report("bad-weights", message, node.span)
        return ()
    return tuple((name, weight / total) for name, weight in known) if total else ()


def check_order(block: Binding, theirs: Node, weights: Theirs, findings: Findings) -> None:
    """What is bound has a row, where `order` says what rows there are."""
    order = [str(name) for name in block.order or ()]
    for name, _ in weights if order else ():
        if name not in order:
            related = (Related("the order", block.key("order"), note=True),)
            message = f"`{name}` is bound and has no place in `order`"
            findings.report("bad-binding", message, theirs.span, "", did_you_mean(name, order), related)


def report_doubles(block: Binding, findings: Findings) -> None:
    """Report a row that `order` names twice."""
    seen: dict[str, Text] = {}
    for name in block.order or ():
        if isinstance(name, Text) and name in seen:
            related = (Related("first here", seen[name].span),)
            findings.report("duplicate-name", f"`{name}` has two places in `order`", name.span, "", None, related)
        elif isinstance(name, Text):
            seen[str(name)] = name
