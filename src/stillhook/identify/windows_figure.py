"""Pictures of steady stretches over a log, and of a friction curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.identify.steady_state.search import effort_of, kind_of, signal_of
from stillhook.identify.steady_state.steps import Rejected, Steady, Window
from stillhook.report.plots.run import COLOURS, GREY
from stillhook.units import KINDS, in_display

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stillhook.identify.curve import FrictionCurve
    from stillhook.logs.log import Log


USED, ALONE = ("#009E73", 0.3, "steady, used"), ("#56B4E9", 0.35, "steady, no partner")
EXCLUDED, NOT_USED = ("#E69F00", 0.25, "start left out"), ("#999999", 0.35, "rejected")
"""Colour, opacity and label of the stretches."""
MOST_POINTS = 6000
"""Points of a drawn line: more are not seen, and make the picture slow."""
WORDS_FROM = 0.012
"""Part of the log from which on a rejected stretch is wide enough for its word."""


def window_figure(
    log: Log,
    speed: str,
    effort: str | FloatArray,
    steady: Steady,
    *,
    unpaired: Sequence[Rejected] = (),
    title: str = "",
    kinds: Mapping[str, str] | None = None,
) -> Figure:
    """Speed and effort over time; used stretches green, rejected ones grey with their reason in a word, settling
    orange.

    Parameters: log, speed, effort, kinds as in `steady_windows`; steady its result; unpaired stretches that
    `pair_windows` found no partner for (blue); title of the figure.
    """
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(12.0, 6.5), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    draw_windows(axes, log, speed, effort, steady, unpaired=unpaired, kinds=kinds)
    figure.suptitle(title, fontsize="medium")
    return figure


def draw_windows(
    axes: Sequence[Any],
    log: Log,
    speed: str,
    effort: str | FloatArray,
    steady: Steady,
    *,
    unpaired: Sequence[Rejected] = (),
    kinds: Mapping[str, str] | None = None,
) -> None:
    """The same into two axes that are there: speed above, effort below."""
    name = effort if isinstance(effort, str) else "effort"
    alone = {r.start for r in unpaired}
    used = [w for w in steady.windows if w.start not in alone]
    for ax, label, values, kind in (
        (axes[0], speed, signal_of(log, speed), kind_of(log, speed, kinds)),
        (axes[1], name, effort_of(log, effort), kind_of(log, effort, kinds)),
    ):
        t, x = _thinned(log.t, displayed(values, kind))
        ax.plot(t, x, color=COLOURS[0], lw=0.8)
        ax.set_ylabel(labelled(label, kind))
        ax.grid(alpha=0.3)
        _shade(ax, steady, used, unpaired)
    _words(axes[0], steady.rejected, float(log.t[-1] - log.t[0]))
    axes[1].set_xlabel("time [s]")
    axes[1].set_xlim(float(log.t[0]), float(log.t[-1]))
    _legend(axes[0], with_unpaired=bool(unpaired))


def curve_figure(curve: FrictionCurve, log: Log, effort: str | FloatArray, *, title: str = "") -> Figure:
    """Speed and effort over time with the stretches that were used, and friction over speed with 95 % intervals."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 10.5), layout="constrained")
    grid = figure.add_gridspec(3, 1, height_ratios=(1.0, 1.0, 1.4))
    above = figure.add_subplot(grid[0])
    below = figure.add_subplot(grid[1], sharex=above)
    draw_windows((above, below), log, curve.speed, effort, curve.steady, unpaired=curve.unpaired, kinds=curve.kinds)
    draw_curve(figure.add_subplot(grid[2]), curve)
    figure.suptitle(title or curve.source, fontsize="medium")
    return figure


def draw_curve(
    ax: Any, curve: FrictionCurve, *, label: str = "half the difference of both directions", colour: str = COLOURS[0]
) -> None:
    """Friction over speed with 95 % intervals into axes that are there."""
    kind_v, kind_e = curve.kinds.get("speed", ""), curve.kinds.get("effort", "")
    v = displayed(np.array([p.speed for p in curve.points]), kind_v)
    F = displayed(np.array([p.friction for p in curve.points]), kind_e)
    half = displayed(np.array([p.estimate.half for p in curve.points]), kind_e)
    ax.errorbar(v, F, yerr=half, fmt="o-", color=colour, lw=1.0, ms=4.0, capsize=3.0, label=f"{label}, 95 %")
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=min(0.0, float(np.min(F - half))))
    ax.set_xlabel(labelled("speed", kind_v))
    ax.set_ylabel(labelled("friction", kind_e))
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")


def labelled(name: str, kind: str) -> str:
    return f"{name} [{KINDS[kind].display}]" if kind in KINDS else f"{name} [SI]"


def displayed(values: FloatArray, kind: str) -> FloatArray:
    """SI values in the unit that their kind prints in."""
    if kind not in KINDS:
        return values
    zero = in_display(0.0, kind)
    return np.asarray(values * (in_display(1.0, kind) - zero) + zero, dtype=float)


def _thinned(t: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest value of equal stretches, so that a long log keeps its spikes."""
    size = 2 * len(t) // MOST_POINTS
    if size < 2:
        return t, x
    n = len(t) // size * size
    y = x[:n].reshape(-1, size)
    y = np.where(np.all(np.isnan(y), axis=1, keepdims=True), 0.0, y)
    both = np.stack([np.nanmin(y, axis=1), np.nanmax(y, axis=1)], axis=1).ravel()
    return np.repeat(t[:n].reshape(-1, size).mean(axis=1), 2), both


def _shade(ax: Any, steady: Steady, used: Sequence[Window], unpaired: Sequence[Rejected]) -> None:
    from matplotlib.collections import PolyCollection  # one for all of a kind: hundreds of spans take seconds

    groups: tuple[Sequence[Window | Rejected], ...] = (steady.rejected, steady.trimmed, unpaired, used)
    for parts, (colour, alpha, _) in zip(groups, (NOT_USED, EXCLUDED, ALONE, USED), strict=True):
        boxes = [((p.start, 0.0), (p.start, 1.0), (p.end, 1.0), (p.end, 0.0)) for p in parts]
        spans = PolyCollection(boxes, transform=ax.get_xaxis_transform(), color=colour, alpha=alpha, lw=0)
        ax.add_collection(spans, autolim=False)


def _words(ax: Any, rejected: Sequence[Rejected], length: float) -> None:
    for r in rejected:
        if r.end - r.start > WORDS_FROM * length:
            place = {"transform": ax.get_xaxis_transform(), "rotation": 90, "ha": "center", "va": "bottom"}
            ax.text(0.5 * (r.start + r.end), 0.02, r.code, fontsize="x-small", color=GREY, **place)


def _legend(ax: Any, *, with_unpaired: bool) -> None:
    from matplotlib.patches import Patch

    shown = (USED, ALONE, EXCLUDED, NOT_USED) if with_unpaired else (USED, EXCLUDED, NOT_USED)
    handles = [Patch(color=colour, alpha=alpha, label=label) for colour, alpha, label in shown]
    ax.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize="small", frameon=False)
