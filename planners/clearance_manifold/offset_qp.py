"""The banded quadratic program over lateral offsets (section 4.2), solved by OSQP.

Set up once; every solve gets its linear term, its box and both parts of its warm start, and rho is fixed: nothing of the
solver's past enters an answer.
"""

from __future__ import annotations

import numpy as np
import osqp
from scipy import sparse

from estimators.belief import F64

FAR_M = 1e3  # in place of no bound


def difference(at_m: F64, order: int) -> F64:
    """Return the matrix of the first or second difference quotient at unevenly spaced arc lengths, shape (n - order, n)."""
    n = len(at_m)
    first = np.zeros((n - 1, n))
    gap = np.diff(at_m)
    rows = np.arange(n - 1)
    first[rows, rows], first[rows, rows + 1] = -1.0 / gap, 1.0 / gap
    if order == 1:
        return first
    middle = 0.5 * (gap[1:] + gap[:-1])
    return np.asarray(np.diff(first, axis=0) / middle[:, None])


class OffsetProgram:
    """Minimise sum of anchors_k (y - ref_k)^2 + w_smooth (slope^2 + l^2 curvature^2), each per metre, over low <= y <= high."""

    def __init__(self, at_m: F64, anchors: tuple[float, ...], smooth: float, curvature_length_m: float) -> None:
        """Set the solver up.

        Args:
            at_m: arc lengths of the stations, shape (n,), increasing.
            anchors: weights of the references that `solve` is given.
            smooth: weight of slope and curvature.
            curvature_length_m: l.
        """
        gap = np.diff(at_m)
        self._share = np.gradient(at_m)  # metres that a station stands for
        self._anchors = anchors
        slope, bend = difference(at_m, 1), difference(at_m, 2)
        quadratic = np.diag(sum(anchors) * self._share)
        quadratic += smooth * slope.T @ (gap[:, None] * slope)
        quadratic += smooth * curvature_length_m**2 * bend.T @ (self._share[1:-1, None] * bend)
        self.quadratic = 2.0 * quadratic  # (n, n), the Hessian
        n = len(at_m)
        self._solver = osqp.OSQP()
        self._solver.setup(
            sparse.csc_matrix(np.triu(self.quadratic)), np.zeros(n), sparse.identity(n, format="csc"),
            np.full(n, -FAR_M), np.full(n, FAR_M),
            verbose=False, adaptive_rho=False, rho=40.0, rho_is_vec=False, scaling=0, polishing=False,
            eps_abs=1e-5, eps_rel=1e-5, max_iter=400, check_termination=10, warm_starting=True,
        )  # fmt: skip

    def linear(self, references: tuple[F64, ...]) -> F64:
        """Return the linear term for references, one of shape (n,) for each anchor."""
        return np.asarray(
            -2.0 * self._share * np.sum([w * ref for w, ref in zip(self._anchors, references, strict=True)], axis=0)
        )

    def solve(self, references: tuple[F64, ...], low: F64, high: F64, start: F64, duals: F64) -> tuple[F64, F64, bool]:
        """Return offsets, shape (n,), inside the box, the multipliers, shape (n,), and whether the solver converged."""
        self._solver.update(q=self.linear(references), l=low, u=high)
        self._solver.warm_start(x=start, y=duals)
        result = self._solver.solve(raise_error=False)
        if not np.isfinite(result.x).all():
            return np.clip(start, low, high), np.zeros_like(duals), False
        return np.clip(result.x, low, high), result.y.copy(), result.info.status_val == 1
