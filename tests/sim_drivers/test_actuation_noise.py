"""Actuation noise: as large as asked, gone when nothing is driven, forgotten as fast as asked, the same for the same seed."""

import math

import numpy as np

from drivers.interface.seeds import stream
from sim_drivers.actuation_noise import ActuationNoise, ActuationNoiseSettings

PERIOD_S = 0.0025


def errors(fraction: float, time_s: float, seed: int = 1, samples: int = 200_000) -> np.ndarray:
    """Relative errors of vx, vy and wz, shape (samples, 3)."""
    noise = ActuationNoise(ActuationNoiseSettings(fraction=fraction, time_s=time_s), stream(seed, "noise"), PERIOD_S)
    twist = np.array((0.5, -0.2, 2.0))
    return np.array([noise.spoil(twist) for _ in range(samples)]) / twist - 1.0


def test_it_has_the_deviation_and_the_memory_that_were_asked_for() -> None:
    error = errors(0.05, 0.2)
    np.testing.assert_allclose(error.std(axis=0), 0.05, rtol=0.1)
    np.testing.assert_allclose(error.mean(axis=0), 0.0, atol=0.005)
    apart = round(0.2 / PERIOD_S)  # one time constant
    kept = [np.corrcoef(error[:-apart, axis], error[apart:, axis])[0, 1] for axis in range(3)]
    np.testing.assert_allclose(kept, math.exp(-1.0), atol=0.08)
    assert np.abs(np.corrcoef(error.T) - np.eye(3)).max() < 0.15


def test_it_is_there_from_the_start_and_follows_the_seed() -> None:
    firsts = np.array([errors(0.05, 10.0, seed, samples=1)[0] for seed in range(200)])
    np.testing.assert_allclose(firsts.std(), 0.05, rtol=0.15)
    np.testing.assert_array_equal(errors(0.05, 0.2, 3, 600), errors(0.05, 0.2, 3, 600))


def test_who_stands_stands_and_without_noise_nothing_changes() -> None:
    noise = ActuationNoise(ActuationNoiseSettings(fraction=0.3), stream(0, "noise"), PERIOD_S)
    assert not noise.spoil(np.zeros(3)).any()
    still = ActuationNoise(ActuationNoiseSettings(), stream(0, "noise"), PERIOD_S)
    assert still.spoil(np.array((0.1, 0.0, 0.3))).tolist() == [0.1, 0.0, 0.3]
