"""The result of `identify friction` as a document."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stillhook.identify.system_friction.fitting.model import Y_NAMES, Y
from stillhook.identify.system_friction.fitting.uncertainty import correlation
from stillhook.identify.system_friction.identify import JUDGED_FROM, Friction
from stillhook.identify.system_friction.next_tests import ANYTHING
from stillhook.identify.system_friction.result import test_rows
from stillhook.report.document import Bullets, Document, Figure, Part, Section, Table, Text, Verdict
from stillhook.report.formatting import EMPTY, fmt
from stillhook.units import number, show

KIND = {"Y_1": "", "Y_2": "torque", "Y_3": "torque", "Y_4": "rotation", "Y_5": "viscous_torque", "Y_6": ""}
MEANING = {
    "Y_1": "break-away part of the drum torque",
    "Y_2": "constant friction",
    "Y_3": "break-away friction",
    "Y_4": "motor speed over which break-away fades",
    "Y_5": "friction per motor speed",
    "Y_6": "friction part of the drum torque",
}
CAPTIONS = {
    "friction-pressure": (
        "Half the difference of the hoisting and lowering pressure drops. Bars: 95 %. Lines: interpolated to 25"
        " rev/min."
    ),
    "friction-torque": (
        "What one motor shaft loses. Hollow points and dashed lines: held-out tests, which no fit has seen."
    ),
    "system-friction": "What is left for gears, drum, sheaves and wire after the motor loss.",
    "model-against-measured": "All motors together. Points on the line are predicted exactly.",
    "error": (
        "Grey: 1 % of the nominal torque, the thesis's claim from 250 rev/min (dotted) on. Low loads have little"
        " nominal torque."
    ),
    "second-loop-motor": "What the crane's tests make of the supplier's motor model.",
    "model-and-map": "The map is exact in its own cells, with nothing outside; the model smooths and extrapolates.",
    "second-loop-system": "With a right motor model, tests of one load fall on one curve at every displacement.",
}
TEST_HEADER = (
    "test",
    "use",
    "load",
    "load by\npressures",
    "displacement\nof a motor",
    "motor speeds",
    "pairs",
    "not\nused",
    "error\n(RMS)",
)
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
    if KIND[name] or not value or math.isnan(value):
        return fmt(value, KIND[name], digits)
    return f"{value:.{digits - 1}e}"


def report(result: Friction, figures: Mapping[str, bytes], windows: Mapping[str, bytes] | None = None) -> Document:
    """The report. figures PNG by stem (see `friction_figures.figures`); windows PNG of the logs by test name."""
    campaign = result.campaign
    pictures = [Figure(png, CAPTIONS.get(stem, stem)) for stem, png in figures.items()]
    pictures += [Figure(png, f"Test {name}: stretches used, and not used.") for name, png in (windows or {}).items()]
    sections = [
        _parameters(result),
        Section("What the data cannot determine", _weaknesses(result)),
        _tests(result),
        _methods(result),
        *_second(result),
        *_mapped(result),
        _proposals(result),
        *([Section("Figures", pictures)] if pictures else []),
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
    used = sum(not m.test.hold_out for m in result.measured)
    pairs = len(result.points.fitted())
    advice = "The set must not be used as it is: see below."
    if result.usable:
        advice = "The set can be used where the campaign has been."
    held_out = len(result.measured) - used
    text = f"{used} tests fitted ({pairs} pairs of steady stretches), {held_out} held out. {advice}"
    return Verdict(text, result.usable)


def _parameters(result: Friction) -> Section:
    rows = []
    for n in Y_NAMES:
        i, value = result.intervals.get(n), float(getattr(result.fit.y, n))
        ends = (_parameter(n, i.low if i else None), _parameter(n, i.high if i else None))
        state = " (taken from another set)" if n in result.fit.prescribed else ""
        state = " (left out)" if n in result.fit.dropped else state
        rows.append((n, _parameter(n, value), *ends, MEANING[n] + state))
    matrix, names = correlation(result.fit), result.fit.names
    correlations = [
        [name, *(f"{matrix[i, j]:.2f}" if j <= i else "" for j in range(len(names)))] for i, name in enumerate(names)
    ]
    equation = (
        "T_fs = (Y_1 T_d + Y_3) exp(-|n_m| / Y_4) + Y_2 + Y_5 |omega_m| + Y_6 T_d, T_d the drum torque. "
        f"Intervals: 95 %, profile. Motor loss: {result.campaign.motor_name} (MJ4)."
    )
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
    parts: list[Part] = [
        Table(TEST_HEADER, [_test(t) for t in test_rows(result)]),
        Text(
            "Not used: stretches left out, see stretches.csv. Error: model less measured, of nominal torque D_m dp_m."
        ),
        Bullets(list(_remarks(result))),
        *_held_out(result),
    ]
    return Section("Tests", parts)


def _test(t: Mapping[str, Any]) -> Sequence[str]:
    """A test, see `TEST_HEADER`, from its row of numbers."""
    speeds = f"{show(t['omega_m_min'], 'rotation', 3).split()[0]} to {show(t['omega_m_max'], 'rotation', 3)}"
    carried = t["load_carried"]
    return (
        t["name"],
        "held out" if t["hold_out"] else "fitted",
        show(t["load"], "mass", 3),
        EMPTY if math.isnan(carried) else f"{carried / 1e3:.1f} t",
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
    parts: list[Part] = [Table(("", *Y_NAMES, "cost E\n[N²m²]"), rows), Text(_agreement(result))]
    parts += [Text(BENT)] if c.on_grid and c.cost_ours > GRID_BIAS * c.cost_grid else []
    return Section("Our fit next to the thesis's", parts)


def _agreement(result: Friction) -> str:
    c = result.check
    if c.agree:
        return f"Least squares and the complex method ({c.optimum.evaluations} evaluations) reach the same cost."
    return (
        f"The complex method stopped at {number(c.optimum.cost, 5)} after {c.optimum.evaluations} evaluations, least"
        f" squares reaches {number(c.cost_grid, 5)}: it got stuck; another seed or variant helps."
    )


def _second(result: Friction) -> list[Section]:
    s = result.second
    return [] if s is None else [Section(f"Second loop (paper D section 3): {s.verdict}", [Bullets(s.statements)])]


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
        change = f"{_deviation(p.sd_before)} to {_deviation(p.sd_after)} per motor"
        rows.append((show(p.load, "mass", 3), show(p.D_m, "displacement", 3), change))
    return Section("What to test next", [Table(header, rows)])


def _deviation(sd: float) -> str:
    """A standard error of a friction torque in words."""
    return show(sd, "torque", 2) if sd < ANYTHING else "unknown"
