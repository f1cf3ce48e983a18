"""Machines: which limbs each takes in, and how their configuration space becomes states.

In: limbs with their chains, the `machine` blocks of limbs and templates, `machines` and `transitions` at the top.
Out: a `BodyMachine` for each limb with a free joint, or for those that a machine at the top takes together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from gesturec.checks import values
from gesturec.checks.body import BodyArc, BodyCell, BodyDwell, BodyLimb, BodyMachine, BodyState, ResolvedBody
from gesturec.checks.configuration import Wish, joint_wishes, limb_entries
from gesturec.checks.environment import Environment
from gesturec.checks.plausible import LONGEST_PAUSE, LONGEST_TICK, suspect_time
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Sequence, Text
from gesturec.language.expressions import tree
from gesturec.language.expressions.parse import ExpressionError, parse_arc
from gesturec.language.expressions.units import TIME
from gesturec.language.findings import Findings
from gesturec.language.schema.blocks import LimbMachine, Machine, Transitions
from gesturec.language.schema.leaf import texts_in, wrong_kind


class MachinePlan(NamedTuple):
    """A machine to build: its limbs, and what is written about it."""

    name: str
    span: Span
    limbs: tuple[BodyLimb, ...]
    block: LimbMachine | None
    environment: Environment
    is_own: bool  # one limb's own, whose states are joint maps


def build_machines(body: ResolvedBody, environment: Environment, findings: Findings) -> list[MachinePlan]:
    """Build every machine of the body; returns the plans, for the rules, which are typed later."""
    taken = take_limbs(body, environment, findings)
    plans = [*own_machines(body, taken, environment, findings)]
    for key, block in body.model.main.block.machines.items():
        limbs = tuple(limb for limb in body.limbs.values() if taken.get(limb.name) == key)
        plans.append(MachinePlan(str(key), key.span, limbs, block, environment, is_own=False))
    for plan in plans:
        for limb in plan.limbs:
            limb.machine = plan.name
        body.machines[plan.name] = build_machine(plan, body, environment)
        check_parents(plan, findings)
    return plans


def take_limbs(body: ResolvedBody, environment: Environment, findings: Findings) -> dict[str, Text]:
    """Which machine at the top takes in which limb."""
    taken: dict[str, Text] = {}
    for key, block in body.model.main.block.machines.items():
        for item, name in listed_limbs(block, body, environment):
            if name in taken and taken[name] != key:
                message = f"limb `{name}` is taken in by two machines, `{taken[name]}` and `{key}`"
                related = (Related("the other", taken[name].span),)
                findings.report("two-machines", message, item.span, "", None, related)
            taken.setdefault(name, key)
    return taken


def listed_limbs(block: Machine, body: ResolvedBody, environment: Environment) -> Iterator[tuple[Text, str]]:
    """The limbs that a machine at the top names, groups written out."""
    if isinstance(block.limbs, Sequence) and not block.limbs:
        environment.findings.report("empty-group", "a machine takes in at least one limb", block.key("limbs"))
    for item in values.listed(block.limbs, environment):
        if item in body.limbs:
            yield item, str(item)
        elif item in body.groups:
            yield from ((item, member) for member in body.groups[str(item)] if member in body.limbs)
        else:
            help = did_you_mean(item, [*body.limbs, *body.groups])
            environment.findings.report("unknown-limb", f"there is no limb or group `{item}`", item.span, "", help)


def own_machines(
    body: ResolvedBody, taken: dict[str, Text], environment: Environment, findings: Findings
) -> Iterator[MachinePlan]:
    """The machines of limbs that no machine at the top takes in."""
    for limb in body.limbs.values():
        written = limb.machine_block
        own = next((section.block.machine for section in limb.sections[-1:] if section.block.machine), None)
        if limb.name in taken:
            if own is not None:
                key = taken[limb.name]
                related = (Related("the other", key.span),)
                message = f"limb `{limb.name}` has a machine of its own and belongs to machine `{key}`"
                findings.report("two-machines", message, own.start, "", None, related)
        elif any(joint.is_free for joint in limb.joints):
            block, inner = written or (None, environment)
            yield MachinePlan(limb.name, limb.span, (limb,), block, inner, is_own=True)
        elif own is not None and not limb.is_hole:
            message = f"limb `{limb.name}` has no joint that is quantised or keyed, so it has no machine"
            findings.report("no-machine", message, own.start)


def build_machine(plan: MachinePlan, body: ResolvedBody, environment: Environment) -> BodyMachine:
    """One machine from its plan."""
    block, top = plan.block, body.model.main.block.transitions
    above = (*body.outer, *([] if top is None else [(top, environment)]))
    machine = BodyMachine(plan.name, tuple(limb.name for limb in plan.limbs), plan.span, "grid", "adjacent")
    machine.is_hole = any(limb.is_hole for limb in plan.limbs)
    if block is not None:
        machine.states = tuple(states_of(block, plan, body))
        if block.cycle or block.path:
            from gesturec.checks.cycles import build_curve

            machine.cycle = build_curve(block, plan.limbs, plan.environment, plan.is_own)
        for first, second in (("cycle", "path"),):
            if block.has(first) and block.has(second):
                related = (Related(f"beside `{first}`", block.key(first)),)
                message = f"a machine has `{first}` or `{second}`, not both"
                plan.environment.findings.report("conflicting-keys", message, block.key(second), "", None, related)
        machine.kind = (
            "cycle"
            if block.has("cycle")
            else "path"
            if block.has("path")
            else "states"
            if block.has("states")
            else "grid"
        )
    set_steps(machine, block, above, plan.environment)
    if block is not None:
        warn_of_step(block, machine, plan.environment)
        machine.arcs = tuple(arcs_of(block, machine, plan.environment))
        machine.dwell = tuple(dwell_of(block, machine, plan.environment))
        machine.reverse = values.truth(block.reverse, plan.environment)
        if machine.reverse and machine.kind not in ("path", "cycle"):
            message = "`reverse` is about a path, and this machine has none"
            plan.environment.findings.report("conflicting-keys", message, block.key("reverse"))
    check_keyed(machine, plan)
    return machine


def set_steps(
    machine: BodyMachine,
    block: LimbMachine | None,
    above: tuple[tuple[Transitions, Environment], ...],
    inner: Environment,
) -> None:
    """`step` and `tick`: the machine's own, else those of the innermost `transitions`, else the defaults."""
    machine.step = "any" if machine.kind == "states" else "adjacent"
    sources: list[tuple[LimbMachine | Transitions, Environment]] = [*above]
    sources += [] if block is None else [(block, inner)]
    for source, environment in sources:
        step = values.word(source.step, environment)
        if step in ("adjacent", "single", "any") and not (source is not block and machine.kind == "states"):
            machine.step = str(step)  # type: ignore[assignment]
        tick = values.positive(source.tick, environment, TIME)
        suspect_time(source.tick, environment, (tick,), LONGEST_TICK)
        machine.tick = tick if tick is not None else machine.tick


