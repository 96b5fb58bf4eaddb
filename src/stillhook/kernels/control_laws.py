"""The controllers as one function inside a kernel, and what the PLC reads as another, through the sensors of the crane
where it has some: fixed when a kernel is compiled, controllers chosen by the mode's code while it runs.

Every kernel holds the shipped controllers that have neither settings nor a memory of their own, and the usual one of
its winch type. A case that uses any other one is run by a kernel that holds this one too. Settings and memories of
controllers and sensors are fields of one record, which is carried from cycle to cycle. A kernel without sensors holds
nothing of them.
"""

import functools
import hashlib
import itertools
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from stillhook.control.checks import Checks, concluded, doubts
from stillhook.control.guard import FINITE, Guard, check, is_code, known_mode, limited, outside, sound_demand
from stillhook.control.interface import AFTER, BEFORE, DISPLACEMENT, QUANTITIES, Demand, Sensed
from stillhook.control.plc import ActuatorCommands, ahead, command, foreseen, observed
from stillhook.control.registry import CONTROLLERS, ControlLaw
from stillhook.control.sensors import Sensor, measured, sensor_named
from stillhook.kernels.drivers.commands import memory_of
from stillhook.kernels.lanes import unflatten
from stillhook.physics import tip_prediction
from stillhook.physics.records import define, joined, record, replace
from stillhook.physics.scalar import scalar
from stillhook.winches.records import Tick
from stillhook.winches.registry import WinchType


class ControlLaws(NamedTuple):
    """Record: class of what the controllers carry from cycle to cycle, `code` of the one in force, then settings and
    memory of each that has them, those of the crane's sensors, `Guard` and `Checks` where there are; sensing(sense,
    lines) is what the PLC reads by the `sense` of a winch, see `sensing`; check(sensed, m, laws, plc) gives what the
    controllers may be called with (all as it is where they are not guarded); cycle(sensed, m, laws, plc) gives the
    actuators' commands, the PLC's memory and the new record."""

    Record: Any
    sensors: tuple[str, ...]
    checks: bool
    sensing: Callable[..., Any]
    check: Callable[..., Any]
    cycle: Callable[..., Any]
    blank: Callable[..., Any]


def extra_controllers(modes: Iterable[str]) -> tuple[str, ...]:
    """The controllers of these modes that not every kernel holds, by name."""
    return tuple(sorted({mode for mode in modes if not CONTROLLERS[mode].in_every_kernel}))


def controllers_of_winch(winch: WinchType, modes: Iterable[str] = ()) -> tuple[str, ...]:
    """The controllers in a winch type's kernels that not every kernel holds, by name: those of these modes, and the
    usual one of the type, so that its other modes need no kernel of their own."""
    return extra_controllers((winch.default_mode, *modes))


def label(names: tuple[str, ...]) -> str:
    """What the folder of a kernel with these controllers is called: their names, codes and sources; "" for none."""
    if not names:
        return ""
    digest = hashlib.sha256()
    for law in (CONTROLLERS[name] for name in names):
        digest.update(f"{law.name} {law.code}".encode() + b"\0" + law.file.read_bytes())
    return f"-{'-'.join(names)}-{digest.hexdigest()[:12]}"


