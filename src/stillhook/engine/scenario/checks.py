"""What can be said before a run: refusals (ScenarioError) and limits that the run will meet (notes)."""

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

from stillhook.control.commands import marginal_gain
from stillhook.engine.certificate import standing
from stillhook.engine.inputs import CycleInputs, MotionDemand
from stillhook.engine.pack.capacity import wire_weight
from stillhook.engine.pack.winch import (
    drum_record,
    friction_record,
    gains,
    load_record,
    loop_record,
    motor_law,
    motor_speed_max,
    parts_of,
    plc_record,
    power_most,
    torque_limit,
    wire_speed_max,
)
from stillhook.engine.pack.winch import layer_diameter_at as layer_diameter_at
from stillhook.engine.scenario.followed_law import LEAST_GAIN, FollowedLaw, standing_error
from stillhook.errors import ScenarioError
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor_laws import motor_loss
from stillhook.physics.load_path.drum import LAST_TURNS, WIRE_SLACK, wire_usable
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import LONGEST, Mode, Scenario
from stillhook.units import show
from stillhook.winches.circuits.losses import loss_fit
from stillhook.winches.circuits.tables import MotorSet


class Foreseen(NamedTuple):
    """What a run will meet: notes, one line each, worst first; unstable: the position loop is beyond its gain of
    marginal stability of the published loop; validated: the crane's certificate holds, and the run is inside its
    envelope; wire: largest weight of the wire that is out, in air, which the run leaves out [N]; F_rest: what hangs at
    the crane tip at rest with that wire [N]."""

    notes: tuple[str, ...]
    unstable: bool
    validated: bool
    wire: float
    F_rest: float


def check(crane: Crane, case: Scenario) -> None:
    """Refuse what no crane of this kind can do. Errors: ScenarioError, SpecError of an unknown winch type, one
    line."""
    _check_numbers(case)
    for mode in (case.mode, *(mode for _, mode in case.modes)):
        if reason := crane.plant.type.mode_refusal(mode):
            raise ScenarioError(f"mode: {reason}")
    _check_load(crane, case)
    _check_times(crane, case)
    _check_held(crane, case)
    if reason := crane.plant.type.refusal(crane, case):
        raise ScenarioError(reason)
    wire = wire_usable(drum_record(crane))
    if case.s_w > wire:
        raise ScenarioError(
            f's_w {show(case.s_w, "length")} is more than the {show(wire, "length")} of wire that "{crane.name}" can'
            f" pay out (drum full, {LAST_TURNS:.0f} turns kept). Lower s_w or choose another crane."
        )
    loss, units = case.power_loss, len(crane.plant.type.pump_units(crane)[0])
    if loss is not None and units == 0:
        raise ScenarioError(f'power_loss: "{crane.name}" has no hydraulic power units. Leave it out.')
    if loss is not None and units == 1:
        raise ScenarioError(
            f'power_loss: "{crane.name}" has a single hydraulic power unit; nothing would be left to hold the load.'
        )
    if loss is not None and loss.unit > units:
        raise ScenarioError(
            f'power_loss.unit {loss.unit}: "{crane.name}" has {units} hydraulic power units. Give 1 to {units}.'
        )


def _check_numbers(case: Scenario) -> None:
    """For scenarios that were not read from text: a copy with changed fields, or one out of a stored run."""
    for name, highest in (
        ("load", math.inf),
        ("s_w", math.inf),
        ("duration", LONGEST),
        ("ramp", math.inf),
        ("warm_up", math.inf),
    ):
        value = getattr(case, name)
        if not (isinstance(value, int | float) and 0.0 <= value <= highest):
            raise ScenarioError(
                f"{name} = {value!r}: not a number of 0 or more in SI. Build the scenario from texts with units."
            )


def _check_load(crane: Crane, case: Scenario) -> None:
    if case.load > crane.SWL:
        raise ScenarioError(
            f'Load {show(case.load, "mass")} exceeds the SWL {show(crane.SWL, "mass")} of "{crane.name}" '
            f"({100.0 * case.load / crane.SWL:.5g} %). Lower the load or choose another crane."
        )
    if case.load + crane.hook_mass <= 0.0:
        raise ScenarioError(
            f'Nothing is suspended from the wire: load 0 t, and "{crane.name}" has a hook_mass of 0 t. Give one.'
        )
    if case.water is not None and case.weight <= 0.0:
        raise ScenarioError(
            f"The payload floats: {show(case.load, 'mass')} in air displaces {case.water.volume:g} m^3 of water. "
            "Lower water.volume or raise the load."
        )


