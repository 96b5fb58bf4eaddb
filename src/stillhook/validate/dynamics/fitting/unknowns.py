"""Tuned parameters of a test of the winch's dynamics, and nuisance parameters left free so that they do not bias the
tuned ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from stillhook.library.leakage import form_of
from stillhook.spec.crane import Crane, inertia_ratio_without_wire
from stillhook.winches.circuits.tables import LeakForm, MotorSet

C_H, C_LEAK, INERTIA, VISCOUS, SPEED_LEAKAGE = "C_h", "C_leak", "J_m_eff", "viscous", "speed_leakage"
TUNED = (C_H, C_LEAK, INERTIA)
"""The three that are tuned: capacitance of both lines, leakage of the active pumps and motors, inertia at the shaft
with a full drum."""


MOST = math.log(2.5)
"""A factor on what is tuned is looked for within exp(MOST) and its inverse."""


class Unknown(NamedTuple):
    """A factor on the crane. bend(crane, factor) gives the crane; spread: standard deviation of its logarithm before
    any data (inf: none is assumed); step: by how much the logarithm changes in a finite difference."""

    name: str
    meaning: str
    bend: Callable[[Crane, float], Crane]
    spread: float
    step: float = 2e-3

    @property
    def most(self) -> float:
        """Bound of the logarithm either way: what is tuned within a factor of 2.5, the rest within three spreads."""
        return MOST if math.isinf(self.spread) else max(MOST, 3.0 * self.spread)


def _line(crane: Crane, x: float) -> Crane:
    a = crane.active
    line = a.line.model_copy(update={"V": a.line.V * x})
    return crane.model_copy(update={"active": a.model_copy(update={"line": line})})


def _leakage(crane: Crane, x: float) -> Crane:
    a = crane.active
    motor = a.motor.model_copy(update={"C_1": a.motor.C_1 * x, "C_2": a.motor.C_2 * x})
    pump = a.pump.model_copy(update={"leak_scale": (1.0 if a.pump.leak_scale is None else a.pump.leak_scale) * x})
    return crane.model_copy(update={"active": a.model_copy(update={"motor": motor, "pump": pump})})


WITHOUT_SPEED: Mapping[LeakForm, LeakForm] = {LeakForm.CONSTANT: LeakForm.SPEED, LeakForm.STROKE: LeakForm.STROKE_SPEED}
"""Forms of leak that do not go with the motors' speed, and each with it."""


def _speed_leakage(crane: Crane, x: float) -> Crane:
    """C_2 times x, whatever the form; in a form without it, C_2 (x - 1) beside what the motors leak."""
    a, leak = crane.active, form_of(crane.active)
    C_1, C_2 = a.motor.C_1, a.motor.C_2 * x
    if leak.form in WITHOUT_SPEED:
        C_1, C_2 = C_1 + a.motor.C_2 * leak.at.n_m, C_2 - a.motor.C_2
        leak = leak.model_copy(update={"form": WITHOUT_SPEED[leak.form]})
    motor = a.motor.model_copy(update={"C_1": C_1, "C_2": C_2})
    return crane.model_copy(update={"active": a.model_copy(update={"motor": motor, "leak": leak})})


def _inertia(crane: Crane, x: float) -> Crane:
    """All inertia but the wire's takes the difference: the wire's follows from its mass."""
    s, part = 1.0 + inertia_ratio_without_wire(crane) * (x - 1.0), crane.inertia
    new = part.model_copy(update={"J_m_eff": part.J_m_eff * x, "J_gear": part.J_gear * s, "J_drum": part.J_drum * s})
    return _motors(crane.model_copy(update={"inertia": new}), lambda m: m.model_copy(update={"J": m.J * s}))


def _motors(crane: Crane, change: Callable[[MotorSet], MotorSet]) -> Crane:
    circuits = crane.circuits.items()
    return crane.model_copy(update={name: c.model_copy(update={"motor": change(c.motor)}) for name, c in circuits})


