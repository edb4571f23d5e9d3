"""The quadratic program of one real-time iteration, solved by OSQP.

The variables are deviations from a trajectory that the base can drive: of the states after each step, of the inputs, and one
slack a step that all barriers share.  Set up once; every solve gets all numbers that differ and both parts of its warm
start, and rho is fixed: nothing of the solver's past enters an answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse

from estimators.belief import F64

Indices = NDArray[np.intp]

FAR = 1e4  # in place of no bound
_NEAR = 0.05  # m, rad, m/s, rad/s: a solution that misses its constraints by no more is one


@dataclass(frozen=True, slots=True)
class Costs:
    """Weights of squares, of the states (x, y, yaw) and inputs (speed, rate); of changes of the inputs; of a metre of slack."""

    state: F64  # (n, 3), after each step
    inputs: F64  # (2,)
    change: F64  # (2,)
    slack: float


@dataclass(frozen=True, slots=True)
class Subproblem:
    """All numbers of one program; n steps, m barriers."""

    slopes: F64  # (n, 7), of `kernels.linearised`
    state_error: F64  # (n, 3), of the trajectory, after each step, to its reference
    input_error: F64  # (n, 2)
    inputs: F64  # (n, 2), of the trajectory
    before: F64  # (2,), the inputs driven now
    lowest: F64  # (2,), inputs
    highest: F64  # (2,)
    change: F64  # (2,), of the inputs from step to step, at most
    gradient: F64  # (n + 1, m, 2), of the barriers
    missing: F64  # (n, m), of `kernels.fall`; -FAR where there is no barrier


@dataclass(frozen=True, slots=True)
class Solution:
    """What OSQP returned; the start of the next solve."""

    primal: F64  # (6 n,)
    dual: F64  # (rows,)
    solved: bool  # it converged, or came near in the iterations it was given
    iterations: int

    def of_inputs(self, steps: int) -> F64:
        """Return the inputs' deviations, shape (n, 2)."""
        return self.primal[3 * steps : 5 * steps].reshape(steps, 2)


