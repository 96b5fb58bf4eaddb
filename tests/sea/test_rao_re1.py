"""ShipX/VERES files: a plank written in VERES axes comes back, and every damage ends in one line that names its place."""

from pathlib import Path

import numpy as np
import pytest
from tests.sea import other_programs
from tests.sea.plank import plank_motions

from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.vessel.rao import DOFS

OMEGA, HEADINGS = np.linspace(0.1, 1.5, 8), np.arange(0.0, 181.0, 30.0)
TITLE = [
    " MOTION TRANSFER FUNCTIONS  - VERES Version  4.02.3",
    " Run name:",
    " Ship name: Plank",
    " Loading:",
    "",
    " ShipX exported data",
]
DIGITS = 1e-7  # nine digits in the file


def lines(*, headings=HEADINGS, omega=OMEGA, dofs=6, speeds=(0.0,), reference=(5.0, 4.0)) -> list[str]:
    """A file of the plank: x aft, y starboard, so that VERES's heading is the direction of travel in these axes."""
    H = plank_motions(omega, np.radians(headings))  # half a turn about z: the same formulas hold in VERES's own axes
    text = [
        *TITLE,
        " 0.1025E+04 0.981E+01",
        " 60.0 16.0 4.0",
        " 5.0 6.0",
        f" {len(speeds)} {len(headings)} {len(omega)} {dofs}",
    ]
    for speed in speeds:
        text.append(f" {speed} 0.0 0.0 {reference[0]} {reference[1]}")
        for j, heading in enumerate(headings):
            text.append(f" {heading:.2f}")
            for k, w in enumerate(omega):
                text.append(f" {w:.7f}")
                text += [f" {d + 1} {H[d, j, k].real:.9E} {H[d, j, k].imag:.9E}" for d in range(dofs)]
    return text


def written(folder: Path, text: list[str]) -> Path:
    path = folder / "plank.re1"
    path.write_text("\n".join(text) + "\n")
    return path


def test_a_plank_in_veres_axes_comes_back_in_ours(tmp_path: Path) -> None:
    ship = read_vessel(written(tmp_path, lines()))
    assert ship.name == "Plank"
    assert np.allclose(np.degrees(ship.beta), np.arange(0.0, 360.0, 30.0))
    assert np.abs(ship.H - plank_motions(ship.omega, ship.beta)).max() < DIGITS


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        ((5.0, 4.0), "5 m aft of Lpp/2, centreline, 4 m above the keel (in the still waterline)"),
        ((-2.5, 6.0), "2.5 m forward of Lpp/2, centreline, 6 m above the keel (2 m above the still waterline)"),
        ((0.0, 1.0), "0 m aft of Lpp/2, centreline, 1 m above the keel (3 m below the still waterline)"),
    ],
)
def test_the_reference_point_is_told(tmp_path: Path, reference: tuple[float, float], words: str) -> None:
    assert read_vessel(written(tmp_path, lines(reference=reference))).origin == words


def test_of_several_speeds_standstill_is_read(tmp_path: Path) -> None:
    ship = read_vessel(written(tmp_path, lines(speeds=(2.5, 0.0, 5.0))))
    assert np.abs(ship.H - plank_motions(ship.omega, ship.beta)).max() < DIGITS


def test_a_file_with_headings_all_round_is_read_without_a_mirror(tmp_path: Path) -> None:
    ship = read_vessel(written(tmp_path, lines(headings=np.arange(0.0, 360.0, 30.0))))
    assert np.abs(ship.H - plank_motions(ship.omega, ship.beta)).max() < DIGITS
    assert not any("mirrored" in note for note in ship.notes)


def refused(folder: Path, text: list[str]) -> str:
    return other_programs.refused(written(folder, text))


@pytest.mark.parametrize("length", [1, 6, *range(7, len(lines()), 41)])
def test_a_file_that_is_cut_off_anywhere_is_refused(tmp_path: Path, length: int) -> None:
    assert "the file is cut off" in refused(tmp_path, lines()[:length])


