"""What all streams of a camera have in common: numbers and stamps of their frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivers.realsense.device_clock import DeviceClock
from drivers.realsense.numbering import Numbering

COUNTER_NS = 2**32 * 1000  # a D400's clock counts microseconds in 32 bits


def camera_clock(latency_s: float) -> DeviceClock:
    """Return the clock of a sensor whose fastest frames arrive `latency_s` after their capture."""
    return DeviceClock(round(latency_s * 1e9), COUNTER_NS)


@dataclass(frozen=True, slots=True)
class FrameStamp:
    """When a frame was captured and read, on CLOCK_MONOTONIC, its number, and the domain of its own stamp."""

    captured_ns: int
    received_ns: int
    sequence: int
    domain: int

    @property
    def row(self) -> tuple[int, int, int, int]:
        """The first fields of every record."""
        return self.captured_ns, self.received_ns, self.sequence, self.domain


class FrameStamps:
    """Stamps the frames of one stream, and counts those that were lost or came twice.

    A better guess of the clock neither turns time back nor presses frames together: they stay half as far apart as the device
    says, until the new line is reached.
    """

    def __init__(self, clock: DeviceClock, first: int) -> None:
        """Number from `first`; streams of one sensor share a clock."""
        self._numbering = Numbering(first)
        self._clock = clock
        self._domain: int | None = None
        self._newest_ns = -(2**62)
        self._device_ns = 0  # the newest frame's own stamp
        self.repeated = 0

    @property
    def dropped(self) -> int:
        """Lost on the way, or came twice."""
        return self._numbering.lost + self.repeated

    @property
    def drift(self) -> float:
        """Of the stream's clock, as a fraction."""
        return self._clock.drift

    def restart(self) -> None:
        """Expect another beginning of the counter: the camera was opened anew.  What is known of its clock still holds."""
        self._numbering.restart()

    def take(self, frame: Any, now_ns: int) -> FrameStamp | None:
        """Return the stamp of an `rs.frame` that was read now, or None for one that had come already."""
        sequence = self._numbering.take(frame.get_frame_number())
        if sequence is None:
            self.repeated += 1
            return None
        domain = int(frame.get_frame_timestamp_domain())
        if domain != self._domain:  # a camera changes it when it has found out how its clock and the system's belong together
            self._domain = domain
            self._clock.restart()
        device_ns, jumps = round(frame.get_timestamp() * 1e6), self._clock.jumps
        captured_ns = self._clock.to_host(device_ns, now_ns)
        apart_ns = device_ns - self._device_ns if self._clock.jumps == jumps else 0
        self._device_ns = device_ns
        self._newest_ns = max(captured_ns, self._newest_ns + 1, min(self._newest_ns + apart_ns // 2, now_ns))
        return FrameStamp(min(self._newest_ns, now_ns), now_ns, sequence, domain)
