"""Motion transfer functions: interpolation against a plank in closed form, what holds beyond the table, points of the ship."""

import numpy as np
import pytest
from tests.sea.plank import BETA, BREADTH, LENGTH, OMEGA, plank, plank_motions

from stillhook.errors import SeaError
from stillhook.sea.vessel.rao import Rao, wavenumber

TABLE = 1e-12  # what the table holds comes back but for rounding
CURVE = 0.01  # m/m: cubics between values 0.05 rad/s apart, motions of order 1
SPLINE = 1e-3  # m/m: a spline between headings 10 deg apart, in waves down to 5.2 s (0.7 of the plank)
HALF = 1e-3  # at a third of the lowest frequency what is left of the deviation is of order k^2


def test_what_the_table_holds_comes_back() -> None:
    ship = plank()
    assert np.abs(ship.at(OMEGA, BETA) - ship.H).max() < TABLE
    assert np.abs(ship.table(OMEGA) - ship.H).max() < TABLE


def test_motions_between_frequencies_and_headings_are_those_of_the_plank() -> None:
    ship = plank()
    omega, beta = 0.5 * (OMEGA[1:] + OMEGA[:-1]), BETA + np.radians(5.0)
    scale = np.array([1.0, 1.0, 1.0, BREADTH / 2, LENGTH / 2, LENGTH / 2])[:, None, None]
    assert np.abs(scale * (ship.at(omega, BETA) - plank_motions(omega, BETA))).max() < CURVE
    waves = OMEGA[OMEGA <= 1.2]
    assert np.abs(scale * (ship.at(waves, beta) - plank_motions(waves, beta))).max() < SPLINE


def test_a_straight_line_between_headings_would_lose_ten_times_as_much() -> None:
    ship = plank()
    x, y, omega = -25.0, -18.0, np.array([1.05])
    beta = BETA + np.radians(5.0)
    exact = _vertical(plank_motions(omega, beta), x, y)
    straight = 0.5 * (ship.vertical(omega, BETA, x, y) + ship.vertical(omega, BETA + np.radians(10.0), x, y))
    assert 10.0 * np.abs(ship.vertical(omega, beta, x, y) - exact).max() < np.abs(straight - exact).max()


def _vertical(H: np.ndarray, x: float, y: float) -> np.ndarray:
    return H[2] + y * H[3] - x * H[4]


def test_no_curve_goes_beyond_the_values_on_either_side() -> None:
    rng = np.random.default_rng(6)
    H = rng.normal(size=(6, 8, 12)) + 1j * rng.normal(size=(6, 8, 12))
    ship = Rao("rough", np.linspace(0.2, 2.0, 12), np.radians(np.arange(0.0, 360.0, 45.0)), H)
    fine = np.linspace(0.2, 2.0, 12 * 20 - 19)
    between = ship.table(fine)
    for part in (np.real, np.imag):
        low = np.minimum(part(H[..., 1:]), part(H[..., :-1])).repeat(20, axis=-1)
        high = np.maximum(part(H[..., 1:]), part(H[..., :-1])).repeat(20, axis=-1)
        assert (part(between[..., :-1]) >= low - TABLE).all()
        assert (part(between[..., :-1]) <= high + TABLE).all()


def test_a_heading_is_the_same_after_any_turn() -> None:
    ship = plank()
    for beta in (-0.3, 0.1, 3.0, 6.2):
        assert np.abs(ship.at(OMEGA, beta) - ship.at(OMEGA, beta + 4.0 * np.pi)).max() < TABLE


def test_shares_of_headings_add_to_one() -> None:
    shares = plank().heading_weights(np.linspace(-7.0, 7.0, 200))
    assert np.abs(shares.sum(axis=1) - 1.0).max() < TABLE


