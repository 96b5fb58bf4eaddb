"""Electric winch: machines with inverters on a DC link with a store turn the drum through gears."""

import math
from typing import Annotated, Any, NamedTuple

from stillhook.base.variable import Row
from stillhook.control.plc import Plc, hold
from stillhook.physics.electric import machine, supply
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.records import replace, zeros_but
from stillhook.physics.scalar import clip, fmax, fmin, scalar
from stillhook.units import show
from stillhook.winches import shaft
from stillhook.winches.circuits import rows
from stillhook.winches.circuits.electric import BLANK, Drive, Electric, Extremes, fold_extremes, records
from stillhook.winches.interface import Cause, Parts, Stiffness
from stillhook.winches.load_path import load
from stillhook.winches.load_path.load import Hoist, shaft_inertia_without_wire
from stillhook.winches.records import Geometry, Sensors, apply_override
from stillhook.winches.shaft import bristle_after, friction, geometry, sense, wire_speed

NAME = "electric"
TITLE = "electric winch: machines with inverters on a DC link with a store"
PATH = load
CONTROL = "speed"
TUNED = {"electric.speed.K": (20.0, 2000.0), "electric.speed.T_i": (0.02, 2.0)}
SHOWN = {"T_m_max": "peak\ntorque", "P_el_max": "peak grid\npower", "theta_max": "highest\ntemperature"}
TRIP = 1.1
"""Speed over the highest of the machines at which the drive trips and the brake closes for good [-]. Assumed."""
TRIPPED, CLOSING = 1.0e-3, 10.0
"""Share from which a trip goes on by itself [-], and the rate at which it closes the brake [1/s]. Assumed."""
BISECTIONS = 50
"""Halvings of a search for a speed: to rounding."""
TABLES = {"electric": Electric}


class Params(NamedTuple):
    drive: Drive
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """The winch without its load path."""

    i: float  # torque-producing current of one machine [A]
    omega_m: float  # motor speed, hoisting positive [rad/s]
    omega_ref: float  # its set-point, smoothed [rad/s]
    T_ff: float  # feedforward, smoothed [N m]
    T_n: float  # integral part of the speed loop [N m]
    E: float  # energy of the store [J]
    theta: float  # temperature of the windings [K]
    theta_store: float  # temperature of the store [K]
    heat: float  # temperature rise of the braking resistor over the highest that it may have [-]
    trip: float  # how far the brake is closed after a trip for overspeed, for good [-]
    z: float  # bristle, half a step ahead [rad]


class Command(NamedTuple):
    """Held between PLC cycles: u_p motor speed over that at full command [-]; T_ff feedforward of load and acceleration
    [N m]; brake how far the holding brake is closed [-]."""

    u_p: float
    T_ff: float
    brake: float


class Circuit(NamedTuple):
    """Everything that the diagram shows at an instant; powers [W], torques of all machines at the shaft [N m]. I_store
    current into the store [A], V_dc voltage of the link [V]. g level of dry friction, with that of the brake where it
    is held (above 0.5); held how far the brake is closed, by the PLC or a trip [-]."""

    T_demand: float
    T_ref: float
    T: float
    P_dc: float
    P_el: float
    P_resistor: float
    P_store: float
    I_store: float
    loss_store: float
    V_dc: float
    g: float
    held: float
    T_moving: float


class Signals(NamedTuple):
    """Signals of its own."""

    omega_m: rows.OmegaM
    T_m: Annotated[float, Row("N m", "torque", "hoisting positive", "torque of all machines at the motor shaft")]
    i: Annotated[float, Row("A", "current", "hoisting positive", "torque-producing current of one machine")]
    P_el: Annotated[float, Row("W", "power", "to the winch positive", "power from the grid; negative: fed back")]
    P_dc: Annotated[float, Row("W", "power", "to the winch positive", "power of the inverters from the DC link")]
    E_store: Annotated[float, Row("J", "energy", "", "energy of the store on the DC link")]
    theta: Annotated[float, Row("K", "temperature", "", "temperature of the windings")]
    V_dc: Annotated[float, Row("V", "voltage", "", "voltage of the DC link")]
    I_store: Annotated[float, Row("A", "current", "charging positive", "current into the store")]
    P_resistor: Annotated[float, Row("W", "power", "", "power of the braking resistor")]
    theta_store: Annotated[float, Row("K", "temperature", "", "temperature of the store")]