def _check_times(crane: Crane, case: Scenario) -> None:
    """The counted part of a run holds at least one PLC cycle."""
    t_cycle = crane.control.t_cycle
    n = math.floor(case.duration / t_cycle + 1e-9)
    if round(case.warm_up / t_cycle) >= n:
        raise ScenarioError(
            f"warm_up {case.warm_up:g} s leaves no whole PLC cycle of {show(t_cycle, 'time')} of the duration"
            f" {case.duration:g} s. Shorten warm_up or run longer."
        )


def _check_held(crane: Crane, case: Scenario) -> None:
    """A displacement that the operator holds is one that the motors have, in a run that is manual at some time."""
    alpha, least = case.operator.alpha_m, crane.plant.type.least_displacement(crane)
    if alpha is None:
        return
    if least >= 1.0 and alpha != 1.0:
        raise ScenarioError(
            f'operator.alpha_m = {alpha:g}: winch type "{crane.plant}" has no motors whose displacement an operator'
            " sets. Leave it out."
        )
    if not least <= alpha <= 1.0:
        raise ScenarioError(
            f'operator.alpha_m = {alpha:g}: the motors of "{crane.name}" go from {least:g} to 1 of their displacement. '
            "Give a value in between, or a crane with a smaller active.motor.alpha_min."
        )
    if all(m.compensates for m in (case.mode, *(m for _, m in case.modes))):
        raise ScenarioError(
            f"operator.alpha_m = {alpha:g}: held in manual mode only, and this run is in {case.mode.value}. "
            'Set mode = "manual", or leave it out.'
        )


def foresee(crane: Crane, case: Scenario) -> Foreseen:
    """Limits that this run will meet. The scenario must have passed `check`."""
    drive = CycleInputs(crane, case)
    demand = drive.demand()
    stands = standing(crane, case, drive, demand)
    d = layer_diameter_at(crane, case.s_w)
    K_wire = crane.drum.d_max / d
    gain = _gain_notes(crane, case, demand.v_max, K_wire)
    notes = [
        *_speed_notes(crane, case, demand.v_max, d),
        *_wire_notes(crane, demand),
        *_weight_notes(crane, case),
        *gain,
        *type_notes(crane, HeldLoad.of(crane, case, demand.s_tip_pp)),
        *_friction_notes(crane, case, d),
        *loss_notes(case_friction(crane, case, demand)),
        *_event_notes(case),
        *stands.notes,
    ]
    wire = wire_weight(crane, max(case.s_w, demand.s_w_max))
    F_rest = load_record(crane, case).W + wire
    return Foreseen(tuple(notes), bool(gain), stands.validated, wire, F_rest)


T_D_BEYOND = 0.1
"""Part by which a drum torque may lie beyond those at which friction was identified before a word is said."""


def _friction_notes(crane: Crane, case: Scenario, d: float) -> list[str]:
    lo, hi = crane.friction.T_d_min, crane.friction.T_d_max
    T_d = load_record(crane, case).W * 0.5 * d
    if lo is None or hi is None or (1.0 - T_D_BEYOND) * lo <= T_d <= (1.0 + T_D_BEYOND) * hi:
        return []
    identified = f"{show(lo, 'drum_torque', 3)} to {show(hi, 'drum_torque', 3)}"
    return [
        f"drum torque {show(T_d, 'drum_torque', 3)}: system friction was identified from {identified} only, so here it"
        " is an extrapolation"
    ]


LOSS_BEYOND = 0.1
"""Part by which motors may work beyond the range in which their loss was fitted before a word is said."""
CONSIDERABLE = 0.2
"""Part of a winch's friction from which it matters how well the loss of one set of motors is known."""


class FrictionPart(NamedTuple):
    """Loss of one set of motors at a working point: name of its circuit; T_f loss of the set, total friction of the
    whole winch [N m], both at the motor shaft; alpha displacement [-]; beyond where the point is outside the fit, in
    words, "" where it is inside.
    """

    circuit: str
    T_f: float
    total: float
    alpha: float
    beyond: str


