"""From faults to commands: what is sent is always finite, inside the limits, and stops when it must."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.arm_motion import PANDA
from drivers.interface.commands import BaseLimits, BodyTwist, Command, JointTrajectory
from drivers.interface.devices import DeviceState
from drivers.interface.geometry import SE2
from drivers.interface.samples import EmergencyStop, Jog, ResetFaults, SetEnabled, SetPaused, Stamp, TruthSample
from drivers.interface.sensed import Sensed, Tick
from estimators.belief import EstimatorFault
from planners.planner import Plan
from planners.shield import Filtered, ReachableSet
from runtime.cycle import Verdict
from runtime.diagnosis import ladder_rung
from runtime.fault_board import FaultBoard
from runtime.faults import RESPONSE, Fault, FaultReport, Response
from runtime.sections import DeadlineLadder, SupervisorSection
from runtime.supervisor import Supervisor, SupervisorSetup
from tests.runtime.cycles import LIMITS, MS, PERIOD_NS, belief, health, sensed, wheels

FORWARD = Plan(base=BodyTwist(0.6, 0.0, 0.0))


class Passing:
    """A shield that sends what can be reached of what is asked, or raises, or asks for the impossible."""

    def __init__(self, raising: bool = False, twist: BodyTwist | None = None) -> None:
        self.raising, self.twist = raising, twist

    def filter(self, command: Command, belief: object, reachable: ReachableSet) -> Filtered:
        if self.raising:
            raise ZeroDivisionError("division by zero")
        twist = reachable.clip(command.base) if self.twist is None else self.twist
        return Filtered(replace(command, base=twist))


def supervisor(
    shield: Passing | None = None, board: FaultBoard | None = None, limits: BaseLimits = LIMITS, **settings: object
) -> Supervisor:
    setup = SupervisorSetup(PERIOD_NS * 1e-9, limits, plan_budget_ns=PERIOD_NS, has_operator=True)
    return Supervisor(SupervisorSection(**settings), setup, shield or Passing(), board or FaultBoard())


def drive(guard: Supervisor, ticks: range, plan: Plan = FORWARD, **changes: object) -> list[Verdict]:
    return [guard.admit(plan, belief(k), sensed(k, **changes)) for k in ticks]


def present(verdict: Verdict) -> set[Fault]:
    return {report.fault for report in verdict.faults}


def test_a_healthy_robot_gets_up_to_the_speed_that_was_asked() -> None:
    verdicts = drive(supervisor(), range(40))
    assert all(v.response is Response.RUN and not v.faults for v in verdicts)
    assert math.isclose(verdicts[-1].command.base.vx, 0.6, abs_tol=1e-6)
    assert all(v.command.expires_ns == k * PERIOD_NS + 250 * MS for k, v in enumerate(verdicts))
    assert all(v.command.oldest_input_ns == k * PERIOD_NS - 10 * MS for k, v in enumerate(verdicts))


def test_every_fault_has_a_response() -> None:
    assert set(RESPONSE) == set(Fault)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_non_finite_plan_stops_the_robot_and_is_named(bad: float) -> None:
    guard = supervisor()
    drive(guard, range(40))
    verdict = guard.admit(Plan(base=BodyTwist(bad, 0.0, 0.0)), belief(40), sensed(40))
    assert Fault.NON_FINITE_COMMAND in present(verdict)
    assert verdict.response is Response.STAND_DOWN
    assert math.isclose(verdict.command.base.vx, 0.6 - 2.0 * 0.05, abs_tol=1e-6)


def test_a_stand_down_ends_by_itself() -> None:
    guard = supervisor()
    drive(guard, range(20))
    guard.admit(Plan(base=BodyTwist(math.nan, 0, 0)), belief(20), sensed(20))
    verdicts = drive(guard, range(21, 60))
    assert verdicts[0].response is Response.RUN
    assert math.isclose(verdicts[-1].command.base.vx, 0.6, abs_tol=1e-6)


def test_an_emergency_stop_latches_until_it_is_reset() -> None:
    guard = supervisor()
    drive(guard, range(30))
    guard.admit(FORWARD, belief(30), sensed(30, EmergencyStop()))
    verdicts = drive(guard, range(31, 60))
    assert all(v.response is Response.LATCH for v in verdicts)
    assert verdicts[-1].command.base == BodyTwist()
    again = guard.admit(FORWARD, belief(60), sensed(60, ResetFaults()))
    assert again.response is Response.RUN
    assert again.command.base.vx > 0.0


def test_a_device_fault_stays_latched_after_the_device_recovers() -> None:
    guard = supervisor()
    drive(guard, range(5))
    broken = (health(state=DeviceState.FAULTED, fault="axis 1: over-current"),)
    verdict = guard.admit(FORWARD, belief(5), sensed(5, health=broken))
    assert verdict.faults == (FaultReport(Fault.DEVICE_FAULT, "base", "axis 1: over-current"),)
    assert guard.admit(FORWARD, belief(6), sensed(6)).response is Response.LATCH


def test_silence_stands_the_robot_down_and_samples_bring_it_back() -> None:
    guard = supervisor()
    drive(guard, range(20))
    silent = drive(guard, range(20, 32), base=())
    assert Fault.SILENT_DEVICE not in present(silent[3])
    assert present(silent[-1]) == {Fault.SILENT_DEVICE}
    assert silent[-1].command.base == BodyTwist()
    assert drive(guard, range(32, 34))[-1].response is Response.RUN


def test_the_same_sample_again_is_not_news() -> None:
    guard = supervisor()
    drive(guard, range(20))
    frozen = (wheels(19 * PERIOD_NS, 95),)
    assert present(drive(guard, range(20, 32), base=frozen)[-1]) == {Fault.SILENT_DEVICE}


def test_samples_that_come_late_are_stale() -> None:
    guard = supervisor()
    drive(guard, range(5))
    verdicts = [
        guard.admit(FORWARD, belief(k), sensed(k, base=(wheels(k * PERIOD_NS - 450 * MS, k, 449 * MS),))) for k in range(20, 24)
    ]
    assert present(verdicts[-1]) == {Fault.STALE_SAMPLE}


def test_until_every_device_has_delivered_the_robot_waits() -> None:
    guard = supervisor(startup_grace_s=1.0)
    verdicts = drive(guard, range(40), base=())
    assert present(verdicts[5]) == {Fault.STARTING}
    assert present(verdicts[-1]) == {Fault.SILENT_DEVICE}
    assert all(v.command.base == BodyTwist() for v in verdicts)


def test_half_the_rate_slows_the_robot() -> None:
    guard = supervisor(startup_grace_s=0.0)
    verdicts = [guard.admit(FORWARD, belief(k), sensed(k, base=(wheels(k * PERIOD_NS - MS, k),))) for k in range(120)]
    assert present(verdicts[-1]) == {Fault.WRONG_RATE}
    assert verdicts[-1].command.base.vx <= 0.375 + 1e-6


def test_samples_that_the_loop_was_too_slow_to_see_count_for_the_rate() -> None:
    guard = supervisor(startup_grace_s=0.0)
    one_of_five = [
        sensed(k, base=(wheels(k * PERIOD_NS - MS, 5 * k),), health=(health(received=5 * (k + 1), overflowed=4 * (k + 1)),))
        for k in range(120)
    ]
    assert not any(guard.admit(FORWARD, belief(k), cycle).faults for k, cycle in enumerate(one_of_five))


def test_half_the_rate_slows_the_arm_as_well() -> None:
    setup = SupervisorSetup(PERIOD_NS * 1e-9, None, PERIOD_NS, has_operator=True, arm_limits=PANDA)
    guard = Supervisor(SupervisorSection(startup_grace_s=0.0, slow_factor=0.4), setup, Passing(), FaultBoard())
    knots = np.stack((PANDA.position_min_rad, PANDA.position_max_rad))
    plan = Plan(None, JointTrajectory(0, np.array([0.0, 9.0]), knots, np.zeros_like(knots)))
    verdicts = [guard.admit(plan, belief(k), sensed(k, base=(wheels(k * PERIOD_NS - MS, k),))) for k in range(120)]
    assert verdicts[0].command.arm.speed_factor == 1.0
    assert present(verdicts[-1]) == {Fault.WRONG_RATE}
    assert verdicts[-1].command.arm.speed_factor == 0.4
    assert verdicts[-1].asked.arm.speed_factor == 1.0


def skipping(index: int, skipped: int) -> Sensed:
    return replace(sensed(index), tick=Tick(index, index * PERIOD_NS, PERIOD_NS, skipped))


def test_the_ladder_is_climbed_by_consecutive_misses_only() -> None:
    guard = supervisor(deadline_ladder=DeadlineLadder(hold=2, decelerate=3, stop=4, latch=6))
    drive(guard, range(20))
    climbed = [guard.admit(FORWARD, belief(k), skipping(k, 1)) for k in range(21, 27)]
    assert [v.faults[-1].fault for v in climbed] == [
        Fault.DEADLINE_TOLERATED,
        Fault.DEADLINE_HELD,
        Fault.DEADLINE_SLOWED,
        Fault.DEADLINE_STOPPED,
        Fault.DEADLINE_STOPPED,
        Fault.DEADLINE_LATCHED,
    ]
    assert guard.admit(FORWARD, belief(27), sensed(27)).response is Response.LATCH


def test_a_loop_that_keeps_missing_drives_slower_until_it_is_on_time() -> None:
    """Never two in a row, so that the ladder would only tolerate it."""
    guard = supervisor()
    drive(guard, range(20))
    late = [guard.admit(FORWARD, belief(k), skipping(k, int(k % 2 == 0))) for k in range(20, 120)]
    assert Fault.DEADLINE_SLOWED not in present(late[5])
    assert Fault.DEADLINE_SLOWED in present(late[-1])
    assert late[-1].response is Response.DECELERATE
    punctual = drive(guard, range(120, 170))
    assert punctual[-1].response is Response.RUN


def test_a_held_command_keeps_its_expiry() -> None:
    guard = supervisor(deadline_ladder=DeadlineLadder(hold=1, decelerate=100, stop=100, latch=100))
    last = drive(guard, range(20))[-1]
    held = guard.admit(Plan(base=BodyTwist(0.1, 0, 0)), belief(21), skipping(21, 1))
    assert held.command == last.command
    expired = guard.admit(FORWARD, belief(26), skipping(26, 1))
    assert expired.command.base.vx < held.command.base.vx
    assert expired.command.expires_ns > 26 * PERIOD_NS


def test_no_misses_no_rung() -> None:
    assert ladder_rung(DeadlineLadder(), 0) is None


def test_the_operator_pauses_jogs_and_takes_the_permission_away() -> None:
    guard = supervisor()
    drive(guard, range(30))
    paused = guard.admit(FORWARD, belief(30), sensed(30, SetPaused(True)))
    assert present(paused) == {Fault.PAUSED}
    jogging = guard.admit(FORWARD, belief(31), sensed(31, Jog(BodyTwist(0.0, 0.2, 0.0), 33 * PERIOD_NS)))
    assert jogging.response is Response.RUN
    assert jogging.command.base.vy > 0.0
    drive(guard, range(32, 33))
    assert drive(guard, range(33, 34))[-1].response is Response.STAND_DOWN
    resumed = guard.admit(FORWARD, belief(34), sensed(34, SetPaused(False), SetEnabled(False)))
    assert present(resumed) == {Fault.NOT_ENABLED}


def test_a_shield_that_raises_stops_the_robot() -> None:
    guard = supervisor(Passing(raising=True))
    verdict = drive(guard, range(3))[-1]
    assert present(verdict) == {Fault.SHIELD_RAISED}
    assert verdict.command.base == BodyTwist()
    assert "division by zero" in verdict.faults[0].detail


@pytest.mark.parametrize("twist", [BodyTwist(math.nan, 0, 0), BodyTwist(5.0, 0, 0)])
def test_the_last_check_lets_nothing_through(twist: BodyTwist) -> None:
    verdict = drive(supervisor(Passing(twist=twist)), range(3))[-1]
    assert Fault.COMMAND_OUT_OF_LIMITS in present(verdict)
    assert verdict.response is Response.STAND_DOWN
    assert verdict.command.base == BodyTwist()


def test_a_slow_planner_is_a_fault_of_the_tick_after() -> None:
    late = replace(sensed(1), tick=Tick(1, PERIOD_NS, PERIOD_NS, 0, 0, 60 * MS, 55 * MS))
    guard = supervisor()
    drive(guard, range(1))
    assert present(guard.admit(FORWARD, belief(1), late)) == {Fault.PLANNER_OVER_BUDGET}


def test_estimator_faults_and_posted_reports_count() -> None:
    board = FaultBoard()
    guard = supervisor(board=board)
    drive(guard, range(1))
    board.post(FaultReport(Fault.PLANNER_RAISED, "planner", "boom"))
    verdict = guard.admit(FORWARD, belief(1, faults=(EstimatorFault.INVALID_INPUT,)), sensed(1))
    assert present(verdict) == {Fault.PLANNER_RAISED, Fault.INVALID_VALUES}
    assert guard.admit(FORWARD, belief(2), sensed(2)).response is Response.RUN


def test_after_an_expired_command_it_goes_on_from_what_the_base_really_does() -> None:
    guard = supervisor()
    drive(guard, range(40))
    verdict = guard.admit(FORWARD, belief(60, twist=BodyTwist(0.0, 0.0, 0.0)), sensed(60))
    assert verdict.command.base.vx <= 0.05


def test_a_command_that_expired_at_the_base_is_reported_once() -> None:
    guard = supervisor()
    drive(guard, range(3))
    tripped = drive(guard, range(3, 6), health=(health(expired_commands=1),))
    assert [Fault.DEAD_MAN_TRIPPED in present(v) for v in tripped] == [True, False, False]


class Forgetful:
    """A shield that does not answer, or takes the base out of the command."""

    def __init__(self, answers: bool) -> None:
        self.answers = answers

    def filter(self, command: Command, belief: object, reachable: object) -> Filtered | None:
        return Filtered(replace(command, base=None)) if self.answers else None


@pytest.mark.parametrize(("answers", "fault"), [(False, Fault.SHIELD_RAISED), (True, Fault.COMMAND_OUT_OF_LIMITS)])
def test_a_shield_that_says_nothing_stops_the_robot(answers: bool, fault: Fault) -> None:
    verdict = drive(supervisor(Forgetful(answers)), range(3))[-1]
    assert present(verdict) == {fault}
    assert verdict.command.base == BodyTwist()


def test_motion_that_the_base_cannot_make_is_named_and_stops_it_instead_of_being_clipped() -> None:
    skid_steer = replace(LIMITS, velocity=BodyTwist(0.75, 0.0, 1.2))
    guard = supervisor(limits=skid_steer)
    moving = drive(guard, range(40))[-1]
    assert moving.command.base.vx > 0.5
    sideways = drive(guard, range(40, 60), Plan(base=BodyTwist(0.6, 0.1, 0.0)))
    assert present(sideways[0]) == {Fault.IMPOSSIBLE_MOTION}
    assert sideways[-1].command.base == BodyTwist()
    assert drive(guard, range(60, 61), Plan(base=BodyTwist(0.6, 1e-12, 0.0)))[-1].response is Response.RUN


def test_a_belief_that_is_not_finite_never_reaches_the_wire() -> None:
    guard = supervisor()
    drive(guard, range(10))
    lost = belief(30, twist=BodyTwist(math.nan, 0.0, 0.0), faults=(EstimatorFault.DIVERGED,))  # the last command has expired
    verdict = guard.admit(FORWARD, lost, sensed(30))
    assert verdict.response is Response.LATCH
    assert verdict.command.base == BodyTwist()


def test_a_contact_latches() -> None:
    guard = supervisor()
    drive(guard, range(10))
    truth = TruthSample(Stamp(0, 0, 0), SE2(), BodyTwist(), (), -0.01, ("wall",))
    assert (
        FaultReport(Fault.COLLISION, "truth", "it touches wall")
        in guard.admit(FORWARD, belief(10), sensed(10, truth=truth)).faults
    )
    assert guard.admit(FORWARD, belief(11), sensed(11)).response is Response.LATCH


def test_a_device_that_is_being_reconnected_stands_the_robot_down_and_latches_nothing() -> None:
    guard = supervisor()
    drive(guard, range(20))
    lost = health(state=DeviceState.RECONNECTING, fault="the cable is out")
    (verdict,) = drive(guard, range(20, 21), health=(lost,))
    assert verdict.response is Response.STAND_DOWN
    assert [(report.fault, report.detail) for report in verdict.faults] == [(Fault.SILENT_DEVICE, "the cable is out")]
    assert drive(guard, range(21, 22))[0].response is Response.RUN
