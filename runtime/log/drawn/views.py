"""The kinds of views that the layouts are put together from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import rerun.blueprint as rrb

from runtime.log.drawn import events

BACKGROUND = (16, 18, 24)
Position = tuple[float, float, float]
Eye = tuple[Position, Position, Position]  # where it is, what it looks at, which way is up


def plot(name: str, *entities: str, shown: tuple[float, float] | None = None) -> rrb.TimeSeriesView:
    """Return a plot of entities over time, the same span in all plots; `shown` fixes the values' span."""
    return rrb.TimeSeriesView(
        name=name,
        origin=entities[0],
        contents=[f"{entity}/**" for entity in entities],
        plot_legend=rrb.PlotLegend("LeftTop"),
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        axis_y=rrb.ScalarAxis(range=shown) if shown is not None else None,
    )


def scene(name: str, origin: str, contents: Sequence[str], frame: str, eye: Eye, trails: Sequence[str]) -> rrb.Spatial3DView:
    """Return a scene seen from an eye that hangs on a frame; trails are shown as a whole."""
    position, target, up = eye
    past: Mapping[str, Any] = {trail: _whole_past() for trail in trails}
    return rrb.Spatial3DView(
        name=name,
        origin=origin,
        contents=contents,
        spatial_information=rrb.SpatialInformation(target_frame=f"tf#{frame}"),
        background=BACKGROUND,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(kind="Orbital", position=position, look_target=target, eye_up=up),
        overrides=past,
    )


def responses() -> rrb.StateTimelineView:
    """Return what the supervisor let the robot do, over time."""
    return rrb.StateTimelineView(name="Response", origin=events.RESPONSE)


def words() -> rrb.TextLogView:
    """Return what is said in words; a click on a tick goes there."""
    columns = rrb.TextLogColumns(timeline_columns=["tick"], text_log_columns=["LogLevel", "Body"])
    return rrb.TextLogView(name="Faults and events", origin=events.EVENTS, columns=columns)


def _whole_past() -> rrb.VisibleTimeRanges:
    begin, now = rrb.TimeRangeBoundary.infinite(), rrb.TimeRangeBoundary.cursor_relative()
    return rrb.VisibleTimeRanges([rrb.VisibleTimeRange(name, start=begin, end=now) for name in ("tick", "mono")])
