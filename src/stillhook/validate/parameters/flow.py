"""Where the pumps' oil goes, and pressures at standstill: balances of the closed circuit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.control.commands import SMALL
from stillhook.control.plc import MANUAL
from stillhook.library.leakage import pump_leak
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import LEAK_KNOTS, PumpLeak
from stillhook.spec.crane import Crane
from stillhook.statistics.blocks import fit
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.units import number, parse
from stillhook.validate.criteria.results import Measure, Note
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.data_set.record import Record, stretches_of
from stillhook.validate.parameters.leak_laws import SLIP_PRESSURE, LeakRows
from stillhook.validate.parameters.leakage import LeakChoice, choose
from stillhook.validate.parameters.segments import (
    LogPart,
    bridged,
    by_test,
    differences,
    integral,
    moments,
    smoothed,
    stacked,
)
from stillhook.validate.parameters.settings import known_setting

WINDOW = 0.5
"""Window of the balance [s]: shorter than the time for which one line stays the higher one."""
CLEAR = parse("6 bar", "pressure")
"""Least difference of the lines, and of the upper one to boost [Pa]: below, boost and flushing flow as well."""
LEAST_ROWS = 100


@dataclass(frozen=True)
class Balance:
    """ratio: of pump to motor displacement (with their speeds) that the balance implies over the twin's, less 1; leak:
    leakage, in the form that the data support; tests that it is based on; assumed: commands from which settings
    follow that were not logged."""

    ratio: Estimate
    leak: LeakChoice
    tests: tuple[str, ...]
    assumed: tuple[str, ...]


def balance(parts: Sequence[LogPart]) -> Balance | None:
    """Flow balance of the higher line, window by window; None where signals are missing or the lines are never far
    enough apart.

    .. math:: D_m \\omega_m = r\\,D_p \\omega_p \\alpha_p - c\\,(C_{int}\\Delta p + C_{ext} p) - C_h \\dot p

    in the direction of the higher line, integrated. On that line neither boost nor flushing flow. Source: Moslatt 2020
    E eq. 11. Tests with heave compensation alone are used where there are any: at full pumps the electric motors slip,
    which looks like leakage.
    """
    used = [p for p in parts if p.kind is Kind.AHC] or list(parts)
    rows = leak_rows(used)
    if rows is None or np.isfinite(rows.Q_m).sum() < LEAST_ROWS:
        return None
    leak = choose(parts[0].crane, rows)
    if leak is None:
        return None
    logged = [p for p in used if _logged(p)]
    assumed = tuple(f"u_{name}" for name in "mp" if not all(p.has(f"alpha_{name}") for p in logged))
    return Balance(leak.ratio, leak, tuple(dict.fromkeys(p.test for p in logged)), assumed)


def leak_rows(parts: Sequence[LogPart]) -> LeakRows | None:
    """The windows of all parts whose signals suffice; None where none does."""
    rows = [row for part in parts if (row := _rows(part)) is not None]
    return LeakRows(*stacked([vars(row).values() for row in rows])) if rows else None


def _logged(part: LogPart) -> bool:
    return part.has("p_a", "p_b") and part.omega_m is not None


def _rows(part: LogPart) -> LeakRows | None:
    """Means over windows in the direction of the higher line; None where signals are missing. rate: flow of the motors'
    acceleration, which a speed that was logged late has, times its lag."""
    alpha_p, alpha_m = known_setting(part, "p"), known_setting(part, "m")
    if not _logged(part) or alpha_p is None or alpha_m is None:
        return None
    omega_m, active, step = part.omega_m, part.params.active, part.step
    assert omega_m is not None
    p_a, p_b = (bridged(part[name], step) for name in ("p_a", "p_b"))
    dp = p_a - p_b
    higher = np.maximum(p_a, p_b)
    D_m = active.motors.count * active.motors.D_max
    head = internal_leakage(1.0, np.abs(dp)) + external_leakage(1.0, higher)
    file_leak = _pump_conductance(alpha_p, active.pumps.leak) + np.asarray(motor_leakage(omega_m, active.motors))
    flows = {
        "Q_m": D_m * alpha_m * omega_m,
        "Q_p": active.pumps.D_max * active.pumps.omega_p * alpha_p,
        "head": head,
        "stroke": head * _pump_conductance(alpha_p, pump_leak(part.crane.active.pump)),
        "speed": head * np.abs(omega_m),
        "file": head * file_leak,
        "slip": active.pumps.D_max * active.pumps.omega_p * alpha_p**2 * np.abs(dp) / SLIP_PRESSURE,
        "alpha": head * np.abs(alpha_p),
        "dp": np.abs(dp),
    }
    mean = {name: differences(integral(x, step), step, WINDOW) / WINDOW for name, x in flows.items()}
    way = _way(dp, higher, part)
    mean["Q_m"], mean["Q_p"] = np.where(way != 0.0, way * mean["Q_m"], np.nan), way * mean["Q_p"]
    C_h = differences(higher, step, WINDOW) / WINDOW / active.i_C_h
    lag = D_m * integral(alpha_m * np.gradient(omega_m, step), step)
    rate = way * differences(lag, step, WINDOW) / WINDOW
    return LeakRows(way=way, C_h=C_h, rate=rate, block=part.blocks(moments(part, WINDOW)), **mean)


def _pump_conductance(alpha_p: FloatArray, leak: PumpLeak) -> FloatArray:
    """Pump leak conductance of a table at measured settings [m^3/s/Pa], (n,)."""
    return np.interp(np.abs(alpha_p), LEAK_KNOTS, leak)


def _way(dp: FloatArray, higher: FloatArray, part: LogPart) -> FloatArray:
    """Per window, 1 where line a is always the higher one, -1 where b is, 0 where neither is or a valve flows."""
    active = part.params.active
    good = (np.abs(dp) > CLEAR) & (higher > active.boost.p + CLEAR) & (higher < active.relief.p - CLEAR)
    sign = np.where(good, np.sign(dp), 0.0)
    every = max(1, round(WINDOW / part.step))
    n = len(range(0, part.n, every)) - 1
    inside = np.stack([sign[i * every : (i + 1) * every + 1] for i in range(n)]) if n else np.zeros((0, 1))
    return np.where(np.abs(inside.sum(axis=1)) == inside.shape[1], np.sign(inside[:, 0]), 0.0) if n else np.zeros(0)


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
    """One rest. after: 1 after hoisting, -1 after lowering, 0 where the log begins at rest; dp: p_a - p_b that it ends
    at [Pa]; seconds that it counts."""

    test: str
    after: int
    dp: Estimate
    seconds: float


@dataclass(frozen=True)
class Rests:
    """dp: p_a - p_b at rest, mean of those after hoisting and those after lowering [Pa]; tau: time in which differences
    leak away [s]; rests: each; alpha_p: pump setting that would hold dp against the crane file's leakage [-]."""

    dp: Estimate
    tau: float
    rests: tuple[Rest, ...]
    alpha_p: float


