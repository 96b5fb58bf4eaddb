"""What gas, piston, passive motors and pumps do by the logs.

The passive motors move oil, V = -int D_pm alpha_pm omega_m dt, and the pressure answers: dp = (n p / V_gas) dV + R dQ +
p_dry d(sign Q). Leakage and drift are slow: differences over a fifth of a wave lose them. Source: Moslatt 2020 paper C,
double-piston accumulator.

Number of working motors by the torque at the shaft: D_m alpha_m dp + g D_pm alpha_pm (p_hp - p_lp) = F_w lambda + J
domega/dt + T_f, with the friction's scale, terms of the wire's place and of inertia fitted next to g.
A wrong load cell has the same effect in one equation, because the PLC sets the motors by it. The stated load is the
second reference. Source: Moslatt 2020 eqs 2.3 and 2.15.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.physics.hydraulics.accumulator import gas_pressure
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.scalar import G
from stillhook.spec.crane import passive_of
from stillhook.statistics.blocks import fit, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.time_lag import low_pass
from stillhook.units import parse
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.data_set.record import filled
from stillhook.validate.parameters.hoisting import MOVING, missing, twin_friction
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
    means,
    moments,
    rates,
    stacked,
)
from stillhook.validate.parameters.settings import EVERY as SPACING
from stillhook.validate.parameters.settings import followed, known_setting

EVERY = 0.2
"""Width of the means of which torques, levels and excursions are taken [s]."""
DRY = 0.05
"""Flow over which dry friction changes its side, over the flow of all active pumps [-]: the piston then creeps."""


def flow(part: LogPart) -> FloatArray:
    """Oil flow into the accumulator about its mean (n,) [m^3/s]: D_pm alpha_pm omega_m, lowering positive, and
    make-up."""
    assert part.omega_m is not None
    alpha_pm, omega_m = (bridged(x, part.step) for x in (part["alpha_pm"], part.omega_m))
    motors = -passive_of(part.crane).motor.D_total * alpha_pm * omega_m
    pumps = made_up(part)
    return np.asarray(motors + pumps - np.nanmean(pumps))


def made_up(part: LogPart) -> FloatArray:
    """Flow of the make-up pumps (n,) [m^3/s], but for a constant: by their logged setting, else by the law on the
    logged pressure. Some per cent of a wave's oil: enough to turn the piston's dry friction at another moment."""
    settings, step = part.params.passive.settings, part.step
    if part.has("alpha_pp"):
        return np.asarray(settings.Q_p_max * bridged(part["alpha_pp"], step))
    mean = filtered(filled(part["p_hp"]), part.params.plc.tau_p, step)
    u = settings.K_acc * (float(np.mean(mean)) - mean)
    if part.has("v_op"):
        alpha_pm, v_op = (bridged(part[name], step) for name in ("alpha_pm", "v_op"))
        u = u + settings.D_m_max * alpha_pm * v_op / part.r_eff / settings.Q_p_max
    return np.asarray(settings.Q_p_max * np.clip(u, -1.0, 1.0))


def filtered(x: FloatArray, tau: float, step: float) -> FloatArray:
    """First-order filter of the PLC, cycle by cycle, starting on the first sample, as
    `stillhook.control.plc.low_pass`."""
    return low_pass(x, step / (tau + step))


def dry(Q: FloatArray, part: LogPart) -> FloatArray:
    """Side of the piston's dry friction at a flow [m^3/s], -1 to 1, (n,)."""
    pump = part.crane.active.pump
    return np.asarray(np.tanh(Q / (DRY * pump.D_total * pump.omega_p)))


def mean_every(x: FloatArray, part: LogPart, width: float) -> FloatArray:
    """Means of a signal over a width [s], one a width, its short holes bridged."""
    return means(bridged(x, part.step), part.step, width)


SETTING_DOUBT = 0.01
"""Relative error of a measured setting [-], as in criterion p-displacement."""
LOW_DOUBT = parse("3 bar", "pressure")
"""Uncertainty of the low-side pressure, which is not logged [Pa]."""
LEAST_LOAD = 0.1
"""Torque of the load over that of the safe working load from which the share is taken of a test [-]: below, zeros of
sensors decide."""


@dataclass(frozen=True)
class Share:
    """One test. share: torque of all passive motors by the load cell over the file's, less 1; by_weight: by the stated
    load, None without; structural: half width that calibrations leave in addition [-]; standing: torque left in the
    mean with the file's motors, T_load mean torque of the load [N m]."""

    test: str
    share: Estimate
    by_weight: float | None
    structural: float
    standing: Estimate
    T_load: float


def shares(parts: Sequence[LogPart]) -> tuple[Share, ...]:
    """The share of every test with heave compensation, or else of every test, that carries a load and has the
    signals."""
    usable = [p for p in parts if not missing(p)]
    usable = [p for p in usable if p.kind is Kind.AHC] or usable
    return tuple(s for test, same in by_test(usable).items() if (s := _share(test, same)) is not None)


