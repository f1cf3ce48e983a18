"""Names of the body: one set at the top, one set in each limb; a name means one thing or is an error.

In: the blocks and the limbs built from them. Out: findings for what shares a name, and the flattened groups.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gesturec.checks import values
from gesturec.checks.body import BodyLimb, BodyToken, ResolvedBody
from gesturec.checks.chain import token_of
from gesturec.checks.environment import Environment
from gesturec.checks.order import inner_first
from gesturec.checks.rotations import ORIGIN
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Sequence, Text
from gesturec.language.expressions.units import LENGTH
from gesturec.language.findings import Findings
from gesturec.language.schema.blocks import LimbMachine, Template

Named = tuple[str, str, Span]  # name, what it is, place
STILL = "still"  # a truth of poses and gestures, in every place where a name of the author's could stand


def report_doubles(names: Iterable[Named], where: str, findings: Findings) -> bool:
    """Report every name that an earlier thing has already, and whether there was one."""
    doubles = False
    seen: dict[str, tuple[str, Span]] = {}
    for name, what, span in names:
        if name == STILL:
            message = f"`{STILL}` is the body at rest in poses and gestures, and here it would name a {what} too"
            findings.report("shadowed-name", message, span, "", "choose another name")
        if name in seen and seen[name][1] != span:
            doubles = True
            other, first = seen[name]
            both = f"two {what}s" if other == what else f"a {other} and a {what}"
            related = (Related(f"the {other}" if other != what else f"the first {what}", first),)
            label = f"the {what}" if other != what else f"the second {what}"
            findings.report("duplicate-name", f"`{name}` names {both} {where}", span, label, None, related)
        else:
            seen.setdefault(name, (what, span))
    return doubles


def build_root(body: ResolvedBody, environment: Environment) -> None:
    """The root's tokens."""
    root = body.model.main.block.root
    for key, block in root.tokens.items() if root is not None else ():
        at = values.vector(block.at, environment, LENGTH) or ORIGIN
        body.root_tokens[str(key)] = token_of(block, key, None, -1, at, environment)


def check_names(body: ResolvedBody, findings: Findings) -> None:
    """Find names that mean two things, at the top and in each limb."""
    report_doubles(top_names(body), "at the top", findings)
    for limb in body.limbs.values():
        notes = expansion_notes(limb)
        findings.context.extend(notes)
        # one of the two was to have another name, which may be used: say nothing of unknown ones
        limb.is_hole |= report_doubles(limb_names(limb), f"in limb `{limb.name}`", findings)
        del findings.context[len(findings.context) - len(notes) :]


def expansion_notes(limb: BodyLimb) -> tuple[Related, ...]:
    """The note of the limb that a template, or another limb's chain, was expanded for; none for its own chain."""
    if limb.flips or any(isinstance(section.block, Template) for section in limb.sections):
        return (Related(f"expanded from limb `{limb.name}`", limb.span, note=True),)
    return ()


def top_names(body: ResolvedBody) -> Iterator[Named]:
    """Every name at the top: limbs, groups, root tokens, poses, gestures, machines."""
    file = body.model.main.block
    for limb in body.limbs.values():
        yield limb.name, "limb", limb.span
    for part in body.model.parts:
        for key in part.block.groups:
            yield str(key), "group", key.span
    for token in body.root_tokens.values():
        yield token.name, "root token", token.span
    for what, keys in (("machine", file.machines), ("pose", file.poses), ("gesture", file.gestures)):
        for key in keys:
            yield str(key), what, key.span


def limb_names(limb: BodyLimb) -> Iterator[Named]:
    """Every name in a limb: joints, tokens, states, phases, poses, gestures."""
    for joint in limb.joints:
        yield joint.name, "joint", joint.span
    for token in limb.tokens:
        yield token.name, "token", token.span
    machine = limb.machine_block
    if machine is not None:
        yield from machine_names(machine[0])
    for section in limb.sections:
        for key in section.block.poses:
            yield str(key), "pose", key.span
        for key in section.block.gestures:
            yield str(key), "gesture", key.span


