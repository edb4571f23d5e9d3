"""Has the autopilot enter the mode that follows set-points, and arm: asked again after a refusal, for a while."""

from __future__ import annotations

from drivers.rover_serial.autopilots import MODE_FLAG_CUSTOM, Autopilot
from drivers.rover_serial.commands import Commands, Result
from drivers.rover_serial.messages import ARM_DISARM, DO_SET_MODE

RETRY_NS = 1_000_000_000  # after a refusal
REASON_NS = 300_000_000  # a reason may come a moment after the refusal


class Arming:
    """One attempt, which ends in `done` or with a `refusal`; meanwhile somebody sends set-points."""

    def __init__(self, autopilot: Autopilot, commands: Commands, patience_s: float, now_ns: int) -> None:
        """Begin; PX4 wants set-points for a while before it changes its mode."""
        self._autopilot, self._commands = autopilot, commands
        self._retry_ns = now_ns + round(autopilot.stream_first_s * 1e9)
        self._until_ns = self._retry_ns + round(patience_s * 1e9)
        self._now_ns = now_ns
        self._outcome = ""  # why it will not be
        self._told_ns = 0  # when it is told
        self._over = False
        self.done = False
        self.refusal = ""

    def abandon(self) -> None:
        """Leave it; what is answered later does not count."""
        self._over = True

    def step(self, now_ns: int) -> None:
        """Go on."""
        self._now_ns = now_ns
        if self._outcome:
            self.refusal = self._outcome if now_ns >= self._told_ns else ""
        elif not self.done and self._commands.idle and now_ns >= self._retry_ns:
            self._retry_ns = now_ns + RETRY_NS
            self._commands.ask(DO_SET_MODE, (float(MODE_FLAG_CUSTOM), *map(float, self._autopilot.mode)), self._mode_set)

    def _mode_set(self, result: Result) -> None:
        if self._over:
            return
        if result is Result.ACCEPTED:
            self._commands.ask(ARM_DISARM, (1.0,), self._armed)
        else:
            self._refused(f"the mode {self._autopilot.mode_name} {result.words}")

    def _armed(self, result: Result) -> None:
        if self._over:
            return
        if result is Result.ACCEPTED:
            self.done = True
        else:
            self._refused(f"arming {result.words}")

    def _refused(self, what: str) -> None:
        self._retry_ns = self._now_ns + RETRY_NS
        if self._retry_ns > self._until_ns:
            self._outcome, self._told_ns = what, self._now_ns + REASON_NS
