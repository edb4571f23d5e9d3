"""A three-wheel omni base of the XLeRobot class."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from drivers.interface.devices import DeviceSetup
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.omni_ideal import IdealOmniChassis
from sim_drivers.omni_rollers import RollerOmniChassis
from sim_drivers.wheeled_base import Chassis, WheeledBase, WheeledBaseSettings

Fraction = Annotated[float, Field(ge=-0.2, le=0.2)]
SmallAngle = Annotated[float, Field(ge=-0.2, le=0.2)]


class OmniBaseSettings(WheeledBaseSettings):
    """Size and caps are those of the clearance paper's robot; what it does not give is marked as a stand-in's own.

    The errors of the true geometry are not zero: printed wheels and hand-mounted motors differ from the drawing by some
    tenths of a per cent and of a degree, and `trundle calibrate` must have something to find.
    """

    wheels: Literal["ideal", "rollers"] = Field(default="ideal", description="planar joints, or wheels with real contact")
    max_vx_m_s: float = Field(default=0.75, gt=0.0, le=5.0, description="cap forwards and backwards")
    max_vy_m_s: float = Field(default=0.5, gt=0.0, le=5.0, description="cap sideways")
    max_wz_rad_s: float = Field(default=1.2, gt=0.0, le=10.0, description="cap on turning")
    radius_m: float = Field(default=0.12, gt=0.02, le=1.0, description="of the round body")
    height_m: float = Field(default=0.30, gt=0.05, le=2.0, description="of the body")
    wheel_radius_m: float = Field(default=0.05, gt=0.02, le=0.3, description="nominal")
    wheel_distance_m: float = Field(default=0.10, gt=0.02, le=1.0, description="nominal, from the centre to each wheel")
    first_bearing_rad: float = Field(default=np.pi / 3, ge=-np.pi, le=np.pi, description="of the first wheel; the others follow")
    wheel_radius_error: tuple[Fraction, Fraction, Fraction] = Field(
        default=(0.003, -0.002, 0.001), description="how much larger each wheel really is, as a fraction"
    )
    wheel_heading_error_rad: tuple[SmallAngle, SmallAngle, SmallAngle] = Field(
        default=(0.003, -0.002, -0.002), description="how far each wheel really rolls off the tangent"
    )
    slip_m_per_sqrt_m: float = Field(
        default=0.001, ge=0.0, le=0.1, description="ideal wheels: standard deviation of a wheel's slip over one metre of travel"
    )
    wheel_torque_nm: float = Field(default=2.9, gt=0.0, le=100.0, description="rollers: what a motor gives at most")

    @property
    def nominal(self) -> OmniThreeWheel:
        """The geometry on the drawing."""
        return OmniThreeWheel.symmetric(self.wheel_radius_m, self.wheel_distance_m, self.first_bearing_rad)

    @property
    def true(self) -> OmniThreeWheel:
        """The geometry as built."""
        nominal = self.nominal
        a, b, c = ((1.0 + error) * self.wheel_radius_m for error in self.wheel_radius_error)
        return OmniThreeWheel((a, b, c), nominal.wheel_distance_m, nominal.wheel_bearing_rad, self.wheel_heading_error_rad)


class SimOmniBase(WheeledBase):
    """A simulated three-wheel omni base, on ideal wheels or on rollers."""

    Settings: ClassVar[type[Settings]] = OmniBaseSettings
    role: ClassVar[str] = "base"

    def __init__(self, settings: OmniBaseSettings, setup: DeviceSetup) -> None:
        """Join the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        super().__init__(settings, setup, _chassis(settings, setup), settings.nominal)


def _chassis(settings: OmniBaseSettings, setup: DeviceSetup) -> Chassis:
    size_m = (settings.radius_m, settings.height_m)
    if settings.wheels == "rollers":
        return RollerOmniChassis(settings.true, settings.mass_kg, size_m, settings.wheel_torque_nm)
    rng = stream(setup.seed, f"{setup.name}.slip")
    return IdealOmniChassis(settings.true, settings.mass_kg, size_m, settings.slip_m_per_sqrt_m, rng)
