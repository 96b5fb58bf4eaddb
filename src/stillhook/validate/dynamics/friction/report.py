"""The verification of a friction for a reader: a document, figures as paper D has them, numbers for machines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.identify.system_friction.identify import JUDGED_FROM
from stillhook.report.document import Bullets, Document, Figure, Section, Table, Text, Verdict
from stillhook.report.formatting import EMPTY
from stillhook.report.kit import axis, display, legend_below, panels, threshold
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import number, parse, show
from stillhook.validate.criteria.results import plain
from stillhook.validate.dynamics.friction.verify import (
    SETTLE,
    WAYS,
    Deviation,
    PressureStretch,
    Repeated,
    Use,
    Verification,
    deviation,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure as Picture

SPEED_EDGES = tuple(parse(f"{n} rev/min", "rotation") for n in (0, 250, 500, 1000, 10000))
D_EDGES = (0.0, 0.5, 0.75, 1.01)
"""Ranges of speed, and of displacement over its maximum, by which deviations are listed."""
HEADER = (
    "mean\n[bar]",
    "rms\n[bar]",
    "mean\nmagnitude\n[bar]",
    "of measured\npressure",
    "of load\ntorque",
    "stretches",
)
FASTER = 0.05
"""Deviation of the twin's motor speed that is reported: the pump command then says something else than friction."""
METHOD = (
    "The logged pump command and motor displacement drive the twin, which carries the stated load; each steady stretch of"
    " a staircase, and each half-wave of heave compensation at 250 rev/min or more, gives one mean pressure drop across"
    " the motors, measured and simulated. Deviation: simulated less measured. Nominal torque: that of the load at the"
    f" motor shafts. The first {SETTLE:g} s of heave compensation do not count. A deviation of equal sign in both"
    " directions is one of load, layer or passive circuit; of opposite sign, one of friction. Source: G.-A. Moslåt 2020,"
    " paper D sections 4.2 and 4.3."
)


def verification_report(v: Verification, pictures: Mapping[str, bytes]) -> Document:
    """The report; pictures PNG by test name, as `verification_figures` draws them."""
    shown = [Figure(png, f"{name}: pressure drop across the motors and motor speed.") for name, png in pictures.items()]
    sections = [
        Section("Deviation by test", [Table(("test", "use", "load", "displacement", *HEADER, "limits"), _by_test(v))]),
        Section("Deviation by direction", [Table(("test", "direction", "measured\n[bar]", *HEADER), _by_way(v))]),
        Section("Deviation by motor speed and displacement", [Table(("", *HEADER), _by_range(v))]),
        Section("Remarks", [Bullets(_remarks(v))]),
        *([Section("Figures (as paper D figures 15 and 18 to 23)", shown)] if shown else []),
        Section("Method", [Text(METHOD)]),
    ]
    return Document(
        title=f"Friction of {v.campaign.crane.name} verified in the twin",
        name=v.campaign.title,
        marks=["SYNTHETIC: these logs were simulated, not measured"] if v.campaign.synthetic else [],
        front=[_verdict(v)],
        sections=sections,
    )


def _verdict(v: Verification) -> Verdict:
    limits = v.campaign.verify
    text = (
        f"Limits from {show(JUDGED_FROM, 'rotation', 3)} on: {limits.pressure:.3g} of the measured pressure, and"
        f" {limits.torque:.3g} of the load torque for staircases under load. Friction: {v.friction}."
    )
    over = [f"test {r.test.name}, {reason}" for r in v.runs for reason in v.exceeded(r)]
    if over:
        return Verdict(f"Over the limit: {'; '.join(over)}.", passed=False, text=[text])
    if not v.unseen:
        word = "Not verified: every judged test was used to fit the friction. Hold a test out, or add one."
        return Verdict(word, passed=False, text=[text])
    judged = [r.deviation for r in v.unseen if r.deviation]
    worst = max(d.of_pressure for d in judged)
    word = f"Within the limits: {len(judged)} tests that were not fitted, at most {worst:.1%} of the measured pressure."
    return Verdict(word, passed=True, text=[text])


def _cells(d: Deviation | None) -> Sequence[str]:
    if d is None:
        return [EMPTY] * (len(HEADER) - 1) + ["0"]
    pressures = (f"{x / 1e5:{sign}.2f}" for x, sign in ((d.mean, "+"), (d.rms, ""), (d.magnitude, "")))
    return *pressures, f"{d.of_pressure:.1%}", f"{d.of_torque:.2%}", str(d.n)


def _by_test(v: Verification) -> list[Sequence[str | Verdict]]:
    rows: list[Sequence[str | Verdict]] = []
    for r in v.runs:
        over = v.exceeded(r)
        word = Verdict("exceeded" if over else "met", not over) if r.judged else "too slow"
        D_m = [s.D_m for s in r.stretches]
        ends = dict.fromkeys(number(x, 3) for x in display([min(D_m), max(D_m)], "displacement"))
        setting = f"{' to '.join(ends)} cm³/rev"
        rows.append((r.test.name, r.use.value, show(r.test.load, "mass", 3), setting, *_cells(r.deviation), word))
    return rows


def _by_way(v: Verification) -> Iterator[Sequence[str]]:
    for r in v.runs:
        for way, words in WAYS.items():
            if same := [s for s in r.judged if s.direction == way]:
                yield r.test.name, words, f"{np.mean([s.dp_m for s in same]) / 1e5:.1f}", *_cells(deviation(same))


