"""Logs as columns of arrays: Parquet, MAT v5 and v7.3 (and other HDF5)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError
from stillhook.formats.binary.reader import refuse_bomb
from stillhook.logs.formats.source import EXAMPLES, NANO, Chunk, Want, from_sample, stamps_to_seconds, with_words
from stillhook.units import quote

FEWEST_ROWS = 64  # of a piece, however small the pieces
NUMBER = 8  # bytes


def rows_of(size: int, columns: int) -> int:
    """Rows in a piece of `size` bytes."""
    return max(FEWEST_ROWS, size // (NUMBER * max(1, columns)))


@dataclass
class ParquetLog:
    """A Parquet file, read in slices."""

    path: Path
    row: str = "sample"
    time_base: bool = False
    name: str = field(init=False)
    headings: tuple[str, ...] = field(init=False)
    units: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.name = self.path.name
        self._frame = pl.scan_parquet(self.path, glob=False)
        self._schema = self._frame.collect_schema()
        self._length = int(self._frame.select(pl.len()).collect().item())
        refuse_bomb(self.path, NUMBER * self._length * len(self._schema), at_once=False)
        self.headings, self.units = tuple(self._schema), ("",) * len(self._schema)

    def base(self, place: int) -> int:
        """A table has one time base."""
        return 0

    def sample(self, place: int) -> str:
        """The first cell of a column."""
        first = self._frame.select(pl.col(self.headings[place]).drop_nulls().head(1).cast(pl.String)).collect()
        return str(first.item()) if first.height else ""

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        """The requested columns in slices."""
        places = sorted({place for want in wants for place in want.places})
        rows = rows_of(size, len(places))
        for begin in range(0, self._length, rows):
            table = self._frame.select([self.headings[p] for p in places]).slice(begin, rows).collect()
            texts: dict[Want, tuple[str, ...]] = {}
            values = {want: self._column(table, want, texts) for want in wants}
            done = min(1.0, (begin + rows) / self._length)
            yield Chunk(0, values, from_sample(begin), done, texts)

    def _column(self, table: pl.DataFrame, want: Want, texts: dict[Want, tuple[str, ...]]) -> FloatArray:
        cells = table[self.headings[want.places[0]]]
        if want.stamps is not None and cells.dtype.is_temporal():
            return seconds_of(cells)
        if want.stamps is not None:
            words = cells.cast(pl.String)
            if len(want.places) == 2:
                words = words + " " + table[self.headings[want.places[1]]].cast(pl.String)
            return stamps_to_seconds(words, want.stamps)
        if cells.dtype.is_temporal() or cells.dtype.is_nested():
            raise LogError(
                f"{self.name}: column {quote(cells.name)} holds {cells.dtype}, not numbers. Map another column."
            )
        numbers = cells.cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy().astype(np.float64, copy=False)
        read = with_words(numbers, cells, want)
        bad = ~np.isfinite(read)
        if bad.any():
            words = cells.filter(pl.Series(bad)).cast(pl.String).fill_null("").unique(maintain_order=True)
            texts[want] = tuple(words.head(EXAMPLES).to_list())
        return read


def seconds_of(cells: pl.Series) -> FloatArray:
    """Dates with times, or durations, in seconds (since 1970), NaN where missing."""
    kind = pl.Duration("ns") if cells.dtype == pl.Duration else pl.Datetime("ns")
    integer = (
        cells.dt.replace_time_zone(None) if isinstance(cells.dtype, pl.Datetime) and cells.dtype.time_zone else cells
    )
    numbers = integer.cast(kind).cast(pl.Int64).cast(pl.Float64).fill_null(np.nan).to_numpy()
    return np.asarray(numbers * NANO, dtype=np.float64)


@dataclass(frozen=True)
class ArrayColumn:
    """A column that is read by slices: its heading, length, and how to read rows from to."""

    heading: str
    length: int
    read: Callable[[int, int], Any]
    unit: str = ""


@dataclass
class ArraysLog:
    """Columns of numbers, each read by slices; those of one length belong together."""

    name: str
    columns: list[ArrayColumn]
    row: str = "sample"
    time_base: bool = False
    headings: tuple[str, ...] = field(init=False)
    units: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        if not self.columns:
            raise LogError(f"{self.name}: holds no column of numbers. Save time and signals as vectors of one length.")
        self.headings, self.units = tuple(c.heading for c in self.columns), tuple(c.unit for c in self.columns)
        self._lengths = list(dict.fromkeys(c.length for c in self.columns))

    def base(self, place: int) -> int:
        """Columns of one length share their time."""
        return self._lengths.index(self.columns[place].length)

    def sample(self, place: int) -> str:
        """The first cell of a column."""
        return str(np.asarray(self.columns[place].read(0, 1)).ravel()[0]) if self.columns[place].length else ""

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        """The requested columns in slices."""
        length = self.columns[wants[0].places[0]].length
        rows = rows_of(size, len(wants))
        for begin in range(0, length, rows):
            end = min(length, begin + rows)
            texts: dict[Want, tuple[str, ...]] = {}
            values = {}
            for want in wants:
                if want.stamps is not None:
                    raise LogError(
                        f"{self.name}: column {quote(self.headings[want.places[0]])} holds numbers, not stamps."
                        " Give its"
                        ' unit, such as "s".'
                    )
                values[want] = np.asarray(self.columns[want.places[0]].read(begin, end), dtype=np.float64).ravel()
                if not np.isfinite(values[want]).all():
                    texts[want] = ("nan",)
            yield Chunk(self.base(wants[0].places[0]), values, from_sample(begin), end / length, texts)


def open_mat(path: Path) -> ArraysLog:
    """A MAT file of version 5 to 7: vectors, columns of matrices ("data(:,2)"), fields of structs ("log.p_a")."""
    from scipy.io import loadmat, whosmat

    refuse_bomb(path, NUMBER * sum(math.prod(map(abs, shape)) for _, shape, _ in whosmat(path)))
    content = loadmat(path, squeeze_me=True, chars_as_strings=True)
    columns: list[ArrayColumn] = []
    for name, value in content.items():
        if not name.startswith("__"):
            columns += _array_columns(name, value)
    return ArraysLog(path.name, columns)


def _array_columns(name: str, value: Any) -> list[ArrayColumn]:
    array = np.asarray(value)
    if array.dtype.names:
        record = array if array.ndim == 0 else array[0] if array.ndim == 1 and len(array) == 1 else None
        return (
            []
            if record is None
            else [c for key in array.dtype.names for c in _array_columns(f"{name}.{key}", record[key])]
        )
    if array.dtype == object and array.ndim == 0:
        return _array_columns(name, array.item()) if array.item() is not value else []
    if array.dtype.kind not in "fiub" or array.size < 2:
        return []
    if array.ndim == 1:
        return [ArrayColumn(name, len(array), lambda a, b: array[a:b])]
    if array.ndim == 2:
        return [
            ArrayColumn(f"{name}(:,{k + 1})", len(array), partial(_column_of, array, k)) for k in range(array.shape[1])
        ]
    return []


def _column_of(array: Any, k: int, begin: int, end: int) -> Any:
    return array[begin:end, k]


def _row_of(array: Any, k: int, begin: int, end: int) -> Any:
    return array[k, begin:end]


def open_hdf(path: Path) -> ArraysLog:
    """A MAT file of version 7.3 (HDF5): as `open_mat`, read in slices."""
    import h5py  # type: ignore[import-untyped]

    file = h5py.File(path, "r")
    columns: list[ArrayColumn] = []

    def visit(name: str, item: Any) -> None:
        if name.startswith("#") or not isinstance(item, h5py.Dataset) or item.dtype.kind not in "fiu" or item.size < 2:
            return
        heading = name.replace("/", ".")
        if item.ndim == 1:
            columns.append(ArrayColumn(heading, item.shape[0], lambda a, b: item[a:b]))
        elif item.ndim == 2 and 1 in item.shape:
            long = int(np.argmax(item.shape))
            columns.append(
                ArrayColumn(heading, item.shape[long], lambda a, b: item[a:b, 0] if long == 0 else item[0, a:b])
            )
        elif item.ndim == 2:  # MATLAB stores columns as rows
            columns.extend(
                ArrayColumn(f"{heading}(:,{k + 1})", item.shape[1], partial(_row_of, item, k))
                for k in range(item.shape[0])
            )

    file.visititems(visit)
    refuse_bomb(path, NUMBER * sum(column.length for column in columns), at_once=False)
    return ArraysLog(path.name, columns)
