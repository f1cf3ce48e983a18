"""Limbs: templates with their arguments, mirrors, and the chains that they make.

In: the limbs' and templates' blocks and the parameters. Out: a `BodyLimb` each, with joints and tokens in their
frames, as written: a mirrored limb is its original with other arguments, and the axes that lowering reflects it in.
A fault in a template is found in every limb made of it, and told once, with the limb where it was seen first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from gesturec.checks import values
from gesturec.checks.body import BodyLimb, ResolvedBody, Section
from gesturec.checks.chain import build_chain
from gesturec.checks.environment import Environment, Given
from gesturec.checks.parameters import Settled
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.errors import ModelError
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean, nearest
from gesturec.language.document import Mapping, Node, Sequence, Text
from gesturec.language.findings import Findings
from gesturec.language.limits import raised_by
from gesturec.language.model import Model
from gesturec.language.schema.blocks import Limb, Template


class TemplateOf(NamedTuple):
    """A template with the environment of its file."""

    key: Text
    block: Template
    environment: Environment

    def arguments(self) -> dict[str, tuple[Text, Node | None]]:
        """Its arguments with their defaults, but for those that no limb can give."""
        node = self.block.arguments
        pairs: list[tuple[Text, Node | None]] = [(item, None) for item in node or () if isinstance(item, Text)]
        if isinstance(node, Mapping):
            pairs = list(node.items())
        return {str(key): (key, default) for key, default in pairs if key not in Limb.keys_known()}


@dataclass(eq=False)
class Plan:
    """What a limb is made of, once its mirrors are followed to the limb that has a chain or template."""

    original: Limb
    overrides: dict[str, tuple[Text, Node]]  # arguments, the outermost mirror's first
    flips: tuple[int, ...]
    parent: Text | None
    blocks: tuple[Limb, ...]  # whose sections count, the original's first


Templates = dict[str, TemplateOf | None]


def templates_of(model: Model, settled: Settled, findings: Findings) -> Templates:
    """Every template of the model and its includes, None for one that is wrong; a name twice is an error."""
    found: dict[str, TemplateOf | None] = {}
    for part in model.parts:
        for key, block in part.block.templates.items():
            first = found.get(key)
            if first is not None:
                related = (Related("first here", first.key.span),)
                findings.report("duplicate-name", f"two templates are called `{key}`", key.span, "", None, related)
                continue
            found[str(key)] = None if block is None else TemplateOf(key, block, settled.of(part))
            if block is not None:
                check_arguments(TemplateOf(key, block, settled.of(part)), findings)
    return found


def check_arguments(template: TemplateOf, findings: Findings) -> None:
    """An argument has not the name of a limb's own key or of a parameter, nor stands twice."""
    seen: dict[str, Text] = {}
    node = template.block.arguments
    for key in node if isinstance(node, Mapping | Sequence) else ():
        if not isinstance(key, Text):
            continue
        if key in Limb.keys_known():
            findings.report(
                "reserved-name", f"an argument cannot be called `{key}`, which is a key of a limb", key.span
            )
        if (parameter := template.environment.find(key)) is not None:
            related = (Related("the parameter", parameter.place),) if parameter.place.source.text else ()
            message = f"the argument `{key}` has the name of a parameter: `${key}` would mean two things"
            findings.report("shadowed-name", message, key.span, "", None, related)
        if key in seen:
            related = (Related("first here", seen[key].span),)
            findings.report("duplicate-name", f"the argument `{key}` is listed twice", key.span, "", None, related)
        seen[str(key)] = key


def build_limbs(body: ResolvedBody, settled: Settled, findings: Findings) -> None:
    """Build every limb of the body."""
    model = body.model
    templates = templates_of(model, settled, findings)
    environment = settled.of(model.main)
    used: set[str] = set()
    plans: dict[str, Plan] = {}
    for key, block in limbs_within(model.main.block.limbs, findings).items():
        plan = plan_of(key, block, model.main.block.limbs, findings)
        limb = BodyLimb(str(key), key.span, plan.flips if plan else (), (), is_hole=True)
        body.limbs[limb.name] = limb
        if plan is not None:
            plans[limb.name] = plan
            used.add(str(plan.original.template))
            build_limb(limb, plan, templates, environment, findings)
    for name, template in templates.items():
        if name not in used and template is not None:
            check_unused(template, name, environment, findings)
    link_parents(body, plans, findings)


