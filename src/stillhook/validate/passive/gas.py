"""Gas of the accumulator: its pressure at mid stroke, its volume by the stiffness, the friction loss of the
piston, its stroke.

The passive motors move oil, V = -int D_pm alpha_pm omega_m dt, and the pressure answers: dp = (n p / V_gas) dV + R dQ +
p_dry d(sign Q). Leakage and drift are slow: differences over a fifth of a wave lose them. Source: Moslatt 2020 paper C,
double-piston accumulator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.physics.hydraulics.accumulator import gas_pressure
from stillhook.spec.crane import passive_of
from stillhook.statistics.blocks import fit, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.units import parse
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.parameters.segments import (
    OIL,
    ByTest,
    Columns,
    LogPart,
    bridged,
    by_test,
    differences,
    fits,
    integral,
    later,
    moments,
    stacked,
)
from stillhook.validate.passive.motors import dry, flow, mean_every

EVERY = 0.2
"""Width of the means of which levels and excursions are taken [s]."""
LEAST_OIL = 2e-3
"""Smallest scatter of the oil moved in a window, over the stroke, from which the gas curve is shown [-]: on a stroke of
1.2 m^3 the pressure then moves by some tenths of a bar, as much as a transmitter scatters."""
FORM = 0.065
"""Uncertainty of the gas volume from the laws of friction, heat and make-up [-]: windows of 1 to 3 s, dry friction that
turns at 2 to 10 % of the pumps' flow, and a lag that is off by 10 ms move it by 1 to 3 % each. On 85 simulated cranes
it came out 3.4 % high in the mean, with a scatter of 2 %."""
LAG = 0.04
"""Lag between speed and pressure signals that is tried, either way [s]: sensors and filters of some tens of
milliseconds. 20 ms of it are 4 % of the gas volume, because the pressure that flow costs leads that of the gas."""
LOSS_DOUBT = 3e4
"""Uncertainty of the flow loss from lag, law of dry friction and transmitters [Pa]: up to 0.4 bar high on
12 cranes of the reference plant before the lag was taken out."""
KINK = 5.0
"""Times the gas's own stiffness that a pressure must change to count as that of a piston at an end: trapped oil is 1000
times as stiff."""
KINK_LEAST = parse("8 bar", "pressure")
"""And the least change within `EVERY` [Pa]: beyond noise and beyond what flow costs."""
SOFT, STIFF = 1.0, 2.3
"""Least and most index n = V dp / (p dV) of nitrogen in an accumulator: 1 for an ideal gas whose heat has time to flow;
2.3 for real nitrogen of 280 bar and 20 degC without any (2.0 at 200 bar, 2.4 at 310 bar; equation of state of Span et
al. 2000, as `stillhook.engine.pack.gas.nitrogen_isentrope`)."""


@dataclass(frozen=True)
class Level:
    """p: pressure at mid stroke [Pa]; placed: the piston's position was logged, so that the level is that of the gas;
    else it is the mean, which the make-up pumps hold at the set pressure whatever the gas has."""

    p: ByTest
    placed: bool


@dataclass(frozen=True)
class Curve:
    """Gas curve of all tests. V: gas volume that the stiffness implies with the file's n [m^3]; R: pressure per flow
    [Pa s/m^3], dry: that of dry friction [Pa], loss: both at the flow of all active pumps [Pa]; p: pressure that it
    holds at [Pa]."""

    V: ByTest
    R: float
    dry: float
    loss: Estimate
    p: float


@dataclass(frozen=True)
class Stroke:
    """used: part of the file's stroke that the piston went through [-], low and high its ends about mid stroke [m^3];
    at_end: time in which the pressure changed as with a piston at its end although the file leaves room [s]; where:
    test and time of it; placed: from the logged position of the piston."""

    used: float
    low: float
    high: float
    at_end: float
    where: str
    placed: bool


def levels(parts: Sequence[LogPart]) -> Level | None:
    """Pressure at mid stroke, of the tests with heave compensation where there are any; None without p_hp."""
    usable = [p for p in parts if p.has("p_hp")]
    usable = [p for p in usable if p.kind is Kind.AHC] or usable
    placed = bool(usable) and all(p.has("V_acc") for p in usable)

    def rows(part: LogPart) -> Columns:
        p = _at_middle(part, placed)
        return np.ones_like(p), p, part.blocks(part.t[:: max(1, round(EVERY / part.step))])

    p = ByTest.of({f.test: f.fit.estimate(0) for f in fits(usable, rows)})
    return None if p is None else Level(p, placed)


def _at_middle(part: LogPart, placed: bool) -> FloatArray:
    """Pressure means, carried to mid stroke along the file's gas curve where the piston's place is known."""
    p = mean_every(part["p_hp"], part, EVERY)
    if not placed:
        return p
    acc = part.params.passive.accumulator
    xi = mean_every(part["V_acc"], part, EVERY) * acc.i_half - 1.0
    return np.asarray(p * gas_pressure(0.0, acc.gas) / gas_pressure(xi, acc.gas))


def stiffness(part: LogPart) -> float:
    """The file's gas at mid stroke: pressure per oil [Pa/m^3]."""
    acc = part.params.passive.accumulator
    return float(acc.gas.c_1 * acc.i_half)


