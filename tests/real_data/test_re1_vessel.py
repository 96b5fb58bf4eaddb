"""The public ShipX file of an 82.8 m supply vessel: convention shown by its long waves, sides told apart."""

from pathlib import Path

import numpy as np
import pytest

from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.vessel.floating_body import long_wave_test
from stillhook.sea.vessel.rao import Rao, wavenumber

HEAD, FOLLOWING, FROM_STARBOARD, FROM_PORT = np.pi, 0.0, np.pi / 2.0, 3.0 * np.pi / 2.0
LONG = 0.02  # what a wave of 60 s leaves of its limit on a hull of 83 m
PITCH = 0.05  # strip theory's pitch in the same wave


@pytest.fixture(scope="module")
def supply(shared_data: Path) -> Rao:
    return read_vessel(shared_data / "vessel_mss_supply" / "input.re1")


def test_the_file_is_read_whole_and_says_where_its_reference_point_is(supply: Rao) -> None:
    assert supply.H.shape == (6, 36, 36)
    assert supply.origin == "5.38592 m aft of Lpp/2, centreline, 6 m above the keel (in the still waterline)"
    assert 2.0 * np.pi / supply.omega[[0, -1]] == pytest.approx([60.0, 2.0], rel=1e-5)


@pytest.mark.parametrize(("beta", "side"), [(HEAD, 1.0), (FOLLOWING, -1.0)])
def test_along_the_ship_it_goes_round_with_the_water_and_leans_with_the_slope(
    supply: Rao, beta: float, side: float
) -> None:
    surge, _, heave, _, pitch, _ = supply.at(supply.omega[:1], beta)[:, 0]
    k = wavenumber(supply.omega[:1])[0]
    assert abs(surge - side * 1j) < LONG
    assert abs(heave - 1.0) < LONG
    assert abs(pitch / k + side * 1j) < PITCH


@pytest.mark.parametrize(("beta", "side"), [(FROM_STARBOARD, 1.0), (FROM_PORT, -1.0)])
def test_across_the_ship_it_sways_with_the_water_and_rolls_to_the_side_of_the_slope(
    supply: Rao, beta: float, side: float
) -> None:
    _, sway, heave, roll, _, _ = supply.at(supply.omega[:1], beta)[:, 0]
    assert abs(sway + side * 1j) < LONG
    assert abs(heave - 1.0) < LONG
    assert (roll / (-side * 1j * wavenumber(supply.omega[:1])[0])).real == pytest.approx(
        1.62, abs=0.01
    )  # its own, not a floating plank's 1


def test_every_motion_rides_on_long_waves(supply: Rao) -> None:
    assert {t.verdict for t in long_wave_test(supply)} == {"fits"}


def test_phases_are_those_of_a_crest_at_the_reference_point_and_not_at_midship(supply: Rao) -> None:
    k = wavenumber(supply.omega[:3])
    for beta, side in ((HEAD, 1.0), (FOLLOWING, -1.0)):
        offset = np.angle(supply.at(supply.omega[:3], beta)[0] / (side * 1j)) / k * side
        assert np.abs(offset).max() < 1.5  # m; from midship it would be 5.4 m


def test_the_weather_side_moves_more_than_the_lee_side_in_beam_sea(supply: Rao) -> None:
    omega = 2.0 * np.pi / np.array([10.0, 12.0, 14.0])
    for beta, weather in ((FROM_STARBOARD, -18.0), (FROM_PORT, 18.0)):
        assert (
            np.abs(supply.vertical(omega, beta, -20.0, weather))
            > 3.0 * np.abs(supply.vertical(omega, beta, -20.0, -weather))
        ).all()


def test_a_file_cut_off_in_the_middle_is_told(shared_data: Path, tmp_path: Path) -> None:
    text = (shared_data / "vessel_mss_supply" / "input.re1").read_text()
    (tmp_path / "cut.re1").write_text(text[: len(text) // 2])
    with pytest.raises(
        Exception, match=r"cut\.re1: (ends after line \d+, where .* should follow: the file is cut off|line \d+)"
    ):
        read_vessel(tmp_path / "cut.re1")
