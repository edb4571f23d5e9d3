"""CVaR against closed forms, its bounds against what sampling really does."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from drivers.interface.seeds import stream
from planners.risk import cvar, cvar_error, fractional_cvar, gather_smallest, objective_error, tail_count

LOSSES = st.lists(st.floats(0.0, 10.0), min_size=1, max_size=60).map(np.array)
FRACTIONS = st.floats(0.01, 1.0)
FORMS = [cvar, fractional_cvar]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.5, 1.0])
def test_of_a_gaussian(form, alpha):
    samples = 2.0 + 3.0 * stream(1, "gaussian").standard_normal(400_000)
    expected = 2.0 + 3.0 * norm.pdf(norm.ppf(1.0 - alpha)) / alpha
    assert form(samples, alpha) == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("alpha", [0.05, 0.2, 1.0])
def test_of_a_uniform(form, alpha):
    quantiles = (np.arange(10_000) + 0.5) / 10_000
    assert form(quantiles, alpha) == pytest.approx(1.0 - alpha / 2.0, abs=1e-9)


def test_of_atoms():
    """A tenth of the mass at 10, three tenths at 2: a tail of a quarter is the first whole and half of the second."""
    losses = np.array([10.0] + 3 * [2.0] + 6 * [0.0])
    assert fractional_cvar(losses, 0.25) == pytest.approx((0.1 * 10.0 + 0.15 * 2.0) / 0.25)
    assert cvar(losses, 0.25) == pytest.approx((10.0 + 2.0 + 2.0) / 3.0)
    assert cvar(losses, 0.1) == fractional_cvar(losses, 0.1) == 10.0


@given(LOSSES, FRACTIONS)
def test_the_fractional_form_solves_the_optimisation_form(losses, alpha):
    def value(eta):
        return eta + np.maximum(losses - eta, 0.0).mean() / alpha

    best = min(value(eta) for eta in losses)  # piecewise linear and convex: a kink is optimal
    assert fractional_cvar(losses, alpha) == pytest.approx(best, abs=1e-9)
    assert minimize_scalar(value, bounds=(0.0, 10.0), method="bounded").fun >= best - 1e-9


@given(LOSSES, FRACTIONS)
def test_it_lies_between_mean_and_maximum_and_rounding_up_only_lowers_it(losses, alpha):
    whole, fractional = cvar(losses, alpha), fractional_cvar(losses, alpha)
    assert losses.mean() - 1e-9 <= whole <= fractional + 1e-9 <= losses.max() + 2e-9


@given(LOSSES)
def test_its_ends_are_the_mean_and_the_worst(losses):
    assert cvar(losses, 1.0) == pytest.approx(losses.mean())
    assert cvar(losses, 1e-6) == losses.max()


@pytest.mark.parametrize(("samples", "alpha"), [(0, 0.1), (5, 0.0), (5, 1.1), (5, -0.1), (5, math.nan)])
def test_nonsense_is_refused(samples, alpha):
    with pytest.raises(ValueError, match="at least one sample"):
        tail_count(samples, alpha)
    with pytest.raises(ValueError, match="at least one sample"):
        fractional_cvar(np.ones(samples), alpha)


def test_the_bounds_are_the_propositions():
    assert cvar_error(128, 0.1, 4.0, 165, 0.05) == pytest.approx(40.0 * math.sqrt(math.log(6600.0) / 256.0))
    assert objective_error(128, 0.1, 4.0, 2.0, 0.5, 165, 0.05) == pytest.approx(22.0 * math.sqrt(math.log(13200.0) / 256.0))


def test_the_bound_of_c2_holds_and_shrinks_with_the_root_of_the_samples():
    alpha, delta, commands = 0.2, 0.1, 10
    truth = 1.0 - alpha / 2.0
    for samples in (100, 1000):
        bound = cvar_error(samples, alpha, 1.0, commands, delta)
        draws = stream(2, "bound", samples).random((200, commands, samples))
        errors = np.array([max(abs(fractional_cvar(one, alpha) - truth) for one in trial) for trial in draws[:20]])
        assert (errors <= bound).mean() >= 1.0 - delta
        assert errors.max() > 0.0
    assert cvar_error(100, alpha, 1.0, commands, delta) / bound == pytest.approx(math.sqrt(10.0))


@given(st.lists(st.floats(-5.0, 5.0, width=32) | st.sampled_from([-0.5, 0.0, 0.5]), min_size=1, max_size=50), st.integers(1, 50))
def test_the_smallest_are_gathered(values, count):
    array, count = np.array(values, dtype=np.float32), min(count, len(values))
    found = np.empty(len(array) + 1, np.float32)
    gather_smallest(array, count, found)
    assert np.array_equal(np.sort(found[:count]), np.sort(array)[:count])
    assert array.tolist() == values
