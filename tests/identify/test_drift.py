"""Shapes of a drift over a test: polynomials that know nothing of each other, and a walk of a walk."""

import numpy as np
import pytest

from stillhook.identify.system_friction.fitting.drift import _integrated, _legendre

EXACT = 1e-12  # Gauss points integrate polynomials of this degree without error


def test_the_shapes_over_a_test_are_orthogonal_and_one_at_its_end():
    x, weight = np.polynomial.legendre.leggauss(8)
    shapes = np.array(_legendre(x))
    product = (shapes * weight) @ shapes.T
    np.testing.assert_allclose(product, np.diag([2.0 / 3.0, 2.0 / 5.0, 2.0 / 7.0]), atol=EXACT)
    assert [float(each[0]) for each in _legendre(np.array([1.0]))] == [1.0, 1.0, 1.0]


@pytest.mark.parametrize(("s", "t"), [(1.0, 1.0), (0.5, 1.0), (0.4, 0.9)])
def test_an_integrated_walk_has_the_covariance_of_its_increments(s, t):
    """int_0^s int_0^t min(a, b) db da, summed over small squares."""
    n = 2000
    a, b = (np.arange(n) + 0.5) * s / n, (np.arange(n) + 0.5) * t / n
    summed = float(np.minimum(a[:, None], b[None, :]).mean()) * s * t
    assert float(_integrated(np.array(s), np.array(t))) == pytest.approx(summed, rel=1e-3)
    assert _integrated(np.array(s), np.array(t)) == _integrated(np.array(t), np.array(s))
