"""What the inertial unit says of the time between its samples, and how wrong that can be, at whatever rate they come.

Between two samples rate and specific force are taken to change linearly.  Three things make that wrong, and each is process
noise that grows with the interval T; none of it depends on which unit it is:

- white noise of the unit, as a density;
- what a sample differs from what the two before it led to expect, d: a base that begins to brake, or a vibration that is faster
  than the samples.  Where the change set in somewhere between the samples (uniformly), the integral is wrong by d T / sqrt(12);
  white vibration of deviation s has d^2 = 6 s^2 and adds s^2 T^2, which is d^2 T^2 / 6: the larger of the two is taken;
- what no sample shows, as it came and went in between: with a jerk of at most J the velocity is wrong by at most J T^2 / 4, with
  an angular jerk of at most B the heading by at most B T^3 / 12 (the remainder of the trapezoidal rule), uniformly within that.

After the newest sample rate and force are held, and go on to change by as much as between the two newest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from drivers.interface.samples import ImuSample
from estimators.odometry.ekf_model import GYRO_BIAS, Drive
from estimators.odometry.ekf_settings import EkfSettings
from estimators.odometry.ekf_state import EkfState
from estimators.odometry.odometry import SECOND_NS
from estimators.odometry.odometry_limits import MotionLimits

SPIN_OVER_S = 1e-3  # stamps that a busy host has pressed closer together than this tell no rate of change


class Reading(NamedTuple):
    """A sample of the inertial unit, as the base feels it at its origin; biases not taken off."""

    captured_ns: int
    rate_rad_s: float
    force_m_s2: tuple[float, float]


class InertialModel:
    """Turns samples of an inertial unit into what drives the filter over a time."""

    def __init__(self, settings: EkfSettings, limits: MotionLimits) -> None:
        """Take noises and bounds, and where the unit sits."""
        self._settings, self._limits = settings, limits
        self._gap_ns = settings.gap_max_s * SECOND_NS
        s = settings
        self._rate_var, self._force_var = s.gyro_noise_rad_s_sqrt_hz**2, s.accel_noise_m_s2_sqrt_hz**2
        self._unseen_rate_var, self._unseen_force_var = s.turn_jerk_max_rad_s3**2 / 432.0, s.jerk_max_m_s3**2 / 48.0

    def reading(self, state: EkfState, sample: ImuSample) -> Reading | None:
        """Return a sample that comes after a state; None where it cannot be true."""
        s, (fx, fy, fz) = self._settings, sample.accel_m_s2
        rate = sample.gyro_rad_s[2] * self._limits.gyro_scale
        force = math.sqrt(fx * fx + fy * fy + fz * fz)
        if not abs(rate) <= self._limits.turn_rate_max_rad_s or not s.accel_min_m_s2 <= force <= s.accel_max_m_s2:
            return None
        captured_ns = sample.stamp.captured_ns
        at_base = self._at_base(state, fx, fy, rate, captured_ns) if self.recent(state, captured_ns) else (fx, fy)
        return Reading(captured_ns, rate, at_base)

    def recent(self, state: EkfState, time_ns: int) -> bool:
        """Tell whether the newest sample is not too old to say anything of a time."""
        return state.gyro_ns is not None and time_ns - state.gyro_ns <= self._gap_ns

    def between(self, state: EkfState, ahead: Reading, end_ns: int) -> Drive:
        """Return what drives a state on to a time no later than the next reading, on the line between the last and the next."""
        last_ns, time_ns, force = state.gyro_ns, state.time_ns, state.force_m_s2
        if last_ns is None or time_ns is None or force is None or not self.recent(state, ahead.captured_ns):
            return ahead.rate_rad_s, 0.0, 0.0, False, *self._blind
        interval_s = (ahead.captured_ns - last_ns) / SECOND_NS
        share = (0.5 * (time_ns + end_ns) - last_ns) / max(ahead.captured_ns - last_ns, 1)
        rate, (rate_slope, x_slope, y_slope) = state.rate_rad_s, state.slopes
        turn = ahead.rate_rad_s - rate
        jump_rate = turn - rate_slope * interval_s
        (fx, fy), (next_x, next_y) = force, ahead.force_m_s2
        jump_x, jump_y = next_x - fx - x_slope * interval_s, next_y - fy - y_slope * interval_s
        noise = self._noise(interval_s, jump_rate, jump_x * jump_x + jump_y * jump_y)
        return rate + share * turn, fx + share * (next_x - fx), fy + share * (next_y - fy), True, *noise

    def held(self, state: EkfState, end_ns: int) -> Drive:
        """Return what drives a state on to a time that no reading has come after yet."""
        if state.gyro_ns is None or state.force_m_s2 is None or not self.recent(state, end_ns):
            return state.rate_rad_s, 0.0, 0.0, False, *self._blind
        age_s = (end_ns - state.gyro_ns) / SECOND_NS
        rate_slope, x_slope, y_slope = state.slopes
        rate_std, force_std = self._noise(age_s, rate_slope * age_s, (x_slope * x_slope + y_slope * y_slope) * age_s * age_s)
        return state.rate_rad_s, *state.force_m_s2, True, rate_std, force_std

    def taken(self, state: EkfState, reading: Reading) -> EkfState:
        """Return a state that remembers a reading as the newest, and how fast it came about."""
        slopes = (0.0, 0.0, 0.0)
        if state.gyro_ns is not None and state.force_m_s2 is not None and self.recent(state, reading.captured_ns):
            per_s = 1.0 / max((reading.captured_ns - state.gyro_ns) / SECOND_NS, SPIN_OVER_S)
            (fx, fy), (old_x, old_y) = reading.force_m_s2, state.force_m_s2
            slopes = (reading.rate_rad_s - state.rate_rad_s) * per_s, (fx - old_x) * per_s, (fy - old_y) * per_s
        return state._replace(
            rate_rad_s=reading.rate_rad_s, force_m_s2=reading.force_m_s2, gyro_ns=reading.captured_ns, slopes=slopes
        )

    @property
    def _blind(self) -> tuple[float, float]:
        return self._settings.blind_turn_rad_s_sqrt_hz, self._settings.blind_accel_m_s2_sqrt_hz

    def _noise(self, interval_s: float, jump_rate: float, jump_force2: float) -> tuple[float, float]:
        """Return the densities of rate and specific force over an interval; the force's jump is squared, and both axes' sum."""
        cubed = interval_s * interval_s * interval_s
        rate_var = (
            self._rate_var + jump_rate * jump_rate * interval_s / 6.0 + self._unseen_rate_var * cubed * interval_s * interval_s
        )
        force_var = self._force_var + 0.5 * jump_force2 * interval_s / 6.0 + self._unseen_force_var * cubed
        return math.sqrt(rate_var), math.sqrt(force_var)

    def _at_base(self, state: EkfState, fx: float, fy: float, rate: float, time_ns: int) -> tuple[float, float]:
        """Return the specific force at the base's origin: where the unit sits, turning pulls outwards and speeding up sideways.

        Source: the acceleration of a point of a rigid body, a + dw/dt x r + w x (w x r) (Siciliano et al., Robotics, appendix).
        """
        x_m, y_m = self._limits.imu_x_m, self._limits.imu_y_m
        if (x_m == 0.0 and y_m == 0.0) or state.gyro_ns is None or time_ns <= state.gyro_ns:
            return fx, fy
        spin = (rate - state.rate_rad_s) / max((time_ns - state.gyro_ns) / SECOND_NS, SPIN_OVER_S)
        turning = 0.5 * (rate + state.rate_rad_s) - float(state.x[GYRO_BIAS])
        return fx + turning * turning * x_m + spin * y_m, fy + turning * turning * y_m - spin * x_m
