"""How a table in text is written: encoding, separator, decimal sign, headings, a row of units, first row of data.

Found from the first part of a file by its rows of numbers (`dialect_of`), or by its header, the first line that is no
comment (`header_of`).
Units as other programs spell them, and what they are in ours.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from stillhook.errors import LogError, StillhookError
from stillhook.units import KINDS, quote

STAMPS = "UTC"  # the unit of a column of times that holds ISO 8601 stamps
PURE = {"1": 1.0, "%": 0.01}  # units of pure numbers
SCALES = {
    "psi": ("bar", 0.0689476),
    "psig": ("bar", 0.0689476),
    "in": ("mm", 25.4),
    "in/s": ("mm/s", 25.4),
    "ft": ("m", 0.3048),
    "lbs": ("N", 4.448222),
    "lbf": ("N", 4.448222),
    "mbar": ("bar", 0.001),
    "V": (None, None),
    "mA": (None, None),
}
"""What people write, the unit of ours that comes nearest, and the factor between them; None for raw sensor values."""
_SAME = {
    **dict.fromkeys(("rpm", "r/min", "1/min"), "rev/min"),
    **dict.fromkeys(("°c", "c"), "degC"),
    **dict.fromkeys(("l/min", "lpm"), "L/min"),
    **dict.fromkeys(("cc/rev", "cm3/rev"), "cm^3/rev"),
    **dict.fromkeys(("tonne", "te"), "t"),
} | {"°": "deg", "sec": "s", "nm": "N m", "kg·m": "kg m", "m/s2": "m/s^2"}
"""Spellings found in files, in lower case, and ours."""


def our_unit(unit: str, kind: str) -> str | None:
    """The unit as Stillhook spells it, where it is one of the kind; spellings such as rpm are known. None otherwise."""
    allowed_units = KINDS[kind].allowed if kind else tuple(PURE)
    tidy = " ".join(unit.strip().strip("[]()").split())
    if not kind and tidy in ("", "-"):
        return "1"
    return next((ours for ours in (tidy, _SAME.get(tidy.lower())) if ours in allowed_units), None)


def is_unit(text: str) -> bool:
    """Whether a text is a unit of any kind of quantity, or a raw one such as psi."""
    return text.strip() in SCALES or any(our_unit(text, kind) is not None for kind in KINDS)


WEIGHT = {"t": 9806.65, "te": 9806.65, "tonne": 9806.65, "tf": 9806.65, "kg": 9.80665, "kgf": 9.80665}
"""Masses that a load cell shows in place of forces, and the weight of one [N]."""


def table_unit(unit: str, kind: str) -> tuple[str, float] | None:
    """The unit of ours for one that a table gives, and the factor to it: a load cell's tonnes are a force by their
    weight. None where it is not a unit of the kind."""
    ours = our_unit(unit, kind)
    if ours is not None:
        return ours, 1.0
    if kind == "force" and (weight := WEIGHT.get(unit.strip().strip("[]()").strip())) is not None:
        return "N", weight
    return None


_WITH_UNIT = re.compile(r"(?P<column>.*?\S)\s*\[(?P<unit>[^\[\]]+)\]\s*")


def apart(column: str, unit: str | None, headings: Sequence[str]) -> tuple[str, str | None]:
    """A heading and its unit out of a text with both, such as "PT101 [bar]", which is not a heading of the file as it
    is."""
    if unit is not None or any(column == h.strip() for h in headings) or not (match := _WITH_UNIT.fullmatch(column)):
        return column, unit
    return match["column"], match["unit"].strip()


def hint(unit: str, kind: str) -> str:
    """What to write for a unit that is not ours."""
    unit_name, factor = SCALES.get(unit.strip(), (None, None))
    if unit_name is not None and kind and unit_name in KINDS[kind].allowed:
        return f' Write unit = "{unit_name}", scale = {factor}.'
    example = f'unit = "{KINDS[kind].display if kind else "1"}", scale = 0.1'
    return f" Choose one of these and the factor to it as scale, such as {example}."


COMMENTS = (b"#", b"//", b"%")
COLUMN_SEPARATORS = (";", "\t", "|", ",", " ")  # " ": runs of blanks
PLAIN_SEPARATORS = (";", "\t", "|")
"""Separators that are nothing else in a row of numbers."""
FEW_LINES = 200  # lines of the head that are looked at for the rows of data
MAJORITY = 0.5  # of the cells of a row of data that must be numbers, stamps or marks of missing values
MISSING = frozenset({"", "-", "--", "---", "nan", "n/a", "na", "#n/a", "null", "none", "mm", "missing", "*"})
"""What represents a missing number, in lower case."""
_NO_NUMBER = MISSING | {"bad", "inf", "-inf"}
_NUMBER = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?(?:\d+,\d*|,\d+)(?:[eE][+-]?\d+)?")
_POINT = re.compile(r"[+-]?(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?")
_STAMP = re.compile(
    r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}([T ].*)?|\d{1,2}:\d\d(:\d\d)?([.,]\d+)?( ?[AP]M)?Z?"
    r"|\d{8}T?\d{6}([.,]\d+)?(Z|[+-]\d\d:?\d\d)?"
)
_MARK = re.compile(r"^\s*(?:#|//|%)\s*")
_UNIT = re.compile(
    r"[\[(].*[\])]|%|-|1|psi[ag]?|rpm|m?[AV]|in(/s)?|lbs?f?|mbar|°C?|bar[ag]|U/min|1/min|l/min|k?Nm|cSt", re.IGNORECASE
)


@dataclass(frozen=True)
class Dialect:
    """How a text log is written."""

    encoding: str
    separator: str
    decimal: str
    first_line: int
    """Line number of the first row of data."""
    header_line: int
    """0 where there is none; columns are then named by their place."""
    headings: tuple[str, ...]
    units: tuple[str, ...]
    fields: int
    """Fields in a row of data, empty ones at its end included."""
    first_row: tuple[str, ...]


def dialect_of(
    head: bytes, name: str, complete: bool, noun: str = "log", error: type[StillhookError] = LogError
) -> Dialect:
    """The dialect of a file that begins with these bytes. complete: they are the file; noun: what it should be, for
    messages. Errors: one line where no table is found."""
    encoding, text = head_text(head)
    lines = text.split("\n")
    if not complete and len(lines) > 1:
        lines.pop()  # the last one is cut off
    if not any(line.strip() for line in lines):
        raise error(f"{name}: is empty. Give a {noun} with a header and rows of numbers.")
    ways = [(*rows, separator) for separator in COLUMN_SEPARATORS if (rows := _data_rows(lines, separator))]
    if not ways:
        begin = quote(next((line for line in lines if line.strip()), ""))
        problem = "holds no table: no rows of numbers below a header, separated by ; tab | , or blanks"
        raise error(f"{name}: {problem}. It begins with {begin}.")
    most = max((len(rows) for _, rows, sign in ways if sign in PLAIN_SEPARATORS), default=0)
    ways = [way for way in ways if way[2] != "," or len(way[1]) > most]  # commas are then decimal
    # most rows, then most fields; blanks last
    fields, rows_at, separator = max(ways, key=lambda way: (len(way[1]), way[0] if way[2] != " " else 0))
    first = rows_at[0]
    cells = [split_row(lines[i], separator) for i in rows_at]
    header, units = _header(lines, first, fields, separator)
    headings = tuple(str(i + 1) for i in range(fields))
    if header is not None:
        names = _heading_cells(lines[header], fields, separator)
        _refuse_other_width(name, header + 1, len(names), cells, separator, error)
        headings = (*names, *headings[len(names) :])
    unit_cells = tuple(split_row(_MARK.sub("", lines[units]), separator)[:fields]) if units is not None else ()
    bare = [unit.strip().strip("[]()").strip() for unit in (*unit_cells, *[""] * (fields - len(unit_cells)))]
    return Dialect(
        encoding,
        separator,
        decimal_of(cells, [i + 1 for i in rows_at], name, noun, error),
        first + 1,
        0 if header is None else header + 1,
        headings,
        tuple(bare),
        fields,
        tuple(cells[0]),
    )


def _refuse_other_width(
    name: str, line: int, names: int, cells: list[list[str]], separator: str, error: type[StillhookError]
) -> None:
    """Refuse rows of data that hold more than the header names; empty fields at their end do no harm."""
    if names <= len(cells[0]) and not any(cell for row in cells for cell in row[names:]):
        return
    comma = ' A decimal comma needs ";" between columns.' if separator == "," else ""
    problem = f"the header names {names} columns and the rows below hold {len(cells[0])} fields"
    raise error(f"{name}: line {line}: {problem}.{comma} Correct the header or the export.")


def head_text(head: bytes) -> tuple[str, str]:
    """The encoding of a text that begins with these bytes, and its begin with "\\n" at the end of each line."""
    encoding = _encoding(head)
    return encoding, one_newline(head.decode(encoding, errors="replace").removeprefix("\ufeff"))


def one_newline(text: str) -> str:
    """A text with "\\n" at the end of each line."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _encoding(head: bytes) -> str:
    if head.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    even, odd = head[0::2].count(0), head[1::2].count(0)
    if max(even, odd) > len(head) // 5:
        return "utf-16-le" if odd > even else "utf-16-be"
    try:
        head[: max(0, len(head) - 4)].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def split_row(line: str, separator: str) -> list[str]:
    """The cells of a line, without quotes and blanks around them; two quotes within quotes are one."""
    if separator == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    cells, quoted, cell = [], False, ""
    for before, sign in zip(f" {line}", line, strict=False):
        if sign == '"':
            cell += '"' if before == '"' and not quoted else ""
            quoted = not quoted
        elif sign == separator and not quoted:
            cells.append(cell.strip())
            cell = ""
        else:
            cell += sign
    return [*cells, cell.strip()]


