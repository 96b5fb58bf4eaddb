"""A number with its interval: what each way to one gives, and what is kept when it is scaled."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, norm, t

from stillhook.statistics.estimate import CONFIDENCE, NORMAL_95, Estimate, t_factor

sizes = st.floats(-1e6, 1e6)
widths = st.floats(0.0, 1e6)
COVERAGE = 0.02
"""Share of 2000 draws of 95 %: four standard deviations."""


def test_the_factors_are_the_quantiles_of_the_confidence():
    assert pytest.approx(norm.ppf(0.5 + 0.5 * CONFIDENCE), rel=1e-15) == NORMAL_95
    assert t_factor(3) == pytest.approx(t.ppf(0.975, 3), rel=1e-12)
    assert t_factor(1e9) == pytest.approx(NORMAL_95, rel=1e-6)


@given(sizes, widths)
def test_a_symmetric_interval_keeps_its_half_width_to_the_last_bit(value, half):
    estimate = Estimate.around(value, half)
    assert (estimate.half, estimate.low, estimate.high) == (half, value - half, value + half)
    assert estimate.contains(value)


def test_the_half_width_of_another_is_its_longer_side():
    assert Estimate(1.0, 0.5, 3.0).half == 2.0
    assert Estimate(1.0, 0.5, math.inf).half == math.inf


@given(sizes, widths, st.floats(-10.0, 10.0), sizes)
def test_ends_stay_in_order_and_about_the_value_when_scaled(value, half, factor, offset):
    scaled = Estimate.around(value, half).scaled(factor, offset)
    assert scaled.low <= scaled.value <= scaled.high


@pytest.mark.slow
@given(st.integers(1, 500), st.data())
def test_a_share_has_the_interval_of_wilson(n, data):
    hits = data.draw(st.integers(0, n))
    exact = binomtest(hits, n).proportion_ci(CONFIDENCE, method="wilson")
    share = Estimate.of_share(hits, n)
    assert (share.value, share.n) == (hits / n, n)
    assert (share.low, share.high) == pytest.approx((exact.low, exact.high), rel=1e-12, abs=1e-15)


def test_a_mean_of_few_is_held_by_students_interval():
    rng, n = np.random.default_rng(3), 5
    inside = [Estimate.of_mean(rng.standard_normal(n), t_factor(n - 1)).contains(0.0) for _ in range(2000)]
    assert np.mean(inside) == pytest.approx(CONFIDENCE, abs=COVERAGE)


@pytest.mark.parametrize("values", [[], [2.0]])
def test_a_mean_of_one_or_none_has_no_interval(values):
    estimate = Estimate.of_mean(np.array(values))
    assert estimate.n == len(values)
    assert math.isnan(estimate.low)
    assert not estimate.contains(2.0)


def test_draws_that_are_no_numbers_do_not_count():
    draws = np.append(np.linspace(0.0, 1.0, 2001), np.nan)
    estimate = Estimate.of_draws(0.5, draws)
    assert (estimate.low, estimate.high) == pytest.approx((0.025, 0.975))
    assert estimate.to_dict("share") == {"share": 0.5, "low": estimate.low, "high": estimate.high}
