"""A loop that is late, or has not begun, does not make a sample late."""

from dataclasses import replace

from tests.estimators.scenes import MS, sensed
from tests.estimators.test_ekf_odometry import assert_near, ekf, run, square


def test_what_a_late_loop_or_none_yet_could_not_read_in_time_is_no_fault_of_the_device():
    drive, odometry = square(), ekf()
    first = odometry.update(sensed(1000 * MS, imu=drive.imu[:200], base=drive.wheels[:100]))
    assert (first.faults, first.dropped) == ((), 0)
    late = sensed(1600 * MS, imu=drive.imu[200:320], base=drive.wheels[100:160])
    after = odometry.update(replace(late, tick=replace(late.tick, skipped=11)))
    assert (after.faults, after.dropped) == ((), 0)
    in_time = run(ekf(), drive)[1600 // 50]
    assert_near(after.odom_from_base, in_time.odom_from_base, 1e-3, 1e-3)
