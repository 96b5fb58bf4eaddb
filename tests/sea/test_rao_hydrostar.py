"""HydroStar's files of motions (.rao): six of a folder are one vessel; what is not read is refused."""

from pathlib import Path

import numpy as np
import pytest
from tests.sea.other_programs import hydrostar_texts, refused, written
from tests.sea.plank import plank_motions

from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.vessel.rao import wavenumber

OMEGA, ROUND = np.linspace(0.1, 1.5, 8), np.arange(0.0, 360.0, 30.0)
SIX_DIGITS = 5e-6  # m/m: phases have four decimals of a degree


def files(folder: Path, degrees: np.ndarray = ROUND, **how: object) -> list[Path]:
    H = plank_motions(OMEGA, np.radians(degrees))
    texts = hydrostar_texts(OMEGA, degrees, H, **how)  # type: ignore[arg-type]
    return [written(folder / f"Motion_{d + 1}.rao", text) for d, text in enumerate(texts)]


@pytest.mark.parametrize("degrees", [ROUND, np.arange(0.0, 181.0, 30.0), np.arange(180.0, 361.0, 30.0)])
def test_any_of_the_six_files_is_the_vessel(tmp_path: Path, degrees: np.ndarray) -> None:
    paths = files(tmp_path, degrees)
    for path in (paths[0], paths[4]):
        ship = read_vessel(path)
        assert len(ship.beta) == 12
        assert np.abs(ship.H - plank_motions(OMEGA, ship.beta)).max() < SIX_DIGITS
        assert ship.name == tmp_path.name


def test_phases_are_moved_to_the_reference_point(tmp_path: Path) -> None:
    ship = read_vessel(files(tmp_path, point=(10.0, 0.0, -1.0), wave=(-5.0, 0.0))[0])
    moved = plank_motions(OMEGA, ship.beta) * np.exp(1j * wavenumber(OMEGA) * 15.0 * np.cos(ship.beta)[:, None])
    assert np.abs(ship.H - moved).max() < 5.0 * SIX_DIGITS
    assert "x = 10 m, y = 0 m, z = -1 m" in ship.origin


def test_components_11_to_66_and_the_ends_of_the_scale_are_read(tmp_path: Path) -> None:
    for d, path in enumerate(files(tmp_path)):
        lines = path.read_text().replace(f":  {d + 1}\n", f":  {d + 1}{d + 1}\n").splitlines()
        at = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        ends = ["  0.0000" + " 0.0" * 24, " -1.0000" + " NaN" * 24]
        written(path, "\n".join([*lines[:at], *ends, *lines[at:]]) + "\n")
    assert len(read_vessel(tmp_path / "Motion_1.rao").omega) == 8


def test_what_is_not_read_ends_in_one_line(tmp_path: Path) -> None:
    paths = files(tmp_path)
    whole = paths[2].read_text()

    def line(content: str) -> str:
        return refused(written(paths[2], content))

    assert "RAOTYPE" in line(whole.replace(":  Motion", ":  Excitation"))
    assert "COMPONENT 7 is not a motion" in line(whole.replace("COMPONENT  :  3", "COMPONENT  :  7"))
    assert "yaw is in " in line(whole.replace("COMPONENT  :  3", "COMPONENT  :  6").replace("m/m", "deg/m"))
    assert 'UNIT "deg/m" of heave, m/m is read' in line(whole.replace("m/m", "deg/m"))
    assert "numbers, 25 are needed" in line(
        whole.replace("\n#------", " 1.0\n#------").replace("AMP/PHASE 1.0", "AMP/PHASE")
    )
    assert "does not state HEADING" in line(whole.replace("#HEADING", "#HEADS"))
    assert 'does not state "Ref.pt incident wave"' in line(whole.replace("Ref.pt incident", "Ref of"))
    assert "has other frequencies or headings" in line(whole.replace("  0.1000", "  0.1100"))
    assert "has another depth, speed or point" in line(whole.replace("Inf.", "90.0"))
    first = next(row for row in whole.splitlines() if not row.startswith("#"))
    for word in (" NaN ", " one "):
        assert "is not finite numbers" in line(whole.replace(first, first[:8] + word + first[22:]))
    paths[2].unlink()
    assert "heave is missing: no other .rao file of its folder holds it" in refused(paths[0])
    files(tmp_path, speed=5.0)
    assert "is for 5 m/s forward" in refused(paths[0])


def test_phases_that_lag_are_found(tmp_path: Path) -> None:
    H = np.conj(plank_motions(OMEGA, np.radians(ROUND)))
    for d, text in enumerate(hydrostar_texts(OMEGA, ROUND, H)):
        written(tmp_path / f"{d}.rao", text)
    assert "It would fit with time the other way" in refused(tmp_path / "0.rao")
