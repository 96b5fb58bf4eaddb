"""Supplier maps: every dialect reads the same, and bad data end in a clear line or a declared omission."""

from pathlib import Path

import numpy as np
import pytest
from tests.parquet import write_parquet
from trials.campaigns.motor_map import synthetic_map, write_map

from stillhook.errors import LogError, StillhookError, UnitError
from stillhook.identify.motor.fit import LossModel
from stillhook.identify.motor.map import LossMap, levels, mapped_loss, read_map
from stillhook.identify.motor.rank import compare_mapped
from stillhook.units import from_display

CC, RPM, BAR = (from_display(1.0, k) for k in ("displacement", "rotation", "pressure"))
CELLS = [
    (D, n, p, round(0.02 * D * p / 6.2832 / 10 + 5.0 + n / 200.0, 3))
    for D in (100, 200)
    for n in (500, 1500)
    for p in (100, 200, 300)
]
HEAD = ("D_m [cm^3/rev]", "n [rev/min]", "dp [bar]", "T_f [N m]")


def text(rows=CELLS, head=HEAD, separator=",", comma=False) -> str:
    lines = [separator.join(head), *(separator.join(f"{c}" for c in row) for row in rows)]
    body = "\n".join(lines[1:])
    return lines[0] + "\n" + (body.replace(".", ",") if comma else body) + "\n"


def read(tmp_path: Path, content: str | bytes, name: str = "map.csv", **options) -> LossMap:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_map(path, **options)


def refused(tmp_path: Path, content: str | bytes, name: str = "map.csv", **options) -> str:
    with pytest.raises(StillhookError) as e:
        read(tmp_path, content, name, **options)
    line = str(e.value)
    assert "\n" not in line
    assert len(line) < 400
    return line


def same(a: LossMap, b: LossMap) -> bool:
    return all(np.allclose(getattr(a, f), getattr(b, f), rtol=1e-9) for f in ("D_m", "omega_m", "dp_m", "T_f"))


@pytest.fixture
def plain(tmp_path: Path) -> LossMap:
    return read(tmp_path, text(), "plain.csv")


def test_a_plain_map_is_read_in_si(plain: LossMap):
    assert len(plain) == len(CELLS)
    assert plain.D_m.max() == pytest.approx(200 * CC)
    assert plain.omega_m.max() == pytest.approx(1500 * RPM)
    assert plain.dp_m.max() == pytest.approx(300 * BAR)
    assert plain.T_f == pytest.approx([c[3] for c in CELLS])
    assert plain.D_max == plain.D_m.max()
    assert not plain.synthetic


DIALECTS: dict[str, str | bytes] = {
    "semicolon": text(separator=";"),
    "tab": text(separator="\t"),
    "decimal comma": text(separator=";", comma=True),
    "tab, decimal comma": text(separator="\t", comma=True),
    "byte order mark": "\ufeff" + text(),
    "CRLF": text().replace("\n", "\r\n"),
    "comments": "# bench 7\n\n" + text() + "\n# end\n",
    "quotes": text(head=[f'"{h}"' for h in HEAD]),
    "words": text(head=("Displacement [cm^3/rev]", "Speed [rev/min]", "Pressure drop [bar]", "Torque loss [N m]")),
    "aliases": text(head=("Vg [cm^3/rev]", "n [rev/min]", "dp [bar]", "loss [N m]")),
    "UTF-16": text(separator="\t").encode("utf-16"),
}


@pytest.mark.parametrize("name", DIALECTS)
def test_every_dialect_gives_the_same_map(tmp_path, plain, name):
    assert same(read(tmp_path, DIALECTS[name]), plain)


@pytest.mark.slow
def test_parquet_and_excel_give_the_same_map(tmp_path, plain):
    import openpyxl

    write_parquet(dict(zip(HEAD, zip(*CELLS, strict=True), strict=True)), tmp_path / "map.parquet")
    book = openpyxl.Workbook()
    book.active.append(["# from the bench"])
    book.active.append(list(HEAD))
    for row in CELLS:
        book.active.append(list(row))
    book.save(tmp_path / "map.xlsx")
    assert same(read_map(tmp_path / "map.parquet"), plain)
    assert same(read_map(tmp_path / "map.xlsx"), plain)