def test_a_file_that_is_cut_off_within_a_line_is_refused(tmp_path: Path) -> None:
    text = lines()
    assert "real and imaginary part should be (3 numbers)" in refused(tmp_path, [*text[:-1], text[-1][:12]])


def test_missing_degrees_of_freedom_are_told(tmp_path: Path) -> None:
    assert f"line 10: 5 degrees of freedom, six are needed ({', '.join(DOFS)})" in refused(tmp_path, lines(dofs=5))
    text = lines()
    assert "degree of freedom 4 where 3 (heave) should be" in refused(tmp_path, text[:15] + text[16:])


def test_headings_out_of_order_are_told(tmp_path: Path) -> None:
    assert "heading 30 deg after 60 deg: headings must ascend" in refused(
        tmp_path, lines(headings=HEADINGS[[0, 2, 1, 3, 4, 5, 6]])
    )
    assert "headings must ascend" in refused(tmp_path, lines(headings=HEADINGS[::-1]))


def test_headings_whose_names_changed_places_are_found_by_their_motions(tmp_path: Path) -> None:
    text = lines()
    places = {f" {h:.2f}": i for i, line in enumerate(text) for h in HEADINGS if line == f" {h:.2f}"}
    start, step = places[" 30.00"], places[" 60.00"] - places[" 30.00"]
    block = text[start + 1 : start + step]
    text[start + 1 : start + step], text[start + step + 1 : start + 2 * step] = (
        text[start + step + 1 : start + 2 * step],
        block,
    )
    assert "headings are out of order" in refused(tmp_path, text)


def test_headings_from_the_other_end_are_found_by_their_motions(tmp_path: Path) -> None:
    turned = lines(headings=HEADINGS[::-1])
    marks = [i for i, line in enumerate(turned) if line in {f" {h:.2f}" for h in HEADINGS}]
    for i, h in zip(marks, HEADINGS, strict=True):
        turned[i] = f" {h:.2f}"
    assert "no floating body moves so" in refused(tmp_path, turned)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (" 0.3000000", " 0.0500000", "frequency 0.05 rad/s: every heading has the same, ascending"),
        (" 0.3000000", " zero", "is not frequency 2 of 8"),
        (" 1 7 8 6", " 1 7 8", "numbers of speeds, headings, frequencies and degrees of freedom should be (4 numbers)"),
        (" 1 7 8 6", " 1 -7 8 6", "1, -7, 8, 6 are not counts of a table"),
        (" 1 7 8 6", " 1 99999 99999 6", "are not counts of a table"),
        (" 1 7 8 6", " 1 6 8 6", "continues after its 6 headings"),
        (" 60.0 16.0 4.0", " 60.0 16.0", "Lpp, breadth and draught should be (3 numbers)"),
        (" 0.0 0.0 0.0 5.0 4.0", " 3.0 0.0 0.0 5.0 4.0", "holds no zero speed, only up to 3 m/s"),
        (TITLE[0], " EXCITATION FORCE TRANSFER FUNCTIONS", "not the motions. Give the .re1"),
    ],
)
def test_damaged_lines_are_named(tmp_path: Path, old: str, new: str, text: str) -> None:
    damaged = lines()
    damaged[damaged.index(old)] = new
    assert text in refused(tmp_path, damaged)


@pytest.mark.parametrize("word", ["NaN", "Infinity", "********"])
def test_fill_values_are_named_with_their_line(tmp_path: Path, word: str) -> None:
    damaged = lines()
    place = next(i for i, line in enumerate(damaged) if line.startswith(" 3 "))
    damaged[place] = f" 3 {word} 0.0"
    assert f"line {place + 1}" in refused(tmp_path, damaged)


def test_a_file_in_degrees_is_refused(tmp_path: Path) -> None:
    damaged = [
        " ".join([f[0], *(f"{57.29578 * float(v):.9E}" for v in f[1:])])
        if len(f := line.split()) == 3 and f[0] in "456"
        else line
        for line in lines()
    ]
    assert "rotations in deg/m that are declared as rad/m" in refused(tmp_path, damaged)
