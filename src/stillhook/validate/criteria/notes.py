"""What is said of a result: a code with its values, and the one template of each code (`notes.toml`)."""

from __future__ import annotations

import string
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from stillhook.report.formatting import percent
from stillhook.statistics.estimate import Estimate, extremes
from stillhook.units import KINDS, number, show

_SECTIONS = tomllib.loads((files("stillhook.validate.criteria") / "notes.toml").read_text(encoding="utf-8"))
NOTES: Mapping[str, str] = {code: text for section in _SECTIONS.values() for code, text in section.items()}
"""The template of every code."""


class _Format(string.Formatter):
    """What a template may ask of a value, next to Python's own formats.

    `pressure 3`: a quantity [SI] in its display unit to three digits; `# 3`: a number to three digits; `% 3`: the same
    as per cent; `.2f%`: per cent by a format of Python; `ms`: whole milliseconds; `cm`: centimetres to three digits;
    `|...`: its magnitude; `?above|below`: a word by its sign; `+test|tests`: a count of these. Of several values `or`:
    the word between them, a comma without one. Of a value by test any of these, for the smallest and the largest test.
    """

    def format_field(self, value: Any, format_spec: str) -> str:
        kind, _, digits = format_spec.partition(" ")
        if isinstance(value, Mapping):
            numbers = {k: v.value if isinstance(v, Estimate) else v for k, v in value.items()}
            return extremes(numbers, lambda x: self.format_field(x, format_spec))
        if isinstance(value, list | tuple):
            return (f" {format_spec} " if format_spec else ", ").join(map(str, value))
        match format_spec[:1]:
            case "?":
                return format_spec[1:].split("|")[int(value <= 0.0)]
            case "|":
                return self.format_field(abs(value), format_spec[1:])
            case "+" if "|" in format_spec:
                return f"{value:g} {format_spec[1:].split('|')[value != 1]}"
        if kind == "ms":
            return f"{1e3 * value + 0.0:.0f} ms"
        if kind == "cm":
            return f"{100.0 * value:.3g} cm"
        if kind in ("#", "%"):
            return number(value, int(digits)) if kind == "#" else percent(value, int(digits))
        if kind in KINDS:
            return show(value, kind, int(digits or 4))
        if format_spec.endswith("%"):
            return f"{100.0 * value:{format_spec[:-1]}} %"
        return str(format(value, format_spec))


_FORMAT = _Format()


class Note(str):
    """A cause, a condition or a remark: code, and values [SI] that its template takes. As text, the sentence."""

    code: str
    values: Mapping[str, Any]

    def __new__(cls, code: str, /, **values: Any) -> Note:
        self = super().__new__(cls, _FORMAT.vformat(NOTES[code], (), values))
        self.code, self.values = code, values
        return self
