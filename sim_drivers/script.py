"""An operator who follows a script."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.mission import Goal
from drivers.interface.samples import (
    EmergencyStop,
    Jog,
    NewGoal,
    OperatorAction,
    OperatorEvent,
    ResetFaults,
    SetEnabled,
    SetPaused,
    Stamp,
)
from drivers.interface.settings import Settings

SECOND_NS = 1_000_000_000


class _Event(Settings):
    at_s: float = Field(ge=0.0, le=1e6, description="after the operator was opened")


class SwitchEvent(_Event):
    """A switch is thrown or a button pressed."""

    action: Literal["enable", "disable", "estop", "reset", "pause", "resume"]


class JogEvent(_Event):
    """The robot is driven by hand for a while."""

    action: Literal["jog"]
    vx: float = Field(default=0.0, ge=-10.0, le=10.0, description="m/s")
    vy: float = Field(default=0.0, ge=-10.0, le=10.0, description="m/s")
    wz: float = Field(default=0.0, ge=-20.0, le=20.0, description="rad/s")
    duration_s: float = Field(gt=0.0, le=3600.0, description="how long it is valid")


class GoalEvent(_Event):
    """A new goal is sent, in the map."""

    action: Literal["goal"]
    x_m: float = Field(ge=-1e4, le=1e4)
    y_m: float = Field(ge=-1e4, le=1e4)
    yaw_rad: float | None = Field(default=None, ge=-7.0, le=7.0, description="none: any heading will do")


Event = Annotated[SwitchEvent | JogEvent | GoalEvent, Field(discriminator="action")]


class ScriptSettings(Settings):
    """What the operator does, and when."""

    events: tuple[Event, ...] = (SwitchEvent(at_s=0.0, action="enable"),)


class ScriptedOperator:
    """An operator who acts at given times: enable, disable, estop, reset, pause, resume, jog, goal.

    Each event is stamped with the time that the script gives, so that a late loop changes when it is heard, not what was said.
    """

    Settings: ClassVar[type[Settings]] = ScriptSettings
    role: ClassVar[str] = "operator"

    def __init__(self, settings: ScriptSettings, setup: DeviceSetup) -> None:
        """Sort the script by time; events of the same time keep their order."""
        self._setup = setup
        self._events = sorted(settings.events, key=lambda event: event.at_s)
        self._state = DeviceState.CLOSED
        self._opened_ns = 0
        self._given = 0

    def open(self) -> None:
        """Start the script from its beginning."""
        if self._state is not DeviceState.OPEN:
            self._state, self._opened_ns, self._given = DeviceState.OPEN, self._setup.now_ns(), 0

    def stop(self) -> None:
        """Do nothing: an operator does not move."""

    def close(self) -> None:
        """End the script."""
        self._state = DeviceState.CLOSED

    def health(self) -> DeviceHealth:
        """Say how it stands; a script at its end is still an operator, who has nothing more to say."""
        return DeviceHealth(device=self._setup.name, state=self._state, received=self._given)

    def drain(self) -> tuple[OperatorEvent, ...]:
        """Return what the operator did since the last call, oldest first."""
        if self._state is not DeviceState.OPEN:
            return ()
        now_ns, given = self._setup.now_ns(), []
        while self._given < len(self._events):
            event = self._events[self._given]
            due_ns = self._opened_ns + round(event.at_s * SECOND_NS)
            if due_ns > now_ns:
                break
            given.append(OperatorEvent(Stamp(due_ns, now_ns, self._given), _action(event, due_ns)))
            self._given += 1
        return tuple(given)


_SWITCHES: dict[str, OperatorAction] = {
    "enable": SetEnabled(True),
    "disable": SetEnabled(False),
    "estop": EmergencyStop(),
    "reset": ResetFaults(),
    "pause": SetPaused(True),
    "resume": SetPaused(False),
}


def _action(event: Event, due_ns: int) -> OperatorAction:
    if isinstance(event, JogEvent):
        return Jog(BodyTwist(event.vx, event.vy, event.wz), due_ns + round(event.duration_s * SECOND_NS))
    if isinstance(event, GoalEvent):
        return NewGoal(Goal(event.x_m, event.y_m, event.yaw_rad))
    return _SWITCHES[event.action]