def overall(tests: Sequence[Share]) -> tuple[Estimate, float]:
    """Share over all tests, less 1, and its structural half width, with the difference of load cell and stated load."""
    each = []
    apart = [0.5 * abs(s.share.value - s.by_weight) for s in tests if s.by_weight is not None]
    for s in tests:
        middle = s.share.value if s.by_weight is None else 0.5 * (s.share.value + s.by_weight)
        each.append(Estimate.around(middle, s.share.half, s.share.n))
    return pooled(each), math.hypot(max(s.structural for s in tests), max(apart, default=0.0))


def _share(test: str, parts: Sequence[LogPart]) -> Share | None:
    T, T_p, model, spring, rate, load, block = stacked(_rows(p) for p in parts)
    part, crane = parts[0], parts[0].crane
    r_eff = float(np.nanmean(np.concatenate([p.r_eff for p in parts])))
    if not np.isfinite(load).any() or np.nanmean(load) < LEAST_LOAD * crane.SWL * G * r_eff:
        return None
    fitted = fit((T_p, -model, spring, rate), T, block)
    still = fit((np.ones_like(T), -model, spring, rate), T - T_p, block)
    if fitted is None or still is None:
        return None
    T_load, mean = float(np.nanmean(load)), float(np.nanmean(T_p))
    stated = part.record.test.load is not None
    by_weight = float(fitted.b[0]) - 1.0 - (T_load - part.weight * r_eff) / mean if stated else None
    passive = passive_of(crane)
    structural = math.hypot(SETTING_DOUBT, LOW_DOUBT / (passive.accumulator.gas.p_0 - passive.p_lp))
    return Share(
        test=test,
        share=fitted.estimate(0, -1.0),
        by_weight=by_weight,
        structural=structural,
        standing=still.estimate(0),
        T_load=T_load,
    )


def _rows(part: LogPart) -> tuple[NDArray[Any], ...]:
    """Means over EVERY seconds: torque that the passive motors must give, that of the file's, friction of the twin with
    the sign of the motion, wire out about its middle, angular acceleration, torque of the load, block; NaN at
    standstill."""
    assert part.omega_m is not None
    s = {name: mean_every(part[name], part, EVERY) for name in ("p_a", "p_b", "F_w", "p_hp", "alpha_pm")}
    setting = known_setting(part, "m")
    assert setting is not None
    passive, alpha_m = passive_of(part.crane), mean_every(setting, part, EVERY)
    omega, r_eff, s_w = (mean_every(x, part, EVERY) for x in (part.omega_m, part.r_eff, part.wire_out))
    dp, dp_p, load = s["p_a"] - s["p_b"], s["p_hp"] - passive.p_lp, s["F_w"] * r_eff
    rate = rates(bridged(part.omega_m, part.step), part.step, EVERY)
    T = load + part.inertia * rate - motor_torque(part.crane.active.motor.D_total * alpha_m, dp)
    T_p = motor_torque(passive.motor.D_total * s["alpha_pm"], dp_p)
    model = np.sign(omega) * twin_friction(part, omega, alpha_m, dp, load * part.crane.i_hD, (s["alpha_pm"], dp_p))
    every = max(1, round(EVERY / part.step))
    moves = np.abs(omega) > MOVING
    return np.where(moves, T, np.nan), T_p, model, s_w - np.nanmean(s_w), rate, load, part.blocks(part.t[::every])


SETTLING = 3.0
"""Time constants of a filter of the PLC after which its unknown start has faded."""
LEAST_ORDER = 0.02
"""Smallest scatter of the make-up command from which its gain is shown [-]."""


@dataclass(frozen=True)
class MakeUp:
    """gain: measured setting over the law's, less 1; offset, as the pressure by which set pressure and transmitter
    disagree [Pa]."""

    gain: Estimate
    offset: float


def displacement_by_weight(part: LogPart) -> FloatArray | None:
    """Setting that law and servo give the passive motors (n,) [-], NaN while the filter settles and where it is held in
    [0, 1]; None where load cell or pressure have holes."""
    F, p = (bridged(part[name], part.step) for name in ("F_w", "p_hp"))
    if not (np.isfinite(F).all() and np.isfinite(p).all() and np.isfinite(part.r_eff).all()):
        return None
    settings, tau = part.params.passive.settings, part.params.plc.tau_F
    dp = np.maximum(p - settings.p_lp, settings.dp_least)
    law = filtered(F, tau, part.step) * part.r_eff / (settings.D_m_max * dp)
    setting = followed(np.clip(law, 0.0, 1.0), part.params.passive.motor_servo, part.step)
    free = (law > 0.0) & (law < 1.0) & (part.t > SETTLING * (tau + 1.0 / passive_of(part.crane).motor.servo.omega_n))
    return np.where(free, setting, np.nan)


def setting(parts: Sequence[LogPart]) -> ByTest | None:
    """Measured setting of the passive motors over that of the law, less 1, of every test that carries a load; None
    without the signals."""
    usable = [p for p in parts if p.has("alpha_pm", "F_w", "p_hp") and p.weight > LEAST_LOAD * p.crane.SWL * G]
    result = fits(usable, lambda p: _of_law(displacement_by_weight(p), p, "alpha_pm"))
    return ByTest.of({f.test: f.fit.estimate(0, -1.0) for f in result})


