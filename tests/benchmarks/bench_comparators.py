"""One call of each comparator of the RCSP paper: a walled corridor with a pillar, and six walkers around the robot."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from planners.mpc_cbf.planner import BarrierMpc
from planners.orca.planner import ReciprocalAvoidance
from planners.teb.planner import ElasticBand
from tests.planners.synthetic import Box, Disc, belief_of, mission_to
from tests.planners.tracked import planner_of, straight_router, tracks_of

STANDING = [Box(-1, -1.8, 9, -1.7), Box(-1, 1.7, 9, 1.8), Disc(4.2, -0.6, 0.3)]
WALKERS = [
    Disc(4.6, 0.3, 0.25, -0.6, 0.0), Disc(3.6, -1.2, 0.25, 0.0, 0.7), Disc(3.4, 1.3, 0.25, -0.1, -0.6),
    Disc(1.0, 1.0, 0.25, 0.5, 0.0), Disc(5.0, -1.0, 0.25, -0.8, 0.1), Disc(0.6, -1.1, 0.25, 0.3, 0.1),
]  # fmt: skip
TICKS = 20


def _ticking(planner: Any) -> Callable[[], object]:
    """Return a call that goes through a second of the scene, the robot driving on, over and over."""
    router, told = straight_router(), []
    for tick in range(TICKS):
        walkers = [walker.at(0.05 * tick) for walker in WALKERS]
        belief = belief_of([*STANDING, *walkers], SE2(2.0 + 0.02 * tick, 0.0, 0.0), BodyTwist(0.4, 0.0, 0.0), tick=tick)
        belief = replace(belief, tracks=tracks_of(walkers))
        told.append((belief, router.route(belief, mission_to(8.0, 0.0))))
    at = -1

    def call() -> object:
        nonlocal at
        at += 1
        return planner.plan(*told[at % TICKS])

    return call


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return the calls, everything compiled and prepared."""
    planners = {"mpc_cbf_step": BarrierMpc, "orca_step": ReciprocalAvoidance, "teb_step": ElasticBand}
    return [(name, _ticking(planner_of(planner))) for name, planner in planners.items()]
