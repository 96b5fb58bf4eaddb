"""Vessels as CSV with declared conventions: the same ship in every convention is the same ship; what is not declared or does not fit is refused."""

import gzip
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tests.sea.other_programs import refused
from tests.sea.plank import plank

from stillhook.errors import SeaError
from stillhook.formats.vessel.csv import write_rao_csv
from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.vessel.rao import DOFS, Rao

OMEGA, BETA = np.linspace(0.1, 1.5, 8), np.radians(np.arange(0.0, 360.0, 30.0))
DIGITS = 1e-5  # six digits of numbers up to 1
SHIP = plank(OMEGA, BETA)


def head(**changes: str | None) -> list[str]:
    said = {
        "name": "plank",
        "axes": "x forward, y port, z up",
        "time": "exp(+i omega t)",
        "heading": "waves travel to, counter-clockwise from bow",
        "mirror": "none",
        "origin": "middle",
    }
    return [f"# {key}: {value}" for key, value in (said | changes).items() if value is not None]


def columns(rotation: str = "rad", *, polar: bool = False, angle: str = "deg") -> list[str]:
    units = ["m/m"] * 3 + [f"{rotation}/m"] * 3
    if polar:
        return [
            c for dof, u in zip(DOFS, units, strict=True) for c in (f"{dof} amplitude [{u}]", f"{dof} phase [{angle}]")
        ]
    return [f"{dof} {part} [{u}]" for dof, u in zip(DOFS, units, strict=True) for part in ("re", "im")]


def table(ship: Rao = SHIP) -> list[list[float]]:
    """Rows of omega, heading [deg], then real and imaginary parts."""
    return [
        [w, np.degrees(b), *np.column_stack([ship.H[:, j, k].real, ship.H[:, j, k].imag]).ravel()]
        for (j, b), (k, w) in product(enumerate(ship.beta), enumerate(ship.omega))
    ]


