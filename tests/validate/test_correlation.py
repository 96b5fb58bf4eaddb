"""Correlation of the control error over few load cases: its interval holds the truth, and does not explode."""

import math

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from stillhook.statistics.estimate import half_of_mean, mean_of_few
from stillhook.validate.ahc.measures import SCATTER, CaseCorrelation, case_correlation, mean_correlation

STEP = 0.1  # s
BLOCK = 300
WAVES = butter(2, [0.08, 0.13], "bandpass", fs=1.0 / STEP, output="sos")
LEVEL = np.sqrt(np.sum(sosfilt(WAVES, np.eye(1, 4000)[0]) ** 2))


def load_case(rng, z: float, seconds: float, slow: float = 0.3):
    """Measured and simulated error whose correlation is tanh(z): waves of 8 to 12 s; the difference is noise with a memory of 2 s, and
    slow is the part of its power that is drift (a random walk about its straight line)."""
    n = round(seconds / STEP)
    x = sosfilt(WAVES, rng.standard_normal(n + 1000))[1000:]
    x /= LEVEL
    k = math.exp(-STEP / 2.0)
    noise = lfilter([math.sqrt(1.0 - k * k)], [1.0, -k], rng.standard_normal(n + 500))[500:]
    t, walk = np.arange(n), np.cumsum(rng.standard_normal(n))
    walk = (walk - np.polyval(np.polyfit(t, walk, 1), t)) / math.sqrt(n / 15.0)
    off = math.sqrt(1.0 - slow) * noise + math.sqrt(slow) * walk
    return np.column_stack([x, x + math.sqrt(1.0 / math.tanh(z) ** 2 - 1.0) * off])


def of(r: float, deviation: float) -> CaseCorrelation:
    return CaseCorrelation(r, deviation, 50.0)


def test_three_unequal_cases_of_a_healthy_crane_show_what_they_have():
    """0.912 to 0.977: the interval of version 0.10 was -0.258 to 0.999, wider than any of its cases."""
    cases = {"1": of(0.912, 0.15), "2": of(0.955, 0.04), "3": of(0.977, 0.12)}
    found = mean_correlation(cases)
    before = half_of_mean([c.z for c in cases.values()], [1.96 * c.deviation for c in cases.values()], [200, 1500, 300])
    assert math.tanh(cases["2"].z - before) < 0.7
    assert 0.8 < found.low < 0.912
    assert 0.977 < found.high < 0.995
    assert 0.94 < found.value < 0.96


def test_cases_that_differ_widely_keep_a_wide_interval_and_a_wrong_crane_is_refuted():
    apart = mean_correlation({"1": of(0.2, 0.05), "2": of(0.95, 0.05), "3": of(0.9, 0.05)})
    assert apart.low < 0.6
    wrong = mean_correlation({"1": of(0.18, 0.06), "2": of(0.38, 0.04), "3": of(0.44, 0.1)})
    assert wrong.high < 0.8


def test_one_case_alone_has_its_own_interval():
    one = of(0.95, 0.1)
    assert mean_correlation({"1": one}) == one.estimate
    assert one.estimate.low == pytest.approx(math.tanh(one.z - 0.196), rel=1e-3)


def test_an_error_that_does_not_move_has_no_correlation():
    rng = np.random.default_rng(0)
    still = np.column_stack([rng.standard_normal(500), np.zeros(500)])
    assert case_correlation([still], BLOCK) is None
    assert case_correlation([], BLOCK) is None


def test_many_cases_are_a_plain_mean_and_hardly_feel_the_prior():
    rng = np.random.default_rng(3)
    y = rng.normal(1.0, 0.4, 60)
    found = mean_of_few(y, np.full(60, 0.1), SCATTER)
    assert found.value == pytest.approx(y.mean(), abs=1e-3)
    assert found.half == pytest.approx(1.96 * y.std(ddof=1) / math.sqrt(60), rel=0.08)
    wide, narrow = (mean_of_few([1.0, 1.4, 1.9], [0.1] * 3, x).half for x in (1.0, 0.2))
    assert wide > narrow


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [200.0, 600.0])
def test_the_deviation_of_a_case_is_that_of_repeated_tests(seconds):
    """Errors of a narrow wave band are alike over some waves: 2,000 samples of 200 s are some 50 independent ones."""
    rng, z = np.random.default_rng(4), 1.8
    found = [case_correlation([load_case(rng, z, seconds, slow=0.0)], BLOCK) for _ in range(150)]
    spread = float(np.std([c.z for c in found]))
    stated = float(np.median([c.deviation for c in found]))
    assert 0.85 * spread < stated < 1.5 * spread
    assert 0.5 / math.sqrt(seconds / STEP) < 0.5 * spread


@pytest.mark.slow
def test_with_three_unequal_cases_noise_and_drift_95_of_100_intervals_hold_the_truth():
    rng, held, campaigns, mean = np.random.default_rng(11), 0, 150, math.atanh(0.95)
    for _ in range(campaigns):
        z = mean + 0.36 * rng.standard_normal(3)
        rows = zip(z, (200.0, 900.0, 300.0), strict=True)
        found = mean_correlation(
            {str(i): case_correlation([load_case(rng, *row)], BLOCK) for i, row in enumerate(rows)}
        )
        held += found.low <= 0.95 <= found.high
    assert held >= 0.91 * campaigns  # 95 % of 150 come to fewer in 2 of 100 trials
