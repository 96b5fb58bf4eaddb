"""Logs as text in their many dialects, read in pieces.

The dialect is found from the first part of the file: encoding (UTF-8, UTF-16, Latin-1/Windows-1252), separator (; tab |
, or runs of blanks), decimal sign, lines before the header, the header (also one that begins with #), a row of units
below it, the first row of data. Comments (#, //, %) and blank lines do not count. Rows whose number of fields does not
match are left out and reported.
"""

from __future__ import annotations

import codecs
import csv
import io
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import first_bytes, opened
from stillhook.errors import LogError
from stillhook.formats.table.dialect import COMMENTS, Dialect, decimal_of, dialect_of, head_text, split_row
from stillhook.formats.table.stamps import stamps_to_seconds
from stillhook.formats.table.text import numbers_of
from stillhook.logs.formats.source import EXAMPLES, Chunk, Want, joined, with_words
from stillhook.units import quote

HEAD = 1 << 18  # bytes from which the dialect is found
LONGEST_LINE = 1 << 24  # bytes; a longer "line" is no line of a log
_NEWLINE, _QUOTE, _BLANK, _TAB = 10, 34, 32, 9
EXACT_DIGITS = 15
"""A number of so many digits without an exponent is a whole number below 2^53 over a power of ten that is exact: the
quick reading of pandas divides once and so gives the nearest double, as "round_trip" does for every number."""
NOTHING = ["", "nan", "NaN", "NAN", "n/a", "N/A", "null", "NULL", "-", "--", "---"]
"""Cells that need no look at the other columns of their row: they and what they say are read as text after that."""
TRUTHS = (b"true", b"True", b"TRUE", b"false", b"False", b"FALSE")
_COMMENT = re.compile(rb"[ \t]*(?:#|//|%)")
_SCOPE = re.compile(r"Name[\t;,].*?[\r\n].*?SampleTime\[(ms|s|us)\]", re.DOTALL)
NAME, UNIT = "Name", "Unit"


@dataclass(frozen=True)
class _Block:
    """Whole lines of data, tidied so that every line is a row; where they were in the file."""

    data: bytes
    rows: int
    first_line: int
    kept_rows: NDArray[np.intp] | None
    """Line in the block of each row, None where every line is one."""
    broken: tuple[tuple[int, str], ...]

    def line_of(self, row: int) -> int:
        return self.first_line + (row if self.kept_rows is None else int(self.kept_rows[row]))


