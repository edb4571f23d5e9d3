import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from estimators.belief import Track
from planners.shield import ReachableSet, ShieldSetup
from planners.shields.field_cbf import FieldCbf
from planners.shields.field_cbf_kernels import MATERIAL, Barrier, boundary_samples, constraints
from planners.shields.none import NoShield
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of, command_of, reachable_from

RADIUS_M, D_MIN_M = 0.12, 0.10
CAPS = ReachableSet(BodyTwist(-0.75, -0.5, -1.2), BodyTwist(0.75, 0.5, 1.2))


def shield_of(period_s=0.05, limits=OMNI, **settings):
    shield = FieldCbf(FieldCbf.Settings(**settings), ShieldSetup(period_s, RADIUS_M, limits))
    shield.warm_up()
    return shield


def run(shield, obstacles, asked_in_odom, period_s, duration_s, start=SE2(), limits=None):  # noqa: B008
    """Close the loop around a single integrator; return the least surface clearance and the last pose."""
    pose, twist, least = start, BodyTwist(), math.inf
    for tick in range(round(duration_s / period_s)):
        world = [o.at(tick * period_s) for o in obstacles]
        least = min(least, *(float(o.distance(pose.x, pose.y)) - RADIUS_M for o in world))
        ux, uy = asked_in_odom
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        asked = BodyTwist(c * ux + s * uy, -s * ux + c * uy, 0.0)
        reachable = CAPS if limits is None else reachable_from(twist, limits, period_s)
        twist = shield.filter(command_of(asked), belief_of(world, pose, twist, size_m=3.0), reachable).command.base
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, period_s)
    return least, pose


@pytest.mark.parametrize("period_s", [0.05, 0.2])
@pytest.mark.parametrize("yaw", [0.0, 0.9, -2.5])
@pytest.mark.parametrize("asked", [(0.0, 0.0), (0.5, 0.0), (0.4, 0.3)])
def test_safe_set_stays_invariant_before_an_advancing_wall(period_s, yaw, asked):
    wall = Box(1.0, -4.0, 1.5, 4.0, vx=-0.4)
    least, pose = run(shield_of(period_s), [wall], asked, period_s, 5.0, SE2(0.0, 0.0, yaw))
    assert least >= D_MIN_M - 0.01
    assert pose.x < -0.5


@pytest.mark.parametrize("period_s", [0.05, 0.2])
def test_without_the_rate_of_the_field_the_same_wall_comes_nearer(period_s):
    wall, still = Box(1.0, -4.0, 1.5, 4.0, vx=-0.4), Box(1.0, -4.0, 1.5, 4.0)
    shield = shield_of(period_s)
    x, blind = 0.0, []
    for tick in range(round(4.0 / period_s)):
        moved = wall.at(tick * period_s)
        unaware = Box(moved.x0, still.y0, moved.x1, still.y1)
        blind.append(moved.x0 - x - RADIUS_M)
        x += shield.filter(command_of(BodyTwist()), belief_of([unaware], SE2(x)), CAPS).command.base.vx * period_s
    aware, _ = run(shield_of(period_s), [wall], (0.0, 0.0), period_s, 4.0)
    assert min(blind) < aware


@pytest.mark.parametrize("seed", range(6))
def test_single_integrator_never_penetrates_static_obstacles(seed):
    rng = np.random.default_rng(seed)
    discs = [Disc(*rng.uniform(-1.4, 1.4, 2), rng.uniform(0.1, 0.3)) for _ in range(7)]
    discs = [d for d in discs if d.distance(0.0, 0.0) > RADIUS_M + D_MIN_M + 0.05]
    heading = rng.uniform(-np.pi, np.pi)
    least, _ = run(shield_of(), discs, (0.5 * np.cos(heading), 0.5 * np.sin(heading)), 0.05, 6.0)
    assert least >= D_MIN_M - 0.01


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL])
def test_limited_acceleration_keeps_off_the_wall(limits):
    wall = Box(1.2, -4.0, 1.5, 4.0)
    least, pose = run(shield_of(limits=limits), [wall], (0.5, 0.0), 0.05, 5.0, limits=limits)
    assert least > 0.5 * D_MIN_M
    assert pose.x > 0.7  # it is let near, not stopped far off


def test_command_is_left_alone_where_nothing_is_near():
    filtered = shield_of().filter(command_of(BodyTwist(0.5, 0.1, 0.3)), belief_of([Disc(2.5, 0.0, 0.3)]), CAPS)
    assert filtered.command.base == BodyTwist(0.5, 0.1, 0.3)
    assert not filtered.intervened
    assert filtered.diagnostics.samples == 0


