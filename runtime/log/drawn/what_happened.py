"""The layout for "what happened": the scene on the left; what was sensed, believed, commanded and said on the right and below."""

from __future__ import annotations

import rerun.blueprint as rrb

from runtime.log.drawn import arm, plots, scene, timing, views
from runtime.log.header import RunHeader

NAME = "What happened"
_CLEARANCE_SHOWN_M = (-0.2, 2.5)  # further away is as good as free
_UNITS = {"vx": "m/s", "vy": "m/s", "wz": "rad/s"}
_BEHIND: views.Eye = ((-3.0, -1.3, 2.7), (0.8, 0.0, 0.1), (0.0, 0.0, 1.0))
_BESIDE: views.Eye = ((1.9, -1.6, 1.5), (0.25, 0.0, 0.35), (0.0, 0.0, 1.0))  # an arm's reach away
_ABOVE: views.Eye = ((0.0, -0.01, 4.6), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def layout(header: RunHeader) -> rrb.Horizontal:
    """Return the layout, without views of what the robot does not have."""
    rows: list[rrb.Container | rrb.View] = []
    if "camera" in header.devices:
        rows.append(rrb.Horizontal(rrb.Tabs(_depth(), _colour(), active_tab=0), _clearance(header)))
    if "base" in header.devices:
        rows.append(rrb.Horizontal(*(views.plot(f"{axis} [{_UNITS[axis]}]", f"/view/command/{axis}") for axis in plots.AXES)))
    if header.arm is not None:
        rows += [_joints(), rrb.Horizontal(*_joint_rates())]
    return rrb.Horizontal(
        rrb.Vertical(_scene(header), rrb.Vertical(views.responses(), views.words(), row_shares=[2, 3]), row_shares=[3.4, 1.2]),
        rrb.Vertical(*rows, rrb.Horizontal(_clearances(), _reasons(header))),
        column_shares=[5, 4],
        name=NAME,
    )


def _scene(header: RunHeader) -> rrb.Spatial3DView:
    contents = [f"{scene.MAP}/**", scene.DEPTH, f"- {scene.ODOM}/clearance", f"- {scene.ODOM}/rate", f"- {scene.MAP}/truth"]
    eye = _BESIDE if header.arm is not None and "base" not in header.devices else _BEHIND
    return views.scene("Scene", scene.MAP, contents, scene.FOCUS, eye, [f"{scene.MAP}/trail"])


def _clearance(header: RunHeader) -> rrb.Spatial3DView:
    body = ("base/body", "base/heading") if "base" in header.devices else ()  # of an arm there are its links, in the scene
    shown = [f"{scene.ODOM}/{name}" for name in ("clearance", "rate", "plan", "route", "drawn/**", *body, "tracks/**")]
    contents = [*shown, f"{scene.MAP}/movers/**", f"{scene.MAP}/goals", f"{scene.MAP}/trail"]
    return views.scene("Clearance field, from above", scene.MAP, contents, scene.FOCUS, _ABOVE, [f"{scene.MAP}/trail"])


def _depth() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(name=f"Depth, 0 to {scene.DEPTH_SHOWN_M:g} m", origin=scene.DEPTH, background=views.BACKGROUND)


def _colour() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(name="Colour", origin=scene.COLOUR, background=views.BACKGROUND)


def _joints() -> rrb.TimeSeriesView:
    return views.plot("joint positions and set points [rad]", arm.POSITION, arm.SET_POINT)


def _joint_rates() -> tuple[rrb.TimeSeriesView, rrb.TimeSeriesView]:
    return views.plot("joint velocities [rad/s]", arm.VELOCITY), views.plot("joint torques [Nm]", arm.TORQUE)


def _clearances() -> rrb.TimeSeriesView:
    return views.plot("clearance [m]", plots.CLEARANCE, shown=_CLEARANCE_SHOWN_M)


def _reasons(header: RunHeader) -> rrb.Tabs:
    first = ("speed [m/s]", plots.SPEED) if "base" in header.devices else ("stage times [ms]", timing.STAGE_TIMES)
    return rrb.Tabs(views.plot(*first), views.plot("planner", plots.PLANNER), views.plot("shield", plots.SHIELD))
