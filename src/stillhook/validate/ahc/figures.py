"""Figures of step 5 in the arrangement of Moslatt 2020 paper F: figure 10, figure 11, figures 12 and 13, and the
spectra."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.validate.ahc.check import AhcStep
from stillhook.validate.ahc.comparison import BAND, Comparison, Spectra, Windows, by_motion
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.figures import MEASURED, SIMULATED, axes_of, legend_below, marked
from stillhook.validate.data_set.records.record import Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 300.0
"""Plotted length over time [s], as in figure 10."""
BIN = 0.25
"""Width of the bins of tip motion [m]."""


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 5 by name; none without a comparison."""
    if not isinstance(step, AhcStep) or not step.comparisons:
        return {}
    parts = [c for c in step.comparisons if len(c.windows.x)]
    out = {"tip-wire-speed-and-error": _over_time(_shown(step.comparisons), campaign)}
    if parts:
        out |= {
            "error-and-efficiency": _against_motion(parts, campaign),
            "deviations": _deviations([c.windows for c in parts], campaign),
        }
    if step.spectra is not None:
        out["spectra"] = _spectra(step.spectra, campaign)
    return out


def _shown(comparisons: Sequence[Comparison]) -> Comparison:
    """The last load case that is long enough to be shown, else the longest: as print shows its load case 4."""
    long = [c for c in comparisons if c.seconds >= 0.8 * SHOWN]
    return long[-1] if long else max(comparisons, key=lambda c: len(c.e_measured))


def _over_time(c: Comparison, campaign: Campaign) -> Figure:
    n = min(len(c.e_measured), round(SHOWN / c.replay.record.step))
    s = c.replay.segment
    title = f"Load case {c.name}: {s.load / 1e3:.0f} t, {s.s_w:.0f} m of wire out, mode {s.mode.value}"
    figure, grid = axes_of(3, 1, (10.0, 8.0), marked(campaign, title), sharex=True)
    axes = grid[:, 0]
    t = c.replay.t[:n] - c.replay.t[0]
    axes[0].plot(t, c.replay.s_tip[:n] - c.replay.s_tip[:n].mean(), color=GREY, lw=1.0)
    v_w = _wire_speed(c)
    axes[1].plot(t, 60.0 * v_w[:n], color=MEASURED, lw=1.2, label="measured")
    axes[1].plot(t, 60.0 * c.simulated["v_w"][:n], color=SIMULATED, lw=1.0, ls="--", label="simulated")
    axes[2].plot(t, 100.0 * c.e_measured[:n], color=MEASURED, lw=1.2, label="measured")
    axes[2].plot(t, 100.0 * c.e_simulated[:n], color=SIMULATED, lw=1.0, ls="--", label="simulated")
    names = ("crane tip [m]\n(up positive)", "wire speed [m/min]\n(hoisting positive)", "control error [cm]")
    for ax, name in zip(axes, names, strict=True):
        ax.set_ylabel(name)
    axes[2].set(xlabel="time [s]", xlim=(0.0, t[-1]))
    figure.align_ylabels(axes)
    legend_below(figure, [axes[2]], 2)
    return figure


def _wire_speed(c: Comparison) -> Any:
    """Measured wire speed: logged, or else the slope of the wire paid out."""
    if c.replay.record.has("v_w"):
        return c.replay.measured("v_w")
    return -np.gradient(c.replay.measured("s_w"), c.replay.record.step)


def _against_motion(parts: Sequence[Comparison], campaign: Campaign) -> Figure:
    figure, grid = axes_of(
        1, 2, (11.0, 5.0), marked(campaign, "Control error and efficiency over moving windows, all load cases")
    )
    axes = grid[0]
    windows = [c.windows for c in parts]
    tip = np.concatenate([w.s_tip_pp for w in windows])
    for colour, label in ((MEASURED, "measured"), (SIMULATED, "simulated")):
        y, eta = (100.0 * np.concatenate([getattr(w, name) for w in windows]) for name in (label, f"eta_{label}"))
        axes[0].plot(tip, y, ".", ms=3, color=colour, alpha=0.5, label=label)
        axes[0].axhline(y.mean(), color=colour, ls=":", lw=1.2, label=f"{label}, average")
        axes[1].plot(tip, eta, ".", ms=3, color=colour, alpha=0.5)
    axes[0].set_ylabel("control error, peak to peak [cm]")
    axes[1].set_ylabel("compensation efficiency [%]")
    axes[0].set_ylim(bottom=0.0)
    for ax in axes:
        ax.set_xlabel("crane tip, peak to peak [m]")
    legend_below(figure, [axes[0]], 4)
    return figure


def _deviations(windows: Sequence[Windows], campaign: Campaign) -> Figure:
    figure, grid = axes_of(
        1, 3, (12.0, 4.6), marked(campaign, "Simulated against measured, all load cases"), width_ratios=(3, 3, 2)
    )
    axes = grid[0]
    tip = np.concatenate([w.s_tip_pp for w in windows])
    middle, error, eta, count = by_motion(windows, BIN)
    dots = (100.0 * np.concatenate([getattr(w, name) for w in windows]) for name in ("eta_deviation", "x"))
    names = ("deviation of the efficiency [percentage points]", "deviation of the control error [cm]")
    for ax, y, mean, name in zip(axes[:2], dots, (100.0 * eta, 100.0 * error), names, strict=True):
        ax.plot(tip, y, ".", ms=3, color=COLOURS[5], label="windows")
        ax.plot(middle, mean, "o-", color="#000000", lw=1.5, ms=4, label=f"average over {BIN:g} m")
        ax.set(ylabel=name, ylim=(0.0, None))
    axes[2].bar(middle, 100.0 * count / count.sum(), width=0.9 * BIN, color=GREY)
    axes[2].set_ylabel("share of the windows [%]")
    for ax in axes:
        ax.set_xlabel("crane tip, peak to peak [m]")
    legend_below(figure, [axes[0]], 2)
    return figure


def _spectra(x: Spectra, campaign: Campaign) -> Figure:
    figure, grid = axes_of(1, 1, (8.0, 4.6), marked(campaign, "Spectra of the control error, all load cases"))
    ax = grid[0, 0]
    band = (x.f > 0.0) & (x.f <= 5.0)
    ax.axvspan(*BAND, color=GREY, alpha=0.12, lw=0, label="wave band")
    ax.loglog(x.f[band], 1e4 * x.measured[band], color=MEASURED, lw=1.4, label="measured")
    ax.loglog(x.f[band], 1e4 * x.simulated[band], color=SIMULATED, lw=1.2, ls="--", label="simulated")
    ax.set(xlabel="frequency [Hz]", ylabel="power density [cm$^2$/Hz]", xlim=(x.f[band][0], x.f[band][-1]))
    legend_below(figure, [ax], 3)
    return figure
