"""Residuals between tensions and lengths of wire: against the twin asked there."""

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.errors import LiftError
from stillhook.response.winch.duty import Duty
from stillhook.response.winch.identify import ResidualGrid, identify_grid, identify_residual

BETWEEN = 0.15  # of what is left, half way between tables a factor of 1.6 in tension and four layers apart
OMEGA = np.array([0.5, 0.8, 1.3])


@pytest.fixture(scope="module")
def crane():
    return load_crane("nov-250t")


@pytest.fixture(scope="module")
def grid(crane):
    return identify_grid(crane, [8e5, 1.3e6], [200.0, 1000.0])


@pytest.mark.thorough
def test_at_its_own_places_the_grid_is_what_the_twin_said(crane, grid):
    own = identify_residual(crane, Duty(F=1.3e6, s_w=200.0))
    assert np.array_equal(grid.at(1.3e6, 200.0).C, own.C)


@pytest.mark.thorough
def test_between_them_it_is_near_what_the_twin_says_there(crane, grid):
    mixed, own = grid.at(1.05e6, 600.0), identify_residual(crane, Duty(F=1.05e6, s_w=600.0))
    for sigma_v in (0.05, 0.2, 0.5):
        a, b = (np.abs(r.gaussian(OMEGA, sigma_v)) for r in (mixed, own))
        assert a == pytest.approx(b, rel=BETWEEN)


def test_outside_it_says_so():
    grid = ResidualGrid((8e5, 1.3e6), (200.0, 1000.0), ())
    with pytest.raises(LiftError, match="residual grid: tension 2000 kN is outside 800 kN to 1300 kN"):
        grid.at(2e6, 500.0)
    with pytest.raises(LiftError, match="wire 10 m is outside 200 m to 1000 m"):
        grid.at(1e6, 10.0)


def test_a_grid_out_of_order_is_refused(crane):
    with pytest.raises(LiftError, match="F must hold one value or more, ascending"):
        identify_grid(crane, [2e6, 1e6], [100.0])
