"""Limits below the table of alpha are outside it: said in the answer, in its tables and in the weather, never made up."""

import json
import math

import numpy as np
import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.cli import run
from stillhook.plan.planning import plan as planned
from stillhook.plan.report.document import brief, document
from stillhook.plan.report.limits_summary import OUTSIDE_ALPHA, tables
from stillhook.report.document import Table

PLAN = (
    manifold("none")
    + """\
[environment]
Hs = "0.25 m to 4 m by 0.25 m"
Tp = ["6 s", "12 s"]
headings = ["165 deg", "180 deg", "195 deg"]

[operation]
T_POP = "4 h"

[weather]
file = "SYNTHETIC-norwegian-sea"

[[phase]]
name = "splash"
kind = "splash-zone"
"""
)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    return loaded(tmp_path_factory.mktemp("plan"), PLAN)


@pytest.fixture(scope="module")
def result(lift):
    return planned(lift, tier="closed-form")


def low_and_high(result):
    """Rows of the answer whose limit is below 1 m, and others."""
    rows = result.facts["limits"]
    return [r for r in rows if 0.0 < r["Hs_limit"] < 1.0], [r for r in rows if r["Hs_limit"] >= 1.0]


@pytest.mark.long
def test_the_answer_marks_limits_below_the_table_and_gives_no_op_wf(result):
    low, high = low_and_high(result)
    assert low
    assert high
    for row in low:
        assert row["case_by_case"] is True
        assert math.isnan(row["op_wf"])
    for row in high:
        assert row["case_by_case"] is False
        assert row["op_wf"] == pytest.approx(row["alpha"] * min(row["Hs_limit"], 4.0))


def test_tables_write_case_by_case_in_place_of_alpha(result):
    main = next(part for part in tables(result) if isinstance(part, Table))
    alpha = [str(row[main.header.index("alpha")]) for row in main.rows]
    assert OUTSIDE_ALPHA in alpha
    assert any(cell.startswith("0.") for cell in alpha)


def test_the_weather_section_says_what_it_takes_for_them(result):
    text = result["weather"].attrs["case_by_case"]
    assert "have no factor in the table of alpha (case by case below Hs 1 m): no OP_WF and no window there" in text
    assert text in repr(document(result, {}))
    assert result.caused("no-alpha")
    assert "case by case" in repr(brief(result))


def test_a_table_that_reaches_as_low_leaves_nothing_open(lift, tmp_path):
    cells = "T_POP [h],Hs [m],alpha [1]\n" + "".join(f"12,{Hs},0.6\n" for Hs in (0.01, 1, 4))
    (tmp_path / "own.csv").write_text("# standard: agreed with the surveyor\n" + cells, encoding="utf-8")
    own = planned(lift, tier="closed-form", alpha=str(tmp_path / "own.csv"))
    assert not any(row["case_by_case"] for row in own.facts["limits"])
    assert own["weather"].attrs["case_by_case"] == ""
    assert np.nanmax(own.data["op_wf"] - 0.6 * np.minimum(own.data["Hs_limit"], 4.0)) == pytest.approx(0.0, abs=1e-9)
    assert own.facts["operation"]["alpha_table"]["name"] == "own.csv"


@pytest.mark.long
def test_the_command_prints_and_writes_it(tmp_path, capsys):
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    run(["plan", str(tmp_path / "plan.toml"), "--tier", "closed-form", "--json"])
    rows = json.loads(capsys.readouterr().out)["limits"]
    assert {row["op_wf"] is None for row in rows if row["case_by_case"]} == {True}
