"""`stillhook tip` as a user meets it."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests import commands

from stillhook.base.gateway.named_files import VARIABLE
from stillhook.cli import run
from stillhook.sea.motion.text import motion_from_json
from stillhook.variables import BY_NAME

WAVE = "jonswap Hs=1 m Tp=8 s gamma=3.3"
AT = "x=-20 m, y=-18 m"
WAVES = ("--wave", WAVE, "--heading", "0 deg")
HEAD_ON = ("--at", AT, *WAVES)


@pytest.fixture
def vessel(shared_data: Path) -> str:
    return str(shared_data / "vessel_mss_supply" / "input.re1")


@pytest.fixture
def no_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of the other files that are written: the picture takes longest and is looked at elsewhere."""
    monkeypatch.setattr("stillhook.report.save.tip_figure", lambda *given: None)
    monkeypatch.setattr("stillhook.report.kit.save", lambda figure, path: path.touch())


@pytest.fixture
def answer(capsys: pytest.CaptureFixture[str]) -> Callable[..., dict]:
    return lambda *arguments: commands.answer(capsys, "tip", *arguments)


@pytest.fixture
def refusal(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    return lambda *arguments: commands.refusal(capsys, "tip", *arguments)


@pytest.fixture
def beam(vessel: str) -> tuple[str, ...]:
    """The tip in beam sea."""
    return (vessel, "--at", AT, "--wave", WAVE, "--heading", "90 deg")


def test_the_line_of_the_handbook_gives_the_tips_numbers(answer, vessel):
    found = answer(vessel, "--at", AT, "--wave", WAVE, "--heading", "180 deg")
    assert found["T_z"] == pytest.approx(2.0 * math.pi * found["sigma_z"] / found["sigma_v"])
    assert found["sea"]["H_m0"] == pytest.approx(1.0)
    assert 0.14 < found["sigma_z"] < 0.15
    assert "ends at a period of 2 s" in found["notes"][0]


def test_every_number_has_its_row_among_the_variables(answer, beam):
    found = answer(*beam)
    for name, value in found.items():
        if isinstance(value, float):
            assert name in BY_NAME, name


@pytest.mark.slow
def test_headings_may_be_written_with_their_unit_and_waves_may_bring_their_own(answer, vessel):
    plain, unit, own = (
        answer(vessel, "--at", AT, "--wave", wave, *heading)["sigma_z"]
        for wave, heading in (
            (WAVE, ("--heading", "135 deg")),
            (WAVE, ("--heading", "0.375 rev")),
            (f"{WAVE} heading=135 deg", ()),
        )
    )
    assert plain == unit == own


@pytest.mark.slow
def test_short_crested_waves_differ_from_long_crested_ones(answer, vessel):
    long, short = (
        answer(vessel, "--at", AT, "--wave", WAVE, "--heading", "75 deg", *more)["sigma_z"]
        for more in ((), ("--spread", "4"))
    )
    assert 0.8 * long < short < 0.99 * long


@pytest.mark.slow
def test_a_crane_in_place_of_a_tip_is_the_tip_that_it_has(answer, beam, vessel):
    crane = ("--boom", "x=-20 m, y=-6 m, z=15 m, slew 270 deg, main 24 m 60 deg")
    by_crane = answer(vessel, *crane, "--wave", WAVE, "--heading", "90 deg")
    by_hand = answer(*beam)
    assert by_crane["sigma_a"] == pytest.approx(by_hand["sigma_a"])
    assert by_crane["at"]["z"] == pytest.approx(15.0 + 24.0 * math.sqrt(3.0) / 2.0)


@pytest.mark.slow
def test_all_headings_make_a_table_with_starboard_and_port_in_their_places(answer, capsys, vessel):
    found = answer(vessel, "--at", AT, "--wave", WAVE, "--heading", "all")
    by_heading = {round(math.degrees(row["beta"])): row["sigma_v"] for row in found["headings"]}
    assert len(by_heading) == 24
    assert by_heading[90] > 1.8 * by_heading[270]  # tip to starboard, waves from starboard
    assert run(["tip", vessel, "--at", AT, "--wave", WAVE, "--heading", "all", "--verbose"]) == 0
    assert "sigma_v" in capsys.readouterr().out


@pytest.mark.slow
def test_out_writes_picture_series_and_summary_that_agree(answer, beam, tmp_path):
    out = tmp_path / "tip"
    found = answer(*beam, "--duration", "10 min", "--out", str(out))
    assert sorted(p.name for p in out.iterdir()) == [
        "stillhook-manifest.json",
        "summary.json",
        "tip.csv",
        "tip.json",
        "tip.png",
    ]
    motion = motion_from_json((out / "tip.json").read_text())
    assert motion.duration == found["series"]["repeat"] == 600.0
    rows = [line.split(",") for line in (out / "tip.csv").read_text().splitlines()[2:]]
    t, s = np.array(rows, dtype=float).T
    np.testing.assert_allclose(motion.sample(t)[0], s, atol=1e-6)
    assert np.abs(motion.sample(t)[1]).max() == pytest.approx(found["series"]["v_max"])
    assert json.loads((out / "summary.json").read_text())["sigma_z"] == found["sigma_z"]


@pytest.mark.slow
@pytest.mark.usefixtures("no_picture")
def test_the_same_seed_writes_the_same_series_and_another_does_not(answer, beam, tmp_path):
    given = (*beam, "--duration", "5 min")
    texts = []
    for seed in ("4", "5", "4"):
        answer(*given, "--seed", seed, "--out", str(tmp_path))
        texts.append((tmp_path / "tip.json").read_text())
    assert texts[0] == texts[2] != texts[1]


@pytest.mark.usefixtures("no_picture")
def test_exact_rotations_are_told_beside_the_linear_motion(answer, vessel, tmp_path):
    wave = "jonswap Hs=3 m Tp=9 s gamma=1"
    series = ("--duration", "10 min", "--exact", "--out", str(tmp_path / "o"))
    found = answer(vessel, "--at", f"{AT}, z=30 m", "--wave", wave, "--heading", "90 deg", *series)
    assert "off the linear motion" in found["series"]["report"]


@pytest.mark.slow
@pytest.mark.usefixtures("no_picture")
def test_a_case_file_runs_on_the_series_that_was_written(answer, beam, tmp_path):
    from stillhook.formats.case_file import load_case

    answer(*beam, "--duration", "5 min", "--out", str(tmp_path))
    (tmp_path / "case.toml").write_text(
        'crane = "nov-250t"\n[scenario]\nload = "50 t"\ns_w = "100 m"\ntip = { file = "tip.json" }\n'
    )
    case = load_case(tmp_path / "case.toml").case
    assert case.duration == 300.0
    assert case.tip == motion_from_json((tmp_path / "tip.json").read_text())


@pytest.mark.slow
def test_a_log_of_a_motion_sensor_gives_the_same_numbers(answer, refusal, shared_data):
    log = str(shared_data / "ship_motion_palmer" / "NBP1406_seap-2014-08-01.txt")
    at_sensor, at_tip = (answer("--log", log, "--at", at) for at in ("x=0 m, y=0 m, z=0 m", "x=40 m, y=0 m, z=20 m"))
    assert at_sensor["sigma_z"] == pytest.approx(1.0961, rel=0.01)
    assert at_tip["sigma_v"] > at_sensor["sigma_v"]
    assert "read as" in at_tip["notes"][0]
    assert "--at: z is missing" in refusal("--log", log, "--at", AT)
    assert 'as --at "x=-20 m' in refusal("--log", log)


@pytest.mark.slow
def test_a_case_file_says_how_a_log_is_read(answer, refusal, shared_data, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(shared_data))
    log = shared_data / "ship_motion_palmer" / "NBP1406_seap-2014-08-01.txt"
    tip = f'{{ file = "{log}", position = ["40 m", "0 m", "20 m"], start = "60 s", heave = "down" }}'
    case = commands.case_file(tmp_path, tip=tip)
    assert answer("--log", case)["sigma_v"] == pytest.approx(
        answer("--log", str(log), "--at", "x=40 m, y=0 m, z=20 m")["sigma_v"], rel=0.05
    )
    assert "moved. Write scenario.tip.max_gap in the case file of --log" in refusal("--log", case, "--max-gap", "3 s")


@pytest.mark.slow
@pytest.mark.usefixtures("no_picture")
def test_the_series_that_was_written_has_the_numbers_of_the_spectra(answer, refusal, beam, tmp_path):
    given = (*beam, "--duration", "40 min", "--out", str(tmp_path))
    spectra, series = (
        answer(*given),
        answer("--log", str(tmp_path / "tip.json"), "--duration", "40 min"),
    )
    for name in ("sigma_z", "sigma_v", "sigma_a", "T_z", "v_mpm"):
        assert series[name] == pytest.approx(spectra[name], rel=0.01), name  # 10 s of 40 min are left out
    assert "holds the motion of a tip already" in refusal("--log", str(tmp_path / "tip.json"), "--at", f"{AT}, z=1 m")


@pytest.mark.thorough
def test_measured_directions_are_turned_by_the_ships_heading(answer, refusal, beam, vessel, tmp_path, monkeypatch):
    """A sea that comes from the east is on the starboard beam of a ship that heads north, and dead ahead of one that heads east."""
    from stillhook.sea.spectra.directions import Directional
    from stillhook.sea.spectra.measured import SpectrumSeries

    omega, width = np.linspace(0.5, 1.2, 8), np.full(8, 0.1)
    theta = np.radians(np.arange(0.0, 360.0, 30.0))
    share = np.zeros((1, 8, 12))
    share[:, :, 3] = 1.0
    time, S = np.array(["2020-01-01T00:00:00"], dtype="datetime64[s]"), np.full((1, 8), 0.3)
    series = SpectrumSeries(omega, width, S, time, np.array([True]), "buoy", directional=Directional(theta, share))
    monkeypatch.setattr("stillhook.formats.waves.wavespectra.read_sea", lambda path: series)
    file = tmp_path / "buoy.txt"
    file.write_text("")
    at = (vessel, "--at", AT, "--wave", str(file), "--record", "0")
    for ship, heading in (("0 deg", "90 deg"), ("90 deg", "180 deg"), ("180 deg", "270 deg")):
        by_ship, by_heading = (
            answer(*at, "--ship", ship)["sigma_z"],
            answer(*at, "--heading", heading)["sigma_z"],
        )
        assert by_ship == pytest.approx(by_heading)
    assert "Give --ship, where the bow points" in refusal(*at)
    assert "already has directions" in refusal(*at, "--ship", "0 deg", "--spread", "4")


@pytest.mark.thorough
def test_measured_spectra_are_taken_record_by_record(answer, refusal, vessel, shared_data, tmp_path):
    """The sea of the record, 38 bands; and what the command asks for when it is not determined enough."""
    buoy = str(shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz")
    at = (vessel, "--at", AT, "--wave", buoy)
    found = answer(*at, "--record", "1996-01-05T12:00", "--heading", "90 deg")
    assert found["sea"]["H_m0"] == pytest.approx(2.46, abs=0.005)
    assert found["sea"]["T_p"] == pytest.approx(1.0 / 0.06)
    assert found["sigma_z"] < 2.0 * found["sea"]["H_m0"] / 4.0
    assert "Choose one with --record" in refusal(*at, "--heading", "90 deg")
    assert "has no directions. Give --heading" in refusal(*at, "--record", "0")
    assert "no directions are taken from it" in refusal(*at, "--record", "0", "--heading", "90 deg", "--ship", "30 deg")
    met = tmp_path / "met.txt"
    met.write_text(
        "#YY  MM DD hh mm WDIR WSPD GST  WVHT   DPD   APD MWD\n#yr  mo dy hr mn degT m/s  m/s     m   sec   sec degT\n"
        "2019 08 01 00 00 999  99.0 99.0  1.50  9.00  6.00 270\n"
    )
    assert "no spectra" in refusal(vessel, "--at", AT, "--wave", str(met), "--record", "0", "--heading", "90 deg")


@pytest.mark.slow
def test_seeds_give_the_largest_values_that_were_met_with_their_intervals(answer, beam, capsys):
    given = (*beam, "--duration", "1 h", "--seeds", "12")
    found = answer(*given)
    for name in ("z_mpm", "v_mpm", "a_mpm"):
        met = found["maxima"][name]
        assert met["low"] < met["value"] < met["high"]
        assert met["value"] == pytest.approx(found[name], rel=0.08)  # twelve seeds
    assert run(["tip", *given, "--verbose"]) == 0
    assert "of 12 seeds (95 %)" in capsys.readouterr().out


def test_the_table_for_people_has_the_numbers_and_where_the_vessel_ends(capsys, vessel):
    assert run(["tip", vessel, "--at", AT, "--wave", WAVE, "--heading", "180 deg", "--verbose"]) == 0
    text = capsys.readouterr().out
    for part in ("sigma_z", "T_z", "most probable maximum", "largest in 3 h", "ends at a period of 2 s", "m/min"):
        assert part in text


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--wave", WAVE, "--heading", "0 deg"), "--at: missing"),
        (("--at", AT, "--heading", "0 deg"), "--wave: missing"),
        (("--at", AT, "--wave", WAVE), "no heading"),
        (("--at", "x=-20, y=-18 m", "--wave", WAVE, "--heading", "0 deg"), "--at: x"),
        (("--at", AT, "--wave", "jonswap Hs=1 Tp=8 s", "--heading", "0 deg"), "Hs"),
        (("--at", AT, "--wave", WAVE, "--heading", "north"), "--heading"),
        (("--at", AT, "--wave", WAVE, "--heading", "180"), '--heading = "180": no unit; write "180 deg"'),
        (("--at", AT, "--wave", WAVE, "--heading", "400 deg"), '--heading = "400 deg": not between 0 deg and 360 deg'),
        (("--at", AT, "--wave", f"{WAVE} heading=-30 deg"), '"-30 deg": not between 0 deg and 360 deg'),
        ((*HEAD_ON, "--spread", "0"), "spread 0"),
        ((*HEAD_ON, "--duration", "1 s"), "too few for a largest value"),
        (
            (*HEAD_ON, "--duration", "-1 s"),
            "--duration -1 s: is not longer than 0 s",
        ),
        (("--at", AT, "--wave", "waves/gone.txt", "--heading", "0 deg"), '--wave "waves/gone.txt": no such file'),
        ((*HEAD_ON, "--boom", "x=0 m"), "--boom: the tip is given by --at already"),
        (("--boom", AT, *WAVES), "is not heel, slew and main boom"),
        (("--boom", f"{AT}, slew 0 deg, main 20 m 50 deg", *WAVES), "--boom: z is missing"),
        (("--boom", f"{AT}, z=5 m, slew 0 deg, main 20 m", *WAVES), "is not a length and an angle"),
        ((*HEAD_ON, "--exact"), "--exact: is for the series"),
        (
            (*HEAD_ON, "--record", "0"),
            "--record: belongs to a file of measured waves",
        ),
        ((*HEAD_ON, "--seeds", "2"), "seeds = 2: give 5 to 1000"),
        (("--at", AT, "--wave", WAVE, "--heading", "all", "--seeds", "20"), "--seeds: is for one heading"),
        (("--at", AT, "--wave", f"{WAVE} heading=20 deg", "--heading", "all"), "already have a heading"),
        (("--at", AT, "--wave", WAVE, "--log", "x.csv"), "belongs to a vessel in waves"),
        (
            (*HEAD_ON, "--seed", "-1", "--out", "never-made"),
            "whole number of 0 or more",
        ),
        (
            (*HEAD_ON, "--amplitudes", "wild", "--out", "never-made"),
            "not one of fixed, rayleigh",
        ),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(refusal, vessel, tmp_path, monkeypatch, arguments, text):
    monkeypatch.chdir(tmp_path)
    assert text in refusal(vessel, *arguments)
    assert not list(tmp_path.iterdir())


def test_a_vessel_that_is_not_there_or_not_given_is_one_line(refusal):
    assert "VESSEL: missing" in refusal()
    assert "no-such" in refusal("no-such.re1", "--at", AT, "--wave", WAVE, "--heading", "0 deg")


LIFT = """\
crane = "nov-250t"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
start_depth = "-10 m"
tip.at = "x=-15 m, y=-24 m, z=36 m"
water.depth = "300 m"
rigging.carrier = "another-vessel"
sea = { wave = "jonswap Hs=2 m Tp=8 s", heading = "90 deg" }
other_vessel = { vessel = "supply-vessel-82m", at = "x=-20 m, y=0 m" }
phase = [{ name = "lift-off", kind = "lift-off", speed = "30 m/min" }]
"""


@pytest.mark.usefixtures("no_picture")
def test_a_lift_file_gives_tip_waves_and_the_vessel_that_the_tip_moves_against(answer, tmp_path):
    file = tmp_path / "lift.toml"
    file.write_text(LIFT, encoding="utf-8")
    found = answer(str(file), "--duration", "1 h", "--out", str(tmp_path / "out"))
    alone = answer(
        "construction-vessel-130m",
        "--at",
        "x=-15 m, y=-24 m",
        *("--wave", "jonswap Hs=2 m Tp=8 s"),
        *("--heading", "90 deg", "--duration", "1 h"),
    )
    assert found["sigma_z"] == alone["sigma_z"]
    assert found["against"]["sigma_v"] > 1.2 * found["sigma_v"]
    rows = np.loadtxt(tmp_path / "out" / "tip.csv", delimiter=",", skiprows=2)
    assert rows[:, 1].std() == pytest.approx(found["sigma_z"], rel=0.02)
    assert rows[:, 2].std() == pytest.approx(found["against"]["sigma_z"], rel=0.02)
    headings = answer(str(file), "--wave", "jonswap Hs=2 m Tp=8 s", "--heading", "all")["headings"]
    across = next(row for row in headings if row["beta"] == pytest.approx(math.pi / 2.0))
    assert across["against"]["sigma_v"] == pytest.approx(found["against"]["sigma_v"])


def test_waves_of_a_lift_file_take_no_heading_of_the_line(refusal, tmp_path):
    file = tmp_path / "lift.toml"
    file.write_text(LIFT, encoding="utf-8")
    assert "--heading: belongs to --wave" in refusal(str(file), "--heading", "90 deg")
    assert "--heading all: turns the waves of --wave" in refusal(str(file), "--heading", "all")
