"""Pieces of step 5: windows and their statistics, the tip's motion out of a log, the shape of two errors."""

import numpy as np
import pytest
from scipy.special import ndtr
from tests.validate.ahc_logs import STEP, sea

from stillhook.errors import ValidateError
from stillhook.validate.ahc.comparison import counted_share, gaussian_share, mean_and_s, shape, windows
from stillhook.validate.data_set.signals import smooth_tip

T = np.arange(0.0, 120.0, STEP)


# --- windows ---------------------------------------------------------------------------------------------------------------------------------


def test_paper_f_reads_86_percent_where_its_own_mean_and_deviation_give_87():
    """Print: mean 3.3 cm, s 1.5 cm, 96 % below 6 cm and 86 % below 5 cm."""
    assert gaussian_share(0.06, 0.033, 0.015) == pytest.approx(0.96, abs=0.005)
    assert gaussian_share(0.05, 0.033, 0.015) == pytest.approx(0.87, abs=0.005)
    assert gaussian_share(0.05, 0.033, 0.015) == pytest.approx(ndtr(1.7 / 1.5))


def test_deviations_of_one_size_have_no_spread():
    assert mean_and_s(np.full(5, 0.02)) == (pytest.approx(0.02), pytest.approx(0.0))
    assert gaussian_share(0.05, 0.02, 0.0) == 1.0
    assert gaussian_share(0.01, 0.02, 0.0) == 0.0
    assert counted_share(0.03, np.array([0.01, 0.02, 0.04, 0.05])) == 0.5


def test_a_sine_deviates_by_twice_the_difference_of_its_amplitudes():
    e = np.sin(2.0 * np.pi * T / 8.0)
    w = windows("1", T, STEP, 0.03 * e, 0.05 * e, 1.0 * e, 30.0)
    assert w.x == pytest.approx(0.04, abs=1e-5)  # to the sampling of the crest
    assert w.eta_measured == pytest.approx(0.97, abs=1e-5)
    assert w.eta_simulated == pytest.approx(0.95, abs=1e-5)
    assert w.ends[0] == pytest.approx(30.0)
    assert w.ends[-1] <= T[-1]


def test_a_slow_offset_of_the_cranes_error_does_not_count():
    e = 0.03 * np.sin(2.0 * np.pi * T / 8.0)
    w = windows("1", T, STEP, e + 0.5, e, e, 30.0)
    assert w.x.max() < 1e-12


def test_a_part_shorter_than_the_window_has_none():
    w = windows("1", T[:2000], STEP, T[:2000], T[:2000], T[:2000], 30.0)
    assert len(w.x) == 0


def test_a_tip_that_stands_has_no_efficiency():
    w = windows("1", T, STEP, np.sin(T), np.sin(T), np.zeros_like(T), 30.0)
    assert np.isnan(w.eta_measured).all()


# --- the tip ---------------------------------------------------------------------------------------------------------------------------------


def noisy(seed: int = 1, *, s: float = 0.002, v: float = 0.003):
    rng = np.random.default_rng(seed)
    true = sea(seed).sample(T)
    return true, true[0] + s * rng.standard_normal(len(T)), true[1] + v * rng.standard_normal(len(T))


def test_the_smooth_tip_is_several_times_closer_to_the_truth_than_the_log():
    true, s, v = noisy()
    tip = smooth_tip(T, s, v, place="test")
    inside = slice(200, -200)
    found = tip.motion.sample(T)
    assert np.abs(found[0] - true[0])[inside].std() < 0.002 / 5.0
    assert np.abs(found[1] - true[1])[inside].std() < 0.003 / 3.0
    assert (tip.spread_s, tip.spread_v) == (pytest.approx(0.002, rel=0.05), pytest.approx(0.003, rel=0.05))


def test_measured_speed_makes_the_tip_better_than_position_alone():
    true, s, v = noisy(s=0.01, v=0.002)
    with_v, without = (smooth_tip(T, s, x, place="test").motion.sample(T)[1] for x in (v, None))
    assert np.std(with_v - true[1]) < 0.5 * np.std(without - true[1])


def test_a_speed_that_contradicts_the_position_is_hardly_heard():
    """A speed 20 % too large: position wins, within what both say."""
    true, s, v = noisy()
    tip = smooth_tip(T, s, 1.2 * v, place="test")
    assert tip.spread_v > 10.0 * 0.003
    assert np.std(tip.motion.sample(T)[0] - true[0]) < 0.002


def test_a_short_hole_is_bridged_and_a_long_one_refused():
    true, s, v = noisy()
    s[3000:3020], v[3000:3020] = np.nan, np.nan
    tip = smooth_tip(T, s, v, place="test")
    assert np.abs(tip.motion.sample(T)[0] - true[0])[2900:3100].max() < 0.001  # half of the noise of one sample
    assert np.isnan(tip.noise[3000:3020]).all()
    s[3000:3500] = np.nan
    with pytest.raises(ValidateError, match='test "7": s_tip has gaps'):
        smooth_tip(T, s, None, place='test "7"')


@pytest.mark.parametrize("every", [0.1, 0.25])
def test_a_slow_log_still_gives_a_tip(every):
    t = np.arange(0.0, 120.0, every)
    true = sea(3).sample(t)
    tip = smooth_tip(t, true[0], true[1], place="test")
    assert np.abs(tip.motion.sample(t)[0] - true[0]).max() < 2e-5


def test_a_log_of_one_sample_a_second_is_refused():
    t = np.arange(0.0, 120.0, 1.0)
    with pytest.raises(ValidateError, match="too few for a tip motion"):
        smooth_tip(t, np.sin(t), np.cos(t), place="test")


# --- shape -----------------------------------------------------------------------------------------------------------------------------------


def irregular(seed: int) -> np.ndarray:
    return np.asarray(sea(seed).sample(np.arange(0.0, 300.0, STEP))[0]) * 0.03


@pytest.mark.slow
def test_an_error_compared_with_itself_is_of_the_same_shape():
    e = irregular(1)
    assert shape([(e, e, STEP)]) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-9))


@pytest.mark.slow
def test_another_sea_has_no_likeness():
    found = shape([(irregular(1), irregular(2), STEP)])
    assert abs(found.correlation) < 0.5


@pytest.mark.slow
def test_errors_half_as_large_are_six_decibel_off():
    e = irregular(5)
    found = shape([(e, 0.5 * e, STEP)])
    assert found.distance == pytest.approx(20.0 * np.log10(2.0))


@pytest.mark.slow
def test_a_part_that_was_logged_more_slowly_counts_by_its_seconds():
    e = irregular(7)
    mixed = shape([(e, 0.9 * e, STEP), (e[::10], 0.9 * e[::10], 10.0 * STEP)])
    alone = shape([(e, 0.9 * e, STEP)])
    assert mixed == (pytest.approx(1.0), pytest.approx(alone.distance, abs=1e-3))  # nothing above 5 Hz in waves


def test_an_error_that_stands_still_has_no_shape():
    e = irregular(1)
    found = shape([(np.full(len(e), 1e-3), e, STEP)])
    assert np.isnan([found.correlation, found.distance]).all()


def test_parts_shorter_than_a_minute_have_no_spectrum():
    e = irregular(6)[:5000]
    assert np.isnan(shape([(e, e, STEP)]).distance)
