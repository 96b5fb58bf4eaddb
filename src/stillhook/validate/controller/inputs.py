"""Inputs of a crane's PLC, cycle by cycle, from a record: inputs of the simulated controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.control.commands import SMALL, BrakeSettings
from stillhook.control.plc import MANUAL, Memory, Plc
from stillhook.control.registry import CONTROLLERS, code_of, mode_of_code
from stillhook.engine.pack.prediction import predicting
from stillhook.engine.pack.winch import active_record, controllers_of, drum_record, plc_record
from stillhook.kernels.plc_alone import Commands, PlcInputs, plc_alone
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.swash import MotorControl
from stillhook.physics.load_path.drum import K_wire, layer_diameter, layers_filled
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator
from stillhook.validate.ahc.replay import LEAST_SPEED
from stillhook.validate.criteria.results import Note
from stillhook.validate.data_set.record import Record, Segment, filled, stretches_of
from stillhook.validate.parameters.settings import servo_response

SHORTEST = 5.0  # s: a segment must be longer than the bumpless start of the PLC's memory
DERIVATIVE = {1: (3, 0.25), 2: (5, 0.5)}
"""Degree of the polynomial, and half width of the window [s] in which it gives the first and second derivative of a
noisy signal: 2 mm of white noise on a 100 Hz signal leave 5 mm/s and 2 cm/s^2, and a wave of 3 s loses 0.02 and 0.15 %
of them."""
MOVED = 0.1  # m: a reference that drifts by more was moved by the operator
STANDS = 21.0  # s: a set-point is constant for half as long at least; waves are shorter
ROUNDS = 3  # rounds of motor command and displacement, each derived from the other
AS_COMMANDED = MotorControl(offset=0.0, half_width=0.0, feedback=0.0)
HELD = 2e-3  # spread of a motor command that is held by the operator
SAME = 1e-3  # of full command: difference of commands from two starts at which the start no longer counts
PRESSURES = ("p_a", "p_b", "p_hp", "alpha_pm")  # signals that follow from pressures or make them


@dataclass(frozen=True)
class PlcSegment:
    """An uninterrupted part [first, last) of a record with all inputs of the PLC. parts: its segments; seen, memory:
    inputs and state of the PLC; plc: its settings, with the cycle of the record and the displacement that the operator
    holds; u_p, u_m, e_c: logged signals (n,), None where not logged; settled: samples at which the motors' displacement
    is known (n,), None where all; notes: substitutes for missing signals."""

    record: Record
    first: int
    last: int
    parts: tuple[Segment, ...]
    seen: PlcInputs
    memory: Memory
    plc: Plc
    u_p: FloatArray
    u_m: FloatArray | None
    e_c: FloatArray | None
    settled: BoolArray | None
    notes: tuple[Note, ...]

    def within(self, part: Segment) -> slice:
        """A segment's samples, counted from the start of the stretch."""
        return slice(part.first - self.first, part.last - self.first)

    def simulated_commands(self, crane: Crane) -> Commands:
        """Commands of the simulated PLC for these inputs."""
        return self._simulated(crane, None)[0]

    def _simulated(self, crane: Crane, laws: Any) -> tuple[Commands, Any]:
        """The same, and what controllers and prediction remember at the end; laws the same before the first cycle."""
        p_hp = np.zeros(self.last - self.first)  # affects the passive pumps only
        settings = controllers_of(crane, self.modes)[1] | predicting(crane, self.plc.t_cycle)
        commands, _, laws = plc_alone(self.seen, p_hp, self.memory, self.plc, motor_control(crane), settings, laws)
        return commands, laws

    @property
    def modes(self) -> set[str]:
        """Modes that it is in."""
        return {mode_of_code(code) for code in np.unique(self.seen.mode)}


def motor_control(crane: Crane) -> MotorControl:
    """How the motors' displacement is set; of a drive that has none to set, as commanded."""
    return active_record(crane).control if "active" in crane.circuits else AS_COMMANDED


