"""What the odometry's Kalman filter knows at one capture time; immutable, so that any of them can be gone back to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivers.interface.geometry import SE2, wrap_angle
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64
from estimators.odometry.ekf_model import STATES, VX, VY, YAW, X, Y

_NEVER = -(2**63)


class EkfState(NamedTuple):
    """Mean and covariance, and what is needed of the newest samples to fold in the next one (a tuple: made for every sample)."""

    x: F64  # (11,), see `ekf_model`; never written to
    covariance: F64  # (11, 11)
    time_ns: int | None = None  # None: nothing came yet
    rate_rad_s: float = 0.0  # the newest yaw rate, bias not taken off
    force_m_s2: tuple[float, float] | None = None  # the newest specific force; None: it was not usable
    gyro_ns: int | None = None  # when the newest gyro sample was captured
    slopes: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of rate and specific force between the two newest [rad/s^2, m/s^3]
    wheels_ns: int | None = None  # when the wheel sample was captured that the way is counted from
    wheels_rad: F64 | None = None  # (wheels,), its angles
    still_ns: int | None = None  # since when the wheels have not turned further than their counting jitters
    still_rad: F64 | None = None  # (wheels,), their angles then
    rejected_ns: int | None = None  # since when the wheels contradict everything else
    local_from_odom: SE2 | None = None  # of the device that offers absolute poses
    slipping: bool = False  # the newest wheel sample contradicted the inertial unit
    dropped: int = 0  # samples that could not be used
    diverged: int = 0  # times that the filter had to begin anew

    @property
    def pose(self) -> SE2:
        """The pose odom_from_base."""
        return SE2(float(self.x[X]), float(self.x[Y]), wrap_angle(float(self.x[YAW])))

    @property
    def velocity_m_s(self) -> tuple[float, float]:
        """Forwards and to the left."""
        return float(self.x[VX]), float(self.x[VY])

    def packed(self) -> bytes:
        """Return everything, exactly."""
        local = self.local_from_odom
        times = [self.time_ns, self.gyro_ns, self.wheels_ns, self.still_ns, self.rejected_ns]
        return pack(
            x=self.x,
            covariance=self.covariance,
            times_ns=np.array([_NEVER if time is None else time for time in times], dtype=np.int64),
            rate_rad_s=self.rate_rad_s,
            force_m_s2=self.force_m_s2 or (),
            slopes=self.slopes,
            wheels_rad=np.zeros(0) if self.wheels_rad is None else self.wheels_rad,
            still_rad=np.zeros(0) if self.still_rad is None else self.still_rad,
            local_from_odom=() if local is None else (local.x, local.y, local.yaw),
            counts=(int(self.slipping), self.dropped, self.diverged),
        )

    @classmethod
    def unpacked(cls, packed: bytes) -> EkfState:
        """Return what `packed` was called on."""
        state = unpack(packed)
        time_ns, gyro_ns, wheels_ns, still_ns, rejected_ns = (None if t == _NEVER else t for t in state["times_ns"].tolist())
        force, local = state["force_m_s2"].tolist(), state["local_from_odom"].tolist()
        slipping, dropped, diverged = state["counts"].tolist()
        slopes = state["slopes"].tolist()
        return cls(
            x=state["x"].reshape(STATES),
            covariance=state["covariance"],
            time_ns=time_ns,
            rate_rad_s=float(state["rate_rad_s"]),
            force_m_s2=(force[0], force[1]) if force else None,
            gyro_ns=gyro_ns,
            slopes=(slopes[0], slopes[1], slopes[2]),
            wheels_ns=wheels_ns,
            wheels_rad=state["wheels_rad"] if wheels_ns is not None else None,
            still_ns=still_ns,
            still_rad=state["still_rad"] if still_ns is not None else None,
            rejected_ns=rejected_ns,
            local_from_odom=SE2(*local) if local else None,
            slipping=bool(slipping),
            dropped=dropped,
            diverged=diverged,
        )
