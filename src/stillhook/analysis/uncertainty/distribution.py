"""What is known of a number that is not known: its distribution, as text with units in and SI inside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import SpecError
from stillhook.units import KINDS, in_display, number, parse, quote

MOST_OUTSIDE = 0.01
"""Largest share of a normal distribution beyond what the number may be [-]: more, and a normal distribution is the
wrong one."""
OPEN = 1e-10
"""The least part by which a uniform draw is moved off 0 and 1, where the normal law is infinite (as scipy.stats.qmc
does)."""


class Law(StrEnum):
    """Shape of a distribution. The values are, in this order: normal mean and standard deviation; lognormal median and
    the factor of one standard deviation; uniform both ends; triangular low end, peak, high end; fixed the value."""

    NORMAL = "normal"
    LOGNORMAL = "lognormal"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"
    FIXED = "fixed"


COUNT = {Law.NORMAL: 2, Law.LOGNORMAL: 2, Law.UNIFORM: 2, Law.TRIANGULAR: 3, Law.FIXED: 1}


@dataclass(frozen=True)
class Distribution:
    """A law and its values [SI]; see `Law`. Build one from text with `distribution`."""

    law: Law
    values: tuple[float, ...]

    def at(self, u: FloatArray, low: float = -math.inf, high: float = math.inf) -> FloatArray:
        """The quantiles at u in (0, 1); a normal distribution is that of the values between low and high, and none is
        clipped."""
        from scipy.special import ndtr, ndtri

        v = self.values
        u = 0.5 + (1.0 - OPEN) * (u - 0.5)
        out: FloatArray
        if self.law is Law.FIXED:
            out = np.full_like(u, v[0])
        elif self.law is Law.NORMAL:
            p_low, p_high = ndtr((low - v[0]) / v[1]), ndtr((high - v[0]) / v[1])
            out = v[0] + v[1] * ndtri(p_low + (p_high - p_low) * u)
        elif self.law is Law.LOGNORMAL:
            out = v[0] * v[1] ** ndtri(u)
        elif self.law is Law.UNIFORM:
            out = v[0] + (v[1] - v[0]) * u
        else:
            a, m, b = v
            part = (m - a) / (b - a)
            out = np.where(u < part, a + np.sqrt(u * (b - a) * (m - a)), b - np.sqrt((1.0 - u) * (b - a) * (b - m)))
        return out

    def problem(self, low: float, high: float) -> str:
        """Why this is no distribution of a number between low and high; "" where it is one."""
        from scipy.special import ndtr

        v = self.values
        if not all(math.isfinite(x) for x in v):
            return "a value is not finite. Give numbers."
        if (self.law is Law.NORMAL and v[1] <= 0.0) or (self.law is Law.LOGNORMAL and not (v[0] > 0.0 and v[1] > 1.0)):
            need = "a deviation above 0" if self.law is Law.NORMAL else "a median above 0 and a factor above 1"
            return f"{self.law} takes {need}. Give it, or a fixed value."
        if self.law in (Law.UNIFORM, Law.TRIANGULAR) and not (v[0] < v[-1] and sorted(v) == list(v)):
            return f"{self.law} takes values that rise. Sort them, or give a fixed value."
        if self.law is Law.NORMAL:
            outside = float(ndtr((low - v[0]) / v[1]) + ndtr((v[0] - high) / v[1]))
            advice = f"{outside:.0%} of it is outside {low:g} to {high:g}. Use lognormal, uniform or triangular."
            return advice if outside > MOST_OUTSIDE else ""
        ends = (v[0],) if self.law in (Law.LOGNORMAL, Law.FIXED) else (v[0], v[-1])
        if not all(low <= x <= high for x in ends):
            return f"beyond {low:g} to {high:g}. Give values in between."
        return ""

    def describe(self, kind: str = "") -> str:
        """In words, in display units: "lognormal 1, x/ 1.3"."""
        unit = f" {KINDS[kind].display}" if kind else ""
        show = [number(in_display(x, kind) if kind else x, 3) for x in self.values]
        if self.law is Law.LOGNORMAL:
            return f"lognormal {show[0]}{unit}, times or over {number(self.values[1], 3)}"
        if self.law is Law.NORMAL:
            return f"normal {show[0]} ± {show[1]}{unit}"
        if self.law is Law.FIXED:
            return f"fixed {show[0]}{unit}"
        return f"{self.law} {' to '.join((show[0], show[-1]))}{unit}" + (
            f", most often {show[1]}" if self.law is Law.TRIANGULAR else ""
        )

    def to_dict(self, kind: str = "") -> dict[str, Any]:
        """What `distribution` reads back."""
        units = [kind] * len(self.values)
        if self.law is Law.LOGNORMAL:
            units[1] = ""
        written = [f"{x!r} {KINDS[k].si}" if k else x for x, k in zip(self.values, units, strict=True)]
        return {self.law.value: written[0] if self.law is Law.FIXED else written}


def distribution(value: Any, kind: str, where: str, low: float = -math.inf, high: float = math.inf) -> Distribution:
    """A distribution from the table of a file.

    Parameters: value ``{normal = [1, 0.1]}``, ``{uniform = ["0 ms", "20 ms"]}`` and so on with the names of `Law`, or a
    plain value, which is fixed; kind of quantity ("" a pure number); where what comes first in an error; low, high what
    the number may be [SI].
    Errors: SpecError, UnitError of one line.
    """
    if not isinstance(value, Mapping):
        value = {Law.FIXED.value: value}
    if len(value) != 1 or (name := next(iter(value))) not in tuple(Law):
        raise SpecError(
            f"{where} = {quote(dict(value))}: choose one of {', '.join(Law)}, such as {{ normal = [1.0, 0.1] }}."
        )
    law, rows = Law(name), value[name]
    rows = rows if isinstance(rows, (list, tuple)) else [rows]
    if len(rows) != COUNT[law]:
        raise SpecError(f"{where}: {law} takes {COUNT[law]} value{'s' * (COUNT[law] > 1)}, came {len(rows)}.")
    kinds = [kind] * len(rows)
    if law is Law.LOGNORMAL:
        kinds[1] = ""
    result = Distribution(law, tuple(_value(x, k, where) for x, k in zip(rows, kinds, strict=True)))
    if problem := result.problem(low, high):
        raise SpecError(f"{where} = {quote({law.value: list(rows)})}: {problem}")
    return result


def _value(x: Any, kind: str, where: str) -> float:
    if kind:
        return parse(x, kind, where)
    if isinstance(x, bool) or not isinstance(x, (int, float)):
        raise SpecError(f"{where} = {quote(x)}: must be a number.")
    return float(x)