@dataclass
class CsvLog:
    """A text log, its dialect known."""

    path: Path
    dialect: Dialect
    row: str = "line"
    time_base: bool = False
    name: str = field(init=False)
    headings: tuple[str, ...] = field(init=False)
    units: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.name, self.headings, self.units = self.path.name, self.dialect.headings, self.dialect.units

    def base(self, place: int) -> int:
        return 0

    def sample(self, place: int) -> str:
        return self.dialect.first_row[place] if place < len(self.dialect.first_row) else ""

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        """The requested columns in pieces of about `size` bytes, cut at line ends."""
        total = max(1, self.path.stat().st_size)
        line, skip = 1, self.dialect.first_line - 1
        for data, done in _lines(self.path, self.dialect.encoding, size):
            below, passed = _after(data, skip)
            skip, line = skip - passed, line + passed
            if not below:
                continue
            block = _tidied(below, line, self.dialect)
            line += below.count(b"\n")
            if block.rows or block.broken:
                yield self._parsed(block, wants, min(1.0, done / total))

    def _parsed(self, block: _Block, wants: Sequence[Want], done: float) -> Chunk:
        if b'"' in block.data and (row := _open_quote(block)) is not None:
            raise LogError(
                f"{self.name}: line {block.line_of(row)}: a quote is not closed. Correct or remove the line."
            )
        numbers = self._numbers(block, sorted({p for want in wants if want.stamps is None for p in want.places}))
        unread = {p for want in wants for p in want.places if p not in numbers or np.isnan(numbers[p]).any()}
        words = self._words(block, sorted(unread))
        values: dict[Want, FloatArray] = {}
        texts: dict[Want, tuple[str, ...]] = {}
        for want in wants:
            place = want.places[0]
            if want.stamps is not None:
                cells = joined([words[p] for p in want.places])
                read = stamps_to_seconds(cells, want.stamps)
            elif place in words:
                cells = words[place]
                read = with_words(numbers[place] if place in numbers else self._cast(cells), cells, want)
            else:
                values[want] = numbers[place]
                continue
            bad = dict.fromkeys(cells[i] for i in np.flatnonzero(~np.isfinite(read)))
            if examples := tuple(cell for cell in bad if cell.lower() != "nan"):
                texts[want] = examples[:EXAMPLES]
            values[want] = read
        return Chunk(0, values, block.line_of, done, texts, block.broken)

    def _cast(self, cells: Sequence[str]) -> FloatArray:
        if self.dialect.decimal == ",":  # a point would be a sign between thousands
            cells = [cell.replace(".", "x", 1).replace(",", ".", 1) for cell in cells]
        return numbers_of(cells)

    def _numbers(self, block: _Block, places: Sequence[int]) -> dict[int, FloatArray]:
        """Columns of numbers, NaN for empty cells; none of them where a cell of one is not a number."""
        if not places:
            return {}
        precision = "high" if self._few_digits(block, places) else "round_trip"
        try:
            table = self._read(block, places, dtype=np.float64, na_values=NOTHING, float_precision=precision)
        except ValueError:
            return {}
        columns = {p: table[p].to_numpy() for p in places}
        if any(word in block.data for word in TRUTHS):  # pandas takes them for 1 and 0
            return {
                p: column for p, column in columns.items() if not (np.isin(column, (0.0, 1.0)) | np.isnan(column)).all()
            }
        return columns

    def _words(self, block: _Block, places: Sequence[int]) -> dict[int, list[str]]:
        if not places:
            return {}
        table = self._read(block, places, dtype=str, na_filter=False)
        return {p: [cell.strip(' \t"') for cell in table[p].tolist()] for p in places}

    def _few_digits(self, block: _Block, places: Sequence[int]) -> bool:
        """Whether every cell of these columns is so short that it holds no more than EXACT_DIGITS digits."""
        data = block.data
        if b'"' in data or b"e" in data or b"E" in data:
            return False
        signs = np.frombuffer(data, np.uint8)
        ends = np.flatnonzero((signs == ord(self._separator)) | (signs == _NEWLINE))
        if len(ends) != block.rows * self.dialect.fields:
            return False
        widths = (np.diff(ends, prepend=-1) - 1).reshape(block.rows, self.dialect.fields)
        return int(widths[:, places].max(initial=0)) <= EXACT_DIGITS

    @property
    def _separator(self) -> str:
        return "\t" if self.dialect.separator == " " else self.dialect.separator

    def _read(self, block: _Block, places: Sequence[int], **options: Any) -> pd.DataFrame:
        if not block.rows:
            return pd.DataFrame({place: [] for place in places}, dtype=options["dtype"])
        try:
            table = pd.read_csv(
                io.BytesIO(block.data),
                header=None,
                index_col=False,
                usecols=places,
                engine="c",
                sep=self._separator,
                decimal=self.dialect.decimal,
                quoting=csv.QUOTE_MINIMAL if b'"' in block.data else csv.QUOTE_NONE,
                encoding_errors="replace",
                keep_default_na=False,
                skip_blank_lines=False,
                low_memory=False,
                lineterminator="\n",
                **options,
            )
        except pd.errors.ParserError as problem:
            raise LogError(
                f"{self.name}: lines from {block.first_line} on cannot be read as a table"
                f" ({quote(str(problem).splitlines()[0])})."
            ) from None
        if len(table) != block.rows:
            raise LogError(
                f"{self.name}: lines from {block.first_line} on read as {len(table)} rows where there are {block.rows}."
            )
        return table


