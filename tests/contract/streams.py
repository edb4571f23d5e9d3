"""What a simulated robot senses, believes and routes on a short drive past a wall, a pillar and a walker."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist, Command
from drivers.interface.devices import DeviceSetup
from drivers.interface.geometry import SE2, SE3
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import frozen_array
from drivers.interface.sensed import Sensed, Tick
from estimators.belief import OCCUPIED, UNKNOWN, Belief
from estimators.estimator import EstimatorSetup
from estimators.standard import StandardEstimator, StandardSettings
from planners.router import Route, RouterSetup
from planners.routers.grid import GridRouter
from runtime.mission import MissionTracker
from runtime.registry import Part, load
from runtime.robot import Devices, Robot
from sim_drivers.scene import MarkerPlate, Mover, Scene, Shape, StaticObstacle
from sim_drivers.world import MujocoWorld, WorldSettings
from tests.contract.facts import arrays
from tests.planners.synthetic import Disc, belief_of

BASES = {"omni": "sim_omni", "differential": "sim_skid_steer"}
PERIOD_NS, TICKS = 50_000_000, 50
PERIOD_S = PERIOD_NS * 1e-9
RADIUS_M = 0.3
START = SE2(0.5, -0.2, 0.3)
MISSION = Mission(START, (Goal(3.0, 0.5), Goal(0.0, 0.0)))
SCENE = Scene(
    name="contract",
    map_from_start=START,
    goals=MISSION.goals,
    time_limit_s=60.0,
    static=(
        StaticObstacle("wall", Shape.box(6.0, 0.1, 1.0), SE2(1.0, 1.6)),
        StaticObstacle("pillar", Shape.cylinder(0.15, 1.0), SE2(2.2, -0.6)),
    ),
    movers=(Mover("walker", Shape.cylinder(0.25, 1.7), np.array([[0.0, 3.0, 1.0, 0.0], [9.0, 0.5, -1.5, 0.0]])),),
    markers=(MarkerPlate("walker", SE3.from_euler(-0.25, 0.0, -0.45, math.pi / 2, 0.0, -math.pi / 2), 0.15, 4),),
)


@dataclass(frozen=True)
class Stream:
    limits: BaseLimits
    kinematics: WheelKinematics
    sensed: tuple[Sensed, ...]

    @property
    def estimator_setup(self) -> EstimatorSetup:
        return EstimatorSetup(PERIOD_S, RADIUS_M, START, self.kinematics)


def build_world() -> MujocoWorld:
    return MujocoWorld(SCENE, WorldSettings())


def device_of(driver: str, world: MujocoWorld, name: str, seed: int = 5):
    cls = load(Part.DRIVER, driver)
    return cls(cls.Settings(), DeviceSetup(name, seed, lambda: world.now_ns, world))


@cache
def stream(base: str) -> Stream:
    """Drive an s-curve, sideways too where the base can."""
    world = build_world()
    kinds = {"camera": "sim_depth", "imu": "sim_imu", "scan": "sim_scan", "operator": "script", "truth": "sim_truth"}
    kinds["markers"] = "sim_markers"
    devices = Devices(**{name: device_of(driver, world, name) for name, driver in {"base": BASES[base], **kinds}.items()})
    world.compile()
    robot, limits = Robot(devices, MissionTracker(MISSION)), devices.base.limits
    robot.open()
    sensed = []
    for index in range(TICKS):
        now_ns = index * PERIOD_NS
        world.step_to(now_ns)
        sensed.append(robot.read(Tick(index, now_ns, PERIOD_NS)))
        sideways = 0.1 if limits.holonomic else 0.0
        robot.write(Command(BodyTwist(0.4, sideways, 0.8 * math.cos(0.1 * index)), None, now_ns + 2 * PERIOD_NS, now_ns))
    robot.close()
    return Stream(limits, devices.base.kinematics, tuple(sensed))


@cache
def beliefs(base: str) -> tuple[Belief, ...]:
    """What the standard estimator makes of it, and then situations in which a part's memory matters, or that none likes."""
    driven = stream(base)
    estimator = StandardEstimator(StandardSettings(), driven.estimator_setup)
    believed = [estimator.update(sensed) for sensed in driven.sensed]
    last = believed[-1]
    no_good = (_everywhere(last, UNKNOWN), _everywhere(last, OCCUPIED), replace(last, odom_from_base=SE2(100.0, -100.0, 3.0)))
    situations = [*_dilemma(), *_stuck(), *no_good, *believed[-5:]]
    return (*believed, *(replace(b, tick=TICKS + i, stamp_ns=(TICKS + i) * PERIOD_NS) for i, b in enumerate(situations)))


def _dilemma() -> list[Belief]:
    """A pillar on the straight line to the goal, first a little to one side of it, then to the other: which way round?"""
    one, other = (belief_of([Disc(1.45, y, 0.3)]) for y in (0.27, 0.21))
    return [_read_only(one)] * 4 + [_read_only(other)] * 4


def _stuck() -> list[Belief]:
    """Facing the goal, it knows nothing but the ground that it stands on, for longer than anybody should wait."""
    facing = SE2(0.0, 0.0, math.atan2(MISSION.goals[0].y_m, MISSION.goals[0].x_m))
    return [_read_only(belief_of([], facing, seen_m=0.15))] * 45


def _read_only(belief: Belief) -> Belief:
    for array in arrays(belief):
        frozen_array(array)
    return belief


@cache
def routes(base: str) -> tuple[Route, ...]:
    """The grid router's route at each belief, but none at every seventh of the drive."""
    router = GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    found = [router.route(belief, MISSION) for belief in beliefs(base)]
    nowhere = replace(found[0], path_in_odom=np.zeros((0, 2)), length_m=0.0, blocked=True)
    return tuple(nowhere if index % 7 == 6 and index < TICKS else route for index, route in enumerate(found))


def _everywhere(belief: Belief, label: int) -> Belief:
    shape, field = belief.grid.label.shape, belief.clearance
    known = frozen_array(np.full(shape, label != UNKNOWN))
    nothing = frozen_array(np.zeros(shape, dtype=np.float32))
    clearance = nothing if label == OCCUPIED else frozen_array(np.full(shape, 6.0, dtype=np.float32))
    return replace(
        belief,
        grid=replace(belief.grid, label=frozen_array(np.full(shape, label, dtype=np.uint8))),
        clearance=replace(field, clearance_m=clearance, rate_m_s=nothing, known=known, overlap=known),
    )
