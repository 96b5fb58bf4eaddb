"""Pressure difference of both lines while the winch is on its brake: zero errors of a transmitter or of the
pumps.

Behind a closed brake no difference of the lines is maintained: it leaks away, dp(t) = d + A exp(-t / tau), and d is due
to zero errors of the transmitters or of the pumps. Without a brake, friction maintains a difference, and a rest shows
nothing.

Pressures of the closed circuit: boost on the lower line, relief on the higher one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.control.brake import SMALL
from stillhook.control.plc import MANUAL
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.statistics.jackknife_regression import fit
from stillhook.units import number, parse, show
from stillhook.validate.criteria.results import Measure
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.segments import LogPart, bridged, by_test, smoothed

STANDS = 1.0
"""Motor speed below which the winch is at standstill [rad/s], some 10 rev/min: what an encoder's noise reaches."""
SPEED = 0.2
"""Width of the means of the speed [s]: single samples are noisy."""
JOYSTICK = 1e-3
"""Joystick below which it is at zero [m/s]."""
STOPPED = 0.3
"""Time after the brake has closed before a rest counts [s]: the oil that was moving has come to rest."""
LEAST = 1.0
"""Shortest rest that counts, from there on [s]."""
EVERY = 0.1
"""Width of the means that are fitted [s]."""
TAUS = np.geomspace(0.2, 10.0, 40)
"""Times in which a difference may leak away [s]: lines of some litres with the leakage of new to worn units."""
AS_GOOD = 1.5
"""Factor of the least sum of squares, per degree of freedom of one, within which a time of leaking away is as good."""


@dataclass(frozen=True)
class Rest:
    """One rest. test; start [s of the record]; after: 1 after hoisting, -1 after lowering, 0 where the log begins at
    rest; dp: p_a - p_b that it ends at with half of its 95 % interval [Pa]; seconds that it counts; alpha_p: mean
    setting of the pumps, NaN where it was not logged [-]."""

    test: str
    start: float
    after: int
    dp: Estimate
    seconds: float
    alpha_p: float


@dataclass(frozen=True)
class Rests:
    """dp: p_a - p_b at rest, mean of those after hoisting and those after lowering [Pa]; tau: time in which differences
    leak away [s]; rests: each; alpha_p: pump setting that would hold dp against the crane file's leakage [-], measured:
    the logged one, NaN without.
    """

    dp: Estimate
    tau: float
    rests: tuple[Rest, ...]
    alpha_p: float
    measured: float


def lacking(crane: Crane, records: Sequence[Record]) -> str:
    """Reason why no rest can be compared, in words; "" where signals and brake are available."""
    if crane.brake is None:
        return "the crane file has no holding brake, and friction may maintain a difference of the lines"
    known = [r for r in records if _standing(r)]
    return (
        ""
        if known
        else "log p_a, p_b and the motor speed, and keep the winch on its brake for 5 s or more in manual mode"
    )


def rests(crane: Crane, records: Sequence[Record]) -> Rests | None:
    """All rests on the brake in all records, fitted together; None where there are none."""
    if crane.brake is None:
        return None
    raw = [one for r in records if _standing(r) for one in _of(crane, r)]
    if not raw:
        return None
    best = _leaking(raw)
    each = tuple(
        Rest(r.test.name, float(r.t[a]), after, _ended(t, dp, best), float(t[-1] - t[0]), _setting(r, a, b))
        for r, a, b, after, t, dp in raw
    )
    dp = _mean(each)
    leak = float(crane.active.C_leak)
    measured = [x.alpha_p for x in each if math.isfinite(x.alpha_p)]
    held = dp.value * leak / (crane.active.pump.D_total * crane.active.pump.omega_p)
    return Rests(dp, best[0], each, held, float(np.mean(measured)) if measured else math.nan)


Raw = tuple[Record, int, int, int, FloatArray, FloatArray]


def _standing(r: Record) -> bool:
    return r.has("p_a", "p_b") and (r.has("omega_m") or r.has("v_w"))


