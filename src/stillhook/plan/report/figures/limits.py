"""Figures of the limits: what is workable in every cell and what governs there, and height over period for all
alternatives.

The heading rosette: limiting wave height against where the waves come from, seen from above with the bow upwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.detail import detail_figures, weather_figures
from stillhook.plan.report.figures.sweep import sweep
from stillhook.plan.report.words import (
    COLOUR,
    CREDITED,
    MARKER,
    THICK,
    TWIN,
    WIDTH,
    canvas,
    differs,
    height,
    highest_shown,
    key_below,
    named,
    names,
    phase_code,
    rule_code,
)
from stillhook.plan.result import Credit, PlanResult, grouped
from stillhook.report.formatting import direction
from stillhook.report.pictures import pngs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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
    """A panel for some of the periods; a line for each alternative, as credited. Headings that were not analysed are
    left blank."""
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


RESOLUTION = 150
"""Of pictures [dots per inch]."""
ROWS = 21
"""Rows of cells in one picture at most; more alternatives go to a second one."""
ROW, PANEL, FRAME = 0.33, 0.42, 0.8
"""Height of a row of cells, of the margins of each strip, and of the margins of the picture [inch]."""
COLOURS, NOTHING, UNTOLD, DARK = "YlGnBu", "#E8A598", "#E0E0E0", 0.62
"""Scale of limits; colour of a cell with the limit 0, and of an undetermined one; part of the scale from which letters
are white."""
PANELS = 3
"""Headings side by side at most."""
CLOSED = "closed-form"


def pictures(result: PlanResult) -> dict[str, bytes]:
    """Every figure as PNG, by file stem: the same bytes whatever the settings of matplotlib here."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        return pngs(figures(result), RESOLUTION)


def figures(result: PlanResult) -> dict[str, Figure]:
    """Every figure of a plan by file stem, in the order in which a report shows them."""
    result_figures: dict[str, Figure] = {"limits-over-period": curves(result)}
    result_figures |= limit_tables(result, CREDITED)
    result_figures |= limit_tables(result, TWIN)
    result_figures["rosette"] = rosette(result)
    swept = {"sweep": sweep(result["sweep"])} if "sweep" in result else {}
    return result_figures | weather_figures(result) | detail_figures(result) | swept


