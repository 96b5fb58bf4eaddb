"""Parquet files, read and written by DuckDB, which loads no extension and nothing from a network."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import duckdb

MEMORY = "1GB"
"""That DuckDB may take beside the columns that it returns."""
THREADS = 2
"""That decompress."""
_PATTERN = re.compile(r"[*?\[]")


def open_duckdb(*, threads: int, memory: str) -> duckdb.DuckDBPyConnection:
    """DuckDB in memory, which loads no extension from a network."""
    import duckdb

    settings: dict[str, Any] = {"threads": threads, "memory_limit": memory, "autoinstall_known_extensions": False}
    return duckdb.connect(":memory:", config=settings)


def sql_text(text: str) -> str:
    """A text within SQL."""
    return "'" + text.replace("'", "''") + "'"


def sql_name(text: str) -> str:
    """A name within SQL."""
    return '"' + text.replace('"', '""') + '"'


def sql_file(path: Path) -> str:
    """The path of one file within SQL: none of its characters is a pattern."""
    return sql_text(_PATTERN.sub(r"[\g<0>]", str(path)))


@dataclass(frozen=True)
class ParquetTable:
    """A Parquet file that is open: headings, number of rows, and columns by slices."""

    path: Path
    connection: duckdb.DuckDBPyConnection

    @cached_property
    def rows(self) -> int:
        """How many its footer states."""
        ((rows,),) = self._query(f"SELECT num_rows FROM parquet_file_metadata({sql_file(self.path)})").fetchall()
        return int(rows)

    @cached_property
    def headings(self) -> tuple[str, ...]:
        """As written; fields of a nested column are not among them."""
        schema = self._query(f"SELECT name, num_children FROM parquet_schema({sql_file(self.path)})").fetchall()
        headings, nested = [], 0
        for name, children in schema[1:]:  # the first is the root
            if nested:
                nested -= 1
            else:
                headings.append(name)
            nested += children or 0
        return tuple(headings)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """Headings as DuckDB tells them apart, which ignores case."""
        description = self._query(f"SELECT * FROM {self._source} LIMIT 0").description or ()
        return tuple(name for name, *_ in description)

    @property
    def _source(self) -> str:
        return f"read_parquet({sql_file(self.path)}, hive_partitioning = false)"

    def column(self, place: int, begin: int, end: int) -> np.ma.MaskedArray[Any, Any]:
        """Rows [begin, end) of a column, masked where there is no value. Stamps with a time zone are in UTC."""
        numbered = self._source.removesuffix(")") + ", file_row_number = true)"
        within = f"file_row_number >= {begin} AND file_row_number < {end}"
        (cells,) = (
            self._query(f"SELECT {sql_name(self._names[place])} FROM {numbered} WHERE {within}").fetchnumpy().values()
        )
        return np.ma.asarray(cells)

    def _query(self, query: str) -> duckdb.DuckDBPyConnection:
        return self.connection.execute(query)


def open_table(path: Path) -> ParquetTable:
    """A Parquet file. Errors: duckdb.Error, when it is first read."""
    return ParquetTable(path, open_duckdb(threads=THREADS, memory=MEMORY))


def write_table(columns: Mapping[str, Any], facts: Mapping[str, str], file: Path) -> None:
    """Write columns (n,) by heading, and facts as metadata of the file. NaN stays NaN; the same columns give the same
    bytes. Errors: OSError."""
    import duckdb

    arrays = {f"c{i}": np.asarray(column) for i, column in enumerate(columns.values())}
    parts = [
        (f"coalesce({name}, 'nan'::DOUBLE)" if array.dtype.kind == "f" else name) + f" AS {sql_name(heading)}"
        for heading, (name, array) in zip(columns, arrays.items(), strict=True)
    ]  # DuckDB takes NaN of an array for a missing value
    notes = ", ".join(f"{sql_name(name)}: {sql_text(text)}" for name, text in facts.items())
    options = "FORMAT parquet, COMPRESSION zstd, USE_TMP_FILE false"
    options += f", KV_METADATA {{{notes}}}" if facts else ""
    with closing(open_duckdb(threads=1, memory=MEMORY)) as connection:
        connection.register("columns_given", arrays)
        try:
            connection.execute(
                f"COPY (SELECT {', '.join(parts)} FROM columns_given) TO {sql_text(str(file))} ({options})"
            )
        except duckdb.IOException as problem:
            raise OSError(" ".join(str(problem).split())[:200]) from None
