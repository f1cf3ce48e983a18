"""Rules on one step that no machine alone can obey: an `allow` that names several.

In: a body whose rules and poses are typed. Out: findings. `forbid` and `prefer` of several machines weigh what they do
together; `allow` adds a step to one machine's own, and there is no joint step that it could add.
"""

from __future__ import annotations

from gesturec.checks.body import ResolvedBody
from gesturec.language.expressions.scope import CycleAt, Joint, LevelTest, Limb, Pose, StateTest, Symbol, Token
from gesturec.language.expressions.typed import Typed, walk
from gesturec.language.findings import Findings

LOCAL = frozenset(("local_token", "prev_local_token"))  # seen from the part that the limb hangs from


def refuse_joint_allows(body: ResolvedBody, findings: Findings) -> None:
    """Report every `allow` that speaks of several machines."""
    own = (rule for machine in body.machines.values() for rule in machine.rules)
    for rule in (*own, *body.rules):
        machines = sorted(machines_of(rule.expressed.typed, body)) if rule.kind == "allow" else []
        if len(machines) > 1:
            named = ", ".join(f"`{name}`" for name in machines)
            message = f"an `allow` adds steps to one machine, and this one names {len(machines)}: {named}"
            help = "write one `allow` for each machine, and `forbid` what they may not do together"
            findings.report("allow-of-several", message, rule.expressed.span, "", help)


def machines_of(typed: Typed, body: ResolvedBody) -> set[str]:
    """The machines that an expression speaks of, by full name; through poses too."""
    return {
        machine
        for node in walk(typed)
        for symbol in node.symbols
        for machine in symbol_machines(symbol, body, is_local=node.op in LOCAL)
    }


def symbol_machines(symbol: Symbol, body: ResolvedBody, is_local: bool) -> set[str]:
    """The machines behind one name."""
    match symbol:
        case StateTest(machine=machine) | CycleAt(machine=machine):
            return {machine}
        case Joint(name=name) | LevelTest(joint=name):
            return limb_machines(name, body, is_carried=False)
        case Token(name=name) | Limb(name=name):
            return limb_machines(name, body, is_carried=not is_local)
        case Pose(full=full):
            return pose_machines(full, body)
    return set()


def limb_machines(name: str, body: ResolvedBody, is_carried: bool) -> set[str]:
    """The machine of the limb of a name, and those of the limbs that carry it."""
    from gesturec.checks.spanning import single

    above, one, inner = single(name, body)
    limb, found = one.limbs.get(inner.partition(".")[0]), set[str]()
    while limb is not None:
        if limb.machine is not None:
            found.add(f"{above}.{limb.machine}" if above else limb.machine)
        limb = one.limbs.get(limb.parent[0]) if is_carried and limb.parent is not None else None
    return found


def pose_machines(full: str, body: ResolvedBody) -> set[str]:
    """The machines that a pose speaks of; of a wrong one none."""
    from gesturec.checks.spanning import known_part

    found = known_part(full, body)
    if found is not None:
        part, inner = found
        return {f"{part.name}.{machine}" for machine in pose_machines(inner, part.body)}
    pose = body.poses.get(full)
    return set() if pose is None else {name for part in pose.parts for name in machines_of(part.typed, body)}
