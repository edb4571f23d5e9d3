import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup, DeviceState, MobileBase
from drivers.interface.errors import ConfigurationError, DeviceError
from drivers.interface.geometry import SE2
from drivers.recorded_wheels import RecordedWheelBase, RecordedWheelSettings

EXCERPT = Path(__file__).parents[1] / "data" / "diff_drive"
LINE = "odom2diff {} {} {} 0 0.1 1e-4 1e-4 1e-4\n"


class Time:
    def __init__(self) -> None:
        self.now_ns = 7_000_000_000

    def __call__(self) -> int:
        return self.now_ns


def base(time: Time, path: Path = EXCERPT / "input_excerpt.txt", radius_m: float = 0.05) -> RecordedWheelBase:
    return RecordedWheelBase(RecordedWheelSettings(path=path, wheel_radius_m=radius_m), DeviceSetup("base", 0, time))


def rms_after_alignment(path, truth) -> float:
    """Return the RMS distance [m] after the best rotation and shift (Kabsch)."""
    a, b = path - path.mean(0), truth - truth.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, np.linalg.det(vt.T @ u.T)])
    return float(np.sqrt(np.mean(np.sum((a @ (vt.T @ flip @ u.T).T - b) ** 2, axis=1))))


def test_dead_reckoning_on_the_real_drive_follows_its_ground_truth():
    time = Time()
    device = base(time)
    assert isinstance(device, MobileBase)
    device.open()
    time.now_ns += 60_000_000_000
    samples = device.drain()
    pose, poses = SE2(), [SE2()]
    for before, after in pairwise(samples):
        dt_s = (after.stamp.captured_ns - before.stamp.captured_ns) * 1e-9
        twist = device.kinematics.twist((after.position_rad - before.position_rad) / dt_s)
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, dt_s)
        poses.append(pose)
    path = np.array([(p.x, p.y) for p in poses])
    truth = np.loadtxt(EXCERPT / "ground_truth_excerpt.txt", usecols=(2, 3))
    assert len(path) == len(truth) == 200
    assert rms_after_alignment(path, truth) < 0.07  # over 7.7 m, in a room of 2.4 m; the columns the other way round: 0.8 m
    assert np.sum(np.hypot(*np.diff(path, axis=0).T)) == pytest.approx(np.sum(np.hypot(*np.diff(truth, axis=0).T)), rel=0.02)


def test_samples_come_when_their_time_has_come(tmp_path):
    file = tmp_path / "drive.txt"
    file.write_text("range2 0.5 1 2 3 4 5 6\n" + "".join(LINE.format(10 + k / 8, 0.1 * k, 0.2 * k) for k in range(5)))
    time = Time()
    device = base(time, file)
    device.open()
    assert [s.stamp.sequence for s in device.drain()] == [0]
    time.now_ns += 124_999_999
    assert device.drain() == ()
    time.now_ns += 250_000_001
    late = device.drain()
    assert [s.stamp.sequence for s in late] == [1, 2, 3]
    assert [s.stamp.captured_ns - 7_000_000_000 for s in late] == [125_000_000, 250_000_000, 375_000_000]
    np.testing.assert_allclose(late[1].velocity_rad_s, [0.2 / 0.05, 0.4 / 0.05])
    np.testing.assert_allclose(late[1].position_rad, [0.1 * 0.25 / 0.05, 0.2 * 0.25 / 0.05])  # area under a ramp from 0
    assert device.kinematics.effective_track_m == 0.2
    assert device.health().expected_period_ns == 125_000_000


def test_it_ends_one_period_after_the_last_sample(tmp_path):
    file = tmp_path / "drive.txt"
    file.write_text("".join(LINE.format(k / 8, 0, 0) for k in range(3)))
    time = Time()
    device = base(time, file)
    device.open()
    time.now_ns += 374_000_000
    assert device.health().state is DeviceState.OPEN
    time.now_ns += 1_000_000
    assert device.health().state is DeviceState.ENDED
    assert len(device.drain()) == 3  # nothing was lost by coming late
    assert device.health().received == 3


def test_a_command_is_checked_and_changes_nothing():
    device = base(Time())
    device.open()
    device.command(BodyTwist(0.3, 0.0, 0.1), 1)
    for bad in (math.nan, math.inf):
        with pytest.raises(DeviceError, match="base"):
            device.command(BodyTwist(bad, 0.0, 0.0), 1)
    assert not device.limits.holonomic


@pytest.mark.parametrize("rounds", [1, 2])
def test_stop_and_close_work_in_every_state(rounds):
    device = base(Time())
    for act in (lambda: None, device.open, device.drain):
        act()
        for _ in range(rounds):
            device.stop()
            device.close()
        assert device.drain() == ()
        assert device.health().state is DeviceState.CLOSED
    device.open()
    assert len(device.drain()) == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "0 odom2diff lines"),
        (LINE.format(0, 0, 0), "1 odom2diff lines"),
        (LINE.format(0, 0, 0) + LINE.format(1, "fast", 0), "line 2.*fast"),
        (LINE.format(0, 0, 0) + LINE.format(1, "nan", 0), "line 2"),
        (LINE.format(0, 0, 0) + LINE.format(1, "inf", 0), "line 2"),
        (LINE.format(0, 0, 0) + "odom2diff 1 0 0\n", "line 2"),
        (LINE.format(1, 0, 0) + LINE.format(1, 0, 0), "line 2.*time must increase"),
        (LINE.format(0, 0, 0) + "odom2diff 1 0 0 0 0.2\n", "line 2.*wheel distance"),
        ("odom2diff 1 0 0 0 0\n", "line 1"),
    ],
)
def test_a_malformed_file_is_named_with_its_line(tmp_path, text, said):
    file = tmp_path / "drive.txt"
    file.write_text(text)
    device = base(Time(), file)
    with pytest.raises(ConfigurationError, match=said) as error:
        device.open()
    assert "drive.txt" in str(error.value)
    device.stop()
    device.close()
    assert device.health().state is DeviceState.CLOSED


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00odom"])
def test_an_unreadable_file_is_named(tmp_path, content):
    file = tmp_path / "drive.txt"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(ConfigurationError, match="cannot read the wheel recording"):
        base(Time(), file).open()
