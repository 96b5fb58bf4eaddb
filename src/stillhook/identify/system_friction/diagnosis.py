"""What a campaign cannot determine, and what would resolve it, in plain words."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stillhook.identify.system_friction.fitting.fit import Y_4_MOST, FrictionFit
from stillhook.identify.system_friction.fitting.model import Y_LINEAR, Points, Y, system_friction
from stillhook.identify.system_friction.fitting.uncertainty import blind_directions, correlation, shift_by_motor
from stillhook.library import frictions
from stillhook.library import system_friction as published
from stillhook.library.parameter_sets import LossSet
from stillhook.logs.findings import SET_VALUES
from stillhook.logs.types import Log
from stillhook.statistics.estimate import Estimate
from stillhook.units import parse, show

ONE_LOAD = 1.3
"""Ratio of the largest to the smallest drum torque below which a campaign has one load: what is in proportion to it and
what is constant then differ by less than a third over the complete campaign."""
LIGHT = 0.2
"""Share of SWL below which a single load is a light one, so that constant terms are kept and not those in proportion to
the load."""
SLOW = parse("150 rev/min", "rotation")
"""A campaign whose slowest pair is faster does not see break-away friction fade: published Y_4 are 157 to 270 rev/min,
and at 150 rev/min four to six tenths of it are gone."""
FAST = parse("500 rev/min", "rotation")
"""A campaign whose fastest pair is slower does not separate friction that grows with speed from break-away friction
that fades."""
ONE_DISPLACEMENT = 0.05
BOUND_TOGETHER = 0.95
OUTLIER = 4.0  # standard uncertainties: one in 16,000 by chance
FEW = 5  # outliers that are listed one by one
LACK = 3.0
"""Scatter beyond the stretches' own, over that, from which on the model (and not the sensors) is said to leave it."""


DRIFT_SHOWN = parse("0.1 bar", "pressure")
"""Drift of the zero over a test from which it is worth reporting: that of a good transmitter in a changing
temperature."""
COURSE_SHOWN = 0.01
"""The same for the friction, over itself: two kelvin of oil."""


@dataclass(frozen=True)
class Statement:
    """``code`` short name; ``text`` what is so, and what to do; ``severe`` the set must not be used as it is."""

    code: str
    text: str
    severe: bool = False


@dataclass(frozen=True)
class Design:
    """What can be requested of a campaign: ``used`` linear parameters that may be free, ``given`` ones that come from
    elsewhere [SI], and why; ``keep_Y_2`` true where Y_2 represents more than itself."""

    used: tuple[str, ...]
    prescribed: Mapping[str, float]
    statements: tuple[Statement, ...]
    keep_Y_2: bool | None = None


def design(points: Points, SWL_torque: float, like: Mapping[str, float] | None = None) -> Design:
    """Which parameters the loads and speeds of a campaign can determine at all.

    Parameters: points measured ones; SWL_torque drum torque at SWL [N m]; like parameters of another winch [SI], to
    fill in what this one's tests cannot determine.
    """
    points, used, prescribed, out = points.fitted(), list(Y_LINEAR), dict[str, float](), []
    low, high = float(points.T_d.min()), float(points.T_d.max())
    if high <= ONE_LOAD * low:
        light = high < LIGHT * SWL_torque
        lost, fading = (("Y_1", "Y_6"), ("Y_3", "Y_2")) if light else (("Y_3", "Y_2"), ("Y_1", "Y_6"))
        for name in lost:
            used.remove(name)
        if like:
            prescribed |= {n: like[n] for n in lost}
        filled = "taken from the set of like" if like else "left out"
        text = (
            f"All tests carry about the same drum torque ({show(high, 'drum_torque', 3)}): friction in proportion to"
            f" the load (Y_1, Y_6) and constant friction (Y_3, Y_2) cannot be distinguished; {', '.join(lost)}"
            f" {filled}, {', '.join(fading)} represent both. The result holds for this load only. Add a staircase"
            f" {'with a load near SWL' if light else 'with the empty hook'}."
        )
        out.append(Statement("one load", text))
    slowest, fastest = float(points.omega.min()), float(points.omega.max())
    if slowest > SLOW:
        used = [n for n in used if n not in ("Y_1", "Y_3")]
        prescribed |= {n: like[n] for n in ("Y_1", "Y_3", "Y_4")} if like else {}
        text = (
            f"The slowest pair runs at {show(slowest, 'rotation', 3)}: break-away friction (Y_1, Y_3, Y_4) cannot be"
            " seen, and stick-slip depends on it. "
            + ("It is taken from the set of like. " if like else "")
            + "Add steps between 20 and 150 rev/min, or name a set of a similar winch, like."
        )
        out.append(Statement("no low speed", text, severe=like is None))
    if fastest < FAST:
        text = (
            f"The fastest pair runs at {show(fastest, 'rotation', 3)}: friction that grows with speed (Y_5) is hardly"
            " seen. Add steps up to the highest speed of the winch."
        )
        out.append(Statement("no high speed", text))
    if float(np.ptp(points.D_m)) < ONE_DISPLACEMENT * float(points.D_m.max()):
        text = (
            f"All tests have one displacement ({show(float(points.D_m.mean()), 'displacement', 3)} a motor):"
            " whether the split between motor loss and system friction is right cannot be checked. Repeat a load at two"
            " thirds of it."
        )
        out.append(Statement("one displacement", text))
    constant = "Y_2" in used and "Y_6" not in used and "Y_6" not in prescribed
    return Design(tuple(used), prescribed, tuple(out), True if constant else None)


