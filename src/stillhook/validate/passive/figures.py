"""Figure of step 6: pressure over the oil that the passive motors move, and over its flow, against the crane file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.spec.crane import passive_of
from stillhook.units import in_display
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.plots import CRANE_FILE, FITTED, MEASURED, cloud, finish, line, panels
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.passive.check import PassiveEstimates
from stillhook.validate.passive.gas import index

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures(estimates: PassiveEstimates, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Gas curve and flow loss in windows, each without the other; none where their signals were not logged."""
    gas, acc = estimates.gas, passive_of(campaign.crane).accumulator
    if gas is None:
        return {}
    figure, axes = panels(campaign, "Passive pressure in windows of 2 s: gas curve and flow loss", 1, 2, (11.0, 5.0))
    stiff = acc.gas.p_0 / acc.gas.V_0 * index(estimates.parts[0])
    implied = stiff * (gas.p / acc.gas.p_0) * acc.gas.V_0 / gas.V.value
    bar, dp = in_display(1.0, "pressure"), gas.dp - gas.dry * gas.d_dry
    sides = (
        ("oil into the accumulator [L]", "volume", gas.dV, dp - gas.R * gas.dQ, stiff, implied),
        ("change of flow [L/min]", "flow", gas.dQ, dp - implied * gas.dV, acc.R_piston, gas.R),
    )
    for ax, (name, kind, x, y, file_slope, log_slope) in zip(axes[0], sides, strict=True):
        unit = in_display(1.0, kind)
        ends = (unit * float(np.nanmin(x)), unit * float(np.nanmax(x)))
        cloud(ax, unit * x, bar * y, MEASURED, "measured")
        line(ax, bar / unit * file_slope, ends, CRANE_FILE, "crane file")
        line(ax, bar / unit * log_slope, ends, FITTED, "log", "--")
        ax.set_xlabel(name)
    axes[0, 1].set_ylabel("change of pressure, less gas and dry friction [bar]")
    return {"gas-curve": finish(figure, axes, ("change of pressure, less flow loss [bar]",), 3)}
