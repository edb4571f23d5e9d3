"""Layer 1: the clearance that the robot will find where it gets to, when it gets there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.samples import frozen_array
from estimators.belief import F32, F64, Belief, ClearanceField, Lattice, Mask
from estimators.memory.rolling import transfer
from planners.clearance_manifold.closing import SLOTS, ClosingMemory
from planners.clearance_manifold.distance_kernels import lowered
from planners.clearance_manifold.prediction_kernels import Arrival, nearest_closing, observe, taken_on_arrival
from planners.clearance_manifold.recent_rate import RecentRate
from planners.clearance_manifold.settings import PredictionSettings

NEVER_S = 1e6  # age of what was never in view
CLOSING_M_S = 0.25
SECOND_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Predicted:
    """The field on arrival."""

    clearance_m: F32  # (rows, columns), Gamma_pred
    closing: F64  # (SLOTS, 5), of all that closes in: middle in odom [m], velocity [m/s], number of cells, 0 where nothing does,
    begins: Mask  # (SLOTS,), and whether it is another than before


class ArrivalField:
    """Predicts the field, and remembers when each cell was last in view (section 4.1)."""

    def __init__(self, settings: PredictionSettings, radius_m: float) -> None:
        """Start with nothing seen; what is within the robot's radius it stands on."""
        self._settings, self._radius_m = settings, radius_m
        self._lattice: Lattice | None = None
        self._age_s: F32 = np.zeros((0, 0), np.float32)
        self._met_s: F32 = np.zeros((0, 0), np.float32)
        self._stamp_ns = 0
        self._closing = ClosingMemory(settings.carry_s)
        self._recent = RecentRate()

    def warm_up(self) -> None:
        """Compile the kernels, on read-only arrays as a belief's are."""
        field, known = frozen_array(np.ones((3, 3), np.float32)), frozen_array(np.ones((3, 3), np.bool_))
        age_s = np.zeros((3, 3), np.float32)
        observe(age_s, known, np.zeros(2), 1.0, np.zeros(3), 1.0, (0.0, 0.0, 1.0), 0.0)
        taken = taken_on_arrival(field, field, age_s, np.zeros(2), 1.0, np.zeros(2), self._arrival(0.0))
        lowered(field, taken, 1.0)
        nearest_closing(field, field, age_s, 0.0, np.zeros(2), 1.0, np.zeros(2), CLOSING_M_S, SLOTS)
        self._closing.warm_up()

    def update(self, belief: Belief) -> Predicted:
        """Take in what is seen now and return the prediction on the belief's lattice."""
        field, pose = belief.clearance, belief.odom_from_base
        elapsed_s = self._observe(belief)
        corner = np.array([field.lattice.x_m, field.lattice.y_m])
        robot, arrival = np.array([pose.x, pose.y]), self._arrival(belief.twist.speed_m_s)
        cell_m = field.lattice.cell_m
        taken = taken_on_arrival(field.clearance_m, field.rate_m_s, self._age_s, corner, cell_m, robot, arrival)
        recent = self._recent.update(field, belief.stamp_ns)
        window_s = self._recent.window_s(belief.stamp_ns)
        found = nearest_closing(field.clearance_m, field.rate_m_s, recent, window_s, corner, cell_m, robot, CLOSING_M_S, SLOTS)
        closing = self._closing.update(found, field, self._met_s, elapsed_s)
        return Predicted(lowered(field.clearance_m, taken, cell_m), closing, self._closing.begins)

    @property
    def age_s(self) -> F32:
        """How long ago each cell was last in view, or too near for that [s], shape (rows, columns)."""
        return self._age_s

    @property
    def met_s(self) -> F32:
        """The same without what is too near: how long ago it was looked at or stood on [s], shape (rows, columns)."""
        return self._met_s

    def _arrival(self, speed_m_s: float) -> Arrival:
        s = self._settings
        expected = min(max(speed_m_s, s.speed_floor_m_s), s.nominal_speed_m_s)
        return Arrival(expected, s.horizon_max_s, s.trust_decay_s, s.confidence_decay_s)

    def _observe(self, belief: Belief) -> float:
        """Let what is in view be new and the rest grow older; return by how much [s]."""
        field, pose = belief.clearance, belief.odom_from_base
        elapsed_s = max(0.0, (belief.stamp_ns - self._stamp_ns) / SECOND_NS) if self._lattice is not None else 0.0
        self._age_s, self._met_s = (_carried(age_s, self._lattice, field) for age_s in (self._age_s, self._met_s))
        if self._lattice is None:
            self._met_s[:] = 0.0  # where it is put down, somebody has looked
        self._lattice, self._stamp_ns = field.lattice, belief.stamp_ns
        corner = np.array([field.lattice.x_m, field.lattice.y_m])
        s, at = self._settings, np.array([pose.x, pose.y, pose.yaw])
        half_rad, cell_m = math.radians(0.5 * s.fov_deg), field.lattice.cell_m
        for age_s, near_m in ((self._age_s, 0.0), (self._met_s, s.near_m)):
            observe(age_s, field.known, corner, cell_m, at, half_rad, (self._radius_m, near_m, s.range_m), elapsed_s)
        return elapsed_s

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is remembered, as named arrays."""
        at = self._lattice
        corner = np.zeros(0) if at is None else np.array([at.x_m, at.y_m, at.cell_m])
        ages = {
            "age_corner": corner,
            "age_s": self._age_s,
            "met_s": self._met_s,
            "age_stamp_ns": np.array([self._stamp_ns], np.int64),
        }
        return ages | self._closing.state() | self._recent.state()

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._age_s, self._met_s = (np.asarray(state[name], np.float32) for name in ("age_s", "met_s"))
        corner = state["age_corner"].tolist()
        self._lattice = Lattice(*corner, *self._age_s.shape) if corner else None
        self._stamp_ns = int(state["age_stamp_ns"][0])
        self._closing.take(state)
        self._recent.take(state)


def _carried(age_s: F32, before: Lattice | None, field: ClearanceField) -> F32:
    """Return the ages on the field's lattice; a lattice of other cells begins anew."""
    if before == field.lattice:
        return age_s
    shape = (field.lattice.rows, field.lattice.columns)
    if before is None or before.cell_m != field.lattice.cell_m:
        return np.full(shape, NEVER_S, np.float32)
    return transfer(age_s, before, field.lattice, NEVER_S)
