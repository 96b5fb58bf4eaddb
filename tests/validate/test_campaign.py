"""A validation campaign's file: what it may hold, and one clear line for everything else."""

import datetime
import math

import pytest

from stillhook.errors import StillhookError, ValidateError
from stillhook.spec.scenario import Mode
from stillhook.validate.data_set.campaign import Kind, load_campaign
from stillhook.validate.validation import validate

TOP = 'title = "Trials"\ndate = 2026-11-21\ncrane = "nov-250t"\n'
SIGNALS = '[signals]\ntime = { column = "Time", unit = "s" }\ns_w = { column = "w", unit = "m" }\nmode = { column = "State" }\n'
TEST = '[[test]]\nname = "1"\nlog = "x.csv"\nkind = "ahc"\nload = "82 t"\n'


def loaded(folder, text):
    (folder / "x.csv").write_text("Time,w,State\n")
    (folder / "c.toml").write_text(text)
    return load_campaign(folder / "c.toml")


def test_everything_that_a_file_states_is_read_in_si(tmp_path):
    campaign = loaded(
        tmp_path,
        f'{TOP}delay = "40 ms"\nremarks = ["calm", "no wind"]\n{SIGNALS}{TEST}s_w = "487 m"\nmode = "ssc"\nstart = "10 s"\nend = "2 min"\n'
        'water = { volume = "10 m^3", added_mass = "20 t", C_D = 1.2, area = "12 m^2" }\n'
        '[[test]]\nname = "2"\nlog = "x.csv"\nkind = "limits"\n',
    )
    assert (campaign.title, campaign.date) == ("Trials", datetime.date(2026, 11, 21))
    assert (campaign.delay, campaign.synthetic) == (0.04, False)
    assert campaign.remarks == ("calm", "no wind")
    assert (campaign.criteria.name, campaign.crane.name) == ("paper-f", "nov-250t")
    first, second = campaign.tests
    assert (first.load, first.s_w, first.mode, first.start, first.end) == (82e3, 487.0, Mode.SSC, 10.0, 120.0)
    assert first.water is not None
    assert first.water.added_mass == 20e3
    assert (second.kind, second.load, second.s_w, second.mode) == (Kind.LIMITS, None, None, None)
    assert (second.start, second.end) == (-math.inf, math.inf)
    assert campaign.of(Kind.LIMITS) == (second,)
    assert first.mapping is not None
    assert first.mapping["s_w"].unit == "m"


def test_modes_take_numbers_and_words(tmp_path):
    (test,) = loaded(tmp_path, f'{TOP}{SIGNALS}[modes]\n5 = "ns"\n-1 = "manual"\n"AHC on" = "ssc"\n{TEST}').tests
    assert test.modes[5.0] is Mode.NS
    assert test.modes[-1.0] is Mode.MANUAL
    assert test.mapping is not None
    ((word, number),) = test.mapping["mode"].words
    assert word == "AHC on"
    assert test.modes[number] is Mode.SSC


def test_without_a_table_of_modes_the_numbers_are_those_of_stillhook(tmp_path):
    (test,) = loaded(tmp_path, f"{TOP}{SIGNALS}{TEST}").tests
    assert [test.modes[float(i)] for i in range(len(Mode))] == list(Mode)


@pytest.mark.thorough
def test_a_test_may_have_a_mapping_of_its_own_and_a_part_of_a_log(tmp_path):
    text = (
        f'{TOP}{SIGNALS}{TEST}end = "10 s"\n'
        + TEST.replace('"1"', '"2"')
        + 'start = "10 s"\n[test.signals]\ntime = "t [s]"\ns_w = "x [m]"\n'
    )
    first, second = loaded(tmp_path, text).tests
    assert first.mapping is not None
    assert second.mapping is not None
    assert (first.mapping["s_w"].column, second.mapping["s_w"].column) == ("w", "x [m]")


