"""Output of AQWA-LINE (.lis): known vessels come back from its tables; what is not read is refused."""

from pathlib import Path

import numpy as np
import pytest
from tests.sea.other_programs import aqwa_text, refused, written
from tests.sea.plank import plank_motions

from stillhook.errors import SeaError
from stillhook.formats.vessel.open import read_untested, read_vessel

OMEGA, ROUND = np.linspace(0.1, 1.5, 8), np.arange(-180.0, 181.0, 30.0)
FOUR_DECIMALS = 1.5e-4  # m/m: half of a digit of an amplitude, and of one of a phase times it


def text(degrees: np.ndarray = ROUND, **how: int) -> str:
    return aqwa_text(OMEGA, degrees, plank_motions(OMEGA, np.radians(degrees)), **how)


@pytest.mark.parametrize("page", [0, 1])
@pytest.mark.parametrize("degrees", [ROUND, np.arange(0.0, 181.0, 30.0), np.arange(-180.0, 1.0, 30.0)])
def test_the_plank_comes_back_from_one_side_and_all_round(tmp_path: Path, degrees: np.ndarray, page: int) -> None:
    ship = read_vessel(written(tmp_path / "plank.lis", text(degrees, page=page)))
    assert len(ship.beta) == 12
    assert np.abs(ship.omega / OMEGA - 1.0).max() < 5e-4  # three decimals of the frequency, or two of the period
    assert np.abs(ship.H - plank_motions(OMEGA, ship.beta)).max() < FOUR_DECIMALS
    assert "X = 1.0000 m, Y = 0.0000 m, Z = -2.0000 m" in ship.origin
    assert ship.depth == 1000.0


def test_one_structure_of_several_is_stated(tmp_path: Path) -> None:
    written(tmp_path / "two.lis", text() + text(structure=2))
    assert 'holds structures 1, 2. Write a vessel description (TOML) with motions = "two.lis", body = 1' in refused(
        tmp_path / "two.lis"
    )
    assert read_vessel(written(tmp_path / "a.toml", 'motions = "two.lis"\nbody = 2\n')).name == "two, structure 2"
    assert "body = 3 is stated" in refused(written(tmp_path / "b.toml", 'motions = "two.lis"\nbody = 3\n'))


def test_a_later_pass_counts_and_is_said(tmp_path: Path) -> None:
    first = aqwa_text(OMEGA, ROUND, 0.9 * plank_motions(OMEGA, np.radians(ROUND)))
    ship = read_vessel(written(tmp_path / "plank.lis", first + text()))
    assert np.abs(ship.H - plank_motions(OMEGA, ship.beta)).max() < FOUR_DECIMALS
    assert any("motions are given twice: the last count" in note for note in ship.notes)


def test_what_is_not_read_ends_in_one_line(tmp_path: Path) -> None:
    whole = text()
    lines = whole.splitlines()

    def line(content: str) -> str:
        return refused(written(tmp_path / "plank.lis", content))

    assert "gravity is 32.174, and metres are read" in line(whole.replace("9.807", "32.174"))
    assert "holds no table of motions" in line(whole.replace("R.A.O.S-VARIATION", "FORCES-VARIATION"))
    assert "forward speed of 5.0" in line(whole + " FORWARD SPEED . . = 5.0\n")
    row = next(i for i, content in enumerate(lines) if content.startswith("   62.83"))
    cut = "\n".join([*lines[:row], lines[row][:70], *lines[row + 1 :]])
    assert f"line {row + 1}: " in line(cut)
    assert "all finite" in line("\n".join([*lines[:row], lines[row][:-7] + "    NaN", *lines[row + 1 :]]))
    assert "all finite" in line("\n".join([*lines[:row], lines[row][:-8] + "********", *lines[row + 1 :]]))
    assert "is missing: every heading has every frequency" in line("\n".join([*lines[: row + 1], *lines[row + 2 :]]))
    assert "ends in a table of motions: the file is cut off" in line("\n".join(lines[: row + 3]))
    block = next(i for i, content in enumerate(lines) if content.startswith("   62.83") and "-150.00" in content)
    assert "the line that begins its block is lost" in line("\n".join([*lines[:block], *lines[block + 1 :]]))
    assert "period 62.83 s is not that of 0.3 rad/s" in line(whole.replace("   62.83   0.100", "   62.83   0.300"))
    assert "It would fit with time the other way" in line(
        aqwa_text(OMEGA, ROUND, np.conj(plank_motions(OMEGA, np.radians(ROUND))))
    )


def test_a_file_that_is_cut_off_anywhere_ends_in_one_line_or_a_vessel(tmp_path: Path) -> None:
    whole = text()
    ends = range(100, len(whole), 977)
    outcomes = [outcome(written(tmp_path / "plank.lis", whole[:end])) for end in ends]
    assert not any("\n" in line for line in outcomes)
    assert sum(line != "" for line in outcomes) > 5


def outcome(path: Path) -> str:
    """The line in which a file is refused; empty where it is read."""
    try:
        read_untested(path)
    except SeaError as e:
        return str(e)
    return ""
