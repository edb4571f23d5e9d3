import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from drivers.interface.arm_motion import PANDA
from drivers.interface.commands import BodyTwist, JointTrajectory
from drivers.interface.devices import Arm, DeviceSetup
from drivers.interface.errors import DeviceError
from drivers.interface.geometry import SE2
from sim_drivers.arm import ArmSettings, SimArm
from sim_drivers.arm_model import READY_RAD
from sim_drivers.omni_base import OmniBaseSettings, SimOmniBase
from sim_drivers.scene import Scene
from sim_drivers.world import MujocoWorld, WorldSettings

MS = 1_000_000
READY = np.array(READY_RAD)
GOAL = READY + np.array([0.5, 0.4, -0.5, 0.3, 0.6, -0.5, 0.8])
# Franka Control Interface documentation: a [m], d [m], alpha [rad] of joints 1 to 7 and the flange (modified convention).
DH = [
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -math.pi / 2),
    (0.0, 0.316, math.pi / 2),
    (0.0825, 0.0, math.pi / 2),
    (-0.0825, 0.384, -math.pi / 2),
    (0.0, 0.0, math.pi / 2),
    (0.088, 0.0, math.pi / 2),
    (0.0, 0.107, 0.0),
]


def make(seed=1, **settings):
    world = MujocoWorld(Scene("test", SE2(), (), 60.0, ()), WorldSettings())
    arm = SimArm(ArmSettings(**settings), DeviceSetup("arm", seed, lambda: world.now_ns, world))
    world.compile()
    arm.open()
    return world, arm


def move(to=GOAL, seconds=1.5, start=READY, start_ns=0):
    return JointTrajectory(start_ns, np.array([0.0, seconds]), np.stack((start, to)), np.zeros((2, 7)))


def watch(world, milliseconds):
    """Step a millisecond at a time; return measured positions and velocities, both (n, 7)."""
    rows = []
    for _ in range(milliseconds):
        world.step_to(world.now_ns + MS)
        rows.append((world.data.qpos.copy(), world.data.qvel.copy()))
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def flange_by_dh(q):
    pose = np.eye(4)
    for (a, d, alpha), theta in zip(DH, [*q, 0.0], strict=True):
        ca, sa, ct, st = math.cos(alpha), math.sin(alpha), math.cos(theta), math.sin(theta)
        pose = pose @ np.array([[ct, -st, 0, a], [st * ca, ct * ca, -sa, -d * sa], [st * sa, ct * sa, ca, d * ca], [0, 0, 0, 1]])
    return pose


def test_is_an_arm():
    assert isinstance(make()[1], Arm)


@pytest.mark.parametrize("index", range(5))
def test_forward_kinematics_are_the_documented_ones(index):
    q = np.random.default_rng(index).uniform(PANDA.position_min_rad, PANDA.position_max_rad)
    world, _ = make(start_rad=tuple(q))
    flange = world.data.body("arm_panda_link8")
    expected = flange_by_dh(q)
    np.testing.assert_allclose(flange.xpos, expected[:3, 3], atol=1e-12)
    np.testing.assert_allclose(flange.xmat.reshape(3, 3), expected[:3, :3], atol=1e-12)


def test_limits_in_the_model_are_those_of_the_motion():
    world, _ = make()
    np.testing.assert_array_equal(world.model.jnt_range, np.stack((PANDA.position_min_rad, PANDA.position_max_rad), axis=1))
    np.testing.assert_array_equal(world.model.jnt_actfrcrange[:, 1], PANDA.torque_nm)


def test_urdf_has_what_libfranka_asks_of_it():
    robot = ET.fromstring(resources.files("configs").joinpath("models/panda.urdf").read_text())
    moving = [joint for joint in robot.iter("joint") if joint.get("type") == "revolute"]
    assert [f"joint{index}" in joint.get("name") for index, joint in enumerate(moving, 1)] == [True] * 7
    for joint, velocity, deceleration in zip(moving, PANDA.velocity_rad_s, PANDA.acceleration_rad_s2, strict=True):
        limit, by_position = joint.find("limit"), joint.find("position_based_velocity_limits")
        assert float(limit.get("velocity")) == velocity
        assert (float(by_position.get("velocity_offset")), float(by_position.get("deceleration_limit"))) == (0.0, deceleration)
    assert any("link8" in link.get("name") for link in robot.iter("link"))