def _friction(crane: Crane, system: Mapping[str, float], loss: Mapping[str, float]) -> Crane:
    """The crane with factors on parameters of its system friction and of its motors' loss."""

    def motor(m: MotorSet) -> MotorSet:
        return m.model_copy(
            update={"loss": m.loss.model_copy(update={n: getattr(m.loss, n) * x for n, x in loss.items()})}
        )

    f = crane.friction
    new = f.system.model_copy(update={n: getattr(f.system, n) * x for n, x in system.items()})
    return _motors(crane.model_copy(update={"friction": f.model_copy(update={"system": new})}), motor)


def _dry(crane: Crane, x: float) -> Crane:
    return _friction(crane, dict.fromkeys(("Y_2", "Y_6"), x), {"X_4": x})


def _breakaway(crane: Crane, x: float) -> Crane:
    return _friction(crane, dict.fromkeys(("Y_1", "Y_3"), x), {})


def _viscous(crane: Crane, x: float) -> Crane:
    return _friction(crane, {"Y_5": x}, {"X_1": x})


def viscous_friction(crane: Crane) -> float:
    """Friction of motors and transmission that goes with the speed, of all motors together [N m s/rad]."""
    return float(sum(m.count * (m.loss.X_1 + crane.friction.system.Y_5) for m in crane.motors))


def _pressure_loss(crane: Crane, x: float) -> Crane:
    return _friction(crane, {}, {"X_3": x, "X_5": x})


def _pump_flow(crane: Crane, x: float) -> Crane:
    pump = crane.active.pump
    return _pump(
        crane,
        {"D": tuple(D * x for D in pump.D), "leak_scale": (1.0 if pump.leak_scale is None else pump.leak_scale) / x},
    )


def _pump(crane: Crane, update: Mapping[str, object]) -> Crane:
    pump = crane.active.pump.model_copy(update=dict(update))
    return crane.model_copy(update={"active": crane.active.model_copy(update={"pump": pump})})


def _servo(crane: Crane, name: str, x: float) -> Crane:
    servo = crane.active.pump.servo
    return _pump(crane, {"servo": servo.model_copy(update={name: getattr(servo, name) * x})})


def _valve(crane: Crane, name: str, x: float) -> Crane:
    valve = getattr(crane.active, name)
    new = valve.model_copy(update={"conductance": valve.conductance * x})
    return crane.model_copy(update={"active": crane.active.model_copy(update={name: new})})


def _bristle(crane: Crane, x: float) -> Crane:
    f = crane.friction
    return crane.model_copy(update={"friction": f.model_copy(update={"sigma_0": f.sigma_0 * x})})


UNKNOWNS = (
    Unknown(C_H, "capacitance of both active lines", _line, math.inf),
    Unknown(C_LEAK, "leakage of the active pumps and motors", _leakage, math.inf),
    Unknown(INERTIA, "inertia at the motor shaft", _inertia, math.inf),
    Unknown(SPEED_LEAKAGE, "rise of leakage with speed, and slip of the electric motors", _speed_leakage, 0.12, 0.01),
    Unknown("dry", "dry friction of motors and transmission", _dry, 1.0),
    Unknown("breakaway", "breakaway friction of the transmission", _breakaway, 1.0),
    Unknown(VISCOUS, "friction that grows with speed", _viscous, 1.0),
    Unknown("pressure_loss", "motor loss that grows with pressure", _pressure_loss, 0.25),
    Unknown("bristle", "stiffness of the winch held by its friction", _bristle, 1.0, 0.01),
    Unknown("pump_flow", "flow of the pumps at a setting", _pump_flow, 0.01, 5e-4),
    Unknown(
        "pump_omega_n",
        "natural frequency of the pumps' displacement control",
        lambda c, x: _servo(c, "omega_n", x),
        0.5,
    ),
    Unknown("pump_zeta", "damping ratio of the pumps' displacement control", lambda c, x: _servo(c, "zeta", x), 0.5),
    Unknown("boost", "conductance of the boost valves", lambda c, x: _valve(c, "boost", x), 0.5, 0.01),
    Unknown("flushing", "conductance of the flushing valve", lambda c, x: _valve(c, "flushing", x), 0.5, 0.01),
)
"""Factors on the crane: first the three that are tuned. Spreads: friction of one crane is known to a factor of e, the
loss with pressure to 25 % (paper D: 10 % in place), the pumps' flow to 1 % (slip of the electric motors and tolerance
of the displacement), the valves of the low side, which a crane file mostly assumes, to a factor of 1.6."""