def _by_range(v: Verification) -> Iterator[Sequence[str]]:
    D_max = v.campaign.motor.D_max
    groups: tuple[tuple[str, Sequence[float], Callable[[PressureStretch], float], float], ...] = (
        ("rotation", SPEED_EDGES, lambda s: abs(s.omega_m), 1.0),
        ("displacement", D_EDGES, lambda s: s.D_m / D_max, D_max),
    )
    for ahc in (False, True):
        of = [s for r in v.runs if r.test.ahc is ahc for s in r.stretches]
        for kind, edges, value, scale in groups:
            for low, high in zip(edges, edges[1:], strict=False):
                if same := [s for s in of if low <= value(s) < high]:
                    words = f"{number(float(display(low * scale, kind)), 3)} to {show(high * scale, kind, 3)}"
                    words = f"from {show(low * scale, kind, 3)}" if high == edges[-1] else words
                    yield f"{'heave compensation' if ahc else 'staircases'}, {words}", *_cells(deviation(same))


def _remarks(v: Verification) -> list[str]:
    out = [f"Friction that is verified: {v.friction}."]
    if all(r.use is not Use.FITTED for r in v.runs):
        out.append("Whether this friction was fitted to these tests earlier cannot be seen from the files.")
    for r in v.runs:
        ratio = [s.omega_sim / s.omega_m - 1.0 for s in r.judged]
        if ratio and abs(off := float(np.mean(ratio))) > FASTER:
            out.append(
                f"Test {r.test.name}: the twin runs {off:+.0%} of the logged motor speed: check pump flow, leakage and"
                " the scale of u_p and alpha_m."
            )
        if r.judged and (both := [deviation([s for s in r.judged if s.direction == w]) for w in _ways(r)])[1:]:
            load, friction = 0.5 * (both[0].mean + both[1].mean), 0.5 * (both[0].mean - both[1].mean)
            out.append(
                f"Test {r.test.name}: {friction / 1e5:+.2f} bar of friction (half the difference of both directions),"
                f" {load / 1e5:+.2f} bar of load or passive circuit (half the sum)."
            )
    return out


def _ways(r: Repeated) -> list[int]:
    return [w for w in WAYS if any(s.direction == w for s in r.judged)]


def verification_figures(v: Verification) -> dict[str, Picture]:
    """By test: measured and simulated pressure drop over time, above the motor speed (paper D figures 18 to 23)."""
    return {f"Test {r.test.name}": _figure(v, r) for r in v.runs}


def _figure(v: Verification, r: Repeated) -> Picture:
    title = f"Test {r.test.name}, {show(r.test.load, 'mass', 3)} ({r.use.value}): friction {v.friction}"
    figure, axes = panels(2, 1, (9.0, 5.5), title, sharex=True, height_ratios=(2, 1))
    for ax, both, kind in ((axes[0, 0], r.dp_m, "pressure"), (axes[1, 0], r.omega_m, "rotation")):
        for values, label, colour in zip(both.T, ("measured", "simulated"), (GREY, COLOURS[0]), strict=True):
            ax.plot(r.t, display(values, kind), lw=0.8, color=colour, label=label)
    for s in r.judged:
        axes[0, 0].hlines(display([s.dp_m, s.dp_sim], "pressure"), s.start, s.end, colors=["black", COLOURS[1]], lw=1.6)
    for sign in (-1.0, 1.0):
        threshold(axes[1, 0], sign * float(display(JUDGED_FROM, "rotation")))
    axis(axes[0, 0], y="pressure drop [bar]")
    axis(axes[1, 0], "time [s]", "motor speed [rev/min]")
    legend_below(figure, [axes[0, 0]])
    if v.campaign.synthetic:
        figure.text(0.995, 0.005, "SYNTHETIC", ha="right", va="bottom", fontsize="x-small", color="#a00000")
    return figure


def verification_dict(v: Verification) -> dict[str, Any]:
    """Everything in SI, ready for JSON."""
    tests = []
    for r in v.runs:
        ways = {words: [s for s in r.judged if s.direction == way] for way, words in WAYS.items()}
        tests.append(
            {
                "name": r.test.name,
                "use": r.use.value,
                "load": r.test.load,
                "deviation": r.deviation,
                "directions": {words: deviation(same) for words, same in ways.items() if same},
                "torque_judged": r.judged_torque,
                "exceeded": v.exceeded(r),
                "stretches": list(r.stretches),
            }
        )
    limits = v.campaign.verify.model_dump()
    return plain(
        {"friction": v.friction, "passed": v.passed, "judged_from": JUDGED_FROM, "limits": limits, "tests": tests}
    )


def stretches_table(v: Verification) -> pandas.DataFrame:
    """Every stretch in display units."""
    import pandas as pd

    units = {"omega": "rotation", "dp": "pressure", "rms": "pressure", "D": "displacement"}
    heads = {"rotation": "rev/min", "pressure": "bar", "displacement": "cm^3/rev"}
    frame = pd.DataFrame([s for r in v.runs for s in r.stretches])
    for name in list(frame):
        if (kind := units.get(name.partition("_")[0])) is not None:
            frame[f"{name} [{heads[kind]}]"] = display(frame.pop(name), kind)
    return frame
