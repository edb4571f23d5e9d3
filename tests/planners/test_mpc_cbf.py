import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from planners.mpc_cbf.kernels import barriers, fall, linearised, rollout
from planners.mpc_cbf.planner import BarrierMpc
from planners.mpc_cbf.program import FAR, BarrierProgram, Costs, Subproblem
from planners.mpc_cbf.reference import ahead_of, reference
from tests.planners.synthetic import OMNI, Box, Disc, belief_of
from tests.planners.tracked import JACKAL, WALLS, Tracking, planner_of, route_from, run, straight_router

STEP_S, MARGIN_M = 0.1, 0.07
START = np.array([0.3, -0.2, 0.7])


def drawn_inputs(steps, seed=2):
    return np.random.default_rng(seed).uniform([0.1, -1.0], [0.8, 1.0], (steps, 2))


def test_a_step_is_the_exact_arc_to_the_third_order():
    states = rollout(START, np.array([[0.6, 0.9]]), STEP_S)
    exact = SE2(*START).integrate(0.6, 0.0, 0.9, STEP_S)
    assert states[1] == pytest.approx([exact.x, exact.y, exact.yaw], abs=0.6 * STEP_S * (0.9 * STEP_S) ** 2 / 20.0)


def test_linearisation_agrees_with_finite_differences():
    inputs, nudge = drawn_inputs(4), 1e-6
    states = rollout(START, inputs, STEP_S)
    for k, slopes in enumerate(linearised(states, inputs, STEP_S)):

        def after(state, driven):
            return rollout(state, driven[None], STEP_S)[1]

        by_state = [(after(states[k] + nudge * e, inputs[k]) - states[k + 1]) / nudge for e in np.eye(3)]
        by_input = [(after(states[k], inputs[k] + nudge * e) - states[k + 1]) / nudge for e in np.eye(2)]
        assert np.array(by_state) == pytest.approx(np.eye(3) + np.outer([0, 0, 1], [slopes[0], slopes[1], 0.0]), abs=1e-6)
        assert by_input[0] == pytest.approx([slopes[2], slopes[4], 0.0], abs=1e-6)
        assert by_input[1] == pytest.approx([slopes[3], slopes[5], slopes[6]], abs=1e-6)


def test_barriers_are_distances_to_discs_that_move_on_and_their_gradients_unit():
    centre, velocity = np.array([[2.0, 0.0], [0.3, -0.2]]), np.array([[-0.5, 0.2], [0.0, 0.0]])
    value, gradient = barriers(rollout(START, drawn_inputs(5), STEP_S), centre, velocity, np.array([0.4, 0.2]), STEP_S)
    states = rollout(START, drawn_inputs(5), STEP_S)
    for k in range(6):
        apart = np.hypot(*(states[k, :2] - centre - k * STEP_S * velocity).T)
        assert value[k] == pytest.approx(apart - [0.4, 0.2])
    assert np.hypot(gradient[..., 0], gradient[..., 1]) == pytest.approx(np.ones((6, 2)))
    assert gradient[0, 1] == pytest.approx([-math.cos(0.7), -math.sin(0.7)])  # at the centre: back


def test_linearised_barrier_is_never_above_the_true_one():
    rng, centre = np.random.default_rng(4), np.array([[1.0, 0.5]])
    states = np.concatenate((rng.uniform(-1, 1, (50, 2)), np.zeros((50, 1))), axis=1)
    moved = states + np.concatenate((rng.uniform(-1, 1, (50, 2)), np.zeros((50, 1))), axis=1)
    for state, other in zip(states, moved, strict=True):
        value, gradient = barriers(state[None], centre, np.zeros((1, 2)), np.ones(1), STEP_S)
        true, _ = barriers(other[None], centre, np.zeros((1, 2)), np.ones(1), STEP_S)
        assert value[0, 0] + gradient[0, 0] @ (other - state)[:2] <= true[0, 0] + 1e-12


def subproblem(steps, change=10.0, missing=None, gradient=None):
    inputs = drawn_inputs(steps)
    states = rollout(START, inputs, STEP_S)
    missing = np.full((steps, 1), -FAR) if missing is None else missing
    gradient = np.zeros((steps + 1, 1, 2)) if gradient is None else gradient
    return Subproblem(
        linearised(states, inputs, STEP_S), states[1:] - [1.0, 0.2, 0.5], inputs - [0.4, 0.0], inputs, np.array([0.2, 0.1]),
        np.full(2, -10.0), np.full(2, 10.0), np.full(2, change), gradient, missing,
    )  # fmt: skip


