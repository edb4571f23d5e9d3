"""A recorded drive of a differential-drive base, played through the base contract as if it happened now.

The file's format is in `drivers/wheel_log.py`.
"""

from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.integrate import cumulative_trapezoid

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.kinematics import SkidSteer
from drivers.interface.samples import Stamp, WheelSample, frozen_array
from drivers.interface.settings import Settings
from drivers.wheel_log import WheelLog, read_wheel_log


class RecordedWheelSettings(Settings):
    """Which file, and what the base that drove it could do."""

    path: Path = Field(description="text file with odom2diff lines")
    wheel_radius_m: float = Field(0.02, gt=0.0, le=1.0, description="turns the file's rim velocities into wheel rates")
    max_vx_m_s: float = Field(0.5, gt=0.0, le=10.0, description="cap on speed")
    max_wz_rad_s: float = Field(2.0, gt=0.0, le=20.0, description="cap on turning")
    max_ax_m_s2: float = Field(1.0, gt=0.0, le=50.0, description="cap on acceleration, also when stopping")
    max_az_rad_s2: float = Field(4.0, gt=0.0, le=100.0, description="cap on angular acceleration, also when stopping")
    max_jx_m_s3: float = Field(10.0, gt=0.0, le=1000.0, description="cap on jerk")
    max_jz_rad_s3: float = Field(40.0, gt=0.0, le=1000.0, description="cap on angular jerk")


class RecordedWheelBase:
    """Plays a recorded drive of a differential-drive base.

    It delivers each recorded sample when its time has come, counted from the first at `open`.

    It takes commands as any base does, and does nothing with them: what was driven was driven.  Wheel angles are the rates
    integrated by the trapezoidal rule.  Nothing overflows, since the file keeps what was not yet drained.
    """

    Settings: ClassVar[type[Settings]] = RecordedWheelSettings
    role: ClassVar[str] = "base"
    plays_recording: ClassVar[bool] = True

    def __init__(self, settings: RecordedWheelSettings, setup: DeviceSetup) -> None:
        """Remember; the file is read when it is first needed."""
        self._settings = settings
        self._setup = setup
        self._open_ns: int | None = None
        self._next = 0

    @cached_property
    def _log(self) -> WheelLog:
        return read_wheel_log(self._settings.path)

    @cached_property
    def _due_ns(self) -> NDArray[np.int64]:
        """When each sample falls due after `open`, shape (n,)."""
        return np.asarray(np.rint((self._log.time_s - self._log.time_s[0]) * 1e9), dtype=np.int64)

    @cached_property
    def _rate_rad_s(self) -> NDArray[np.float64]:
        return self._log.rim_m_s / self._settings.wheel_radius_m  # (n, 2)

    @cached_property
    def _angle_rad(self) -> NDArray[np.float64]:
        return cumulative_trapezoid(self._rate_rad_s, self._log.time_s, axis=0, initial=0)  # (n, 2)

    @property
    def limits(self) -> BaseLimits:
        """What it may be asked."""
        s = self._settings
        slowing = BodyTwist(s.max_ax_m_s2, 0.0, s.max_az_rad_s2)
        return BaseLimits(
            velocity=BodyTwist(s.max_vx_m_s, 0.0, s.max_wz_rad_s),
            acceleration=slowing,
            jerk=BodyTwist(s.max_jx_m_s3, 0.0, s.max_jz_rad_s3),
            stop_deceleration=slowing,
        )

    @property
    def kinematics(self) -> SkidSteer:
        """Two wheels, left and right, at the distance that the file tells; reads it."""
        return SkidSteer(self._settings.wheel_radius_m, self._log.track_m, wheel_count=2)

    def open(self) -> None:
        """Start the recording's time.

        Raises:
            ConfigurationError: the file is missing or malformed.
        """
        self._angle_rad  # noqa: B018  read and integrated now, not in a tick
        self._next = 0
        self._open_ns = self._setup.now_ns()

    def stop(self) -> None:
        """Do nothing: a recording does not move."""

    def close(self) -> None:
        """End the recording's time."""
        self._open_ns = None

    def command(self, twist: BodyTwist, expires_ns: int) -> None:
        """Check the twist and forget it: a recording cannot be driven.

        Raises:
            DeviceError: the twist is not finite.
        """
        if not twist.finite:
            raise DeviceError(f"{self._setup.name}: a base cannot follow the non-finite {twist}")

    def drain(self) -> tuple[WheelSample, ...]:
        """Return every sample that fell due since the last call, oldest first."""
        if self._open_ns is None:
            return ()
        now_ns = self._setup.now_ns()
        end = int(np.searchsorted(self._due_ns, now_ns - self._open_ns, side="right"))
        samples = tuple(self._sample(index, self._open_ns, now_ns) for index in range(self._next, end))
        self._next = max(self._next, end)
        return samples

    def health(self) -> DeviceHealth:
        """Say how it stands; the recording has ended one period after its last sample."""
        return DeviceHealth(self._setup.name, self._state(), received=self._next, expected_period_ns=self._period_ns)

    @property
    def _period_ns(self) -> int:
        return 0 if self._open_ns is None else int(np.median(np.diff(self._due_ns)))

    def _state(self) -> DeviceState:
        if self._open_ns is None:
            return DeviceState.CLOSED
        ended = self._setup.now_ns() - self._open_ns >= self._due_ns[-1] + self._period_ns
        return DeviceState.ENDED if ended else DeviceState.OPEN

    def _sample(self, index: int, open_ns: int, now_ns: int) -> WheelSample:
        return WheelSample(
            Stamp(open_ns + int(self._due_ns[index]), now_ns, index),
            frozen_array(self._angle_rad[index].copy()),
            frozen_array(self._rate_rad_s[index].copy()),
        )
