"""Cut the tree of a source into limbs: chains of joints, each a machine, that hang from the root or from a joint.

In: a `Skeleton`. Out: `Limb`s of `Step`s. Rigid joints vanish: their tokens go to the part that carries them, and
their frames stand before the joint that they lead to. A limb ends where the body branches. A coupling holds inside a
limb only, so limbs that a coupling joins are joined: after the one limb's joints the chain goes back along them, by
joints that undo them exactly, and goes on with the other's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gesturec.diagnostics.errors import InputError
from gesturec.scaffold.tree import ORIGIN, Coupling, Dof, Floats, Node, Rest, Skeleton, Token, compose

MAX_DOFS: Final = 6  # quantised joints of a limb; the grid of one machine is their product
MAX_DEGREE: Final = 16  # of a coupling through others
MAX_MOVING: Final = 2000  # joints of a body


@dataclass(eq=False)
class Moved:
    """A part that a degree of freedom moves (None: the root part), with all that is rigidly fixed to it."""

    name: str  # of the source's part
    dof: Dof | None
    line: int
    at: Floats
    rest: Rest
    parent: Moved | None
    frames: list[tuple[Floats, Rest]] = field(default_factory=list)  # from the parent part to the joint
    tokens: list[Token] = field(default_factory=list)
    children: list[Moved] = field(default_factory=list)

    @property
    def moving(self) -> Dof:
        """The degree of freedom of a part other than the root."""
        assert self.dof is not None
        return self.dof


@dataclass(frozen=True, eq=False)
class Step:
    """One move of a chain: to a part by its joint, or (`back`) exactly back."""

    part: Moved
    back: bool = False


@dataclass(eq=False)
class Limb:
    """A chain of steps that hangs from `parent` (None: the root)."""

    parent: Moved
    steps: list[Step]

    def stack(self) -> list[Moved]:
        """The parts between the limb's parent and where its chain has come to."""
        stack = [self.parent]
        for step in self.steps:
            if step.back:
                stack.pop()
            else:
                stack.append(step.part)
        return stack

    def parts(self) -> list[Moved]:
        """The parts that the limb's own joints move."""
        return [step.part for step in self.steps if not step.back]


def cut_into_limbs(skeleton: Skeleton) -> tuple[Moved, list[Limb]]:
    """The root part and the limbs, parents before those that hang from them.

    Raises
    ------
    InputError
        A coupling to a joint that is not there, in a circle, or between limbs that cannot be one chain.
    """
    root = _without_rigid_joints(skeleton)
    resolve_couplings(root, skeleton.path)
    limbs = _chains(root, per_node=skeleton.limb_per_node)
    for limb in limbs:
        _hand_back_centres(limb)
    limbs = _join_coupled(limbs, skeleton.path)
    return root, _parents_first(root, [piece for limb in limbs for piece in _pieces(limb)])


def all_parts(root: Moved) -> list[Moved]:
    """Every part, parents first."""
    parts = [root]
    for part in parts:
        parts.extend(part.children)
    return parts


def _without_rigid_joints(skeleton: Skeleton) -> Moved:
    """The tree of moved parts."""
    root = Moved(
        skeleton.root.name,
        None,
        skeleton.root.line,
        ORIGIN,
        skeleton.root.rest,
        None,
        tokens=list(skeleton.root.tokens),
    )
    # node, the part that carries it, its frame in that part (rotation, translation), rigid frames on the way there
    waiting: list[tuple[Node, Moved, Floats, Floats, list[tuple[Floats, Rest]]]] = [
        (child, root, np.eye(3), ORIGIN, []) for child in reversed(skeleton.root.children)
    ]
    count = 0
    while waiting:
        node, part, rotation, translation, frames = waiting.pop()
        if node.dof is not None:
            count += 1
            part = Moved(node.name, node.dof, node.line, node.at, node.rest, part, frames, list(node.tokens))
            assert part.parent is not None
            part.parent.children.append(part)
            rotation, translation, frames = np.eye(3), ORIGIN, []
        else:
            translation = translation + rotation @ node.at
            rotation = rotation @ node.rest.matrix
            part.tokens += [
                Token(token.name, translation + rotation @ token.at, token.comment) for token in node.tokens
            ]
            frames = [*frames, (node.at, node.rest)]
        if count > MAX_MOVING:
            raise InputError(f"more than {MAX_MOVING} moving joints, the limit", skeleton.path, node.line)
        waiting.extend((child, part, rotation, translation, frames) for child in reversed(node.children))
    return root


