"""A suspended load at one depth, linearised: rod, end, drag, water, and the static tensions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.programme import hanging, wire_strength
from stillhook.errors import LiftError
from stillhook.physics.scalar import G
from stillhook.response.winch.duty import Duty
from stillhook.response.wire_rod import End, Rod
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
