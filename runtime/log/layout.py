"""The layout that is embedded in every recording, made for one question: what happened."""

from __future__ import annotations

import rerun.blueprint as rrb

from runtime.log import events, plots, scene
from runtime.log.header import RunHeader

_BACKGROUND = (16, 18, 24)
_CLEARANCE_M = (-0.2, 2.5)  # shown; further away is as good as free


def layout(header: RunHeader) -> rrb.Blueprint:
    """Return the layout: the scene on the left; what was sensed, believed, commanded and went wrong on the right."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_scene(header), _events(), row_shares=[4, 1]),
            rrb.Vertical(
                rrb.Horizontal(_depth(), _clearance()),
                _commands(),
                rrb.Horizontal(
                    _series("/view/clearance", "clearance [m]", (-0.2, 2.5)), _series("/timing/stages", "stage times [ms]")
                ),
                row_shares=[3, 2.4, 2.6],
            ),
            column_shares=[5, 4],
        ),
        rrb.TimePanel(timeline="mono", state="collapsed"),
        collapse_panels=True,
    )


def _scene(header: RunHeader) -> rrb.Spatial3DView:
    hidden = [f"- {scene.ODOM}/clearance", f"- {scene.MAP}/truth"]
    return rrb.Spatial3DView(
        name="Scene",
        origin=scene.MAP,
        contents=[f"{scene.MAP}/**", scene.DEPTH, *hidden],
        spatial_information=rrb.SpatialInformation(target_frame=f"tf#{scene.FOCUS}"),
        background=_BACKGROUND,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(kind="Orbital", position=(-3.0, -1.3, 2.7), look_target=(0.8, 0.0, 0.1), eye_up=(0, 0, 1)),
        overrides={f"{scene.MAP}/trail": _whole_past()},
    )


def _clearance() -> rrb.Spatial3DView:
    shown = [f"{scene.ODOM}/{name}" for name in ("clearance", "plan", "route", "base/body", "base/heading")]
    return rrb.Spatial3DView(
        name="Clearance field, from above",
        origin=scene.MAP,
        contents=[*shown, f"{scene.MAP}/movers/**", f"{scene.MAP}/goals", f"{scene.MAP}/trail"],
        spatial_information=rrb.SpatialInformation(target_frame=f"tf#{scene.FOCUS}"),
        background=_BACKGROUND,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(kind="Orbital", position=(0.0, -0.01, 4.6), look_target=(0.0, 0.0, 0.0), eye_up=(1, 0, 0)),
        overrides={f"{scene.MAP}/trail": _whole_past()},
    )


def _whole_past() -> rrb.VisibleTimeRanges:
    return rrb.VisibleTimeRanges(
        [
            rrb.VisibleTimeRange(name, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative())
            for name in ("tick", "mono")
        ]
    )


def _depth() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(name=f"Depth, 0 to {scene.DEPTH_SHOWN_M:g} m", origin=scene.DEPTH, background=_BACKGROUND)


def _commands() -> rrb.Horizontal:
    units = {"vx": "m/s", "vy": "m/s", "wz": "rad/s"}
    return rrb.Horizontal(*(_series(f"/view/command/{axis}", f"{axis} [{units[axis]}]") for axis in plots.AXES))


def _series(entity: str, name: str, shown: tuple[float, float] | None = None) -> rrb.TimeSeriesView:
    axis = rrb.ScalarAxis(range=shown) if shown is not None else None
    return rrb.TimeSeriesView(name=name, origin=entity, plot_legend=rrb.PlotLegend("LeftTop"), axis_y=axis)


def _events() -> rrb.Vertical:
    return rrb.Vertical(
        rrb.StateTimelineView(name="Response", origin=events.RESPONSE),
        rrb.TextLogView(
            name="Faults and events",
            origin=events.EVENTS,
            columns=rrb.TextLogColumns(timeline_columns=["tick"], text_log_columns=["LogLevel", "Body"]),
        ),
        row_shares=[2, 3],
    )
