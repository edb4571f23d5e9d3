import math
from itertools import pairwise

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup, DeviceState, MobileBase
from drivers.interface.errors import ConfigurationError, DeviceError
from drivers.interface.geometry import SE2
from sim_drivers.omni_base import OmniBaseSettings, SimOmniBase
from sim_drivers.scene import Scene, Shape, StaticObstacle
from sim_drivers.world import MujocoWorld, WorldSettings

MS = 1_000_000
START = SE2(1.0, 2.0, 0.7)
EXACT = {"wheel_radius_error": (0.0, 0.0, 0.0), "wheel_heading_error_rad": (0.0, 0.0, 0.0), "slip_m_per_sqrt_m": 0.0}
QUIET = {"jitter_counts": 0.0, "loss_probability": 0.0}
WHEELS = ("ideal", "rollers")


def make(seed=1, static=(), physics_step_s=None, **settings):
    world = MujocoWorld(Scene("test", START, (), 60.0, static), WorldSettings(physics_step_s=physics_step_s))
    base = SimOmniBase(OmniBaseSettings(**settings), DeviceSetup("base", seed, lambda: world.now_ns, world))
    world.compile()
    base.open()
    return world, base


def pose(world):
    body = world.data.body("base")
    return SE2(float(body.xpos[0]), float(body.xpos[1]), math.atan2(body.xmat[3], body.xmat[0]))


def hold(world, base, twist, seconds):
    """Command as a 20 Hz loop does; return all samples."""
    samples = []
    for _ in range(round(seconds * 20)):
        base.command(twist, world.now_ns + 150 * MS)
        world.step_to(world.now_ns + 50 * MS)
        samples += base.drain()
    return samples


def rest(world, base, seconds=0.8):
    base.stop()
    world.step_to(world.now_ns + round(seconds * 1000) * MS)
    return list(base.drain())


def odometry(base, samples):
    estimate = SE2()
    for before, after in pairwise(samples):
        dt_s = (after.stamp.captured_ns - before.stamp.captured_ns) * 1e-9
        twist = base.kinematics.twist((after.position_rad - before.position_rad) / dt_s)
        estimate = estimate.integrate(twist.vx, twist.vy, twist.wz, dt_s)
    return estimate


def test_is_a_mobile_base():
    _, base = make()
    assert isinstance(base, MobileBase)
    assert (base.limits.velocity, base.limits.holonomic) == (BodyTwist(0.75, 0.5, 1.2), True)


def test_needs_a_world():
    with pytest.raises(ConfigurationError, match=r"world\.scenario"):
        SimOmniBase(OmniBaseSettings(), DeviceSetup("base", 1, lambda: 0, None))


@pytest.mark.parametrize("wheels", WHEELS)
@pytest.mark.parametrize("twist", [BodyTwist(0.5, 0, 0), BodyTwist(0, 0.4, 0), BodyTwist(0, 0, 1.0), BodyTwist(0.3, -0.2, 0.5)])
def test_goes_where_it_is_told(wheels, twist):
    world, base = make(wheels=wheels, **EXACT)
    hold(world, base, twist, 1.0)  # up to speed
    before = pose(world)
    hold(world, base, twist, 1.0)
    moved = before.inverse() @ pose(world)
    expected = SE2().integrate(twist.vx, twist.vy, twist.wz, 1.0)
    assert moved.distance(expected) < 0.006
    assert moved.yaw == pytest.approx(expected.yaw, abs=0.006)


@pytest.mark.parametrize("wheels", WHEELS)
def test_nominal_kinematics_misjudge_the_true_geometry_a_little(wheels):
    world, base = make(wheels=wheels)
    start = pose(world)
    samples = hold(world, base, BodyTwist(0.5, 0.0, 0.0), 3.0) + rest(world, base)
    error = (start.inverse() @ pose(world)).inverse() @ odometry(base, samples)
    assert 1e-3 < error.distance(SE2()) < 0.04  # of about 1.5 m
    assert abs(error.yaw) < 0.04


