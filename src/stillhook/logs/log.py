"""Crane test logs: read in pieces, brought to SI, checked, and averaged on bins of time.

    log = read_log("hoist_50t.csv", read_mapping("mapping.toml"))
    for line in describe(log): print(line)

Memory stays bounded for files of any size: a piece of about 32 MB at a time, of which only the mapped columns are
parsed.

From a mapping and an open log to tracks: one for each clock, with the columns that it stamped; and the samples
through them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.guard import reader
from stillhook.base.progress import Progress
from stillhook.errors import LogError, UnitError
from stillhook.formats.table.dialect import SCALES, STAMPS, hint, our_unit, table_unit
from stillhook.formats.table.stamps import is_stamp
from stillhook.logs.clock import Merged, Other, merged
from stillhook.logs.findings import Checked, checked, counted, limit_of
from stillhook.logs.formats.open import open_log
from stillhook.logs.formats.source import EXAMPLES, Chunk, Source, Want, master
from stillhook.logs.frozen_signals import standstill
from stillhook.logs.mapping import (
    allowed,
    factors,
    mapping_from,
    mapping_from_headings,
    place_of,
    read_mapping,
    resolved,
    split_heading,
)
from stillhook.logs.resample import Column, Track
from stillhook.logs.signs import check_signs
from stillhook.logs.streaming import Watch
from stillhook.logs.types import Finding, Log, Signal
from stillhook.units import parse, quote

HEAD = 1 << 18  # bytes from which the spacing of the samples is found
FASTEST = 20_000.0  # Hz: ten times any PLC; such a rate is time in another unit
SLOWEST = 0.2  # Hz: a plateau of a staircase lasts some ten seconds
FEWEST = 10  # samples: fewer are not a log
COARSE = 0.5  # of the first stamps that repeat: they are too coarse for the samples
MOST_BROKEN = 0.01  # of the lines: with more that do not fit the header, the file is not what it seems ...
FEW_BROKEN = 10  # ... but so many are borne in short logs
SAME = 1e-3
"""Part of the spacing of samples, times their number, by which two columns of time may drift apart and be one."""
BOTH = " + "  # joins the headings of two columns of stamps
TIME = Signal("time", "", quantity="time")


@dataclass(frozen=True)
class Clock:
    """A clock in a log: where its stamps are and how they read."""

    base: int
    want: Want
    factor: float
    offset: float
    column: str
    """What to call it in messages."""

    @property
    def dated(self) -> bool:
        return self.want.stamps is not None and (self.want.stamps == STAMPS or "%d" in self.want.stamps)

    def seconds(self, chunk: Chunk) -> FloatArray:
        """Its stamps in a piece [s]."""
        raw = chunk.values[self.want]
        return raw if self.factor == 1.0 and not self.offset else raw * self.factor + self.offset


@dataclass
class Tracks:
    """All that is read from a log: the main clock first. series: signal -> its own column of times, where columns of
    the file come in series that have one each."""

    tracks: dict[Clock, Track] = field(default_factory=dict)
    series: dict[str, str] = field(default_factory=dict)
    broken: list[tuple[int, str]] = field(default_factory=list)
    """The first lines that do not fit the header, and what is wrong with them."""
    broken_count: int = 0


def build(source: Source, rows: Mapping[str, Signal], width: float) -> Tracks:
    """Tracks for a mapping: columns found, units known, spacing of the samples measured.

    Errors: LogError or UnitError of one line for columns and units that are not there, and for rates that no log has.
    """
    columns: dict[Clock, list[Column]] = {}
    main = clock_of(source, rows["time"], rows["time"].column) if "time" in rows else None
    series = {} if main is None or source.time_base else _series(source, rows, main)
    own: dict[str, str] = {}
    for name, signal in rows.items():
        if name == "time":
            continue
        place = place_of(signal.column, source.headings, f"{source.name}: {name}")
        unit = unit_of(source, signal, place)
        factor, offset = factors(signal, unit)
        base = source.base(place)
        before = max((at for at in series if at < place), default=-1)
        if signal.clock is not None:
            clock = clock_of(source, rows.get("time", TIME), signal.clock)
        elif main is not None and base == main.base and series.get(before, main) != main:
            clock = series[before]
            own[name] = clock.column
        elif main is not None and base == main.base:
            clock = main
        elif source.time_base:
            clock = Clock(base, Want((master(base),)), 1.0, 0.0, "the file's time base")
            main = main or clock
        elif main is not None:
            raise LogError(
                f"{source.name}: {name}: column {quote(signal.column)} has another length than the time. Map columns of"
                " one length."
            )
        else:
            raise LogError(f'{source.name}: no time. Add a row time = {{ column = "...", unit = "s" }} to the mapping.')
        column = Column(
            signal, Want((place,), words=signal.words), factor, offset, unit, Watch(signal, limit_of(signal))
        )
        columns.setdefault(clock, []).append(column)
    if main is None or main not in columns:
        raise LogError(
            f"{source.name}: every signal has its own clock. Leave out `clock` where a signal is stamped by time."
        )
    result = Tracks(series=own)
    for clock in (main, *(clock for clock in columns if clock != main)):
        spacing = _spacing(source, clock)
        every = max(width if clock is main else result.tracks[main].every, spacing)
        result.tracks[clock] = Track(source.name, source.row, columns[clock], spacing, every, None, quote(clock.column))
    return result


_TIME_COLUMN = re.compile(
    r"(t|time|zeit|tid|clock|time ?stamp)([ _.\-]?\d+)?|(t|time)[ _.\-].+|.+[ _.\-](t|time)", re.IGNORECASE
)
"""Headings of columns of time, without their unit."""


def _series(source: Source, rows: Mapping[str, Signal], main: Clock) -> dict[int, Clock]:
    """Columns of time by their place, the main one among them: each stamps the columns behind it, up to the next. Of
    columns that say the same as the main one none is kept."""
    signals = {place_of(s.column, source.headings, f"{source.name}: {n}") for n, s in rows.items() if n != "time"}
    time, result = rows["time"], dict.fromkeys(main.want.places, main)
    for place, heading in enumerate(source.headings):
        name, file_unit = split_heading(heading)[0], _file_unit(source, place)
        if place in result or place in signals or source.base(place) != main.base or not _TIME_COLUMN.fullmatch(name):
            continue
        unit = our_unit(file_unit, "time") if file_unit else time.unit
        if unit is None or unit == STAMPS or "%" in unit:
            continue
        factor, offset = factors(time, unit)
        clock = Clock(main.base, Want((place,)), factor, offset, heading.strip())
        if _differs(source, main, clock):
            result[place] = clock
    return result if len(result) > len(main.want.places) else {}


def _differs(source: Source, main: Clock, other: Clock) -> bool:
    """Whether a column of rising numbers runs otherwise than the main clock."""
    first = next(source.chunks(list(dict.fromkeys([main.want, other.want])), HEAD), None)
    if first is None:
        return False
    both = np.stack([clock.seconds(first) for clock in (main, other)])
    t = both[:, np.isfinite(both).all(axis=0)]
    if t.shape[1] < FEWEST or (np.diff(t[1]) < 0.0).any() or t[1, -1] <= t[1, 0]:
        return False
    elapsed = t - t[:, :1]
    return bool(np.abs(elapsed[0] - elapsed[1]).max() > SAME * np.median(np.diff(t[0])) * len(elapsed[0]))


def _own_times(source: Source, tracks: Tracks) -> Iterator[Finding]:
    """Signals of series with a column of times of their own."""
    for column in dict.fromkeys(tracks.series.values()):
        names = ", ".join(name for name, of in tracks.series.items() if of == column)
        text = f"{names}: stamped by the column of times before {'it' if ',' not in names else 'them'}, {quote(column)}"
        yield Finding(names, "clock", 0.0, 0.0, 0, "noted", text)


def _other_units(source: Source, rows: Mapping[str, Signal]) -> Iterator[Finding]:
    """Signals whose mapping gives another unit than the file, with no scale that would explain it."""
    for name, signal in rows.items():
        if signal.unit is None or signal.scale != 1.0 or (name == "time" and BOTH in signal.column):
            continue
        file_unit = _file_unit(source, place_of(signal.column, source.headings, f"{source.name}: {name}"))
        unit_name = our_unit(file_unit, signal.quantity) if file_unit else None
        if file_unit and (file_unit in SCALES if unit_name is None else unit_name != signal.unit):
            units = f"the mapping states {quote(signal.unit)} and the file {quote(file_unit)}"
            yield Finding(name, "unit", 0.0, 0.0, 0, "noted", f"{name}: {units}; the mapping is believed")


def clock_of(source: Source, time: Signal, column: str) -> Clock:
    """The clock in a column, read as `time` is."""
    where = f"{source.name}: time" if column == time.column else f"{source.name}: clock"
    parts = column.split(BOTH)
    headings = [h.strip() for h in source.headings]
    if len(parts) == 2 and column not in headings:
        places = tuple(place_of(part.strip(), source.headings, where) for part in parts)
        pattern = time.unit if time.unit is not None and "%" in time.unit else STAMPS
        return Clock(source.base(places[0]), Want(places, pattern), 1.0, 0.0, column)
    place = place_of(column, source.headings, where)
    known = our_unit(_file_unit(source, place), "time")  # a row of units may say how stamps are written, dd.mm.yyyy
    if time.unit is None and known is None and is_stamp(source.sample(place)):
        unit = STAMPS
    else:
        unit = unit_of(source, time, place)
    if unit == STAMPS or "%" in unit:
        return Clock(source.base(place), Want((place,), unit), 1.0, 0.0, column)
    factor, offset = factors(time, unit)
    return Clock(source.base(place), Want((place,)), factor, offset, column)


def _file_unit(source: Source, place: int) -> str:
    """The unit that the file gives for a column, in its heading or next to it."""
    return split_heading(source.headings[place])[1] or source.units[place]


def unit_of(source: Source, signal: Signal, place: int) -> str:
    """The unit of a column: that of the mapping, or the one that the file gives. Errors: UnitError with what is
    allowed."""
    if signal.unit is not None:
        return signal.unit
    file_unit = _file_unit(source, place)
    if signal.name == "time" and file_unit in (STAMPS, "ISO"):
        return STAMPS
    if table_unit(file_unit, signal.quantity) is not None and (file_unit or not signal.quantity):
        return our_unit(file_unit, signal.quantity) or file_unit
    problem, advice = "has no unit; choose one of", ""
    if file_unit:
        problem, advice = f"has the unit {quote(file_unit)}, which is not one of", hint(file_unit, signal.quantity)
    raise UnitError(
        f"{source.name}: {signal.name}: column {quote(source.headings[place])} {problem}"
        f" {allowed(signal.name, signal.quantity)}.{advice}"
    )


def _spacing(source: Source, clock: Clock) -> float:
    """Median spacing of the first stamps of a clock [s]. Errors: LogError for stamps that are none, repeat, or come at
    no log's rate."""
    first = next(source.chunks([clock.want], HEAD), None)
    stamps = np.empty(0) if first is None else clock.seconds(first)
    place = f"{source.name}: time in {quote(clock.column)}"
    if first is None or not len(stamps):
        raise LogError(f"{source.name}: holds no rows of data. Give a log with a header and rows of numbers.")
    finite = stamps[np.isfinite(stamps)]
    if not len(finite):
        cell = quote(next(iter(first.texts.get(clock.want, ("",)))))
        raise LogError(
            f"{place}: {cell} is not a {'stamp' if clock.want.stamps else 'number'}. Give its unit:"
            f" {allowed('time', 'time')}."
        )
    with np.errstate(over="ignore"):
        step = np.diff(finite)
    ahead = step[step > 0.0]
    if len(finite) < FEWEST or not len(ahead):
        raise LogError(
            f"{place}: {len(finite)} samples{' at one moment' if len(finite) >= FEWEST else ''} are not a log. Give"
            " another column or file."
        )
    if np.count_nonzero(step == 0.0) > COARSE * len(step):
        raise LogError(
            f"{place}: most stamps repeat ({len(ahead)} of {len(step)} advance). Export them with fractions of a"
            " second."
        )
    spacing = float(np.median(ahead))
    if 1.0 / spacing > FASTEST:
        raise LogError(
            f"{place}: {1.0 / spacing:.4g} samples per second are more than any log has ({FASTEST:g}). Check its unit:"
            ' is it "s" rather than "ms"?'
        )
    if 1.0 / spacing < SLOWEST:
        raise LogError(
            f"{place}: one sample in {spacing:.4g} s is too slow for steady windows (at most {1.0 / SLOWEST:g} s)."
            ' Check its unit: is it "ms" rather than "s"?'
        )
    return spacing


