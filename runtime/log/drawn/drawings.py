"""What planner and shield draw of how they decided: each drawing under its own name, as lines or dots in odom."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from planners.planner import Drawing, no_path
from runtime.cycle import Cycle
from runtime.log.drawn import colours, scene
from runtime.log.drawn.layers import Rows
from runtime.log.files.sink import Sink

DRAWN = f"{scene.ODOM}/drawn"
_Z_M = 0.015  # just below the paths
_RADIUS_M = 0.008
_DOT_M = 0.025


class Drawings:
    """Draws what is picked, below an entity of their own; one that is missing at a tick is wiped."""

    def __init__(self, owner: str, pick: Callable[[Cycle], tuple[Drawing, ...]]) -> None:
        """Draw for a planner or a shield."""
        self._owner, self._pick = owner, pick
        self._rows: dict[str, Rows[Drawing]] = {}

    def put(self, cycle: Cycle) -> None:
        """Draw the tick."""
        tick, drawn = cycle.sensed.tick, {drawing.name: drawing for drawing in self._pick(cycle)}
        for name, drawing in drawn.items():
            if name not in self._rows:
                colour = colours.STAGES[len(self._rows) % len(colours.STAGES)]
                self._rows[name] = _rows(f"{DRAWN}/{self._owner}/{name}", drawing.connected, colour)
        for name, rows in self._rows.items():
            rows.add(tick, drawn.get(name, Drawing(name, no_path())))

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        for rows in self._rows.values():
            rows.send(sink)


def planner_drawings(cycle: Cycle) -> tuple[Drawing, ...]:
    """Return what the planner drew."""
    return cycle.plan.drawings


def shield_drawings(cycle: Cycle) -> tuple[Drawing, ...]:
    """Return what the shield drew, if it was asked."""
    return cycle.verdict.filtered.drawings if cycle.verdict.filtered is not None else ()


def _rows(entity: str, connected: bool, colour: colours.Rgb) -> Rows[Drawing]:
    if connected:
        return Rows(entity, _lines, [(entity, rr.LineStrips3D.from_fields(colors=[colour], radii=[_RADIUS_M]))])
    return Rows(entity, _dots, [(entity, rr.Points3D.from_fields(colors=[colour], radii=[_DOT_M]))])


def _raised(drawing: Drawing) -> NDArray[np.float64]:
    """Return the points, shape (n, 3), in odom."""
    return np.asarray(np.c_[drawing.points_in_odom, np.full(len(drawing.points_in_odom), _Z_M)])


def _lines(drawings: list[Drawing]) -> rr.ComponentColumnList:
    return rr.LineStrips3D.columns(strips=[_raised(drawing) for drawing in drawings])


def _dots(drawings: list[Drawing]) -> rr.ComponentColumnList:
    points = np.concatenate([_raised(drawing) for drawing in drawings])
    return rr.Points3D.columns(positions=points).partition([len(drawing.points_in_odom) for drawing in drawings])