def open_csv(path: Path) -> CsvLog:
    """A text log with its dialect found from the first part of the file. Errors: LogError of one line."""
    _, head = first_bytes(path, HEAD, "log file", LogError)
    complete = len(head) < HEAD
    return CsvLog(path, twincat_dialect(head, path.name) or dialect_of(head, path.name, complete))


def twincat_dialect(head: bytes, name: str) -> Dialect | None:
    """The dialect of an export of TwinCAT Scope; None for any other file. Errors: LogError where decimal signs differ.

    Such an export has a head of lines with a name before each value, then rows of time and signals. The line "Name"
    gives the headings, "Unit" the units, and SampleTime[ms] says that times are in ms. Where the word Name comes again
    in that line, a column of times of its own begins: the signals behind it belong to it.
    """
    encoding, text = head_text(head)
    match = _SCOPE.match(text)
    if match is None:
        return None
    lines = text.split("\n")
    separator = text[len(NAME)]
    rows = {
        row[0].strip(): (i, row)
        for i, line in enumerate(lines[:200])
        if (row := split_row(line, separator)) and row[0].strip()
    }
    at, names = rows[NAME]
    units = rows.get(UNIT, (at, []))[1]
    first = next((i for i in range(at + 1, len(lines)) if re.match(r"[+-]?\d", lines[i])), None)
    if first is None:
        return None
    cells = [split_row(line, separator) for line in lines[first : first + 50] if line.strip()]
    fields = len(cells[0])
    times = [i for i, cell in enumerate(names) if cell.strip() == NAME]
    label = {place: "time" if k == 0 else f"time {k + 1}" for k, place in enumerate(times)}
    headings = tuple(label.get(i, names[i] if i < len(names) and names[i] else str(i + 1)) for i in range(fields))
    unit = tuple(match[1] if i in label else units[i].strip("()[]") if i < len(units) else "" for i in range(fields))
    return Dialect(
        encoding,
        separator,
        decimal_of(cells, [first + 1 + i for i in range(len(cells))], name),
        first + 1,
        at + 1,
        headings,
        unit,
        fields,
        tuple(cells[0]),
    )


def _open_quote(block: _Block) -> int | None:
    """Row with a quote that is not closed, None where there is none."""
    signs = np.frombuffer(block.data, np.uint8)
    quotes = np.diff(np.searchsorted(np.flatnonzero(signs == _QUOTE), np.flatnonzero(signs == _NEWLINE)), prepend=0)
    odd = np.flatnonzero(quotes % 2)
    return int(odd[0]) if len(odd) else None


def _lines(path: Path, encoding: str, size: int) -> Iterator[tuple[bytes, int]]:
    """Pieces of whole lines as bytes with "\\n" at the end of each line, and the bytes of the file read so far."""
    decode: Callable[[bytes, bool], bytes] = lambda data, end: data
    if encoding.startswith("utf-16"):
        decoder = codecs.getincrementaldecoder(encoding)(errors="replace")
        decode = lambda data, end: decoder.decode(data, end).encode()
    rest, read, last = b"", 0, b""
    with opened(path, "log file", LogError) as stream:
        whole = os.fstat(stream.fileno()).st_size  # what is written to it meanwhile is left for the next time
        while data := stream.read(min(size, whole - read)):
            if read == 0:
                data = data.removeprefix(codecs.BOM_UTF8)
            read += len(data)
            text = last + decode(data, False)
            last = text[-1:] if text.endswith(b"\r") else b""  # the other half of CRLF may begin the next piece
            text = _one_newline(text[: len(text) - len(last)])
            cut = text.rfind(b"\n") + 1
            if cut:
                yield rest + text[:cut], read
                rest = text[cut:]
            else:
                rest += text
            if len(rest) > LONGEST_LINE:
                raise LogError(f"{path.name}: a line of more than {LONGEST_LINE >> 20} MB. Is this a log in text?")
    rest = _one_newline(rest + last + decode(b"", True))
    if rest:
        yield (rest if rest.endswith(b"\n") else rest + b"\n"), read


