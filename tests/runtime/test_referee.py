"""The referee tells a robot that is hit from one that hits, and counts what a run cost."""

import pytest

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.geometry import SE2
from drivers.interface.samples import Stamp, TruthSample
from planners.planner import Plan, no_path
from planners.router import Route
from runtime.cycle import Cycle, Verdict
from runtime.faults import Response
from runtime.mission import MissionTracker
from runtime.referee import Outcome, Referee
from runtime.supervisor import STANDING
from tests.runtime.cycles import MISSION, PERIOD_NS, belief, sensed

CRUISING, TURNING, STILL, PUSHED = BodyTwist(0.4), BodyTwist(wz=0.5), BodyTwist(0.01, 0.0, 0.02), BodyTwist(-0.8, 0.3, 1.0)


def cycle(index: int, twist: BodyTwist, clearance_m: float = 0.5, contacts: tuple[str, ...] = ()) -> Cycle:
    now_ns = index * PERIOD_NS
    truth = TruthSample(Stamp(now_ns, now_ns, index), SE2(), twist, (), clearance_m, contacts)
    command = Command(BodyTwist(), None, now_ns + PERIOD_NS, now_ns)
    verdict = Verdict(command, command, Response.RUN, (), STANDING, None)
    return Cycle(sensed(index, truth=truth), belief(index), Route(None, no_path(), 0.0), Plan(BodyTwist()), verdict, ())


def judged(twists: list[BodyTwist], clearance_m: float = -0.01, contacts: tuple[str, ...] = ("cart",)) -> Referee:
    """A run with these true twists, which is touched on the tick after them and pushed while it is."""
    referee = Referee(MissionTracker(MISSION), time_limit_s=60.0, give_up_after_s=3.0, interrupted=lambda: False)
    for index, twist in enumerate(twists):
        assert not referee.is_over(cycle(index, twist))
    assert referee.is_over(cycle(len(twists), PUSHED, clearance_m, contacts))
    assert referee.outcome is Outcome.COLLIDED
    return referee


@pytest.mark.parametrize(
    ("twists", "hit"),
    [
        ([CRUISING] * 10, False),
        ([STILL] * 10, True),
        ([CRUISING] * 10 + [STILL] * 6, True),  # 0.3 s
        ([CRUISING] * 10 + [STILL] * 4, False),  # just braked before what came
        ([STILL] * 10 + [CRUISING], False),
        ([STILL] * 10 + [TURNING], False),  # its corners swing
    ],
)
def test_who_has_stood_for_a_while_was_hit(twists: list[BodyTwist], hit: bool) -> None:
    assert judged(twists).tally.hit_while_standing is hit


@pytest.mark.parametrize(("clearance_m", "contacts"), [(0.01, ("cart",)), (0.0, ())])
def test_a_touch_is_a_contact_or_no_room(clearance_m: float, contacts: tuple[str, ...]) -> None:
    assert judged([STILL] * 10, clearance_m, contacts).tally.hit_while_standing
