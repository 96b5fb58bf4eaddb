"""Scatter between load cases: intervals of pooled numbers hold the mean of all cases of the kind, not only of those that were logged."""

import numpy as np
import pytest

from stillhook.statistics.blocks import interval, one_number, pooled
from stillhook.statistics.estimate import NORMAL_95, Estimate, between, extremes, half_of_mean, random_effects
from stillhook.validate.ahc.measures import over_cases

LENGTHS = np.array([200.0, 1500.0, 200.0, 300.0])  # s: load cases of paper F table 3
DRAWS = 400
HELD = (0.90, 0.98)  # share of 95 % intervals that hold the truth, by issue; +-2.2 % is one draw's own doubt twice over


def drawn(rng, scatter: float):
    """Values of load cases about a true mean of 0, with sampling deviations that fall with the length."""
    s = 1.0 / np.sqrt(LENGTHS / LENGTHS.mean())
    return scatter * rng.standard_normal(len(s)) + s * rng.standard_normal(len(s)), s


@pytest.mark.thorough
@pytest.mark.parametrize("scatter", [0.5, 1.0, 3.0])
def test_intervals_over_load_cases_hold_the_truth_as_often_as_they_say(scatter):
    rng, held = np.random.default_rng(11), np.zeros(3)
    for _ in range(DRAWS):
        y, s = drawn(rng, scatter)
        mean, half = random_effects(y, NORMAL_95 * s)
        by_length = float(LENGTHS @ y / LENGTHS.sum())
        fixed = float(s**-2.0 @ y / np.sum(s**-2.0))
        held += [
            abs(mean) <= half,
            abs(by_length) <= half_of_mean(y, NORMAL_95 * s, LENGTHS),
            abs(fixed) <= NORMAL_95 / np.sqrt(np.sum(s**-2.0)),
        ]
    share = held / DRAWS
    assert HELD[0] <= share[0] <= HELD[1]
    assert HELD[0] <= share[1] <= HELD[1]
    if scatter >= 1.0:
        assert share[2] < 0.85  # sampling errors alone, as before, leave the truth out this often


def test_cases_that_agree_within_their_errors_have_no_scatter_and_no_narrower_interval_than_their_errors_give():
    assert between([1.0, 1.01, 0.99], [0.1, 0.1, 0.1]) == 0.0
    mean, half = random_effects([1.0, 1.0, 1.0], [0.1, 0.1, 0.1])
    assert mean == pytest.approx(1.0)
    assert half == pytest.approx(0.1 / np.sqrt(3.0))


def test_scatter_of_cases_with_negligible_errors_is_their_standard_deviation():
    y = np.array([0.3, -1.2, 0.8, 2.0])
    assert between(y, np.full(4, 1e-6)) == pytest.approx(y.std(ddof=1), rel=1e-6)
    _, half = random_effects(y, np.full(4, 1e-6))
    assert half == pytest.approx(
        3.1824463 * y.std(ddof=1) / 2.0, rel=1e-5
    )  # Student's t, 3 degrees of freedom: the textbook interval


def test_one_case_stays_as_it_is():
    assert pooled([Estimate.around(0.4, 0.1, 7)]) == Estimate.around(0.4, 0.1, 7)
    assert half_of_mean([0.4], [0.1], [3.0]) == pytest.approx(0.1)


def test_a_case_without_an_interval_of_its_own_adds_its_distance_to_the_scatter():
    known = half_of_mean([1.0, 1.1, 0.9], [0.3, 0.3, 0.3], [1.0, 1.0, 1.0])
    assert half_of_mean([1.0, 1.1, 3.0], [0.3, 0.3, np.nan], [1.0, 1.0, 1.0]) > 3.0 * known


def test_the_structural_error_of_an_estimate_stays_in_the_pooled_one():
    total = pooled([Estimate.around(0.1, 0.05, 5, 0.04), Estimate.around(0.1, 0.02, 5)])
    assert (total.structural, total.half) == (0.04, pytest.approx(0.04))


def test_readings_of_one_number_keep_their_weights_and_grow_where_they_contradict_each_other():
    agree, apart = (one_number([Estimate.around(0.0, 0.1), Estimate.around(x, 0.1)]) for x in (0.02, 1.0))
    assert agree.half == pytest.approx(0.1 / np.sqrt(2.0))
    assert apart.half > 5.0 * agree.half


def test_the_smallest_and_the_largest_case_are_named():
    assert extremes({"1": 1.08, "2": 1.3, "3": 1.02}, lambda x: f"{x:g}") == "1.02 (3) to 1.3 (2)"
    assert extremes({"1": 1.08}, str) == ""


def windows(rng, level: float, n: int):
    return level + 0.1 * rng.standard_normal(n)


@pytest.mark.slow
def test_a_mean_over_windows_of_all_load_cases_knows_how_much_they_differ():
    rng = np.random.default_rng(3)
    levels = {"1": 1.0, "2": 2.0, "3": 3.0, "4": 2.5}
    parts = {name: [windows(rng, x, 1000 if name == "2" else 200)] for name, x in levels.items()}
    found = over_cases(np.mean, parts, at_least=10, bounds=(0.0, np.inf))
    alone = interval(np.mean, [p for own in parts.values() for p in own], at_least=10, bounds=(0.0, np.inf))
    assert found.pooled.value == alone.value
    assert found.pooled.high - found.pooled.value > 3.0 * (alone.high - alone.value)
    assert found.notes(".1f") == ["1.0 (1) to 3.0 (3) by load case"]


@pytest.mark.thorough
def test_over_windows_the_interval_holds_the_mean_of_all_cases_of_the_kind():
    """Cases of equal length whose true levels scatter: the blocks alone hold their common mean less often than they say."""
    rng, held, blocks_alone, campaigns = np.random.default_rng(5), 0, 0, 60
    for _ in range(campaigns):
        parts = {str(i): [windows(rng, 2.0 + 0.5 * rng.standard_normal(), 120)] for i in range(4)}
        found = over_cases(np.mean, parts, at_least=5)
        alone = interval(np.mean, [p for own in parts.values() for p in own], at_least=5)
        held += found.pooled.low <= 2.0 <= found.pooled.high
        blocks_alone += alone.low <= 2.0 <= alone.high
    assert held >= 0.88 * campaigns
    assert blocks_alone < 0.8 * campaigns


@pytest.mark.slow
def test_one_load_case_says_that_it_is_alone():
    found = over_cases(np.mean, {"1": [windows(np.random.default_rng(0), 1.0, 100)], "2": []}, at_least=5)
    assert list(found.cases) == ["1"]
    assert "one load case" in found.notes("")[0]