def warn_of_step(block: LimbMachine, machine: BodyMachine, environment: Environment) -> None:
    """Warn of a `step` of what has no grid to step in: along a curve time says how far one goes."""
    if machine.cycle is not None and block.has("step"):
        message = f"`step` is about a grid, and machine `{machine.name}` is a {machine.kind}"
        help = "leave it out: a cycle's `period` and a path's `duration` bound how far one frame goes"
        environment.findings.report("ignored-key", message, block.key("step"), "ignored", help)


def exclusive_of(body: ResolvedBody, environment: Environment) -> tuple[str, ...]:
    """What changes only one at a time; of several bodies machines by `body.machine`."""
    top = body.model.main.block.transitions
    items = values.listed(top.exclusive, environment) if top is not None else []
    names = body.machine_names()
    known = ("motion", "deformation", *names)
    for item in items:
        if item not in known:
            message = f"`{item}` is neither `motion`, `deformation` nor a machine"
            environment.findings.report("unknown-machine", message, item.span, "", did_you_mean(item, known))
    machines = [item for item in items if item in names]
    if machines and "deformation" in items:
        message = "`deformation` is all machines together, so no machine stands beside it"
        environment.findings.report("conflicting-keys", message, machines[0].span)
    if len(items) == 1:
        message = "of one thing at most one changes anyway"
        environment.findings.report("idle-constraint", message, items[0].span)
    return tuple(str(item) for item in items)