class Extra(NamedTuple):
    """Effect that the twin does not model and a log shows: value 0 is the unchanged twin. spread: deviation beforehand;
    low, high: bounds; unit in which it is reported, and the unit's value in SI."""

    name: str
    meaning: str
    spread: float
    low: float
    high: float
    unit: str
    scale: float


COMMAND_DELAY, INERTANCE, DROP, P_DELAY, SPEED_DELAY = (
    "command_delay",
    "line_inertance",
    "line_drop",
    "p_delay",
    "omega_delay",
)
OFFSETS = {"p_a": "p_a_offset", "p_b": "p_b_offset"}
"""Signals whose sensor may have a constant error, and the parameter that says which."""
DELAYS = {"p_a": P_DELAY, "p_b": P_DELAY, "omega_m": SPEED_DELAY}
"""Signals whose sensor may be late, and the parameter that says by how much."""
EXTRAS = (
    Extra(COMMAND_DELAY, "dead time of the pumps' control", 0.01, -0.01, 0.04, "ms", 1e-3),
    Extra(INERTANCE, "inertia of the oil in a line, part of J_m_eff", 0.03, 0.0, 0.2, "%", 0.01),
    Extra(DROP, "pressure drop of a line at full pump flow", 2e5, 0.0, 20e5, "bar", 1e5),
    Extra(OFFSETS["p_a"], "offset of p_a", 2e5, -20e5, 20e5, "bar", 1e5),
    Extra(OFFSETS["p_b"], "offset of p_b", 2e5, -20e5, 20e5, "bar", 1e5),
    Extra(P_DELAY, "lateness of the pressures", 0.01, -0.04, 0.04, "ms", 1e-3),
    Extra(SPEED_DELAY, "lateness of omega_m", 0.05, -0.2, 0.2, "ms", 1e-3),
)
"""The pressure transmitters are taken to sit at the motors: what a line's oil takes to be moved is not seen by them,
but swings along."""
VARIES: Mapping[str, float] = {C_LEAK: 0.05, "dry": 0.05, "pump_flow": 1e-3}
"""By how much a parameter may differ from turn to turn, as a deviation: leakage with the temperature of the oil (some 2
K), dry friction with the direction and the state of the flanks, the pumps' flow by a count of the command's 12 bits at
a fifth of their
stroke."""
NAMES = (*(u.name for u in UNKNOWNS), *(e.name for e in EXTRAS))
"""Every parameter of the fit, in its order."""
PLACE = {name: i for i, name in enumerate(NAMES)}


SLIP, SLIP_PRESSURE, SLIP_AT = 0.01, 250e5, 0.35
"""Slip of the electric motors that drive the pumps at full flow and this pressure [-, Pa] (typical of their size), and
pump setting at which it is compared with leakage."""


def centre(crane: Crane, name: str) -> float:
    """What the logarithm of an unknown is beforehand: 0, but for leakage that rises with speed.

    The pumps slow with the power that they give. At a setting a that takes the flow of a conductance of slip a^2 Q / p,
    Q full flow: like leakage that rises with speed, which the twin has.
    """
    if name != SPEED_LEAKAGE:
        return 0.0
    pump, motor = crane.active.pump, crane.active.motor
    Q = pump.D_total * pump.omega_p
    rise = motor.count * motor.C_2 * SLIP_AT * Q / motor.D_total
    return math.log1p(SLIP * SLIP_AT**2 * Q / SLIP_PRESSURE / rise) if rise > 0.0 else 0.0


def bent(crane: Crane, logs: Mapping[str, float]) -> Crane:
    """The crane with the factors exp(logs[name]) of the unknowns."""
    for unknown in UNKNOWNS:
        if logs.get(unknown.name):
            crane = unknown.bend(crane, math.exp(logs[unknown.name]))
    return crane
