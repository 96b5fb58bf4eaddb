"""Alpha factors: the printed table, between its columns, at its edges, and tables of one's own."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.cli import run
from stillhook.errors import UnitError, WeatherError
from stillhook.weather.alpha import alpha_of, alpha_tables, alphas, load_alpha_table, reference_period

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
            assert "check against your edition" in table.source

    def test_a_name_that_is_none_is_refused(self):
        with pytest.raises(WeatherError, match="There are dnv-os-h101"):
            load_alpha_table("dnv-h101")


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
        assert "case by case" in found["reason"]

    def test_too_long_an_operation_is_answered(self, capsys):
        assert run(["weather", "alpha", "--hs", "2 m", "--t-pop", "80 h", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["weather_restricted"] is False

    def test_people_read_times_in_hours_and_the_clause(self, capsys):
        assert run(["weather", "alpha", "--hs", "2 m", "--t-pop", "24 h", "--t-c", "6 h"]) == 0
        out = capsys.readouterr().out
        assert "T_POP 24 h, T_C 6 h, T_R 30 h" in out
        assert "check against your edition" in out

    def test_a_bare_number_is_refused(self, capsys):
        assert run(["weather", "alpha", "--hs", "2", "--t-pop", "24 h"]) == 2
        assert 'write "2 m"' in capsys.readouterr().err
