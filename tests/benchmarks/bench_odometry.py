"""The odometry's Kalman filter: what each sample costs, at 200 Hz of gyro and 100 Hz of wheels, on a base that drives a curve."""

import time
from collections.abc import Iterator

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.mission import Mission
from drivers.interface.samples import ImuSample, Stamp, WheelSample
from drivers.interface.sensed import Sensed, Tick
from estimators.odometry.odometry import Odometry
from estimators.odometry.odometry_choice import OdometrySettings, build_odometry
from tests.benchmarks.figure import Figure, of_distribution

GYRO_NS, WHEELS_NS = 5_000_000, 10_000_000
ROUNDS = 1500
TWIST = BodyTwist(0.4, 0.1, 0.5)
OMNI = OmniThreeWheel.symmetric(wheel_radius_m=0.05, wheel_distance_m=0.1)


def figures() -> Iterator[Figure]:
    """Samples in the order of their capture, and one gyro sample that comes 50 ms late: ten gyro and five wheel samples again."""
    odometry = build_odometry(OdometrySettings(kind="ekf"), OMNI)
    gyro_ms, wheels_ms, late_ms = [], [], []
    for index in range(1, ROUNDS):
        now_ns = index * WHEELS_NS
        pair = (gyro(now_ns - GYRO_NS), gyro(now_ns))
        held_back = pair[0] if index % 10 == 5 else None
        gyro_ms.append(_took_ms(odometry, now_ns, imu=pair[1:] if held_back else pair) / (1 if held_back else 2))
        wheels_ms.append(_took_ms(odometry, now_ns, base=(wheels(now_ns),)))
        if index > 10 and index % 10 == 0:
            late_ms.append(_took_ms(odometry, now_ns, imu=(gyro(now_ns - 5 * WHEELS_NS - GYRO_NS),)))
    yield of_distribution("ekf_gyro_sample", gyro_ms[100:])
    yield of_distribution("ekf_wheel_sample", wheels_ms[100:])
    yield of_distribution("ekf_sample_50ms_late", late_ms[10:])


def gyro(captured_ns: int) -> ImuSample:
    """A sample of the curve, with gravity and what turns the velocity."""
    force = (-TWIST.wz * TWIST.vy, TWIST.wz * TWIST.vx, 9.81)
    return ImuSample(Stamp(captured_ns, captured_ns, 0), (0.0, 0.0, TWIST.wz), force)


def wheels(captured_ns: int) -> WheelSample:
    """The wheels on the curve."""
    rates = OMNI.wheel_rates(TWIST)
    return WheelSample(Stamp(captured_ns, captured_ns, 0), np.asarray(rates * captured_ns * 1e-9), rates)


def _took_ms(odometry: Odometry, now_ns: int, imu: tuple[ImuSample, ...] = (), base: tuple[WheelSample, ...] = ()) -> float:
    sensed = Sensed(Tick(0, now_ns, WHEELS_NS), None, imu, base, (), (), (), None, (), Mission(SE2(), ()))
    before_ns = time.perf_counter_ns()
    odometry.update(sensed)
    return (time.perf_counter_ns() - before_ns) * 1e-6
