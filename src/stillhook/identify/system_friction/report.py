"""The result of `identify friction` for a reader: a document, and figures as the thesis has them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.identify.system_friction.fitting.fit import predicted, predicted_sd
from stillhook.identify.system_friction.fitting.model import (
    Y_NAMES,
    Loss,
    Points,
    Y,
    loss_of,
    motor_loss_at,
    system_friction,
)
from stillhook.identify.system_friction.fitting.second_loop import SecondLoop
from stillhook.identify.system_friction.fitting.uncertainty import correlation
from stillhook.identify.system_friction.identify import JUDGED_FROM, Friction, nominal_share
from stillhook.identify.system_friction.result import test_rows
from stillhook.report.document import Bullets, Document, Figure, Part, Section, Table, Text, Verdict
from stillhook.report.formatting import EMPTY, fmt
from stillhook.report.kit import axis, band, display, legend_below, panel, panels, threshold
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.statistics.estimate import NORMAL_95, t_factor
from stillhook.units import number, parse, show
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

CAPTIONS = {
    "friction-pressure": (
        "Half the difference of the hoisting and lowering pressure drops. Bars: 95 %. Lines: interpolated to 25"
        " rev/min."
    ),
    "friction-torque": (
        "What one motor shaft loses: friction as pressure, times D_m. Bars: 95 %. Hollow points and dashed lines:"
        " held-out tests, which no fit has seen."
    ),
    "system-friction": "What is left for gears, drum, sheaves and wire after the motor loss.",
    "model-against-measured": "All motors together. Points on the line are predicted exactly.",
    "error": (
        "Grey: 1 % of the nominal torque, the thesis's claim from 250 rev/min (dashed) on. Low loads have little"
        " nominal torque."
    ),
    "second-loop-motor": "What the crane's tests make of the supplier's motor model.",
    "model-and-map": "The map is exact in its own cells, with nothing outside; the model smooths and extrapolates.",
    "second-loop-system": "With a right motor model, tests of one load fall on one curve at every displacement.",
}
MAX_SIMILAR = 2
"""Findings of one kind in one signal of a log that are reported one by one."""
GRID_BIAS = 1.5
"""Cost of our fit on the thesis's grid over the least one there from which the difference is worth reporting."""
BENT = (
    "This set is fitted to the pairs themselves; the straight lines between them on the grid bend what the grid's best"
    " follows."
)
NOTHING_HELD_OUT = (
    "No test was held out. Hold one out to see how well the friction of other loads and displacements is predicted."
)
METHOD = (
    "Steady stretches of the logs, hoisting and lowering of about the same speed in pairs; half the difference"
    " of their pressure drops is the mean of both losses, with which the models are compared at both pressures and"
    " speeds (G.-A. Moslåt 2020, section 2.2 and paper D). The intervals hold the scatter that the points show. Not in"
    " them: a gain error of pressure sensors or displacement, which makes the complete friction wrong in the same"
    " proportion and the system friction by more, and a wrong motor model, which moves the parameters."
)


def _parameter(name: str, value: float | None, digits: int = 4) -> str:
    """A parameter in its display unit; a dash for one that there is none of."""
    if value is not None and math.isinf(value):
        return "open"
    if (kind := BY_NAME[name].kind) or not value or math.isnan(value):
        return fmt(value, kind, digits)
    return f"{value:.{digits - 1}e}"


def report(result: Friction, pictures: Mapping[str, bytes], windows: Mapping[str, bytes] | None = None) -> Document:
    """The report. pictures PNG by stem (see `figures`); windows PNG of the logs by test name."""
    campaign, loop = result.campaign, result.second
    shown = [Figure(png, CAPTIONS[stem]) for stem, png in pictures.items()]
    shown += [Figure(png, f"Test {name}: stretches used, and not used.") for name, png in (windows or {}).items()]
    sections = [
        _parameters(result),
        Section("What the data cannot determine", _weaknesses(result)),
        _tests(result),
        _methods(result),
        *(
            []
            if loop is None
            else [Section(f"Second loop (paper D section 3): {loop.verdict}", [Bullets(loop.statements)])]
        ),
        *_mapped(result),
        _proposals(result),
        *([Section("Figures", shown)] if shown else []),
        Section("Method", [Text(METHOD)]),
    ]
    return Document(
        title=f"Friction of {campaign.crane.name}",
        name=campaign.title,
        marks=["SYNTHETIC: these logs were simulated, not measured"] if campaign.synthetic else [],
        front=[_verdict(result)],
        sections=sections,
    )