def stream(source: Source, tracks: Tracks, size: int, progress: Callable[[float], None]) -> None:
    bases = list(dict.fromkeys(clock.base for clock in tracks.tracks))
    for done, base in enumerate(bases):
        on_base = [(clock, track) for clock, track in tracks.tracks.items() if clock.base == base]
        wants = [want for clock, track in on_base for want in (clock.want, *(c.want for c in track.columns))]
        for chunk in source.chunks(list(dict.fromkeys(wants)), size):
            for clock, track in on_base:
                for column in track.columns:
                    texts = (*column.texts, *chunk.texts.get(column.want, ()))
                    column.texts = tuple(dict.fromkeys(texts))[:EXAMPLES]
                values = [chunk.values[column.want] for column in track.columns]
                track.feed(clock.seconds(chunk), values, chunk.line_of)
            tracks.broken_count += len(chunk.broken)
            tracks.broken.extend(chunk.broken[: FEW_BROKEN - len(tracks.broken)])
            progress((done + chunk.done) / len(bases))


def refuse_broken(source: Source, tracks: Tracks) -> None:
    """LogError where more lines do not fit the header than a fault of the logger explains."""
    lines = next(iter(tracks.tracks.values())).samples + tracks.broken_count
    if tracks.broken_count > max(FEW_BROKEN, MOST_BROKEN * lines):
        line, problem = tracks.broken[0]
        raise LogError(
            f"{source.name}: line {line}: {problem} ({tracks.broken_count} such lines among {lines})."
            ' Correct the export; a decimal comma needs ";" between columns.'
        )


