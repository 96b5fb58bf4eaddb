"""Seas, vessels, payloads and lifts in careless hands: each slip ends in one line that says where, what came and what to do."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.commands import refusal

from stillhook.cli import run as command
from stillhook.formats.vessel.csv import write_rao_csv
from stillhook.sea.vessel.rao import Rao

ANCHOR = 'name = "a"\nmass = "92 t"\nshape = "suction-anchor"\ndiameter = "6.5 m"\nheight = "11 m"\nwall = "35 mm"\nroof = "0.4 m"\nhatch = 0.05\n'
LEVELS = "".join(f'[[levels]]\nh = "{h} m"\nV = "{2 * h} m^3"\nA33 = "{70 * h} t"\nA_p = "90 m^2"\n' for h in (0, 1, 4))
NDBC = "YY MM DD hh   .030   .040   .050\n96 01 01 00   1.00   2.00   1.00\n96 01 01 01   0.00   0.00   0.00\n"


def told(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert command([str(a) for a in arguments]) == 0
    return capsys.readouterr().out


def file(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("waves", "said"),
    [
        ("", "no waves are given"),
        ("pm Hs=1 m Tp=8 s +", 'a "+" has a spectrum on one side only'),
        ("+ pm Hs=1 m Tp=8 s", 'a "+" has a spectrum on one side only'),
        ("pm Hs=1 m Tp=8 s+pm Hs=1 m Tp=4 s", 'Write " + " between spectra'),
        ("pm Hs=1 m Tp=8 s heading=10 deg", "Leave it out here"),
    ],
)
def test_a_slip_in_a_sum_of_waves_is_named(waves, said, capsys):
    assert said in refusal(capsys, "sea", waves)


def test_files_that_are_no_spectra_say_so_shortly(tmp_path, capsys):
    assert "is not a text file" in refusal(capsys, "sea", file(tmp_path / "nul.txt", b"\0" * 5000))
    narrow = "\n".join(line[:19] for line in NDBC.splitlines())
    assert "one band of frequencies is not a spectrum" in refusal(capsys, "sea", file(tmp_path / "one.txt", narrow))


def test_a_calm_is_printed_without_nan(tmp_path, capsys):
    record = ("sea", file(tmp_path / "calm.txt", NDBC), "--record", "1")
    assert "nan" not in told(capsys, *record)
    assert "nan" not in told(
        capsys, "sea", file(tmp_path / "missing.txt", NDBC.replace("1.00", "999.0").replace("0.00", "999.0"))
    )


def test_directions_that_lack_a_file_are_told(tmp_path, capsys):
    for letter in "wdij":
        file(tmp_path / f"46042{letter}1996.txt", NDBC.replace("0.00", "1.00"))
    told_so = told(capsys, "sea", tmp_path / "46042w1996.txt")
    assert "no directions: 46042k1996.txt" in told_so
    assert "no directions" not in told(capsys, "sea", file(tmp_path / "46043w1996.txt", NDBC))


def vessel(path: Path, spike: float = 0.0) -> Path:
    """A buoy that rides on the water, with one heave that is another."""
    omega, beta = np.linspace(0.1, 1.5, 15), np.radians(np.arange(0.0, 360.0, 30.0))
    k, c, s = omega**2 / 9.81, np.cos(beta)[:, None], np.sin(beta)[:, None]
    one = np.ones_like(k)
    H = np.array([-1j * c * one, -1j * s * one, one + 0 * c, -1j * s * k, 1j * c * k, -s * c * k], dtype=complex)
    H[2, 3, 9] += spike
    return write_rao_csv(Rao("buoy", omega, beta, H, origin="centre"), path, source="made here")


@pytest.mark.slow
def test_a_motion_that_no_ship_makes_is_refused_with_its_place(tmp_path, capsys):
    assert command(["vessel", "--check", str(vessel(tmp_path / "rides.csv"))]) == 0
    assert command(["vessel", "--check", str(vessel(tmp_path / "spike.csv", 9e3)), "--verbose"]) == 1
    assert "heave of 9e+03 m/m at 6.28 s and 90 deg is not a ship's motion" in capsys.readouterr().out
    assert "is not a ship's motion" in refusal(capsys, "vessel", tmp_path / "spike.csv")


@pytest.mark.thorough
def test_vessel_files_that_are_none_say_what_they_are(tmp_path, capsys):
    assert "is empty" in refusal(capsys, "vessel", "--check", file(tmp_path / "a.re1", ""))
    assert "is not a text file" in refusal(
        capsys, "vessel", "--check", file(tmp_path / "b.re1", "1 2 3\n".encode("utf-16"))
    )
    titles = " MOTION TRANSFER FUNCTIONS\n Run name:\n Ship name: S\n"
    assert "ends after line 3" in refusal(capsys, "vessel", "--check", file(tmp_path / "c.re1", titles))
    numbers = "\n\n ShipX exported data\n 1025 9.81\n 82800 19200 6000\n"
    assert "Lengths are in m" in refusal(capsys, "vessel", "--check", file(tmp_path / "d.re1", titles + numbers))
    feet = vessel(tmp_path / "e.csv").read_text().replace("heave re [m/m]", "heave re [ft/ft]")
    assert 'has no column "heave re [m/m]", but "heave re [ft/ft]"' in refusal(
        capsys, "vessel", "--check", file(tmp_path / "e.csv", feet)
    )


@pytest.mark.thorough
def test_a_name_beyond_the_terminals_letters_is_shown_in_others(tmp_path):
    ship = vessel(tmp_path / "schön.csv")
    plain = os.environ | {"PYTHONIOENCODING": "ascii"}
    command = [sys.executable, "-c", "from stillhook.cli import main; main()", "vessel", str(ship)]
    done = subprocess.run(command, capture_output=True, env=plain, check=False)
    assert done.returncode == 0, done.stderr
    assert b"sch\\xf6n.csv" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"92 t"', '"92 kg"', "hardly more than air"),
        ('"6.5 m"', '"650 m"', "hardly more than air"),
        ("hatch = 0.05\n", "hatch = 0.05\nseabed = 3\n", "it must be a table, with settlement"),
    ],
)
def test_a_payload_in_a_wrong_unit_is_refused(old, new, said, tmp_path, capsys):
    assert said in refusal(capsys, "payload", file(tmp_path / "p.toml", ANCHOR.replace(old, new)))


def test_parts_are_no_heavier_than_the_whole_and_there_are_some(tmp_path, capsys):
    whole = 'name = "t"\nmass = "150 t"\nshape = "assembly"\n[parts]\n'
    assert "give at least 1" in refusal(capsys, "payload", file(tmp_path / "p.toml", whole))
    part = (
        '[parts.f]\nshape = "frame"\ncount = 2\nmass = "80 t"\ndiameter = "0.8 m"\nlength = "120 m"\nheight = "4 m"\n'
    )
    assert "its parts weigh 160 t, it 150 t" in refusal(capsys, "payload", file(tmp_path / "p.toml", whole + part))
    assert command(["payload", str(file(tmp_path / "p.toml", whole + part.replace("80", "75")))]) == 0


def test_water_in_a_wrong_unit_is_refused(capsys):
    assert "900 to 1300 kg/m^3" in refusal(capsys, "payload", "mud-mat-25t", "--rho", "1.025 kg/m^3")


def test_a_sheet_says_where_every_number_is_from(tmp_path, capsys):
    given = 'name = "m"\nmass = "60 t"\nheight = "4 m"\nC_D = 3.1\nsource = "model test 17"\n'
    out = told(capsys, "payload", "--verbose", file(tmp_path / "levels.toml", given + LEVELS))
    assert "model test 17" in out
    assert "given in" not in out
    assert "DNV" not in out
    out = told(capsys, "payload", "--verbose", file(tmp_path / "anchor.toml", ANCHOR))
    assert all(name in out for name in ("C_D", "C_s", "engaged", "seabed.settlement"))
    assert "mass over that of steel" in out
    assert "e-1" not in out


def test_an_empty_lift_is_not_told_to_be_a_crane(tmp_path, capsys):
    line = refusal(capsys, "lower", file(tmp_path / "l.toml", ""))
    assert "empty" in line
    assert "base =" not in line


TIP = ("tip", "supply-vessel-82m", "--at", "x=-20 m, y=-18 m", "--wave")
JONSWAP = "jonswap Hs=1 m Tp=8 s gamma=3.3"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((JONSWAP, "--heading", "180 deg", "--duration", "1 s"), "duration: it holds 0.12 cycles of the motion"),
        ((JONSWAP, "--heading", "180 deg", "--duration", "10 s", "--out", "x"), "duration 10 s leaves 5 harmonics"),
        ((JONSWAP, "--heading", "180 deg", "--duration", "8760 h", "--out", "x"), "longer than 111 h"),
        ((f"{JONSWAP} heading=10 deg", "--heading", "180 deg"), "already have a heading. Leave it out."),
        ((f"{JONSWAP} heading=10 deg spread=3", "--spread", "4"), "already have a spread. Leave it out."),
    ],
)
def test_options_of_a_tip_that_cannot_count_are_refused(options, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert said in refusal(capsys, *TIP, *options)
    assert not list(tmp_path.iterdir())


def test_a_crane_stands_above_water(capsys):
    crane = ("--boom", "x=-15 m, y=-6 m, z=-15 m, slew 270 deg, main 25 m 60 deg")
    line = refusal(capsys, *TIP[:2], *crane, "--wave", JONSWAP, "--heading", "180 deg")
    assert "its heel is 15 m below still water" in line


@pytest.mark.slow
def test_one_heading_counts_for_waves_that_have_none_and_all_is_all(capsys):
    assert "largest in 3 h" in told(capsys, *TIP, f"{JONSWAP} heading=10 deg + pm Hs=1 m Tp=7 s", "--heading", "90 deg")
    assert "\u2502 345" in told(capsys, *TIP, JONSWAP, "--heading", "ALL", "--verbose")


def test_a_lift_in_measured_waves_is_told_how_many_records_there_are(tmp_path, capsys):
    file(tmp_path / "buoy.txt", NDBC)
    lift = (
        'crane = "nov-250t"\nvessel = "supply-vessel-82m"\npayload = "mud-mat-25t"\nstart_depth = "-3 m"\n'
        '[sea]\nwave = "buoy.txt"\nheading = "180 deg"\n[tip]\nat = "x=-15 m, y=-14 m, z=36 m"\n[water]\ndepth = "320 m"\n'
        '[[phase]]\nmode = "ahc"\ntime = "60 s"\n'
    )
    line = refusal(capsys, "lower", file(tmp_path / "l.toml", lift))
    assert "sea.record: missing, and buoy.txt holds 2." in line
