"""The heave-compensation cylinder of a crane: its tables, records, flows, and what follows from them before a run."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple, Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.base.variable import Row
from stillhook.control.plant import Hydraulics
from stillhook.physics.friction import Bristle
from stillhook.physics.hydraulics import lines
from stillhook.physics.hydraulics.accumulator import Accumulator
from stillhook.physics.hydraulics.cylinder import Chambers, Ends, RodFriction, rod_friction_dry
from stillhook.physics.hydraulics.lines import line_pressure, vapour_displaced, vapour_share
from stillhook.physics.hydraulics.swash import Servo
from stillhook.physics.load_path.drum import wire_damping
from stillhook.physics.scalar import scalar
from stillhook.tables.table import Count, Number, Spec
from stillhook.units import show
from stillhook.winches.circuits import rows, tables
from stillhook.winches.circuits.active import NEAR_LIMIT, ActiveFlows, servo_rate
from stillhook.winches.interface import Parts, PartSpeed, Stiffness, Stroke
from stillhook.winches.records import folded, highest, largest, lowest

FILL_RATE, FILL_MOST = 15.0, 0.3
"""Rate at which the pumps bring the cylinder to the load behind the closed lock [1/s], and their largest command
meanwhile [-]: as for closed circuits behind a holding brake. Assumed."""
MAKE_UP_RATE = 0.1
"""Rate at which oil that the accumulator has lost is pumped back [1/s]: slow against waves. Assumed."""
OFF = 1.0e5
"""Pressure that the closed circuit holds at rest from which a word is said [Pa]."""
AREA_SHARE = 0.25
"""Largest part by which the areas of lines A and B may differ [-]. What one line takes more than the other gives must
come through the boost valves, or go through the flushing valve: a closed circuit wants equal areas."""


class CylinderPump(tables.Pumps):
    """Pumps in closed circuit with the cylinder."""

    C_leak: u.Leakage = Field(ge=0, description="total leak of all pumps and of the piston")
    servo: tables.Servo


class CarryingChamber(Spec):
    """Chamber of the cylinder on an accumulator, which carries the weight of the load."""

    A: u.Area = Field(gt=0, description="area on which the accumulator's oil pushes the rod out")
    accumulator: tables.Accumulator
    p_min: u.Pressure = Field(gt=0, description="lowest gas pressure that is set; highest accumulator.gas.p_0")
    Q_make_up: u.Flow = Field(ge=0, description="flow of the pump that compensates leakage")
    relief: tables.Relief
    line: tables.Line


class CylinderFriction(Spec):
    """Friction of rod, guides and sheaves, and the stick-slip model's own numbers."""

    F_c: u.Force = Field(gt=0, description="friction of the seals")
    mu: Number = Field(ge=0, lt=1, description="share of the wire's force on the rod")
    breakaway: Number = Field(ge=0, le=10, description="part by which friction is higher at rest")
    v_s: u.Speed = Field(gt=0, description="rod speed over which breakaway fades")
    b: u.ForcePerSpeed = Field(ge=0, description="viscous friction of the rod")
    sigma_0: u.Stiffness = Field(gt=0, description="bristle stiffness at the rod")
    sigma_1_ratio: Number = Field(ge=0, description="bristle damping over sqrt(sigma_0 m)")
    v_fade: u.Speed = Field(gt=0, description="rod speed over which bristle damping fades")
    v_reg: u.Speed = Field(gt=0, description="regularised option: rod speed of the tanh")


class EndStops(Spec):
    """Ends of the stroke."""

    x_c: u.Length = Field(gt=0, description="length of each cushion")
    c: u.ForcePerSpeed = Field(gt=0, description="damping of a cushion where the rod meets the stop")
    k: u.Stiffness = Field(gt=0, description="stiffness of the end stops")


class SpeedWinch(Spec):
    """The winch behind the cylinder: a source of speed for the operator, on its brake otherwise."""

    v_max: u.Speed = Field(gt=0, description="highest wire speed of the winch")
    tau: u.Time = Field(gt=0, description="time constant of its speed")


