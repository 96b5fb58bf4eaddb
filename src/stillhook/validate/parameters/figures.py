"""Figures of step 1: flow and torque balance of the logs against the crane file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.report.plots.colours import COLOURS
from stillhook.units import in_display
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.plots import CRANE_FILE, FITTED, MEASURED, cloud, finish, line, panels
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.flow import Balance
from stillhook.validate.parameters.hoisting import Friction
from stillhook.validate.parameters.measures import ParameterEstimates

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures(estimates: ParameterEstimates, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 1 by name, those whose signals were logged."""
    out: dict[str, Figure] = {}
    if estimates.balance is not None:
        out["flow-balance"] = _flow(campaign, estimates.balance)
    if estimates.frictions:
        out["torque-balance"] = _friction(campaign, estimates.frictions)
    return out


def _flow(campaign: Campaign, b: Balance) -> Figure:
    """Motor flow over pump flow, and the missing flow over the twin's leakage."""
    title, unit = (
        "Flow balance of the higher line of the active circuit, windows of half a second",
        in_display(1.0, "flow"),
    )
    figure, axes = panels(campaign, title, 1, 2, (11.0, 5.0))
    known = np.isfinite(b.Q_m)
    Q_p, Q_m, Q_leak, Q_lost = (unit * x[known] for x in (b.Q_p, b.Q_m, b.Q_leak, b.Q_lost))
    ax, leak = axes[0]
    cloud(ax, Q_p, Q_m, MEASURED, "windows")
    line(ax, 1.0, ax.get_xlim(), CRANE_FILE, "crane file")
    ax.set(xlabel="pump flow [L/min]", ylabel="motor flow [L/min]")
    cloud(leak, Q_leak, Q_lost, MEASURED, "windows")
    ends = (0.0, float(np.nanmax(Q_leak)))
    line(leak, 1.0, ends, CRANE_FILE, "crane file")
    e = b.leakage
    of, low, high = (100.0 * x for x in (e.value, e.low, e.high))
    line(leak, 1.0 + e.value, ends, FITTED, f"log: leakage {of:+.1f} % ({low:+.1f} to {high:+.1f})")
    for end in (e.low, e.high):
        line(leak, 1.0 + end, ends, FITTED, None, ":")
    low, high = np.nanpercentile(Q_lost, [0.5, 99.5])  # single outliers do not set the limits of the axis
    leak.set(ylim=(min(0.0, low - 0.2 * (high - low)), high + 0.2 * (high - low)))
    leak.set(xlabel="leakage of the twin [L/min]", ylabel="missing flow [L/min]")
    return finish(figure, axes, ("motor flow [L/min]",), 3)


def _friction(campaign: Campaign, frictions: tuple[Friction, ...]) -> Figure:
    """Remaining torque at the motor shaft over the twin's friction, by test."""
    title = "Torque balance at the motors: remaining torque against the twin's friction"
    figure, axes = panels(campaign, title, 1, 2, (11.0, 5.0))
    for ax, up in zip(axes[0], (False, True), strict=True):
        for i, f in enumerate(frictions):
            some = np.isfinite(f.measured) & np.isfinite(f.twin) & ((f.twin > 0.0) == up)
            label = f"test {f.test}: {1.0 + f.scale.value:.2f} (+- {f.scale.half:.2f})"
            cloud(ax, np.abs(f.twin[some]), (f.measured * np.sign(f.twin))[some], COLOURS[i % 6], label)
        line(ax, 1.0, (0.0, ax.get_xlim()[1]), CRANE_FILE, "crane file")
        ax.set(xlabel="friction of the twin [N m]")
        ax.set_title("hoisting" if up else "lowering", fontsize="medium")
    return finish(figure, axes, ("remaining torque [N m]",), 4)
