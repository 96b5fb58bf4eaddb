"""Figures of a motor's torque loss, as paper A draws them (figures 3 to 9) and as the thesis compares model and map
(figure 2.11)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.identify.motor.fit import CARDS, LossFit, LossModel, fit_loss
from stillhook.identify.motor.identify import MotorLoss
from stillhook.identify.motor.map import AXES, LossMap, MappedLoss, blocks, levels, mapped_loss
from stillhook.identify.motor.rank import residual_share
from stillhook.report.kit import axis, bars, display, legend, panels
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import from_display, parse, show

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


TERM_MODELS = (LossModel.MJ4, LossModel.MJ5, LossModel.MJ6)
TERM_POINT = ("200 bar", 250.0 / 280.0)
"""Paper A figures 6 and 7: 200 bar, 250 of 280 cm^3/rev."""
TERM_SPEEDS = (300.0, 2500.0, 10.0)
"""Paper A eq. 20: from, to, step [rev/min]; inside the map only."""
SHOWN_PRESSURES = (100.0, 200.0, 300.0)
"""Paper A figures 8 and 9 [bar]; the nearest levels of the map are drawn."""
TERMS = {
    "X_1": "viscous",
    "C_g": "viscous",
    "X_2": "turbulent",
    "C_i": "turbulent",
    "X_3": "pressure",
    "C_f": "pressure",
    "X_4": "constant",
    "C_e": "constant",
    "X_5": "high pressure",
    "C_m": "high pressure",
    "C_k": "notches",
}
BEYOND = 1.25
"""How far past the map's last speed the model is drawn, dashed."""
SPEED = "motor speed [rev/min]"
MOST_BINS = 24
MOST_SHOWN = 8
HALF = 0.5 * (1.0 - 1e-6)
"""Paper A's "approximately 50 % of maximum displacement", with room for a unit's last digit."""


def figures(result: MotorLoss) -> Mapping[str, Figure]:
    """All figures by file stem, in the order in which a report shows them."""
    return {
        "ranking": ranking(result),
        "terms": term_shares(result),
        "terms-over-speed": terms_over_speed(result),
        "residuals-over-speed": residuals_over_speed(result),
        "residuals-over-map": residuals_over_map(result),
        "model-and-map": model_and_map(result),
    }


def _panels(
    result: MotorLoss, rows: int, columns: int, size: tuple[float, float], title: str, **more: Any
) -> tuple[Figure, NDArray[Any]]:
    warning = "SYNTHETIC MAP, measured on no motor\n" if result.map.synthetic else ""
    return panels(rows, columns, size, f"{warning}{title}", **more)


def ranking(result: MotorLoss) -> Figure:
    """Error of all models: at full displacement, on the complete map, the new ones enlarged (paper A figures 3, 4, 5),
    and on levels that the fit has not seen."""
    title = "Sum of squared errors over sum of squared torque losses (as paper A figures 3 to 5)"
    figure, axes = _panels(result, 2, 2, (11.0, 8.0), title, grid="y")
    by_age = sorted(result.ranking.ranked, key=lambda r: list(LossModel).index(r.model))
    fixed = {r.model: r.fixed.normalised for r in by_age if r.fixed is not None}
    variable = {r.model: r.fit.normalised for r in by_age}
    new = {model: error for model, error in variable.items() if model.value.startswith("mj")}
    left_out = {r.model: 100.0 * r.cv for r in [r for r in result.ranking.ranked if r.eligible][:MOST_SHOWN]}
    parts = (
        (f"fixed displacement {show(float(result.map.full().D_m.max()), 'displacement')}", fixed, "log"),
        ("variable displacement, all models", variable, "log"),
        ("variable displacement, new models", new, "linear"),
        ("levels left out: error [% of mean nominal torque]", left_out, "linear"),
    )
    for ax, (words, errors, scale) in zip(axes.flat, parts, strict=True):
        colours = [COLOURS[1] if model is result.ranking.recommended else COLOURS[0] for model in errors]
        bars(ax, range(len(errors)), list(errors.values()), width=0.8, color=colours)
        names = [f"{CARDS[model].title} ({len(CARDS[model].names)})" for model in errors]
        ax.set_xticks(range(len(errors)), names, rotation=55, ha="right", fontsize="small")
        ax.set_yscale(scale)
        axis(ax, title=words)
        ax.plot([], [], "s", color=COLOURS[1], label="recommended")
        legend(ax)
    return figure


