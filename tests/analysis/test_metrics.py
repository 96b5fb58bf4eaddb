"""Windows and settling times of motions whose answer is known without a window: a ramp, a step, an exponential."""

import math

import numpy as np
import pytest
import xarray as xr

from stillhook import metrics
from stillhook.errors import StillhookError

DT = 0.25  # s, exact in binary, as are all times below
ROUNDING = 1e-12  # m: sums of a few products of binary fractions


def run(values, *, name="e_c", warm_up=0.0, start=0.0) -> xr.Dataset:
    time = start + DT * np.arange(len(values))
    return xr.Dataset({name: ("time", np.asarray(values, dtype=float))}, {"time": time}).assign(warm_up=warm_up)


def ramp(speed: float, n: int = 81, **options) -> xr.Dataset:
    return run(speed * DT * np.arange(n), **options)


@pytest.mark.parametrize("window", [0.25, 0.5, 5.0, 20.0])
def test_a_steady_drift_spans_its_speed_times_the_window(window):
    """Both ends of the window count: with a sample fewer or more the span would be of another time."""
    span = metrics.e_c_pp(ramp(0.5), window=f"{window} s")
    counted = span.dropna("time")
    assert float(counted["time"][0]) == window
    np.testing.assert_allclose(counted, 0.5 * window, atol=ROUNDING)


def test_a_window_as_long_as_the_run_has_one_value_and_a_longer_one_none():
    drift = ramp(0.5)
    assert metrics.e_c_pp(drift, window="20 s").notnull().sum() == 1
    assert metrics.e_c_pp(drift, window="20.25 s").isnull().all()


def test_a_window_shorter_than_the_spacing_of_samples_is_refused():
    with pytest.raises(StillhookError, match=r"^metrics: window = 0\.1 s: give a time, at least the 0\.25 s between"):
        metrics.e_c_pp(ramp(0.5), window="0.1 s")


@pytest.mark.parametrize("start", [0.0, 100.0])
def test_the_warm_up_is_not_counted_and_the_sample_at_its_end_is(start):
    """A jump at the last sample of the warm-up is in no window; one at the first sample after it is in the first."""
    at_the_end = np.zeros(81)
    at_the_end[39] = 3.0  # at 9.75 s of 10 s
    assert float(metrics.e_c_pp(run(at_the_end, warm_up=10.0, start=start), window="5 s").max()) == 0.0
    after = np.zeros(81)
    after[40] = 3.0
    span = metrics.e_c_pp(run(after, warm_up=10.0, start=start), window="5 s").dropna("time")
    assert float(span["time"][0]) == start + 15.0
    assert span.values.tolist() == [3.0] + [0.0] * (len(span) - 1)


def test_samples_that_are_not_even_are_refused_and_rounded_stamps_are_not():
    drift = ramp(0.5)
    rounded = drift.assign_coords(time=drift["time"] + 1e-8 * np.cos(np.arange(81)))
    assert metrics.time_step(rounded) == pytest.approx(DT, abs=1e-7)
    uneven = drift.assign_coords(time=drift["time"] + np.where(np.arange(81) == 40, 1e-3, 0.0))
    with pytest.raises(StillhookError, match="not evenly spaced"):
        metrics.time_step(uneven)
    with pytest.raises(StillhookError, match="has no time series"):
        metrics.time_step(drift.isel(time=[0]))
    assert metrics.time_step(drift.isel(time=[0, 1])) == DT


def test_what_does_not_follow_the_tip_leaves_all_of_its_motion_and_half_of_it_leaves_half():
    wave = np.sin(2.0 * np.pi * DT * np.arange(161) / 8.0)
    stands = run(wave).assign(s_tip=("time", wave))
    assert float(metrics.eta_c(stands, window="16 s").max()) == pytest.approx(0.0, abs=ROUNDING)
    halved = run(0.5 * wave).assign(s_tip=("time", wave))
    np.testing.assert_allclose(metrics.eta_c(halved, window="16 s").dropna("time"), 0.5, atol=ROUNDING)
    calm = run(wave).assign(s_tip=("time", 0.0 * wave))
    assert metrics.eta_c(calm, window="16 s").isnull().all()


class TestSettling:
    START = 5.0

    def settled(self, speed, band=0.25) -> float:
        """After a step of 1 m/s at 5 s to 1 m/s."""
        data = run(speed, name="v_w")
        return float(metrics.settling_time(data, start="5 s", target="1 m/s", step="1 m/s", band=band))

    @pytest.mark.parametrize("tau", [0.5, 2.0])
    def test_a_lag_of_first_order_settles_after_the_logarithm_of_the_band(self, tau):
        t = DT * np.arange(241)
        speed = np.where(t < self.START, 0.0, 1.0 - np.exp(-np.maximum(t - self.START, 0.0) / tau))
        assert 0.0 <= tau * math.log(50.0) - self.settled(speed, band=0.02) < DT

    def test_what_is_at_its_target_at_once_takes_no_time_whatever_was_before(self):
        t = DT * np.arange(81)
        assert self.settled(np.where(t < self.START, 0.0, 1.0)) == 0.0

    def test_on_the_edge_of_the_band_is_within_it(self):
        assert self.settled(np.full(81, 0.75)) == 0.0
        assert self.settled(np.full(81, 1.25)) == 0.0
        assert math.isnan(self.settled(np.full(81, 0.7499)))

    def test_what_leaves_the_band_again_settles_after_that(self):
        speed = np.ones(81)
        speed[60] = 2.0  # at 15 s
        assert self.settled(speed) == 10.0
        speed[80] = 2.0
        assert math.isnan(self.settled(speed))

    def test_the_step_may_be_at_the_last_sample_but_not_after_it(self):
        data = run(np.ones(21), name="v_w")
        settled = {"target": "1 m/s", "step": "1 m/s"}
        assert float(metrics.settling_time(data, start="5 s", **settled)) == 0.0
        with pytest.raises(StillhookError, match=r"start = 5\.1 s is after the end of the run, 5 s\.$"):
            metrics.settling_time(data, start="5.1 s", **settled)
