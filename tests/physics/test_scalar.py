"""Mathematics of the kernels, against the standard library's."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.physics.scalar import clip, copysign, exp, quantise, scalar_of, tanh

EXP = 1.0e-14
"""Relative error that the vectorising exponential promises."""


@pytest.mark.slow
def test_the_compiled_exponential_is_the_exponential(numba):
    from stillhook.kernels.by_numba import kernel_of

    kernel = kernel_of(scalar_of(exp))

    @numba.njit
    def over(x, out):
        for i in range(x.size):
            out[i] = kernel(x[i])

    x = np.concatenate([np.linspace(-700.0, 700.0, 20001), np.linspace(-1.0, 1.0, 2001), [-1e-300, 0.0, 1e-16]])
    y = np.empty_like(x)
    over(x, y)
    exact = np.array([math.exp(i) for i in x])
    assert np.max(np.abs(y / exact - 1.0)) < EXP
    far = np.array([-1e4, 1e4])
    over(far, y)
    assert 0.0 < y[0] < 1e-300 < 1e300 < y[1] < np.inf


@given(st.floats(-300.0, 300.0))
def test_tanh_is_odd_and_bounded(x):
    assert tanh(x) == pytest.approx(math.tanh(x), abs=1e-15)
    assert tanh(-x) == -tanh(x)


@given(st.floats(-1e6, 1e6), st.floats(-1e3, 0.0), st.floats(0.0, 1e3))
def test_clip_stays_between_its_bounds(x, lo, hi):
    assert lo <= clip(x, lo, hi) <= hi
    assert clip(x, lo, hi) == x or not lo <= x <= hi


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 10.0))
def test_a_quantised_signal_is_the_nearest_multiple_of_its_step(x, step):
    y = quantise(x, step)
    assert abs(y - x) <= 0.5 * step * (1.0 + 1e-9)
    assert abs(y / step - round(y / step)) < 1e-9


@given(st.floats(-1e3, 1e3))
def test_an_ideal_sensor_has_no_steps(x):
    assert quantise(x, 0.0) == x


def test_copysign_gives_rest_no_direction_of_its_own():
    assert copysign(0.0, 5.0) == 0.0
    assert copysign(3.0, -1.0) == -3.0
