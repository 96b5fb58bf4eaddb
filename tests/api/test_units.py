"""A quantity is a number, a space and a listed unit; everything else is refused on one line that says what to write."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, Field, ValidationError

from stillhook import units
from stillhook.errors import UnitError
from stillhook.units import KINDS, Quantity, from_display, in_display, number, parse, show

ROUNDING = 1e-12  # relative; a few float operations

# Dimensions that are not spelled by the SI unit of the kind are checked here: text, kind, value in SI.
READ = [
    ("250 t", "mass", 250e3),
    ("215 cm^3/rev", "displacement", 215e-6 / (2 * math.pi)),
    ("215 cc/rev", "displacement", 215e-6 / (2 * math.pi)),
    ("80 cc", "volume", 80e-6),
    ("250 te", "mass", 250e3),
    ("1500 rpm", "rotation", 50 * math.pi),
    ("1e-5 L/min/bar/rpm", "leakage_per_speed", 1e-5 * 1e-3 / 60 / 1e5 * 60 / (2 * math.pi)),
    ("3 d", "hours", 259200.0),
    ("1 d", "time", 86400.0),
    ("96 mm", "diameter", 0.096),
    ("350 bar", "pressure", 350e5),
    ("1800 rev/min", "rotation", 60 * math.pi),
    ("0.4 L/min/bar", "leakage", 0.4e-3 / 60 / 1e5),
    ("1e-5 L/min/bar/(rev/min)", "leakage_per_speed", 1e-5 * 1e-3 / 60 / 1e5 * 60 / (2 * math.pi)),
    ("0.002 bar/(L/min)", "flow_resistance", 0.002 * 1e5 * 60e3),
    ("25 degC", "temperature", 298.15),
    ("-10 degC", "temperature", 263.15),
    ("298.15 K", "temperature", 298.15),
    ("1.5 MN m", "torque", 1.5e6),
    ("-80 m/min", "speed", -80 / 60),
    ("90 deg", "angle", math.pi / 2),
    ("10 ms", "time", 0.01),
    ("0.5 Hz", "frequency", math.pi),
    ("210 GPa", "modulus", 210e9),
    ("3.5 kN/mm", "stiffness", 3.5e6),
    ("0.1 1/bar", "gain_per_pressure", 1e-6),
    ("3.69e10 N m s^2/rad^2/(m^3/rad)^3", "torque_loss_turbulent", 3.69e10),
    ("+.5 m", "length", 0.5),
    ("5. m", "length", 5.0),
    ("  7 \t cm^3 / rev  ", "displacement", 7e-6 / (2 * math.pi)),
]

# What stock pint reads silently as something else, and what people write.
REFUSED = [
    ("215 cm^3", "displacement", '"215 cm^3": unit "cm^3" is not one of m^3/rad, cm^3/rev, cc/rev.'),
    ("1500 1/min", "rotation", '"1500 1/min": unit "1/min" is not one of rad/s, rev/min, rpm.'),
    ("1500 RPM", "rotation", '"1500 RPM": unit "RPM" is not one of rad/s, rev/min, rpm.'),
    ("215 cc", "displacement", '"215 cc": unit "cc" is not one of m^3/rad, cm^3/rev, cc/rev.'),
    ("3 d", "angle", '"3 d": unit "d" is not one of rad, deg, rev.'),
    ("3 d", "length", '"3 d": unit "d" is not one of m, cm, mm, km.'),
    ("12 te", "force", '"12 te": unit "te" is not one of N, kN, MN.'),
    ("12 ton", "mass", '"12 ton": unit "ton" is not one of kg, t, te.'),
    ("1 Nm", "torque", '"1 Nm": unit "Nm" is not one of N m, kN m, MN m.'),
    ("3,5 m", "length", '"3,5 m": a comma in the number; write a point, "3.5 m".'),
    ("1,234.5 kg", "mass", '"1,234.5 kg": not a number, a space and a unit, such as "1 t" (allowed: kg, t, te).'),
    ("250t", "mass", '"250t": no space before the unit; write "250 t".'),
    ("250", "mass", '"250": no unit; write "250 t" (allowed: kg, t, te).'),
    (100, "mass", '100: a bare number; write it as text with its unit, "100 t" (allowed: kg, t, te).'),
    (-2.5, "speed", '-2.5: a bare number; write it as text with its unit, "-2.5 m/min" (allowed: m/s, m/min, mm/s).'),
    ("nan m", "length", '"nan m": not a finite number; write one with a unit, such as "1 m".'),
    ("-inf m", "length", '"-inf m": not a finite number; write one with a unit, such as "1 m".'),
    ("1e999 m", "length", '"1e999 m": too large a number; write one with a unit, such as "1 m".'),
    ("-1e200 m", "length", '"-1e200 m": too large a number; write one with a unit, such as "1 m".'),
    (math.nan, "length", "nan: not a finite number; write one as text with its unit, such as"),
    ("", "length", '"": empty; write a number and a unit, such as "1 m" (allowed: m, cm, mm, km).'),
    (" \n", "length", '" \\n": empty; write a number and a unit, such as "1 m" (allowed: m, cm, mm, km).'),
    (None, "length", 'nothing: write a number and a unit as text, such as "1 m" (allowed: m, cm, mm, km).'),
    (True, "mass", 'true: write a number and a unit as text, such as "1 t" (allowed: kg, t, te).'),
    ([1, "m"], "length", "[1, 'm']: write a number and a unit as text, such as"),
    (b"5 m", "length", "b'5 m': write a number and a unit as text, such as"),
    ("1+1 m", "length", '"1+1 m": not a number, a space and a unit, such as'),
    ("2*3 m", "length", '"2*3 m": not a number, a space and a unit, such as'),
    ("1_000 m", "length", '"1_000 m": not a number, a space and a unit, such as'),
    ("0x10 m", "length", '"0x10 m": not a number, a space and a unit, such as'),
    ("٣ m", "length", '"٣ m": not a number, a space and a unit, such as'),
    ("−5 m", "length", '"−5 m": not a number, a space and a unit, such as'),
    ("1 000 m", "length", '"1 000 m": unit "000 m" is not one of m, cm, mm, km.'),
    ("5 m**2", "length", '"5 m**2": unit "m**2" is not one of m, cm, mm, km.'),
    ("5 2*m", "length", '"5 2*m": unit "2*m" is not one of m, cm, mm, km.'),
    ("5 m; import os", "length", '"5 m; import os": unit "m; import os" is not one of m, cm, mm, km.'),
    ("5 M", "length", '"5 M": unit "M" is not one of m, cm, mm, km.'),
    ("5\u00a0m", "length", '"5\\xa0m": '),
    ("5\u2028m", "length", '"5\\u2028m": '),
    ("5 \x1b[31mm", "length", '"5 \\x1b[31mm": unit "\\x1b[31mm" is not one of m, cm, mm, km.'),
    ("m", "length", '"m": not a number, a space and a unit, such as "1 m" (allowed: m, cm, mm, km).'),
]


@pytest.mark.parametrize(("text", "kind", "value"), READ)
def test_text_with_a_listed_unit_becomes_si(text: str, kind: str, value: float) -> None:
    assert parse(text, kind) == pytest.approx(value, rel=ROUNDING)


@pytest.mark.parametrize(("text", "kind", "message"), REFUSED)
def test_anything_else_is_refused_with_what_to_write(text: object, kind: str, message: str) -> None:
    with pytest.raises(UnitError) as error:
        parse(text, kind)
    assert str(error.value).startswith(message)
    assert len(str(error.value).splitlines()) == 1


def test_the_error_starts_with_file_and_field() -> None:
    with pytest.raises(UnitError) as error:
        parse("215 cm^3", "displacement", "nov-250t.toml: active.motor.D_max")
    assert str(error.value) == (
        'nov-250t.toml: active.motor.D_max = "215 cm^3": unit "cm^3" is not one of m^3/rad, cm^3/rev, cc/rev.'
    )


def test_a_very_long_text_is_cut_in_the_error_and_costs_no_time() -> None:
    with pytest.raises(UnitError) as error:
        parse("1" * 1_000_000, "length")
    assert len(str(error.value)) < 400


def test_an_unknown_kind_names_the_known_ones() -> None:
    with pytest.raises(UnitError, match='Unknown kind "weight": it is not one of length'):
        parse("1 kg", "weight")


@pytest.mark.parametrize("kind", KINDS)
def test_every_allowed_unit_measures_what_its_kind_measures(kind: str) -> None:
    """The factors exist, are positive, and the SI unit and the display unit are among the allowed ones."""
    known = KINDS[kind]
    assert known.si in known.allowed
    assert known.display in known.allowed
    for unit in known.allowed:
        assert parse(f"2 {unit}", kind) > parse(f"1 {unit}", kind)
    assert parse(f"1.25 {known.si}", kind) == 1.25


@pytest.mark.slow
def test_factors_are_those_of_pint() -> None:
    """An independent reading of the same units: pint's stock registry, with what it reads otherwise defined as here."""
    pint = pytest.importorskip("pint")
    registry = pint.UnitRegistry()
    for line in ("rad = [angle]", "rev = 2 * pi * rad", "deg = rev / 360", "Hz = rev / s", "rpm = rev / min"):
        registry.define(line)
    for line in ("L = 1e-3 m^3", "te = 1e3 kg", "d = 24 h", "kn = 1852 m / h"):
        registry.define(line)
    for kind, known in KINDS.items():
        for unit in known.allowed:
            texts = [text.replace(" ", "*").replace("*/*", "/") for text in (unit, known.si)]
            theirs = registry.Quantity(3.5, texts[0]).to(texts[1]).magnitude
            assert parse(f"3.5 {unit}", kind) == pytest.approx(theirs, rel=ROUNDING), (kind, unit)


