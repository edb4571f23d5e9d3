import math
from itertools import pairwise

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup, MobileBase
from drivers.interface.errors import DeviceError
from drivers.interface.geometry import SE2
from sim_drivers.scene import Scene, Shape, StaticObstacle
from sim_drivers.skid_steer_base import TRACK_M, WHEELBASE_M, SimSkidSteerBase, SkidSteerSettings
from sim_drivers.world import MujocoWorld, WorldSettings

MS = 1_000_000
ORIGIN = SE2()
EXACT = {"wheel_radius_error": (0.0, 0.0, 0.0, 0.0)}
QUIET = {"jitter_counts": 0.0, "loss_probability": 0.0}


def make(seed=1, static=(), start=ORIGIN, **settings):
    world = MujocoWorld(Scene("test", start, (), 60.0, static), WorldSettings())
    base = SimSkidSteerBase(SkidSteerSettings(**settings), DeviceSetup("base", seed, lambda: world.now_ns, world))
    world.compile()
    base.open()
    return world, base


def pose(world):
    body = world.data.body("base")
    return SE2(float(body.xpos[0]), float(body.xpos[1]), math.atan2(body.xmat[3], body.xmat[0]))


def hold(world, base, twist, seconds):
    samples = []
    for _ in range(round(seconds * 20)):
        base.command(twist, world.now_ns + 150 * MS)
        world.step_to(world.now_ns + 50 * MS)
        samples += base.drain()
    return samples


def test_is_a_mobile_base_that_cannot_strafe():
    _, base = make()
    assert isinstance(base, MobileBase)
    assert not base.limits.holonomic
    with pytest.raises(DeviceError, match="sideways"):
        base.command(BodyTwist(0.5, 0.1, 0.0), 1000 * MS)
    with pytest.raises(DeviceError, match="not finite"):
        base.command(BodyTwist(math.nan, 0.0, 0.0), 1000 * MS)


def test_drives_straight():
    world, base = make(start=SE2(1.0, -1.0, 2.0), **EXACT)
    hold(world, base, BodyTwist(0.8, 0.0, 0.0), 1.5)
    before = pose(world)
    hold(world, base, BodyTwist(0.8, 0.0, 0.0), 1.0)
    moved = before.inverse() @ pose(world)
    assert moved.x == pytest.approx(0.8, rel=0.01)  # the tyres give under the weight, and creep
    assert abs(moved.y) < 0.01
    assert abs(moved.yaw) < 0.01


@pytest.mark.parametrize(("friction", "rate_rad_s"), [(0.6, 0.3), (0.6, 1.0), (0.4, 0.6), (0.8, 0.6)])
def test_effective_track_is_where_point_contacts_balance(friction, rate_rad_s):
    """Quasi-static turn on four point contacts: sum of moments zero when wheels run as on a track of t + l^2 / t."""
    world, base = make(friction=friction, encoders=QUIET, **EXACT)
    hold(world, base, BodyTwist(0.0, 0.0, rate_rad_s), 1.0)
    before = pose(world)
    samples = hold(world, base, BodyTwist(0.0, 0.0, rate_rad_s), 1.0)
    turned = (before.inverse() @ pose(world)).yaw
    rolled = samples[-1].position_rad - samples[0].position_rad
    span_s = (samples[-1].stamp.captured_ns - samples[0].stamp.captured_ns) * 1e-9
    difference_m_s = 0.098 * (rolled[1::2].mean() - rolled[0::2].mean()) / span_s
    effective_track = difference_m_s / turned
    assert effective_track == pytest.approx(TRACK_M + WHEELBASE_M**2 / TRACK_M, rel=0.03)
    assert effective_track == pytest.approx(base.kinematics.effective_track_m, rel=0.03)


def test_odometry_follows_a_gentle_curve():
    world, base = make(encoders=QUIET, **EXACT)
    samples = hold(world, base, BodyTwist(0.4, 0.0, 0.4), 3.0)
    base.stop()
    world.step_to(world.now_ns + 800 * MS)
    samples += base.drain()
    estimate = SE2()
    for before, after in pairwise(samples):
        dt_s = (after.stamp.captured_ns - before.stamp.captured_ns) * 1e-9
        twist = base.kinematics.twist((after.position_rad - before.position_rad) / dt_s)
        estimate = estimate.integrate(twist.vx, twist.vy, twist.wz, dt_s)
    truth = pose(world)
    assert 1e-4 < estimate.distance(truth) < 0.05  # it skids outwards, which wheels cannot tell
    assert estimate.yaw == pytest.approx(truth.yaw, abs=0.05)


