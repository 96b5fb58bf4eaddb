"""Torque balance at the motor shaft, sample by sample, with the twin's own laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import pack
from stillhook.errors import IdentifyError
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.accumulator import piston_loss
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.motor_laws import motor_loss
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.winches.load_path.load import drum_geometry

WITH_PRESSURES = ("active-passive", "pure-active")
"""Winch types whose motors have pressures on both sides of an active circuit."""
ACTIVE = ("p_a", "p_b", "alpha_m", "F_w")
PASSIVE = ("p_hp", "alpha_pm")
ENCODER = ("omega_m", "v_w", "s_w")
"""Signals of the encoder's clock, the best first; all others are on the clock of the pressures."""
LOAD_SHARE = 0.4
"""Load of the records that are packed, part of the SWL [-]: no number of the balance depends on it."""
NUDGE = 1e-3
"""Part of the full displacement by which its effect on the motors' loss is taken [-]."""


class Samples(NamedTuple):
    """Terms of the balance at the samples of a half wave (n,), torques at the motor shaft, hoisting positive [N m]."""

    active: FloatArray  # of the active motors, without losses
    passive: FloatArray  # of the passive motors, without losses
    wire: FloatArray  # of the wire
    system: FloatArray  # system friction of the crane file, with the sign of the motion
    motors: FloatArray  # motors' loss of the crane file, with the sign of the motion
    per_alpha_m: FloatArray  # active torque less the file's loss, per part of the full displacement
    per_alpha_pm: FloatArray  # passive torque less the file's loss, per part of the full displacement
    per_p: FloatArray  # active torque per pressure [m^3]
    per_p_hp: FloatArray  # passive torque per pressure [m^3]
    per_load: FloatArray  # part of `system` that is proportional to the drum torque
    piston: FloatArray  # passive torque lost to the accumulator's piston; 0 unless read on the gas side


class Geometry(NamedTuple):
    """r_eff wire per motor angle [m/rad]; J inertia at the motor shaft [kg m^2]; layer in use."""

    r_eff: float
    J: float
    layer: int


@dataclass(frozen=True)
class Balance:
    """The balance of one crane. gas_side: p_hp is read at the gas, so that the piston's resistance is added."""

    crane: Crane
    gas_side: bool = False

    def __post_init__(self) -> None:
        name = self.crane.plant.type.name
        if name not in WITH_PRESSURES:
            raise IdentifyError(
                f'Crane "{self.crane.name}": winch type "{name}" has no pressures of both lines of its motors to'
                f" measure friction by. Choose a crane of type {' or '.join(WITH_PRESSURES)}."
            )

    @property
    def has_passive(self) -> bool:
        """Whether a passive circuit turns the drum as well."""
        return "passive" in self.crane.circuits

    @property
    def needed(self) -> tuple[str, ...]:
        """Signals without which there is no balance, besides time and one of ENCODER."""
        return (*ACTIVE, "s_w", *(PASSIVE if self.has_passive else ()))

    @cached_property
    def params(self) -> Any:
        """The twin's records."""
        case = Scenario(load=f"{LOAD_SHARE * self.crane.SWL!r} kg", s_w="0 m")
        return pack(self.crane, case).params

    def geometry(self, s_w: float) -> Geometry:
        """Drum and inertia with s_w of wire out [m]."""
        geo = drum_geometry(s_w, self.params.hoist)
        return Geometry(float(geo.r_eff), 1.0 / float(geo.i_J), round(float(np.ceil(geo.layers - 1e-9))))

    def samples(self, x: Mapping[str, FloatArray], omega: FloatArray, geo: Geometry) -> Samples:
        """Terms at samples x (n,), SI, with the motor speed omega at the same moments [rad/s]."""
        hoist, motors = self.params.hoist, self.params.active.motors
        sign, n = np.sign(omega), float(hoist.n_motors)
        alpha_m, dp = x["alpha_m"], x["p_a"] - x["p_b"]
        D = motors.count * motors.D_max

        def loss_of(of: Any, alpha: FloatArray, drop: FloatArray) -> tuple[FloatArray, FloatArray]:
            """Loss of a set of motors, and its change per part of the full displacement [N m]."""
            now, more = (of.count * motor_loss(omega, a * of.D_max, drop, of.fit) for a in (alpha, alpha + NUDGE))
            return now, sign * (more - now) / NUDGE

        wire = x["F_w"] * geo.r_eff
        T_d = np.maximum(wire * self.crane.i_hD, 0.0)
        system = n * system_friction(omega, T_d, hoist.friction)
        loss, loss_per_m = loss_of(motors, alpha_m, dp)
        passive = piston = per_pm = per_p_hp = np.zeros_like(omega)
        if self.has_passive:
            P, alpha_pm = self.params.passive, x["alpha_pm"]
            D_pm, drop = P.motors.count * P.motors.D_max, x["p_hp"] - P.settings.p_lp
            if self.gas_side:
                lost = piston_loss(-D_pm * alpha_pm * omega, P.accumulator)
                piston, drop = motor_torque(D_pm * alpha_pm, lost), drop + lost
            passive_loss, loss_per_pm = loss_of(P.motors, alpha_pm, drop)
            passive, per_pm = motor_torque(D_pm * alpha_pm, drop), D_pm * drop - loss_per_pm
            loss, per_p_hp = loss + passive_loss, D_pm * alpha_pm
        without = n * system_friction(omega, 0.0, hoist.friction)
        return Samples(
            active=motor_torque(D * alpha_m, dp),
            passive=passive,
            wire=wire,
            system=sign * system,
            motors=sign * loss,
            per_alpha_m=D * dp - loss_per_m,
            per_alpha_pm=per_pm,
            per_p=D * alpha_m,
            per_p_hp=per_p_hp,
            per_load=sign * (system - without),
            piston=piston,
        )