def _term_point(result: MotorLoss) -> tuple[FloatArray, float, float]:
    """Speeds inside the map, displacement and pressure of paper A's look at the terms."""
    (lo, hi), (_, dp_most) = (result.map.range()[name] for name in ("omega_m", "dp_m"))
    start, stop, step = TERM_SPEEDS
    omega = np.append(np.arange(start, stop, step), stop) * from_display(1.0, "rotation")
    omega = omega[(omega >= lo * 0.999) & (omega <= hi * 1.001)]
    if len(omega) < 2:
        omega = np.linspace(lo, hi, 50)
    return omega, TERM_POINT[1] * result.map.D_max, min(parse(TERM_POINT[0], "pressure"), dp_most)


def term_shares(result: MotorLoss) -> Figure:
    """Share of each term in the loss summed over the speeds, MJ4 to MJ6 (paper A figure 6, eq. 20).

    Differs from print: eq. 20's indices count terms and speeds alike; read as the sum of one term over the speeds over
    that of all terms.
    """
    omega, D, dp = _term_point(result)
    slow, fast = display(omega[[0, -1]], "rotation")
    at = f"{show(dp, 'pressure', 3)}, {show(D, 'displacement', 3)}, {slow:.0f} to {fast:.0f} rev/min"
    title = f"Share of each term in the summed loss at {at} (as paper A figure 6)"
    figure, axes = _panels(result, 1, 1, (9.0, 4.8), title, grid="y")
    ax, names, fits = axes[0, 0], list(dict.fromkeys(TERMS.values())), {r.model: r.fit for r in result.ranking.ranked}
    for i, model in enumerate(TERM_MODELS):
        fit = fits.get(model) or fit_loss(result.map, model)
        terms = fit.terms(omega, np.full_like(omega, D), np.full_like(omega, dp))
        total = sum(float(t.sum()) for t in terms.values())
        share = {TERMS[n]: 100.0 * float(t.sum()) / total for n, t in terms.items()}
        label = fit.card.title + (f", C_n = {fit['C_n']:.2f}" if "C_n" in fit.names else "")
        places, heights = np.arange(len(names)) + 0.27 * (i - 1), [share.get(n, 0.0) for n in names]
        bars(ax, places, heights, width=0.25, color=COLOURS[i], label=label)
    ax.set_xticks(range(len(names)), names)
    axis(ax, y="share of the summed loss [%]")
    legend(ax)
    return figure


def terms_over_speed(result: MotorLoss) -> Figure:
    """What each term of MJ4 adds over the speed (paper A figure 7)."""
    omega, D, dp = _term_point(result)
    title = f"Terms of MJ4 at {show(dp, 'pressure', 3)}, {show(D, 'displacement', 3)} (as paper A figure 7)"
    figure, axes = _panels(result, 1, 1, (9.0, 4.8), title)
    ax, speed = axes[0, 0], display(omega, "rotation")
    terms = result.mj4.terms(omega, np.full_like(omega, D), np.full_like(omega, dp))
    for colour, (name, term) in zip(COLOURS, terms.items(), strict=False):
        ax.plot(speed, term, color=colour, label=f"{name}, {TERMS[name]}")
    ax.plot(speed, sum(terms.values()), color="black", lw=2.0, label="sum")
    axis(ax, SPEED, "torque loss [N m]", zero="y")
    legend(ax)
    return figure