def resolve_couplings(root: Moved, path: str) -> None:
    """Let every coupling name a joint that is free, composing couplings of couplings; fixed ones become values."""
    parts = {part.moving.name: part for part in all_parts(root)[1:]}
    for part in parts.values():
        if part.moving.coupling is not None:
            coupling = _resolved(part, part.moving.coupling, parts, path)
            part.dof = _with_coupling(part.moving, coupling, parts[coupling.other].moving)


def _resolved(part: Moved, coupling: Coupling, parts: dict[str, Moved], path: str) -> Coupling:
    """The coupling to the joint at the end of the row of joints that follow each other."""
    met = [part.moving.name]
    while True:
        if coupling.other not in parts:
            there = f"`{coupling.other}`, which is no joint that moves"
            raise InputError(f"joint `{met[-1]}` follows {there}", path, part.line)
        met.append(coupling.other)
        if coupling.other in met[:-1]:
            raise InputError(f"joints follow each other in a circle: {' -> '.join(met)}", path, part.line)
        following = parts[coupling.other].moving.coupling
        if following is None:
            return coupling
        degree = (len(coupling.coefficients) - 1) * (len(following.coefficients) - 1)
        if degree > MAX_DEGREE:
            raise InputError(
                f"joint `{met[0]}` follows others by a polynomial of degree {degree}; the limit is {MAX_DEGREE}",
                path,
                part.line,
            )
        coupling = Coupling(following.other, compose(coupling.coefficients, following.coefficients))


def _with_coupling(dof: Dof, coupling: Coupling, other: Dof) -> Dof:
    if other.value is None:
        return Dof(dof.name, dof.type, dof.axis, dof.low, dof.high, coupling, None, dof.max_speed, dof.comment)
    value = float(np.polynomial.Polynomial(coupling.coefficients)(other.value))
    comment = f"follows `{other.name}`, which is fixed"
    return Dof(dof.name, dof.type, dof.axis, dof.low, dof.high, None, value, dof.max_speed, comment)


def _chains(root: Moved, *, per_node: bool) -> list[Limb]:
    """Limbs that end where the body branches, and with `per_node` at every token too."""
    limbs = []
    waiting = [(root, child) for child in reversed(root.children)]
    while waiting:
        parent, part = waiting.pop()
        steps = [Step(part)]
        while len(part.children) == 1 and not (per_node and part.tokens):
            part = part.children[0]
            steps.append(Step(part))
        limbs.append(Limb(parent, steps))
        waiting.extend((part, child) for child in reversed(part.children))
    return limbs


def _hand_back_centres(limb: Limb) -> None:
    """Give tokens at the centre of a limb's first hinges to the part that it hangs from.

    They do not move with those hinges, but show where the parent's part is, and a token tells of its own limb only.
    """
    rotation, translation = np.eye(3), ORIGIN
    for k, part in enumerate(limb.parts()):
        for at, rest in [*part.frames, (part.at, part.rest)]:
            if k and at.any():
                return
            translation, rotation = translation + rotation @ at, rotation @ rest.matrix
        if part.moving.type != "hinge":
            return
        centres = [token for token in part.tokens if not token.at.any()]
        part.tokens = [token for token in part.tokens if token.at.any()]
        limb.parent.tokens += [Token(token.name, translation, token.comment) for token in centres]


