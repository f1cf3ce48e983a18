"""Mean and covariance of tokens while the true joint values vary: cell moments.

In: the chain and, for each joint of a machine, how its value is spread in every state (uniform over a cell,
or Gaussian). Out: for every state the mean and full covariance of the machine's tokens together, in the
frame that its limbs hang from.

The idea: joints vary independently of each other, so the tokens are carried inwards joint by joint, and at
each joint the law of total covariance is applied,

    mean = E_q[R m + d],    cov = E_q[R C R^T] + Cov_q[R m + d],

with the expectation over that one joint's value q by quadrature (Gauss-Legendre over a cell, Gauss-Hermite
for a Gaussian). The cost grows with the sum of the nodes of the joints, not with their product. A coupled
joint moves with those that it follows: their nodes stay open, as an axis of the arrays, from the outermost
joint concerned to the innermost.

The error is that of the one-dimensional rules. What is integrated are trigonometric polynomials of degree
2 (products of two positions), for which the number of nodes is chosen so that the bound of `_legendre_bound`
stays below ERROR, relative to the size of the body. For couplings that are not linear the same nodes are used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import factorial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.kinematics import COUPLED, SLIDE, Chain, coupled_value, joint_frame, joints_between

Array = NDArray[np.float64]

ERROR: Final = 1e-6  # of the quadrature, relative: 0.1 um on a hand, far below any measurement
MAX_NODES: Final = 24
BLOCK: Final = 1 << 22  # numbers in the largest array of a block of states: 32 MiB


class Spread(NamedTuple):
    """How one joint's value varies: uniform from low to high, and Gaussian with sigma about that."""

    low: Array  # (n,)
    high: Array
    sigma: float


class Moments(NamedTuple):
    """Mean (n, n_token, 3), m, and covariance (n, 3 n_token, 3 n_token), m^2."""

    mean: Array
    covariance: Array


class _Cloud(NamedTuple):
    """Tokens of one part: mean (n, *nodes, 3 n_token) and covariance (n, *nodes, 3 n_token, 3 n_token)."""

    tokens: tuple[int, ...]
    mean: Array
    covariance: Array


