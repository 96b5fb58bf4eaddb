"""What texts and figures of a plan's report share: names, colours and codes, limits and ranges in words, fixed
texts."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative
from stillhook.plan.result import CREDITS, Credit, PlanResult
from stillhook.plan.table import LimitTable
from stillhook.report.formatting import EMPTY, days, direction, fixed, fmt, kind_of, percent
from stillhook.report.plots.colours import colours_of
from stillhook.units import number, show

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


WIDTH = 7.5
"""Of every figure [inch]: about that of a page, so that its letters are of one size."""
FIRST = (*ALTERNATIVES, *(alternative for alternative in Alternative if alternative not in ALTERNATIVES))
"""Alternatives in the order in which markers are taken: those of every plan first."""
COLOUR: Mapping[str, str] = colours_of(FIRST)
MARKER: Mapping[str, str] = {name: "xsv^oDP*"[i % 8] for i, name in enumerate(FIRST)}
THICK: Mapping[str, float] = {name: max(3.2 - 0.45 * i, 0.5) for i, name in enumerate(FIRST)}
"""Widths of lines: the later drawn is the thinner, so that lines that are one on the other are all seen."""
TWIN, CREDITED = CREDITS
SWINGS = "0 m BY OSCILLATION"
"""Begins remarks on alternatives that have no limit because the winch oscillates; shown with the answer."""
SAME = 5e-3
"""Limits that differ by less are shown as one [m]: the second decimal that tables print."""


def named(alternative: object) -> str:
    """An alternative as it is called in texts."""
    return Alternative(str(alternative)).label if str(alternative) in list(Alternative) else str(alternative)


def names(data: xarray.Dataset, dim: str = "alternative") -> list[str]:
    """Labels along a dimension, as texts."""
    return [str(x) for x in data[dim].values]


def swinging(result: PlanResult) -> list[str]:
    """Remarks on alternatives that have no limit because the winch oscillates, a sentence each."""
    return [f"{line}." for line in result.facts["remarks"] if line.startswith(SWINGS)]


def phase_code(result: PlanResult, phase: str) -> str:
    """P1, P2, ...: the phase by its place in the plan."""
    return f"P{names(result.data, 'phase').index(phase) + 1}"


def rule_code(result: PlanResult, rule: str) -> str:
    """R1, R2, ...: the rule by its place in the rule set."""
    return f"R{names(result.data, 'rule').index(rule) + 1}"


def height(Hs: float, highest: float) -> str:
    """A limiting wave height in metres: beyond the highest sea state analysed as "> 4", none as "-"."""
    if math.isnan(Hs):
        return "-"
    if Hs > highest:
        return f"> {number(highest, 3)}"
    return f"{Hs:.2f}" if Hs > 0.0 else "0"


def sea_words(attrs: Mapping[str, Any]) -> str:
    """The sea of a block: "Hs 2 m, Tp 9 s, waves at 180°", of what it says."""
    words = []
    if "Hs" in attrs:
        words.append(f"Hs {show(float(attrs['Hs']), 'length', 3)}")
    if "Tp" in attrs:
        words.append(f"Tp {show(float(attrs['Tp']), 'time', 3)}")
    if "beta" in attrs:
        words.append(f"waves at {direction(attrs['beta'])}")
    return ", ".join(words)


def canvas(rows: int, columns: int, tall: float, **more: Any) -> tuple[Figure, NDArray[Any]]:
    """A figure of the width of a page with its axes (rows, columns); tall [inch]."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(WIDTH, tall), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **more)
    for ax in np.ravel(axes):
        ax.grid(alpha=0.3)
        ax.tick_params(labelsize="small")
    return figure, axes