def test_longer_waves_than_the_table_holds_end_at_a_body_that_rides_on_the_water() -> None:
    ship = plank()
    omega = np.array([0.1 / 3.0, 0.01, 1e-4])
    exact = plank_motions(omega, BETA)
    k = wavenumber(omega)
    assert np.abs(ship.at(omega, BETA)[:3] - exact[:3]).max() < HALF
    assert np.abs((ship.at(omega, BETA)[3:] - exact[3:]) / k).max() < HALF


def test_the_table_goes_over_into_longer_waves_without_a_step() -> None:
    ship = plank()
    below, above = ship.at([0.1 - 1e-9], BETA), ship.at([0.1 + 1e-9], BETA)
    assert np.abs(below - above).max() < 1e-6  # slopes times 2e-9


def test_shorter_waves_than_the_table_holds_move_nothing() -> None:
    assert (plank().at([2.2001, 5.0], 1.0) == 0.0).all()


def test_a_point_of_the_ship_moves_as_heave_roll_and_pitch_say() -> None:
    ship = plank()
    x, y = -20.0, -18.0
    H = ship.at(OMEGA, 0.7)
    assert np.abs(ship.vertical(OMEGA, 0.7, x, y) - (H[2] + y * H[3] - x * H[4])).max() < TABLE


def test_in_long_waves_every_point_follows_the_water_that_is_there() -> None:
    ship = plank()
    omega = np.array([0.15])
    k = wavenumber(omega)
    for beta in np.radians([0.0, 40.0, 90.0, 180.0, 270.0]):
        for x, y in ((25.0, 0.0), (0.0, 7.0), (-20.0, -7.0)):
            surface = np.exp(-1j * k * (x * np.cos(beta) + y * np.sin(beta)))
            assert abs(ship.vertical(omega, beta, x, y) - surface)[0] < 2e-3  # (k L)^2/24 at 15 k L


def test_mirrored_points_in_mirrored_seas_move_alike() -> None:
    ship = plank()
    one, other = ship.vertical(OMEGA, 1.1, -20.0, -9.0), ship.vertical(OMEGA, -1.1, -20.0, 9.0)
    assert np.abs(one - other).max() < TABLE


def test_many_headings_and_one_give_the_same() -> None:
    ship = plank()
    many = ship.vertical(OMEGA, [0.2, 1.0, 4.0], 3.0, 4.0)
    assert many.shape == (3, len(OMEGA))
    assert np.abs(many[1] - ship.vertical(OMEGA, 1.0, 3.0, 4.0)).max() < TABLE
    assert ship.at(OMEGA, 1.0).shape == (6, len(OMEGA))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"omega": OMEGA[::-1]}, "frequencies must be above 0 and ascend"),
        ({"omega": OMEGA - OMEGA[0]}, "frequencies must be above 0 and ascend"),
        ({"beta": BETA[::-1]}, "headings must ascend from 0 up to below 360 deg"),
        ({"beta": BETA + 0.2}, "headings must ascend from 0 up to below 360 deg"),
        ({"H": plank().H[:5]}, "transfer functions of shape (5, 36, 43) for 43 frequencies and 36 headings"),
        ({"H": np.where(np.arange(43) == 3, np.nan, plank().H)}, "is not a finite number"),
        ({"depth": -5.0}, "depth -5 m is not above 0"),
    ],
)
def test_arrays_that_are_no_table_are_refused(change: dict, text: str) -> None:
    fields = {"name": "plank", "omega": OMEGA, "beta": BETA, "H": plank().H} | change
    with pytest.raises(SeaError) as caught:
        Rao(**fields)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_heading_that_is_no_number_is_refused() -> None:
    with pytest.raises(SeaError, match="is not a number"):
        plank().at(OMEGA, float("nan"))


def test_a_vessel_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        plank().H[0, 0, 0] = 1.0


def test_a_finer_table_leaves_less_open_between_its_frequencies() -> None:
    open_by = [plank(np.linspace(0.1, 2.2, n)).leeway(-20.0, -8.0) for n in (15, 29, 57)]
    assert open_by[0] > 3.0 * open_by[1] > 9.0 * open_by[2]  # second order in the spacing: 4 times each
