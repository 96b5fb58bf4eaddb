"""A suspended load at one depth, linearised: rod, end, drag, water, and the static tensions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.engine.pack.programme import hanging, wire_strength
from stillhook.errors import LiftError
from stillhook.physics.scalar import G
from stillhook.response.winch.duty import Duty
from stillhook.response.wire_rod import End, Rod, transfers
from stillhook.sea.vessel.long_wave import wavenumber
from stillhook.sea.vessel.wave_field import decay
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.scenario import Sensors
from stillhook.units import show


@dataclass(frozen=True)
class SuspendedLoad:
    """Wire, hook, slings and payload at one depth, linearised about rest."""

    rod: Rod
    end: End
    s_w: float  # wire paid out [m]
    F_top: float  # static tension at the crane tip [N]
    F_sling: float  # static tension in the slings [N]
    B: float = 0.0  # drag of the payload, 1/2 rho C_D A_p [N s^2/m^2]
    C_lin: float = 0.0  # linear drag of the payload [N s/m]
    rho_V: float = 0.0  # mass of the displaced water [kg]
    z: float | None = None  # height of the middle of the payload above still water, where waves act [m]; None: in air
    depth: float = math.inf  # of the water [m]
    sensors: Sensors = field(default_factory=Sensors)  # of the winch
    V: float = 0.0  # mean speed of the payload through the water, either sign [m/s]; adds to the damping by drag

    @property
    def duty(self) -> Duty:
        """Duty of the winch."""
        return Duty(F=self.F_top, s_w=self.s_w, sensors=self.sensors)

    def decay(self, omega: FloatArray) -> FloatArray:
        """Vertical motion of the water at the payload per elevation above it [-], shape of omega; 0 in air."""
        if self.z is None:
            return np.zeros_like(omega)
        return np.asarray(decay(wavenumber(omega, self.depth), np.array([self.z]), self.depth)[0])


def suspended_load(crane: Crane, lift: Lowering, z: float) -> SuspendedLoad:
    """The load with the payload's underside z [m] above still water (negative: below), from the same lift that is
    lowered in time.

    In air, or completely submerged: forces on a payload that pierces the surface are not linear. Near the bottom
    (`Payload.seabed`) added mass and drag grow, which is not included. Material damping is that of the crane's
    `wire.zeta` at this depth.
    Errors: LiftError for a payload in the surface, below the seabed, or wire that the drum does not have.
    """
    load, rho = lift.payload, lift.rho
    if -load.reach(rho) < z < 0.0:
        raise LiftError(
            f'payload "{load.name}": with its underside {show(-z, "length")} under water it pierces the surface,'
            " and the method is linear. Choose 0 m or more above,"
            f" {show(load.reach(rho), 'length')} or more below, or simulate the lowering in time."
        )
    if z < -lift.depth:
        raise LiftError(
            f"z {show(z, 'length')} is below the seabed at {show(lift.depth, 'length')}. Choose a depth above it."
        )
    still = hanging(crane, lift, z)
    EA, _ = wire_strength(crane)
    if still.s_w <= 0.0:
        raise LiftError(
            f"z {show(z, 'length')}: hook and rigging do not fit under the crane tip at {show(lift.h_tip, 'length')}."
        )
    wet = load.covered(rho) if z < 0.0 else None
    k_s = lift.rigging.stiffness
    end = End(
        m=load.mass,
        A33=wet.A33 if wet else 0.0,
        m_h=crane.hook_mass,
        k_s=k_s,
        c_s=2.0 * lift.rigging.zeta * math.sqrt(k_s * load.mass),
    )
    mu, L = crane.wire.mass_per_length, still.s_w
    F_sling = still.F_hook - crane.hook_mass * G
    omega = math.sqrt(EA / (crane.wire.L_0 + L) / (end.moving + end.m_h + mu * L / 3.0))
    k_top = EA / crane.wire.L_0 if crane.wire.L_0 > 0.0 else math.inf
    rod = Rod(L=L, EA=EA, mu=mu, w=(still.F_tip - still.F_hook) / L, beta=2.0 * crane.wire.zeta / omega, k_top=k_top)
    under = {"B": load.drag(rho), "C_lin": load.C_lin, "rho_V": rho * wet.V, "z": z + load.height / 2.0} if wet else {}
    return SuspendedLoad(rod, end, L, still.F_tip, F_sling, depth=lift.depth, sensors=lift.sensors, **under)


def drag_of_gaussian(B: float, sigma_v: ArrayLike, V: float = 0.0) -> FloatArray:
    r"""Linear drag [N s/m] of a Gaussian speed of deviation sigma_v [m/s] about a mean speed V [m/s]; B [N s^2/m^2].

    .. math:: \Sigma = 2 B\,E|V + v| = 2 B \left(V\,\mathrm{erf}\frac{V}{\sqrt 2 \sigma_v}
        + \sqrt{2/\pi}\,\sigma_v\,e^{-V^2/2\sigma_v^2}\right)

    The slope with the least square error; at V = 0 it takes out the same power.
    """
    sigma = np.asarray(sigma_v, dtype=np.float64)
    if V == 0.0:
        return np.asarray(math.sqrt(8.0 / math.pi) * B * sigma)
    share, bell = _normal(V, sigma)
    return np.asarray(2.0 * B * (V * (2.0 * share - 1.0) + 2.0 * sigma * bell))


def mean_drag(B: float, V: float, sigma_v: ArrayLike) -> FloatArray:
    """Mean of B (V + v)|V + v| for a Gaussian v of deviation sigma_v [m/s] [N]; B [N s^2/m^2], V [m/s]."""
    sigma = np.asarray(sigma_v, dtype=np.float64)
    share, bell = _normal(V, sigma)
    return np.asarray(B * ((V**2 + sigma**2) * (2.0 * share - 1.0) + 2.0 * V * sigma * bell))


def _normal(V: float, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Standard normal distribution and density at V/sigma; of what does not scatter, those far out."""
    from scipy.special import ndtr  # heavy: only where something moves on

    x = V / np.where(sigma > 0.0, sigma, 1e-12)
    return np.asarray(ndtr(x)), np.asarray(np.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi))