class CylinderTable(Spec):
    """Cylinder in the wire's path that compensates heave: lines A and B in closed circuit with servo-controlled pumps,
    a third chamber on an accumulator."""

    falls: Count = Field(description="wire taken in over travel of the rod")
    A_a: u.Area = Field(gt=0, description="area of line A, which pushes the rod out (hoisting)")
    A_b: u.Area = Field(gt=0, description="area of line B, which pulls it in (lowering)")
    x_max: u.Length = Field(gt=0, description="stroke between the end stops")
    v_max: u.Speed = Field(gt=0, description="highest rod speed that the seals are made for")
    m: u.Mass = Field(gt=0, description="rod, crosshead and travelling sheaves")
    pump: CylinderPump
    line: tables.Line
    boost: tables.Boost
    relief: tables.Relief
    flushing: tables.Flushing
    passive: CarryingChamber
    friction: CylinderFriction
    stops: EndStops
    winch: SpeedWinch

    @model_validator(mode="after")
    def _parts_fit_together(self) -> Self:
        p = self.passive
        if abs(self.A_a - self.A_b) > AREA_SHARE * max(self.A_a, self.A_b):
            raise ValueError(
                f"A_a {u.show(self.A_a, 'area')} and A_b {u.show(self.A_b, 'area')} differ by more than"
                f" {AREA_SHARE:.0%}: the boost pump cannot make up the difference in a closed circuit. Bring them"
                " closer."
            )
        if p.A * self.x_max > p.accumulator.V_stroke:
            raise ValueError(
                f"passive.accumulator.V_stroke {u.show(p.accumulator.V_stroke, 'volume')} is less than the"
                f" {u.show(p.A * self.x_max, 'volume')} of the stroke. Raise it, or lower x_max or passive.A."
            )
        if 2.0 * self.stops.x_c >= self.x_max:
            raise ValueError(
                f"stops.x_c {u.show(self.stops.x_c, 'length')}: two cushions leave nothing of x_max"
                f" {u.show(self.x_max, 'length')}. Shorten them."
            )
        if self.relief.p <= self.boost.p + self.flushing.dp_open:
            raise ValueError(
                f"relief.p {u.show(self.relief.p, 'pressure')} is not above boost.p + flushing.dp_open"
                f" {u.show(self.boost.p + self.flushing.dp_open, 'pressure')}. Raise relief.p."
            )
        if not p.p_min <= p.accumulator.gas.p_0 < p.relief.p:
            raise ValueError(
                f"passive.p_min {u.show(p.p_min, 'pressure')}, accumulator.gas.p_0"
                f" {u.show(p.accumulator.gas.p_0, 'pressure')} and relief.p {u.show(p.relief.p, 'pressure')} of the"
                " passive chamber must rise in this order. Change the one that is out of place."
            )
        return self

    @property
    def Q(self) -> float:
        """Full flow of the pumps [m^3/s]."""
        return self.pump.Q_max

    @property
    def v_w_max(self) -> float:
        """Wire speed with the pumps full and no leakage [m/s]: falls times flow over area."""
        return self.falls * self.Q / self.A_a


class CylinderDrive(NamedTuple):
    """The cylinder as kernels read it. n_f wire taken in over travel of the rod [-]; i_m inverse of the mass that moves
    [1/kg]; Q_p full flow of the pumps [m^3/s]; C_leak their total leak [m^3/s/Pa]; P_back power that the units take
    back at most [W]; v_rod highest rod speed [m/s]; v_winch highest wire speed of the winch [m/s], i_tau inverse of its
    time constant [1/s]; F_lock force that the lock of the rod carries [N]; K_fill pump command per missing pressure
    behind the lock [1/Pa]; Q_make_up [m^3/s]; V_mid oil in the accumulator with the rod at mid stroke [m^3]."""

    n_f: float
    i_m: float
    chambers: Chambers
    ends: Ends
    friction: RodFriction
    bristle: Bristle
    servo: Servo
    Q_p: float
    C_leak: float
    boost: lines.Boost
    relief: lines.Relief
    flushing: lines.Flushing
    accumulator: Accumulator
    passive_relief: lines.Relief
    P_back: float
    v_rod: float
    v_winch: float
    i_tau: float
    F_lock: float
    K_fill: float
    Q_make_up: float
    V_mid: float


