"""Tracks for the analytic worlds: what a planner is told of the discs that move."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist
from estimators.belief import Belief, Track
from planners.planner import PlannerSetup
from planners.router import RouterSetup
from planners.routers.grid import GridRouter
from planners.routers.straight import StraightRouter
from planners.shield import ShieldSetup
from planners.shields.none import NoShield
from tests.planners.synthetic import Box, Disc, Trace, drive, mission_to

PERIOD_S, RADIUS_M = 0.05, 0.333
JACKAL = BaseLimits(
    BodyTwist(1.0, 0.0, 2.0), BodyTwist(1.5, 0.0, 4.0), BodyTwist(20.0, 0.0, 40.0), BodyTwist(2.0, 0.0, 5.0), reverse=True
)
WALLS = [Box(-1, -1.5, 9, -1.4), Box(-1, 1.4, 9, 1.5)]


def tracks_of(discs: list[Disc]) -> tuple[Track, ...]:
    return tuple(Track(i, (d.x, d.y), (d.vx, d.vy), d.radius, np.zeros((4, 4))) for i, d in enumerate(discs))


@dataclass
class Tracking:
    """A planner that is told of the movers as they are at the belief's tick."""

    planner: Any
    movers: list[Disc]

    def plan(self, belief: Belief, route: Any) -> Any:
        movers = [mover.at(belief.tick * PERIOD_S) for mover in self.movers]
        return self.planner.plan(replace(belief, tracks=tracks_of(movers)), route)


def planner_of(cls: Any, limits: BaseLimits | None = JACKAL, **settings: Any) -> Any:
    planner = cls(cls.Settings(**settings), PlannerSetup(PERIOD_S, RADIUS_M, limits, 0))
    planner.warm_up()
    return planner


def straight_router() -> StraightRouter:
    return StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))


def run(planner: Any, standing: list[Any], movers: list[Disc], goal: tuple[float, float], **options: Any) -> Trace:
    """Drive a base of the Jackal's size and limits; movers are in the grid as well as tracked, and the route knows no movers."""
    router = options.pop("router", None) or GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    options = {"limits": JACKAL, "radius_m": RADIUS_M, "period_s": PERIOD_S, **options}
    shield = NoShield(NoShield.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, options["limits"]))
    return drive(Tracking(planner, movers), router, shield, [*standing, *movers], goal, **options)


def route_from(belief, *goal):
    return straight_router().route(belief, mission_to(*goal))
