"""Leakage and passive circuit of the reference plant: independent laws, brought to the twin's size at the working
point of a crane's tests. Its friction: another law than the twin's, of the same mean over the loads and speeds of the
tests.

What a crane that stands in for a measured one has beyond its crane file: the parameters of the reference plant, with
their sources and the scatter between cranes in `crane.toml`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.gas import gas_record
from stillhook.engine.pack.winch import active_record, drum_record, friction_record
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor import TorqueLossFit, motor_leakage, torque_loss
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.physics.load_path.drum import layer_diameter, layers_filled
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane, Source, SourceKind, passive_of
from stillhook.winches.circuits.losses import TorqueLoss
from stillhook.winches.circuits.passive import PassiveCircuit
from trials.reference_plant.gas import (
    ATMOSPHERE,
    GasBank,
    TrueAccumulator,
    gas_pressure_true,
    molar_heat,
    pressure_per_kelvin,
)
from trials.reference_plant.laws import TrueFriction, TrueLeak, TruePassive

PARAMETERS = tomllib.loads(Path(__file__).with_name("crane.toml").read_text(encoding="utf-8"))
"""Rows of the parameters by name."""
GAS_PERIOD = 10.0
"""Period at which `gas_volume` 1 has the twin's stiffness [s]: that of the tests' seas."""


@dataclass(frozen=True)
class ReferenceCrane:
    """A crane as it really is, against the crane file of its twin. Most numbers are factors over those of the twin; the
    defaults are a plausible crane. `numbers` lists them with meaning and source; every source is an assumption, because
    none is published.
    """

    capacitance: float = 1.0
    leakage: float = 1.0
    inertia: float = 1.0
    friction: float = 1.0
    gear: float = 1.0
    wire_short: float = 0.0
    K_1: float = 1.0
    pump_limit: float = 1.0
    motor_offset: float = 0.0
    motor_hysteresis: float = 0.01
    motor_omega: float = 0.96
    motor_zeta: float = 1.05
    motor_D: float = 1.002
    pump_omega: float = 1.04
    pump_zeta: float = 0.95
    pump_late: float = 0.004
    pump_speed: float = 1.002
    slip: float = 0.01
    line_split: float = 0.45
    line_omega: float = 190.0
    line_drop: float = 150000.0
    passive: float = 1.003
    active_more: float = 0.0
    passive_more: float = 0.0
    passive_dead: float = 0.0
    precharge: float = 1.0
    gas_volume: float = 1.0
    gas_T: float = 293.15
    gas_tau: float = 120.0
    piston_dry: float = 200000.0
    piston_oil: float = 1.0
    p_low: float = 1.0
    p_low_rise: float = 100000.0
    boost: float = 1.0
    leak_stroke: float = 0.1
    leak_speed: float = 0.1
    leak_edges: float = 0.05
    leak_across: float = 0.66
    p_case: float = 100000.0
    all_constant: float = 0.0
    all_stroke: float = 0.0
    all_speed: float = 0.0
    tau_cell: float = 0.1
    cell_gain: float = 1.002
    cell_zero: float = 1000.0
    dac_bits: float = 12.0
    wire_beta: float = 25.0
    wire_strands: float = 0.01
    wire_pressed: float = 0.01
    wire_zeta: float = 0.5
    wire_mass: float = 0.3
    bristle: float = 0.7
    friction_difference: float = 0.08
    shape_stribeck: float = 0.7
    shape_load: float = -0.4
    shape_viscous: float = 0.5
    uneven: float = 0.03
    stribeck: float = 1.5
    friction_lag: float = 0.03
    oil_swing: float = 2.0
    oil_phase: float = 0.0
    oil_thin: float = 0.03


class Number(NamedTuple):
    """One parameter of the reference plant: name, value in SI, meaning, source."""

    name: str
    value: float
    meaning: str
    source: Source


def numbers(reference: ReferenceCrane) -> Iterator[Number]:
    """Every parameter of the reference plant with its source."""
    for name, value in vars(reference).items():
        row = PARAMETERS[name]
        yield Number(name, value, row["meaning"], Source(text=row["source"], kind=SourceKind.ASSUMED))


STATES = ((0.0, 0.005), (0.328, 0.172), (0.376, 0.172), (0.656, 0.818))
"""Payload over SWL and wire out over all wire at which both frictions have one mean: empty hook, paper F table 3."""
SPEED = 0.25
"""Root mean square of the wire speed [m/s]: the tip of paper F table 3, some 1.4 m in 10 s."""
SPEEDS = 40
FAST = 1.1
"""Wire speed up to which the law is fitted to the twin's, beyond those of the mean [m/s]: so that it stays of its size
there."""
ROUNDS = 40
MOST_BEND = 1.0
"""Largest bend."""
OMEGA_BEND = 300.0
"""Motor speed at which a viscous part of the bend is of the bend's size [rad/s]: about the fastest of the tests."""
LEAST = 1e-3
"""Least part of a term that a bend leaves of it: none becomes negative."""