def limbs_within(limbs: dict[Text, Limb | None], findings: Findings) -> dict[Text, Limb | None]:
    """The limbs, no more of them than may be."""
    most = findings.limits.limbs
    if len(limbs) > most:
        message = f"the body has {len(limbs):,} limbs; the limit is {most:,}"
        place = list(limbs)[most].span
        findings.report("limit-exceeded", message, place, "this is one too many", raised_by("limbs"))
        raise ModelError(findings.sorted())
    return limbs


def plan_of(key: Text, block: Limb | None, limbs: dict[Text, Limb | None], findings: Findings) -> Plan | None:
    """Follow a limb's mirrors to its original; None where they lead in a circle or nowhere."""
    if block is None:
        return None
    flips: list[int] = []
    overrides: dict[str, tuple[Text, Node]] = {}
    blocks = [block]
    seen = [str(key)]
    parent = block.parent
    while block.has("mirror"):
        if block.mirror is None or block.across is None:
            if not block.has("across"):
                message = "a mirrored limb needs `across`: the axis that the plane of reflection is square to"
                findings.report("missing-key", message, block.key("mirror"), "`across` is missing")
            return None
        flips.append("xyz".index(block.across))
        for name, value in block.further.items():
            overrides.setdefault(str(name), (name, value))
        target = block.mirror
        found = limbs.get(target)
        if found is None and target in limbs:
            return None
        if found is None:
            findings.report(
                "unknown-limb", f"there is no limb `{target}` to mirror", target.span, "", did_you_mean(target, limbs)
            )
            return None
        if len(flips) > findings.limits.mirrors:
            message = f"limbs are mirror images of mirror images more than {findings.limits.mirrors} deep"
            findings.report_once("limit-exceeded", message, target.span, raised_by("mirrors"))
            return None
        if target in seen:
            findings.report(
                "circular-reference", f"`{target}` is the mirror image of itself", target.span, "closes the circle"
            )
            return None
        seen.append(str(target))
        block = found
        blocks.append(block)
        parent = parent if parent is not None else block.parent
    if block.has("across") and any(block.has(key) for key in block.one_of):
        findings.report("conflicting-keys", "`across` needs `mirror`", block.key("across"))
    for name, value in block.further.items():
        overrides.setdefault(str(name), (name, value))
    return Plan(block, overrides, tuple(flips), parent, tuple(reversed(blocks)))


def build_limb(limb: BodyLimb, plan: Plan, templates: Templates, environment: Environment, findings: Findings) -> None:
    """Build one limb by its plan."""
    if not plan.original.has("template"):
        for name, _ in plan.overrides.values():
            known = Limb.keys_known()
            findings.report(
                "unknown-key", f"a limb has no key `{name}`", name.span, "unknown key", did_you_mean(name, known)
            )
        limb.sections = tuple(Section(block, environment) for block in plan.blocks)
        build_chain(limb, plan.original.chain, environment, environment.units)
        limb.is_hole = False
        return
    template = template_of(plan.original, templates, findings)
    if template is None or not template.block.has("chain"):
        return
    inner = instance_environment(limb, plan, template, environment, findings)
    own = Environment(environment.units, findings, inner.given, inner.outer)
    limb.sections = (Section(template.block, inner), *(Section(block, own) for block in plan.blocks))
    note = Related(f"expanded from limb `{limb.name}`", limb.span, note=True)
    findings.context.append(note)
    build_chain(limb, template.block.chain, inner, environment.units)
    findings.context.remove(note)
    limb.is_hole = False


def template_of(block: Limb, templates: Templates, findings: Findings) -> TemplateOf | None:
    """The template that a limb names."""
    name = block.template
    if name is None:
        return None
    if name not in templates:
        findings.report(
            "unknown-template", f"there is no template `{name}`", name.span, "", did_you_mean(name, templates)
        )
    return templates.get(name)


def instance_environment(
    limb: BodyLimb, plan: Plan, template: TemplateOf, environment: Environment, findings: Findings
) -> Environment:
    """What a template's chain sees in one limb: the arguments given to it, and the parameters."""
    inner = Environment(template.environment.units, findings, {}, template.environment)
    arguments = template.arguments()
    unknown = [name for name in plan.overrides if name not in arguments]
    missing = [name for name, (_, default) in arguments.items() if default is None and name not in plan.overrides]
    for name in unknown:
        near = nearest(name, [*arguments, *Limb.keys_known()])
        help = f"did you mean `{near}`?" if near is not None else did_you_mean(name, missing or arguments)
        related = (Related("its arguments", template.block.key("arguments"), note=True),)
        message = f"template `{plan.original.template}` has no argument `{name}`"
        findings.report("unknown-argument", message, plan.overrides[name][0].span, "", help, related)
    for name, (key, default) in arguments.items():
        if name in plan.overrides:
            given_key, node = plan.overrides[name]
            inner.given[name] = Given(name, node, given_key.span, environment)
        elif default is not None:
            inner.given[name] = Given(name, default, key.span, inner)
        else:
            if len(missing) > len(unknown):  # else one that is misspelt probably stands for it
                report_missing_argument(limb, plan, name, key, findings)
            inner.given[name] = Given(name, None, key.span, inner)
    return inner


