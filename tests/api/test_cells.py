"""Texts that a spreadsheet would take for formulas are written as texts, and read back as they were."""

import csv
import io
import re
from pathlib import Path

import openpyxl
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import stillhook
from stillhook.errors import PlanError, SpecError
from stillhook.formats.table.cells import cell_of, csv_of, remark_of, text_of
from stillhook.formats.table.crane_sheet import crane_file_of_sheet, crane_sheet
from stillhook.formats.table.workbook import Sheet, write_sheets

EVIL = [
    "=1+1",
    "=cmd|'/c calc'!A1",
    '=HYPERLINK("http://x","y")',
    "+1+1",
    "-1+1|cmd",
    "@SUM(1,1)",
    "\t=1+1",
    "\r=1+1",
    " =1+1",
    '"=1+1',
    "'=1+1",
    "\uff1d1+1",
    "\n=1",
]
STARTS = re.compile('[\\s\\x00-\\x1f"]*[=+\\-@\uff1d\uff0b\uff0d\uff20]')


@pytest.mark.parametrize("text", EVIL)
def test_a_text_that_is_a_formula_begins_with_an_apostrophe(text: str) -> None:
    assert cell_of(text) == "'" + text


@pytest.mark.parametrize(
    "value", ["-1.5", "+2", "-3,2", "-1e-3", "+.5", "load 100 t", "a=b", "", "a\nb", -1.5, 3, None]
)
def test_numbers_and_other_texts_stay_as_they_are(value: object) -> None:
    assert cell_of(value) is value


@given(st.text())
def test_every_text_reads_back_and_none_begins_as_a_formula(text: str) -> None:
    cell = cell_of(text)
    assert text_of(cell) == text
    assert not STARTS.match(cell) or re.fullmatch(r"[+-][\d.,]*\d[\d.,]*([eE][+-]?\d+)?[\d.,]*", cell)


@given(
    st.lists(
        st.tuples(st.text(alphabet=st.characters(codec="utf-8")), st.floats(allow_nan=False)), min_size=1, max_size=5
    )
)
@example([("\r", 0.0), ("a\r\nb", 1.0)])
def test_a_table_keeps_its_numbers_and_names(rows: list[tuple[str, float]]) -> None:
    table = pd.DataFrame(rows, columns=["=name", "value [m]"])
    head, *body = csv.reader(io.StringIO(csv_of(table), newline=""))
    assert head == ["'=name", "value [m]"]
    assert [(text_of(name), float(value)) for name, value in body] == rows


@pytest.mark.parametrize("ending", [".csv", ".xlsx"])
def test_a_sheet_holds_no_formula(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"sheet{ending}"
    evil = [text for text in EVIL if text.isprintable()]
    sheet = Sheet("names", ["=head", "value"], [[text, -1.5] for text in evil], ["note\n=1+1"])
    write_sheets([sheet], file, PlanError)
    if ending == ".xlsx":
        pages = openpyxl.load_workbook(file)
        rows = list(pages.active.iter_rows())
        assert {cell.data_type for row in rows for cell in row if cell.value is not None} <= {"s", "n"}
        assert [row[0].value for row in rows[2:]] == evil
        assert all(row[0].quotePrefix and row[1].value == -1.5 for row in rows[2:])
    else:
        remark, *lines = file.read_text().splitlines()
        assert remark == "# note =1+1"
        head, *body = csv.reader(lines)
        assert head[0] == "'=head"
        assert [(text_of(name), float(value)) for name, value in body] == [(text, -1.5) for text in evil]


def test_the_sheet_of_a_crane_reads_back_as_the_same_crane(tmp_path: Path) -> None:
    crane = stillhook.load_crane("nov-250t").model_copy(update={"title": "=1+1 our crane"})
    file = write_sheets([crane_sheet(crane)], tmp_path / "crane.csv", SpecError)
    (tmp_path / "crane.toml").write_text(crane_file_of_sheet(file))
    again = stillhook.load_crane(tmp_path / "crane.toml")
    assert again.title == crane.title
    assert again.model_dump(exclude={"sources", "name"}) == crane.model_dump(exclude={"sources", "name"})


@pytest.mark.parametrize("separator", [",", ";", ", ", "\t,", ',"'])
@pytest.mark.parametrize("text", EVIL)
def test_no_part_of_a_remark_is_a_formula(tmp_path: Path, text: str, separator: str) -> None:
    """The name of a plan or a vessel is in a line above its table, which a spreadsheet cuts at its separators."""
    file = write_sheets(
        [Sheet("a", ("b",), [(1.0,)], (f"plan: ours{separator}{text}",))], tmp_path / "a.csv", PlanError
    )
    first, *rest = file.read_text(encoding="utf-8").splitlines()
    assert rest == ["b", "1.0"]
    assert not any(STARTS.match(part) for part in re.split("[,;\t]", first))


def test_a_remark_without_formulas_stays_as_it_is() -> None:
    text = "headings 165, -180; 195 deg: x = 1 - 2, 3+4"
    assert remark_of(text) == text
