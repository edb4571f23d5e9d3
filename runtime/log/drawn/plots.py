"""What is plotted over time: commands, clearance, speed, diagnostics, timing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Any

import pyarrow as pa
import rerun as rr

from drivers.interface.commands import Command
from estimators.belief import Belief
from planners.planner import Diagnostics
from runtime.cycle import Cycle
from runtime.log.drawn import colours
from runtime.log.drawn.layers import Layer, Rows
from runtime.log.exact.columns import ArrowColumn, offsets_of
from runtime.log.exact.leaves import said
from runtime.log.files.sink import Sink
from runtime.log.header import RunHeader

CLEARANCE = "/view/clearance"
SPEED = "/view/speed"
PLANNER = "/view/planner"
SHIELD = "/view/shield"
AXES = ("vx", "vy", "wz")
NAN = float("nan")
Values = tuple[float, ...]
_SCALARS = next(iter(rr.Scalars.columns(scalars=[0.0]))).component_descriptor()


def layers(header: RunHeader) -> list[Layer[Any]]:
    """Return what every robot's planner and estimator is plotted by."""
    pair = (colours.ASKED, colours.SENT)
    both = (colours.SENT, colours.TRUTH)
    base = [
        *(Layer(_commanded(axis), series(f"/view/command/{axis}", ("asked", "sent"), pair)) for axis in AXES),
        Layer(_speeds, series(SPEED, ("believed", "true"), both)),
    ]
    return [
        Layer(_clearances(header.robot_radius_m), series(CLEARANCE, ("believed", "true"), both)),
        *(base if "base" in header.devices else ()),
    ]


def series(
    entity: str, names: Sequence[str], palette: Sequence[colours.Rgb] | None = None, *, steps: bool = False
) -> Rows[Values]:
    """Return rows of one value per name, plotted as lines; of a pair the first is drawn wide, so that both can be seen."""

    def columns(rows: list[Values]) -> list[ArrowColumn]:
        flat = pa.array([value for row in rows for value in row], pa.float64())
        ends = list(accumulate(len(row) for row in rows))
        return [ArrowColumn(_SCALARS, pa.ListArray.from_arrays(offsets_of(ends), flat))]

    widths = [3.5, 1.5] if len(names) == 2 and not steps else [1.5] * len(names)
    mode = "StepAfter" if steps else None
    style = rr.SeriesLines(names=list(names), colors=palette, widths=widths, interpolation_mode=mode)
    return Rows(entity, columns, [(entity, style)])


class Diagnosed:
    """Plots every number that a planner or shield says about its decision, under the name of its diagnostics' class."""

    def __init__(self, entity: str, pick: Callable[[Cycle], Diagnostics | None]) -> None:
        """Plot below the entity what is picked."""
        self._entity, self._pick = entity, pick
        self._rows: dict[str, Rows[Values]] = {}

    def put(self, cycle: Cycle) -> None:
        """Plot the tick."""
        diagnostics = self._pick(cycle)
        if diagnostics is None:
            return
        numbers = [(name, value) for name, value in said(diagnostics) if isinstance(value, float)]
        if not numbers:
            return
        kind = type(diagnostics).__name__
        if kind not in self._rows:
            self._rows[kind] = series(f"{self._entity}/{kind}", [name for name, _ in numbers])
        self._rows[kind].add(cycle.sensed.tick, tuple(value for _, value in numbers))

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        for rows in self._rows.values():
            rows.send(sink)


def planner_diagnostics(cycle: Cycle) -> Diagnostics:
    """Return what the planner said."""
    return cycle.plan.diagnostics


def shield_diagnostics(cycle: Cycle) -> Diagnostics | None:
    """Return what the shield said, if it was asked."""
    return cycle.verdict.filtered.diagnostics if cycle.verdict.filtered is not None else None


def _commanded(axis: str) -> Callable[[Cycle], Values]:
    def value(command: Command) -> float:
        return float(getattr(command.base, axis)) if command.base is not None else NAN

    return lambda c: (value(c.verdict.asked), value(c.verdict.command))


def _speeds(cycle: Cycle) -> Values:
    truth = cycle.sensed.truth
    return (cycle.belief.twist.speed_m_s, truth.twist.speed_m_s if truth is not None else NAN)


def _clearances(robot_radius_m: float) -> Callable[[Cycle], Values]:
    def pick(cycle: Cycle) -> Values:
        truth = cycle.sensed.truth
        return (_at_robot(cycle.belief) - robot_radius_m, truth.clearance_m if truth is not None else NAN)

    return pick


def _at_robot(belief: Belief) -> float:
    """Return the clearance field's value in the robot's cell [m], NaN where it is not known."""
    lattice, pose = belief.clearance.lattice, belief.odom_from_base
    row, column = int((pose.y - lattice.y_m) // lattice.cell_m), int((pose.x - lattice.x_m) // lattice.cell_m)
    if not (0 <= row < lattice.rows and 0 <= column < lattice.columns and belief.clearance.known[row, column]):
        return NAN
    return float(belief.clearance.clearance_m[row, column])
