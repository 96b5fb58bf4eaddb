"""What the fit gives for capacitance, leakage and inertia, with intervals, and what of it the data can tell; the measures of step 4."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from stillhook.validate.dynamics_fit import Tuning
from stillhook.validate.dynamics_runs import Stretch
from stillhook.validate.dynamics_swings import Compared, Errors
from stillhook.validate.dynamics_unknowns import C_H, C_LEAK, INERTIA, MOST, PLACE
from stillhook.validate.lines import Measure
from stillhook.validate.transients import Transient

ERROR = {C_H: "C_h_error", C_LEAK: "C_leak_error", INERTIA: "J_m_eff_error"}
"""Name of the measure of each tuned number: tuned over crane file, less 1."""
UNSEEN: Mapping[str, float] = {C_H: 0.01, C_LEAK: 0.02, INERTIA: 0.01}
"""Deviation of the logarithm that no residual shows, added to that of the fit: gain errors of the pressure transmitters and the tolerance
of the motors' displacement scale what is found, and the twin's one volume a line and its friction law stand for more than they are."""
WIDEST: Mapping[str, float] = {C_H: 0.2, C_LEAK: 0.4, INERTIA: 0.2}
"""Half width of the interval of the logarithm beyond which the data cannot tell a number."""
LEVEL = 0.975
MOST_LEFT = 0.25
"""Part of a signal's own deviation that a tuned twin may leave; beyond it is no twin of this winch, and its numbers mean nothing. Another
friction law, lines with two ends and sensors leave 0.02 to 0.07."""
MORE = "Make more and quicker turns without load, and log all signals."
JUDGED = ("p_a", "p_b", "omega_m")


@dataclass(frozen=True)
class Found:
    """One tuned number. factor: tuned over crane file, with its 95 % interval low..high; known: the data can tell it, and if not, why."""

    name: str
    factor: float
    low: float
    high: float
    known: bool
    why: str = ""


def found_of(tuning: Tuning, name: str, misfit: Mapping[str, float]) -> Found:
    """The tuned number of this name, by Student's t with as many degrees of freedom as there are turns less one.

    misfit: what the tuned twin leaves of each signal, over the signal's own deviation.
    """
    from scipy.stats import t as student

    i, fit = PLACE[name], tuning.fit
    x = float(fit.theta[i])
    spread = math.hypot(math.sqrt(float(fit.covariance[i, i])), UNSEEN[name])
    half = float(student.ppf(LEVEL, fit.clusters - 1)) * spread if fit.clusters > 1 else math.inf
    worst = max((s for s in misfit if s in JUDGED), key=lambda s: misfit[s], default="")
    why = ""
    if worst and misfit[worst] > MOST_LEFT:
        left = f"The tuned twin leaves {100.0 * misfit[worst]:.0f} % of {worst}"
        why = f"{left}: another machine, or signals that do not belong together. Check the mapping."
    elif not fit.converged:
        why = f"The fit did not converge after {fit.runs} runs ({fit.said}). {MORE}"
    elif min(x - float(tuning.low[i]), float(tuning.high[i]) - x) < 0.01 * MOST:
        bound = f"The fit runs into its bound at {math.exp(x):.3g} times the crane file"
        why = f"{bound}: the twin cannot repeat this test. Check crane file and mapping."
    elif half > WIDEST[name]:
        why = f"The turns leave it open by a factor of {math.exp(half):.3g} either way. {MORE}"
    edge = min(half, 5.0)
    return Found(name, math.exp(x), math.exp(x - edge), math.exp(x + edge), not why, why)


def measures_of(
    found: Sequence[Found], swings: Compared, stretches: Sequence[Stretch], turns: Sequence[Transient], tuning: Tuning
) -> tuple[Measure, ...]:
    """The measures of step 4."""
    seconds = sum(len(s.t) * s.record.step for s in stretches)
    data = f"{len(turns)} turns, {seconds:.0f} s"
    out = [_change(f, data) for f in found]
    for tuned in (False, True):
        end = "_tuned" if tuned else ""
        out += [_error(f"pressure_gradient_error{end}", swings.gradient(line, tuned), f"line {line}") for line in ("A", "B")]
        out.append(_error(f"swing_period_error{end}", swings.period(tuned), ""))
        out.append(_error(f"swing_damping_error{end}", swings.damping(tuned), ""))
        misfit = swings.misfit_after if tuned else swings.misfit_before
        out += [Measure(f"dynamics_misfit{end}", misfit[n], test=n, data=data) for n in JUDGED if n in misfit]
    return tuple(out)


def _change(f: Found, data: str) -> Measure:
    if not f.known:
        return Measure(ERROR[f.name], None, data=data, note=f.why)
    return Measure(ERROR[f.name], f.factor - 1.0, low=f.low - 1.0, high=f.high - 1.0, data=data, note="tuned over the crane file's, less 1")


FEWEST_PLACES = 3
"""Source: paper F step 4 measures the period in three places."""


def _error(name: str, errors: Errors, test: str) -> Measure:
    low, high = errors.interval
    data = f"{errors.places} places"
    if errors.places < FEWEST_PLACES:
        note = (
            f"Crane and twin both show it in {errors.places} places; {FEWEST_PLACES} are the least. Make more and quicker turns both ways."
        )
        return Measure(name, None, test=test, data=data, note=note)
    return Measure(name, errors.mean, low=low, high=high, test=test, data=data, note="simulated over measured, less 1")
