"""What the operator wants now, folded from his actions."""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivers.interface.samples import EmergencyStop, Jog, OperatorEvent, ResetFaults, SetEnabled, SetPaused
from runtime.faults import Fault, FaultReport


@dataclass(frozen=True, slots=True)
class OperatorState:
    """Permission to move, pause, e-stop and the jog in force.  A robot without an operator is enabled."""

    enabled: bool = True
    paused: bool = False
    emergency: bool = False
    reset: bool = False  # asked at this very tick
    jog: Jog | None = None

    def after(self, events: tuple[OperatorEvent, ...], now_ns: int) -> OperatorState:
        """Return the state after this tick's actions."""
        state = replace(self, reset=False)
        for event in events:
            state = _fold(state, event)
        if state.jog is not None and state.jog.expires_ns <= now_ns:
            state = replace(state, jog=None)
        return state

    def faults(self) -> list[FaultReport]:
        """Return what the operator's wish means for motion."""
        found = []
        if self.emergency:
            found.append(FaultReport(Fault.EMERGENCY_STOP, "operator"))
        if not self.enabled:
            found.append(FaultReport(Fault.NOT_ENABLED, "operator"))
        if self.paused and self.jog is None:
            found.append(FaultReport(Fault.PAUSED, "operator"))
        return found


def _fold(state: OperatorState, event: OperatorEvent) -> OperatorState:
    match event.action:
        case SetEnabled(enabled):
            return replace(state, enabled=enabled)
        case SetPaused(paused):
            return replace(state, paused=paused)
        case EmergencyStop():
            return replace(state, emergency=True)
        case ResetFaults():
            return replace(state, emergency=False, reset=True)
        case Jog() as jog:
            return replace(state, jog=jog)
        case _:  # a new goal is the mission's business
            return state
