"""Alpha factors: the printed table, between its columns, at its edges, and tables of one's own."""

import json

import numpy as np
import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.cli import run
from stillhook.errors import UnitError, WeatherError
from stillhook.formats.weather.alpha_table import read_alpha_table
from stillhook.weather.alpha import AlphaTable, alpha_of, alpha_tables, alphas, load_alpha_table, reference_period

H = 3600.0
PRINTED = {
    12: (0.65, 0.76, 0.79, 0.80),
    24: (0.63, 0.73, 0.76, 0.78),
    36: (0.62, 0.71, 0.73, 0.76),
    48: (0.60, 0.68, 0.71, 0.74),
    72: (0.55, 0.63, 0.68, 0.72),
}
"""DNV-OS-H101 table 4-1, Hs 1, 2, 4 and 6 m."""
TABLE = load_alpha_table()


class TestTable:
    @pytest.mark.parametrize("T_POP", PRINTED)
    def test_every_printed_number_comes_out(self, T_POP):
        for Hs, alpha in zip((1.0, 2.0, 4.0, 6.0), PRINTED[T_POP], strict=True):
            found = alpha_of(TABLE, Hs, T_POP * H)
            assert (found.alpha, found.op_wf) == (alpha, alpha * Hs)

    def test_alpha_steps_with_time_and_a_step_belongs_to_its_row(self):
        assert [alpha_of(TABLE, 2.0, T * H).alpha for T in (0.1, 12.0, 12.01, 24.0, 24.5, 71.0)] == [
            0.76,
            0.76,
            0.73,
            0.73,
            0.71,
            0.63,
        ]

    def test_alpha_is_straight_between_heights_and_stays_above_six_metres(self):
        assert alpha_of(TABLE, 1.5, 12 * H).alpha == pytest.approx(0.705, rel=1e-12)
        assert alpha_of(TABLE, 5.0, 48 * H).alpha == pytest.approx(0.725, rel=1e-12)
        assert alpha_of(TABLE, 11.0, 72 * H).alpha == 0.72

    @pytest.mark.slow
    @given(st.floats(1.0, 12.0), st.floats(0.5, 71.9))
    def test_a_higher_limit_and_a_shorter_operation_never_lower_alpha(self, Hs, T_POP):
        here = alpha_of(TABLE, Hs, T_POP * H).alpha
        assert alpha_of(TABLE, Hs + 0.3, T_POP * H).alpha >= here - 1e-12
        assert alpha_of(TABLE, Hs, T_POP * H / 2).alpha >= here
        assert 0.55 <= here <= 0.80


class TestEdges:
    def test_below_a_metre_none_is_made_up(self):
        found = alpha_of(TABLE, 0.99, 12 * H)
        assert (found.alpha, found.op_wf, found.weather_restricted) == (None, None, True)
        assert "case by case" in found.reason

    def test_beyond_72_hours_there_is_no_alpha_and_no_restriction(self):
        found = alpha_of(TABLE, 2.0, 72.5 * H, 1.0 * H)
        assert (found.alpha, found.weather_restricted) == (None, False)
        assert "beyond the 72 h" in found.reason

    @pytest.mark.parametrize(
        ("T_POP", "T_C", "T_R", "restricted"),
        [
            (24, None, 48, True),
            (47.9, None, 95.8, True),
            (48, None, 96, False),
            (48, 47, 95, True),
            (71.9, 24, 95.9, True),
            (72, 6, 78, False),
            (60, 36, 96, False),
            (12, 0, 12, True),
        ],
    )
    def test_restricted_means_below_72_and_below_96_hours(self, T_POP, T_C, T_R, restricted):
        found = reference_period(TABLE, T_POP * H, None if T_C is None else T_C * H)
        assert found == (pytest.approx(T_R * H), restricted)

    def test_many_heights_at_once_are_as_one_by_one(self):
        Hs = np.array([[0.5, 1.0, 1.7], [3.3, np.inf, np.nan]])
        found = alphas(TABLE, Hs, 30 * H)
        for h, a in zip(Hs.flat, found.flat, strict=True):
            if np.isfinite(h) and h >= 1.0:
                assert a == alpha_of(TABLE, float(h), 30 * H).alpha
            else:
                assert np.isnan(a)
        assert np.all(np.isnan(alphas(TABLE, Hs, 80 * H)))

    @pytest.mark.parametrize(
        ("hs", "T_POP", "T_C"),
        [(0.0, H, None), (-1.0, H, None), (2.0, 0.0, None), (2.0, H, -1.0), (float("nan"), H, None)],
    )
    def test_heights_and_times_that_are_none_are_refused(self, hs, T_POP, T_C):
        with pytest.raises(WeatherError, match="must be above 0"):
            alpha_of(TABLE, hs, T_POP, T_C)


