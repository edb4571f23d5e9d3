"""Servos and masses in a `mujoco.MjSpec`, as the simulated robots need them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco


def add_velocity_servo(spec: Any, joint: str, gain: float, limit: float) -> None:
    """Add an actuator that drives a joint at the speed set as its control, with force `gain` times the error up to `limit`."""
    servo = _add_servo(spec, joint, limit)
    servo.gainprm[0] = gain
    servo.biasprm[2] = -gain


def add_position_servo(spec: Any, joint: str, stiffness: float, damping: float, limit: float) -> None:
    """Add an actuator that pulls a joint to the position set as its control like a damped spring, with force up to `limit`."""
    servo = _add_servo(spec, joint, limit)
    servo.gainprm[0] = stiffness
    servo.biasprm[1:3] = -stiffness, -damping


def set_inertia(body: Any, mass_kg: float, centre_m: Sequence[float], inertia_kg_m2: Sequence[float]) -> None:
    """Give a body its mass, centre of mass and principal moments, whatever geoms it has."""
    body.explicitinertial = True
    # Without an explicit centre MuJoCo 4.0 takes the body's own position in its parent for it.
    body.mass, body.ipos, body.inertia = mass_kg, list(centre_m), list(inertia_kg_m2)


def _add_servo(spec: Any, joint: str, limit: float) -> Any:
    servo = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.forcelimited = True
    servo.forcerange = [-limit, limit]
    return servo
