"""The contracts of the devices.  Real, simulated, emulated and recorded ones all stand behind these.

Life of a device: constructed (nothing touched yet) -> `open()` -> used -> `stop()` -> `close()`.  `stop` and `close` are
idempotent and work in every state, also before `open`, half-open and after an error.  Reading never blocks: `latest()`
gives a camera's newest frame once, `drain()` every other device's samples since the last call.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, runtime_checkable

from drivers.interface.commands import BaseLimits, BodyTwist, JointLimits, JointTrajectory
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.links import Links
from drivers.interface.samples import (
    BaseSample,
    ColourFrame,
    DepthFrame,
    ImuSample,
    JointSample,
    MarkerSample,
    OperatorEvent,
    RangeScan,
    TruthSample,
)
from drivers.interface.settings import Settings


class DeviceState(enum.Enum):
    """Where in its life a device stands."""

    CLOSED = "closed"
    OPEN = "open"
    RECONNECTING = "reconnecting"  # it was lost; its own reader tries to get it back
    FAULTED = "faulted"  # will not come back by itself
    ENDED = "ended"  # a recording that has been played to its end


@dataclass(frozen=True, slots=True)
class DeviceHealth:
    """What a device says of itself; counters run from `open`."""

    device: str
    state: DeviceState
    fault: str = ""  # one sentence on why it is faulted or reconnecting; empty when all is well
    received: int = 0
    dropped: int = 0  # failed its checksum, counter or range check, or lost on the way
    overflowed: int = 0  # came faster than the loop drained
    expired_commands: int = 0  # times the dead man at the last hop had to act
    expected_period_ns: int = 0  # 0: the device has no fixed rate
    battery_fraction: float | None = None
    battery_v: float | None = None
    bus_load: float | None = None  # share of the wire's bit rate that is in use


@dataclass(frozen=True, slots=True)
class DeviceIdentity:
    """Who answers at the other end of the wire; what a device does not tell is empty."""

    device: str
    model: str = ""
    firmware: str = ""
    protocol: str = ""
    serial: str = ""


@dataclass(frozen=True, slots=True)
class DeviceSetup:
    """What the runtime hands to every driver: its name in the robot, the seed, the time, and the world if there is one."""

    name: str
    seed: int
    now_ns: Callable[[], int]
    world: object | None = None
    links: Links = field(default_factory=Links)  # what the devices of one robot share


@runtime_checkable
class Device(Protocol):
    """What every device can do.  A driver class is built as `Driver(settings, setup)`.

    `role` is the name of the device it drives in a robot: camera, markers, imu, base, arm, scan, operator or truth.  A driver
    that lives in real time (hardware, an emulated device, a person) sets the class attribute `real_time = True`; the loop is
    then paced by the host's clock.  One that plays what was recorded, and therefore obeys nobody, sets `plays_recording = True`.
    """

    Settings: ClassVar[type[Settings]]
    role: ClassVar[str]

    def open(self) -> None:
        """Connect and start delivering.  Raises DeviceError with one sentence when it cannot."""
        ...

    def stop(self) -> None:
        """Bring whatever moves to rest."""
        ...

    def close(self) -> None:
        """Stop and let go of every resource."""
        ...

    def health(self) -> DeviceHealth:
        """Say how it stands; never blocks, never raises."""
        ...


@runtime_checkable
class Resettable(Protocol):
    """A device that latches faults of its own, which the operator's reset is to clear."""

    def clear_faults(self) -> None:
        """Ask the device to clear its faults and be ready to move; never blocks.

        Until it is known what came of it, `health` says RECONNECTING: a fault would latch again in the tick of the reset.
        """
        ...


@runtime_checkable
class Identified(Protocol):
    """A device that knows who answers at the other end of its wire."""

    def identity(self) -> DeviceIdentity:
        """Return what it has told of itself so far; never blocks, never raises."""
        ...


@runtime_checkable
class DepthCamera(Device, Protocol):
    """A depth camera."""

    def latest(self) -> DepthFrame | None:
        """Return the newest frame not yet returned, or None."""
        ...


@runtime_checkable
class MarkerCamera(Device, Protocol):
    """A camera that delivers the fiducial markers it sees."""

    def drain(self) -> tuple[MarkerSample, ...]:
        """Return what was seen in every image since the last call, oldest first."""
        ...


@runtime_checkable
class ColourCamera(Protocol):
    """A camera that also has pictures for the human eye; nothing in the loop reads them."""

    def latest_colour(self) -> ColourFrame | None:
        """Return the newest picture not yet returned, or None."""
        ...


@runtime_checkable
class Imu(Device, Protocol):
    """An inertial measurement unit; its samples are already turned into the base frame."""

    def drain(self) -> tuple[ImuSample, ...]:
        """Return every sample since the last call, oldest first."""
        ...


@runtime_checkable
class Mounted(Protocol):
    """An inertial unit that knows where on the robot it sits: turning, its accelerometer feels more than the base does."""

    @property
    def place_in_base_m(self) -> tuple[float, float]:
        """Where it sits, forward and to the left of the base's origin [m]."""
        ...


@runtime_checkable
class RangeScanner(Device, Protocol):
    """A planar range scanner."""

    def drain(self) -> tuple[RangeScan, ...]:
        """Return every scan since the last call, oldest first."""
        ...


@runtime_checkable
class MobileBase(Device, Protocol):
    """A wheeled base that follows body twists."""

    @property
    def limits(self) -> BaseLimits:
        """What it may be asked."""
        ...

    @property
    def kinematics(self) -> WheelKinematics | None:
        """How its wheels and its twist belong together; None: it reports poses only."""
        ...

    def command(self, twist: BodyTwist, expires_ns: int) -> None:
        """Follow the twist until `expires_ns`, then stand still.  Raises DeviceError for a non-finite twist."""
        ...

    def drain(self) -> tuple[BaseSample, ...]:
        """Return every sample since the last call, oldest first."""
        ...


@runtime_checkable
class Arm(Device, Protocol):
    """A serial arm that follows joint trajectories."""

    @property
    def limits(self) -> JointLimits:
        """What it may be asked."""
        ...

    def command(self, trajectory: JointTrajectory, expires_ns: int) -> None:
        """Follow the trajectory until `expires_ns`, then decelerate to rest.  Raises DeviceError for one beyond its limits."""
        ...

    def drain(self) -> tuple[JointSample, ...]:
        """Return every sample since the last call, oldest first."""
        ...


@runtime_checkable
class Operator(Device, Protocol):
    """The person in charge."""

    def drain(self) -> tuple[OperatorEvent, ...]:
        """Return every action since the last call, oldest first."""
        ...


@runtime_checkable
class TruthSource(Device, Protocol):
    """Something that knows how things really are."""

    def latest(self) -> TruthSample | None:
        """Return the truth now, or None before the first."""
        ...


@runtime_checkable
class WorldElsewhere(Protocol):
    """A device that knows how late a simulated world in another process is."""

    @property
    def world_late_s(self) -> float:
        """For how long that world has stood still, its machine being too slow, since `open` [s]."""
        ...
