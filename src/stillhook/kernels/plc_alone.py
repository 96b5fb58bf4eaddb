"""The PLC alone, without a winch behind it: cycle after cycle over inputs that are given, such as those of a log."""

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.guard import Guard
from stillhook.control.interface import DISPLACEMENT, Sensed
from stillhook.control.plc import ActuatorCommands, Memory, Plc, ahead, foreseen, memory_before
from stillhook.control.registry import mode_of_code
from stillhook.kernels.build import compiled
from stillhook.kernels.control_laws import ControlLaws, control_laws, extra_controllers, label
from stillhook.kernels.lanes import Array, access, flatten, size, unflatten
from stillhook.physics.hydraulics.swash import MotorControl, known_displacement
from stillhook.physics.records import record, replace
from stillhook.physics.scalar import scalar


class Commands(NamedTuple):
    """What the PLC commands in every cycle, each (n,): u_p pumps and u_m motors [-], u_ff the feedforward in u_p, u_raw
    pumps before the limit, e_c control error against the tip that it reads [m]; s_tip [m], v_tip [m/s],
    a_tip [m/s^2] the tip's motion that it goes by, extrapolated or predicted."""

    u_p: FloatArray
    u_m: FloatArray
    u_ff: FloatArray
    u_raw: FloatArray
    e_c: FloatArray
    s_tip: FloatArray
    v_tip: FloatArray
    a_tip: FloatArray


NO_LIMIT = 1e30
"""Power of the pumps that limits nothing [W]."""
AJAR = 1e-9
"""Share by which a brake is closed that may be so by the log: the next cycle without that mark finds it open [-]."""

going_on = replace(Memory, "u_p", "b_p", "brake")


class PlcInputs(NamedTuple):
    """What the PLC reads in every cycle, each (n,): fields of `Sensed`, without p_hp, which serves the passive circuit;
    dp and dp_load serve controllers that read pressures.

    braked: 1 where the holding brake may not be open; u_braked: the pump command of those cycles, which follows from
    pressures [-].
    """

    s_tip: FloatArray
    v_tip: FloatArray
    a_tip: FloatArray
    v_op: FloatArray
    s_op: FloatArray
    mode: FloatArray
    f_pump: FloatArray
    s_w: FloatArray
    F: FloatArray
    alpha_m: FloatArray
    K_wire: FloatArray
    omega_m: FloatArray
    p_a: FloatArray
    p_b: FloatArray
    dp: FloatArray
    dp_load: FloatArray
    braked: FloatArray
    u_braked: FloatArray


def plc_alone(
    seen: PlcInputs,
    p_hp: FloatArray,
    memory: Memory,
    plc: Plc,
    control: MotorControl,
    settings: Mapping[str, Any],
    laws: Any = None,
) -> tuple[Commands, Memory, Any]:
    """Commands of the PLC over what it reads, cycle by cycle, its memory after the last one, and what its controllers
    carry then.

    Parameters: seen, one value a cycle; p_hp (n,) accumulator pressure [Pa]; memory before the first cycle; control:
    where the motors' displacement is not measured, the PLC calculates with its own last command in place of
    seen.alpha_m; settings those of controllers that have some of their own, by name; laws what the controllers carry
    before the first cycle, default nothing.

    The holding brake and the pumps' torque limit are left out: a log need not have the pressures for them. Where
    seen.braked marks a brake, the pump command is taken as it is and the PLC goes on from it without a jump, as it does
    when a brake opens.
    Source: Moslatt 2020 paper F, verification step 2 ("controller inputs from measured data").
    """
    plc = plc._replace(brake=plc.brake._replace(fitted=0.0), power=plc.power._replace(P_max=NO_LIMIT))
    columns = PlcInputs(*(np.asarray(x, dtype=np.float64) for x in seen))
    commands = np.empty((len(p_hp), len(Commands._fields)))
    used = extra_controllers(mode_of_code(code) for code in np.unique(columns.mode))
    bound = kernel(used, predicts="prediction" in settings)
    laws = bound.laws.blank(dict(settings)) if laws is None else laws
    lane = np.array(flatten(bound.Lane(memory, laws, plc, control)))
    rows = np.column_stack([*columns, p_hp])
    bound.run(lane, rows.reshape(-1), commands.reshape(-1), len(rows))
    after = unflatten(bound.Lane, iter(lane.tolist()))
    return Commands(*commands.T), after.m, after.laws


