"""A signal through a raised cosine: what is constant stays, and one bad sample spoils its surroundings and no more."""

from types import SimpleNamespace

import numpy as np
import pytest

from stillhook.validate.controller import law
from stillhook.validate.controller.law import shifted, smoothed

STEP = 0.01
ROUNDING = 1e-12


@pytest.mark.parametrize("n", [1, 5, 9])
def test_a_bad_sample_is_missing_within_its_reach_and_nowhere_else(n):
    good = np.ones(60, np.bool_)
    good[30] = False
    smooth = smoothed(np.full(60, 3.0), good, n * STEP, STEP)
    half = (n - 1) // 2
    bad = np.flatnonzero(np.isnan(smooth))
    expected = [*range(half), *range(30 - half, 31 + half), *range(60 - half, 60)]
    assert bad.tolist() == expected
    np.testing.assert_allclose(smooth[np.isfinite(smooth)], 3.0, atol=ROUNDING)


def test_a_straight_line_stays_one_and_what_is_shorter_than_the_cosine_is_not_known():
    line = np.arange(40.0)
    smooth = smoothed(line, np.ones(40, np.bool_), 7 * STEP, STEP)
    np.testing.assert_allclose(smooth[3:-3], line[3:-3], atol=40.0 * ROUNDING)
    assert np.isnan(smoothed(line[:6], np.ones(6, np.bool_), 7 * STEP, STEP)).all()
    assert np.isfinite(smoothed(line[:7], np.ones(7, np.bool_), 7 * STEP, STEP)).sum() == 1


@pytest.mark.parametrize("by", [0.0, 0.02, 0.025])
def test_a_ramp_that_comes_later_is_lower_by_its_slope(by):
    late = shifted(np.arange(40.0), by, STEP)
    np.testing.assert_allclose(late[5:], np.arange(5.0, 40.0) - by / STEP, atol=1e-9)


def test_the_power_of_white_noise_after_smoothing_is_told_from_its_second_differences(monkeypatch):
    """Slow motion adds nothing to it; what is smoothed here says how much is left."""
    rng, n = np.random.default_rng(1), 300_000
    sizes = dict(zip(law.NAMES, (0.02, 0.1, 0.005, 0.03), strict=True))
    noise = {name: size * rng.standard_normal(n) for name, size in sizes.items()}
    motion = np.sin(2.0 * np.pi * 0.1 * STEP * np.arange(n))
    run = SimpleNamespace(step=STEP, rows=lambda *, ahc: np.ones(n, np.bool_))
    monkeypatch.setattr(law, "_raw", lambda run: [motion + x for x in noise.values()])
    found = law._noise([run])
    for name, x in noise.items():
        left = np.nanvar(smoothed(x, np.ones(n, np.bool_), law.SMOOTH[0], STEP))
        assert found[name] == pytest.approx(left, rel=0.1), name
