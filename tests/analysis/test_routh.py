"""Routh's table against roots that are known because the polynomial was made of them, and gain limits by table, poles
and closed form."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.scripts import PAGES, script

from stillhook import load_crane
from stillhook.analysis.loop_stability.loops import sampled
from stillhook.analysis.loop_stability.margins import gain_limit_of
from stillhook.analysis.loop_stability.stability import gain_limit
from stillhook.analysis.loop_stability.transfer import position_loop
from stillhook.errors import StillhookError

PAGE = script(PAGES / "routh.py")
closed_loop_polynomial = script(PAGES / "reduced.py").closed_loop_polynomial
routh, gain_limit_by_poles, gain_limit_by_routh = PAGE.routh, PAGE.gain_limit_by_poles, PAGE.gain_limit_by_routh
CRANES = [load_crane(n) for n in ("nov-250t", "nov-150t", "nov-100t-pure-active")]
CRANE = CRANES[0]
WAYS = 1e-10  # four ways to one limit: floats rounded in polynomials, closed in by halving

real = st.integers(-3, 3).map(lambda a: [complex(a)])
pair = st.tuples(st.integers(-2, 2), st.integers(1, 3)).map(lambda p: [complex(p[0], p[1]), complex(p[0], -p[1])])
roots = st.lists(st.one_of(real, pair), min_size=1, max_size=4).map(lambda parts: [r for part in parts for r in part])


@pytest.mark.slow
@given(roots, st.sampled_from([1, -2, Fraction(1, 3)]))
def test_table_counts_roots_on_the_right_and_on_the_axis(at: list[complex], factor: float):
    """Roots of small whole parts make polynomials of whole coefficients, often with zero rows and zero first
    elements."""
    p = [factor * int(c) for c in np.poly(at).real.round()]
    found = routh(p)
    assert found.unstable == sum(r.real > 0 for r in at)
    assert found.on_axis == sum(r.real == 0 for r in at)
    assert found.stable == all(r.real < 0 for r in at)


@pytest.mark.parametrize(
    ("p", "unstable", "on_axis", "word"),
    [
        ([1, 2, 3, 4, 5], 2, 0, None),  # a textbook case without special rows
        ([1, 1, 2, 2, 3], 2, 0, "zero first element"),
        ([1, 0, -5, 0, 14, -20], 3, 0, "zero first element"),  # one root added on the left is not enough
        ([1, 0, 0, 0, 1], 2, 0, "zero row"),
        ([1, 0, 2, 0, 1], 0, 4, "zero row"),  # twice +-i
        ([1, 2, 8, 12, 20, 16, 16], 0, 4, "zero row"),
        ([5], 0, 0, None),
        ([1, 0], 0, 1, None),
    ],
)
def test_special_cases_are_told(p: list[int], unstable: int, on_axis: int, word: str | None):
    found = routh(p)
    roots = np.roots(p)
    assert (found.unstable, found.on_axis) == (unstable, on_axis)
    assert unstable == np.sum(roots.real > 1e-6)  # double roots on the axis are found to 1e-8
    assert bool(found.special) == (word is not None)
    assert word is None or word in found.special[0]


def test_no_polynomial_is_refused():
    for bad in ([], [0, 0.0], [1.0, math.nan]):
        with pytest.raises(StillhookError, match="Routh"):
            routh(bad)


@pytest.mark.slow
@settings(max_examples=20)
@given(st.sampled_from(CRANES), st.floats(0.02, 1.0), st.floats(1.0, 1.9))
def test_four_ways_lead_to_one_limit(crane, alpha_m: float, K_wire: float):
    """Routh's table, eigenvalues, the response through -1 and the closed form share no line of code."""
    closed = gain_limit(crane, alpha_m, K_wire)
    loop = position_loop(crane, alpha_m, K_wire=K_wire)
    by_response, omega_c = gain_limit_of(loop)
    ways = (
        gain_limit_by_routh(*closed_loop_polynomial(crane, alpha_m, K_wire=K_wire)),
        gain_limit_by_poles(loop.closed_poles),
        by_response,
    )
    assert ways == pytest.approx([closed.K_p_ms] * 3, rel=WAYS)
    assert omega_c == pytest.approx(closed.omega_c, rel=WAYS)


@pytest.mark.slow
@settings(max_examples=20)
@given(st.sampled_from(CRANES), st.floats(0.1, 1.0), st.sampled_from([0.0, 0.004, 0.01, 0.037, 0.25]))
def test_limit_with_plc_is_where_the_poles_leave_the_unit_circle(crane, alpha_m: float, delay: float):
    loop = sampled(position_loop(crane, alpha_m), crane.control.t_cycle, delay)
    assert gain_limit_by_poles(loop.closed_poles, sampled=True) == pytest.approx(
        gain_limit_of(loop)[0], rel=1e-7
    )  # |z| = 1 -+ 1e-9


def test_loop_that_never_swings_has_no_limit():
    assert gain_limit_by_routh([1.0], [1.0, 1.0, 0.0]) == math.inf
    with pytest.raises(StillhookError, match="unstable at any gain"):
        gain_limit_by_routh([1.0], [1.0, 0.0, 0.0])
