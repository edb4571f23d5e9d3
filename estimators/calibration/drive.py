"""A logged drive as arrays: wheel angles, yaw rates, and the poses that are known from elsewhere."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.samples import ImuSample, TruthSample, WheelSample
from estimators.belief import F64

LEAST_SAMPLES = 10
S = TypeVar("S", WheelSample, ImuSample)


@dataclass(frozen=True, slots=True)
class References:
    """Known poses, from the simulator, from motion capture or from marks on the floor, which may be few and far between."""

    time_s: F64  # (k,), increasing
    pose: F64  # (k, 3): x, y [m], yaw [rad] (not wrapped), in one frame


@dataclass(frozen=True, slots=True)
class Drive:
    """What was sensed; the three kinds of samples have times of their own on one clock."""

    wheel_s: F64  # (n,), increasing
    wheel_rad: F64  # (n, wheels)
    gyro_s: F64  # (g,), increasing; may be empty
    gyro_rad_s: F64  # (g,)
    references: References


def drive_of(
    wheels: Iterable[WheelSample], imu: Iterable[ImuSample], truth: Iterable[TruthSample], spacing_s: float = 0.5
) -> Drive:
    """Sort samples into a drive; the truth is taken every `spacing_s`, so that ways are long beside the encoders' counts.

    Raises:
        ConfigurationError: there are too few samples of wheels or truth.
    """
    wheels = in_order(wheels)
    require(len(wheels), "wheel samples")
    first_ns, last_ns = wheels[0].stamp.captured_ns, wheels[-1].stamp.captured_ns
    known = {t.stamp.captured_ns: t.map_from_base for t in truth if first_ns <= t.stamp.captured_ns <= last_ns}
    poses = _thinned(known, spacing_s)
    require(len(poses), "reference poses")
    times = np.array([time_ns for time_ns, _ in poses]) * 1e-9
    pose = np.array([(p.x, p.y, p.yaw) for _, p in poses])
    pose[:, 2] = np.unwrap(pose[:, 2])
    return drive_from(wheels, imu, References(times, pose))


def in_order(samples: Iterable[S]) -> list[S]:
    """Return the samples by capture time, each time once."""
    return [sample for _, sample in sorted({sample.stamp.captured_ns: sample for sample in samples}.items())]


def drive_from(wheels: list[WheelSample], imu: Iterable[ImuSample], references: References) -> Drive:
    """Return samples as arrays; `wheels` are in order."""
    imu = in_order(imu)
    return Drive(
        wheel_s=np.array([sample.stamp.captured_ns for sample in wheels]) * 1e-9,
        wheel_rad=np.array([sample.position_rad for sample in wheels]),
        gyro_s=np.array([sample.stamp.captured_ns for sample in imu]) * 1e-9,
        gyro_rad_s=np.array([sample.gyro_rad_s[2] for sample in imu]),
        references=references,
    )


def require(found: int, kind: str) -> None:
    """Raise ConfigurationError if too few of a kind of sample were found."""
    if found < LEAST_SAMPLES:
        raise ConfigurationError(f"calibration: {found} {kind} are too few; {LEAST_SAMPLES} are the least")


def ways(references: References) -> F64:
    """Return the way from each reference to the next in the frame of the first, shape (k - 1, 3): x, y [m], yaw [rad]."""
    return relative(references.pose[:-1], references.pose[1:])


def relative(start: F64, end: F64) -> F64:
    """Return poses seen from others, both of shape (k, 3) with yaws that are not wrapped."""
    dx, dy = end[:, 0] - start[:, 0], end[:, 1] - start[:, 1]
    c, s = np.cos(start[:, 2]), np.sin(start[:, 2])
    return np.stack((c * dx + s * dy, c * dy - s * dx, end[:, 2] - start[:, 2]), axis=1)


def _thinned(poses: dict[int, SE2], spacing_s: float) -> list[tuple[int, SE2]]:
    kept: list[tuple[int, SE2]] = []
    for time_ns in sorted(poses):
        if not kept or time_ns - kept[-1][0] >= spacing_s * 1e9:
            kept.append((time_ns, poses[time_ns]))
    return kept