class Answer(NamedTuple):
    """Complex answer of one quantity: to the motion u of the wire's top end, and to the wave's elevation above the load
    [per m]."""

    u: ComplexArray
    wave: ComplexArray


QUANTITIES = ("load", "load_rate", "relative", "top", "top_rate", "sling", "sling_rate")
"""Displacement of the payload and its speed, its speed through the water; tension at the crane tip and in the slings
with their rates."""


def answers(omega: FloatArray, load: SuspendedLoad, drag: ArrayLike, compliance: ArrayLike = 0.0) -> dict[str, Answer]:
    """Every one of `QUANTITIES` at omega and linear drags [N s/m] that broadcast with it; compliance of the winch
    [m/N].

    The wave's force on the payload is that of the water's acceleration on displaced water and added mass, and of drag
    by its speed.
    """
    t = transfers(omega, load.rod, load.end, drag, compliance)
    water, rate = load.decay(omega), 1j * omega
    inertia = -(omega**2) * (load.rho_V + load.end.A33)
    F = (inertia + rate * np.asarray(drag, dtype=np.float64)) * water
    motion = Answer(t.load_u, t.load_F * F)
    top, sling = Answer(t.top_u, t.top_F * F), Answer(t.sling_u, t.sling_F * F)
    return {
        "load": motion,
        "load_rate": Answer(rate * motion.u, rate * motion.wave),
        "relative": Answer(rate * motion.u, rate * (motion.wave - water)),
        "top": top,
        "top_rate": Answer(rate * top.u, rate * top.wave),
        "sling": sling,
        "sling_rate": Answer(rate * sling.u, rate * sling.wave),
    }
