"""The one place that makes words of a plan's result: names, codes, limits and ranges, and the sentence of a cause."""

from __future__ import annotations

import math
import string
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.registry import DEFAULT_MODE
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.result import CREDITS, Credit, PlanResult, Remark
from stillhook.report.formatting import EMPTY, days, direction, fixed, fmt, kind_of, percent
from stillhook.spec.scenario import Mode
from stillhook.spec.validity import CAP
from stillhook.trust.standing import UNSIGNED
from stillhook.units import KINDS, number, quote, show

if TYPE_CHECKING:
    import xarray


TWIN, CREDITED = CREDITS
SYNTHETIC_LINE = "SYNTHETIC certificate"
"""What a line of a table is of that may not be claimed."""
SAME = 5e-3
"""Limits that differ by less are shown as one [m]: the second decimal that tables print."""
OVER = {"none": "no compensation", "cap-80": "the 80 % cap", "best-classic": "the best classic controller"}
"""References of gains, in words."""
TEXTS: Mapping[str, Any] = tomllib.loads((files("stillhook.plan.report") / "texts.toml").read_text(encoding="utf-8"))
"""Fixed texts of a plan's report by name, and the sentences of causes by their codes."""


class _Sentences(string.Formatter):
    """Templates with values in SI: the format of a field is one of Python's, a kind of `stillhook.units` and its
    digits ("length 3"), "list", "percent" or "heights" (two ends [m], None for any)."""

    def format_field(self, value: Any, format_spec: str) -> str:
        kind, _, digits = format_spec.partition(" ")
        if kind in KINDS:
            return show(float(value), kind, int(digits or 4))
        match kind:
            case "list":
                return ", ".join(map(str, value))
            case "percent":
                return percent(value)
            case "heights":
                if value[0] is None:
                    return "any Hs of the table"
                ends = ["any" if Hs is None else fixed(Hs, 2) for Hs in value]
                return f"Hs {' to '.join(dict.fromkeys(ends))} m"
        return str(super().format_field(value, format_spec))


def write(template: str, **values: Any) -> str:
    """A template of `TEXTS` with its values."""
    return _Sentences().format(template, **values)


def sentence(remark: Remark) -> str:
    """The sentence of a cause; a text of another room as it is."""
    return remark if isinstance(remark, str) else write(TEXTS["causes"][remark["cause"]], **remark)


def described(alternative: str, settings: str = "") -> str:
    """What an alternative is, in words; settings: controller whose settings it has, in place of its usual ones."""
    texts = TEXTS["alternatives"]
    if alternative in texts and not settings:
        return write(texts[alternative], cap=CAP)
    law = DEFAULT_MODE if alternative == Alternative.STRONG_SSC else Mode(alternative)
    return write(texts["set" if settings else "twin"], title=law.law.title, settings=settings)


def listed(phases: Iterable[str]) -> str:
    """Names of phases in a row; those with a comma in quotes."""
    return ", ".join(quote(name) if "," in name else name for name in phases)


def in_air(payload: Mapping[str, Any]) -> str:
    """What a payload weighs in air, by its facts in a result."""
    mass = fmt(payload["mass"], "mass")
    return f"{mass} in air{' with contingency and rigging' if 'net' in payload else ''}"


def named(alternative: object) -> str:
    """An alternative as it is called in texts."""
    return Alternative(str(alternative)).label if str(alternative) in list(Alternative) else str(alternative)


def names(data: xarray.Dataset, dim: str = "alternative") -> list[str]:
    """Labels along a dimension, as texts."""
    return [str(x) for x in data[dim].values]


def phase_code(result: PlanResult, phase: str) -> str:
    """P1, P2, ...: the phase by its place in the plan."""
    return f"P{names(result.data, 'phase').index(phase) + 1}"


def rule_code(result: PlanResult, rule: str) -> str:
    """R1, R2, ...: the rule by its place in the rule set."""
    return f"R{names(result.data, 'rule').index(rule) + 1}"


GOVERNING = ("governing_phase", "governing_rule", "governing_end")
"""What governs a cell: phase, rule, and what the limit is the end of ("" where the rule is used up there)."""


def governing_of(cells: xarray.Dataset) -> list[tuple[str, str, str]]:
    """`GOVERNING` of every cell, row by row. Results of version 0.10 name no ends."""
    columns = [cells[name].values.ravel() if name in cells else [""] * cells["Hs_limit"].size for name in GOVERNING]
    return [(str(phase), str(rule), str(end)) for phase, rule, end in zip(*columns, strict=True)]


def codes(result: PlanResult, phase: str, rule: str, end: str = "") -> str:
    """What governs by its codes; empty where nothing does."""
    by = TEXTS["end_codes"].get(end) or (rule_code(result, rule) if rule else "")
    return f"{phase_code(result, phase)} {by}" if phase and by else by


def governs(phase: str, rule: str, end: str = "") -> str:
    """What governs, in words."""
    by = TEXTS["ends"].get(end) or rule.replace("-", " ")
    return f"{phase}: {by}" if phase and by else by or "-"


def height(Hs: float, highest: float) -> str:
    """A limiting wave height in metres: beyond the highest sea state analysed as "> 4", none as "-"."""
    if math.isnan(Hs):
        return "-"
    if Hs > highest:
        return f"> {number(highest, 3)}"
    return f"{Hs:.2f}" if Hs > 0.0 else "0"


