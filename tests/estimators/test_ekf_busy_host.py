"""The Kalman filter of the odometry on a machine that has too much to do: stamps that lie, and what no base can have done."""

import math
from dataclasses import replace

from drivers.interface.commands import BodyTwist
from estimators.belief import EstimatorFault
from estimators.odometry.odometry_choice import OdometrySettings, build_odometry
from tests.estimators.test_ekf_odometry import OMNI, STILL, Drive, assert_near, ekf, feed, smooth, square


def test_stamps_that_were_pressed_together_make_no_motion():
    """What a busy host's camera process may do: samples that are a nanosecond apart."""
    drive = Drive(OMNI, STILL + smooth(BodyTwist(0.5, 0.0, 1.0)), noise=0.05)
    for index in range(250, 400, 10):
        stamp = drive.imu[index].stamp
        at = replace(stamp, captured_ns=drive.imu[index - 1].stamp.captured_ns + 1)
        drive.imu[index] = replace(drive.imu[index], stamp=at)
    estimates = feed(build_odometry(OdometrySettings(kind="ekf"), OMNI, (0.06, 0.0)), drive.imu, drive.wheels, drive.end_ns)
    assert max(math.hypot(e.twist.vx, e.twist.vy) for e in estimates) < 0.6
    assert_near(estimates[-1].odom_from_base, drive.poses[-1], 0.05, 0.05)


def test_a_velocity_that_no_base_has_is_divergence_and_does_not_move_the_pose():
    drive = square()
    odometry, wild = ekf(), (60.0, 0.0, 9.81)
    imu = [replace(s, accel_m_s2=wild) if 1.2 < s.stamp.captured_ns * 1e-9 < 1.6 else s for s in drive.imu]
    estimates = feed(odometry, imu, [], drive.end_ns // 8)
    assert any(EstimatorFault.DIVERGED in e.faults for e in estimates)
    assert max(math.hypot(e.twist.vx, e.twist.vy) for e in estimates) < 10.5