class Surface(NamedTuple):
    """Sliding states of a winch: omega_m [rad/s], T_w torque of the wire [N m] and T_hyd of the motors' oil [N m] at
    the shaft, and the twin's friction there [N m]. Each state weighs the same."""

    omega_m: FloatArray
    T_w: FloatArray
    T_hyd: FloatArray
    T_f: FloatArray


class Law(NamedTuple):
    """Friction law against the twin's over the surface: both means [N m], rms of the relative difference [-]."""

    friction: TrueFriction
    mean_twin: float
    mean_reference: float
    difference: float


def usual_speeds() -> FloatArray:
    """Wire speeds as they come up in heave compensation, each as often as the others, both ways [m/s]."""
    half = SPEED * np.sqrt(2.0) * scipy.special.erfinv((np.arange(SPEEDS) + 0.5) / SPEEDS)
    return np.concatenate([-half, half])


def surface(crane: Crane, speeds: FloatArray) -> Surface:
    """The twin's friction (MJ4 and eq. 2.7) at STATES and wire speeds [m/s]."""
    a, b, f = crane.active.motor, passive_of(crane).motor, friction_record(crane.friction.system)
    drum = drum_record(crane)
    diameters = [layer_diameter(layers_filled((1.0 - out) * drum.L_full, drum), drum) for _, out in STATES]
    lever = 0.5 * np.repeat(diameters, len(speeds)) / crane.i_hD
    F = np.repeat([(load * crane.SWL + crane.hook_mass) * G for load, _ in STATES], len(speeds))
    w, T_w = np.tile(speeds, len(STATES)) / lever, F * lever
    dp_pm = passive_of(crane).accumulator.gas.p_0 - passive_of(crane).p_lp
    system = (a.count + b.count) * np.asarray(system_friction(w, T_w * crane.i_hD, f))
    passive = b.count * _mj4(w, T_w / dp_pm / b.count, dp_pm, b.loss)
    T_f = system + passive
    for _ in range(ROUNDS):  # the active motors' pressure is what overcomes the friction, and makes more of it
        T_f = system + passive + a.count * _mj4(w, a.D_max, T_f / a.D_total, a.loss)
    return Surface(w, T_w, T_w + T_f, T_f)


def _mj4(omega_m: FloatArray, D_m: FloatArray | float, dp_m: FloatArray | float, loss: TorqueLoss) -> FloatArray:
    """MJ4 (eq. 2.12) over arrays."""
    fit = TorqueLossFit(X_1=loss.X_1, X_2=loss.X_2, X_3=loss.X_3, X_4=loss.X_4, X_5=loss.X_5)
    return np.asarray(torque_loss(omega_m, D_m, dp_m, fit))