def wire_ratio(crane: Crane, s_w: FloatArray) -> FloatArray:
    """K_wire of the layer in use at every wire length s_w [m], as calculated by the PLC [-]."""
    drum = drum_record(crane)
    usable = np.clip(s_w, 0.0, drum.L_full)
    # The layer is a staircase: its edges once, then a look-up.
    edges = np.array([np.pi * drum.turns * (n * drum.d + n * n * drum.d_wire) for n in range(1, int(drum.layers) + 1)])
    ratios = np.array([K_wire(layer_diameter(float(n), drum), drum) for n in range(1, int(drum.layers) + 1)])
    assert layers_filled(float(edges[-1]), drum) <= drum.layers
    at = np.searchsorted(edges, drum.L_full - usable - 1e-9)
    return ratios[np.minimum(at, len(ratios) - 1)]


def derivative(x: FloatArray, step: float, order: int = 1) -> FloatArray:
    """First or second derivative of an even signal (n,) by local polynomials, without delay; see DERIVATIVE."""
    degree, half = DERIVATIVE[order]
    n = max(2 * round(half / step) + 1, degree + 2)
    return np.asarray(scipy.signal.savgol_filter(x, n, degree, deriv=order, delta=step), dtype=np.float64)


def lacking(crane: Crane, record: Record) -> list[str]:
    """Signals without which a record cannot be used for the controller."""
    missing = [name for name in ("u_p", "s_w") if not record.has(name)]
    if not record.has("s_tip") and not record.has("v_op"):
        missing.append("s_tip (or v_op)")
    learns = any(part.mode.law.learns for part in record.segments)
    return missing + (not_learned_from(crane, record) if learns else [])


def learned_before(crane: Crane, record: Record, used: Sequence[PlcSegment]) -> str | None:
    """Controller that learns, and of which no part of a record is used although its signals are there."""
    if not_learned_from(crane, record):
        return None
    modes = {mode for s in used if s.record is record for mode in s.modes}
    names = (str(part.mode) for part in record.segments if part.mode.law.learns)
    return next((name for name in names if name not in modes), None)


def not_learned_from(crane: Crane, record: Record) -> list[str]:
    """Signals that a controller which learns follows and that a record lacks."""
    return [name for name in (*pressures_of(crane), "omega_m", "alpha_m", "F_w") if not record.has(name)]


def pressures_of(crane: Crane) -> tuple[str, ...]:
    """Those of PRESSURES by which the PLC knows what the motors carry."""
    return PRESSURES if crane.passive is not None else PRESSURES[:2]


def plc_segments(crane: Crane, record: Record, *, blind: bool = False) -> tuple[PlcSegment, ...]:
    """The parts of a record on which the simulated PLC can run, through changes of mode and gaps between segments, as
    the PLC does; of a controller that learns those in which it comes into force. blind: also those in manual mode
    without a joystick signal, as at rest."""
    if not record.has("u_p", "s_w"):
        return ()
    mode = modes_of(record)
    asks = np.where(
        mode == MANUAL, record.has("v_op") or blind, record.has("s_tip")
    )  # otherwise the requested motion is unknown
    learns = np.isin(mode, [law.code for law in CONTROLLERS.values() if law.learns])
    if not_learned_from(crane, record):
        asks &= ~learns
    needed = [n for n in ("s_tip", "v_tip", "a_tip", "s_w", "v_op", "alpha_m", "u_p") if record.has(n)]
    finite = np.isfinite(mode) & asks & np.all([np.isfinite(record.signals[n]) for n in needed], axis=0)
    for a, b in stretches_of(finite):
        if learns[a] and not (a > 0 and np.isfinite(mode[a - 1]) and not learns[a - 1]):
            finite[a:b] &= np.cumsum(~learns[a:b]) > 0  # what it has learned before is not known
    spans = [(a, b) for a, b in stretches_of(finite) if (b - a) * record.step >= SHORTEST]
    segments = (_plc_segment(crane, record, mode, a, b) for a, b in spans)
    return tuple(s for s in segments if s.parts)


