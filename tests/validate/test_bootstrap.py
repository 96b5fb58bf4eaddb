"""Intervals of numbers from series that remember: they hold what they promise, respect borders, and repeat to the bit."""

import numpy as np
import pytest

from stillhook.statistics.blocks import blocks, interval

MEMORY = 0.95  # of an autoregressive series: an autocorrelation time of some 20 samples
WINDOW = 60  # samples of a moving mean
TRIALS, DRAWS = 100, 200
PROMISED = 0.95
LUCK = 0.065  # three standard errors of a share of 0.95 in 100 trials
LOOSE = 0.03  # by which the interval may fall short: percentiles of few blocks are known to, by up to 3 % here (measured: 0.93 to 0.95)


def autoregressive(rng: np.random.Generator, n: int) -> np.ndarray:
    from scipy.signal import lfilter

    return 3.0 + lfilter([1.0], [1.0, -MEMORY], rng.standard_normal(n + 400))[400:]


def windowed(rng: np.random.Generator, n: int) -> np.ndarray:
    """Moving means of magnitudes, as overlapping windows of deviations are."""
    return np.convolve(np.abs(rng.standard_normal(n + WINDOW - 1)), np.full(WINDOW, 1.0 / WINDOW), "valid")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("make", "truth"),
    [(autoregressive, 3.0), (windowed, np.sqrt(2.0 / np.pi))],
    ids=["autoregressive", "moving window"],
)
@pytest.mark.parametrize("sizes", [(1500, 340, 340), (1000,)], ids=["three parts", "one part"])
def test_ninety_five_percent_intervals_hold_the_mean_about_as_often(make, truth, sizes):
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(TRIALS):
        found = interval(np.mean, [make(rng, n) for n in sizes], at_least=2 * WINDOW, draws=DRAWS)
        hits += found.low <= truth <= found.high
    assert PROMISED - LOOSE - LUCK < hits / TRIALS <= 1.0


def test_an_interval_that_took_samples_as_independent_would_be_several_times_too_narrow():
    x = autoregressive(np.random.default_rng(2), 3000)
    found = interval(np.mean, [x])
    naive = 2.0 * 1.96 * x.std() / np.sqrt(len(x))
    assert (found.high - found.low) > 4.0 * naive  # sqrt((1 + 0.95)/(1 - 0.95)) = 6.2 in the limit


def test_effective_samples_of_an_autoregressive_series_are_those_of_theory():
    x = autoregressive(np.random.default_rng(3), 40_000)
    theory = len(x) * (1.0 - MEMORY) / (1.0 + MEMORY)
    assert blocks([x]).effective == pytest.approx(theory, rel=0.2)  # the estimate's own spread at this length


def test_white_noise_needs_no_blocks():
    x = np.random.default_rng(4).standard_normal(5000)
    found = blocks([x])
    assert found.length <= 3
    assert found.effective == pytest.approx(len(x), rel=0.1)


def test_blocks_are_at_least_as_long_as_asked_but_leave_three_of_them():
    x = np.random.default_rng(5).standard_normal(1000)
    assert blocks([x], at_least=120).length == 120
    assert blocks([x[:200]], at_least=120).length == 66


def test_no_block_crosses_from_one_part_into_another():
    """Within each part neighbours differ by one, around its ring; across parts by a thousand: a draw holds few jumps, all between blocks."""
    parts = [np.arange(300.0), 10_000.0 + np.arange(200.0)]
    seen: list[float] = []

    def jumps(x: np.ndarray) -> float:
        step = np.abs(np.diff(x))
        seen.append(float(np.sum((step != 1.0) & (step != 299.0) & (step != 199.0))))
        return float(x.mean())

    interval(jumps, parts, at_least=50, draws=50)
    length = blocks(parts, at_least=50).length
    assert max(seen[1:]) <= 500 / min(length, 200) + 1  # one jump a block


@pytest.mark.slow
def test_the_same_data_give_the_same_interval_to_the_bit():
    x = autoregressive(np.random.default_rng(6), 900)
    assert interval(np.mean, [x[:400], x[400:]]) == interval(np.mean, [x[:400], x[400:]])


def test_rows_of_a_regression_stay_together():
    rng = np.random.default_rng(7)
    a = autoregressive(rng, 2000)
    rows = np.column_stack([a, 2.5 * a + 0.01 * rng.standard_normal(2000)])
    found = interval(lambda r: float(r[:, 0] @ r[:, 1] / (r[:, 0] @ r[:, 0])), [rows[:900], rows[900:]])
    assert found.low < 2.5 < found.high
    assert found.high - found.low < 1e-3


def test_bounds_hold_a_share_between_none_and_all():
    x = (autoregressive(np.random.default_rng(8), 600) > 0.0).astype(float)
    found = interval(np.mean, [x], at_least=100, bounds=(0.0, 1.0))
    assert 0.0 <= found.low <= found.value <= found.high <= 1.0


def test_a_series_that_does_not_move_has_an_interval_of_no_width():
    found = interval(np.mean, [np.full(100, 2.0)], at_least=20)
    assert (found.low, found.value, found.high) == (2.0, 2.0, 2.0)


@pytest.mark.parametrize("x", [np.array([1.0]), np.zeros(0)])
def test_too_few_samples_have_no_interval(x):
    found = interval(np.mean, [x, np.zeros(0)])
    assert np.isnan(found.low)
    assert np.isnan(found.high)


def test_samples_of_short_parts_are_drawn_as_often_as_those_of_long_ones():
    """Three parts shorter than a block of another level than the long one: the mean of the draws is that of the data."""
    parts = [np.zeros(900), np.ones(30), np.ones(60), np.ones(45)]
    drawn: list[float] = []

    def mean(x: np.ndarray) -> float:
        drawn.append(float(x.mean()))
        return drawn[-1]

    found = interval(mean, parts, at_least=100)
    # A share of sums over eight blocks of unequal length is off by a fifth of its spread; short parts drawn by their length alone were
    # off by one spread.
    assert np.mean(drawn[1:]) == pytest.approx(135 / 1035, abs=0.25 * np.std(drawn[1:]))
    assert found.low < found.value < found.high


def test_parts_shorter_than_a_block_take_part_as_they_are():
    rng = np.random.default_rng(9)
    parts = [autoregressive(rng, n) for n in (30, 45, 900)]
    found = interval(np.mean, parts, at_least=120, draws=DRAWS)
    assert found.low < found.value < found.high
