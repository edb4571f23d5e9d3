"""Point-DS: a single point attracts the robot; obstacles are the shield's business.

Source: Cui, Deng, Wang, section 6 (baselines), equation 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from estimators.belief import Belief
from planners.planner import Diagnostics, Plan, PlannerSetup
from planners.point_ds.kernels import attraction, within
from planners.point_ds.settings import PointAttractorSettings
from planners.polyline import point_along
from planners.router import Route


@dataclass(frozen=True, slots=True)
class PointAttractorDiagnostics(Diagnostics):
    """How far the attractor is."""

    attractor_distance_m: float


class PointAttractor:
    """Point attractor: drives straight to it, in the body frame of a base that can move in every direction."""

    Settings = PointAttractorSettings
    default_shield: ClassVar[str] = "field_cbf"

    def __init__(self, settings: PointAttractorSettings, setup: PlannerSetup) -> None:
        """Take the limits.

        Raises:
            ConfigurationError: the base cannot move sideways, or there is none.
        """
        if setup.limits is None:
            raise ConfigurationError("planner.name 'point_ds' drives a base, but the robot has none")
        if not setup.limits.holonomic:
            raise ConfigurationError(
                "planner.name 'point_ds' commands sideways velocity (vy), which this base cannot do; "
                "choose a planner for it that does not, such as 'dwa', or an omnidirectional base"
            )
        self._settings, self._limits = settings, setup.limits

    def warm_up(self) -> None:
        """Compile the kernels."""
        attraction(1.0, 0.0, 1.0, 1.0)
        within(1.0, 0.0, 0.0, 1.0, 1.0)
        point_along(np.zeros((2, 2)), 1.0)

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the attraction as a body twist; it ignores every obstacle."""
        if route.empty or route.goal_in_odom is None:
            return Plan(BodyTwist(), diagnostics=PointAttractorDiagnostics(0.0))
        target = route.goal_in_odom
        if self._settings.attractor == "route":
            target = point_along(route.path_in_odom, self._settings.look_ahead_m)
        ahead = belief.odom_from_base.inverse().apply(np.array(target))
        path = np.array([[belief.odom_from_base.x, belief.odom_from_base.y], target])
        diagnostics = PointAttractorDiagnostics(math.hypot(*ahead))
        return Plan(self._towards(SE2(float(ahead[0]), float(ahead[1]))), path_in_odom=path, diagnostics=diagnostics)

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""

    def _towards(self, target: SE2) -> BodyTwist:
        """Return the twist towards a point in the body frame, inside the limits, turning to face the motion."""
        s, cap = self._settings, self._limits.velocity
        vx, vy = attraction(target.x, target.y, s.attraction_per_s, s.speed_m_s)
        wz = 0.0
        if math.hypot(vx, vy) > s.standstill_m_s:
            wz = min(max(s.heading_gain_per_s * math.atan2(vy, vx), -cap.wz), cap.wz)
        if not self._limits.reverse:
            vx = max(vx, 0.0)
        vx, vy = within(vx, vy, -cap.vx, cap.vx, cap.vy)
        return BodyTwist(float(vx), float(vy), wz)
