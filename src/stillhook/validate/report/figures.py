"""Pictures of a validation: the tests (step 0), commands of the PLC (2), the winch at its limits (3), turns of
the winch (4), heave compensation after Moslatt 2020 paper F figure 10, and its windows after figures 11 to 13 (5)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report import document, kit
from stillhook.report.plots.colours import BLACK, BLUE, COLOURS, GREEN, GREY, RED
from stillhook.units import KINDS, in_display
from stillhook.validate.ahc.check import AhcEstimates
from stillhook.validate.ahc.comparison import Comparison
from stillhook.validate.controller.check import ControllerEstimates, difference
from stillhook.validate.controller.law import Run
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.record import Record, Transient, stretches_of
from stillhook.validate.dynamics.check import DynamicsEstimates
from stillhook.validate.dynamics.runs import SIGNALS
from stillhook.validate.speed_limits import SaturatedPart, SpeedLimits, machines_of
from stillhook.validate.validation import Validation
from stillhook.variables import WINDOW

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Figures = dict[str, "Figure"]

RESOLUTION = 150
"""Of pictures [dots per inch]: as wide as a page of the certificate, most have 220 on paper."""


MEASURED, SIMULATED, OTHER, FITTED = BLUE, RED, GREEN, BLACK
"""Colours: of the crane, the twin, a second run of it, and a fit to the logs."""
SHADE = "#DDDDDD"
POINTS = 1500
"""Points of a curve or dots of a cloud: twice the dots that a picture has."""


def panels(
    campaign: Campaign, title: str, rows: int, columns: int, size: tuple[float, float], **more: Any
) -> tuple[Figure, Any]:
    """A figure with its axes (rows, columns), always two-dimensional; size [inch]. The title says where the data are
    synthetic."""
    return kit.panels(rows, columns, size, f"SYNTHETIC. {title}" if campaign.synthetic else title, **more)


@dataclass(frozen=True)
class Curves:
    """A panel over time: t (n,) [s]; measured (n,), None where it was not logged; simulated: label, colour and series
    (n,) of each run of the twin; shaded: spans of time."""

    t: FloatArray
    measured: FloatArray | None
    simulated: Sequence[tuple[str, str, FloatArray]] = ()
    shaded: Sequence[tuple[float, float]] = ()

    @property
    def series(self) -> list[FloatArray]:
        """All curves of the panel."""
        return [*([] if self.measured is None else [self.measured]), *(y for *_, y in self.simulated)]


def over_time(
    campaign: Campaign,
    title: str,
    words: str,
    columns: Sequence[tuple[str, Sequence[Curves]]],
    names: Sequence[str],
    size: tuple[float, float],
    *,
    time: str = "time [s]",
) -> Figure:
    """Measured and simulated curves: columns with a title each, and a panel for each name [unit]; words: the caption.
    A row of panels in which nothing varies is a sentence of the caption, one such panel among others a line of text."""
    kept = [i for i in range(len(names)) if any(kit.varies(*curves[i].series) for _, curves in columns)] or [0]
    same = [
        f"Not drawn, because it does not vary: {name.splitlines()[0].lower()}."
        for i, name in enumerate(names)
        if i not in kept
    ]
    size = size[0], size[1] * (0.2 + 0.8 * len(kept) / len(names))
    figure, axes = panels(campaign, title, len(kept), len(columns), size, sharex="col")
    for column, (heading, every) in zip(axes.T, columns, strict=True):
        curves = [every[i] for i in kept]
        for ax, c in zip(column, curves, strict=True):
            if c.series and not kit.varies(*c.series):
                _constant(ax, float(np.nanmean(c.series[0])))
                continue
            if c.measured is not None:
                ax.plot(c.t, c.measured, color=MEASURED, lw=1.6, label="measured")
            width, style = (0.8, "-") if c.measured is None else (1.1, "--")  # dashes show what is below them
            for label, colour, y in c.simulated:
                ax.plot(c.t, y, color=colour, lw=width, ls=style, label=label)
            for a, b in c.shaded:
                ax.axvspan(a, b, color=SHADE, lw=0.0, zorder=0)
        column[0].set_title(heading, fontsize="small")
        column[-1].set(xlabel=time, xlim=(curves[0].t[0], curves[0].t[-1]))
    return kit.caption(finish(figure, axes, [names[i] for i in kept], 4), " ".join([words, *same]))


def _constant(ax: Any, value: float) -> None:
    """What is drawn in place of a panel whose values do not vary."""
    text = f"{value:.4g} throughout"
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=GREY, fontsize="small")
    ax.set_yticks([])


def finish(figure: Figure, axes: Any, names: Sequence[str], columns: int) -> Figure:
    """The figure with names of its vertical axes from the top, and one legend of all axes below it."""
    for ax, name in zip(axes[:, 0], names, strict=True):
        ax.set_ylabel(name)
    figure.align_ylabels(axes[:, 0])
    kit.legend_below(figure, np.ravel(axes), columns)
    return figure


ROWS = 8
"""Tests in one overview; further ones are in the tables only."""
SHOWN = (
    ("s_tip", "crane tip [m], up positive", BLUE, 1.0),
    ("s_w", "wire paid out [m]", GREEN, 1.0),
    ("F_w", "load cell [kN]", RED, 1e-3),
)
"""Signals of the overview, their titles and colours, and the factor to the unit of their axis."""


def tests(records: tuple[Record, ...], campaign: Campaign) -> Figures:
    """Tip, wire and load cell of every test over time; unused parts shaded."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shown = records[:ROWS]
    if not shown:
        return {}
    title, size = "The tests; shaded parts are not used", (11.0, 1.5 + 1.35 * len(shown))
    figure, axes = panels(campaign, title, len(shown), len(SHOWN), size)
    for row, record in zip(axes, shown, strict=True):
        for ax, (name, _, colour, scale) in zip(row, SHOWN, strict=True):
            _panel(ax, record, name, colour, scale)
        row[0].set_ylabel(f'test "{record.test.name}"', fontsize="small")
    for ax, (_, name, *_) in zip(axes[0], SHOWN, strict=True):
        ax.set_title(name, fontsize="small")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    handles: list[Any] = [
        Patch(color=SHADE, label="not used"),
        Line2D([], [], color=GREY, ls=":", label="start of another load case"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize="small", frameon=False)
    more = f" The first {ROWS} of {len(records)} tests." if len(records) > ROWS else ""
    words = (
        "Motion of the crane tip, wire paid out and load cell of each test over time. Grey: not used in any load case."
    )
    return {"tests": kit.caption(figure, f"{words} Dotted: start of another load case.{more}")}


def _panel(ax: Any, record: Record, name: str, colour: str, scale: float) -> None:
    t = record.t + record.zero
    unused = np.ones(len(t), np.bool_)
    for s in record.segments:
        unused[s.first : s.last] = False
    for a, b in stretches_of(unused):
        ax.axvspan(t[a], t[min(b, len(t) - 1)], color=SHADE, lw=0)
    for s in record.segments[1:]:
        ax.axvline(t[s.first], color=GREY, ls=":", lw=0.9)
    ax.set_xlim(t[0], t[-1])
    ax.tick_params(labelsize="x-small")
    if name not in record.signals or not np.isfinite(record.signals[name]).any():
        ax.text(0.5, 0.5, "not logged", transform=ax.transAxes, ha="center", va="center", color=GREY, fontsize="small")
        ax.set_yticks([])
        return
    low, high = _envelope(scale * record.signals[name])
    if np.nanmax(high) - np.nanmin(low) < 0.02 * scale:  # noise alone
        _constant(ax, 0.5 * float(np.nanmax(high) + np.nanmin(low)))
        return
    ax.fill_between(np.linspace(t[0], t[-1], len(low)), low, high, color=colour, lw=0.6, edgecolor=colour)


def _envelope(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest value of every piece, NaN where nothing is known."""
    edges = np.linspace(0, len(x), min(len(x), POINTS) + 1).astype(int)
    pieces = [x[a:b][np.isfinite(x[a:b])] for a, b in pairwise(edges)]
    low, high = (np.array([f(p) if len(p) else np.nan for p in pieces]) for f in (np.min, np.max))
    return low, high


COMMANDS = 60.0
"""Plotted length of the commands of a test [s]."""
MOST = 3
"""Tests, or parts, that are plotted."""


def commands(estimates: ControllerEstimates, campaign: Campaign) -> Figures:
    """Commands about the largest one of each test, and their deviation; a drive without a closed circuit takes a speed
    alone."""
    largest: dict[str, tuple[float, Run, slice]] = {}
    for run in (r for r in estimates.runs if any(p.mode.compensates for p in r.segment.parts)):
        u, n = np.abs(run.segment.u_p), round(COMMANDS / run.step)
        at = int(np.nanargmax(u))
        first = int(np.clip(at - n // 2, 0, max(0, len(u) - n)))
        if run.test not in largest or u[at] > largest[run.test][0]:
            largest[run.test] = (float(u[at]), run, slice(first, first + n))
    best = sorted(largest, key=lambda n: -largest[n][0])[:MOST]
    machines = {"u_p": "pump", "u_m": "motor"} if "active" in campaign.crane.circuits else {"u_p": "speed"}
    columns = []
    for test, (_, run, part) in largest.items():
        if test not in best:
            continue
        s = run.segment
        t = s.record.t[s.first : s.last][part]
        curves, off = [], []
        for colour, (signal, machine) in zip(COLOURS[2:], machines.items(), strict=False):
            measured, simulated = getattr(s, signal), 100.0 * getattr(run.simulated, signal)[part]
            logged = None if measured is None else 100.0 * measured[part]
            curves.append(Curves(t, logged, [("simulated", SIMULATED, simulated)]))
            if (d := difference(run, signal, estimates.rows.cycles)) is not None:
                off.append((f"{machine} command, measured less simulated", colour, 100.0 * d[part]))
        columns.append((f"test {test}, mode {s.parts[0].mode.value}", [*curves, Curves(t, None, off)]))
    names = [f"{machine} command [%]" for machine in machines.values()]
    names[0] += "\n(hoisting positive)"
    title, size = "Commands of the PLC over its logged inputs", (4.0 + 3.4 * len(columns), 2.5 * (len(machines) + 1))
    words = (
        f"Commands of the PLC for {COMMANDS:g} s about the largest one of a test, measured and computed by the twin's"
        " controller from the logged inputs, and their deviation."
    )
    names = [*names, "deviation\n[% of full command]"]
    return {"commands": over_time(campaign, title, words, columns, names, size)}


LIMITED = 90.0
"""Longest stretch of a part at its limits that is plotted [s]."""
AT_LIMITS = (
    ("v_w", 60.0, "wire speed [m/min]\n(hoisting positive)"),
    ("u_p", 100.0, "{command} command [%]"),
    ("alpha_m", 100.0, "motors' displacement [%]"),
)
"""Curves at the limits: signal, factor to the unit of its axis, label of the axis."""


def at_limits(estimates: SpeedLimits, campaign: Campaign) -> Figures:
    """The parts with most saturation; where no pump comes to its end, one part that comes near it."""
    most = sorted(estimates.parts, key=lambda p: -int(p.saturated.sum()))
    saturated = [p for p in most if p.saturated.any() or (p.twin_saturated is not None and p.twin_saturated.any())]
    return {f"at-limits-{i + 1}": _at_limits(p, campaign) for i, p in enumerate(saturated[:MOST] or most[:1])}


def _at_limits(p: SaturatedPart, campaign: Campaign) -> Figure:
    shown, cut = [panel for panel in AT_LIMITS if panel[0] in p.driven], _window(p)
    t, curves = p.t[cut], []
    spans = [(p.t[a], p.t[b - 1]) for a, b in p.spans() if p.t[b - 1] >= t[0] and p.t[a] <= t[-1]]
    for name, scale, _ in shown:
        measured, twins = p.v_w if name == "v_w" else p.signals.get(name), []
        if name != "u_p" and np.isfinite(p.driven[name][cut]).any():
            twins.append(("twin driven by the measured commands", SIMULATED, scale * p.driven[name][cut]))
        if p.complete is not None:
            twins.append(("complete twin on tip motion and joystick", OTHER, scale * p.complete[name][cut]))
        curves.append(Curves(t, None if measured is None else scale * measured[cut], twins, spans))
    words, seconds = machines_of(campaign.crane), f"{p.saturated.sum() * p.step:.1f} s"
    title = f"Test {p.name}, mode {p.segment.mode.value}: {words['machines']} saturated (shaded) for {seconds}"
    names = [label.format(**words) for *_, label in shown]
    whole = "" if p.complete is None else "; complete twin driven by tip motion and joystick"
    caption = (
        f'Winch at its limits in test "{p.name}" from {t[0]:.0f} s on, saturated where shaded: measured; twin driven by'
        f" the measured commands{whole}."
    )
    return over_time(campaign, title, caption, [("", curves)], names, (10.0, 8.0))


def _window(p: SaturatedPart) -> slice:
    """All of a part, or of a long one the stretch with the most time at an end."""
    n = round(LIMITED / p.step)
    if len(p.t) <= n:
        return slice(None)
    much = np.concatenate([[0], np.cumsum(p.saturated)])
    at = int(np.argmax(much[n:] - much[:-n])) if p.saturated.any() else int(np.argmax(np.abs(p.signals["u_p"])))
    first = int(np.clip(at, 0, len(p.t) - n))
    return slice(first, first + n)


IN_TURNS = (
    ("p_a", "pressure A", "pressure"),
    ("p_b", "pressure B", "pressure"),
    ("omega_m", "motor speed", "rotation"),
)
"""Signals in the turns, their names, and their quantities."""
TURN = 4.0
"""Time that is shown of a turn [s]."""


def turns(estimates: DynamicsEstimates, campaign: Campaign) -> Figures:
    """p_a, p_b and omega_m in three turns: the crane, the twin as its file has it, the twin tuned."""
    columns, tuning = [], estimates.tuning
    for turn in _three(estimates):
        i, segment = next((i, s) for i, s in enumerate(estimates.time_segments) if s.holds(turn))
        first = turn.first - segment.first
        part = slice(first, min(turn.last - segment.first, first + round(TURN / segment.record.step)))
        t = segment.t[part] - (turn.start - float(segment.record.t[segment.first]))
        curves = []
        for name, _, kind in IN_TURNS:
            k, unit = SIGNALS.index(name), in_display(1.0, kind)
            twins = [
                ("twin, crane file", SIMULATED, unit * tuning.before[i][part, k]),
                ("twin, tuned", FITTED, unit * tuning.after[i][part, k]),
            ]
            measured = unit * segment.measured[name][part] if name in segment.measured else None
            curves.append(Curves(t, measured, twins))
        change = f"u_p {turn.before:+.2f} to {turn.after:+.2f}"
        columns.append((f'test "{turn.test}", {turn.start:.1f} s: {change}', curves))
    names = [f"{words} [{KINDS[kind].display}]" for _, words, kind in IN_TURNS]
    title = "Turns of the winch, the twin driven by the measured commands (paper F step 4)"
    words = (
        f"Pressures and motor speed in the first {TURN:g} s of {len(columns)} turns of the winch: measured, and the"
        " twin driven by the measured commands with the values of the crane file and with the tuned ones."
    )
    return {"turns": over_time(campaign, title, words, columns, names, (12.0, 8.5), time="time after the turn [s]")}


def _three(estimates: DynamicsEstimates) -> list[Transient]:
    """Three turns: those with the largest changes, hoisting and lowering, and one to rest where there is one; in order
    of time."""
    largest = sorted(estimates.transients, key=lambda x: -abs(x.change))
    to_rest = [x for x in largest if abs(x.after) < 0.5 * abs(x.before)][:1]
    ways = [[x for x in largest if x not in to_rest and (x.change > 0.0) == up][:1] for up in (True, False)]
    chosen = [*ways[0], *ways[1], *to_rest]
    others = [x for x in estimates.transients if x not in chosen]
    return sorted((chosen + others)[:3], key=lambda x: (x.test, x.start))


COMPENSATED = 300.0
"""Plotted length of a load case [s], as in figure 10."""


def compensation(estimates: AhcEstimates, campaign: Campaign) -> Figures:
    """Tip, wire speed and control error of the last load case that is long enough, else of the longest: as print shows
    its load case 4."""
    long = [c for c in estimates.comparisons if c.seconds >= 0.8 * COMPENSATED]
    c = long[-1] if long else max(estimates.comparisons, key=lambda c: len(c.e_measured))
    some, s = slice(min(len(c.e_measured), round(COMPENSATED / c.replay.record.step))), c.replay.segment
    t, s_tip = c.replay.t[some] - c.replay.t[0], c.replay.s_tip[some]
    pairs = ((60.0, _wire_speed(c), c.simulated["v_w"]), (100.0, c.e_measured, c.e_simulated))
    curves = [Curves(t, s_tip - s_tip.mean())]
    curves += [Curves(t, k * x[some], [("simulated", SIMULATED, k * y[some])]) for k, x, y in pairs]
    title = f"Load case {c.name}: {s.load / 1e3:.0f} t, {s.s_w:.0f} m of wire out, mode {s.mode.value}"
    names = ("crane tip [m]\n(up positive)", "wire speed [m/min]\n(hoisting positive)", "control error [cm]")
    words = (
        f"Heave compensation in load case {c.name}: motion of the crane tip, wire speed and control error, measured and"
        " simulated by the complete twin from the tip's motion alone."
    )
    return {"tip-wire-speed-and-error": over_time(campaign, title, words, [("", curves)], names, (10.0, 8.0))}


def _wire_speed(c: Comparison) -> FloatArray:
    """Measured wire speed: logged, or else the slope of the wire paid out."""
    if c.replay.record.has("v_w"):
        return c.replay.measured("v_w")
    return np.asarray(-np.gradient(c.replay.measured("s_w"), c.replay.record.step))


BIN = 0.25
"""Width of the bins of tip motion [m]."""


def windows(estimates: AhcEstimates, campaign: Campaign) -> Figures:
    """Control error, efficiency and the deviation of the error over the tip's motion, by windows; none without."""
    comparisons = [c for c in estimates.comparisons if len(c.windows.x)]
    if not comparisons:
        return {}
    figure, axes = panels(campaign, "Control error over moving windows, all load cases", 1, 3, (14.0, 5.0))
    w = {
        name: np.concatenate([getattr(c.windows, name) for c in comparisons])
        for name in ("s_tip_pp", "measured", "simulated", "eta_measured", "eta_simulated", "x")
    }
    tip, (error, efficiency, deviation) = w["s_tip_pp"], axes[0]
    for colour, label in ((MEASURED, "measured"), (SIMULATED, "simulated")):
        _cloud(error, tip, 100.0 * w[label], colour, label)
        _cloud(efficiency, tip, 100.0 * w[f"eta_{label}"], colour, label)
    _cloud(deviation, tip, 100.0 * w["x"], OTHER, "deviation")
    cell = np.floor(tip / BIN)
    bins = np.unique(cell)
    means = [100.0 * w["x"][cell == i].mean() for i in bins]
    deviation.plot((bins + 0.5) * BIN, means, "o-", color=FITTED, lw=1.5, ms=4, label=f"average over {BIN:g} m")
    efficiency.set_ylabel("compensation efficiency [%]")
    deviation.set(ylabel="deviation of the control error [cm]", ylim=(0.0, None))
    error.set(ylim=(0.0, None))
    for ax in axes[0]:
        ax.set_xlabel("crane tip, peak to peak [m]")
    words = (
        f"Control error (left) and compensation efficiency (middle) over the motion of the tip in moving windows of"
        f" {WINDOW:g} s, measured and simulated; deviation of the control error (right), with its average over bins of"
        f" {BIN:g} m. All load cases."
    )
    return {"windows": kit.caption(finish(figure, axes, ("control error, peak to peak [cm]",), 4), words)}


def _cloud(ax: Any, x: FloatArray, y: FloatArray, colour: str, label: str) -> None:
    """Samples or windows as dots, some `POINTS` of them."""
    some = slice(None, None, max(1, len(x) // POINTS))
    ax.plot(x[some], y[some], ".", ms=3, alpha=0.6, color=colour, label=label, rasterized=True)


FIGURES: Mapping[StepNumber, tuple[Callable[..., dict[str, Any]], ...]] = {
    StepNumber.DATA: (tests,),
    StepNumber.CONTROLLER: (commands,),
    StepNumber.LIMITS: (at_limits,),
    StepNumber.DYNAMICS: (turns,),
    StepNumber.AHC: (compensation, windows),
}
"""What is drawn of the estimates of a step and the campaign."""


def pictures(validation: Validation) -> dict[str, document.Figure]:
    """Every figure with its caption, by file stem: the same bytes with any settings of matplotlib."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        return kit.printed(figures(validation), RESOLUTION)


def figures(validation: Validation) -> dict[str, Figure]:
    """Every figure of a validation by file stem, "step-5-..."; none of a step that could not be taken."""
    out: dict[str, Figure] = {}
    for step in validation.steps:
        if step.estimates is None:
            continue
        for draw in FIGURES.get(step.number, ()):
            drawn = draw(step.estimates, validation.campaign)
            out |= {f"step-{int(step.number)}-{name}": figure for name, figure in drawn.items()}
    return out