def key_below(figure: Figure, axes: Sequence[Axes], columns: int = 6) -> None:
    """One legend of some axes below the whole figure, each label once."""
    pairs = {label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    if pairs:
        figure.legend(
            list(pairs.values()),
            list(pairs),
            loc="outside lower center",
            ncols=columns,
            fontsize="small",
            frameon=False,
        )


def lines(ax: Axes, x: FloatArray, of: xarray.DataArray, factor: float = 1.0, **style: Any) -> None:
    """A line for every alternative over x; of (alternative, ...)."""
    for name in names(of.to_dataset(name="value")):
        y = factor * np.asarray(of.sel(alternative=name).values, dtype=float)
        if np.isfinite(y).any():
            ax.plot(x, y, color=COLOUR[name], label=named(name), **{"lw": THICK[name], **style})


def few(n: int, most: int) -> list[int]:
    """At most so many places out of n, evenly spread, both ends included."""
    return sorted({round(i) for i in np.linspace(0, n - 1, min(n, most))})


def highest_shown(result: PlanResult) -> float:
    """Top of the scales: the highest sea state analysed, or less where no limit comes near it [m]."""
    highest = float(result.data.attrs["Hs_highest"])
    limits = np.nan_to_num(result.data["Hs_limit"].values, nan=0.0, posinf=highest)
    return min(highest, max(1.0, float(np.ceil(2.4 * limits.max()) / 2.0)))


def leading(result: PlanResult) -> str:
    """The alternative on the first page: that of the facts, else the twin alternative with the largest limits,
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


def of_wind_sea(result: PlanResult) -> str:
    """What limits are of where a swell is beside the wind sea of the table, for titles: ", of the wind sea beside a
    swell of ..."; empty without one."""
    swell = result.facts["settings"].get("swell")
    return "" if swell is None else f", of the wind sea beside a {swell['text']}"


def workable(cells: xarray.Dataset) -> list[str]:
    """Operability, and mean, median and 90 % fractile of the waiting, of a row of the weather block."""
    waits = [days(float(cells[key])) for key in ("wait_mean", "wait_p50", "wait_p90")]
    return [percent(float(cells["operability"])), *waits]


def gain(cells: xarray.Dataset, over: str, digits: int = 1) -> str:
    """Days gained over another alternative with their 95 % interval, where there is one, of a row of the weather
    block."""
    value, *ends = (
        fixed(float(cells[key].sel(over=over)), digits) if key in cells else ""
        for key in ("days_gained", "days_gained_low", "days_gained_high")
    )
    known = "days_gained_low" in cells and math.isfinite(float(cells["days_gained_low"].sel(over=over)))
    return f"{value} ({ends[0]} to {ends[1]})" if known and len({value, *ends}) > 1 else value


def differs(result: PlanResult, alternative: str) -> bool:
    """Whether what is credited to an alternative is not what its model says."""
    a, b = (np.minimum(limits(result, credit, alternative), highest(result)) for credit in CREDITS)
    return not bool(np.allclose(a, b, rtol=0.0, atol=SAME, equal_nan=True))


def lines_of(result: PlanResult, alternative: str) -> list[tuple[str, Credit]]:
    """Lines of a table for an alternative: as credited, and by its model where that differs."""
    lines: list[tuple[str, Credit]] = [(named(alternative), CREDITED)]
    return [*lines, (f"{named(alternative)}, by the twin", TWIN)] if differs(result, alternative) else lines


def least(Hs: FloatArray) -> FloatArray:
    """Least limit over the headings, of (heading, period) [m]; NaN where one of them is not determined."""
    return np.asarray(Hs.min(axis=0))


def worst_heading(Hs: FloatArray) -> list[int]:
    """Place of the heading with the least limit in every period; an undetermined one comes first."""
    return [int(i) for i in np.where(np.isnan(Hs), -1.0, Hs).argmin(axis=0)]


def between(Hs: FloatArray, top: float) -> str:
    """Range of limits in words: "1.65 m to 3.24 m", "2.2 m to above 4 m"; "no result" where none is."""
    values = Hs[~np.isnan(Hs)]
    if not values.size:
        return "no result"
    low, high = (_in_words(float(x), top) for x in (values.min(), values.max()))
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
    if kind == "speed":  # at sea motions are stated in m/s, winches in m/min
        return f"{fmt(value, digits=3)} m/s ({fmt(value, kind, 3)})"
    return fmt(value, kind)


TEXTS: Mapping[str, Any] = tomllib.loads((files("stillhook.plan.report") / "texts.toml").read_text(encoding="utf-8"))
"""Fixed texts of a plan's report by name."""
