"""A file of several bodies: each is resolved by itself, then what spans them.

In: a model with `bodies`, and settings. Out: a `ResolvedBody` whose `parts` are the bodies, and whose own poses,
gestures, constraints, bindings and tests speak of them by `body.name`.
"""

from __future__ import annotations

from collections.abc import Mapping as Settings

from gesturec.checks import values
from gesturec.checks.body import ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.checks.parameters import SCALE, SIDE, Placed, Settled, settle
from gesturec.checks.span import build_span
from gesturec.checks.spanning import BodyPart
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Text
from gesturec.language.expressions.scope import Words
from gesturec.language.expressions.units import PURE
from gesturec.language.findings import Findings
from gesturec.language.model import BodyModel, Model
from gesturec.language.schema.leaf import is_passed, wrong_kind

# What belongs to one body, and stands in its own model.
OF_ONE_BODY = ("limbs", "machines", "mirror", "templates")


def build_bodies(body: ResolvedBody, settled: Settled, settings: Settings[str, object], findings: Findings) -> None:
    """The bodies, and what spans them."""
    refuse_keys(body.model, findings)
    for key, one in body.model.bodies.items():
        part = build_part(str(key), one, body, settings, findings)
        if part is not None:
            body.parts[part.name] = part
    if len(body.parts) == len(body.model.bodies):
        build_span(body, settled, findings)


def refuse_keys(model: Model, findings: Findings) -> None:
    """Report what a file of several bodies cannot have."""
    block = model.main.block
    for key in OF_ONE_BODY:
        if block.has(key):
            related = (Related("beside `bodies`", block.key("bodies")),)
            message = f"`{key}` belongs to one body, and stands in the body's own model"
            findings.report("conflicting-keys", message, block.key(key), "", None, related)
    if block.has("transitions"):
        message = "`transitions` of several bodies together are not built yet"
        findings.report("not-built", message, block.key("transitions"), "", "each body's own model may have them")
    if not model.bodies and not block.is_hole("bodies") and not is_refused(model, findings):
        findings.report("empty-group", "`bodies` has no body", block.key("bodies"), "nothing in it")


def is_refused(model: Model, findings: Findings) -> bool:
    """Whether a body's own name or block was refused already, so that there are fewer than were written."""
    key = model.main.block.key("bodies")
    return any(
        each.span is not None
        and each.rule == "reserved-name"
        and each.span.start >= key.start
        and each.span.source == key.source
        for each in findings.errors()
    )


# one body


def build_part(
    name: str, one: BodyModel, whole: ResolvedBody, settings: Settings[str, object], findings: Findings
) -> BodyPart | None:
    """One body, resolved by itself; None where a finding says why it cannot be."""
    from gesturec.checks.check import build_parts

    model, file = one.model, one.block.model
    if model is None or file is None:
        return None
    if model.main.block.has("bodies"):
        findings.report("not-built", "a body that is itself of several bodies is not built yet", file.span)
        return None
    note = Related(f"read for body `{name}`", file.span, note=True)
    findings.context.append(note)
    found = settle(model, part_settings(name, one, whole, settings), findings)
    body = ResolvedBody(model, str(model.main.block.name or ""), found.of(model.main))
    body.scale, body.flip, body.parameters = found.scale, found.flip, dict(found.effective)
    names, poses = build_parts(body, found, findings)
    findings.context.remove(note)
    return BodyPart(name, body, names, poses)


def part_settings(name: str, one: BodyModel, whole: ResolvedBody, settings: Settings[str, object]) -> dict[str, object]:
    """What a body's parameters are set to: by `set`, then by settings of its name; sizes multiply."""
    environment, node = whole.environment, one.block.set
    found: dict[str, object] = {}
    if node is not None and not isinstance(node, Mapping):
        wrong_kind(node, "a mapping of parameters to values", environment.findings)
    for key, value in node.items() if isinstance(node, Mapping) else ():
        if not isinstance(value, Text):
            wrong_kind(value, "a value", environment.findings)
        elif is_known(key, one, environment.findings):
            found[str(key)] = value_of(str(key), value, environment)
    found |= {key.partition(".")[2]: value for key, value in settings.items() if key.partition(".")[0] == name}
    if whole.scale != 1.0:
        found[SCALE] = whole.scale * float(str(found.get(SCALE, 1.0)))
    return found


def is_known(key: Text, one: BodyModel, findings: Findings) -> bool:
    """Whether the body's model has a parameter of this name."""
    assert one.model is not None
    known = [str(name) for part in one.model.parts for name in part.block.parameters] + [SCALE]
    known += [SIDE] if one.model.main.block.has("mirror") else []
    if key not in known:
        message = f"the model of this body has no parameter `{key}`"
        findings.report("unknown-setting", message, key.span, "", did_you_mean(key, known))
    return key in known


def value_of(name: str, node: Text, environment: Environment) -> object:
    """A value as the body's model takes it: bare numbers are in the units of this file."""
    if name == SCALE:
        number = values.number(node, environment, PURE)
        return Text(repr(1.0 if number is None else number), node.span)
    if name == SIDE and is_passed(node):
        given = environment.parameter(node[1:])
        return Text(given.text, node.span) if isinstance(given, Words) else node
    return node if name == SIDE else Placed(node, environment)