def modes_of(record: Record) -> FloatArray:
    """Code of the PLC's mode at every sample (n,): of the segments, between them of the log, NaN where not known."""
    logged = record.signals.get("mode")
    mode = np.full(len(record.t), np.nan) if logged is None else np.array(logged, dtype=np.float64)
    for part in record.segments:
        mode[part.first : part.last] = code_of(part.mode)
    return mode


def _plc_segment(crane: Crane, record: Record, mode: FloatArray, a: int, b: int) -> PlcSegment:
    notes: list[Note] = []
    parts = tuple(p for s in record.segments if (p := _cut(s, a, b)) is not None)
    x = {name: values[a:b] for name, values in record.signals.items()}
    zero, one, ahc = np.zeros(b - a), np.ones(b - a), mode[a:b] > MANUAL
    s_tip, v_op = x.get("s_tip", zero), x.get("v_op", zero)
    v_tip, a_tip = _tip(x, s_tip, record.step, notes if ahc.any() else [])
    s_op = np.concatenate([[0.0], np.cumsum(0.5 * (v_op[1:] + v_op[:-1]) * record.step)])
    e_c = _mostly(x.get("e_c_measured"))
    u_m = _mostly(x.get("u_m")) if "active" in crane.circuits else None
    starts = not ahc[0] or (a > 0 and mode[a - 1] == MANUAL)
    F = _mostly(x.get("F_w"))
    if F is None:
        notes.append(Note("stated-load"))
        F = one * ((parts[0].load if parts else 0.0) + crane.hook_mass) * G
    plc = plc_record(crane)._replace(t_cycle=record.step)
    braked = on_brake(mode[a:b], v_op, x["u_p"], plc.brake, record.step) if "v_op" in x else zero > 0.0
    seen = PlcInputs(
        s_tip=s_tip,
        v_tip=v_tip,
        a_tip=a_tip,
        v_op=v_op,
        s_op=s_op,
        mode=mode[a:b],
        f_pump=x.get("f_pump", one),
        s_w=x["s_w"],
        F=F,
        alpha_m=one,
        K_wire=wire_ratio(crane, x["s_w"]),
        omega_m=_logged(x, "omega_m"),
        p_a=_logged(x, "p_a"),
        p_b=_logged(x, "p_b"),
        dp=zero,
        dp_load=zero,
        braked=braked.astype(np.float64),
        u_braked=x["u_p"],
    )
    memory = _memory(record, mode, a, F, e_c is not None, u_m is not None)
    bare = PlcSegment(record, a, b, parts, seen, memory, plc, x["u_p"], u_m, e_c, None, ())
    wire = x["s_w"] - bare.simulated_commands(crane).s_tip + s_op
    datum, moved = _datum(wire, e_c, ahc, starts, record.step, notes)
    seen = seen if moved is None else seen._replace(s_op=s_op - moved)
    bare = replace(bare, seen=seen, memory=memory._replace(datum=datum))
    completed = _with_pressures(crane, _with_displacement(crane, bare, x.get("alpha_m"), notes))
    return replace(_with_known_start(crane, _with_held(crane, completed, notes)), notes=tuple(notes))


def on_brake(mode: FloatArray, v_op: FloatArray, u_p: FloatArray, brake: BrakeSettings, step: float) -> BoolArray:
    """Samples at which the holding brake may be closed (n,): from t_wait at zero speed in manual mode until it is
    certainly open.

    That is t_most + t_open after a speed or a mode is requested, or where the pumps' command exceeds its limit against
    a closed brake. A log that begins at zero speed begins on the brake.
    """
    out = np.zeros(len(mode), dtype=bool)
    if not brake.fitted:
        return out
    still = (mode == MANUAL) & (np.abs(v_op) < LEAST_SPEED)
    for a, b in stretches_of(still):
        standing = np.flatnonzero(np.abs(u_p[a:b]) <= SMALL)
        if not len(standing):
            continue
        first = 0 if a == 0 else a + int(standing[0]) + round(brake.t_wait / step)
        if first < b:
            last = b + round((brake.t_most + brake.t_open) / step)
            beyond = np.flatnonzero(np.abs(u_p[b:last]) > brake.u_most)
            out[first : b + int(beyond[0]) if len(beyond) else last] = True
    return out


