"""Ground truth against closed forms and against MuJoCo's distances over every pair."""

import math

import mujoco
import numpy as np
import pytest

from drivers.interface.devices import DeviceSetup
from drivers.interface.geometry import SE2
from sim_drivers.robot_clearance import RobotClearance
from sim_drivers.scene import Conveyor, Mover, Scene, Shape, StaticObstacle
from sim_drivers.truth import SimTruth, TruthSettings
from sim_drivers.world import FLOOR_BIT, OBSTACLE_BIT, MujocoWorld, WorldSettings


class Robot:
    """A cylinder of radius 0.12 m with an unnamed antenna on a body of its own, and a wheel that could touch the floor only."""

    max_step_s = 0.002
    period_ns = 1_000_000_000

    def __init__(self, velocity=(0.0, 0.0, 0.0)):
        self.velocity = velocity

    def build(self, spec, base):
        for axis in ([1, 0, 0], [0, 1, 0]):
            base.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        base.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        base.mass, base.inertia, base.explicitinertial = 5.0, [0.1, 0.1, 0.1], True
        base.ipos, base.iquat = [0, 0, 0], [1, 0, 0, 0]
        bits = {"contype": OBSTACLE_BIT, "conaffinity": OBSTACLE_BIT}
        base.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.12, 0.2, 0], pos=[0, 0, 0.3], **bits)
        base.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], pos=[0, 0.5, 0.051], contype=0, conaffinity=FLOOR_BIT)
        antenna = base.add_body(name="antenna", pos=[0, 0, 0.9])
        antenna.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.01, 0.3, 0], mass=0, **bits)

    def bind(self, world):
        world.data.qvel[:3] = self.velocity
        mujoco.mj_step1(world.model, world.data)

    def act(self, world):
        pass


def opened(static=(), movers=(), conveyors=(), start=None, velocity=(0.0, 0.0, 0.0), **settings):
    scene = Scene("test", start or SE2(), (), 60.0, tuple(static), tuple(movers), tuple(conveyors))
    world = MujocoWorld(scene, WorldSettings())
    world.add(Robot(velocity))
    truth = SimTruth(TruthSettings(**settings), DeviceSetup("truth", 1, lambda: world.now_ns, world))
    world.compile()
    truth.open()
    return world, truth


def after(world, truth, seconds):
    world.step_to(world.now_ns + round(seconds * 1e9))
    return truth.latest()


def test_pose_and_twist_of_a_base_that_slides_and_turns():
    """The joints slide along the start's axes; the twist is given along the base's own."""
    start = SE2(1.0, -2.0, 0.5)
    world, truth = opened(start=start, velocity=(0.4, 0.1, 0.8))
    sample = after(world, truth, 0.5)
    expected = start @ SE2(0.4 * 0.5, 0.1 * 0.5, 0.8 * 0.5)
    pose, twist = sample.map_from_base, sample.twist
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((expected.x, expected.y, expected.yaw), abs=1e-9)
    c, s = math.cos(0.4), math.sin(0.4)
    assert (twist.vx, twist.vy, twist.wz) == pytest.approx((0.4 * c + 0.1 * s, 0.1 * c - 0.4 * s, 0.8), abs=1e-9)
    assert sample.stamp.captured_ns == sample.stamp.received_ns == 500_000_000


def test_movers_are_where_they_are_and_as_fast():
    walker = Mover("walker", Shape.cylinder(0.25, 1.7), np.array([[0.0, 3.0, 1.0, 0.0], [4.0, 1.0, 2.0, 0.0]]))
    world, truth = opened(movers=(walker,))
    (obstacle,) = after(world, truth, 1.0).obstacles
    assert (obstacle.map_from_obstacle.x, obstacle.map_from_obstacle.y) == pytest.approx((2.5, 1.25))
    assert (obstacle.name, obstacle.velocity_m_s, obstacle.radius_m) == ("walker", (-0.5, 0.25), 0.25)


