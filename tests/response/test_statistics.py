"""Tension statistics: against a long Gaussian record made here, and against limits."""

import numpy as np
import pytest

from stillhook.statistics.extremes import (
    chance_below_zero,
    most_probable_maximum,
    rate_below_zero,
    share_below_zero,
    zero_crossing_period,
)

pytestmark = pytest.mark.slow

DT = 0.1  # s
SCATTER = 0.03  # of counts in one million seconds of waves of some 8 s


@pytest.fixture(scope="module")
def tension():
    """A Gaussian record of mean 100 and deviation 60 about 8 s, with its rate."""
    n = 10_000_000
    omega = 2.0 * np.pi / (n * DT) * np.arange(n // 20)  # up to 3 rad/s: nothing is above
    rng = np.random.default_rng(1)
    size = np.exp(-(((omega - 0.8) / 0.15) ** 2))
    c = size * (rng.standard_normal(len(omega)) + 1j * rng.standard_normal(len(omega)))
    x, rate = np.fft.irfft(c, n), np.fft.irfft(1j * omega * c, n)
    scale = 60.0 / x.std()
    return 100.0 + scale * x, float(scale * rate.std())


@pytest.mark.thorough
def test_share_and_rate_below_zero_are_those_counted_in_a_long_record(tension):
    F, rate = tension
    T_z = zero_crossing_period(60.0, rate)
    assert share_below_zero(100.0, 60.0) == pytest.approx(np.mean(F < 0.0), rel=SCATTER)
    falls = np.count_nonzero((F[:-1] >= 0.0) & (F[1:] < 0.0)) / (DT * len(F))
    assert rate_below_zero(100.0, 60.0, T_z) == pytest.approx(falls, rel=SCATTER)


@pytest.mark.long
def test_period_is_the_mean_time_between_upward_crossings(tension):
    F, rate = tension
    ups = np.count_nonzero((F[:-1] < 100.0) & (F[1:] >= 100.0))
    assert zero_crossing_period(60.0, rate) == pytest.approx(DT * len(F) / ups, rel=0.01)


def test_most_probable_maximum_is_near_the_middle_of_the_maxima_of_many_hours(tension):
    F, rate = tension
    hours = F[: len(F) // 36_000 * 36_000].reshape(-1, 36_000).max(axis=1)
    top = 100.0 + most_probable_maximum(60.0, zero_crossing_period(60.0, rate), 3600.0)
    counted = np.quantile(hours, np.exp(-1.0))
    assert 0.95 * top < counted <= top  # maxima taken as independent are on the safe side in a narrow band


def test_what_stands_still_is_never_slack_and_has_no_maximum():
    assert share_below_zero(100.0, 0.0) == 0.0
    assert rate_below_zero(100.0, 0.0, np.nan) == 0.0
    assert most_probable_maximum(0.0, np.nan, 3600.0) == 0.0


def test_a_missing_sea_stays_missing():
    for found in (
        share_below_zero(1.0, np.nan),
        rate_below_zero(1.0, np.nan, np.nan),
        most_probable_maximum(np.nan, np.nan, 3600.0),
    ):
        assert np.isnan(found)


def test_chance_grows_from_rate_times_time_to_certainty():
    assert chance_below_zero(1e-6, 100.0) == pytest.approx(1e-4, rel=1e-3)
    assert chance_below_zero(1.0, 1e4) == 1.0
