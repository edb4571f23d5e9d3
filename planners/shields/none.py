"""No shield: the command is only brought inside what the limits can reach."""

from __future__ import annotations

from dataclasses import replace

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.settings import Settings
from estimators.belief import Belief
from planners.shield import Filtered, ReachableSet, ShieldSetup


class NoShield:
    """No shield: clips, and knows of no obstacle."""

    class Settings(Settings):
        """It has none."""

    def __init__(self, settings: Settings, setup: ShieldSetup) -> None:
        """Take nothing."""

    @property
    def kept_clear_m(self) -> float:
        """It knows of no obstacle."""
        return 0.0

    def warm_up(self) -> None:
        """Nothing to compile."""

    def filter(self, command: Command, belief: Belief, reachable: ReachableSet) -> Filtered:
        """Return the command with its twist clipped into `reachable`; one that is not finite counts as a stop."""
        if command.base is None:
            return Filtered(command)
        twist = reachable.clip(command.base if command.base.finite else BodyTwist())
        return Filtered(replace(command, base=twist), intervened=twist != reachable.clip(command.base))

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""
