"""Campaign files: what is read, and one clear line for everything that is wrong with one."""

from pathlib import Path

import pytest
from tests.identify.refusals import refused

from stillhook.identify.system_friction.campaign import load_campaign
from stillhook.units import parse

GOOD = """
crane = "nov-150t"
motors = 11
[signals]
time = { column = "t", unit = "s" }
p_a = { column = "A", unit = "bar" }
p_b = { column = "B", unit = "bar" }
omega_m = { column = "n", unit = "rev/min" }
[accuracy]
p = "0.2 bar"
omega_m = "0.3 %"
[[test]]
name = "1"
log = "1.csv"
D_mt = "2365 cm^3/rev"
load = "77 t"
layer = 6
[[test]]
log = "2.csv"
D_m = "164 cm^3/rev"
load = "0 t"
s_w = "300 m"
hold_out = true
start = "10 s"
end = "90 s"
"""


def written(folder: Path, text: str) -> Path:
    for log in ("1.csv", "2.csv"):
        (folder / log).write_text("t,A,B,n\n0,1,1,0\n")
    path = folder / "campaign.toml"
    path.write_text(text)
    return path


def test_a_campaign_is_read_in_si(tmp_path):
    c = load_campaign(written(tmp_path, GOOD))
    one, two = c.tests
    assert (c.crane.name, c.count, c.losses.name) == ("nov-150t", 11, "A6VM215")
    assert one.D_m == pytest.approx(parse("215 cm^3/rev", "displacement"))
    assert (one.load, one.layer, one.hold_out) == (77e3, 6, False)
    assert (two.name, two.s_w, two.hold_out, two.start, two.end) == ("2", 300.0, True, 10.0, 90.0)
    assert (c.accuracy.p, c.accuracy.omega_m) == (pytest.approx(0.2e5), pytest.approx(0.003))
    assert c.weight(one) == pytest.approx(80e3 * 9.80665)
    assert c.diameter(one) == pytest.approx(2.25 + 11 * 0.077)


def test_a_stated_wire_length_gives_the_layer_in_use(tmp_path):
    c = load_campaign(written(tmp_path, GOOD))
    d = c.diameter(c.tests[1])
    assert d is not None
    assert c.crane.drum.d < d < c.crane.drum.d_max


def instead(old: str, new: str, line: str) -> tuple[str, str]:
    """What is written instead of what in the good file, and the line about it."""
    assert old in GOOD
    return GOOD.replace(old, new), line


BAD = [
    ("", "empty. "),
    ("crane = ", "not valid TOML: "),
    (GOOD.split("[[test]]")[0], "test: missing (one [[test]] table for each log). Add it."),
    instead(
        'crane = "nov-150t"\n', "", "crane: missing (library name or crane file: drum, wire, gears, hook). Add it."
    ),
    instead("nov-150t", "nov-15t", 'No crane "nov-15t": the library has '),
    instead("motors = 11\n", "", 'motors: missing. "nov-150t" has 3 active and 8 passive motors: say how many were in'),
    instead("motors = 11", "motors = 12", 'motors = 12: "nov-150t" has 1 to 11. Give how many were in the circuit.'),
    instead("motors = 11", "motor = 11", "motor = 11: it must be a text (loss model: library name or motor file)."),
    instead("motors = 11", 'motors = 11\nmotor = "A6VM280"', 'motor = "A6VM280": 280 cm^3/rev, where "nov-150t" has '),
    instead("motors = 11", 'motors = 11\nmotor = "A6VM21"', 'did you mean "A6VM215"?'),
    instead("layer = 6", "lyer = 6", 'test "1": lyer: unknown field; did you mean "layer"? Allowed: name, log, '),
    instead(
        "layer = 6", "layer = 12", 'test "1": layer = 12: "nov-150t" has layers 1 to 11, counted from the bare drum.'
    ),
    instead("layer = 6", 'layer = 6\ns_w = "1 m"', 'test "1": layer and s_w: both given. Give one.'),
    instead('"77 t"', "77", 'test "1": load = 77: '),
    instead('"77 t"', '"77 kN"', 'test "1": load = "77 kN": unit "kN" is not one of kg, t, te.'),
    instead('"77 t"', '"777 t"', 'test "1": load = "777 t": "nov-150t" is made for 0 t to 150 t. Check the load.'),
    instead("D_mt", "D_m", 'test "1": displacement of one motor 2365 cm^3/rev: allowed is above 0 up to 215 cm^3/rev.'),
    instead(
        '"2365 cm^3/rev"', '"2365 cm^3"', 'test "1": D_mt = "2365 cm^3": unit "cm^3" is not one of m^3/rad, cm^3/rev'
    ),
    instead('log = "1.csv"\nD_mt', 'log = "9.csv"\nD_mt', 'test "1": log = "9.csv": no such file next to this file.'),
    instead('"2.csv"', '"1.csv"', 'test "2": log = "1.csv" is that of test "1" as well, and would count twice.'),
    instead('name = "1"', "name = 1", "test 1: name = 1: it must be a text ("),
    instead('name = "1"', 'name = "2"', 'test: the name "2" is given twice. Give every test its own.'),
    instead(
        "hold_out = true", 'hold_out = "yes"', 'test 2: hold_out = "yes": it must be true or false (kept from every'
    ),
    instead('"0.3 %"', "0.3", "accuracy.omega_m = 0.3: it must be less than 0.2."),
    instead('"0.2 bar"', '"-0.2 bar"', 'accuracy.p = "-0.2 bar": it must be greater than or equal to 0.'),
    instead('unit = "rev/min"', 'unit = "knots"', "signals"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("text", "line"), BAD, ids=[line[:60] for _, line in BAD])
def test_what_is_wrong_is_said_in_one_line(tmp_path, text, line):
    problem = refused(load_campaign, written(tmp_path, text))
    assert problem.startswith("campaign.toml: ")
    assert line in problem


@pytest.mark.parametrize("load", ["150 t", "190 t", "225 t"])
def test_an_overload_test_up_to_half_above_the_swl_is_read(tmp_path, load):
    campaign = load_campaign(written(tmp_path, GOOD.replace('"77 t"', f'"{load}"')))
    assert campaign.tests[0].load == parse(load, "mass")


def test_more_than_that_is_a_slip_of_the_pen(tmp_path):
    line = refused(load_campaign, written(tmp_path, GOOD.replace('"77 t"', '"226 t"')))
    assert 'load = "226 t": "nov-150t" is made for 0 t to 150 t. Check the load.' in line
