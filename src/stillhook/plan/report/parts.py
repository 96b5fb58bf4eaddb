"""Pieces that a plan's report is made of: plain data that the page and the PDF set alike, and how numbers are
written."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.style import CREDITED, TWIN, degrees, height, named, names
from stillhook.plan.result.result import Credit, PlanResult
from stillhook.plan.table.table import LimitTable
from stillhook.spec.validity import SHORT
from stillhook.units import number, show
from stillhook.variables import BY_NAME

Part = dict[str, Any]
"""One piece: kind is text, sub, facts, bullets, table or figure; the rest is what it says."""
HOUR, DAY = 3600.0, 86400.0
WIDE, WIDER, NUMBER = "1fr", "2fr", "number"
"""Columns of words that fold, and of numbers, which stand at the right."""


def text(content: str) -> Part:
    """A paragraph."""
    return {"kind": "text", "text": content}


def sub(title: str) -> Part:
    """A heading inside a section."""
    return {"kind": "sub", "text": title}


def facts(rows: Iterable[tuple[str, str]]) -> Part:
    """Names with what they are."""
    return {"kind": "facts", "rows": [list(row) for row in rows]}


def bullets(lines: Iterable[str]) -> Part:
    """Sentences, one below the other."""
    return {"kind": "bullets", "lines": list(lines)}


def table(
    header: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    wide: Sequence[int] = (),
    wider: Sequence[int] = (),
    numbers: Sequence[int] = (),
    strong: Sequence[int] = (),
    strong_rows: Sequence[int] = (),
    small: bool = False,
) -> Part:
    """A table of texts.

    wide, wider: places of columns of words, which fold; numbers: of columns of numbers; strong, strong_rows: columns
    and rows that count; small letters.
    """
    kinds = {**dict.fromkeys(wide, WIDE), **dict.fromkeys(wider, WIDER), **dict.fromkeys(numbers, NUMBER)}
    return {
        "kind": "table",
        "header": list(header),
        "rows": [list(row) for row in rows],
        "small": small,
        "columns": [kinds.get(i, "auto") for i in range(len(header))],
        "strong": list(strong),
        "strong_rows": list(strong_rows),
    }


def figure(stem: str, caption: str, tall: float = 118.0) -> Part:
    """A picture by the stem of its file; tall: no taller than this on paper [mm]."""
    return {"kind": "figure", "stem": stem, "file": f"{stem}.png", "caption": caption, "tall": tall}


def leading(result: PlanResult) -> str:
    """The alternative that the first page tells: that of the facts, else the twin alternative with the largest limits,
    as credited."""
    wanted = str(result.facts.get("shown") or "")
    labels = names(result.data)
    if wanted in labels:
        return wanted
    twins = [a.value for a in result.alternatives if a.twin] or labels

    def mean(name: str, credit: Credit) -> float:
        limits = np.minimum(result.data["Hs_limit"].sel(credit=credit, alternative=name).values, highest(result))
        return round(float(np.nan_to_num(limits).mean()), 9)

    return max(twins, key=lambda name: (mean(name, CREDITED), mean(name, TWIN)))


def highest(result: PlanResult) -> float:
    """The highest sea state analysed [m]."""
    return float(result.data.attrs["Hs_highest"])


def limits(result: PlanResult, credit: Credit, alternative: str) -> FloatArray:
    """Limiting heights (heading, period) [m]."""
    return np.asarray(result.data["Hs_limit"].sel(credit=credit, alternative=alternative).values, dtype=float)


def reading(result: PlanResult) -> str:
    """How the table is read between and beyond its cells, in words."""
    data, name = result.data, leading(result)
    tolerance = float(data.attrs.get("heading_tolerance", 0.0))
    cells = limits(result, CREDITED, name)
    return LimitTable(cells, data["heading"].values, data["period"].values, tolerance, highest(result)).described()


def least(Hs: FloatArray) -> FloatArray:
    """Least limit over the headings, of (heading, period) [m]; NaN where one of them is not told."""
    return np.asarray(Hs.min(axis=0))


def worst_heading(Hs: FloatArray) -> list[int]:
    """Place of the heading with the least limit in every period; one that is not told comes first."""
    return [int(i) for i in np.where(np.isnan(Hs), -1.0, Hs).argmin(axis=0)]


def between(Hs: FloatArray, top: float) -> str:
    """Range of limits in words: "1.65 m to 3.24 m", "2.2 m to above 4 m"; "no result" where none is."""
    known = Hs[~np.isnan(Hs)]
    if not known.size:
        return "no result"
    low, high = (_in_words(float(x), top) for x in (known.min(), known.max()))
    return low if low == high else f"{low} to {high}"


def _in_words(Hs: float, top: float) -> str:
    return f"above {number(top, 3)} m" if Hs > top else f"{height(Hs, top)} m"


def over(values: Sequence[float] | FloatArray, kind: str) -> str:
    """Range of values in words: "5 s to 16 s", "150° to 180°"."""
    ends = [degrees(x) if kind == "angle" else show(float(x), kind, 4) for x in (min(values), max(values))]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


def governs(phase: str, rule: str) -> str:
    """What governs, in words."""
    return f"{phase}: {rule.replace('-', ' ')}" if phase and rule else "-"


def hours(seconds: object) -> str:
    """A time in hours."""
    return (
        "-"
        if seconds is None or not math.isfinite(float(str(seconds)))
        else f"{number(float(str(seconds)) / HOUR, 3)} h"
    )


def days(seconds: float) -> str:
    """A time in days; hours below one and a half."""
    if not math.isfinite(seconds):
        return "-"
    return f"{number(seconds / DAY, 3)} d" if seconds >= 1.5 * DAY else f"{number(seconds / HOUR, 3)} h"


def percent(part: float) -> str:
    """A part as per cent."""
    return "-" if math.isnan(part) else f"{number(100.0 * part, 3)} %"


def valued(value: object, quantity: str) -> str:
    """A limit in the display unit of its quantity; a name stays what it is."""
    if not isinstance(value, int | float):
        return "-" if value is None else str(value)
    kind = BY_NAME[quantity].kind if quantity in BY_NAME else ""
    if kind == "speed":  # at sea motions are told in m/s, winches in m/min
        return f"{number(float(value), 3)} m/s ({show(float(value), kind, 3)})"
    return show(float(value), kind, 4) if kind else number(float(value), 4)


def short(digest: object) -> str:
    """The start of a hash, in groups of four."""
    content = str(digest)[:SHORT]
    return " ".join(content[i : i + 4] for i in range(0, len(content), 4))


def of_rule(facts_: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A rule's row by its key; empty where the facts have none."""
    return next((row for row in facts_["rules"]["rows"] if row["key"] == key), {})


def labelled(alternatives: Iterable[str]) -> str:
    """Alternatives as they are called, in a row."""
    return ", ".join(named(a) for a in alternatives)