def friction_parts(crane: Crane, W: float, d: float, v: float, alpha: float) -> list[FrictionPart]:
    """Where the friction of the winch comes from at wire speed v [m/s] with weight W [N] on diameter d [m], active
    motors at alpha.

    The passive motors carry the weight at mid stroke, the active motors the rest, which is nothing at a steady speed
    but for friction and is left out of the pressure of an active/passive winch.
    """
    r_eff = 0.5 * d / crane.i_hD
    omega = min(v / r_eff, motor_speed_max(crane, alpha))
    if crane.circuits == {}:
        return []
    active, others = crane.active.motor, crane.plant.type.other_motors(crane, W, d)
    dp = 0.0 if others else W * r_eff / (active.D_total * alpha)
    sets = [("active", active, alpha, dp)]
    sets += [(o.name, o.motor, min(max(o.alpha, o.motor.alpha_min), 1.0), o.dp) for o in others]
    losses = [m.count * motor_loss(omega, a * m.D_max, dp, loss_fit(m)) for _, m, a, dp in sets]
    system = sum(m.count for _, m, _, _ in sets) * system_friction(
        omega, W * 0.5 * d, friction_record(crane.friction.system)
    )
    total = sum(losses) + system
    parts = zip(sets, losses, strict=True)
    return [
        FrictionPart(circuit=name, T_f=T_f, total=total, alpha=a, beyond=_beyond_fit(m, omega, a, dp))
        for (name, m, a, dp), T_f in parts
    ]


def case_friction(crane: Crane, case: Scenario, demand: MotionDemand | None = None) -> list[FrictionPart]:
    """`friction_parts` at the highest speed that tip and operator require, with the smallest displacement that the
    first mode takes."""
    v = (CycleInputs(crane, case).demand() if demand is None else demand).v_max
    d = layer_diameter_at(crane, case.s_w)
    K_wire = crane.drum.d_max / d
    alpha = min(alpha_wanted(crane, case, K_wire, u_ff) for u_ff in (0.0, min(gains(crane).K_1 * v * K_wire, 1.0)))
    return friction_parts(crane, load_record(crane, case).W, d, v, alpha)


def _beyond_fit(motor: MotorSet, omega_m: float, alpha: float, dp_m: float) -> str:
    """How a working point exceeds the range in which a motor's loss was fitted, in words.

    Low speed and low pressure are none of these: every reversal passes through them, and what the motors lose there was
    part of the tests from which system friction was identified.
    """
    out = []
    if motor.D_loss_min is not None and alpha * motor.D_max < (1.0 - LOSS_BEYOND) * motor.D_loss_min:
        least = motor.D_loss_min / motor.D_max
        out.append(f"{100.0 * alpha:.2g} % of their displacement, which were fitted from {100.0 * least:.0f} % up")
    most = motor.D_max if motor.loss_model is None or motor.loss_model.D_m is None else motor.loss_model.D_m[-1]
    if alpha * motor.D_max > (1.0 + LOSS_BEYOND) * most:
        largest = 100.0 * most / motor.D_max
        out.append(f"{100.0 * alpha:.0f} % of their displacement, which were measured up to {largest:.0f} %")
    if motor.n_loss_max is not None and omega_m > (1.0 + LOSS_BEYOND) * motor.n_loss_max:
        out.append(f"{show(omega_m, 'rotation', 3)}, which were fitted up to {show(motor.n_loss_max, 'rotation')}")
    if motor.dp_loss_max is not None and abs(dp_m) > (1.0 + LOSS_BEYOND) * motor.dp_loss_max:
        out.append(f"{show(abs(dp_m), 'pressure', 3)}, which were fitted up to {show(motor.dp_loss_max, 'pressure')}")
    return ", and at ".join(out)


def loss_notes(parts: Sequence[FrictionPart]) -> list[str]:
    """A note for each set of motors that works outside its fit with a considerable part of the friction."""
    return [
        f"{p.T_f:.0f} of {p.total:.0f} N m of friction at the highest speed are losses of the {p.circuit} motors at"
        f" {p.beyond}: an extrapolation"
        for p in parts
        if p.beyond and p.T_f > CONSIDERABLE * p.total
    ]


