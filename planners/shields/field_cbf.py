"""The multi-boundary field-CBF: keeps every near boundary at its distance, with no list of obstacles.

Source: Cui, Deng, Wang, section 4.3, equations 5 to 8, appendix B.  README.md beside this file says what differs and why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from drivers.interface.commands import BaseLimits, BodyTwist, Command
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from drivers.interface.settings import Settings
from estimators.belief import UNKNOWN, Belief, ClearanceField, Lattice, OccupancyGrid
from planners.planner import Diagnostics, Drawing
from planners.shield import Filtered, ReachableSet, ShieldSetup
from planners.shields.field_cbf_forms import FORMS, Asked, Form
from planners.shields.field_cbf_kernels import ALWAYS, FIELD_RATE, MATERIAL, Barrier

GATES = {"material_derivative": MATERIAL, "field_rate": FIELD_RATE, "none": ALWAYS}


@dataclass(frozen=True, slots=True)
class FieldCbfDiagnostics(Diagnostics):
    """How the command was filtered."""

    samples: int  # boundary samples around the robot
    active: int  # of these, committed to the QP
    min_h_m: float  # least barrier value; infinite when no boundary is near
    infeasible: bool  # no reachable velocity keeps all constraints
    violation_m_s: float  # by how much the worst one then fails
    enclosed: bool  # the robot's own cell is occupied: there is no boundary to turn away from


class FieldCbf:
    """Multi-boundary field-CBF: the velocity nearest to the asked one that keeps off every near boundary.

    It is projected onto the half-planes of up to `directions` boundary samples, inside what is reachable.
    """

    class Settings(Settings):
        """Appendix B, layer 3: multi-boundary field-CBF."""

        alpha_per_s: float = Field(2.0, gt=0.0, le=50.0, description="barrier gain (alpha_CBF)")
        d_min_m: float = Field(0.10, ge=0.0, le=2.0, description="kept free beyond the robot's radius")
        directions: int = Field(16, ge=1, le=128, description="K, boundary samples, one for each direction")
        sample_radius_m: float = Field(0.7, gt=0.0, le=5.0, description="where samples are looked for (R_sample)")
        guard_m: float = Field(0.30, ge=0.0, le=5.0, description="boundaries this near always constrain (R_cbf)")
        contact_time_s: float = Field(0.40, ge=0.0, le=10.0, description="farther ones when contact is this near (T_cbf)")
        buffer_gain: float = Field(1.0, ge=0.0, le=10.0, description="beta of equation 8")
        buffer_min_m: float = Field(0.05, ge=0.0, le=1.0, description="least buffer")
        buffer_max_m: float | None = Field(0.25, ge=0.0, le=2.0, description="largest buffer; none: without bound (table 2)")
        form: Literal["boundaries", "single_scalar", "objects"] = Field(
            "boundaries",
            description="what the barriers are made of: boundary samples, the field at the robot, or tracks (table 2)",
        )
        gate: Literal["material_derivative", "field_rate", "none"] = Field(
            "material_derivative", description="closing rate that the time to contact counts; none: no gate (table 2)"
        )
        reaction_time_s: float = Field(
            0.2,
            ge=0.0,
            le=2.0,
            description="dt of equation 8: how long a boundary closes in unanswered; the control period, if longer",
        )
        braking_allowance: float = Field(
            1.5,
            ge=0.0,
            le=5.0,
            description="widens gate and search by so many times what the base takes to stop; 0: the paper's base stops at once",
        )
        on_infeasible: Literal["least_violation", "stop"] = Field(
            "least_violation", description="retreat along the direction that fails the worst constraint least, or stop"
        )

    def __init__(self, settings: Settings, setup: ShieldSetup) -> None:
        """Take the settings."""
        s = settings
        braking_s, braking_m = (s.braking_allowance * amount for amount in _braking(setup.limits))
        self._stop_when_infeasible = s.on_infeasible == "stop"
        self._barrier = Barrier(
            safe_m=setup.robot_radius_m + s.d_min_m,
            directions=s.directions,
            sample_radius_m=s.sample_radius_m + braking_m,
            alpha_per_s=s.alpha_per_s,
            guard_m=s.guard_m,
            contact_time_s=s.contact_time_s + braking_s,
            reaction_s=max(s.reaction_time_s, setup.period_s),
            buffer_gain=s.buffer_gain,
            buffer_min_m=s.buffer_min_m,
            buffer_max_m=math.inf if s.buffer_max_m is None else s.buffer_max_m,
            gate=GATES[s.gate],
        )
        self._filtered: Form = FORMS[s.form]

    @property
    def kept_clear_m(self) -> float:
        """The clearance at which the barrier and its least buffer leave no approach to what stands [m]."""
        return self._barrier.safe_m + self._barrier.buffer_min_m

    def warm_up(self) -> None:
        """Compile the kernels, on an empty field; its arrays are read-only as a belief's are, which is a type of its own."""
        lattice = Lattice(-1.5, -1.5, 1.0, 3, 3)
        zero, none = frozen_array(np.zeros((3, 3), np.float32)), frozen_array(np.zeros((3, 3), np.bool_))
        grid = OccupancyGrid(lattice, frozen_array(np.full((3, 3), UNKNOWN, np.uint8)))
        field = ClearanceField(lattice, zero, zero, none, none)
        belief = Belief(0, 0, SE2(), SE2(), BodyTwist(), np.zeros((3, 3)), grid, field, (), None, 0)
        at_rest = np.zeros(2)
        self._filtered(belief, Asked(at_rest, at_rest, at_rest), self._barrier)

    def filter(self, command: Command, belief: Belief, reachable: ReachableSet) -> Filtered:
        """Return the command with its twist filtered; wz is only clipped, as turning moves no boundary of a round robot.

        A twist that is not finite counts as a stop.
        """
        if command.base is None:
            return Filtered(command)
        asked = reachable.clip(command.base if command.base.finite else BodyTwist())
        low, high = reachable.lowest, reachable.highest
        box = Asked(np.array([asked.vx, asked.vy]), np.array([low.vx, low.vy]), np.array([high.vx, high.vy]))
        found = self._filtered(belief, box, self._barrier)
        infeasible = found.enclosed or found.slack_m_s > 0.0
        stops = infeasible and self._stop_when_infeasible
        twist = reachable.clip(BodyTwist(0.0 if stops else found.vx, 0.0 if stops else found.vy, asked.wz))
        said = FieldCbfDiagnostics(
            len(found.boundaries),
            len(found.constraining),
            found.nearest_m - self._barrier.safe_m,
            infeasible,
            found.slack_m_s,
            found.enclosed,
        )
        drawn = Drawing("boundaries", found.boundaries, False), Drawing("constraints", found.constraining, False)
        return Filtered(replace(command, base=twist), twist != reachable.clip(command.base), said, drawn)

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""


def _braking(limits: BaseLimits | None) -> tuple[float, float]:
    """Return how long [s] and how far [m] the base goes on from full speed within its normal acceleration."""
    if limits is None:
        return 0.0, 0.0
    time_s = limits.velocity.vx / limits.acceleration.vx
    return time_s, 0.5 * limits.velocity.vx * time_s