def judge(points: Points, fit: FrictionFit, intervals: Mapping[str, Estimate]) -> tuple[Statement, ...]:
    """What the fit itself shows: bounds, open or useless intervals, parameters bound together, outliers, what the model
    leaves over."""
    points = points.fitted()
    out = [*_limits(fit), *_intervals(intervals), *_together(points, fit)]
    sigma = fit.noise.sigma
    far = np.flatnonzero(np.abs(fit.residual) > OUTLIER * sigma)
    if len(far):
        places = ", ".join(
            f'test "{points.names[points.test[i]]}" at {show(float(points.omega[i]), "rotation", 3)}' for i in far[:FEW]
        )
        more = f" and {len(far) - FEW} more" if len(far) > FEW else ""
        text = (
            f"{len(far)} pairs are more than {OUTLIER:g} standard uncertainties off: {places}{more}. Look at their"
            " stretches."
        )
        out.append(Statement("outliers", text))
    return (*out, *_drift(fit), *_residual_statements(points, fit))


def _drift(fit: FrictionFit) -> list[Statement]:
    """Slow drift of the transmitters, and friction that varies with time, where the campaign shows them."""
    zero, course = fit.noise.zero_drift, fit.noise.friction_drift
    out = []
    if zero > DRIFT_SHOWN:
        text = (
            f"The zero of p_a - p_b drifts by about {show(zero, 'pressure', 2)} over a test, as hoisting and lowering"
            " together show. It is taken off, and what stays of it is in the intervals. Let the transmitters warm up"
            " and read them at rest before and after each test; what repeats badly beyond that belongs into the"
            ' campaign file: [accuracy] p = "0.1 bar".'
        )
        out.append(Statement("zero drift", text))
    if course > COURSE_SHOWN:
        text = (
            f"Friction depends on time or test in addition to speed and load, by about {course:.1%} (oil that warms up,"
            " or a law of another form): at rising speeds this cannot be distinguished from friction that varies with"
            " speed, so the intervals are wider. Warm the oil up first, and run the speeds once more in falling order."
        )
        out.append(Statement("friction drift", text))
    return out


def _limits(fit: FrictionFit) -> list[Statement]:
    """Where the fit ended on the limits of what friction can be."""
    out = []
    if not any(getattr(fit.y, n) > 0.0 for n in Y_LINEAR):
        text = (
            "No system friction is left: the motor loss alone is more than what was measured. Check the motor loss,"
            " units and scales, and the number of motors."
        )
        out.append(Statement("nothing left", text, severe=True))
    if "Y_4" in fit.at_bound:
        text = (
            f"Y_4 ended on the edge of its range ({show(fit.y.Y_4, 'rotation', 3)}): break-away friction does not fade"
            " the way the model has it. Look at the slowest steps; add some between 20 and 300 rev/min."
        )
        out.append(Statement("Y_4 at its bound", text, severe=True))
    return out


def _intervals(intervals: Mapping[str, Estimate]) -> list[Statement]:
    open_ = [
        n
        for n, i in intervals.items()
        if math.isinf(i.high) or (n == "Y_4" and i.high >= min(10.0 * i.value, 0.999 * Y_4_MOST))
    ]
    zero = [n for n, i in intervals.items() if i.low <= 0.0 and n not in open_]
    out = []
    if open_:
        text = f"{', '.join(open_)}: no upper end with 95 % confidence. See the proposed tests."
        out.append(Statement("open interval", text, severe="Y_4" in open_))
    if zero:
        out.append(Statement("not above zero", f"{', '.join(zero)}: may as well be zero (95 % interval)."))
    return out