def _verdict(result: Friction) -> Verdict:
    held_out = sum(m.test.hold_out for m in result.measured)
    used, pairs = len(result.measured) - held_out, len(result.points.fitted())
    advice = "The set can be used where the campaign has been."
    if not result.usable:
        advice = "The set must not be used as it is: see below."
    text = f"{used} tests fitted ({pairs} pairs of steady stretches), {held_out} held out. {advice}"
    return Verdict(text, result.usable)


def _parameters(result: Friction) -> Section:
    rows = []
    for n in Y_NAMES:
        i, value = result.intervals.get(n), float(getattr(result.fit.y, n))
        ends = (_parameter(n, i.low if i else None), _parameter(n, i.high if i else None))
        state = " (taken from another set)" if n in result.fit.prescribed else ""
        state = " (left out)" if n in result.fit.dropped else state
        rows.append((n, _parameter(n, value), *ends, BY_NAME[n].meaning + state))
    equation = (
        "T_fs = (Y_1 T_d + Y_3) exp(-|n_m| / Y_4) + Y_2 + Y_5 |omega_m| + Y_6 T_d, T_d the drum torque. "
        f"Intervals: 95 %, profile. Motor loss: {result.campaign.losses.name} ({result.campaign.motor.law.upper()})."
    )
    matrix, names = correlation(result.fit), result.fit.names
    correlations = [
        [name, *(f"{matrix[i, j]:.2f}" if j <= i else "" for j in range(len(names)))] for i, name in enumerate(names)
    ]
    parts: list[Part] = [
        Text(equation),
        Table(("", "value", "from", "to", "meaning"), rows),
        Text("Correlation of the fitted parameters: near 1 or -1, only their combination is known."),
        Table(("", *names), correlations),
    ]
    return Section("System friction per motor shaft (eq. 2.7)", parts)


def _weaknesses(result: Friction) -> list[Part]:
    if not result.statements:
        return [Text("No weakness found: loads, speeds and displacements of the campaign distinguish all parameters.")]
    severe = [Verdict(f"NOT USABLE: {s.text}", passed=False) for s in result.statements if s.severe]
    return [*severe, Bullets([s.text for s in result.statements if not s.severe])]


def _tests(result: Friction) -> Section:
    header = ("test", "use", "load", "load by\npressures", "displacement\nof a motor", "motor speeds", "pairs")
    explained = (
        "Not used: stretches left out, see stretches.csv. Error: model less measured, of nominal torque D_m dp_m."
    )
    parts: list[Part] = [
        Table((*header, "not\nused", "error\n(RMS)"), [_test(t) for t in test_rows(result)]),
        Text(explained),
        Bullets(list(_remarks(result))),
        *_held_out(result),
    ]
    return Section("Tests", parts)


def _test(t: Mapping[str, Any]) -> Sequence[str]:
    speeds = f"{show(t['omega_m_min'], 'rotation', 3).split()[0]} to {show(t['omega_m_max'], 'rotation', 3)}"
    return (
        t["name"],
        "held out" if t["hold_out"] else "fitted",
        show(t["load"], "mass", 3),
        EMPTY if math.isnan(t["load_carried"]) else f"{t['load_carried'] / 1e3:.1f} t",
        show(t["D_m"], "displacement", 4),
        speeds,
        str(t["pairs"]),
        str(t["rejected"] + t["unpaired"]),
        f"{t['rms_percent']:.2f} %",
    )