def cost_of(inputs_deviation, problem, costs):
    """The quadratic cost of inputs, the states following the linearised steps; each written out, no matrices."""
    state, total, before = np.zeros(3), 0.0, problem.before
    for k, slope in enumerate(problem.slopes):
        dv, dw = inputs_deviation[k]
        x = state[0] + slope[0] * state[2] + slope[2] * dv + slope[3] * dw
        y = state[1] + slope[1] * state[2] + slope[4] * dv + slope[5] * dw
        state = np.array([x, y, state[2] + slope[6] * dw])
        now = problem.inputs[k] + inputs_deviation[k]
        total += costs.state[k] @ (problem.state_error[k] + state) ** 2
        total += costs.inputs @ (problem.input_error[k] + inputs_deviation[k]) ** 2
        total += costs.change @ (now - before) ** 2
        before = now
    return total


def test_program_without_active_limits_is_the_least_squares_optimum():
    steps, costs = 5, Costs(np.full((5, 3), 2.0), np.array([0.2, 0.1]), np.array([0.5, 0.5]), 100.0)
    program, problem = BarrierProgram(steps, 1, 0.2, costs, 4000), subproblem(5)
    found = program.solve(problem, program.start()).of_inputs(steps)
    # A quadratic of 2 n variables is known by its values: its gradient at the optimum is zero.
    nudge, least = 1e-3, cost_of(found, problem, costs)
    for i in range(2 * steps):
        e = np.eye(2 * steps)[i].reshape(steps, 2) * nudge
        slope = (cost_of(found + e, problem, costs) - cost_of(found - e, problem, costs)) / (2.0 * nudge)
        curvature = (cost_of(found + e, problem, costs) - 2.0 * least + cost_of(found - e, problem, costs)) / nudge**2
        assert abs(slope / curvature) < 0.01


def test_program_keeps_caps_changes_and_barriers():
    steps, costs = 5, Costs(np.full((5, 3), 20.0), np.array([0.2, 0.1]), np.array([0.5, 0.5]), 1000.0)
    gradient = np.tile(np.array([-1.0, 0.0]), (steps + 1, 1, 1))  # a wall ahead along x
    missing = np.full((steps, 1), -0.01)
    program, problem = BarrierProgram(steps, 1, 0.0, costs, 4000), subproblem(steps, 0.9, missing, gradient)
    problem = replace(problem, highest=np.array([0.6, 0.8]), before=np.array([0.3, 0.1]))
    solution = program.solve(problem, program.start())
    driven = problem.inputs + solution.of_inputs(steps)
    assert solution.solved
    assert (driven <= problem.highest + 0.01).all()
    assert np.abs(np.diff(driven, axis=0, prepend=problem.before[None])).max() <= 0.9 + 0.01
    x = np.concatenate(([0.0], solution.primal[: 3 * steps].reshape(steps, 3)[:, 0]))
    assert np.diff(x).max() <= 0.01 + 0.005  # gamma 0: each step may give up what it had, no more


def test_reference_cruises_and_comes_to_rest_at_the_end():
    path, times = np.array([[0.0, 0.0], [2.0, 0.0]]), np.linspace(0.0, 6.0, 601)
    aim, speed = reference(path, 0.8, 0.5, times)
    until_s, brake_s = (2.0 - 0.64) / 0.8, 1.6
    assert aim[:, 0] == pytest.approx(np.concatenate(([0.0], np.cumsum(0.005 * (speed[1:] + speed[:-1])))), abs=1e-3)
    assert speed[times < until_s] == pytest.approx(0.8)
    assert speed[times > until_s + brake_s] == pytest.approx(0.0)
    assert aim[-1] == pytest.approx([2.0, 0.0, 0.0])


def test_reference_begins_at_the_nearest_point_of_the_route():
    path = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    assert ahead_of(np.array([0.7, 0.4]), path).tolist() == [[0.7, 0.0], [2.0, 0.0], [2.0, 2.0]]
    assert ahead_of(np.array([2.5, 1.5]), path).tolist() == [[2.0, 1.5], [2.0, 2.0]]
    assert ahead_of(np.array([1.0, 0.0]), path[:1]).tolist() == [[1.0, 0.0], [0.0, 0.0]]