def index(part: LogPart) -> float:
    """The file's index n = V dp / (p dV) at mid stroke, whatever its gas law."""
    gas = passive_of(part.crane).accumulator.gas
    return stiffness(part) * gas.V_0 / gas.p_0


def curve(parts: Sequence[LogPart]) -> Curve | None:
    """Stiffness of the gas and flow loss, test by test in the wave band; None without the signals or the motion."""
    volumes, losses, rows = {}, [], []
    usable = [p for p in parts if p.kind is Kind.AHC and not p.lacking(*OIL, "omega_m")]
    lag = _lag(usable)
    for test, same in by_test(usable).items():
        dV, dQ, d_dry, one, dp, block = stacked(_rows(p, lag) for p in same)
        acc = passive_of(same[0].crane).accumulator
        if not np.isfinite(dV).any() or np.nanstd(dV) < LEAST_OIL * acc.V_stroke:
            continue
        pump = same[0].crane.active.pump
        full = pump.D_total * pump.omega_p
        # the loss of a full flow is then one coefficient
        fitted = fit((dV, dQ - d_dry * full, d_dry, one), dp, block)
        if fitted is None or not fitted.b[0] > 0.0:
            continue
        p = float(np.nanmean(np.concatenate([part["p_hp"] for part in same])))
        V = acc.gas.V_0 * stiffness(same[0]) * (p / acc.gas.p_0) / float(fitted.b[0])
        volumes[test] = Estimate.around(V, V * fitted.half(0) / float(fitted.b[0]), fitted.blocks)
        losses.append(fitted.estimate(2))
        rows.append((p, float(fitted.b[1]), float(fitted.b[2]) - full * float(fitted.b[1])))
    by = ByTest.of(volumes)
    if by is None:
        return None
    p, R, level = (float(np.mean(column)) for column in zip(*rows, strict=True))
    return Curve(by, R, level, pooled(losses), p)


def _lag(parts: Sequence[LogPart]) -> float:
    """By how much the logged pressure comes later than the flow [s], from the residual of three lags; 0 where none
    between is least."""
    residuals = []
    for lag in (-LAG, 0.0, LAG) if parts else ():
        *columns, dp, block = stacked(_rows(p, lag) for p in parts)
        if (fitted := fit(columns, dp, block)) is None:
            return 0.0
        residuals.append(fitted.sd**2)
    if not residuals:
        return 0.0
    bend = residuals[0] - 2.0 * residuals[1] + residuals[2]
    lag = 0.5 * LAG * (residuals[0] - residuals[2]) / bend if bend > 0.0 else 0.0
    return lag if abs(lag) <= LAG else 0.0


