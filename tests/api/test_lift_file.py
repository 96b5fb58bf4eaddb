"""Lift files: the library's examples are read, and what is wrong with a file of one's own is said in one line."""

import re
from pathlib import Path

import numpy as np
import pytest

from stillhook.engine.pack.programme import pack_programme
from stillhook.errors import StillhookError
from stillhook.formats.lift_file import lifts, load_lift

GOOD = """
crane = "nov-250t"
vessel = "supply-vessel-82m"
payload = "manifold-60t"
start_depth = "-3 m"
[sea]
wave = "jonswap Hs=1 m Tp=7 s"
heading = "180 deg"
[tip]
at = "x=-10 m, y=-14 m, z=25 m"
[water]
depth = "200 m"
[[phase]]
mode = "splash"
speed = "12 m/min"
depth = "20 m"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "lift.toml"
    path.write_text(text)
    return path


def changed(folder: Path, old: str, new: str) -> Path:
    assert old in GOOD
    return written(folder, GOOD.replace(old, new))


@pytest.mark.slow
@pytest.mark.parametrize("name", lifts())
def test_every_lift_of_the_library_can_be_packed(name):
    file = load_lift(name)
    rows = pack_programme(file.crane, file.lift).rows
    assert len(rows) == len(file.lift.programme)
    assert file.lift.waves is not None
    assert file.lift.waves.duration >= file.lift.duration


@pytest.mark.slow
def test_a_lift_goes_to_3000_m_and_lands():
    lift = load_lift("anchor-to-3000m").lift
    assert lift.depth == 3000.0
    assert [s.mode.value for s in lift.programme] == ["splash", "ahc", "ahc", "landing"]


@pytest.mark.slow
def test_the_water_at_the_load_and_the_tip_above_it_come_from_one_sea(tmp_path):
    """In waves far longer than the ship the tip rides on the water."""
    text = GOOD.replace("jonswap Hs=1 m Tp=7 s", "jonswap Hs=1 m Tp=22 s gamma=7").replace("200 m", "3000 m")
    lift = load_lift(written(tmp_path, text), duration="20 min").lift
    t = lift.waves.dt * np.arange(len(lift.waves.eta))
    s = lift.tip.sample(t)[0]
    assert np.corrcoef(s, lift.waves.eta)[0, 1] > 0.98
    assert np.std(s) == pytest.approx(0.25, rel=0.1)


@pytest.mark.slow
def test_a_seed_makes_another_sea_and_the_same_seed_the_same(tmp_path):
    path = written(tmp_path, GOOD)
    first, again, other = (load_lift(path, seed=s).lift.waves.eta for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(np.corrcoef(first, other)[0, 1]) < 0.5


@pytest.mark.slow
def test_a_run_is_as_long_as_the_programme_takes_and_some_more(tmp_path):
    assert load_lift(written(tmp_path, GOOD)).lift.duration > 23.0 / 0.2 + 30.0
    assert load_lift(written(tmp_path, GOOD), duration="5 min").lift.duration == 300.0


def test_a_motion_may_stand_in_place_of_vessel_and_sea(tmp_path):
    text = GOOD.replace('vessel = "supply-vessel-82m"\n', "").replace(
        'at = "x=-10 m, y=-14 m, z=25 m"', 'height = "25 m"\nmotion = "sine 1 m 9 s"'
    )
    text = re.sub(r"\[sea\][^\[]*", "", text)
    lift = load_lift(written(tmp_path, text)).lift
    assert lift.waves is None
    assert lift.tip.sample(np.array([2.25]))[0] == pytest.approx(1.0)


def test_a_boom_gives_place_and_height_of_the_tip(tmp_path):
    boom = '[boom]\npedestal = ["-10 m", "-6 m", "12 m"]\nslew = "270 deg"\nmain = ["25 m", "60 deg"]\n'
    lift = load_lift(changed(tmp_path, '[tip]\nat = "x=-10 m, y=-14 m, z=25 m"\n', boom)).lift
    assert lift.h_tip == pytest.approx(12.0 + 25.0 * np.sin(np.radians(60.0)))


def test_a_payload_may_be_described_in_the_file(tmp_path):
    own = '[payload]\nname = "lid"\nmass = "30 t"\nshape = "plate"\nlength = "6 m"\nwidth = "4 m"\nheight = "0.5 m"\n'
    text = GOOD.replace('payload = "manifold-60t"\n', "") + own
    assert load_lift(written(tmp_path, text)).lift.payload.mass == 30e3


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('crane = "nov-250t"', 'crane = "nov-25t"', 'No crane "nov-25t"'),
        ('payload = "manifold-60t"', 'payload = "manifold"', 'No payload "manifold": the library has'),
        ('vessel = "supply-vessel-82m"', 'vessel = "boat"', 'vessel = "boat": neither a file next to the lift file'),
        ('vessel = "supply-vessel-82m"\n', "", "vessel: missing"),
        ('start_depth = "-3 m"\n', "", "start_depth: missing"),
        ('start_depth = "-3 m"', "start_depth = -3", "start_depth"),
        ('start_depth = "-3 m"', 'start_depth = "-3 m"\nspeed = "4 m/s"', "speed: unknown field"),
        ("Hs=1 m", "Hs=1 t", "Hs"),
        ("Hs=1 m", "Hs=0 m", "Hs"),
        ('heading = "180 deg"\n', "", "heading"),
        ('heading = "180 deg"', "heading = 180", "heading"),
        ('heading = "180 deg"', 'heading = "180 deg"\nseed = -1', "sea.seed = -1: it must be greater than or equal to"),
        ('heading = "180 deg"', 'heading = "180 deg"\nseed = true', "seed = true"),
        ('heading = "180 deg"', 'heading = "180 deg"\nspread = "wide"', 'sea.spread = "wide": it must be a number'),
        ('heading = "180 deg"', 'heading = "180 deg"\nspraed = 2', "spraed: unknown field"),
        (", z=25 m", "", "tip: its height above the water is missing"),
        ('at = "x=-10 m, y=-14 m, z=25 m"', 'height = "25 m"', "tip: its place is missing"),
        (", z=25 m", ', z=25 m"\nheight = "25 m', "tip.height: given together with z in tip.at"),
        ('depth = "200 m"\n', "", "water.depth: missing"),
        ('depth = "200 m"', 'depth = "-200 m"', "depth"),
        ('mode = "splash"', 'mode = "plunge"', "mode"),
        ('depth = "20 m"', "landed = true\ndepth = '20 m'", "depth and landed ends it"),
        ('depth = "20 m"', 'end_tension = "200 kN"', "duration: missing, and only the run can determine when phase 1"),
        (
            '[tip]\nat = "x=-10 m, y=-14 m, z=25 m"',
            '[tip]\nheight = "20 m"\nmotion = "sine 1 m 9 s"',
            "vessel: given together with tip.motion",
        ),
        ("[[phase]]", "[phase]", "phase: write a list of tables, [[phase]]"),
        ("[[phase]]", "[[phas]]", "phas: unknown field"),
        ("[water]", "[water", "not valid TOML"),
        ('depth = "200 m"', 'depth = "1e9 m"', 'water.depth = "1e9 m": it must be less than or equal to 12000 m'),
        ('depth = "200 m"', 'depth = "0 m"', 'water.depth = "0 m": it must be greater than 0'),
        ('depth = "200 m"', 'depth = "200 m"\nrho = "1 kg/m^3"', 'water.rho = "1 kg/m^3": it must be greater than or'),
        ('speed = "12 m/min"', 'speed = "1000 m/s"', "phase 1: speed = "),
        ("z=25 m", "z=-25 m", "tip: its height -25 m is not above the water"),
        ('start_depth = "-3 m"', 'start_depth = "-3 m"\nduration = "20 s"', "duration = 20 s: too short for waves at"),
        ('wave = "jonswap Hs=1 m Tp=7 s"', 'wave = "46042w1996.txt"', "no such file next to the lift file"),
        ('heading = "180 deg"', 'heading = "180 deg"\nrecord = "3"', "belongs to a file of measured waves"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_that_names_the_file(tmp_path, old, new, says):
    path = changed(tmp_path, old, new)
    with pytest.raises(StillhookError) as error:
        load_lift(path)
    assert "\n" not in str(error.value)
    assert says in str(error.value)
    assert str(error.value).startswith("lift.toml")


def test_a_name_that_is_none_lists_the_lifts_there_are():
    with pytest.raises(
        StillhookError, match=r'No lift "anchor-to-300m": the library has .*did you mean "anchor-to-3000m"'
    ):
        load_lift("anchor-to-300m")


def test_a_seed_belongs_to_waves(tmp_path):
    text = re.sub(r"\[sea\][^\[]*", "", GOOD.replace('vessel = "supply-vessel-82m"\n', ""))
    text = text.replace('at = "x=-10 m, y=-14 m, z=25 m"', 'height = "25 m"\nmotion = "sine 1 m 9 s"')
    with pytest.raises(StillhookError, match=r"belongs to waves, and the file has no \[sea\]"):
        load_lift(written(tmp_path, text), seed=3)


def test_an_empty_file_is_told_what_a_lift_file_has(tmp_path):
    with pytest.raises(StillhookError, match=r"lift.toml: empty. A lift file names crane, payload, start_depth"):
        load_lift(written(tmp_path, " \n"))


def test_waves_may_be_a_record_of_a_measured_file(tmp_path):
    """Four records of an NDBC file of our own, as it is laid out: hour, bands, densities."""
    bands = [0.05, 0.08, 0.10, 0.12, 0.15, 0.20, 0.25, 0.30]
    rows = ["#YY  MM DD hh mm " + " ".join(f"{f:.4f}" for f in bands)]
    rows += [
        f"2020 01 01 {h:02d} 00 " + " ".join(["0.00", "1.00", "6.00", "8.00", "4.00", "2.00", "1.00", "0.50"])
        for h in range(4)
    ]
    (tmp_path / "waves.txt").write_text("\n".join(rows) + "\n")
    path = changed(tmp_path, 'wave = "jonswap Hs=1 m Tp=7 s"', 'wave = "waves.txt"\nrecord = "2020-01-01T02:00"')
    file = load_lift(path)
    assert np.std(file.lift.waves.eta) == pytest.approx(np.sqrt(file.sea.moment(0)), rel=0.05)
    assert "2020-01-01T02:00:00Z" in file.place


def test_deep_water_motions_over_shallow_water_are_noted(tmp_path):
    text = GOOD.replace("200 m", "30 m").replace("Tp=7 s", "Tp=12 s")
    (note,) = load_lift(written(tmp_path, text)).notes
    assert "are for deep water; 30 m are shallow to waves of 12 s" in note
    assert not load_lift(written(tmp_path, GOOD)).notes


def test_a_compensator_is_of_the_library_with_what_the_file_changes(tmp_path):
    lift = load_lift(changed(tmp_path, "[sea]", '[compensator]\nunit = "phc-60t"\np_0 = "90 bar"\n[sea]')).lift
    assert lift.compensator.name == "phc-60t"
    assert lift.compensator.p_0 == pytest.approx(9e6)
    assert load_lift(changed(tmp_path, "[sea]", '[compensator]\nunit = "phc-60t"\n[sea]')).lift.compensator.p_0 > 1e7
    assert load_lift(written(tmp_path, GOOD)).lift.compensator is None


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ('unit = "phc-6t"', 'No compensator "phc-6t": the library has'),
        ('unit = "phc-60t"\nstrok = "3 m"', 'unknown field; did you mean "stroke"?'),
        ('unit = "phc-60t"\nV_0 = "100 L"', "no gas would be left"),
        ('unit = "phc-60t"\np_0 = "-3 bar"', 'lift.toml: compensator.p_0 = "-3 bar": it must be greater than 0.'),
        ('unit = "phc-60t"\nstroke = "0 m"', 'lift.toml: compensator.stroke = "0 m": it must be greater than 0.'),
        ('unit = "phc-60t"\nn = nan', "lift.toml: compensator.n = nan: it must be a finite number."),
        ('stroke = "3 m"', "lift.toml: compensator.area: missing"),
        ("unit = 3", "give a name of the library, or the path of a file."),
    ],
)
def test_a_wrong_compensator_is_said_in_one_line(tmp_path, table, says):
    with pytest.raises(StillhookError) as problem:
        load_lift(changed(tmp_path, "[sea]", f"[compensator]\n{table}\n[sea]"))
    assert says in str(problem.value)
    assert str(problem.value).startswith("lift.toml:")
    assert "\n" not in str(problem.value)