def _value_count(cells: list[str]) -> int:
    """How many cells of a row of data are numbers or stamps; 0 for a line that is not a row of data."""
    filled = [cell for cell in cells if cell.lower() not in _NO_NUMBER]
    values = sum(bool(_NUMBER.fullmatch(cell) or _STAMP.fullmatch(cell)) for cell in filled)
    return values if values >= MAJORITY * len(filled) else 0


def _data_rows(lines: list[str], separator: str) -> tuple[int, list[int]] | None:
    """Fields in a row of data, and which of the first lines are rows of data."""
    if separator != " " and not any(separator in line for line in lines):
        return None
    rows: list[tuple[int, int, int]] = []
    for i, line in enumerate(lines):
        if len(rows) >= FEW_LINES:
            break
        if not line.strip() or _MARK.match(line):
            continue
        cells = split_row(line, separator)
        if len(cells) > 1 and (values := _value_count(cells)):
            rows.append((i, len(cells), values))
    if not rows:
        return None
    fields = Counter(n for _, n, _ in rows).most_common(1)[0][0]
    full = max(values for _, n, values in rows if n == fields)  # a padded line, Date;2020-01-01;;;;, holds fewer
    return fields, [i for i, n, values in rows if n == fields and values >= MAJORITY * full]


def _heading_cells(line: str, fields: int, separator: str) -> list[str]:
    """The headings of a line: split as the data are, or, above data in blanks, by any sign that gives as many."""
    bare = _MARK.sub("", line)
    for sign in dict.fromkeys((separator, *COLUMN_SEPARATORS)):
        cells = split_row(bare, sign)
        while len(cells) > 1 and not cells[-1]:
            cells.pop()
        if len(cells) == fields or (sign == separator and sign != " " and len(cells) > 1):
            return cells
    return []


