"""The devices with their process: a recording to its end, and an emulated camera that comes and goes while a loop goes on."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from drivers.interface.clock import RealClock
from drivers.interface.devices import DepthCamera, DeviceSetup, DeviceState, Imu
from drivers.interface.errors import ConfigurationError, DeviceError
from drivers.interface.links import Links
from drivers.realsense.driver import RealSenseCamera
from drivers.realsense.imu import RealSenseImu
from drivers.realsense.settings import CameraSettings, ImuSettings
from runtime.emulate import FreeRun
from sim_drivers.firmware.camera_imu import CameraImuSettings, RealSenseImuFirmware
from sim_drivers.firmware.depth_camera import CameraFirmwareSettings, RealSenseFirmware
from sim_drivers.firmware.firmware import FirmwareSetup
from tests.contract.streams import build_world
from tests.drivers.realsense.imager import SHAPE, Imager
from tests.drivers.realsense.lockstep import fresh_name

RAW = {"decimation": 1, "disparity": False, "spatial": None, "temporal": None}
PATIENCE_S = 40.0  # other work may share the machine


def until(holds: Callable[[], bool], what: str) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < deadline_s, what
        time.sleep(0.002)


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    """Six frames of a wall that comes nearer, recorded by librealsense at 30 Hz."""
    path = tmp_path_factory.mktemp("realsense") / "wall.db3"
    imager = Imager()
    recorder = imager.rs.recorder(str(path), imager.device)
    imager.start(recorder.query_sensors()[0])
    for index in range(6):
        imager.frame(np.full(SHAPE, 2000 - 100 * index, np.uint16))
        time.sleep(1 / 30)
    imager.close()
    del recorder
    return path


def test_a_recording_goes_through_the_driver_to_its_end(recording):
    settings = CameraSettings(source="bag", path=recording, filters=RAW)
    camera = RealSenseCamera(settings, DeviceSetup("camera", 0, time.monotonic_ns))
    assert isinstance(camera, DepthCamera)
    camera.open()
    try:
        frames = []

        def ended() -> bool:
            frame = camera.latest()
            frames.extend([frame] if frame is not None else [])
            return camera.health().state is DeviceState.ENDED and frame is None

        until(ended, "the recording has no end")
        frame = frames[-1]
        assert camera.health().received + camera.health().dropped >= 5  # a recorder may begin a frame late
        assert frame.depth.shape == SHAPE
        assert (frame.depth == 1500).all()
        assert frame.depth_unit_m == 0.001
        assert (frame.intrinsics.fx, frame.intrinsics.cx) == (434.0, 424.0)
        assert not frame.depth.flags.writeable
    finally:
        camera.close()
    assert camera.health().state is DeviceState.CLOSED


def test_what_is_not_there_is_named(tmp_path):
    setup = DeviceSetup("eye", 0, time.monotonic_ns)
    with pytest.raises(ConfigurationError, match=r"eye\.path: there is no recording"):
        RealSenseCamera(CameraSettings(source="bag", path=tmp_path / "none.bag"), setup).open()
    (tmp_path / "bad.bag").write_bytes(b"no recording")
    with pytest.raises(DeviceError, match="eye: librealsense says"):
        RealSenseCamera(CameraSettings(source="bag", path=tmp_path / "bad.bag"), setup).open()
    with pytest.raises(DeviceError, match="there is no RealSense camera with serial number 000; none is connected"):
        RealSenseCamera(CameraSettings(serial_number="000"), setup).open()


@contextmanager
def emulation(name: str, **firmware: object) -> Iterator[None]:
    """Let a world with a camera and its inertial unit run beside the test."""
    world = build_world()
    run, over = FreeRun(world, RealClock()), Event()
    drivers = {"source": "emulated", "memory": name}
    parts = (
        RealSenseFirmware(CameraSettings(**drivers), CameraFirmwareSettings(**firmware), FirmwareSetup("camera", 1, world, run)),
        RealSenseImuFirmware(ImuSettings(**drivers), CameraImuSettings(), FirmwareSetup("imu", 1, world, run)),
    )
    world.compile()
    for part in parts:
        part.open()
    run.start()

    def step() -> None:
        while not over.is_set():
            run.step()

    thread = Thread(target=step)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        for part in parts:
            part.close()


def test_camera_and_imu_share_a_process_that_finds_the_camera_again():
    name, links = fresh_name(), Links()
    common = {"source": "emulated", "memory": name, "connect_s": 20.0}
    camera = RealSenseCamera(CameraSettings(**common), DeviceSetup("camera", 0, time.monotonic_ns, links=links))
    imu = RealSenseImu(ImuSettings(**common), DeviceSetup("imu", 0, time.monotonic_ns, links=links))
    assert isinstance(imu, Imu)
    try:
        with emulation(name):
            camera.open()
            imu.open()
            assert camera._lease.it.io.pid == imu._lease.it.io.pid
            assert camera.identity().serial == f"serial number {name}"
            until(lambda: camera.latest() is not None and len(imu.drain()) > 0, "nothing came")
        until(lambda: camera.health().state is DeviceState.RECONNECTING, "nobody noticed that it was unplugged")
        assert camera.latest() is None or camera.latest() is None
        assert "emulat" in camera.health().fault or camera.health().fault == ""
        with emulation(name):
            until(lambda: camera.health().state is DeviceState.OPEN, "it was not found again")
            until(lambda: camera.latest() is not None and len(imu.drain()) > 0, "nothing came any more")
            camera.close()
            until(lambda: imu.health().state is DeviceState.OPEN, "the process ended, and it is still the other one's")
    finally:
        camera.close()
        imu.close()
    assert imu.health().state is DeviceState.CLOSED
