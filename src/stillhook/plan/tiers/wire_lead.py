r"""Side-lead and off-lead of the wire while the load hangs in air: its angle across the plane of the boom, and in it.

The load is a pendulum of one degree of freedom under a tip that moves sideways, the crane heels with the vessel:

.. math:: \theta = \frac{\omega^2}{\omega_0^2 - \omega^2 + 2 i \zeta \omega_0 \omega} \frac{X}{L}, \quad
          \omega_0 = \sqrt{g/L}, \quad \text{lead} = (\theta_x + \eta_5)\,\hat x + (\theta_y - \eta_4)\,\hat y

Slow motions leave the heel alone, fast ones X/L; near :math:`\omega_0` the damping decides. Vessel's static heel and
trim are added, each as a magnitude. Valid for small angles, a load in air whose tug lines are slack, a tip whose height
counts from the vessel's reference point at the waterline. Not determined in the wave zone and below, where waves and
current move the load sideways, nor where only the radius of the tip is known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import places
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.load_chart import CraneChart
from stillhook.plan.definition.rules import Seas
from stillhook.response.forcing import HIGHEST, LOWEST, STEP
from stillhook.sea.vessel.tip import TipPoint
from stillhook.spec.lift.phase import Phase
from stillhook.statistics.extremes import largest_of_parts, zero_crossing_period

ON_THE_WAY = 5
"""Lengths of the pendulum that are looked at where the load moves up or down."""
LEADS = ("off_lead", "side_lead")


def leads(
    plan: LiftPlan, phase: Phase, seas: Seas, duration: float, quantile: Mapping[str, float]
) -> dict[str, FloatArray]:
    """Largest off-lead and side-lead (n,) [rad] of a phase in seas, over a duration [s], each with its probability of
    staying below; empty where they are not determined. The largest over the lengths of the pendulum."""
    used, tip = plan.load_chart, plan.tip_of(phase)
    if used is None or not used.judges_leads(phase):
        return {}
    still = used.static_leads(tip)
    largest = {name: np.full(len(seas), still[name]) for name in LEADS}
    for L in _lengths(plan, phase, tip):
        for name, (sigma, rate) in _deviations(plan, used, tip, seas, L).items():
            T = zero_crossing_period(sigma, rate)
            cycles = duration / np.where(np.isnan(T), np.inf, T)
            value = still[name] + largest_of_parts(0.0, sigma[None], cycles[None], quantile[name])
            largest[name] = np.maximum(largest[name], value)
    return largest


def _lengths(plan: LiftPlan, phase: Phase, tip: TipPoint) -> FloatArray:
    """Lengths from the tip to the middle of the payload along a phase's way [m]."""
    assert tip.z is not None
    hangs = [tip.z - z - 0.5 * plan.payload.height for z in places(phase)]
    return np.unique(np.linspace(min(hangs), max(hangs), ON_THE_WAY))


def _deviations(
    plan: LiftPlan, used: CraneChart, tip: TipPoint, seas: Seas, L: float
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Standard deviations of each lead [rad] and of its rate [rad/s] in seas (n,), by a pendulum of L [m]."""
    omega = np.arange(LOWEST + STEP / 2.0, HIGHEST, STEP)
    power: dict[tuple[float, float | None], dict[str, FloatArray]] = {}
    moments = {name: np.zeros((2, len(seas))) for name in LEADS}
    for n, row in enumerate(zip(seas.Hs, seas.Tp, seas.beta, strict=True)):
        for train in plan.environment.sea(*(float(v) for v in row)).trains:
            key = (train.beta, train.spread)
            if key not in power:
                theta, share = train.directions()
                transfer = _transfer(plan, used, tip, omega, theta, L)
                power[key] = {name: share @ np.abs(H) ** 2 for name, H in transfer.items()}
            S = train.spectrum.density(omega) * STEP
            for name in LEADS:
                moments[name][:, n] += np.sum(power[key][name] * S), np.sum(power[key][name] * S * omega**2)
    return {name: (np.sqrt(m[0]), np.sqrt(m[1])) for name, m in moments.items()}


def _transfer(
    plan: LiftPlan, used: CraneChart, tip: TipPoint, omega: FloatArray, beta: FloatArray, L: float
) -> dict[str, ComplexArray]:
    """Leads per metre of wave (j, k) at headings (j,) and frequencies (k,) [rad/m]."""
    assert tip.z is not None
    psi = used.direction_of(tip)
    assert psi is not None
    surge, sway, _, roll, pitch, yaw = plan.vessel.at(omega, beta)
    X, Y = surge + tip.z * pitch - tip.y * yaw, sway - tip.z * roll + tip.x * yaw
    omega_0 = math.sqrt(G / L)
    swing = omega**2 / (omega_0**2 - omega**2 + 2.0j * used.swing_damping * omega_0 * omega) / L
    forward, port = swing * X + pitch, swing * Y - roll
    c, s = math.cos(psi), math.sin(psi)
    return {"off_lead": forward * c + port * s, "side_lead": port * c - forward * s}
