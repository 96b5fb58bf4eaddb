"""Leakage and passive circuit of the truth plant: laws of their own, brought to the twin's size where a crane's tests
work."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stillhook.engine.pack.gas import gas_record
from stillhook.engine.pack.winch import active_record
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.spec.crane import Crane
from stillhook.validate.synthetic.reference.crane import GAS_PERIOD, ReferenceCrane
from stillhook.validate.synthetic.reference.friction import surface, usual_speeds
from stillhook.winches.circuits.passive import PassiveCircuit
from stillhook.winches.reference.gas import (
    ATMOSPHERE,
    GasBank,
    TrueAccumulator,
    gas_pressure_true,
    molar_heat,
    pressure_per_kelvin,
)
from stillhook.winches.reference.laws import TruePassive
from stillhook.winches.reference.leak import TrueLeak

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
    """The tests' mean working point: the loads and speeds of
    `stillhook.validate.synthetic.reference.friction.surface`."""
    at, a = surface(crane, usual_speeds()), crane.active
    speed = float(np.abs(at.omega_m).mean())
    stroke = speed * a.motor.D_total / (a.pump.D_total * a.pump.omega_p)
    return Working(stroke, speed, float(np.sqrt(np.mean(at.T_f**2))) / a.motor.D_total)


class LeakSize(NamedTuple):
    """Conductances of the twin [m^3/s/Pa]: pumps and motors at the working point, both together at full stroke and
    OMEGA_LEAK, and of that the pumps' part [-]."""

    pumps: float
    motors: float
    stated: float
    of_pumps: float


def leak_size(crane: Crane) -> LeakSize:
    """What the twin leaks."""
    A, w = active_record(crane), working(crane)
    full, fast = float(pump_leakage(1.0, A.pumps.leak)), float(motor_leakage(OMEGA_LEAK, A.motors))
    return LeakSize(
        float(pump_leakage(w.stroke, A.pumps.leak)),
        float(motor_leakage(w.speed, A.motors)),
        full + fast,
        full / (full + fast),
    )


def active_leak(crane: Crane, reference: ReferenceCrane) -> TrueLeak:
    """Leak law of the active circuit. At the working point its pumps and motors leak what the twin's do, times
    `leakage`. Parts `all_constant`, `all_stroke`, `all_speed` replace as much of it by that form, which has the twin's
    total where crane files state it.
    """
    w, size = working(crane), leak_size(crane)
    remaining = reference.leakage * (1.0 - reference.all_constant - reference.all_stroke - reference.all_speed)
    even = reference.leakage * reference.all_constant * size.stated
    p, m = remaining * size.pumps, remaining * size.motors
    return TrueLeak(
        c_p=(1.0 - reference.leak_stroke) * p + even * size.of_pumps,
        c_p_stroke=reference.leak_stroke * p / w.stroke + reference.leakage * reference.all_stroke * size.stated,
        c_m=(1.0 - reference.leak_speed) * m + even * (1.0 - size.of_pumps),
        c_m_speed=reference.leak_speed * m / w.speed
        + reference.leakage * reference.all_speed * size.stated / OMEGA_LEAK,
        edges=reference.leak_edges,
        p_ref=w.pressure,
        across=reference.leak_across,
        p_case=reference.p_case,
    )


def reference_passive(crane: Crane, known: PassiveCircuit, reference: ReferenceCrane) -> TruePassive:
    """The passive circuit; known what its PLC knows of it."""
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
    leak = TrueLeak(
        c_p=(1.0 - reference.leak_stroke) * p,
        c_p_stroke=reference.leak_stroke * p / w.stroke,
        c_m=(1.0 - reference.leak_speed) * C_m,
        c_m_speed=reference.leak_speed * C_m / w.speed,
        edges=reference.leak_edges,
        p_ref=s.p_set,
        across=reference.leak_across,
        p_case=reference.p_case,
    )
    D_m = reference.passive * (m.count - reference.passive_dead) * m.D_max
    return TruePassive(acc=acc, leak=leak, D_m=D_m, p_lp=reference.p_low * s.p_lp, R_lp=reference.p_low_rise / Q_LOW)


def gas_bank(crane: Crane, reference: ReferenceCrane) -> GasBank:
    """Nitrogen that has the twin's pressure p_0, times `precharge`, with the piston at mid stroke, in vessels whose
    stiffness there at GAS_PERIOD would be the twin's at p_0, were their volume not `gas_volume` times as large."""
    assert crane.passive is not None
    twin = crane.passive.accumulator
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
