"""What reading one file may take: the table of budgets, and the limits of time and memory.

Text is read in this process; its limits are sizes and counts, so chosen that the largest file is read within a minute
and some GB. Binary formats are read in a process of their own (`stillhook.formats.binary`), under a limit of time and
memory. Logs are read in pieces, however long they are.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterable, Iterator
from typing import NamedTuple, TypeVar

from stillhook.errors import StillhookError
from stillhook.units import parse, quote


class Budget(NamedTuple):
    """What a file of a kind may hold; 0: not limited by a number, `why` says what limits it."""

    kind: str
    size: int  # of the file, and of what a gz file holds [bytes]
    depth: int  # tables and lists inside of each other; parts of a dotted key
    rows: int  # lines
    cells: int  # between commas, semicolons and tabs
    why: str


TOML = Budget("TOML", 1_000_000, 32, 0, 0, "the longest of the library has 15 kB, the deepest 6 levels")
JSON = Budget("JSON", 50_000_000, 64, 0, 0, "a certificate has some hundred kB, the facts of a plan up to 1 MB")
YAML = Budget("YAML (OrcaFlex)", 20_000_000, 32, 0, 0, "a model with ten vessel types has some MB")
STATE = Budget("saved state of a session", 50_000_000, 64, 0, 0, "some 100 kB, which do not grow with time")
TABLE = Budget("map, load chart, campaign's table", 50_000_000, 0, 1_000_000, 5_000_000, "a map has some thousand rows")
RECORDS = Budget(
    "weather, spectra, motion or vessel in text",
    200_000_000,
    0,
    5_000_000,
    30_000_000,
    "45 years by the hour have 400,000 rows, of spectra 19 million cells; a day of motion at 50 Hz has 4 million rows",
)
PROGRAM = Budget("program of a PLC, certificate of a server", 5_000_000, 0, 0, 0, "an exported program has 100 kB")
KEY = Budget("key in PEM", 20_000, 0, 0, 0, "a key has some hundred bytes")
LOG = Budget("log in text, Seapath's sentences", 0, 0, 0, 0, "read in pieces, however long")
BUDGETS = (TOML, JSON, YAML, STATE, TABLE, RECORDS, PROGRAM, KEY, LOG)

LONGEST_NUMBER = 100
"""Digits of a number in YAML: the time of reading one grows with their square."""
MOST_PARTS = 5_000_000
"""Values of a YAML file, those that come again by name counted each time."""

TIME, MEMORY = "STILLHOOK_READ_TIME", "STILLHOOK_READ_MEMORY"
"""Environment variables that change the limits."""
LONGEST = 60.0
"""One step may take this long [s], and a second more for each megabyte of the file."""
SLOWEST = 1e6
"""Bytes a second of the slowest drive that is waited for without TIME."""
MOST_MEMORY = "8 GB"
"""Of the process that reads binary files."""
SMALL = 100_000_000
"""What any packed file may unpack to [bytes]."""
DENSEST = 2000
"""A file unpacks to no more than this many times its size: deflate reaches 1032."""

Item = TypeVar("Item")
_LOOK = 4096
"""Rows after which the clock is looked at."""


def time_limit(size: int) -> float:
    """How long a step of reading a file of a size [bytes] may take [s]: `LONGEST` and a second for each megabyte; where
    the environment variable `TIME` is set, that alone. Errors: StillhookError for a variable that is not a time above
    0."""
    text = os.environ.get(TIME)
    if not text:
        return LONGEST + size / SLOWEST
    value = parse(text, "time", TIME)
    if not value > 0.0:
        raise StillhookError(f'{TIME} = {quote(text)}: a time above 0, such as "10 min".')
    return value


def late(limit: float) -> str:
    """What to say where a limit of time [s] is passed."""
    return f'not read within {limit:.3g} s; for a slow drive set {TIME}="10 min"'


def memory_limit() -> int:
    """Memory that reading a binary file may take [bytes]: `MOST_MEMORY` or the environment variable `MEMORY`."""
    text = os.environ.get(MEMORY) or MOST_MEMORY
    match = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?) (GB|MB)", text.strip())
    size = float(match[1]) * (1e9 if match[2] == "GB" else 1e6) if match else 0.0
    if not 0.0 < size < 1e15:
        raise StillhookError(f'{MEMORY} = {quote(text)}: is not a size. Give one in GB or MB, such as "{MOST_MEMORY}".')
    return int(size)


def most_unpacked(size: int) -> int:
    """What a packed file of a size may unpack to [bytes]."""
    return max(SMALL, DENSEST * size)


def in_time(rows: Iterable[Item], size: int, name: str, error: type[StillhookError]) -> Iterator[Item]:
    """The rows of a file of a size [bytes], as long as its time lasts. Errors: `error`, one line."""
    limit = time_limit(size)
    end = time.monotonic() + limit
    for i, row in enumerate(rows):
        if not i % _LOOK and time.monotonic() > end:
            raise error(f"{name}: {late(limit)}.")
        yield row