def make_up_command(part: LogPart, standing: bool) -> FloatArray | None:
    """Setting that law and servo give the passive pumps (n,) [-], NaN while the slow mean settles and at an end; None
    where signals have holes. standing: the PLC's pressure is that of the standing piston, as in the twin (p_hp less
    what flow costs by the file), else p_hp as it is."""
    if (part.kind is not Kind.AHC and not part.has("v_op")) or part.omega_m is None:
        return None
    p, u_m = (bridged(part[name], part.step) for name in ("p_hp", "alpha_pm"))
    if standing:
        p = p - passive_of(part.crane).accumulator.R_piston * flow(part)
    v_op = bridged(part["v_op"], part.step) if part.has("v_op") else np.zeros(part.n)
    if not all(np.isfinite(x).all() for x in (p, u_m, v_op, part.r_eff)):
        return None
    s, tau = part.params.passive.settings, part.params.plc.tau_p
    u = s.K_acc * (s.p_set - filtered(p, tau, part.step)) + s.D_m_max * u_m * v_op / part.r_eff / s.Q_p_max
    free = (np.abs(u) < 0.9) & (part.t > SETTLING * tau)
    return np.where(free, followed(np.clip(u, -1.0, 1.0), part.params.passive.pump_servo, part.step), np.nan)


def make_up(parts: Sequence[LogPart]) -> MakeUp | None:
    """Gain and offset over the make-up law, by the place of the PLC's pressure that explains the setting better; None
    where not logged or hardly moving."""
    fits = [x for x in (_made_up(parts, standing) for standing in (True, False)) if x is not None]
    _, moves, result = min(fits, key=lambda x: x[0], default=(0.0, 0.0, None))
    return result if moves > LEAST_ORDER else None


def _made_up(parts: Sequence[LogPart], standing: bool) -> tuple[float, float, MakeUp] | None:
    """What is left of the setting (rms), scatter of the law's [-], gain and offset."""
    usable = [p for p in parts if p.has("alpha_pp", "alpha_pm", "p_hp")]
    rows = [row for p in usable if (row := _of_law(make_up_command(p, standing), p, "alpha_pp")) is not None]
    if not rows:
        return None
    law, alpha, block = stacked(rows)
    fitted = fit((law, np.ones_like(law)), alpha, block)
    if fitted is None:
        return None
    make_up = MakeUp(fitted.estimate(0, -1.0), float(fitted.b[1]) / usable[-1].params.passive.settings.K_acc)
    return fitted.sd, float(np.nanstd(law)), make_up


def _of_law(law: FloatArray | None, part: LogPart, name: str) -> Columns | None:
    """A law, the measured setting and the blocks of time every SPACING seconds; None without the law."""
    every = max(1, round(SPACING / part.step))
    return None if law is None else (law[::every], part[name][::every], part.blocks(part.t[::every]))


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
    """p: pressure at mid stroke [Pa]; placed: the piston's position was logged; else it is the mean, which the make-up
    pumps hold at the set pressure at any gas charge."""

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
    at_end: time in which the pressure changed as at an end although the file leaves room [s]; where: test and time of
    it; placed: from the logged position."""

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
    """The file's index n = V dp / (p dV) at mid stroke, with any gas law."""
    gas = passive_of(part.crane).accumulator.gas
    return stiffness(part) * gas.V_0 / gas.p_0


def curve(parts: Sequence[LogPart]) -> Curve | None:
    """Stiffness of the gas and flow loss, test by test in the wave band; None without the signals or the motion."""
    volumes, losses, rows = {}, [], []
    usable = [p for p in parts if p.kind is Kind.AHC and not p.lacking(*OIL, "omega_m")]
    lag = _lag(usable)
    for test, same in by_test(usable).items():
        dV, dQ, d_dry, one, dp, block = stacked(_gas_rows(p, lag) for p in same)
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
        *columns, dp, block = stacked(_gas_rows(p, lag) for p in parts)
        if (fitted := fit(columns, dp, block)) is None:
            return 0.0
        residuals.append(fitted.sd**2)
    if not residuals:
        return 0.0
    bend = residuals[0] - 2.0 * residuals[1] + residuals[2]
    lag = 0.5 * LAG * (residuals[0] - residuals[2]) / bend if bend > 0.0 else 0.0
    return lag if abs(lag) <= LAG else 0.0


def _gas_rows(part: LogPart, lag: float) -> Columns:
    """Differences over windows: oil moved, flow, side of dry friction, all lag [s] later, one, and pressure; block."""
    step = part.step
    Q = later(flow(part), step, lag)
    oil, Q, side, p = (differences(x, step) for x in (integral(Q, step), Q, dry(Q, part), bridged(part["p_hp"], step)))
    return oil, Q, side, np.ones_like(oil), p, part.blocks(moments(part))


def displacement(parts: Sequence[LogPart]) -> ByTest | None:
    """Oil that reaches the piston, by its logged position, over what the file's motors and make-up move, less 1."""

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
    """Excursion of the piston, by its logged position or by the pressure along the implied gas curve; None without."""
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
