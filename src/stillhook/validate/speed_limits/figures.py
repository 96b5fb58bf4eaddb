"""Figures of step 3: the winch at its limits over time, and the speeds there of crane and twin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.plots.run import COLOURS, GREY
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.figures import MEASURED, SIMULATED, axes_of, legend_below, marked
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.speed_limits.check import LimitsStep, Plateau
from stillhook.validate.speed_limits.runs import SaturatedPart

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 3
"""Parts that are drawn over time."""
SHOWN = 90.0
"""Longest stretch that is drawn of a part [s]."""
COMPLETE = COLOURS[2]
SHADE = "#f0e0c0"


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 3 by name; where no pump comes to its end, one part that comes near it."""
    if not isinstance(step, LimitsStep) or not step.parts:
        return {}
    most = sorted(step.parts, key=lambda p: -int(p.saturated.sum()))
    shown = [p for p in most if p.saturated.any() or (p.twin_saturated is not None and p.twin_saturated.any())][
        :MOST
    ] or most[:1]
    out = {f"at-limits-{i + 1}": _over_time(p, campaign) for i, p in enumerate(shown)}
    if step.plateaus:
        out["limit-speeds"] = _speeds(step.plateaus, campaign)
    return out


def _over_time(p: SaturatedPart, campaign: Campaign) -> Figure:
    title = (
        f"Test {p.name}, mode {p.segment.mode.value}: pumps saturated (shaded) for {p.saturated.sum() * p.step:.1f} s"
    )
    figure, axes = axes_of(3, 1, (10.0, 8.0), marked(campaign, title), sharex=True)
    cut = _window(p)
    t = p.t[cut]
    _line(axes[0, 0], t, p.v_w[cut], 60.0, MEASURED, "measured", lw=1.6)
    _twin(axes[0, 0], t, p, cut, "v_w", 60.0)
    _line(axes[1, 0], t, p.signals["u_p"][cut], 100.0, MEASURED, "measured", lw=1.6)
    if p.complete is not None:
        _line(
            axes[1, 0], t, p.complete["u_p"][cut], 100.0, COMPLETE, "complete twin on tip motion and joystick", ls=":"
        )
    if "alpha_m" in p.signals:
        _line(axes[2, 0], t, p.signals["alpha_m"][cut], 100.0, MEASURED, "measured", lw=1.6)
    _twin(axes[2, 0], t, p, cut, "alpha_m", 100.0)
    for ax, name in zip(
        axes[:, 0],
        ("wire speed [m/min]\n(hoisting positive)", "pump command [%]", "motors' displacement [%]"),
        strict=True,
    ):
        ax.set_ylabel(name)
        for a, b in p.spans():
            if p.t[b - 1] >= t[0] and p.t[a] <= t[-1]:
                ax.axvspan(p.t[a], p.t[b - 1], color=SHADE, lw=0.0, zorder=0)
    axes[2, 0].set(xlabel="time [s]", xlim=(t[0], t[-1]))
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


def _line(ax: Any, t: FloatArray, y: FloatArray, scale: float, colour: str, label: str, **style: Any) -> None:
    ax.plot(t, scale * y, color=colour, label=label, **({"lw": 1.2} | style))


def _twin(ax: Any, t: FloatArray, p: SaturatedPart, cut: slice, name: str, scale: float) -> None:
    if np.isfinite(p.driven[name][cut]).any():
        _line(ax, t, p.driven[name][cut], scale, SIMULATED, "twin driven by the measured commands", ls="--")
    if p.complete is not None:
        _line(ax, t, p.complete[name][cut], scale, COMPLETE, "complete twin on tip motion and joystick", ls=":")


def _speeds(plateaus: Sequence[Plateau], campaign: Campaign) -> Figure:
    title = "Wire speed with saturated pumps, one point per plateau"
    figure, axes = axes_of(1, 2, (10.0, 4.8), marked(campaign, title))
    allowed = next((c.limit for c in campaign.criteria.criteria if c.measure == "limit_speed_error" and c.judged), None)
    top = 66.0 * max(max(abs(p.v_w), np.nan_to_num(abs(p.driven)), np.nan_to_num(abs(p.complete))) for p in plateaus)
    for ax, run, colour, name in (
        (axes[0, 0], "driven", SIMULATED, "twin driven by the measured commands"),
        (axes[0, 1], "complete", COMPLETE, "complete twin on tip motion and joystick"),
    ):
        x = np.array([0.0, top])
        if allowed is not None:
            ax.fill_between(
                x, x * (1.0 - allowed), x * (1.0 + allowed), color=SHADE, lw=0.0, label=f"within {100.0 * allowed:g} %"
            )
        ax.plot(x, x, color=GREY, lw=1.0)
        for way, mark, label in ((1, "^", "hoisting"), (-1, "v", "lowering")):
            same = [p for p in plateaus if p.way == way and np.isfinite(getattr(p, run))]
            if same:
                speeds = [60.0 * abs(getattr(p, run)) for p in same]
                ax.plot(
                    [60.0 * abs(p.v_w) for p in same], speeds, mark, ms=7, mfc="none", color=colour, label=f"{label}"
                )
        ax.set(xlim=(0.0, top), ylim=(0.0, top), xlabel="measured [m/min]", ylabel=f"{name} [m/min]")
        ax.legend(loc="upper left", fontsize="small", frameon=False)
    return figure