@functools.cache
def control_laws(
    names: tuple[str, ...],
    drive: str = DISPLACEMENT,
    guarded: bool = False,
    sensors: tuple[str, ...] = (),
    checks: bool = False,
    late: tuple[str, ...] = (),
    predicts: bool = False,
) -> ControlLaws:
    """The controllers that every kernel of this kind of drive holds, and those named; guarded: with
    `stillhook.control.guard` around them, and with checks `stillhook.control.checks` before it; sensors: those of the
    crane, by name; late: commands that displacement controls with a dead time follow; predicts: the tip's motion is
    predicted, see `stillhook.physics.tip_prediction`."""
    laws = [law for law in CONTROLLERS.values() if (law.in_every_kernel and drive in law.drives) or law.name in names]
    parts = [(f"{law.field}_{part}", cls) for law in laws for part, cls in _parts(law)]
    behind = [*([("guard", Guard)] if guarded else []), *([("checks", Checks)] if checks else [])]
    delayed = memory_of(late)
    foresight = PREDICTION if predicts else {}
    read = parts_of(sensors) | delayed | foresight
    before = f"{' guarded' * guarded}{' checked' * checks}{' predicts' * predicts}"
    kind = f"{drive}{before} {' '.join(names)}{' by ' if sensors else ''}{' '.join(sensors)}"
    kind += f" late {' '.join(late)}" if late else ""
    LawRecord = record("LawRecord", f"{__name__} {kind}", code=float, **dict(parts), **read, **dict(behind))
    names_used: dict[str, Any] = {"Record": LawRecord, "Demand": Demand, "observed": observed, "command": command}
    names_used |= {"ahead": ahead, "foreseen": foreseen, "followed": tip_prediction.followed}
    if predicts:
        names_used["with_prediction"] = replace(LawRecord, "prediction_memory")
    guarding: tuple[Any, ...] = (check, is_code, known_mode, limited, outside, sound_demand)
    names_used |= {each.__name__: each for each in guarding}
    if guarded:
        names_used |= {"with_guard": replace(LawRecord, "guard"), "with_memory": replace(Guard, "g")}
    if checks:
        names_used |= {"doubts": doubts, "concluded": concluded, "with_checks": replace(LawRecord, "guard", "checks")}
        names_used |= {"with_k": replace(Checks, "k"), "Quality": Sensed}
    for law in laws:
        names_used[f"cycle_{law.field}"] = law.cycle
        names_used |= {f"{law.field}_{part}_class": cls for part, cls in _parts(law)}
    of_fields = [field for field, _ in behind]
    later = FORESEEN if predicts else EXTRAPOLATED
    cycle = _guarded(laws, _qualities(sensors) if checks else None, later) if guarded else CYCLE.replace(LATER, later)
    source = f"{_demand(laws, [*read, *of_fields], guarded)}\n\n{cycle}"
    define(source, names_used, f"<controllers of {kind}>")
    names_used |= {each: scalar(names_used[each]) for each in ("demand", "checked")}

    def blank(settings: dict[str, Any], guard: Guard | None = None, checks: Checks | None = None) -> Any:
        """The record before the first cycle, with the settings of each controller and sensor that has some."""
        values: dict[str, Any] = {"code": -1.0, "guard": guard, "checks": checks, **blank_parts(sensors, settings)}
        values |= {part: unflatten(cls, itertools.repeat(0.0)) for part, cls in (delayed | foresight).items()}
        values |= {"prediction_settings": settings["prediction"]} if predicts else {}
        values |= {f"{law.field}_settings": settings[law.name] for law in laws if law.record is not None}
        values |= {f"{law.field}_memory": law.memory() for law in laws if law.memory is not None}
        names: tuple[str, ...] = LawRecord._fields
        return LawRecord(*[values[name] for name in names])

    def read_by(sense: Callable[..., Any], lines: bool) -> Callable[..., Any]:
        return sensing(sense, lines, sensors, LawRecord)

    return ControlLaws(LawRecord, sensors, checks, read_by, names_used["checked"], scalar(names_used["cycle"]), blank)


PREDICTION = {"prediction_settings": tip_prediction.Settings, "prediction_memory": tip_prediction.Memory}
"""Fields of what is carried where the tip's motion is predicted."""
LATER = "later = t_a = None"
EXTRAPOLATED = "later, t_a = ahead(sensed, plc.t_lead, plc.t_lead_ff), 0.0"
FORESEEN = """\
p, s = laws.prediction_memory, laws.prediction_settings
    p = followed(sensed.v_tip, sensed.a_tip, p, s, plc.t_cycle)
    laws = with_prediction(laws, p)
    later, t_a = foreseen(sensed, p, s, plc)"""
"""Lines of a cycle that give the tip's motion as it will be, and the time from now to that of its acceleration."""
CYCLE = """\
def checked(sensed, m, laws, plc):
    return sensed, m, laws

def cycle(sensed, m, laws, plc):
    later = t_a = None
    o = observed(sensed, later, t_a, m, plc)
    d, laws = demand(o.r, laws, plc)
    drive, m = command(o, d, m, plc)
    return drive, m, laws
"""


