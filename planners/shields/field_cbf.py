"""The multi-boundary field-CBF: keeps every near boundary at its distance, with no list of obstacles.

Source: Cui, Deng, Wang, section 4.3, equations 5 to 8, appendix B.  README.md beside this file says what differs and why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.settings import Settings
from estimators.belief import Belief
from planners.planner import Diagnostics
from planners.shield import Filtered, ReachableSet, ShieldSetup
from planners.shields.field_cbf_kernels import boundary_samples, constraints
from planners.shields.plane_qp import solve

F64 = NDArray[np.float64]


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
    """Projects the asked velocity onto the half-planes of up to `directions` boundary samples, inside what is reachable."""

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
        buffer_max_m: float = Field(0.25, ge=0.0, le=2.0, description="largest buffer")
        reaction_time_s: float = Field(
            0.2,
            ge=0.0,
            le=2.0,
            description="dt of equation 8: how long a boundary closes in unanswered; the control period, if longer",
        )
        on_infeasible: Literal["least_violation", "stop"] = Field(
            "least_violation", description="retreat along the direction that fails the worst constraint least, or stop"
        )

    def __init__(self, settings: Settings, setup: ShieldSetup) -> None:
        """Take the settings."""
        self._settings = settings
        self._safe_m = setup.robot_radius_m + settings.d_min_m
        self._reaction_s = max(settings.reaction_time_s, setup.period_s)

    def warm_up(self) -> None:
        """Compile the kernels, on an empty field."""
        field, none = np.zeros((3, 3), np.float32), np.zeros((3, 3), np.bool_)
        normal, distance, rate = boundary_samples(field, field, none, np.zeros(2), 1.0, np.zeros(2), 1.0, 1.0, 4)
        half_planes = constraints(normal, distance, rate, np.zeros(2), 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0)
        solve(*half_planes, np.zeros(2), np.zeros(2), np.ones(2))

    def filter(self, command: Command, belief: Belief, reachable: ReachableSet) -> Filtered:
        """Return the command with its twist filtered; wz is only clipped, as turning moves no boundary of a round robot.

        A twist that is not finite counts as a stop.
        """
        if command.base is None:
            return Filtered(command)
        asked = command.base if command.base.finite else BodyTwist()
        (vx, vy), diagnostics = self._velocity(asked, belief, reachable)
        twist = reachable.clip(BodyTwist(vx, vy, asked.wz))
        return Filtered(replace(command, base=twist), intervened=twist != command.base, diagnostics=diagnostics)

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""

    def _velocity(self, asked: BodyTwist, belief: Belief, reachable: ReachableSet) -> tuple[tuple[float, float], Diagnostics]:
        """Return the filtered (vx, vy) in the body frame."""
        normals, distance, rate = self._boundaries(belief)
        h = distance - self._safe_m
        samples = int(np.isfinite(distance).sum())
        lattice, pose = belief.clearance.lattice, belief.odom_from_base
        (row,), (column,) = lattice.cell_of(np.array([[pose.x, pose.y]]))
        inside = 0 <= row < lattice.rows and 0 <= column < lattice.columns
        if inside and belief.clearance.clearance_m[row, column] <= 0.0:
            return (0.0, 0.0), FieldCbfDiagnostics(samples, 0, -self._safe_m, True, 0.0, True)
        wanted = np.array([asked.vx, asked.vy])
        s = self._settings
        planes, bounds = constraints(
            normals, distance, rate, wanted, self._safe_m, s.alpha_per_s, s.guard_m, s.contact_time_s,
            self._reaction_s, s.buffer_gain, s.buffer_min_m, s.buffer_max_m,
        )  # fmt: skip
        low, high = reachable.lowest, reachable.highest
        u, slack = solve(planes, bounds, wanted, np.array([low.vx, low.vy]), np.array([high.vx, high.vy]))
        if slack > 0.0 and s.on_infeasible == "stop":
            u = np.zeros(2)
        least = float(h.min()) if samples else math.inf
        diagnostics = FieldCbfDiagnostics(samples, len(bounds), least, slack > 0.0, float(slack), False)
        return (float(u[0]), float(u[1])), diagnostics

    def _boundaries(self, belief: Belief) -> tuple[F64, F64, F64]:
        """Return normals in the body frame, shape (K, 2), distances [m] and rates [m/s], shape (K,)."""
        field, pose, s = belief.clearance, belief.odom_from_base, self._settings
        lattice = field.lattice
        normals, distance, rate = boundary_samples(
            field.clearance_m, field.rate_m_s, field.overlap, np.array([lattice.x_m, lattice.y_m]), lattice.cell_m,
            np.array([pose.x, pose.y]), s.sample_radius_m, 2.0 * self._safe_m, s.directions,
        )  # fmt: skip
        c, sn = math.cos(pose.yaw), math.sin(pose.yaw)
        return normals @ np.array([[c, -sn], [sn, c]]), distance, rate
