"""CSV: a line with names and units, a line for each time or case; numbers read back to the same doubles.

Series of several cases stand below one another with the case in the first column.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from stillhook.formats.out.table import Content, heading, number

SUFFIX, TITLE = ".csv", "text with commas"


def write(content: Content, file: Path) -> None:
    """Write a file."""
    tables = content.tables
    several = len(tables) > 1
    of_cases = not tables[0].is_series and "case" in content.texts
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    extra = {n: v for n, v in content.texts.items() if not tables[0].is_series and n != "case"}
    head = [heading(c) for c in tables[0].columns]
    writer.writerow([*(["case"] if several or of_cases else []), *head, *extra])
    for table in tables:
        rows = np.column_stack([c.values for c in table.columns])
        for i, row in enumerate(rows):
            first = [table.name] if several else [content.texts["case"][i]] if of_cases else []
            writer.writerow([*first, *map(number, row), *(v[i] for v in extra.values())])
    file.write_text(text.getvalue(), encoding="utf-8", newline="")
