"""Figures of step 6, against the crane file: pressure over the oil that the motors move, torque of passive motors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.crane import passive_of
from stillhook.units import in_display
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.figures import axes_of, legend_below, mark, thinned
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.passive.gas import Curve, index
from stillhook.validate.passive.step import PassiveStep
from stillhook.validate.passive.torque import Share

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """The figures of step 6 by file stem, those whose signals were logged."""
    if not isinstance(step, PassiveStep) or step.estimates is None:
        return {}
    estimates, out = step.estimates, dict[str, "Figure"]()
    if estimates.gas is not None:
        out["gas-curve"] = _gas(campaign, estimates.gas, index(estimates.parts[0]))
    if estimates.shares:
        out["passive-motors"] = _motors(campaign, estimates.shares)
    mark(campaign, out.values())
    return out


def _gas(campaign: Campaign, gas: Curve, n: float) -> Figure:
    """Change of the passive pressure, corrected for the flow loss, over the oil moved in windows; and the flow loss; n
    of the file."""
    acc = passive_of(campaign.crane).accumulator
    figure, ((ax, loss),) = axes_of(1, 2, (11.0, 5.0), "Passive pressure in windows of 2 s: gas curve and flow loss")
    stiff = acc.gas.p_0 / acc.gas.V_0 * n
    implied = stiff * (gas.p / acc.gas.p_0) * acc.gas.V_0 / gas.V.value
    bar, litre, flow = (in_display(1.0, kind) for kind in ("pressure", "volume", "flow"))
    x, y = thinned(gas.dV), thinned(gas.dp - gas.R * gas.dQ - gas.dry * gas.d_dry)
    ax.plot(litre * x, bar * y, ".", ms=3, color=COLOURS[0], alpha=0.6, label="measured")
    ends = np.array([np.nanmin(gas.dV), np.nanmax(gas.dV)])
    ax.plot(litre * ends, bar * stiff * ends, color=GREY, lw=2.0, label="crane file")
    ax.plot(litre * ends, bar * implied * ends, color=COLOURS[1], lw=1.5, ls="--", label="log")
    ax.set_xlabel("oil into the accumulator [L]")
    ax.set_ylabel("change of pressure, less flow loss [bar]")
    residual = gas.dp - implied * gas.dV - gas.dry * gas.d_dry
    loss.plot(flow * thinned(gas.dQ), bar * thinned(residual), ".", ms=3, color=COLOURS[0], alpha=0.6)
    ends = np.array([np.nanmin(gas.dQ), np.nanmax(gas.dQ)])
    loss.plot(flow * ends, bar * acc.R_piston * ends, color=GREY, lw=2.0)
    loss.plot(flow * ends, bar * gas.R * ends, color=COLOURS[1], lw=1.5, ls="--")
    loss.set_xlabel("change of flow [L/min]")
    loss.set_ylabel("change of pressure, less gas and dry friction [bar]")
    legend_below(figure, [ax], 3)
    return figure


def _motors(campaign: Campaign, shares: tuple[Share, ...]) -> Figure:
    """Required torque of the passive motors over that of all motors of the file, by test; lines of fewer motors."""
    count = passive_of(campaign.crane).motor.count
    title = "Torque of the passive motors from load and active motors, over that of all motors in the crane file"
    figure, ((ax,),) = axes_of(1, 1, (9.0, 6.0), title)
    top = max(float(np.nanmax(s.T_p)) for s in shares)
    for i, s in enumerate(shares):
        label = f"test {s.test}: {count * (1.0 + s.share.value):.2f} of {count} motors"
        ax.plot(thinned(s.T_p), thinned(s.T), ".", ms=3, alpha=0.5, color=COLOURS[i % 6], label=label)
    low = min(float(np.nanmin(s.T_p)) for s in shares)
    ends = np.array([0.95 * low, 1.02 * top])
    for dead in (0, 1, 2):
        n, style = count - dead, ("-", "--", ":")[dead]
        torque = n / count * ends
        ax.plot(ends, torque, color=GREY, lw=2.0 - 0.5 * dead, ls=style, label=f"{n} motors")
    ax.set_xlabel("torque of all motors of the crane file [N m]")
    ax.set_ylabel("required torque [N m]")
    legend_below(figure, [ax], 3)
    return figure
