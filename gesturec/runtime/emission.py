"""How well a machine's states fit the tokens that are seen.

In: measured tokens with covariance, the pose with its own. They are brought into the frame of the
machine's table at the model's size, where the pose's uncertainty couples all of them; this is `Evidence`.
Out: for every state the squared Mahalanobis distance ``(z - m)^T (V + C)^-1 (z - m)`` over the seen
tokens and the log determinant, with V the evidence's covariance and C the state's cell's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.arrays import Array, seen_rows
from gesturec.runtime.pose import PoseEstimate
from gesturec.runtime.rotations import skew

PERSONAL: Final = 0.08  # of a limb's length that this person's may differ by before tokens are a misfit


class Frame(NamedTuple):
    """A segment's frame in the intrinsic one: ``intrinsic = rotation @ x + translation``."""

    rotation: Array  # (3, 3)
    translation: Array  # (3,)


ROOT_FRAME: Final = Frame(np.eye(3), np.zeros(3))


@dataclass(frozen=True, eq=False)
class Evidence:
    """Seen tokens of one machine in the frame of its table, at the model's size.

    `covariance` is of all their coordinates together, (3 n_seen, 3 n_seen), m^2. `hidden` tells whether
    a token that the recording has was not seen; one that it does not have is not missed.
    """

    seen: NDArray[np.bool_]  # (n_token,)
    hidden: bool
    position: Array  # (n_seen, 3) m
    covariance: Array


class Points(NamedTuple):
    """A frame's tokens in the world: where they were measured, how well, and which the recording has at all."""

    measured: Array  # (n_token, 3) m; NaN unseen
    covariance: Array  # (n_token, 3, 3) m^2
    bound: NDArray[np.bool_]  # (n_token,)


def gather_evidence(
    tokens: NDArray[np.int64], points: Points, pose: PoseEstimate, frame: Frame, shape: Array
) -> Evidence | None:
    """Evidence of tokens in a frame; None where none is seen. `shape` (n_token,) is variance to allow each, m^2."""
    seen = seen_rows(points.measured[tokens])
    if not seen.any():
        return None
    arm = points.measured[tokens[seen]] - pose.translation
    turn = (pose.rotation @ frame.rotation).T / np.exp(pose.log_scale)  # world to table, with the size
    position = arm @ turn.T - frame.rotation.T @ frame.translation
    jacobian = np.concatenate(
        [turn @ skew(arm), np.broadcast_to(-turn, (len(arm), 3, 3)), -(arm @ turn.T)[:, :, None]], -1
    )
    jacobian = jacobian.reshape(-1, 7)
    total = jacobian @ pose.covariance @ jacobian.T
    _add_blocks(total, turn @ points.covariance[tokens[seen]] @ turn.T + shape[seen, None, None] * np.eye(3))
    hidden = bool((points.bound[tokens] & ~seen).any())
    return Evidence(seen, hidden, position, (total + total.T) / 2)


def _add_blocks(matrix: Array, blocks: Array) -> None:
    """Add (n, 3, 3) blocks to the diagonal of a (3 n, 3 n) matrix, in place."""
    for i, block in enumerate(blocks):
        matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += block


class Emission(NamedTuple):
    """Fit of every state: chi-square, and log determinant of its covariance, each (n_state,)."""

    chi_square: Array
    log_determinant: Array

    @property
    def cost(self) -> Array:
        """Minus twice the log likelihood, but for a constant."""
        return self.chi_square + self.log_determinant


def emit(tables: MachineTables, evidence: Evidence, extra: Array | None = None) -> Emission:
    """Fit of every state of a machine; `extra` (3 n_seen,) is variance to add on the diagonal."""
    rows = np.repeat(evidence.seen, 3)
    covariance = tables.covariance[:, rows][:, :, rows] + evidence.covariance
    if extra is not None:
        covariance = covariance + np.diag(extra)
    residual = (evidence.position - tables.mean[:, evidence.seen]).reshape(len(covariance), -1)
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, residual[..., None])[..., 0]
    diagonal = np.diagonal(factor, axis1=1, axis2=2)
    return Emission((white**2).sum(1), 2 * np.log(diagonal).sum(1))


def personal_variance(lever: Array, evidence: Evidence) -> Array:
    """Variance by which another person's limb may differ, (3 n_seen,), for tokens `lever` (n_token,) m out."""
    return np.repeat((PERSONAL * lever[evidence.seen]) ** 2, 3)


def levers(tables: MachineTables, base: Array) -> Array:
    """Greatest distance of each token from the machine's base (3,) over its states, (n_token,) m."""
    return np.asarray(np.linalg.norm(tables.mean - base, axis=-1).max(0))