def test_stays_on_its_wheels():
    world, base = make()
    tilts = []
    for twist in (BodyTwist(1.0, 0, 0), BodyTwist(0, 0, 2.0), BodyTwist(-1.0, 0, -1.0)):
        for _ in range(10):
            hold(world, base, twist, 0.1)
            tilts.append(math.acos(min(1.0, float(world.data.body("base").xmat[8]))))
    assert max(tilts) < 0.03


def test_brakes_by_itself_when_nobody_commands_any_more():
    world, base = make(**EXACT)
    hold(world, base, BodyTwist(1.0, 0.0, 0.0), 1.5)
    expires_ns = world.now_ns + 100 * MS
    world.step_to(expires_ns)
    before = pose(world)
    world.step_to(expires_ns + 2000 * MS)
    stop_distance = 1.0 / (2 * base.limits.stop_deceleration.vx) + 0.1
    assert 0.5 * stop_distance < before.distance(pose(world)) < stop_distance
    assert np.abs(world.data.qvel[:6]).max() < 2e-3
    assert base.health().expired_commands == 1


def test_a_wall_stops_it():
    wall = StaticObstacle("wall", Shape.box(0.2, 2.0, 1.0), SE2(0.8, 0.0, 0.0))
    world, base = make(static=(wall,))
    touched = set()
    for _ in range(200):
        base.command(BodyTwist(0.6, 0.0, 0.0), world.now_ns + 150 * MS)
        world.step_to(world.now_ns + 10 * MS)
        touched |= {frozenset(world.model.geom(int(g)).name for g in contact.geom) for contact in world.data.contact}
    assert pose(world).x == pytest.approx(0.7 - 0.254, abs=0.02)
    assert frozenset(("chassis", "wall")) in touched


def test_the_seed_decides():
    def run(seed):
        world, base = make(seed)
        return np.array([s.position_rad for s in hold(world, base, BodyTwist(0.4, 0.0, 0.3), 0.5)])

    assert run(1).tobytes() == run(1).tobytes()
    assert run(1).tobytes() != run(2).tobytes()


@pytest.mark.parametrize("twist", [BodyTwist(0.0, 0.0, 2.0), BodyTwist(0.6, 0.0, -1.6)])
def test_tyres_that_are_dragged_sideways_stay_on_the_floor(twist):
    world, base = make(start=SE2(0.0, 0.0, 0.4))
    hold(world, base, twist, 1.0)
    loads, speeds = [], []
    for _ in range(200):
        base.command(twist, world.now_ns + 150 * MS)
        world.step_to(world.now_ns + 3 * MS)
        loads.append(world.data.sensordata.copy())
        speeds.append(world.data.qvel[:3].copy())
    assert np.min(loads) > 0.5 * 17.0 * 9.81 / 4  # each wheel carries; in a curve the outer ones more
    assert np.sum(loads, axis=1) == pytest.approx(17.0 * 9.81, rel=0.02)  # the base does not bounce
    force = np.diff(speeds, axis=0) / 2.5e-3 + (0.0, 0.0, 9.81)
    assert np.linalg.norm(force, axis=1) == pytest.approx(9.81, abs=0.3)


def test_sliding_sideways_is_braked_by_friction_alone():
    """Coulomb: mu g, whatever the weight and the speed, well above the speed at which a tyre creeps."""
    for mass_kg, friction in ((17.0, 0.6), (30.0, 0.4)):
        world, base = make(mass_kg=mass_kg, friction=friction)
        hold(world, base, BodyTwist(), 0.2)
        world.data.qvel[1] = 2.0
        world.step_to(world.now_ns + 50 * MS)
        before = float(world.data.qvel[1])
        world.step_to(world.now_ns + 100 * MS)
        assert before - float(world.data.qvel[1]) == pytest.approx(0.1 * friction * 9.81, rel=0.03)
        base.close()