def report_missing_argument(limb: BodyLimb, plan: Plan, name: str, key: Text, findings: Findings) -> None:
    """Report an argument that is left out."""
    place = plan.original.template.span if plan.original.template is not None else limb.span
    message = f"limb `{limb.name}` leaves out the argument `{name}` of template `{plan.original.template}`"
    related = (Related("declared", key.span, note=True),)
    findings.report("missing-argument", message, place, f"needs `{name}`", None, related)


def check_unused(template: TemplateOf, name: str, environment: Environment, findings: Findings) -> None:
    """Warn of a template that no limb uses, and look for faults in it all the same."""
    findings.report("unused-name", f"no limb uses the template `{name}`", template.key.span)
    inner = Environment(template.environment.units, findings, {}, template.environment)
    for argument, (key, default) in template.arguments().items():
        inner.given[argument] = Given(argument, default, key.span, inner)
    build_chain(BodyLimb(name, template.key.span, (), ()), template.block.chain, inner, environment.units)


def link_parents(body: ResolvedBody, plans: dict[str, Plan], findings: Findings) -> None:
    """Find the part that each limb hangs from, and refuse circles."""
    places: dict[str, Span] = {}
    for name, plan in plans.items():
        limb = body.limbs[name]
        node = values.word(plan.parent, body.environment)
        for section in limb.sections:
            node = node or values.word(section.block.parent, section.environment)
        if node is not None:
            limb.parent = parent_of(body, node, findings)
            places[limb.name] = node.span
    for limb in body.limbs.values():
        if limb.parent is not None and hangs_from_itself(body, limb):
            span = places[limb.name]
            findings.report(
                "circular-reference", f"limb `{limb.name}` hangs from itself in the end", span, "closes the circle"
            )
            limb.parent = None
    refuse_deep(body, places, findings)


def refuse_deep(body: ResolvedBody, places: dict[str, Span], findings: Findings) -> None:
    """Refuse limbs that hang from limbs too often; each is looked at once, after those that it hangs from."""
    depth: dict[str, int] = {}
    for limb in body.limbs.values():
        way = [limb]
        while (parent := way[-1].parent) is not None and parent[0] not in depth:
            way.append(body.limbs[parent[0]])
        for each in reversed(way):
            depth[each.name] = 0 if each.parent is None else depth[each.parent[0]] + 1
            if depth[each.name] > findings.limits.hanging:
                message = f"limbs hang from limbs more than {findings.limits.hanging} deep"
                findings.report_once("limit-exceeded", message, places[each.name], raised_by("hanging"))


def parent_of(body: ResolvedBody, node: Text, findings: Findings) -> tuple[str, str] | None:
    """`limb.joint` as a limb and its joint."""
    name, dot, joint = node.partition(".")
    limb = body.limbs.get(name)
    if limb is None:
        known = [f"{n}.{joint}" for n in body.limbs] if dot else list(body.limbs)
        findings.report(
            "unknown-limb",
            f"there is no limb `{name}` to hang from",
            node.part(0, len(name)),
            "",
            did_you_mean(node, known),
        )
        return None
    if not dot:
        known = [f"{name}.{item.name}" for item in limb.joints]
        message = f"`parent` names the joint whose part the limb hangs from: `{name}.JOINT`"
        findings.report(
            "unknown-joint",
            message,
            node.span,
            "no joint",
            did_you_mean(node, known) or f"such as `{known[-1]}`" if known else None,
        )
        return None
    if limb.joint(joint) is None and not limb.is_hole:
        help = did_you_mean(joint, [item.name for item in limb.joints])
        message = f"limb `{name}` has no joint `{joint}`"
        findings.report("unknown-joint", message, node.part(len(name) + 1, len(node)), "", help)
        return None
    return None if limb.is_hole else (name, joint)


def hangs_from_itself(body: ResolvedBody, limb: BodyLimb) -> bool:
    """Whether the way to the root comes back to the limb."""
    seen, at = set(), limb
    while at.parent is not None and at.name not in seen:
        seen.add(at.name)
        at = body.limbs[at.parent[0]]
    return at.parent is not None and at is limb
