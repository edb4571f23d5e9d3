"""One tick of the clearance-manifold planner and of its layers: a walled corridor, with 5, 20 and 80 walkers in it."""

from collections.abc import Callable
from dataclasses import replace
from itertools import cycle

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from planners.clearance_manifold.extraction import Prior
from planners.clearance_manifold.planner import ClearanceManifold
from planners.planner import PlannerSetup
from planners.router import RouterSetup
from planners.routers.straight import StraightRouter
from tests.planners.synthetic import OMNI, Box, Disc, belief_of, mission_to

PERIOD_S, RADIUS_M = 0.05, 0.12
WALLS = (Box(-1, -1.3, 9, -1.2), Box(-1, 1.2, 9, 1.3))
TICKS = 40


def _walkers(count: int) -> list[Disc]:
    """One comes towards the robot in its corridor; the others walk beyond the walls, inside the grid."""
    crowd = [Disc(0.2 + 0.06 * k, 1.9 * (-1) ** k, 0.25, -0.8, 0.0) for k in range(count - 1)]
    return [Disc(4.2, 0.2, 0.25, -0.8, 0.0), *crowd]


def _inputs(count: int) -> list[tuple[object, object]]:
    router = StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    told = []
    for tick in range(TICKS):
        world = (*WALLS, *(walker.at(tick * PERIOD_S) for walker in _walkers(count)))
        belief = belief_of(world, SE2(2.0 + 0.02 * tick, 0.0, 0.0), BodyTwist(0.4, 0.0, 0.0), tick=tick)
        belief = replace(belief, stamp_ns=tick * 50_000_000)
        told.append((belief, router.route(belief, mission_to(9.0, 0.0))))
    return told


def _planner() -> ClearanceManifold:
    planner = ClearanceManifold(ClearanceManifold.Settings(), PlannerSetup(PERIOD_S, RADIUS_M, OMNI, 0))
    planner.warm_up()
    return planner


def _ticking(count: int) -> Callable[[], object]:
    planner, inputs = _planner(), cycle(_inputs(count))
    return lambda: planner.plan(*next(inputs))  # type: ignore[arg-type]


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return the calls, everything compiled and prepared."""
    planner, (belief, route) = _planner(), _inputs(1)[20]
    planner.plan(belief, route)  # type: ignore[arg-type]
    predicted, solver = planner._field.update(belief), planner._solver  # type: ignore[arg-type]
    scene = planner._scene(planner._chart, predicted, belief, np.array([2.4, 0.0]))  # type: ignore[arg-type]
    prior = Prior(np.zeros(len(scene.arcs_m)), np.zeros(len(scene.arcs_m)))
    tubes_m = np.full(len(scene.arcs_m), 0.125)
    return [
        ("manifold_prediction", lambda: planner._field.update(belief)),  # type: ignore[arg-type]
        ("manifold_solver", lambda: solver.extract(scene, prior)),
        ("manifold_tracker", lambda: solver.repair(scene, prior, tubes_m)),
        ("manifold_plan", _ticking(1)),
        ("manifold_plan_5_walkers", _ticking(5)),
        ("manifold_plan_20_walkers", _ticking(20)),
        ("manifold_plan_80_walkers", _ticking(80)),
    ]