CHUNK = 1 << 25  # bytes of a piece


@reader(LogError)
def read_log(
    path: str | os.PathLike[str],
    mapping: Mapping[str, Signal] | None = None,
    *,
    every: str = "0.1 s",
    leave_out_clocks: bool = False,
    progress: Progress | None = None,
) -> Log:
    """A log in SI on bins of time, checked.

    Parameters
    ----------
    path : str or path-like
        CSV or other text, Parquet, MDF4, TDMS or MAT.
    mapping : mapping, optional
        Signals by name (`read_mapping`, `mapping_from`); without it headings such as "p_a [bar]" are taken.
    every : str, default "0.1 s"
        Width of the bins, at least the spacing of the samples.
    leave_out_clocks : bool, default False
        Signals of another clock that cannot be aligned are left out (NaN) in place of an error.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Log
        Signals [SI]; what could be repaired or left out is reported in `Log.findings`.

    Raises
    ------
    LogError, UnitError
        One line, for a file that cannot be read, columns or units that are not there, and signals that cannot be
        trusted.
    """
    width = parse(every, "time", "every")
    if not width > 0.0:
        raise LogError(f'every = {quote(every)}: the width of the bins must be above 0, such as "0.1 s".')
    source = open_log(path)
    rows = dict(mapping) if mapping is not None else mapping_from_headings(source.headings, source.name)
    rows = {name: resolved(signal, source.headings, source.name) for name, signal in rows.items()}
    _refuse_nothing(source, rows, from_headings=mapping is None)
    log = read_samples(source, rows, width, leave_out_clocks=leave_out_clocks, progress=progress)
    check_signs(log)
    return log


