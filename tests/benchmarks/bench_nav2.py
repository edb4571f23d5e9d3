"""One decision of each of Nav2's controllers: a walled corridor, two pillars, one of them coming towards the robot."""

from collections.abc import Callable

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from planners.graceful.planner import Graceful
from planners.mppi.planner import Mppi
from planners.planner import PlannerSetup
from planners.regulated_pure_pursuit.planner import RegulatedPurePursuit
from planners.router import RouterSetup
from planners.routers.grid import GridRouter
from tests.benchmarks.bench_planners import CORRIDOR, PERIOD_S, RADIUS_M
from tests.planners.synthetic import DIFFERENTIAL, OMNI, belief_of, mission_to


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return the calls, everything compiled and prepared."""
    belief = belief_of(CORRIDOR, SE2(2.3, -0.1, 0.1), BodyTwist(0.4, 0.0, 0.0))
    differential, omni = (PlannerSetup(PERIOD_S, RADIUS_M, limits, 0) for limits in (DIFFERENTIAL, OMNI))
    planners = {
        "mppi_step_1000x30": Mppi(Mppi.Settings(batch_size=1000, time_steps=30), differential),
        "mppi_step_1000x30_omni": Mppi(Mppi.Settings(batch_size=1000, time_steps=30), omni),
        "mppi_step_1000x30_new_noise": Mppi(Mppi.Settings(regenerate_noises=True), differential),
        "regulated_pure_pursuit_step": RegulatedPurePursuit(RegulatedPurePursuit.Settings(), differential),
        "graceful_step": Graceful(Graceful.Settings(), differential),
    }
    router = GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    for part in (router, *planners.values()):
        part.warm_up()
    route = router.route(belief, mission_to(8.0, 0.0))
    return [(name, lambda planner=planner: planner.plan(belief, route)) for name, planner in planners.items()]