@pytest.mark.parametrize("wheels", WHEELS)
def test_odometry_agrees_where_the_geometry_is_exact(wheels):
    world, base = make(wheels=wheels, encoders=QUIET, **EXACT)
    start = pose(world)
    samples = hold(world, base, BodyTwist(0.4, 0.2, 0.4), 2.0) + rest(world, base)
    error = (start.inverse() @ pose(world)).inverse() @ odometry(base, samples)
    assert error.distance(SE2()) < (0.002 if wheels == "ideal" else 0.01)
    assert abs(error.yaw) < (0.002 if wheels == "ideal" else 0.01)


def test_rollers_slip_under_acceleration_but_little():
    world, base = make(wheels="rollers", encoders=QUIET, acceleration_m_s2=3.0, **EXACT)
    start = pose(world)
    samples = hold(world, base, BodyTwist(0.75, 0.0, 0.0), 0.6) + rest(world, base)
    slip = odometry(base, samples).x - (start.inverse() @ pose(world)).x
    assert 1e-5 < abs(slip) < 0.02


def test_rollers_go_the_same_way_at_a_fifth_of_the_physics_step():
    ends = []
    for step_s in (None, 0.0005):
        world, base = make(wheels="rollers", physics_step_s=step_s)
        for quarter in range(16):
            hold(world, base, BodyTwist(0.4 * math.cos(quarter), 0.4 * math.sin(quarter), 0.5), 0.25)
        ends.append(pose(world))
    off = ends[0].inverse() @ ends[1]
    assert math.hypot(off.x, off.y) < 2e-3
    assert abs(off.yaw) < 3e-3


def test_rollers_stay_upright_and_do_not_bounce():
    world, base = make(wheels="rollers")
    heights, tilts = [], []
    for _ in range(40):
        hold(world, base, BodyTwist(0.6, 0.4, 0.8), 0.05)
        heights.append(float(world.data.body("base").xpos[2]))
        tilts.append(math.acos(min(1.0, float(world.data.body("base").xmat[8]))))
    assert max(np.abs(heights)) < 5e-4
    assert max(tilts) < 0.01


@pytest.mark.parametrize("wheels", WHEELS)
def test_brakes_by_itself_when_nobody_commands_any_more(wheels):
    world, base = make(wheels=wheels, **EXACT)
    hold(world, base, BodyTwist(0.6, 0.0, 0.0), 1.0)
    expires_ns = world.now_ns + 100 * MS  # the last command's: 150 ms, given 50 ms ago
    world.step_to(expires_ns)
    assert base.health().expired_commands <= 1
    before = pose(world)
    world.step_to(expires_ns + 1500 * MS)
    stop_distance = 0.6**2 / (2 * base.limits.stop_deceleration.vx) + 0.6 * 0.09  # and two lags and a drive period
    assert 0.5 * stop_distance < before.distance(pose(world)) < stop_distance
    assert np.abs(world.data.qvel[: 6 if wheels == "rollers" else 3]).max() < 1e-3
    assert base.health().expired_commands == 1
    world.step_to(expires_ns + 2000 * MS)
    assert base.health().expired_commands == 1


def test_a_new_command_after_the_trip_is_obeyed():
    world, base = make()
    base.command(BodyTwist(0.5, 0, 0), world.now_ns + 30 * MS)
    world.step_to(1000 * MS)
    assert base.health().expired_commands == 1
    before = pose(world)
    hold(world, base, BodyTwist(0.5, 0, 0), 1.0)
    assert before.distance(pose(world)) > 0.3


def test_a_command_waits_for_its_latency():
    world, base = make(command_latency_s=0.2)
    base.command(BodyTwist(0.5, 0, 0), 10_000 * MS)
    world.step_to(195 * MS)
    assert pose(world).distance(START) < 1e-9
    world.step_to(500 * MS)
    assert pose(world).distance(START) > 0.01


def test_caps_are_kept():
    world, base = make(**EXACT)
    hold(world, base, BodyTwist(5.0, 0.0, 0.0), 1.5)
    assert float(np.hypot(*world.data.qvel[:2])) == pytest.approx(0.75, abs=1e-3)


