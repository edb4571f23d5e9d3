"""Puts a run together from its configuration: world, devices, clock, estimator, router, planner, shield, supervisor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from drivers.interface.clock import Clock, PacedClock, RealClock, SimClock
from drivers.interface.devices import DeviceSetup, WorldElsewhere
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.links import Links
from drivers.interface.mission import Goal, Mission
from estimators.estimator import Estimator, EstimatorSetup
from planners.planner import Planner, PlannerSetup
from planners.router import Router, RouterSetup
from planners.shield import Shield, ShieldSetup
from runtime.configuration import Configuration
from runtime.fault_board import FaultBoard
from runtime.mission import MissionTracker
from runtime.pacer import Pacer
from runtime.planning import PlannerRunner
from runtime.robot import Devices, Robot
from runtime.supervisor import Supervisor, SupervisorSetup
from sim_drivers.scene import Scene
from sim_drivers.world import MujocoWorld


@dataclass(frozen=True, slots=True)
class Assembly:
    """All parts of a run, not yet opened."""

    configuration: Configuration
    scene: Scene | None
    world: MujocoWorld | None
    clock: Clock
    lockstep: bool
    robot: Robot
    mission: MissionTracker
    time_limit_s: float
    estimator: Estimator
    router: Router
    planner: Planner
    runner: PlannerRunner
    shield: Shield
    supervisor: Supervisor
    board: FaultBoard

    def warm_up(self) -> None:
        """Compile every kernel, so that none is compiled inside a tick; a paced world has not moved on meanwhile."""
        self.estimator.warm_up()
        self.router.warm_up()
        self.planner.warm_up()
        self.shield.warm_up()
        if isinstance(self.clock, PacedClock):
            self.clock.begin()

    @property
    def world_late_s(self) -> float:
        """For how long a paced world has kept the loop waiting, or an emulated one has stood still; nothing else does."""
        truth = self.robot.devices.truth
        if isinstance(truth, WorldElsewhere):
            return truth.world_late_s
        return self.clock.world_late_ns * 1e-9 if isinstance(self.clock, PacedClock) else 0.0

    def pacer(self) -> Pacer:
        """Return a beat that starts now."""
        loop = self.configuration.loop
        return Pacer(
            self.clock,
            loop.period_ns,
            lockstep=self.lockstep,
            model_work_ns=round(loop.work_ms * 1e6),
            model_plan_ns=round(loop.plan_ms * 1e6),
        )


def assemble(configuration: Configuration, seed: int) -> Assembly:
    """Build every part.

    Raises:
        ConfigurationError: parts that do not fit together; the sentence says which.
    """
    scene = draw_scene(configuration, seed)
    here = configuration.emulation is None  # else the world lives in `trundle emulate`; the scene is drawn all the same
    world = MujocoWorld(scene, configuration.world.common) if here and scene and configuration.world else None
    devices, clock, lockstep = _devices(configuration, seed, world)
    mission = MissionTracker(_mission(configuration, scene))
    board = FaultBoard()
    period_s = configuration.loop.period_ns * 1e-9
    radius_m = configuration.robot.radius_m
    limits = devices.base.limits if devices.base else None
    kinematics = devices.base.kinematics if devices.base else None
    arm_limits = devices.arm.limits if devices.arm else None

    planning = configuration.planner
    estimator_setup = EstimatorSetup(period_s, radius_m, mission.mission.map_from_start, kinematics)
    plan_period_s = period_s * planning.common.period_ticks
    planner = planning.choice.build(PlannerSetup(plan_period_s, radius_m, limits, seed, arm_limits))
    shield = configuration.shield.build(ShieldSetup(period_s, radius_m, limits))
    budget_ns = configuration.loop.period_ns if planning.common.budget_ms is None else round(planning.common.budget_ms * 1e6)
    supervisor_setup = SupervisorSetup(period_s, limits, budget_ns, devices.operator is not None, arm_limits)
    return Assembly(
        configuration=configuration,
        scene=scene,
        world=world,
        clock=clock,
        lockstep=lockstep,
        robot=Robot(devices, mission),
        mission=mission,
        time_limit_s=_time_limit(configuration, scene),
        estimator=configuration.estimator.build(estimator_setup),
        router=configuration.router.build(RouterSetup(period_s, radius_m)),
        planner=planner,
        runner=PlannerRunner(
            planner,
            board,
            period_ticks=planning.common.period_ticks,
            latency_ticks=planning.common.latency_ticks,
            lockstep=lockstep,
        ),
        shield=shield,
        supervisor=Supervisor(configuration.supervisor, supervisor_setup, shield, board),
        board=board,
    )


def draw_scene(configuration: Configuration, seed: int) -> Scene | None:
    """Return the scene of this seed, with the configured start; None: the configuration has no world."""
    if configuration.world is None:
        return None
    scene: Scene = configuration.world.choice.build().draw(seed)
    start = configuration.mission.start
    return scene if start is None else replace(scene, map_from_start=SE2(start.x_m, start.y_m, start.yaw_rad))


def _devices(configuration: Configuration, seed: int, world: MujocoWorld | None) -> tuple[Devices, Clock, bool]:
    clocks: list[Clock] = []

    def now_ns() -> int:  # the clock needs the compiled world, and that needs the devices first
        return clocks[0].now_ns()

    built: dict[str, Any] = {}
    links = Links()
    for name, choice in configuration.devices:
        built[name] = choice.build(DeviceSetup(name, seed, now_ns, world, links))
    # A driver that lives in real time (a device, a keyboard) says so with a class attribute.
    live = [name for name, choice in configuration.devices if getattr(choice.cls, "real_time", False)]
    realtime = configuration.loop.realtime or bool(live) or configuration.emulation is not None
    if world is None:
        clocks.append(RealClock() if realtime else SimClock())
    else:
        world.compile()
        _check_period(configuration, world)
        clocks.append(PacedClock(world, world.step_ns) if realtime else SimClock(world))
    return Devices(**built), clocks[0], not realtime


def _check_period(configuration: Configuration, world: MujocoWorld) -> None:
    period_ns = configuration.loop.period_ns
    if period_ns % world.step_ns:
        raise ConfigurationError(
            f"{configuration.source}: loop.rate_hz {configuration.loop.rate_hz:g} makes a period of {period_ns / 1e6:g} ms, "
            f"which is not a whole multiple of the physics step of {world.step_ns / 1e6:g} ms"
        )


def _mission(configuration: Configuration, scene: Scene | None) -> Mission:
    section = configuration.mission
    start = scene.map_from_start if scene is not None else SE2()
    if section.start is not None:
        start = SE2(section.start.x_m, section.start.y_m, section.start.yaw_rad)
    if section.goals is None:
        return Mission(start, scene.goals if scene is not None else ())
    return Mission(start, tuple(Goal(g.x_m, g.y_m, g.yaw_rad, g.tolerance_m) for g in section.goals))


def _time_limit(configuration: Configuration, scene: Scene | None) -> float:
    if configuration.mission.time_limit_s is not None:
        return configuration.mission.time_limit_s
    if scene is not None:
        return scene.time_limit_s
    raise ConfigurationError(f"{configuration.source}: without a world the key 'mission.time_limit_s' is needed")
