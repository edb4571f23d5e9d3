"""The supervisor: faults to a response, a response to a command, and the last check before the wire."""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivers.interface.commands import BaseLimits, BodyTwist, Command, JointLimits, JointTrajectory
from drivers.interface.sensed import Sensed
from estimators.belief import Belief
from planners.planner import Plan
from planners.shield import Filtered, ReachableSet, Shield
from runtime.cycle import Verdict
from runtime.diagnosis import Diagnosis, DiagnosisState, worst
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport, Response
from runtime.guards import checked, report
from runtime.limits import Limiter, Motion
from runtime.operator_state import OperatorState
from runtime.sections import SupervisorSection
from runtime.watch import SECOND_NS

STANDING = ReachableSet(BodyTwist(), BodyTwist())


@dataclass(frozen=True, slots=True)
class SupervisorSetup:
    """What the supervisor needs to know about the robot and the loop."""

    period_s: float
    limits: BaseLimits | None
    plan_budget_ns: int
    has_operator: bool
    arm_limits: JointLimits | None = None  # None: a robot without an arm


@dataclass(frozen=True, slots=True)
class SupervisorState:
    """What a supervisor goes on from, the shield's own state aside."""

    operator: OperatorState
    motion: Motion
    last: Command
    diagnosis: DiagnosisState


class Supervisor:
    """Admits commands.  Whatever it is given, it returns a finite command inside the limits that expires."""

    def __init__(self, settings: SupervisorSection, setup: SupervisorSetup, shield: Shield, board: FaultBoard) -> None:
        """Start standing, with nothing latched."""
        self._settings = settings
        self._setup = setup
        self._shield = shield
        self._board = board
        self._diagnosis = Diagnosis(settings, setup.limits, setup.plan_budget_ns, board)
        self._limiter = None if setup.limits is None else Limiter(setup.limits, setup.period_s)
        self._arm_at_rest = None if setup.arm_limits is None else JointTrajectory.rest()
        self._operator = OperatorState(enabled=not setup.has_operator)
        self._motion = Motion()
        self._last = Command(None, None, 0, 0)

    def admit(self, plan: Plan, belief: Belief, sensed: Sensed) -> Verdict:
        """Return what is sent at this tick, and why."""
        self._operator = self._operator.after(sensed.operator, sensed.tick.start_ns)
        faults = self._diagnosis.faults(plan, belief, sensed, self._operator)
        self._resume_from(belief, sensed)
        reachable = self._reachable(worst(faults))
        wanted = self._wanted(plan, belief, sensed)
        asked = wanted if wanted.base is None else replace(wanted, base=reachable.clip(wanted.base))
        filtered = self._shielded(wanted, belief, reachable, faults)
        command = self._slowed(self._responding(worst(faults), asked, filtered, sensed), worst(faults))
        command = self._checked(command, sensed, faults)
        self._remember(command)
        return Verdict(command, asked, worst(faults), tuple(faults), reachable, filtered, self._board.given)

    @property
    def state(self) -> SupervisorState:
        """What it goes on from; it can be set."""
        return SupervisorState(self._operator, self._motion, self._last, self._diagnosis.state)

    @state.setter
    def state(self, state: SupervisorState) -> None:
        self._operator, self._motion, self._last = state.operator, state.motion, state.last
        self._diagnosis.state = state.diagnosis

    def _resume_from(self, belief: Belief, sensed: Sensed) -> None:
        """After the last command has expired the base stands or brakes by itself: go on from what it really does."""
        if self._limiter is not None and sensed.tick.start_ns >= self._last.expires_ns > 0:
            self._motion = Motion(self._limiter.nearest(belief.twist) if belief.twist.finite else BodyTwist())

    def _reachable(self, response: Response) -> ReachableSet:
        if self._limiter is None:
            return STANDING
        factor = self._settings.slow_factor if response is Response.DECELERATE else 1.0
        return self._limiter.reachable(self._motion, factor)

    def _wanted(self, plan: Plan, belief: Belief, sensed: Sensed) -> Command:
        """Return what the planner wants in the end: a shield has to know that it brakes, not how far it gets in this tick."""
        twist, arm = plan.base, plan.arm
        if self._operator.jog is not None:  # who drives by hand has the base to himself
            twist, arm = self._operator.jog.twist, None
        if self._limiter is None:
            twist = None
        elif twist is None or not twist.finite:
            twist = BodyTwist()
        expires_ns = sensed.tick.start_ns + round(self._settings.command_lifetime_s * SECOND_NS)
        if self._arm_at_rest is None or arm is None:
            arm = self._arm_at_rest
        return Command(twist, arm, expires_ns, belief.oldest_input_ns)

    def _shielded(self, wanted: Command, belief: Belief, reachable: ReachableSet, faults: list[FaultReport]) -> Filtered | None:
        if worst(faults) not in {Response.RUN, Response.DECELERATE} or wanted.base is None:
            return None
        try:
            return checked(self._shield.filter(wanted, belief, reachable), Filtered)
        except Exception as error:  # noqa: BLE001 - a shield is anyone's code; its failure must stop the robot, not the loop
            faults.append(report(error, Fault.SHIELD_RAISED, "shield"))
            return None

    def _responding(self, response: Response, asked: Command, filtered: Filtered | None, sensed: Sensed) -> Command:
        if response is Response.HOLD and sensed.tick.start_ns < self._last.expires_ns:
            return self._last
        if response is Response.RUN or response is Response.DECELERATE:
            return asked if filtered is None else filtered.command
        return self._stopping(asked)

    def _slowed(self, command: Command, response: Response) -> Command:
        """Lower the arm's speed limits while decelerating; the base's are in what it can reach."""
        if response is not Response.DECELERATE or command.arm is None:
            return command
        return replace(command, arm=replace(command.arm, speed_factor=self._settings.slow_factor * command.arm.speed_factor))

    def _checked(self, command: Command, sensed: Sensed, faults: list[FaultReport]) -> Command:
        """Assert, last before the wire: finite, inside the limits, not expired.  It repairs nothing; it stops."""
        wrong = self._wrong_with_base(command, sensed) or self._wrong_with_arm(command.arm)
        if wrong is None:
            return command
        faults.append(wrong)
        return self._stopping(command)

    def _wrong_with_base(self, command: Command, sensed: Sensed) -> FaultReport | None:
        if self._limiter is None:
            return None
        twist = command.base
        if twist is not None and twist.finite and self._limiter.within_caps(twist) and command.expires_ns > sensed.tick.start_ns:
            return None
        return FaultReport(Fault.COMMAND_OUT_OF_LIMITS, "supervisor", f"{twist} failed the last check")

    def _wrong_with_arm(self, trajectory: JointTrajectory | None) -> FaultReport | None:
        limits = self._setup.arm_limits
        if trajectory is None or limits is None or not (wrong := limits.fault_of(trajectory)):
            return None
        fault = Fault.COMMAND_OUT_OF_LIMITS if trajectory.finite else Fault.NON_FINITE_COMMAND
        return FaultReport(fault, "planner", f"the arm's trajectory {wrong}")

    def _stopping(self, command: Command) -> Command:
        stopping = None if self._limiter is None else self._limiter.stopping(self._motion)
        return replace(command, base=stopping, arm=self._arm_at_rest)

    def _remember(self, command: Command) -> None:
        if self._limiter is not None and command.base is not None:
            self._motion = self._limiter.after(self._motion, command.base)
        self._last = command