Row: Any = NamedTuple("Row", [(f, float) for f in (*PlcInputs._fields, "p_hp")])  # type: ignore[misc]
"""One cycle of what the PLC reads."""
ROW, COMMANDS = size(Row), len(Commands._fields)
row_at = access(Row, 1).load
sensed_at, with_displacement = access(Sensed, 1).load, replace(Sensed, "alpha_m")
put_commands = access(ActuatorCommands, 1).store


class Kernel(NamedTuple):
    """The PLC with some controllers: Lane, the record of what it carries; run, compiled: `_cycles` (None for a drive by
    speed), or `_guarded_cycles`; begin and once, the memory before the first cycle and one cycle, on all that it
    reads."""

    laws: ControlLaws
    Lane: Any
    run: Any
    begin: Any
    once: Any


class Outside(NamedTuple):
    """A cycle of a guarded PLC: what it reads, the quality of each input, 1 good or 0 bad, and the reset, 0 or 1."""

    y: Sensed
    quality: Sensed
    reset: float


GUARD_OUTPUTS = ("alarm", "cause", "state")


def _guarded_commands() -> Any:
    fields = [(f, float) for f in (*ActuatorCommands._fields, *GUARD_OUTPUTS)]
    return NamedTuple("GuardedCommands", fields)  # type: ignore[misc]


GuardedCommands = _guarded_commands()
"""What a guarded PLC commands, and its alarm: codes of what is bad now and of what the winch was stopped for, and the
state of the guard, see `stillhook.control.guard`."""

OUTSIDE, GUARDED = size(Outside), size(GuardedCommands)
outside_at, AT_ALARM = access(Outside, 1).load, size(ActuatorCommands)
with_quality = replace(Guard, "quality", "reset")


@functools.cache
def kernel(
    names: tuple[str, ...],
    drive: str = DISPLACEMENT,
    guarded: bool = False,
    checks: bool = False,
    predicts: bool = False,
) -> Kernel:
    """Cycles with these controllers in addition to those of every kernel of this kind of drive; guarded: for inputs
    from outside, see `stillhook.control.guard`; with the checks before it, see `stillhook.control.checks`; predicts as
    `control_laws` has it."""
    laws = control_laws(names, drive, guarded, checks=checks, predicts=predicts)
    of = f"{__name__} {laws.Record.__module__}"
    Lane = record("Lane", of, m=Memory, laws=laws.Record, plc=Plc, control=MotorControl)
    load, put = access(Lane, 1).load, access(Lane, 1).store
    plc_check, plc_cycle = laws.check, laws.cycle

    def begin(A: Array, S: Array):
        """The memory of a lane before its first cycle, on a `Sensed` in S."""
        a = load(A, 0)
        y, m, _ = plc_check(sensed_at(S, 0), a.m, a.laws, a.plc)
        m = memory_before(m, y.F, y.s_w, y.s_tip, y.mode, y.v_op, a.plc)
        put(A, 0, Lane(m, a.laws, a.plc, a.control))

    def once(A: Array, S: Array, out: Array):
        """One cycle of a lane on a `Sensed` in S; out its `ActuatorCommands`. The motors' displacement is what is
        measured; where it is not, the PLC goes by its own command."""
        a = load(A, 0)
        seen, m, laws = plc_check(sensed_at(S, 0), a.m, a.laws, a.plc)
        seen = with_displacement(seen, known_displacement(seen.alpha_m, m.u_m, a.control))
        drive, m, laws = plc_cycle(seen, m, laws, a.plc)
        put(A, 0, Lane(m, laws, a.plc, a.control))
        put_commands(out, 0, drive)

    if guarded:
        run = compiled(
            _guarded_cycles(laws, Lane),
            f"plc-{'predicts-' * predicts}{'checked-' * checks}guarded-{drive}{label(names)}",
        )
    else:
        run = (
            compiled(
                _cycles(laws, Lane, _predicted if predicts else _extrapolated),
                f"plc{'-predicts' * predicts}{label(names)}",
            )
            if drive == DISPLACEMENT
            else None
        )
    return Kernel(laws, Lane, run, begin, once)


