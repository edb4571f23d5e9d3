"""Dead reckoning: wheel travel, or the device's own pose where there are no wheels, added up to motion since the start.

Source of the noise model: Siegwart, Nourbakhsh, Scaramuzza, Introduction to Autonomous Mobile Robots, 2nd ed., section
5.2.4 (variances grow with the distance travelled and the angle turned).
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import BaseSample, ImuSample, PoseSample, WheelSample, frozen_array
from drivers.interface.sensed import Sensed
from drivers.interface.settings import Settings
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, EstimatorFault
from estimators.odometry.odometry import SECOND_NS, STAMP_SLACK_S, OdometryEstimate, PoseTrail, is_plausible, latest_valid_ns

GYRO_SAMPLES_MAX = 1024  # kept while no wheel sample comes that could use them


class DeadReckoningSettings(Settings):
    """What is believed of wheels and gyro."""

    use_gyro: bool = Field(default=False, description="take the yaw rate from the gyro where it has samples, not from the wheels")
    position_variance_m2_per_m: float = Field(default=4e-4, ge=0.0, le=1.0, description="growth per metre travelled, each axis")
    yaw_variance_rad2_per_m: float = Field(default=1e-4, ge=0.0, le=1.0, description="growth per metre travelled")
    yaw_variance_rad2_per_rad: float = Field(default=4e-4, ge=0.0, le=1.0, description="growth per radian turned")
    speed_max_m_s: float = Field(default=5.0, gt=0.0, le=50.0, description="faster motion is an invalid sample")
    turn_rate_max_rad_s: float = Field(default=10.0, gt=0.0, le=100.0, description="faster turning is an invalid sample")
    extrapolation_max_s: float = Field(default=0.2, ge=0.0, le=5.0, description="how long the last twist is believed")
    trail_s: float = Field(default=1.0, gt=0.0, le=60.0, description="how far back poses are kept for late frames")


class DeadReckoning:
    """Odometry from `WheelSample`s; from `PoseSample`s as long as no wheel sample has come."""

    def __init__(self, settings: DeadReckoningSettings, kinematics: WheelKinematics | None) -> None:
        """Begin at the identity; without kinematics wheel samples are invalid."""
        self._settings = settings
        self._kinematics = kinematics
        self._trail = PoseTrail(settings.trail_s, settings.extrapolation_max_s)
        self._covariance = np.zeros((3, 3))
        self._wheels_rad: F64 | None = None  # (wheels,), at the newest sample
        self._device_pose: SE2 | None = None  # local_from_base, at the newest sample
        self._gyro: list[tuple[int, float]] = []  # capture time [ns] and yaw rate [rad/s], not yet used

    def warm_up(self) -> None:
        """Do nothing: there is no kernel."""

    def update(self, sensed: Sensed) -> OdometryEstimate:
        """Fold in every sample at its own capture time, then carry the last twist on to the tick."""
        latest_ns = latest_valid_ns(sensed)
        imu_valid = [self._take_gyro(sample, latest_ns) for sample in sensed.imu]
        base_valid = [self._fold(sample, latest_ns) for sample in self._leading(sensed.base)]
        faults = () if all(imu_valid + base_valid) else (EstimatorFault.INVALID_INPUT,)
        pose, covariance = self._trail.at(sensed.tick.start_ns), frozen_array(self._covariance.copy())
        return OdometryEstimate(pose, self._trail.twist, covariance, self._trail.newest_ns, faults)

    def pose_at(self, time_ns: int) -> SE2:
        """Return odom_from_base at a time of the recent past."""
        return self._trail.at(time_ns)

    def _leading(self, samples: tuple[BaseSample, ...]) -> tuple[BaseSample, ...]:
        """Return the wheel samples, or the poses of a device without; a pose beside wheels is for fusion, not for reckoning."""
        wheels = tuple(sample for sample in samples if isinstance(sample, WheelSample))
        return wheels if wheels or self._wheels_rad is not None else samples

    def _fold(self, sample: BaseSample, latest_ns: int) -> bool:
        """Take in one sample; False: it was dropped."""
        captured_ns, newest_ns = sample.stamp.captured_ns, self._trail.newest_ns
        if captured_ns > latest_ns or (newest_ns is not None and captured_ns <= newest_ns):
            return False
        return self._fold_wheels(sample) if isinstance(sample, WheelSample) else self._fold_pose(sample)

    def _take_gyro(self, sample: ImuSample, latest_ns: int) -> bool:
        rate, captured_ns = sample.gyro_rad_s[2], sample.stamp.captured_ns
        in_order = captured_ns <= latest_ns and (not self._gyro or captured_ns > self._gyro[-1][0])
        if not in_order or not abs(rate) <= self._settings.turn_rate_max_rad_s:
            return False
        if self._settings.use_gyro:
            self._gyro.append((captured_ns, rate))
            del self._gyro[:-GYRO_SAMPLES_MAX]
        return True

    def _gyro_rate(self, until_ns: int) -> float | None:
        """Return the mean yaw rate since the last sample, and let go of what it was made of; None without gyro samples."""
        rates = [rate for captured_ns, rate in self._gyro if captured_ns <= until_ns]
        del self._gyro[: len(rates)]
        return math.fsum(rates) / len(rates) if rates else None

    def _fold_wheels(self, sample: WheelSample) -> bool:
        kinematics, position, rates = self._kinematics, sample.position_rad, sample.velocity_rad_s
        if kinematics is None or position.shape != (kinematics.wheel_count,) or position.shape != rates.shape:
            return False
        if not (np.isfinite(position).all() and np.isfinite(rates).all()):
            return False
        captured_ns, before = sample.stamp.captured_ns, self._wheels_rad
        self._wheels_rad, self._device_pose = position.copy(), None
        gyro = self._gyro_rate(captured_ns)
        newest_ns = self._trail.newest_ns
        if before is None or newest_ns is None:
            return self._anchor(captured_ns)
        elapsed_s = (captured_ns - newest_ns) / SECOND_NS
        mean, now = kinematics.twist((position - before) / elapsed_s), kinematics.twist(rates)
        turn = mean.wz if gyro is None else gyro
        motion = SE2().integrate(mean.vx, mean.vy, turn, elapsed_s)
        twist = BodyTwist(now.vx, now.vy, now.wz if gyro is None else gyro)
        return self._move(motion, turn * elapsed_s, twist, captured_ns)

    def _fold_pose(self, sample: PoseSample) -> bool:
        pose, before, captured_ns = sample.local_from_base, self._device_pose, sample.stamp.captured_ns
        if not all(math.isfinite(value) for value in (pose.x, pose.y, pose.yaw)):
            return False
        newest_ns, self._device_pose = self._trail.newest_ns, pose
        if before is None or newest_ns is None:
            return self._anchor(captured_ns)
        motion, elapsed_s = before.inverse() @ pose, (captured_ns - newest_ns) / SECOND_NS
        twist = sample.twist or BodyTwist(motion.x / elapsed_s, motion.y / elapsed_s, motion.yaw / elapsed_s)
        return self._move(motion, motion.yaw, twist, captured_ns)

    def _anchor(self, captured_ns: int) -> bool:
        """Take a first sample as the reference that the next one is measured from."""
        self._trail.append(captured_ns, self._trail.pose, self._trail.twist)
        return True

    def _move(self, motion: SE2, turn_rad: float, twist: BodyTwist, captured_ns: int) -> bool:
        """Append a motion; one that no base can make (a counter that was reset) is left out, and counting goes on from there."""
        settings, newest_ns = self._settings, self._trail.newest_ns
        elapsed_s = (captured_ns - (newest_ns or 0)) / SECOND_NS
        limits = settings.speed_max_m_s, settings.turn_rate_max_rad_s
        reported = SE2(twist.vx, twist.vy, twist.wz)
        turned = SE2(motion.x, motion.y, turn_rad)
        if not (is_plausible(turned, elapsed_s + STAMP_SLACK_S, *limits) and is_plausible(reported, 1.0, *limits)):
            self._trail.append(captured_ns, self._trail.pose, BodyTwist())
            return False
        self._grow(motion, abs(turn_rad))
        self._trail.append(captured_ns, self._trail.pose @ motion, twist)
        return True

    def _grow(self, motion: SE2, turned_rad: float) -> None:
        """Propagate the covariance through a motion in the base frame and add what the motion itself is uncertain by."""
        settings, travelled_m = self._settings, motion.distance(SE2())
        c, s = math.cos(self._trail.pose.yaw), math.sin(self._trail.pose.yaw)
        carried = np.eye(3)
        carried[0, 2], carried[1, 2] = -s * motion.x - c * motion.y, c * motion.x - s * motion.y
        position = settings.position_variance_m2_per_m * travelled_m
        yaw = settings.yaw_variance_rad2_per_m * travelled_m + settings.yaw_variance_rad2_per_rad * turned_rad
        self._covariance = carried @ self._covariance @ carried.T + np.diag((position, position, yaw))

    def snapshot(self) -> bytes:
        """Return the whole state."""
        pose = self._device_pose
        return pack(
            trail=np.frombuffer(self._trail.snapshot(), dtype=np.uint8),
            covariance=self._covariance,
            wheels_rad=np.zeros(0) if self._wheels_rad is None else self._wheels_rad,
            device_pose=() if pose is None else (pose.x, pose.y, pose.yaw),
            gyro_ns=np.array([captured_ns for captured_ns, _ in self._gyro], dtype=np.int64),
            gyro_rad_s=np.array([rate for _, rate in self._gyro]),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._trail.restore(state["trail"].tobytes())
        self._covariance = state["covariance"]
        self._wheels_rad = state["wheels_rad"] if state["wheels_rad"].size else None
        self._device_pose = SE2(*state["device_pose"].tolist()) if state["device_pose"].size else None
        self._gyro = list(zip(state["gyro_ns"].tolist(), state["gyro_rad_s"].tolist(), strict=True))
