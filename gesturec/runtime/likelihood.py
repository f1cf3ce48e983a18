"""What the seen tokens say of each cell of a lattice: Gaussian with every covariance there is, and a floor.

Each token is good or, with probability `OUTLIER`, anywhere in the limb's workspace. All good and all bad
are always weighed; where some token is in doubt, each is left out in turn besides. A bound on
the distance from each token's largest eigenvalues saves the exact one for cells that cannot matter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.emission import Evidence
from gesturec.runtime.lattice import Lattice, Part

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
OUTLIER: Final = 0.01  # share of measurements that have nothing to do with their token
LOOKED_AT_FIRST: Final = 8  # cells whose exact distances tell how far others may be and still matter
LOG_2PI: Final = float(np.log(2 * np.pi))
NEGLIGIBLE: Final = 50.0  # chi-square beyond the best at which a cell's weight (1e-11) is not computed


class Fit(NamedTuple):
    """Likelihood of every cell, (n_cell,), the largest 1; and the least chi-square of one."""

    likelihood: NDArray[np.float32]
    least: float


def cell_likelihood(lattice: Lattice, evidence: Evidence, limit: float, generous: Callable[[], float]) -> Fit:
    """What the seen tokens say of every cell.

    Some token is in doubt where the best cell's chi-square is beyond `limit` even with an allowance for another
    person's limb; `generous` finds that, and is asked only where it can matter, as it is never larger.
    """
    count = len(evidence.position)
    floor = np.log(OUTLIER) - 3 * np.log(2 * lattice.reach)
    whole, least = _log_gaussian(lattice, evidence, np.ones(count, dtype=bool))
    terms = [whole + count * np.log1p(-OUTLIER), np.full(len(whole), count * floor)]
    least = least if least <= limit else generous()
    if count > 1 and least > limit:
        for kept in _leaving_one_out(count):
            part, _ = _log_gaussian(lattice, evidence, kept)
            terms.append(part + (count - 1) * np.log1p(-OUTLIER) + floor)
    top = max(float(term.max()) for term in terms)
    total = np.exp(np.array(terms) - top).sum(0)
    return Fit(np.asarray(total / total.max(), dtype=np.float32), least)


def _leaving_one_out(count: int) -> Iterator[Mask]:
    for token in range(count):
        kept = np.ones(count, dtype=bool)
        kept[token] = False
        yield kept


def _log_gaussian(lattice: Lattice, evidence: Evidence, kept: Mask) -> tuple[Array, float]:
    """Log density of the kept tokens in every cell, -inf where it cannot matter; and the least chi-square."""
    part = lattice.part(np.flatnonzero(evidence.seen)[kept])
    own = np.flatnonzero(kept)
    rows = (3 * own[:, None] + np.arange(3)).ravel()
    position, noise = evidence.position[own].ravel(), evidence.covariance[np.ix_(rows, rows)]
    if len(rows) == 3:
        square, log_determinant = _squares_of_three(position - part.mean, part.covariance + noise)
        return -0.5 * (square + log_determinant + 3 * LOG_2PI), float(square.min())

    def squares(cells: NDArray[np.int64]) -> tuple[Array, Array]:
        return _squares(position - part.mean[cells], part.covariance[cells] + noise)

    bound = _bound(part, position, noise)
    first = np.argpartition(bound, min(LOOKED_AT_FIRST, len(bound) - 1))[:LOOKED_AT_FIRST]
    least = float(squares(first)[0].min())
    cells = np.flatnonzero(bound <= least + NEGLIGIBLE)
    square, log_determinant = squares(cells)
    log_density = np.full(len(bound), -np.inf)
    log_density[cells] = -0.5 * (square + log_determinant + len(rows) * LOG_2PI)
    return log_density, float(square.min())


def _bound(part: Part, position: Array, noise: Array) -> Array:
    """A lower bound of the chi-square in every cell: the worst token's distance over its largest variance."""
    count = part.spread.shape[1]
    away = ((part.mean - position) ** 2).reshape(-1, count, 3).sum(2)
    blocks = noise.reshape(count, 3, count, 3)[range(count), :, range(count), :]
    return np.asarray((away / (np.linalg.eigvalsh(blocks)[:, -1] + part.spread)).max(1))


def _squares(residual: Array, covariance: Array) -> tuple[Array, Array]:
    """Squared Mahalanobis length and log determinant of residuals (n, k) with covariances (n, k, k)."""
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, residual[..., None])[..., 0]
    return (white**2).sum(1), 2 * np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(1)


def _squares_of_three(residual: Array, covariance: Array) -> tuple[Array, Array]:
    """The same of three coordinates in closed form, by the adjugate of a symmetric 3 x 3 matrix."""
    a, b, c = covariance[:, 0, 0], covariance[:, 0, 1], covariance[:, 0, 2]
    d, e, f = covariance[:, 1, 1], covariance[:, 1, 2], covariance[:, 2, 2]
    aa, bb, cc = d * f - e * e, c * e - b * f, b * e - c * d
    dd, ee, ff = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * aa + b * bb + c * cc
    x, y, z = residual.T
    square = aa * x * x + dd * y * y + ff * z * z + 2 * (bb * x * y + cc * x * z + ee * y * z)
    return square / determinant, np.log(determinant)
