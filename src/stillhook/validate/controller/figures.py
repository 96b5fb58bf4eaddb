"""Figures of step 2: commands measured and simulated, their deviation, the law of the motors, the gains that the
commands follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.control.commands import reduction_cubic, reduction_linear
from stillhook.control.controllers import ssc_cubic
from stillhook.engine.pack.winch import gains
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.validate.controller.check import ControllerStep
from stillhook.validate.controller.law import Law, Run
from stillhook.validate.controller.motor import SEMI, MotorLaw, difference, differences
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.figures import MEASURED, SIMULATED, axes_of, legend_below, marked
from stillhook.validate.data_set.records.record import Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 60.0
"""Plotted length of a test [s]."""
MOST = 3
"""Number of tests plotted side by side."""
POINTS = 3000
"""Samples of a cloud."""
WORDS = {"u_p": "pump", "u_m": "motor"}
"""Machines of the commands."""
ALLOWED = 3.0
"""% of full command. Source: Moslatt 2020 paper F table 2, criterion 3."""


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of step 2 by name; none where no command could be compared."""
    if not isinstance(step, ControllerStep) or step.estimates is None:
        return {}
    estimates = step.estimates
    runs = [r for r in estimates.runs if any(p.mode.compensates for p in r.segment.parts)]
    out = {
        "commands": _commands(runs, estimates.rows.cycles, campaign),
        "deviation": _exceedance(runs, estimates.rows.cycles, campaign),
    }
    laws = [m for m in estimates.motor_laws if m.mode in SEMI]
    if laws:
        out["motor-law"] = _motor_law(laws, campaign)
    if estimates.law is not None:
        out["gains"] = _gains(estimates.law, estimates.laws, campaign)
    return out


def _machines(campaign: Campaign) -> dict[str, str]:
    """Commands of the winch, each with its machine in words: a drive without a closed circuit takes a speed alone."""
    return WORDS if "active" in campaign.crane.circuits else {"u_p": "speed"}


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


def _commands(runs: Sequence[Run], cycles: int, campaign: Campaign) -> Figure:
    shown, machines = _shown(runs), _machines(campaign)
    figure, axes = axes_of(
        len(machines) + 1,
        len(shown),
        (4.0 + 3.4 * len(shown), 2.5 * (len(machines) + 1)),
        marked(campaign, "Commands of the PLC over its logged inputs"),
        sharex="col",
    )
    for column, (run, part) in zip(axes.T, shown, strict=True):
        s = run.segment
        t = s.record.t[s.first : s.last][part]
        for ax, signal in zip(column[:-1], machines, strict=True):
            measured = getattr(s, signal)
            if measured is not None:
                ax.plot(t, 100.0 * measured[part], color=MEASURED, lw=1.6, label="measured")
            ax.plot(
                t, 100.0 * getattr(run.simulated, signal)[part], color=SIMULATED, lw=1.0, ls="--", label="simulated"
            )
        for colour, (signal, label) in zip(COLOURS[2:4], machines.items(), strict=False):
            d = difference(run, signal, cycles)
            if d is not None:
                column[-1].plot(
                    t, 100.0 * d[part], color=colour, lw=0.8, label=f"{label} command, measured less simulated"
                )
        _room(column[-1])
        column[0].set_title(f"test {s.record.test.name}, mode {s.parts[0].mode.value}", fontsize="small")
        column[-1].set_xlabel("time [s]")
    names = [f"{machine} command [%]" for machine in machines.values()]
    names[0] += "\n(hoisting positive)"
    for ax, name in zip(axes[:, 0], (*names, "deviation\n[% of full command]"), strict=True):
        ax.set_ylabel(name)
    legend_below(figure, (axes[0, 0], axes[-1, 0]), 4)
    figure.align_ylabels(axes[:, 0])
    return figure


def _room(ax: Any) -> None:
    """The limit of criterion 3, where the deviations come near it."""
    top = float(np.abs(ax.get_ylim()).max())
    if top > 0.2 * ALLOWED:
        for y in (-ALLOWED, ALLOWED):
            ax.axhline(y, color=GREY, lw=1.0, ls=":")
        ax.set_ylim(-max(top, 1.1 * ALLOWED), max(top, 1.1 * ALLOWED))