def _rows(part: LogPart, lag: float) -> Columns:
    """Differences over windows: oil moved, flow, side of dry friction, all lag [s] later, one, and pressure; block."""
    step = part.step
    Q = later(flow(part), step, lag)
    oil, Q, side, p = (differences(x, step) for x in (integral(Q, step), Q, dry(Q, part), bridged(part["p_hp"], step)))
    return oil, Q, side, np.ones_like(oil), p, part.blocks(moments(part))


def displacement(parts: Sequence[LogPart]) -> ByTest | None:
    """Oil that reaches the piston, by its logged position, over what the file's motors and make-up move, less 1; None
    without it or without motion."""

    def rows(p: LogPart) -> Columns:
        dV, measured = (differences(x, p.step) for x in (integral(flow(p), p.step), bridged(p["V_acc"], p.step)))
        return dV, np.ones_like(dV), measured, p.blocks(moments(p))

    usable = [p for p in parts if p.kind is Kind.AHC and p.has("V_acc") and not p.lacking(*OIL, "omega_m")]
    tests = {
        f.test: f.fit.estimate(0, -1.0)
        for f in fits(usable, rows)
        if np.nanstd(f.columns[0]) >= LEAST_OIL * passive_of(f.parts[0].crane).accumulator.V_stroke
    }
    return ByTest.of(tests)


def stroke(parts: Sequence[LogPart], gas: Curve | None) -> Stroke | None:
    """Excursion of the piston, by its logged position or by the pressure along the gas curve that the log itself
    implies; None without."""
    usable = [p for p in parts if not p.lacking(*OIL, "omega_m")]
    if not usable:
        return None
    passive = passive_of(usable[0].crane)
    middle, placed = 0.5 * passive.accumulator.V_stroke, all(p.has("V_acc") for p in usable)
    if not placed and gas is None:
        return None
    lows, highs, at_end, where = [], [], 0.0, ""
    for part in usable:
        x = mean_every(part["V_acc"], part, EVERY) - middle if placed else place(part, gas)
        stuck = _at_an_end(part, x, gas)
        if stuck.any():
            at_end += EVERY * float(stuck.sum())
            where = where or f"{EVERY * int(np.argmax(stuck)):.1f} s of {part.test}"
        free = x[~stuck & np.isfinite(x)]
        lows.append(float(free.min()) if len(free) else 0.0)
        highs.append(float(free.max()) if len(free) else 0.0)
    low, high = min(lows), max(highs)
    return Stroke(max(-low, high) / middle, low, high, at_end, where, placed)


def place(part: LogPart, gas: Curve | None) -> FloatArray:
    """Piston off mid stroke [m^3], means over EVERY: from the pressure less the flow loss, by the implied gas curve."""
    assert gas is not None
    n = index(part)
    Q = mean_every(flow(part), part, EVERY)
    p = mean_every(part["p_hp"], part, EVERY) - gas.R * Q - gas.dry * dry(Q, part)
    with np.errstate(invalid="ignore"):
        return np.asarray(gas.V.all.value * (1.0 - (np.maximum(p, 1.0) / gas.p) ** (-1.0 / n)))


def _at_an_end(part: LogPart, x: FloatArray, gas: Curve | None) -> NDArray[np.bool_]:
    """Where the pressure changes far more than the gas would, while the file leaves the piston room, (m,)."""
    acc = passive_of(part.crane).accumulator
    Q = flow(part)
    p, V, Q = (mean_every(y, part, EVERY) for y in (part["p_hp"], integral(Q, part.step), Q))
    dp, dV, dQ = (np.abs(np.diff(y, append=np.nan)) for y in (p, V, Q))
    R, least = (abs(gas.R), KINK_LEAST + 2.0 * abs(gas.dry)) if gas is not None else (acc.R_piston, KINK_LEAST)
    with np.errstate(invalid="ignore"):
        jumps = dp > np.maximum(KINK * stiffness(part) * dV + 2.0 * R * dQ, least)
        return np.asarray(jumps & (np.abs(x) < 0.9 * 0.5 * acc.V_stroke))
