"""A crane tip against another vessel's deck: both in the same waves, each with the phase that they have where it is."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from tests.sea.plank import plank

from stillhook.physics.scalar import G
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import realise, regular, tip_motion
from stillhook.sea.vessel.relative import OtherVessel, RelativeMotion
from stillhook.sea.vessel.tip import tip_response

PERIOD = 9.0  # s
LAMBDA = G * PERIOD**2 / (2.0 * math.pi)  # m, of deep water
TIP = (-20.0, -15.0)
SEA = parse_sea("jonswap Hs=2 m Tp=9 s", heading="150 deg", spread=4.0)
OPEN_TABLE = 2e-3  # of the motion: the table of the plank is interpolated at frequencies and turned headings


def against(vessel: Rao, other: Rao, **how) -> RelativeMotion:
    return RelativeMotion(vessel, OtherVessel(other, **how))


@pytest.fixture(scope="module")
def ship() -> Rao:
    return plank()


def test_two_alike_vessels_at_one_place_do_not_move_against_each_other(ship):
    same = against(ship, ship, at=TipPoint(*TIP), position=(0.0, 0.0))
    assert tip_response(same, SEA, *TIP).sigma_v == 0.0
    assert np.abs(tip_motion(realise(SEA, 600.0, 3), same, *TIP).sample(np.arange(0.0, 100.0, 1.0))[0]).max() == 0.0


@pytest.mark.parametrize(("wave_lengths", "times"), [(0.5, 2.0), (1.0, 0.0), (0.25, math.sqrt(2.0))])
def test_half_a_wave_length_apart_is_twice_the_motion_of_one(ship, wave_lengths, times):
    """In long-crested regular waves that travel along the line between them; a whole wave length apart: none."""
    apart = against(ship, ship, at=TipPoint(*TIP), position=(wave_lengths * LAMBDA, 0.0))
    waves = regular(1.0, PERIOD, 0.0)
    t = np.linspace(0.0, PERIOD, 721)
    alone, both = (np.abs(tip_motion(waves, of, *TIP).sample(t)[0]).max() for of in (ship, apart))
    assert both == pytest.approx(times * alone, abs=1e-4 * alone)


def test_across_the_waves_the_distance_does_not_matter(ship):
    abeam = against(ship, ship, at=TipPoint(*TIP), position=(0.0, 37.0))
    assert tip_response(abeam, parse_sea("jonswap Hs=2 m Tp=9 s", heading="0 deg"), *TIP).sigma_z < 1e-12


def test_a_vessel_that_is_turned_answers_the_waves_from_its_own_bow(ship):
    """The other one turned by 180 deg with the waves on the bow has them on its stern: the tip at a place of the one is
    over the mirrored place of the other, where the water is the same."""
    turned = OtherVessel(ship, TipPoint(12.0, 5.0), heading=parse_direction("180 deg"))
    assert turned.placed(*TIP) == pytest.approx((TIP[0] + 12.0, TIP[1] + 5.0))
    omega, beta = np.array([0.5, 0.8]), np.radians([150.0])
    H = RelativeMotion(ship, turned).vertical(omega, beta, *TIP)
    X, Y = turned.placed(*TIP)
    k = omega**2 / G
    deck = ship.vertical(omega, beta - math.pi, 12.0, 5.0) * np.exp(
        -1j * k * (X * np.cos(beta)[0] + Y * np.sin(beta)[0])
    )
    assert H == pytest.approx(ship.vertical(omega, beta, *TIP) - deck)


def test_by_default_the_deck_is_below_the_tip_where_long_waves_lift_both_alike(ship):
    """The symmetric plank turned end for end about the tip is another body on the same water."""
    below = against(ship, ship, at=TipPoint(18.0, -4.0), heading=math.radians(70.0))
    long, short = (abs(below.vertical([w], 1.1, *TIP)[0]) for w in (0.02, 1.2))
    assert long < 2e-2 < short


@pytest.mark.slow
def test_the_spectrum_is_that_of_realisations(ship):
    """Of 8 records of an hour with the variances of the spectrum: both vessels by the same waves with the right
    phase, in time as the difference of their motions."""
    of = against(ship, ship, at=TipPoint(10.0, 4.0), heading=math.radians(30.0))
    response, t = tip_response(of, SEA, *TIP), np.arange(0.0, 3600.0, 0.5)
    variances = [tip_motion(realise(SEA, 3600.0, seed), of, *TIP).sample(t)[1].var() for seed in range(8)]
    assert math.sqrt(np.mean(variances)) == pytest.approx(response.sigma_v, rel=0.03)


def test_deep_water_is_not_taken_for_shallow(ship):
    """On 15 m of water a wave of 9 s is shorter (about 99 m by tanh): half of that apart is twice the motion there."""
    depth, omega = 15.0, 2.0 * math.pi / PERIOD
    k = omega**2 / G
    for _ in range(200):  # fixed point of the dispersion relation
        k = omega**2 / (G * math.tanh(k * depth))
    other = OtherVessel(ship, TipPoint(*TIP), position=(math.pi / k, 0.0))
    H = RelativeMotion(ship, other, depth).vertical([omega], 0.0, *TIP)
    assert abs(H[0]) == pytest.approx(2.0 * abs(ship.vertical([omega], 0.0, *TIP)[0]), rel=1e-6)


@pytest.mark.parametrize(
    ("crane", "deck", "both"),
    [
        ([0.2, 0.5, 0.9, 1.4], [0.3, 0.5, 1.2], [0.3, 0.5, 0.9, 1.2]),
        ([0.3, 0.5, 1.2], [0.2, 0.5, 0.9, 1.4], [0.3, 0.5, 0.9, 1.2]),
        ([0.3, 0.6], [0.3, 0.6], [0.3, 0.6]),
    ],
)
def test_motions_against_each_other_are_known_where_both_tables_are_ends_included(crane, deck, both) -> None:
    tables = [SimpleNamespace(omega=np.array(omega)) for omega in (crane, deck)]
    relative = RelativeMotion(tables[0], SimpleNamespace(rao=tables[1]))  # type: ignore[arg-type]
    assert relative.omega.tolist() == both
