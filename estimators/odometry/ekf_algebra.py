"""FilterPy's Kalman filters as functions: handed a state they give back the next, so that nothing hides in them."""

from __future__ import annotations

from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, KalmanFilter

from drivers.interface.kernel import kernel
from estimators.belief import F64
from estimators.odometry.ekf_model import STATES
from estimators.odometry.ekf_state import EkfState

_IDENTITY = np.eye(STATES)


class Prediction(ExtendedKalmanFilter):  # type: ignore[misc]  # FilterPy is untyped
    """FilterPy's filter with the motion model in the place of its linear prediction."""

    def __init__(self) -> None:
        """Predict a state of ours."""
        super().__init__(STATES, 3)
        self.predicted = np.zeros(STATES)

    def predict_x(self, u: Any = 0) -> None:
        """Take over the state that the motion model gave."""
        self.x = self.predicted


class Algebra:
    """Predicts and corrects.  Measurements are linear, so that FilterPy's linear filter corrects: its inverse can be chosen."""

    def __init__(self, gate: float, skip_ratio: float) -> None:
        """`gate` bounds the normalised innovation squared; beyond `skip_ratio` times it a measurement is not believed at all."""
        self._prediction = Prediction()
        self._correction = KalmanFilter(STATES, 3)
        self._correction.inv = inverse  # SciPy's takes longer to check a matrix of nine numbers than all the rest takes
        self._gate, self._skip_ratio = gate, skip_ratio

    def propagate(self, state: EkfState, predicted: F64, jacobian: F64, noise: F64) -> tuple[F64, F64]:
        """Return mean and covariance after a prediction."""
        ekf = self._prediction
        ekf.x, ekf.P, ekf.F, ekf.Q, ekf.predicted = state.x, state.covariance, jacobian, noise, predicted
        ekf.predict()
        return ekf.x, ekf.P

    def correct(self, state: EkfState, innovation: F64, measured: slice, noise: F64) -> tuple[F64, F64]:
        """Return mean and covariance after a measurement of a part of the state."""
        kf = self._correction
        kf.x, kf.P = state.x, state.covariance
        kf.update(state.x[measured] + innovation, R=noise, H=_IDENTITY[measured])
        return kf.x, symmetric(kf.P)

    def warm_up(self) -> None:
        """Compile what stands beside FilterPy."""
        symmetric(_IDENTITY)
        inverse(np.eye(3))

    def weight(self, state: EkfState, innovation: F64, measured: slice, noise: F64) -> float:
        """Return how far a measurement of a part of the state is believed: 1 within the gate, less beyond it, 0 far beyond it."""
        surprise = squared_surprise(innovation, state.covariance, measured.start, noise)
        if surprise <= self._gate:
            return 1.0
        return self._gate / surprise if surprise <= self._gate * self._skip_ratio else 0.0


@kernel()
def squared_surprise(innovation: F64, covariance: F64, first: int, noise: F64) -> float:
    """Return the normalised innovation squared of three states from the `first` on, measured with a noise of shape (3, 3)."""
    scatter = covariance[first : first + 3, first : first + 3] + noise
    return float(innovation @ np.linalg.solve(scatter, innovation))


@kernel()
def symmetric(matrix: F64) -> F64:
    """Return the symmetric part of a square matrix."""
    return 0.5 * (matrix + matrix.T)


@kernel()
def inverse(matrix: F64) -> F64:
    """Return the inverse of a square matrix."""
    inverted = np.empty_like(matrix)
    inverted[:] = np.linalg.inv(matrix)
    return inverted
