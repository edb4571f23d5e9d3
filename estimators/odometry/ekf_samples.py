"""Samples of the odometry's window, packed for a snapshot and unpacked again, bit for bit."""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.samples import ImuSample, PoseSample, Stamp, WheelSample, frozen_array
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64
from estimators.odometry.ekf_filter import Sample

_IMU, _WHEELS, _POSE = range(3)


def pack_samples(samples: list[Sample]) -> bytes:
    """Return the samples as bytes: kinds and stamps beside one long row of numbers."""
    rows = [_row(sample) for sample in samples]
    stamps = [(sample.stamp.captured_ns, sample.stamp.received_ns, sample.stamp.sequence) for sample in samples]
    return pack(
        kinds=np.array([kind for kind, _ in rows], dtype=np.int64),
        lengths=np.array([len(values) for _, values in rows], dtype=np.int64),
        values=np.array([value for _, values in rows for value in values], dtype=np.float64),
        stamps=np.array(stamps, dtype=np.int64).reshape(-1, 3),
    )


def unpack_samples(packed: bytes) -> list[Sample]:
    """Return what `pack_samples` was given."""
    content = unpack(packed)
    ends = np.cumsum(content["lengths"])
    rows = np.split(content["values"], ends[:-1]) if len(ends) else []
    stamps = [Stamp(*times) for times in content["stamps"].tolist()]
    return [_sample(kind, stamp, row) for kind, stamp, row in zip(content["kinds"].tolist(), stamps, rows, strict=True)]


def _row(sample: Sample) -> tuple[int, tuple[float, ...]]:
    match sample:
        case ImuSample():
            return _IMU, (*sample.gyro_rad_s, *sample.accel_m_s2)
        case WheelSample():
            return _WHEELS, (*sample.position_rad.tolist(), *sample.velocity_rad_s.tolist())
        case PoseSample():
            pose, twist = sample.local_from_base, sample.twist
            speeds = (math.nan,) * 3 if twist is None else (twist.vx, twist.vy, twist.wz)
            return _POSE, (pose.x, pose.y, pose.yaw, *speeds, *sample.covariance.ravel().tolist())


def _sample(kind: int, stamp: Stamp, row: F64) -> Sample:
    values = row.tolist()
    if kind == _IMU:
        return ImuSample(stamp, (values[0], values[1], values[2]), (values[3], values[4], values[5]))
    if kind == _WHEELS:
        position, velocity = np.split(row, 2)
        return WheelSample(stamp, frozen_array(position.copy()), frozen_array(velocity.copy()))
    twist = None if math.isnan(values[3]) else BodyTwist(values[3], values[4], values[5])
    return PoseSample(stamp, SE2(values[0], values[1], values[2]), twist, frozen_array(row[6:].reshape(3, 3).copy()))
