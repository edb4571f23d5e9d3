"""Key frames: all that the parts go on from at the beginning of a tick, so that a replay need not begin with the first."""

from __future__ import annotations

from dataclasses import dataclass

from runtime.cycle import Cycle
from runtime.faults import Fault
from runtime.parts import Parts
from runtime.planning import RunnerState
from runtime.supervisor import SupervisorState
from runtime.watch import SECOND_NS

_CARRIED_OVER = frozenset({Fault.ESTIMATOR_RAISED, Fault.PLANNER_RAISED})  # their answer is one of an earlier tick


@dataclass(frozen=True, slots=True)
class KeyState:
    """The states that are dataclasses of our own."""

    supervisor: SupervisorState
    runner: RunnerState


@dataclass(frozen=True, slots=True)
class KeyFrame:
    """What a tick is begun with; of the runner, what it goes on from when it has collected the plan that is due."""

    state: KeyState
    estimator: bytes  # snapshots
    router: bytes
    planner: bytes
    shield: bytes

    def restore(self, parts: Parts, anew: frozenset[str] = frozenset()) -> None:
        """Have the parts go on from here, but for those named in `anew`, which are others than were recorded."""
        for name in ("estimator", "router", "planner", "shield"):
            if name not in anew:
                getattr(parts, name).restore(getattr(self, name))
        parts.supervisor.state = self.state.supervisor
        parts.runner.state = self.state.runner


@dataclass(frozen=True, slots=True)
class _Begun:
    estimator: bytes
    router: bytes
    shield: bytes
    supervisor: SupervisorState


class KeyFrames:
    """Takes a key frame every so often: most of it between two ticks, when nobody waits for the loop."""

    def __init__(self, parts: Parts, interval_s: float) -> None:
        """Begin with the first interval; the first tick needs none."""
        self.fault = ""  # why no more are taken: a part that cannot say what it goes on from
        self._parts = parts
        self._interval_ns = round(interval_s * SECOND_NS)
        self._due_ns: int | None = None
        self._begun: _Begun | None = None

    def after(self, cycle: Cycle) -> KeyFrame | None:
        """Return the key frame that this tick was begun with, if one was taken; begin the next tick's, if one is due."""
        frame, now_ns = self._finished(cycle), cycle.sensed.tick.start_ns
        if frame is not None or self._due_ns is None:
            self._due_ns = now_ns + self._interval_ns
        if now_ns >= self._due_ns and not self.fault and self._parts.runner.is_idle_at(cycle.sensed.tick.index + 1):
            self._begin()
        return frame

    def _begin(self) -> None:
        parts = self._parts
        taken = {}
        for name in ("estimator", "router", "shield"):
            try:
                taken[name] = getattr(parts, name).snapshot()
            except Exception as error:  # noqa: BLE001 - a part is anyone's code; its failure costs key frames, not the run
                self.fault = f"no more key frames: the {name}'s snapshot raised {type(error).__name__}: {error}"
                return
        self._begun = _Begun(**taken, supervisor=parts.supervisor.state)
        parts.runner.ask_checkpoint()

    def _finished(self, cycle: Cycle) -> KeyFrame | None:
        """Return the key frame; none where the tick also rested on what no part keeps as its state."""
        begun, checkpoint, self._begun = self._begun, self._parts.runner.checkpoint, None
        self.fault = self.fault or self._parts.runner.checkpoint_fault
        if begun is None or checkpoint is None or any(report.fault in _CARRIED_OVER for report in cycle.verdict.faults):
            return None
        state = KeyState(begun.supervisor, checkpoint.state)
        return KeyFrame(state, begun.estimator, begun.router, checkpoint.planner, begun.shield)