@pytest.mark.parametrize("name", ["ton", "nm", "Nm", "psi", "day", "tonne", "inch", "degree", "kilobar", "mbar"])
def test_no_unit_has_a_meaning_that_is_not_in_the_table(name: str) -> None:
    """A stock registry would read 12 ton as US short tons and Nm as nanometres."""
    with pytest.raises(UnitError, match=f'Unknown unit "{name}"'):
        units._scale(name, "m")


def test_angle_is_a_dimension_so_a_volume_is_no_displacement() -> None:
    with pytest.raises(UnitError, match=r'"cm\^3" does not measure what "m\^3/rad" does'):
        units._scale("cm^3", "m^3/rad")


@given(st.sampled_from(sorted(set(KINDS) - {"temperature"})), st.floats(-1e6, 1e6))
@example("length", 0.1)
@example("angle", math.radians(165.0))
def test_an_exact_text_is_read_as_the_same_number(kind, value):
    assert parse(units.exact(value, kind), kind) == value


@given(st.sampled_from(sorted(KINDS)), st.floats(-1e6, 1e6))
@settings(deadline=None)
def test_shown_values_read_back_the_same_within_their_digits(kind: str, value: float) -> None:
    """What is printed in display units is again a text that parse takes."""
    si = from_display(value, kind)
    assert in_display(si, kind) == pytest.approx(value, rel=1e-9, abs=1e-9)
    again = in_display(parse(show(si, kind, digits=6), kind), kind)
    assert again == pytest.approx(value, rel=1e-5, abs=1e-9)


