"""What is said in words: faults that come and go, changes of the response, what the operator did."""

from __future__ import annotations

from typing import NamedTuple

import rerun as rr

from drivers.interface.mission import Goal
from drivers.interface.samples import EmergencyStop, Jog, NewGoal, OperatorAction, ResetFaults, SetEnabled, SetPaused
from runtime.cycle import Cycle
from runtime.faults import FaultReport, Response
from runtime.log.drawn import colours
from runtime.log.drawn.layers import Rows
from runtime.log.exact.leaves import said
from runtime.log.files.sink import Sink

EVENTS = "/view/events"
RESPONSE = "/view/response"
_LEVELS = {
    Response.RUN: rr.TextLogLevel.INFO,
    Response.HOLD: rr.TextLogLevel.INFO,
    Response.DECELERATE: rr.TextLogLevel.WARN,
    Response.STAND_DOWN: rr.TextLogLevel.ERROR,
    Response.LATCH: rr.TextLogLevel.CRITICAL,
}


class Event(NamedTuple):
    """One line of text."""

    level: str
    text: str


class Events:
    """Writes what has changed since the tick before."""

    def __init__(self) -> None:
        """Know of nothing yet."""
        self._text: Rows[Event] = Rows(EVENTS, _texts)
        self._state: Rows[str] = Rows(RESPONSE, _states, [(RESPONSE, _state_style())])
        self._response: Response | None = None
        self._faults: dict[tuple[str, str], FaultReport] = {}
        self._goals: tuple[Goal, ...] | None = None
        self._contacts: tuple[str, ...] = ()
        self._words: dict[str, str] = {}

    def put(self, cycle: Cycle) -> None:
        """Write what is new."""
        tick, verdict = cycle.sensed.tick, cycle.verdict
        for event in cycle.sensed.operator:
            self._text.add(tick, Event(rr.TextLogLevel.INFO, f"operator: {_action(event.action)}"))
        for news in self._on_the_way(cycle):
            self._text.add(tick, news)
        words = {name: value for name, value in said(cycle.plan.diagnostics) if isinstance(value, str)}
        for name, value in words.items():
            if value and value != self._words.get(name):
                self._text.add(tick, Event(rr.TextLogLevel.DEBUG, f"planner: {name.replace('_', ' ')}: {value}"))
        self._words = words
        faults = {(report.fault.value, report.device): report for report in verdict.faults}
        for key, report in faults.items():
            if key not in self._faults:
                self._text.add(tick, Event(_LEVELS[report.response], _sentence(report)))
        for key, report in self._faults.items():
            if key not in faults:
                self._text.add(tick, Event(rr.TextLogLevel.INFO, f"over: {_name(report)}"))
        self._faults = faults
        if verdict.response is not self._response:
            self._response = verdict.response
            self._state.add(tick, verdict.response.name)
            self._text.add(tick, Event(_LEVELS[verdict.response], f"response: {verdict.response.name}"))

    def _on_the_way(self, cycle: Cycle) -> list[Event]:
        """Return which goal lies behind the robot now, and what it has begun to touch."""
        goals, truth, events = cycle.sensed.mission.goals, cycle.sensed.truth, []
        if self._goals and goals == self._goals[1:]:
            events.append(Event(rr.TextLogLevel.INFO, f"goal reached: {_place(self._goals[0])}"))
        if goals != self._goals and goals:
            events.append(
                Event(rr.TextLogLevel.INFO, f"goal: {_place(goals[0])}" + f", then {len(goals) - 1} more" * (len(goals) > 1))
            )
        contacts = truth.contacts if truth is not None else ()
        events += [
            Event(rr.TextLogLevel.CRITICAL, f"the robot touches {name}") for name in contacts if name not in self._contacts
        ]
        self._goals, self._contacts = goals, contacts
        return events

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        self._text.send(sink)
        self._state.send(sink)


def _sentence(report: FaultReport) -> str:
    return f"fault: {_name(report)}" + (f": {report.detail}" if report.detail else "")


def _name(report: FaultReport) -> str:
    return report.fault.value + (f" of {report.device}" if report.device else "")


def _place(goal: Goal) -> str:
    return f"{goal.x_m:g} m, {goal.y_m:g} m"


def _action(action: OperatorAction) -> str:
    match action:
        case SetEnabled(enabled):
            return "gives the permission to move" if enabled else "takes the permission to move"
        case SetPaused(paused):
            return "pauses" if paused else "resumes"
        case Jog(twist):
            return f"jog {twist.vx:g} m/s, {twist.vy:g} m/s, {twist.wz:g} rad/s"
        case NewGoal(goal):
            return f"new goal at {_place(goal)}"
        case EmergencyStop():
            return "emergency stop"
        case ResetFaults():
            return "resets the faults"


def _texts(events: list[Event]) -> rr.ComponentColumnList:
    return rr.TextLog.columns(text=[event.text for event in events], level=[event.level for event in events])


def _states(names: list[str]) -> rr.ComponentColumnList:
    return rr.StateChange.columns(state=names)


def _state_style() -> rr.AsComponents:
    return rr.StateConfiguration(values=[response.name for response in Response], colors=colours.RESPONSES)
