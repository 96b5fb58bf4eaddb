"""A mapping says which column is which signal; what it gets wrong is reported in one line."""

import numpy as np
import pytest
from tests.identify.refusals import refused

from stillhook.errors import LogError, UnitError
from stillhook.formats.table.dialect import SCALES
from stillhook.logs.log import mapping_from, read_log, read_mapping
from stillhook.logs.mapping import factors
from stillhook.units import KINDS, parse


def said(table, error=LogError):
    return refused(mapping_from, table, "test.toml", error=error)


def row(**keys):
    return {"p_a": {"column": "PT101", "unit": "bar", **keys}}


def test_a_mapping_file_is_read(tmp_path):
    (tmp_path / "map.toml").write_text(
        '[signals]\ntime = { column = "Time", unit = "s" }\np_a = { column = "PT101", unit = "bar", range = ["0 bar", "400 bar"] }\n'
        'omega_m = { column = "M1 speed", unit = "rpm", sign = -1 }\nu_p = "Pump [%]"\n'
        'effort = { column = 7, unit = "kN", quantity = "force", scale = 2.0, offset = -1.5, clock = "T2" }\n'
    )
    rows = read_mapping(tmp_path / "map.toml")
    assert list(rows) == ["time", "p_a", "omega_m", "u_p", "effort"]
    assert (rows["p_a"].lo, rows["p_a"].hi) == (0.0, 400e5)
    assert (rows["omega_m"].unit, rows["omega_m"].sign, rows["omega_m"].quantity) == ("rpm", -1, "rotation")
    assert (rows["u_p"].column, rows["u_p"].unit, rows["u_p"].quantity) == ("Pump [%]", None, "")
    assert (rows["effort"].column, rows["effort"].clock, rows["effort"].scale, rows["effort"].offset) == (
        "7",
        "T2",
        2.0,
        -1.5,
    )


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (
            "[other]\na = 1\n",
            'map.toml: no table [signals]. Write rows such as p_a = { column = "PT101", unit = "bar" }',
        ),
        ("[signals]\n", "map.toml: signals = {} names no signal. Write rows such as p_a = "),
        ("[signals\n", "not valid TOML"),
    ],
)
def test_files_that_are_no_mapping(tmp_path, content, text):
    (tmp_path / "map.toml").write_text(content)
    assert text in refused(read_mapping, tmp_path / "map.toml", error=LogError)


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"p_a": 7}, ' = 7: write a table such as { column = "PT101", unit = "bar" }, or the heading as text.'),
        (row(colum="x"), '.colum: unknown field; did you mean "column"? Allowed: column, unit, sign, '),
        ({"p_a": {"unit": "bar"}}, ".column: missing (heading of the column in the file, or its place counted from 1)"),
        (row(column=0), ".column = 0: write the heading of the column in the file, or its place counted from 1."),
        (row(sign=2), ".sign = 2: it must be 1 or -1."),
        (row(sign=True), ".sign = true: it must be a whole number (1 or -1)."),
        (row(scale="2"), '.scale = "2": it must be a number (factor on the raw number, before the unit).'),
        (row(scale=-1), ".scale = -1: write a number above 0; a flipped signal takes sign = -1."),
        (row(scale=0), ".scale = 0: write a number above 0; a flipped signal takes sign = -1."),
        (row(offset=float("nan")), ".offset = nan: it must be a finite number."),
        (row(range="0 bar"), '.range = "0 bar": write the two ends of the sensor, such as ["0 bar", "400 bar"].'),
        (row(range=["400 bar", "0 bar"]), "the first end must be below the second."),
        (row(quantity="force"), '.quantity = "force": p_a measures "pressure". Leave quantity out.'),
    ],
)
def test_rows_that_are_wrong_are_told(table, text):
    line = said(table)
    assert line.startswith("test.toml: signals.p_a")
    assert text in line


def test_a_row_of_time_takes_no_sign():
    line = said({"time": {"column": "t", "unit": "s", "sign": -1}})
    assert line == "test.toml: signals.time: time takes column, unit, scale and offset only."


def test_an_unknown_name_is_told_with_the_nearest():
    text = said({"p_A": {"column": "PT101", "unit": "bar"}})
    assert text.startswith('test.toml: signals.p_A: "p_A" is not a signal of Stillhook; did you mean "p_')
    assert 'For another name give what it measures, such as quantity = "pressure" (one of length,' in text


