"""A mapping says which column is which signal; what it gets wrong is reported in one line."""

import numpy as np
import pytest

from stillhook.errors import LogError, UnitError
from stillhook.formats.table.units import SCALES
from stillhook.logs.log import mapping_from, read_log, read_mapping
from stillhook.logs.mapping import factors
from stillhook.units import KINDS, parse


def said(table, error=LogError):
    with pytest.raises(error) as caught:
        mapping_from(table, "test.toml")
    assert "\n" not in str(caught.value)
    return str(caught.value)


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
            'map.toml: no table [signals]. Write rows such as p_a = { column = "PT101", unit = "bar" } below it.',
        ),
        (
            "[signals]\n",
            'map.toml: signals = {} names no signal. Write rows such as p_a = { column = "PT101", unit = "bar" }.',
        ),
        ("[signals\n", "not valid TOML"),
    ],
)
def test_files_that_are_no_mapping(tmp_path, content, text):
    (tmp_path / "map.toml").write_text(content)
    with pytest.raises(LogError) as caught:
        read_mapping(tmp_path / "map.toml")
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("table", "text"),
    [
        (
            {"p_a": 7},
            'test.toml: signals.p_a = 7: write a table such as { column = "PT101", unit = "bar" }, or the heading as text.',
        ),
        (
            row(colum="x"),
            'test.toml: signals.p_a.colum: unknown field; did you mean "column"? Allowed: column, unit, sign, scale, offset, clock, range, quantity, words.',
        ),
        (
            {"p_a": {"unit": "bar"}},
            "test.toml: signals.p_a.column: missing (heading of the column in the file, or its place counted from 1). Add it.",
        ),
        (
            row(column=0),
            "test.toml: signals.p_a.column = 0: write the heading of the column in the file, or its place counted from 1.",
        ),
        (row(sign=2), "test.toml: signals.p_a.sign = 2: it must be 1 or -1."),
        (row(sign=True), "test.toml: signals.p_a.sign = true: it must be a whole number (1 or -1)."),
        (
            row(scale="2"),
            'test.toml: signals.p_a.scale = "2": it must be a number (factor on the raw number, before the unit).',
        ),
        (row(scale=-1), "test.toml: signals.p_a.scale = -1: write a number above 0; a flipped signal takes sign = -1."),
        (row(scale=0), "test.toml: signals.p_a.scale = 0: write a number above 0; a flipped signal takes sign = -1."),
        (row(offset=float("nan")), "test.toml: signals.p_a.offset = nan: it must be a finite number."),
        (
            row(range="0 bar"),
            'test.toml: signals.p_a.range = "0 bar": write the two ends of the sensor, such as ["0 bar", "400 bar"].',
        ),
        (
            row(range=["400 bar", "0 bar"]),
            "test.toml: signals.p_a.range = ['400 bar', '0 bar']: the first end must be below the second.",
        ),
        (
            row(quantity="force"),
            'test.toml: signals.p_a.quantity = "force": p_a measures "pressure". Leave quantity out.',
        ),
        (
            {"time": {"column": "t", "unit": "s", "sign": -1}},
            "test.toml: signals.time: time takes column, unit, scale and offset only.",
        ),
    ],
)
def test_rows_that_are_wrong_are_told(table, text):
    assert said(table) == text


def test_an_unknown_name_is_told_with_the_nearest():
    text = said({"p_A": {"column": "PT101", "unit": "bar"}})
    assert text.startswith('test.toml: signals.p_A: "p_A" is not a signal of Stillhook; did you mean "p_')
    assert 'For a name of your own give what it measures, such as quantity = "pressure" (one of length,' in text


def test_an_unknown_unit_is_told_with_those_allowed():
    assert said(row(unit="psi"), UnitError) == (
        'test.toml: signals.p_a.unit = "psi" is not one of Pa, bar, kPa, MPa. Write unit = "bar", scale = 0.0689476.'
    )
    assert said(row(unit="mA"), UnitError) == (
        'test.toml: signals.p_a.unit = "mA" is not one of Pa, bar, kPa, MPa. Choose one of these and the factor to it as scale, such as unit = "bar", '
        "scale = 0.1."
    )
    assert "is not one of 1, %." in said({"u_p": {"column": "u", "unit": "V"}}, UnitError)
    assert "is not one of s, ms, min, h, d, UTC (ISO 8601 stamps), a pattern of stamps such as" in said(
        {"time": {"column": "t", "unit": "week"}}, UnitError
    )


def test_range_of_another_kind_is_told():
    assert (
        said(row(range=["0 m", "400 m"]), UnitError)
        == 'test.toml: signals.p_a.range = "0 m": unit "m" is not one of Pa, bar, kPa, MPa.'
    )


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


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        (
            {"p_a": {"column": "PT100", "unit": "bar"}},
            'x.csv: p_a: no column "PT100" in the file. The nearest are "PT102", "PT101".',
        ),
        (
            {"p_a": {"column": "zzz", "unit": "bar"}},
            'x.csv: p_a: no column "zzz" in the file. It has "Time", "PT101", "PT102", "PT102", "Speed M1".',
        ),
        (
            {"p_b": {"column": "PT102", "unit": "bar"}},
            'x.csv: p_b: 2 columns "PT102" (places 3, 4). Give the place of one, such as column = 3.',
        ),
        ({"p_b": {"column": "PT101"}}, 'x.csv: p_b: column "PT101" has no unit; choose one of Pa, bar, kPa, MPa.'),
        ({"p_a": {"column": "PT101", "unit": "bar", "clock": "T2"}}, 'x.csv: clock: no column "T2" in the file. '),
    ],
)
def test_columns_that_are_not_there_are_told_with_the_nearest(small, rows, text):
    with pytest.raises((LogError, UnitError)) as caught:
        read_log(small, mapping_from({"time": {"column": "Time", "unit": "s"}, **rows}, "m"))
    assert str(caught.value).startswith(text)


def test_a_mapping_without_time_or_signals_is_told(small):
    with pytest.raises(LogError) as caught:
        read_log(small, mapping_from({"p_a": {"column": "PT101", "unit": "bar"}}, "m"))
    assert str(caught.value) == (
        'x.csv: the mapping names no time. Add a row such as time = { column = "...", unit = "s" }; the file has "Time", "PT101", "PT102", "PT102", '
        '"Speed M1".'
    )
    with pytest.raises(LogError, match="the mapping names no signal"):
        read_log(small, mapping_from({"time": {"column": "Time", "unit": "s"}}, "m"))


def test_the_width_of_the_bins_is_a_time(small):
    for every, error in (("0 s", LogError), ("1 m", UnitError), ("fast", UnitError)):
        with pytest.raises(error, match="every"):
            read_log(
                small,
                mapping_from({"time": {"column": "Time", "unit": "s"}, "p_a": {"column": 2, "unit": "bar"}}, "m"),
                every=every,
            )