def states_of(block: LimbMachine, plan: MachinePlan, body: ResolvedBody) -> Iterator[BodyState]:
    """Named states, each a configuration map."""
    for key, node in block.states.items():
        if isinstance(node, Mapping):
            wrong: set[tuple[str, str]] = set()
            yield BodyState(str(key), tuple(state_cells(node, plan, body, wrong)), key.span, wrong=frozenset(wrong))
        else:
            if node is not None:
                wrong_kind(node, "a configuration map", plan.environment.findings)
            yield BodyState(str(key), (), key.span, is_hole=True)


def state_cells(
    node: Mapping, plan: MachinePlan, body: ResolvedBody, wrong: set[tuple[str, str]]
) -> Iterator[BodyCell]:
    """What a state says of joints; those of which it says something wrong, which is reported, go to `wrong`."""
    when = node.key("when")
    if when is not None:
        message = "a state is a cell of joint values; `when` belongs into a pose"
        plan.environment.findings.report("unknown-key", message, when.span)
    maps = [(plan.limbs[0], node)] if plan.is_own else [*limb_maps(node, plan, body)]
    for limb, joint_map in maps:
        wishes = joint_wishes(joint_map, limb, plan.environment, "state")
        wrong |= {(limb.name, str(key)) for key in joint_map} - {(limb.name, wish.joint.name) for wish in wishes}
        for wish in wishes:
            if not wish.joint.is_free:
                message = f"joint `{wish.joint.name}` is {wish.joint.source}, and no state gives it a value"
                plan.environment.findings.report("no-joint", message, wish.span)
            elif wish.cell is not None and is_bounded(wish, plan.environment):
                yield wish.cell
            elif wish.cell is not None:
                wrong.add((limb.name, wish.joint.name))


def is_bounded(wish: Wish, environment: Environment) -> bool:
    """Whether a keyed joint has a cell with both ends, its own range's if the state leaves one open."""
    cell, joint = wish.cell, wish.joint
    if cell is None or joint.source != "keyed":
        return True
    if math.isfinite(max(cell.low, joint.low)) and math.isfinite(min(cell.high, joint.high)):
        return True
    message = f"a state of joint `{joint.name}` has two ends, and neither this nor a `range` gives both"
    environment.findings.report(
        "bad-interval", message, wish.span, "open", "write both ends, or give the joint a `range`"
    )
    return False


def limb_maps(node: Mapping, plan: MachinePlan, body: ResolvedBody) -> Iterator[tuple[BodyLimb, Mapping]]:
    """The joint maps of a state of several limbs."""
    for entry in limb_entries(node, body, plan.environment, "state"):
        if entry.limb not in plan.limbs:
            message = f"limb `{entry.limb.name}` does not belong to machine `{plan.name}`"
            plan.environment.findings.report("unknown-limb", message, entry.key.span)
        elif isinstance(entry.node, Mapping):
            yield entry.limb, entry.node
        else:
            wrong_kind(entry.node, "a joint map", plan.environment.findings)


def check_keyed(machine: BodyMachine, plan: MachinePlan) -> None:
    """Every keyed joint gets values from every state, and from the cycle or path where there is one."""
    findings = plan.environment.findings
    # A limb with a machine of its own beside this one is reported; its joints were to get their values there.
    limbs = [limb for limb in plan.limbs if plan.is_own or limb.machine_block is None]
    keyed = [joint for limb in limbs for joint in limb.joints if joint.source == "keyed"]
    has_curve = machine.kind in ("cycle", "path")
    for joint in keyed:
        if not machine.states and not has_curve:
            message = f"joint `{joint.name}` has no levels, and no `states`, `cycle` or `path` gives it values"
            help = "give it `levels:`, `every:` or `count:`, or a value"
            findings.report("keyed-without-values", message, joint.span, "keyed", help)
            continue
        for state in machine.states:
            named = {(cell.limb, cell.joint) for cell in state.cells}
            is_misspelt = any(
                limb.joint(name) is None for limb in limbs for each, name in state.wrong if each == limb.name
            )
            if (joint.limb, joint.name) not in named | state.wrong and not state.is_hole and not is_misspelt:
                message = f"state `{state.name}` gives no value to joint `{joint.full}`, which is keyed"
                findings.report("keyed-without-values", message, state.span)
    for joint in [joint for limb in plan.limbs for joint in limb.joints] if has_curve else ():
        if joint.source == "quantised":
            message = f"joint `{joint.full}` has levels, and every free joint of a cycle or path is keyed"
            findings.report("conflicting-keys", message, joint.span)


