"""The session against an emulated camera: frames through librealsense's software device and filters, in lockstep."""

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.io.session import local_port
from drivers.realsense.plan import MEMORY, CameraPlan
from drivers.realsense.session import RealSenseSession
from drivers.realsense.settings import CameraSettings
from sim_drivers.depth_camera import D455
from tests.drivers.realsense.lockstep import fresh_name, lockstep

UNFILTERED = {"decimation": 3, "disparity": False, "spatial": None, "temporal": None}
PERFECT = {"loss_probability": 0.0}
NOISELESS = {"subpixel_px": 0.0, "shadow_hole_probability": 0.0, "edge_hole_probability": 0.0, "dropout_probability": 0.0}


def test_frames_are_stamped_with_when_they_were_captured_whatever_the_cameras_clock_says():
    with lockstep({}, clock_offset_s=4000.0, clock_drift=50e-6, **PERFECT) as both:
        frames = both.frames(2.0)
        assert len(frames) == pytest.approx(60, abs=3)
        sequence = np.array([meta["sequence"] for meta, _ in frames])
        assert (np.diff(sequence) == 1).all()
        captured_s = np.array([meta["captured_ns"] for meta, _ in frames]) * 1e-9
        assert np.allclose(captured_s * 30.0, np.round(captured_s * 30.0), atol=0.2)  # within a step of the physics
        age_s = np.array([meta["received_ns"] for meta, _ in frames]) * 1e-9 - captured_s
        assert age_s == pytest.approx(0.03, abs=0.006)


def test_the_intrinsics_are_those_of_the_decimated_stream_and_so_is_the_picture():
    """A pixel of the chain's image that sees the wall sees it where the wall is."""
    with lockstep({"filters": UNFILTERED, "z_m": 0.5}, noise=NOISELESS, range_max_m=10.0, **PERFECT) as both:
        meta, image = both.frames(0.3)[-1]
        assert image.shape == (160, 284)
        assert (image[:, 282:] == 0).all()  # librealsense pads the width to a multiple of four
        assert meta["fx"] == pytest.approx(D455.fx / 3, rel=1e-6)
        assert meta["cx"] == pytest.approx(D455.cx / 3, rel=1e-6)
        assert meta["unit_m"] == 0.001
        row = 150  # the floor
        expected_m = 0.5 * meta["fy"] / (row - (meta["cy"] - 1 / 3))  # librealsense leaves a third of a pixel to the reader
        assert np.median(image[row, :282]) * meta["unit_m"] == pytest.approx(expected_m, rel=0.01)


def test_what_the_camera_does_not_know_stays_unknown():
    with lockstep({}, min_range_m=1.0, **PERFECT) as both:
        *_, (_, image) = both.frames(0.5)
        near = image[150:, 60:200]  # the floor before the robot
        assert (near[4:] == 0).all()  # the spatial filter fills up to four pixels at a rim, and no more
        assert (image > 0).mean() > 0.2


@pytest.mark.parametrize("unit_m", [0.001, 0.0005])
def test_depth_units_are_honoured(unit_m):
    with lockstep({"filters": UNFILTERED}, noise=NOISELESS, depth_unit_m=unit_m, **PERFECT) as both:
        meta, image = both.frames(0.2)[-1]
        assert meta["unit_m"] == pytest.approx(unit_m, rel=1e-6)
        assert 0.5 < np.median(image[image > 0]) * unit_m < 6.0


def test_rates_and_forces_come_in_the_optical_frame_and_keep_pace():
    with lockstep({}, {}) as both:
        both.base.command(BodyTwist(0.0, 0.0, 0.5), 10**18)
        both.wait(1.0)
        both.motion()
        both.wait(1.0)
        samples = both.motion()
        assert len(samples) == pytest.approx(200, abs=3)
        assert (np.diff(samples["captured_ns"]) > 0).all()
        assert samples["gyro_rad_s"].mean(axis=0) == pytest.approx([0.0, -0.5, 0.0], abs=0.02)  # y is down
        assert samples["accel_m_s2"].mean(axis=0) == pytest.approx([0.0, -9.81, 0.0], abs=0.3)
        assert both.port.health.state is DeviceState.OPEN


def test_lost_frames_are_counted():
    script = [{"kind": "drop", "from_s": 1.0, "until_s": 2.0, "probability": 0.5}]
    with lockstep({}, faults=script, **PERFECT) as both:
        frames = both.frames(3.0)
        numbers = [int(meta["sequence"]) for meta, _ in frames]
        missing = numbers[-1] - numbers[0] + 1 - len(numbers)
        assert 5 < missing < 25
        assert both.port.health.dropped == missing


def test_a_frame_that_comes_again_is_none_and_a_frozen_camera_is_lost():
    script = [{"kind": "freeze", "from_s": 1.0}]
    with lockstep({"silent_s": 0.5}, faults=script, **PERFECT) as both:
        before = both.frames(1.0)
        assert len(before) > 25
        after = both.frames(0.4)
        assert len(after) <= 2
        assert both.port.health.dropped > 5
        with pytest.raises(DeviceError, match="no depth has come"):
            both.wait(2.0)


def test_unplugged_it_is_lost_and_plugged_in_again_it_goes_on():
    script = [{"kind": "disconnect", "from_s": 1.0, "until_s": 1.5}]
    with lockstep({}, faults=script, **PERFECT) as both:
        before = both.frames(0.9)
        with pytest.raises(DeviceError, match="unplugged"):
            both.wait(0.3)
        both.session.close()
        both.session.open()
        both.wait(0.1)
        assert both.port.health.state is DeviceState.RECONNECTING
        both.port.health.fault = "why it was lost"  # as the process notes it
        after = both.frames(1.0)
        assert (both.port.health.state, both.port.health.fault) == (DeviceState.OPEN, "")
        assert len(after) > 10
        assert after[0][0]["sequence"] > before[-1][0]["sequence"]
        assert after[0][0]["captured_ns"] > before[-1][0]["captured_ns"]


def test_late_frames_are_old_frames():
    script = [{"kind": "delay", "from_s": 1.0, "by_s": 0.2}]
    with lockstep({}, faults=script, **PERFECT) as both:
        both.frames(1.0)
        late = both.frames(1.0)[5:]
        age_s = np.array([meta["received_ns"] - meta["captured_ns"] for meta, _ in late]) * 1e-9
        assert age_s == pytest.approx(0.23, abs=0.01)


def test_a_jump_of_its_clock_is_noticed_and_time_goes_on():
    script = [{"kind": "clock_jump", "from_s": 1.0, "by_s": 30.0}]
    with lockstep({}, faults=script, **PERFECT) as both:
        captured_ns = np.array([meta["captured_ns"] for meta, _ in both.frames(2.0)])
        assert (np.diff(captured_ns) > 0).all()
        assert np.diff(captured_ns).max() < 50_000_000
        assert captured_ns[-1] < 2_000_000_000


def test_without_an_emulation_it_says_so():
    settings = CameraSettings(source="emulated", memory=fresh_name(), connect_s=0.5)
    session = RealSenseSession(CameraPlan(settings, settings), local_port(MEMORY, "camera"))
    session.open()
    session.poll(0)
    with pytest.raises(DeviceError, match=r"no emulation has a camera .* start 'trundle emulate'"):
        session.poll(600_000_000)
    session.close()
