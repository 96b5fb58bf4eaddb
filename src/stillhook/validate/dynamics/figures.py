"""Figures of step 4: three turns before and after tuning, the residuals, and the tuned values with their
intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.formatting import change, percent_fixed
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.statistics.estimate import NORMAL_95
from stillhook.units import in_display
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.figures import axes_of, legend_below, mark
from stillhook.validate.data_set.records.record import Record, Transient
from stillhook.validate.dynamics.check import DynamicsStep
from stillhook.validate.dynamics.estimates import LETTERS, TunedValue
from stillhook.validate.dynamics.form import Tuning
from stillhook.validate.dynamics.model import PLACE, TUNED, UNKNOWNS
from stillhook.validate.dynamics.runs import SIGNALS, DynamicsSegment
from stillhook.validate.dynamics.swings import SwingComparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = ("p_a", "p_b", "omega_m")
NAMES = {"p_a": "pressure A [bar]", "p_b": "pressure B [bar]", "omega_m": "motor speed [rev/min]"}
KIND = {"p_a": "pressure", "p_b": "pressure", "omega_m": "rotation"}
LONG = 4.0
"""Time that is shown of a turn [s]."""
CRANE = "#000000"
FILE = {"color": COLOURS[1], "label": "crane file"}
TUNE = {"color": COLOURS[0], "label": "tuned"}
FINE_TICKS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.7, 2.0)
COARSE_TICKS = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0, 10.0)


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """The figures of step 4 by file stem; none where no test could be used."""
    if not isinstance(step, DynamicsStep) or step.tuning is None or step.swings is None:
        return {}
    out = {
        "turns": _turns(step, step.tuning),
        "residuals": _residuals(step.time_segments, step.tuning, step.swings),
        "tuned": _tuned(step.tuned, step.tuning),
    }
    mark(campaign, out.values())
    return out


def _shown(step: DynamicsStep) -> list[Transient]:
    """Three turns: those with the largest changes, hoisting and lowering, and one to rest where there is one; in order
    of time."""
    to_rest = sorted((x for x in step.transients if abs(x.after) < 0.5 * abs(x.before)), key=lambda x: -abs(x.change))[
        :1
    ]
    up = sorted((x for x in step.transients if x not in to_rest and x.change > 0.0), key=lambda x: -x.change)
    down = sorted((x for x in step.transients if x not in to_rest and x.change < 0.0), key=lambda x: x.change)
    chosen = [*up[:1], *down[:1], *to_rest]
    others = [x for x in step.transients if x not in chosen]
    return sorted((chosen + others)[:3], key=lambda x: (x.test, x.start))


def _turns(step: DynamicsStep, tuning: Tuning) -> Figure:
    """p_a, p_b and omega_m in three turns: the crane, the twin as its file has it, the twin tuned."""
    turns = _shown(step)
    title = "Turns of the winch, the twin driven by the measured commands (paper F step 4)"
    figure, axes = axes_of(len(SHOWN), len(turns), (12.0, 8.5), title, sharex="col")
    for j, turn in enumerate(turns):
        i, segment = next((i, s) for i, s in enumerate(step.time_segments) if s.holds(turn))
        first = turn.first - segment.first
        samples = slice(first, min(turn.last - segment.first, first + round(LONG / segment.record.step)))
        t = segment.t[samples] - (turn.start - float(segment.record.t[segment.first]))
        for ax, name in zip(axes[:, j], SHOWN, strict=True):
            k = SIGNALS.index(name)
            if name in segment.measured:
                y = _display(segment.measured[name][samples], name)
                ax.plot(t, y, color=CRANE, lw=2.6, alpha=0.45, label="crane")
            for outputs, style in ((tuning.before[i], FILE | {"ls": "--"}), (tuning.after[i], TUNE)):
                label = f"twin, {style['label']}"
                ax.plot(t, _display(outputs[samples, k], name), lw=1.2, **style | {"label": label})
        title = f'test "{turn.test}", {turn.start:.1f} s: u_p {turn.before:+.2f} to {turn.after:+.2f}'
        axes[0, j].set_title(title, fontsize="medium")
        axes[-1, j].set_xlabel("time after the turn [s]")
    for ax, name in zip(axes[:, 0], SHOWN, strict=True):
        ax.set_ylabel(NAMES[name])
    pressures = axes[:2].ravel()
    lowest, highest = min(ax.get_ylim()[0] for ax in pressures), max(ax.get_ylim()[1] for ax in pressures)
    for ax in pressures:
        ax.set_ylim(lowest, highest)
    legend_below(figure, axes[0, :1], 3)
    return figure


def _residuals(time_segments: Sequence[DynamicsSegment], tuning: Tuning, swings: SwingComparison) -> Figure:
    """Twin less crane over the tests, before and after tuning."""
    title = "Twin less crane, driven by the measured commands"
    figure, grid = axes_of(len(SHOWN), 1, (12.0, 7.5), title, sharex=True)
    axes = grid[:, 0]
    for ax, name in zip(axes, SHOWN, strict=True):
        k = SIGNALS.index(name)
        start = 0.0
        for s, before, after in zip(time_segments, tuning.before, tuning.after, strict=True):
            if name not in s.measured:
                continue
            for outputs, style in ((before, FILE), (after, TUNE)):
                deviation = np.where(s.counted, outputs[:, k] - s.measured[name], np.nan)
                ax.plot(s.t + start, _display(deviation, name), lw=0.7, **style)
            start += float(s.t[-1])
        if name in swings.misfit_before:
            before_and_after = (percent_fixed(m[name], 1) for m in (swings.misfit_before, swings.misfit_after))
            text = "rms {} of the signal's own before, {} after".format(*before_and_after)
            ax.set_title(text, fontsize="small", loc="right")
        ax.set_ylabel(NAMES[name])
    axes[-1].set_xlabel("time in the tests [s]")
    legend_below(figure, axes[:1], 2)
    return figure


def _tuned(values: Sequence[TunedValue], tuning: Tuning) -> Figure:
    """Factors on the crane file with 95 % intervals: the three tuned values, and the free nuisance parameters."""
    title = "Tuned values with 95 % intervals; below the line: free nuisance parameters"
    figure, grid = axes_of(1, 1, (9.0, 5.0), title)
    ax, text = grid[0, 0], {"textcoords": "offset points", "va": "center", "fontsize": "small"}
    nuisances = [u.name for u in UNKNOWNS if u.name not in TUNED]
    for row, f in enumerate(values):
        x = f.factor
        if f.known:
            ends = [[x.value - x.low], [x.high - x.value]]
            ax.errorbar(x.value, -row, xerr=ends, fmt="o", color=TUNE["color"], capsize=4)
            ax.annotate(change(x.value - 1.0), (x.high, -row), (8, 0), **text)
        else:
            ax.annotate("not determined", (1.0, -row), (8, 0), color=GREY, **text)
    for row, name in enumerate(nuisances, start=len(values)):
        i = PLACE[name]
        logarithm, half = float(tuning.fit.theta[i]), NORMAL_95 * float(tuning.fit.covariance[i, i]) ** 0.5
        low, value, high = np.exp([logarithm - half, logarithm, logarithm + half])
        ax.errorbar(value, -row, xerr=[[value - low], [high - value]], fmt="s", ms=4, color=GREY, capsize=3)
    labels = [*(LETTERS[f.name] for f in values), *(name.replace("_", " ") for name in nuisances)]
    ax.axvline(1.0, color=CRANE, lw=0.8)
    ax.axhline(-2.5, color=GREY, lw=0.6, ls=":")
    ax.set_yticks([-row for row in range(len(labels))], labels)
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    low, high = min(low, 0.9), max(high, 1.1)
    ticks = [x for x in (FINE_TICKS if high < 2.0 * low else COARSE_TICKS) if low <= x <= high]
    ax.set_xticks(ticks, [f"{x:g}" for x in ticks])
    ax.set_xticks([], minor=True)
    ax.grid(visible=False, axis="y")
    ax.set(xlim=(low / 1.02, high * 1.06), xlabel="tuned over crane file [-]")
    return figure


def _display(y: FloatArray, name: str) -> FloatArray:
    return y * in_display(1.0, KIND[name])
