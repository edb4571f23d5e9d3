"""Where the arm's controller is, and how the arm is to feel and to be watched."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from drivers.interface.settings import Settings

Torque = Annotated[float, Field(gt=0.0, le=100.0)]
Force = Annotated[float, Field(gt=0.0, le=200.0)]
Stiffness = Annotated[float, Field(ge=0.0, le=14_250.0)]
PerJoint = tuple[Torque, Torque, Torque, Torque, Torque, Torque, Torque]


class FrankaSettings(Settings):
    """Everything about the arm."""

    host: str = Field(default="172.16.0.2", min_length=1, description="address of the arm's controller")
    decimation: int = Field(default=10, ge=1, le=100, description="every so many milliseconds a joint state goes to the loop")
    latency_s: float = Field(default=0.0005, ge=0.0, le=0.1, description="from measuring to the state's arrival")
    controller: Literal["joint_impedance", "cartesian_impedance"] = Field(
        default="joint_impedance", description="of the controller's own, that follows the set points"
    )
    joint_stiffness_nm_rad: tuple[Stiffness, Stiffness, Stiffness, Stiffness, Stiffness, Stiffness, Stiffness] = Field(
        default=(3000.0, 3000.0, 3000.0, 2500.0, 2500.0, 2000.0, 2000.0), description="of the joint impedance controller"
    )
    contact_torque_nm: PerJoint = Field(default=(20.0,) * 7, description="external torque that counts as a contact")
    collision_torque_nm: PerJoint = Field(default=(20.0,) * 7, description="external torque that stops the arm by a reflex")
    contact_force_n: tuple[Force, Force, Force, Force, Force, Force] = Field(
        default=(20.0, 20.0, 20.0, 25.0, 25.0, 25.0), description="external force x, y, z [N] and moment [N m] that is a contact"
    )
    collision_force_n: tuple[Force, Force, Force, Force, Force, Force] = Field(
        default=(20.0, 20.0, 20.0, 25.0, 25.0, 25.0), description="the same for a reflex"
    )
    auto_recover: bool = Field(
        default=False, description="clear a reflex without being asked; otherwise the operator's reset does"
    )
    real_time_kernel: bool = Field(default=False, description="refuse to drive without one")
    priority: int | None = Field(default=80, ge=1, le=98, description="SCHED_FIFO, where permitted, of the 1 kHz exchange")
    open_timeout_s: float = Field(default=10.0, gt=0.1, le=60.0, description="how long connecting may take")