@scalar
def _extrapolated(y, laws, plc):
    """The tip's motion that a cycle on y goes by."""
    return ahead(y, plc.t_lead, plc.t_lead_ff)


@scalar
def _predicted(y, laws, plc):
    """The same of a PLC that predicts, after the cycle."""
    motion, _ = foreseen(y, laws.prediction_memory, laws.prediction_settings, plc)
    return motion


def _cycles(laws_of: ControlLaws, Lane: Any, later: Any) -> Any:
    """The cycles of a PLC over what was recorded; later as `_extrapolated`."""
    load, put, plc_cycle = access(Lane, 1).load, access(Lane, 1).store, laws_of.cycle

    def cycles(A: Array, S: Array, out: Array, n: int):
        """A lane, whose memory goes on; S rows of what the PLC reads; out rows of commands, n each."""
        a = load(A, 0)
        m, laws, plc, control = a.m, a.laws, a.plc, a.control
        for k in range(n):
            seen, following = row_at(S, k * ROW), row_at(S, min(k + 1, n - 1) * ROW)
            y = Sensed(
                s_tip=seen.s_tip,
                v_tip=seen.v_tip,
                a_tip=seen.a_tip,
                v_op=seen.v_op,
                s_op=seen.s_op,
                mode=seen.mode,
                f_pump=seen.f_pump,
                s_w=seen.s_w,
                F=seen.F,
                alpha_m=known_displacement(seen.alpha_m, m.u_m, control),
                K_wire=seen.K_wire,
                dp=seen.dp,
                dp_load=seen.dp_load,
                p_hp=seen.p_hp,
                omega_m=seen.omega_m,
                p_a=seen.p_a,
                p_b=seen.p_b,
            )
            drive, m, laws = plc_cycle(y, m, laws, plc)
            motion = later(y, laws, plc)
            braked = seen.braked > 0.0
            if braked:
                m = going_on(m, following.u_braked, 0.0, AJAR)  # the command that the brake opens with
            i = k * COMMANDS
            out[i] = seen.u_braked if braked else drive.u_p
            out[i + 1] = drive.u_m
            out[i + 2] = drive.u_ff
            out[i + 3] = seen.u_braked if braked else drive.u_raw
            out[i + 4] = drive.e_c
            out[i + 5] = motion.s_tip
            out[i + 6] = motion.v_tip
            out[i + 7] = motion.a_tip
        put(A, 0, Lane(m, laws, plc, control))

    return cycles


def _guarded_cycles(laws_of: ControlLaws, Lane: Any) -> Any:
    """The cycles of a guarded PLC."""
    load, put, plc_check, plc_cycle = access(Lane, 1).load, access(Lane, 1).store, laws_of.check, laws_of.cycle
    with_outside = replace(laws_of.Record, "guard")

    def guarded_cycles(A: Array, S: Array, out: Array, n: int):
        """A lane, whose memory goes on; S rows of `Outside`, out rows of `GuardedCommands`, n each."""
        a = load(A, 0)
        m, laws, plc, control = a.m, a.laws, a.plc, a.control
        for k in range(n):
            o = outside_at(S, k * OUTSIDE)
            begun = laws.guard.g.begun
            laws = with_outside(laws, with_quality(laws.guard, o.quality, o.reset))
            y, m, laws = plc_check(o.y, m, laws, plc)
            if begun < 0.5:
                m = memory_before(m, y.F, y.s_w, y.s_tip, y.mode, y.v_op, plc)
            y = with_displacement(y, known_displacement(y.alpha_m, m.u_m, control))
            drive, m, laws = plc_cycle(y, m, laws, plc)
            i = k * GUARDED
            put_commands(out, i, drive)
            out[i + AT_ALARM] = laws.guard.g.alarm
            out[i + AT_ALARM + 1] = laws.guard.g.cause
            out[i + AT_ALARM + 2] = laws.guard.g.state
        put(A, 0, Lane(m, laws, plc, control))

    return guarded_cycles