class Extremes(NamedTuple):
    """Extremes of its signals over a run."""

    p_max: rows.HighestPressure
    p_min: rows.LowestPressure
    void_max: rows.MostVoid
    alpha_p_max: rows.LargestAlphaP
    x_rod_min: Annotated[float, Row("m", "length", "", "least travel of the rod", symbol="min x"), lowest("x_rod")]
    x_rod_max: Annotated[float, Row("m", "length", "", "largest travel of the rod", symbol="max x"), highest("x_rod")]
    v_rod_max: Annotated[float, Row("m/s", "speed", "", "highest rod speed", symbol="max|v|"), largest("v_rod")]
    P_hpu_max: rows.HighestPower


BLANK, fold_extremes = folded(Extremes)


@scalar
def cylinder_flows(alpha_p, P_a, P_b, f_pump, C):
    """All flows of the closed circuit, without what the piston sweeps. alpha_p pump setting [-]; P_a, P_b linear
    pressures [Pa]; f_pump share of the pumps that run [-].

    Source: the lines of Moslatt 2020 E eq. 11, with a cylinder in place of the motors. Differs from the closed circuits
    of rotating winches: relief valves open into the other line, so that pumps may push a rod against its end.
    """
    Q_p = f_pump * C.Q_p * alpha_p
    p_a, p_b, i_beta = line_pressure(P_a), line_pressure(P_b), 1.0 / C.chambers.beta
    void_a, void_b = vapour_share(P_a, i_beta), vapour_share(P_b, i_beta)
    Q_int = lines.internal_leakage(C.C_leak, p_a - p_b) + vapour_displaced(Q_p, void_b, void_a)
    Q_ext_a, Q_ext_b = lines.external_leakage(C.C_leak, p_a), lines.external_leakage(C.C_leak, p_b)
    Q_boost_a, Q_boost_b = lines.boost_flows(p_a, p_b, C.boost)
    Q_relief_a, Q_relief_b = lines.relief_flow(p_a, C.relief), lines.relief_flow(p_b, C.relief)
    Q_flush_a, Q_flush_b = lines.flushing_flow(p_a, p_b, C.flushing), lines.flushing_flow(p_b, p_a, C.flushing)
    Q_ab = Q_p - Q_int - Q_relief_a + Q_relief_b
    return ActiveFlows(
        Q_p=Q_p,
        Q_m=0.0,
        Q_int=Q_int,
        Q_ext_a=Q_ext_a,
        Q_ext_b=Q_ext_b,
        Q_boost_a=Q_boost_a,
        Q_boost_b=Q_boost_b,
        Q_relief_a=Q_relief_a,
        Q_relief_b=Q_relief_b,
        Q_flush_a=Q_flush_a,
        Q_flush_b=Q_flush_b,
        Q_a=Q_ab - Q_ext_a + Q_boost_a - Q_flush_a,
        Q_b=-Q_ab - Q_ext_b + Q_boost_b - Q_flush_b,
    )


def gas_pressure_set(t: CylinderTable, W: float) -> float:
    """Gas pressure that is set for a weight W [N], rod at mid stroke [Pa]: what carries it, within the range of the
    bank."""
    return min(max(t.falls * W / t.passive.A, t.passive.p_min), t.passive.accumulator.gas.p_0)


