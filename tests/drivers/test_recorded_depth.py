from pathlib import Path
from shutil import copy

import cv2
import numpy as np
import pytest

from drivers.interface.devices import DepthCamera, DeviceSetup, DeviceState
from drivers.interface.errors import ConfigurationError
from drivers.recorded_depth import RecordedDepthCamera, RecordedDepthSettings

EXCERPT = Path(__file__).parents[1] / "data" / "realsense_depth"
LENS = {"fx_px": 383.0, "fy_px": 383.0, "cx_px": 320.0, "cy_px": 240.0}
MS = 1_000_000


class Time:
    def __init__(self, now_ns: int = 5_000 * MS) -> None:
        self.now_ns = now_ns

    def __call__(self) -> int:
        return self.now_ns


def camera(time: Time, path: Path, **settings: object) -> RecordedDepthCamera:
    return RecordedDepthCamera(RecordedDepthSettings(path=path, **{**LENS, **settings}), DeviceSetup("camera", 0, time))


@pytest.fixture
def ten_frames(tmp_path: Path) -> Path:
    for k in range(10):
        cv2.imwrite(str(tmp_path / f"{k:03}.png"), np.full((4, 6), 1000 + k, dtype=np.uint16))
    return tmp_path


def test_real_frames_arrive_unchanged_with_their_lens_and_time():
    time = Time()
    device = camera(time, EXCERPT, rate_hz=30.0)
    assert isinstance(device, DepthCamera)
    device.open()
    first = device.latest()
    assert device.latest() is None  # each frame once
    time.now_ns += 34 * MS
    second = device.latest()
    assert first.depth.shape == (480, 640)
    assert first.depth.dtype == np.uint16
    assert not first.depth.flags.writeable
    assert (first.intrinsics.width, first.intrinsics.height, first.intrinsics.fx) == (640, 480, 383.0)
    reference = cv2.imread(str(EXCERPT / "001.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(second.depth, reference)
    assert second.stamp.captured_ns - first.stamp.captured_ns == round(1e9 / 30)
    assert second.stamp.received_ns == time.now_ns
    assert 0.05 < np.mean(first.depth == 0) < 0.15  # the holes are still there


def test_a_slow_loop_gets_the_newest_frame_and_the_drops_are_counted(ten_frames):
    time = Time()
    device = camera(time, ten_frames, rate_hz=10.0)
    device.open()
    assert device.latest().depth[0, 0] == 1000
    time.now_ns += 450 * MS
    frame = device.latest()
    assert (frame.depth[0, 0], frame.stamp.sequence) == (1004, 4)
    health = device.health()
    assert (health.received, health.dropped, health.expected_period_ns) == (2, 3, 100 * MS)


def test_it_ends_after_the_last_frame(ten_frames):
    time = Time()
    device = camera(time, ten_frames, rate_hz=10.0)
    device.open()
    time.now_ns += 999 * MS
    assert device.health().state is DeviceState.OPEN
    time.now_ns += 10_000 * MS
    assert device.latest().depth[0, 0] == 1009  # due before the end, so still delivered
    assert device.latest() is None
    assert device.health().state is DeviceState.ENDED


def test_a_loop_begins_again_and_never_ends(ten_frames):
    time = Time()
    device = camera(time, ten_frames, rate_hz=10.0, loop=True)
    device.open()
    time.now_ns += 1_200 * MS
    assert device.latest().depth[0, 0] == 1002
    assert device.health().state is DeviceState.OPEN


def test_a_broken_file_is_dropped_and_counted(ten_frames):
    time = Time()
    (ten_frames / "001.png").write_bytes(b"\x89PNG cut short")
    (ten_frames / "002.png").write_bytes(b"")
    cv2.imwrite(str(ten_frames / "003.png"), np.zeros((4, 6, 3), dtype=np.uint8))
    device = camera(time, ten_frames, rate_hz=10.0)
    device.open()
    device.latest()
    for _ in range(3):
        time.now_ns += 100 * MS
        assert device.latest() is None
    time.now_ns += 100 * MS
    assert device.latest().depth[0, 0] == 1004
    assert device.health().dropped == 3


def test_the_mount_takes_optical_points_to_the_base(ten_frames):
    device = camera(Time(), ten_frames, x_m=0.1, z_m=0.3, pitch_rad=np.pi / 6)
    device.open()
    ahead = device.latest().base_from_optical.apply(np.array([0.0, 0.0, 2.0]))  # 2 m along the optical axis
    np.testing.assert_allclose(ahead, [0.1 + 2 * np.cos(np.pi / 6), 0.0, 0.3 - 1.0], atol=1e-12)  # it looks down


@pytest.mark.parametrize("rounds", [1, 2])
def test_stop_and_close_work_in_every_state(ten_frames, rounds):
    device = camera(Time(), ten_frames)
    for act in (lambda: None, device.open, device.latest):
        act()
        for _ in range(rounds):
            device.stop()
            device.close()
        assert device.latest() is None
        assert device.health().state is DeviceState.CLOSED
    device.open()
    assert device.latest() is not None  # opens again, from the start


@pytest.mark.parametrize("make", ["absent", "empty", "text"])
def test_a_wrong_folder_is_named(tmp_path, make):
    folder = tmp_path / "frames"
    if make != "absent":
        folder.mkdir()
    if make == "text":
        copy(__file__, folder / "000.png")
    device = camera(Time(), folder)
    with pytest.raises(ConfigurationError, match=r"camera\.path.*frames"):
        device.open()
    device.stop()
    device.close()
    assert device.latest() is None
