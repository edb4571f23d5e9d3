"""The contract of a scenario: seeded and parametrised, it draws a scene."""

from typing import ClassVar, Protocol, runtime_checkable

from drivers.interface.settings import Settings
from sim_drivers.scene import Scene


@runtime_checkable
class Scenario(Protocol):
    """Draws a scene.  Built as `Scenario(settings)`; the class docstring's first line is what `trundle list` shows."""

    Settings: ClassVar[type[Settings]]

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed; the same seed gives the same scene."""
        ...
