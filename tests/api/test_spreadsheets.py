"""Tables to Excel and back: what is written is what is read again, and a sheet that cannot be is refused in one line."""

from __future__ import annotations

import csv
import math
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from tests.commands import answer, refusal

import stillhook
from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.formats.weather.alpha_table import read_alpha_table
from stillhook.formats.weather.file import read_weather
from stillhook.library import load_crane
from stillhook.plan.definition.rules import Tier
from stillhook.plan.file import load_plan
from stillhook.plan.planning import plan
from stillhook.plan.report.checked import checked
from stillhook.plan.report.sheets import LIMITS, limits_sheet, rules_sheet
from stillhook.plan.result import PlanResult, save_plan
from stillhook.spec.crane import content
from stillhook.tables.sheet import sheet_of

openpyxl = pytest.importorskip("openpyxl")
SITE = "SYNTHETIC-norwegian-sea"


def book(path: Path, **sheets: list[list[object]]) -> Path:
    """An Excel file with these rows in its sheets."""
    made = openpyxl.Workbook()
    made.remove(made.active)
    for name, rows in sheets.items():
        sheet = made.create_sheet(name)
        for row in rows:
            sheet.append(row)
    made.save(path)
    return path


def rows_of(path: Path, sheet: str) -> list[tuple[object, ...]]:
    return list(openpyxl.load_workbook(path, read_only=True)[sheet].iter_rows(values_only=True))


@pytest.mark.long
@pytest.mark.parametrize("ending", ["xlsx", "csv"])
@pytest.mark.parametrize("name", stillhook.cranes())
def test_a_cranes_sheet_becomes_the_same_crane_again(tmp_path: Path, name: str, ending: str):
    sheet, file = tmp_path / f"sheet.{ending}", tmp_path / "mine.toml"
    assert run(["convert", name, str(sheet)]) == 0
    assert run(["convert", str(sheet), str(file)]) == 0
    crane, of = load_crane(file), load_crane(name)
    assert content(crane) == content(of)
    assert crane.paper is of.paper
    assert crane.sources == of.sources


def test_a_value_that_is_changed_in_excel_changes_the_crane(tmp_path: Path):
    sheet = tmp_path / "sheet.xlsx"
    run(["convert", "nov-250t", str(sheet)])
    made = openpyxl.load_workbook(sheet)
    row = next(row for row in made["crane"].iter_rows() if row[0].value == "hook_mass")
    row[1].value, row[2].value, row[3].value = "4 t", "datasheet", "weighing report"
    made.save(sheet)
    assert run(["convert", str(sheet), str(tmp_path / "mine.toml")]) == 0
    crane = load_crane(tmp_path / "mine.toml")
    assert crane.hook_mass == 4000.0
    assert (crane.sources["hook_mass"].kind.value, crane.sources["hook_mass"].text) == ("datasheet", "weighing report")


@pytest.mark.long
def test_weather_in_excel_is_the_same_series_and_stays_marked_as_synthetic(tmp_path: Path):
    file = tmp_path / "site.xlsx"
    assert run(["convert", SITE, str(file)]) == 0
    read, of = read_weather(file), read_weather(SITE)
    assert np.array_equal(read.time, of.time)
    assert read.columns.keys() == of.columns.keys()
    for name, values in of.columns.items():
        assert np.allclose(read.columns[name], values, rtol=0.0, atol=1e-7, equal_nan=True), name
    assert any(note.startswith("SYNTHETIC") for note in read.notes)


def test_a_hindcast_is_read_from_a_sheet_by_name_with_dates_of_excel_and_empty_cells(tmp_path: Path):
    times = [datetime(2026, 1, 1, hour, 59, 59, 999_999) if hour else datetime(2026, 1, 1) for hour in range(3)]
    rows = [["Date", "Hs [m]", "Tp [s]"], *([t, 1.25 + i, None if i == 1 else 8] for i, t in enumerate(times))]
    file = book(tmp_path / "site.xlsx", notes=[["nothing"]], waves=rows)
    weather = read_weather(f"{file}#waves")
    assert weather.time.astype("datetime64[s]").tolist() == [datetime(2026, 1, 1, h) for h in (0, 2, 3)]
    assert weather.columns["H_m0"].tolist() == [1.25, 2.25, 3.25]
    assert math.isnan(weather.columns["T_p"][1])