OWN = """
title = "Site factors"
version = "2"
standard = "agreed with the surveyor"
Hs = ["0.5 m", "1 m"]
row = [{ T_POP = "24 h", alpha = [0.5, 0.6] }]
restricted = { T_POP_below = "72 h", T_R_below = "96 h" }
"""


class TestOwnTables:
    def test_a_table_of_ones_own_reaches_below_a_metre(self, tmp_path):
        (tmp_path / "own.toml").write_text(OWN)
        assert alpha_of(load_alpha_table(str(tmp_path / "own.toml")), 0.75, 20 * H).alpha == pytest.approx(0.55)

    @pytest.mark.parametrize(
        ("old", "new", "says"),
        [
            ("0.5, 0.6", "0.5", "give 2 numbers, one for each Hs"),
            ("0.5, 0.6", "0.5, 1.6", r"row 1: alpha\[1\] = 1.6: it must be less than or equal to 1"),
            ('"0.5 m", "1 m"', '"1 m", "0.5 m"', "Hs: must rise from above 0"),
            ('"0.5 m", "1 m"', '0.5, "1 m"', "Hs\\[0\\] = 0.5"),
            ('standard = "agreed with the surveyor"', "", r"standard: missing \(what the factors are from\)"),
            ("restricted", "restrictd", 'did you mean "restricted"'),
            ('T_POP = "24 h"', 'T_POP = "24"', "no unit"),
            ("row = [{", "rows = [{", 'did you mean "row"'),
        ],
    )
    def test_a_table_that_is_wrong_is_refused_with_its_place(self, tmp_path, old, new, says):
        assert old in OWN
        (tmp_path / "own.toml").write_text(OWN.replace(old, new))
        with pytest.raises((WeatherError, UnitError), match=says) as caught:
            load_alpha_table(str(tmp_path / "own.toml"))
        assert "own.toml" in str(caught.value)

    def test_every_table_that_ships_loads_and_says_where_it_is_from(self):
        for name in alpha_tables():
            table = load_alpha_table(name)
            assert table.texts["standard"]
            assert "edition" in table.texts["note"]
            assert "seen" in table.texts["source"] or "transcribed" in table.texts["source"]

    def test_a_name_that_is_none_is_refused(self):
        with pytest.raises(WeatherError, match="There are dnv-os-h101"):
            load_alpha_table("dnv-h101")


CELLS = "T_POP [h],Hs [m],alpha [1]\n" + "".join(
    f"{T},{Hs},{alpha}\n" for T, row in PRINTED.items() for Hs, alpha in zip((1, 2, 4, 6), row, strict=True)
)
REMARKS = (
    "# standard: agreed with the surveyor\n# version: 3\n# T_R_below: 120 h\n# a line without a name says nothing\n"
)


