"""The control sequence and the trajectories sampled about it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d
from scipy.signal import savgol_coeffs

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.seeds import stream
from drivers.interface.stateful import pack, unpack
from planners.mppi.kernels import average, charge_change, limit, roll_out, sample_controls
from planners.mppi.settings import MppiSettings

F32 = NDArray[np.float32]

_WINDOW, _ORDER = 9, 2  # of the Savitzky-Golay filter
_PAST = _WINDOW // 2


class Optimizer:
    """Samples controls about the last sequence, shifted to now, and averages them by what they cost.

    Axes are vx, vy, wz.  A sequence holds velocities at multiples of `model_dt_s` from now on.
    """

    def __init__(self, settings: MppiSettings, limits: BaseLimits, period_s: float, seed: int) -> None:
        """Take the caps: the settings' inside the base's."""
        s, cap, acceleration = settings, limits.velocity, limits.acceleration
        self._settings, self._seed, self._period_s = settings, seed, period_s
        sideways = min(cap.vy, s.max_speed_m_s)
        reverse = min(cap.vx, s.max_reverse_m_s) if limits.reverse else 0.0
        turn = min(cap.wz, s.max_turn_rad_s)
        self.highest = np.array([min(cap.vx, s.max_speed_m_s), sideways, turn], np.float32)
        self.lowest = np.array([-reverse, -sideways, -turn], np.float32)
        self._acceleration = np.array([acceleration.vx, acceleration.vy if sideways else 0.0, acceleration.wz], np.float32)
        self._std = np.array([s.vx_std_m_s, s.vy_std_m_s if sideways else 0.0, s.wz_std_rad_s], np.float32)
        self._price = np.divide(s.gamma, self._std**2, out=np.zeros(3, np.float32), where=self._std > 0.0)
        self._smoothing = savgol_coeffs(_WINDOW, _ORDER).astype(np.float32)
        batch = (s.time_steps, s.batch_size)
        self.controls = np.zeros((3, *batch), np.float32)
        self.x, self.y, self.yaw = (np.zeros(batch, np.float32) for _ in range(3))
        self.costs = np.zeros(s.batch_size, np.float32)
        self._sent = np.zeros((3, 1 + int(np.ceil(_PAST * s.model_dt_s / period_s))), np.float32)  # newest last
        self._now = np.zeros(3, np.float32)
        self._draws = 0
        self._draw()
        self.reset()

    def warm_up(self) -> None:
        """Compile the kernels on the sequence as it is, and forget what came of it."""
        kept = self.snapshot()
        self.sample(np.zeros(3))
        self.average()
        self.trajectory(np.zeros(3))
        self.restore(kept)

    def reset(self) -> None:
        """Forget the sequence and what was sent: the robot stands."""
        self.sequence = np.zeros((3, self._settings.time_steps), np.float32)
        self._sent[:] = 0.0

    def draw(self) -> None:
        """Draw the noise anew."""
        self._draws += 1
        self._draw()

    def redraw(self) -> None:
        """Draw the noise anew where the settings want it for every decision."""
        if self._settings.regenerate_noises:
            self.draw()

    def start_from(self, measured: BodyTwist) -> None:
        """Take where the velocity will be: on its way from what is measured to what was sent last."""
        velocity = np.array([measured.vx, measured.vy, measured.wz], np.float32)
        reach = self._acceleration * np.float32(self._period_s)
        self._now = np.clip(self._sent[:, -1], velocity - reach, velocity + reach)

    def sample(self, pose: NDArray[np.float64]) -> None:
        """Sample controls, roll them out from a pose, shape (3,), and start their costs with what change costs."""
        s, origin = self._settings, pose.astype(np.float32)
        dt = np.float32(s.model_dt_s)
        sample_controls(self.sequence, self._noise, self._now, self._acceleration * dt, self.controls)
        roll_out(self.controls, origin, dt, self.x, self.y, self.yaw)
        self.costs[:] = 0.0
        charge_change(self.controls, self.sequence, self._price, self.costs)

    def average(self) -> float:
        """Make the sequence the mean of the controls, weighted by their costs; return the effective number of samples."""
        s = self._settings
        mean, effective = average(self.controls, self.costs, s.temperature)
        times = -s.model_dt_s * np.arange(_PAST, 0, -1)
        sent_at = self._period_s * np.arange(-self._sent.shape[1], 0)
        past = np.stack([np.interp(times, sent_at, sent) for sent in self._sent]).astype(np.float32)
        smooth = correlate1d(np.concatenate((past, mean), axis=1), self._smoothing, axis=1, mode="nearest")
        self.sequence = np.ascontiguousarray(smooth[:, _PAST:])
        limit(self.sequence, self._now, self._acceleration * np.float32(s.model_dt_s), self.lowest, self.highest)
        return float(effective)

    def trajectory(self, pose: NDArray[np.float64]) -> F32:
        """Return where the sequence leads from a pose, shape (3,): points, shape (steps, 2)."""
        s = self._settings
        x, y, yaw = (np.zeros((s.time_steps, 1), np.float32) for _ in range(3))
        roll_out(np.ascontiguousarray(self.sequence[:, :, None]), pose.astype(np.float32), np.float32(s.model_dt_s), x, y, yaw)
        return np.concatenate((x, y), axis=1)

    def send(self) -> BodyTwist:
        """Return the sequence's first velocity and shift the sequence by one period: the next decision starts from it."""
        s = self._settings
        command = self.sequence[:, 0]
        self._sent = np.concatenate((self._sent[:, 1:], command[:, None]), axis=1)
        at = np.arange(s.time_steps, dtype=np.float64)
        shifted = [np.interp(at + self._period_s / s.model_dt_s, at, axis) for axis in self.sequence]
        twist = BodyTwist(*command.astype(np.float64).tolist())
        self.sequence = np.array(shifted, np.float32)
        return twist

    def cheapest(self, count: int) -> F32:
        """Return the points of the cheapest trajectories, shape (count * steps, 2)."""
        count = min(count, len(self.costs))
        best = np.argpartition(self.costs, count - 1)[:count]
        return np.stack((self.x[:, best].T.ravel(), self.y[:, best].T.ravel()), axis=1)

    def snapshot(self) -> bytes:
        """Return the sequence, what was sent and which noise is drawn."""
        return pack(sequence=self.sequence, sent=self._sent, draws=self._draws)

    def restore(self, snapshot: bytes) -> None:
        """Take over a state, and draw its noise again."""
        state = unpack(snapshot)
        self.sequence, self._sent, self._draws = state["sequence"], state["sent"], int(state["draws"])
        self._draw()

    def _draw(self) -> None:
        axes = np.flatnonzero(self._std)
        shape = (len(axes), *self.controls.shape[1:])
        self._noise = np.zeros(self.controls.shape, np.float32)
        self._noise[axes] = stream(self._seed, "mppi", self._draws).standard_normal(shape, np.float32)
        self._noise *= self._std[:, None, None]
