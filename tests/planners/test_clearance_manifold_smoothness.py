"""What the clearance-manifold planner asks for is smooth, what closes in on it is steady, and P4 is the same at every rate."""

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from planners.clearance_manifold.closing import ClosingMemory
from planners.clearance_manifold.drift import Drift, Past
from planners.clearance_manifold.governor import Around, Governor, Motion, approach
from planners.clearance_manifold.governor_kernels import followed, jerk_to_move, jerk_to_pass, jerk_to_stop, room_along
from planners.clearance_manifold.planner import ClearanceManifold
from planners.clearance_manifold.ridge_kernels import Ground
from planners.clearance_manifold.settings import ClearanceManifoldSettings, SmoothnessSettings
from planners.planner import PlannerSetup
from planners.router import RouterSetup
from planners.routers.straight import StraightRouter
from tests.planners.synthetic import OMNI, Box, belief_of, mission_to


def driven(wanted, jerk=1.0, dt=0.05, seconds=4.0, velocity=(0.0, 0.0)):
    """Return velocities and accelerations, shape (n, 2) each, while `wanted` stays."""
    v, a, told = np.array(velocity), np.zeros(2), []
    for _ in range(round(seconds / dt)):
        v, a = followed(v, a, np.array(wanted), jerk, jerk, 10.0, 50.0, dt)
        told.append((v, a))
    return np.array([one for one, _ in told]), np.array([one for _, one in told])


@pytest.mark.parametrize("wanted", [(0.5, 0.0), (0.3, -0.4), (-0.02, 0.01)])
@pytest.mark.parametrize("dt", [0.02, 0.05, 0.2])
def test_a_step_is_followed_with_no_more_jerk_than_allowed_and_without_overshoot(wanted, dt):
    velocity, acceleration = driven(wanted, dt=dt)
    jerk = np.diff(np.vstack(([0.0, 0.0], acceleration)), axis=0) / dt
    assert np.hypot(*jerk.T).max() <= 1.0 + 1e-9
    assert velocity[-1] == pytest.approx(wanted, abs=0.01 * np.hypot(*wanted) + 1e-3)
    along = velocity @ np.array(wanted) / np.hypot(*wanted)
    assert along.max() <= np.hypot(*wanted) * 1.02 + 1e-3


@pytest.mark.parametrize("jerk", [0.5, 1.0, 4.0])
def test_a_stop_takes_the_way_of_the_closed_form(jerk):
    """v sqrt(v / jerk): the jerk that a way asks for, and the speed that a way admits, are its inverses."""
    velocity, _ = driven((0.0, 0.0), jerk, dt=0.001, velocity=(0.5, 0.0))
    way_m = 0.001 * velocity[:, 0].sum()
    assert way_m == pytest.approx(0.5 * (0.5 / jerk) ** 0.5, rel=0.05)
    assert jerk_to_stop(0.5, way_m) == pytest.approx(jerk, rel=0.1)
    assert approach(way_m, jerk) == pytest.approx(0.5, rel=0.04)


def test_an_acceleration_that_is_wanted_no_more_ends_before_it_changes_much():
    v, a, top = np.array([0.5, 0.0]), np.array([1.2, 0.0]), 0.5
    for _ in range(20):
        v, a = followed(v, a, np.array([0.5, 0.0]), 0.5, 8.0, 10.0, 6.0, 0.05)
        top = max(top, v[0])
    assert top < 0.5 + 0.1 + 1.2 * 0.05


def test_what_presses_is_answered_in_time():
    """Constant jerk moves by j t^3 / 6, in half of the time; half up and half down in T it changes a velocity by j T^2 / 4."""
    assert jerk_to_move(0.4, 1.2) * (0.5 * 1.2) ** 3 / 6.0 == pytest.approx(0.4)
    assert jerk_to_pass(0.4, 2.0) * (0.3 * 2.0) ** 2 / 4.0 == pytest.approx(0.4)


@pytest.mark.parametrize(("direction", "room_m"), [((1.0, 0.0), 0.8), ((0.0, 1.0), 1.0), ((0.6, 0.8), 1.0)])
def test_room_ends_where_the_robot_would_come_too_near_to_a_wall(direction, room_m):
    belief = belief_of([Box(1.0, -3, 3, 3)])
    at, field = belief.clearance.lattice, belief.clearance
    ground = Ground(field.clearance_m, at.x_m, at.y_m, at.cell_m)
    found = room_along(ground, field.known, np.zeros(2), np.array(direction), 0.2, 0.25, 1.0)
    assert found == pytest.approx(room_m, abs=0.06)
    assert room_along(ground, np.zeros_like(field.known), np.zeros(2), np.array(direction), 0.2, 0.25, 1.0) < 0.26


