"""Ranges within which a crane's signals are, for the guard of a controller, and settings of the checks before it."""

from itertools import pairwise
from typing import Any

from stillhook.control.checks import CheckSettings, Ends, Freeze, Uses, checks_at_start
from stillhook.control.guard import FINITE, GuardSettings, Least, Most, Start, Step, Stops, guard_at_start
from stillhook.control.interface import Sensed
from stillhook.control.plc import MANUAL, Plc
from stillhook.control.registry import CONTROLLERS
from stillhook.engine.pack.winch import drum_record, wire_speed_max
from stillhook.physics.hydraulics.swash import MotorControl
from stillhook.physics.load_path.drum import K_wire, layer_diameter
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.guard import GuardTable, Reaction

T_HOLD, T_BACK, T_RAMP = 0.2, 0.05, 1.0
"""Time for which a bad signal is replaced, for which it must be good again, and in which a full command is taken to
zero [s]. Assumed: a wave of 5 s changes the tip's speed by a quarter in 0.2 s."""
TIP, TIP_SPEED, TIP_ACCELERATION = 50.0, 20.0, 50.0
"""Ends of the motion of a crane's tip [m, m/s, m/s^2]. Assumed: no ship's motion gets there."""
TIP_JERK = 500.0
"""Fastest change of the tip's acceleration [m/s^3]. Assumed: a hundred times that of a wave."""
NOISE = (0.02, 0.2, 1.0)
"""What noise and rounding of the motion unit and the encoder may add between two cycles [m, m/s, m/s^2]. Assumed."""
OVERSPEED = 2.0
"""Fastest motion of a wire over that of a full command [-]: beyond it the encoder is at fault, or the brake has to
close at once. Assumed."""
OVERLOAD = 3.0
"""Largest tension over that of the safe working load [-]; the whole wire may hang from it in addition. Assumed."""
P_MOST = 1.0e8
"""Largest pressure [Pa]: twice what a hydraulic winch is built for. Assumed."""
P_LEAST = -5.0e5
"""Least pressure of a line where signals are checked [Pa]: oil bears no tension; the rest is the transmitter's error.
Assumed."""
RELEASED = 0.02
"""Joystick that counts as released, over its full speed [-]. Assumed."""


HOST_CYCLES = 10.0
"""Cycles of the PLC for which a simulator may hold or extrapolate what it gives. Assumed: 0.1 s at 10 ms."""


def motor_control(params: Any) -> MotorControl:
    """Where the PLC has the motors' displacement from; that of a drive without motors that turn is always known."""
    active = getattr(params, "active", None)
    return MotorControl(offset=0.0, half_width=0.0, feedback=1.0) if active is None else active.control


def guard_settings(crane: Crane, plc: Plc, control: MotorControl, *, hosted: bool = False) -> GuardSettings:
    """The guard's settings for a crane: ranges out of its drum, wire, load and speeds.

    Parameters: plc, control as of its packed parameters; hosted: the inputs come from a simulator, whose steps may be
    several cycles: they may jump by as many steps at once.
    """
    t, drum = plc.t_cycle, drum_record(crane)
    v_full = wire_speed_max(crane)
    v_most = v_full / max(plc.motors.alpha_min, 0.01)
    omega_most = OVERSPEED * v_most * 2.0 * crane.i_hD / drum.d
    wire = 1.05 * drum.L_full + 10.0
    weight = OVERLOAD / plc.motors.i_F_swl + drum.L_full * drum.m_wire * G
    layers = [K_wire(layer_diameter(float(n), drum), drum) for n in range(1, round(drum.layers) + 1)]
    inner = max([layers[0], *layers])
    apart = max([abs(a - b) for a, b in pairwise(layers)], default=0.0)
    measured = control.feedback > 0.5
    limited = plc.power.P_max < plc.power.Q_p * P_MOST
    cycles = HOST_CYCLES if hosted else 1.0
    T = cycles * t
    p_least = -P_MOST if crane.control.guard is None else P_LEAST
    rows = {  # least, most, step, start, stops
        "s_tip": (-TIP, TIP, TIP_SPEED * T + NOISE[0], 0.0, 1.0),
        "v_tip": (-TIP_SPEED, TIP_SPEED, TIP_ACCELERATION * T + NOISE[1], 0.0, 1.0),
        "a_tip": (-TIP_ACCELERATION, TIP_ACCELERATION, TIP_JERK * T + NOISE[2], 0.0, 1.0),
        "v_op": (-1.2 * v_most, 1.2 * v_most, FINITE, 0.0, 0.0),
        "s_op": (-wire, wire, 2.4 * v_most * T, 0.0, 1.0),
        "mode": (-0.5, max(law.code for law in CONTROLLERS.values()) + 0.5, FINITE, MANUAL, 1.0),
        "f_pump": (0.01, 1.0 + 1e-9, FINITE, 1.0, 1.0),
        "s_w": (-wire, wire, OVERSPEED * v_most * T + NOISE[0], 0.0, 1.0),
        "F": (-0.1 * weight, weight, 0.5 * weight, 1.0 / plc.motors.i_F_swl, 0.0),
        "alpha_m": (-0.1, 1.1, 50.0 * T if measured else FINITE, 1.0, float(measured)),
        "K_wire": (0.5, 1.5 * inner, cycles * max(1.5 * apart, 0.05), 1.0, 1.0),
        "dp": (-P_MOST, P_MOST, P_MOST, 0.0, float(limited)),
        "dp_load": (-P_MOST, P_MOST, P_MOST, 0.0, 0.0),
        **dict.fromkeys(("p_hp", "p_a", "p_b"), (p_least, P_MOST, P_MOST, 0.0, 0.0)),
        "omega_m": (-omega_most, omega_most, omega_most, 0.0, 0.0),
    }
    kinds: Any = (Least, Most, Step, Start, Stops)
    least, most, step, start, stops = (kind(**{n: row[i] for n, row in rows.items()}) for i, kind in enumerate(kinds))
    if crane.control.guard is not None:
        stops = stops._replace(**having(crane.control.guard, Reaction.STOP))
    return GuardSettings(
        least=least,
        most=most,
        step=step,
        stops=stops,
        start=start,
        t_hold=T_HOLD,
        t_back=T_BACK,
        t_ramp=T_RAMP,
        v_full=v_most,
        v_zero=RELEASED * v_full,
    )