def cylinder_drive(crane: Any, accumulator: Accumulator, hoist: Any) -> CylinderDrive:
    """The record of a crane's cylinder; accumulator at the gas pressure that is set; hoist of the run."""
    t: CylinderTable = crane.cylinder
    f = t.friction
    r_outer = 0.5 * crane.drum.d_max / crane.i_hD
    return CylinderDrive(
        n_f=float(t.falls),
        i_m=1.0 / t.m,
        chambers=Chambers(t.A_a, t.A_b, t.passive.A, t.line.V, t.line.bulk_modulus, t.x_max),
        ends=Ends(t.x_max, t.stops.x_c, 1.0 / t.stops.x_c, t.stops.c, t.stops.k),
        friction=RodFriction(f.F_c, f.mu, f.breakaway, 1.0 / f.v_s, f.b),
        bristle=Bristle(
            sigma_0=f.sigma_0,
            sigma_1=f.sigma_1_ratio * math.sqrt(f.sigma_0 * t.m),
            i_omega_f=1.0 / f.v_fade,
            regular=hoist.bristle.regular,
            i_omega_r=1.0 / f.v_reg,
        ),
        servo=tables.servo_record(t.pump.servo),
        Q_p=t.Q,
        C_leak=t.pump.C_leak,
        boost=tables.boost_record(t.boost),
        relief=tables.relief_record(t.relief),
        flushing=tables.flushing_record(t.flushing, t.boost),
        accumulator=accumulator,
        passive_relief=tables.relief_record(t.passive.relief),
        P_back=tables.power_back(crane),
        v_rod=t.v_max,
        v_winch=t.winch.v_max,
        i_tau=1.0 / t.winch.tau,
        F_lock=t.falls * hoist.T_brake / r_outer,
        K_fill=FILL_RATE * (t.line.V + 0.5 * t.A_a * t.x_max) / t.line.bulk_modulus / t.Q,
        Q_make_up=t.passive.Q_make_up,
        V_mid=0.5 * accumulator.V_stroke,
    )


def cylinder_stiffness(C: CylinderDrive, h: Any) -> Stiffness:
    """Fast modes of the winch; the rod is the inertia, so that friction and wire are among them. h the Hoist of the
    run."""
    A, acc, m, s = C.chambers, C.accumulator, 1.0 / C.i_m, C.bristle
    least, most = A.V_line, A.V_line + max(A.A_a, A.A_b) * A.x_max
    k_oil = A.beta * max(A.A_a, A.A_b) ** 2 * (1.0 / least + 1.0 / most)
    k_wire = h.wire.EA / (h.wire.L_0 + max(h.s_w_0, 0.0))
    c_wire = float(wire_damping(h.s_w_0, h.load.m, h.wire))
    g = float(rod_friction_dry(0.0, C.n_f * h.load.W, C.friction))
    rates = {
        "boost valve against the cylinder's oil": C.boost.G * A.beta / least,
        "relief valve against the cylinder's oil": C.relief.G * A.beta / least,
        "flushing valve against the cylinder's oil": C.flushing.G * A.beta / least,
        "leakage against the cylinder's oil": C.C_leak * A.beta / least,
        "rod on the cylinder's oil": math.sqrt(k_oil / m),
        "rod on its end stop": math.sqrt(C.ends.k / m),
        "rod in its cushion": C.ends.c / m,
        "rod on the wire": C.n_f * math.sqrt(k_wire / m) + C.n_f**2 * c_wire / m,
        "rod on the accumulator's trapped oil": A.A_p * math.sqrt(acc.i_C / m),
        "passive relief valve against the trapped oil": C.passive_relief.G * acc.i_C,
        "friction of the accumulator piston": A.A_p**2 * acc.R / m,
        "viscous friction of the rod": C.friction.b / m,
        "bristle of the rod": (s.sigma_1 + math.sqrt(s.sigma_0 * m)) / m,
        "regularised friction of the rod": g * s.i_omega_r / m if s.regular > 0.5 else 0.0,
        "pump displacement control": servo_rate(C.servo),
        "speed of the winch": C.i_tau,
    }
    v_max = C.n_f * C.Q_p / min(A.A_a, A.A_b) + C.v_winch
    return Stiffness(rates, viscous=0.0, dry=0.0, n_max=v_max / (0.5 * h.drum.d_max * h.i_i))


def motors(crane: Any) -> tuple[Any, ...]:
    """The drum's motors are not modelled: the winch is a source of speed."""
    return ()


