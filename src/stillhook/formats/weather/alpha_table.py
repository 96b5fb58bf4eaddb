"""Tables of alpha factors as users bring them: TOML as the library's own, or a table of one row a cell, CSV or XLSX,
with `T_POP [h]`, `Hs [m]` and `alpha [1]`; of an Excel file the sheet after a #.

Lines of remarks above the table say where it is from: "# standard: DNV-ST-N001", and likewise title, version, edition,
clause, note, source, level, monitoring, T_POP_below and T_R_below (72 h and 96 h without them).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path

from stillhook.base.choice import nearest
from stillhook.errors import UnitError, WeatherError
from stillhook.formats.table.columns import ColumnSpec
from stillhook.formats.table.read import Columns, read_columns
from stillhook.tables.sheet import sheet_of
from stillhook.units import parse, quote, show
from stillhook.weather.alpha import DEFAULT, TEXTS, AlphaTable, alpha_tables, load_alpha_table

COLUMNS = (
    ColumnSpec("T_POP", "hours", ("tpop", "t-pop", "planned_operation_period"), "T_POP [h]", required=True),
    ColumnSpec("Hs", "length", ("h_s", "hm0", "op_lim"), "Hs [m]", required=True),
    ColumnSpec("alpha", "", ("alpha_factor", "factor"), "alpha [1]", required=True),
)
ENDINGS = (".csv", ".txt", ".tsv", ".xlsx", ".xlsm", ".parquet", ".pq")
"""Files that hold a table of one row a cell."""
RESTRICTED = {"T_POP_below": "72 h", "T_R_below": "96 h"}
"""Ends of what counts as weather restricted, where a file does not give them: those of DNV-OS-H101 (not compared with
print)."""


def read_alpha_table(name_or_path: str = DEFAULT) -> AlphaTable:
    """A table by its name in the library, or from a file: TOML, CSV or XLSX.

    Errors: WeatherError of one line that names file and place: a column, unit or cell that is missing, a factor that is
    not above 0 and at most 1, a cell that is given twice, remarks that are none.
    """
    if name_or_path in alpha_tables() or sheet_of(Path(name_or_path))[0].suffix.lower() not in ENDINGS:
        return load_alpha_table(name_or_path)
    try:
        return _table(read_columns(name_or_path, COLUMNS, error=WeatherError))
    except UnitError as e:
        raise WeatherError(str(e)) from None


def _table(columns: Columns) -> AlphaTable:
    cells: dict[tuple[float, float], float] = {}
    rows = zip(columns.numbers, *(columns.values[spec.name] for spec in COLUMNS), strict=True)
    for number, T_POP, Hs, alpha in rows:
        where = f"{columns.source}: row {number}"
        if math.isnan(T_POP) or math.isnan(Hs) or math.isnan(alpha):
            raise WeatherError(f"{where}: a cell is empty. Write T_POP, Hs and alpha in every row.")
        cell = f"T_POP {T_POP / 3600.0:g} h, Hs {show(float(Hs), 'length')}"
        if not (T_POP > 0.0 and Hs > 0.0 and 0.0 < alpha <= 1.0):
            allowed = "times and heights are above 0, factors above 0 and at most 1"
            raise WeatherError(f"{where}: {cell}, alpha {alpha:g}: {allowed}. Check numbers and units.")
        if (T_POP, Hs) in cells:
            raise WeatherError(f"{where}: {cell} is given twice.")
        cells[float(T_POP), float(Hs)] = float(alpha)
    times, heights = (sorted({cell[i] for cell in cells}) for i in (0, 1))
    for T, H in product(times, heights):
        if (T, H) not in cells:
            missing = f"no alpha for T_POP {T / 3600.0:g} h at Hs {show(H, 'length')}"
            raise WeatherError(f"{columns.source}: {missing}. Every time has every height.")
    texts = _remarks(columns.table.comments, columns.source)
    ends = {
        name: parse(texts.pop(name, usual), "hours", f"{columns.source}: {name}") for name, usual in RESTRICTED.items()
    }
    alpha = tuple(tuple(cells[T, H] for H in heights) for T in times)
    _check_order(alpha, times, heights, columns.source)
    named = {"standard": columns.source} | texts
    said = {name: named.get(name, "") for name in TEXTS}
    ends_in_order = ends["T_POP_below"], ends["T_R_below"]
    return AlphaTable(columns.source, tuple(heights), tuple(times), alpha, *ends_in_order, texts=said)


def _check_order(
    alpha: Sequence[Sequence[float]], times: Sequence[float], heights: Sequence[float], source: str
) -> None:
    """Refuse factors that rise with the time of the operation: rows or columns were exchanged."""
    for (T, row), (longer, below) in pairwise(zip(times, alpha, strict=True)):
        for H, a, b in zip(heights, row, below, strict=True):
            if b > a:
                raise WeatherError(
                    f"{source}: at Hs {show(H, 'length')} alpha rises from {a:g} for T_POP {T / 3600.0:g} h to"
                    f" {b:g} for {longer / 3600.0:g} h: a longer operation is forecast no better. Check the rows."
                )


def _remarks(comments: Sequence[str], source: str) -> dict[str, str]:
    """What lines of remarks say, by name; lines without a colon are none."""
    allowed = (*TEXTS, *RESTRICTED)
    said: dict[str, str] = {}
    for line in comments:
        line = line.lstrip().lstrip("# ")
        name, colon, text = line.partition(":")
        if not colon or not text.strip() or len(name.split()) != 1:
            continue
        if name.strip() not in allowed:
            near = nearest(name.strip(), allowed)
            raise WeatherError(f"{source}: remark {quote(name.strip())}: unknown{near} Allowed: {', '.join(allowed)}.")
        said[name.strip()] = " ".join(text.split())
    return said
