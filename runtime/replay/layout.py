"""The layout for "what would the other have done": both plans in one scene, both commands and reasons in pairs."""

from __future__ import annotations

import rerun.blueprint as rrb

from runtime.log import plots, scene, views
from runtime.log.header import RunHeader

RECORDED = "/view/recorded"  # what the recording holds of the same things
RECORDED_PLAN = f"{scene.ODOM}/recorded_plan"
_UNITS = {"vx": "m/s", "vy": "m/s", "wz": "rad/s"}
_BEHIND: views.Eye = ((-3.0, -1.3, 2.7), (0.8, 0.0, 0.1), (0.0, 0.0, 1.0))
_ABOVE: views.Eye = ((0.0, -0.01, 4.6), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def layout(header: RunHeader) -> rrb.Blueprint:
    """Return the layout: the scene with both plans, the commands of both, and below what each side says of its reasons."""
    contents = [f"{scene.MAP}/**", scene.DEPTH, f"- {scene.ODOM}/clearance", f"- {scene.MAP}/truth"]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                views.scene("Both plans", scene.MAP, contents, scene.FOCUS, _BEHIND, [f"{scene.MAP}/trail"]),
                views.words(),
                row_shares=[4, 1],
            ),
            rrb.Vertical(*_commands(header), _clearance(), _reasons(), row_shares=[2, 2, 2]),
            column_shares=[5, 5],
        ),
        rrb.TimePanel(timeline="mono", state="collapsed"),
        collapse_panels=True,
    )


def _commands(header: RunHeader) -> list[rrb.Horizontal]:
    if "base" not in header.devices:
        return []
    return [rrb.Horizontal(*(views.plot(f"{axis} [{_UNITS[axis]}]", f"{RECORDED}/both/{axis}") for axis in plots.AXES))]


def _clearance() -> rrb.Horizontal:
    shown = [f"{scene.ODOM}/{name}" for name in ("clearance", "plan", "recorded_plan", "route", "base/body", "base/heading")]
    above = views.scene("From above", scene.MAP, [*shown, f"{scene.MAP}/movers/**"], scene.FOCUS, _ABOVE, [])
    return rrb.Horizontal(above, views.plot("clearance [m]", plots.CLEARANCE))


def _reasons() -> rrb.Horizontal:
    """Return what planner and shield of either side say, with the risk among it."""
    recorded = rrb.Tabs(
        views.plot("recorded planner", f"{RECORDED}/planner"), views.plot("recorded shield", f"{RECORDED}/shield")
    )
    replayed = rrb.Tabs(views.plot("replayed planner", plots.PLANNER), views.plot("replayed shield", plots.SHIELD))
    return rrb.Horizontal(recorded, replayed)