def _together(points: Points, fit: FrictionFit) -> list[Statement]:
    rest = "cannot be distinguished by these speeds and loads. See the proposed tests."
    blind = [names for names in blind_directions(points, fit) if len(names) > 1]
    out = [Statement("cannot be distinguished", f"{' and '.join(names)} {rest}") for names in blind]
    r = correlation(fit)
    bound = [
        f"{fit.names[j]} and {a} ({r[i, j]:.2f})"
        for i, a in enumerate(fit.names)
        for j in range(i)
        if abs(r[i, j]) > BOUND_TOGETHER
    ]
    if bound and not out:
        text = f"Bound together (correlation): {', '.join(bound)}. Trust what they add up to in the friction, not each."
        out.append(Statement("bound together", text))
    return out


def _residual_statements(points: Points, fit: FrictionFit) -> list[Statement]:
    """Residuals that vary with the test: friction that neither model has."""
    noise = float(np.sqrt(np.mean(points.u_dp**2)))
    if fit.tau <= LACK * noise:
        return []
    means = []
    for k in np.unique(points.test):
        of_test = points.test == k
        r = fit.residual[of_test]
        if of_test.sum() > 2 and abs(r.mean()) > 3.0 * r.std(ddof=1) / math.sqrt(of_test.sum()):
            means.append((abs(float(r.mean())), float(r.mean()), points.names[k], float(points.D_m[of_test].mean())))
    text = (
        f"The models leave {show(float(np.sqrt(np.mean(fit.residual**2))), 'torque', 2)} a motor (RMS), more than the"
        " stretches scatter: friction that they do not have"
    )
    if means:
        _, r, name, D = max(means)
        sign = "+" if r > 0 else ""
        text += (
            f', most in test "{name}" ({show(D, "displacement", 3)} a motor: {sign}{show(r, "torque", 2)} in the mean)'
        )
    text += (
        ". The intervals count it as scatter. Differences that vary with displacement point to the motor model (second"
        " loop)."
    )
    return [Statement("left over", text)]


UNLIKE = 2.5
"""Factor beyond the published winches' system friction from which a result is called unusual: they differ by two among
themselves."""
UNLIKE_SPEED = parse("500 rev/min", "rotation")  # where break-away friction has faded and viscous friction is small


def unlike(points: Points, y: Y) -> tuple[Statement, ...]:
    """A word where the friction is far from that of every winch in the library, as a wrong unit, scale or motor model
    makes it."""
    fitted = points.fitted()
    T_d, omega = np.array([float(fitted.T_d.max())]), np.array([UNLIKE_SPEED])
    estimate = float(system_friction(omega, T_d, y)[0])
    others = [float(system_friction(omega, T_d, Y.of(published(name)))[0]) for name in frictions()]
    if min(others) / UNLIKE <= estimate <= max(others) * UNLIKE:
        return ()
    text = (
        f"System friction of {show(estimate, 'torque', 3)} a motor at 500 rev/min and"
        f" {show(float(T_d[0]), 'drum_torque', 3)}: published winches have {show(min(others), 'torque', 3)} to"
        f" {show(max(others), 'torque', 3)} there. Check units and scales, number of motors and motor loss."
    )
    return (Statement("unusual", text),)


MOTOR_SHARE = 0.5
"""Shift by the motor's loss over a parameter's own standard error from which it is worth reporting."""


def motor_statement(losses: LossSet, points: Points, fit: FrictionFit) -> tuple[Statement, ...]:
    """How far the motor's own uncertainty moves what was found; silent where nothing says how well its loss is
    known."""
    if losses.evidence is None:
        return ()
    shift = shift_by_motor(points, fit, losses.motor, losses.evidence.names, losses.evidence.matrix)
    moved = [(n, float(s)) for n, s in zip(fit.names, shift, strict=True) if s > MOTOR_SHARE * fit.sd(n)]
    if not moved:
        return ()
    texts = ", ".join(f"{n} by {s / fit.sd(n):.2g} of its own standard errors" for n, s in moved)
    text = (
        f"The motor loss is itself uncertain; that moves {texts}. It is not in the intervals, which hold for this motor"
        " loss."
    )
    return (Statement("motor loss", text),)


def log_statement(test: str, log: Log) -> tuple[Statement, ...]:
    """What was found in the log of a test."""
    findings = [f for f in log.findings if f.kind != "constant" or f.signal not in SET_VALUES]
    if not findings:
        return ()
    kinds = Counter(f.kind for f in findings)
    counts = f" ({', '.join(f'{n} {kind}' for kind, n in kinds.items())})" if len(findings) > 1 else ""
    more = "; the report lists the others" if len(findings) > 1 else ""
    return (Statement("log", f'test "{test}": found in {log.source}{counts}: {findings[0].text}{more}.'),)