def test_sliding_along_a_wall_is_not_hindered():
    papers = shield_of(braking_allowance=0.0)
    filtered = papers.filter(command_of(BodyTwist(0.5, 0.0, 0.0)), belief_of([Box(-3, 0.32, 3, 0.5)]), CAPS)
    assert not filtered.intervened
    assert filtered.diagnostics.samples > 3


def test_gate_lets_a_distant_boundary_go_and_catches_the_one_driven_at():
    belief = belief_of([Box(0.37, -3.0, 0.6, 3.0)])  # 0.37 m off: beyond the guard zone
    standing = shield_of().filter(command_of(BodyTwist(0.0, 0.3, 0.0)), belief, CAPS)
    driving = shield_of().filter(command_of(BodyTwist(0.6, 0.0, 0.0)), belief, CAPS)
    assert standing.diagnostics.active == 0
    assert standing.diagnostics.samples > 0
    assert driving.diagnostics.active > 0
    assert driving.command.base.vx < 0.3


def test_one_wall_gives_its_exact_barrier_value_normal_and_rate():
    belief = belief_of([Box(0.4, -3.0, 0.8, 3.0, vx=-0.25)], SE2(0.013, 0.007))
    field, lattice = belief.clearance, belief.clearance.lattice
    normal, distance, rate, _ = boundary_samples(
        field.clearance_m, field.rate_m_s, field.overlap, np.array([lattice.x_m, lattice.y_m]), lattice.cell_m,
        np.array([0.013, 0.007]), 0.7, 0.44, 16,
    )  # fmt: skip
    nearest = int(np.argmin(distance))
    assert distance[nearest] == pytest.approx(0.387, abs=0.01)
    assert normal[nearest] == pytest.approx([-1.0, 0.0], abs=0.2)
    assert rate[nearest] == pytest.approx(-0.25, abs=0.02)


def test_far_side_of_a_pillar_gives_no_sample():
    belief = belief_of([Disc(0.45, 0.0, 0.1, vx=-0.5)])
    field, lattice = belief.clearance, belief.clearance.lattice
    _, distance, rate, _ = boundary_samples(
        field.clearance_m, field.rate_m_s, field.overlap, np.array([lattice.x_m, lattice.y_m]), lattice.cell_m,
        np.zeros(2), 0.9, 0.44, 16,
    )  # fmt: skip
    seen = np.isfinite(distance)
    assert seen.any()
    assert np.all(distance[seen] < 0.46)
    assert np.all(rate[seen] <= 0.01)  # the receding far side is not mixed in


@pytest.mark.parametrize("x", np.arange(-0.6, 0.6, 0.15))
def test_between_two_posts_no_boundary_is_seen_where_none_is(x):
    """On the line between them their slopes cancel across, and what is left along it points at nothing."""
    posts = [Box(-0.1, 0.7, 0.1, 2.0), Box(-0.1, -2.0, 0.1, -0.7)]
    belief = belief_of(posts, SE2(float(x), 0.0, 0.0))
    field, lattice, robot = belief.clearance, belief.clearance.lattice, np.array([x, 0.0])
    normal, distance, _, _ = boundary_samples(
        field.clearance_m,
        field.rate_m_s,
        field.overlap,
        np.array([lattice.x_m, lattice.y_m]),
        lattice.cell_m,
        robot,
        1.1,
        0.9,
        16,
    )
    seen = np.isfinite(distance)
    assert seen.any()
    points = robot - distance[seen, None] * normal[seen]
    true_m = np.min([post.distance(*points.T) for post in posts], axis=0)
    assert np.max(np.abs(true_m)) < 0.12


def test_buffer_follows_equation_8_between_its_bounds():
    normal, asked = np.array([[-1.0, 0.0]]), np.zeros(2)
    barrier = Barrier(0.22, 16, 0.7, 2.0, 0.3, 0.4, 0.2, 1.0, 0.05, 0.25, MATERIAL)

    def buffer(rate):
        _, bound, _ = constraints(normal, np.array([0.25]), np.array([rate]), asked, barrier)
        return (bound[0] + rate) / 2.0 + 0.03

    assert buffer(0.5) == pytest.approx(0.05)
    assert buffer(-0.75) == pytest.approx(0.15)
    assert buffer(-2.0) == pytest.approx(0.25)


