"""Regression on errors that hang together in time: coverage of the intervals, lags, curves with holes, layers, servos."""

import numpy as np
import pytest
from scipy.signal import lfilter
from tests.validate.ahc_logs import TWIN, record

from stillhook.physics.hydraulics.swash import Servo
from stillhook.statistics.blocks import fit, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.validate.parameters.segments import (
    LogPart,
    diameter_of,
    differences,
    integral,
    layer_at,
    layer_of,
    slope,
    wire_of_layer,
)
from stillhook.validate.parameters.settings import followed

STEP = 0.01
NOMINAL, SLACK = 0.95, 0.04  # of 95 % intervals; three standard deviations of 300 draws


def red_noise(rng, n, tau):
    """Noise of unit variance that hangs together over tau samples."""
    a = np.exp(-1.0 / tau)
    return lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], rng.standard_normal(n))


def part_of(**signals) -> LogPart:
    n = len(next(iter(signals.values())))
    log = {"s_tip": np.zeros(n), "s_w": np.full(n, 500.0)} | signals
    r = record(log)
    return LogPart(TWIN, r, r.segments[0], 0)


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [6, 30])
def test_intervals_hold_the_slope_in_95_of_100_logs_though_the_errors_hang_together(blocks):
    rng = np.random.default_rng(5)
    n, each, hits, plain = 100 * blocks, 100, 0, 0
    block = np.arange(n) // each
    for _ in range(300):
        x, e = red_noise(rng, n, 10.0), red_noise(rng, n, 10.0)
        found = fit((x, np.ones(n)), 2.0 * x + e, block)
        hits += abs(found.b[0] - 2.0) <= found.half(0)
        plain += abs(found.b[0] - 2.0) <= 1.96 * found.sd / np.sqrt(x @ x)
    assert hits / 300 == pytest.approx(NOMINAL, abs=SLACK)
    assert plain / 300 < NOMINAL - 2.0 * SLACK  # what independent errors would promise is not kept


def test_columns_that_say_the_same_give_no_fit():
    x = np.random.default_rng(1).standard_normal(500)
    assert fit((x, 2.0 * x), x, np.arange(500) // 50) is None
    assert fit((x,), x, np.zeros(500, dtype=np.intp)) is None  # one block


def test_rows_with_holes_are_left_out():
    rng = np.random.default_rng(2)
    x = rng.standard_normal(600)
    y = 3.0 * x
    y[50:80] = np.nan
    assert fit((x,), y, np.arange(600) // 50).b[0] == pytest.approx(3.0)


def test_estimates_that_differ_by_more_than_they_allow_give_a_wider_mean():
    alike = pooled([Estimate.around(1.0, 0.1), Estimate.around(1.05, 0.1)])
    apart = pooled([Estimate.around(1.0, 0.1), Estimate.around(2.0, 0.1)])
    assert (
        0.1 < alike.half < 0.1 * apart.half
    )  # two tests alone tell little of how tests differ (Student's t, 1 degree of freedom)
    assert alike.low < 1.0 < 1.05 < alike.high
    assert pooled([Estimate.around(1.0, 0.2)]) == Estimate.around(1.0, 0.2)


def waves(n, seed=0):
    t, rng = np.arange(n) * STEP, np.random.default_rng(seed)
    return sum(
        a * np.sin(2 * np.pi * t / T + p)
        for a, T, p in zip((1.0, 0.7, 0.4), (11.0, 8.3, 6.1), rng.uniform(0, 6, 3), strict=True)
    )


def test_noise_of_a_speed_draws_no_slope_towards_zero():
    """An ordinary regression of ds/dt on v would be 4 % low at this noise."""
    rng, n = np.random.default_rng(3), 20_000
    s = waves(n)
    v = np.gradient(s, STEP)
    noisy = v + 0.2 * np.std(v) * rng.standard_normal(n)
    part = part_of(v_w=noisy)
    found = slope([part], [(integral(noisy, STEP), s)])
    assert found.value == pytest.approx(1.0, abs=2e-3)
    assert abs(found.value - 1.0) < 2.0 * found.half


@pytest.mark.parametrize("lag", [-0.1, 0.03, 0.25])
def test_a_lag_between_two_curves_is_found_and_costs_no_slope(lag):
    n, late = 20_000, round(lag / STEP)
    whole = waves(n + 200)
    s, x = whole[100 - late : 100 - late + n], whole[100 : 100 + n]
    found = slope([part_of(v_w=x)], [(x, 1.01 * s)])
    assert found.lag == pytest.approx(lag, abs=1e-3)
    assert found.value == pytest.approx(1.01, abs=2e-4)


def test_a_curve_that_stands_still_tells_no_slope():
    n = 20_000
    assert slope([part_of(v_w=np.zeros(n))], [(np.zeros(n), waves(n))]) is None


def test_a_hole_spoils_its_own_windows_alone():
    n = 20_000
    v = np.ones(n)
    v[5000:5100] = np.nan
    moved = differences(integral(v, STEP), STEP, 2.0)
    lost = np.flatnonzero(np.isnan(moved))
    assert set(lost) <= {0, 24, 25, len(moved) - 1}
    assert np.nanmax(np.abs(moved - 2.0)) < 1e-9


def test_layers_go_from_the_outermost_inwards_as_wire_is_paid_out():
    s_w = np.linspace(0.0, 2800.0, 200)
    layer = layer_of(TWIN, s_w)
    assert layer[0] == TWIN.drum.layers
    assert layer[-1] == 1.0
    assert (np.diff(layer) <= 0.0).all()
    for n in range(1, TWIN.drum.layers + 1):
        least, most = wire_of_layer(TWIN, n)
        assert layer_of(TWIN, np.array([0.5 * (least + most)]))[0] == n


def test_the_layer_of_a_diameter_undoes_the_diameter_of_a_layer():
    layers = np.arange(1.0, TWIN.drum.layers + 1.0)
    back = [layer_at(TWIN, float(d)) for d in diameter_of(TWIN, layers)]
    assert back == pytest.approx(list(layers))


def test_a_followed_command_settles_on_it_and_stays_in_its_stroke():
    servo = Servo(5.0, 1.0, 0.6, 1.0, 2.5, 2.5)
    u = np.concatenate((np.full(100, 1.0), np.full(500, 0.8), np.full(500, 0.2)))
    out = followed(u, servo, STEP)
    assert out[:100] == pytest.approx(1.0)
    assert out[599] == pytest.approx(0.8, abs=1e-6)
    assert out[-1] == 0.6
    assert (np.diff(out) <= 1e-12).all()  # critically damped: it never overshoots
