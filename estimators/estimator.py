"""The contract of an estimator."""

from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

from drivers.interface.geometry import SE2
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.sensed import Sensed
from drivers.interface.settings import Settings
from drivers.interface.stateful import Stateful
from estimators.belief import Belief


@dataclass(frozen=True, slots=True)
class EstimatorSetup:
    """What the runtime hands to an estimator."""

    period_s: float
    robot_radius_m: float
    map_from_start: SE2
    kinematics: WheelKinematics | None  # None: a robot without a base
    imu_in_base_m: tuple[float, float] = (0.0, 0.0)  # where the inertial unit sits, forward and to the left


@runtime_checkable
class Estimator(Stateful, Protocol):
    """Turns what was sensed into a belief.  Built as `Estimator(settings, setup)`."""

    Settings: ClassVar[type[Settings]]

    def warm_up(self) -> None:
        """Compile every kernel; called once before the first tick."""
        ...

    def update(self, sensed: Sensed) -> Belief:
        """Fold in all samples and return the belief at `sensed.tick.start_ns`; bad input is a fault in it, never an exception."""
        ...