class Limits(NamedTuple):
    """1 where a limit is passed at an instant, else 0."""

    torque: Annotated[float, Cause("torque", "time with the machines at their largest torque")]
    drive_power: Annotated[float, Cause("power", "time with the machines or their supply at their largest power")]
    temperature: Annotated[float, Cause("temperature", "time with the windings above their highest temperature")]
    speed: Annotated[float, Cause("overspeed", "time with the machines above their highest speed, or tripped by it")]
    store_full: Annotated[
        float,
        Cause("store full", "time with less taken back than the load gives, the store close to its highest voltage"),
    ]
    store_empty: Annotated[float, Cause("store empty", "time with the store too empty for its power")]
    store_current: Annotated[float, Cause("store current", "time with the store at its largest current")]
    store_heat: Annotated[float, Cause("store temperature", "time with the store above its highest temperature")]
    resistor: Annotated[
        float, Cause("resistor temperature", "time with the braking resistor too hot for what it is to burn")
    ]
    overvoltage: Annotated[float, Cause("overvoltage", "time with the DC link above its highest voltage")]
    undervoltage: Annotated[float, Cause("undervoltage", "time with the DC link below its lowest voltage")]
    brake: Annotated[float, Cause("brake slipping", "time with the holding brake slipping")]


class Powers(NamedTuple):
    """Powers [W] of two balances: into the DC link goes the grid's, out of it `shaft` and the losses; into the shaft
    goes `motor`, which is the same as `shaft`, out of it friction."""

    grid: float
    motor: float
    shaft: float
    copper: float
    iron: float
    inverter: float
    store: float
    resistor: float
    friction: float


SUPPLIED = ("grid", "motor")
WITHIN = ("motor", "shaft")
PER_MOTOR = ("electric.inverter",)


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant, read along its diagram: speed loop, torque limit, current, DC link, friction. q
    point of the load path. Where the holding brake closes it takes the load over, and the drive lets go."""
    h, d, M = p.hoist, p.drive, p.drive.machines
    held = fmax(u.brake, x.trip)
    P_most = supply.supply_limit(x.E, x.heat, d.store, d.grid)
    P_back = supply.take_limit(x.E, x.heat, d.store, d.grid)
    T_demand = (1.0 - held) * machine.torque_demand(x.omega_ref, x.omega_m, x.T_ff, x.T_n, d.speed)
    T_most = machine.torque_limit(x.omega_m, P_most, P_back, M)
    T_least = -machine.torque_limit(-x.omega_m, P_most, P_back, M)
    T_ref = clip(T_demand, T_least, T_most)
    P_dc = machine.link_power(x.i, x.omega_m, M)
    P_resistor = supply.resistor_power(P_dc, x.E, x.heat, d.store, d.grid)
    P_el = supply.grid_power(P_dc, P_resistor, x.E, d.store, d.grid)
    P_store = P_el - P_dc - P_resistor
    I_store = supply.store_current(P_store, x.E, d.store)
    return Circuit(
        T_demand=T_demand,
        T_ref=T_ref,
        T=machine.torque(x.i, M),
        P_dc=P_dc,
        P_el=P_el,
        P_resistor=P_resistor,
        P_store=P_store,
        I_store=I_store,
        loss_store=d.store.R * I_store * I_store,
        V_dc=supply.open_voltage(x.E, d.store) + d.store.R * I_store,
        g=shaft.dry_level(0.0, x.omega_m, q.F_w * 0.5 * geo.d, h) + held * h.T_brake,
        held=held,
        T_moving=shaft.moving_loss(0.0, x.omega_m, h),
    )


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    h, M = p.hoist, p.drive.machines
    T = c.T - q.F_w * geo.r_eff - friction(c, x, p)
    T_n = machine.integral_rate(x.omega_ref, x.omega_m, c.T_demand, c.T_ref, p.drive.speed)
    trips = h.T_brake > 0.0 and (abs(x.omega_m) > TRIP * M.n_max or x.trip > TRIPPED)
    heat = (machine.copper_loss(x.i, M) + machine.iron_loss(x.omega_m, M)) / M.count
    return State(
        i=machine.current_rate(x.i, machine.current(c.T_ref, p.drive.machines), p.drive.rate_i),
        omega_m=T * geo.i_J,
        omega_ref=machine.smoothing_rate(x.omega_ref, u.u_p * p.drive.n_full, p.drive.speed),
        T_ff=machine.smoothing_rate(x.T_ff, u.T_ff, p.drive.speed),
        T_n=(1.0 - c.held) * T_n - c.held * p.drive.speed.i_T * x.T_n,
        E=c.P_store - c.loss_store,
        theta=machine.heating_rate(x.theta, heat, p.drive.winding),
        theta_store=machine.heating_rate(x.theta_store, c.loss_store, p.drive.heat_store),
        heat=supply.resistor_heating_rate(x.heat, c.P_resistor, p.drive.grid),
        trip=CLOSING * (1.0 - x.trip) if trips else 0.0,
        z=0.0,
    )


still, with_load = zeros_but(State, "E", "theta", "theta_store"), replace(State, "i", "T_ff", "T_n", "z")


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the load hangs still; s_w wire out [m]."""
    return still(p.drive.store.E_set, p.drive.theta_0, p.drive.theta_store_0)


