"""Settings of the idle planner: none."""

from drivers.interface.settings import Settings


class IdleSettings(Settings):
    """It has nothing to set."""