@pytest.mark.parametrize("seed", range(20))
def test_answer_lies_in_the_reachable_set_whatever_closes_in(seed):
    rng = np.random.default_rng(seed)
    discs = [Disc(*rng.uniform(-0.7, 0.7, 2), 0.1, *rng.uniform(-1, 1, 2)) for _ in range(8)]
    pose = SE2(0.0, 0.0, rng.uniform(-3, 3))
    low = rng.uniform([-0.7, -0.5, -1.2], 0.0)
    box = ReachableSet(BodyTwist(*low), BodyTwist(*(low + rng.uniform(0.0, 0.5, 3))))
    filtered = shield_of().filter(command_of(BodyTwist(0.5, 0.0, 0.4)), belief_of(discs, pose, size_m=3.0), box)
    twist = filtered.command.base
    assert box.clip(twist) == twist
    assert twist.finite


def test_squeezed_between_two_walls_it_fails_both_least_or_stops():
    walls = [Box(0.2, -3, 0.5, 3, vx=-0.4), Box(-0.5, -3, -0.2, 3, vx=0.4)]
    asked = command_of(BodyTwist(0.4, 0.0, 0.0))
    retreat = shield_of().filter(asked, belief_of(walls), CAPS)
    assert retreat.diagnostics.infeasible
    assert retreat.command.base.vx == pytest.approx(0.0, abs=0.05)
    stop = shield_of(on_infeasible="stop").filter(asked, belief_of(walls), CAPS)
    assert stop.command.base.vx == 0.0


def test_medial_axis_of_two_walls_keeps_both_normals():
    walls = [Box(-3, 0.3, 3, 0.5), Box(-3, -0.5, 3, -0.3)]
    filtered = shield_of().filter(command_of(BodyTwist(0.4, 0.2, 0.0)), belief_of(walls), CAPS)
    assert filtered.diagnostics.active >= 2
    assert filtered.command.base.vx > 0.25
    assert filtered.command.base.vy < 0.07  # alpha (0.30 - 0.22 - 0.05)


def test_base_that_cannot_strafe_brakes():
    box = ReachableSet(BodyTwist(-0.75, 0.0, -1.2), BodyTwist(0.75, 0.0, 1.2))
    filtered = shield_of(limits=DIFFERENTIAL).filter(
        command_of(BodyTwist(0.5, 0.0, 0.7)), belief_of([Box(0.3, -3, 0.6, 3)], SE2(0, 0, 0.5)), box
    )
    assert filtered.command.base.vx < 0.15
    assert filtered.command.base.vy == 0.0
    assert filtered.command.base.wz == 0.7


@pytest.mark.parametrize("asked", [BodyTwist(math.nan, 0.0, 0.0), BodyTwist(0.0, math.inf, 0.0)])
def test_twist_that_is_not_finite_becomes_a_stop(asked):
    filtered = shield_of().filter(command_of(asked), belief_of([]), CAPS)
    assert filtered.command.base == BodyTwist()
    assert filtered.intervened


@pytest.mark.parametrize("pose", [SE2(), SE2(0.0, 0.0, 2.0)])
def test_inside_an_obstacle_or_off_the_grid_it_answers(pose):
    inside = shield_of().filter(command_of(BodyTwist(0.5, 0.0, 0.0)), belief_of([Disc(0.0, 0.0, 1.0)], pose), CAPS)
    assert inside.command.base == BodyTwist()
    assert inside.diagnostics.enclosed


def test_arm_only_command_passes():
    assert shield_of().filter(command_of(None), belief_of([]), CAPS).command.base is None


def test_state_and_answers_repeat():
    belief = belief_of([Disc(0.5, 0.1, 0.2, vx=-0.3)])
    first, second = shield_of(), shield_of()
    second.restore(first.snapshot())
    asked = command_of(BodyTwist(0.5, 0.05, 0.1))
    one, other = first.filter(asked, belief, CAPS), second.filter(asked, belief, CAPS)
    assert (one.command, one.diagnostics) == (other.command, other.diagnostics)


def test_no_shield_only_clips():
    shield = NoShield(NoShield.Settings(), ShieldSetup(0.05, RADIUS_M, OMNI))
    filtered = shield.filter(command_of(BodyTwist(2.0, 0.1, 0.0)), belief_of([Disc(0.3, 0.0, 0.1)]), CAPS)
    assert filtered.command.base == BodyTwist(0.75, 0.1, 0.0)
    assert not filtered.intervened  # it is the nearest that can be reached
    assert shield.filter(command_of(None), belief_of([]), CAPS).command.base is None