def _remarks(result: Friction) -> Iterator[str]:
    """What was noted about each test and found in its log; many findings of one kind are counted."""
    for m in result.measured:
        similar: dict[tuple[str, str], list[str]] = {}
        for f in m.log.findings:
            similar.setdefault((f.signal, f.kind), []).append(f.text)
        for texts in similar.values():
            yield from (f"test {m.test.name}: {text}" for text in texts[:MAX_SIMILAR])
            if len(texts) > MAX_SIMILAR:
                more = len(texts) - MAX_SIMILAR
                yield f"test {m.test.name}: ... and {more} more of this kind (all of them in summary.json)"
        yield from (f"test {m.test.name}: {n.text}" for n in m.notes)


def _held_out(result: Friction) -> list[Part]:
    if not result.held_out:
        return [Text(NOTHING_HELD_OUT)]
    rows = [(h.test, f"{h.rms:.2f} %", f"{h.worst:.2f} %", str(h.count)) for h in result.held_out]
    speed = show(JUDGED_FROM, "rotation", 3)
    text = f"Held-out tests, from {speed} on, in % of nominal torque:"
    return [Text(text), Table(("test", "RMS", "largest", "pairs"), rows)]


def _methods(result: Friction) -> Section:
    c = result.check

    def row(label: str, y: Y, cost: float) -> Sequence[str]:
        return label, *(_parameter(n, float(getattr(y, n))) for n in Y_NAMES), number(cost, 5)

    where = "25 rev/min grid" if c.on_grid else "pairs"
    rows = [
        row("pairs, weighted (ours)", result.fit.y, c.cost_ours),
        row(f"{where}, least squares", c.y_grid, c.cost_grid),
        row(f"{where}, complex method", c.y_complex, c.optimum.cost),
    ]
    agreement = (
        f"Least squares and the complex method ({c.optimum.evaluations} evaluations) reach the same cost."
        if c.agree
        else f"The complex method stopped at {number(c.optimum.cost, 5)} after {c.optimum.evaluations} evaluations,"
        f" least squares reaches {number(c.cost_grid, 5)}: it got stuck; another seed or variant helps."
    )
    parts: list[Part] = [Table(("", *Y_NAMES, "cost E\n[N²m²]"), rows), Text(agreement)]
    parts += [Text(BENT)] if c.on_grid and c.cost_ours > GRID_BIAS * c.cost_grid else []
    return Section("Our fit next to the thesis's", parts)


def _mapped(result: Friction) -> list[Section]:
    """What the map does better or worse than the model."""
    m = result.mapped
    if m is None:
        return []
    text = (
        f"Residual {show(m.rms_model, 'torque', 3)} a motor (RMS) with the fitted model, {show(m.rms_map, 'torque', 3)}"
        f" with the map {m.source} itself; {m.outside:.0%} of the points are outside the map, where its edge is held."
    )
    return [Section("The supplier's map instead of the fitted model (paper D figure 13)", [Text(text)])]


def _proposals(result: Friction) -> Section:
    header = ("load", "displacement\nof one motor", "uncertainty of\npredicted friction")
    rows = []
    for p in result.proposals:
        before, after = ("unknown" if sd is None else show(sd, "torque", 2) for sd in (p.sd_before, p.sd_after))
        rows.append((show(p.load, "mass", 3), show(p.D_m, "displacement", 3), f"{before} to {after} per motor"))
    return Section("What to test next", [Table(header, rows)])


SIZE = (9.0, 5.0)
MARK = "SYNTHETIC: simulated, measured on no crane"
MARKERS = "osD^v<>pP*Xh"
SPEED = "motor speed [rev/min]"