def test_barriers_fall_no_faster_than_they_may_along_every_prediction_and_on_the_way():
    walker = Disc(5.0, 0.3, 0.3, -0.3)
    planner = planner_of(BarrierMpc, barrier_rate_per_s=2.0)
    trace = run(planner, [], [walker], (4.0, 0.0))
    assert max(plan.diagnostics.worst_fall_m for plan in trace.plans) < 0.01
    barrier = np.array(trace.clearance_m) - MARGIN_M
    keep = math.exp(-2.0 * 0.05)  # of a barrier, over one period
    assert (barrier[1:] - keep * barrier[:-1]).min() > -0.005
    decays = math.exp(-2.0 * 2.0)  # over the horizon
    for plan, now in zip(trace.plans, barrier, strict=False):
        assert plan.diagnostics.least_barrier_m >= decays * now - 0.03


def test_a_barrier_that_may_fall_slower_brakes_earlier():
    wall = [Box(2.0, -3, 2.2, 3)]
    nearest = []
    for rate in (0.7, 4.0):
        trace = run(
            planner_of(BarrierMpc, barrier_rate_per_s=rate), wall, [], (4.0, 0.0), router=straight_router(), duration_s=1.7
        )
        nearest.append(trace.clearance_m[-1])
    assert nearest[0] > nearest[1] + 0.1


def test_a_solution_that_is_none_is_not_driven():
    belief = belief_of(WALLS, twist=BodyTwist(0.8, 0.0, 0.0))
    walkers = [Disc(1.2, 0.2, 0.3, -0.8), Disc(1.0, -0.8, 0.3, 0.0, 0.5)]
    plan = Tracking(planner_of(BarrierMpc, solver_iterations=10, iterations=1), walkers).plan(
        belief, route_from(belief, 4.0, 0.0)
    )
    assert not plan.diagnostics.solved
    assert plan.base == BodyTwist()


def test_no_way_out_softens_the_barriers_and_says_so():
    around = [Disc(0.75 * math.cos(a), 0.75 * math.sin(a), 0.25, -math.cos(a), -math.sin(a)) for a in np.linspace(0, 5.2, 6)]
    belief = belief_of(around)
    plan = Tracking(planner_of(BarrierMpc), around).plan(belief, route_from(belief, 4.0, 0.0))
    assert plan.base.finite
    assert plan.diagnostics.worst_fall_m > 0.0 or not plan.diagnostics.solved


def test_a_base_that_may_not_reverse_does_not():
    trace = run(
        planner_of(BarrierMpc, replace(JACKAL, reverse=False)), [], [], (-2.0, 0.0), limits=replace(JACKAL, reverse=False)
    )
    assert trace.reached(-2.0, 0.0)
    assert min(plan.base.vx for plan in trace.plans) >= 0.0


def test_prediction_is_drawn_where_the_robot_goes():
    belief = belief_of([])
    walker = Disc(2.0, 1.0, 0.3, -0.5)
    plan = Tracking(planner_of(BarrierMpc, barrier_rate_per_s=2.0), [walker]).plan(belief, route_from(belief, 4.0, 0.0))
    drawn = {drawing.name: drawing.points_in_odom for drawing in plan.drawings}
    assert drawn["prediction"].shape == (21, 2)
    assert drawn["prediction"][0] == pytest.approx([0.0, 0.0])
    assert drawn["prediction"][-1, 0] > 0.8
    assert drawn["barriers at the horizon"][0] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("limits", [OMNI, JACKAL], ids=["omni", "jackal"])
def test_it_never_strafes(limits):
    trace = run(planner_of(BarrierMpc, limits), [Disc(1.5, 0.05, 0.3)], [], (3.0, 0.0), limits=limits)
    assert trace.reached(3.0, 0.0)
    assert {plan.base.vy for plan in trace.plans} == {0.0}


def test_a_robot_without_a_base_is_refused():
    with pytest.raises(ConfigurationError, match=r"planner.name 'mpc_cbf'"):
        planner_of(BarrierMpc, None)


def test_fall_is_what_the_condition_lacks():
    assert fall(np.array([[1.0], [0.7], [0.7]]), 0.2) == pytest.approx(np.array([[0.1], [-0.14]]))