@pytest.mark.parametrize(("half_width_m", "passes"), [(0.26, False), (0.32, True)])
def test_passage_narrower_than_twice_the_buffered_clearance_is_closed(half_width_m, passes):
    walls = [Box(-3, half_width_m, 3, 0.6), Box(-3, -0.6, 3, -half_width_m)]
    filtered = shield_of().filter(command_of(BodyTwist(0.4, 0.0, 0.0)), belief_of(walls), CAPS)
    assert (filtered.command.base.vx > 0.35) == passes
    assert filtered.diagnostics.infeasible != passes
    assert (half_width_m > shield_of().kept_clear_m) == passes  # as it tells the planner


def test_a_single_scalar_barrier_has_no_direction_between_two_closing_walls():
    """On the medial axis the slope cancels: it is told that the room closes, and not where to go."""
    walls = [Box(-3, 0.275, 3, 0.5, vy=-0.3), Box(-3, -0.5, 3, -0.225, vy=0.3)]
    asked = command_of(BodyTwist(0.4, 0.0, 0.0))
    told = shield_of(form="single_scalar", gate="none").filter(asked, belief_of(walls, SE2(0.0, 0.025)), CAPS)
    assert told.diagnostics.samples == 1
    assert told.diagnostics.infeasible
    assert told.command.base.vx == pytest.approx(0.4, abs=1e-6)
    assert shield_of().filter(asked, belief_of(walls, SE2(0.0, 0.025)), CAPS).command.base.vx < 0.39


@pytest.mark.parametrize("closing", [0.0, 0.3])
def test_a_single_scalar_barrier_before_one_wall_is_the_closed_form(closing):
    belief = belief_of([Box(0.4, -3, 1, 3, vx=-closing)])
    shield = shield_of(form="single_scalar", gate="none", buffer_gain=0.0, buffer_min_m=0.05)
    vx = shield.filter(command_of(BodyTwist(0.7, 0.0, 0.0)), belief, CAPS).command.base.vx
    assert vx == pytest.approx(2.0 * (0.4 - 0.22 - 0.05) - closing, abs=0.02)


def test_an_object_barrier_reads_tracks_and_knows_no_walls():
    shield = shield_of(form="objects", gate="none", buffer_gain=0.0)
    ahead = Track(1, (0.8, 0.0), (-0.2, 0.0), 0.25, np.zeros((4, 4)))
    belief = belief_of([Box(0.3, -3, 1, 3)])
    asked = command_of(BodyTwist(0.7, 0.1, 0.0))
    assert not shield.filter(asked, belief, CAPS).intervened
    twist = shield.filter(asked, replace(belief, tracks=(ahead,)), CAPS).command.base
    assert twist.vx == pytest.approx(2.0 * (0.8 - 0.25 - 0.22 - 0.05) - 0.2, abs=1e-9)
    assert twist.vy == pytest.approx(0.1)


@pytest.mark.parametrize(("gate", "held"), [("material_derivative", True), ("field_rate", False), ("none", True)])
def test_only_the_material_derivative_opens_the_gate_for_a_wall_driven_at(gate, held):
    belief = belief_of([Box(0.40, -3.0, 0.6, 3.0)])  # beyond the guard zone
    told = shield_of(gate=gate).filter(command_of(BodyTwist(0.6, 0.0, 0.0)), belief, CAPS)
    assert (told.diagnostics.active > 0) == held
    assert told.intervened == held


def test_without_a_bound_the_buffer_grows_with_what_closes_in():
    belief = belief_of([Box(0.9, -3.0, 1.2, 3.0, vx=-1.5)])
    asked = command_of(BodyTwist(0.0, 0.0, 0.0))
    bounded, unbounded = (
        shield_of(buffer_max_m=most, gate="none", sample_radius_m=1.2).filter(asked, belief, CAPS).command.base.vx
        for most in (0.1, None)
    )
    assert unbounded - bounded == pytest.approx(-2.0 * (0.3 - 0.1), abs=0.05)


def test_what_constrains_is_drawn_where_the_wall_is():
    filtered = shield_of().filter(command_of(BodyTwist(0.4, 0.0, 0.0)), belief_of([Box(0.3, -3, 0.6, 3)], SE2(0, 0, 1.0)), CAPS)
    drawn = {drawing.name: drawing for drawing in filtered.drawings}
    assert len(drawn["boundaries"].points_in_odom) == filtered.diagnostics.samples
    points = drawn["constraints"].points_in_odom
    assert len(points) == filtered.diagnostics.active > 0
    assert points[:, 0] == pytest.approx(0.3, abs=0.03)
