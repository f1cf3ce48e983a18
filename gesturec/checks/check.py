"""The checks, as a table of contents: a `Model` becomes a `ResolvedBody`, and every fault on the way a finding.

In: a model and the settings of its parameters. Out: the body with every name resolved, and the findings, all of
them, each once, sorted by place. An unknown name becomes a hole about which nothing more is said.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping

from gesturec.checks.bindings import build_bindings
from gesturec.checks.body import BodyLimb, Expressed, ResolvedBody
from gesturec.checks.constraints import build_constraints, build_rules
from gesturec.checks.follow import causes_alone
from gesturec.checks.gestures import Gestures, WrittenGesture, written_gestures
from gesturec.checks.limbs import build_limbs
from gesturec.checks.machines import build_machines, exclusive_of
from gesturec.checks.model_tests import build_tests
from gesturec.checks.names import build_groups, build_root, check_names, expansion_notes, tokens_of
from gesturec.checks.parameters import SCALE, Settled, settle
from gesturec.checks.poses import Poses, WrittenPose, typed_expression, written_poses
from gesturec.checks.profile import profile_settings
from gesturec.checks.scopes import BodyScope, Names
from gesturec.checks.steps import refuse_joint_allows
from gesturec.checks.suspicions import WrongPlaces, is_misspelt, report_unread, warn_of_empty, warn_of_root
from gesturec.diagnostics.alike import told_once
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.errors import ModelError
from gesturec.diagnostics.render import place_of_start
from gesturec.language.expressions.typed import Type, uses
from gesturec.language.findings import Findings
from gesturec.language.limits import DEFAULT_LIMITS, Limits
from gesturec.language.model import Model
from gesturec.language.schema.blocks import JointEntry

# Rules about a text by itself.
OF_WRITING = frozenset(
    ("bad-expression", "bad-pattern", "bad-interval", "bad-arc", "bad-number", "unknown-unit", "unknown-function")
)
NO_SETTINGS: Mapping[str, object] = {}


def check_model(model: Model, settings: Mapping[str, object] = NO_SETTINGS) -> tuple[Diagnostic, ...]:
    """Every finding of a model, sorted by place."""
    return resolve_model(model, settings)[1].sorted()


def resolve_model(
    model: Model,
    settings: Mapping[str, object] = NO_SETTINGS,
    profile: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> tuple[ResolvedBody, Findings]:
    """The body of a model with every name resolved, and the findings. With an error in them it has holes.

    A profile sets parameters as `settings` do, which come after it.
    """
    findings = Findings(limits)
    for finding in model.findings:
        findings.add(finding)
    try:
        body = resolved_body(model, settings, profile, findings)
        findings = causes_alone(findings, model)
        return body, certain(findings, model) if model.broken else findings
    except RecursionError:
        # What may nest has limits; this is for what nests through several kinds of names at once.
        message = "names are defined by other names too deep to be followed"
        findings.report("limit-exceeded", message, place_of_start(model.main.source))
        raise ModelError(findings.sorted()) from None


def certain(findings: Findings, model: Model) -> Findings:
    """What is wrong whatever the sections say that could not be read: how something is written, not what it names."""
    kept = Findings()
    for finding in findings.sorted():
        if finding in model.findings or finding.rule in OF_WRITING:
            kept.add(finding)
    return kept


def resolved_body(
    model: Model, settings: Mapping[str, object], profile: str | os.PathLike[str] | None, findings: Findings
) -> ResolvedBody:
    """The body of a model with every name resolved; of several bodies, what spans them with the bodies as parts."""
    told = {**profile_settings(profile, findings, model.body_names()), **settings}
    body, settled = settled_body(model, told, findings)
    build_own(body, settled, told, findings)
    return body


def settled_body(model: Model, told: Mapping[str, object], findings: Findings) -> tuple[ResolvedBody, Settled]:
    """A body with its parameters, of which nothing is built yet; settings of its bodies are theirs."""
    own = {name: value for name, value in told.items() if name.partition(".")[0] not in model.bodies}
    settled = settle(model, own, findings)
    body = ResolvedBody(model, str(model.main.block.name or ""), settled.of(model.main))
    body.scale, body.flip, body.parameters = settled.scale, settled.flip, dict(settled.effective)
    return body, settled


def build_own(
    body: ResolvedBody, settled: Settled, told: Mapping[str, object], findings: Findings
) -> tuple[Names, Poses] | None:
    """What a file says of its body, or of its bodies; None where it cannot be built, which is reported."""
    block = body.model.main.block
    if not block.has("bodies"):
        return build_parts(body, settled, findings)
    from gesturec.checks.bodies import build_bodies

    # with a root beside them, which is reported, what is in the file is of neither kind
    return None if block.has("root") else build_bodies(body, settled, told, findings)


def build_parts(body: ResolvedBody, settled: Settled, findings: Findings) -> tuple[Names, Poses]:
    """Everything that a body is made of, each part in the names of those before it; what names its poses have."""
    environment = body.environment
    build_root(body, environment)
    build_limbs(body, settled, findings)
    build_groups(body, findings)
    plans = build_machines(body, environment, findings)
    check_names(body, findings)
    names = Names(lambda full: None, lambda full: None, {}, {})
    poses = Poses(body, names, written_poses(body, environment))
    gestures = Gestures(body, names, written_gestures(body, environment))
    names.pose, names.gesture = poses.look_up, gestures.look_up
    names.poses = own_names(poses.written.values())
    names.gestures = own_names(gestures.written.values())
    poses.resolve_inner()
    build_couplings(body, names, findings)
    build_constraints(body, names, environment, findings)
    build_rules(body, plans, names, environment)
    body.poses = {full: pose for full in poses.written if (pose := poses.resolve(full)) is not None}
    refuse_joint_allows(body, findings)
    gestures.build()
    body.exclusive = exclusive_of(body, environment)
    body.bindings = build_bindings(body, settled, findings)
    body.tests = build_tests(body, poses, tuple(gestures.written), environment)
    warn(body, settled, findings)
    return names, poses


def own_names(written: Iterable[WrittenPose | WrittenGesture]) -> dict[str | None, tuple[str, ...]]:
    """The own names of poses or gestures, by limb."""
    found: dict[str | None, tuple[str, ...]] = {}
    for item in written:
        limb = item.limb.name if item.limb is not None else None
        found[limb] = (*found.get(limb, ()), str(item.key))
    return found


def build_couplings(body: ResolvedBody, names: Names, findings: Findings) -> None:
    """Type the `follows` of every coupled joint in the scope of its limb's joints."""
    for limb in body.limbs.values():
        section = limb.sections[0] if limb.sections else None
        for entry in section.block.chain if section is not None else ():
            joint = limb.joint(entry.joint) if isinstance(entry, JointEntry) and entry.joint is not None else None
            if joint is None or not isinstance(entry, JointEntry) or entry.follows is None or section is None:
                continue
            scope = BodyScope(body, names, section.environment, limb, only_joints=True)
            notes = expansion_notes(limb)
            findings.context.extend(notes)
            typed = typed_expression(entry.follows, scope, Type("number", joint.kind))
            del findings.context[len(findings.context) - len(notes) :]
            if typed is not None:
                if not uses(typed).joints:
                    message = f"`{entry.follows}` names no joint to follow"
                    findings.report("no-joint", message, entry.follows.span, "", "a fixed joint has `value:`")
                joint.follows = Expressed(typed, scope, limb.name, entry.follows.span)


