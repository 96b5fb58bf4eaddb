"""One page that a colleague can read without the program: HTML with its pictures inside."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from stillhook.identify.system_friction.fitting.model import Y_NAMES, Y
from stillhook.identify.system_friction.fitting.uncertainty import correlation
from stillhook.identify.system_friction.identify import JUDGED_FROM, Friction
from stillhook.identify.system_friction.next_tests import ANYTHING, Proposal
from stillhook.identify.system_friction.result import test_rows
from stillhook.report.html import bullets, heading, page, paragraph, picture, table
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
    "model-and-map": "The map knows its own cells exactly, and nothing outside them; the model smooths, and goes on.",
    "second-loop-system": "With a right motor model, tests of one load fall on one curve whatever the displacement.",
}
METHOD = (
    "Method: steady stretches of the logs, hoisting and lowering of about the same speed in pairs; half the difference"
    " of their pressure drops is the mean of both losses, with which the models are compared at both pressures and"
    " speeds (G.-A. Moslåt 2020, section 2.2 and paper D). The intervals hold the scatter that the points show. Not in"
    " them: a gain error of pressure sensors or displacement, which makes the complete friction wrong in the same"
    " proportion and the system friction by more, and a wrong motor model, which moves the parameters."
)


def formatted(name: str, value: float | None, digits: int = 4) -> str:
    """A parameter in its display unit; a dash for one that there is none of."""
    if value is None or math.isnan(value):
        return "-"
    if math.isinf(value):
        return "open"
    return show(value, KIND[name], digits) if KIND[name] else f"{value:.{digits - 1}e}" if value else "0"


def tonnes(mass: float) -> str:
    """A measured load, to a tenth of a tonne."""
    return "-" if math.isnan(mass) else f"{mass / 1e3:.1f} t"


def report(result: Friction, figures: Mapping[str, bytes], windows: Mapping[str, bytes] | None = None) -> str:
    """The page as text. figures PNG by stem (see `friction_figures.figures`); windows PNG of the logs by test name."""
    campaign = result.campaign
    parts = [
        paragraph(_verdict(result), no=not result.usable),
        heading("System friction per motor shaft (eq. 2.7)"),
        paragraph(
            "T_fs = (Y_1 T_d + Y_3) exp(-|n_m| / Y_4) + Y_2 + Y_5 |omega_m| + Y_6 T_d, T_d the drum torque. "
            f"Intervals: 95 %, {result.method.value}. Motor loss: {campaign.motor_name} (MJ4)."
        ),
        table(("", "value", "from", "to", "meaning"), _parameters(result)),
        paragraph("Correlation of the fitted parameters: near 1 or -1, only their combination is known."),
        table(("", *result.fit.names), _correlations(result)),
        heading("What the data cannot determine"),
        _list(result),
        heading("Tests"),
        table(
            ("test", "use", "load", "carried", "displacement", "speeds", "pairs", "not used", "error RMS"),
            _tests(result),
        ),
        paragraph(
            "Carried: load by the pressures. Not used: stretches left out, see stretches.csv. Error: of nominal torque"
            " D_m dp_m."
        ),
        bullets(_remarks(result)),
        *_held_out(result),
        heading("Our fit next to the thesis's"),
        table(("", *Y_NAMES, "cost E [N²m²]"), _methods(result)),
        paragraph(_agreement(result)),
        *_second(result),
        *_mapped(result),
        heading("What to test next"),
        table(("load", "displacement of one motor", "uncertainty of predicted friction"), _proposals(result)),
        heading("Figures"),
        *(picture(f, CAPTIONS.get(stem, stem)) for stem, f in figures.items()),
        *(picture(f, f"Test {name}: stretches used, and not used.") for name, f in (windows or {}).items()),
        paragraph(METHOD),
    ]
    synthetic = "SYNTHETIC: these logs were simulated, not measured." if campaign.synthetic else ""
    return page(f"Friction of {campaign.crane.name}: {campaign.title}", parts, synthetic=synthetic)


def _verdict(result: Friction) -> str:
    used = sum(not m.test.hold_out for m in result.measured)
    pairs = len(result.points.fitted())
    good = (
        "The set can be used where the campaign has been."
        if result.usable
        else "The set must not be used as it is: see below."
    )
    return f"{used} tests fitted ({pairs} pairs of steady stretches), {len(result.measured) - used} held out. {good}"


def _parameters(result: Friction) -> Iterable[Sequence[str]]:
    for n in Y_NAMES:
        i, value = result.intervals.get(n), float(getattr(result.fit.y, n))
        state = (
            " (taken from another set)"
            if n in result.fit.prescribed
            else " (left out)"
            if n in result.fit.dropped
            else ""
        )
        yield (
            n,
            formatted(n, value),
            formatted(n, i.low if i else None),
            formatted(n, i.high if i else None),
            MEANING[n] + state,
        )


def _correlations(result: Friction) -> Iterable[Sequence[str]]:
    r = correlation(result.fit)
    for i, name in enumerate(result.fit.names):
        yield name, *(f"{r[i, j]:.2f}" if j <= i else "" for j in range(len(result.fit.names)))


def _list(result: Friction) -> str:
    if not result.statements:
        return paragraph(
            "No weakness found: loads, speeds and displacements of the campaign distinguish all parameters."
        )
    severe = [paragraph(s.text, no=True) for s in result.statements if s.severe]
    return "".join(severe) + bullets(s.text for s in result.statements if not s.severe)


def test_cells(t: Mapping[str, Any]) -> Sequence[str]:
    """Load, load by the pressures, displacement, speeds, pairs, stretches not used and error of a test, from its row of
    numbers."""
    speeds = f"{show(t['omega_m_min'], 'rotation', 3).split()[0]} to {show(t['omega_m_max'], 'rotation', 3)}"
    return (
        show(t["load"], "mass", 3),
        tonnes(t["load_carried"]),
        show(t["D_m"], "displacement", 4),
        speeds,
        str(t["pairs"]),
        str(t["rejected"] + t["unpaired"]),
        f"{t['rms_percent']:.2f} %",
    )


def _tests(result: Friction) -> Iterable[Sequence[str]]:
    for t in test_rows(result):
        yield t["name"], "held out" if t["hold_out"] else "fitted", *test_cells(t)


MAX_SIMILAR = 2
"""Findings of one kind in one signal of a log that are reported one by one."""


def _remarks(result: Friction) -> Iterable[str]:
    """What was noted about each test and found in its log; many findings of one kind are counted."""
    for m in result.measured:
        similar: dict[tuple[str, str], list[str]] = {}
        for f in m.log.findings:
            similar.setdefault((f.signal, f.kind), []).append(f.text)
        for texts in similar.values():
            yield from (f"test {m.test.name}: {text}" for text in texts[:MAX_SIMILAR])
            if len(texts) > MAX_SIMILAR:
                yield (
                    f"test {m.test.name}: ... and {len(texts) - MAX_SIMILAR} more of this kind (all of them in"
                    " summary.json)"
                )
        yield from (f"test {m.test.name}: {n.text}" for n in m.notes)


def _held_out(result: Friction) -> list[str]:
    if not result.held_out:
        return [
            paragraph(
                "No test was held out. Hold one out to see how well the friction of other loads and displacements is"
                " predicted."
            )
        ]
    rows = ((h.test, f"{h.rms:.2f} %", f"{h.worst:.2f} %", str(h.count)) for h in result.held_out)
    speed = show(JUDGED_FROM, "rotation", 3)
    return [
        paragraph(f"Held-out tests, from {speed} on, in % of nominal torque:"),
        table(("test", "RMS", "largest", "pairs"), rows),
    ]


def _methods(result: Friction) -> Iterable[Sequence[str]]:
    c = result.check

    def row(label: str, y: Y, cost: float) -> Sequence[str]:
        return label, *(formatted(n, float(getattr(y, n))) for n in Y_NAMES), number(cost, 5)

    yield row("pairs, weighted (ours)", result.fit.y, c.cost_ours)
    where = "25 rev/min grid" if c.on_grid else "pairs"
    yield row(f"{where}, least squares", c.y_grid, c.cost_grid)
    yield row(f"{where}, complex method", c.y_complex, c.optimum.cost)


def _agreement(result: Friction) -> str:
    c = result.check
    if c.agree:
        return f"Least squares and the complex method ({c.optimum.evaluations} evaluations) reach the same cost."
    return (
        f"The complex method stopped at {number(c.optimum.cost, 5)} after {c.optimum.evaluations} evaluations, least"
        f" squares reaches {number(c.cost_grid, 5)}: it got stuck; another seed or variant helps."
    )


def _second(result: Friction) -> list[str]:
    s = result.second
    if s is None:
        return []
    return [
        heading(f"Second loop (paper D section 3): {s.verdict}"),
        bullets(s.statements),
    ]


def _mapped(result: Friction) -> list[str]:
    title = "The supplier's map instead of the fitted model (paper D figure 13)"
    return [heading(title), paragraph(mapped_line(result))] if result.mapped else []


def mapped_line(result: Friction) -> str:
    """What the map does better or worse than the model, in a sentence."""
    m = result.mapped
    assert m is not None
    return (
        f"Residual {show(m.rms_model, 'torque', 3)} a motor (RMS) with the fitted model, {show(m.rms_map, 'torque', 3)}"
        f" with the map {m.source} itself; {m.outside:.0%} of the points are outside the map, where its edge is held."
    )


def uncertainty_of(sd: float) -> str:
    """A standard error of a friction torque in words."""
    return show(sd, "torque", 2) if sd < ANYTHING else "unknown"


def proposal_cells(p: Proposal) -> tuple[str, str, str]:
    """Load, displacement of one motor, and what the uncertainty of the predicted friction becomes."""
    change = f"{uncertainty_of(p.sd_before)} to {uncertainty_of(p.sd_after)}"
    return show(p.load, "mass", 3), show(p.D_m, "displacement", 3), change


def _proposals(result: Friction) -> Iterable[Sequence[str]]:
    for load, D_m, change in map(proposal_cells, result.proposals):
        yield load, D_m, f"{change} per motor"