@pytest.mark.slow
@given(st.text(max_size=60), st.sampled_from(sorted(KINDS)))
@settings(deadline=None, max_examples=300)
@example("1 m/s/", "speed")
@example("1e m", "length")
@example("- 1 m", "length")
def test_no_text_crashes_the_reader_or_breaks_the_line(text: str, kind: str) -> None:
    message = ""
    try:
        value = parse(text, kind)
    except UnitError as error:
        value, message = 0.0, str(error)
    assert math.isfinite(value)
    assert len(message.splitlines()) <= 1
    assert message.isprintable()


@pytest.mark.slow
@given(st.from_regex(r"[+-]?[0-9]{1,6}(\.[0-9]{0,6})?(e[+-]?[0-9])?", fullmatch=True))
@settings(deadline=None)
def test_the_number_means_what_python_means(digits: str) -> None:
    assert parse(f"{digits} m", "length") == float(digits)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 4, "0"),
        (-0.0, 4, "0"),
        (215.0, 4, "215"),
        (17500.0, 4, "17500"),
        (123456.0, 4, "123500"),
        (0.00012345, 3, "0.000123"),
        (9.9999, 3, "10"),
        (-2.5, 4, "-2.5"),
        (1.16e-14, 4, "1.16e-14"),
        (3.69e10, 4, "3.69e+10"),
        (999.9e6, 4, "999900000"),
        (1.2e9, 4, "1.2e+09"),
        (1e-4, 4, "0.0001"),
        (0.9e-4, 4, "9e-05"),
        (math.nan, 4, "nan"),
        (math.inf, 4, "inf"),
    ],
)
def test_numbers_print_without_needless_exponents(value: float, digits: int, text: str) -> None:
    assert number(value, digits) == text


