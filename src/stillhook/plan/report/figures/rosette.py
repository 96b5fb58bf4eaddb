"""The heading rosette: limiting wave height against where the waves come from, seen from above with the bow upwards."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.style import (
    COLOUR,
    CREDITED,
    MARKER,
    THICK,
    WIDTH,
    highest_shown,
    key_below,
    named,
    names,
)
from stillhook.plan.result.result import PlanResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

FULL = 2.0 * np.pi
PERIODS = 4
"""Panels: periods out of the table."""
FULL_CIRCLE = np.radians(200.0)
"""Headings that span less are drawn as a sector [rad]."""
MARGIN = np.radians(12.0)


def from_bow(beta: FloatArray) -> FloatArray:
    """Where waves that travel in beta come from, clockwise from the bow [rad, -pi to pi]: head sea (beta pi) 0, from
    starboard pi/2."""
    return np.asarray((np.pi - beta + np.pi) % FULL - np.pi)


def rosette(result: PlanResult) -> Figure:
    """A panel for some of the periods; a line for each alternative, as credited. Headings that were not asked are left
    blank."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    data = result.data
    chosen = _periods(data.sizes["period"])
    come = from_bow(data["heading"].values)
    order = np.argsort(come)
    sector = bool(np.ptp(come) < FULL_CIRCLE)
    across = len(chosen) if sector or len(chosen) < 3 else 2
    figure = Figure(figsize=(WIDTH, 3.1 if sector else 0.8 + 3.4 * -(-len(chosen) // across)), layout="constrained")
    axes = figure.subplots(-(-len(chosen) // across), across, subplot_kw={"projection": "polar"}, squeeze=False).ravel()
    for ax in axes[len(chosen) :]:
        ax.set_visible(False)
    for ax, k in zip(axes, chosen, strict=False):
        _panel(ax, result, k, come[order], order)
    key_below(figure, list(axes))
    figure.suptitle(
        "Limiting Hs [m] by where the waves come from (bow at 0°, starboard positive), credited", fontsize="medium"
    )
    return figure


def _periods(n: int) -> list[int]:
    """Periods of the panels: inner ones, evenly spread."""
    inner = np.linspace(0, n - 1, min(n, PERIODS) + 2)[1:-1] if n > PERIODS else np.arange(n)
    return sorted({round(float(i)) for i in inner})


def _panel(ax: PolarAxes, result: PlanResult, k: int, come: FloatArray, order: NDArray[np.intp]) -> None:
    data, highest = result.data, float(result.data.attrs["Hs_highest"])
    round_ship = len(come) > 2 and bool(np.max(np.diff(np.append(come, come[0] + FULL))) < np.radians(50.0))
    for name in names(data):
        Hs = np.minimum(data["Hs_limit"].sel(credit=CREDITED, alternative=name).isel(period=k).values[order], highest)
        theta = np.append(come, come[0] + FULL) if round_ship else come
        radius = np.append(Hs, Hs[0]) if round_ship else Hs
        ax.plot(theta, radius, color=COLOUR[name], marker=MARKER[name], ms=3.5, lw=THICK[name], label=named(name))
    ax.set_theta_zero_location("N")
    ax.set_theta_direction(-1)
    if np.ptp(come) < FULL_CIRCLE:
        low, high = float(come.min() - MARGIN), float(come.max() + MARGIN)
        ax.set_thetamin(np.degrees(low))
        ax.set_thetamax(np.degrees(high))
        ax.set_thetagrids([float(x) for x in np.round(np.degrees(come))])
    top = highest_shown(result)
    ax.set_ylim(0.0, top)
    ax.set_yticks(list(range(1, int(top) + 1)))
    ax.tick_params(labelsize="x-small")
    ax.set_title(f"Tp {data['period'].values[k]:g} s", fontsize="small", pad=4)