def cell_moments(
    chain: Chain, spreads: Mapping[int, Spread], followed: Mapping[int, Sequence[int]], tokens: Sequence[int], base: int
) -> Moments:
    """Moments of `tokens` in the frame of segment `base`.

    Parameters
    ----------
    chain
        The body.
    spreads
        Of every joint between the tokens and `base` that is not coupled; all arrays of one length n, the states.
    followed
        For each coupled joint the joints that it follows.
    tokens, base
        As in `kinematics.points_in`.
    """
    n = _n_state(spreads)
    if not tokens:
        return Moments(np.zeros((n, 0, 3)), np.zeros((n, 0, 0)))
    width = (3 * len(tokens)) ** 2 * _largest_tensor(chain, spreads, followed)
    block = max(1, BLOCK // max(width, 1))
    parts = [
        _block_moments(chain, {j: _rows(s, start, start + block) for j, s in spreads.items()}, followed, tokens, base)
        for start in range(0, n, block)
    ]
    return Moments(np.concatenate([part.mean for part in parts]), np.concatenate([part.covariance for part in parts]))


def _rows(spread: Spread, start: int, stop: int) -> Spread:
    return Spread(spread.low[start:stop], spread.high[start:stop], spread.sigma)


def _largest_tensor(chain: Chain, spreads: Mapping[int, Spread], followed: Mapping[int, Sequence[int]]) -> int:
    """Nodes that can be open at once: those of all joints that one coupled joint follows, and one more joint's."""
    counts = {joint: len(nodes_of(chain, joint, spread)[1]) for joint, spread in spreads.items()}
    open_nodes = int(np.prod([counts[j] for j in {j for driver in followed.values() for j in driver} if j in counts]))
    return open_nodes * max(counts.values(), default=1)


def _block_moments(
    chain: Chain, spreads: Mapping[int, Spread], followed: Mapping[int, Sequence[int]], tokens: Sequence[int], base: int
) -> Moments:
    joints = _joints_of(chain, tokens, base)
    drivers = sorted({driver for joint in joints for driver in followed.get(joint, ()) if driver in spreads})
    nodes = {joint: nodes_of(chain, joint, spread) for joint, spread in spreads.items()}
    values = _node_values(chain, joints, drivers, nodes)
    clouds = _own_tokens(chain, tokens, _n_state(spreads), len(drivers))
    waiting = {driver: _last_use(driver, joints, followed) for driver in drivers}
    for joint in joints:  # outermost first
        cloud = clouds.pop(joint + 1, None)
        if cloud is not None:
            cloud = _carry(chain, joint, values[joint], cloud)
            if joint not in drivers and joint in nodes:
                cloud = _average(cloud, len(drivers) + 1, nodes[joint][1])
        for axis, driver in enumerate(drivers):
            if cloud is not None and waiting[driver] == joint:
                cloud = _average(cloud, axis + 1, nodes[driver][1], keep=True)
        if cloud is not None:
            parent = int(chain.joint_parent[joint])
            clouds[parent] = _merge(clouds.get(parent), cloud)
    return _in_order(clouds[base], tokens)


def _n_state(spreads: Mapping[int, Spread]) -> int:
    return len(next(iter(spreads.values())).low) if spreads else 1


def _joints_of(chain: Chain, tokens: Sequence[int], base: int) -> list[int]:
    """All joints between the tokens and `base`, outermost first."""
    segments = {int(chain.token_segment[token]) for token in tokens}
    return sorted({j for segment in segments for j in joints_between(chain, segment, base)}, reverse=True)


def _last_use(driver: int, joints: Sequence[int], followed: Mapping[int, Sequence[int]]) -> int:
    """The innermost joint whose value depends on `driver`."""
    return min(joint for joint in joints if joint == driver or driver in followed.get(joint, ()))


def nodes_of(chain: Chain, joint: int, spread: Spread) -> tuple[Array, Array]:
    """Quadrature of one joint: values (n, node) and weights (node,), the same for every state."""
    is_slide = bool(chain.joint_type[joint] == SLIDE)
    half = (spread.high - spread.low) / 2
    value, weight = ((spread.low + spread.high) / 2)[:, None], np.ones(1)
    if half.max(initial=0) > 0:
        place, weight = _legendre(2 if is_slide else legendre_count(float(half.max())))
        value = value + half[:, None] * place
    if spread.sigma > 0:
        place, gauss = _hermite(2 if is_slide else hermite_count(spread.sigma))
        value = (value[:, :, None] + spread.sigma * place).reshape(len(half), -1)
        weight = np.multiply.outer(weight, gauss).ravel()
    return value, weight


def _legendre(count: int) -> tuple[Array, Array]:
    place, weight = np.polynomial.legendre.leggauss(count)
    return place, weight / 2


def _hermite(count: int) -> tuple[Array, Array]:
    place, weight = np.polynomial.hermite_e.hermegauss(count)
    return place, weight / weight.sum()


def legendre_count(half: float) -> int:
    """Least number of nodes with which cos 2q over (-half, half) is right to ERROR."""
    return next((n for n in range(2, MAX_NODES) if _legendre_bound(n, half) <= ERROR), MAX_NODES)


def _legendre_bound(n: int, half: float) -> float:
    """Error of the mean of cos 2q by n nodes: (2 half)^2n (n!)^4 / ((2n + 1) ((2n)!)^3) times 2^2n."""
    return float((4 * half) ** (2 * n) * (factorial(n) ** 4 / ((2 * n + 1) * factorial(2 * n) ** 3)))


def hermite_count(sigma: float) -> int:
    """Least number of nodes with which cos 2q under a Gaussian is right to ERROR: (2 sigma)^2n n! / (2n)!."""
    bounds = ((2 * sigma) ** (2 * n) * factorial(n) / factorial(2 * n) for n in range(2, MAX_NODES))
    return next((n for n, bound in enumerate(bounds, start=2) if bound <= ERROR), MAX_NODES)


def _node_values(
    chain: Chain, joints: Sequence[int], drivers: Sequence[int], nodes: Mapping[int, tuple[Array, Array]]
) -> dict[int, Array]:
    """Values of the joints on axes (state, one per driver, own nodes)."""
    values: dict[int, Array] = {}
    for joint, (value, _) in nodes.items():
        axis = drivers.index(joint) if joint in drivers else len(drivers)
        shape = [1] * (len(drivers) + 1)
        shape[axis] = value.shape[1]
        values[joint] = value.reshape(len(value), *shape)
    for joint in sorted(joints):
        if chain.joint_source[joint] == COUPLED:
            values[joint] = coupled_value(chain, joint, values)
        elif joint not in values:
            values[joint] = np.full([1] * (len(drivers) + 2), chain.joint_value[joint])
    return values


def _own_tokens(chain: Chain, tokens: Sequence[int], n: int, n_driver: int) -> dict[int, _Cloud]:
    """The tokens fixed on each part, which there do not vary."""
    shape = (n, *[1] * n_driver)
    clouds = {}
    for segment in sorted({int(chain.token_segment[token]) for token in tokens}):
        own = tuple(token for token in tokens if chain.token_segment[token] == segment)
        at = chain.token_at[list(own)].ravel()
        size = len(at)
        clouds[segment] = _Cloud(own, np.broadcast_to(at, (*shape, size)), np.zeros((*shape, size, size)))
    return clouds


def _carry(chain: Chain, joint: int, value: Array, cloud: _Cloud) -> _Cloud:
    """The cloud in the parent's frame, with an axis of the joint's own nodes added last."""
    rotation, shift = joint_frame(chain, joint, value)
    mean, covariance = cloud.mean[..., None, :], cloud.covariance[..., None, :, :]
    n_token = len(cloud.tokens)
    points = mean.reshape(*mean.shape[:-1], n_token, 3) @ np.swapaxes(rotation, -1, -2) + shift[..., None, :]
    if covariance.any():
        covariance = _turned(rotation, covariance, n_token)
    moved = points.reshape(*points.shape[:-2], 3 * n_token)
    return _squeezed(cloud.tokens, moved, np.broadcast_to(covariance, (*moved.shape, 3 * n_token)), joint, chain)


def _squeezed(tokens: tuple[int, ...], mean: Array, covariance: Array, joint: int, chain: Chain) -> _Cloud:
    """A joint without nodes of its own (fixed, coupled or a driver) leaves no axis of its own."""
    if mean.shape[-2] == 1:
        return _Cloud(tokens, mean[..., 0, :], covariance[..., 0, :, :])
    return _Cloud(tokens, mean, covariance)


def _turned(rotation: Array, covariance: Array, n_token: int) -> Array:
    """R C R^T for every pair of tokens."""
    shape = (*covariance.shape[:-2], n_token, 3, n_token, 3)
    blocks = np.swapaxes(covariance.reshape(shape), -2, -3)  # (..., token, token, 3, 3)
    turned = rotation[..., None, None, :, :] @ blocks @ np.swapaxes(rotation, -1, -2)[..., None, None, :, :]
    turned = np.swapaxes(turned, -2, -3)
    return np.asarray(turned.reshape(*turned.shape[:-4], 3 * n_token, 3 * n_token))


def _average(cloud: _Cloud, axis: int, weight: Array, keep: bool = False) -> _Cloud:
    """Law of total covariance over one axis of nodes."""
    if cloud.mean.shape[axis] != len(weight):
        return cloud
    mean = np.moveaxis(cloud.mean, axis, -1) @ weight
    apart = np.moveaxis(cloud.mean - np.expand_dims(mean, axis), axis, -1)  # (..., 3 token, node)
    within = np.moveaxis(cloud.covariance, axis, -1) @ weight
    covariance = within + (apart * weight) @ np.swapaxes(apart, -1, -2)
    if keep:
        return _Cloud(cloud.tokens, np.expand_dims(mean, axis), np.expand_dims(covariance, axis))
    return _Cloud(cloud.tokens, mean, covariance)


def _merge(one: _Cloud | None, other: _Cloud) -> _Cloud:
    """Two clouds on one part: given the open nodes they do not depend on each other."""
    if one is None:
        return other
    shape = np.broadcast_shapes(one.mean.shape[:-1], other.mean.shape[:-1])
    n, m = one.mean.shape[-1], other.mean.shape[-1]
    covariance = np.zeros((*shape, n + m, n + m))
    covariance[..., :n, :n], covariance[..., n:, n:] = one.covariance, other.covariance
    means = [np.broadcast_to(cloud.mean, (*shape, cloud.mean.shape[-1])) for cloud in (one, other)]
    return _Cloud(one.tokens + other.tokens, np.concatenate(means, axis=-1), covariance)


def _in_order(cloud: _Cloud, tokens: Sequence[int]) -> Moments:
    """Drop the axes of nodes, all closed by now, and put the tokens in the order asked for."""
    n, size = len(cloud.mean), 3 * len(tokens)
    mean, covariance = cloud.mean.reshape(n, size), cloud.covariance.reshape(n, size, size)
    order = np.concatenate([np.arange(3) + 3 * cloud.tokens.index(token) for token in tokens])
    ordered = covariance[:, order][:, :, order]
    return Moments(mean[:, order].reshape(n, -1, 3), (ordered + np.swapaxes(ordered, 1, 2)) / 2)
