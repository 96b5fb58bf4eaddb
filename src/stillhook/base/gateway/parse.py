"""Texts of TOML, JSON and YAML as tables and lists, within a budget of nesting and without what no file of ours holds.

Every fault is an `UnreadableError` with a reason in a few words; who reads the file says the rest.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from stillhook.base.gateway.access import read_bytes
from stillhook.base.gateway.budget import JSON, LONGEST_NUMBER, MOST_PARTS, TOML, YAML
from stillhook.base.gateway.guard import few_words
from stillhook.errors import StillhookError, UnreadableError
from stillhook.units import quote

LARGEST_WHOLE = 2**64
"""Whole numbers are below it: every seed and count of ours."""

_TOML_TOKEN = re.compile(
    r'"""[^"\\]*+(?:(?:\\.|"(?!""))[^"\\]*+)*+"{3,5}'
    r"|'''.*?'{3,5}"
    r'|"[^"\\\n]*+(?:\\.[^"\\\n]*+)*+"'
    r"|'[^'\n]*'"
    r"|#[^\n]*"
    r"|[\[\]{}.=,\n]",
    re.DOTALL,
)
_JSON_TOKEN = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[\[\]{}]', re.DOTALL)
_LONG_WHOLE = re.compile(r"[0-9]{16}")
_MAYBE_INFINITE = re.compile(r"[eE]\+?[0-9]{3}|[0-9]{300}")
_HALF_SIGN = re.compile("[\\ud800-\\udfff]")
"""In place of bytes that were no UTF-8, in texts that other libraries decode."""
_SURROGATE = re.compile(rf"\\u[dD][89a-fA-F]|{_HALF_SIGN.pattern}")

UNPRINTED = re.compile("[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f\\u2028-\\u202e\\u2066-\\u2069\\ufffe\\uffff]")
"""Signs that command a terminal, turn the direction of what follows, or end a line unseen; tab and line end are none of
them. XML has no place for most of them."""
_ESCAPED = re.compile(r"\\[bfreuUx]")
"""How TOML writes one."""


