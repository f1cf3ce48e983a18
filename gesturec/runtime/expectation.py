"""Where limbs' tokens are expected before a frame is looked at: what stands in for the root where it is hidden.

In: what the decoders believe after the frame before. Out: `Limbs`, the seen tokens of the limbs that hang from the
root, each limb's with the mean and covariance that its belief, carried to this frame, gives them in the intrinsic
frame (cells' moments and the spread between cells). They serve the pose filter as root tokens whose place is uncertain.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.arrays import Array, Ids, seen_rows
from gesturec.runtime.body import Body
from gesturec.runtime.emission import Points

NEGLIGIBLE: Final = 1e-6  # of the likeliest cell's weight: cells below do not count


class Believed(NamedTuple):
    """Cells with their weights (n,), and their tokens' means (n, 3 k) m and covariances (n, 3 k, 3 k)."""

    weight: NDArray[Any]
    mean: Array
    covariance: Array


class Expecting(Protocol):
    """What a decoder tells of a frame that it has not seen."""

    def expect(self, carried: Any, dt: float) -> Believed: ...


class Limbs(NamedTuple):
    """K seen tokens of limbs."""

    machine: Ids  # (K,)
    tokens: Array  # (K, 3) m, expected, in the intrinsic frame at the model's size
    spread: Array  # (3 K, 3 K) m^2, of what is expected, in the intrinsic frame
    measured: Array  # (K, 3) m, world
    noise: Array  # (K, 3, 3) m^2, of the measurement, world


def expect_limbs(
    body: Body, decoders: Sequence[Expecting], carried: Sequence[Any], points: Points, shape: float, dt: float
) -> Limbs | None:
    """Seen tokens of limbs and where they are expected `dt` s after what is carried; None where none is seen."""
    parts: list[tuple[int, Ids, Array, Array]] = []
    for machine, decoder in enumerate(decoders):
        tokens = np.asarray(body.machines[machine].tokens, dtype=np.int64)
        seen = seen_rows(points.measured[tokens])
        if body.routes[machine] is None and seen.any():
            rows = np.repeat(seen, 3)
            mean, covariance = _moments(decoder.expect(carried[machine], dt), rows)
            covariance = covariance + np.diag(np.repeat(body.shape_of(machine, shape)[seen], 3))
            parts.append((machine, tokens[seen], mean.reshape(-1, 3), covariance))
    if not parts:
        return None
    chosen = np.concatenate([part[1] for part in parts])
    return Limbs(
        np.repeat([part[0] for part in parts], [len(part[1]) for part in parts]),
        np.concatenate([part[2] for part in parts]),
        _blocks([part[3] for part in parts]),
        points.measured[chosen],
        points.covariance[chosen],
    )


def _moments(believed: Believed, rows: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Mean and covariance of some coordinates over all cells."""
    kept = np.flatnonzero(believed.weight > NEGLIGIBLE * believed.weight.max())
    weight = believed.weight[kept].astype(float)
    weight /= weight.sum()
    each = believed.mean[kept][:, rows]
    mean = weight @ each
    apart = each - mean
    within = np.einsum("c,cij->ij", weight, believed.covariance[kept][:, rows][:, :, rows])
    return mean, within + (weight[:, None] * apart).T @ apart


def _blocks(blocks: Sequence[Array]) -> Array:
    """Square matrices along a diagonal."""
    matrix = np.zeros((sum(map(len, blocks)),) * 2)
    start = 0
    for block in blocks:
        end = start + len(block)
        matrix[start:end, start:end] = block
        start = end
    return matrix
