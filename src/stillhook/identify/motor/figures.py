"""Figures of a motor's torque loss, as paper A draws them (figures 7 to 9) and as the thesis compares model and map
(figure 2.11)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.identify.motor.fit import LossFit
from stillhook.identify.motor.identify import MotorLoss
from stillhook.identify.motor.map import AXES, LossMap, blocks, levels
from stillhook.identify.motor.rank import residual_share
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import from_display, in_display, parse, show

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


TERM_POINT = ("200 bar", 250.0 / 280.0)
"""Paper A figure 7: 200 bar, 250 of 280 cm^3/rev."""
SHOWN_PRESSURES = (100.0, 200.0, 300.0)
"""Paper A figures 8 and 9 [bar]; the nearest levels of the map are drawn."""
TERMS = {"X_1": "viscous", "X_2": "turbulent", "X_3": "pressure", "X_4": "constant", "X_5": "high pressure"}
BEYOND = 1.25
"""How far past the map's last speed the model is drawn, dashed."""
SPEED = "motor speed [rev/min]"
WARNING = "#8a4b00"
MOST_BINS = 24
HALF = 0.5 * (1.0 - 1e-6)
"""Paper A's "approximately 50 % of maximum displacement", with room for a unit's last digit."""


def figures(result: MotorLoss) -> Mapping[str, Figure]:
    """All figures by file stem, in the order in which a report shows them."""
    return {
        "terms-over-speed": terms_over_speed(result),
        "residuals-over-speed": residuals_over_speed(result),
        "residuals-over-map": residuals_over_map(result),
        "model-and-map": model_and_map(result),
    }


def _figure(result: MotorLoss, title: str, size: tuple[float, float]) -> Figure:
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=size, layout="constrained")
    warning = "SYNTHETIC MAP, measured on no motor\n" if result.map.synthetic else ""
    figure.suptitle(f"{warning}{title}", fontsize="medium", color=WARNING if warning else "black")
    return figure


def terms_over_speed(result: MotorLoss) -> Figure:
    """What each term of MJ4 adds over the speeds of the map (paper A figure 7)."""
    ends = result.map.range()
    omega, D = np.linspace(*ends["omega_m"], 200), TERM_POINT[1] * result.map.D_max
    dp = min(parse(TERM_POINT[0], "pressure"), ends["dp_m"][1])
    title = f"Terms of MJ4 at {show(dp, 'pressure', 3)}, {show(D, 'displacement', 3)} (as paper A figure 7)"
    figure = _figure(result, title, (9.0, 4.8))
    ax = figure.subplots()
    terms = result.mj4.terms(omega, np.full_like(omega, D), np.full_like(omega, dp))
    for colour, (name, term) in zip(COLOURS, terms.items(), strict=False):
        ax.plot(_rpm(omega), term, color=colour, label=f"{name}, {TERMS[name]}")
    ax.plot(_rpm(omega), sum(terms.values()), color="black", lw=2.0, label="sum")
    ax.set_xlabel(SPEED)
    ax.set_ylabel("torque loss [N m]")
    ax.set_ylim(bottom=0.0)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False, fontsize="small")
    return figure


def residuals_over_speed(result: MotorLoss) -> Figure:
    """Map less model over the nominal torque, over speed, a curve a displacement: large ones above, small ones below
    (figures 8, 9)."""
    m, share = result.map, 100.0 * residual_share(result.map, result.fit)
    title = f"{result.fit.card.title}: map less model in % of nominal torque (as paper A figures 8 and 9)"
    figure = _figure(result, title, (12.0, 7.5))
    chosen = _shown(m)
    axes = figure.subplots(2, len(chosen), sharex=True, squeeze=False)
    label = levels(m.D_m)
    large = [i for i in range(int(label.max()) + 1) if m.D_m[label == i].mean() >= HALF * m.D_max]
    small = [i for i in range(int(label.max()) + 1) if i not in large]
    rows = (("half displacement and more", large), ("below half", small))
    for column, (pressure, cells) in enumerate(chosen):
        for ax, (words, row_levels) in zip(axes[:, column], rows, strict=True):
            for colour, i in zip(COLOURS * 4, row_levels, strict=False):
                at = np.flatnonzero(cells & (label == i))
                at = at[np.argsort(m.omega_m[at])]
                if len(at):
                    name = show(float(m.D_m[at].mean()), "displacement", 3)
                    ax.plot(_rpm(m.omega_m[at]), share[at], color=colour, lw=1.1, marker=".", ms=4, label=name)
            limit = 100.0 * result.threshold
            ax.axhspan(-limit, limit, color=GREY, alpha=0.12)
            ax.set_title(f"{show(pressure, 'pressure', 3)}, {words}", fontsize="small")
            ax.grid(alpha=0.3)
            if ax.get_lines():
                ax.legend(fontsize="x-small", frameon=False, ncols=2)
        axes[1, column].set_xlabel(SPEED)
    for ax in axes[:, 0]:
        ax.set_ylabel("error [% of nominal torque]")
    return figure


