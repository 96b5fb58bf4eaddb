"""The verification of a friction for a reader: a document, figures as paper D has them, numbers for machines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.identify.system_friction.identify import JUDGED_FROM
from stillhook.report.document import Bullets, Document, Figure, Section, Table, Text, Verdict
from stillhook.report.formatting import EMPTY
from stillhook.report.kit import axis, display, legend_below, panels, threshold
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.statistics.estimate import Estimate
from stillhook.units import number, parse, show
from stillhook.validate.criteria.results import plain
from stillhook.validate.dynamics.friction.verify import (
    SETTLE,
    SPEED,
    WAYS,
    Deviation,
    PressureStretch,
    Repetition,
    Use,
    Verification,
    deviation,
    friction_parts,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure as Picture

SPEED_EDGES = tuple(parse(f"{n} rev/min", "rotation") for n in (0, 250, 500, 1000, 10000))
D_EDGES = (0.0, 0.5, 0.75, 1.1)
"""Ranges of speed, and of displacement over its maximum, by which deviations are listed."""
SHARES = ("mean\nmagnitude\n[bar]", "of measured\npressure", "of load\ntorque", "stretches")
HEADER = ("mean\n[bar]", "rms\n[bar]", *SHARES)
FRICTION = ("friction\n[bar]", "+- (95 %)", "of measured\nfriction")
RANGE = ("", *FRICTION, *HEADER[1:])
TEST = ("test", "use", "load", "displacement", *FRICTION[::2], "load\n[bar]")
DIRECTION = ("test", "direction", "measured\n[bar]", "rms of\nsamples\n[bar]")
PASSIVE_HEADER = ("test", "accumulator,\nmeasured\n[bar]", "simulated\n[bar]", "displacement,\nmeasured", "simulated")
FORM = 0.02
"""Difference of the friction's deviation between two ranges, over the measured friction, that is reported."""
FASTER = 0.05
"""Deviation of the twin's motor speed that is reported: the pump command then says something else than friction."""
METHOD = (
    "The logged pump command and motor displacement drive the twin, which carries the stated load. Each steady stretch"
    f" of a staircase, and each half-wave of heave compensation at {SPEED} or more, gives one mean pressure drop across"
    " the motors, measured and simulated. Deviation: simulated less measured. Load torque: of load and hook, at the"
    f" motor shafts. The first {SETTLE:g} s of heave compensation do not count. A deviation of equal sign in both"
    " directions (column load: half the sum) is one of load, layer or passive circuit; of opposite sign (column"
    " friction: half the difference, negative where the twin has too little) one of friction. Source: G.-A. Moslåt"
    " 2020, paper D sections 4.2 and 4.3."
)


def verification_report(v: Verification, pictures: Mapping[str, bytes]) -> Document:
    """The report; pictures PNG by test, as `verification_figures` draws them."""
    shown = [Figure(png, f"{name}: pressure drop across the motors and motor speed.") for name, png in pictures.items()]
    ways = list(_by_way(v))
    ranges = [(words, *_friction(same), *_cells(deviation(same))[1:]) for _, words, same in by_range(v)]
    passive = [row for r in v.runs if r.passive for row in [_passive(r)]]
    sections = [
        Section("Deviation by test", [Table((*TEST, *SHARES, "limits"), [_row(v, r) for r in v.runs])]),
        *([Section("Deviation by direction", [Table((*DIRECTION, *HEADER), ways)])] if ways else []),
        *([Section("Passive circuit in heave compensation", [Table(PASSIVE_HEADER, passive)])] if passive else []),
        Section("Deviation by motor speed and displacement", [Table(RANGE, ranges)]),
        Section("Remarks", [Bullets(list(_remarks(v)))]),
        *([Section("Figures (as paper D figures 15 and 18 to 23)", shown)] if shown else []),
        Section("Method", [Text(METHOD)]),
    ]
    marks = ["SYNTHETIC: these logs were simulated, not measured"] if v.campaign.synthetic else []
    title = f"Friction of {v.campaign.crane.name} verified in the twin"
    return Document(title=title, name=v.campaign.title, marks=marks, front=[_verdict(v)], sections=sections)