def reference_friction(crane: Crane, reference: ReferenceCrane) -> Law:
    """The reference crane's friction: fitted to the twin's, then bent by `friction_difference`, then brought to the
    twin's mean, times `friction`.

    A bend of size b multiplies the Stribeck part by 1 + 2 b shape_stribeck and the part of the load by 1 + b
    shape_load, adds a viscous part of b shape_viscous times the mean at OMEGA_BEND, and takes from the constant level
    what keeps the mean. What the two laws differ by anyway counts as part of the difference.
    """
    at = surface(crane, usual_speeds())
    omega_s, mean = reference.stribeck * crane.friction.system.Y_4, float(at.T_f.mean())
    parts = _parts(at, omega_s, reference.uneven)
    best = _fitted(crane, omega_s, reference.uneven)
    load, stribeck = reference.shape_load, 2.0 * reference.shape_stribeck
    grown = np.array([0.0, load, load, stribeck, stribeck, 0.0, 0.0])
    added = np.array([0.0, 0.0, 0.0, 0.0, 0.0, reference.shape_viscous * mean / OMEGA_BEND, 0.0])

    def law(size: float) -> tuple[FloatArray, float]:
        c = np.maximum(best * (1.0 + size * grown) + size * added, LEAST * best)
        c[0] = max(c[0] + (mean - (parts @ c).mean()) / parts[:, 0].mean(), 0.0)
        return c, float(np.sqrt(np.mean((parts @ c / at.T_f - 1.0) ** 2)))

    lo, hi = 0.0, MOST_BEND
    for _ in range(ROUNDS):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if law(mid)[1] < reference.friction_difference else (lo, mid)
    c, difference = law(lo)
    c = c * mean / (parts @ c).mean()
    c = reference.friction * c
    level, on_load, motors, start, start_load, viscous, turbulent = (float(x) for x in c)
    friction = TrueFriction(
        level=level,
        load=on_load,
        motors=motors,
        uneven=reference.uneven,
        start=start,
        start_load=start_load,
        i_omega_s=1.0 / omega_s,
        viscous=viscous,
        turbulent=turbulent,
        i_tau=1.0 / reference.friction_lag,
    )
    return Law(friction, mean, float((parts @ c).mean()), difference)


def _fitted(crane: Crane, omega_s: float, uneven: float) -> FloatArray:
    """Coefficients of the law's terms, none negative, with which it is closest to the twin's friction up to FAST."""
    fast = np.linspace(0.0, FAST, SPEEDS + 1)[1:]
    wide = surface(crane, np.concatenate([usual_speeds(), -fast, fast]))
    parts = _parts(wide, omega_s, uneven)
    # a fit at steady speed cannot distinguish the motors' own load-dependent friction from the wire's
    share = crane.active.motor.loss.X_3
    rest, _ = scipy.optimize.nnls(np.delete(parts, 2, 1) / wide.T_f[:, None], 1.0 - share * parts[:, 2] / wide.T_f)
    return np.insert(rest, 2, share)


def _parts(at: Surface, omega_s: float, uneven: float) -> FloatArray:
    """The law's terms over the surface, shape (states, 7), in the order of `TrueFriction` without its shape numbers."""
    side = 1.0 + uneven * np.sign(at.omega_m)
    start, w = np.exp(-((at.omega_m / omega_s) ** 2)), abs(at.omega_m)
    return np.column_stack([side, side * at.T_w, side * at.T_hyd, start, start * at.T_w, w, w * w])


Q_DRY = 1.5e-3
"""Flow into the accumulator about which the dry friction of its piston turns [m^3/s]: 90 L/min, a few per cent of a
heave's (assumed)."""
Q_LOW = 3000.0 / 6e4
"""Flow into the low side at which `ReferenceCrane.p_low_rise` holds [m^3/s]."""
OMEGA_LEAK = 1000.0 * math.pi / 30.0
"""Motor speed at which crane files state a leakage [rad/s]."""
M_N2 = 0.0280134
"""Molar mass of nitrogen [kg/mol]."""
CIRCUIT_ROUNDS = 60
STEP = 1e-4
"""Relative step of derivatives by differences."""


class Working(NamedTuple):
    """Where the active circuit works in a crane's tests, on the mean: stroke of the pumps [-], motor speed [rad/s],
    pressure [Pa]."""

    stroke: float
    speed: float
    pressure: float


def working(crane: Crane) -> Working:
    """The tests' mean working point: the loads and speeds of `trials.reference_plant.parameters.surface`."""
    at, a = surface(crane, usual_speeds()), crane.active
    speed = float(np.abs(at.omega_m).mean())
    stroke = speed * a.motor.D_total / (a.pump.D_total * a.pump.omega_p)
    return Working(stroke, speed, float(np.sqrt(np.mean(at.T_f**2))) / a.motor.D_total)