def _shown(m: LossMap) -> list[tuple[float, NDArray[np.bool_]]]:
    """Pressure levels nearest to those of paper A, and their cells; each once."""
    label = levels(m.dp_m)
    means = np.array([m.dp_m[label == i].mean() for i in range(int(label.max()) + 1)])
    nearest = [int(np.argmin(np.abs(means - from_display(p, "pressure")))) for p in SHOWN_PRESSURES]
    return [(float(means[i]), label == i) for i in dict.fromkeys(nearest)]


def residuals_over_map(result: MotorLoss) -> Figure:
    """Largest error over displacement and speed, and over displacement and pressure, in % of nominal torque; crosses
    beyond the limit."""
    m, share = result.map, 100.0 * np.abs(residual_share(result.map, result.fit))
    title = f"{result.fit.card.title}: largest error in % of nominal torque; crosses: beyond {result.threshold:.1%}"
    figure = _figure(result, title, (12.0, 4.8))
    left, right = figure.subplots(1, 2)
    _heat(figure, left, m, share, ("omega_m", SPEED), 100.0 * result.threshold)
    _heat(figure, right, m, share, ("dp_m", "pressure drop [bar]"), 100.0 * result.threshold)
    return figure


def _heat(figure: Figure, ax: Axes, m: LossMap, share: FloatArray, across: tuple[str, str], limit: float) -> None:
    """The largest error in each box of displacement and one other setting; crosses where it is beyond the limit."""
    from matplotlib.colors import LogNorm

    name, heading = across
    i, j = blocks(m.D_m, MOST_BINS), blocks(m.axis(name), MOST_BINS)
    table = np.full((int(i.max()) + 1, int(j.max()) + 1), np.nan)
    for a, b, s in zip(i, j, share, strict=True):
        if np.isfinite(s):
            table[a, b] = np.fmax(table[a, b], s)
    y = [in_display(float(m.D_m[i == a].mean()), "displacement") for a in range(table.shape[0])]
    x = [in_display(float(m.axis(name)[j == b].mean()), AXES[name]) for b in range(table.shape[1])]
    norm = LogNorm(0.1 * limit, max(10.0 * limit, float(np.nanmax(table))))
    picture = ax.imshow(np.maximum(table, 0.1 * limit), origin="lower", aspect="auto", cmap="viridis", norm=norm)
    bad = np.argwhere(table > limit)
    ax.plot(bad[:, 1], bad[:, 0], "x", color="#D00000", ms=5)
    ax.set_yticks(range(len(y)), [f"{v:.0f}" for v in y])
    step = max(1, len(x) // 8)
    ax.set_xticks(range(0, len(x), step), [f"{v:.0f}" for v in x[::step]])
    ax.set_xlabel(heading)
    ax.set_ylabel("displacement [cm^3/rev]")
    figure.colorbar(picture, ax=ax, label="largest error [%]")


def model_and_map(result: MotorLoss) -> Figure:
    """Torque loss over speed, the map's cells against the model (figure 2.11; paper D figure 3). Shaded: beyond the
    map, where the model is extrapolated (dashed)."""
    m, fit = result.map, result.fit
    figure = _figure(
        result, f"{fit.card.title} (lines) and map (points); shaded: beyond the map (as figure 2.11)", (12.0, 4.8)
    )
    chosen = _shown(m)
    axes = figure.subplots(1, len(chosen), sharey=True, squeeze=False)[0]
    label = levels(m.D_m)
    picked = list(dict.fromkeys(np.linspace(0, int(label.max()), 4).round().astype(int).tolist()))
    lo, hi = m.range()["omega_m"]
    for ax, (pressure, cells) in zip(axes, chosen, strict=True):
        for colour, i in zip(COLOURS, picked, strict=False):
            at = cells & (label == i)
            if at.any():
                _curves(ax, m, fit, at, (lo, hi), colour)
        ax.axvspan(_rpm(hi), _rpm(BEYOND * hi), color=GREY, alpha=0.15)
        ax.axvspan(0.0, _rpm(lo), color=GREY, alpha=0.15)
        ax.set_title(show(pressure, "pressure", 3), fontsize="small")
        ax.set_xlabel(SPEED)
        ax.grid(alpha=0.3)
        ax.set_xlim(0.0, _rpm(BEYOND * hi))
    axes[0].set_ylim(bottom=0.0)
    axes[0].set_ylabel("torque loss [N m]")
    axes[0].legend(frameon=False, fontsize="x-small")
    return figure


def _curves(ax: Axes, m: LossMap, fit: LossFit, at: NDArray[np.bool_], ends: tuple[float, float], colour: str) -> None:
    D, dp = float(m.D_m[at].mean()), float(m.dp_m[at].mean())
    ax.plot(_rpm(m.omega_m[at]), m.T_f[at], ".", color=colour, ms=4)
    inside = np.linspace(*ends, 200)
    inside_T = np.broadcast_to(fit.torque(inside, D, dp), inside.shape)
    ax.plot(_rpm(inside), inside_T, color=colour, lw=1.2, label=show(D, "displacement", 3))
    for piece in (np.linspace(0.1 * ends[0], ends[0], 50), np.linspace(ends[1], BEYOND * ends[1], 50)):
        ax.plot(_rpm(piece), np.broadcast_to(fit.torque(piece, D, dp), piece.shape), color=colour, lw=1.0, ls="--")


def _rpm(omega: Any) -> Any:
    return omega / from_display(1.0, "rotation")
