"""Digital displacement: units on a rail, each of whose cylinders is enabled or idle for a stroke, turn the drum
(Moslatt 2020 papers C and E, section 1). Rail, speed control and PLC are those of secondary control; response, leak and
friction are those of cylinders.

Averaged over the cylinders: the pattern of strokes is not in the state. Its torque and its wire speed are bounded in
closed form, see `notes`."""

from typing import Any, NamedTuple

from pydantic import Field

from stillhook.control.plc import Plc
from stillhook.physics.hydraulics.digital import enabled, setting_acceleration, torque_of_pattern
from stillhook.physics.hydraulics.secondary import load_ahead, setting_for_torque
from stillhook.physics.hydraulics.swash import displacement, swash_acceleration, swash_rate
from stillhook.physics.records import replace
from stillhook.physics.scalar import copysign, fmin, scalar
from stillhook.tables.table import Count, Number, Spec
from stillhook.units import show
from stillhook.winches.circuits import rail
from stillhook.winches.circuits.passive import PassiveCircuit
from stillhook.winches.circuits.rail import (
    BLANK,
    DriveSettings,
    Extremes,
    Secondary,
    Signals,
    charge,
    fold_extremes,
    stroke,
)
from stillhook.winches.interface import Parts, Stiffness
from stillhook.winches.load_path import load
from stillhook.winches.load_path.load import Hoist
from stillhook.winches.records import Geometry, Sensors, apply_override
from stillhook.winches.shaft import bristle_after, friction, geometry, wire_speed
from stillhook.winches.types import secondary
from stillhook.winches.types.secondary import (
    CONTROL,
    SHOWN,
    SUPPLIED,
    TUNED,
    Circuit,
    Command,
    Limits,
    Powers,
    State,
    full_speed,
    hydraulics,
    lag,
    limits,
    motors,
    powers,
    pump_flows,
    pump_speed,
    pump_units,
    sense,
    settle,
    signals,
    start,
    stored_energy,
)

NAME = "digital"
TITLE = "digital displacement winch: units on a rail turn the drum, each cylinder enabled or idle for a stroke"
PATH = load
STROKES = 1.0
"""Share of their stroke that pistons move, enabled or idle [-]."""
SLOW = 0.1
"""Part of full speed at which the wire speed of the pattern is stated [-]."""
NEAR = 0.01
"""Part of the full displacement by which a map may end below it [-]."""
CONSIDERABLE = 0.1
"""Torque of the pattern over that of the load, above which it is noted [-]."""


class Digital(Spec):
    """Cylinders of digital displacement units; their rail and units are in [secondary]."""

    cylinders: Count = Field(description="cylinders of one unit, evenly on its shaft and between those of the others")
    idle: Number = Field(
        ge=0, le=1, description="loss of an idle cylinder over that of an enabled one without pressure"
    )


TABLES = {"secondary": Secondary, "digital": Digital}
SERVOS = secondary.SERVOS


class Params(NamedTuple):
    """As of secondary control, and idle loss of an idle cylinder over that of an enabled one without pressure [-]; the
    servo of the units is their response at standstill, by partial strokes."""

    rail: PassiveCircuit
    drive: DriveSettings
    p_min: float
    P_back: float
    idle: float
    hoist: Hoist
    plc: Plc
    sensors: Sensors


with_motors = replace(PassiveCircuit, "motors")


@scalar
def rail_at(alpha, p):
    """The rail with the leak and the friction of units at a setting [-]."""
    return with_motors(p.rail, enabled(p.rail.motors, fmin(abs(alpha), 1.0), p.idle))


@scalar
def circuit(x, q, u, geo, p):
    """The winch at an instant: the rail, of whose units the enabled cylinders leak, while all pistons move."""
    alpha_s = displacement(x.alpha_s, p.rail.motor_servo)
    return secondary.circuit_of(x, q, u, geo, alpha_s, STROKES, rail_at(alpha_s, p), p)


