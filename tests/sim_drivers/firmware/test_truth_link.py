"""Truth over loopback: the driver and the emulated world's end, in one process, the world stepped by the test."""

import math
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.emulated_truth import EmulatedTruth
from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.geometry import SE2
from drivers.interface.samples import ObstacleTruth, Stamp, TruthSample
from drivers.interface.truth_wire import BYE, RUN, WATCH, TruthLook, decode, encode
from sim_drivers.firmware.firmware import FirmwareSetup, LockstepHost
from sim_drivers.firmware.truth import EmulatedTruthFirmware
from sim_drivers.scene import Mover, Scene, Shape
from sim_drivers.world import MujocoWorld, WorldSettings
from tests.ports import free_port

WALK = np.array([[0.0, 3.0, 0.0, 0.0], [10.0, 13.0, 0.0, 0.0]])  # 1 m/s from the start
SCENE = Scene("walk", SE2(), (), 10.0, (), (Mover("walker", Shape.cylinder(0.2, 1.7), WALK),))
PATIENCE_S = 10.0


class Bench:
    """A world that a thread steps, slower than real time, so that the driver's thread finds somebody there."""

    def __init__(self, port: int) -> None:
        self.settings = EmulatedTruth.Settings(port=port, open_timeout_s=PATIENCE_S)
        self.world = MujocoWorld(SCENE, WorldSettings())
        self.host = LockstepHost(self.world)
        self.firmware = EmulatedTruthFirmware(
            self.settings, EmulatedTruthFirmware.Settings(silent_after_s=1.0), FirmwareSetup("truth", 0, self.world, self.host)
        )
        self.world.compile()
        self.firmware.open()
        self._leave = threading.Event()
        self._thread = threading.Thread(target=self._step)
        self._thread.start()

    def driver(self) -> EmulatedTruth:
        return EmulatedTruth(self.settings, DeviceSetup("truth", 0, time.monotonic_ns))

    def until(self, holds: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < deadline_s
            time.sleep(0.005)

    def close(self) -> None:
        self._leave.set()
        self._thread.join()
        self.firmware.close()

    def _step(self) -> None:
        while not self._leave.wait(0.01):
            self.world.step_to(self.world.now_ns + 10_000_000)


@contextmanager
def bench() -> Iterator[Bench]:
    running = Bench(free_port())
    try:
        yield running
    finally:
        running.close()


numbers = st.floats(allow_nan=False)
poses = st.builds(SE2, numbers, numbers, numbers)
times = st.integers(0, 2**62)


@given(poses, st.tuples(numbers, numbers, numbers), numbers, st.lists(st.text(), max_size=3), times, times)
def test_a_datagram_is_exact(pose, twist, clearance_m, contacts, captured_ns, late_ns):
    obstacle = ObstacleTruth("a door", pose, twist[:2], 0.4)
    sample = TruthSample(Stamp(captured_ns, 7, 3), pose, BodyTwist(*twist), (obstacle,), clearance_m, tuple(contacts))
    assert decode(encode(TruthLook(sample, late_ns)), 7) == TruthLook(sample, late_ns)


@given(st.binary(max_size=200))
def test_whatever_is_no_truth_is_refused(datagram):
    with pytest.raises(ValueError, match="no truth datagram"):
        decode(datagram, 0)


def test_walkers_wait_until_a_run_opens_and_the_world_ends_with_it():
    with bench() as running:
        running.until(lambda: running.world.now_ns > 500_000_000)
        assert running.world.scene_ns == 0
        driver = running.driver()
        driver.open()
        first = driver.latest()
        assert first.obstacles[0].map_from_obstacle.x < 3.5
        running.until(lambda: driver.latest().obstacles[0].map_from_obstacle.x > 4.0)
        newest = driver.latest()
        x = newest.obstacles[0].map_from_obstacle.x
        assert 3.0 + (newest.stamp.captured_ns - first.stamp.captured_ns) * 1e-9 == pytest.approx(x, abs=0.5)
        assert driver.health().state is DeviceState.OPEN
        assert not running.host.ended
        driver.close()
        running.until(lambda: running.host.ended)
        assert driver.latest() is None


def test_a_second_run_is_refused_and_a_watcher_is_not():
    with bench() as running:
        first, second = running.driver(), running.driver()
        first.open()
        with pytest.raises(DeviceError, match="another run"):
            second.open()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as watcher:
            watcher.settimeout(PATIENCE_S)
            watcher.sendto(WATCH, ("127.0.0.1", running.settings.port))
            assert decode(watcher.recv(65_507), 0).sample.obstacles[0].name == "walker"
            watcher.sendto(BYE, ("127.0.0.1", running.settings.port))
        first.close()
        running.until(lambda: running.host.ended)


def test_a_run_that_falls_silent_has_left():
    with bench() as running, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.sendto(RUN, ("127.0.0.1", running.settings.port))
        running.until(lambda: running.world.scene_ns > 0)
        running.until(lambda: running.host.ended)


def test_how_late_the_world_is_counts_from_the_opening():
    with bench() as running:
        running.host.late_ns = 3_000_000_000
        driver = running.driver()
        driver.open()
        assert driver.world_late_s == 0.0
        running.host.late_ns += 250_000_000
        running.until(lambda: driver.world_late_s == 0.25)
        driver.close()


def test_without_an_emulation_it_says_how_to_start_one():
    settings = EmulatedTruth.Settings(port=free_port(), open_timeout_s=0.3)
    driver = EmulatedTruth(settings, DeviceSetup("truth", 0, time.monotonic_ns))
    with pytest.raises(DeviceError, match="start 'trundle emulate'"):
        driver.open()
    for _ in range(2):
        driver.stop()
        driver.close()
    assert driver.health().state is DeviceState.CLOSED


def test_a_port_that_is_taken_is_told():
    with bench() as running:
        world = MujocoWorld(SCENE, WorldSettings())
        setup = FirmwareSetup("truth", 0, world, LockstepHost(world))
        other = EmulatedTruthFirmware(running.settings, EmulatedTruthFirmware.Settings(), setup)
        with pytest.raises(DeviceError, match="does another 'trundle emulate' run"):
            other.open()
        other.close()


def test_a_foreign_datagram_is_dropped_and_counted():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        server.settimeout(PATIENCE_S)
        settings = EmulatedTruth.Settings(port=server.getsockname()[1], open_timeout_s=PATIENCE_S)
        driver = EmulatedTruth(settings, DeviceSetup("truth", 0, time.monotonic_ns))

        def answer() -> None:
            _, client = server.recvfrom(64)
            good = TruthSample(Stamp(5, 5, 0), SE2(1.0, 2.0, 0.5), BodyTwist(), (), math.inf, ())
            for datagram in (b"{}", b"\xff\xfe", encode(TruthLook(good, 0))):
                server.sendto(datagram, client)

        thread = threading.Thread(target=answer)
        thread.start()
        driver.open()
        thread.join()
        assert driver.latest().map_from_base == SE2(1.0, 2.0, 0.5)
        assert (driver.health().received, driver.health().dropped) == (1, 2)
        driver.close()
