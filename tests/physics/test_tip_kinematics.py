"""Jets are a quantity with its two derivatives: whatever is done to them, they stay each other's derivatives."""

import math

import numpy as np
import pytest

from stillhook.physics.tip_kinematics import Jet, between, cosine, plus, scaled, sine, times

STEP = 1e-4
FIRST = 1e-6  # of differences over two steps, relative to numbers of about one
SECOND = 1e-5
EXACT = 1e-12


def of_polynomial(c, t) -> Jet:
    p = np.polynomial.Polynomial(c)
    return Jet(*(float(each(t)) for each in (p, p.deriv(), p.deriv(2))))


def assert_derivatives(at, t):
    """Of a function of time that gives jets."""
    before, now, after = at(t - STEP), at(t), at(t + STEP)
    assert now.v == pytest.approx((after.x - before.x) / (2.0 * STEP), abs=FIRST)
    assert now.a == pytest.approx((after.v - before.v) / (2.0 * STEP), abs=SECOND)


@pytest.mark.parametrize("x", [0.1, 0.37, 0.5, 0.92])
def test_between_two_jets_speed_and_acceleration_are_those_of_the_position(x):
    p, q, h = Jet(0.3, -0.8, 1.1), Jet(1.2, 0.4, -0.7), 1.7
    assert_derivatives(lambda t: between(p, q, h, t / h), x * h)


def test_at_its_ends_the_quintic_is_the_jets_themselves():
    p, q = Jet(0.3, -0.8, 1.1), Jet(1.2, 0.4, -0.7)
    assert between(p, q, 1.7, 0.0) == pytest.approx(p, abs=EXACT)
    assert between(p, q, 1.7, 1.0) == pytest.approx(q, abs=100.0 * EXACT)


@pytest.mark.parametrize("degree", range(6))
def test_a_motion_of_up_to_the_fifth_degree_is_met_exactly(degree):
    c = np.cos(np.arange(degree + 1.0))
    p, q = of_polynomial(c, 0.0), of_polynomial(c, 2.0)
    for x in (0.25, 0.6, 0.9):
        assert between(p, q, 2.0, x) == pytest.approx(of_polynomial(c, 2.0 * x), abs=1e-9)


@pytest.mark.parametrize("t", [0.0, 0.4, 1.3])
def test_sums_products_and_circular_functions_of_jets_keep_their_derivatives(t):
    a, b = (0.2, -0.5, 0.3, 0.1), (1.0, 0.4, -0.6)

    def jets(t):
        return of_polynomial(a, t), of_polynomial(b, t)

    assert_derivatives(lambda t: plus(*jets(t)), t)
    assert_derivatives(lambda t: times(*jets(t)), t)
    assert_derivatives(lambda t: scaled(-2.5, jets(t)[0]), t)
    assert_derivatives(lambda t: sine(jets(t)[0]), t)
    assert_derivatives(lambda t: cosine(jets(t)[0]), t)


def test_sine_and_cosine_are_of_the_angle():
    angle = Jet(0.7, 0.2, -0.1)
    assert (sine(angle).x, cosine(angle).x) == (pytest.approx(math.sin(0.7)), pytest.approx(math.cos(0.7)))
