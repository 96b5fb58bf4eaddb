"""Time series for SIMA and SIMO as text: comment lines with names and units, then columns with the time first. Forces
are in kN, masses in t, as SIMO's are.

Source: what is public of SIMO's text series, as read by QATS (DNV, 2024): a comment line that begins with #, names in
it, blanks between columns. Not tried in SIMA.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stillhook.formats.out.orcaflex import IN_KILO
from stillhook.formats.out.table import Content, number, series_of

SUFFIX, TITLE = ".asc", "SIMA text series"


def write(content: Content, file: Path) -> None:
    """Write a file. Errors: ConvertError for several cases, and for numbers without a time."""
    table = series_of(content, TITLE)
    columns = [c.values * (1e-3 if c.unit in IN_KILO else 1.0) for c in table.columns]
    names = "# " + " ".join(c.name for c in table.columns)
    rows = (" ".join(number(x) or "nan" for x in row) for row in np.column_stack(columns))
    file.write_text("\n".join([names, *rows]) + "\n", encoding="utf-8")
