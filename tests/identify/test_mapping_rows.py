"""The row of a mapping file says how a column is read: read again, it means the same."""

import tomllib

import pytest

from stillhook.formats.table.understood import ReadColumn, Understood, mapping_text

WRITTEN = {"unit": "", "sign": 1, "scale": 1.0, "offset": 0.0}


def meaning(row: ReadColumn) -> tuple[str, str, int, float, float]:
    """Heading, unit, sign, scale and offset of a row in TOML."""
    value = tomllib.loads(f"x = {row.row}")["x"]
    found = WRITTEN | ({"column": value} if isinstance(value, str) else value)
    return found["column"], found["unit"], found["sign"], found["scale"], found["offset"]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("scale", "offset"), [(0.5, 0.0), (1.0, 2.5), (0.5, 2.5), (-2.0, -1.0)])
def test_scale_and_offset_come_back_from_the_row(sign, scale, offset):
    row = ReadColumn("p_a", "P01", "bar", sign, "pressure", scale=scale, offset=offset)
    assert meaning(row) == ("P01", "bar", sign, scale, offset)


@pytest.mark.parametrize(("scale", "offset", "unwritten"), [(0.5, 0.0, "offset"), (1.0, 2.5, "scale")])
def test_what_changes_nothing_is_left_out(scale, offset, unwritten):
    assert unwritten not in ReadColumn("p_a", "P01", "bar", 1, "pressure", scale=scale, offset=offset).row


def test_a_plain_column_is_its_heading_with_unit_and_direction():
    assert ReadColumn("s_w", "Wire", "m", -1, "length").row == '"Wire [m] down"'
    assert ReadColumn("s_w", "Wire [m]", "m", 1, "length").row == '"Wire [m]"'


@pytest.mark.parametrize("heading", ["Pos \U0001f6a2", 'a "b" \\', "x\x7f", "#]}", "two\nlines"])
def test_every_heading_and_unit_is_read_back(heading):
    row = ReadColumn("p_a", heading, heading, 1, "pressure", scale=2.0)
    assert meaning(row)[:2] == (heading, heading)


def test_the_name_of_a_file_and_what_is_not_read_are_remarks_of_one_line():
    name = "log\n[columns]\nx = 1\u2028\x1b"
    text = mapping_text(Understood(name, "log", (ReadColumn("p_a", "P", "bar"),), unused=(name,)))
    assert tomllib.loads(text) == {"columns": {"p_a": "P [bar]"}}
    assert {line[:1] for line in text.splitlines() if "x = 1" in line} == {"#"}
