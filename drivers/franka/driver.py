"""The Franka arm as the loop sees it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from drivers.franka.orders import CAPACITY, MOST_KNOTS, packed
from drivers.franka.session import SAMPLE
from drivers.franka.settings import FrankaSettings
from drivers.interface.arm_motion import PANDA
from drivers.interface.commands import JointLimits, JointTrajectory
from drivers.interface.devices import DeviceSetup
from drivers.interface.errors import DeviceError
from drivers.interface.samples import JointSample, frozen_array
from drivers.interface.settings import Settings
from drivers.io.channels import MemorySpec, RingSpec
from drivers.io.device import WireDevice
from drivers.io.process import IoSpec

MEMORY = MemorySpec((RingSpec("joints", SAMPLE, 2048),), (), command_values=CAPACITY)
LONGEST_REQUEST_S = 6.0  # a recovery takes its time, and meanwhile the process waits


@dataclass(frozen=True, slots=True)
class ExchangeFigures:
    """How well the 1 kHz exchange keeps up, since `open`."""

    cycles: int  # states that were answered with a set point
    kept: float  # share of the motion's commands that the controller had in time
    resumed: int  # times that the set point went on from the controller's own
    states_lost: int  # that the controller sent and that never came, or came together


class FrankaArm(WireDevice):
    """A Franka arm behind the contract of an arm; its 1 kHz exchange is a process of its own.

    The operator's reset recovers it from a reflex.
    """

    Settings: ClassVar[type[Settings]] = FrankaSettings
    role: ClassVar[str] = "arm"
    what: ClassVar[str] = "Franka arm"
    model: ClassVar[str] = "models/panda.urdf"  # in configs, for the log

    def __init__(self, settings: FrankaSettings, setup: DeviceSetup) -> None:
        """Remember; nothing is touched."""
        spec = IoSpec(
            setup.name,
            "drivers.franka.session:FrankaSession",
            settings,
            MEMORY,
            open_s=settings.open_timeout_s,
            place=f"the arm at {settings.host}",
            silent_s=LONGEST_REQUEST_S,
        )
        super().__init__(setup, spec, "joints", settings.decimation * 1_000_000)

    @property
    def limits(self) -> JointLimits:
        """What it may be asked."""
        return PANDA

    def command(self, trajectory: JointTrajectory, expires_ns: int) -> None:
        """Follow the trajectory until `expires_ns`, then decelerate to rest.

        Raises:
            DeviceError: it cannot be followed, or the arm is not open.
        """
        if fault := PANDA.fault_of(trajectory):
            raise DeviceError(f"{self._setup.name}: the trajectory {fault}")
        if len(trajectory.time_from_start_s) > MOST_KNOTS:
            raise DeviceError(f"{self._setup.name}: the trajectory has more than {MOST_KNOTS} knots")
        offset_ns = self._clock.offset_ns()
        self._io.command(packed(trajectory, trajectory.start_ns - offset_ns), expires_ns - offset_ns)

    def drain(self) -> tuple[JointSample, ...]:
        """Return the joint samples that have arrived since the last call, oldest first."""
        if (drained := self._drained()) is None:
            return ()
        stamps, records = drained
        joints = (frozen_array(records[name].copy()) for name in ("position_rad", "velocity_rad_s", "torque_nm"))  # (n, 7)
        return tuple(map(JointSample, stamps, *joints))

    @property
    def exchange(self) -> ExchangeFigures:
        """How well the exchange keeps up."""
        kept, resumed, cycles, states_lost = self._io.health().figures[:4]
        return ExchangeFigures(_count(cycles), kept, _count(resumed), _count(states_lost))


def _count(figure: float) -> int:
    return 0 if math.isnan(figure) else round(figure)
