"""Campaign files: what is read, and one clear line for everything that is wrong with one."""

from pathlib import Path

import pytest

from stillhook.errors import StillhookError
from stillhook.identify.system_friction.campaign.file import load_campaign
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
    assert (c.crane.name, c.count, c.motor_name) == ("nov-150t", 11, "A6VM215")
    assert one.D_m == pytest.approx(parse("215 cm^3/rev", "displacement"))
    assert (one.load, one.layer, one.hold_out) == (77e3, 6, False)
    assert (two.name, two.s_w, two.hold_out, two.start, two.end) == ("2", 300.0, True, 10.0, 90.0)
    assert (c.u_p, c.r_omega) == (pytest.approx(0.2e5), pytest.approx(0.003))
    assert c.weight(one) == pytest.approx(80e3 * 9.80665)
    assert c.diameter(one) == pytest.approx(2.25 + 11 * 0.077)


def test_a_stated_wire_length_gives_the_layer_in_use(tmp_path):
    c = load_campaign(written(tmp_path, GOOD))
    d = c.diameter(c.tests[1])
    assert d is not None
    assert c.crane.drum.d < d < c.crane.drum.d_max


BAD = [
    ("", "campaign.toml: empty. "),
    ("crane = ", "campaign.toml: not valid TOML: "),
    (
        GOOD.replace('crane = "nov-150t"\n', ""),
        "campaign.toml: crane: missing (library name or crane file: drum, wire, gears, hook). Add it.",
    ),
    (GOOD.replace("nov-150t", "nov-15t"), 'campaign.toml: No crane "nov-15t": the library has '),
    (
        GOOD.replace("motors = 11\n", ""),
        'campaign.toml: motors: missing. "nov-150t" has 3 active and 8 passive motors: say how many were in the circuit',
    ),
    (
        GOOD.replace("motors = 11", "motors = 12"),
        'campaign.toml: motors = 12: "nov-150t" has 1 to 11. Give how many were in the circuit.',
    ),
    (
        GOOD.replace("motors = 11", "motor = 11"),
        "campaign.toml: motor = 11: it must be a text (loss model: library name or motor file).",
    ),
    (
        GOOD.replace("motors = 11", 'motors = 11\nmotor = "A6VM280"'),
        'campaign.toml: motor = "A6VM280": 280 cm^3/rev, where "nov-150t" has motors of 215 cm^3/rev.',
    ),
    (GOOD.replace("motors = 11", 'motors = 11\nmotor = "A6VM21"'), 'did you mean "A6VM215"?'),
    (
        GOOD.replace("layer = 6", "lyer = 6"),
        'campaign.toml: test "1": lyer: unknown field; did you mean "layer"? Allowed: name, log, ',
    ),
    (
        GOOD.replace("layer = 6", "layer = 12"),
        'campaign.toml: test "1": layer = 12: "nov-150t" has layers 1 to 11, counted from the bare drum.',
    ),
    (
        GOOD.replace("layer = 6", 'layer = 6\ns_w = "1 m"'),
        'campaign.toml: test "1": layer and s_w: both given. Give one.',
    ),
    (GOOD.replace('"77 t"', "77"), 'campaign.toml: test "1": load = 77: '),
    (GOOD.replace('"77 t"', '"77 kN"'), 'campaign.toml: test "1": load = "77 kN": unit "kN" is not one of kg, t, te.'),
    (
        GOOD.replace('"77 t"', '"777 t"'),
        'campaign.toml: test "1": load = "777 t": "nov-150t" is made for 0 t to 150 t. Check the load.',
    ),
    (
        GOOD.replace("D_mt", "D_m"),
        'campaign.toml: test "1": displacement of one motor 2365 cm^3/rev: allowed is above 0 up to 215 cm^3/rev. D_m is that of one motor',
    ),
    (
        GOOD.replace('"2365 cm^3/rev"', '"2365 cm^3"'),
        'campaign.toml: test "1": D_mt = "2365 cm^3": unit "cm^3" is not one of m^3/rad, cm^3/rev, cc/rev.',
    ),
    (
        GOOD.replace('log = "1.csv"\nD_mt', 'log = "9.csv"\nD_mt'),
        'campaign.toml: test "1": log = "9.csv": no such file next to this file. Check the path.',
    ),
    (
        GOOD.replace('"2.csv"', '"1.csv"'),
        'campaign.toml: test "2": log = "1.csv" is that of test "1" as well, and would count twice. Name another log, or',
    ),
    (GOOD.replace('name = "1"', "name = 1"), "campaign.toml: test 1: name = 1: it must be a text ("),
    (
        GOOD.replace('name = "1"', 'name = "2"'),
        'campaign.toml: test: the name "2" is given twice. Give every test its own.',
    ),
    (
        GOOD.replace("hold_out = true", 'hold_out = "yes"'),
        'campaign.toml: test 2: hold_out = "yes": it must be true or false (kept from every fit).',
    ),
    (
        GOOD.replace('"0.3 %"', "0.3"),
        "campaign.toml: accuracy.omega_m = 0.3: it must be less than 0.2.",
    ),
    (
        GOOD.replace('"0.2 bar"', '"-0.2 bar"'),
        'campaign.toml: accuracy.p = "-0.2 bar": it must be greater than or equal to 0.',
    ),
    (GOOD.replace('unit = "rev/min"', 'unit = "knots"'), "campaign.toml: signals"),
    (GOOD.split("[[test]]")[0], "campaign.toml: test: missing (one [[test]] table for each log). Add it."),
]


@pytest.mark.slow
@pytest.mark.parametrize(("text", "line"), BAD, ids=[line[:60] for _, line in BAD])
def test_what_is_wrong_is_said_in_one_line(tmp_path, text, line):
    with pytest.raises(StillhookError) as problem:
        load_campaign(written(tmp_path, text))
    assert line in str(problem.value)
    assert "\n" not in str(problem.value)
    assert str(problem.value).startswith("campaign.toml: ")