def _speed_notes(crane: Crane, case: Scenario, v: float, d: float) -> list[str]:
    """v highest wire speed that is demanded [m/s]; d diameter in use [m]."""
    alpha, out = alpha_wanted(crane, case, crane.drum.d_max / d, 1.0), []
    v_max = wire_speed_max(crane, alpha, d)
    if v > v_max:
        speed = "speed of tip and operator" if case.operator.profile else "tip speed"
        out.append(
            f"{speed} {show(v, 'speed')} is above the {show(v_max, 'speed')} that {case.mode.value} reaches at this"
            f" load and layer{_saturates(crane, alpha)}"
        )
    limit = min(_speed_limits(crane, case, d, alpha), default=math.inf)
    omega = min(v / (0.5 * d / crane.i_hD), motor_speed_max(crane, alpha))
    if omega > limit:
        out.append(
            f"motors would turn {show(omega, 'rotation')}, above their limit {show(limit, 'rotation')} at this load"
        )
    return out


def _saturates(crane: Crane, alpha: float) -> str:
    """What a speed beyond the winch's means for its drive."""
    if not crane.circuits:
        return ": the drive's command will saturate"
    return f" (motors at {alpha:.2f}): the pumps will saturate"


def _speed_limits(crane: Crane, case: Scenario, d: float, alpha: float) -> list[float]:
    """Speed limits of the gears and of the sets of motors of closed circuits [rad/s]: active ones at alpha, others at
    the displacement that holds the load."""
    if crane.circuits == {}:
        return []
    others = crane.plant.type.other_motors(crane, load_record(crane, case).W, d)
    motors = [crane.active.motor.speed_limit(alpha), *(o.motor.speed_limit(min(o.alpha, 1.0)) for o in others)]
    return motors if crane.n_gear is None else [*motors, crane.n_gear]


def alpha_wanted(crane: Crane, case: Scenario, K_wire: float, u_ff: float, mode: Mode | None = None) -> float:
    """Displacement that the PLC requires in a mode (default the scenario's first) at this load [-]; u_ff 0 at rest, 1
    at full speed."""
    F = load_record(crane, case).W
    return motor_law(crane, mode or case.mode, F, K_wire, plc=plc_record(crane, case.operator))(u_ff)


def _wire_notes(crane: Crane, demand: MotionDemand) -> list[str]:
    wire = wire_usable(drum_record(crane))
    if demand.s_w_min >= -WIRE_SLACK and demand.s_w_max <= wire:
        return []
    return [
        f"tip and operator require {show(demand.s_w_min, 'length')} to {show(demand.s_w_max, 'length')} of wire out,"
        f" and there are 0 m (hook at the crane tip) to {show(wire, 'length')} ({LAST_TURNS:.0f} turns kept)"
    ]


WIRE_SHARE = 0.05
"""Part of the hook load from which the weight of the wire that is out gets a word: as large as what a load is weighed
to."""


def _weight_notes(crane: Crane, case: Scenario) -> list[str]:
    """The wire of a Scenario has stiffness and damping, and no weight: tension and pressures are without it, the
    judgement of the capacity has it."""
    m, load = wire_weight(crane, case.s_w) / G, load_record(crane, case).W / G
    if m <= WIRE_SHARE * load:
        return []
    return [
        f"the wire of {show(case.s_w, 'length')} weighs {show(m, 'mass', 3)} in air, {m / load:.0%} of the hook load,"
        " and is left out of tension and pressures; stillhook lower has it"
    ]


def _gain_notes(crane: Crane, case: Scenario, v: float, K_wire: float) -> list[str]:
    """Is K_p above the gain of marginal stability of the published loop, at the smallest displacement that a mode of
    this run takes?

    No margin: slow and loaded the complete plant oscillates at less (`stillhook.analysis.loop_stability.governing`,
    whose answer the note names), and the run shows it.
    """
    modes = {m for m in (case.mode, *(m for _, m in case.modes)) if m.compensates}
    if not modes or not crane.circuits:
        return []
    u_ff = min(gains(crane).K_1 * v * K_wire, 1.0)

    def over_limit(mode: Mode) -> tuple[float, float]:
        """Gain with which the mode feeds back at its smallest displacement, over the limit there; the displacement."""
        alpha = alpha_wanted(crane, case, K_wire, u_ff, mode)
        law = FollowedLaw(crane, mode.law, load_record(crane, case).W, K_wire=K_wire, alpha_m=alpha)
        return law.feedback_share * crane.control.K_p / marginal_gain(loop_record(crane, alpha, K_wire))[0], alpha

    most, alpha = max(map(over_limit, modes))
    if most <= 1.0:
        return []
    K_p, omega = crane.control.K_p, marginal_gain(loop_record(crane, alpha, K_wire))[1]
    limit = show(K_p / most, "gain_per_length")
    return [
        f"K_p {show(K_p, 'gain_per_length')} is above the {limit} at which the position loop"
        f" is marginally stable (published loop, motors at {alpha:.2f}): expect oscillation at {omega:.3g} rad/s"
        "; the margin of the complete plant on its own wire is that of stillhook stability"
    ]


