"""What the figures of a plan share: colours of alternatives, codes of phases and rules, how a limit is written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative
from stillhook.plan.result import CREDITS, PlanResult
from stillhook.report.formatting import direction
from stillhook.report.plots.run import COLOURS
from stillhook.units import number, show

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


WIDTH = 7.5
"""Of every figure [inch]: about that of a page, so that its letters are of one size."""
FIRST = (*ALTERNATIVES, *(alternative for alternative in Alternative if alternative not in ALTERNATIVES))
"""Alternatives in the order in which colours and markers are taken: those of every plan first."""
ORDER_OF_COLOURS = (6, 4, 5, 0, 1, 3, 2, 7)
COLOUR: Mapping[str, str] = {
    name: COLOURS[ORDER_OF_COLOURS[i % len(ORDER_OF_COLOURS)] % len(COLOURS)] for i, name in enumerate(FIRST)
}
MARKER: Mapping[str, str] = {name: "xsv^oDP*"[i % 8] for i, name in enumerate(FIRST)}
THICK: Mapping[str, float] = {name: max(3.2 - 0.45 * i, 0.5) for i, name in enumerate(FIRST)}
"""Widths of lines: the later drawn is the thinner, so that lines that are one on the other are all seen."""
TWIN, CREDITED = CREDITS
SAME = 5e-3
"""Limits that differ by less are shown as one [m]: the second decimal that tables print."""


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
