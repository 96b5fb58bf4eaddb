"""Logs of measurement systems: MDF4 (asammdf) and TDMS (nptdms). Both readers are extras: pip install
"stillhook[logs]"."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError
from stillhook.formats.binary.reader import refuse_bomb
from stillhook.logs.formats.columnar import NUMBER, rows_of
from stillhook.logs.formats.source import EXAMPLES, NANO, Chunk, Want, from_sample, master
from stillhook.units import quote


@dataclass(frozen=True)
class Channel:
    """A channel of a measurement file: its heading, unit, time base and how to find it again."""

    heading: str
    unit: str
    base: int
    key: Any


@dataclass
class _Measured(ABC):
    """What both formats share: channels on time bases."""

    name: str
    channels: list[Channel] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    row: str = "sample"
    time_base: bool = True

    @property
    def headings(self) -> tuple[str, ...]:
        """Names of the channels, with their group before them where one name is in several."""
        return tuple(channel.heading for channel in self.channels)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the channels."""
        return tuple(channel.unit for channel in self.channels)

    def base(self, place: int) -> int:
        """The time base of a channel."""
        return master(place) if place < 0 else self.channels[place].base

    def sample(self, place: int) -> str:
        """The first sample of a channel."""
        first = self._raw(place, 0, 1)
        return str(first[0]) if len(first) else ""

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        """The wanted channels of one time base in slices."""
        base = self.base(wants[0].places[0])
        length, rows = self.lengths[base], rows_of(size, len(wants))
        for begin in range(0, length, rows):
            end = min(length, begin + rows)
            texts: dict[Want, tuple[str, ...]] = {}
            values = {want: self._column(want, begin, end, texts) for want in wants}
            yield Chunk(base, values, from_sample(begin), end / length, texts)

    def _column(self, want: Want, begin: int, end: int, texts: dict[Want, tuple[str, ...]]) -> FloatArray:
        place = want.places[0]
        raw = self._times(master(place), begin, end) if place < 0 else self._raw(place, begin, end)
        raw = np.ma.asarray(raw)
        mask = np.ma.getmaskarray(raw)
        cells = np.asarray(raw.data)
        if len(cells) != end - begin:
            raise LogError(
                f"{self.name}: channel {quote(self.headings[place])} holds fewer samples than its time base. The"
                " file is"
                " cut off."
            )
        if cells.dtype.kind == "M":
            return np.asarray(cells.astype("datetime64[ns]").astype(np.int64) * NANO, dtype=np.float64)
        if want.stamps is not None:
            raise LogError(
                f"{self.name}: channel {quote(self.headings[place])} holds no stamps. Leave out time: the file carries"
                " its own."
            )
        if cells.dtype.kind in "fiub":
            values = np.where(mask, np.nan, cells.astype(np.float64))
            words: list[str] = ["invalid"] if mask.any() else []
        else:
            values, words = _numbers(cells, dict(want.words))
        if not np.isfinite(values).all():
            texts[want] = tuple(words[:EXAMPLES]) or ("nan",)
        return values

    @abstractmethod
    def _raw(self, place: int, begin: int, end: int) -> Any:
        """Samples [begin, end) of a channel as the file has them."""

    @abstractmethod
    def _times(self, base: int, begin: int, end: int) -> FloatArray:
        """Stamps [s] of the same samples on a time base."""


def _numbers(cells: Any, numbers_of_words: Mapping[str, float]) -> tuple[FloatArray, list[str]]:
    """Cells of text as numbers, words that represent one among them; and examples of those that are none."""
    values, words = np.full(len(cells), np.nan), []
    lower = {word.lower(): value for word, value in numbers_of_words.items()}
    for i, cell in enumerate(cells):
        text = cell.decode("utf-8", "replace") if isinstance(cell, bytes) else str(cell)
        try:
            values[i] = lower[text.strip().lower()] if text.strip().lower() in lower else float(text)
        except ValueError:
            words.append(text)
    return values, list(dict.fromkeys(words))


def _named(names: Sequence[tuple[str, str]]) -> list[str]:
    """Headings of (group, name): the name alone where it stands once."""
    often = Counter(name for _, name in names)
    return [name if often[name] == 1 else f"{group}/{name}" for group, name in names]


class MdfLog(_Measured):
    """An MDF file, version 3 or 4; each group of channels has its time."""

    def __init__(self, path: Path) -> None:
        from asammdf import MDF

        super().__init__(path.name)
        self._mdf = MDF(path)
        groups = list(enumerate(self._mdf.groups))
        keys = [
            (g, i, channel)
            for g, group in groups
            for i, channel in enumerate(group.channels)
            if self._mdf.masters_db.get(g) != i
        ]
        headings = _named([(str(g), channel.name) for g, _, channel in keys])
        self.lengths = [int(group.channel_group.cycles_nr) for _, group in groups]
        refuse_bomb(path, NUMBER * sum(self.lengths[g] for g, _, _ in keys), at_once=False)
        self.channels = [
            Channel(h, str(getattr(c, "unit", "") or ""), g, (g, i))
            for h, (g, i, c) in zip(headings, keys, strict=True)
        ]

    def _raw(self, place: int, begin: int, end: int) -> Any:
        group, index = self.channels[place].key
        signal = self._mdf.get(
            group=group, index=index, record_offset=begin, record_count=end - begin, ignore_invalidation_bits=True
        )
        bits = getattr(signal, "invalidation_bits", None)
        return (
            signal.samples
            if bits is None
            else np.ma.masked_array(signal.samples, mask=np.asarray(bits, dtype=np.bool_))
        )

    def _times(self, base: int, begin: int, end: int) -> FloatArray:
        return np.asarray(self._mdf.get_master(base, record_offset=begin, record_count=end - begin), dtype=np.float64)


class TdmsLog(_Measured):
    """A TDMS file; channels of one length, start and increment share their time."""

    def __init__(self, path: Path) -> None:
        from nptdms import TdmsFile

        super().__init__(path.name)
        self._file = TdmsFile.open(path)
        channels = [
            (group.name, channel) for group in self._file.groups() for channel in group.channels() if len(channel)
        ]
        refuse_bomb(path, NUMBER * sum(len(channel) for _, channel in channels), at_once=False)
        headings = _named([(group, channel.name) for group, channel in channels])
        bases: dict[Any, int] = {}
        for heading, (_, channel) in zip(headings, channels, strict=True):
            p = channel.properties
            key = (len(channel), p.get("wf_increment"), p.get("wf_start_offset", 0.0), p.get("wf_start_time"))
            base = bases.setdefault(key, len(bases))
            self.channels.append(
                Channel(heading, str(p.get("unit_string", p.get("NI_UnitDescription", "")) or ""), base, channel)
            )
        self._bases = list(bases)
        self.lengths = [int(key[0]) for key in self._bases]
        self.time_base = bool(self._bases) and all(key[1] for key in self._bases)

    def _raw(self, place: int, begin: int, end: int) -> Any:
        return self.channels[place].key[begin:end]

    def _times(self, base: int, begin: int, end: int) -> FloatArray:
        _, increment, offset, start = self._bases[base]
        zero = 0.0 if start is None else float(np.datetime64(start, "ns").astype(np.int64)) * NANO
        return zero + float(offset) + np.arange(begin, end, dtype=np.float64) * float(increment)