def _verdict(v: Verification) -> Verdict:
    limits = v.campaign.verify
    text = (
        f"Friction: {v.friction}. Limits from {SPEED} on: {100.0 * limits.pressure:.3g} % of the measured pressure, and"
        f" {100.0 * limits.torque:.3g} % of the load torque for staircases under load."
    )
    if over := [f"test {r.test.name}, {reason}" for r in v.runs for reason in v.exceeded(r)]:
        return Verdict(f"Over the limit: {'; '.join(over)}.", passed=False, text=[text])
    if not v.unseen:
        slow = not any(r.judged for r in v.runs)
        reason = f"no test reaches {SPEED}" if slow else "every test was used to fit the friction"
        word = f"Not verified: {reason}. {'Add a faster test' if slow else 'Hold a test out, or add one'}."
        return Verdict(word, passed=False, text=[text])
    worst = max(deviation(r.judged).of_pressure for r in v.unseen)
    word = (
        f"Within the limits: {len(v.unseen)} tests that were not fitted, at most {worst:.1%} of the measured pressure."
    )
    return Verdict(word, passed=True, text=[text])


def _cells(d: Deviation) -> Sequence[str]:
    pressures = (f"{x / 1e5:{sign}.2f}" for x, sign in ((d.mean, "+"), (d.rms, ""), (d.magnitude, "")))
    return *pressures, f"{d.of_pressure:.1%}", f"{d.of_torque:.2%}", str(d.n)


def _row(v: Verification, r: Repetition) -> Sequence[str | Verdict]:
    D_m, over = [s.D_m for s in r.stretches], v.exceeded(r)
    ends = dict.fromkeys(number(x, 3) for x in display([min(D_m), max(D_m)], "displacement"))
    row = (r.test.name, r.use.value, show(r.test.load, "mass", 3), f"{' to '.join(ends)} cm³/rev")
    if not r.judged:
        return *row, *[EMPTY] * 7, "too slow"
    ways = [[s for s in r.judged if s.direction == way] for way in WAYS]
    up, down = (deviation(same).mean / 1e5 for same in ways) if all(ways) else (np.nan, np.nan)
    load = 0.5 * (up + down)
    parts = (*_friction(r.judged)[::2], f"{load:+.2f}" if np.isfinite(load) else EMPTY)
    return *row, *parts, *_cells(deviation(r.judged))[2:], Verdict("exceeded" if over else "met", not over)


def _passive(r: Repetition) -> Sequence[str]:
    """Accumulator pressure and displacement of the passive motors, measured and simulated."""
    cells = [
        (1e-5, ".1f", *r.passive.get("p_hp", (np.nan, np.nan))),
        (1.0, ".3f", *r.passive.get("alpha_pm", (np.nan,) * 2)),
    ]
    return r.test.name, *(f"{x * k:{form}}" if np.isfinite(x) else EMPTY for k, form, *both in cells for x in both)


def _friction(stretches: Sequence[PressureStretch]) -> Sequence[str]:
    """Deviation of the friction part, half its 95 % interval [bar], and the deviation over the measured part."""
    if (parts := friction_parts(stretches)) is None or not parts[1] > 0.0:
        return EMPTY, EMPTY, EMPTY
    off, measured = parts
    return f"{off.value / 1e5:+.2f}", f"{off.half / 1e5:.2f}", f"{off.value / measured:+.1%}"


def _by_way(v: Verification) -> Iterator[Sequence[str]]:
    for r in v.runs:
        for way, words in WAYS.items():
            if same := [s for s in r.judged if s.direction == way]:
                measured, samples = np.mean([s.dp_m for s in same]), np.sqrt(np.mean([s.rms**2 for s in same]))
                yield r.test.name, words, f"{measured / 1e5:.1f}", f"{samples / 1e5:.2f}", *_cells(deviation(same))