def rests(crane: Crane, records: Sequence[Record]) -> Rests | None:
    """All rests on the brake in all records, fitted together; None where there are none."""
    if crane.brake is None:
        return None
    raw = [one for r in records if _standing(r) for one in _of(crane, r)]
    if not raw:
        return None
    best = _leaking(raw)
    each = tuple(Rest(test, after, _ended(t, dp, best), float(t[-1] - t[0])) for test, after, t, dp in raw)
    dp = _mean(each)
    setting = dp.value * float(crane.active.C_leak) / (crane.active.pump.D_total * crane.active.pump.omega_p)
    return Rests(dp, best[0], each, setting)


Raw = tuple[str, int, FloatArray, FloatArray]


def _standing(r: Record) -> bool:
    return r.has("p_a", "p_b") and (r.has("omega_m") or r.has("v_w"))


def _of(crane: Crane, r: Record) -> list[Raw]:
    """Rests of a record: test, after what, time since the rest counts [s] and p_a - p_b [Pa] in means over EVERY."""
    assert crane.brake is not None
    wait = crane.brake.t_wait + crane.brake.t_close + STOPPED
    out: list[Raw] = []
    speed = r.signals["omega_m"] if r.has("omega_m") else r.signals["v_w"] * crane.i_hD / (0.5 * crane.drum.d_max)
    every = max(1, round(EVERY / r.step))
    speed = smoothed(bridged(speed, r.step), r.step, SPEED)
    for a, b in stretches_of(_stands(r, speed)):
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
        out.append((r.test.name, after, ((np.arange(n) + 0.5) * EVERY)[good], dp[good]))
    return out


