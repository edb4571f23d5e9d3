"""One call of each planner, shield and router: a walled corridor, two pillars, one of them coming towards the robot."""

from collections.abc import Callable

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from planners.dwa.planner import DynamicWindow
from planners.planner import PlannerSetup
from planners.point_ds.planner import PointAttractor
from planners.router import RouterSetup
from planners.routers.grid import GridRouter
from planners.shield import ShieldSetup
from planners.shields.field_cbf import FieldCbf
from tests.planners.synthetic import OMNI, Box, Disc, belief_of, command_of, mission_to, reachable_from

PERIOD_S, RADIUS_M = 0.05, 0.12
CORRIDOR = (Box(-1, -1.1, 9, -1.0), Box(-1, 1.0, 9, 1.1), Disc(3, 0.3, 0.25, -0.5), Disc(4.5, -0.5, 0.25))


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return the calls, everything compiled and prepared."""
    twist = BodyTwist(0.4, 0.0, 0.0)
    belief, mission = belief_of(CORRIDOR, SE2(2.3, -0.1, 0.1), twist), mission_to(8.0, 0.0)
    setup = PlannerSetup(PERIOD_S, RADIUS_M, OMNI, 0)
    dwa, point_ds = DynamicWindow(DynamicWindow.Settings(), setup), PointAttractor(PointAttractor.Settings(), setup)
    router = GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    shield = FieldCbf(FieldCbf.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, OMNI))
    for part in (dwa, point_ds, router, shield):
        part.warm_up()
    route, reachable = router.route(belief, mission), reachable_from(twist, OMNI, PERIOD_S)
    asked = command_of(BodyTwist(0.5, 0.0, 0.2))
    return [
        ("dwa_step", lambda: dwa.plan(belief, route)),
        ("field_cbf_filter", lambda: shield.filter(asked, belief, reachable)),
        ("point_ds_step", lambda: point_ds.plan(belief, route)),
        ("grid_router_route", lambda: router.route(belief, mission)),
    ]
