"""An analysis as text: what is wrong first, each finding with what would help."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gesturec.analysis.report import Analysis, MachineAnalysis, Pair, Separation

TOLD = 5  # pairs, groups or states that are listed of each kind


def analysis_text(analysis: Analysis) -> str:
    """The report for a terminal."""
    merge = f"states mistaken in {100 * analysis.merge:g} % or more merge"
    lines = [f"{analysis.name}: single frames, noise {1000 * analysis.noise:g} mm, pose known; {merge}"]
    if analysis.without_effect:
        lines.append(f"hiding {_listed(analysis.without_effect)} changes nothing here: no machine is told by it")
    if not analysis.machines:
        lines.append("no machine: a body without quantised or keyed joints has no states to tell apart")
    lines += _machines(analysis.machines)
    lines += [*_constraints(analysis), *_relations(analysis), *_rules(analysis)]
    return "\n".join(lines) + "\n"


def _machines(machines: Iterable[MachineAnalysis]) -> Iterator[str]:
    """Every machine; one of which the same is to be said as of one before, as of a mirrored limb, in a line."""
    said: dict[tuple[str, ...], str] = {}
    for machine in machines:
        yield ""
        lines = tuple(_machine(machine))
        alike = tuple(line.replace(f"{machine.name}.", ".").removeprefix(machine.name) for line in lines)
        if alike in said:
            yield f"{machine.name}: as `{said[alike]}`"
        else:
            said[alike] = machine.name
            yield from lines


def _machine(machine: MachineAnalysis) -> Iterator[str]:
    components = "one component" if machine.components == 1 else f"{machine.components} components"
    yield f"{machine.name}: {machine.states:,} states, {machine.transitions:,} transitions, {components}"
    if machine.unreachable:
        yield f"  cannot be reached: {_listed(machine.unreachable)}"
    if machine.dead_ends:
        yield f"  cannot be left: {_listed(machine.dead_ends)}"
    if machine.impossible:
        yield f"  left impossible by relations: {len(machine.impossible):,} states: {_listed(machine.impossible)}"
    for group in machine.equal[:TOLD]:
        yield f"  equal to every token: {_listed(group)}"
    yield from _more(len(machine.equal), "sets of equal states")
    for separation in machine.separations:
        yield from _separation(separation)


def _separation(separation: Separation) -> Iterator[str]:
    hidden = f"{', '.join(separation.hidden)} hidden" if separation.hidden else "nothing hidden"
    if not separation.seen:
        yield f"  {hidden}: nothing is seen, so no state is told from another"
        return
    error, deviation = 100 * separation.error, 100 * separation.error_deviation
    yield f"  {hidden}: {error:.1f} ± {deviation:.1f} % of states decided wrongly, {_merging(separation)}"
    for pair in separation.pairs[:TOLD]:
        yield f"    {_pair(pair)}"
    if separation.nearest is not None and not separation.pairs:
        yield f"    nearest: {_pair(separation.nearest)}"
    yield from (f"  {line}" for line in _more(separation.merging, "pairs"))
    chains = [group for group in separation.groups if len(group) > 2]
    for group in chains[:TOLD]:
        yield f"    merged in a chain: {_listed(group)}"
    yield from (f"  {line}" for line in _more(len(chains), "chains"))
    for remedy in separation.remedies:
        yield f"    {'parts' if remedy.kind == 'token' else 'joins'} {remedy.pairs}: {remedy.text}"


def _merging(separation: Separation) -> str:
    return {0: "no pair merges", 1: "1 pair merges"}.get(separation.merging, f"{separation.merging:,} pairs merge")


def _pair(pair: Pair) -> str:
    differ = f" (differ in {', '.join(pair.differ)})" if pair.differ else ""
    return f"{pair.one} ~ {pair.other}: {pair.separation:.2f} deviations, {_share(pair.error)} wrong{differ}"


def _share(error: float) -> str:
    """A share in per cent, with a digit where it is small."""
    return f"{100 * error:.0f} %" if error >= 0.05 else f"{100 * error:.2g} %"


def _constraints(analysis: Analysis) -> Iterator[str]:
    if analysis.constraints:
        yield "\nconstraints, each on its own"
    for removed in analysis.constraints:
        states = "too many to count" if removed.states is None else f"{removed.states:,} states"
        arcs = "" if removed.arcs is None else f" and {removed.arcs:,} transitions"
        what = "nothing: it holds in every state" if removed.states == 0 else f"{states}{arcs}"
        yield f"  {removed.name} ({removed.machine}): removes {what}"


def _relations(analysis: Analysis) -> Iterator[str]:
    if analysis.relations:
        yield "\nrelations across machines"
    for relation in analysis.relations:
        count, does = relation.forbidden, "forbids"
        if relation.kind != "require":
            count, does = relation.costing, "weighs"
        share = f"{count:,} of {relation.combinations:,} ({100 * count / relation.combinations:.1f} %)"
        yield f"  {relation.name} ({', '.join(relation.machines)}): {does} {share if count else 'nothing'}"
        if relation.impossible:
            yield f"    by itself leaves {len(relation.impossible):,} states impossible: {_listed(relation.impossible)}"


def _rules(analysis: Analysis) -> Iterator[str]:
    if analysis.rules:
        yield "\nrules"
    done = {"forbid": "removes", "allow": "adds", "prefer": "makes dearer"}
    for rule in analysis.rules:
        what = f"{rule.arcs:,} transitions" if rule.arcs else "nothing"
        yield f"  {rule.name} ({rule.machine}): {done[rule.kind]} {what}"


def _listed(names: Iterable[str]) -> str:
    names = tuple(names)
    more = f" and {len(names) - TOLD:,} more" if len(names) > TOLD else ""
    return ", ".join(names[:TOLD]) + more


def _more(count: int, what: str) -> Iterator[str]:
    if count > TOLD:
        yield f"  … {count - TOLD:,} more {what}"
