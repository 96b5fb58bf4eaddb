"""Figures of step 5 after Moslatt 2020 paper F: figure 10, figures 11 to 13, and the spectra."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.plots.colours import GREY
from stillhook.validate.ahc.check import AhcEstimates
from stillhook.validate.ahc.comparison import BAND, Comparison, Spectra
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.plots import FITTED, MEASURED, OTHER, SIMULATED, cloud, crane, finish, panels, twin
from stillhook.validate.data_set.records.record import Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 300.0
"""Plotted length over time [s], as in figure 10."""
BIN = 0.25
"""Width of the bins of tip motion [m]."""


def figures(estimates: AhcEstimates, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 5 by name."""
    out = {"tip-wire-speed-and-error": _over_time(_shown(estimates.comparisons), campaign)}
    if any(len(c.windows.x) for c in estimates.comparisons):
        out["windows"] = _windows(estimates.comparisons, campaign)
    if estimates.spectra is not None:
        out["spectra"] = _spectra(estimates.spectra, campaign)
    return out


def _shown(comparisons: Sequence[Comparison]) -> Comparison:
    """The last load case that is long enough to be shown, else the longest: as print shows its load case 4."""
    long = [c for c in comparisons if c.seconds >= 0.8 * SHOWN]
    return long[-1] if long else max(comparisons, key=lambda c: len(c.e_measured))


def _over_time(c: Comparison, campaign: Campaign) -> Figure:
    some, s = slice(min(len(c.e_measured), round(SHOWN / c.replay.record.step))), c.replay.segment
    title = f"Load case {c.name}: {s.load / 1e3:.0f} t, {s.s_w:.0f} m of wire out, mode {s.mode.value}"
    figure, axes = panels(campaign, title, 3, 1, (10.0, 8.0), sharex=True)
    t, s_tip = c.replay.t[some] - c.replay.t[0], c.replay.s_tip[some]
    axes[0, 0].plot(t, s_tip - s_tip.mean(), color=GREY, lw=1.0)
    pairs = ((60.0, _wire_speed(c), c.simulated["v_w"]), (100.0, c.e_measured, c.e_simulated))
    for ax, (scale, measured, simulated) in zip(axes[1:, 0], pairs, strict=True):
        crane(ax, t, scale * measured[some])
        twin(ax, t, scale * simulated[some])
    axes[2, 0].set(xlabel="time [s]", xlim=(0.0, t[-1]))
    names = ("crane tip [m]\n(up positive)", "wire speed [m/min]\n(hoisting positive)", "control error [cm]")
    return finish(figure, axes, names, 2)


def _wire_speed(c: Comparison) -> FloatArray:
    """Measured wire speed: logged, or else the slope of the wire paid out."""
    if c.replay.record.has("v_w"):
        return c.replay.measured("v_w")
    return np.asarray(-np.gradient(c.replay.measured("s_w"), c.replay.record.step))


def _windows(comparisons: Sequence[Comparison], campaign: Campaign) -> Figure:
    """Control error, efficiency and the deviation of the error over the tip's motion, by windows."""
    figure, axes = panels(campaign, "Control error over moving windows, all load cases", 1, 3, (14.0, 5.0))
    w = {
        name: np.concatenate([getattr(c.windows, name) for c in comparisons])
        for name in ("s_tip_pp", "measured", "simulated", "eta_measured", "eta_simulated", "x")
    }
    tip, (error, efficiency, deviation) = w["s_tip_pp"], axes[0]
    for colour, label in ((MEASURED, "measured"), (SIMULATED, "simulated")):
        cloud(error, tip, 100.0 * w[label], colour, label)
        cloud(efficiency, tip, 100.0 * w[f"eta_{label}"], colour, label)
    cloud(deviation, tip, 100.0 * w["x"], OTHER, "deviation")
    cell = np.floor(tip / BIN)
    bins = np.unique(cell)
    means = [100.0 * w["x"][cell == i].mean() for i in bins]
    deviation.plot((bins + 0.5) * BIN, means, "o-", color=FITTED, lw=1.5, ms=4, label=f"average over {BIN:g} m")
    efficiency.set_ylabel("compensation efficiency [%]")
    deviation.set(ylabel="deviation of the control error [cm]", ylim=(0.0, None))
    error.set(ylim=(0.0, None))
    for ax in axes[0]:
        ax.set_xlabel("crane tip, peak to peak [m]")
    return finish(figure, axes, ("control error, peak to peak [cm]",), 4)


def _spectra(x: Spectra, campaign: Campaign) -> Figure:
    figure, axes = panels(campaign, "Spectra of the control error, all load cases", 1, 1, (8.0, 4.6))
    ax, band = axes[0, 0], (x.f > 0.0) & (x.f <= 5.0)
    ax.axvspan(*BAND, color=GREY, alpha=0.12, lw=0, label="wave band")
    crane(ax, x.f[band], 1e4 * x.measured[band])
    twin(ax, x.f[band], 1e4 * x.simulated[band])
    ax.set(xscale="log", yscale="log", xlabel="frequency [Hz]", xlim=(x.f[band][0], x.f[band][-1]))
    return finish(figure, axes, ("power density [cm$^2$/Hz]",), 3)