def _of(crane: Crane, r: Record) -> list[Raw]:
    """Rests of a record: samples [a, b), after what, time since the rest counts [s] and p_a - p_b [Pa] in means over
    EVERY."""
    assert crane.brake is not None
    wait = crane.brake.t_wait + crane.brake.t_close + STOPPED
    out: list[Raw] = []
    speed = r.signals["omega_m"] if r.has("omega_m") else r.signals["v_w"] * crane.i_hD / (0.5 * crane.drum.d_max)
    every = max(1, round(EVERY / r.step))
    speed = smoothed(bridged(speed, r.step), r.step, SPEED)
    for a, b in _runs(_stands(r, speed)):
        first = a + round(wait / r.step) if a > 0 else 0
        n = (b - first) // every
        if n * EVERY < LEAST:
            continue
        dp = (r.signals["p_a"] - r.signals["p_b"])[first : first + n * every].reshape(n, every).mean(axis=1)
        good = np.isfinite(dp)
        if good.sum() * EVERY < LEAST:
            continue
        before = speed[max(0, a - round(2.0 / r.step)) : a]
        after = int(np.sign(np.nansum(before))) if len(before) else 0
        out.append((r, first, b, after, ((np.arange(n) + 0.5) * EVERY)[good], dp[good]))
    return out


def _stands(r: Record, speed: FloatArray) -> BoolArray:
    """Samples at standstill without a command in manual mode, (n,)."""
    n = len(r.t)
    mode = (
        r.signals["mode"]
        if r.has("mode")
        else np.full(n, MANUAL if r.test.mode is None or r.test.mode.value == "manual" else 1.0)
    )
    with np.errstate(invalid="ignore"):
        still = (np.abs(speed) < STANDS) & (mode == MANUAL) & np.isfinite(r.signals["p_a"] + r.signals["p_b"])
        if r.has("v_op"):
            still &= np.abs(r.signals["v_op"]) < JOYSTICK
        if r.has("u_p"):
            still &= np.abs(r.signals["u_p"]) < SMALL
    return np.asarray(still)


