"""Where the pumps' oil goes: flow balance of the active circuit, for the ratio of the displacements, the leakage and
the capacitance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.library.leakage import pump_leak
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import LEAK_KNOTS, PumpLeak
from stillhook.statistics.estimate import Estimate
from stillhook.units import parse
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.parameters.circuit.leakage import SLIP_PRESSURE, LeakChoice, LeakRows, choose
from stillhook.validate.parameters.circuit.settings import known_setting
from stillhook.validate.parameters.segments import LogPart, bridged, differences, integral, moments

WINDOW = 0.5
"""Time over which the balance is drawn [s]: shorter than the time for which one line stays the higher one."""
CLEAR = parse("6 bar", "pressure")
"""Least difference of the lines, and least height of the upper one above boost: below, boost and flushing flow as well
[Pa]."""
LEAST_ROWS = 100


@dataclass(frozen=True)
class Balance:
    """What the balance implies over what the twin has, less 1: ratio of pump to motor displacement (with their speeds),
    leakage, capacitance of a line; offset: zero error of the pump setting [-]. leak: the form of the leakage that the
    data speak for, with which the others were fitted. twin_leakage: the twin's whole leak conductance at the working
    point of the data, weighted with the pressure that drives it [m^3/s/Pa]; tests that it rests on; measured_motors,
    measured_pumps: settings were logged, not made from commands. For figures, window by window towards the higher line
    [m^3/s]: Q_p of the pumps, Q_m of the motors, Q_lost what is missing between them, Q_leak what the twin's leakage
    would take, Q_form
    what the
    chosen form
    takes."""

    ratio: Estimate
    leakage: Estimate
    capacitance: Estimate
    offset: Estimate
    leak: LeakChoice
    twin_leakage: float
    tests: tuple[str, ...]
    measured_motors: bool
    measured_pumps: bool
    Q_p: FloatArray
    Q_m: FloatArray
    Q_lost: FloatArray
    Q_leak: FloatArray
    Q_form: FloatArray


def pump_conductance(alpha_p: FloatArray, leak: PumpLeak) -> FloatArray:
    """The twin's pump leak conductance at measured settings [m^3/s/Pa], (n,)."""
    return np.interp(np.abs(alpha_p), LEAK_KNOTS, leak)


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
    return None if leak is None else _balance(used, rows, leak)


def leak_rows(parts: Sequence[LogPart]) -> LeakRows | None:
    """The windows of all parts whose signals suffice; None where none does."""
    rows = [row for part in parts if (row := _rows(part)) is not None]
    return LeakRows.joined(rows) if rows else None


def _balance(parts: Sequence[LogPart], rows: LeakRows, leak: LeakChoice) -> Balance:
    pumps = parts[0].params.active.pumps
    full = pumps.D_max * pumps.omega_p
    logged = [p for p in parts if _logged(p)]
    b = leak.chosen.fit.b
    slip = leak.slip.value if leak.slip is not None else 0.0
    lost = b[0] * rows.Q_p + b[1] * rows.way - b[2] * rows.C_h + b[3] * rows.rate - slip * rows.slip - rows.Q_m
    form = np.sum([x * rows.column(n) for n, x in leak.chosen.coefficients.items()], axis=0)
    return Balance(
        ratio=leak.nuisance("Q_p", -1.0),
        leakage=leak.value,
        capacitance=leak.nuisance("C_h", -1.0),
        offset=leak.nuisance("way", 0.0, 1.0 / full),
        leak=leak,
        twin_leakage=leak.twin,
        measured_motors=all(p.has("alpha_m") for p in logged),
        tests=tuple(dict.fromkeys(p.test for p in logged)),
        measured_pumps=all(p.has("alpha_p") for p in logged),
        Q_p=rows.Q_p,
        Q_m=rows.Q_m,
        Q_lost=lost,
        Q_leak=rows.file,
        Q_form=form,
    )


def _logged(part: LogPart) -> bool:
    return part.has("p_a", "p_b") and part.omega_m is not None


def _rows(part: LogPart) -> LeakRows | None:
    """Means over windows in the direction of the higher line; None where signals are missing. rate is the flow of the
    motors' acceleration: a speed that was logged late has it, times its lag, whatever the displacement does
    meanwhile."""
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
    file_leak = pump_conductance(alpha_p, active.pumps.leak) + np.asarray(motor_leakage(omega_m, active.motors))
    flows = {
        "Q_m": D_m * alpha_m * omega_m,
        "Q_p": active.pumps.D_max * active.pumps.omega_p * alpha_p,
        "head": head,
        "stroke": head * pump_conductance(alpha_p, pump_leak(part.crane.active.pump)),
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


def _way(dp: FloatArray, higher: FloatArray, part: LogPart) -> FloatArray:
    """Per window, 1 where line a is the higher one all the time, -1 where b is, 0 where neither clearly is or a valve
    flows."""
    active = part.params.active
    good = (np.abs(dp) > CLEAR) & (higher > active.boost.p + CLEAR) & (higher < active.relief.p - CLEAR)
    sign = np.where(good, np.sign(dp), 0.0)
    every = max(1, round(WINDOW / part.step))
    n = len(range(0, part.n, every)) - 1
    inside = np.stack([sign[i * every : (i + 1) * every + 1] for i in range(n)]) if n else np.zeros((0, 1))
    return np.where(np.abs(inside.sum(axis=1)) == inside.shape[1], np.sign(inside[:, 0]), 0.0) if n else np.zeros(0)