def machine_names(block: LimbMachine) -> Iterator[Named]:
    """States and phases as written."""
    for key in block.states:
        yield str(key), "state", key.span
    for curve in (block.cycle, block.path):
        if curve is not None and curve.phases is not None:
            yield from phase_names(curve.phases)


def phase_names(phases: Mapping) -> Iterator[Named]:
    """Phases and the phases that they are made of."""
    for key, value in phases.items():
        yield str(key), "phase", key.span
        if isinstance(value, Mapping):
            yield from phase_names(value)


def build_groups(body: ResolvedBody, findings: Findings) -> None:
    """Flatten every group to limbs, joints (`limb.joint`) or tokens."""
    groups = {str(key): (key, node) for part in body.model.parts for key, node in part.block.groups.items()}
    done: dict[str, tuple[str, ...] | None] = {}
    for name in inner_first({name: node for name, (_, node) in groups.items()}):
        flatten(name, groups, body, done, (), findings)
    for name in groups:
        body.groups[name] = flatten(name, groups, body, done, (), findings)
        kinds = sorted({member_kind(body, member) or "hole" for member in body.groups[name]} - {"hole"})
        if len(kinds) > 1:
            message = f"group `{name}` has members of two kinds, {kinds[0]}s and {kinds[1]}s"
            findings.report("mixed-group", message, groups[name][0].span)
            body.mixed_groups.add(name)


def flatten(
    name: str,
    groups: dict[str, tuple[Text, Text | Sequence | None]],
    body: ResolvedBody,
    done: dict[str, tuple[str, ...] | None],
    above: tuple[str, ...],
    findings: Findings,
) -> tuple[str, ...]:
    """The members of a group, groups in it written out."""
    if done.get(name) is not None:
        return done[name] or ()
    key, node = groups[name]
    members: list[str] = []
    for item in values.listed(node, body.environment):
        if item in (*above, name) and item in body.limbs:  # which is reported as two things of one name
            members.append(str(item))
        elif item in (*above, name):
            findings.report(
                "circular-reference", f"group `{item}` is a member of itself", item.span, "closes the circle"
            )
        elif item in groups:
            members += flatten(str(item), groups, body, done, (*above, name), findings)
        elif member_kind(body, item) is None:
            report_member(body, name, item, list(groups), findings)
        else:
            members.append(str(item))
    if isinstance(node, Sequence) and not node:
        findings.report("empty-group", f"group `{name}` has no members", key.span, "nothing in it")
    done[name] = tuple(dict.fromkeys(members))
    return done[name] or ()


def member_kind(body: ResolvedBody, path: str) -> str | None:
    """What a path names that a group may hold; None for nothing."""
    if path in body.limbs:
        return "limb"
    if path in body.root_tokens:
        return "token"
    limb_name, dot, name = path.partition(".")
    if not dot and body.root_is_hole:
        return "hole"
    limb = body.limbs.get(limb_name)
    if limb is None or not dot:
        return None
    if limb.is_hole:
        return "hole"
    if limb.joint(name) is not None:
        return "joint"
    return "token" if limb.token(name) is not None else None


def report_member(body: ResolvedBody, group: str, item: Text, groups: list[str], findings: Findings) -> None:
    """Report a member that there is not."""
    known = [*body.limbs, *body.root_tokens, *(g for g in groups if g != group)]
    for limb in body.limbs.values():
        known += [joint.full for joint in limb.joints] + [token.full for token in limb.tokens]
    message = f"group `{group}` has a member that is no limb, joint, token or group: `{item}`"
    findings.report("unknown-group", message, item.span, "not a part of the body", did_you_mean(item, known))


def tokens_of(body: ResolvedBody) -> dict[str, BodyToken]:
    """Every token by its full name, the root's first."""
    tokens = dict(body.root_tokens)
    for limb in body.limbs.values():
        tokens |= {token.full: token for token in limb.tokens}
    return tokens
