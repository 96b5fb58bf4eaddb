"""Stamps of date and time in tables, as seconds since 1970: ISO 8601, 20.11.2026 06:00:00,090 and patterns."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError
from stillhook.units import quote

_STAMP = re.compile(
    r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*|\d{1,2}\.\d{1,2}\.\d{4}[T ]\d\d:\d\d.*|\d{4}/\d\d/\d\d[T ]\d\d:\d\d.*"
)
_ISO_ZONE = re.compile(r"[+-]\d\d:?\d\d$")
_BLANK = re.compile(r"^(\S+) +(?=\d)")
_ISO = "%Y-%m-%dT%H:%M:%S%.f"
_TO_ISO = (
    (re.compile(r"^(\d{4}-)"), r"\1"),
    (re.compile(r"^(\d{1,2})\.(\d{1,2})\.(\d{4})T"), r"\3-\2-\1T"),
    (re.compile(r"^(\d{4})/(\d{1,2})/(\d{1,2})T"), r"\1-\2-\3T"),
    (re.compile(r"^(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)"), r"\1-\2-\3T\4:\5:\6"),
)
"""Ways to write a date with a time, and the same as ISO 8601, which pandas reads some thirty times as fast."""
_FRACTION = re.compile(r"%\.[369]?f")
_SHORT = {"%F": "%Y-%m-%d", "%D": "%m/%d/%y", "%T": "%H:%M:%S", "%R": "%H:%M"}
NANO = 1e-9


def is_stamp(cell: str) -> bool:
    """Whether a cell is a stamp that "UTC" reads."""
    return bool(_STAMP.fullmatch(cell.strip()))


def stamps_to_seconds(text: Sequence[str], pattern: str) -> FloatArray:
    """Stamps as seconds since 1970, NaN where a cell is not one; a stamp without a zone is UTC."""
    tidy = [cell.strip(' \t"') for cell in text]
    if pattern != "UTC":
        return _parsed(tidy, pattern)
    tidy = [_BLANK.sub(r"\1T", cell).replace(",", ".", 1).removesuffix("Z") for cell in tidy]
    first = next((cell for cell in tidy if cell), "")
    zone = "%z" if _ISO_ZONE.search(first) else ""
    for written, iso in _TO_ISO:
        if any(written.match(cell) for cell in tidy):
            return _parsed([written.sub(iso, cell) if written.match(cell) else "" for cell in tidy], _ISO + zone)
    return np.full(len(tidy), np.nan)


def _parsed(text: Sequence[str], pattern: str) -> FloatArray:
    """Seconds since 1970, or since midnight where the pattern holds no year. %.f is a fraction that may be missing."""
    for short, spelt in _SHORT.items():
        pattern = pattern.replace(short, spelt)
    if not _FRACTION.search(pattern):
        return _seconds(text, pattern)
    seconds = _seconds(text, _FRACTION.sub(".%f", pattern))
    missing = np.flatnonzero(np.isnan(seconds))
    if len(missing):
        seconds[missing] = _seconds([text[i] for i in missing.tolist()], _FRACTION.sub("", pattern))
    return seconds


def _seconds(text: Sequence[str], pattern: str) -> FloatArray:
    import pandas as pd

    try:
        stamps = pd.to_datetime(pd.Series(text, dtype=object), format=pattern, errors="coerce", utc=True)
    except ValueError as problem:
        raise LogError(
            f"time: unit = {quote(pattern)} is not a pattern of stamps ({quote(str(problem).splitlines()[0])})."
        ) from None
    read = stamps.to_numpy(dtype="datetime64[ns]")
    origin = "1970-01-01" if "%Y" in pattern or "%y" in pattern else "1900-01-01"  # where strptime puts a time of day
    since = (read - np.datetime64(origin, "ns")).astype(np.int64)
    return np.where(np.isnat(read), np.nan, since.astype(np.float64)) * NANO