def test_a_plan_names_a_sheet_for_its_weather_and_a_description_too(tmp_path: Path, capsys):
    rows = [["time_utc", "Hs [m]", "Tp [s]"], *([datetime(2026, 1, 1, 3 * i), 1.0, 8.0] for i in range(8))]
    book(tmp_path / "site.xlsx", other=[["nothing"]], waves=rows)
    run(["new", "lift", str(tmp_path / "lift.toml")])
    text = (tmp_path / "lift.toml").read_text("utf-8").replace(SITE, "site.xlsx#waves")
    (tmp_path / "lift.toml").write_text(text, encoding="utf-8")
    assert load_plan(tmp_path / "lift.toml").weather.file.endswith("site.xlsx#waves")
    (tmp_path / "weather.toml").write_text('file = "site.xlsx#waves"\n[columns]\nHs = "Hs"\n', encoding="utf-8")
    capsys.readouterr()
    assert answer(capsys, "weather", "show", str(tmp_path / "weather.toml"))["n_records"] == 8


def test_factors_charts_and_maps_are_read_from_a_sheet_by_name(tmp_path: Path):
    hours = [["T_POP [h]", "Hs [m]", "alpha [1]"], [12, 1, 0.7], [12, 2, 0.8], [24, 1, 0.6], [24, 2, 0.7]]
    chart = [["radius [m]", "SWL [t]", "DAF [1]"], [10, 250, 1.3], [30, 180, 1.3]]
    file = book(tmp_path / "own.xlsx", notes=[["nothing"]], factors=hours, chart=chart)
    assert read_alpha_table(f"{file}#factors").alpha == ((0.7, 0.8), (0.6, 0.7))
    run(["new", "lift", str(tmp_path / "lift.toml")])
    text = (tmp_path / "lift.toml").read_text("utf-8")
    text = text.replace("# [load_chart]", "[load_chart]").replace('# file = ""', 'file = "own.xlsx#chart"', 1)
    (tmp_path / "lift.toml").write_text(text, encoding="utf-8")
    plan_ = load_plan(tmp_path / "lift.toml")
    assert plan_.load_chart is not None
    (tmp_path / "lift.toml").write_text(text.replace("#chart", "#charts"), encoding="utf-8")
    with pytest.raises(StillhookError, match=r'own\.xlsx: no sheet "charts"\. It has "notes", "factors", "chart"\.'):
        load_plan(tmp_path / "lift.toml")


def test_a_name_with_a_sign_is_itself_where_the_file_is_there(tmp_path: Path):
    file = book(tmp_path / "a.xlsx#b", waves=[["time"]])
    assert sheet_of(file) == (file, "")
    assert sheet_of(tmp_path / "a.xlsx#c") == (tmp_path / "a.xlsx", "c")
    assert sheet_of(tmp_path / "site#2.csv") == (tmp_path / "site#2.csv", "")


@pytest.fixture(scope="module")
def result() -> PlanResult:
    return plan(load_plan("template-to-1500m"), tier=Tier.CLOSED_FORM)


