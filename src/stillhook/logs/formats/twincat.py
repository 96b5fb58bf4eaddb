"""Text exports of TwinCAT Scope: a head of lines with a name before each value, then rows of time and signals.

The line "Name" gives the headings, "Unit" the units, and SampleTime[ms] says that times are in ms. Where the word Name
comes again in that line, a column of times of its own begins: the signals behind it belong to it.
"""

from __future__ import annotations

import re

from stillhook.formats.table.dialect import Dialect, decimal_of, head_text, split_row

_HEAD = re.compile(r"Name[\t;,].*?[\r\n].*?SampleTime\[(ms|s|us)\]", re.DOTALL)
NAME, UNIT = "Name", "Unit"


def twincat_dialect(head: bytes, name: str) -> Dialect | None:
    """The dialect of an export of TwinCAT Scope; None for any other file. Errors: LogError where decimal signs
    differ."""
    encoding, text = head_text(head)
    match = _HEAD.match(text)
    if match is None:
        return None
    lines = text.split("\n")
    separator = text[len(NAME)]
    rows = {
        row[0].strip(): (i, row)
        for i, line in enumerate(lines[:200])
        if (row := split_row(line, separator)) and row[0].strip()
    }
    at, names = rows[NAME]
    units = rows.get(UNIT, (at, []))[1]
    first = next((i for i in range(at + 1, len(lines)) if re.match(r"[+-]?\d", lines[i])), None)
    if first is None:
        return None
    cells = [split_row(line, separator) for line in lines[first : first + 50] if line.strip()]
    fields = len(cells[0])
    times = [i for i, cell in enumerate(names) if cell.strip() == NAME]
    label = {place: "time" if k == 0 else f"time {k + 1}" for k, place in enumerate(times)}
    headings = tuple(label.get(i, names[i] if i < len(names) and names[i] else str(i + 1)) for i in range(fields))
    unit = tuple(match[1] if i in label else units[i].strip("()[]") if i < len(units) else "" for i in range(fields))
    return Dialect(
        encoding,
        separator,
        decimal_of(cells, [first + 1 + i for i in range(len(cells))], name),
        first + 1,
        at + 1,
        headings,
        unit,
        fields,
        tuple(cells[0]),
    )
