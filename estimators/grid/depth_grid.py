"""From a depth image to a labelled grid: the deterministic raw branch of Cui, Deng, Wang, appendix D.3.

Where the paper leaves a choice, or its figure does not carry over:

- A depth of 0 is not a ray without a hit: the camera does not know, and the cell stays unknown.  Free space is proven only
  by valid depths, each up to its return, as long as its ray runs inside the slab; that also holds for rays that end at the
  floor, the ceiling or beyond the range.
- The paper suppresses components of fewer than 8 cells.  Seen at 160x90, a walker of 0.3 m at 0.8 to 2.4 m covers 5 to 12
  cells and a leg of 0.1 m only 2 to 4, whereas noise that gets two returns into one cell rarely does so into two
  neighbours: the default is 2 cells, 2 returns each.
- A wall seen at a shallow angle lies cell behind cell on one ray; it does not count as hidden by itself (`is_hidden`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.sensed import Sensed
from drivers.interface.settings import Settings
from estimators.belief import F64, U8, Mask
from estimators.grid.depth_kernels import collect_depth, outline_blind
from estimators.grid.grid_filter import GridFilterSettings
from estimators.grid.labelling import FrameLabels, label_frame, lattice_in_reach

SATURATED = 65_535  # what an overflowing depth value is clipped to; not a measurement


class DepthGridSettings(Settings):
    """How depth becomes cells."""

    slab_low_m: float = Field(default=-0.1, ge=-3.0, le=0.0, description="lower edge of the slab, from the camera's height")
    slab_high_m: float = Field(default=0.1, ge=0.0, le=3.0, description="upper edge of the slab, from the camera's height")
    range_min_m: float = Field(default=0.3, gt=0.0, le=2.0, description="depths below are not trusted")
    range_max_m: float = Field(default=2.5, gt=0.2, le=20.0, description="how far from the camera cells are labelled")
    blind_range_m: float = Field(default=0.6, ge=0.0, le=2.0, description="depth within which an obstacle may give no return")
    depth_max_m: float = Field(default=20.0, gt=0.2, le=65.0, description="depths beyond are outliers and say nothing")
    hits_min: int = Field(default=2, ge=1, le=1000, description="returns that make a cell occupied")
    component_cells_min: int = Field(default=2, ge=1, le=100, description="smaller groups of occupied cells are noise")
    filtered: bool = Field(default=False, description="whether far labels are filtered (appendix D.3, step 7)")
    filter: GridFilterSettings = GridFilterSettings()


def is_sound(frame: DepthFrame) -> bool:
    """Tell whether a frame can be projected: pose, intrinsics and unit finite, and the image of the size they are for.

    A camera below the ground is none: a frame that claims it would make obstacles of the floor.
    """
    k, pose = frame.intrinsics, frame.base_from_optical
    numbers = (k.fx, k.fy, k.cx, k.cy, frame.depth_unit_m, pose.x, pose.y, pose.z, pose.qw, pose.qx, pose.qy, pose.qz)
    return (
        all(math.isfinite(number) for number in numbers)
        and min(k.fx, k.fy, frame.depth_unit_m, frame.depth.size) > 0.0
        and pose.z >= 0.0
        and frame.depth.dtype == np.uint16
        and frame.depth.shape == (k.height, k.width)
        and abs(pose.qw**2 + pose.qx**2 + pose.qy**2 + pose.qz**2 - 1.0) < 1e-3
    )


def _rotation_about_z(yaw: float) -> F64:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


class DepthGrid:
    """Labels the cells around the camera from one frame; keeps nothing between frames."""

    def __init__(self, settings: DepthGridSettings, cell_m: float) -> None:
        """Cells of `cell_m`, aligned with odom."""
        self._settings = settings
        self._cell_m = cell_m

    def warm_up(self) -> None:
        """Compile every kernel, on a frame that knows nothing."""
        nothing = np.zeros((4, 4), dtype=np.uint16)
        pinhole = Intrinsics(4, 4, 4.0, 4.0, 2.0, 2.0)
        self.label(DepthFrame(Stamp(0, 0, 0), nothing, 0.001, pinhole, BODY_FROM_OPTICAL), SE2())

    def stamp(self, sensed: Sensed) -> Stamp | None:
        """Return the stamp of the frame that came; None: none came."""
        return None if sensed.depth is None else sensed.depth.stamp

    def see(self, sensed: Sensed, odom_from_base: SE2) -> FrameLabels | None:
        """Return what that frame says; None: it is not sound."""
        if sensed.depth is None or not is_sound(sensed.depth):
            return None
        return self.label(sensed.depth, odom_from_base)

    def label(self, frame: DepthFrame, odom_from_base: SE2) -> FrameLabels:
        """Return what a sound frame says, taken from the robot's pose at its capture."""
        settings, cell_m = self._settings, self._cell_m
        x, y = odom_from_base.apply(frame.base_from_optical.translation[:2])
        rotation = _rotation_about_z(odom_from_base.yaw) @ frame.base_from_optical.rotation
        lattice = lattice_in_reach(x, y, settings.range_max_m, cell_m)
        camera = ((x - lattice.x_m) / cell_m, (y - lattice.y_m) / cell_m)
        hits = np.zeros((lattice.rows, lattice.columns), dtype=np.int32)
        free_ends = np.zeros((lattice.rows, lattice.columns), dtype=np.uint8)
        clear_m = np.zeros(frame.depth.shape[1])
        self._collect(frame, rotation, camera, hits, free_ends, clear_m)
        grid = label_frame(lattice, hits, free_ends, camera, settings.hits_min, settings.component_cells_min)
        return FrameLabels(grid, frozen_array(self._blind(frame, rotation, camera, clear_m, grid.label.shape)))

    def _collect(
        self,
        frame: DepthFrame,
        rotation: F64,
        camera: tuple[float, float],
        hits: NDArray[np.int32],
        free_ends: U8,
        clear_m: F64,
    ) -> None:
        settings, k, unit = self._settings, frame.intrinsics, frame.depth_unit_m
        depth = np.ascontiguousarray(frame.depth).view()
        depth.flags.writeable = False  # one compiled kernel serves both kinds of array
        nearest = max(1, math.ceil(settings.range_min_m / unit))
        farthest = min(SATURATED - 1, math.floor(settings.depth_max_m / unit))
        collect_depth(
            depth,
            (nearest, farthest),
            float(unit),
            (float(k.fx), float(k.fy), float(k.cx), float(k.cy)),  # integers would compile another kernel
            rotation,
            camera,
            self._cell_m,
            (settings.slab_low_m, settings.slab_high_m),
            (settings.range_min_m, settings.range_max_m),
            hits,
            free_ends,
            clear_m,
        )

    def _blind(self, frame: DepthFrame, rotation: F64, camera: tuple[float, float], clear_m: F64, shape: tuple[int, ...]) -> Mask:
        k, blind = frame.intrinsics, np.zeros(shape, dtype=np.bool_)
        level = math.hypot(rotation[0, 2], rotation[1, 2])
        if level > 1e-3:  # a camera that looks straight down has no direction along the floor
            forward = (float(rotation[0, 2] / level), float(rotation[1, 2] / level))
            reach_cells = self._settings.blind_range_m / self._cell_m
            outline_blind(camera, forward, (float(k.fx), float(k.cx)), clear_m / self._cell_m, reach_cells, blind)
        return blind
