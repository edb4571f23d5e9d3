"""FilterPy's extended Kalman filter as functions: handed a state it gives back the next, so that nothing hides in it."""

from __future__ import annotations

from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from estimators.belief import F64
from estimators.ekf_model import STATES
from estimators.ekf_state import EkfState


class Algebra(ExtendedKalmanFilter):  # type: ignore[misc]  # FilterPy is untyped
    """FilterPy's filter with the motion model in the place of its linear prediction."""

    def __init__(self, gate: float, skip_ratio: float) -> None:
        """`gate` bounds the normalised innovation squared; beyond `skip_ratio` times it a measurement is not believed at all."""
        super().__init__(STATES, 3)
        self._gate, self._skip_ratio = gate, skip_ratio
        self._predicted = np.zeros(STATES)

    def predict_x(self, u: Any = 0) -> None:
        """Take over the state that the motion model gave."""
        self.x = self._predicted

    def propagate(self, state: EkfState, predicted: F64, jacobian: F64, noise: F64) -> tuple[F64, F64]:
        """Return mean and covariance after a prediction."""
        self.x, self.P, self.F, self.Q, self._predicted = state.x, state.covariance, jacobian, noise, predicted
        self.predict()
        return self.x, self.P

    def correct(self, state: EkfState, innovation: F64, rows: F64, noise: F64) -> tuple[F64, F64]:
        """Return mean and covariance after a measurement whose Jacobian is `rows`, shape (m, 11)."""
        self.x, self.P = state.x, state.covariance
        self.update(innovation, lambda _: rows, lambda _: 0.0, R=noise)
        return self.x, 0.5 * (self.P + self.P.T)

    def weight(self, state: EkfState, innovation: F64, rows: F64, noise: F64) -> float:
        """Return how far a measurement is believed: 1 within the gate, less beyond it, 0 far beyond it."""
        scatter = rows @ state.covariance @ rows.T + noise
        surprise = float(innovation @ np.linalg.inv(scatter) @ innovation)
        if surprise <= self._gate:
            return 1.0
        return self._gate / surprise if surprise <= self._gate * self._skip_ratio else 0.0