def _event_notes(case: Scenario) -> list[str]:
    """Events that the run is too short for."""
    events = [("change of mode", t) for t, _ in case.modes] + [("set-point step", t) for t, _ in case.operator.steps]
    if case.power_loss is not None:
        events.append(("loss of a hydraulic power unit", case.power_loss.time))
    return [
        f"the {name} at {t:g} s comes after the end of the run at {case.duration:g} s"
        for name, t in events
        if t > case.duration
    ]


WORKED_OFF = 0.01
"""Part of the error of a proportional law below which a controller has worked it off [-]."""


class HeldLoad(NamedTuple):
    """What a winch holds and how: weight W [N], diameter of the layer in use d [m], displacement of the active motors
    alpha [-], peak-to-peak motion of the tip to compensate s_tip_pp [m], gas pressure held; manual at some time,
    compensating at some time, and with which controllers where they are known.
    """

    W: float
    d: float
    alpha: float
    s_tip_pp: float
    gas_held: bool
    manual: bool
    compensates: bool
    modes: tuple[Mode, ...] = ()

    @classmethod
    def of(cls, crane: Crane, case: Scenario, s_tip_pp: float) -> Self:
        """A scenario's."""
        d = layer_diameter_at(crane, case.s_w)
        modes = tuple(m for m in (case.mode, *(m for _, m in case.modes)) if m.compensates)
        alpha = alpha_wanted(crane, case, crane.drum.d_max / d, 0.0)
        return cls(load_record(crane, case).W, d, alpha, s_tip_pp, case.gas_held, not modes, bool(modes), modes)

    def standing_errors(self, crane: Crane, u: float) -> dict[str, float]:
        """Control error that stays while the pumps hold a command u [-] against leakage, by the controller under which
        it does [m]; the largest of proportional ones as "P control", none where a law works it off."""
        most, out = u / max(crane.control.K_p, LEAST_GAIN), dict[str, float]()
        at = {"F": self.W, "K_wire": crane.drum.d_max / self.d, "alpha_m": self.alpha}
        for mode in self.modes:
            if FollowedLaw(crane, mode.law, **at).is_proportional(u):
                out["P control"] = most
                continue
            left = standing_error(crane, mode.law, u, wire_speed_max(crane, self.alpha, self.d), **at)
            if left > WORKED_OFF * most:
                out[mode.value] = left
        return out if self.modes else {"P control": most}


def type_notes(crane: Crane, held: HeldLoad) -> list[str]:
    """What the crane's winch type means for a weight and a motion, in lines; every answer of runs carries them."""
    lines: list[str] = crane.plant.type.notes(crane, held, parts_of())
    if (T := torque_limit(crane)) is not None:
        torque, power = show(T, "torque"), show(power_most(crane), "power")
        lines = [*lines, f"the limit power is the torque of the power units, {torque} at the pumps' speed: {power}"]
    return lines


def notes_of(cranes: Sequence[Crane], cases: Sequence[Scenario]) -> list[str]:
    """Those of many runs in few lines: the heaviest run of each mode, and of several such the one with most motion."""
    worst: dict[Mode, tuple[tuple[float, float], Crane, Scenario]] = {}
    for crane, case in zip(cranes, cases, strict=True):
        if case.mode not in worst or case.load >= worst[case.mode][0][0]:
            rank = (case.load, CycleInputs(crane, case).demand().s_tip_pp)
            if case.mode not in worst or rank > worst[case.mode][0]:
                worst[case.mode] = (rank, crane, case)
    lines: dict[str, list[str]] = {}
    for mode, ((load, s_tip_pp), crane, case) in worst.items():
        for note in type_notes(crane, HeldLoad.of(crane, case, s_tip_pp)):
            lines.setdefault(f"with {show(load, 'mass', 4)}: {note}", []).append(mode.value)
    return [f"{', '.join(modes)} {line}" for line, modes in lines.items()]
