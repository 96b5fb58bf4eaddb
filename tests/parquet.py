"""Parquet files by DuckDB alone, past the package."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd


def write_parquet(columns: Mapping[str, Any], path: Path) -> None:
    """Columns by heading; None is no value."""
    frame = pd.DataFrame({name: np.asarray(column) for name, column in columns.items()})  # noqa: F841  (in the query)
    duckdb.sql("SELECT * FROM frame").write_parquet(str(path))


def read_parquet(path: Path) -> pd.DataFrame:
    return duckdb.read_parquet(str(path)).df()