def _one_newline(text: bytes) -> bytes:
    if b"\r" not in text:
        return text
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _after(data: bytes, lines: int) -> tuple[bytes, int]:
    """The data below the first `lines` lines, and how many of these were in it."""
    cut, passed = 0, 0
    while passed < lines and cut < len(data):
        cut, passed = data.find(b"\n", cut) + 1, passed + 1
    return (data[cut:] if cut else data), passed


def _tidied(data: bytes, first_line: int, dialect: Dialect) -> _Block:
    """The lines of a piece as rows: runs of blanks made one separator, comments and lines of another length taken
    out."""
    separator = dialect.separator
    if separator == " ":
        data, separator = _single_tabs(data), "\t"
    lines, sign = data.count(b"\n"), separator.encode()
    simple = data.count(sign) == lines * (dialect.fields - 1) and not data.startswith((*COMMENTS, b"\n"))
    if simple and b"\n\n" not in data and not any(mark[:1] in data and b"\n" + mark in data for mark in COMMENTS):
        return _Block(data, lines, first_line, None, ())
    counts, ends = _separators(data, sign[0])
    begins = np.concatenate(([0], ends[:-1] + 1))
    good = counts == dialect.fields - 1
    heads = np.frombuffer(data, np.uint8)[begins]
    for i in np.flatnonzero(good & np.isin(heads, np.frombuffer(b"#/% \t", np.uint8))):
        good[i] = not _COMMENT.match(data, begins[i])
    pieces: dict[int, bytes] = {}
    broken: list[tuple[int, str]] = []
    for i in np.flatnonzero(~good):
        line = data[begins[i] : ends[i]]
        if not line.strip(b' \t"' + sign) or _COMMENT.match(line):
            continue
        fields = line.split(sign)
        if (
            len(fields) > dialect.fields
            and b'"' not in line
            and not any(cell.strip() for cell in fields[dialect.fields :])
        ):
            pieces[int(i)], good[i] = sign.join(fields[: dialect.fields]), True  # only empty fields too many
        else:
            broken.append((first_line + int(i), f"{counts[i] + 1} fields where the header has {dialect.fields}"))
    kept_rows = np.flatnonzero(good)
    body = b"".join(pieces.get(int(i), data[begins[i] : ends[i]]) + b"\n" for i in kept_rows)
    return _Block(body, len(kept_rows), first_line, kept_rows, tuple(broken))


def _separators(data: bytes, sign: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Separators outside quotes in each line, and where each line ends."""
    signs = np.frombuffer(data, np.uint8)
    ends = np.flatnonzero(signs == _NEWLINE)
    places = np.flatnonzero(signs == sign)
    if b'"' in data:
        quotes = np.flatnonzero(signs == _QUOTE)
        places = places[np.searchsorted(quotes, places) % 2 == 0]
    counts = np.diff(np.searchsorted(places, ends), prepend=0)
    return counts.astype(np.intp), ends.astype(np.intp)


def _single_tabs(data: bytes) -> bytes:
    """Runs of blanks and tabs as one tab, none at either end of a line."""
    signs = np.frombuffer(b"\n" + data, np.uint8)
    blank = (signs == _BLANK) | (signs == _TAB)
    step = np.diff(blank.astype(np.int8))
    first, last = (
        np.flatnonzero(step == 1) + 1,
        np.flatnonzero(step == -1),
    )  # data end with a newline, so that every run has both
    keep = ~blank
    keep[last[(signs[first - 1] != _NEWLINE) & (signs[last + 1] != _NEWLINE)]] = True
    return bytes(np.where(blank, np.uint8(_TAB), signs)[keep].data)[1:]