def warn(body: ResolvedBody, settled: Settled, findings: Findings) -> None:
    """What is legal and probably not meant."""
    wrong = WrongPlaces(findings)
    for name, (key, block, _) in settled.blocks.items():
        given = body.environment.find(name)
        if given is None or given.is_used or name == SCALE or is_misspelt(name, findings):
            continue
        if wrong.has_in(key.span) or wrong.has_in(block.span):
            continue
        if not report_unread(given.node, findings):
            findings.report("unused-name", f"nothing uses the parameter `{name}`", key.span)
    warn_of_root(body, findings)
    warn_of_empty(body, findings)
    blind = [
        Diagnostic(
            "no-visible-token",
            f"no token of machine `{limb.name}` can be measured, so nothing tells states apart",
            limb.span,
        )
        for limb in blind_limbs(body)
    ]
    for finding in told_once(blind, body.limbs):
        findings.add(finding)


def blind_limbs(body: ResolvedBody) -> Iterator[BodyLimb]:
    """Limbs with a machine of their own and no token that is measured, on them or on what hangs from them."""
    carried: set[str] = {
        token.limb for token in tokens_of(body).values() if token.limb and not token.virtual and token.joint >= 0
    }
    inwards = list(carried)
    while inwards:
        parent = body.limbs[inwards.pop()].parent
        if parent is not None and parent[0] not in carried:
            carried.add(parent[0])
            inwards.append(parent[0])
    for limb in body.limbs.values():
        if limb.machine == limb.name and limb.name not in carried and not limb.is_hole:
            yield limb