with_setting = replace(State, "alpha_s", "alpha_s_dot")


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state: as of secondary control, but for the setting, which follows by strokes."""
    return with_setting(
        secondary.rates(c, x, q, u, geo, p),
        x.alpha_s_dot,
        setting_acceleration(x.alpha_s, x.alpha_s_dot, c.u_s, x.omega_m, p.rail.motor_servo),
    )


with_rail = replace(Params, "rail")


@scalar
def loss_at(alpha, F, dp, omega_m, geo, p):
    """Friction of the winch with units at a setting and a load F [N], never negative [N m]."""
    now = with_rail(p, rail_at(alpha, p))
    dry = secondary.dry_level(F * 0.5 * geo.d, alpha, dp, omega_m, now)
    return dry + abs(secondary.moving_loss(STROKES, dp, omega_m, now))


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Commands of the plant, the PLC's memory, signals of the drive; the friction fed forward is that of cylinders."""
    drive = apply_override(drive, tick)
    omega_ref = drive.u_p * p.drive.n_full
    F = load_ahead(m.F, r.F, p.drive.most)
    T_f = loss_at(x.alpha_s, F, r.p_hp - p.rail.settings.p_lp, omega_ref, geo, p)
    T_ahead = secondary.torque_ahead_of(F, T_f, omega_ref, drive.u_p, m, drive.brake, tick, geo, p)
    return secondary.commands(drive, omega_ref, T_ahead, r, x, m, tick, geo, p)


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Parameters of a run."""
    return Params(**secondary.pack(crane, case, parts)._asdict(), idle=crane.digital.idle)


def stiffness(p: Params) -> Stiffness:
    """Fast modes of the winch; strokes follow each other fastest at the highest speed."""
    of_rail = secondary.stiffness(p)
    R = p.rail
    fastest = (R.motor_servo.omega_n**2 + R.n_full**2) ** 0.5 * max(1.0, 2.0 * R.motor_servo.zeta)
    return of_rail._replace(
        rates={**of_rail.rates, "secondary unit displacement control": fastest},
    )


def steady_torque(p: Params, geo: Geometry, F_w: float, omega_m: float) -> float:
    """Torque of all units at a steady speed [N m], hoisting positive; F_w tension at the top [N]."""
    R, T_w = p.rail, F_w * geo.r_eff
    dp = R.settings.p_set - R.settings.p_lp
    T_f = loss_at(setting_for_torque(T_w, R.settings.D_m_max, dp), F_w, dp, omega_m, geo, p)
    return float(T_w + copysign(T_f, omega_m))


def steady_flow(p: Params, T: float, omega_m: float) -> float:
    """Flow that the rail's pumps must give at a steady speed and mid stroke [m^3/s]; negative: take."""
    s = p.rail.settings
    alpha = setting_for_torque(T, s.D_m_max, s.p_set - s.p_lp)
    return secondary.steady_flow(p._replace(rail=rail_at(alpha, p)), T, omega_m)


def speed_limit(p: Params, geo: Geometry, F_w: float, lowering: bool = False) -> tuple[float, str]:
    """Highest steady motor speed with the tension F_w at the top [rad/s], and the limit that ends it."""
    return secondary.speed_limit_of(steady_torque, steady_flow, p, geo, F_w, lowering)


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """What the rail has to say, a map of the loss that does not reach the full displacement at which cylinders are
    enabled, and how far the pattern of strokes moves the wire."""
    table = crane.secondary
    unit, cylinders = table.unit, table.unit.count * crane.digital.cylinders
    T = torque_of_pattern(unit.D_total, table.accumulator.gas.p_0 - table.p_lp, cylinders)
    omega, r_eff = SLOW * table.drive.n_full, 0.5 * held.d / crane.i_hD
    v, share = T / (crane.inertia.J_m_eff * omega) * r_eff, T / (held.W * r_eff)
    of_pattern = (
        f"strokes of {cylinders} cylinders are averaged: their pattern adds at most {show(T, 'torque')} at the shaft,"
        f" {share:.0%} of the load, and {show(v, 'speed')} of wire at {show(omega, 'rotation')}"
    )
    full, levels = unit.D_max, () if unit.loss_model is None else unit.loss_model.D_m or ()
    short = [f"{show(D, 'displacement')}" for D in levels[-1:] if D < (1.0 - NEAR) * full]
    of_map = [
        f"enabled cylinders lose what a unit loses at {show(full, 'displacement')}, and its map ends at {end}: the loss"
        " is held there, and too small"
        for end in short
    ]
    return rail.notes(crane, held, parts) + of_map + [of_pattern] * (share > CONSIDERABLE)