def test_a_velocity_that_leads_into_a_wall_is_given_up_before_it():
    """The wanted velocity changes from 0.5 m/s towards a wall to none: the jerk is what the room left asks for."""
    settings = SmoothnessSettings()
    for wall_m in (0.6, 0.45):
        belief = belief_of([Box(-3, wall_m, 3, 2.0)])
        at, field = belief.clearance.lattice, belief.clearance
        around = Around(Ground(field.clearance_m, at.x_m, at.y_m, at.cell_m), field.known, 0.2, 0.25)
        governor, y, v = Governor(settings, OMNI, 0.05), 0.0, np.array([0.0, 0.5])
        governor.take({"reference": np.array([0.0, 0.5, 0.0, 0.0])})
        for _ in range(60):
            v = governor.follow(
                np.zeros(2), Motion(np.array([0.0, y]), v, np.array([1.0, 0.0]), 2.0, np.inf), around, settings.jerk_m_s3
            )
            y += 0.05 * v[1]
        assert abs(v[1]) < 0.01
        assert y < wall_m - 0.2 + 0.03


def test_who_is_kept_from_what_was_asked_goes_on_from_what_he_does():
    governor = Governor(SmoothnessSettings(), OMNI, 0.05)
    belief = belief_of([])
    at, field = belief.clearance.lattice, belief.clearance
    around = Around(Ground(field.clearance_m, at.x_m, at.y_m, at.cell_m), field.known, 0.2, 0.25)
    held = Motion(np.zeros(2), np.zeros(2), np.array([1.0, 0.0]), 2.0, np.inf)  # a shield lets it stand
    for _ in range(100):
        asked = governor.follow(np.array([0.5, 0.0]), held, around, 0.8)
    assert asked[0] < SmoothnessSettings().slip_m_s + 0.05 * OMNI.acceleration.vx  # and what it gains in a tick


@pytest.mark.parametrize("speed", [0.6, 1.2])
def test_the_end_of_a_wall_stops_closing_in_and_a_walker_does_not(speed):
    """Both are first seen with the same rate; the wall's fades as it is smoothed, and its middle stays."""
    rng = np.random.default_rng(3)
    field = belief_of([]).clearance
    age = np.zeros(field.known.shape, np.float32)
    wall, walker = ClosingMemory(1.0), ClosingMemory(1.0)
    for tick in range(12):
        noise = rng.normal(0.0, 0.04, 2)
        ends = np.array([2.0 + noise[0], 1.4 + noise[1], 0.0, -speed * np.exp(-0.05 * tick / 0.56), 20.0])
        comes = np.array([2.0 + noise[0], 1.4 - 0.05 * speed * tick + noise[1], 0.0, -1.5 * speed, 20.0])  # a rate too high
        still, moves = (memory.update(seen[None], field, age, 0.05)[0] for memory, seen in ((wall, ends), (walker, comes)))
    assert np.hypot(*still[2:4]) < 0.45 * speed * np.exp(-0.05 * 11 / 0.56)
    assert moves[3] == pytest.approx(-speed, rel=0.35)


@pytest.mark.parametrize("period_ms", [20, 50, 200])
def test_how_fast_a_manifold_moves_is_the_same_at_every_rate(period_ms):
    drift, arcs = Drift(), np.linspace(0.0, 4.0, 15)
    for tick in range(1000 // period_ms):
        offset = np.full(15, 0.3 * tick * period_ms * 1e-3)
        speed = drift.speed(tick * period_ms * 1_000_000, arcs, offset)
        drift.keep(Past(tick * period_ms * 1_000_000, np.zeros((15, 2)), arcs, offset))
    assert speed == pytest.approx(0.3)
    other = Drift()
    other.take(drift.state())
    offset = np.full(15, 0.3)
    assert other.speed(1_000_000_000, arcs, offset) == drift.speed(1_000_000_000, arcs, offset) == pytest.approx(0.3)


def test_steps_of_half_a_cell_are_no_speed_beyond_the_bound():
    """A ridge on a grid of 5 cm moves in steps: per tick of 0.05 s that would be 0.5 m/s, per step of 0.2 s it is 0.125 m/s."""
    drift, arcs, fastest = Drift(), np.linspace(0.0, 4.0, 15), 0.0
    for tick in range(40):
        offset = np.full(15, 0.025 * (tick // 5))
        fastest = max(fastest, drift.speed(tick * 50_000_000, arcs, offset))
        drift.keep(Past(tick * 50_000_000, np.zeros((15, 2)), arcs, offset))
    assert fastest == pytest.approx(0.125)


def test_from_rest_to_full_speed_in_a_corridor_the_commands_keep_the_jerk():
    router = StraightRouter(StraightRouter.Settings(), RouterSetup(0.05, 0.12))
    settings = ClearanceManifoldSettings()
    planner, pose, twists = ClearanceManifold(settings, PlannerSetup(0.05, 0.12, OMNI, 0)), SE2(), []
    walls, goal = (Box(-4, 1.0, 12, 1.2), Box(-4, -1.2, 12, -1.0)), mission_to(9.0, 0.0)
    for tick in range(60):
        belief = belief_of(walls, pose, twists[-1] if twists else BodyTwist(), tick=tick)
        twists.append(planner.plan(belief, router.route(belief, goal)).base)
        pose = pose.integrate(twists[-1].vx, twists[-1].vy, twists[-1].wz, 0.05)
    speed = np.array([twist.vx for twist in twists])
    assert speed[-1] == pytest.approx(settings.controller.speed_m_s, abs=0.02)
    assert np.abs(np.diff(speed, n=2)).max() / 0.05**2 <= settings.smoothness.jerk_m_s3 + 1e-6
