"""How long to wait before the next try."""

from __future__ import annotations

from pydantic import Field

from drivers.interface.settings import Settings


class BackoffSettings(Settings):
    """Doubling pauses between tries, and when a fault is no longer a matter of waiting."""

    first_s: float = Field(default=0.1, gt=0.0, le=10.0, description="pause before the first new try")
    longest_s: float = Field(default=2.0, gt=0.0, le=60.0, description="no pause is longer; each is twice the one before")
    tries: int = Field(default=0, ge=0, le=10_000, description="tries before it gives up and is faulted; 0: never")


class Backoff:
    """The pauses of one series of failures."""

    def __init__(self, settings: BackoffSettings) -> None:
        """Start with the shortest pause."""
        self._settings = settings
        self._failures = 0

    def succeeded(self) -> None:
        """Begin anew at the next failure."""
        self._failures = 0

    def failed(self) -> float | None:
        """Count a failure; return the pause until the next try [s], or None to give up."""
        self._failures += 1
        s = self._settings
        if s.tries and self._failures > s.tries:
            return None
        return float(min(s.first_s * 2.0 ** min(self._failures - 1, 30), s.longest_s))