def _exceedance(runs: Sequence[Run], cycles: int, campaign: Campaign) -> Figure:
    machines = _machines(campaign)
    figure, axes = axes_of(
        1,
        len(machines),
        (5.0 * max(len(machines), 1.4), 4.6),
        marked(campaign, "Exceedance of the deviation of the commands"),
        sharey=True,
        sharex=True,
    )
    names = list(dict.fromkeys(r.test for r in runs))
    for ax, signal, machine in zip(axes[0], machines, machines.values(), strict=True):
        for colour, name in zip(COLOURS * 3, names, strict=False):
            parts = [d for r in runs if r.test == name for d in differences(r, signal, cycles, ahc=True)]
            if parts:
                size = np.sort(100.0 * np.abs(np.concatenate(parts)))
                exceeded = 100.0 * np.arange(len(size), 0, -1) / len(size)
                dots = slice(None, None, max(1, len(size) // POINTS))
                ax.step(np.maximum(size, 1e-3)[dots], exceeded[dots], color=colour, lw=1.2, label=f"test {name}")
        ax.axvline(ALLOWED, color=GREY, ls=":", lw=1.2, label="criterion 3: at most 3 %")
        ax.axhline(5.0, color=GREY, ls="--", lw=0.8, label="5 % of the time")
        ax.set_xlabel(f"deviation of the {machine} command [% of full command]")
    axes[0, 0].set(
        xscale="log", yscale="log", ylim=(0.05, 120.0), xlim=(1e-3, 100.0), ylabel="share of time exceeded [%]"
    )
    legend_below(figure, (axes[0, 0],), min(len(names) + 2, 6))
    return figure


def _motor_law(laws: Sequence[MotorLaw], campaign: Campaign) -> Figure:
    figure, axes = axes_of(
        1, 1, (7.0, 5.2), marked(campaign, "Motor command over the feedforward in the logged pump command")
    )
    ax, x = axes[0, 0], np.linspace(0.0, 1.0, 201)
    curves: dict[tuple[Mode, float], MotorLaw] = {}
    for m in laws:
        curves.setdefault((m.mode, round(m.lowest, 2)), m)
    for (mode, lowest), style in zip(curves, ("-", "--", ":", "-.") * 3, strict=False):
        y = [_law(float(u), mode, lowest, campaign.crane) for u in x]
        ax.plot(x, y, style, color="#000000", lw=1.2, label=f"twin, {mode.value}, minimum {lowest:g}")
    for colour, m in zip(COLOURS * 3, laws, strict=False):
        dots = slice(None, None, max(1, len(m.u_ff) // POINTS))
        label = f"test {m.test}, measured"
        ax.plot(m.u_ff[dots], m.u_m[dots], ".", ms=2.0, color=colour, label=label, rasterized=True)
    ax.axvline(campaign.crane.control.u_thr, color=GREY, lw=0.8, ls=":")
    ax.set(
        xlim=(0.0, 1.05),
        ylim=(min(0.5, min(n for _, n in curves) - 0.05), 1.05),
        xlabel="|u_ff| [-]",
        ylabel="motor command [-]",
    )
    legend_below(figure, (ax,), 3)
    return figure


def _law(u_ff: float, mode: Mode, lowest: float, crane: Crane) -> float:
    u_thr = crane.control.u_thr
    reduction = reduction_cubic(u_ff, u_thr) if mode == ssc_cubic.NAME else reduction_linear(u_ff, u_thr)
    return 1.0 - float(reduction) * (1.0 - lowest)


def _gains(law: Law, laws: Mapping[str, Law], campaign: Campaign) -> Figure:
    figure, axes = axes_of(
        1,
        3,
        (10.0, 1.8 + 0.35 * (len(laws) + 1)),
        marked(campaign, "Gains in the logged commands, deviation from the crane file's"),
        sharey=True,
    )
    ours = gains(campaign.crane)
    rows = [*laws.items(), ("all", law)]
    for ax, name in zip(axes[0], ("K_1", "K_2", "K_p"), strict=True):
        file_value = getattr(ours, name)
        for k, (_, gains_of_row) in enumerate(rows):
            e = getattr(gains_of_row, name)
            if e is not None and file_value > 0.0:
                colour = COLOURS[1] if gains_of_row is law else MEASURED
                share, half = 100.0 * (e.value / file_value - 1.0), 100.0 * e.half / file_value
                ax.errorbar(share, k, xerr=half, fmt="o", ms=4, capsize=3, color=colour)
        ax.axvline(0.0, color=GREY, lw=1.0)
        reach = max(1.0, 1.15 * float(np.abs(ax.get_xlim()).max()))
        ax.set(xlim=(-reach, reach), xlabel=f"{name} [% deviation], 95 % interval")
    axes[0, 0].set_yticks(range(len(rows)), [n if n == "all" else f"test {n}" for n, _ in rows])
    axes[0, 0].set_ylim(len(rows) - 0.5, -0.5)
    return figure
