"""`stillhook weather` as a user meets it."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests import commands

from stillhook.cli import run
from stillhook.variables import BY_NAME

KEYS = (
    "n_hours",
    "operability",
    "n_windows",
    "window_mean",
    "n_windows_long_enough",
    "wait_mean",
    "wait_p50",
    "wait_p90",
    "n_censored",
    "n_gaps",
)


@pytest.fixture
def file(tmp_path):
    """Two months of hours, calm every third day."""
    hours = np.datetime64("2020-01-01T00:00") + np.arange(60 * 24) * np.timedelta64(1, "h")
    rows = "".join(f"{t}Z,{0.9 if i // 24 % 3 == 2 else 2.5},{90 * (i // 24 % 4)}\n" for i, t in enumerate(hours))
    (tmp_path / "site.csv").write_text("time,Hs [m],MWD [deg]\n" + rows)
    return str(tmp_path / "site.csv")


def described(file, folder, rows):
    """A description (TOML) of a weather file."""
    path = Path(folder, "site.toml")
    path.write_text(f'file = "{file}"\n{rows}\n', encoding="utf-8")
    return str(path)


def answer(capsys, *arguments):
    return commands.answer(capsys, "weather", *arguments)


def refusal(capsys, *arguments):
    return commands.refusal(capsys, "weather", *arguments)


class TestPersistence:
    ASKED = ("--limit", "Hs <= 1 m", "--window", "24 h")

    def test_keys_are_those_of_the_nomenclature_and_times_stand_in_hours_beside(self, file, capsys):
        found = answer(capsys, "persistence", file, *self.ASKED)
        assert set(KEYS) <= set(found)
        assert set(found) <= set(BY_NAME)
        assert set(found["months"][0]) <= set(BY_NAME)
        assert (found["n_hours"], found["n_windows"], found["window_mean"]) == (1440, 20, 24 * 3600.0)
        assert found["hours"]["wait_p50"] == found["wait_p50"] / 3600.0

    def test_calm_every_third_day_is_waited_for_two_days_at_most(self, file, capsys):
        found = answer(capsys, "persistence", file, *self.ASKED)
        assert found["operability"] == pytest.approx(1 / 3)
        assert found["hours"]["wait_max"] == 71.0  # from the hour after the start on
        assert found["hours"]["wait_mean"] == pytest.approx(35.2, abs=0.5)  # half of three days
        assert found["n_censored"] == 23

    def test_the_table_for_people_names_gaps_and_what_was_left_out(self, file, capsys):
        assert run(["weather", "persistence", file, *self.ASKED, "--verbose"]) == 0
        out = capsys.readouterr().out
        assert "Gaps in time: 0; 0 of 1440 records without a value" in out
        assert "left out of the waits" in out
        assert "Feb" in out

    def test_a_ship_free_to_turn_works_where_a_fixed_one_does_not(self, file, tmp_path, capsys):
        head = ("--limit", "Hs <= 3 m for beta 150..210 deg", "--limit", "Hs <= 1 m for beta 210..150 deg")
        file = described(file, tmp_path, 'sense = "coming-from"')
        free = answer(capsys, "persistence", file, *head, "--window", "6 h", "--ship", "free")
        fixed = answer(capsys, "persistence", file, *head, "--window", "6 h", "--ship", "90 deg")
        assert (free["operability"], free["ship"]) == (1.0, "free")
        held = {round(np.degrees(h["ship"])): h["operability"] for h in free["by_heading"]}
        assert held[90] == pytest.approx(fixed["operability"])
        assert max(held.values()) < 1.0
        assert 1 / 3 < fixed["operability"] < 0.6
        assert fixed["ship"] == pytest.approx(np.pi / 2)

    @pytest.mark.slow
    def test_a_ship_free_to_turn_keeps_one_heading_through_a_window(self, capsys, tmp_path):
        rows = [f"2019-08-{d:02d} {h:02d}:00,2.0,{20 if h % 2 else 140}" for d in range(1, 11) for h in range(24)]
        (tmp_path / "crossing.csv").write_text("time,hs,wave_from_direction\n" + "\n".join(rows) + "\n")
        head = (
            "--limit",
            "Hs <= 3 m for beta 150..210 deg",
            "--limit",
            "Hs <= 1 m for beta 210..150 deg",
            "--ship",
            "free",
        )
        hour = answer(capsys, "persistence", str(tmp_path / "crossing.csv"), *head, "--window", "1 h")
        assert (hour["operability"], hour["start_share"]) == (1.0, 1.0)
        two = answer(capsys, "persistence", str(tmp_path / "crossing.csv"), *head, "--window", "2 h")
        assert (two["operability"], two["start_share"], two["n_censored"]) == (0.0, 0.0, 240)
        assert (
            run(["weather", "forecast", str(tmp_path / "crossing.csv"), *head, "--t-pop", "1 h", "--t-c", "0 h"]) == 0
        )
        assert (
            run(["weather", "forecast", str(tmp_path / "crossing.csv"), *head, "--t-pop", "1 h", "--t-c", "1 h"]) == 1
        )

    @pytest.mark.slow
    def test_out_keeps_a_picture_and_the_answer(self, file, capsys, tmp_path):
        found = answer(capsys, "persistence", file, *self.ASKED, "--out", str(tmp_path / "out"))
        assert json.loads((tmp_path / "out" / "weather.json").read_text()) == found
        assert (tmp_path / "out" / "weather.png").read_bytes().startswith(b"\x89PNG")

    def test_waves_told_every_hour_among_records_of_ten_minutes_are_judged_by_the_hour(self, capsys, tmp_path):
        rows = [
            f"2019-08-{d:02d} {h:02d}:{m:02d},{5.0},{1.5 if m == 40 and (d, h) != (2, 5) else ''}"
            for d in (1, 2, 3)
            for h in range(24)
            for m in range(0, 60, 10)
        ]
        (tmp_path / "buoy.csv").write_text("time,wind,hs\n" + "\n".join(rows) + "\n")
        found = answer(
            capsys,
            "persistence",
            str(tmp_path / "buoy.csv"),
            "--limit",
            "Hs <= 2 m",
            "--limit",
            "wind <= 6 m/s",
            "--window",
            "12 h",
        )
        assert (found["n_hours"], found["n_windows"], found["n_missing"], found["hours"]["window_max"]) == (
            72,
            2,
            1,
            42.0,
        )
        assert "1 of 6 records only" in found["notes"][0]

    def test_a_window_longer_than_the_series_leaves_all_waits_unknown(self, file, capsys):
        found = answer(capsys, "persistence", file, "--limit", "Hs <= 1 m", "--window", "9000 h")
        assert (found["n_windows_long_enough"], found["wait_mean"], found["n_censored"]) == (0, None, 1440)

    @pytest.mark.thorough
    @pytest.mark.parametrize(
        ("arguments", "says"),
        [
            (("--window", "24 h"), "Missing option '--limit'"),
            (("--limit", "Hs <= 1 m"), "Missing option '--window'"),
            (("--limit", "Hs <= 1 m", "--window", "24"), "no unit"),
            (("--limit", "Hs <= 1 m", "--window", "0 h"), '--window "0 h": is not above'),
            (("--limit", "wind <= 9 m/s", "--window", "6 h"), "has no wind; it has H_m0"),
            (("--limit", "from 0..90 deg", "--window", "6 h"), "sense = coming-from, going-to, cartesian"),
            (("--limit", "Hs <= 1 m", "--window", "6 h", "--ship", "90 deg"), "no limit depends on beta"),
            (
                ("--limit", "Hs <= 1 m", "--window", "6 h", "--time", "when"),
                "--time: moved. Write time in a description",
            ),
            (("--limit", "Hs <= 1 m", "--window", "24"), 'write "24 h"'),
            (
                ("--limit", "beta 0..90 deg", "--window", "6 h", "--ship", "400 deg"),
                '--ship = "400 deg": not between 0 deg and 360 deg',
            ),
        ],
    )
    def test_mistakes_are_one_line(self, file, capsys, arguments, says):
        assert says in refusal(capsys, "persistence", file, *arguments)

    @pytest.mark.parametrize(
        ("limit", "rows", "says"),
        [
            ("beta 0..90 deg", 'sense = "going-to"', "--ship: missing"),
            ("Hs <= 1 m", 'sense = "from"', 'site.toml: sense = "from": is not one of coming-from'),
            ("Hs <= 1 m", 'columns = { Hs = "height" }', '"height": no column'),
            ("Hs <= 1 m", 'columns = { waves = "Hs" }', "is not one of Hs, Tp"),
            ("Hs <= 1 m", 'columns = { Hs = "" }', "write a heading of the file"),
            ("Hs <= 1 m", 'time = "when"', 'time = "when": no such column'),
            ("Hs <= 1 m", 'date_order = "dym"', "is not one of ymd, mdy, dmy"),
            ("Hs <= 1 m", 'step = "0 h"', 'step = "0 h": it must be greater than 0'),
            ("Hs <= 1 m", 'step = "7 h"', "step = 7 h: its records are 1 h apart"),
            ("Hs <= 1 m", "sens = 3", 'did you mean "sense"'),
        ],
    )
    def test_mistakes_in_a_description_are_one_line(self, file, tmp_path, capsys, limit, rows, says):
        site = described(file, tmp_path, rows)
        assert says in refusal(capsys, "persistence", site, "--limit", limit, "--window", "6 h")

    @pytest.mark.parametrize("cell", ["NaN", "inf", ""])
    def test_a_column_without_a_number_is_refused(self, tmp_path, capsys, cell):
        (tmp_path / "none.csv").write_text(f"time,Hs,Tp\n2020-01-01 00:00,{cell},8\n2020-01-01 01:00,{cell},8\n")
        line = refusal(capsys, "persistence", str(tmp_path / "none.csv"), *self.ASKED)
        assert "none.csv has no record of H_m0: all 2 are missing" in line

    def test_all_is_a_hundred_per_cent(self, file, capsys):
        assert run(["weather", "persistence", file, "--limit", "Hs <= 1 m", "--window", "9000 h", "--verbose"]) == 0
        assert "1440 (100 %) of all records have no later window" in capsys.readouterr().out

    @pytest.mark.slow
    def test_a_direction_or_a_horizon_that_cannot_be_is_refused_in_the_other_commands_too(self, file, capsys):
        assert '--heading = "400 deg": not between 0 deg and 360 deg' in refusal(
            capsys, "lift", "template-to-1500m", file, "--heading", "400 deg"
        )
        asked = ("forecast", file, "--limit", "Hs <= 2 m", "--t-pop", "6 h")
        assert '--horizon "0 h": is not above 0 h' in refusal(capsys, *asked, "--horizon", "0 h")


class TestShow:
    def test_columns_gaps_and_what_was_made_of_directions(self, file, tmp_path, capsys):
        found = answer(capsys, "show", file)
        assert set(found["columns"]) == {"H_m0"}
        assert set(found) <= set(BY_NAME)
        assert "does not say what its wave direction" in found["notes"][0]
        site = described(file, tmp_path, 'sense = "coming-from"')
        columns = answer(capsys, "show", site)["columns"]
        assert set(columns) == {"H_m0", "come_from"}
        found = columns["come_from"]
        assert (found["min"], found["max"]) == (0.0, pytest.approx(1.5 * np.pi))

    @pytest.mark.slow
    def test_the_table_for_people(self, capsys):
        assert run(["weather", "show", "SYNTHETIC-norwegian-sea", "--verbose"]) == 0
        out = capsys.readouterr().out
        assert "29224 records, one every 3 h" in out
        assert "measured nowhere" in out
