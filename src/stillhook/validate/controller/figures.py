"""Figures of step 2: commands measured and simulated over time, and the law of the motors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.control.commands import reduction_cubic, reduction_linear
from stillhook.control.controllers import ssc_cubic
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.validate.controller.check import ControllerEstimates
from stillhook.validate.controller.law import Run
from stillhook.validate.controller.motor import SEMI, MotorLaw, difference
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.plots import FITTED, cloud, crane, finish, panels, twin
from stillhook.validate.data_set.records.record import Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 60.0
"""Plotted length of a test [s]."""
MOST = 3
"""Number of tests plotted side by side."""
WORDS = {"u_p": "pump", "u_m": "motor"}
"""Machines of the commands."""


def figures(estimates: ControllerEstimates, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 2 by name."""
    runs = [r for r in estimates.runs if any(p.mode.compensates for p in r.segment.parts)]
    out = {"commands": _commands(_shown(runs), estimates.rows.cycles, campaign)}
    if laws := [m for m in estimates.motor_laws if m.mode in SEMI]:
        out["motor-law"] = _motor_law(laws, campaign)
    return out


def _shown(runs: Sequence[Run]) -> list[tuple[Run, slice]]:
    """One stretch of each test, about the largest command in it; of many tests those with the largest ones."""
    largest: dict[str, tuple[float, Run, slice]] = {}
    for run in runs:
        u, T = np.abs(run.segment.u_p), run.segment.record.step
        at, n = int(np.nanargmax(u)), round(SHOWN / T)
        first = int(np.clip(at - n // 2, 0, max(0, len(u) - n)))
        name, top = run.test, float(u[at])
        if name not in largest or top > largest[name][0]:
            largest[name] = (top, run, slice(first, first + n))
    best = sorted(largest, key=lambda n: -largest[n][0])[:MOST]
    return [largest[n][1:] for n in largest if n in best]


def _commands(shown: Sequence[tuple[Run, slice]], cycles: int, campaign: Campaign) -> Figure:
    """Commands and their deviation; a drive without a closed circuit takes a speed alone."""
    machines = WORDS if "active" in campaign.crane.circuits else {"u_p": "speed"}
    title, size = "Commands of the PLC over its logged inputs", (4.0 + 3.4 * len(shown), 2.5 * (len(machines) + 1))
    figure, axes = panels(campaign, title, len(machines) + 1, len(shown), size, sharex="col")
    for column, (run, part) in zip(axes.T, shown, strict=True):
        s = run.segment
        t = s.record.t[s.first : s.last][part]
        for ax, colour, (signal, machine) in zip(column, COLOURS[2:], machines.items(), strict=False):
            measured = getattr(s, signal)
            crane(ax, t, None if measured is None else 100.0 * measured[part])
            twin(ax, t, 100.0 * getattr(run.simulated, signal)[part])
            if (d := difference(run, signal, cycles)) is not None:
                label = f"{machine} command, measured less simulated"
                column[-1].plot(t, 100.0 * d[part], color=colour, lw=0.8, label=label)
        column[0].set_title(f"test {s.record.test.name}, mode {s.parts[0].mode.value}", fontsize="small")
        column[-1].set_xlabel("time [s]")
    names = [f"{machine} command [%]" for machine in machines.values()]
    names[0] += "\n(hoisting positive)"
    return finish(figure, axes, (*names, "deviation\n[% of full command]"), 4)


def _motor_law(laws: Sequence[MotorLaw], campaign: Campaign) -> Figure:
    """Motor command over the feedforward, with the twin's law for every mode and least displacement."""
    figure, axes = panels(campaign, "Motor command over the feedforward in the logged pump command", 1, 1, (7.0, 5.2))
    ax, x = axes[0, 0], np.linspace(0.0, 1.0, 201)
    curves = list(dict.fromkeys((m.mode, round(m.lowest, 2)) for m in laws))
    for (mode, lowest), style in zip(curves, ("-", "--", ":", "-.") * 3, strict=False):
        y = [_law(float(u), mode, lowest, campaign.crane) for u in x]
        ax.plot(x, y, style, color=FITTED, lw=1.2, label=f"twin, {mode.value}, minimum {lowest:g}")
    for colour, m in zip(COLOURS * 3, laws, strict=False):
        cloud(ax, m.u_ff, m.u_m, colour, f"test {m.test}, measured")
    ax.axvline(campaign.crane.control.u_thr, color=GREY, lw=0.8, ls=":")
    ax.set(xlim=(0.0, 1.05), ylim=(min(0.5, min(n for _, n in curves) - 0.05), 1.05), xlabel="|u_ff| [-]")
    return finish(figure, axes, ("motor command [-]",), 3)


def _law(u_ff: float, mode: Mode, lowest: float, crane_file: Crane) -> float:
    u_thr = crane_file.control.u_thr
    reduction = reduction_cubic(u_ff, u_thr) if mode == ssc_cubic.NAME else reduction_linear(u_ff, u_thr)
    return 1.0 - float(reduction) * (1.0 - lowest)