def test_holds_still_against_gravity():
    world, arm = make()
    position, _ = watch(world, 300)
    np.testing.assert_allclose(position, np.tile(READY, (300, 1)), atol=1e-9)
    torque = arm.drain()[-1].torque_nm
    assert 15.0 < abs(torque[1]) + abs(torque[3]) < 60.0  # the sensors feel the links' weight


def test_reaches_a_way_point_on_time_and_inside_its_limits():
    world, arm = make()
    arm.command(move(), 3000 * MS)
    position, velocity = watch(world, 2000)
    assert np.abs(position[1520] - GOAL).max() < 1e-3
    assert np.abs(position[-1] - GOAL).max() < 1e-6
    assert np.abs(position[750] - (READY + GOAL) / 2).max() < 0.01  # half way at half time
    assert (np.abs(velocity) < PANDA.velocity_rad_s).all()
    assert (np.abs(np.diff(velocity, axis=0)) / 1e-3 < PANDA.acceleration_rad_s2).all()
    assert arm.health().expired_commands == 0


def test_passes_through_knots_with_their_velocity():
    world, arm = make()
    middle, velocity = READY + 0.2, np.full(7, 0.4)
    knots = np.stack((READY, middle, READY + 0.4))
    arm.command(JointTrajectory(0, np.array([0.0, 0.8, 1.6]), knots, np.stack((0 * velocity, velocity, 0 * velocity))), 3000 * MS)
    position, speed = watch(world, 802)
    np.testing.assert_allclose(position[-1], middle, atol=3e-3)
    np.testing.assert_allclose(speed[-1], velocity, atol=0.02)


def test_an_impossible_demand_is_met_late_but_inside_the_limits():
    world, arm = make()
    far = READY.copy()
    far[0], far[5] = 2.0, 0.2
    arm.command(move(far, 0.02), 10_000 * MS)
    position, velocity = watch(world, 2500)
    assert np.abs(position[-1] - far).max() < 1e-4
    assert (np.abs(velocity) < 1.06 * PANDA.velocity_rad_s).all()  # the set point keeps the limit, the servo swings over it
    assert (position > PANDA.position_min_rad).all()
    assert (position < PANDA.position_max_rad).all()


def test_comes_to_rest_when_the_command_expires():
    world, arm = make()
    arm.command(move(), 700 * MS)
    watch(world, 700)
    at_expiry = world.data.qpos.copy()
    position, velocity = watch(world, 600)
    assert np.abs(velocity[-1]).max() < 1e-6
    assert 0.001 < np.abs(position[-1] - at_expiry).max() < 0.1
    assert np.abs(position[-1] - GOAL).max() > 0.1
    assert arm.health().expired_commands == 1


@pytest.mark.parametrize("end", ["stop", "close"])
def test_stop_and_close_bring_it_to_rest(end):
    world, arm = make()
    arm.command(move(), 5000 * MS)
    watch(world, 700)
    getattr(arm, end)()
    getattr(arm, end)()
    _, velocity = watch(world, 500)
    assert np.abs(velocity[-1]).max() < 1e-6
    assert arm.health().expired_commands == 0


def test_stop_and_close_work_before_everything():
    world = MujocoWorld(Scene("test", SE2(), (), 60.0, ()), WorldSettings())
    arm = SimArm(ArmSettings(), DeviceSetup("arm", 1, lambda: world.now_ns, world))
    arm.stop()
    arm.close()
    with pytest.raises(DeviceError, match="not open"):
        arm.command(move(), 1)