def figures(result: Friction) -> Mapping[str, Picture]:
    """All figures of a result by file stem, in the order in which a report shows them."""
    out = {
        "friction-pressure": friction_pressure(result),
        "friction-torque": friction_torque(result),
        "system-friction": system_friction_figure(result),
        "model-against-measured": model_against_measured(result),
        "error": error_figure(result),
    }
    if result.second is not None:
        out["second-loop-motor"] = motor_old_and_new(result, result.second)
        losses = {"first loop": result.loss, "second loop": loss_of(result.second.motor)}
        title = "System friction derived with the motor model of each loop (as paper D figures 11, 12, 14)"
        out["second-loop-system"] = derived_system_friction(result, losses, title)
    if result.mapped is not None:
        losses = {
            f"fitted model ({result.campaign.motor.law.upper()})": result.loss,
            "supplier's map": result.mapped.loss,
        }
        title = "System friction derived with the fitted motor model and with the supplier's map (as paper D figure 13)"
        out["model-and-map"] = derived_system_friction(result, losses, title)
    if result.campaign.synthetic:
        for figure in out.values():
            figure.text(0.995, 0.005, MARK, ha="right", va="bottom", fontsize="x-small", color="#a00000")
    return out


def friction_pressure(result: Friction) -> Picture:
    """dp_F over motor speed, by test (thesis figure 2.6): pairs with 95 % bars, the 25 rev/min grid as lines."""
    figure, ax = panel(SIZE, "Friction as pressure, dp_F = (dp_up - dp_down) / 2 (as figure 2.6)")
    for style, points in _by_test(result):
        speed, dp_F = display(points.omega, "rotation"), display(points.dp_F, "pressure")
        bars = display(NORMAL_95 * np.hypot(points.u_dp, result.fit.tau), "pressure")
        ax.errorbar(speed, dp_F, yerr=bars, ls="none", capsize=2, **style)
        grid = result.grid.where(result.grid.test == points.test[0])
        ax.plot(display(grid.omega, "rotation"), display(grid.dp_F, "pressure"), lw=0.8, color=style["color"])
    return _finished(figure, ax, "dp_F [bar]")


def friction_torque(result: Friction) -> Picture:
    """Friction torque per motor shaft over speed, by test, with 95 % bars and the model (figures 2.6, 2.7, 2.12; paper
    D figure 7)."""
    title = "Friction torque per motor shaft, measured (points) and modelled (lines) (as figures 2.7, 2.12)"
    figure, ax = panel(SIZE, title)
    for style, points in _by_test(result):
        speed, modelled = display(points.omega, "rotation"), predicted(points, result.loss, result.fit.y)
        bars = NORMAL_95 * points.D_m * np.hypot(points.u_dp, result.fit.tau)
        ax.errorbar(speed, points.T_f, yerr=bars, ls="none", capsize=2, **style)
        ax.plot(speed, modelled, lw=1.0, color=style["color"], ls=_line(points))
    return _finished(figure, ax, "T_f [N m]")


def system_friction_figure(result: Friction) -> Picture:
    """System friction per motor shaft: measured less motor loss, and the fitted curve with its 95 % band (figure
    2.13)."""
    title = "System friction per motor shaft: measured less motor loss, fit with 95 % band (as figure 2.13)"
    figure, ax = panel(SIZE, title)
    omega = np.linspace(0.0, float(result.points.omega.max()), 200)
    loads: set[float] = set()
    for style, points in _by_test(result):
        measured = points.T_f - motor_loss_at(points, result.loss)
        ax.plot(display(points.omega, "rotation"), measured, ls="none", **style)
        load = round(float(points.T_d.mean()), -3)
        if load not in loads:
            loads.add(load)
            at = Points.planned(omega, float(points.T_d.mean()), 1.0)
            T, half = system_friction(omega, at.T_d, result.fit.y), predicted_sd(at, result.fit)
            low, high = (T + sign * t_factor(result.fit.dof) * half for sign in (-1.0, 1.0))
            band(ax, display(omega, "rotation"), T, np.maximum(low, 0.0), high, color=style["color"], lw=1.2)
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    return _finished(figure, ax, "T_fs [N m]")