@reader(LogError)
def read_samples(
    source: Source,
    rows: Mapping[str, Signal],
    width: float = 0.1,
    *,
    leave_out_clocks: bool = False,
    progress: Progress | None = None,
) -> Log:
    """The same of an open log, with bins of `width` [s], without the test of its signs."""
    tracks = build(source, rows, width)
    stream(source, tracks, CHUNK, progress or (lambda share: None))
    refuse_broken(source, tracks)
    (main_clock, main), *others = ((clock, checked(track)) for clock, track in tracks.tracks.items())
    more = [
        Other(
            other,
            any(column.signal.clock is not None for column in other.track.columns),
            main_clock.dated and clock.dated,
        )
        for clock, other in others
    ]
    return _log(source, rows, tracks, main, merged(source.name, main, more, leave_out=leave_out_clocks))


def _refuse_nothing(source: Source, rows: Mapping[str, Signal], *, from_headings: bool) -> None:
    signals = [name for name in rows if name != "time"]
    if signals and ("time" in rows or source.time_base):
        return
    shown = ", ".join(quote(h) for h in source.headings[:8]) + (" ..." if len(source.headings) > 8 else "")
    lack = "time" if signals else "signal"
    example = 'time = { column = "...", unit = "s" }' if signals else 'p_a = { column = "...", unit = "bar" }'
    if from_headings:
        heading = "time [s]" if signals else "p_a [bar]"
        raise LogError(
            f'{source.name}: no heading names a {lack} of Stillhook, such as "{heading}", among {shown}. Give a mapping'
            f" with rows such as {example}."
        )
    raise LogError(f"{source.name}: the mapping names no {lack}. Add a row such as {example}; the file has {shown}.")


