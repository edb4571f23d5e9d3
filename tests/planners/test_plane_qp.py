import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from planners.shields.plane_qp import cut, solve


def random_problem(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(0, 9))
    angle = rng.uniform(-np.pi, np.pi, count)
    normals = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    bounds = rng.uniform(-0.8, 0.3, count)
    low = rng.uniform(-1.0, 0.0, 2)
    return normals, bounds, rng.uniform(-1.0, 1.0, 2), low, low + rng.uniform(0.0, 1.0, 2)


def least_slack(normals, bounds, low, high):
    """The smallest common relaxation, as a linear program over (u, slack)."""
    if len(bounds) == 0:
        return 0.0
    rows = np.hstack((-normals, -np.ones((len(bounds), 1))))
    limits = [(low[0], high[0]), (low[1], high[1]), (0.0, None)]
    return linprog([0.0, 0.0, 1.0], A_ub=rows, b_ub=-bounds, bounds=limits).fun


@pytest.mark.parametrize("seed", range(120))
def test_optimum_equals_that_of_a_general_solver(seed):
    normals, bounds, asked, low, high = random_problem(seed)
    u, slack = solve(normals, bounds, asked, low, high)
    assert slack == pytest.approx(least_slack(normals, bounds, low, high), abs=2e-6)
    assert np.all(u >= low)
    assert np.all(u <= high)
    assert np.all(normals @ u >= bounds - slack - 1e-9)
    if slack == 0.0:
        keep = {"type": "ineq", "fun": lambda v: normals @ v - bounds}
        start = np.clip(u, low, high)
        best = minimize(
            lambda v: np.sum((v - asked) ** 2),
            start,
            bounds=list(zip(low, high, strict=True)),
            constraints=[keep] if len(bounds) else [],
            method="SLSQP",
            options={"ftol": 1e-14},
        )
        assert np.sum((u - asked) ** 2) <= best.fun + 1e-7


@pytest.mark.parametrize("seed", range(40))
def test_optimum_beats_every_feasible_point_of_a_fine_lattice(seed):
    normals, bounds, asked, low, high = random_problem(1000 + seed)
    u, slack = solve(normals, bounds, asked, low, high)
    lattice = np.stack(np.meshgrid(*np.linspace(low, high, 101).T), axis=-1).reshape(-1, 2)
    worst = np.max(bounds - lattice @ normals.T, axis=1) if len(bounds) else np.full(len(lattice), -1.0)
    if slack > 0.0:
        assert np.all(worst >= slack - 2e-6)
    else:
        feasible = lattice[worst <= 0.0]
        assert np.all(np.sum((feasible - asked) ** 2, axis=1) >= np.sum((u - asked) ** 2) - 1e-12)


def test_what_is_feasible_comes_back_untouched():
    asked = np.array([0.3, -0.1])
    u, slack = solve(np.array([[1.0, 0.0]]), np.array([0.2]), asked, np.full(2, -0.5), np.full(2, 0.5))
    assert u.tolist() == asked.tolist()
    assert slack == 0.0


def test_box_without_width_moves_along_the_other_axis_only():
    low, high = np.array([-0.5, 0.0]), np.array([0.5, 0.0])
    u, slack = solve(np.array([[-0.6, 0.8]]), np.array([0.12]), np.array([0.4, 0.3]), low, high)
    assert u == pytest.approx([-0.2, 0.0])
    assert slack == 0.0


def test_two_planes_that_exclude_each_other_share_the_violation():
    normals = np.array([[1.0, 0.0], [-1.0, 0.0]])
    u, slack = solve(normals, np.array([0.3, 0.1]), np.zeros(2), np.full(2, -1.0), np.ones(2))
    assert u == pytest.approx([0.1, 0.0], abs=2e-6)
    assert slack == pytest.approx(0.2, abs=2e-6)


def test_a_half_plane_cuts_the_corner_off_a_square():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    rest = cut(square, -np.array([1.0, 1.0]), -1.0)
    x, y = rest.T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert area == pytest.approx(0.5)