@pytest.mark.parametrize("text", ['synthetic = true\ntitle = "T"\n', 'title = "SYNTHETIC trials"\n'])
def test_a_synthetic_campaign_is_marked_by_a_flag_or_its_title(tmp_path, text):
    assert loaded(tmp_path, f"{text}{TOP.split(chr(10), 1)[1]}{SIGNALS}{TEST}").synthetic


WATER = f"{TEST}water = {{ volume = "
PAYLOAD = 'payload = "82 t"\ndepth = '
REFUSED = [  # what a good file has, what stands there instead, what is said of it
    ("date = 2026-11-21\n", "", "c.toml: date: missing (date of the certificate). Add it."),
    ("2026-11-21", '"2026-11-21"', "it must be a date without quotes, such as 2026-11-21"),
    ("2026-11-21", "2026-11-21T10:00:00", "it must be a date without quotes"),
    ('crane = "nov-250t"\n', "", "crane: missing (library name or crane file"),
    ("nov-250t", "nov-251t", 'did you mean "nov-250t"?'),
    ('title = "Trials"', "title = 3", "title = 3: it must be a text"),
    (
        'title = "Trials"',
        'titel = "Trials"',
        'titel: unknown field; did you mean "title"? Allowed: title, date, crane,',
    ),
    ('title = "Trials"', 'delay = "-40 ms"', "it must be greater than or equal to 0."),
    ('title = "Trials"', "delay = 0.04", 'write it as text with its unit, "0.04 s"'),
    ('title = "Trials"', 'remarks = "x"', "it must be a list"),
    ('title = "Trials"', 'synthetic = "yes"', "it must be true or false"),
    ('title = "Trials"', 'criteria = "paper-g"', 'No criteria "paper-g": the library has'),
    ('title = "Trials"', "modes = [1]", "modes = [1]: it must be a table."),
    (TEST, f'[modes]\n5 = "super"\n{TEST}', "modes.5 = \"super\": it must be 'manual', 'level-1', 'level-2', 'ns'"),
    (TEST, f"[modes]\n5 = 3\n{TEST}", "modes.5 = 3: it must be 'manual'"),
    ("[[test]]", 's_tip = { column = "w", unit = "m" }\n[[test]]', "s_tip and s_w both refer to column"),
    ('unit = "m"', 'unit = "kg"', 'signals.s_w.unit = "kg" is not one of m, cm, mm, km.'),
    (TEST, "", "test: missing (one [[test]] table for each log). Add it."),
    (TEST, "[test]\nname = '1'\n", "test: write a list of tables, [[test]]."),
    ('name = "1"', "name = 1", "test 1: name = 1: it must be a text ("),
    ('kind = "ahc"', 'kind = "heave"', "it must be 'ahc', 'limits' or 'dynamics'."),
    ('kind = "ahc"\n', "", 'test "1": kind: missing (heave compensation, speed limit, or'),
    ("x.csv", "y.csv", 'test "1": log = "y.csv": no such file next to this file. Check the path.'),
    ('"82 t"', "82", 'test "1": load = 82: a bare number; write it as text with its unit, "82 t"'),
    ("82 t", "300 t", 'load = "300 t": "nov-250t" is rated for 0 t to 250 t. Check the load.'),
    (TEST, f'{TEST}s_w = "9 km"\n', 's_w = "9 km": "nov-250t" has 0 m to 2831 m of wire.'),
    (TEST, f'{TEST}mode = "sssc"\n', 'mode = "sssc": it must be'),
    (TEST, f'{TEST}mode = "manual"\n', 'a test of kind "ahc" needs a compensating mode.'),
    (TEST, f'{TEST}start = "5 s"\nend = "3 s"\n', 'end = "3 s": must come after start 5 s.'),
    (TEST, f'{TEST}laod = "3 t"\n', 'laod: unknown field; did you mean "load"?'),
    (TEST, f'{TEST}water = "1 m^3"\n', 'water = "1 m^3": it must be a table, with volume'),
    (TEST, f'{TEST}water = {{ volum = "1 m^3" }}\n', 'water.volum: unknown field; did you mean "volume"?'),
    (TEST, f'{WATER}"-1 m^3" }}\n', 'water.volume = "-1 m^3": it must be greater than 0.'),
    (TEST, f'{WATER}"100 m^3" }}\n', "a payload of 82 t floats. Check load and volume."),
    (TEST, f'e_c_measured = {{ column = "w", unit = "m" }}\n{TEST}', "s_w and e_c_measured both refer to column"),
    (TEST, f'{TEST}payload = "60 t"\n', "load and payload: both stated."),
    (TEST, f'{TEST}depth = "467 m"\n', "load with depth: load already includes the weight of the wire out."),
    ("load", "payload", "payload: needs depth or h_tip for the weight of the wire out."),
    ('load = "82 t"', 'depth = "467 m"', "depth: stated without payload. State payload"),
    ('load = "82 t"', f'{PAYLOAD}"-1 m"', 'depth = "-1 m": it must be greater than or equal to 0'),
    ('load = "82 t"', 'payload = "300 t"\ndepth = "1 m"', "is rated for 0 t to 250 t. Check the payload."),
    (TEST, TEST + TEST, 'the name "1" is given twice. Give every test its own.'),
    (TEST, TEST + TEST.replace('"1"', '"2"'), 'log = "x.csv" is that of test "1" as well, and would count twice.'),
]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("head", "synthetic"),
    [
        ("# SYNTHETIC: simulated, measured on no crane\n", True),
        ("Crane 7\n\n// log 3, SYNTHETIC\n", True),
        ('"# SYNTHETIC";;\n', True),
        ("# of a crane with ropes of synthetic fibre\n", False),
        ("", False),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_logs_that_say_that_they_are_synthetic_are(tmp_path, head, synthetic, encoding):
    campaign = loaded(tmp_path, f"{TOP}synthetic = false\n{SIGNALS}{TEST}")
    assert not campaign.synthetic
    (tmp_path / "x.csv").write_text(f"{head}Time,SYNTHETIC rope,State\n", encoding=encoding)
    campaign = load_campaign(tmp_path / "c.toml")
    assert campaign.synthetic is synthetic
    assert campaign.remarks == (("SYNTHETIC, as the head of x.csv says.",) if synthetic else ())


@pytest.mark.parametrize(("was", "instead", "told"), REFUSED)
def test_everything_else_is_one_line_that_names_file_and_field(tmp_path, was, instead, told):
    text = f"{TOP}{SIGNALS}{TEST}"
    assert was in text
    with pytest.raises(StillhookError) as caught:
        loaded(tmp_path, text.replace(was, instead))
    line = str(caught.value)
    assert line.startswith("c.toml: ")
    assert told in line
    assert "\n" not in line


@pytest.mark.parametrize(("text", "told"), [("crane = \n", r"c\.toml: not valid TOML"), ("", r"c\.toml: empty")])
def test_a_file_that_is_no_toml_is_told(tmp_path, text, told):
    with pytest.raises(StillhookError, match=told):
        loaded(tmp_path, text)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "told"),
    [
        ((5, None), "campaign = 5: it must be the path"),
        (("c.toml", 0), "steps = 0: it must be a list of some of 0, 1"),
        (("c.toml", [9]), "steps = [9]: it must be a list"),
        (("c.toml", "0"), 'steps = "0": it must be a list'),
    ],
)
def test_python_is_told_what_it_may_give(tmp_path, given, told):
    loaded(tmp_path, f"{TOP}{SIGNALS}{TEST}")
    campaign, steps = given
    with pytest.raises(ValidateError) as caught:
        validate(tmp_path / campaign if isinstance(campaign, str) else campaign, steps=steps)
    assert str(caught.value).startswith(told)
