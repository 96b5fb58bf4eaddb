"""Step 4 in words and tables: tuned values, and gradients, periods and fit before and after."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from stillhook.library.leakage import stated_leak
from stillhook.report.document import Table
from stillhook.report.formatting import change
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import NORMAL_95, Estimate
from stillhook.units import show
from stillhook.validate.dynamics.estimates import TunedValue
from stillhook.validate.dynamics.fitting.fit import Tuning
from stillhook.validate.dynamics.fitting.unknowns import C_H, C_LEAK, EXTRAS, INERTIA, PLACE, TUNED, UNKNOWNS
from stillhook.validate.dynamics.swings import SwingComparison

WORDS = {C_H: "capacitance of the lines", C_LEAK: "leakage", INERTIA: "inertia"}
LETTERS = {C_H: "C_h", C_LEAK: "C_leak", INERTIA: "J_m_eff"}


def amounts(crane: Crane) -> dict[str, tuple[float, str]]:
    """Values of the three tuned numbers in the crane file, and their kind of quantity: volume of oil in a line, leak
    conductance at the point that the file states, inertia."""
    a = crane.active
    return {C_H: (a.line.V, "volume"), C_LEAK: (stated_leak(a), "leakage"), INERTIA: (crane.inertia.J_m_eff, "inertia")}


def statements_of(
    crane: Crane,
    values: Sequence[TunedValue],
    tuning: Tuning,
    swings: SwingComparison,
    elsewhere: bool,
    notes: Sequence[str],
) -> tuple[str, ...]:
    """Lines for the reader, the most important first; elsewhere: other tests also determined the leakage."""
    out = []
    file_values = amounts(crane)
    for f in values:
        value, kind = file_values[f.name] if f.of is None else (f.of, file_values[f.name][1])
        if f.known:
            whose = "the file states" if f.of is None else "the twin has, at the working point of heave compensation,"
            x = f.factor
            amount = f"{show(x.value * value, kind, 4)} where {whose} {show(value, kind, 4)}{_oil(crane, f.name)}"
            change, low, high = (100.0 * (end - 1.0) for end in (x.value, x.low, x.high))
            out.append(
                f"{WORDS[f.name].capitalize()} {LETTERS[f.name]} is {change:+.1f} % from the crane file (95 %:"
                f" {low:+.1f} to {high:+.1f} %), {amount}.{_form(f)}"
            )
        else:
            out.append(f"{WORDS[f.name].capitalize()} {LETTERS[f.name]} is not determined by these tests. {f.reason}")
    out.append(_figures(swings))
    fit = tuning.fit
    end = "converged" if fit.converged else "did NOT converge"
    out.append(
        f"The fit {end} after {fit.runs} runs of the twin and its variations ({fit.message}), on {fit.clusters} turns."
    )
    if elsewhere:
        out.append(
            "The leakage is based on these turns and on the flow balance of the tests with heave compensation, where"
            " it is larger."
        )
    return (*out, *notes)


def _form(f: TunedValue) -> str:
    """Influence of the form of the law on a value, as a sentence."""
    if not f.form:
        return ""
    part = f" Of the interval +- {100.0 * f.factor.structural:.1f} % are from the form of the law"
    return f"{part}, because {f.form}." if f.fits else f"{part}. Not proposed as a tuned value: {f.form}."


def _figures(swings: SwingComparison) -> str:
    """Gradients, periods and misfit in one sentence."""
    cases: dict[str, Callable[[bool], Estimate]] = {
        "pressure gradients of line A": lambda tuned: swings.gradient("A", tuned),
        "of line B": lambda tuned: swings.gradient("B", tuned),
        "periods between peaks": swings.period,
    }
    parts = []
    for name, error in cases.items():
        before, after = error(False), error(True)
        if before.n and after.n:
            parts.append(f"{name} {100.0 * before.value:+.1f} % ({100.0 * after.value:+.1f} %)")
    if not parts:
        return "No turn shows a pressure gradient or a period in both twin and crane."
    return f"Twin against crane, by its file and (tuned): {', '.join(parts)}."


def _oil(crane: Crane, name: str) -> str:
    return f" (as volume of a line at {show(crane.active.line.bulk_modulus, 'pressure', 6)})" if name == C_H else ""


def tables_of(crane: Crane, values: Sequence[TunedValue], tuning: Tuning, swings: SwingComparison) -> tuple[Table, ...]:
    """Tuned values; before and after; free nuisance parameters."""
    return (_tuned(crane, values), _before_after(swings), _nuisance_table(tuning))


def _tuned(crane: Crane, values: Sequence[TunedValue]) -> Table:
    rows = []
    for f in values:
        value, kind = amounts(crane)[f.name] if f.of is None else (f.of, amounts(crane)[f.name][1])
        if f.known:
            cells = (
                show(f.factor.value * value, kind, 4),
                f"{show(f.factor.low * value, kind, 4)}",
                f"{show(f.factor.high * value, kind, 4)}",
            )
            rows.append((LETTERS[f.name], show(value, kind, 4), *cells, f"{100.0 * (f.factor.value - 1.0):+.1f} %"))
        else:
            rows.append((LETTERS[f.name], show(value, kind, 4), "-", "-", "-", "-"))
    title = "Tuned on the winch's dynamics (C_h as oil in a line; leakage with the pumps full, motors at 1000 rev/min)"
    return Table(("", "crane\nfile", "tuned", "95 %\nfrom", "95 %\nto", "change"), tuple(rows), title)


def _before_after(swings: SwingComparison) -> Table:
    def row(name: str, of: Callable[[bool], Estimate]) -> tuple[str, ...]:
        before, after = of(False), of(True)
        shown = (change(e.value) if e.n else "-" for e in (before, after))
        return name, *shown, f"{before.n:g}"

    crane, before, after = swings.spectral
    rows = [
        row("pressure gradient, line A", lambda tuned: swings.gradient("A", tuned)),
        row("pressure gradient, line B", lambda tuned: swings.gradient("B", tuned)),
        row("period between peaks", swings.period),
        row("damping ratio", swings.damping),
    ]
    if all(math.isfinite(x) for x in swings.spectral):
        rows.append(
            (
                "period in the spectrum",
                f"{100.0 * (before / crane - 1.0):+.1f} %",
                f"{100.0 * (after / crane - 1.0):+.1f} %",
                "all",
            )
        )
    for name in swings.misfit_before:
        rows.append(
            (
                f"rms of {name}, part of its own",
                *(f"{100.0 * m[name]:.1f} %" for m in (swings.misfit_before, swings.misfit_after)),
                "all",
            )
        )
    header = ("twin over crane, less 1", "crane\nfile", "tuned, and\nrest free", "places")
    return Table(header, tuple(rows), "Twin against crane, driven by the measured commands")


def _nuisance_table(tuning: Tuning) -> Table:
    """Nuisance parameters left free so that they do not bias the three."""
    theta, deviation = tuning.fit.theta, np.sqrt(np.diag(tuning.fit.covariance))
    rows = []
    for u in (u for u in UNKNOWNS if u.name not in TUNED):
        x, s = float(theta[PLACE[u.name]]), float(deviation[PLACE[u.name]])
        rows.append(
            (u.meaning, f"{100.0 * math.expm1(x):+.1f} %", f"{100.0 * NORMAL_95 * s:.1f} %" if s < 0.5 else "open")
        )
    for e in EXTRAS:
        x, s = float(theta[PLACE[e.name]]) / e.scale, float(deviation[PLACE[e.name]]) / e.scale
        rows.append((e.meaning, f"{x:+.2f} {e.unit}", f"{1.96 * s:.2f} {e.unit}"))
    return Table(("", "found", "+-"), tuple(rows), "Free nuisance parameters, not part of the verdict")
