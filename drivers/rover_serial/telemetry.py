"""Makes samples of an autopilot's messages: its north-east-down and forward-right-down axes become ours, its units SI."""

from __future__ import annotations

import math
from collections.abc import Callable

from drivers.io.session import Port
from drivers.rover_serial.messages import Message
from drivers.rover_serial.settings import RoverSettings
from drivers.rover_serial.timesync import TimeSync

MILLI_G, MILLI = 9.80665e-3, 1e-3
BELIEF, SLACK_M = 2.0, 0.05  # times the fastest that it can be asked for, and what noise may add
FASTEST_RAD_S, STRONGEST_M_S2 = 100.0, 400.0  # beyond is no measurement
STANDING_M_S = 0.02
ATTITUDE_NS = 200_000_000  # an older attitude is not joined with a position
RESTART_NS = 1_000_000_000  # a clock that goes back so far has begun anew
Pair = tuple[float, float]


class Series:
    """The stamps of one kind of sample: each later than the one before, and a gap where some were lost."""

    def __init__(self, first: int) -> None:
        """Count on from a number."""
        self._sequence = first - 1
        self._theirs_ns: int | None = None
        self._captured_ns = -1
        self.period_ns = 0  # as asked for

    def next(self, theirs_ns: int, captured_ns: int) -> int | None:
        """Return a sample's number, or None for one that is no later than the one before."""
        last_ns = self._theirs_ns
        if captured_ns <= self._captured_ns or (last_ns is not None and theirs_ns <= last_ns):
            return None
        gap = round((theirs_ns - last_ns) / self.period_ns) if last_ns is not None and self.period_ns else 1
        self._sequence += max(gap, 1)
        self._theirs_ns, self._captured_ns = theirs_ns, captured_ns
        return self._sequence


