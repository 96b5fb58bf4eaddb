"""Paper E's reduced model beside the complete plant: multiplied out for Routh's table, with the plant's own numbers,
and where its gain limit is least."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from stillhook import Crane
from stillhook.analysis.loop_stability.linearisation import linearise
from stillhook.analysis.loop_stability.stability import eigenfrequency, gain_limit
from stillhook.analysis.loop_stability.transfer import circuit_matrices, effective_radius
from stillhook.analysis.steady.operating_point import OperatingPoint
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.physics.load_path.drum import K_wire as ratio_of


def closed_loop_polynomial(crane: Crane, alpha_m: float = 1.0, *, K_wire: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator of the cut loop, highest power first: 1 + K_p num/den = 0 gives the poles.

    Multiplied out from the transfer functions of circuit, servo and integration, for Routh's table.
    """
    a, J, B_v, servo = crane.active, crane.inertia.J_m_eff, crane.control.B_v, crane.active.pump.servo
    circuit_matrices(crane, alpha_m)  # refuses a displacement outside its range
    C_h, D_m = capacitance(a.line.V, a.line.bulk_modulus), a.motor.D_total * alpha_m
    hydraulic = np.polyadd(np.polymul([J, B_v], [C_h, a.C_leak]), [D_m * D_m])
    pump = np.array([1.0, 2.0 * servo.zeta * servo.omega_n, servo.omega_n**2])
    den = np.polymul(np.polymul(hydraulic, pump), [1.0, 0.0])
    num = np.array([servo.omega_n**2 * a.pump.D_total * a.pump.omega_p * D_m * effective_radius(crane, K_wire)])
    return num / den[0], den / den[0]


class Equivalent(NamedTuple):
    """B_v slope of all torques against the motion by motor speed, wire rigid [N m s/rad], of which B_low is from the
    low line; C_leak leakage of the line at pressure [m^3/s/Pa]; J_m with the load hanging rigidly on the wire [kg m^2];
    K_wire [-]; omega_0 [rad/s], zeta [-], K_p_ms [1/m] of the reduced model with these."""

    B_v: float
    B_low: float
    C_leak: float
    J_m: float
    K_wire: float
    omega_0: float
    zeta: float
    K_p_ms: float


def equivalent(crane: Crane, point: OperatingPoint) -> Equivalent:
    """The reduced model with the plant's own numbers at a point where the winch slides.

    B_v holds the slope of the friction (Stribeck curve, with the bristle in its steady state), of the motors' turbulent
    and viscous losses, and of the passive circuit (piston friction, leakage), and what the low line adds: boost holds
    its pressure through the conductance G of its check valve, so that the line is a damper of D_m^2 / G and not a
    constant pressure. Valid for wires so short that the load follows the winch.
    """
    linear = linearise(point)
    A, n = linear.A, {name: i for i, name in enumerate(linear.states)}
    if (bristle := A[n["z"], n["z"]]) != 0.0:  # in its steady state, where it is far faster than all else
        A = A - np.outer(A[:, n["z"]], A[n["z"]]) / bristle
    J = 1.0 / point.geometry.i_J
    by_speed = A[n["omega_m"], n["omega_m"]] + A[n["omega_m"], n["v_load"]] * point.geometry.r_eff
    pressed, low = ("p_a", "p_b") if point.p_a >= point.p_b else ("p_b", "p_a")
    C_leak, G_low = (-float(A[n[p], n[p]]) / point.params.active.i_C_h for p in (pressed, low))
    B_low = (crane.active.motor.D_total * point.alpha_m) ** 2 / G_low
    B_v = -J * float(by_speed) + B_low
    J_m = J + point.params.hoist.load.m * point.geometry.r_eff**2
    K_wire = float(ratio_of(point.geometry.d, drum_record(crane)))
    hydraulic = crane.model_copy(
        update={
            "inertia": crane.inertia.model_copy(update={"J_m_eff": J_m}),
            "control": crane.control.model_copy(update={"B_v": B_v}),
            "active": crane.active.model_copy(update={"C_leak": C_leak}),
        }
    )
    e = eigenfrequency(hydraulic, point.alpha_m)
    return Equivalent(
        B_v=B_v,
        B_low=B_low,
        C_leak=C_leak,
        J_m=J_m,
        K_wire=K_wire,
        omega_0=e.omega_0,
        zeta=e.zeta,
        K_p_ms=gain_limit(hydraulic, point.alpha_m, K_wire).K_p_ms,
    )


def least_limit(crane: Crane) -> tuple[float, float]:
    """Displacement at which the gain limit is lowest [-], and that limit [1/m]: below, where no mode goes, it rises
    again.

    There the winch oscillates so slowly that the decay of the circuit alone, which does not depend on the displacement,
    holds it.
    """
    minimum = scipy.optimize.minimize_scalar(
        lambda a: gain_limit(crane, a).K_p_ms, bounds=(1e-3, 1.0), method="bounded", options={"xatol": 1e-9}
    )
    return float(minimum.x), float(minimum.fun)
