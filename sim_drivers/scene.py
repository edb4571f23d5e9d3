"""What stands and moves in a simulated world, as plain data; the world turns it into MuJoCo, the viewer into boxes."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2, SE3
from drivers.interface.mission import Goal

if TYPE_CHECKING:
    from drivers.interface.marker_detector import DictionaryName


class Kind(enum.Enum):
    """The two shapes that everything in a scene is made of."""

    BOX = "box"
    CYLINDER = "cylinder"


@dataclass(frozen=True, slots=True)
class Shape:
    """An upright solid: a box by its half extents x, y, z [m], or a cylinder by its radius (x and y alike) and half height."""

    kind: Kind
    half_extents_m: tuple[float, float, float]

    @classmethod
    def box(cls, length_m: float, width_m: float, height_m: float) -> Shape:
        """Return a box by its full lengths along x, y and z."""
        return cls(Kind.BOX, (length_m / 2, width_m / 2, height_m / 2))

    @classmethod
    def cylinder(cls, radius_m: float, height_m: float) -> Shape:
        """Return an upright cylinder."""
        return cls(Kind.CYLINDER, (radius_m, radius_m, height_m / 2))

    @property
    def bounding_radius_m(self) -> float:
        """Radius of the smallest circle around the centre that holds the footprint."""
        x, y, _ = self.half_extents_m
        return x if self.kind is Kind.CYLINDER else float(np.hypot(x, y))


@dataclass(frozen=True, slots=True)
class StaticObstacle:
    """Something that stands on the floor (or hangs at `base_z_m`) and never moves."""

    name: str
    shape: Shape
    map_from_shape: SE2
    base_z_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Mover:
    """A walker, a door, a cart: a solid on a prescribed way, linear between key frames, resting before and after.

    It is pushed by nothing.  Key frames are (t [s], x [m], y [m], yaw [rad]), shape (n, 4), with t increasing; a looped one
    starts again after the last.
    """

    name: str
    shape: Shape
    keyframes: NDArray[np.float64]  # (n, 4)
    looped: bool = False

    def pose_at(self, time_s: float) -> SE2:
        """Return the pose in the map at a time of the run."""
        low, high, t = self._around(time_s)
        if low is high:
            return SE2(*low[1:])
        span, since = high[0] - low[0], t - low[0]
        x, y, yaw = ((h - v) / span * since + v for v, h in zip(low[1:], high[1:], strict=True))
        return SE2(x, y, yaw)

    def velocity_at(self, time_s: float) -> tuple[float, float]:
        """Return the velocity of the centre in the map [m/s]; at a key frame, of what follows."""
        low, high, _ = self._around(time_s)
        if low is high:
            return (0.0, 0.0)
        span = high[0] - low[0]
        return ((high[1] - low[1]) / span, (high[2] - low[2]) / span)

    def _around(self, time_s: float) -> tuple[list[float], list[float], float]:
        """Return the key frames before and after a time, one and the same before the first and after the last, and the time."""
        t, frames = self._wrapped(time_s), self.keyframes
        after = int(frames[:, 0].searchsorted(t, side="right"))
        before = max(after - 1, 0)
        low = frames[before].tolist()
        return low, low if after in (0, len(frames)) else frames[after].tolist(), t

    def _wrapped(self, time_s: float) -> float:
        start, end = float(self.keyframes[0, 0]), float(self.keyframes[-1, 0])
        return start + (time_s - start) % (end - start) if self.looped and time_s > start else time_s


@dataclass(frozen=True, slots=True)
class Conveyor:
    """A belt along its own x axis; its top lies at the shape's full height.

    The items are free bodies: they stand where they are given only until the belt, or the robot, moves them.
    """

    name: str
    shape: Shape
    map_from_belt: SE2
    speed_m_s: float
    items: tuple[StaticObstacle, ...] = ()


@dataclass(frozen=True, slots=True)
class MarkerPlate:
    """A square fiducial marker, printed with a white margin, that sticks on something of the scene.

    The marker's frame has its origin in the middle, x to the right and y upwards as printed, z out of the plate.
    """

    carrier: str  # the name of the obstacle, mover or conveyor's item; its origin is the solid's centre
    carrier_from_marker: SE3
    side_m: float  # of the black square
    identity: int
    dictionary: DictionaryName = "4X4_50"


@dataclass(frozen=True, slots=True)
class Scene:
    """A scenario that has been drawn for one seed."""

    name: str
    map_from_start: SE2
    goals: tuple[Goal, ...]
    time_limit_s: float
    static: tuple[StaticObstacle, ...]
    movers: tuple[Mover, ...] = ()
    conveyors: tuple[Conveyor, ...] = ()
    markers: tuple[MarkerPlate, ...] = ()
