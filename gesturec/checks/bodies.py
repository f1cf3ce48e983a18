"""A file of several bodies: each is resolved by itself, then what spans them.

In: a model with `bodies`, and settings. Out: a `ResolvedBody` whose `parts` are the bodies, and whose own poses,
gestures, constraints, rules, bindings and tests speak of them by `body.name`. The model of a body may be of several
bodies too: that is one more call of the same.
"""

from __future__ import annotations

from collections.abc import Mapping as Settings

from gesturec.checks import values
from gesturec.checks.body import ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.checks.parameters import SCALE, SIDE, Placed, Settled
from gesturec.checks.poses import Poses
from gesturec.checks.scopes import Names
from gesturec.checks.span import build_span
from gesturec.checks.spanning import BodyPart
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Text
from gesturec.language.expressions.scope import Words
from gesturec.language.expressions.units import PURE, TIME
from gesturec.language.findings import Findings
from gesturec.language.model import BodyModel, Model
from gesturec.language.schema.leaf import is_passed, wrong_kind

# What belongs to one body, and stands in its own model.
OF_ONE_BODY = ("limbs", "machines", "mirror", "templates")


def build_bodies(
    body: ResolvedBody, settled: Settled, settings: Settings[str, object], findings: Findings
) -> tuple[Names, Poses] | None:
    """The bodies, and what spans them; what names the file's poses have, where all bodies could be built."""
    refuse_keys(body.model, findings)
    check_steps(body)
    for key, one in body.model.bodies.items():
        part = build_part(str(key), one, body, settings, findings)
        if part is not None:
            body.parts[part.name] = part
    return build_span(body, settled, findings) if len(body.parts) == len(body.model.bodies) else None


def check_steps(body: ResolvedBody) -> None:
    """Look at what `transitions` says of all machines, before it is asked for in each of them."""
    top, environment = body.model.main.block.transitions, body.environment
    if top is not None:
        values.word(top.step, environment)
        values.positive(top.tick, environment, TIME)


def refuse_keys(model: Model, findings: Findings) -> None:
    """Report what a file of several bodies cannot have."""
    block = model.main.block
    for key in OF_ONE_BODY:
        if block.has(key):
            related = (Related("beside `bodies`", block.key("bodies")),)
            message = f"`{key}` belongs to one body, and stands in the body's own model"
            findings.report("conflicting-keys", message, block.key(key), "", None, related)
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
    from gesturec.checks.check import build_own, settled_body

    model, file = one.model, one.block.model
    if model is None or file is None:
        return None
    note = Related(f"read for body `{name}`", file.span, note=True)
    findings.context.append(note)
    told = part_settings(name, one, whole, settings)
    body, found = settled_body(model, told, findings)
    top = whole.model.main.block.transitions
    body.outer = whole.outer if top is None else (*whole.outer, (top, whole.environment))
    built = build_own(body, found, told, findings)
    findings.context.remove(note)
    return None if built is None else BodyPart(name, body, *built)


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
    known = settings_of(one.model)
    if key not in known:
        message = f"the model of this body has no parameter `{key}`"
        findings.report("unknown-setting", message, key.span, "", did_you_mean(key, known))
    return key in known


def settings_of(model: Model) -> list[str]:
    """The parameters of a model, and of its bodies by `body.parameter`."""
    own = [str(name) for part in model.parts for name in part.block.parameters] + [SCALE]
    own += [SIDE] if model.main.block.has("mirror") else []
    bodies = ((name, one.model) for name, one in model.bodies.items())
    return own + [f"{name}.{inner}" for name, one in bodies if one is not None for inner in settings_of(one)]


def value_of(full: str, node: Text, environment: Environment) -> object:
    """A value as the body's model takes it: bare numbers are in the units of this file."""
    name = full.rpartition(".")[2]
    if name == SCALE:
        number = values.number(node, environment, PURE)
        return Text(repr(1.0 if number is None else number), node.span)
    if name == SIDE and is_passed(node):
        given = environment.parameter(node[1:])
        return Text(given.text, node.span) if isinstance(given, Words) else node
    return node if name == SIDE else Placed(node, environment)