@pytest.mark.parametrize("bad", [BodyTwist(math.nan, 0, 0), BodyTwist(0, math.inf, 0), BodyTwist(0, 0, -math.inf)])
def test_refuses_what_is_not_finite(bad):
    _, base = make()
    with pytest.raises(DeviceError, match="not finite"):
        base.command(bad, 1000 * MS)


def test_life_cycle():
    world = MujocoWorld(Scene("test", START, (), 60.0, ()), WorldSettings())
    base = SimOmniBase(OmniBaseSettings(), DeviceSetup("base", 1, lambda: world.now_ns, world))
    base.stop()
    base.close()
    with pytest.raises(DeviceError, match="not open"):
        base.command(BodyTwist(), 1)
    world.compile()
    base.open()
    base.open()
    assert base.health().state is DeviceState.OPEN
    hold(world, base, BodyTwist(0.5, 0, 0), 0.5)
    base.close()
    base.close()
    world.step_to(world.now_ns + 1500 * MS)
    assert np.abs(world.data.qvel[:3]).max() < 1e-3
    assert base.drain() == ()
    assert base.health().state is DeviceState.CLOSED


def test_samples_come_on_the_grid_and_late():
    world, base = make(encoders={"latency_s": 0.025, "loss_probability": 0.0})
    world.step_to(1000 * MS)
    samples = base.drain()
    captured = [s.stamp.captured_ns for s in samples]
    assert np.diff(captured).tolist() == [10 * MS] * (len(samples) - 1)
    assert captured[-1] == 970 * MS
    assert all(s.stamp.received_ns - s.stamp.captured_ns == 25 * MS for s in samples)
    assert not samples[0].position_rad.flags.writeable
    assert base.health().expected_period_ns == 10 * MS


def test_lost_and_overflowed_samples_are_counted():
    world, base = make(encoders={"loss_probability": 0.3, "buffered_samples": 10})
    world.step_to(2000 * MS)
    health = base.health()
    assert 40 < health.dropped < 80
    assert len(base.drain()) == 10
    assert health.overflowed == health.received - 10
    base.close()
    base.open()
    assert (base.health().dropped, base.health().overflowed) == (0, 0)


def test_angles_are_counted():
    world, base = make(encoders={"counts_per_rev": 64})
    samples = hold(world, base, BodyTwist(0.5, 0, 0), 0.5)
    counts = np.array([s.position_rad for s in samples]) / (2 * math.pi / 64)
    assert np.abs(counts - np.round(counts)).max() < 1e-9


def test_reported_rate_is_the_wheels_rate():
    world, base = make(encoders={"counts_per_rev": 100_000, **QUIET}, **EXACT)
    samples = hold(world, base, BodyTwist(0.4, 0.1, 0.3), 2.0)
    np.testing.assert_allclose(samples[-1].velocity_rad_s, base.kinematics.wheel_rates(BodyTwist(0.4, 0.1, 0.3)), atol=0.05)


@pytest.mark.parametrize("wheels", WHEELS)
def test_a_wall_stops_it_and_is_a_contact(wheels):
    ahead = START @ SE2(0.5, 0.0, 0.0)
    world, base = make(wheels=wheels, static=(StaticObstacle("wall", Shape.box(0.2, 2.0, 1.0), ahead),))
    touched = set()
    for _ in range(300):  # wheels that spin against a wall make the base rattle, so look often
        base.command(BodyTwist(0.5, 0.0, 0.0), world.now_ns + 150 * MS)
        world.step_to(world.now_ns + 5 * MS)
        touched |= {frozenset(world.model.geom(int(g)).name for g in contact.geom) for contact in world.data.contact}
    assert (START.inverse() @ pose(world)).x == pytest.approx(0.4 - 0.12, abs=0.01)
    assert frozenset(("chassis", "wall")) in touched


@pytest.mark.parametrize("wheels", WHEELS)
def test_the_seed_decides(wheels):
    def run(seed):
        world, base = make(seed, wheels=wheels)
        samples = hold(world, base, BodyTwist(0.4, 0.1, 0.3), 0.5)
        return np.array([np.concatenate((s.position_rad, s.velocity_rad_s, [s.stamp.captured_ns])) for s in samples])

    first, again, other = run(1), run(1), run(2)
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()
