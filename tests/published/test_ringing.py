"""A ringing series gives back the period and the damping it was made of."""

import math

import numpy as np
import pytest
import xarray

from stillhook.errors import StillhookError
from stillhook.thesis.ringing import ringing, rms_above

PERIOD, ZETA, REST = 0.7, 0.1, 40e5
DT = 0.002
ON_THE_GRID = 1.5 * DT
"""Peaks lie on samples: two of them are each up to half a sample off."""
FIT = 0.01
"""Relative: heights of peaks are read on samples, at most (omega DT)^2 / 8 too low; the settled mean still holds the
last ringing."""
FILTER = 0.01
"""Relative: a third-order filter lets 0.03 % of the wave through a decade below its edge; the ends of the series
ring."""


def run_of(x: np.ndarray, t: np.ndarray) -> xarray.Dataset:
    return xarray.Dataset({"p_a": ("time", x)}, coords={"time": t})


@pytest.fixture(scope="module")
def ring_down() -> xarray.Dataset:
    """At rest until 2 s, then a damped cosine that starts in its trough."""
    t = np.arange(0.0, 20.0, DT)
    omega_d = 2.0 * math.pi / PERIOD
    sigma = ZETA * omega_d / math.sqrt(1.0 - ZETA**2)
    after = np.maximum(t - 2.0, 0.0)
    swing = -50e5 * np.exp(-sigma * after) * np.cos(omega_d * after)
    return run_of(REST + np.where(t < 2.0, -50e5, swing), t)


def test_period_and_damping_of_a_ring_down_are_found_again(ring_down: xarray.Dataset):
    r = ringing(ring_down, "p_a", start=2.0, least=0.1e5)
    assert r.period == pytest.approx(PERIOD, abs=ON_THE_GRID)
    assert r.later == pytest.approx(PERIOD, abs=ON_THE_GRID)
    assert r.zeta == pytest.approx(ZETA, rel=FIT)
    assert r.decay == pytest.approx(ZETA * 2.0 * math.pi / PERIOD / math.sqrt(1.0 - ZETA**2), rel=FIT)


def test_decay_counts_from_when_the_ringing_is_left_alone(ring_down: xarray.Dataset):
    forced = ring_down.copy(deep=True)
    forced["p_a"].values[:1500] += 30e5  # the first peak, at 2.35 s, is pushed up
    free = ringing(forced, "p_a", start=2.0, least=0.1e5, free=3.2)
    pushed = ringing(forced, "p_a", start=2.0, least=0.1e5)
    assert free.decay == pytest.approx(ringing(ring_down, "p_a", start=2.0, least=0.1e5).decay, rel=FIT)
    assert pushed.decay > 1.02 * free.decay


def test_a_series_without_two_peaks_has_no_period():
    t = np.arange(0.0, 10.0, DT)
    r = ringing(run_of(1.0 - np.exp(-t), t), "p_a", start=0.0, least=0.01)
    assert math.isnan(r.period)
    assert math.isnan(r.zeta)
    assert len(r.t_peak) == 0


def test_small_ripple_is_no_peak(ring_down: xarray.Dataset):
    t = ring_down["time"].values
    rough = run_of(ring_down["p_a"].values + 0.3e5 * np.sin(2.0 * math.pi * 15.0 * t), t)
    assert ringing(rough, "p_a", start=2.0, least=2e5).period == pytest.approx(
        PERIOD, abs=0.04
    )  # ripple of 0.3 bar moves peaks of 50 bar


def test_only_what_lies_above_the_frequency_counts_as_ringing():
    t = np.arange(0.0, 120.0, 0.01)
    wave, ring = 3.0 * np.sin(2.0 * math.pi * t / 12.0), 0.2 * np.sin(2.0 * math.pi * 1.5 * t)
    assert rms_above(run_of(wave + ring, t), "p_a", frequency=0.6, start=10.0) == pytest.approx(
        0.2 / math.sqrt(2.0), rel=FILTER
    )


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda run: ringing(run, "p_x", start=0.0, least=1.0), 'no series "p_x"'),
        (lambda run: ringing(run, "p_a", start=19.0, least=1.0), "the series ends at 19.998 s"),
        (lambda run: ringing(run, "p_a", start=2.0, least=0.0), "least height above 0"),
        (lambda run: rms_above(run, "p_a", frequency=300.0), "half the sampling rate"),
    ],
)
def test_what_cannot_be_measured_is_refused_in_one_line(ring_down: xarray.Dataset, call, text: str):
    with pytest.raises(StillhookError) as problem:
        call(ring_down)
    assert text in str(problem.value)
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(("start", "least", "accepted"), [(2.0, 0.0, False), (2.0, -1.0, False), (18.0, 1.0, False)])
def test_a_least_height_of_nothing_and_a_start_in_the_settled_part_are_refused(ring_down, start, least, accepted):
    """Every ripple would be a peak, and none would be left before rest."""
    with pytest.raises(StillhookError, match=r"Start before the settled part, and give a least height above 0\.$"):
        ringing(ring_down, "p_a", start=start, least=least)
