"""The layout for "what would the other have done": both plans in one scene, both commands and reasons in pairs."""

from __future__ import annotations

import rerun.blueprint as rrb

from runtime.log.drawn import plots, scene, views
from runtime.log.header import RunHeader

RECORDED = "/view/recorded"  # what the recording holds of the same things
RECORDED_PLAN = f"{scene.ODOM}/recorded_plan"
_UNITS = {"vx": "m/s", "vy": "m/s", "wz": "rad/s"}
_BEHIND: views.Eye = ((-2.2, -1.0, 2.1), (1.0, 0.0, 0.1), (0.0, 0.0, 1.0))
_ABOVE: views.Eye = ((1.0, -0.01, 4.4), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # ahead is to the right
_SHOWN_M = (-0.1, 2.0)


def layout(header: RunHeader) -> rrb.Blueprint:
    """Return the layout: both plans from above and in the scene, the commands of both, and what each side says of its reasons."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_above(), rrb.Horizontal(_scene(), _beside(), column_shares=[5, 4])),
            rrb.Vertical(*_commands(header), _reasons(), row_shares=[2, 2, 2, 3] if _has_base(header) else None),
            column_shares=[5, 4],
        ),
        rrb.TimePanel(timeline="mono", state="collapsed"),
        collapse_panels=True,
    )


def _above() -> rrb.Spatial3DView:
    shown = [f"{scene.ODOM}/{name}" for name in ("clearance", "plan", "recorded_plan", "route", "base/body", "base/heading")]
    contents = [*shown, f"{scene.MAP}/movers/**", f"{scene.MAP}/static/**"]
    return views.scene("Both plans from above", scene.MAP, contents, scene.FOCUS, _ABOVE, [])


def _scene() -> rrb.Spatial3DView:
    contents = [f"{scene.MAP}/**", scene.DEPTH, f"- {scene.ODOM}/clearance", f"- {scene.MAP}/truth"]
    return views.scene("Scene", scene.MAP, contents, scene.FOCUS, _BEHIND, [f"{scene.MAP}/trail"])


def _beside() -> rrb.Vertical:
    return rrb.Vertical(views.words(), views.plot("clearance [m]", plots.CLEARANCE, shown=_SHOWN_M))


def _has_base(header: RunHeader) -> bool:
    return "base" in header.devices


def _commands(header: RunHeader) -> list[rrb.TimeSeriesView]:
    if not _has_base(header):
        return []
    return [views.plot(f"{axis} [{_UNITS[axis]}]", f"{RECORDED}/both/{axis}") for axis in plots.AXES]


def _reasons() -> rrb.Horizontal:
    """Return what planner and shield of either side say, with the risk among it."""
    recorded = rrb.Tabs(
        views.plot("recorded planner", f"{RECORDED}/planner"), views.plot("recorded shield", f"{RECORDED}/shield")
    )
    replayed = rrb.Tabs(views.plot("replayed planner", plots.PLANNER), views.plot("replayed shield", plots.SHIELD))
    return rrb.Horizontal(recorded, replayed)
