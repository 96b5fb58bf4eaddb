"""Where the pumps' oil goes: flow balance of the active circuit, for the ratio of the displacements, the leakage and the capacitance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.physics.motor import motor_leakage
from stillhook.physics.pump import LEAK_KNOTS, PumpLeak
from stillhook.physics.valves import external_leakage, internal_leakage
from stillhook.units import parse
from stillhook.validate.campaign import Kind
from stillhook.validate.implied_curves import bridged, differences, integral, moments
from stillhook.validate.implied_parts import Part
from stillhook.validate.implied_regression import Estimate, Fit, FloatArray, fit
from stillhook.validate.implied_settings import known_setting

WINDOW = 0.5
"""Time over which the balance is drawn [s]: shorter than the time for which one line stays the higher one."""
CLEAR = parse("6 bar", "pressure")
"""Least difference of the lines, and least height of the upper one above boost: below, boost and flushing flow as well [Pa]."""
LEAST_ROWS = 100


@dataclass(frozen=True)
class Balance:
    """What the balance implies over what the twin has, less 1: ratio of pump to motor displacement (with their speeds), leakage,
    capacitance of a line; offset: zero error of the pump setting [-]. twin_leakage: the twin's whole leak conductance at the mean of the
    data [m^3/s/Pa]; tests that it rests on; measured_motors, measured_pumps: settings were logged, not made from commands.
    For figures, window by window towards the higher line [m^3/s]: Q_p of the pumps, Q_m of the motors, Q_lost what is missing between
    them, Q_leak what the twin's leakage would take."""

    ratio: Estimate
    leakage: Estimate
    capacitance: Estimate
    offset: Estimate
    twin_leakage: float
    tests: tuple[str, ...]
    measured_motors: bool
    measured_pumps: bool
    Q_p: FloatArray
    Q_m: FloatArray
    Q_lost: FloatArray
    Q_leak: FloatArray


def pump_conductance(alpha_p: FloatArray, leak: PumpLeak) -> FloatArray:
    """The twin's pump leak conductance at measured settings [m^3/s/Pa], (n,)."""
    return np.interp(np.abs(alpha_p), LEAK_KNOTS, leak)


def balance(parts: Sequence[Part]) -> Balance | None:
    """Flow balance of the higher line, window by window; None where signals are missing or the lines are never far enough apart.

    .. math:: D_m \\omega_m = r\\,D_p \\omega_p \\alpha_p - c\\,(C_{int}\\Delta p + C_{ext} p) - C_h \\dot p

    in the direction of the higher line, integrated. On that line neither boost nor flushing flow. Source: Moslatt 2020 E eq. 11.
    Tests with heave compensation alone are used where there are any: at full pumps the electric motors slip, which looks like leakage.
    """
    mine = [p for p in parts if p.kind is Kind.AHC]
    rows = [row for part in mine or parts if (row := _rows(part)) is not None]
    if not rows:
        return None
    Q_m, Q_p, zero, leak, C, rate, block = (np.concatenate(c) for c in zip(*rows, strict=True))
    if np.isfinite(Q_m).sum() < LEAST_ROWS:
        return None
    found = fit((Q_p, zero, -leak, -C, rate), Q_m, block)
    if found is None:
        return None
    return _balance(mine or parts, found, (Q_p, zero, leak, C, rate), Q_m)


def _balance(parts: Sequence[Part], found: Fit, columns: tuple[FloatArray, ...], Q_m: FloatArray) -> Balance:
    Q_p, zero, leak, C, rate = columns
    pumps = parts[0].params.active.pumps
    full = pumps.D_max * pumps.omega_p
    logged = [p for p in parts if _logged(p)]
    mean = np.concatenate([_conductance(p) for p in logged])
    return Balance(
        ratio=Estimate(float(found.b[0]) - 1.0, found.half(0), found.blocks), leakage=Estimate(float(found.b[2]) - 1.0, found.half(2)),
        capacitance=Estimate(float(found.b[3]) - 1.0, found.half(3)), offset=Estimate(float(found.b[1] / full), found.half(1) / full),
        twin_leakage=float(np.nanmean(mean)), measured_motors=all(p.has("alpha_m") for p in logged),
        tests=tuple(dict.fromkeys(p.test for p in logged)), measured_pumps=all(p.has("alpha_p") for p in logged),
        Q_p=Q_p, Q_m=Q_m, Q_lost=found.b[0] * Q_p + found.b[1] * zero - found.b[3] * C + found.b[4] * rate - Q_m, Q_leak=leak,
    )  # fmt: skip


def _logged(part: Part) -> bool:
    return part.has("p_a", "p_b") and part.omega_m is not None


def _conductance(part: Part) -> FloatArray:
    """The twin's leak conductance of pumps and motors together at the measured settings and speeds, (n,) [m^3/s/Pa]."""
    active, alpha_p = part.params.active, known_setting(part, "p")
    assert part.omega_m is not None
    pumps = pump_conductance(alpha_p, active.pumps.leak) if alpha_p is not None else np.nan
    return np.asarray(pumps + motor_leakage(part.omega_m, active.motors))


def _rows(part: Part) -> tuple[NDArray[Any], ...] | None:
    """Means over windows in the direction of the higher line: Q_m, Q_p, one (a zero error of the pumps), leak flow, C_h dp/dt, rate of Q_m
    (a lag of the speed signal), block."""
    alpha_p, alpha_m = known_setting(part, "p"), known_setting(part, "m")
    if not _logged(part) or alpha_p is None or alpha_m is None:
        return None
    omega_m, active, step = part.omega_m, part.params.active, part.step
    assert omega_m is not None
    p_a, p_b = (bridged(part[name], step) for name in ("p_a", "p_b"))
    dp, C = p_a - p_b, _conductance(part)
    higher = np.maximum(p_a, p_b)
    D_m = active.motors.count * active.motors.D_max
    flows = {
        "Q_m": D_m * alpha_m * omega_m,
        "Q_p": active.pumps.D_max * active.pumps.omega_p * alpha_p,
        "leak": internal_leakage(C, np.abs(dp)) + external_leakage(C, higher),
    }
    mean = {name: differences(integral(x, step), step, WINDOW) / WINDOW for name, x in flows.items()}
    way = _way(dp, higher, part)
    C_h = differences(higher, step, WINDOW) / WINDOW / active.i_C_h
    Q_m = np.where(way != 0.0, way * mean["Q_m"], np.nan)
    rate = way * differences(flows["Q_m"], step, WINDOW) / WINDOW
    return Q_m, way * mean["Q_p"], way, mean["leak"], C_h, rate, part.blocks(moments(part, WINDOW))


def _way(dp: FloatArray, higher: FloatArray, part: Part) -> FloatArray:
    """Per window, 1 where line a is the higher one all the time, -1 where b is, 0 where neither clearly is or a valve flows."""
    active = part.params.active
    good = (np.abs(dp) > CLEAR) & (higher > active.boost.p + CLEAR) & (higher < active.relief.p - CLEAR)
    sign = np.where(good, np.sign(dp), 0.0)
    every = max(1, round(WINDOW / part.step))
    n = len(range(0, part.n, every)) - 1
    inside = np.stack([sign[i * every : (i + 1) * every + 1] for i in range(n)]) if n else np.zeros((0, 1))
    return np.where(np.abs(inside.sum(axis=1)) == inside.shape[1], np.sign(inside[:, 0]), 0.0) if n else np.zeros(0)