def _join_coupled(limbs: list[Limb], path: str) -> list[Limb]:
    """Join limbs until every coupled joint is in the limb of the joint that it follows."""
    home = {part.moving.name: limb for limb in limbs for part in limb.parts()}
    kept = list(limbs)
    for part in [part for limb in limbs for part in limb.parts()]:
        coupling = part.moving.coupling
        if coupling is None or home[part.moving.name] is home[coupling.other]:
            continue
        driver, follower = home[coupling.other], home[part.moving.name]
        joined = _joined(driver, follower) or _joined(follower, driver)
        if joined is None:
            raise InputError(
                f"joint `{part.moving.name}` follows `{coupling.other}`, and no one chain of joints has both; "
                "a limb is a chain, and couplings hold within one",
                path,
                part.line,
            )
        kept = [joined if limb is driver else limb for limb in kept if limb is not follower]
        home.update({moved.moving.name: joined for moved in joined.parts()})
    return kept


def _joined(first: Limb, second: Limb) -> Limb | None:
    """One chain: the first limb, back to where the second hangs from, the second; None if it does not pass there."""
    stack = first.stack()
    if second.parent not in stack:
        return None
    back = stack[stack.index(second.parent) + 1 :][::-1]
    return Limb(first.parent, [*first.steps, *(Step(part, back=True) for part in back), *second.steps])


def _pieces(limb: Limb) -> list[Limb]:
    """Cut a limb of many free joints, where no coupling and no way back crosses the cut."""
    pieces, start, parent = [], 0, limb.parent
    places = _cuts(limb.steps)
    while _free_count(limb.steps[start:]) > MAX_DOFS:
        cut = _best_cut(limb.steps, start, [place for place in places if place > start])
        if cut is None:
            break
        pieces.append(Limb(parent, limb.steps[start:cut]))
        parent, start = limb.steps[cut - 1].part, cut
    return [*pieces, Limb(parent, limb.steps[start:])]


def _cuts(steps: list[Step]) -> list[int]:
    """Where a chain may be cut, before step k: steps of one joint, or of coupled ones, stay together."""
    first: dict[str, int] = {}
    last: dict[str, int] = {}
    for k, step in enumerate(steps):
        dof = step.part.moving
        for name in (dof.name, dof.coupling.other if dof.coupling is not None else dof.name):
            first.setdefault(name, k)
            last[name] = k
    ends = np.zeros(len(steps) + 1, dtype=int)  # how many stretches begin before k less those that have ended
    for name, k in first.items():
        ends[k + 1] += 1
        ends[last[name] + 1] -= 1
    return [int(k) for k in np.flatnonzero(np.cumsum(ends)[:-1] == 0) if k > 0]


def _best_cut(steps: list[Step], start: int, places: list[int]) -> int | None:
    """The last place to cut with at most half of `MAX_DOFS` before it, or the first beyond; None if there is none."""
    best = None
    for place in places:
        count = _free_count(steps[start:place])
        if count > (MAX_DOFS + 1) // 2 and best is not None:
            break
        if count > 0:
            best = place
    return best


def _free_count(steps: list[Step]) -> int:
    return sum(_is_free(step.part.moving) for step in steps if not step.back)


def _is_free(dof: Dof) -> bool:
    return dof.value is None and dof.coupling is None


def _parents_first(root: Moved, limbs: list[Limb]) -> list[Limb]:
    """Order limbs so that what they hang from comes before them."""
    placed, ordered, waiting = {id(root)}, [], list(limbs)
    while waiting:
        ready = [limb for limb in waiting if id(limb.parent) in placed]
        assert ready, "limbs hang from each other in a circle"
        ordered += ready
        placed |= {id(part) for limb in ready for part in limb.parts()}
        waiting = [limb for limb in waiting if limb not in ready]
    return ordered
