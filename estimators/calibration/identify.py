"""Least squares that says how well each parameter is determined, and refuses when one is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from drivers.interface.errors import ConfigurationError
from estimators.belief import F64

OUTLIER = 3.0  # standard deviations from which on a residual counts less (slip)
ROBUST = 1.4826  # standard deviation over median absolute deviation, of a normal distribution


@dataclass(frozen=True, slots=True)
class Unknown:
    """A parameter that is looked for."""

    name: str
    unit: str
    nominal: float
    scale: float  # how far off it may well be
    largest_std: float  # worse determined than this it is not used


@dataclass(frozen=True, slots=True)
class Identified:
    """What was found."""

    unknown: Unknown
    value: float
    std: float


def identify(unknowns: tuple[Unknown, ...], residuals: Callable[[F64], F64]) -> tuple[Identified, ...]:
    """Find the parameters that make the residuals least; `residuals` takes shape (p,) and gives shape (m,) in their noise's std.

    Standard deviations come from the Jacobian at the solution (Nocedal, Wright, Numerical Optimization, 2nd ed., section
    10.1); the noise is that of most residuals (Huber, Robust Statistics: median absolute deviation) and no less
    than 1, so that data without noise promise nothing that they cannot keep.

    Raises:
        ConfigurationError: the data do not determine a parameter; the sentence names it.
    """
    nominal = np.array([unknown.nominal for unknown in unknowns])
    scale = np.array([unknown.scale for unknown in unknowns])

    def scaled(shares: F64) -> F64:
        return residuals(nominal + scale * shares)

    found = least_squares(scaled, np.zeros(len(unknowns)), loss="soft_l1", f_scale=OUTLIER)
    noise = max(1.0, ROBUST * float(np.median(np.abs(found.fun))))
    _, singular, directions = np.linalg.svd(np.asarray(found.jac), full_matrices=False)  # (p,), (p, p)
    inverse = 1.0 / np.maximum(singular, 1e-12 * max(1.0, singular.max()))
    std = scale * noise * np.sqrt(np.sum((directions * inverse[:, None]) ** 2, axis=0))  # (p,)
    _refuse(unknowns, std, len(found.fun))
    values = nominal + scale * found.x
    return tuple(Identified(u, float(value), float(s)) for u, value, s in zip(unknowns, values, std, strict=True))


def _refuse(unknowns: tuple[Unknown, ...], std: F64, residuals: int) -> None:
    """Raise for the parameter that is worst determined, if it is too badly."""
    excess = std / np.array([unknown.largest_std for unknown in unknowns])
    if residuals < len(unknowns) or not excess.max() <= 1.0:
        worst = unknowns[int(np.nanargmax(excess))]
        raise ConfigurationError(
            f"calibration: the data do not determine '{worst.name}' (standard deviation {std[int(np.nanargmax(excess))]:.2g} "
            f"{worst.unit}, allowed {worst.largest_std:.2g}); drive further, and in every way that the base can move"
        )
