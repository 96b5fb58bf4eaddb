"""Figure of step 4: three turns of the winch, before and after tuning."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.units import KINDS, in_display
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.plots import FITTED, SIMULATED, crane, finish, panels, twin
from stillhook.validate.data_set.records.record import Record, Transient
from stillhook.validate.dynamics.check import DynamicsEstimates
from stillhook.validate.dynamics.runs import SIGNALS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = (("p_a", "pressure A", "pressure"), ("p_b", "pressure B", "pressure"), ("omega_m", "motor speed", "rotation"))
"""Signals, their names, and their quantities."""
LONG = 4.0
"""Time that is shown of a turn [s]."""


def figures(estimates: DynamicsEstimates, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """p_a, p_b and omega_m in three turns: the crane, the twin as its file has it, the twin tuned."""
    turns, tuning = _shown(estimates), estimates.tuning
    title = "Turns of the winch, the twin driven by the measured commands (paper F step 4)"
    figure, axes = panels(campaign, title, len(SHOWN), len(turns), (12.0, 8.5), sharex="col")
    for column, turn in zip(axes.T, turns, strict=True):
        i, segment = next((i, s) for i, s in enumerate(estimates.time_segments) if s.holds(turn))
        first = turn.first - segment.first
        part = slice(first, min(turn.last - segment.first, first + round(LONG / segment.record.step)))
        t = segment.t[part] - (turn.start - float(segment.record.t[segment.first]))
        for ax, (name, _, kind) in zip(column, SHOWN, strict=True):
            k, unit = SIGNALS.index(name), in_display(1.0, kind)
            crane(ax, t, unit * segment.measured[name][part] if name in segment.measured else None)
            twin(ax, t, unit * tuning.before[i][part, k], "twin, crane file", SIMULATED)
            twin(ax, t, unit * tuning.after[i][part, k], "twin, tuned", FITTED)
        change = f"u_p {turn.before:+.2f} to {turn.after:+.2f}"
        column[0].set_title(f'test "{turn.test}", {turn.start:.1f} s: {change}', fontsize="medium")
        column[-1].set_xlabel("time after the turn [s]")
    names = [f"{words} [{KINDS[kind].display}]" for _, words, kind in SHOWN]
    return {"turns": finish(figure, axes, names, 3)}


def _shown(estimates: DynamicsEstimates) -> list[Transient]:
    """Three turns: those with the largest changes, hoisting and lowering, and one to rest where there is one; in order
    of time."""
    largest = sorted(estimates.transients, key=lambda x: -abs(x.change))
    to_rest = [x for x in largest if abs(x.after) < 0.5 * abs(x.before)][:1]
    ways = [[x for x in largest if x not in to_rest and (x.change > 0.0) == up][:1] for up in (True, False)]
    chosen = [*ways[0], *ways[1], *to_rest]
    others = [x for x in estimates.transients if x not in chosen]
    return sorted((chosen + others)[:3], key=lambda x: (x.test, x.start))
