"""Logs as Parquet, read in slices by polars (extra `logs`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError
from stillhook.formats.binary.reader import refuse_bomb
from stillhook.logs.formats.columnar import NUMBER, rows_of
from stillhook.logs.formats.source import EXAMPLES, NANO, Chunk, Want, from_sample, stamps_to_seconds, with_words
from stillhook.units import quote

if TYPE_CHECKING:
    import polars as pl


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
        import polars as pl

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
        import polars as pl

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
        import polars as pl

        cells = table[self.headings[want.places[0]]]
        if want.stamps is not None and cells.dtype.is_temporal():
            return seconds_of(cells)
        if want.stamps is not None:
            words = cells.cast(pl.String)
            if len(want.places) == 2:
                words = words + " " + table[self.headings[want.places[1]]].cast(pl.String)
            return stamps_to_seconds(words.fill_null("").to_list(), want.stamps)
        if cells.dtype.is_temporal() or cells.dtype.is_nested():
            raise LogError(
                f"{self.name}: column {quote(cells.name)} holds {cells.dtype}, not numbers. Map another column."
            )
        numbers = cells.cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy().astype(np.float64, copy=False)
        if np.isfinite(numbers).all():
            return numbers
        as_text = cells.cast(pl.String).fill_null("").str.strip_chars(' \t"').to_list()
        read = with_words(numbers, as_text, want)
        bad = np.flatnonzero(~np.isfinite(read))
        if len(bad):
            texts[want] = tuple(dict.fromkeys(as_text[i] for i in bad))[:EXAMPLES]
        return read


def seconds_of(cells: pl.Series) -> FloatArray:
    """Dates with times, or durations, in seconds (since 1970), NaN where missing."""
    import polars as pl

    kind = pl.Duration("ns") if cells.dtype == pl.Duration else pl.Datetime("ns")
    integer = (
        cells.dt.replace_time_zone(None) if isinstance(cells.dtype, pl.Datetime) and cells.dtype.time_zone else cells
    )
    numbers = integer.cast(kind).cast(pl.Int64).cast(pl.Float64).fill_null(np.nan).to_numpy()
    return np.asarray(numbers * NANO, dtype=np.float64)
