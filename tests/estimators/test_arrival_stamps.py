"""Stamps that are those of an arrival: samples bunch, and what came before a gap is not when it says it was."""

from dataclasses import replace

import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.samples import Stamp
from tests.estimators.scenes import MS
from tests.estimators.test_ekf_odometry import SKID, STILL, Drive, assert_near, ekf, feed, smooth
from tests.estimators.test_odometry import OMNI, drive, reckoning, samples_of


def restamped(sample, by_ns):
    captured_ns = sample.stamp.captured_ns + by_ns
    return replace(sample, stamp=Stamp(captured_ns, captured_ns, sample.stamp.sequence))


def straight(kinematics):
    return Drive(kinematics, STILL + smooth(BodyTwist(0.6, 0.0, 0.0), hold_s=4.0) + STILL, bias=0.004, noise=0.002)


def test_samples_that_bunch_lose_no_way_of_dead_reckoning():
    samples, poses = samples_of(OMNI, [BodyTwist(0.5, 0.1, 1.0)] * 100, period_ns=10 * MS)
    bunched = [restamped(s, 9 * MS) if index % 10 == 5 else s for index, s in enumerate(samples)]
    estimate = drive(reckoning(OMNI), bunched)
    assert estimate.faults == ()
    assert_near(estimate.odom_from_base, poses[100], 1e-9, 1e-9)


def test_samples_that_bunch_are_neither_invalid_nor_slip():
    made = straight(OMNI)
    bunched = [restamped(s, 2 * MS) if index % 10 == 5 else s for index, s in enumerate(made.wheels)]
    estimates = feed(ekf(), made.imu, bunched, made.end_ns)
    assert all(estimate.faults == () for estimate in estimates)
    assert sum(estimate.slipping for estimate in estimates) <= len(estimates) // 20
    assert_near(estimates[-1].odom_from_base, made.poses[-1], 0.06, 0.01)


@pytest.mark.parametrize("stall_ms", [70, 100, 200])
def test_a_world_that_stood_still_leaves_the_right_velocity(stall_ms):
    made, begin_ns = straight(SKID), 3000 * MS
    imu, base = (
        [restamped(s, stall_ms * MS) if s.stamp.captured_ns > begin_ns else s for s in samples[::rarely]]
        for samples, rarely in ((made.imu, 8), (made.wheels, 4))  # 25 Hz each, as an autopilot streams
    )
    estimates = feed(ekf(SKID), imu, base, made.end_ns + stall_ms * MS)
    after = estimates[(begin_ns + (stall_ms + 200) * MS) // (50 * MS)]
    assert after.twist.vx == pytest.approx(0.6, abs=0.05)
    assert_near(estimates[-1].odom_from_base, made.poses[-1], 0.1, 0.02)
