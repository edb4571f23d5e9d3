"""The contract of emulated firmware: a part of the world with a wire."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

from drivers.interface.devices import DeviceSetup
from drivers.interface.settings import Settings
from sim_drivers.world import MujocoWorld, Part


class Host(Protocol):
    """What runs the world, as a firmware sees it."""

    @property
    def now_ns(self) -> int:
        """The world's present on the clock that the other process reads too [ns]; monotonic, also where the world was late."""
        ...

    @property
    def late_ns(self) -> int:
        """For how long the world has stood still because the machine was too slow, since it was made [ns]."""
        ...

    def hold(self) -> None:
        """Keep the scene's walkers where they start until `begin`; called by a constructor."""
        ...

    def begin(self) -> None:
        """A run has opened its devices: the scene's walkers set off."""
        ...

    def end(self) -> None:
        """The run is over: the world is made anew for the next one."""
        ...


@dataclass(frozen=True, slots=True)
class FirmwareSetup:
    """What every firmware is handed: the device's name in the robot, the seed, the world and who runs it."""

    name: str
    seed: int
    world: MujocoWorld
    host: Host

    def device(self, part: str = "") -> DeviceSetup:
        """Return what a simulated device inside the firmware is built with; it stamps with the world's time."""
        name = f"{self.name}.{part}" if part else self.name
        return DeviceSetup(name, self.seed, lambda: self.world.now_ns, self.world)


@runtime_checkable
class Firmware(Part, Protocol):
    """Stands in for what a real driver talks to.  Built as `Firmware(driver_settings, settings, setup)`.

    `open` raises DeviceError with one sentence when the wire cannot be bound.  `act` never blocks.  One whose client must answer
    each cycle sets the class attribute `catch_up_ns`, the longest hiccup of the host that may come as a burst of cycles.
    """

    Settings: ClassVar[type[Settings]]

    @property
    def listens(self) -> str:
        """Where the driver finds it, in a few words; empty: nowhere of its own."""
        ...

    def open(self) -> None:
        """Bind the wire."""
        ...

    def close(self) -> None:
        """Let go of the wire; idempotent, in every state."""
        ...


class LockstepHost:
    """A world that a test steps itself, together with the other end of the wire."""

    def __init__(self, world: MujocoWorld) -> None:
        """Take the world."""
        self._world = world
        self.late_ns = 0
        self.ended = False

    @property
    def now_ns(self) -> int:
        """The world's time [ns]."""
        return self._world.now_ns

    def hold(self) -> None:
        """Keep the walkers where they start."""
        self._world.hold()

    def begin(self) -> None:
        """Let the walkers set off."""
        self._world.begin()

    def end(self) -> None:
        """Remember that the run is over."""
        self.ended = True


class AlongsideSettings(Settings):
    """Nothing: what can be set, is set where the wire is."""


class Alongside:
    """A device on another one's wire: that one's firmware serves it as well."""

    Settings: ClassVar[type[Settings]] = AlongsideSettings
    max_step_s = 0.01
    period_ns = 1_000_000_000
    listens = ""

    def __init__(self, driver_settings: object, settings: AlongsideSettings, setup: FirmwareSetup) -> None:
        """Join the world."""
        setup.world.add(self)

    def open(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing."""

    def bind(self, world: MujocoWorld) -> None:
        """Look up nothing."""

    def act(self, world: MujocoWorld) -> None:
        """Do nothing."""
