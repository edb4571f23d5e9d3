"""One decision of RCSP, |U| = 165 and H = 25: at the issue's size, over obstacles and over scenarios; its lattice shield.

Everybody is near enough to matter to every command, so that nothing is passed over: the worst case, in which cost is linear.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import cycle

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from estimators.belief import Belief, Track
from planners.planner import PlannerSetup
from planners.rcsp.planner import Rcsp
from planners.router import Route, RouterSetup
from planners.routers.straight import StraightRouter
from planners.shield import ShieldSetup
from planners.shields.lattice import LatticeShield
from tests.planners.synthetic import DIFFERENTIAL, Box, Disc, belief_of, command_of, mission_to, reachable_from

PERIOD_S, RADIUS_M = 0.05, 0.25
WALLS = (Box(-1, -2.6, 9, -2.5), Box(-1, 2.5, 9, 2.6))
TWIST = BodyTwist(0.4, 0.0, 0.0)
TICKS = 40


def _discs(count: int) -> list[Disc]:
    """Coming towards the robot, side by side and one behind the other."""
    places = [(1.2 + 0.25 * (k // 8), -1.05 + 0.3 * (k % 8)) for k in range(count)]
    return [Disc(x, y, 0.2, -0.4, 0.02 * k) for k, (x, y) in enumerate(places)]


def _believed(count: int, tick: int) -> Belief:
    now = [disc.at(tick * PERIOD_S) for disc in _discs(count)]
    belief = belief_of((*WALLS, *now), SE2(), TWIST, tick=tick)
    for array in (belief.clearance.clearance_m, belief.grid.label):
        frozen_array(array)
    doubt = frozen_array(np.diag([0.01, 0.01, 0.02, 0.02]))
    tracks = tuple(Track(k, (d.x, d.y), (d.vx, d.vy), d.radius, doubt) for k, d in enumerate(now))
    return replace(belief, stamp_ns=(tick + 1) * 50_000_000, tracks=tracks)


def _inputs(count: int) -> list[tuple[Belief, Route]]:
    router = StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    beliefs = [_believed(count, tick) for tick in range(TICKS)]
    return [(belief, router.route(belief, mission_to(8.0, 0.0))) for belief in beliefs]


def _planning(obstacles: int, scenarios: int, **settings: object) -> Callable[[], object]:
    whole = {"budget": {"scenarios": scenarios}, **settings}
    planner = Rcsp(Rcsp.Settings.model_validate(whole), PlannerSetup(PERIOD_S, RADIUS_M, DIFFERENTIAL, 0))
    planner.warm_up()
    inputs = cycle(_inputs(obstacles))
    return lambda: planner.plan(*next(inputs))


def _filtering() -> Callable[[], object]:
    shield = LatticeShield(LatticeShield.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, DIFFERENTIAL))
    shield.warm_up()
    inputs, reachable = cycle(_inputs(6)), reachable_from(TWIST, DIFFERENTIAL, PERIOD_S)
    return lambda: shield.filter(command_of(BodyTwist(0.5, 0.0, 0.2)), next(inputs)[0], reachable)


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return the calls, everything compiled and prepared."""
    return [
        ("rcsp_decision", _planning(6, 128)),
        *((f"rcsp_{count}_obstacles", _planning(count, 128)) for count in (1, 4, 16, 64)),
        *((f"rcsp_{count}_scenarios", _planning(6, count)) for count in (32, 256, 1024, 4096)),
        ("rcsp_reacting", _planning(6, 128, reaction="candidate")),
        ("lattice_filter", _filtering()),
    ]
