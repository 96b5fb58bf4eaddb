"""Figures of step 3: the winch at its limits over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.plots import OTHER, SHADE, crane, finish, panels, twin
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.speed_limits.check import SaturatedPart, SpeedLimits, worded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 3
"""Parts that are drawn over time."""
SHOWN = 90.0
"""Longest stretch that is drawn of a part [s]."""
PANELS = (
    ("v_w", 60.0, "wire speed [m/min]\n(hoisting positive)"),
    ("u_p", 100.0, "pump command [%]"),
    ("alpha_m", 100.0, "motors' displacement [%]"),
)
"""Curves over time: signal, factor to the unit of its axis, label of the axis."""


def figures(estimates: SpeedLimits, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 3 by name; where no pump comes to its end, one part that comes near it."""
    most = sorted(estimates.parts, key=lambda p: -int(p.saturated.sum()))
    saturated = [p for p in most if p.saturated.any() or (p.twin_saturated is not None and p.twin_saturated.any())]
    return {f"at-limits-{i + 1}": _over_time(p, campaign) for i, p in enumerate(saturated[:MOST] or most[:1])}


def _over_time(p: SaturatedPart, campaign: Campaign) -> Figure:
    seconds = f"{p.saturated.sum() * p.step:.1f} s"
    title = f"Test {p.name}, mode {p.segment.mode.value}: pumps saturated (shaded) for {seconds}"
    shown = [panel for panel in PANELS if panel[0] in p.driven]
    figure, axes = panels(campaign, worded(title, campaign.crane), len(shown), 1, (10.0, 8.0), sharex=True)
    cut = _window(p)
    t = p.t[cut]
    for ax, (name, scale, _) in zip(axes[:, 0], shown, strict=True):
        measured = p.v_w if name == "v_w" else p.signals.get(name)
        crane(ax, t, None if measured is None else scale * measured[cut])
        if name != "u_p" and np.isfinite(p.driven[name][cut]).any():
            twin(ax, t, scale * p.driven[name][cut], "twin driven by the measured commands")
        if p.complete is not None:
            twin(ax, t, scale * p.complete[name][cut], "complete twin on tip motion and joystick", OTHER)
        for a, b in p.spans():
            if p.t[b - 1] >= t[0] and p.t[a] <= t[-1]:
                ax.axvspan(p.t[a], p.t[b - 1], color=SHADE, lw=0.0, zorder=0)
    axes[-1, 0].set(xlabel="time [s]", xlim=(t[0], t[-1]))
    return finish(figure, axes, [worded(label, campaign.crane) for *_, label in shown], 3)


def _window(p: SaturatedPart) -> slice:
    """All of a part, or of a long one the stretch with the most time at an end."""
    n = round(SHOWN / p.step)
    if len(p.t) <= n:
        return slice(None)
    much = np.concatenate([[0], np.cumsum(p.saturated)])
    at = int(np.argmax(much[n:] - much[:-n])) if p.saturated.any() else int(np.argmax(np.abs(p.signals["u_p"])))
    first = int(np.clip(at, 0, len(p.t) - n))
    return slice(first, first + n)
