"""A device's clock on CLOCK_MONOTONIC: offset and drift, from when its stamps arrive."""

from __future__ import annotations

from collections import deque

SPAN_NS = 1_000_000_000  # of each span only the fastest arrival counts
SPANS = 60
STEADY_SPANS = 10  # before so many are over, the drift is taken for zero
MOST_DRIFT = 300e-6  # crystals are better than 100 ppm, and there are two
EARLY_NS = 50_000_000  # no stamp is so far ahead of its arrival: the device's clock has jumped
BACK_NS = 50_000_000  # frames come in order, and streams that share a clock nearly so

Point = tuple[int, int]  # device time, arrival less device time [ns]


class DeviceClock:
    """Converts a device's stamps.  It is told the arrivals, and never asks for the time.

    An arrival is the stamp plus a delay that varies but is never less than some least one.  The line under all points (stamp,
    arrival - stamp) that is nearest to them tells offset and drift.  Source: Moon, Skelly, Towsley, Estimation and removal of
    clock skew from network delay measurements, INFOCOM 1999, section 3 (their linear program; its optimum is the edge of the
    lower convex hull at the mean stamp).
    """

    def __init__(self, latency_ns: int = 0, wraps_at_ns: int = 0) -> None:
        """Start without knowledge.

        Args:
            latency_ns: from capture to the fastest arrivals, which no stamp can tell.
            wraps_at_ns: where the device's counter begins anew; 0: never.
        """
        self._latency_ns = latency_ns
        self._wraps_at_ns = wraps_at_ns
        self.jumps = 0
        self.restart()

    @property
    def drift(self) -> float:
        """How much slower the device's clock runs than ours, as a fraction."""
        return self._slope

    def restart(self) -> None:
        """Forget everything: it is another clock from now on."""
        self._fastest: deque[Point] = deque(maxlen=SPANS)
        self._base_ns = 0  # what wrapped so far
        self._raw_ns: int | None = None
        self._newest_ns = 0  # stamp
        self._span_ns = 0  # when the newest span began
        self._slope, self._foot_ns, self._offset_ns = 0.0, 0, 0

    def to_host(self, raw_ns: int, arrived_ns: int) -> int:
        """Return when something with this stamp that arrived just now was captured."""
        stamp_ns = self._unwrapped(raw_ns)
        delay_ns = arrived_ns - stamp_ns
        if self._fastest and (delay_ns - self._line(stamp_ns) < -EARLY_NS or stamp_ns < self._newest_ns - BACK_NS):
            self.jumps += 1
            self.restart()
            stamp_ns = self._unwrapped(raw_ns)
            delay_ns = arrived_ns - stamp_ns
        self._newest_ns = max(stamp_ns, self._newest_ns)
        self._learn(stamp_ns, delay_ns)
        return min(stamp_ns + self._line(stamp_ns), arrived_ns) - self._latency_ns

    def _unwrapped(self, raw_ns: int) -> int:
        last, self._raw_ns = self._raw_ns, raw_ns
        if self._wraps_at_ns and last is not None:
            if raw_ns < last - self._wraps_at_ns // 2:
                self._base_ns += self._wraps_at_ns
            elif raw_ns > last + self._wraps_at_ns // 2:  # one that was overtaken by the turn of the counter
                self._base_ns -= self._wraps_at_ns
        return self._base_ns + raw_ns

    def _learn(self, stamp_ns: int, delay_ns: int) -> None:
        if not self._fastest or stamp_ns - self._span_ns >= SPAN_NS:
            self._span_ns = stamp_ns
            self._fastest.append((stamp_ns, delay_ns))
            self._fit()
        elif delay_ns < self._fastest[-1][1]:
            self._fastest[-1] = (stamp_ns, delay_ns)
            self._fit()

    def _fit(self) -> None:
        points = tuple(self._fastest)
        if len(points) < STEADY_SPANS:
            self._slope, (self._foot_ns, self._offset_ns) = 0.0, min(points, key=lambda point: point[1])
            return
        (x0, y0), (x1, y1) = _edge_below(points)
        self._slope = min(max((y1 - y0) / (x1 - x0), -MOST_DRIFT), MOST_DRIFT)
        self._foot_ns, self._offset_ns = x0, y0

    def _line(self, stamp_ns: int) -> int:
        return self._offset_ns + round(self._slope * (stamp_ns - self._foot_ns))


def _edge_below(points: tuple[Point, ...]) -> tuple[Point, Point]:
    """Return the edge of the lower convex hull over the mean of the points, which are at least two, in order of time.

    >>> _edge_below(((0, 2), (10, 9), (20, 1), (30, 5)))
    ((0, 2), (20, 1))
    """
    hull: list[Point] = []
    for point in points:
        while len(hull) > 1 and _turns_right(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    mean_ns = sum(point[0] for point in points) / len(points)
    end = next(index for index, point in enumerate(hull) if index and point[0] >= mean_ns)
    return hull[end - 1], hull[end]


def _turns_right(a: Point, b: Point, c: Point) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) <= (c[0] - a[0]) * (b[1] - a[1])