class Telemetry:
    """Samples for base and unit; silent until `live`."""

    def __init__(self, settings: RoverSettings, port: Port, clock: TimeSync) -> None:
        """Take the rings."""
        self._settings, self._health, self._clock = settings, port.health, clock
        self._rings = port.rings
        self.series = {name: Series(ring.written) for name, ring in port.rings.items()}
        self.live = False
        self.source = "wheels"  # or position: which of them is the odometry
        self.restarted = False  # the autopilot's clock has begun anew
        self.odometry_ns: int | None = None  # when some last came
        self.imu_ns: int | None = None
        self.speed_m_s = math.nan
        self._newest_ns = 0  # on the autopilot's clock
        self._last: tuple[int, Pair] | None = None  # wheel distances, and when
        self._offset_m = (0.0, 0.0)
        self._rpm: Pair | None = None
        self._yaw: tuple[int, float, float] | None = None  # when received, yaw, yaw rate; ours
        self._origin = (0.0, 0.0)  # where an estimate that has jumped goes on
        self._position: tuple[int, Pair] | None = None
        self._take: dict[str, Callable[[Message, int], bool]] = {
            "WHEEL_DISTANCE": self._wheels, "RPM": self._rpms, "ATTITUDE": self._attitude, "LOCAL_POSITION_NED": self._pose,
            "RAW_IMU": self._scaled_imu, "SCALED_IMU": self._scaled_imu, "HIGHRES_IMU": self._highres_imu,
        }  # fmt: skip

    def take(self, name: str, message: Message, now_ns: int) -> None:
        """Take in a message; what cannot be is dropped and counted."""
        handler = self._take.get(name)
        if handler is not None and not handler(message, now_ns):
            self._health.dropped += 1

    @property
    def standing(self) -> bool:
        """Whether it stands, as far as is known."""
        return self.speed_m_s < STANDING_M_S

    def _put(self, name: str, theirs_ns: int, now_ns: int, *values: tuple[float, ...]) -> bool:
        self._note_time(theirs_ns)
        if name not in self._rings or not self.live:
            return True
        captured_ns = self._clock.captured_ns(theirs_ns, now_ns, round(self._settings.latency_s * 1e9))
        sequence = self.series[name].next(theirs_ns, captured_ns)
        if sequence is not None:
            self._rings[name].put((captured_ns, now_ns, sequence, *values))
        return sequence is not None

    def _note_time(self, theirs_ns: int) -> None:
        self.restarted = self.restarted or theirs_ns < self._newest_ns - RESTART_NS
        self._newest_ns = max(self._newest_ns, theirs_ns)

    def _wheels(self, message: Message, now_ns: int) -> bool:
        s, theirs_ns = self._settings, message.time_usec * 1000
        if message.count <= max(s.wheel_order):
            return False
        left, right = (sign * message.distance[index] for sign, index in zip(s.wheel_signs, s.wheel_order, strict=True))
        if not (math.isfinite(left) and math.isfinite(right)):
            return False
        if self.source != "wheels":
            return True
        self.odometry_ns = now_ns
        here = (left + self._offset_m[0], right + self._offset_m[1])
        last, self._last = self._last, (theirs_ns, here)
        if last is None:  # distances count from where the base was opened
            self._offset_m, self._last = (-left, -right), (theirs_ns, (0.0, 0.0))
            return True
        elapsed_s = (theirs_ns - last[0]) * 1e-9
        gone = (here[0] - last[1][0], here[1] - last[1][1])
        if elapsed_s <= 0.0 or max(map(abs, gone)) > BELIEF * s.fastest_m_s * elapsed_s + SLACK_M:
            self._offset_m, self._last = (last[1][0] - left, last[1][1] - right), (theirs_ns, last[1])  # it counts anew
            return False
        rate = (gone[0] / elapsed_s, gone[1] / elapsed_s)
        if s.wheel_rates == "rpm" and self._rpm is not None:
            rate = self._rpm
        self.speed_m_s = max(map(abs, rate))
        return self._put("wheels", theirs_ns, now_ns, here, rate)

    def _rpms(self, message: Message, now_ns: int) -> bool:
        s = self._settings
        metres = 2.0 * math.pi * s.wheel_radius_m / (60.0 * s.gear_ratio)
        rates = (s.wheel_signs[0] * message.rpm1 * metres, s.wheel_signs[1] * message.rpm2 * metres)
        believed = all(abs(rate) <= BELIEF * s.fastest_m_s for rate in rates)
        self._rpm = rates if believed else self._rpm
        return believed

    def _attitude(self, message: Message, now_ns: int) -> bool:
        self._note_time(message.time_boot_ms * 1_000_000)
        yaw, rate = -message.yaw, -message.yawspeed  # clockwise from above is positive there
        if not (math.isfinite(yaw) and abs(rate) <= FASTEST_RAD_S):
            return False
        self._yaw = (now_ns, yaw, rate)
        return True

    def _pose(self, message: Message, now_ns: int) -> bool:
        theirs_ns = message.time_boot_ms * 1_000_000
        north, west = message.x, -message.y
        vn, vw = message.vx, -message.vy
        if not all(map(math.isfinite, (north, west, vn, vw))):
            return False
        if self.source != "position":
            return True
        self.odometry_ns = now_ns
        if self._yaw is None or now_ns - self._yaw[0] > ATTITUDE_NS:
            return True  # half of it is missing
        here = self._continuous(theirs_ns, north, west)
        _, yaw, rate = self._yaw
        c, s = math.cos(yaw), math.sin(yaw)
        twist = (c * vn + s * vw, -s * vn + c * vw, rate)
        self.speed_m_s = math.hypot(vn, vw) + abs(rate) * 0.5 * self._settings.effective_track_m
        return self._put("pose", theirs_ns, now_ns, (*here, yaw), twist)

    def _continuous(self, theirs_ns: int, north: float, west: float) -> Pair:
        """Return the position without the jumps that an estimator makes when it corrects itself."""
        here = (north + self._origin[0], west + self._origin[1])
        last = self._position
        if last is not None:
            reach_m = BELIEF * self._settings.max_vx_m_s * max(theirs_ns - last[0], 0) * 1e-9 + SLACK_M
            if math.dist(here, last[1]) > reach_m:
                self._origin = (last[1][0] - north, last[1][1] - west)
                here = last[1]
        self._position = (theirs_ns, here)
        return here

    def _scaled_imu(self, message: Message, now_ns: int) -> bool:
        """RAW_IMU and SCALED_IMU: milli-g and millirad/s (ArduPilot scales both)."""
        gyro = (message.xgyro * MILLI, message.ygyro * MILLI, message.zgyro * MILLI)
        accel = (message.xacc * MILLI_G, message.yacc * MILLI_G, message.zacc * MILLI_G)
        raw = message.get_type() == "RAW_IMU"
        return self._imu(message.time_usec * 1000 if raw else message.time_boot_ms * 1_000_000, now_ns, gyro, accel)

    def _highres_imu(self, message: Message, now_ns: int) -> bool:
        gyro = (message.xgyro, message.ygyro, message.zgyro)
        return self._imu(message.time_usec * 1000, now_ns, gyro, (message.xacc, message.yacc, message.zacc))

    def _imu(self, theirs_ns: int, now_ns: int, gyro: tuple[float, ...], accel: tuple[float, ...]) -> bool:
        if not (all(abs(w) <= FASTEST_RAD_S for w in gyro) and all(abs(a) <= STRONGEST_M_S2 for a in accel)):
            return False
        self.imu_ns = now_ns
        return self._put("imu", theirs_ns, now_ns, (gyro[0], -gyro[1], -gyro[2]), (accel[0], -accel[1], -accel[2]))
