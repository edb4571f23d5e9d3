"""Puts a run together from its configuration: world, devices, clock, estimator, router, planner, shield, supervisor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from drivers.interface.clock import Clock, PacedClock, RealClock, SimClock
from drivers.interface.devices import DeviceSetup, WorldElsewhere
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.links import Links
from drivers.interface.mission import Goal, Mission
from runtime.budget import Budget, measured, modelled
from runtime.configuration import Configuration
from runtime.mission import MissionTracker
from runtime.pacer import Pacer
from runtime.parts import Parts, build_parts
from runtime.planning import Ready, as_it_stands, awaited
from runtime.robot import Devices, Robot
from sim_drivers.faulty import FaultyDevice
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
    parts: Parts

    def warm_up(self) -> None:
        """Compile every kernel, so that none is compiled inside a tick; a paced world has not moved on meanwhile."""
        self.parts.warm_up()
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
    _check_watchdogs(configuration)
    scene = draw_scene(configuration, seed)
    world = _world(configuration, scene)
    clocks: list[Clock] = []

    def now_ns() -> int:  # the clock needs the compiled world, and that needs the devices first
        return clocks[0].now_ns()

    devices = _devices(configuration, seed, world, now_ns)
    clock, lockstep = _clock(configuration, world)
    clocks.append(clock)
    mission = MissionTracker(_mission(configuration, scene))
    ready = awaited if lockstep else as_it_stands
    return Assembly(
        configuration=configuration,
        scene=scene,
        world=world,
        clock=clock,
        lockstep=lockstep,
        robot=Robot(devices, mission),
        mission=mission,
        time_limit_s=_time_limit(configuration, scene),
        parts=build_parts(
            configuration, seed, devices, mission.mission.map_from_start, ready, _budget(configuration, clock, lockstep)
        ),
    )


def assemble_recorded(configuration: Configuration, seed: int, ready: Ready, budget: Budget) -> Parts:
    """Build the parts that decide for a robot whose devices are only asked what they are: no world, no clock, nothing opened.

    Raises:
        ConfigurationError: parts that do not fit together; the sentence says which.
    """
    scene = draw_scene(configuration, seed)
    devices = _devices(configuration, seed, _world(configuration, scene), lambda: 0)
    return build_parts(configuration, seed, devices, _mission(configuration, scene).map_from_start, ready, budget)


def draw_scene(configuration: Configuration, seed: int) -> Scene | None:
    """Return the scene of this seed, with the configured start; None: the configuration has no world."""
    if configuration.world is None:
        return None
    scene: Scene = configuration.world.choice.build().draw(seed)
    start = configuration.mission.start
    return scene if start is None else replace(scene, map_from_start=SE2(start.x_m, start.y_m, start.yaw_rad))


def _world(configuration: Configuration, scene: Scene | None) -> MujocoWorld | None:
    """Return the world, not yet compiled; None where there is none, or where it lives in `trundle emulate`."""
    if scene is None or configuration.world is None or configuration.emulation is not None:
        return None
    return MujocoWorld(scene, configuration.world.common)


def _devices(configuration: Configuration, seed: int, world: MujocoWorld | None, now_ns: Callable[[], int]) -> Devices:
    built: dict[str, Any] = {}
    links, script = Links(), configuration.robot.faults
    for name, choice in configuration.devices:
        setup = DeviceSetup(name, seed, now_ns, world, links)
        built[name] = choice.build(setup)
        if own := tuple(fault for fault in script if fault.device == name):
            built[name] = FaultyDevice(built[name], own, setup)
    if strange := [fault.device for fault in script if fault.device not in built]:
        raise ConfigurationError(
            f"{configuration.source}: robot.faults: the robot has no device '{strange[0]}'. Known: {', '.join(built)}"
        )
    return Devices(**built)


def _clock(configuration: Configuration, world: MujocoWorld | None) -> tuple[Clock, bool]:
    """Return the clock and whether it is in lockstep; the world, which has all its devices now, is compiled."""
    # A driver that lives in real time (a device, a keyboard) says so with a class attribute.
    live = [name for name, choice in configuration.devices if getattr(choice.cls, "real_time", False)]
    realtime = configuration.loop.realtime or bool(live) or configuration.emulation is not None
    if world is None:
        return (RealClock() if realtime else SimClock()), not realtime
    world.compile()
    _check_period(configuration, world)
    return (PacedClock(world, world.step_ns) if realtime else SimClock(world)), not realtime


def _budget(configuration: Configuration, clock: Clock, lockstep: bool) -> Budget:
    loop = configuration.loop
    if lockstep:
        return modelled(loop.period_ns, round(loop.work_ms * 1e6), round(loop.plan_ms * 1e6))
    return measured(clock.now_ns, loop.period_ns)


def _check_period(configuration: Configuration, world: MujocoWorld) -> None:
    period_ns = configuration.loop.period_ns
    if period_ns % world.step_ns:
        raise ConfigurationError(
            f"{configuration.source}: loop.rate_hz {configuration.loop.rate_hz:g} makes a period of {period_ns / 1e6:g} ms, "
            f"which is not a whole multiple of the physics step of {world.step_ns / 1e6:g} ms"
        )


def _check_watchdogs(configuration: Configuration) -> None:
    """Refuse a device whose own watchdog (a setting of its driver, `watchdog_s`) would act before a command has expired."""
    lifetime_s = configuration.supervisor.command_lifetime_s
    for name, choice in configuration.devices:
        watchdog_s = getattr(choice.settings, "watchdog_s", None)
        if watchdog_s is not None and watchdog_s <= lifetime_s:
            raise ConfigurationError(
                f"{configuration.source}: robot.{name}.watchdog_s of {watchdog_s:g} s is no longer than a command lives "
                f"(supervisor.command_lifetime_s, {lifetime_s:g} s): it would coast before it is told to brake"
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
