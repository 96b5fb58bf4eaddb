"""`stillhook sea` as a user meets it."""

import json
import math

import numpy as np
import pytest
from tests import commands

from stillhook.cli import run
from stillhook.variables import BY_NAME

PRINTED = 5e-6
NDBC = "YY MM DD hh   .030   .040   .050   .060\n96 01 01 00    .00   4.00   2.00    .50\n96 01 01 01 999.00 999.00 999.00 999.00\n"


def answer(capsys, *arguments):
    return commands.answer(capsys, "sea", *arguments)


def refusal(capsys, *arguments):
    return commands.refusal(capsys, "sea", *arguments)


class TestWavesAsText:
    def test_numbers_of_a_pierson_moskowitz_sea(self, capsys):
        found = answer(capsys, "pm Hs=2 m Tp=10 s")
        assert found["H_m0"] == pytest.approx(2.0)
        assert found["T_m02"] == pytest.approx(7.1037, abs=1e-4)
        assert found["T_m01"] == pytest.approx(7.7177, abs=1e-4)
        assert found["m_0"] == pytest.approx(0.25)
        assert found["omega_cut"] == pytest.approx(12.0 * 2.0 * math.pi / 10.0)

    def test_every_key_is_in_the_table_of_names(self, capsys, tmp_path):
        (tmp_path / "waves.txt").write_text(NDBC)
        for found in (answer(capsys, "pm Hs=2 m Tp=10 s"), answer(capsys, str(tmp_path / "waves.txt"))):
            assert set(found) - {"notes"} <= set(BY_NAME)

    def test_a_sea_too_steep_is_told_and_not_refused(self, capsys):
        assert "above the steepness limit" in answer(capsys, "jonswap Hs=8 m Tp=6 s")["notes"][0]

    def test_the_table_for_people_names_units(self, capsys):
        assert run(["sea", "jonswap Hs=1 m Tp=8 s gamma=3.3", "--verbose"]) == 0
        assert "zero-crossing wave period" in capsys.readouterr().out


