"""What the tests of the planners that follow the route share: worlds that each must master, and how they are run in them."""

from __future__ import annotations

import numpy as np

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import frozen_array
from planners.planner import PlannerSetup
from planners.router import Route, RouterSetup
from planners.routers.grid import GridRouter
from planners.shield import ShieldSetup
from planners.shields.none import NoShield
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, drive

PERIOD_S, RADIUS_M = 0.05, 0.12
WALLS = [Box(-1, -1.1, 9, -1.0), Box(-1, 1.0, 9, 1.1)]
SLALOM = [*WALLS, Disc(1.5, 0.3, 0.25), Disc(3.0, -0.4, 0.25)]
WORLDS = {  # base, obstacles, goal
    "behind": (DIFFERENTIAL, [], (-2.0, 0.5)),
    "gap": (DIFFERENTIAL, [Box(1.5, -3, 1.7, -0.3), Box(1.5, 0.3, 1.7, 3)], (3.0, 0.0)),
    "slalom": (DIFFERENTIAL, SLALOM, (4.5, 0.0)),
    "slalom, omni": (OMNI, SLALOM, (4.5, 0.0)),
    "dead end": (DIFFERENTIAL, [Box(1.5, -1, 1.7, 1), Box(0.8, -1.1, 1.7, -1), Box(0.8, 1, 1.7, 1.1)], (3.0, 0.0)),
    "crossing": (DIFFERENTIAL, [*WALLS, Disc(4.0, 0.45, 0.2, -0.4)], (4.5, 0.0)),
}


def planner_of(cls, limits=DIFFERENTIAL, seed=0, **settings):
    planner = cls(cls.Settings(**settings), PlannerSetup(PERIOD_S, RADIUS_M, limits, seed))
    planner.warm_up()
    return planner


def route_along(path, goal_yaw=None):
    path = frozen_array(np.asarray(path, dtype=np.float64))
    return Route((float(path[-1, 0]), float(path[-1, 1])), path, float(np.hypot(*np.diff(path, axis=0).T).sum()), False, goal_yaw)


class _Headed:
    """A router whose goal asks for a heading."""

    def __init__(self, router, goal_yaw):
        self._router, self._yaw = router, goal_yaw

    def route(self, belief, mission):
        goals = tuple(Goal(g.x_m, g.y_m, self._yaw, g.tolerance_m) for g in mission.goals)
        return self._router.route(belief, Mission(SE2(), goals))


def run(planner, obstacles, goal, limits=DIFFERENTIAL, goal_yaw=None, **options):
    """Drive with the grid router; where a heading is asked for, until the time is over."""
    router = GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    shield = NoShield(NoShield.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, limits))
    if goal_yaw is not None:
        options = {"tolerance_m": 0.0, "duration_s": 15.0, **options}
    options = {"duration_s": 25.0, **options}
    return drive(planner, _Headed(router, goal_yaw), shield, obstacles, goal, limits=limits, **options)