def _stands(r: Record, speed: FloatArray) -> BoolArray:
    """Samples at standstill without a command in manual mode, (n,)."""
    stated = MANUAL if r.test.mode is None or r.test.mode.value == "manual" else 1.0
    mode = r.signals["mode"] if r.has("mode") else np.full(len(r.t), stated)
    with np.errstate(invalid="ignore"):
        still = (np.abs(speed) < STANDS) & (mode == MANUAL) & np.isfinite(r.signals["p_a"] + r.signals["p_b"])
        if r.has("v_op"):
            still &= np.abs(r.signals["v_op"]) < JOYSTICK
        if r.has("u_p"):
            still &= np.abs(r.signals["u_p"]) < SMALL
    return np.asarray(still)


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
    residual_sum = float(np.sum((dp - X @ b) ** 2))
    inverse = np.linalg.pinv(A)
    return float(b[0]), math.sqrt(max(float(inverse[0, 0]), 0.0) * residual_sum / max(1, len(t) - 2)), residual_sum


def _ended(t: FloatArray, dp: FloatArray, taus: tuple[float, float, float]) -> Estimate:
    """Final value of a rest: with noise and the time constants that fit nearly as well."""
    value, u, _ = _fitted(t, dp, taus[0])
    others = [_fitted(t, dp, tau)[0] for tau in taus[1:]]
    return Estimate.around(value, math.hypot(t_factor(max(len(t) - 2, 1)) * u, max(abs(x - value) for x in others)))


def _mean(each: Sequence[Rest]) -> Estimate:
    """Mean of the rests after hoisting and of those after lowering, half each, so that residues of the last motion
    cancel; interval from the scatter and the interval of each."""
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


WORTH = 1e5
"""Difference from which the pumps' zero is named as the other cause [Pa]."""


def rest_measure(crane: Crane, estimate: Rests | None, records: Sequence[Record]) -> Measure:
    """The difference at rest as a measure of step 1, with its likely causes."""
    name = "rest_pressure_difference"
    if estimate is None:
        logged = any(_standing(r) for r in records)
        return Measure.of(name, None, Note("no-brake") if crane.brake is None else "" if logged else Note("log-rests"))
    dp, sides = estimate.dp, [sum(x.after == side for x in estimate.rests) for side in (1, -1)]
    seconds = sum(x.seconds for x in estimate.rests)
    data = f"{len(estimate.rests)} rests ({sides[0]} after hoisting, {sides[1]} after lowering), {number(seconds, 3)} s"
    notes = [Note("lines-at-rest", dp=dp.value)]
    if abs(dp.value) > WORTH:
        notes.append(Note("rest-zero", setting=estimate.alpha_p))
    return Measure.of(name, dp, *notes, data=data)


APART = parse("10 bar", "pressure")
"""Difference of the lines from which the lower one is held by boost and flushing alone [Pa]."""


@dataclass(frozen=True)
class Pressures:
    """One test. low: mean of the lower line while the lines are apart, less the twin's boost pressure [Pa], None where
    they never are; high: highest pressure over the relief setting, less 1; least pressure [Pa]."""

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
        low = None if fitted is None else fitted.estimate(0, -active.boost.p)
        high, least = float(np.nanmax(np.maximum(a, b))), float(np.nanmin(np.minimum(a, b)))
        out.append(Pressures(test, low, high / active.relief.p - 1.0, least))
    return tuple(out)