def residuals_over_speed(result: MotorLoss) -> Figure:
    """Map less model over the nominal torque, over speed, a curve a displacement: large ones above, small ones below
    (figures 8, 9)."""
    m, share, chosen = result.map, 100.0 * residual_share(result.map, result.fit), _shown(result.map)
    title = f"{result.fit.card.title}: map less model in % of nominal torque (as paper A figures 8 and 9)"
    figure, axes = _panels(result, 2, len(chosen), (12.0, 7.5), title, sharex=True)
    label, limit = levels(m.D_m), 100.0 * result.threshold
    large = [i for i in range(int(label.max()) + 1) if m.D_m[label == i].mean() >= HALF * m.D_max]
    small = [i for i in range(int(label.max()) + 1) if i not in large]
    rows = (("half displacement and more", large), ("below half", small))
    for column, (pressure, cells) in enumerate(chosen):
        for ax, (words, row_levels) in zip(axes[:, column], rows, strict=True):
            for colour, i in zip(COLOURS * 4, row_levels, strict=False):
                at = np.flatnonzero(cells & (label == i))
                at = at[np.argsort(m.omega_m[at])]
                if len(at):
                    name, speed = show(float(m.D_m[at].mean()), "displacement", 3), display(m.omega_m[at], "rotation")
                    ax.plot(speed, share[at], color=colour, lw=1.1, marker=".", ms=4, label=name)
            ax.axhspan(-limit, limit, color=GREY, alpha=0.12)
            axis(ax, title=f"{show(pressure, 'pressure', 3)}, {words}", size="small")
            legend(ax, ncols=2, fontsize="x-small")
        axis(axes[1, column], SPEED)
    for ax in axes[:, 0]:
        axis(ax, y="error [% of nominal torque]")
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
    share = 100.0 * np.abs(residual_share(result.map, result.fit))
    title = f"{result.fit.card.title}: largest error in % of nominal torque; crosses: beyond {result.threshold:.1%}"
    figure, axes = _panels(result, 1, 2, (12.0, 4.8), title, grid="")
    for ax, across in zip(axes[0], (("omega_m", SPEED), ("dp_m", "pressure drop [bar]")), strict=True):
        _heat(figure, ax, result.map, share, across, 100.0 * result.threshold)
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
    y = display([m.D_m[i == a].mean() for a in range(table.shape[0])], "displacement")
    x = display([m.axis(name)[j == b].mean() for b in range(table.shape[1])], AXES[name])
    norm = LogNorm(0.1 * limit, max(10.0 * limit, float(np.nanmax(table))))
    picture = ax.imshow(np.maximum(table, 0.1 * limit), origin="lower", aspect="auto", cmap="viridis", norm=norm)
    bad = np.argwhere(table > limit)
    ax.plot(bad[:, 1], bad[:, 0], "x", color="#D00000", ms=5)
    ax.set_yticks(range(len(y)), [f"{v:.0f}" for v in y])
    step = max(1, len(x) // 8)
    ax.set_xticks(range(0, len(x), step), [f"{v:.0f}" for v in x[::step]])
    axis(ax, heading, "displacement [cm^3/rev]")
    figure.colorbar(picture, ax=ax, label="largest error [%]")


def model_and_map(result: MotorLoss) -> Figure:
    """Torque loss over speed, the map's cells against the model (figure 2.11; paper D figure 3). Shaded: beyond the
    map, where the model is extrapolated (dashed) and the interpolated map is held at its edge (dotted)."""
    m, fit, chosen, law = result.map, result.fit, _shown(result.map), mapped_loss(result.map)
    title = f"{fit.card.title} (lines) and map (points); shaded: beyond the map (as figure 2.11)"
    figure, axes = _panels(result, 1, len(chosen), (12.0, 4.8), title, sharey=True)
    label = levels(m.D_m)
    picked = list(dict.fromkeys(np.linspace(0, int(label.max()), 4).round().astype(int).tolist()))
    lo, hi = m.range()["omega_m"]
    least, most, beyond = display([lo, hi, BEYOND * hi], "rotation")
    for ax, (pressure, cells) in zip(axes[0], chosen, strict=True):
        for colour, i in zip(COLOURS, picked, strict=False):
            at = cells & (label == i)
            if at.any():
                _curves(ax, m, fit, law, at, (lo, hi), colour)
        for ends in ((most, beyond), (0.0, least)):
            ax.axvspan(*ends, color=GREY, alpha=0.15)
        axis(ax, SPEED, title=show(pressure, "pressure", 3), size="small")
        ax.set_xlim(0.0, beyond)
    axis(axes[0, 0], y="torque loss [N m]", zero="y")
    legend(axes[0, 0], fontsize="x-small")
    return figure


def _curves(
    ax: Axes,
    m: LossMap,
    fit: LossFit,
    law: MappedLoss,
    at: NDArray[np.bool_],
    ends: tuple[float, float],
    colour: str,
) -> None:
    """One displacement at one pressure: cells, model, and what is beyond the map."""
    D, dp = float(m.D_m[at].mean()), float(m.dp_m[at].mean())
    ax.plot(display(m.omega_m[at], "rotation"), m.T_f[at], ".", color=colour, ms=4)
    inside, label = np.linspace(*ends, 200), show(D, "displacement", 3)

    def modelled(omega: FloatArray) -> FloatArray:
        return np.broadcast_to(fit.torque(omega, D, dp), omega.shape)

    ax.plot(display(inside, "rotation"), modelled(inside), color=colour, lw=1.2, label=label)
    for omega in (np.linspace(0.1 * ends[0], ends[0], 50), np.linspace(ends[1], BEYOND * ends[1], 50)):
        speed = display(omega, "rotation")
        ax.plot(speed, modelled(omega), color=colour, lw=1.0, ls="--")
        ax.plot(speed, law(omega, D, dp)[0], color=colour, lw=1.0, ls=":")
