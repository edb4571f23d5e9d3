"""The three-dimensional scene: map, odom, base and camera as nested frames, and what lies in each of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from drivers.interface.geometry import SE2, SE3
from drivers.interface.mission import Goal
from drivers.interface.samples import ColourFrame, Intrinsics
from runtime.cycle import Cycle
from runtime.log.drawn import arm, colours, shapes, tracks
from runtime.log.drawn.layers import EQUAL, IDENTICAL, Layer, Rows, Static
from runtime.log.drawn.maps import clearance_columns, grid_columns, rate_columns
from runtime.log.exact import rvl
from runtime.log.header import RunHeader
from runtime.log.settings import LogSettings

MAP = "/view/map"
FOCUS = f"{MAP}/focus"  # moves with the robot and keeps the heading of the start: what the eyes of the layout hang on
ODOM = f"{MAP}/odom"
BASE = f"{ODOM}/base"
CAMERA = f"{BASE}/camera"
ARM = f"{BASE}/arm"
DEPTH = "/replay/sensed/depth"  # the exact image is also the one that is shown
DEPTH_SHOWN_M = 6.0  # the last colour
COLOUR = "/view/colour"
_IMAGE_FRAME = "depth_image"
_PATH_Z_M = 0.02  # paths lie just above the grid

Camera = tuple[Intrinsics, SE3]


def static(header: RunHeader) -> Static:
    """Return the axes of the map and everything that never moves."""
    return [(MAP, rr.ViewCoordinates.RIGHT_HAND_Z_UP), *shapes.solids(f"{MAP}/static", header.static)]


def layers(header: RunHeader, settings: LogSettings) -> list[Layer[Any]]:
    """Return what is drawn of each cycle."""
    often = round(1e9 / settings.view_rate_hz)
    return [
        Layer(lambda c: c.belief.map_from_odom, Rows(ODOM, _poses), EQUAL),
        Layer(_focus, Rows(FOCUS, _poses)),
        Layer(lambda c: c.belief.odom_from_base, Rows(BASE, _poses, shapes.robot(BASE, header))),
        Layer(_camera, Rows(CAMERA, _cameras), EQUAL),
        Layer(_depth_unit, Rows(DEPTH, _depth_scales, _depth_style()), EQUAL),
        Layer(lambda c: c.sensed.colour, Rows(COLOUR, _pictures)),
        Layer(lambda c: c.belief.grid, Rows(f"{ODOM}/grid", grid_columns), IDENTICAL, often),
        Layer(lambda c: c.belief.clearance, Rows(f"{ODOM}/clearance", clearance_columns), IDENTICAL, often),
        Layer(lambda c: c.belief.clearance, Rows(f"{ODOM}/rate", rate_columns), IDENTICAL, often),
        Layer(lambda c: c.route.path_in_odom, path(f"{ODOM}/route", colours.ROUTE, 0.012), IDENTICAL, often),
        Layer(lambda c: c.plan.path_in_odom, path(f"{ODOM}/plan", colours.ASKED, 0.02), IDENTICAL, often),
        Layer(lambda c: c.sensed.mission.goals, _goals(f"{MAP}/goals"), EQUAL),
        Layer(lambda c: c.belief.map_from_base, _dots(f"{MAP}/trail", colours.SENT)),
        Layer(_truth, _dots(f"{MAP}/truth", colours.TRUTH)),
        *shapes.movers(f"{MAP}/movers", header.movers),
        *tracks.layers(f"{ODOM}/tracks", often),
        *(arm.layers(ARM, header.arm) if header.arm is not None else ()),
    ]


def _focus(cycle: Cycle) -> SE2:
    pose = cycle.belief.map_from_base
    return SE2(pose.x, pose.y, cycle.sensed.mission.map_from_start.yaw)


def _truth(cycle: Cycle) -> SE2 | None:
    return cycle.sensed.truth.map_from_base if cycle.sensed.truth is not None else None


def _camera(cycle: Cycle) -> Camera | None:
    depth = cycle.sensed.depth
    return (depth.intrinsics, depth.base_from_optical) if depth is not None else None


def _depth_unit(cycle: Cycle) -> float | None:
    return cycle.sensed.depth.depth_unit_m if cycle.sensed.depth is not None else None


def _poses(poses: list[SE2]) -> rr.ComponentColumnList:
    return rr.Transform3D.columns(
        translation=[(pose.x, pose.y, 0.0) for pose in poses],
        quaternion=[(0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)) for pose in poses],
    )


def _cameras(cameras: list[Camera]) -> list[rr.ComponentColumn]:
    """Return where the camera sits, and how its image plane hangs on it."""
    poses = [pose for _, pose in cameras]
    return [
        *rr.Transform3D.columns(
            translation=[(pose.x, pose.y, pose.z) for pose in poses],
            quaternion=[(pose.qx, pose.qy, pose.qz, pose.qw) for pose in poses],
        ),
        *rr.Pinhole.columns(
            image_from_camera=[[[i.fx, 0, i.cx], [0, i.fy, i.cy], [0, 0, 1]] for i, _ in cameras],
            resolution=[(i.width, i.height) for i, _ in cameras],
            child_frame=[_IMAGE_FRAME] * len(cameras),
            parent_frame=[f"tf#{CAMERA}"] * len(cameras),
            image_plane_distance=[0.35] * len(cameras),
        ),
    ]


def _depth_scales(units_m: list[float]) -> rr.ComponentColumnList:
    return rr.EncodedDepthImage.columns(
        meter=[1.0 / unit for unit in units_m],
        depth_range=[(0.0, DEPTH_SHOWN_M / unit) for unit in units_m],
    )


def _pictures(frames: list[ColourFrame]) -> rr.ComponentColumnList:
    return rr.EncodedImage.columns(blob=[frame.jpeg for frame in frames], media_type=["image/jpeg"] * len(frames))


def _depth_style() -> Static:
    style = rr.EncodedDepthImage.from_fields(media_type=rvl.MEDIA_TYPE, colormap="Turbo", point_fill_ratio=0.6)
    return [(DEPTH, rr.CoordinateFrame(_IMAGE_FRAME)), (DEPTH, style)]


def _dots(entity: str, colour: colours.Rgb) -> Rows[SE2]:
    def columns(poses: list[SE2]) -> rr.ComponentColumnList:
        return rr.Points3D.columns(positions=[(pose.x, pose.y, _PATH_Z_M) for pose in poses])

    return Rows(entity, columns, [(entity, rr.Points3D.from_fields(colors=[colour], radii=[0.015]))])


def path(entity: str, colour: colours.Rgb, radius_m: float) -> Rows[NDArray[np.float64]]:
    """Return rows of paths in the entity's frame, each shape (n, 2) [m]."""

    def columns(paths: list[NDArray[np.float64]]) -> rr.ComponentColumnList:
        return rr.LineStrips3D.columns(strips=[np.c_[path, np.full(len(path), _PATH_Z_M)] for path in paths])

    return Rows(entity, columns, [(entity, rr.LineStrips3D.from_fields(colors=[colour], radii=[radius_m]))])


def _goals(entity: str) -> Rows[tuple[Goal, ...]]:
    def columns(missions: list[tuple[Goal, ...]]) -> rr.ComponentColumnList:
        goals = [goal for mission in missions for goal in mission]
        return rr.Cylinders3D.columns(
            centers=[(goal.x_m, goal.y_m, 0.006) for goal in goals],
            radii=[goal.tolerance_m for goal in goals],
            lengths=[0.004] * len(goals),
        ).partition([len(mission) for mission in missions])

    style = rr.Cylinders3D.from_fields(colors=[colours.GOAL], fill_mode="solid")
    return Rows(entity, columns, [(entity, style)])
