"""The library's supply vessel beside ShipX's table of a real one of the same size: another hull, another method, the same kind of motion."""

import pytest

from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import vessel_file
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.tip import tip_response

SIMILAR = 0.25
"""Strip theory and panels, 82.8 m by 19.2 m and 82 m by 18.5 m, other lines and weights: a sign or a unit would be off by much more."""
TIP = (-20.0, -18.0)


@pytest.fixture
def both(shared_data):
    return read_vessel(vessel_file("supply-vessel-82m")), read_vessel(shared_data / "vessel_mss_supply" / "input.re1")


def sigma(vessel, degrees, T_p):
    sea = parse_sea(f"jonswap Hs=1 m Tp={T_p:g} s gamma=3.3", heading=f"{degrees} deg")
    return tip_response(vessel, sea, *TIP).sigma_z


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [180.0, 150.0, 90.0])
@pytest.mark.parametrize("T_p", [8.0, 10.0])
def test_the_tip_moves_as_that_of_a_real_ship_of_the_same_size(both, degrees, T_p):
    ours, theirs = (sigma(v, degrees, T_p) for v in both)
    assert ours == pytest.approx(theirs, rel=SIMILAR)


@pytest.mark.slow
def test_the_weather_side_moves_more_than_the_lee_side_on_both(both):
    for vessel in both:
        assert sigma(vessel, 90.0, 8.0) > 1.15 * sigma(vessel, 270.0, 8.0)  # the tip is on the starboard side
