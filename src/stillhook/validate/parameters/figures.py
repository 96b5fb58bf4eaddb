"""Figures of step 1: parameters implied by the logs against the crane file, for drum, flows, friction and tip delay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import in_display
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.figures import axes_of, legend_below, mark, thinned
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.check import ParametersStep
from stillhook.validate.parameters.measures import ParameterEstimates
from stillhook.validate.parameters.segments import diameter_of, wire_of_layer
from stillhook.validate.parameters.signals import CURVE, TipDelay

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TWIN = GREY


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """The figures of step 1 by file stem, those whose signals were logged."""
    if not isinstance(step, ParametersStep) or step.estimates is None:
        return {}
    estimates = step.estimates
    out: dict[str, Figure] = {}
    if estimates.radii:
        out["drum"] = _drum(campaign, estimates)
    if estimates.balance is not None:
        out["flow-balance"] = _flow(estimates)
    if estimates.frictions:
        out["torque-balance"] = _friction(estimates)
    if estimates.delays:
        out["tip-delay"] = _delay(campaign, estimates.delays)
    mark(campaign, out.values())
    return out


def _drum(campaign: Campaign, estimates: ParameterEstimates) -> Figure:
    """Diameter of the wire's centre that every test implies, over the layers of the twin's drum."""
    title = "Wire per turn of the motors: diameter of the wire's centre on the drum"
    figure, ((ax,), (error,)) = axes_of(2, 1, (9.0, 7.0), title, height_ratios=(2.2, 1.0))
    crane = campaign.crane
    layers = np.arange(1, crane.drum.layers + 1)
    for n, d in zip(layers, diameter_of(crane, layers.astype(np.float64)), strict=True):
        ax.plot(wire_of_layer(crane, int(n)), [d, d], color=TWIN, lw=2.0, label="twin, by layer" if n == 1 else None)
    for i, x in enumerate(estimates.radii):
        marker = "osD^v<"[i % 6]
        style: dict[str, Any] = {"color": COLOURS[i % 6], "marker": marker, "ms": 7, "ls": "none", "capsize": 3}
        ax.errorbar(x.s_w, x.d_implied, yerr=x.d * x.error.half, label=f"test {x.test}", **style)
        error.errorbar(x.s_w, 100.0 * x.error.value, yerr=100.0 * x.error.half, **style)
    error.axhline(0.0, color=TWIN, lw=2.0)
    error.set_ylabel("implied over\ntwin, less 1 [%]")
    error.set_xlabel("wire paid out [m]")
    ax.set_ylabel("diameter [m]")
    ax.sharex(error)
    ax.tick_params(labelbottom=False)
    low, high = error.get_ylim()
    error.set_ylim(min(low, -0.1), max(high, 0.1))
    _legend_above(ax, 7)
    return figure


def _flow(estimates: ParameterEstimates) -> Figure:
    """Motor flow over pump flow, and the missing flow over the twin's leakage."""
    b = estimates.balance
    assert b is not None
    title = "Flow balance of the higher line of the active circuit, windows of half a second"
    figure, ((ax, leak),) = axes_of(1, 2, (11.0, 5.0), title)
    dots: dict[str, Any] = {"ls": "none", "marker": ".", "ms": 3, "color": COLOURS[0], "alpha": 0.6}
    ax.plot(*(_dots(x, b.Q_m) for x in (b.Q_p, b.Q_m)), label="measured", **dots)
    ends = np.array(ax.get_xlim())
    ax.plot(ends, ends, color=TWIN, lw=1.5, label="twin without leakage")
    ax.set_xlabel("pump flow [L/min]")
    ax.set_ylabel("motor flow [L/min]")
    leak.plot(*(_dots(x, b.Q_m) for x in (b.Q_leak, b.Q_lost)), **dots)
    unit = in_display(1.0, "flow")
    top = np.array([0.0, float(np.nanmax(unit * b.Q_leak))])
    leak.plot(top, top, color=TWIN, lw=1.5, label="twin")
    of, low, high = (100.0 * x for x in (b.leakage.value, b.leakage.low, b.leakage.high))
    for part, style, label in (
        (of, "-", f"log: {of:+.1f} % ({low:+.1f} to {high:+.1f})"),
        (low, ":", None),
        (high, ":", None),
    ):
        leak.plot(top, (1.0 + part / 100.0) * top, color=COLOURS[1], lw=1.5, ls=style, label=label)
    leak.set_xlabel("leakage of the twin [L/min]")
    leak.set_ylabel("missing flow [L/min]")
    # axis limits that hold nearly all dots: single outliers do not set them
    low, high = np.nanpercentile(unit * b.Q_lost, [0.5, 99.5])
    leak.set_ylim(min(0.0, low - 0.2 * (high - low)), high + 0.2 * (high - low))
    _legend_above(leak, 2)
    _legend_above(ax, 2)
    return figure


def _friction(estimates: ParameterEstimates) -> Figure:
    """Remaining torque at the motor shaft over the twin's friction, by test."""
    figure, (axes,) = axes_of(
        1, 2, (11.0, 5.0), "Torque balance at the motors: remaining torque against the twin's friction"
    )
    for ax, up in zip(axes, (False, True), strict=True):
        for i, f in enumerate(estimates.frictions):
            selected = np.isfinite(f.measured) & np.isfinite(f.twin) & ((f.twin > 0.0) == up)
            x, y = (thinned(np.abs(values[selected])) for values in (f.twin, f.measured * np.sign(f.twin)))
            label = f"test {f.test}: {1.0 + f.scale.value:.2f} (+- {f.scale.half:.2f})"
            ax.plot(x, y, ".", ms=3, alpha=0.6, color=COLOURS[i % 6], label=label)
        ends = np.array([0.0, ax.get_xlim()[1]])
        ax.plot(ends, ends, color=TWIN, lw=1.5, label="twin")
        ax.set_xlabel("friction of the twin [N m]")
        ax.set_title("hoisting" if up else "lowering", fontsize="medium")
    axes[0].set_ylabel("remaining torque [N m]")
    legend_below(figure, axes[1:], 4)
    return figure


def _delay(campaign: Campaign, delays: tuple[TipDelay, ...]) -> Figure:
    """Remaining force in the wave band over the lead of the true tip against the logged one."""
    title = "Delay of the tip signal: remaining force of the hook's motion over the lead of the true tip"
    figure, ((ax,),) = axes_of(1, 1, (9.0, 5.0), title)
    for i, d in enumerate(delays):
        label = f"test {d.test}: {1e3 * d.delay.value:.0f} +- {1e3 * d.delay.half:.0f} ms"
        ax.plot(1e3 * CURVE, d.misfit / 1e3, color=COLOURS[i % 6], lw=1.6, label=label)
        ax.axvspan(1e3 * d.delay.low, 1e3 * d.delay.high, color=COLOURS[i % 6], alpha=0.12, lw=0)
    ax.axvline(1e3 * campaign.delay, color=TWIN, lw=2.0, ls="--", label=f"stated: {1e3 * campaign.delay:.0f} ms")
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("delay [ms]")
    ax.set_ylabel("remaining force, rms [kN]")
    _legend_above(ax, 3)
    return figure


def _legend_above(ax: Axes, columns: int) -> None:
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=columns, fontsize="small", frameon=False)


def _dots(flow: FloatArray, measured: FloatArray) -> FloatArray:
    """A flow in its unit where the other one was measured, thinned for a scatter plot."""
    return thinned(np.where(np.isfinite(measured), in_display(1.0, "flow") * flow, np.nan))
