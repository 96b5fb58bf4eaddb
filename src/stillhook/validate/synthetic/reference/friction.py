"""Friction of the truth plant: another law than the twin's, of the same mean over the loads and speeds of a crane's
tests."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from scipy.special import erfinv

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record, friction_record
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss
from stillhook.physics.load_path.drum import layer_diameter, layers_filled
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.validate.synthetic.reference.crane import ReferenceCrane
from stillhook.winches.circuits.tables import TorqueLoss
from stillhook.winches.reference.laws import TrueFriction

STATES = ((0.0, 0.005), (0.328, 0.172), (0.376, 0.172), (0.656, 0.818))
"""Payload over the SWL and wire out over all wire at which both frictions have one mean: an empty hook, and paper F
table 3."""
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
    """Friction law and how it lies to the twin's over the surface: both means [N m], rms of the relative difference
    [-]."""

    friction: TrueFriction
    mean_twin: float
    mean_reference: float
    difference: float


def usual_speeds() -> FloatArray:
    """Wire speeds as they come up in heave compensation, each as often as the others, both ways [m/s]."""
    half = SPEED * np.sqrt(2.0) * erfinv((np.arange(SPEEDS) + 0.5) / SPEEDS)
    return np.concatenate([-half, half])


def surface(crane: Crane, speeds: FloatArray) -> Surface:
    """The twin's friction (MJ4 and eq. 2.7) at STATES and wire speeds [m/s]."""
    assert crane.passive is not None
    a, b, f = crane.active.motor, crane.passive.motor, friction_record(crane.friction.system)
    drum = drum_record(crane)
    diameters = [layer_diameter(layers_filled((1.0 - out) * drum.L_full, drum), drum) for _, out in STATES]
    lever = 0.5 * np.repeat(diameters, len(speeds)) / crane.i_hD
    F = np.repeat([(load * crane.SWL + crane.hook_mass) * G for load, _ in STATES], len(speeds))
    w, T_w = np.tile(speeds, len(STATES)) / lever, F * lever
    dp_pm = crane.passive.accumulator.gas.p_0 - crane.passive.p_lp
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
    grown = np.array(
        [
            0.0,
            reference.shape_load,
            reference.shape_load,
            2.0 * reference.shape_stribeck,
            2.0 * reference.shape_stribeck,
            0.0,
            0.0,
        ]
    )
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
    friction = TrueFriction(
        level=c[0],
        load=c[1],
        motors=c[2],
        uneven=reference.uneven,
        start=c[3],
        start_load=c[4],
        i_omega_s=1.0 / omega_s,
        viscous=c[5],
        turbulent=c[6],
        i_tau=1.0 / reference.friction_lag,
    )
    return Law(TrueFriction(*(float(x) for x in friction)), mean, float((parts @ c).mean()), difference)


def _fitted(crane: Crane, omega_s: float, uneven: float) -> FloatArray:
    """Coefficients of the law's terms, none negative, with which it lies closest to the twin's friction up to FAST."""
    fast = np.linspace(0.0, FAST, SPEEDS + 1)[1:]
    wide = surface(crane, np.concatenate([usual_speeds(), -fast, fast]))
    parts = _parts(wide, omega_s, uneven)
    share = (
        crane.active.motor.loss.X_3
    )  # the motors' own load-dependent friction cannot be told from the wire's by a fit at steady speed
    rest, _ = nnls(np.delete(parts, 2, 1) / wide.T_f[:, None], 1.0 - share * parts[:, 2] / wide.T_f)
    return np.insert(rest, 2, share)


def _parts(at: Surface, omega_s: float, uneven: float) -> FloatArray:
    """The law's terms over the surface, shape (states, 7), in the order of `TrueFriction` without its shape numbers."""
    side = 1.0 + uneven * np.sign(at.omega_m)
    start, w = np.exp(-((at.omega_m / omega_s) ** 2)), abs(at.omega_m)
    return np.column_stack([side, side * at.T_w, side * at.T_hyd, start, start * at.T_w, w, w * w])
