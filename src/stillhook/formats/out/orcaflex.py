"""Time history of OrcaFlex: a text with tabs, a line of column names, the time in the first column [s]. Lengths are in
m, forces in kN, masses in te, as OrcaFlex's SI units are.

Source: OrcaFlex help, pages "Time history data" and "Time history files" (Orcina, 2024). Not tried in OrcaFlex.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stillhook.formats.out.table import Content, number, series_of

SUFFIX, TITLE = ".txt", "OrcaFlex time history"
IN_KILO = {"N": "kN", "N m": "kN.m", "kg": "te", "W": "kW", "Pa": "kPa", "J": "kJ"}
"""Units that OrcaFlex counts in thousands."""


def write(content: Content, file: Path) -> None:
    """Write a file. Errors: ConvertError for several cases, and for numbers without a time."""
    table = series_of(content, TITLE)
    names = ["Time", *(c.name for c in table.columns[1:])]
    columns = [c.values * (1e-3 if c.unit in IN_KILO else 1.0) for c in table.columns]
    rows = ("\t".join(map(number, row)) for row in np.column_stack(columns))
    file.write_text("\n".join(["\t".join(names), *rows]) + "\n", encoding="utf-8")
