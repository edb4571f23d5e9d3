"""What can be measured of a run from its log: latency and age of what was sensed, time, error, effort, clearance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import wrap_angle
from runtime.cycle import STAGES
from runtime.log.drawn import plots, timing
from runtime.log.reading.read import Log, read

F64 = NDArray[np.float64]
_DEVICES = {  # entity of its samples
    "camera": "depth", "imu": "imu", "base": "base", "arm": "joints", "scan": "scans", "markers": "markers"
}  # fmt: skip
_BASE_AXES = ("vx", "vy", "wz")
_POSE = ("x", "y", "yaw")


@dataclass(frozen=True, slots=True)
class Quantity:
    """Values of one quantity over a run, all finite, at least one."""

    unit: str
    values: F64  # (n,)
    low_is_bad: bool = False
    repeats: bool = True  # False: one path through time (a drift, an approach), which no resampling makes many of


def quantities(path: Path) -> dict[str, Quantity]:
    """Return what a log tells, by name, in a fixed order; what it does not hold is not there.

    Raises:
        ConfigurationError: the file is not a log of ours, damaged, or holds no tick.
    """
    log = read(path)
    if not log.ticks:
        raise ConfigurationError(f"the log {path} holds no tick to compare")
    found: dict[str, Quantity] = {}
    for name, quantity in _each(log):
        finite = quantity.values[np.isfinite(quantity.values)]
        if len(finite):
            found[name] = replace(quantity, values=finite)
    return found


def _each(log: Log) -> Iterator[tuple[str, Quantity]]:
    for device, entity in _DEVICES.items():
        yield f"{device} latency", Quantity("ms", _latencies_ms(log, f"/replay/sensed/{entity}"))
    start = _column(log, "/replay/sensed/tick", "start_ns") + _column(log, "/replay/sensed/tick", "lateness_ns")
    oldest = _column(log, "/replay/verdict", "command.oldest_input_ns")
    yield "oldest input's age", Quantity("ms", (start - oldest) / 1e6)
    yield "tick lateness", Quantity("ms", _column(log, "/replay/sensed/tick", "lateness_ns") / 1e6)
    stages = _rows(log, timing.STAGE_TIMES, "Scalars:scalars", len(STAGES))
    for index, stage in enumerate(STAGES):
        yield f"{stage} time", Quantity("ms", stages[:, index])
    yield from _effort(log)
    error, true = _pose_error(log), _column(log, "/replay/sensed/truth", "clearance_m")
    believed = _rows(log, plots.CLEARANCE, "Scalars:scalars", 2)[:, 0]
    yield "position error", Quantity("m", np.hypot(error[:, 0], error[:, 1]), repeats=False)
    yield "heading error", Quantity("rad", np.abs(error[:, 2]), repeats=False)
    yield "true clearance", Quantity("m", true, low_is_bad=True, repeats=False)
    yield "believed clearance", Quantity("m", believed, low_is_bad=True, repeats=False)


def _effort(log: Log) -> Iterator[tuple[str, Quantity]]:
    """Yield what the base was made to do: of the commands sent, as vectors in its own frame."""
    seconds = _column(log, "/replay/sensed/tick", "start_ns") / 1e9
    sent = np.stack([_column(log, "/replay/verdict", f"command.base.{axis}") for axis in _BASE_AXES], axis=1)  # (n, 3)
    acceleration = np.diff(sent, axis=0) / np.diff(seconds)[:, None]
    jerk = np.diff(acceleration, axis=0) / np.diff(seconds)[1:, None]
    for name, unit, vectors in (("speed", "m/s", sent), ("acceleration", "m/s^2", acceleration), ("jerk", "m/s^3", jerk)):
        yield name, Quantity(unit, np.hypot(vectors[:, 0], vectors[:, 1]))
    yield "turn rate", Quantity("rad/s", np.abs(sent[:, 2]))


def _pose_error(log: Log) -> F64:
    """Return the believed pose as seen from the true one, x, y, yaw, shape (n, 3) [m, m, rad]."""
    odom = _poses(log, "/replay/belief", "odom_from_base")
    correction = _poses(log, "/replay/belief", "map_from_odom")
    true = _poses(log, "/replay/sensed/truth", "map_from_base")
    believed = _composed(correction, odom)
    c, s = np.cos(true[:, 2]), np.sin(true[:, 2])
    dx, dy = believed[:, 0] - true[:, 0], believed[:, 1] - true[:, 1]
    turned = np.array([wrap_angle(angle) for angle in believed[:, 2] - true[:, 2]])
    return np.stack((c * dx + s * dy, c * dy - s * dx, turned), axis=1)


def _composed(a: F64, b: F64) -> F64:
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    x, y = a[:, 0] + c * b[:, 0] - s * b[:, 1], a[:, 1] + s * b[:, 0] + c * b[:, 1]
    return np.stack((x, y, a[:, 2] + b[:, 2]), axis=1)


def _poses(log: Log, entity: str, name: str) -> F64:
    return np.stack([_column(log, entity, f"{name}.{part}") for part in _POSE], axis=1)


def _latencies_ms(log: Log, entity: str) -> F64:
    """Return from taking a sample to having it, of all samples [ms]; a device of several kinds of samples has them all."""
    parts = []
    for name in log.entities.get(entity, {}):
        if name.endswith("stamp.captured_ns"):
            captured = log.history(entity, name)
            received = log.history(entity, name.replace("captured", "received"))
            parts += [np.asarray(received[tick]) - np.asarray(captured[tick]) for tick in captured if tick in received]
    return np.concatenate(parts) / 1e6 if parts else np.zeros(0)


def _column(log: Log, entity: str, name: str) -> F64:
    """Return one value a tick, shape (ticks,); NaN where there is none."""
    return _rows(log, entity, name, 1)[:, 0]


def _rows(log: Log, entity: str, name: str, width: int) -> F64:
    """Return `width` values a tick, shape (ticks, width); NaN where there are none."""
    history = log.history(entity, name)
    rows = np.full((len(log.ticks), width), np.nan)
    for row, tick in enumerate(log.ticks):
        if tick in history and len(history[tick]) == width:
            rows[row] = history[tick]
    return rows