def _mostly(x: FloatArray | None) -> FloatArray | None:
    """A signal with its gaps bridged, None where less than half of it is known."""
    return None if x is None or np.isfinite(x).mean() < 0.5 else filled(x)


def _logged(x: dict[str, FloatArray], name: str) -> FloatArray:
    """A signal with its gaps bridged, zeros where it is not logged: read by controllers of the user alone."""
    signal = _mostly(x.get(name))
    return np.zeros(len(x["s_w"])) if signal is None else signal


def _memory(record: Record, mode: FloatArray, a: int, F: FloatArray, e_c_logged: bool, u_m_logged: bool) -> Memory:
    """The PLC's memory before a stretch, without the datum. Where the mode changes just there, its commands start from
    the last that were logged, and the reference is set again where compensation starts, unless it is known from the
    logged error."""
    at = a - 1 if a > 0 and np.isfinite(mode[a - 1]) and np.isfinite(record.signals["u_p"][a - 1]) else a
    before = mode[at]
    if before == MANUAL and mode[a] > MANUAL and e_c_logged:
        before = next(law.code for law in CONTROLLERS.values() if law.compensates and law.code != mode[a])
        # any other compensating mode: a change that keeps the datum
    u_m = float(record.signals["u_m"][at]) if u_m_logged else 1.0
    early = F[: max(1, round(1.0 / record.step))]
    u_m = u_m if np.isfinite(u_m) else 1.0
    return Memory(
        mode=before,
        datum=0.0,
        F=float(early.mean()),
        p_mean=0.0,
        u_p=float(record.signals["u_p"][at]),
        u_m=u_m,
        b_p=0.0,
        b_m=0.0,
        held=1.0,
        brake=0.0,
        idle=0.0,
        stroke=1.0,
    )


def _cut(part: Segment, a: int, b: int) -> Segment | None:
    """The part of a segment inside [a, b), None where there is none."""
    first, last = max(part.first, a), min(part.last, b)
    return replace(part, first=first, last=last) if last > first else None


def _tip(x: dict[str, FloatArray], s_tip: FloatArray, step: float, notes: list[Note]) -> tuple[FloatArray, FloatArray]:
    """Speed and acceleration of the tip; derivatives of logged signals where not logged."""
    v_tip = x.get("v_tip")
    if v_tip is None:
        v_tip = derivative(s_tip, step)
        notes.append(Note("derivative", signal="v_tip", of="s_tip"))
        base, order = s_tip, 2
    else:
        base, order = v_tip, 1
    a_tip = x.get("a_tip")
    if a_tip is None:
        a_tip = derivative(base, step, order)
        notes.append(Note("derivative", signal="a_tip", of="s_tip" if order == 2 else "v_tip"))
    return v_tip, a_tip


def _datum(
    bare: FloatArray, e_c: FloatArray | None, ahc: BoolArray, starts: bool, step: float, notes: list[Note]
) -> tuple[float, FloatArray | None]:
    """Datum of the wire's reference at the start [m], and the motion of the reference in addition to tip and
    joystick [m], None without.

    starts: compensation starts inside the stretch, or with it.
    e_c = datum + moved - bare, where bare = s_w - s_tip + s_op with the tip's position that the PLC foresees. Without a
    logged error: set where compensation starts in the log, or else one constant that makes the mean error zero, since
    the log cannot distinguish a constant offset from it.
    """
    if not ahc.any():
        return float(bare[0]), None
    if e_c is None:
        notes.append(Note("datum-at-start" if starts else "datum-by-mean"))
        return float(bare[0] if starts else bare[ahc].mean()), None
    reference = e_c + bare
    datum = float(np.median(reference[ahc]))
    every, n = max(1, round(1.0 / step)), round(STANDS)
    slow = scipy.ndimage.median_filter(np.where(ahc, reference - datum, 0.0)[::every], n, mode="nearest")
    if np.ptp(slow) < MOVED:
        return datum, None
    notes.append(Note("reference-moved"))
    return datum, np.repeat(slow, every)[: len(bare)]