def test_show_uses_the_display_unit() -> None:
    assert show(215e-6 / (2 * math.pi), "displacement") == "215 cm^3/rev"
    assert show(273.15 + 25, "temperature") == "25 degC"
    assert show(0.096, "diameter") == "96 mm"


class Thing(BaseModel):
    """A model with quantities, as crane and scenario have them."""

    L: units.Length = Field(gt=0)
    m: units.Mass | None = None
    D: tuple[units.Displacement, ...] = ()


def test_fields_take_text_and_hold_si() -> None:
    thing = Thing.model_validate({"L": "60 m", "m": "3 t", "D": ["2 cm^3/rev"]})
    assert (thing.L, thing.m) == (60.0, 3000.0)
    assert pytest.approx((2e-6 / (2 * math.pi),)) == thing.D


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"L": 60.0}, 'a bare number; write it as text with its unit, "60.0 m"'),
        ({"L": "-1 m"}, "greater than 0"),
        ({"L": "0 mm"}, "greater than 0"),
        ({"L": "1 m", "m": 3}, 'write it as text with its unit, "3 t"'),
        ({"L": "1 m", "D": ["1 cm^3"]}, 'unit "cm^3" is not one of m^3/rad, cm^3/rev, cc/rev.'),
    ],
)
def test_fields_refuse_bare_numbers_and_values_out_of_range(data: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message.replace("^", r"\^")):
        Thing.model_validate(data)


def test_a_field_carries_its_kind() -> None:
    assert Quantity("length") in Thing.model_fields["L"].metadata


@pytest.mark.parametrize("printed", [35.4, "35.4", "35.4:1", "35.4 : 1", "i = 35.4", "i=35.4:1"])
def test_a_gear_ratio_reads_as_data_sheets_print_it(printed: object) -> None:
    assert units.parse_ratio(printed) == 35.4


@pytest.mark.parametrize("printed", ["1:35.4", "35.4:2", "35,4", "35.4 rev", "1/35.4", "", True, None, [35.4]])
def test_a_gear_ratio_that_may_mean_either_way_is_refused(printed: object) -> None:
    with pytest.raises(UnitError, match=r'write the turns of the motor for one turn of the drum, 35.4 or "35.4:1"\.$'):
        units.parse_ratio(printed)