def test_efficiency_and_shaft_torque_give_the_same_loss(tmp_path, plain):
    T_N = plain.T_N
    shaft = [(*c[:3], f"{T - c[3]:.9f}") for c, T in zip(CELLS, T_N, strict=True)]
    part = [(*c[:3], f"{100 * (1 - c[3] / T):.12f}") for c, T in zip(CELLS, T_N, strict=True)]
    one = [(*c[:3], f"{1 - c[3] / T:.14f}") for c, T in zip(CELLS, T_N, strict=True)]
    assert same(read(tmp_path, text(shaft, (*HEAD[:3], "torque [N m]"))), plain)
    assert same(read(tmp_path, text(part, (*HEAD[:3], "eta_hm [%]"))), plain)
    assert same(read(tmp_path, text(one, (*HEAD[:3], "efficiency [1]"))), plain)


def test_a_mapping_file_names_columns_units_and_scale(tmp_path, plain):
    (tmp_path / "m.toml").write_text(
        '[columns]\nD_m = { column = "Size", unit = "cm^3/rev" }\nomega_m = { column = "rpm", unit = "rev/min", scale = 1000.0 }\n'
        'dp_m = { column = "Druck", unit = "bar" }\nT_f = { column = "Verlust", unit = "N m" }\n'
    )
    rows = [(c[0], c[1] / 1000.0, *c[2:]) for c in CELLS]
    assert same(read(tmp_path, text(rows, ("Size", "rpm", "Druck", "Verlust")), mapping=tmp_path / "m.toml"), plain)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "parts"),
    [
        ("", ["empty"]),
        ("# nothing but words\n", ["has no header"]),
        (text([]), ["no data below it"]),
        (text(head=("D_m", *HEAD[1:])), ["D_m", "no unit", "cm^3/rev"]),
        (text(head=("D_m [cm^3]", *HEAD[1:])), ['"cm^3"', "cm^3/rev"]),
        (text(head=(HEAD[0], "n [1/h]", *HEAD[2:])), ['"1/h"', "rev/min"]),
        (text(head=("size [cm^3/rev]", *HEAD[1:])), ["no column", "D_m [cm^3/rev]", "size"]),
        (text(head=(*HEAD[:3], "heat [W]")), ["no column with the loss", "eta_hm"]),
        (text(head=("D_m [m^3/rad]", *HEAD[1:])), ["row 2", "cm^3/rev", "Check the number and the unit"]),
        (text(head=(*HEAD[:2], "dp [MPa]", HEAD[3])), ["row 3", "2000 bar", "Check the number"]),
        (text(head=("D_m [cm^3/rev]", "n [rev/min]", "dp [bar]", "dp_m [bar]")), ["both read as dp_m"]),
        (text(head=(HEAD[0], "n [rad/s]", *HEAD[2:])).replace(",1500,", ",15000,"), ["rev/min", "Check"]),
        (text().replace("1500", "15oo", 1), ["row 5", "n [rev/min]", "15oo", "not a finite number"]),
        (text(CELLS[:5]), ["5 cells", "at least 10"]),
        (text()[:-1].replace("\n200,", "\n200;"), ["3 fields where the header has 4"]),
        (text().replace(".", ","), ["5 fields where the header has 4", "decimal comma"]),
        (text([(f'"{D}"', '"1,500"', p, T) for D, n, p, T in CELLS]), ["1,500", "a decimal comma and a point"]),
        (
            text([(D, f"{n / 1000:.3f}", p, T) for D, n, p, T in CELLS], separator=";", comma=True),
            ["ends at 1.5 rev/min", "thousands"],
        ),
        (
            text([("1.000", "500,5", p, 5) for D, n, p, T in CELLS], separator=";"),
            ["comma", "point", "one decimal sign"],
        ),
        (text(head=(*HEAD[:3], "eta_hm [1]")), ["efficiency above 100 %", "Check columns and units"]),
        (text([(*c[:3], 0.9) for c in CELLS], (*HEAD[:3], "eta_hm [%]")), ["at most 0.9 %", 'heading as "eta_hm [1]"']),
        (text([*CELLS[:3], (True, 1, 2, 3), *CELLS[4:]]), ["row 5", '"True"', "not a finite number"]),
        (text([*CELLS[:3], ("1_00", 1, 2, 3), *CELLS[4:]]), ["row 5", "not a finite number"]),
        (b"D_m [cm^3/rev],n [rev/min],dp [bar],T_f [N m]\n100,500,100,\xff\n", ["line 2", "UTF-8"]),
    ],
)
def test_what_cannot_be_read_is_refused_with_row_and_column(tmp_path, content, parts):
    line = refused(tmp_path, content)
    assert line.startswith("map.csv")
    for part in parts:
        assert part in line, line


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("map.xls", ".xls is not read"),
        ("map.xlsx", "not a readable Excel file"),
        ("map.parquet", "not a readable Parquet file"),
    ],
)
def test_files_that_are_not_what_they_are_called_are_refused(tmp_path, name, part):
    assert part in refused(tmp_path, b"\xd0\xcf\x11\xe0 nonsense", name)