def _guarded(laws: list[ControlLaw], qualities: str | None, later: str) -> str:
    """Source of the two parts of a guarded cycle; qualities: of the inputs, where they are checked as well; later: its
    lines that give the tip's motion as it will be."""
    known = " or ".join(f"is_code(y.mode, {law.code!r})" for law in laws)
    before = "y, quality = sensed, guard.quality"
    after = "return c.y, c.m, with_guard(laws, with_memory(guard, c.g))"
    if qualities is not None:
        before = f"""\
checks, q = laws.checks, guard.quality
    b = doubts(sensed, {qualities}, m, guard.g, checks.k, checks.s, guard.s, plc)
    y, quality = b.y, b.quality"""
        after = """\
e = concluded(c.y, c.m, c.g, b.k, checks.s, guard.s, plc)
    return e.y, e.m, with_checks(laws, with_memory(guard, e.g), with_k(checks, e.k))"""
    return f"""\
def checked(sensed, m, laws, plc):
    guard = laws.guard
    {before}
    known = known_mode(y.mode, guard.only) if guard.only >= 0.0 else {known}
    c = check(y, quality, guard.reset, known, m, guard.g, guard.s, plc)
    {after}

def cycle(sensed, m, laws, plc):
    {later}
    o = observed(sensed, later, t_a, m, plc)
    d, laws, wrong = demand(o.r, laws, plc)
    d, g = sound_demand(d, wrong, m, laws.guard.g)
    drive, m = command(o, d, m, plc)
    return limited(drive, plc), m, with_guard(laws, with_memory(laws.guard, g))
"""


def _qualities(sensors: Iterable[str]) -> str:
    """Source of the quality of every input: bad where a sensor of a scenario says that its channel is; dp, which is
    calculated of the lines, with those of p_a and p_b."""
    lost: dict[str, list[str]] = {}
    for sensor in map(sensor_named, sensors):
        if sensor.memory is not None and "lost" in sensor.memory._fields:
            for quantity in sensor.quantities:
                for read in (quantity, *(["dp"] if quantity in ("p_a", "p_b") else [])):
                    lost.setdefault(read, []).append(f"laws.{sensor.memory_field(quantity)}.lost")
    if not lost:
        return "q"
    bad = {name: " or ".join(f"{each} > 0.5" for each in fields) for name, fields in lost.items()}
    values = ", ".join(f"0.0 if {bad[f]} else q.{f}" if f in bad else f"q.{f}" for f in Sensed._fields)
    return f"Quality({values})"


def _parts(law: ControlLaw) -> list[tuple[str, Any]]:
    """Records of its own that a controller has."""
    return [(part, cls) for part, cls in (("settings", law.record), ("memory", law.memory)) if cls is not None]


def _demand(laws: list[ControlLaw], read: list[str], guarded: bool) -> str:
    """Source of demand(r, laws, plc): the law in force, with its memory; the others' memories stay as at their
    start. read: fields of sensors, guard and checks, which stay as they are; guarded: a memory that is no number any
    more starts anew, and how many of its fields are none."""
    lines = ["def demand(r, laws, plc):", "    code = r.y.mode"]
    u_p = u_m = ""
    after, wrong = ["code"], ["0.0"]
    for i, law in enumerate(laws):
        on, arguments = f"code == {law.code!r}", "r, plc"
        if law.record is not None:
            arguments += f", laws.{law.field}_settings"
            after.append(f"laws.{law.field}_settings")
        if law.memory is None:
            lines.append(f"    d_{i} = cycle_{law.field}({arguments})")
        else:
            start = f"{law.field}_memory_class({', '.join(repr(float(x)) for x in law.memory())})"
            lines.append(f"    m_{i} = laws.{law.field}_memory if laws.code == {law.code!r} else {start}")
            lines.append(f"    d_{i}, n_{i} = cycle_{law.field}({arguments}, m_{i})")
            parts = " + ".join(f"outside(n_{i}.{f}, {-FINITE!r}, {FINITE!r})" for f in law.memory._fields)
            if guarded:
                lines.append(f"    wrong_{i} = {parts} if {on} else 0.0")
                wrong.append(f"wrong_{i}")
            after.append(f"n_{i} if {on}{f' and wrong_{i} < 0.5' if guarded else ''} else {start}")
        u_p = f"d_{i}.u_p if {on} else {u_p}" if u_p else f"d_{i}.u_p"
        u_m = f"d_{i}.u_m if {on} else {u_m}" if u_m else f"d_{i}.u_m"
    after += [f"laws.{field}" for field in read]
    made = [f"Demand({u_p}, {u_m})", f"Record({', '.join(after)})", *([" + ".join(wrong)] if guarded else [])]
    lines.append(f"    return {', '.join(made)}")
    return "\n".join(lines)


