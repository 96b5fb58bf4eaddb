"""The long-wave test of vessels: what fits passes, every wrong convention is named, and what a table cannot show is not claimed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.sea.plank import BETA, plank

from stillhook.sea.vessel.floating_body import long_wave_test, remarks, verdict_of, wrong_line
from stillhook.sea.vessel.rao import Rao, long_wave_limits, long_wave_scales, wavenumber

OTHER_SIDE = np.array([1, -1, 1, -1, 1, -1])[:, None, None]
DEGREES = np.array([1, 1, 1, 180 / np.pi, 180 / np.pi, 180 / np.pi])[:, None, None]
Change = Callable[[np.ndarray], np.ndarray]


def refusal(change: Change) -> str | None:
    ship = plank()
    wrong = replace(ship, H=change(ship.H))
    return wrong_line(wrong, long_wave_test(wrong))


def test_a_plank_fits() -> None:
    ship = plank()
    tests = long_wave_test(ship)
    assert {t.verdict for t in tests} == {"fits"}
    assert all(abs(t.share - 1.0) < 0.01 for t in tests)  # (k L)^2/24 and less at 63 s
    assert wrong_line(ship, tests) is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (np.conj, "time the other way"),
        (lambda H: OTHER_SIDE * H, "headings that turn the other way, or y to the other side"),
        (lambda H: np.conj(OTHER_SIDE * H), "both time and the turn of headings the other way"),
        (lambda H: DEGREES * H, "rotations in deg/m that are declared as rad/m"),
        (lambda H: H / DEGREES, "rotations in rad/m that are declared as deg/m"),
        (lambda H: -H, "z the other way, or phases from the trough"),
        (lambda H: np.roll(H, 9, axis=1), "Check axes, signs, phases, units and the order of headings"),
        (lambda H: H[[0, 1, 2, 4, 3, 5]], "Check axes, signs, phases, units and the order of headings"),
        (lambda H: 1j * H, "Check axes, signs, phases, units and the order of headings"),
    ],
)
def test_a_wrong_convention_is_refused_with_what_would_make_it_right(change: Change, words: str) -> None:
    line = refusal(change)
    assert line is not None
    assert "no floating body moves so in waves of 62.8 s" in line
    assert words in line
    assert "\n" not in line


@pytest.mark.parametrize("first", [0, 5, 17, 35])
def test_two_neighbouring_headings_that_changed_places_are_found(first: int) -> None:
    places = np.arange(36)
    places[[first, (first + 1) % 36]] = places[[(first + 1) % 36, first]]
    line = refusal(lambda H: H[:, places])
    assert line is not None
    assert "headings are out of order" in line


@pytest.mark.parametrize("factor", [0.5, 2.0, 0.7, 10.0])
def test_a_table_whose_motions_are_out_by_one_factor_is_refused(factor: float) -> None:
    """All of 0.50 of the limit is a table per wave height; it was said to fit."""
    line = refusal(lambda H: factor * H)
    assert line is not None
    assert ("per metre of wave height" in line) is (factor == 0.5)
    assert ("per height" in line) is (factor == 2.0)


def changed(dof: int, change: Change) -> tuple[str, str]:
    ship = plank()
    H = ship.H.copy()
    H[dof] = change(H[dof])
    other = replace(ship, H=H)
    return verdict_of(other, long_wave_test(other))


def test_the_verdict_is_that_of_the_worst_motion() -> None:
    ship = plank()
    assert verdict_of(ship, long_wave_test(ship))[0] == "fits"
    word, line = changed(3, lambda H: 10.0 * H)
    assert word == "doubtful"
    assert "met by 5 of 6 motions; doubtful: roll reaches" in line
    word, line = changed(5, lambda H: -H)
    assert word == "doubtful"
    assert "yaw" in line


def test_a_heave_that_no_ship_has_is_named_in_a_table_without_long_waves() -> None:
    ship = plank()
    keep = ship.omega > 0.4
    H = ship.H[:, :, keep].copy()
    short = replace(ship, omega=ship.omega[keep], H=H)
    word, line = verdict_of(short, long_wave_test(short))
    assert word == "not shown"
    assert "Export waves of 18 s and more" in line
    H[2, 18, 0] = 8.6
    short = replace(short, H=H)
    word, line = verdict_of(short, long_wave_test(short))
    assert word == "doubtful"
    assert "heave reaches 8.6 m/m" in line
    assert "at 180 deg" in line
    assert any("heave reaches" in note for note in remarks(short, long_wave_test(short)))


def test_roll_that_is_twice_the_slope_passes_and_twenty_times_deserves_a_look() -> None:
    ship = plank()
    H = ship.H.copy()
    H[3] *= 2.0
    twice = replace(ship, H=H)
    assert long_wave_test(twice)[3].verdict == "fits"
    H[3] *= 10.0
    often = replace(ship, H=H)
    assert long_wave_test(often)[3].verdict == "doubtful"
    assert "roll of" in str(wrong_line(often, long_wave_test(often)))  # beyond any ship's in short waves


def test_roll_that_leans_into_every_wave_of_a_minute_is_wrong() -> None:
    line = refusal(lambda H: np.where(np.arange(6)[:, None, None] == 3, -H, H))
    assert line is not None
    assert "roll 1i (should be -1i)" in line


@pytest.mark.parametrize(("first", "words"), [(0.45, "is too short"), (0.7, "is too short")])
def test_a_table_without_long_waves_is_read_and_says_that_signs_are_not_shown(first: float, words: str) -> None:
    ship = plank(np.linspace(first, 2.0, 20))
    tests = long_wave_test(ship)
    assert wrong_line(ship, tests) is None
    assert any(words in line for line in remarks(ship, tests))


def test_waves_of_middle_length_still_show_the_sign_of_time() -> None:
    ship = plank(np.linspace(0.45, 2.0, 20))
    wrong = replace(ship, H=np.conj(ship.H))
    assert "time the other way" in str(wrong_line(wrong, long_wave_test(wrong)))


def test_what_a_table_still_holds_in_its_shortest_waves_is_said() -> None:
    ship = plank(np.linspace(0.1, 1.0, 19))
    assert any("shorter ones are taken to cause no motion" in line for line in remarks(ship, long_wave_test(ship)))
    still = replace(ship, H=ship.H * np.linspace(1.0, 0.0, 19))
    assert not any("shorter" in line for line in remarks(still, long_wave_test(still)))


def test_the_wavenumber_fulfils_the_dispersion_relation_at_any_depth() -> None:
    omega = np.array([0.05, 0.3, 1.0, 3.0])
    for depth in (5.0, 50.0, 500.0):
        k = wavenumber(omega, depth)
        assert np.allclose(9.80665 * k * np.tanh(k * depth), omega**2, rtol=1e-12)  # rounding
    assert np.allclose(wavenumber(omega, 1e5), omega**2 / 9.80665, rtol=1e-12)
    assert wavenumber(np.array([0.02]), 4.0)[0] == pytest.approx(
        0.02 / np.sqrt(9.80665 * 4.0), rel=1e-4
    )  # shallow: sqrt(g h)


def test_on_shallow_water_a_body_goes_further_to_and_fro_than_up_and_down() -> None:
    depth, omega = 30.0, np.linspace(0.1, 1.5, 20)
    H = long_wave_limits(BETA)[..., None] * long_wave_scales(omega, depth)[:, None]
    shallow = Rao("raft", omega, BETA, H, depth=depth)
    assert abs(shallow.H[0, 0, 0]) > 5.0  # coth kh at 63 s
    assert {t.verdict for t in long_wave_test(shallow)} == {"fits"}
    assert wrong_line(replace(shallow, depth=np.inf), long_wave_test(replace(shallow, depth=np.inf))) is not None
    assert (
        np.abs(
            shallow.at([0.05], BETA)
            - long_wave_limits(BETA)[..., None] * long_wave_scales(np.array([0.05]), depth)[:, None]
        ).max()
        < 1e-9
    )


def test_a_slip_of_the_point_in_one_number_is_told() -> None:
    ship = plank()
    H = ship.H.copy()
    H[2, 9, 6] *= 10.0
    slipped = replace(ship, H=H)
    assert any(
        "heave reaches 9." in line and "an error in the table" in line
        for line in remarks(slipped, long_wave_test(slipped))
    )
    assert not any("slip" in line for line in remarks(ship, long_wave_test(ship)))
