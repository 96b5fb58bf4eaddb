"""Figures of step 3: the winch at its limits over time, and the speeds there of crane and twin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.figures import MEASURED, SIMULATED, axes_of, legend_below, marked
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.speed_limits.check import LimitsStep, Plateau, SaturatedPart, worded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 3
"""Parts that are drawn over time."""
SHOWN = 90.0
"""Longest stretch that is drawn of a part [s]."""
COMPLETE = COLOURS[2]
SHADE = "#f0e0c0"
TWINS = {"driven": "twin driven by the measured commands", "complete": "complete twin on tip motion and joystick"}
PANELS = (
    ("v_w", 60.0, "wire speed [m/min]\n(hoisting positive)"),
    ("u_p", 100.0, "pump command [%]"),
    ("alpha_m", 100.0, "motors' displacement [%]"),
)
"""Curves over time: signal, factor to the unit of its axis, label of the axis."""


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 3 by name; where no pump comes to its end, one part that comes near it."""
    if not isinstance(step, LimitsStep) or not step.parts:
        return {}
    most = sorted(step.parts, key=lambda p: -int(p.saturated.sum()))
    saturated = [p for p in most if p.saturated.any() or (p.twin_saturated is not None and p.twin_saturated.any())]
    shown = saturated[:MOST] or most[:1]
    out = {f"at-limits-{i + 1}": _over_time(p, campaign) for i, p in enumerate(shown)}
    if step.plateaus:
        out["limit-speeds"] = _speeds(step.plateaus, campaign)
    return out


def _over_time(p: SaturatedPart, campaign: Campaign) -> Figure:
    seconds = f"{p.saturated.sum() * p.step:.1f} s"
    title = worded(
        f"Test {p.name}, mode {p.segment.mode.value}: pumps saturated (shaded) for {seconds}", campaign.crane
    )
    panels = [panel for panel in PANELS if panel[0] in p.driven]
    figure, axes = axes_of(len(panels), 1, (10.0, 8.0), marked(campaign, title), sharex=True)
    cut = _window(p)
    t = p.t[cut]
    for ax, (name, scale, label) in zip(axes[:, 0], panels, strict=True):
        measured = p.v_w if name == "v_w" else p.signals.get(name)
        if measured is not None:
            ax.plot(t, scale * measured[cut], color=MEASURED, label="measured", lw=1.6)
        if name != "u_p" and np.isfinite(p.driven[name][cut]).any():
            ax.plot(t, scale * p.driven[name][cut], color=SIMULATED, label=TWINS["driven"], lw=1.2, ls="--")
        if p.complete is not None:
            ax.plot(t, scale * p.complete[name][cut], color=COMPLETE, label=TWINS["complete"], lw=1.2, ls=":")
        ax.set_ylabel(worded(label, campaign.crane))
        for a, b in p.spans():
            if p.t[b - 1] >= t[0] and p.t[a] <= t[-1]:
                ax.axvspan(p.t[a], p.t[b - 1], color=SHADE, lw=0.0, zorder=0)
    axes[-1, 0].set(xlabel="time [s]", xlim=(t[0], t[-1]))
    legend_below(figure, axes[:, 0], 3)
    figure.align_ylabels(axes[:, 0])
    return figure


def _window(p: SaturatedPart) -> slice:
    """All of a part, or of a long one the stretch with the most time at an end."""
    n = round(SHOWN / p.step)
    if len(p.t) <= n:
        return slice(None)
    much = np.concatenate([[0], np.cumsum(p.saturated)])
    at = int(np.argmax(much[n:] - much[:-n])) if p.saturated.any() else int(np.argmax(np.abs(p.signals["u_p"])))
    first = int(np.clip(at, 0, len(p.t) - n))
    return slice(first, first + n)


def _speeds(plateaus: Sequence[Plateau], campaign: Campaign) -> Figure:
    title = worded("Wire speed with saturated pumps, one point per plateau", campaign.crane)
    figure, axes = axes_of(1, 2, (10.0, 4.8), marked(campaign, title))
    allowed = next((c.limit for c in campaign.criteria.criteria if c.measure == "limit_speed_error" and c.judged), None)
    top = 66.0 * max(max(abs(p.v_w), np.nan_to_num(abs(p.driven)), np.nan_to_num(abs(p.complete))) for p in plateaus)
    for ax, (run, name), colour in zip(axes[0], TWINS.items(), (SIMULATED, COMPLETE), strict=True):
        x = np.array([0.0, top])
        if allowed is not None:
            label = f"within {100.0 * allowed:g} %"
            ax.fill_between(x, x * (1.0 - allowed), x * (1.0 + allowed), color=SHADE, lw=0.0, label=label)
        ax.plot(x, x, color=GREY, lw=1.0)
        for way, mark, label in ((1, "^", "hoisting"), (-1, "v", "lowering")):
            same = [p for p in plateaus if p.way == way and np.isfinite(getattr(p, run))]
            if same:
                measured, simulated = ([60.0 * abs(getattr(p, name)) for p in same] for name in ("v_w", run))
                ax.plot(measured, simulated, mark, ms=7, mfc="none", color=colour, label=label)
        ax.set(xlim=(0.0, top), ylim=(0.0, top), xlabel="measured [m/min]", ylabel=f"{name} [m/min]")
        ax.legend(loc="upper left", fontsize="small", frameon=False)
    return figure