def _log(source: Source, rows: Mapping[str, Signal], tracks: Tracks, main: Checked, joined: Merged) -> Log:
    findings = [*joined.findings, *standstill(source.name, joined.t, joined.watched, joined.doubtful, main.bins.starts)]
    findings += [*_own_times(source, tracks), *_other_units(source, rows)]
    if tracks.broken_count:
        line, problem = tracks.broken[0]
        text = f"{counted(tracks.broken_count, 'line')} of another length than the header left out, the first is line"
        text += f" {line}: {problem}"
        findings.append(Finding("", "broken", np.nan, np.nan, tracks.broken_count, "left out", text))
    ordered = [name for name in rows if name != "time"]
    return Log(
        source=source.name,
        t=joined.t,
        signals=MappingProxyType({name: joined.watched[name].values for name in ordered}),
        doubtful=MappingProxyType({name: joined.doubtful[name] for name in ordered}),
        gaps=tuple(main.track.gaps),
        findings=tuple(findings),
        rate=1.0 / main.track.spacing,
        samples=main.track.samples,
        every=main.track.every,
        mapping=MappingProxyType(dict(rows)),
        at=main.bins.at,
        number=main.bins.number,
        clocks=tuple(joined.clocks),
    )


def describe(log: Log) -> list[str]:
    """The log in lines for a reader: what was read, and every finding."""
    names = ", ".join(log.signals)
    head = (
        f"{log.source}: {log.samples} samples in {log.duration:.6g} s ({log.rate:.4g} per second), bins of"
        f" {log.every:g} s: {names}"
    )
    return [head, *(f"{finding.text} [{finding.action}]" for finding in log.findings)]


def to_dict(log: Log) -> dict[str, Any]:
    """What was read and found as plain data for JSON; the samples themselves stay in the log."""
    return {
        "source": log.source,
        "samples": log.samples,
        "rate": log.rate,
        "duration": log.duration,
        "every": log.every,
        "bins": len(log.t),
        "signals": list(log.signals),
        "gaps": [list(gap) for gap in log.gaps],
        "findings": [asdict(finding) for finding in log.findings],
    }


__all__ = ["Finding", "Log", "Signal", "check_signs", "describe", "mapping_from", "read_log", "read_mapping", "to_dict"]
