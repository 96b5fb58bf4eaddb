"""Crane test logs: read in pieces, brought to SI, checked, and averaged on bins of time.

    log = read_log("hoist_50t.csv", read_mapping("mapping.toml"))
    for line in describe(log): print(line)

Memory stays bounded for files of any size: a piece of about 32 MB at a time, of which only the mapped columns are
parsed.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from stillhook.base.progress import Progress
from stillhook.errors import LogError
from stillhook.logs.checks.findings import Checked, checked, counted
from stillhook.logs.checks.frozen_signals import standstill
from stillhook.logs.checks.signs import check_signs
from stillhook.logs.formats.open import open_log
from stillhook.logs.formats.source import Source
from stillhook.logs.mapping import mapping_from, mapping_from_headings, read_mapping
from stillhook.logs.merge import Merged, Other, merged
from stillhook.logs.tracks import Tracks, build, refuse_broken, stream
from stillhook.logs.types import Finding, Log, Signal
from stillhook.units import parse, quote

__all__ = ["Finding", "Log", "Signal", "check_signs", "describe", "mapping_from", "read_log", "read_mapping", "to_dict"]

CHUNK = 1 << 25  # bytes of a piece


def read_log(
    path: str | os.PathLike[str],
    mapping: Mapping[str, Signal] | None = None,
    *,
    every: str = "0.1 s",
    leave_out_clocks: bool = False,
    progress: Progress | None = None,
) -> Log:
    """A log in SI on bins of time, checked.

    Parameters: path CSV or other text, Parquet, MDF4, TDMS or MAT; mapping signals by name (`read_mapping`,
    `mapping_from`), without it headings such as "p_a [bar]" are taken; every width of the bins, at least the spacing of
    the samples; leave_out_clocks: signals of another clock that cannot be aligned are left out (NaN) in place of an
    error; progress is called with the share done.
    Errors: LogError or UnitError of one line, for a file that cannot be read, columns or units that are not there, and
    signals that cannot be trusted; what could be repaired or left out is reported in `Log.findings`.
    """
    width = parse(every, "time", "every")
    if not width > 0.0:
        raise LogError(f'every = {quote(every)}: the width of the bins must be above 0, such as "0.1 s".')
    source = open_log(path)
    rows = dict(mapping) if mapping is not None else mapping_from_headings(source.headings, source.name)
    _refuse_nothing(source, rows, from_headings=mapping is None)
    tracks = build(source, rows, width)
    stream(source, tracks, CHUNK, progress or (lambda share: None))
    refuse_broken(source, tracks)
    main, *others = (checked(track) for track in tracks.tracks)
    more = [
        Other(
            other,
            any(column.signal.clock is not None for column in other.track.columns),
            tracks.clocks[0].dated and clock.dated,
        )
        for clock, other in zip(tracks.clocks[1:], others, strict=True)
    ]
    log = _log(source, rows, tracks, main, merged(source.name, main, more, leave_out=leave_out_clocks))
    check_signs(log)
    return log


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
    for name, mapped_unit, file_unit in tracks.units:
        text = (
            f"{name}: the mapping states {quote(mapped_unit)} and the file {quote(file_unit)}; the mapping is believed"
        )
        findings.append(Finding(name, "unit", 0.0, 0.0, 0, "noted", text))
    if tracks.broken_count:
        line, problem = tracks.broken[0]
        text = (
            f"{counted(tracks.broken_count, 'line')} of another length than the header left out, the first is line"
            f" {line}: {problem}"
        )
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
        "findings": [finding.to_dict() for finding in log.findings],
    }