def _runs(good: BoolArray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], good, [False])).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _leaking(raw: Sequence[Raw]) -> tuple[float, float, float]:
    """The time in which differences leak away that fits all rests best, and the least and the most that do nearly as
    well [s]."""
    sums, rows = np.zeros(len(TAUS)), 0
    for *_, t, dp in raw:
        if len(t) < 4:
            continue
        rows += len(t) - 2
        for i, tau in enumerate(TAUS):
            sums[i] += _fitted(t, dp, float(tau))[2]
    if rows < 1:
        return float(TAUS[len(TAUS) // 2]), float(TAUS[0]), float(TAUS[-1])
    near = TAUS[sums <= sums.min() * (1.0 + AS_GOOD * 4.0 / rows) + 1e-12]
    return float(TAUS[int(np.argmin(sums))]), float(near[0]), float(near[-1])


def _fitted(t: FloatArray, dp: FloatArray, tau: float) -> tuple[float, float, float]:
    """Final value of a rest, its standard error [Pa] and the sum of squares that is left."""
    X = np.column_stack((np.ones_like(t), np.exp(-(t - t[0]) / tau)))
    A = X.T @ X
    b = np.linalg.lstsq(X, dp, rcond=None)[0]
    left = float(np.sum((dp - X @ b) ** 2))
    inverse = np.linalg.pinv(A)
    return float(b[0]), math.sqrt(max(float(inverse[0, 0]), 0.0) * left / max(1, len(t) - 2)), left


def _ended(t: FloatArray, dp: FloatArray, taus: tuple[float, float, float]) -> Estimate:
    """Final value of a rest: with noise and the time constants that fit nearly as well."""
    value, u, _ = _fitted(t, dp, taus[0])
    others = [_fitted(t, dp, tau)[0] for tau in taus[1:]]
    return Estimate.around(value, math.hypot(t_factor(max(len(t) - 2, 1)) * u, max(abs(x - value) for x in others)))


def _setting(r: Record, a: int, b: int) -> float:
    for name in ("alpha_p", "u_p"):
        if r.has(name) and np.isfinite(r.signals[name][a:b]).any():
            return float(np.nanmean(r.signals[name][a:b]))
    return math.nan


def _mean(each: Sequence[Rest]) -> Estimate:
    """Mean of the rests after hoisting and of those after lowering, half each, so that residues of the last motion
    cancel; its interval from the scatter between the rests and the interval of each."""
    groups = [[x for x in each if x.after == side] for side in (1, -1)]
    if not all(groups):
        groups = [list(each)]
    values, variances = [], []
    for group in groups:
        v = np.array([x.dp.value for x in group])
        half = np.array([x.dp.half for x in group])
        w = 1.0 / np.maximum(half, 1e3) ** 2
        mean = float(w @ v / w.sum())
        n = len(v)
        spread = t_factor(n - 1) ** 2 * float(w @ (v - mean) ** 2) / float(w.sum()) / max(n - 1, 1) if n > 1 else 0.0
        values.append(mean)
        variances.append(max(spread, 1.0 / float(w.sum())))
    return Estimate.around(float(np.mean(values)), math.sqrt(sum(variances)) / len(values), len(each))


NO_REST = "the logs contain no rest: keep the winch on its brake for 5 s or more in manual mode, joystick at zero"
WORTH = 1e5
"""Difference from which the pumps' zero is named as the other cause [Pa]."""


def rest_measure(crane: Crane, estimate: Rests | None, records: Sequence[Record]) -> Measure:
    """The difference at rest as a measure of step 1, with its likely causes."""
    name, quantity = "rest_pressure_difference", "pressure"
    if estimate is None:
        return Measure(name, None, quantity, note=lacking(crane, records) or NO_REST)
    dp, sides = estimate.dp, [sum(x.after == side for x in estimate.rests) for side in (1, -1)]
    seconds = sum(x.seconds for x in estimate.rests)
    data = f"{len(estimate.rests)} rests ({sides[0]} after hoisting, {sides[1]} after lowering), {number(seconds, 3)} s"
    note = f"PT A reads {show(abs(dp.value), 'pressure', 2)} {'above' if dp.value > 0.0 else 'below'} PT B at rest"
    if abs(dp.value) > WORTH:
        at = f", their setting is {100.0 * estimate.measured:.2f} %" if math.isfinite(estimate.measured) else ""
        note += f": zero of a transmitter, or pumps {100.0 * abs(estimate.alpha_p):.2f} % off zero behind the brake{at}"
    return Measure(name, dp.value, quantity, dp.low, dp.high, "", data, note)


APART = parse("10 bar", "pressure")
"""Difference of the lines from which the lower one is held by boost and flushing alone [Pa]."""


@dataclass(frozen=True)
class Pressures:
    """One test. low: mean of the lower line while the lines are apart, less the twin's boost pressure [Pa], None where
    they never are; high: highest pressure over the relief setting, less 1; least: lowest pressure [Pa]."""

    test: str
    low: Estimate | None
    high: float
    least: float


def pressures(parts: Sequence[LogPart]) -> tuple[Pressures, ...]:
    """The lines' pressures in every test that has both."""
    out = []
    for test, same in by_test([p for p in parts if p.has("p_a", "p_b")]).items():
        a, b = (np.concatenate([p[name][::10] for p in same]) for name in ("p_a", "p_b"))
        block = np.concatenate([p.blocks(p.t[::10]) for p in same])
        active = same[0].params.active
        apart = np.abs(a - b) > APART
        fitted = fit((np.ones_like(a),), np.where(apart, np.minimum(a, b), np.nan), block)
        low = (
            None
            if fitted is None
            else Estimate.around(float(fitted.b[0]) - active.boost.p, fitted.half(0), fitted.blocks)
        )
        high, least = float(np.nanmax(np.maximum(a, b))), float(np.nanmin(np.minimum(a, b)))
        out.append(Pressures(test, low, high / active.relief.p - 1.0, least))
    return tuple(out)


def passive_pressure(parts: Sequence[LogPart]) -> tuple[float, float] | None:
    """Mean of p_hp in the heave-compensated tests, and the twin's pressure at mid stroke [Pa]; None where it was not
    logged."""
    signals = [p["p_hp"] for p in parts if p.has("p_hp") and p.crane.passive is not None]
    if not signals:
        return None
    passive = parts[0].crane.passive
    assert passive is not None
    values: FloatArray = np.concatenate(signals)
    return float(np.nanmean(values)), passive.accumulator.gas.p_0
