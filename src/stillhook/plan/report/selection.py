"""What the sections of a plan's report have in common: the alternative that leads, its limits, and ranges in words."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.style import CREDITED, TWIN, height, named, names
from stillhook.plan.result import Credit, PlanResult
from stillhook.plan.table import LimitTable
from stillhook.report.formatting import EMPTY, direction, fmt, kind_of
from stillhook.units import number


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
    ends = [direction(x) if kind == "angle" else fmt(float(x), kind) for x in (min(values), max(values))]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


def governs(phase: str, rule: str) -> str:
    """What governs, in words."""
    return f"{phase}: {rule.replace('-', ' ')}" if phase and rule else "-"


def valued(value: object, quantity: str) -> str:
    """A limit in the display unit of its quantity; a name stays what it is."""
    if not isinstance(value, int | float):
        return EMPTY if value is None else str(value)
    kind = kind_of(quantity)
    if kind == "speed":  # at sea motions are told in m/s, winches in m/min
        return f"{fmt(value, digits=3)} m/s ({fmt(value, kind, 3)})"
    return fmt(value, kind)


def of_rule(facts_: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A rule's row by its key; empty where the facts have none."""
    return next((row for row in facts_["rules"]["rows"] if row["key"] == key), {})


def labelled(alternatives: Iterable[str]) -> str:
    """Alternatives as they are called, in a row."""
    return ", ".join(named(a) for a in alternatives)


TEXTS: Mapping[str, Any] = tomllib.loads((files("stillhook.plan.report") / "texts.toml").read_text(encoding="utf-8"))
"""Fixed texts of a plan's report by name."""
