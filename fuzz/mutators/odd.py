"""Values that are allowed somewhere and expected nowhere."""

from __future__ import annotations

import random
import tomllib
from pathlib import Path
from typing import Any

import stillhook

NUMBERS = (
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "0.5",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "1e400",
    "-1e400",
    "nan",
    "inf",
    "-inf",
    "NaN",
    "Infinity",
    "1e16",
    "9007199254740993",
    "99999999999999999999999",
    "0x10",
    "0b1",
    "1_000",
    "1,5",
    "1.000,5",
    "1 000",
    "1.",
    ".5",
    "1e",
    "1e+",
    "--",
    "+1",
    "٣",
    "½",
    "１",
    "1e5000",
    "4294967296",
    "-2147483649",
    "18446744073709551616",
    "00012",
    "1e-7",
    "360",
    "-360",
    "100000",
)
ODD = (
    "",
    " ",
    "\0",
    "\n",
    "\r",
    "\t",
    "\u2028",
    "\x85",
    "\ufeff",
    "é",
    "☃",
    "\U0001f409",
    "\u202e",
    "\u200b",
    "a\u0301",
    "\\",
    '"',
    "'",
    '"""',
    "#",
    "=",
    "[",
    "]",
    "{",
    "}",
    "[[",
    "{{",
    "%s",
    "%n",
    "{0}",
    "{x.__class__}",
    "../x",
    "/",
    "/etc/hostname",
    "~",
    "-",
    "--",
    "nan",
    "null",
    "none",
    "true",
    "False",
    "<b>",
    "=1+1",
    "@a",
    ",",
    ";",
    ".",
    ":",
    "+",
    "1:2",
    "12:00",
    "2027-03-01",
    "2027-03-01T00:00:00Z",
    "1979-05-27T07:32:00-99:00",
    "0001-01-01",
    "9999-12-31T23:59:60",
    "A" * 100,
    "x" * 5000,
    "9" * 400,
    "9" * 5000,
    "(" * 200,
    "a.b.c",
    "0x",
    "NaT",
    "still",
    "\x1b[2J",
    "$",
    "`id`",
    "*",
    "?",
)
BYTES = (
    b"\0",
    b"\xff",
    b"\xfe\xff",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\xed\xa0\x80",
    b"\x80",
    b"\x1a",
    b"\x1f\x8b",
    b"PK",
)
UNITS: tuple[str, ...] = ()


def units() -> tuple[str, ...]:
    """Every unit that Stillhook knows, and some that it does not."""
    global UNITS
    if not UNITS:
        rows = tomllib.loads((Path(stillhook.__file__).parent / "units.toml").read_text(encoding="utf-8"))
        found = {word for word in _texts(rows) if len(word) < 16 and word.isprintable()}
        UNITS = (*sorted(found), "kN", "ft", "", "m m", "m^", "1/0", "km/h", "°C", "µm", "m³")
    return UNITS


def _texts(node: Any) -> list[str]:
    if isinstance(node, dict):
        return [text for key, value in node.items() for text in [key, *_texts(value)]]
    return [text for value in node for text in _texts(value)] if isinstance(node, list) else [str(node)]


def number(r: random.Random) -> str:
    if r.random() < 0.4:
        return r.choice(NUMBERS)
    return f"{r.choice((-1, 1, 1)) * r.random() * 10.0 ** r.randint(-9, 12):.{r.randint(1, 17)}g}"


def quantity(r: random.Random) -> str:
    return f"{number(r)} {r.choice(units())}"


def value(r: random.Random, depth: int = 0) -> Any:
    """A value of any type that JSON and TOML have."""
    pick = r.randrange(14 if depth < 2 else 10)
    if pick < 3:
        return quantity(r)
    if pick < 4:
        return r.choice(ODD)
    if pick < 6:
        return r.choice((0, 1, -1, 2**31, 2**63, -(2**64), 10**400, 3, 1000))
    if pick < 8:
        return r.choice((0.0, -0.0, 0.5, 1e308, 5e-324, float("nan"), float("inf"), float("-inf"), -1.5, 1e-12, 1e9))
    if pick < 9:
        return r.random() < 0.5
    if pick < 10:
        return number(r)
    if pick < 12:
        return [value(r, depth + 1) for _ in range(r.choice((0, 1, 2, 3, 50)))]
    return {r.choice((*ODD, "value", "unit", "kind", "name", "x")): value(r, depth + 1) for _ in range(r.randrange(3))}