def check_parents(plan: MachinePlan, findings: Findings) -> None:
    """The limbs of a machine hang from one part, or from each other."""
    inside = {limb.name for limb in plan.limbs}
    parents = {limb.parent: limb for limb in plan.limbs if limb.parent is None or limb.parent[0] not in inside}
    if len(parents) > 1:
        first, second, *_ = parents.values()
        message = f"the limbs of machine `{plan.name}` hang from different parts"
        findings.report(
            "parents-differ",
            message,
            plan.span,
            "",
            None,
            (Related("one", first.span), Related("another", second.span)),
        )


def arcs_of(block: LimbMachine, machine: BodyMachine, environment: Environment) -> Iterator[BodyArc]:
    """Declared transitions; `a <-> b` is two."""
    known = machine.state_names()
    seen: dict[tuple[str, str], Span] = {}
    for item in arcs_written(block, environment):
        try:
            arc = parse_arc(item)
        except ExpressionError as error:
            environment.findings.add(error.diagnostic)
            continue
        good = [report_state(end, known, machine, environment) for end in (arc.source, arc.target)]
        if all(good):
            found = (arc.source.text, arc.target.text)
            both = [BodyArc(*ends, item.span) for ends in ((found, found[::-1]) if arc.both else (found,))]
            report_double_arc(both, seen, environment.findings)
            yield from both
    if block.arcs is not None and machine.kind == "grid":
        message = "arcs join named states and phases, and this machine has none"
        environment.findings.report("conflicting-keys", message, block.key("arcs"))


def arcs_written(block: LimbMachine, environment: Environment) -> list[Text]:
    """The texts of the arcs, which may be passed as a list."""
    node = None if block.arcs is None else values.whole(block.arcs, environment)[0]
    if node is None or (node is not block.arcs and not texts_in(node, "a list of arcs", environment.findings)):
        return []
    return [item for item in node if isinstance(item, Text)] if isinstance(node, Sequence) else []


def report_double_arc(arcs: list[BodyArc], seen: dict[tuple[str, str], Span], findings: Findings) -> None:
    """Report an arc that an earlier one declares too, in one of its directions."""
    for arc in arcs:
        first = seen.setdefault((arc.source, arc.target), arc.span)
        if first != arc.span:
            message = f"`{arc.source} -> {arc.target}` is declared twice"
            related = (Related("first here", first),)
            findings.report("repeated-member", message, arc.span, "again here", "name each once", related)
            return


def report_state(path: tree.Path, known: tuple[str, ...], machine: BodyMachine, environment: Environment) -> bool:
    """Whether a path is a state or phase of the machine; a finding if not."""
    if path.text in known or machine.kind == "grid":
        return path.text in known
    message = f"machine `{machine.name}` has no state or phase `{path.text}`"
    environment.findings.report("unknown-state", message, path.span, "", did_you_mean(path.text, known))
    return False


def dwell_of(block: LimbMachine, machine: BodyMachine, environment: Environment) -> Iterator[BodyDwell]:
    """Bounds on the time in states and phases."""
    node = block.dwell
    known = machine.state_names()
    if isinstance(node, Text):
        found = dwell_interval(node, environment)
        if found is not None:
            yield BodyDwell(None, *found, node.span)
    for key, value in node.items() if isinstance(node, Mapping) else ():
        found = dwell_interval(value, environment) if isinstance(value, Text) else None
        if key not in known:
            message = f"machine `{machine.name}` has no state or phase `{key}`"
            environment.findings.report("unknown-state", message, key.span, "", did_you_mean(key, known))
        elif found is not None:
            yield BodyDwell(str(key), *found, key.span)


def dwell_interval(node: Text, environment: Environment) -> tuple[float, float] | None:
    """A dwell time, which is not below zero."""
    found = values.interval(node, environment, TIME)
    if found is not None and (found[0] < 0 < found[1] - found[0] and found[0] != -float("inf")):
        environment.findings.report("value-out-of-range", "a time is not below zero", node.span)
        return None
    if found is not None and found[1] <= 0:
        message = "the longest time in a state is above zero"
        environment.findings.report("value-out-of-range", message, node.span, "must be above zero")
        return None
    suspect_time(node, environment, found or (), LONGEST_PAUSE)
    return None if found is None else (max(0.0, found[0]), found[1])