def _header(lines: list[str], first: int, fields: int, separator: str) -> tuple[int | None, int | None]:
    """Which lines hold the headings and the units above the first row of data; None where there are none."""
    rows = [
        i
        for i in range(first)
        if len(cells := _heading_cells(lines[i], fields, separator)) > 1 and not _value_count(cells)
    ]
    if not rows:
        return None, None
    most = max(len(_heading_cells(lines[i], fields, separator)) for i in rows)  # lines before the header are shorter
    rows = [i for i in rows if len(_heading_cells(lines[i], fields, separator)) > MAJORITY * most]
    rows = [i for i in rows if not _MARK.match(lines[i])] or rows  # a comment is the header only where no other line is
    last = rows[-1]
    if len(rows) > 1 and _are_units(_heading_cells(lines[last], fields, separator)):
        return rows[-2], last
    return last, None


def _are_units(cells: list[str]) -> bool:
    filled = [cell for cell in cells if cell]
    units = sum(
        bool(_UNIT.fullmatch(cell)) or any(our_unit(cell, kind) is not None for kind in KINDS) or cell in ("UTC", "ISO")
        for cell in filled
    )
    return units > MAJORITY * len(filled)


def decimal_of(
    rows: list[list[str]], numbers: list[int], name: str, noun: str = "log", error: type[StillhookError] = LogError
) -> str:
    """The decimal sign: a comma where cells such as 12,5 say so, a point otherwise; both together are refused."""
    cells = [(n, cell) for n, row in zip(numbers, rows, strict=True) for cell in row]
    comma, point = (next((place for place in cells if sign.fullmatch(place[1])), None) for sign in (_COMMA, _POINT))
    if comma is None:
        return "."
    if point is not None:
        both = f"comma ({quote(comma[1])}, line {comma[0]}) and with a point ({quote(point[1])}, line {point[0]})"
        do = f"Export the {noun} with one decimal sign and no sign between thousands."
        raise error(f"{name}: numbers with a decimal {both}. {do}")
    return ","