def by_range(v: Verification) -> Iterator[tuple[str, str, list[PressureStretch]]]:
    """Group, range in words, and stretches, by speed and by displacement."""
    D_edges = [share * v.campaign.motor.D_max for share in D_EDGES]
    for ahc, test in ((False, "staircases"), (True, "heave compensation")):
        of = [s for r in v.runs if r.test.ahc is ahc for s in r.stretches]
        for kind, edges, name in (("rotation", SPEED_EDGES, "omega_m"), ("displacement", D_edges, "D_m")):
            for low, high in pairwise(edges):
                if same := [s for s in of if low <= abs(getattr(s, name)) < high]:
                    to = f" to {show(high, kind, 3)}" if high < edges[-1] else ""
                    yield f"{test}, {kind}", f"{test}, from {show(low, kind, 3)}{to}", same


def _remarks(v: Verification) -> Iterator[str]:
    yield f"Friction that is verified: {v.friction}."
    if all(r.use is not Use.FITTED for r in v.runs):
        yield "Whether this friction was fitted to these tests earlier cannot be seen from the files."
    for r in v.runs:
        ratio = [s.omega_sim / s.omega_m - 1.0 for s in r.judged]
        if ratio and abs(off := float(np.mean(ratio))) > FASTER:
            yield (
                f"Test {r.test.name}: the twin's motor speed is {off:+.0%} off the logged one: check pump flow, leakage"
                " and the scale of u_p and alpha_m."
            )
    groups: dict[str, list[tuple[Estimate, str]]] = {}
    for group, words, same in by_range(v):
        if (parts := friction_parts(same)) is not None and parts[1] > 0.0:
            groups.setdefault(group, []).append((parts[0].scaled(1.0 / parts[1]), words))
    for found in groups.values():
        (least, where), (most, other) = (end(found, key=lambda x: x[0].value) for end in (min, max))
        if least.high < most.low and most.value - least.value > FORM:
            yield (
                f"The friction deviates by {least.value:+.1%} +- {least.half:.1%} ({where}) and by {most.value:+.1%} +-"
                f" {most.half:.1%} ({other}): its form, or more than one of its parameters, is not the crane's."
            )


def verification_figures(v: Verification) -> dict[str, Picture]:
    """By test: measured and simulated pressure drop over time, above the motor speed (paper D figures 18 to 23)."""
    return {f"Test {r.test.name}": _figure(v, r) for r in v.runs}


def _figure(v: Verification, r: Repetition) -> Picture:
    title = f"Test {r.test.name}, {show(r.test.load, 'mass', 3)} ({r.use.value}); friction: {v.friction}"
    figure, axes = panels(2, 1, (9.0, 5.5), title, sharex=True, height_ratios=(2, 1))
    for ax, both, kind in ((axes[0, 0], r.dp_m, "pressure"), (axes[1, 0], r.omega_m, "rotation")):
        for values, label, colour in zip(both.T, ("measured", "simulated"), (GREY, COLOURS[0]), strict=True):
            ax.plot(r.t, display(values, kind), lw=0.8, color=colour, label=label)
    for name, label, colour in (("dp_m", "measured, mean", "black"), ("dp_sim", "simulated, mean", COLOURS[1])):
        values, start, end = np.array([(getattr(s, name), s.start, s.end) for s in r.judged]).reshape(-1, 3).T
        axes[0, 0].hlines(display(values, "pressure"), start, end, colors=colour, lw=1.6, label=label)
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
        row = {"name": r.test.name, "use": r.use, "load": r.test.load, "torque_judged": r.loaded}
        parts = friction_parts(r.judged)
        row |= {"deviation": deviation(r.judged) if r.judged else None}
        row |= {"friction": None if parts is None else {**parts[0].to_dict(), "measured": parts[1]}}
        row |= {"directions": {words: deviation(same) for words, same in ways.items() if same}}
        row |= {"passive": {n: {"measured": both[0], "simulated": both[1]} for n, both in r.passive.items()}}
        tests.append(plain({**row, "exceeded": v.exceeded(r), "stretches": list(r.stretches)}))
    limits = v.campaign.verify.model_dump()
    return {"friction": v.friction, "passed": v.passed, "judged_from": JUDGED_FROM, "limits": limits, "tests": tests}


def stretches_table(v: Verification) -> pandas.DataFrame:
    """Every stretch, in SI."""
    import pandas as pd

    return pd.DataFrame([s for r in v.runs for s in r.stretches])
