"""`trundle emulate`: world and emulated devices in one process, free-running in real time, for another process to drive."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from drivers.interface.clock import Clock, RealClock
from drivers.interface.errors import ConfigurationError
from runtime.assembly import draw_scene
from runtime.configuration import Configuration
from runtime.interrupt import Phase, interruptible
from runtime.realtime import realtime
from sim_drivers.firmware.firmware import Firmware, FirmwareSetup
from sim_drivers.world import SECOND_NS, MujocoWorld

CATCH_UP_NS = 20_000_000  # of a hiccup, step by step, unless a firmware's `catch_up_ns` is less
LOWEST_FACTOR = 0.98  # of real time; below it a run is void
WATCH_NS = 2 * SECOND_NS  # the factor is judged over so long


@dataclass(frozen=True, slots=True)
class EmulationReport:
    """How an emulation went, over all its worlds."""

    worlds: int  # one, and one more for every run that ended
    emulated_s: float
    realtime_factor: float


class FreeRun:
    """A world in real time: the absolute grid of its steps on CLOCK_MONOTONIC, and the `Host` of its firmware.

    A world that falls behind catches up; what it cannot catch up it has stood still for (`late_ns`), and its present on the
    host's clock moves on by as much, so that both clocks keep one rate and never disagree.
    """

    def __init__(self, world: MujocoWorld, clock: Clock | None = None) -> None:
        """Take a world that is compiled later; its time zero is now until `start`."""
        self.catch_up_ns = CATCH_UP_NS  # a hiccup so long is caught up; of a longer one the rest is lost
        self._world = world
        self._clock = RealClock() if clock is None else clock
        self._anchor_ns = self._clock.now_ns()
        self.late_ns = 0
        self.ended = False

    @property
    def now_ns(self) -> int:
        """The world's present on the host's clock [ns]."""
        return self._anchor_ns + self._world.now_ns

    def hold(self) -> None:
        """Keep the scene's walkers where they start."""
        self._world.hold()

    def begin(self) -> None:
        """Let the scene's walkers set off."""
        self._world.begin()

    def end(self) -> None:
        """Have the world made anew."""
        self.ended = True

    def start(self) -> None:
        """Let the world's time pass from now on."""
        self._anchor_ns = self._clock.now_ns() - self._world.now_ns

    def step(self) -> None:
        """Sleep to the end of the next physics step, and simulate up to now."""
        step_ns = self._world.step_ns
        self._clock.sleep_until(self.now_ns + step_ns)
        behind_ns = self._clock.now_ns() - self.now_ns
        if behind_ns > self.catch_up_ns:
            self.late_ns += behind_ns - step_ns
            self._anchor_ns += behind_ns - step_ns
        self._world.step_to(self._clock.now_ns() - self._anchor_ns)


@dataclass(frozen=True, slots=True)
class Emulation:
    """A world with its firmware, not yet opened."""

    scenario: str
    world: MujocoWorld
    run: FreeRun
    firmware: tuple[tuple[str, str, Firmware], ...]  # (name in the robot, driver, firmware)

    @property
    def places(self) -> tuple[str, ...]:
        """Where each device listens, one line each."""
        return tuple(f"{name} ({driver}): {part.listens}" for name, driver, part in self.firmware if part.listens)


def build(configuration: Configuration, seed: int, clock: Clock | None = None) -> Emulation:
    """Build world and firmware.

    Raises:
        ConfigurationError: nothing is emulated, or parts do not fit together.
    """
    scene = draw_scene(configuration, seed)
    if scene is None or configuration.world is None:
        raise ConfigurationError(f"{configuration.source}: an emulation needs world.scenario")
    if not configuration.emulation:
        raise ConfigurationError(f"{configuration.source}: robot.emulation names no device; `trundle run` simulates this robot")
    world = MujocoWorld(scene, configuration.world.common)
    run = FreeRun(world, clock)
    drivers = dict(configuration.devices)
    firmware = tuple(
        (name, choice.name, choice.cls(drivers[name].settings, choice.settings, FirmwareSetup(name, seed, world, run)))
        for name, choice in configuration.emulation
    )
    run.catch_up_ns = min((getattr(part, "catch_up_ns", CATCH_UP_NS) for _, _, part in firmware), default=CATCH_UP_NS)
    world.compile()
    return Emulation(configuration.scenario, world, run, firmware)


@contextmanager
def opened(emulation: Emulation) -> Iterator[None]:
    """Within the block every wire is bound.

    Raises:
        DeviceError: a wire cannot be bound; what was bound is let go again.
    """
    try:
        for _, _, firmware in emulation.firmware:
            firmware.open()
        yield
    finally:
        for _, _, firmware in reversed(emulation.firmware):
            firmware.close()


def emulate(
    configuration: Configuration,
    seed: int,
    duration_s: float | None,
    ready: Callable[[Emulation], None],
    slow: Callable[[float], None],
) -> EmulationReport:
    """Emulate until interrupted, or for so long; a world whose run has ended is made anew.

    `ready` is called with every world whose wires are bound, `slow` with the real-time factor whenever it was below
    `LOWEST_FACTOR` for a while.

    Raises:
        ConfigurationError: nothing is emulated, or parts do not fit together.
        DeviceError: a wire cannot be bound.
        KeyboardInterrupt: before the first world stands.
    """
    worlds, emulated_ns, late_ns = 0, 0, 0
    left_ns = None if duration_s is None else round(duration_s * SECOND_NS)
    with interruptible() as interrupts:
        over = False
        while not over:
            emulation = build(configuration, seed)
            with opened(emulation), realtime(configuration.loop.system):
                worlds += 1
                interrupts.phase = Phase.DRIVING
                emulation.run.start()
                ready(emulation)
                over = _run(emulation, lambda: interrupts.asked, left_ns, slow)
            emulated_ns, late_ns = emulated_ns + emulation.world.now_ns, late_ns + emulation.run.late_ns
            left_ns = None if left_ns is None else left_ns - emulation.world.now_ns
    return EmulationReport(worlds, emulated_ns / SECOND_NS, _factor(emulated_ns, late_ns))


def _run(emulation: Emulation, asked: Callable[[], bool], left_ns: int | None, slow: Callable[[float], None]) -> bool:
    """Step until asked to stop, the time is up (True) or the run is over (False)."""
    run, world = emulation.run, emulation.world
    watched_ns, late_ns = world.now_ns, run.late_ns
    while not run.ended:
        if asked() or (left_ns is not None and world.now_ns >= left_ns):
            return True
        run.step()
        if world.now_ns - watched_ns >= WATCH_NS:
            factor = _factor(world.now_ns - watched_ns, run.late_ns - late_ns)
            if factor < LOWEST_FACTOR:
                slow(factor)
            watched_ns, late_ns = world.now_ns, run.late_ns
    return False


def _factor(emulated_ns: int, late_ns: int) -> float:
    return emulated_ns / (emulated_ns + late_ns) if emulated_ns else 1.0