def test_no_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        read_map(tmp_path / "gone.csv")
    with pytest.raises(LogError, match="a folder"):
        read_map(tmp_path)


@pytest.mark.parametrize(
    ("toml", "part"),
    [
        ("[columns]\n", "m.toml: no table [columns]. Write rows such as heave = "),
        ("[signals]\na = 1\n", "m.toml: columns.a: unknown column. Allowed: "),
        ("[columns]\nspeed = { column = 'x' }\n", "columns.speed: unknown column. Allowed: "),
        ('[columns]\nD_m = { column = "x", unit = "cm^3" }\n', "not one of m^3/rad"),
        ('[columns]\nD_m = { column = "x", unit = "cm^3/rev", scale = 0 }\n', "scale = 0"),
        (
            '[columns]\nD_m = { column = "x", unit = "cm^3/rev", factor = 2 }\n',
            "columns.D_m.factor: unknown field. Allowed: column, unit, sign, scale, offset.",
        ),
        ('[columns]\nD_m = { column = "gone", unit = "cm^3/rev" }\n', 'no column "gone"'),
        ("not toml", "not valid TOML"),
    ],
)
def test_bad_mappings_are_refused(tmp_path, toml, part):
    (tmp_path / "m.toml").write_text(toml)
    assert part in refused(tmp_path, text(), mapping=tmp_path / "m.toml")


ODD = [(200, 0, 100, 20), (200, 500, -100, 20), (200, 700, 100, ""), (200, 800, 100, "n/a"), (200, 900, 100, -3)]
NO_LOSS = ["standstill", "row 14", "negative pressure", "row 15", "2 rows left out for an empty cell (row 16, 17)"]
ETA = [(*c[:3], 90) for c in CELLS] + [(200, 700, 100, 101), (200, 800, 100, 0), (200, 900, 0, 80)]


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (text([*CELLS, *ODD]), [*NO_LOSS, "negative loss", "row 18"]),
        (text(ETA, (*HEAD[:3], "eta_hm [%]")), ["above 100 %", "0 or below", "no pressure drop"]),
    ],
)
def test_bad_rows_are_left_out_and_declared(tmp_path, content, parts):
    m = read(tmp_path, content)
    assert len(m) == len(CELLS)
    told = " | ".join(m.findings)
    assert all(part in told for part in parts), told


def test_cells_given_twice_are_averaged_and_declared(tmp_path):
    again = (*CELLS[0][:3], CELLS[0][3] + 2.0)
    m = read(tmp_path, text([*CELLS, again]))
    assert len(m) == len(CELLS)
    assert m.T_f.sum() == pytest.approx(sum(c[3] for c in CELLS) + 1.0)
    assert any("more than once" in f and "1 N m" in f for f in m.findings)


def test_two_kinds_of_loss_are_compared_and_one_is_used(tmp_path, plain):
    rows = [(*c, 50.0) for c in CELLS]
    m = read(tmp_path, text(rows, (*HEAD, "eta_hm [%]")))
    assert same(m, plain)
    assert any("eta_hm" in f and "not used" in f and "differ by up to" in f for f in m.findings)


def test_negative_speed_counts_as_speed_and_is_declared(tmp_path, plain):
    m = read(tmp_path, text([(c[0], -c[1], *c[2:]) for c in CELLS]))
    assert m.omega_m.min() > 0.0
    assert any("negative speed" in f for f in m.findings)


def test_a_loss_that_is_most_of_the_torque_is_doubted(tmp_path, plain):
    rows = [(*c[:3], 0.9 * T) for c, T in zip(CELLS, plain.T_N, strict=True)]
    assert any("is it a loss?" in f for f in read(tmp_path, text(rows)).findings)


