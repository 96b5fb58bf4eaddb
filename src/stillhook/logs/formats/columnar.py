"""Logs as columns of arrays: MAT v5 and v7.3 (and other HDF5); MDF4 (asammdf), TDMS (nptdms) and Parquet (DuckDB).

The readers of the last three are extras: pip install "stillhook[logs]".
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError
from stillhook.formats.binary import refuse_bomb, refuse_other_files
from stillhook.formats.table import parquet
from stillhook.formats.table.stamps import NANO, stamps_to_seconds
from stillhook.formats.table.text import numbers_of
from stillhook.logs.formats.source import (
    EXAMPLES,
    Chunk,
    Want,
    from_sample,
    joined,
    master,
    with_words,
)
from stillhook.units import quote

FEWEST_ROWS = 64  # of a piece, however small the pieces
NUMBER = 8  # bytes


def rows_of(size: int, columns: int) -> int:
    return max(FEWEST_ROWS, size // (NUMBER * max(1, columns)))


Slice = Callable[[int, int], Any]
"""Rows [begin, end) of a column as the file has them."""


@dataclass(frozen=True)
class ArrayColumn:
    """A column that is read by slices: its heading, length, unit, and the time base that it belongs to."""

    heading: str
    length: int
    read: Slice
    unit: str = ""
    base: int = 0


@dataclass
class ArraysLog:
    """Columns that are each read by slices; those of one time base belong together.

    lengths of the time bases; times: their stamps [s] where the format carries them itself (MDF, TDMS).
    """

    name: str
    columns: Sequence[ArrayColumn]
    lengths: Sequence[int]
    times: Sequence[Slice] = ()
    row: str = "sample"
    masked: str = "invalid"
    """What a cell is called that the format marks as missing."""
    time_base: bool = field(init=False)
    headings: tuple[str, ...] = field(init=False)
    units: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.time_base = bool(self.times)
        self.headings, self.units = tuple(c.heading for c in self.columns), tuple(c.unit for c in self.columns)

    def base(self, place: int) -> int:
        return master(place) if place < 0 else self.columns[place].base

    def sample(self, place: int) -> str:
        column = self.columns[place]
        first = np.ma.asarray(column.read(0, min(FEWEST_ROWS, column.length)))
        return next((text for text in _texts(first) if text), "")

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        base = self.base(wants[0].places[0])
        length, rows = self.lengths[base], rows_of(size, len(wants))
        for begin in range(0, length, rows):
            end = min(length, begin + rows)
            texts: dict[Want, tuple[str, ...]] = {}
            values = {want: self._column(want, begin, end, texts) for want in wants}
            yield Chunk(base, values, from_sample(begin), end / length, texts)

    def _column(self, want: Want, begin: int, end: int, texts: dict[Want, tuple[str, ...]]) -> FloatArray:
        columns = [self._cells(place, begin, end) for place in want.places]
        cells, mask = columns[0].data, np.ma.getmaskarray(columns[0])
        heading = "" if want.places[0] < 0 else quote(self.headings[want.places[0]])
        if cells.dtype.kind in "mM":
            if want.stamps is None and heading:
                raise LogError(f"{self.name}: column {heading} holds dates or times, not numbers. Map another column.")
            missing = np.isnat(cells) | mask
            nanoseconds = cells.astype(f"{cells.dtype.kind}8[ns]").astype(np.int64)
            return np.where(missing, np.nan, nanoseconds * NANO)
        if want.stamps is not None:
            if self.time_base:
                raise LogError(
                    f"{self.name}: channel {heading} holds no stamps. Leave out time: the file carries its own."
                )
            return stamps_to_seconds(joined([_texts(column) for column in columns]), want.stamps)
        if cells.dtype.kind in "fiub":
            values = np.where(mask, np.nan, cells.astype(np.float64))
            words = [*([self.masked] if mask.any() else []), *(["nan"] if np.isnan(values[~mask]).any() else [])]
        else:
            cells_as_text = _texts(columns[0])
            values = with_words(numbers_of(cells_as_text), cells_as_text, want)
            words = list(dict.fromkeys(cells_as_text[i] for i in np.flatnonzero(~np.isfinite(values))))
        if not np.isfinite(values).all():
            texts[want] = tuple(words[:EXAMPLES]) or ("nan",)
        return values

    def _cells(self, place: int, begin: int, end: int) -> Any:
        """Cells of a column, or stamps of a time base, as a masked array. Errors: LogError where some are missing."""
        read = self.times[master(place)] if place < 0 else self.columns[place].read
        cells = np.ma.asarray(read(begin, end))
        if len(cells) != end - begin:
            raise LogError(
                f"{self.name}: channel {quote(self.headings[place])} holds fewer samples than its time base. The"
                " file is cut off."
            )
        return cells


def _texts(cells: Any) -> list[str]:
    """Cells as texts without blanks around them, empty where masked."""
    if cells.dtype.kind == "M":
        cells = cells.astype(str)
    texts = [
        cell.decode("utf-8", "replace") if isinstance(cell, (bytes, bytearray)) else str(cell)
        for cell in cells.data.tolist()
    ]
    return ["" if hidden else text.strip() for text, hidden in zip(texts, np.ma.getmaskarray(cells), strict=True)]


def _by_length(name: str, columns: Sequence[ArrayColumn]) -> ArraysLog:
    """Columns without a time base: those of one length share their time."""
    if not columns:
        raise LogError(f"{name}: holds no column of numbers. Save time and signals as vectors of one length.")
    lengths = list(dict.fromkeys(c.length for c in columns))
    return ArraysLog(name, [replace(c, base=lengths.index(c.length)) for c in columns], lengths)


def open_mat(path: Path) -> ArraysLog:
    """A MAT file of version 5 to 7: vectors, columns of matrices ("data(:,2)"), fields of structs ("log.p_a")."""
    from scipy.io import loadmat, whosmat

    refuse_bomb(path, NUMBER * sum(math.prod(map(abs, shape)) for _, shape, _ in whosmat(path)))
    content = loadmat(path, squeeze_me=True, chars_as_strings=True)
    columns: list[ArrayColumn] = []
    for name, value in content.items():
        if not name.startswith("__"):
            columns += _array_columns(name, value)
    return _by_length(path.name, columns)


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
        return [ArrayColumn(name, len(array), partial(_rows, array))]
    if array.ndim == 2:
        return [
            ArrayColumn(f"{name}(:,{k + 1})", len(array), partial(_rows, array, column=k))
            for k in range(array.shape[1])
        ]
    return []


def _rows(array: Any, begin: int, end: int, *, column: int | None = None, line: int | None = None) -> Any:
    """Rows of a vector, of a column of a matrix, or of a line of one that is stored the other way round."""
    if line is not None:
        return array[line, begin:end]
    return array[begin:end] if column is None else array[begin:end, column]


def open_hdf(path: Path) -> ArraysLog:
    """A MAT file of version 7.3 (HDF5): as `open_mat`, read in slices."""
    import h5py  # type: ignore[import-untyped]

    file = h5py.File(path, "r")
    refuse_other_files(file)
    columns: list[ArrayColumn] = []

    def visit(name: str, item: Any) -> None:
        if name.startswith("#") or not isinstance(item, h5py.Dataset) or item.dtype.kind not in "fiu" or item.size < 2:
            return
        heading = name.replace("/", ".")
        if item.ndim == 1:
            columns.append(ArrayColumn(heading, item.shape[0], partial(_rows, item)))
        elif item.ndim == 2 and 1 in item.shape:
            vector = {"column": 0} if item.shape[0] > 1 else {"line": 0}
            columns.append(ArrayColumn(heading, item.size, partial(_rows, item, **vector)))
        elif item.ndim == 2:  # MATLAB stores columns as rows
            columns.extend(
                ArrayColumn(f"{heading}(:,{k + 1})", item.shape[1], partial(_rows, item, line=k))
                for k in range(item.shape[0])
            )

    file.visititems(visit)
    refuse_bomb(path, NUMBER * sum(column.length for column in columns), at_once=False)
    return _by_length(path.name, columns)


def _named(names: Sequence[tuple[str, str]]) -> list[str]:
    """Headings of (group, name): the name alone where it is in one group only."""
    often = Counter(name for _, name in names)
    return [name if often[name] == 1 else f"{group}/{name}" for group, name in names]


def open_mdf(path: Path) -> ArraysLog:
    """An MDF file, version 3 or 4; each group of channels has its time."""
    from asammdf import MDF

    file = MDF(path)
    lengths = [int(group.channel_group.cycles_nr) for group in file.groups]
    channels = [
        (g, i, channel)
        for g, group in enumerate(file.groups)
        for i, channel in enumerate(group.channels)
        if file.masters_db.get(g) != i
    ]
    refuse_bomb(path, NUMBER * sum(lengths[g] for g, _, _ in channels), at_once=False)

    def samples(g: int, i: int, begin: int, end: int) -> Any:
        signal = file.get(
            group=g, index=i, record_offset=begin, record_count=end - begin, ignore_invalidation_bits=True
        )
        bits = getattr(signal, "invalidation_bits", None)
        invalid = False if bits is None else np.asarray(bits, dtype=np.bool_)
        return np.ma.masked_array(signal.samples, mask=invalid)

    def times(g: int, begin: int, end: int) -> FloatArray:
        return np.asarray(file.get_master(g, record_offset=begin, record_count=end - begin), dtype=np.float64)

    headings = _named([(str(g), channel.name) for g, _, channel in channels])
    columns = [
        ArrayColumn(heading, lengths[g], partial(samples, g, i), str(getattr(channel, "unit", "") or ""), g)
        for heading, (g, i, channel) in zip(headings, channels, strict=True)
    ]
    return ArraysLog(path.name, columns, lengths, [partial(times, g) for g in range(len(lengths))])


def open_tdms(path: Path) -> ArraysLog:
    """A TDMS file; channels of one length, start and increment share their time."""
    from nptdms import TdmsFile

    file = TdmsFile.open(path)
    channels = [(group.name, channel) for group in file.groups() for channel in group.channels() if len(channel)]
    refuse_bomb(path, NUMBER * sum(len(channel) for _, channel in channels), at_once=False)

    def times(increment: float, offset: float, start: Any, begin: int, end: int) -> FloatArray:
        zero = 0.0 if start is None else float(np.datetime64(start, "ns").astype(np.int64)) * NANO
        return zero + float(offset) + np.arange(begin, end, dtype=np.float64) * float(increment)

    columns, bases = [], dict[Any, int]()
    for heading, (_, channel) in zip(_named([(group, c.name) for group, c in channels]), channels, strict=True):
        p = channel.properties
        clock = (p.get("wf_increment"), p.get("wf_start_offset", 0.0), p.get("wf_start_time"))
        base = bases.setdefault((len(channel), *clock), len(bases))
        unit = str(p.get("unit_string", p.get("NI_UnitDescription", "")) or "")
        columns.append(ArrayColumn(heading, len(channel), partial(_rows, channel), unit, base))
    clocks = [clock for _, *clock in bases]
    timed = all(increment for increment, *_ in clocks)
    return ArraysLog(
        path.name, columns, [length for length, *_ in bases], [partial(times, *c) for c in clocks] if timed else ()
    )


def open_parquet(path: Path) -> ArraysLog:
    """A Parquet file; its columns are of one table."""
    table = parquet.open_table(path)
    refuse_bomb(path, NUMBER * table.rows * len(table.headings), at_once=False)
    columns = [ArrayColumn(name, table.rows, partial(table.column, i)) for i, name in enumerate(table.headings)]
    return ArraysLog(path.name, columns, [table.rows], masked="")
