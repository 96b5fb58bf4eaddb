"""What the wire's angle at the tip answers to waves with: a pendulum in air, a chain of masses under water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.engine.pack.programme import wire_strength
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import at_rest, wire_line
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.plan.definition.load_chart import SWING_DAMPING
from stillhook.response.sideways import Chain
from stillhook.sea.vessel.rao import wavenumber
from stillhook.spec.lift.phase import Phase

PIECES = 24
"""Pieces of the wire: one of 1,500 m in waves of 2.5 s has some six to a wave on it."""


class Answer(NamedTuple):
    """Angle of the wire at the tip at frequencies (k,): per sideways motion of the tip [rad/m], and per wave above the
    load in its direction of travel [rad/m], None where the load is in air."""

    tip: ComplexArray
    wave: ComplexArray | None


def in_air(L: float, zeta: float, omega: FloatArray) -> Answer:
    """Of a pendulum of L [m] with damping zeta, part of critical."""
    omega_0 = math.sqrt(G / L)
    swing = omega**2 / (omega_0**2 - omega**2 + 2.0j * zeta * omega_0 * omega) / L
    return Answer(np.asarray(swing, dtype=np.complex128), None)


def answers(plan: LiftPlan, phase: Phase, z: Sequence[float], omega: FloatArray) -> Sequence[Answer]:
    """Of the payload under water with its underside at each z [m]."""
    return [_under_water(plan, phase, each, tuple(omega.tolist())) for each in z]


@remembered
def _under_water(plan: LiftPlan, phase: Phase, z: float, omega: tuple[float, ...]) -> Answer:
    r"""Chain of masses with the force of the waves on the payload, :math:`(\rho V + A_{11})\,i\omega^2
    \frac{\cosh k(z+d)}{\sinh kd}` per wave."""
    w = np.array(omega)
    swing = chain_at(plan, phase, z).swing(w)
    k = wavenumber(w, plan.depth)
    middle = z + 0.5 * plan.payload.height
    water = (
        np.exp(k * middle) * (1.0 + np.exp(-2.0 * k * (middle + plan.depth))) / (1.0 - np.exp(-2.0 * k * plan.depth))
    )
    rho_V = plan.rho * plan.payload.covered(plan.rho).V
    return Answer(swing.tip, swing.force * (rho_V + added_mass(plan)) * 1j * w**2 * water)


def added_mass(plan: LiftPlan) -> float:
    """Added mass of the covered payload sideways [kg]; that in heave where none is given."""
    current = plan.environment.current
    given = None if current is None else current.added_mass
    return plan.payload.covered(plan.rho).A33 if given is None else given


@remembered
def chain_at(plan: LiftPlan, phase: Phase, z: float) -> Chain:
    """Wire, hook and payload with the underside at z [m]: added mass and drag of the current across its direction of
    what is under water; half of that along it."""
    crane, still, rho = plan.crane, at_rest(plan, phase, z), plan.rho
    EA, steel = wire_strength(crane)
    length = still.s_w + still.stretch - still.F_tip * crane.wire.L_0 / EA
    l = length / PIECES
    s = l * np.arange(1, PIECES + 1)  # nodes from the tip down, the last is the hook
    dry = length - still.wet
    m_1 = crane.wire.mass_per_length
    wet = s > dry
    share = np.where(np.arange(PIECES) < PIECES - 1, l, 0.5 * l)
    covered = z + plan.payload.height <= 0.0
    m = share * (m_1 + wet * rho * 0.25 * math.pi * crane.wire.d**2)
    m[-1] += crane.hook_mass
    load = plan.payload.mass + (added_mass(plan) if covered else 0.0)
    F_surface = still.F_hook + (m_1 - rho * steel) * G * still.wet
    T = np.interp(s - 0.5 * l, (0.0, dry, length), (still.F_tip, F_surface, still.F_hook))
    below = plan.rigging.height + 0.5 * plan.payload.height
    c = np.zeros(PIECES + 1)
    current = plan.environment.current
    if current is not None and covered:
        h_tip = plan.tip_of(phase).z or plan.h_tip
        line = wire_line(plan, phase, z)
        U = np.linalg.norm(current.velocity(np.append(h_tip - s, line.z_load)), axis=-1)
        c = U * np.append(line.B * share, line.B_load)
    zeta = SWING_DAMPING if plan.load_chart is None else plan.load_chart.swing_damping
    T_sling = still.F_hook - crane.hook_mass * G
    return Chain(np.append(m, load), np.append(T, T_sling), np.append(np.full(PIECES, l), below), c, zeta)