def _with_displacement(crane: Crane, s: PlcSegment, alpha_m: FloatArray | None, notes: list[Note]) -> PlcSegment:
    """The segment with the motors' displacement as the PLC has it; derived by the servo where not logged."""
    if motor_control(crane).feedback == 0.0:
        return s  # the PLC calculates with its own command
    servo = crane.active.motor.servo
    of_servo = servo.omega_n, servo.zeta, s.record.step, servo.dead_time or 0.0
    if alpha_m is not None:
        return replace(s, seen=s.seen._replace(alpha_m=alpha_m))
    if s.u_m is not None:
        notes.append(Note("alpha-by-servo"))
        return replace(s, seen=s.seen._replace(alpha_m=servo_response(s.u_m, *of_servo)))
    notes.append(Note("alpha-simulated"))
    for _ in range(ROUNDS):
        u_m = s.simulated_commands(crane).u_m
        s = replace(s, seen=s.seen._replace(alpha_m=servo_response(u_m, *of_servo)))
    return replace(s, settled=np.abs(s.seen.alpha_m - u_m) < HELD)


def _with_held(crane: Crane, s: PlcSegment, notes: list[Note]) -> PlcSegment:
    """In manual mode: the segment with the displacement that the operator visibly holds against the PLC's own law."""
    if (
        s.u_m is None
        or (s.seen.mode > MANUAL).any()
        or np.ptp(s.u_m) > HELD
        or np.abs(s.u_m - s.simulated_commands(crane).u_m).max() < 5.0 * HELD
    ):
        return s
    displacement = float(np.clip(np.median(s.u_m), crane.active.motor.alpha_min, 1.0))
    notes.append(Note("motors-held", at=displacement))
    return replace(s, plc=plc_record(crane, Operator(alpha_m=displacement))._replace(t_cycle=s.plc.t_cycle))


def _with_pressures(crane: Crane, s: PlcSegment) -> PlcSegment:
    """The segment with the pressure difference over the motors, and with that at which they carry the load, where the
    lines' pressures and the passive circuit are logged; without both, and of other winch types, 0."""
    logged = s.record.signals
    read = {name: _mostly(logged[name][s.first : s.last]) for name in pressures_of(crane) if name in logged}
    x = {name: values for name, values in read.items() if values is not None}
    if "active" not in crane.circuits or len(x) < len(pressures_of(crane)):
        return s
    y, plant = s.seen, s.plc.plant
    T_passive: FloatArray | float = 0.0
    if crane.passive is not None:
        T_passive = motor_torque(plant.D_pm * x["alpha_pm"], x["p_hp"] - crane.passive.p_lp)
    r_eff = 0.5 * plant.d_max / (y.K_wire * plant.i_hD)
    dp_load = (y.F * r_eff - T_passive) / (plant.D_m * np.maximum(y.alpha_m, SMALL))
    return replace(s, seen=y._replace(dp=y.p_a - y.p_b, dp_load=dp_load))


def _with_known_start(crane: Crane, s: PlcSegment) -> PlcSegment:
    """The segment without the samples at its start whose commands depend on what controllers and the prediction
    remember from before the log: those from an empty memory differ by more than SAME from those that begin with the
    memory which the first run ends with."""
    remembers = [law.memory is not None and not law.learns for law in (CONTROLLERS[mode] for mode in s.modes)]
    if crane.control.prediction is None and not any(remembers):
        return s
    first, laws = s._simulated(crane, None)
    again = s._simulated(crane, laws)[0]
    apart = np.flatnonzero(np.abs(first.u_raw - again.u_raw) + np.abs(first.u_m - again.u_m) > SAME)
    known = np.arange(len(first.u_p)) > (apart[-1] if len(apart) else -1)
    return replace(s, settled=known if s.settled is None else known & s.settled)