def test_boxes_on_a_belt_are_obstacles_that_move_with_it():
    box = StaticObstacle("parcel", Shape.box(0.2, 0.2, 0.2), SE2(2.0, 1.0, 0.0), base_z_m=0.5)
    belt = Conveyor("belt", Shape.box(3.0, 0.6, 0.5), SE2(2.5, 1.0, 0.0), speed_m_s=0.3, items=(box,))
    world, truth = opened(conveyors=(belt,))
    (obstacle,) = after(world, truth, 2.0).obstacles
    assert obstacle.name == "parcel"
    assert obstacle.velocity_m_s == pytest.approx((0.3, 0.0), abs=0.01)
    assert obstacle.map_from_obstacle.x == pytest.approx(2.6, abs=0.05)


def test_clearance_is_from_surface_to_surface_and_negative_inside():
    pillar = Shape.cylinder(0.3, 1.0)
    for x, expected, touched in ((1.0, 0.58, ()), (0.425, 0.005, ()), (0.35, -0.07, ("pillar",))):
        world, truth = opened(static=(StaticObstacle("pillar", pillar, SE2(x, 0.0, 0.0)),))
        sample = truth_now(world, truth)
        assert sample.clearance_m == pytest.approx(expected, abs=1e-5)
        assert sample.contacts == touched
    assert truth_now(*opened()).clearance_m == math.inf


def truth_now(world, truth):
    """The sample of the state that the world is in, without stepping it apart."""
    truth.act(world)
    return truth.latest()


def test_the_floor_a_wheel_and_the_robot_itself_are_no_obstacles():
    under_wheel = StaticObstacle("under_wheel", Shape.box(0.1, 0.1, 0.05), SE2(0.0, 0.5, 0.0))
    world, truth = opened(static=(under_wheel,))
    sample = truth_now(world, truth)
    assert sample.contacts == ()
    assert sample.clearance_m > 0.2


def test_what_hangs_over_the_hull_still_meets_the_antenna():
    beam = StaticObstacle("beam", Shape.box(0.1, 2.0, 0.1), SE2(0.3, 0.0, 0.0), base_z_m=0.9)
    world, truth = opened(static=(beam,))
    assert truth_now(world, truth).clearance_m == pytest.approx(0.24, abs=1e-5)


@pytest.mark.parametrize("seed", range(10))
def test_clearance_is_the_least_over_all_pairs(seed):
    rng = np.random.default_rng(seed)
    static = [
        StaticObstacle(f"thing{i}", shape, SE2(*rng.uniform(-4, 4, 2), rng.uniform(-3, 3)), rng.uniform(0, 1))
        for i, shape in enumerate(
            Shape.box(*rng.uniform(0.1, 3.0, 3)) if rng.random() < 0.5 else Shape.cylinder(*rng.uniform(0.05, 0.5, 2))
            for _ in range(40)
        )
    ]
    world, _ = opened(static=static)
    model, data = world.model, world.data
    own = [
        g
        for g in range(model.ngeom)
        if model.geom_contype[g] == OBSTACLE_BIT and model.body(model.geom_bodyid[g]).name in ("base", "antenna")
    ]
    others = [model.geom(s.name).id for s in static]
    distance = {model.geom(o).name: min(mujoco.mj_geomDistance(model, data, r, o, 1e6, None) for r in own) for o in others}
    clearance_m, touched = RobotClearance(model).measure(data)
    assert clearance_m == pytest.approx(min(distance.values()), abs=1e-9)
    assert set(touched) == {name for name, d in distance.items() if d <= 0.0}


def test_a_touch_between_two_looks_of_the_loop_is_not_missed():
    """A ball rolls through between one tick and the next; at both ticks it is far away."""
    ball = Mover("ball", Shape.cylinder(0.05, 1.0), np.array([[0.0, -3.0, 0.1, 0.0], [2.0, 3.0, 0.1, 0.0]]))
    world, truth = opened(movers=(ball,))
    before = after(world, truth, 0.5)
    assert before.contacts == ()
    assert before.clearance_m > 1.0
    during = after(world, truth, 1.0)
    assert during.contacts == ("ball",)
    assert during.clearance_m < 0.0
    afterwards = after(world, truth, 0.4)
    assert afterwards.contacts == ()
    assert afterwards.clearance_m > 1.0


def test_the_newest_truth_stays_when_there_is_nothing_newer():
    world, truth = opened()
    assert truth.latest() is None
    sample = after(world, truth, 0.1)
    assert truth.latest() is sample