def written(folder: Path, head: list[str], columns: list[str], rows: list[list[float]], separator: str = ",") -> Path:
    path = folder / "vessel.csv"
    lines = [
        *head,
        separator.join(["omega [rad/s]", "heading [deg]", *columns]),
        *(separator.join(f"{v:.12g}" for v in row) for row in rows),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def assert_same(ship: Rao, tolerance: float = DIGITS) -> None:
    assert np.allclose(ship.omega, OMEGA, rtol=1e-5)
    assert np.allclose(ship.beta, BETA, atol=1e-9)
    assert np.abs(ship.H - SHIP.H).max() < tolerance


def test_a_vessel_comes_back_from_the_file_it_was_written_to(tmp_path: Path) -> None:
    ship = read_vessel(write_rao_csv(SHIP, tmp_path / "a.csv", source="closed form"))
    assert np.array_equal(ship.H, SHIP.H)
    assert (ship.name, ship.origin) == ("plank", "middle")
    assert "closed form" in ship.source


@pytest.mark.parametrize(
    ("axes", "signs"),
    [
        ("x forward, y port, z up", (1, 1, 1)),
        ("x aft, y starboard, z up", (-1, -1, 1)),
        ("x forward, y starboard, z down", (1, -1, -1)),
        ("x aft, y port, z down", (-1, 1, -1)),
    ],
)
@pytest.mark.parametrize("time", ["exp(+i omega t)", "exp(-i omega t)"])
def test_axes_and_time_may_go_either_way(tmp_path: Path, axes: str, signs: tuple[int, int, int], time: str) -> None:
    H = np.array(signs * 2)[:, None, None] * SHIP.H
    rows = table(Rao("other", OMEGA, BETA, np.conj(H) if "-" in time else H))
    assert_same(read_vessel(written(tmp_path, head(axes=axes, time=time), columns(), rows)))


@pytest.mark.parametrize(
    ("heading", "degrees"),
    [
        ("waves travel to, counter-clockwise from bow", lambda b: b),
        ("waves travel to, clockwise from bow", lambda b: -b),
        ("waves come from, counter-clockwise from the bow", lambda b: b - 180.0),
        ("waves coming from, clockwise from bow", lambda b: 180.0 - b),
        ("waves come from, counter-clockwise from stern", lambda b: b),
    ],
)
def test_headings_may_be_counted_in_every_way(tmp_path: Path, heading: str, degrees) -> None:
    rows = [[w, degrees(b), *rest] for w, b, *rest in table()]
    assert_same(read_vessel(written(tmp_path, head(heading=heading), columns(), rows)))


@pytest.mark.parametrize(("phase", "sign"), [("lead", 1.0), ("lag", -1.0)])
@pytest.mark.parametrize(("rotation", "scale"), [("rad", 1.0), ("deg", 180.0 / np.pi)])
@pytest.mark.parametrize(("angle", "unit"), [("deg", 180.0 / np.pi), ("rad", 1.0)])
def test_amplitudes_and_phases_are_read_in_every_unit(
    tmp_path: Path, phase: str, sign: float, rotation: str, scale: float, angle: str, unit: float
) -> None:
    scales = np.array([1.0] * 3 + [scale] * 3)
    rows = []
    for w, b, *rest in table():
        H = np.array(rest[::2]) + 1j * np.array(rest[1::2])
        rows.append([w, b, *np.column_stack([scales * np.abs(H), sign * unit * np.angle(H)]).ravel()])
    path = written(tmp_path, head(time=None, phase=phase), columns(rotation, polar=True, angle=angle), rows)
    assert_same(read_vessel(path))


@pytest.mark.parametrize(
    ("column", "of"), [("period [s]", lambda w: 2 * np.pi / w), ("frequency [Hz]", lambda w: w / (2 * np.pi))]
)
def test_waves_may_be_given_by_period_or_frequency_in_any_order_of_rows(tmp_path: Path, column: str, of) -> None:
    rows = [[of(w), *rest] for w, *rest in table()]
    path = written(tmp_path, head(), columns(), [rows[i] for i in np.random.default_rng(1).permutation(len(rows))], ";")
    path.write_text(path.read_text().replace("omega [rad/s]", column))
    assert_same(read_vessel(path))


def test_a_table_that_names_its_first_heading_again_after_a_turn_is_read(tmp_path: Path) -> None:
    rows = table()
    again = [[w, 360.0, *rest] for w, b, *rest in rows if b == 0.0]
    assert_same(read_vessel(written(tmp_path, head(), columns(), rows + again)))


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"axes": None}, "does not state its axes"),
        ({"origin": None, "mirror": None}, "does not state its mirror, origin"),
        ({"axes": "x forward, y starboard, z up"}, "are left-handed"),
        ({"axes": "x ahead, y port, z up"}, "line 2: axes"),
        ({"time": None}, 'need one line such as "# time: exp(+i omega t)"'),
        ({"phase": "lag"}, "and none of phase"),
        ({"time": "exp(i w t)"}, "Allowed: exp(+i omega t), exp(i omega t), exp(-i omega t)"),
        ({"heading": "from bow"}, "line 4: heading"),
        ({"heading": "waves travel from, clockwise from bow"}, "line 4: heading"),
        ({"mirror": "both"}, "Allowed: port-starboard, none"),
        ({"mirror": "port-starboard"}, "has headings on both"),
        (
            {"headings": "travel to"},
            "headings: unknown key. Allowed: name, axes, time, phase, heading, mirror, origin, depth, source, note; did you",
        ),
        ({"name": ""}, "line 1: name: nothing is stated"),
        ({"depth": "80"}, 'vessel.csv: depth = "80": no unit'),
        ({"depth": "0 m"}, "depth 0 m is not above 0"),
        ({"time": "exp(-i omega t)"}, "It would fit with time the other way"),
        ({"heading": "waves travel to, clockwise from bow"}, "It would fit with headings that turn the other way"),
    ],
)
def test_a_head_that_does_not_declare_or_does_not_fit_is_refused(tmp_path: Path, changes: dict, text: str) -> None:
    assert text in refused(written(tmp_path, head(**changes), columns(), table()))


