"""WAMIT's numeric output of motions (.4): known vessels come back from it; a wrong length scale or column is refused."""

from pathlib import Path

import numpy as np
import pytest
from tests.sea.other_programs import refused, wamit_text, written
from tests.sea.plank import plank_motions

from stillhook.cli import run
from stillhook.errors import SeaError
from stillhook.formats.vessel.open import read_vessel

OMEGA, SIDE = np.linspace(0.1, 1.5, 8), np.arange(0.0, 181.0, 30.0)
ROUND = np.arange(0.0, 360.0, 30.0)
SIX_DIGITS = 1e-6  # of numbers up to 1 m/m


def motions(degrees: np.ndarray = SIDE) -> np.ndarray:
    return plank_motions(OMEGA, np.radians(degrees))


def described(folder: Path, text: str, *lines: str) -> Path:
    written(folder / "plank.4", text)
    return written(folder / "plank.toml", "\n".join(('motions = "plank.4"', *lines)) + "\n")


def assert_plank(path: Path) -> None:
    ship = read_vessel(path)
    assert len(ship.beta) == 12
    assert np.abs(ship.omega / OMEGA - 1.0).max() < SIX_DIGITS
    assert np.abs(ship.H - plank_motions(ship.omega, ship.beta)).max() < SIX_DIGITS


@pytest.mark.parametrize("degrees", [SIDE, ROUND, SIDE[::-1], ROUND - 180.0])
def test_the_plank_comes_back_from_one_side_and_all_round(tmp_path: Path, degrees: np.ndarray) -> None:
    path = written(tmp_path / "plank.4", wamit_text(OMEGA, degrees, motions(degrees)))
    assert_plank(path)
    assert any("length scale 1 m, deep water (not in the file)" in note for note in read_vessel(path).notes)


def test_rotations_are_over_the_stated_length_scale(tmp_path: Path) -> None:
    text = wamit_text(OMEGA, SIDE, motions(), L=60.0)
    assert_plank(described(tmp_path, text, 'length_scale = "60 m"'))
    with pytest.raises(SeaError, match="no floating body moves so"):
        read_vessel(tmp_path / "plank.4")


def test_a_second_body_is_read_where_it_is_stated(tmp_path: Path) -> None:
    two = wamit_text(OMEGA, SIDE, motions()) + wamit_text(OMEGA, SIDE, 0.0 * motions(), body=2)
    assert_plank(described(tmp_path, two, "body = 1"))
    assert "holds bodies 1, 2. Write a vessel description" in refused(tmp_path / "plank.4")
    described(tmp_path, two, "body = 3")
    assert "holds bodies 1, 2, and body = 3 is stated" in refused(tmp_path / "plank.toml")


def test_depth_is_stated_beside_the_file(tmp_path: Path) -> None:
    assert read_vessel(described(tmp_path, wamit_text(OMEGA, SIDE, motions()), 'depth = "2 km"')).depth == 2000.0


def test_a_header_and_rows_in_any_order_are_read(tmp_path: Path) -> None:
    lines = wamit_text(OMEGA, SIDE, motions()).splitlines()
    head = " PERIOD  BETA  MODE  MOD  PHA  RE  IM"
    assert_plank(written(tmp_path / "plank.4", "\n".join((head, *reversed(lines)))))


def test_damaged_files_end_in_one_line(tmp_path: Path) -> None:
    text = wamit_text(OMEGA, SIDE, motions())
    lines = text.splitlines()

    def line(content: str) -> str:
        return refused(written(tmp_path / "plank.4", content))

    assert "mode 6 (yaw) is missing" in line("\n".join(lines[:-1]))
    assert f"line {len(lines)}: " in line("\n".join([*lines[:-1], lines[-1][:40]]))
    assert "is given twice" in line("\n".join([*lines, lines[0]]))
    assert "line 3: " in line(text.replace(lines[2][30:44], "           NaN", 1))
    assert "are not real part" in line("\n".join([lines[0][:62] + f"{0.5:14.6E}" + lines[0][76:], *lines[1:]]))
    assert "mode 2 (sway) is missing" in line("\n".join(l for l in lines if l.split()[2] != "2"))
    written(tmp_path / "plank.3", text)
    assert "holds exciting forces. Give the motions, plank.4" in refused(tmp_path / "plank.3")
    assert "It would fit with time the other way" in line(wamit_text(OMEGA, SIDE, np.conj(motions())))


@pytest.mark.slow
def test_frequencies_in_place_of_periods_do_not_pass_the_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [line.split() for line in wamit_text(OMEGA, SIDE, motions()).splitlines()]
    swapped = "\n".join(" ".join((f"{2.0 * np.pi / float(row[0]):.6E}", *row[1:])) for row in rows)
    assert run(["vessel", "--check", str(written(tmp_path / "plank.4", swapped)), "--verbose"]) == 1
    assert "too short" in capsys.readouterr().out