class TestFiles:
    @pytest.mark.slow
    def test_the_measured_year(self, capsys, shared_data):
        found = answer(capsys, str(shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz"))
        assert (found["n_records"], found["n_valid"], found["n_missing"]) == (8712, 8600, 112)
        assert found["H_m0"]["first"] == pytest.approx(3.7320236, rel=PRINTED)
        assert found["H_m0"]["mean"] == pytest.approx(2.1933776, rel=PRINTED)
        assert found["H_m0"]["max"] == pytest.approx(6.4683847, rel=PRINTED)
        assert len(found["records"]) == 8712
        missing = [r for r in found["records"] if not r["valid"]]
        assert len(missing) == 112
        assert all(r["H_m0"] is None and r["T_m02"] is None for r in missing)

    def test_one_record_by_number_and_by_time(self, capsys, tmp_path):
        path = tmp_path / "waves.txt"
        path.write_text(NDBC)
        assert answer(capsys, str(path), "--record", "0") == answer(capsys, str(path), "--record", "1996-01-01T00:00Z")

    @pytest.mark.slow
    def test_pictures_and_numbers_are_written_together(self, capsys, tmp_path):
        path = tmp_path / "waves.txt"
        path.write_text(NDBC)
        for i, waves in enumerate(("torsethaugen Hs=3 m Tp=14 s", str(path))):
            out = tmp_path / f"out{i}"
            found = answer(capsys, waves, "--out", str(out))
            assert sorted(p.name for p in out.iterdir()) == ["sea.json", "sea.png", "stillhook-manifest.json"]
            assert json.loads((out / "sea.json").read_text()) == found

    @pytest.mark.slow
    def test_a_file_of_nothing_but_missing_records_has_no_numbers(self, capsys, tmp_path):
        path = tmp_path / "waves.txt"
        path.write_text("\n".join([NDBC.splitlines()[0], NDBC.splitlines()[2]]) + "\n")
        found = answer(capsys, str(path), "--out", str(tmp_path / "out"))
        assert found["n_valid"] == 0
        assert found["H_m0"]["first"] is None

    def test_weather_tables_give_heights_periods_and_directions(self, capsys, tmp_path):
        path = tmp_path / "weather.txt"
        path.write_text(
            "#YY MM DD hh mm WVHT DPD APD MWD\n"
            + "".join(f"2019 08 01 00 {m:02d} 1.5 11 7 {d}\n" for m, d in ((0, 350), (10, 10)))
        )
        found = answer(capsys, str(path))
        assert found["H_m0"] == {"first": 1.5, "mean": 1.5, "min": 1.5, "max": 1.5}
        assert np.cos(found["come_from"]["mean"]) == pytest.approx(
            1.0
        )  # 350 and 10 deg have north between them, not south


class TestRefusals:
    @pytest.mark.thorough
    @pytest.mark.parametrize(
        ("arguments", "said"),
        [
            (["jonswap Hs=1 Tp=8 s"], 'Hs = "1": no unit; write "1 m"'),
            (["jonswap Hs=1,5 m Tp=8 s"], 'a comma in the number; write a point, "1.5 m"'),
            (["jonswap Hs=1 m"], "jonswap has no Tp. Give Hs, Tp."),
            (["jonswap Hs=1 m Tp=8 s gama=3"], '"gama" is not one of Hs, Tp, Tz, gamma, norm of jonswap'),
            (["jonswap Hs=1 m Tp=8 s gamma=33"], "gamma = 33 is not between 1 and 10"),
            (["jonswap Hs=1 m Tp=8 s gamma=two"], 'gamma = "two": not a plain number'),
            (["jonswap Hs=1 m Tp=8 s norm=other"], 'norm = "other" is not one of exact, printed'),
            (["jonswap Hs=1 m Hs=2 m Tp=8 s"], "Hs is given twice"),
            (["jonswap Hs=100 m Tp=8 s"], "Hs = 100 m is not between 0 m and 40 m"),
            (["jonswap Hs=1 m Tp=8 min"], "Tp = 480 s is not between 1 s and 40 s"),
            (["jonswap Hs=1 m Tp=8 s heading=180 deg"], "heading does not belong to a spectrum"),
            (["regular H=2 m T=8 s"], '"regular" is not one of jonswap, pm, torsethaugen, ochi-hubble'),
            (["ochi-hubble Hs1=2 m Tp1=14 s lambda1=0.2 Hs2=1 m Tp2=7 s lambda2=1"], "lambda = 0.2 is not above 0.5"),
            ([""], "no waves are given"),
            (["none.txt"], '"none.txt": no such file'),
            (["pm Hs=1 m Tp=8 s", "--record", "3"], "--record: belongs to a file"),
            (["none.txt", "--format", "grib"], '--format "grib": is not one of era5'),
        ],
    )
    def test_bad_input_is_one_line_and_exit_code_2(self, capsys, arguments, said):
        assert said in refusal(capsys, *arguments)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("record", "said"),
        [
            ("1996-01-01T02:00+01:00", "is missing. Choose a valid one"),
            ("7", "record 7 does not exist. The last one is 1."),
            ("noon", 'record "noon" is neither a number nor a time'),
            ("1996-01-05", "no record at 1996-01-05T00:00:00Z. The nearest one is of 1996-01-01T01:00:00Z"),
            ("1", "is missing. Choose a valid one"),
        ],
    )
    def test_a_record_that_is_none_is_told(self, capsys, tmp_path, record, said):
        path = tmp_path / "waves.txt"
        path.write_text(NDBC)
        assert said in refusal(capsys, str(path), "--record", record)

    def test_a_file_that_breaks_leaves_nothing_behind(self, capsys, tmp_path):
        path = tmp_path / "waves.txt"
        path.write_text(NDBC[:-20])
        refusal(capsys, str(path), "--out", str(tmp_path / "out"))
        assert not (tmp_path / "out").exists()
