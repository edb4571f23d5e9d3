"""What ArduPilot Rover and PX4 do differently.

Sources: ArduPilot, Rover Commands in Guided Mode, and its `GCS_MAVLink_Rover.cpp`, `mode_guided.cpp` (4.5 and later); PX4 user
guide, Offboard Mode (section MAVLink, Rover), and its `mavlink_receiver.cpp`; MAVLink common messages.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

MODE_FLAG_CUSTOM = 1
ROVER_TYPES = {10: "ground rover", 11: "surface boat"}
# Only velocity and yaw rate count: every other bit of POSITION_TARGET_TYPEMASK says ignore.
VELOCITY_AND_YAW_RATE = 0x5C7
VELOCITY = 0xDC7
CREEP_M_S = 0.05  # the least speed that gives a velocity a direction


@dataclass(frozen=True, slots=True)
class Target:
    """The fields of a set-point that count; forward-right-down."""

    vx_m_s: float
    vy_m_s: float
    yaw_rate_rad_s: float


@dataclass(frozen=True, slots=True)
class Autopilot:
    """One kind of autopilot."""

    name: str
    identifier: int  # MAV_AUTOPILOT
    mode: tuple[int, int]  # parameters 2 and 3 of MAV_CMD_DO_SET_MODE
    mode_name: str
    frame: int  # MAV_FRAME of a body-fixed set-point
    type_mask: int
    imu_message: str
    stream_first_s: float  # for how long set-points must have come before the mode is entered
    timeout: tuple[str, float]  # its own time-out for set-points: parameter, and what it is where there is none [s]
    reverses: bool  # whether a velocity can point backwards without the rover turning round

    def is_in_mode(self, custom_mode: int) -> bool:
        """Whether a heartbeat's custom mode is the one that follows our set-points."""
        if self is PX4:
            return (custom_mode >> 16 & 0xFF, custom_mode >> 24) == self.mode
        return custom_mode == self.mode[0]

    def target(self, vx_m_s: float, wz_rad_s: float, heading_gain_per_s: float) -> Target:
        """Return the set-point for a twist of ours (forward-left-up).

        ArduPilot takes speed and yaw rate.  A differential rover under PX4 ignores the yaw rate and turns towards the direction
        of its velocity with a rate of RO_YAW_P times the angle to it, so the direction that gives the rate is sent.
        """
        if self is not PX4:
            return Target(vx_m_s, 0.0, -wz_rad_s)
        if wz_rad_s == 0.0:
            return Target(vx_m_s, 0.0, 0.0)
        left_rad = min(max(wz_rad_s / heading_gain_per_s, -math.pi / 2), math.pi / 2)
        speed_m_s = max(vx_m_s, CREEP_M_S)
        return Target(speed_m_s * math.cos(left_rad), -speed_m_s * math.sin(left_rad), 0.0)


ARDUPILOT = Autopilot(
    name="ArduPilot", identifier=3, mode=(15, 0), mode_name="GUIDED", frame=9, type_mask=VELOCITY_AND_YAW_RATE,
    imu_message="RAW_IMU", stream_first_s=0.0, timeout=("GUID_TIMEOUT", 3.0), reverses=True,
)  # fmt: skip
PX4 = Autopilot(
    name="PX4", identifier=12, mode=(6, 0), mode_name="OFFBOARD", frame=8, type_mask=VELOCITY,
    imu_message="HIGHRES_IMU", stream_first_s=1.2, timeout=("COM_OF_LOSS_T", 1.0), reverses=False,
)  # fmt: skip
BY_NAME = {"ardupilot": ARDUPILOT, "px4": PX4}
BY_IDENTIFIER = {autopilot.identifier: autopilot for autopilot in BY_NAME.values()}