@scalar
def settle(x, q, u, tick, geo, p):
    """The state at rest under the PLC's first commands: machines or brake hold the load; x that of `start`."""
    T = q.F_w * geo.r_eff
    i = machine.current((1.0 - u.brake) * T, p.drive.machines)
    return with_load(x, i, u.T_ff, (1.0 - u.brake) * (T - u.T_ff), -u.brake * T / p.hoist.bristle.sigma_0)


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Commands of the drive, the PLC's memory, signals of the drive. Feedforward: torque of the load from the load
    cell, and of the acceleration that compensation asks for."""
    drive = apply_override(drive, tick)
    a_w = -tick.a_m if m.mode > 0.0 else 0.0
    T_ff = m.F * geo.r_eff + a_w / (geo.r_eff * geo.i_J)
    return Command(drive.u_p, T_ff, drive.brake), hold(m, 1.0), drive


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    return Signals(
        omega_m=x.omega_m,
        T_m=c.T,
        i=x.i,
        P_el=c.P_el,
        P_dc=c.P_dc,
        E_store=x.E,
        theta=x.theta,
        V_dc=c.V_dc,
        I_store=c.I_store,
        P_resistor=c.P_resistor,
        theta_store=x.theta_store,
    )


AT = 1.0 - 1.0e-9
"""Part of the largest torque from which the demand counts as held at it [-]: rounding."""
NEAR = 1.0e-3
"""Part of a limit of the supply within which it counts as reached [-]: it is approached with a lag."""
SLIPS = 0.999
"""Part of the level of friction from which the closed brake counts as slipping [-]: it gets there asymptotically."""


@scalar
def limits(c, x, q, u, p):
    """Which limits are passed now; see `Limits`."""
    d = p.drive
    beyond, torque_held = abs(c.T_demand) > abs(c.T_ref), abs(c.T_ref) >= AT * d.machines.T_max
    s, held_back = d.store, beyond and not torque_held
    slips = c.held > 0.5 and p.hoist.bristle.sigma_0 * abs(x.z) >= SLIPS * c.g
    return Limits(
        torque=1.0 if beyond and torque_held else 0.0,
        drive_power=1.0 if held_back else 0.0,
        temperature=1.0 if x.theta > d.winding.theta_max else 0.0,
        speed=1.0 if abs(x.omega_m) > d.machines.n_max or x.trip > TRIPPED else 0.0,
        store_full=1.0 if held_back and c.T_ref * x.omega_m < 0.0 and (s.E_high - x.E) * s.i_band < 1.0 else 0.0,
        store_empty=1.0 if (x.E - s.E_low) * s.i_band < 1.0 else 0.0,
        store_current=1.0 if abs(c.I_store) > (1.0 - NEAR) * s.I_max else 0.0,
        store_heat=1.0 if x.theta_store > d.heat_store.theta_max else 0.0,
        resistor=1.0 if c.P_resistor < fmin(supply.resistor_demand(c.P_dc, x.E, s, d.grid), d.grid.P_resistor) else 0.0,
        overvoltage=1.0 if c.V_dc > (1.0 + NEAR) * s.V_high else 0.0,
        undervoltage=1.0 if c.V_dc < (1.0 - NEAR) * s.V_low else 0.0,
        brake=1.0 if slips else 0.0,
    )


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    M = p.drive.machines
    return Powers(
        grid=c.P_el,
        motor=c.T * x.omega_m,
        shaft=c.T * x.omega_m,
        copper=machine.copper_loss(x.i, M),
        iron=machine.iron_loss(x.omega_m, M),
        inverter=machine.inverter_loss(x.i, M),
        store=c.loss_store,
        resistor=c.P_resistor,
        friction=friction(c, x, p) * x.omega_m,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy of shaft and store [J]."""
    return shaft.energy(x, geo) + x.E


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Records of a run."""
    return Params(records(crane.electric), parts.hoist, parts.plc, parts.sensors)


def motors(crane: Any) -> tuple[Any, ...]:
    """Sets of motors on the shaft."""
    return (crane.electric.motor,)


def full_speed(crane: Any, alpha_m: float) -> float:
    """Motor speed at full command [rad/s], whatever displacement."""
    return float(crane.electric.motor.n_full)


def lag(crane: Any) -> float:
    """Time by which the drive lags its command [s]: smoothing and current loop; the acceleration is fed forward."""
    return float(crane.electric.speed.tau_ref + 1.0 / machine.current_loop_rate(crane.electric.inverter.omega_i))


def stiffness(p: Params) -> Stiffness:
    """Fast modes of the winch [1/s], from which the longest step follows."""
    d, J = p.drive, shaft_inertia_without_wire(p.hoist)
    modes = {
        "current control": d.rate_i,
        "speed control": math.sqrt(d.speed.K * d.rate_i / J),  # with its current loop: s^2 + rate s + rate K / J
        "integral part of the speed control": d.speed.i_T,
        "smoothing of the set-points": d.speed.i_tau,
        "limits of the store": (2.0 * d.store.P_max + d.grid.P_max + d.grid.P_back + d.grid.P_resistor)
        * d.store.i_band,
        "refilling of the store": d.store.i_tau,
        "heat of the braking resistor": supply.resistor_rate(d.grid),
        "closing of the brake at a trip": CLOSING,
    }
    return Stiffness(modes, viscous=0.0, dry=0.0, n_max=d.machines.n_max)


def speed_limit(p: Params, geo: Geometry, F_w: float, lowering: bool = False) -> tuple[float, str]:
    """Highest steady motor speed with the tension F_w at the top [N], and its cause: [rad/s], a word of `Limits` or the
    full command. The store is exhausted, the windings are not yet warm, the braking resistor burns what it may for
    ever."""
    h, sign = p.hoist, -1.0 if lowering else 1.0

    def cause(omega: float) -> str:
        dry = system_friction_dry(omega, F_w * 0.5 * geo.d, h.friction)
        T = F_w * geo.r_eff + sign * h.n_motors * (dry + h.friction.Y_5 * omega)
        P = machine.link_power(machine.current(T, p.drive.machines), sign * omega, p.drive.machines)
        if abs(T) > p.drive.machines.T_max:
            return "torque"
        if P < -(p.drive.grid.P_back + p.drive.grid.P_rated):
            return "store full"
        return "power" if abs(T) * omega > p.drive.machines.P_max or P > p.drive.grid.P_max else ""

    if not cause(p.drive.n_full):
        return p.drive.n_full, "full command"
    low, high = 0.0, p.drive.n_full
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if cause(middle) else (middle, high)
    return low, cause(high)


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """What the winch type means for a weight and a motion."""
    drive = records(crane.electric)
    M, store = drive.machines, drive.store
    T = held.W * 0.5 * held.d / crane.i_hD
    out = []
    if T > M.T_max:
        out.append(
            f"holding the load takes {show(T, 'torque')} at the motor shaft, more than the {show(M.T_max, 'torque')} of"
            " the machines: the load will sink"
        )
    end = machine.time_to_limit(drive.theta_0, machine.copper_loss(machine.current(T, M), M) / M.count, drive.winding)
    if end < math.inf:
        out.append(
            f"holding the load brings the windings to {show(drive.winding.theta_max, 'temperature')} after"
            f" {show(end, 'time', 2)}"
        )
    swing, usable = held.W * held.s_tip_pp, store.E_high - store.E_low
    if held.compensates and swing > 0.5 * usable:
        out.append(
            f"a swing of the tip moves {show(swing, 'energy', 3)} through the store, which holds"
            f" {show(usable, 'energy', 3)} between its limits: expect it full or empty"
        )
    return out