PLACES = {"s_tip": "s_m", "v_tip": "v_m", "a_tip": "a_m", "s_w": "n_s", "F": "n_F"}
"""Where a `Tick` has what becomes a signal: the motion as it comes, or noise that is added to the true value."""
TRUE = {"s_w": "y.s_w", "F": "q.F_w"}
"""What encoder and load cell measure, of the load path."""


def sensors_label(names: tuple[str, ...]) -> str:
    """What the folder of a kernel with these sensors is called: their names and sources; "" for none."""
    if not names:
        return ""
    digest = hashlib.sha256(b"\0".join(sensor_named(name).file.read_bytes() for name in names))
    return f"-{'-'.join(names)}-{digest.hexdigest()[:12]}"


def parts_of(names: tuple[str, ...]) -> dict[str, Any]:
    """Settings, and a memory for each quantity, of these sensors, by their field in the record of the controllers."""
    parts: dict[str, Any] = {}
    for sensor in map(sensor_named, names):
        parts[sensor.settings_field] = sensor.record
        if sensor.memory is not None:
            parts |= {sensor.memory_field(quantity): sensor.memory for quantity in sensor.quantities}
    return parts


def blank_parts(names: tuple[str, ...], settings: dict[str, Any]) -> dict[str, Any]:
    """The parts of these sensors before their first reading, with the settings of each by its name; memories are made
    with the first reading."""
    made = {sensor_named(name).settings_field: settings[name] for name in names}
    return {part: made.get(part) or unflatten(cls, itertools.repeat(0.0)) for part, cls in parts_of(names).items()}


def sensing(sense: Callable[..., Any], lines: bool, names: tuple[str, ...], LawRecord: Any) -> Callable[..., Any]:
    """A scalar function (x, y, q, m, tick, geo, laws, p) -> (sensed, tick, laws) around the `sense` of a winch type:
    what the PLC reads, the tick with the signals of motion unit, encoder and load cell, and the record with the
    memories of the sensors. A memory begins at the value that is read when no controller was in force yet. lines:
    whether dp is the difference of p_a and p_b, so that it follows what is read of them. Where two sensors have one
    quantity, the second one (of a scenario) reads what the first one (of the crane) gives."""
    if not names:

        @scalar
        def ideal(x, y, q, m, tick, geo, laws, p):
            return sense(x, y, q, m, tick, geo, p), tick, laws

        return ideal
    used: dict[str, Any] = {"sense": sense}
    pairs = [(sensor, quantity) for sensor in map(sensor_named, names) for quantity in sensor.quantities]
    pairs.sort(key=lambda pair: QUANTITIES.index(pair[1]))
    memories = [
        (sensor.memory_field(quantity), f"n_{i}") for i, (sensor, quantity) in enumerate(pairs) if sensor.memory
    ]
    read: dict[str, str] = {}
    text = ["def sensing(x, y, q, m, tick, geo, laws, p):", "    h, begun = p.plc.t_cycle, laws.code >= 0.0"]
    for kind, holder, of in ((BEFORE, "tick", Tick), (AFTER, "sensed", Sensed)):
        new: dict[str, str] = {}
        for i, (sensor, quantity) in enumerate(pairs):
            if quantity not in kind:
                continue
            place = PLACES.get(quantity, quantity)
            true = TRUE.get(quantity, f"{holder}.{place}")
            if quantity == "dp" and lines:
                true = _difference(new)
            text += _reading(i, sensor, quantity, read.get(quantity, true), used)
            read[quantity] = f"r_{i}"
            new[place] = f"tick.{place} + (r_{i} - {true})" if quantity in TRUE else f"r_{i}"
        if lines and holder == "sensed" and "dp" not in new and ("p_a" in new or "p_b" in new):
            new["dp"] = _difference(new)
        if new:
            used[f"with_{holder}"] = replace(of, *new)
            text.append(f"    {holder} = with_{holder}({holder}, {', '.join(new.values())})")
        if holder == "tick":
            text.append("    sensed = sense(x, y, q, m, tick, geo, p)")
    if memories:
        used["with_laws"] = replace(LawRecord, *(field for field, _ in memories))
        text.append(f"    laws = with_laws(laws, {', '.join(value for _, value in memories)})")
    text.append("    return sensed, tick, laws\n")
    define("\n".join(text), used, f"<sensing of {sense.__module__} {LawRecord.__module__} {lines}>")
    made: Callable[..., Any] = scalar(used["sensing"])
    return made