def sized(crane: Any, reference: Any, v_top: float) -> dict[str, float]:
    """Size of its tables for the load of another crane and a wire speed v_top [m/s] over their size now [-]: areas by
    the force in the wire, flows by area times rod speed; falls and stroke stay."""
    force = (reference.SWL + reference.hook_mass) / (crane.SWL + crane.hook_mass)
    flow = force * v_top / crane.cylinder.v_w_max
    of_flow = ("pump", "boost", "relief", "flushing")
    return {"cylinder": force, **{f"cylinder.{name}": flow for name in of_flow}, "hpu": flow, "brake": force}


def part_speeds(crane: Any) -> list[PartSpeed]:
    """The rod in its seals, by the smaller of both areas."""
    t: CylinderTable = crane.cylinder
    return [PartSpeed("rod seals", t.Q / min(t.A_a, t.A_b), t.v_max, "speed")]


def full_wire_speed(crane: Any) -> float:
    """Wire speed at full command [m/s], on every layer."""
    return float(crane.cylinder.v_w_max)


def full_speed(crane: Any, alpha_m: float) -> float:
    """Speed of the drum's motors that would give the same wire speed on the full drum [rad/s]."""
    return full_wire_speed(crane) * crane.i_hD / (0.5 * crane.drum.d_max)


def lag(crane: Any) -> float:
    """Time by which the pumps lag their command [s]."""
    return float(crane.cylinder.pump.servo.lag)


def pump_speed(crane: Any) -> float:
    """Speed of the pumps [rad/s]."""
    return float(crane.cylinder.pump.omega_p)


def pump_units(crane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Size of the pump of each power unit."""
    return crane.cylinder.pump.D, ()


def pump_flows(crane: Any) -> tuple[float, float]:
    """Full flow of the pumps [m^3/s]."""
    return float(crane.cylinder.Q), 0.0


def hydraulics(crane: Any) -> Hydraulics:
    """What controllers may know of its hydraulics: no motors, and lines whose volume the rod changes."""
    return Hydraulics(Q_p=float(crane.cylinder.Q))


def charge(crane: Any) -> float:
    """Highest pressure of the accumulator at rest [Pa]."""
    return float(crane.cylinder.passive.accumulator.gas.p_0)


def stroke(crane: Any, F: float) -> Stroke:
    """Motion of the tip that takes the stroke between the cushions, whatever the tension."""
    t = crane.cylinder
    free = t.x_max - 2.0 * t.stops.x_c
    return Stroke(t.falls * free, f"cylinder of {show(free, 'length')} between its cushions on {t.falls} falls")


def refusal(crane: Any, case: Any) -> str:
    """Reason why it cannot run a case."""
    if crane.brake is None:
        return f'"{crane.name}": the drum is held by its brake while the cylinder compensates. Add a table [brake].'
    return f'gas_held: "{crane.name}" sets its gas to the load. Leave it out.' if case.gas_held else ""


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """What the winch type means for a weight and a motion."""
    t, out = crane.cylinder, []
    p_0, free = gas_pressure_set(t, held.W), stroke(crane, held.W)
    dp = (t.falls * held.W - p_0 * t.passive.A) / t.A_a
    p_gas = show(p_0, "pressure")
    if abs(dp) > NEAR_LIMIT * (t.relief.p - t.boost.p):
        out.append(
            f"with the gas at {p_gas} the closed circuit must hold {show(abs(dp), 'pressure')}, more than the"
            f" {show(t.relief.p - t.boost.p, 'pressure')} up to the relief valves: the rod will run into its end"
        )
    elif abs(dp) > OFF:
        out.append(f"the gas is set to {p_gas}, an end of its range, and the pumps hold {show(abs(dp), 'pressure')}")
    if held.compensates and held.s_tip_pp > free.length:
        out.append(
            f"compensating {show(held.s_tip_pp, 'length')} takes more wire than {show(free.length, 'length')}:"
            f" {free.basis}, so the rod will run into its ends"
        )
    return out