def between(Hs: FloatArray, top: float) -> str:
    """Range of limits in words: "1.65 m to 3.24 m", "2.2 m to above 4 m"; "no result" where none is."""
    values = Hs[~np.isnan(Hs)]
    if not values.size:
        return "no result"
    ends = [f"{height(float(x), top)} m".replace(">", "above") for x in (values.min(), values.max())]
    return " to ".join(dict.fromkeys(ends))


def over(values: Sequence[float] | FloatArray, kind: str) -> str:
    """Range of values in words: "5 s to 16 s", "150° to 180°"."""
    ends = [direction(x) if kind == "angle" else fmt(float(x), kind) for x in (min(values), max(values))]
    return " to ".join(dict.fromkeys(ends))


def valued(value: object, quantity: str) -> str:
    """A limit in the display unit of its quantity; a name stays what it is."""
    if not isinstance(value, int | float):
        return EMPTY if value is None else str(value)
    kind = kind_of(quantity)
    if quantity.endswith("_share"):
        return percent(value)
    if kind == "speed":  # at sea motions are stated in m/s, winches in m/min
        return f"{fmt(value, digits=3)} m/s ({fmt(value, kind, 3)})"
    return fmt(value, kind)


def sea_words(attrs: Mapping[str, Any]) -> str:
    """The sea of a block: "Hs 2 m, Tp 9 s, waves at 180°", of what it says."""
    parts = {"Hs": "Hs {Hs:length 3}", "Tp": "Tp {Tp:time 3}"}
    words = [write(text, **{key: attrs[key]}) for key, text in parts.items() if key in attrs]
    return ", ".join([*words, *([f"waves at {direction(attrs['beta'])}"] if "beta" in attrs else [])])


def few(n: int, most: int) -> list[int]:
    """At most so many places out of n, evenly spread, both ends included."""
    return sorted({round(i) for i in np.linspace(0, n - 1, min(n, most))})


def leading(result: PlanResult) -> str:
    """The alternative on the first page."""
    labels, shown = names(result.data), str(result.facts["summary"]["shown"])
    return shown if shown in labels else labels[0]


def highest(result: PlanResult) -> float:
    """The highest sea state analysed [m]."""
    return float(result.data.attrs["Hs_highest"])


def limits(result: PlanResult, credit: Credit, alternative: str) -> FloatArray:
    """Limiting heights (heading, period) [m]."""
    return np.asarray(result.data["Hs_limit"].sel(credit=credit, alternative=alternative).values, dtype=float)


def signature_facts(certificate: Mapping[str, Any]) -> Mapping[str, Any]:
    """How the signature of a plan's certificate stands; those of earlier versions had none."""
    signature: Mapping[str, Any] = certificate.get("signature") or UNSIGNED.to_dict()
    return signature


def untrusted(certificate: Mapping[str, Any]) -> bool:
    """Whether there is a certificate that no trusted key vouches for, and that the plan does not assume itself."""
    return bool(certificate) and not certificate.get("assumed") and not signature_facts(certificate)["trusted"]


def differs(result: PlanResult, alternative: str, credit: Credit = TWIN, other: Credit | None = None) -> bool:
    """Whether the limits of an alternative under a credit, by default its model, are not those of another, by default
    what may be claimed."""
    pair = credit, other or result.claim
    a, b = (np.minimum(limits(result, each, alternative), highest(result)) for each in pair)
    return not bool(np.allclose(a, b, rtol=0.0, atol=SAME, equal_nan=True))


def lines_of(result: PlanResult, alternative: str) -> list[tuple[str, Credit]]:
    """Lines of a table for an alternative: as may be claimed, as credited, and by its model, where they differ."""
    lines: list[tuple[str, Credit]] = [(named(alternative), result.claim)]
    for words, credit in ((SYNTHETIC_LINE, CREDITED), ("by the twin", TWIN)):
        if differs(result, alternative, credit, lines[-1][1]):
            lines.append((f"{named(alternative)}, {words}", credit))
    return lines


def worst_heading(Hs: FloatArray) -> list[int]:
    """Place of the heading with the least limit in every period; an undetermined one comes first."""
    return [int(i) for i in np.where(np.isnan(Hs), -1.0, Hs).argmin(axis=0)]


def reading(result: PlanResult) -> str:
    """How the table is read between and beyond its cells, in words."""
    period, tolerance = result.data["period"].values, result.data.attrs.get("heading_tolerance", 0.0)
    ends = {"lowest": period[0], "highest": period[-1], "Hs": highest(result)}
    return write(TEXTS["reading_between"], tolerance=tolerance, **ends)


def of_wind_sea(result: PlanResult) -> str:
    """What limits are of where the table has a swell with its wind sea, for titles: ", of the wind sea besides a
    swell of ..."; empty without one."""
    swell = result.facts["settings"].get("swell")
    return "" if swell is None else f", of the wind sea with a {swell['text']}"


def workable(cells: xarray.Dataset) -> list[str]:
    """Operability, and mean, median and 90 % fractile of the waiting, of a row of the weather block."""
    waits = [days(float(cells[key])) for key in ("wait_mean", "wait_p50", "wait_p90")]
    return [percent(float(cells["operability"])), *waits]


def gain(cells: xarray.Dataset, over: str, digits: int = 1) -> str:
    """Days gained over another alternative with their 95 % interval, if any, of a row of the weather block."""
    value, *ends = (
        fixed(float(cells[key].sel(over=over)), digits) if key in cells else ""
        for key in ("days_gained", "days_gained_low", "days_gained_high")
    )
    known = "days_gained_low" in cells and math.isfinite(float(cells["days_gained_low"].sel(over=over)))
    return f"{value} ({ends[0]} to {ends[1]})" if known and len({value, *ends}) > 1 else value