def _difference(read: Mapping[str, str]) -> str:
    """dp as it follows from the pressures that are read: the true one where none is read by a sensor."""
    parts = [f" {sign} ({read[p]} - sensed.{p})" for sign, p in (("+", "p_a"), ("-", "p_b")) if p in read]
    return f"(sensed.dp{''.join(parts)})" if parts else "sensed.dp"


def _reading(i: int, sensor: Sensor, quantity: str, true: str, used: dict[str, Any]) -> list[str]:
    """Lines that make the signal r_i, and the memory n_i where the sensor remembers."""
    used[f"reading_{i}"], settings = sensor.reading, f"laws.{sensor.settings_field}"
    if sensor.begin is None:
        return [f"    r_{i} = reading_{i}({true}, h, {settings})"]
    used[f"begin_{i}"] = sensor.begin
    return [
        f"    m_{i} = laws.{sensor.memory_field(quantity)} if begun else begin_{i}({true}, {settings})",
        f"    r_{i}, n_{i} = reading_{i}({true}, h, {settings}, m_{i})",
    ]


class Shown(NamedTuple):
    """How a series shows what sensors give, and the checks: the record of its signals; keep(drive, sensed, laws), the
    active drive's signals with those; show(signals, drive), one row of the series."""

    Signals: Any
    keep: Callable[..., Any]
    show: Callable[..., Any]


ALARMS = {"guard_alarm": "laws.guard.g.alarm", "guard_state": "laws.guard.g.state"}
"""What a series shows of guard and checks, where there are checks."""


def shown(names: tuple[str, ...], Signals: Any, checks: bool = False) -> Shown:
    """The signals of a winch with one for each quantity that these sensors read, and with checks those of the guard."""
    if not names and not checks:

        @scalar
        def keep_all(drive, sensed, laws):
            return drive

        @scalar
        def show_all(signals, drive):
            return signals

        return Shown(Signals, keep_all, show_all)
    quantities = dict.fromkeys(quantity for name in names for quantity in sensor_named(name).quantities)
    values = {measured(quantity): f"sensed.{quantity}" for quantity in quantities} | (ALARMS if checks else {})
    of = f"{Signals.__module__} by {' '.join(names)}{' checked' if checks else ''}"
    Measured = record("Measured", of, **dict.fromkeys(values, float))
    row = joined("Signals", Signals, Measured)
    join_drive = joined("Drive", ActuatorCommands, Measured).join
    used = {"Measured": Measured, "join_drive": join_drive, "join_signals": row.join}
    measurements = ", ".join(f"drive.{name}" for name in Measured._fields)
    source = f"""\
def keep(drive, sensed, laws):
    return join_drive(drive, Measured({", ".join(values.values())}))

def show(signals, drive):
    return join_signals(signals, Measured({measurements}))
"""
    define(source, used, f"<signals of {of}>")
    return Shown(row.record, scalar(used["keep"]), scalar(used["show"]))
