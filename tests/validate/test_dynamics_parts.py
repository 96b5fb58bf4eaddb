"""The pieces of step 4 on signals whose answer is known: turns, swings, and the fit with its intervals."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from stillhook.validate.data_set.record import Transient, quick_changes
from stillhook.validate.dynamics.estimates import swing_of
from stillhook.validate.dynamics.form import normalised_rms
from stillhook.validate.dynamics.output_error import Model, fit
from stillhook.validate.dynamics.runs import SIGNALS

STEP = 0.01
T, ZETA, HIGH = 0.48, 0.08, 60e5  # s, -, Pa
READ = 0.01
"""What peaks between samples and smoothing leave of a period."""


def commands(ramp: float) -> np.ndarray:
    """0, up to 0.4 within a ramp [s], back to 0."""
    t = np.arange(0.0, 20.0, STEP)
    return np.interp(t, [5.0, 5.0 + ramp, 12.0, 12.0 + ramp], [0.0, 0.4, 0.4, 0.0])


def test_quick_changes_are_found_where_they_are_and_slow_ones_are_not() -> None:
    (a, b), (c, d) = quick_changes(commands(0.3), STEP)
    assert abs(a * STEP - 5.0) < 0.1
    assert abs(b * STEP - 5.3) < 0.1
    assert abs(c * STEP - 12.0) < 0.1
    assert abs(d * STEP - 12.3) < 0.1
    assert quick_changes(commands(5.0), STEP) == []


def test_the_noise_of_a_command_is_no_turn() -> None:
    noise = 0.002 * np.random.default_rng(0).standard_normal(3000)  # four counts of a 12-bit card
    assert quick_changes(noise, STEP) == []


def swing(sign: float, noise: float = 0.0):  # type: ignore[no-untyped-def]
    """Pressures that ring out after a turn at 1 s, with the line of that side above the other."""
    t = np.arange(0.0, 6.0, STEP)
    w = 2.0 * math.pi / T / math.sqrt(1.0 - ZETA**2)
    after = np.maximum(t - 1.0, 0.0)
    ring = HIGH * (1.0 - np.exp(-ZETA * w * after) * np.cos(2.0 * math.pi / T * after))
    rng = np.random.default_rng(1)
    lines = [25e5 + ring + noise * rng.standard_normal(len(t)), 25e5 + noise * rng.standard_normal(len(t))]
    turn = Transient("x", 90, len(t), 100, 1.0, 0.3, 0.0, 0.4 * sign)
    return t, turn, lines if sign > 0.0 else lines[::-1]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_period_damping_and_gradient_of_a_swing_are_read_right_in_both_directions(sign: float) -> None:
    t, turn, (p_a, p_b) = swing(sign)
    found = swing_of(turn, t, p_a, p_b, slice(90, len(t)))
    assert found.line == ("A" if sign > 0.0 else "B")
    assert found.period == pytest.approx(T, rel=READ)
    assert found.zeta == pytest.approx(ZETA, rel=0.05)  # smoothing takes the more off a peak the narrower it is
    steepest = HIGH * 2.0 * math.pi / T
    assert 0.7 * steepest < found.gradient < steepest


def test_a_swing_is_read_through_the_noise_of_its_transmitters() -> None:
    t, turn, (p_a, p_b) = swing(1.0, noise=0.5e5)
    assert swing_of(turn, t, p_a, p_b, slice(90, len(t))).period == pytest.approx(T, rel=0.02)


def test_a_line_at_rest_shows_no_swing() -> None:
    t, turn, _ = swing(1.0)
    flat = np.full(len(t), 25e5)
    found = swing_of(turn, t, flat, flat, slice(90, len(t)))
    assert math.isnan(found.period)
    assert math.isnan(found.gradient)


TRUE = np.array([2.0, -1.0])
CLUSTERS, EACH = 12, 60


def problem(seed: int, varies: float = 0.0):  # type: ignore[no-untyped-def]
    """A line with errors that are alike within each cluster, and nearly so from sample to sample."""
    rng = np.random.default_rng(seed)
    n = CLUSTERS * EACH
    x = np.column_stack([np.ones(n), rng.standard_normal(n)])
    cluster = np.repeat(np.arange(CLUSTERS), EACH)
    own = np.repeat(rng.standard_normal(CLUSTERS), EACH)
    y = x @ TRUE + 0.5 * own * x[:, 1] + 0.2 * rng.standard_normal(n)
    y[7] = np.nan  # a sample that was not logged
    return Model(
        lambda theta: (x @ theta - y, x),
        np.zeros(n, dtype=np.int64),
        cluster,
        np.array([0.01]),
        np.zeros(2),
        np.full(2, np.inf),
        np.array([0.0, varies]),
        np.full(2, -10.0),
        np.full(2, 10.0),
    )


def test_the_fit_finds_its_parameters_and_says_that_it_has_converged() -> None:
    found = fit(problem(0), np.zeros(2))
    assert found.converged
    assert found.clusters == CLUSTERS
    assert np.all(np.abs(found.theta - TRUE) < 4.0 * np.sqrt(np.diag(found.covariance)))


@pytest.mark.thorough
@pytest.mark.parametrize("varies", [0.0, 0.5])
def test_intervals_cover_where_errors_are_alike_within_clusters_and_white_ones_would_not(varies: float) -> None:
    from scipy.stats import t as student

    wide = student.ppf(0.975, CLUSTERS - 1)
    found = [fit(problem(seed, varies), np.zeros(2)) for seed in range(120)]
    errors = np.array([abs(f.theta[1] - TRUE[1]) for f in found])
    covered = float(np.mean(errors < wide * np.array([math.sqrt(f.covariance[1, 1]) for f in found])))
    white_error = np.array(
        [math.sqrt(np.linalg.inv(f.H.sum(axis=0) + np.diag(f.prior))[1, 1]) for f in problem_white()]
    )
    white = float(np.mean(errors < 1.96 * white_error))
    assert covered > 0.9  # of 95 %, from 120 draws: three deviations of their number below
    assert white < 0.8


def problem_white():  # type: ignore[no-untyped-def]
    return [fit(problem(seed), np.zeros(2)) for seed in range(120)]


def test_a_run_that_loses_its_numbers_is_stepped_back_from() -> None:
    base = problem(3)

    def evaluate(theta):  # type: ignore[no-untyped-def]
        r, J = base.evaluate(theta)
        return (np.where(np.isfinite(r), 1e3, r), np.zeros_like(J)) if theta[0] > 4.0 else (r, J)

    found = fit(base._replace(evaluate=evaluate), np.array([3.9, -5.0]))
    assert abs(found.theta[0] - TRUE[0]) < 0.5


def misfit_of(measured: np.ndarray, simulated: np.ndarray) -> float:
    """Misfit of p_a, by way of a stretch that holds it alone."""
    counted = np.ones(len(measured), dtype=bool)
    stretch = SimpleNamespace(measured={"p_a": measured}, counted=counted, record=SimpleNamespace(step=STEP))
    outputs = np.zeros((len(measured), len(SIGNALS)))
    outputs[:, SIGNALS.index("p_a")] = simulated
    return normalised_rms([stretch], [outputs])["p_a"]  # type: ignore[list-item]


def test_the_noise_of_a_transmitter_on_a_weak_swing_is_not_what_a_twin_leaves_but_a_late_swing_is() -> None:
    t = np.arange(0.0, 60.0, STEP)
    weak = 25e5 + 2.5e5 * math.sqrt(2.0) * np.sin(2.0 * math.pi * t / T)  # an empty hook: 2.5 bar rms
    noise = 0.5e5 * np.random.default_rng(5).standard_normal(len(t))  # bar, a fifth of it
    of_noise = misfit_of(weak + noise, weak)
    assert of_noise < 0.2 / math.sqrt(3.0) * 1.05  # a mean of three samples
    late = misfit_of(weak, np.interp(t - 0.02, t, weak))
    of_a_sine = 2.0 * math.sin(math.pi * 0.02 / T)  # smoothing leaves it as it is
    assert late == pytest.approx(of_a_sine, rel=READ)


def test_unknown_samples_do_not_count_in_a_misfit() -> None:
    t = np.arange(0.0, 20.0, STEP)
    y = np.sin(2.0 * math.pi * t / T)
    gaps = np.where((t % 5.0) < 0.5, np.nan, y)
    assert misfit_of(gaps, y) == pytest.approx(0.0, abs=0.01)  # samples beside a gap hold some of its straight line