def model_against_measured(result: Friction) -> Picture:
    """Total winch friction at the motor shaft, all motors together: modelled over measured (paper D figure 16)."""
    figure, ax = panel(SIZE, "Friction of the complete winch: modelled against measured (as paper D figure 16)")
    for style, points in _by_test(result):
        modelled = points.count * predicted(points, result.loss, result.fit.y)
        ax.plot(points.count * points.T_f, modelled, ls="none", **style)
    top = max(*ax.get_xlim(), *ax.get_ylim())
    ax.plot([0.0, top], [0.0, top], color=GREY, lw=0.8)
    ax.set_xlim(0.0, top)
    ax.set_ylim(0.0, top)
    return _finished(figure, ax, "modelled [N m]", "measured [N m]")


def error_figure(result: Friction) -> Picture:
    figure, ax = panel(SIZE, "Model less measured, in % of the nominal torque D_m dp_m (as paper D figure 17)")
    for style, points in _by_test(result):
        error = nominal_share(points, result.loss, result.fit.y)
        ax.plot(display(points.omega, "rotation"), error, lw=0.8, ls=_line(points), **style)
    ax.axhspan(-1.0, 1.0, color=GREY, alpha=0.15, lw=0)
    threshold(ax, float(display(JUDGED_FROM, "rotation")), along="y")
    return _finished(figure, ax, "error [% of nominal torque]")


def motor_old_and_new(result: Friction, second: SecondLoop) -> Picture:
    """Motor loss before and after the second loop, over speed at three displacements and 200 bar (paper D figure
    10)."""
    title = "Motor loss at 200 bar before (solid) and after (dashed) the second loop (as paper D figure 10)"
    figure, ax = panel(SIZE, title)
    omega = np.linspace(0.0, parse("2000 rev/min", "rotation"), 100)
    for colour, share in zip(COLOURS, (1.0, 0.7, 0.4), strict=False):
        D = np.full_like(omega, share * result.campaign.motor.D_max)
        old, new = (loss(omega, D, np.full_like(omega, 2e7)) for loss in (result.loss, loss_of(second.motor)))
        speed = display(omega, "rotation")
        ax.plot(speed, old, color=colour, label=show(float(D[0]), "displacement", 3))
        ax.plot(speed, new, color=colour, ls="--")
    ax.set_ylim(bottom=0.0)
    return _finished(figure, ax, "T_fm [N m]")


def derived_system_friction(result: Friction, losses: Mapping[str, Loss], title: str) -> Picture:
    """Measured friction less the motor loss of each of two models, one colour a displacement: with a right motor model
    the points of one load fall on one curve, at any displacement (paper D figures 11 to 14)."""
    figure, axes = panels(1, 2, (10.0, 5.0), title, sharey=True)
    for ax, (label, loss) in zip(axes[0], losses.items(), strict=True):
        for style, points in _by_test(result):
            derived = points.count * (points.T_f - motor_loss_at(points, loss))
            ax.plot(display(points.omega, "rotation"), derived, lw=0.8, **style)
        axis(ax, SPEED, title=label)
    axis(axes[0, 0], y="system friction of the complete winch [N m]")
    legend_below(figure, axes[0], 3)
    return figure


def _finished(figure: Picture, ax: Axes, y: str, x: str = SPEED) -> Picture:
    axis(ax, x, y)
    legend_below(figure, [ax], 1, place="right center")
    return figure


def _by_test(result: Friction) -> Iterator[tuple[dict[str, Any], Points]]:
    """Style with label and points by speed of every test; held-out ones are hollow."""
    for i, k in enumerate(np.unique(result.points.test)):
        points = result.points.where(result.points.test == k)
        points = points.where(np.argsort(points.omega))  # type: ignore[arg-type]
        test, D_m = result.campaign.tests[k], show(float(points.D_m.mean()), "displacement", 3)
        note = ", held out" if test.hold_out else ""
        style = {
            "color": COLOURS[i % len(COLOURS)],
            "marker": MARKERS[i % len(MARKERS)],
            "ms": 4,
            "mfc": "none" if points.hold_out.any() else None,
            "label": f"{points.names[k]}: {show(test.load, 'mass', 3)}, {D_m}{note}",
        }
        yield style, points


def _line(points: Points) -> str:
    """Style of a test's line: dashed where no fit has seen it."""
    return "--" if points.hold_out.any() else "-"