@pytest.mark.slow
def test_errors_of_a_spreadsheet_are_refused_and_blanks_left_out(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(list(HEAD))
    for row in CELLS:
        book.active.append(list(row))
    book.active.append([200, 700, 100, None])
    book.save(tmp_path / "map.xlsx")
    m = read_map(tmp_path / "map.xlsx")
    assert len(m) == len(CELLS)
    assert any("empty cell (row 14)" in f for f in m.findings)
    book.active.append([200, 800, 100, "#DIV/0!"])
    book.save(tmp_path / "map.xlsx")
    with pytest.raises(LogError, match=r'row 15: T_f \[N m\] = "#DIV/0!" is not a finite number'):
        read_map(tmp_path / "map.xlsx")


def test_one_displacement_only_is_said(tmp_path):
    rows = [(200, n, p, 10 + n / 100 + p / 50) for n in (500, 1000, 1500, 2000) for p in (100, 200, 300)]
    assert any("one displacement only (200 cm^3/rev)" in f for f in read(tmp_path, text(rows)).findings)


def test_a_map_beyond_the_motor_it_is_for_is_refused(tmp_path):
    assert "beyond the motor's full 170 cm^3/rev" in refused(tmp_path, text(), D_max="170 cm^3/rev")


def test_a_bare_number_is_no_full_displacement(tmp_path):
    with pytest.raises(UnitError):
        read(tmp_path, text(), D_max="215")


def test_settings_within_a_per_cent_are_one_level():
    assert list(levels(np.array([100.0, 100.5, 50.0, 99.8, 215.0]))) == [1, 1, 0, 1, 2]


def test_scattered_settings_are_cut_into_slices():
    label = levels(np.random.default_rng(0).uniform(400.0, 2500.0, 500))
    assert label.max() == 11
    assert np.bincount(label).min() > 20


# The map as a model


@pytest.fixture(scope="module")
def made() -> LossMap:
    return synthetic_map("A6VM215", seed=3)


def test_a_written_synthetic_map_reads_back_and_stays_marked(tmp_path, made):
    back = read_map(write_map(made, tmp_path / "m.csv"))
    assert same(back, made)
    assert back.synthetic
    assert "synthetic" in (tmp_path / "m.csv").read_text().splitlines()[0].lower()
    assert same(synthetic_map("A6VM215", seed=3), made)
    assert not same(synthetic_map("A6VM215", seed=4), made)


@pytest.mark.parametrize("part", ["whole", "holes", "full displacement", "curve"])
def test_mapped_model_passes_through_every_cell_and_calls_it_inside(made, part):
    rng = np.random.default_rng(1)
    m = {
        "whole": made,
        "holes": made.at(rng.random(len(made)) < 0.8),
        "full displacement": made.full(),
        "curve": made.full().at(made.full().dp_m == made.dp_m.max()),
    }[part]
    T_f, inside = mapped_loss(m)(m.omega_m, m.D_m, m.dp_m)
    assert pytest.approx(m.T_f, rel=1e-9) == T_f
    assert inside.all()


@pytest.mark.parametrize("holes", [False, True])
def test_mapped_model_marks_extrapolation_and_holds_the_edge(made, holes):
    m = made.at(np.random.default_rng(2).random(len(made)) < 0.9) if holes else made
    law = mapped_loss(m)
    edge, _ = law(m.omega_m.max(), m.D_m.max(), m.dp_m.max())
    for factors in ((1.2, 1.0, 1.0), (1.0, 1.2, 1.0), (1.0, 1.0, 1.2)):
        T_f, inside = law(*(f * x for f, x in zip(factors, (m.omega_m.max(), m.D_m.max(), m.dp_m.max()), strict=True)))
        assert not inside
        assert T_f == pytest.approx(edge, rel=0.05 if holes else 1e-9)
    low, inside = law(10 * RPM, m.D_m.max(), m.dp_m.max())
    assert not inside
    assert low > 0.0


def test_mapped_model_is_even_and_takes_arrays(made):
    law = mapped_loss(made)
    w, D = np.linspace(50.0, 250.0, 7), made.D_m.max()
    assert np.array_equal(law(w, D, 2e7)[0], law(-w, D, -2e7)[0])
    assert law(w, D, 2e7)[0].shape == (7,)


def test_a_map_is_better_between_its_levels_and_a_model_beyond_them(made):
    """Paper D section 2.1: "a mapping model ... very accurate results in the range", "the parametric will have a clear advantage" outside."""
    found = compare_mapped(made, LossModel.MJ4)
    assert found is not None
    assert found.mapped_between < 3.0 * found.fitted_between
    assert found.mapped_beyond > 3.0 * found.fitted_beyond


def test_between_cells_the_mapped_model_is_between_them(made):
    law = mapped_loss(made)
    a, b = law(1000 * RPM, made.D_m.max(), 2e7)[0], law(1100 * RPM, made.D_m.max(), 2e7)[0]
    assert law(1050 * RPM, made.D_m.max(), 2e7)[0] == pytest.approx(0.5 * (a + b), rel=1e-9)