@pytest.mark.long
def test_every_cell_of_the_limits_is_a_row_with_what_governs(result: PlanResult, tmp_path: Path):
    sheet = limits_sheet(result)
    data = result.data["Hs_limit"]
    assert len(sheet.rows) == data.size
    for row in sheet.rows[:: max(1, len(sheet.rows) // 50)]:
        of = dict(zip(LIMITS, row, strict=True))
        at = {"credit": of["credit"], "alternative": of["alternative"], "period": of["Tp [s]"]}
        cell = data.sel(at).sel(heading=math.radians(of["heading [deg]"]), method="nearest")
        assert of["Hs_limit [m]"] == pytest.approx(float(cell), nan_ok=True)
        assert bool(of["remark"]) == (not 0.0 < float(cell) < math.inf)
    assert any("SYNTHETIC" in remark for remark in sheet.remarks)
    save_plan(result, tmp_path / "plan")
    assert run(["convert", str(tmp_path / "plan"), str(tmp_path / "limits.xlsx")]) == 0
    written = rows_of(tmp_path / "limits.xlsx", "limits")
    assert len(written) == len(sheet.rows) + 1 + len(sheet.remarks)
    assert len(rows_of(tmp_path / "limits.xlsx", "rules")) == len(rules_sheet(result.facts).rows) + 1
    assert run(["convert", str(tmp_path / "plan"), str(tmp_path / "limits.csv")]) == 0
    with (tmp_path / "limits.csv").open(encoding="utf-8", newline="") as file:
        assert len(list(csv.reader(file))) == len(written)


@pytest.mark.long
def test_the_rule_check_of_a_lift_has_a_row_for_each_rule_phase_and_alternative(tmp_path: Path):
    run(["new", "lift", str(tmp_path / "lift.toml")])
    assert run(["convert", str(tmp_path / "lift.toml"), str(tmp_path / "rules.xlsx")]) == 0
    facts = checked(load_plan(tmp_path / "lift.toml"))
    rows = rows_of(tmp_path / "rules.xlsx", "rules")
    assert len(rows) - 1 == sum(len(cell["rules"]) for cell in facts["limits"])
    static = next(row for row in rows if row[0] == "static-load")
    assert static[6] == pytest.approx(253e3 * 9.80665)
    assert static[7] == "N"


@pytest.mark.long
def test_a_run_is_written_for_excel_with_its_numbers(tmp_path: Path):
    case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 10 s", duration="20 s", warm_up="0 s")
    run_ = stillhook.simulate(load_crane("nov-250t"), case)
    stillhook.save_run(run_, tmp_path / "runs.nc")
    assert (
        run(["convert", str(tmp_path / "runs.nc"), str(tmp_path / "runs.xlsx"), "--signals", "s_tip", "--every", "1 s"])
        == 0
    )
    heads, *rows = rows_of(tmp_path / "runs.xlsx", "run")
    assert heads == ("time [s]", "s_tip [m]")
    assert [row[0] for row in rows][:3] == [0, 1, 2]


def test_a_text_that_begins_with_an_equals_sign_is_no_formula(tmp_path: Path):
    run(["new", "crane", str(tmp_path / "mine.toml")])
    text = (tmp_path / "mine.toml").read_text("utf-8").replace("Our crane, after nov-250t", "=1+1")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    run(["convert", str(tmp_path / "mine.toml"), str(tmp_path / "sheet.xlsx")])
    cell = next(
        row for row in openpyxl.load_workbook(tmp_path / "sheet.xlsx")["crane"].iter_rows() if row[0].value == "title"
    )
    assert (cell[1].value, cell[1].data_type) == ("=1+1", "s")


HEAD = ["field", "value", "kind", "source"]


@pytest.mark.parametrize(
    ("rows", "line"),
    [
        ([["field", "number"], ["SWL", "250 t"]], 'no column "value". A sheet of a crane has field, value, kind'),
        ([HEAD, ["SWL", "250 t", "guess", "x"]], 'row 2: kind "guess": choose published, datasheet'),
        (
            [HEAD, ["SWL", "250 t", "user", "x"], ["SWL", "200 t", "user", "x"]],
            'row 3: "SWL" is given twice, first in row 2',
        ),
        ([HEAD, ["safe load", "250 t", "user", "x"]], 'row 2: field "safe load": write its dotted name'),
        ([HEAD, ["SWL", "250 m", "user", "x"], ["name", "mine"]], 'unit "m" is not one of'),
        ([HEAD, ["name", "mine"]], "missing"),
        ([], "is empty"),
    ],
)
def test_a_crane_sheet_that_cannot_be_is_refused(tmp_path: Path, capsys, rows: list[list[object]], line: str):
    file = book(tmp_path / "sheet.xlsx", crane=rows)
    assert run(["convert", str(file), str(tmp_path / "mine.toml")]) == 2
    refused = capsys.readouterr().err.strip().splitlines()
    assert refused[0].startswith("error: sheet.xlsx: ")
    assert any(line in each for each in refused)


def test_what_is_no_sheet_is_refused_with_what_there_is(tmp_path: Path, capsys):
    file = book(tmp_path / "site.xlsx", waves=[["time_utc", "Hs [m]"], ["2026-01-01", 1.0]])
    assert 'no sheet "wave". It has "waves".' in refusal(capsys, "weather", "show", f"{file}#wave")
    assert "no such file" in refusal(capsys, "weather", "show", tmp_path / "none.xlsx#waves")
    (tmp_path / "bad.xlsx").write_bytes(b"PK\x03\x04 no book")
    assert "not a readable Excel file" in refusal(capsys, "weather", "show", tmp_path / "bad.xlsx")
    assert "--case" in refusal(capsys, "convert", "nov-250t", tmp_path / "x.xlsx", "--case", "SSC")
    (tmp_path / "there.toml").touch()
    assert "is there already" in refusal(capsys, "convert", file, tmp_path / "there.toml")