def active_leak(crane: Crane, reference: ReferenceCrane) -> TrueLeak:
    """Leak law of the active circuit. At the working point its pumps and motors leak what the twin's do, times
    `leakage`. Parts `all_constant`, `all_stroke`, `all_speed` replace as much of it by that form, which has the twin's
    total where crane files state it.
    """
    A, w = active_record(crane), working(crane)
    full, fast = float(pump_leakage(1.0, A.pumps.leak)), float(motor_leakage(OMEGA_LEAK, A.motors))
    stated, of_pumps = full + fast, full / (full + fast)
    remaining = reference.leakage * (1.0 - reference.all_constant - reference.all_stroke - reference.all_speed)
    constant, of_stroke, of_speed = (
        reference.leakage * x * stated for x in (reference.all_constant, reference.all_stroke, reference.all_speed)
    )
    p = remaining * float(pump_leakage(w.stroke, A.pumps.leak))
    m = remaining * float(motor_leakage(w.speed, A.motors))
    leak = _leak(reference, w, p, m, w.pressure)
    return leak._replace(
        c_p=leak.c_p + constant * of_pumps,
        c_p_stroke=leak.c_p_stroke + of_stroke,
        c_m=leak.c_m + constant * (1.0 - of_pumps),
        c_m_speed=leak.c_m_speed + of_speed / OMEGA_LEAK,
    )


def _leak(reference: ReferenceCrane, at: Working, pumps: float, motors: float, p_ref: float) -> TrueLeak:
    """Leak law whose pumps and motors have these conductances [m^3/s/Pa] at the working point."""
    return TrueLeak(
        c_p=(1.0 - reference.leak_stroke) * pumps,
        c_p_stroke=reference.leak_stroke * pumps / at.stroke,
        c_m=(1.0 - reference.leak_speed) * motors,
        c_m_speed=reference.leak_speed * motors / at.speed,
        edges=reference.leak_edges,
        p_ref=p_ref,
        across=reference.leak_across,
        p_case=reference.p_case,
    )


def reference_passive(crane: Crane, known: PassiveCircuit, reference: ReferenceCrane) -> TruePassive:
    """The passive circuit; known: the parameters of its PLC."""
    m, s, twin, w = known.motors, known.settings, known.accumulator, working(crane)
    acc = TrueAccumulator(
        V_stroke=twin.V_stroke,
        i_C=twin.i_C,
        p_dry=reference.piston_dry,
        i_Q_dry=1.0 / Q_DRY,
        R=reference.piston_oil * twin.R,
        C_leak=twin.C_leak,
        bank=gas_bank(crane, reference),
    )
    p, C_m = sum(known.pumps.leak) / len(known.pumps.leak), m.count * m.C_1
    leak = _leak(reference, w, p, C_m, s.p_set)
    D_m = reference.passive * (m.count - reference.passive_dead) * m.D_max
    return TruePassive(acc=acc, leak=leak, D_m=D_m, p_lp=reference.p_low * s.p_lp, R_lp=reference.p_low_rise / Q_LOW)


def gas_bank(crane: Crane, reference: ReferenceCrane) -> GasBank:
    """Nitrogen that has the twin's pressure p_0, times `precharge`, with the piston at mid stroke, in vessels whose
    stiffness there at GAS_PERIOD would be the twin's at p_0, were their volume not `gas_volume` times as large."""
    twin = passive_of(crane).accumulator
    slope = gas_record(twin).c_1 * 2.0 / twin.V_stroke  # Pa/m^3
    rho = density(twin.gas.p_0 + ATMOSPHERE, reference.gas_T)
    V_mid = reference.gas_volume * stiffness(rho, reference.gas_T, reference.gas_tau, GAS_PERIOD) / slope
    n = density(reference.precharge * twin.gas.p_0 + ATMOSPHERE, reference.gas_T) * V_mid
    return GasBank(n, V_mid, n * float(molar_heat(n / V_mid, reference.gas_T)) / reference.gas_tau, reference.gas_T)


def density(p: float, T: float) -> float:
    """Density of nitrogen [mol/m^3] at p [Pa, absolute] and T [K], by halving between nothing and three times the thin
    gas's."""
    lo, hi = 0.0, 3.0 * p / (8.314 * T)
    for _ in range(CIRCUIT_ROUNDS):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if gas_pressure_true(mid, T) < p else (lo, mid)
    return lo


def stiffness(rho: float, T: float, tau: float, period: float) -> float:
    """Volume times the rise of pressure per volume taken away [Pa]: between isothermal and adiabatic, by the period [s]
    over the time constant tau of the vessels' heat [s]. Small changes about rho [mol/m^3], T [K]."""
    d = STEP * rho
    iso = rho * float(gas_pressure_true(rho + d, T) - gas_pressure_true(rho - d, T)) / (2.0 * d)
    p_T = float(pressure_per_kelvin(rho, T))
    extra = T * p_T * p_T / (rho * float(molar_heat(rho, T)))
    x = (2.0 * math.pi * tau / period) ** 2
    return iso + extra * x / (1.0 + x)