class BarrierProgram:
    """Minimise the weighted squares over the linearised steps, the limits and the barriers, softened by the slack."""

    def __init__(self, steps: int, barriers: int, gamma: float, costs: Costs, solver_iterations: int) -> None:
        """Set the solver up for `steps` steps and up to `barriers` barriers."""
        self._n, self._m, self._keep, self._costs = steps, barriers, 1.0 - gamma, costs
        self._solver = osqp.OSQP()
        rows, columns = self._pattern()
        self.rows, count = int(rows.max()) + 1, 6 * steps
        order = sparse.csc_matrix((np.arange(1.0, len(rows) + 1.0), (rows, columns)), shape=(self.rows, count))
        self._order = order.data.astype(np.intp) - 1  # from the order of `_pattern` to the solver's
        self._change = _differences(steps)
        self._quadratic = self._hessian()
        order.data[:] = 1.0
        self._solver.setup(
            sparse.csc_matrix(sparse.triu(self._quadratic)), np.zeros(count), order,
            np.full(self.rows, -FAR), np.full(self.rows, FAR),
            verbose=False, adaptive_rho=False, rho=20.0, alpha=1.7, scaling=0, polishing=False,
            eps_abs=1e-3, eps_rel=1e-3, max_iter=solver_iterations, check_termination=10, warm_starting=True,
        )  # fmt: skip

    def _pattern(self) -> tuple[Indices, Indices]:
        """Return row and column of every entry, shapes (e,), in the order in which `_entries` gives their values."""
        n, x, u, s = self._n, 0, 3 * self._n, 5 * self._n
        at = [(3 * k + i, x + 3 * k + i) for k in range(n) for i in range(3)]  # the state after step k
        at += [(3 * k + i, x + 3 * (k - 1) + i) for k in range(1, n) for i in range(3)]  # before it
        at += [(3 * k + i, x + 3 * (k - 1) + 2) for k in range(1, n) for i in range(2)]  # by the yaw before it
        at += [(3 * k + i, u + 2 * k + j) for k in range(n) for i, j in ((0, 0), (0, 1), (1, 0), (1, 1), (2, 1))]
        at += [(3 * n + i, u + i) for i in range(3 * n)]  # inputs and slacks by themselves
        at += [(6 * n + i, u + i) for i in range(2 * n)]  # changes of the inputs
        at += [(6 * n + i, u + i - 2) for i in range(2, 2 * n)]
        barrier = [(8 * n + k * self._m + i, k) for k, i in product(range(n), range(self._m))]
        at += [(row, x + 3 * k + j) for row, k in barrier for j in range(2)]
        at += [(row, x + 3 * (k - 1) + j) for row, k in barrier if k > 0 for j in range(2)]
        at += [(row, s + k) for row, k in barrier]
        rows, columns = np.array(at, np.intp).T
        return rows, columns

    def _entries(self, problem: Subproblem) -> F64:
        """Return the values of the constraint matrix, shape (e,)."""
        n, m, slopes = self._n, self._m, problem.slopes
        gradient = problem.gradient
        return np.concatenate((
            np.ones(3 * n), np.full(3 * (n - 1), -1.0), -slopes[1:, :2].ravel(), -slopes[:, 2:].ravel(),
            np.ones(3 * n), np.ones(2 * n), np.full(2 * n - 2, -1.0),
            gradient[1:].ravel(), -self._keep * gradient[1:-1].ravel(), np.ones(n * m),
        ))  # fmt: skip

    def _hessian(self) -> sparse.csc_matrix:
        """Return the quadratic term, shape (6 n, 6 n); slacks cost a tenth as much per square metre as per metre."""
        n, costs = self._n, self._costs
        change = self._change.T @ sparse.diags(np.tile(costs.change, n)) @ self._change
        inputs = sparse.diags(np.tile(costs.inputs, n)) + change
        slack = sparse.identity(n) * (0.1 * costs.slack)
        return sparse.csc_matrix(2.0 * sparse.block_diag((sparse.diags(costs.state.ravel()), inputs, slack)))

    def _linear(self, problem: Subproblem) -> F64:
        """Return the linear term, shape (6 n,)."""
        n, costs = self._n, self._costs
        before = np.concatenate((problem.before, np.zeros(2 * n - 2)))
        jumps = self._change @ problem.inputs.ravel() - before
        change = self._change.T @ (np.tile(costs.change, n) * jumps)
        states, inputs = costs.state * problem.state_error, costs.inputs * problem.input_error
        return np.concatenate((2.0 * states.ravel(), 2.0 * (inputs.ravel() + change), np.full(n, costs.slack)))

    def _bounds(self, problem: Subproblem) -> tuple[F64, F64]:
        """Return the lowest and highest value of every row, shapes (rows,)."""
        n = self._n
        jumps = np.diff(np.concatenate((problem.before[None], problem.inputs)), axis=0)
        equal, slack, free = np.zeros(3 * n), np.zeros(n), np.full(n, FAR)
        low = (equal, (problem.lowest - problem.inputs).ravel(), slack, (-problem.change - jumps).ravel())
        high = (equal, (problem.highest - problem.inputs).ravel(), free, (problem.change - jumps).ravel())
        return np.concatenate((*low, problem.missing.ravel())), np.concatenate((*high, np.full(n * self._m, FAR)))

    def start(self) -> Solution:
        """Return what to start from when there was no solution before."""
        return Solution(np.zeros(6 * self._n), np.zeros(self.rows), False, 0)

    def solve(self, problem: Subproblem, start: Solution) -> Solution:
        """Return the optimum, or where the solver was after its iterations; the start itself when that is not finite."""
        low, high = self._bounds(problem)
        self._solver.update(q=self._linear(problem), l=low, u=high, Ax=self._entries(problem)[self._order])
        self._solver.warm_start(x=start.primal, y=start.dual)
        result = self._solver.solve(raise_error=False)
        if not (np.isfinite(result.x).all() and np.isfinite(result.y).all()):
            return Solution(np.zeros_like(start.primal), np.zeros_like(start.dual), False, int(result.info.iter))
        solved = float(result.info.prim_res) < _NEAR
        return Solution(result.x.copy(), result.y.copy(), solved, int(result.info.iter))


def _differences(steps: int) -> sparse.csr_matrix:
    """Return the matrix of changes of the inputs from step to step, the first against nothing, shape (2 n, 2 n)."""
    return sparse.csr_matrix(sparse.identity(2 * steps) - sparse.eye(2 * steps, k=-2))
