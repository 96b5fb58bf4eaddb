"""What a winch type is: one module with its tables, records, equations and what it says before a run.

A winch module has

NAME, TITLE
    Name that crane files write (`plant = "..."`), and one line that says what it is.
TABLES
    Tables of the crane file that it needs, by name: `base.table.Spec` models.
SHOWN (optional)
    Its own numbers in a table of runs, with the head of each column (default all of them).
CONTROL (optional)
    Kind of drive that controllers command: "displacement" (default), a closed circuit whose motors' displacement they
    set, or "speed", a drive that takes the speed command u_p alone.
TUNED (optional)
    Settings of its drive that `tune` may search, by their path in a crane file, with the ends of the search [SI]:
    {"electric.speed.K": (1.0, 40.0)}.
WITHIN (optional)
    Powers that go in at one place of the winch and out at another, equal and both in `Powers`: not from outside.
PER_MOTOR (optional)
    Tables of which the numbers are those of one motor, next to the one with `count`: a larger drive has more of them.
PATH
    Load path below it, `stillhook.winches.load_path` for wire and load.
Params, State, Command, Circuit
    NamedTuples of floats: parameters (with `hoist`, `plc` and `sensors`), state without that of the load path, commands
    held between PLC cycles, what its diagram shows at an instant.
Signals, Extremes, Limits, Powers
    NamedTuples: signals of its own and extremes over a run, annotated with a `base.variable.Row`; limits that are
    passed, annotated with a `Cause`; powers, those of SUPPLIED going in and the others out.
geometry(s_w, p), wire_speed(x, geo)
    The drum during a cycle, and the speed of the wire at the port [m/s].
circuit(x, q, u, geo, p), rates(c, x, q, u, geo, p)
    The winch at an instant, with the load path's point q (tension q.F_w), and the time derivatives of its state.
bristle_after(c, x, p, tau)
    Where the state has a bristle z: its value tau [s] later, exactly.
start(s_w, tick, p), settle(x, q, u, tick, geo, p)
    The state at rest before the PLC's first cycle, and under its first commands.
sense(x, y, q, m, tick, geo, p), actuate(drive, r, x, m_0, m, tick, geo, p)
    What the PLC reads; the plant's commands, the PLC's memory and the signals of the drive.
signals(c, x, q, u, geo, p), limits(c, x, q, u, p), powers(c, x, q, p), stored_energy(c, x, geo, p)
    Its signals, limits, powers and stored energy.
BLANK, fold_extremes(a, y)
    Extremes of nothing yet, and with one more cycle of signals y.

All of these are `scalar` functions of floats and records. Plain Python functions on a `Crane` are

pack(crane, case, parts)
    Params of a run, from the `Parts` that every winch has.
motors(crane)
    Sets of motors on the shaft: each with `count` and inertia `J` of one [kg m^2].
full_speed(crane, alpha_m)
    Motor speed at full command [rad/s] with the motors at displacement alpha_m [-].
stiffness(p)
    `Stiffness`, from which the longest step follows.

and, where they mean something for the type,

lag(crane)
    Time by which the drive lags its command [s] (default 0); K_2 = K_1 lag.
full_wire_speed(crane)
    Wire speed at full command [m/s] of a winch that has the same on every layer (default None: motor speed at full
    command, by gear and diameter). Its PLC reads K_wire = 1.
least_displacement(crane)
    Smallest displacement of the motors [-] (default 1: fixed).
pump_units(crane), pump_flows(crane)
    Size of each pump that a power unit drives, active and passive; their flows at full stroke [m^3/s] (default none).
pump_speed(crane)
    Speed at which the power units turn them [rad/s] (default that of a closed circuit, else None: none are turned).
charge(crane)
    Accumulator pressure at rest [Pa] (default 0).
other_motors(crane, W, d)
    `OtherMotors` next to the active ones that hold a weight W [N] on diameter d [m] (default none).
refusal(crane, case), notes(crane, held, parts)
    Reason why it cannot run a case ("" where it can), and what to say of it before it runs, in lines.
sized(crane, reference, v_top)
    Where its size is not a number of motors: size of its tables for the load of another crane and a wire speed at full
    command [m/s], over their size now, by path of the table.
part_speeds(crane)
    `PartSpeed` of what moves with the wire and is no motor on the shaft (default none).
stroke(crane, F)
    Tip motion that takes the stroke of what carries the tension F [N], in `Stroke`; None where nothing has one.
speed_limit(p, geo, F_w, lowering)
    Highest steady motor speed with tension F_w [N] at the top, hoisting or lowering [rad/s], and the word of the limit
    that stops it; of types without `steady`, for the envelope and the speeds of a plan.
steady(p, geo, F_w, omega_m, v_op, alpha_m), carried(p, geo, F_w), mean_pressure(x, p)
    State and command of a steady speed; `Carried`; mean accumulator pressure. Without them the type has no operating
    point, and margins are those of the linearised engine.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from stillhook.base.variable import Variable

NOT_YET = 1.0e300
"""Stands for the lowest value of nothing yet."""


class Parts(NamedTuple):
    """What a run gives every winch type to pack: records of drum, wire and load, PLC and sensors, and functions that
    pack closed circuits and accumulators."""

    hoist: Any
    plc: Any
    sensors: Any
    active: Callable[[Any], Any]  # crane -> ActiveCircuit
    passive: Callable[[Any, bool], Any]  # crane, whether the gas is held -> PassiveCircuit
    gas: Callable[[Any], Any]  # table of an accumulator -> Gas
    accumulator: Callable[[Any, Any, bool, str], Any]  # its table, that of its line, gas held, place -> Accumulator


class Stiffness(NamedTuple):
    """What bounds the step of a winch without its load path."""

    rates: Mapping[str, float]  # fast modes by name [1/s]
    viscous: float  # slope of its moving losses by motor speed [N m s/rad]
    dry: float  # upper bound of its dry friction without the transmission's [N m]
    n_max: float  # highest motor speed [rad/s]


class OtherMotors(NamedTuple):
    """A set of motors next to the active ones that holds a weight."""

    name: str
    motor: Any  # MotorSet
    alpha: float  # displacement that it takes [-]; above 1 they cannot
    dp: float  # pressure over them [Pa]


class PartSpeed(NamedTuple):
    """A part that moves with the wire at full command."""

    part: str
    speed: float  # at full command
    highest: float  # that it is made for
    quantity: str  # "speed" [m/s] or "rotation" [rad/s]


class Stroke(NamedTuple):
    """How much motion what carries a load can take."""

    length: float  # [m]
    basis: str


class Carried(NamedTuple):
    """What other motors than the active ones hold of a load at rest."""

    T: float  # torque at the motor shaft, without losses [N m]
    alpha: float  # their displacement [-]
    n_max: float  # their highest speed at this displacement [rad/s]


class Cause(NamedTuple):
    """What passing a limit is called: the word in a run's status, and the row of the time beyond it."""

    status: str
    meaning: str
    symbol: str = ""
    source: str = ""

    def named(self, limit: str) -> Variable:
        """The row of the time for which the limit of this name is passed."""
        return Variable(f"{limit}_time", self.symbol or f"{limit}_time", "s", "time", "", self.meaning, self.source)