class TestTablesOfCells:
    """A table of one row a cell, CSV or XLSX, is the same as one in TOML."""

    def read(self, folder, text, name="own.csv"):
        (folder / name).write_text(text, encoding="utf-8")
        return read_alpha_table(str(folder / name))

    def test_the_printed_table_as_a_csv_gives_the_printed_factors(self, tmp_path):
        own = self.read(tmp_path, CELLS)
        assert (own.Hs, own.T_POP, own.alpha) == (TABLE.Hs, TABLE.T_POP, TABLE.alpha)
        assert (own.T_POP_below, own.T_R_below) == (TABLE.T_POP_below, TABLE.T_R_below)

    def test_rows_may_come_in_any_order_and_in_other_units(self, tmp_path):
        head, *rows = CELLS.splitlines()
        assert self.read(tmp_path, "\n".join([head, *reversed(rows)])).alpha == TABLE.alpha
        percent = "T_POP [d];Hs [m];alpha [%]\n0,5;1;65\n0,5;2;76\n"
        assert self.read(tmp_path, percent, "other.csv").alpha == pytest.approx(np.array([[0.65, 0.76]]))

    def test_an_excel_sheet_is_the_same_table(self, tmp_path):
        book = openpyxl.Workbook()
        book.active.append(["# standard: agreed with the surveyor"])
        head, *rows = CELLS.splitlines()
        book.active.append(head.split(","))
        for row in rows:
            book.active.append([float(x) for x in row.split(",")])
        book.save(tmp_path / "own.xlsx")
        own = read_alpha_table(str(tmp_path / "own.xlsx"))
        assert own.alpha == TABLE.alpha
        assert own.texts["standard"] == "agreed with the surveyor"

    def test_remarks_say_where_it_is_from_and_what_is_weather_restricted(self, tmp_path):
        own = self.read(tmp_path, REMARKS + CELLS)
        assert own.source == "agreed with the surveyor, table file own.csv version 3"
        assert own.T_R_below == 120 * H

    def test_a_first_column_for_all_low_heights_is_written_twice(self, tmp_path):
        own = self.read(tmp_path, "T_POP [h],Hs [m],alpha [1]\n24,0.01,0.6\n24,1,0.6\n24,2,0.7\n")
        assert alpha_of(own, 0.4, 12 * H).alpha == 0.6

    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ("T_POP [h],Hs [m]\n12,1\n", ['no column "alpha [1]"']),
            ("T_POP,Hs [m],alpha [1]\n12,1,0.6\n", ["T_POP", "no unit"]),
            ("T_POP [m],Hs [m],alpha [1]\n12,1,0.6\n", ['unit "m"']),
            ("T_POP [h],Hs [m],alpha [1]\n12,1,\n", ["row 2", "empty"]),
            ("T_POP [h],Hs [m],alpha [1]\n12,1,65\n", ["row 2", "alpha 65", "at most 1"]),
            ("T_POP [h],Hs [m],alpha [1]\n12,1,0.6\n12,1,0.7\n", ["row 3", "is given twice"]),
            ("T_POP [h],Hs [m],alpha [1]\n12,1,0.6\n24,2,0.7\n", ["no alpha for T_POP 12 h at Hs 2 m"]),
            ("T_POP [h],Hs [m],alpha [1]\n12,1,0.6\n24,1,0.7\n", ["alpha rises from 0.6", "24 h"]),
            ("T_POP [h],Hs [m],alpha [1]\n", ["no data below"]),
            ("", ["empty"]),
            ("# standrd: mine\n" + CELLS, ['remark "standrd"', "standard"]),
            ("# T_R_below: 96\n" + CELLS, ["T_R_below", "no unit"]),
        ],
    )
    def test_a_table_that_is_wrong_is_refused_in_one_line_with_exit_code_2(self, tmp_path, capsys, text, says):
        (tmp_path / "own.csv").write_text(text, encoding="utf-8")
        command = [
            "weather",
            "alpha",
            "--hs",
            "2 m",
            "--t-pop",
            "12 h",
            "--forecast-factors",
            str(tmp_path / "own.csv"),
        ]
        assert run(command) == 2
        line = capsys.readouterr().err.strip()
        assert "\n" not in line
        for each in ("own.csv", *says):
            assert each in line

    def test_a_file_that_is_not_there_is_refused(self):
        with pytest.raises(WeatherError, match="no such file"):
            read_alpha_table("nowhere.xlsx")

    def test_the_command_takes_it(self, tmp_path, capsys):
        (tmp_path / "own.csv").write_text(REMARKS + CELLS, encoding="utf-8")
        command = [
            "weather",
            "alpha",
            "--hs",
            "2 m",
            "--t-pop",
            "24 h",
            "--forecast-factors",
            str(tmp_path / "own.csv"),
            "--json",
        ]
        assert run(command) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["alpha"], found["case_by_case"]) == (0.73, False)
        assert "own.csv" in found["table"]


