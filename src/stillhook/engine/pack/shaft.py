"""What turns and what hangs, by the numbers of a crane file: stiffness of the wire, losses of motors, and friction of
the shaft as a PLC knows it."""

from __future__ import annotations

import math

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.plant import ShaftFriction
from stillhook.physics.friction import SystemFriction, system_friction
from stillhook.physics.hydraulics.motor_laws import motor_loss
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane, Wire
from stillhook.winches.circuits.losses import loss_fit
from stillhook.winches.circuits.tables import MotorSet

POINTS = 41
"""Speeds from rest to full pumps between which the known friction is fitted."""
SHARE = 0.5
"""Load at which it holds, over the SWL [-]."""


def wire_EA(w: Wire) -> float:
    """Stiffness of a wire times its length [N]."""
    return w.E * w.fill * math.pi / 4.0 * w.d**2


def lost(motor: MotorSet, omega: float, alpha: float, dp: float) -> float:
    """Torque that a set of motors loses [N m]."""
    return float(motor.count * motor_loss(omega, alpha * motor.D_max, dp, loss_fit(motor)))


def shaft_friction(crane: Crane, friction: SystemFriction) -> ShaftFriction:
    """Friction of all motors, gears and the drum at the shaft with half of the SWL on the full drum and the motors at
    full displacement; zeros where a winch has no closed circuit."""
    if "active" not in crane.circuits:
        return ShaftFriction()
    a, F = crane.active, SHARE * crane.SWL * G
    T = F * 0.5 * crane.drum.d_max / crane.i_hD
    others = [o._replace(alpha=min(o.alpha, 1.0)) for o in crane.plant.type.other_motors(crane, F, crane.drum.d_max)]
    dp = max(T - sum(o.alpha * o.motor.D_total * o.dp for o in others), 0.0) / a.motor.D_total
    count = sum(m.count for m in crane.motors)
    omega = np.linspace(0.0, a.pump.Q_max / a.motor.D_total, POINTS)
    T_f = [
        lost(a.motor, w, 1.0, dp)
        + sum(lost(o.motor, w, o.alpha, o.dp) for o in others)
        + count * system_friction(w, T * crane.i_hD, friction)
        for w in omega
    ]
    terms = np.stack([np.ones(POINTS), np.exp(-omega * friction.i_Y_4), omega], axis=1)
    T_dry, T_stick, B = _none_negative(terms, np.array(T_f))
    return ShaftFriction(T_dry, T_stick, friction.i_Y_4, B)


def _none_negative(terms: FloatArray, y: FloatArray) -> list[float]:
    """Least squares of y by the terms (n, k), those left out whose coefficient would be negative."""
    kept = np.ones(terms.shape[1], dtype=bool)
    while True:
        c = np.zeros(len(kept))
        c[kept] = np.linalg.lstsq(terms[:, kept], y, rcond=None)[0]
        if c.min() >= 0.0:
            return [float(x) for x in c]
        kept[np.argmin(c)] = False
