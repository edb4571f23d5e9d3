"""The state machine of an autopilot: mode, arming, set-points and their time-out, failsafe.  No wire, no physics.

Sources: ArduPilot Rover 4.5 and later (`mode_guided.cpp`, `GCS_MAVLink_Rover.cpp`, `failsafe.cpp`, `AP_Arming`); PX4 user guide,
Offboard Mode and Differential Rovers; the behaviour of ArduPilot Rover 4.8 in simulation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sim_drivers.firmware.rover_settings import RoverAutopilotSettings

SECOND_NS = 1_000_000_000
ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
CRITICAL, WARNING, INFO = 2, 4, 6
OFFBOARD_STREAM_NS = 1_000_000_000  # PX4: for how long set-points must have come
OFFBOARD_GAP_NS = 500_000_000  # and how close together
IGNORE_POSITION, IGNORE_VELOCITY, IGNORE_ACCELERATION, IGNORE_YAW, IGNORE_YAW_RATE = 0x007, 0x038, 0x1C0, 0x400, 0x800
NED_FRAMES = {"ardupilot": (1, 7, 8, 9), "px4": (1, 8)}
BODY_FRAMES = (8, 9)
MANUAL, GUIDED, HOLD = 0, 15, 4  # ArduPilot
PX4_MANUAL, PX4_HOLD, PX4_OFFBOARD = 1 << 16, 4 << 16 | 3 << 24, 6 << 16


@dataclass(frozen=True, slots=True)
class SetPoint:
    """The fields of SET_POSITION_TARGET_LOCAL_NED that matter."""

    frame: int
    type_mask: int
    vx: float
    vy: float
    vz: float
    yaw_rate: float


@dataclass(slots=True)
class _Order:
    speed_m_s: float
    turn_rad_s: float | None  # clockwise; None: towards a bearing
    bearing_rad: float
    received_ns: int


class RoverState:
    """Disarmed until its checks pass and it is told; follows set-points in one mode only, and stops when they cease."""

    def __init__(self, settings: RoverAutopilotSettings, boot_ns: int) -> None:
        """Power up."""
        self._settings = settings
        self._boot_ns = boot_ns
        self._is_px4 = settings.kind == "px4"
        self.armed = False
        self.mode = PX4_MANUAL if self._is_px4 else MANUAL
        self.texts: list[tuple[int, str]] = []  # (severity, text) to be sent
        self._order: _Order | None = None
        self._stream_since_ns: int | None = None  # PX4: since when set-points come
        self._setpoint_ns = 0
        self._gcs_ns: int | None = None
        self._turns_on_spot = False
        self.timeouts = 0

    @property
    def timeout_s(self) -> float:
        """Of set-points."""
        return self._settings.setpoint_timeout_s or (0.5 if self._is_px4 else 3.0)

    @property
    def follows(self) -> bool:
        """Whether it is in the mode that follows set-points."""
        return self.mode == (PX4_OFFBOARD if self._is_px4 else GUIDED)

    def unready(self, now_ns: int) -> str:
        """Return why it cannot be armed, or nothing."""
        if self._settings.arming_refused:
            return self._settings.arming_refused
        waited = now_ns - self._boot_ns >= (self._settings.boot_s + self._settings.estimate_s) * SECOND_NS
        return "" if waited else "Need Position Estimate"

    def heard_station(self, now_ns: int) -> None:
        """Take in a heartbeat of the ground station."""
        self._gcs_ns = now_ns

    def set_mode(self, base: float, main: float, sub: float, now_ns: int) -> int:
        """Obey MAV_CMD_DO_SET_MODE; return the result."""
        if not int(base) & 1:
            return UNSUPPORTED
        if not self._is_px4:
            if int(main) not in (MANUAL, HOLD, GUIDED):
                return FAILED
            return self._enter(int(main))
        mode = int(main) << 16 | int(sub) << 24
        if mode == PX4_OFFBOARD and not self._stream_is_long_enough(now_ns):
            self.texts.append((CRITICAL, "Switching to Offboard is currently not available"))
            return 1  # temporarily rejected
        return self._enter(mode) if mode in (PX4_MANUAL, PX4_HOLD, PX4_OFFBOARD) else DENIED

    def arm(self, wanted: bool, now_ns: int) -> int:
        """Obey MAV_CMD_COMPONENT_ARM_DISARM; return the result."""
        if not wanted:
            self.disarm()
            return ACCEPTED
        why = self.unready(now_ns)
        if why:
            self.texts.append((CRITICAL, f"Preflight Fail: {why}" if self._is_px4 else f"Arm: {why}"))
            return FAILED if not self._is_px4 else 1
        self.armed = True
        return ACCEPTED

    def disarm(self) -> None:
        """Let go of the motors."""
        self.armed, self._order = False, None

    def leave(self) -> None:
        """Somebody with a transmitter takes over."""
        self._enter(PX4_MANUAL if self._is_px4 else MANUAL)

    def take(self, point: SetPoint, yaw_rad: float, now_ns: int) -> None:
        """Take in a set-point; `yaw_rad` is where it heads, clockwise from north."""
        if point.frame not in NED_FRAMES[self._settings.kind]:
            return
        if self._is_px4:
            self._take_px4(point, yaw_rad, now_ns)
        elif self.follows:
            self._take_ardupilot(point, yaw_rad, now_ns)

    def step(self, yaw_rad: float, now_ns: int) -> tuple[float, float]:
        """Return speed [m/s] and turn rate (clockwise) [rad/s] to drive at now."""
        self._watch_station(now_ns)
        order = self._order
        if not (self.armed and self.follows) or order is None:
            self._watch_stream(now_ns)
            return 0.0, 0.0
        if now_ns - order.received_ns > self.timeout_s * SECOND_NS:
            self._time_out()
            return 0.0, 0.0
        if order.turn_rad_s is not None:
            return order.speed_m_s, order.turn_rad_s
        return self._towards(order, yaw_rad)

    def _take_ardupilot(self, point: SetPoint, yaw_rad: float, now_ns: int) -> None:
        mask = point.type_mask
        if mask & IGNORE_ACCELERATION != IGNORE_ACCELERATION:
            self.texts.append((INFO, "Ignoring SET_POSITION_TARGET_LOCAL_NED; set ACC_IGNORE in mask"))
            return
        if mask & IGNORE_POSITION != IGNORE_POSITION:
            return  # way-points are not emulated
        speed_m_s, bearing_rad = 0.0, 0.0
        if not mask & IGNORE_VELOCITY:
            speed_m_s = min(math.hypot(point.vx, point.vy), self._settings.drive.max_vx_m_s)
            bearing_rad = math.atan2(point.vy, point.vx) + (yaw_rad if point.frame in BODY_FRAMES else 0.0)
        if not mask & IGNORE_YAW_RATE:  # the sign of vx says which way, and vy only adds to the speed
            self._order = _Order(math.copysign(speed_m_s, point.vx), point.yaw_rate, 0.0, now_ns)
        elif not mask & IGNORE_VELOCITY:
            self._order = _Order(speed_m_s, None, bearing_rad, now_ns)

    def _take_px4(self, point: SetPoint, yaw_rad: float, now_ns: int) -> None:
        if point.type_mask & IGNORE_VELOCITY or point.type_mask & IGNORE_POSITION != IGNORE_POSITION:
            return
        if self._stream_since_ns is None or now_ns - self._setpoint_ns > OFFBOARD_GAP_NS:
            self._stream_since_ns = now_ns
        self._setpoint_ns = now_ns
        if self.follows:  # the yaw rate counts for a mecanum rover only
            bearing_rad = math.atan2(point.vy, point.vx) + (yaw_rad if point.frame in BODY_FRAMES else 0.0)
            speed_m_s = min(math.hypot(point.vx, point.vy), self._settings.drive.max_vx_m_s)
            self._order = _Order(speed_m_s, None, bearing_rad, now_ns)

    def _towards(self, order: _Order, yaw_rad: float) -> tuple[float, float]:
        """Turn towards a bearing, on the spot while it is far off."""
        if order.speed_m_s == 0.0:
            return 0.0, 0.0
        error_rad = math.remainder(order.bearing_rad - yaw_rad, 2.0 * math.pi)
        limit = self._settings.turn_on_spot_rad
        self._turns_on_spot = abs(error_rad) > (0.5 * limit if self._turns_on_spot else limit)
        return 0.0 if self._turns_on_spot else order.speed_m_s, self._settings.heading_gain_per_s * error_rad

    def _time_out(self) -> None:
        self._order = None
        self.timeouts += 1
        if self._is_px4:
            self.texts.append((CRITICAL, "Failsafe activated: No offboard signal"))
            self._enter(PX4_HOLD)
        else:
            self.texts.append((WARNING, f"target not received last {self.timeout_s:.1f} secs, stopping"))

    def _watch_stream(self, now_ns: int) -> None:
        if self._is_px4 and self.follows and now_ns - self._setpoint_ns > self.timeout_s * SECOND_NS:
            if self.armed:
                self._time_out()
            else:
                self._enter(PX4_HOLD)

    def _watch_station(self, now_ns: int) -> None:
        s = self._settings
        if not s.gcs_failsafe or self._gcs_ns is None or now_ns - self._gcs_ns <= s.gcs_timeout_s * SECOND_NS:
            return
        self._gcs_ns = None
        self.texts.append((WARNING, "GCS Failsafe"))
        self._enter(PX4_HOLD if self._is_px4 else HOLD)

    def _stream_is_long_enough(self, now_ns: int) -> bool:
        since_ns = self._stream_since_ns
        fresh = now_ns - self._setpoint_ns <= OFFBOARD_GAP_NS
        return since_ns is not None and fresh and now_ns - since_ns >= OFFBOARD_STREAM_NS

    def _enter(self, mode: int) -> int:
        if mode != self.mode:
            self.mode, self._order, self._turns_on_spot = mode, None, False
        return ACCEPTED
