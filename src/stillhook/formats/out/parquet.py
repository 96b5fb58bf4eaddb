"""Parquet (polars): a column for each name with its unit in the heading, the case in the first one of several."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stillhook.base.extras import need
from stillhook.errors import ConvertError
from stillhook.formats.out.table import Content, heading

SUFFIX, TITLE = ".parquet", "Parquet"


def write(content: Content, file: Path) -> None:
    """Write a file. Errors: ConvertError where polars is not installed."""
    need("polars", TITLE, ConvertError)
    import polars as pl

    tables = content.tables
    columns: dict[str, object] = {}
    if len(tables) > 1:
        columns["case"] = [t.name for t in tables for _ in range(len(t.columns[0].values))]
    elif "case" in content.texts and not tables[0].is_series:
        columns["case"] = list(content.texts["case"])
    for k, column in enumerate(tables[0].columns):
        columns[heading(column)] = np.concatenate([t.columns[k].values for t in tables])
    if not tables[0].is_series:
        columns |= {n: list(v) for n, v in content.texts.items() if n != "case"}
    pl.DataFrame(columns).write_parquet(file, metadata=dict(content.facts))
