"""What the camera's process costs beyond librealsense itself, at 848x480 and 30 Hz, and what the loop's end costs a tick.

Both play the same recording at its pace, each in a process of its own: librealsense alone with a queue and the same filters, and
ours with all that it does besides: stamps, counters, intrinsics, shared memory, health.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from drivers.interface.devices import DeviceSetup, DeviceState
from drivers.realsense.driver import RealSenseCamera
from drivers.realsense.settings import CameraSettings
from tests.benchmarks.figure import Figure, of_distribution
from tests.drivers.realsense.imager import SHAPE, Imager

FRAMES = 120
RATE_HZ = 30.0
PATIENCE_S = 30.0

ALONE = """
import ctypes, sys, time
import libusb_package
ctypes.CDLL(str(libusb_package.get_library_path()), ctypes.RTLD_GLOBAL)
import pyrealsense2 as rs
context = rs.context()
sensor = context.load_device(sys.argv[1]).query_sensors()[0]
queue = rs.frame_queue(2)
filters = (rs.decimation_filter(3), rs.disparity_transform(True), rs.spatial_filter(0.25, 30, 4, 2),
           rs.temporal_filter(0.4, 20, 3), rs.disparity_transform(False))
sensor.open(sensor.get_stream_profiles())
sensor.start(queue)
begun_s, begun_cpu_s, frames, newest_s = 0.0, 0.0, 0, 0.0
while True:
    there, frame = queue.try_wait_for_frame(2000)
    if not there:
        break
    for each in filters:
        frame = each.process(frame)
    frame.get_data()
    newest_s, cpu_s, frames = time.monotonic(), time.process_time(), frames + 1
    if frames == 1:
        begun_s, begun_cpu_s = newest_s, cpu_s
print((cpu_s - begun_cpu_s) / (newest_s - begun_s))
"""


def figures() -> list[Figure]:
    """Record a noisy scene, and play it twice."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.db3"
        record(path)
        told = subprocess.run([sys.executable, "-c", ALONE, str(path)], check=True, capture_output=True, text=True)
        alone = float(told.stdout)
        ours, taken_us = driver(path)
    return [
        Figure("realsense_process", 100.0 * ours, unit="% of a core", peer="librealsense alone", peer_value=100.0 * alone),
        Figure("realsense_beyond_librealsense", 100.0 * (ours - alone), unit="% of a core"),
        of_distribution("realsense_tick", taken_us, "us"),
    ]


def record(path: Path) -> None:
    """Write a wall with noise, a post and a patch without depth."""
    imager, rng = Imager(), np.random.default_rng(0)
    recorder = imager.rs.recorder(str(path), imager.device)
    imager.start(recorder.query_sensors()[0])
    scene = np.full(SHAPE, 2500, np.uint16)
    scene[:, 300:360], scene[200:440, 480:720] = 1200, 0
    begun_s = time.monotonic()
    for index in range(FRAMES):
        time.sleep(max(0.0, begun_s + index / RATE_HZ - time.monotonic()))
        imager.frame(scene + (scene > 0) * rng.integers(0, 40, SHAPE, dtype=np.uint16))
    imager.close()


def driver(path: Path) -> tuple[float, list[float]]:
    """Return the share of a core that our process took, and how long reading took in each tick [us]."""
    camera = RealSenseCamera(CameraSettings(source="bag", path=path), DeviceSetup("camera", 0, time.monotonic_ns))
    taken_us: list[float] = []
    camera.open()
    try:
        pid, begun_s = camera._lease.it.io.pid, time.monotonic()
        begun_cpu_s = cpu_s(pid)
        while camera.health().state is not DeviceState.ENDED and time.monotonic() - begun_s < PATIENCE_S:
            time.sleep(0.02)
            before_ns = time.perf_counter_ns()
            camera.latest()
            camera.health()
            taken_us.append((time.perf_counter_ns() - before_ns) * 1e-3)
        share = (cpu_s(pid) - begun_cpu_s) / (time.monotonic() - begun_s)
    finally:
        camera.close()
    return share, taken_us


def cpu_s(pid: int | None) -> float:
    """Return the processor time that all threads of a process have used [s]."""
    threads = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(thread.read_text().split()[0]) for thread in threads) * 1e-9