def limit_tables(result: PlanResult, credit: Credit) -> dict[str, Figure]:
    """Limits by heading and period with the phase and the rule that govern; by the twin only of those that credit takes
    something from."""
    wanted = names(result.data)
    if credit == TWIN:
        wanted = [name for name in wanted if differs(result, name)]
    strips, each = equal_tables(result, credit, wanted), max(1, ROWS // result.data.sizes["heading"])
    parts = [strips[i : i + each] for i in range(0, len(strips), each)]
    return {
        f"limits-{credit}{f'-{i + 1}' if len(parts) > 1 else ''}": limit_table(result, credit, part)
        for i, part in enumerate(parts)
    }


def equal_tables(result: PlanResult, credit: Credit, alternatives: Sequence[str]) -> list[list[str]]:
    """Alternatives whose tables are the same, limit by limit and by what governs, side by side."""

    def content(name: str) -> bytes:
        cells = result.data.sel(credit=credit, alternative=name)
        texts = [cells[key].values.astype("<U200").tobytes() for key in ("governing_phase", "governing_rule")]
        return b"".join([np.round(cells["Hs_limit"].values, 2).tobytes(), *texts])

    return list(grouped((content(name), name) for name in alternatives).values())


def limit_table(result: PlanResult, credit: Credit, strips: Sequence[Sequence[str]]) -> Figure:
    """A strip of cells for alternatives that are alike: rows are headings, columns periods; in each the limit, below it
    what governs."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    data = result.data
    rows = data.sizes["heading"]
    figure = Figure(figsize=(WIDTH, FRAME + len(strips) * (PANEL + ROW * rows)), layout="constrained")
    axes = figure.subplots(len(strips), 1, squeeze=False)[:, 0]
    for ax, labels in zip(axes, strips, strict=True):
        _strip(ax, result, credit, labels[0])
        ax.set_title(", ".join(named(name) for name in labels), fontsize="small", loc="left", pad=3)
    axes[-1].set_xlabel("peak period Tp [s]", fontsize="small")
    label = "credited" if credit == CREDITED else "simulated (not creditable)"
    figure.suptitle(f"Limiting significant wave height Hs [m], {label}", fontsize="medium")
    return figure


def _strip(ax: Axes, result: PlanResult, credit: Credit, name: str) -> None:
    cells = result.data.sel(credit=credit, alternative=name)
    highest, phases, rules = (
        float(result.data.attrs["Hs_highest"]),
        cells["governing_phase"].values,
        cells["governing_rule"].values,
    )
    Hs = np.asarray(cells["Hs_limit"].values, dtype=float)
    part = np.clip(np.nan_to_num(Hs, nan=0.0, posinf=highest) / highest_shown(result), 0.0, 1.0)
    edges = [np.arange(n + 1) - 0.5 for n in (Hs.shape[1], Hs.shape[0])]
    ax.pcolormesh(*edges, _colours(Hs, part), edgecolors="white", linewidth=0.8)
    style: dict[str, Any] = {"ha": "center", "va": "center", "in_layout": False}
    small = "xx-small" if Hs.shape[1] > 14 else "x-small"
    for i, k in np.ndindex(Hs.shape):
        ink = "white" if part[i, k] > DARK else "black"
        governs = _codes(result, str(phases[i, k]), str(rules[i, k]))
        ax.text(
            k, i - (0.18 if governs else 0.0), height(float(Hs[i, k]), highest), fontsize="small", color=ink, **style
        )
        if governs:
            ax.text(k, i + 0.25, governs, fontsize=small, color=ink, **style)
    ax.set_xlim(-0.5, Hs.shape[1] - 0.5)
    ax.set_ylim(Hs.shape[0] - 0.5, -0.5)
    ax.set_xticks(range(Hs.shape[1]), [f"{T:g}" for T in result.data["period"].values], fontsize="small")
    ax.set_yticks(range(Hs.shape[0]), [direction(b) for b in result.data["heading"].values], fontsize="small")
    ax.tick_params(length=0)


def _colours(Hs: FloatArray, part: FloatArray) -> FloatArray:
    """Colours of cells (heading, period, 4)."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgba

    colours = colormaps[COLOURS](0.85 * part)
    colours[np.isnan(Hs)] = to_rgba(UNTOLD)
    colours[Hs <= 0.0] = to_rgba(NOTHING)
    return np.asarray(colours)


def _codes(result: PlanResult, phase: str, rule: str) -> str:
    return f"{phase_code(result, phase)} {rule_code(result, rule)}" if phase and rule else ""


def closed_form(result: PlanResult) -> FloatArray:
    """Least limit over phases and rules by the closed form alone (alternative, heading, period) [m]; NaN where none
    is determined."""
    Hs = np.asarray(result.data["Hs_rule"].sel(credit=TWIN, tier=CLOSED).values, dtype=float)
    flat = np.moveaxis(Hs, (1, 2), (0, 1)).reshape(-1, *Hs.shape[:1], *Hs.shape[3:])
    least = np.where(np.isnan(flat), np.inf, flat).min(axis=0)
    return np.asarray(np.where(np.isnan(flat).all(axis=0), np.nan, least))


def telling(result: PlanResult) -> list[int]:
    """Headings that are drawn side by side: all of a few; of many the one with the least limits in the mean, the one
    with the largest, and that nearest to a head sea."""
    beta = result.data["heading"].values
    if len(beta) <= PANELS:
        return list(range(len(beta)))
    top = float(result.data.attrs["Hs_highest"])
    mean = np.nan_to_num(result.data["Hs_limit"].sel(credit=CREDITED).values, nan=0.0, posinf=top).mean(axis=(0, 2))
    return sorted({int(mean.argmin()), int(mean.argmax()), int(np.abs(beta - np.pi).argmin())})


def curves(result: PlanResult) -> Figure:
    """Limiting height over peak period, a panel a heading, all alternatives: credited drawn out, by the twin dashed,
    closed form dotted."""
    data, highest = result.data, float(result.data.attrs["Hs_highest"])
    chosen = telling(result)
    figure, axes = canvas(1, len(chosen), 4.1, sharey=True)
    T, closed = data["period"].values, closed_form(result)
    for ax, i in zip(axes[0], chosen, strict=True):
        for a, name in enumerate(names(data)):
            cells = data["Hs_limit"].sel(alternative=name).isel(heading=i)
            credited, twin = (np.minimum(cells.sel(credit=c).values, highest) for c in (CREDITED, TWIN))
            style = {"color": COLOUR[name], "lw": THICK[name]}
            ax.plot(T, credited, marker=MARKER[name], ms=3.5, label=named(name), **style)
            if differs(result, name):
                ax.plot(T, twin, ls="--", **style)
            if name in ("none", "cap-80"):
                ax.plot(T, np.minimum(closed[a, i], highest), ls=":", **style)
        ax.set_title(f"waves at {direction(data['heading'].values[i])}", fontsize="small")
        ax.set_xlabel("peak period Tp [s]", fontsize="small")
        ax.axhline(highest, color="#777777", lw=0.8)
    first = axes[0, 0]
    first.set_ylim(0.0, 1.04 * highest_shown(result))
    first.set_ylabel("limiting significant wave height Hs [m]", fontsize="small")
    first.plot([], [], color="#777777", ls="--", label="twin, before credit")
    first.plot([], [], color="#777777", ls=":", label="closed form alone")
    key_below(figure, [first], 4)
    most = f"analysed up to {highest:g} m"
    figure.suptitle(f"Limits over period by alternative (full lines: credited; {most})", fontsize="medium")
    return figure