class TestCommand:
    def test_the_issues_example(self, capsys):
        assert run(["weather", "alpha", "--hs", "2 m", "--t-pop", "24 h", "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["alpha"], found["op_wf"], found["T_R"], found["weather_restricted"]) == (
            0.73,
            1.46,
            172800.0,
            True,
        )

    def test_below_a_metre_the_answer_is_null_and_the_code_1(self, capsys):
        assert run(["weather", "alpha", "--hs", "0.8 m", "--t-pop", "24 h", "--json"]) == 1
        found = json.loads(capsys.readouterr().out)
        assert found["alpha"] is None
        assert found["case_by_case"] is True
        assert "case by case" in found["reason"]

    def test_too_long_an_operation_is_answered(self, capsys):
        assert run(["weather", "alpha", "--hs", "2 m", "--t-pop", "80 h", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["weather_restricted"] is False

    def test_people_read_times_in_hours_and_the_clause(self, capsys):
        assert run(["weather", "alpha", "--hs", "2 m", "--t-pop", "24 h", "--t-c", "6 h", "--verbose"]) == 0
        out = capsys.readouterr().out
        assert "T_POP 24 h, T_C 6 h, T_R 30 h" in out
        assert "check against your edition" in out

    def test_a_bare_number_is_refused(self, capsys):
        assert run(["weather", "alpha", "--hs", "2", "--t-pop", "24 h"]) == 2
        assert 'write "2 m"' in capsys.readouterr().err


class TestLevels:
    """Check values of other people: factors by forecast level and monitoring, editions, and time from the issue."""

    @pytest.mark.parametrize(
        ("table", "Hs", "T_POP", "alpha", "op_wf"),
        [
            ("dnv-os-h101", 1.63, 12, 0.719, 1.17),  # NTNU 2012, H101 of 2011
            ("dnv-os-h101", 2.5, 8 + 12, 0.7375, 1.84),  # 8 h of lead time
            ("dnv-rules-1996", 2.5, 20, 0.71, 1.8),  # Wikipedia's example
            ("dnv-st-n001", 1.0, 12, 0.93, 0.93),
            ("dnv-st-n001", 2.0, 12, 0.95, 1.90),
            ("dnv-st-n001", 3.0, 12, 0.95, 2.85),
            ("dnv-st-n001", 4.0, 12, 0.95, 3.80),
            ("dnv-st-n001", 0.5, 24, 0.89, 0.445),
        ],
    )
    def test_published_examples_come_out(self, table, Hs, T_POP, alpha, op_wf):
        found = alpha_of(load_alpha_table(table), Hs, T_POP * H)
        assert found.alpha == pytest.approx(alpha, abs=6e-4)
        assert found.op_wf == pytest.approx(op_wf, abs=0.026 if table == "dnv-rules-1996" else 0.006)

    @pytest.mark.parametrize(
        ("key", "row"),
        [
            ("B", {12: (0.68, 0.80, 0.83, 0.84), 72: (0.58, 0.66, 0.71, 0.76)}),
            ("A", {12: (0.72, 0.84, 0.87, 0.88), 72: (0.61, 0.69, 0.75, 0.79)}),
            ("monitoring", {4: (0.90, 0.95, 1.0, 1.0), 24: (0.66, 0.77, 0.80, 0.82)}),
            ("A+monitoring", {4: (0.90, 0.95, 1.0, 1.0), 24: (0.72, 0.84, 0.87, 0.90)}),
        ],
    )
    def test_each_level_has_its_own_numbers_and_says_which_it_is(self, key, row):
        table = load_alpha_table(f"dnv-os-h101#{key}")
        assert table.name == f"dnv-os-h101#{key}"
        assert "forecast level" in table.source
        for T, printed in row.items():
            assert [alpha_of(table, Hs, T * H).alpha for Hs in (1.0, 2.0, 4.0, 6.0)] == list(printed)

    def test_better_forecasts_and_monitoring_never_lower_alpha(self):
        c, b, a, m, am = (load_alpha_table(f"dnv-os-h101#{k}") for k in ("C", "B", "A", "monitoring", "A+monitoring"))
        for worse, better in ((c, b), (b, a), (c, m), (a, am), (m, am)):
            for T in (3, 12, 24):
                for Hs in (1.0, 1.5, 2.7, 5.0, 9.0):
                    assert alpha_of(better, Hs, T * H).alpha >= alpha_of(worse, Hs, T * H).alpha

    def test_ranges_of_heights_do_not_interpolate_and_take_the_lower_one_at_their_end(self):
        table = load_alpha_table("dnv-rules-1996")
        assert [alpha_of(table, Hs, 11 * H).alpha for Hs in (1.0, 1.9, 2.0, 2.01, 4.0, 4.01, 7.0)] == [
            *(0.68, 0.68, 0.68, 0.76, 0.76, 0.80, 0.80)
        ]
        assert alpha_of(table, 3.0, 12 * H).alpha == 0.71  # "below 12 h": 12 h is of the next row

    @pytest.mark.parametrize(
        ("table", "Hs", "T_POP", "says"),
        [
            ("dnv-st-n001", 1.5, 20, "source was not seen there"),
            ("dnv-st-n001", 0.9, 30, "beyond the 24 h of the table. Take a table of your project"),
            ("dnv-rules-1996", 5.0, 20, "source was not seen there"),
            ("dnv-rules-1996", 0.9, 10, "case by case"),
            ("dnv-os-h101#A", 0.9, 10, "case by case"),
            ("dnv-os-h101#A+monitoring", 2.0, 30, "Take dnv-os-h101#A, as table 4-5 says"),
        ],
    )
    def test_what_was_not_seen_has_no_factor_and_one_line_says_so(self, table, Hs, T_POP, says):
        found = alpha_of(load_alpha_table(table), Hs, T_POP * H)
        assert (found.alpha, found.op_wf) == (None, None)
        assert says in found.reason
        assert "\n" not in found.reason
        assert np.isnan(alphas(load_alpha_table(table), np.array([Hs]), T_POP * H)).all()

    @pytest.mark.parametrize(
        ("name", "says"),
        [
            ("dnv-os-h101#D", 'no factors "D" by forecast level and monitoring. There are C, B, A'),
            ("dnv-st-n001#A", "There are public"),
            ("dnv-rules-1996#B", "The file has one table"),
            ("n001#B", "There are dnv-os-h101, dnv-rules-1996, dnv-st-n001"),
        ],
    )
    def test_a_level_that_is_not_there_is_refused_in_one_line(self, name, says, capsys):
        assert run(["weather", "alpha", "--hs", "2 m", "--t-pop", "12 h", "--forecast-factors", name]) == 2
        line = capsys.readouterr().err.strip()
        assert says in line
        assert "\n" not in line

    @pytest.mark.parametrize("name", alpha_tables())
    def test_a_table_survives_being_kept_as_numbers(self, name):
        table = load_alpha_table(name)
        again = AlphaTable.of_numbers(name, json.loads(json.dumps(table.numbers)))
        Hs = np.linspace(0.005, 8.0, 60)
        for T in (2, 12, 12.5, 24, 40, 80):
            np.testing.assert_array_equal(alphas(again, Hs, T * H), alphas(table, Hs, T * H))

    def test_levels_of_ones_own_in_one_file(self, tmp_path):
        text = OWN.replace(
            'row = [{ T_POP = "24 h", alpha = [0.5, 0.6] }]',
            'level = [{ key = "x", level = "ours", monitoring = "buoy", row = [{ T_POP = "24 h", alpha = [0.5, 0.6] }] }]',
        )
        (tmp_path / "own.toml").write_text(text)
        table = load_alpha_table(f"{tmp_path / 'own.toml'}#x")
        assert (table.name, table.texts["monitoring"]) == ("own.toml#x", "buoy")
        (tmp_path / "own.toml").write_text(text + '[[row]]\nT_POP = "24 h"\nalpha = [0.5, 0.6]\n')
        with pytest.raises(WeatherError, match=r"own.toml: .*one \[\[level\]\] or more"):
            load_alpha_table(str(tmp_path / "own.toml"))

    def test_the_sheet_of_an_excel_file_is_named_after_a_hash(self, tmp_path):
        book = openpyxl.Workbook()
        book.active.append(["nothing"])
        sheet = book.create_sheet("level B")
        sheet.append(["# level: B"])
        for line in CELLS.splitlines():
            sheet.append([float(x) if x[0].isdigit() else x for x in line.split(",")])
        book.save(tmp_path / "own.xlsx")
        own = read_alpha_table(f"{tmp_path / 'own.xlsx'}#level B")
        assert own.alpha == TABLE.alpha
        assert "forecast level B, monitoring not stated" in own.source


class TestContingency:
    @pytest.mark.parametrize(
        ("T_POP", "T_C", "short"),
        [(4, None, True), (6, None, False), (12, 6, False), (12, 5.9, True), (20, 9.9, True), (20, 10, False)],
    )
    def test_less_than_six_hours_or_half_of_the_operation_is_short(self, T_POP, T_C, short):
        found = alpha_of(TABLE, 2.0, T_POP * H, None if T_C is None else T_C * H)
        assert bool(found.short_contingency) is short
        assert not short or "N001 2.6.9.2-3" in found.short_contingency

    def test_lead_time_is_part_of_the_planned_period(self, capsys):
        command = ["weather", "alpha", "--hs", "2.5 m", "--t-pop", "12 h", "--lead", "8 h", "--t-c", "12 h", "--json"]
        assert run(command) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["T_POP"], found["lead"], found["T_R"]) == (20 * H, 8 * H, 32 * H)
        assert found["alpha"] == pytest.approx(0.7375)

    def test_a_negative_lead_time_is_refused(self, capsys):
        assert run(["weather", "alpha", "--hs", "2 m", "--t-pop", "12 h", "--lead", "-1 h"]) == 2
        assert "--lead" in capsys.readouterr().err