def test_rotations_in_mixed_units_are_refused(tmp_path: Path) -> None:
    mixed = [c.replace("rad/m", "deg/m") if c.startswith("roll") else c for c in columns()]
    assert "rotations in deg/m and rad/m" in refused(written(tmp_path, head(), mixed, table()))


def test_degrees_that_are_said_to_be_radians_are_refused(tmp_path: Path) -> None:
    rows = [[*row[:8], *(57.3 * v for v in row[8:])] for row in table()]
    assert "rotations in deg/m that are declared as rad/m" in refused(written(tmp_path, head(), columns(), rows))


def test_a_missing_motion_is_named(tmp_path: Path) -> None:
    names = columns()
    rows = [row[:2] + row[2:10] + row[12:] for row in table()]
    assert 'has no column "pitch re [rad/m]"' in refused(written(tmp_path, head(), names[:8] + names[10:], rows))


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda rows: rows[:-1], "is missing: every heading has every frequency"),
        (lambda rows: [*rows, rows[3]], "is given twice"),
        (lambda rows: [[*rows[0][:-1], float("nan")], *rows[1:]], '"nan" is not a finite number'),
        (lambda rows: [[-w, *rest] for w, *rest in rows], "must be above 0"),
        (lambda rows: [r for r in rows if r[1] < 200.0], "no heading within"),
        (lambda rows: rows[:0], "has a header (line 7) and no data below it"),
        (lambda rows: [rows[0][:-1], *rows[1:]], "13 fields where the header has 14"),
    ],
)
def test_rows_that_are_no_table_are_refused(tmp_path: Path, spoil, text: str) -> None:
    assert text in refused(written(tmp_path, head(), columns(), spoil(table())))


def test_a_word_among_the_numbers_is_named_with_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, head(), columns(), table())
    lines = path.read_text().splitlines()
    lines[9] = lines[9].replace(lines[9].split(",")[3], "n/a", 1)
    path.write_text("\n".join(lines))
    assert 'line 10: surge im [m/m] = "n/a" is not a finite number' in refused(path)


def test_a_later_version_of_the_form_is_refused(tmp_path: Path) -> None:
    assert 'line 1: version "2", 1 is read' in refused(
        written(tmp_path, ["# stillhook vessel motions 2", *head()], columns(), table())
    )


def test_a_ship_that_rolls_in_head_sea_is_no_half_of_a_symmetric_one(tmp_path: Path) -> None:
    rows = [[*row[:8], row[8] + 0.01, *row[9:]] for row in table() if row[1] <= 180.0]
    assert "roll in head or following sea reaches" in refused(
        written(tmp_path, head(mirror="port-starboard"), columns(), rows)
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("a.txt", b"hello\n", "is not a known vessel file. Supported: ShipX/VERES .re1"),
        ("a.nc", b"\x89HDF\r\n\x1a\n" + bytes(200), "not a complete NetCDF file"),
        ("a.yml", b"VesselTypes: [", "is not YAML"),
        ("a.bin", bytes(range(256)), "is not a text file. Supported:"),
        ("a.csv", b"", "is empty. Supported:"),
    ],
)
def test_files_of_another_kind_are_told_in_one_line(tmp_path: Path, name: str, content: bytes, text: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SeaError) as caught:
        read_vessel(tmp_path / name)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_name_that_is_neither_file_nor_vessel_of_the_library_is_told(tmp_path: Path) -> None:
    with pytest.raises(SeaError, match="no such vessel file, and no vessel of the library, which has"):
        read_vessel("no-such-ship")
    with pytest.raises(SeaError, match="is a folder"):
        read_vessel(tmp_path)


def test_a_compressed_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.re1").write_bytes(gzip.compress(b"MOTION TRANSFER FUNCTIONS"))
    with pytest.raises(SeaError, match="is a gzip file"):
        read_vessel(tmp_path / "a.re1")