@pytest.mark.parametrize(
    ("trajectory", "message"),
    [
        (move(np.full(7, math.nan)), "not finite"),
        (move(READY + 3.0), "range"),
        (JointTrajectory(0, np.array([0.0, 0.0]), np.stack((READY, GOAL)), np.zeros((2, 7))), "increase"),
        (JointTrajectory(0, np.array([0.0, 1.0]), np.stack((READY, GOAL)), np.full((2, 7), 2.4)), "velocity limits"),
        (JointTrajectory(0, np.array([0.0]), READY[None], np.zeros((1, 7))), "two knots"),
        (JointTrajectory(0, np.array([0.0, 1.0]), np.zeros((2, 6)), np.zeros((2, 6))), "7 positions"),
    ],
)
def test_refuses_what_cannot_be_followed(trajectory, message):
    _, arm = make()
    with pytest.raises(DeviceError, match=message):
        arm.command(trajectory, 1000 * MS)


def test_the_seed_decides():
    def run(seed):
        world, arm = make(seed)
        arm.command(move(), 3000 * MS)
        watch(world, 300)
        samples = arm.drain()
        assert np.diff([s.stamp.captured_ns for s in samples]).tolist() == [10 * MS] * (len(samples) - 1)
        return np.array([np.concatenate((s.position_rad, s.velocity_rad_s, s.torque_nm)) for s in samples])

    assert run(1).tobytes() == run(1).tobytes()
    assert run(1).tobytes() != run(2).tobytes()


def test_rides_on_a_base_as_one_robot():
    world = MujocoWorld(Scene("test", SE2(), (), 60.0, ()), WorldSettings())
    base = SimOmniBase(OmniBaseSettings(mass_kg=60.0, radius_m=0.35), DeviceSetup("base", 1, lambda: world.now_ns, world))
    arm = SimArm(ArmSettings(mount_x_m=0.1, mount_z_m=0.4), DeviceSetup("arm", 1, lambda: world.now_ns, world))
    world.compile()
    base.open()
    arm.open()
    arm.command(move(), 5000 * MS)
    base.command(BodyTwist(0.4, 0.0, 0.0), 2000 * MS)
    world.step_to(4000 * MS)
    assert 0.6 < world.data.body("base").xpos[0] < 0.9
    assert np.abs(arm.drain()[-1].position_rad - GOAL).max() < 1e-3
    flange = world.data.body("base").xpos + np.array([0.1, 0.0, 0.4]) + flange_by_dh(GOAL)[:3, 3]
    np.testing.assert_allclose(world.data.body("arm_panda_link8").xpos, flange, atol=0.03)  # the base turned a little


def test_the_order_to_rest_ends_a_trajectory_and_is_no_dead_mans_work():
    world, arm = make()
    arm.command(move(), 5000 * MS)
    watch(world, 700)
    arm.command(JointTrajectory.rest(), 5000 * MS)
    _, velocity = watch(world, 500)
    assert np.abs(velocity[-1]).max() < 1e-6
    assert arm.health().expired_commands == 0


def test_a_trajectory_begins_at_its_own_time_not_when_it_is_sent():
    runs = []
    for sent_ms in (range(0, 1900, 100), (0,)):
        world, arm = make()
        for at_ms in sent_ms:
            world.step_to(at_ms * MS)
            arm.command(move(start_ns=300 * MS), 3000 * MS)
        world.step_to(1900 * MS)
        runs.append(world.data.qpos.copy())
    np.testing.assert_array_equal(*runs)
    assert np.abs(runs[0] - GOAL).max() < 1e-3


def test_a_speed_factor_lowers_the_joints_speed_and_it_arrives_late():
    fast, slow = (peak_and_place(factor) for factor in (1.0, 0.5))
    assert fast[0] > 0.8 * PANDA.velocity_rad_s[6]
    assert slow[0] < 0.55 * PANDA.velocity_rad_s[6]
    assert abs(slow[1] - fast[1]) < 0.01


def peak_and_place(factor):
    """Return the last joint's highest speed on a turn of 2 rad, and where it comes to stand."""
    world, arm = make()
    goal = READY + 2.0 * np.eye(7)[6]
    turn = replace(move(to=goal, seconds=1.4), speed_factor=factor)
    arm.command(turn, 10**12)
    peak = 0.0
    for step in range(1, 400):
        world.step_to(step * 10 * MS)
        peak = max(peak, float(abs(world.data.qvel[6])))
    return peak, float(world.data.qpos[6])