def time_to_stop(s: GuardSettings, plc: Plc) -> float:
    """Longest time from the first cycle of a bad signal to pumps at zero and a closed brake [s]: the hold, the ramp,
    the brake's wait and its travel, and a cycle for each of the four."""
    brake = plc.brake.t_wait + plc.brake.t_close if plc.brake.fitted > 0.5 else 0.0
    return s.t_hold + s.t_ramp + brake + 4.0 * plc.t_cycle


def having(table: GuardTable, reaction: Reaction) -> dict[str, float]:
    """1 for every input with this reaction, 0 for the others that the checks know."""
    of = {"s_w": table.on_encoder, "omega_m": Reaction.ALARM, "F": table.on_load, "alpha_m": table.on_swivel}
    of |= dict.fromkeys(("s_tip", "v_tip", "a_tip"), table.on_motion)
    of |= dict.fromkeys(("p_a", "p_b", "dp", "p_hp"), table.on_pressure)
    return {name: float(r is reaction) for name, r in of.items()}


MOVING = 0.05
"""Wire speed above which a signal must change, over that of a full command [-]. Assumed."""


def check_settings(crane: Crane, plc: Plc, control: MotorControl) -> CheckSettings | None:
    """Settings of the checks for a crane; None where its file has no [control.guard]. A comparison that its winch type
    has no signals for is off."""
    table = crane.control.guard
    if table is None:
        return None
    signals = {row.name for row in crane.plant.type.rows}
    lines = [name for name in ("p_a", "p_b") if name in signals]
    of_gas = ["p_hp"] if crane.plant.type.charge(crane) > 0.0 else []
    frozen = ["s_w", "F", *lines, *(["dp"] if lines else []), *of_gas]

    servo = crane.active.motor.servo if crane.circuits else None

    def each(kind: Any, values: dict[str, float], otherwise: float = 0.0) -> Any:
        return kind._make([values.get(name, otherwise) for name in Sensed._fields])

    return CheckSettings(
        wire=table.wire if turns_with_the_wire(crane) else FINITE,
        position=table.position,
        speed=table.speed,
        load=table.load / plc.motors.i_F_swl,
        swivel=table.swivel if control.feedback > 0.5 and crane.circuits else FINITE,
        t_memory=table.t_memory,
        t_load=table.t_load,
        tau_swivel=1.0 / servo.omega_n + (servo.dead_time or 0.0) if servo else 0.0,
        t_confirm=table.t_confirm,
        t_clear=table.t_clear,
        v_moving=MOVING * wire_speed_max(crane),
        freeze=each(Freeze, dict.fromkeys(frozen, table.t_freeze), FINITE),
        uses=each(Uses, having(table, Reaction.ALARM)),
        ends=each(Ends, having(table, Reaction.MANUAL)),
        open_loop=float(table.on_swivel is Reaction.OPEN_LOOP),
    )


def turns_with_the_wire(crane: Crane) -> bool:
    """Whether the motor speed is that of the drum which the wire leaves; not so where a cylinder moves it."""
    return bool(crane.motors)


def guard_in(crane: Crane, params: Any) -> dict[str, Any]:
    """Guard and checks of a crane in a simulation, by the names under which controllers carry them; none without a
    table [control.guard]. params: its packed parameters."""
    control = motor_control(params)
    checks = check_settings(crane, params.plc, control)
    if checks is None:
        return {}
    return {"guard": guard_at_start(guard_settings(crane, params.plc, control)), "checks": checks_at_start(checks)}