@pytest.mark.parametrize(
    ("table", "text"),
    [
        (row(unit="psi"), '.p_a.unit = "psi" is not one of Pa, bar, kPa, MPa. Write unit = "bar", scale = 0.0689476.'),
        (row(unit="mA"), "and the factor to it as scale, such as unit = "),
        ({"u_p": {"column": "u", "unit": "V"}}, "is not one of 1, %."),
        ({"time": {"column": "t", "unit": "week"}}, "is not one of s, ms, min, h, d, UTC (ISO 8601 stamps), a pattern"),
        (row(range=["0 m", "400 m"]), 'signals.p_a.range = "0 m": unit "m" is not one of Pa, bar, kPa, MPa.'),
    ],
)
def test_an_unknown_unit_is_told_with_those_allowed(table, text):
    assert text in said(table, UnitError)


def test_scales_that_are_advised_are_right():
    known = {
        "psi": 6894.757,
        "psig": 6894.757,
        "in": 0.0254,
        "in/s": 0.0254,
        "ft": 0.3048,
        "lbs": 4.448222,
        "lbf": 4.448222,
        "mbar": 100.0,
    }
    for unit, (ours, factor) in SCALES.items():
        if ours is not None:
            kind = next(kind for kind in KINDS if ours in KINDS[kind].allowed)
            assert factor * parse(f"1 {ours}", kind) == pytest.approx(known[unit], rel=1e-6)


def test_sign_scale_and_offset_make_the_value(tmp_path):
    """sign * unit(scale * raw + offset), also for temperatures whose zero is not that of kelvin."""
    (tmp_path / "x.csv").write_text("t,mA,T\n" + "\n".join(f"{i},{4 + 0.1 * i:.3f},{20 + i}" for i in range(40)))
    rows = {
        "time": {"column": "t", "unit": "s"},
        "p_a": {"column": "mA", "unit": "bar", "scale": 25.0, "offset": -100.0},  # 4-20 mA of a 400 bar sensor
        "oil": {"column": "T", "unit": "degC", "quantity": "temperature"},
        "back": {"column": "mA", "unit": "bar", "scale": 25.0, "offset": -100.0, "sign": -1, "quantity": "pressure"},
    }
    mapping = mapping_from(rows, "m")
    log = read_log(tmp_path / "x.csv", mapping)
    np.testing.assert_allclose(log.signals["p_a"], 2.5e5 * np.arange(40), atol=1e-6)
    np.testing.assert_allclose(log.signals["back"], -2.5e5 * np.arange(40), atol=1e-6)
    np.testing.assert_allclose(log.signals["oil"], 293.15 + np.arange(40))
    assert factors(mapping["oil"], "degC") == (1.0, 273.15)


@pytest.fixture
def small(tmp_path):
    (tmp_path / "x.csv").write_text(
        "Time,PT101,PT102,PT102,Speed M1\n" + "\n".join(f"{i},1{i},2{i},3{i},4{i}" for i in range(20))
    )
    return tmp_path / "x.csv"


def read_with(file, rows, time=True, **options):
    of_time = {"time": {"column": "Time", "unit": "s"}} if time else {}
    return read_log(file, mapping_from(of_time | rows, "m"), **options)


PT101 = {"column": "PT101", "unit": "bar"}


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        ({"p_a": PT101 | {"column": "PT100"}}, 'p_a: no column "PT100" in the file. The nearest are "PT102", "PT101".'),
        ({"p_a": PT101 | {"column": "zzz"}}, 'p_a: no column "zzz" in the file. It has "Time", "PT101", "PT102", '),
        ({"p_b": PT101 | {"column": "PT102"}}, 'p_b: 2 columns "PT102" (places 3, 4). Give the place of one, such as '),
        ({"p_b": {"column": "PT101"}}, 'p_b: column "PT101" has no unit; choose one of Pa, bar, kPa, MPa.'),
        ({"p_a": PT101 | {"clock": "T2"}}, 'clock: no column "T2" in the file. '),
        ({}, "the mapping names no signal"),
    ],
)
def test_columns_that_are_not_there_are_told_with_the_nearest(small, rows, text):
    assert refused(read_with, small, rows).startswith(f"x.csv: {text}")


def test_a_mapping_without_time_is_told_with_the_columns(small):
    line = refused(read_with, small, {"p_a": PT101}, time=False, error=LogError)
    assert 'names no time. Add a row such as time = { column = "...", unit = "s" }; the file has "Time", ' in line


@pytest.mark.parametrize(("every", "error"), [("0 s", LogError), ("1 m", UnitError), ("fast", UnitError)])
def test_the_width_of_the_bins_is_a_time(small, every, error):
    assert "every" in refused(read_with, small, {"p_a": PT101}, every=every, error=error)
