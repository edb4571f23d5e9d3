"""What the process at the camera does: opens the sensors, reads their frames, says when they fall silent."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.io.session import Port
from drivers.realsense.colour import ColourReader
from drivers.realsense.depth import DepthReader
from drivers.realsense.emulated import EmulatedSource
from drivers.realsense.library import device_errors, librealsense
from drivers.realsense.live import LiveSource
from drivers.realsense.motion import MotionReader
from drivers.realsense.plan import CameraPlan, Figure
from drivers.realsense.profiles import Choice, choose
from drivers.realsense.recorded import RecordedSource
from drivers.realsense.source import Source

POLL_NS = 2_000_000  # librealsense's queues have no descriptor to wait for
LOOK_NS = 100_000_000  # between two looks for a camera that is not there
DEPTH_WAITING = 2  # a queue of old images is of no use
OTHERS_WAITING = 256

Take = Callable[[Any, int], bool]  # says whether the frame is a new one


@dataclass(slots=True)
class Sensor:
    """An opened sensor, the queue of its frames, and who takes them, by the kind of stream."""

    sensor: Any
    queue: Any
    profiles: list[Any] = field(default_factory=list)
    takes: dict[Any, Take] = field(default_factory=dict)


class RealSenseSession:
    """Reads one camera."""

    def __init__(self, plan: CameraPlan, port: Port) -> None:
        """Remember; no camera is touched."""
        self._plan, self._port, self._health = plan, port, port.health
        camera, imu = plan.camera, plan.imu
        self._depth = self._colour = self._motion = None
        if camera is not None:
            self._depth = DepthReader(camera.filters, camera.latency_s, port.frames["depth"])
            if camera.colour_rate_hz > 0.0:
                quality, latency_s = camera.jpeg_quality, camera.latency_s
                self._colour = ColourReader(camera.colour_rate_hz, quality, latency_s, port.frames["colour"])
        if imu is not None:
            self._motion = MotionReader(imu.latency_s, port.rings["motion"])
        self._source: Source | None = None
        self._sensors: list[Sensor] = []
        self._began_ns: int | None = None
        self._heard_ns: dict[str, int] = {}  # when each kind of stream was last heard

    def open(self) -> None:
        """Open the camera; an emulation that may still be on its way is looked for while it is polled.

        Raises:
            DeviceError: it is not there, or has no such streams.
        """
        self._health.state = DeviceState.RECONNECTING
        self._began_ns = None
        self._heard_ns.clear()
        librealsense()  # to load it takes its time, which is here
        with device_errors(self._port.name):
            self._find(0)

    def wakes_on(self) -> tuple[int, ...]:
        """Return nothing: it is polled."""
        return ()

    def next_ns(self, now_ns: int) -> int:
        """Return when to look again."""
        return now_ns + (LOOK_NS if self._source is None else POLL_NS)

    def poll(self, now_ns: int) -> None:
        """Take in what has come.

        Raises:
            DeviceError: the camera is not there, was lost, or is silent.
        """
        if self._began_ns is None:
            self._began_ns = now_ns
        with device_errors(self._port.name):
            if self._source is None and not self._find(now_ns - self._began_ns):
                return
            assert self._source is not None
            self._source.pump()
            over = self._source.is_over and bool(self._heard_ns)  # as it stood before the queues are looked into
            for sensor in self._sensors:
                while frame := sensor.queue.poll_for_frame():
                    self._health.received += 1
                    sensor.takes[frame.get_profile().stream_type()](frame, now_ns)
        self._tell()
        if over:
            self._health.state = DeviceState.ENDED
        else:
            self._judge(now_ns, self._began_ns)

    def send(self, values: NDArray[np.float64], now_ns: int) -> None:
        """Do nothing: a camera takes no orders."""

    def rest(self) -> None:
        """Do nothing: a camera does not move."""

    def clear_faults(self) -> None:
        """Do nothing: it latches none."""

    def close(self) -> None:
        """Close the sensors, also of a camera that is gone."""
        sensors, self._sensors = self._sensors, []
        source, self._source = self._source, None
        for sensor in sensors:
            for let_go in (sensor.sensor.stop, sensor.sensor.close):
                with suppress(RuntimeError):  # it was not started, or is unplugged
                    let_go()
        if source is not None:
            source.close()

    def _find(self, waited_ns: int) -> bool:
        """Open the camera; return whether it is there."""
        source, name = self._plan.source, self._port.name
        try:
            match source.source:
                case "live":
                    self._source = LiveSource(name, source.serial_number)
                case "bag":
                    assert source.path is not None  # the settings see to that
                    self._source = RecordedSource(source.path)
                case "emulated":
                    self._source = EmulatedSource(name, source.memory, self._plan.camera, self._plan.imu)
        except DeviceError:
            if source.source == "emulated" and waited_ns < source.connect_s * 1e9:
                return False
            raise
        self._identify(self._source.device)
        self._start(choose(self._source.device, self._plan, name))
        return True

    def _start(self, choice: Choice) -> None:
        """Open the sensors, and begin with all streams anew."""
        rs = librealsense()
        by_name: dict[str, Sensor] = {}
        for offer in choice.offers:
            key = offer.sensor.get_info(rs.camera_info.name)
            waiting = DEPTH_WAITING if offer is choice.depth else OTHERS_WAITING
            sensor = by_name.setdefault(key, Sensor(offer.sensor, rs.frame_queue(waiting)))
            sensor.profiles.append(offer.profile)
            sensor.takes[offer.profile.stream_type()] = self._taker(offer.profile, choice)
        self._sensors = list(by_name.values())
        for sensor in self._sensors:
            sensor.sensor.open(sensor.profiles)
        for sensor in self._sensors:
            sensor.sensor.start(sensor.queue)

    def _taker(self, profile: Any, choice: Choice) -> Take:
        """Return who takes the frames of a stream, made ready for its beginning."""
        rs = librealsense()
        match profile.stream_type():
            case rs.stream.depth:
                assert self._depth is not None
                self._depth.restart()
                return self._hearing("depth", self._depth.take)
            case rs.stream.color:
                assert self._colour is not None
                self._colour.restart()
                return self._hearing("colour", self._colour.take)
            case rs.stream.gyro:
                assert self._motion is not None
                self._motion.restart(_turn(profile, choice))
                return self._hearing("gyroscope", self._motion.take_gyro)
        assert self._motion is not None
        return self._hearing("accelerometer", self._motion.take_accel)

    def _hearing(self, kind: str, take: Take) -> Take:
        def heard(frame: Any, now_ns: int) -> bool:
            is_new = take(frame, now_ns)
            if is_new:
                self._heard_ns[kind] = now_ns
            return is_new

        return heard

    def _judge(self, now_ns: int, began_ns: int) -> None:
        """Be open when every stream has been heard, and lost when one that steers the robot falls silent."""
        s = self._plan.source
        steering = (["depth"] if self._depth is not None else []) + (["gyroscope"] if self._motion is not None else [])
        unheard = [kind for kind in steering if kind not in self._heard_ns]
        if not unheard:
            self._health.state, self._health.fault = DeviceState.OPEN, ""
        elif now_ns - began_ns > s.connect_s * 1e9:
            raise DeviceError(f"{self._port.name}: no {unheard[0]} came from {s.place} within {s.connect_s:g} s")
        if s.source == "bag":
            return  # a recording may have gaps
        silent = [kind for kind in steering if now_ns - self._heard_ns.get(kind, now_ns) > s.silent_s * 1e9]
        if silent:
            raise DeviceError(f"{self._port.name}: no {silent[0]} has come from {s.place} for {s.silent_s:g} s")

    def _identify(self, device: Any) -> None:
        rs, health = librealsense(), self._health

        def told(info: Any) -> str:
            return str(device.get_info(info)) if device.supports(info) else ""

        usb = told(rs.camera_info.usb_type_descriptor)
        parts = (told(rs.camera_info.name), f"librealsense {rs.__version__}", usb and f"USB {usb}")
        health.protocol = ", ".join(part for part in parts if part)
        health.serial, health.firmware = told(rs.camera_info.serial_number), told(rs.camera_info.firmware_version)

    def _tell(self) -> None:
        depth, motion, figures = self._depth, self._motion, self._health.figures
        if depth is not None:
            figures[Figure.DEPTH_DROPPED], figures[Figure.CLOCK_DRIFT] = depth.stamps.dropped, depth.stamps.drift
        if motion is not None:
            figures[Figure.MOTION_DROPPED] = motion.dropped
        self._health.dropped = (depth.stamps.dropped if depth else 0) + (motion.dropped if motion else 0)


def _turn(gyro: Any, choice: Choice) -> NDArray[np.float64]:
    """Return the rotation (3, 3) from the motion module's axes to the depth stream's optical frame, as the camera tells it."""
    if choice.depth is None:
        return np.eye(3)  # the two are mounted alike
    return np.array(gyro.get_extrinsics_to(choice.depth.profile).rotation).reshape(3, 3).T  # librealsense's is column-major
