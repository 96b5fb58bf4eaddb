"""Figures of step 4: three turns before and after tuning, the residuals, and the tuned values with their
intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.plots.run import COLOURS, GREY
from stillhook.statistics.estimate import NORMAL_95
from stillhook.units import in_display
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import MARK, Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.data_set.records.transients import Transient
from stillhook.validate.dynamics.check import DynamicsStep
from stillhook.validate.dynamics.estimates import LETTERS
from stillhook.validate.dynamics.fitting.model import PLACE, TUNED, UNKNOWNS
from stillhook.validate.dynamics.runs import SIGNALS, DynamicsSegment

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = ("p_a", "p_b", "omega_m")
NAMES = {"p_a": "pressure A [bar]", "p_b": "pressure B [bar]", "omega_m": "motor speed [rev/min]"}
KIND = {"p_a": "pressure", "p_b": "pressure", "omega_m": "rotation"}
LONG = 4.0
"""Time that is shown of a turn [s]."""
CRANE, FILE, TUNE = "#000000", COLOURS[1], COLOURS[0]


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """The figures of step 4 by file stem; none where no test could be used."""
    if not isinstance(step, DynamicsStep) or step.tuning is None:
        return {}
    out = {"turns": _turns(step), "residuals": _residuals(step), "tuned": _tuned(step, campaign)}
    for figure in out.values():
        if campaign.synthetic:
            figure.text(
                0.995,
                0.002,
                f"{MARK}: simulated, not measured on a crane",
                ha="right",
                va="bottom",
                fontsize="x-small",
                color="#a00000",
            )
    return out


def _shown(step: DynamicsStep) -> list[Transient]:
    """Three turns: those with the largest changes, hoisting and lowering, and one to rest where there is one; in order
    of time."""
    rest = sorted((x for x in step.transients if abs(x.after) < 0.5 * abs(x.before)), key=lambda x: -abs(x.change))[:1]
    up = sorted((x for x in step.transients if x not in rest and x.change > 0.0), key=lambda x: -x.change)
    down = sorted((x for x in step.transients if x not in rest and x.change < 0.0), key=lambda x: x.change)
    chosen = [*up[:1], *down[:1], *rest]
    others = [x for x in step.transients if x not in chosen]
    return sorted((chosen + others)[:3], key=lambda x: (x.test, x.start))


def _turns(step: DynamicsStep) -> Figure:
    """p_a, p_b and omega_m in three turns: the crane, the twin as its file has it, the twin tuned."""
    figure = _figure((12.0, 8.5))
    turns = _shown(step)
    axes = figure.subplots(len(SHOWN), len(turns), sharex="col", squeeze=False)
    for j, turn in enumerate(turns):
        i, time_segment = next((i, s) for i, s in enumerate(step.time_segments) if s.holds(turn))
        t, took = _time(time_segment, turn)
        for ax, name in zip(axes[:, j], SHOWN, strict=True):
            k = SIGNALS.index(name)
            assert step.tuning is not None
            for y, style in (
                (time_segment.measured.get(name), {"color": CRANE, "lw": 2.6, "alpha": 0.45, "label": "crane"}),
                (step.tuning.before[i][:, k], {"color": FILE, "lw": 1.2, "ls": "--", "label": "twin, crane file"}),
                (step.tuning.after[i][:, k], {"color": TUNE, "lw": 1.2, "label": "twin, tuned"}),
            ):
                if y is not None:
                    ax.plot(t, _display(y[took], name), **style)
            ax.grid(alpha=0.3)
        axes[0, j].set_title(
            f'test "{turn.test}", {turn.start:.1f} s: u_p {turn.before:+.2f} to {turn.after:+.2f}', fontsize="medium"
        )
        axes[-1, j].set_xlabel("time after the turn [s]")
    for ax, name in zip(axes[:, 0], SHOWN, strict=True):
        ax.set_ylabel(NAMES[name])
    _share_y(axes)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle("Turns of the winch, the twin driven by the measured commands (paper F step 4)", fontsize="medium")
    return figure


def _share_y(axes: Any) -> None:
    """Both pressures on one scale over all turns."""
    pressures = axes[:2].ravel()
    low, high = min(ax.get_ylim()[0] for ax in pressures), max(ax.get_ylim()[1] for ax in pressures)
    for ax in pressures:
        ax.set_ylim(low, high)


def _residuals(step: DynamicsStep) -> Figure:
    """Twin less crane over the tests, before and after tuning."""
    figure = _figure((12.0, 7.5))
    axes = figure.subplots(len(SHOWN), 1, sharex=True)
    assert step.tuning is not None
    assert step.swings is not None
    for ax, name in zip(axes, SHOWN, strict=True):
        k = SIGNALS.index(name)
        at = 0.0
        for i, s in enumerate(step.time_segments):
            if name not in s.measured:
                continue
            for y, colour, label in (
                (step.tuning.before[i], FILE, "crane file"),
                (step.tuning.after[i], TUNE, "tuned"),
            ):
                off = np.where(s.counted, y[:, k] - s.measured[name], np.nan)
                ax.plot(s.t + at, _display(off, name), color=colour, lw=0.7, label=label if i == 0 else None)
            at += float(s.t[-1])
        if name in step.swings.misfit_before:
            before, after = step.swings.misfit_before[name], step.swings.misfit_after[name]
            ax.set_title(
                f"rms {100.0 * before:.1f} % of the signal's own before, {100.0 * after:.1f} % after",
                fontsize="small",
                loc="right",
            )
        ax.set_ylabel(NAMES[name])
        ax.grid(alpha=0.3)
    axes[-1].set_xlabel("time in the tests [s]")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle("Twin less crane, driven by the measured commands", fontsize="medium")
    return figure


def _tuned(step: DynamicsStep, campaign: Campaign) -> Figure:
    """Factors on the crane file with 95 % intervals: the three tuned values, and the free nuisance parameters."""
    figure = _figure((9.0, 5.0))
    ax: Axes = figure.subplots()
    rows: list[str] = []
    assert step.tuning is not None
    for f in step.tuned:
        y = -len(rows)
        rows.append(LETTERS[f.name])
        factor = f.factor
        if f.known:
            ends = [[factor.value - factor.low], [factor.high - factor.value]]
            ax.errorbar(factor.value, y, xerr=ends, fmt="o", color=TUNE, capsize=4)
            ax.annotate(
                f"{100.0 * (factor.value - 1.0):+.1f} %",
                (factor.high, y),
                (8, 0),
                textcoords="offset points",
                va="center",
                fontsize="small",
            )
        else:
            ax.annotate(
                "not determined",
                (1.0, y),
                (8, 0),
                textcoords="offset points",
                va="center",
                fontsize="small",
                color=GREY,
            )
    for u in (u for u in UNKNOWNS if u.name not in TUNED):
        i = PLACE[u.name]
        x, s = float(step.tuning.fit.theta[i]), NORMAL_95 * float(step.tuning.fit.covariance[i, i]) ** 0.5
        ax.errorbar(
            np.exp(x),
            -len(rows),
            xerr=[[np.exp(x) - np.exp(x - s)], [np.exp(x + s) - np.exp(x)]],
            fmt="s",
            ms=4,
            color=GREY,
            capsize=3,
        )
        rows.append(u.name.replace("_", " "))
    ax.axvline(1.0, color=CRANE, lw=0.8)
    ax.axhline(-2.5, color=GREY, lw=0.6, ls=":")
    ax.set_yticks([-i for i in range(len(rows))], rows)
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    low, high = min(low, 0.9), max(high, 1.1)
    ax.set_xlim(low / 1.02, high * 1.06)
    fine, coarse = (
        (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.7, 2.0),
        (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0, 10.0),
    )
    ticks = [x for x in (fine if high < 2.0 * low else coarse) if low <= x <= high]
    ax.set_xticks(ticks, [f"{x:g}" for x in ticks])
    ax.set_xticks([], minor=True)
    ax.grid(alpha=0.3, axis="x")
    ax.set_xlabel("tuned over crane file [-]")
    ax.set_title("Tuned values with 95 % intervals; below the line: free nuisance parameters", fontsize="medium")
    return figure


def _figure(size: tuple[float, float]) -> Figure:
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    return Figure(figsize=size, layout="constrained")


def _time(time_segment: DynamicsSegment, turn: Transient) -> tuple[FloatArray, slice]:
    """Time after a turn [s], and the turn's samples in a stretch."""
    first = turn.first - time_segment.first
    last = min(turn.last - time_segment.first, first + round(LONG / time_segment.record.step))
    took = slice(first, last)
    return time_segment.t[took] - (turn.start - float(time_segment.record.t[time_segment.first])), took


def _display(y: FloatArray, name: str) -> FloatArray:
    return y * in_display(1.0, KIND[name])