def from_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text, whose values can be printed. Errors: UnreadableError."""
    if half := _HALF_SIGN.search(text):
        raise UnreadableError(f"{quote(half[0])} is not Unicode text")
    deepest, dotted = _toml_depth(text)
    if dotted > TOML.depth:
        raise UnreadableError(f"a key of {dotted} parts, up to {TOML.depth} are read")
    _refuse_deeper(deepest, TOML.depth)
    try:
        tables = tomllib.loads(text)
    except Exception as problem:  # besides its own error ValueError for a long number, RecursionError
        raise UnreadableError(_reason(problem)) from None
    if UNPRINTED.search(text) or _ESCAPED.search(text):
        _refuse_unprinted(tables)
    return tables


def _toml_depth(text: str) -> tuple[int, int]:
    """Brackets inside of each other, and parts of the longest dotted key: reading one takes their square."""
    depth = deepest = dots = dotted = 0
    for match in _TOML_TOKEN.finditer(text):
        sign = match[0]
        if sign == ".":
            dots += 1
            dotted = max(dotted, dots)
        elif sign in "[{":
            depth, dots = depth + 1, 0
            deepest = max(deepest, depth)
        elif sign in "]}":
            depth, dots = max(depth - 1, 0), 0
        elif sign in "=,\n":
            dots = 0
    return deepest, dotted + 1


def from_json(text: str | bytes) -> Any:
    """What a JSON text holds; bytes are UTF-8. Refused are NaN and Infinity, a name that comes twice in a table, and
    texts that are not Unicode. Errors: UnreadableError."""
    try:
        text = text.decode("utf-8-sig") if isinstance(text, bytes) else text
        if text.count("[") + text.count("{") > JSON.depth:
            _refuse_deeper(_json_depth(text), JSON.depth)
        numbers: dict[str, Any] = {}
        if _MAYBE_INFINITE.search(text):
            numbers["parse_float"] = _finite
        if _LONG_WHOLE.search(text):
            numbers["parse_int"] = _whole
        value = json.loads(text, object_pairs_hook=_once, parse_constant=_refuse_constant, **numbers)
    except UnreadableError:
        raise
    except Exception as problem:  # ValueError in many ways, TypeError, RecursionError
        raise UnreadableError(_reason(problem)) from None
    if _SURROGATE.search(text):
        _refuse_half_signs(value)
    return value


def json_file(path: str | os.PathLike[str], noun: str, advice: str, error: type[StillhookError]) -> Any:
    """What a file of JSON holds; noun: what it is, with an article; advice: what to do without it, a sentence. Errors:
    `error` of one line."""
    data = read_bytes(path, noun.partition(" ")[2], error, JSON)
    try:
        return from_json(data)
    except UnreadableError as problem:
        raise error(f"{Path(path).name}: not {noun} ({problem}). {advice}") from None


def _json_depth(text: str) -> int:
    depth = deepest = 0
    for match in _JSON_TOKEN.finditer(text):
        sign = match[0]
        if sign in "[{":
            depth += 1
            deepest = max(deepest, depth)
        elif sign in "]}":
            depth -= 1
    return deepest


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        seen: set[str] = set()
        twice = next(name for name, _ in pairs if name in seen or seen.add(name))  # type: ignore[func-returns-value]
        raise UnreadableError(f"{quote(twice)} is given twice")
    return table


def _refuse_constant(text: str) -> Any:
    raise UnreadableError(f"{text} is not a number")


def _finite(text: str) -> float:
    value = float(text)
    if abs(value) == float("inf"):
        raise UnreadableError(f"{quote(text)} is too large a number")
    return value


def _whole(text: str) -> int:
    if len(text) > LONGEST_NUMBER or abs(value := int(text)) >= LARGEST_WHOLE:
        raise UnreadableError(f"{quote(text)} is too large a whole number")
    return value


def from_yaml(text: str) -> list[Any]:
    """The documents of a YAML text. Parts that come again by name count each time: a few lines of them may stand for
    any number of values. Needs PyYAML. Errors: UnreadableError; ImportError."""
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        _check_yaml(yaml, yaml.parse(text, Loader=loader))
        return list(yaml.load_all(text, Loader=loader))
    except UnreadableError:
        raise
    except Exception as problem:  # YAMLError, and of what it makes numbers and dates: ValueError, OverflowError
        raise UnreadableError(_reason(problem)) from None


def _check_yaml(yaml: Any, events: Iterable[Any]) -> None:
    """Refuse what is nested too deep, stands for too many parts, or holds a number of too many digits."""
    opened: list[tuple[str | None, int]] = []  # name of a part, and how many parts came before it
    named: dict[str | None, int] = {}
    parts = 0
    for event in events:
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in named:
                raise UnreadableError(f"*{event.anchor} is a part of itself, or of none")
            parts += named[event.anchor]
        elif isinstance(event, yaml.CollectionStartEvent):
            opened.append((event.anchor, parts))
            _refuse_deeper(len(opened), YAML.depth)
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = opened.pop()
            parts += 1
            named[anchor] = parts - before
        elif isinstance(event, yaml.ScalarEvent):
            parts += 1
            named[event.anchor] = 1
            if len(event.value) > LONGEST_NUMBER and _as_number(event.value):
                raise UnreadableError(f"{quote(event.value)} is too long a number")
        if parts > MOST_PARTS:
            raise UnreadableError(f"more than {MOST_PARTS} values, those that come again counted each time")


def _as_number(text: str) -> bool:
    return text[0] in "+-.0123456789" and not text.strip("+-._:0123456789abcdefABCDEFxoO")


def _refuse_deeper(depth: int, most: int) -> None:
    if depth > most:
        raise UnreadableError(f"nested {depth} deep, up to {most} are read")


def _inside(value: Any) -> Iterator[Any]:
    """Keys and values of tables and lists in each other."""
    waiting = [value]
    while waiting:
        item = waiting.pop()
        if isinstance(item, dict):
            yield from item
            waiting.extend(item.values())
        elif isinstance(item, list):
            waiting.extend(item)
        else:
            yield item


def _refuse_half_signs(value: Any) -> None:
    for item in _inside(value):
        if isinstance(item, str) and any("\ud800" <= sign <= "\udfff" for sign in item):
            raise UnreadableError(f"{quote(item)} is not Unicode text")


def _refuse_unprinted(tables: dict[str, Any]) -> None:
    for item in _inside(tables):
        if isinstance(item, str) and (sign := UNPRINTED.search(item)):
            where = quote(item[max(0, sign.start() - 20) : sign.end() + 20])
            raise UnreadableError(f"{where} has a sign that is not for print, U+{ord(sign[0]):04X}")


def _reason(problem: Exception) -> str:
    if isinstance(problem, RecursionError):
        return "nested too deep"
    if "integer string conversion" in str(problem):
        return "too large a whole number"
    return few_words(problem)
