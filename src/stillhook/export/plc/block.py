"""The function block of one controller on one crane: what it reads, remembers and commands, and its cycle."""

from __future__ import annotations

import inspect
import re
from typing import Any, NamedTuple

from stillhook import variables
from stillhook._version import __version__
from stillhook.base.choice import choice
from stillhook.control.checks import CheckMemory, CheckSettings, checks_at_start, concluded, doubts
from stillhook.control.guard import (
    FINITE,
    LAW_FAULT,
    MEMORY_FAULT,
    GuardMemory,
    GuardSettings,
    check,
    known_mode,
    limited,
    memory_at_start,
    outside,
    sound_demand,
)
from stillhook.control.interface import Sensed
from stillhook.control.plant import PlantParameters
from stillhook.control.plc import ActuatorCommands, Memory, ahead, command, foreseen, memory_before, observed
from stillhook.control.registry import MANUAL_MODE, Mode
from stillhook.engine.pack.guard import check_settings, guard_settings, motor_control
from stillhook.engine.pack.winch import pack
from stillhook.errors import StillhookError
from stillhook.export.plc.program import BOOL, LREAL, PREFIX, Block, Names, Unit, Variable, literal, plain_text
from stillhook.export.plc.translate import COMPARISON, SUM, Body, Library, Record, Value, paragraphs, scalars
from stillhook.kernels.c99.expressions import plain
from stillhook.physics import tip_prediction
from stillhook.physics.hydraulics.swash import MotorControl, known_displacement
from stillhook.physics.records import fields
from stillhook.physics.tip_prediction import followed
from stillhook.spec.control import own_settings
from stillhook.spec.crane import Crane, identity
from stillhook.spec.scenario import Scenario

STARTS = {"f_pump": 1.0, "alpha_m": 1.0, "K_wire": 1.0}
"""Inputs that are 1 until something is connected to them: all pumps, full displacement, outermost layer."""
MEASURED = {"e_c": "e_c_measured"}
"""Outputs that results call otherwise: the PLC has the tip as its motion unit measures it."""
GUARD_OUTPUTS = {
    "alarm": "sum of 2^i over the inputs i, counted from 0, that are replaced;"
    f" {MEMORY_FAULT:.0f} memory, {LAW_FAULT:.0f} law: no number",
    "cause": "alarm with which the winch was stopped, 0 while it is not",
    "state": "0 healthy, 1 an input is replaced or the joystick must be released, 2 stopped until the reset",
}
ABOUT_GUARD = (
    "Guard, g_ before the name: inputs that are bad, by their quality input q_, their range or their change, are"
    " replaced; those that stay bad stop the winch: pumps to zero, brake closed, until a rising edge of reset with the"
    " joystick released, mode manual and good inputs. Ranges and times are in settings.guard."
)
ABOUT_PREDICTION = (
    " Prediction, w_ before the name: oscillators that a Kalman filter follows give the tip's motion after the leads."
    " Its gains in settings.prediction are for the cycle of these settings."
)
ABOUT_CHECKS = (
    " Checks, k_ before the name: inputs that contradict each other are in doubt, and counted in the alarm. Limits and"
    " reactions are in settings.checks."
)
USUAL_WIRE = "100 m"
"""Wire out at which a crane is packed: no setting of the PLC depends on it."""


class PlcError(StillhookError):
    """A controller that cannot be put on a PLC, or a text that cannot be checked."""


def refuse_unsuited(crane: Crane, mode: Mode) -> None:
    """Errors: PlcError where the crane's drive does not take this controller."""
    drive = crane.plant.type.control
    if drive not in mode.law.drives:
        fitting = ", ".join(each.value for each in Mode if drive in each.law.drives)
        raise PlcError(
            f'--controller "{mode.value}": the drive of "{crane.name}" takes no such commands. Choose {fitting}.'
        )


def controller_block(crane: Crane, controller: str) -> Block:
    """The function block of a controller with a crane's settings; manual mode is part of it.

    Errors: PlcError where the crane's drive does not take the controller; TranslationError where a controller of the
    user is written with more than the equations of a PLC may have.

    >>> import stillhook
    >>> from stillhook.export.plc import controller_block
    >>> controller_block(stillhook.load_crane("nov-250t"), "ssc").block.name
    'SH_ssc'
    """
    mode = choice(Mode, controller, "--controller", PlcError)
    refuse_unsuited(crane, mode)
    law, own = mode.law, own_settings(crane.control, mode.law)
    packed = pack(crane, Scenario(load=f"{0.5 * crane.SWL} kg", s_w=USUAL_WIRE, mode=mode))
    control = motor_control(packed.params)
    plc, memory = packed.params.plc, packed.memory._replace(mode=0.0, F=0.0)  # both are read in the first cycle
    library = Library()
    guard, checks = guard_settings(crane, plc, control), check_settings(crane, plc, control)
    parts = [("plc", type(plc), plc), ("control", MotorControl, control), ("guard", GuardSettings, guard)]
    parts += [("own", law.record, own)] if law.record is not None else []
    parts += [("checks", CheckSettings, checks)] if checks is not None else []
    prediction = packed.settings.get("prediction")
    parts += [("prediction", type(prediction), prediction)] if prediction is not None else []
    cls: Any = NamedTuple("Settings", [(name, t) for name, t, _ in parts])  # type: ignore[misc]
    about = f"Settings of {mode.value} on {crane.name}, SI units. Change them here or in the block's input `settings`."
    notes = {PlantParameters: field_notes(PlantParameters)}
    notes |= {law.record: own_notes(law)} if law.record is not None else {}
    whole = library.structure(cls, cls(*(value for _, _, value in parts)), about, notes)
    names = Names()
    inputs = tuple(
        Variable(names.new(name), LREAL, text, literal(STARTS[name]) if name in STARTS else "")
        for name, text in sensed_notes().items()
    )
    qualities = tuple(Variable(names.new(f"q_{name}"), BOOL, f"{name} is good", "TRUE") for name in Sensed._fields)
    reset = Variable(names.new("reset"), BOOL, "rising edge: the operator acknowledges a stop", "FALSE")
    outputs = tuple(Variable(names.new(name), LREAL, output_note(name)) for name in ActuatorCommands._fields)
    outputs += tuple(Variable(names.new(name), LREAL, text) for name, text in GUARD_OUTPUTS.items())
    settings = Variable(names.new("settings"), whole, "initial values are those of this crane")
    first = names.new("first")
    kept = {name: names.new(f"m_{name}") for name in Memory._fields}
    body = Body(library, names)
    reading = Record(Sensed, {f: Value(v.name, float) for f, v in zip(Sensed._fields, inputs, strict=True)})
    m = Record(Memory, {f: Value(own_name, float) for f, own_name in kept.items()})
    g = _variables(GuardMemory, names, "g")
    law_memory = None
    if law.memory is not None:
        law_memory = Record(law.memory, {f: Value(names.new(f"law_{f}"), float) for f in law.memory._fields})
    given = library.reference(cls, settings.name)
    quality = Record(Sensed, {f: Value(v.name, bool) for f, v in zip(Sensed._fields, qualities, strict=True)})
    k = None if checks is None else _variables(CheckMemory, names, "k")
    w = None if prediction is None else _variables(tip_prediction.Memory, names, "w")
    memories = Memories(m, g, law_memory, k, w)
    _cycle(body, reading, quality, Value(reset.name, bool), memories, law, given, outputs, first)
    lines = tuple(body.lines)
    used = set(re.findall(r"\w+", "\n".join(lines)))
    variables_of = [
        Variable(first, "BOOL", "TRUE until the first cycle is done", "TRUE"),
        *(
            Variable(own_name, LREAL, "", literal(getattr(memory, f)))
            for f, own_name in kept.items()
            if own_name in used
        ),
        *(
            Variable(v.text, LREAL, "", literal(x))
            for (_, v), x in zip(scalars(g), flat(memory_at_start(guard)), strict=True)
        ),
    ]
    if k is not None and checks is not None:
        variables_of += [
            Variable(v.text, LREAL, "", literal(x))
            for (_, v), x in zip(scalars(k), flat(checks_at_start(checks).k), strict=True)
        ]
    if w is not None:
        variables_of += [Variable(v.text, LREAL, "", literal(0.0)) for _, v in scalars(w)]
    if law_memory is not None:
        start = law.memory()
        variables_of += [
            Variable(v.text, LREAL, f"memory of {mode.value}: {f}", literal(getattr(start, f)))
            for f, v in law_memory.values.items()
        ]
    title = f"{mode.value}, mode {literal(law.code)}: {law.title}. Mode {literal(0.0)}: {MANUAL_MODE.law.title}."
    about = ABOUT_GUARD + (ABOUT_CHECKS if checks is not None else "") + (ABOUT_PREDICTION if w is not None else "")
    rhythm = f"Call it once every {literal(plc.t_cycle)} s. Inputs and outputs are in SI units, hoisting is positive."
    block = Unit(
        library.names.new(PREFIX + law.field),
        plain_text(f"{title}\n{rhythm}\nMemory, m_ before the name: {_remembered()}\n{about}"),
        "",
        (*inputs, *qualities, reset, settings),
        outputs,
        (*variables_of, *(v for v in body.variables if v.name in used)),
        lines,
    )
    head = (
        f"Controller {mode.value} of the crane {crane.name}, IEC 61131-3 Structured Text (LREAL, 64 bits).",
        f"Written by Stillhook {__version__} from the equations that it simulates with.",
        f"SHA-256 of the contents of the crane: {identity(crane)[1]}",
    )
    numbers = tuple(
        (v.text.removeprefix(f"{settings.name}."), number, path)
        for (path, v), number in zip(scalars(given), flat(cls(*(value for _, _, value in parts))), strict=True)
    )
    return Block(
        head=tuple(plain_text(line) for line in head),
        crane=crane.name,
        controller=mode.value,
        code=law.code,
        t_cycle=plc.t_cycle,
        structures=tuple(library.structures.values()),
        functions=tuple(unit for unit, _ in library.functions.values()),
        block=block,
        settings=numbers,
        memory=memory,
        plc=plc,
        control=control,
        drive=crane.plant.type.control,
        own=own,
        law=law,
        guard=guard,
        checks=checks,
        prediction=prediction,
    )


class Memories(NamedTuple):
    """What the block remembers: memory of the PLC, of the guard, of the law where it has one, of the checks where there
    are any, and of the prediction of the tip's motion."""

    m: Record
    g: Record
    law: Record | None
    k: Record | None
    w: Record | None


def _variables(cls: Any, names: Names, prefix: str) -> Record:
    """Variables for every number of a record, named by their paths."""
    return Record(
        cls,
        {
            f: _variables(t, names, f"{prefix}_{f}")
            if hasattr(t, "_fields")
            else Value(names.new(f"{prefix}_{f}"), float)
            for f, t in fields(cls)
        },
    )


def _number_of(body: Body, truth: Value, name: str) -> Value:
    """A truth value as 1.0 or 0.0."""
    number: Value = body.choice(truth, lambda: Value(literal(1.0), float), lambda: Value(literal(0.0), float), name)
    return number


def _cycle(
    body: Body,
    reading: Record,
    quality: Record,
    reset: Value,
    memories: Memories,
    law: Any,
    settings: Record,
    outputs: tuple[Variable, ...],
    first: str,
) -> None:
    """Statements of one cycle, in the order of `stillhook.kernels.plc_alone`: the guard, memory before the first one,
    the known displacement, observe, the law in force, command, the limits."""
    plc, guard, (m, g, law_memory, k, w) = settings.values["plc"], settings.values["guard"], memories
    qualities = Record(Sensed, {f: _number_of(body, v, f"good_{f}") for f, v in quality.values.items()})
    code, b = Value(literal(law.code), float), None
    if k is not None:
        checks = settings.values["checks"]
        b = body.kept(body.called(plain(doubts), [reading, qualities, m, g, k, checks, guard, plc]), "b")
        reading, qualities = b.values["y"], b.values["quality"]
    known = body.kept(body.called(plain(known_mode), [reading.values["mode"], code]), "known")
    asked = _number_of(body, reset, "asked")
    checked = body.called(plain(check), [reading, qualities, asked, known, m, g, guard, plc])
    if k is not None and b is not None:
        checked = body.kept(checked, "c")
        behind = [checked.values["y"], checked.values["m"], checked.values["g"], b.values["k"], checks, guard, plc]
        last = body.called(plain(concluded), behind)
        checked = Record(checked.cls, checked.values | {f: last.values[f] for f in ("y", "m", "g")})
        _assign(body, k, last.values["k"])
    y = body.kept(checked.values["y"], "y").values
    _assign(body, g, checked.values["g"])
    _assign(body, m, checked.values["m"])
    body.emit(f"IF {first} THEN")
    body.depth += 1
    start = body.called(plain(memory_before), [m, y["F"], y["s_w"], y["s_tip"], y["mode"], y["v_op"], plc])
    _assign(body, m, start)
    body.emit(f"{first} := FALSE;")
    body.depth -= 1
    body.emit("END_IF;")
    known = body.called(plain(known_displacement), [y["alpha_m"], m.values["u_m"], settings.values["control"]])
    y = y | {"alpha_m": body.kept(known, "alpha_known")}
    sensed = Record(Sensed, y)
    if w is None:
        later = body.called(plain(ahead), [sensed, plc.values["t_lead"], plc.values["t_lead_ff"]])
        t_a = Value(literal(0.0), float)
    else:
        of = settings.values["prediction"]
        after = body.called(plain(followed), [y["v_tip"], y["a_tip"], w, of, plc.values["t_cycle"]])
        _assign(body, w, body.kept(after, "after"))
        later, t_a = body.called(plain(foreseen), [sensed, w, of, plc])
    o = body.called(plain(observed), [sensed, later, t_a, m, plc])
    r = o.values["r"]

    def manual() -> Any:
        return body.called(plain(MANUAL_MODE.law.cycle), [r, plc]), _at_start(law)

    def chosen() -> Any:
        arguments = [r, plc, *([settings.values["own"]] if law.record is not None else [])]
        if law_memory is None:
            return body.called(plain(law.cycle), arguments), ()
        return body.called(plain(law.cycle), [*arguments, law_memory])

    if law.name == MANUAL_MODE.value:
        demand, after = manual()
    else:
        in_force = Value(f"{r.values['y'].values['mode'].text} = {literal(law.code)}", bool, COMPARISON)
        demand, after = body.choice(in_force, chosen, manual, "demand")
    wrong = Value(literal(0.0), float)
    if law_memory is not None:
        wrong, after = _sound(body, after, law)
    demand, after_law = body.called(plain(sound_demand), [demand, wrong, m, g])
    drive, new = body.called(plain(command), [o, demand, m, plc])
    drive = body.kept(body.called(plain(limited), [drive, plc]), "drive")
    _assign(body, m, new)
    _assign(body, g, after_law)
    if law_memory is not None:
        _assign(body, law_memory, after)
    for variable, value in zip(outputs, drive.values.values(), strict=False):
        body.emit(f"{variable.name} := {value.text};")
    for variable in outputs[len(drive.values) :]:
        body.emit(f"{variable.name} := {g.values[variable.name].text};")


def _sound(body: Body, memory: Record, law: Any) -> tuple[Value, Record]:
    """How many fields of a law's memory are not numbers, and the memory, at its start again where there is one."""
    ends = [Value(literal(FINITE * sign), float) for sign in (-1.0, 1.0)]
    each = [body.called(plain(outside), [v, *ends]).text for v in memory.values.values()]
    wrong = body.kept(Value(" + ".join(each), float, SUM), "wrong")
    good = Value(f"{wrong.text} < {literal(0.5)}", bool, COMPARISON)
    return wrong, body.choice(good, lambda: memory, lambda: _at_start(law), "law")


def _at_start(law: Any) -> Any:
    """Memory of a law before it comes into force."""
    if law.memory is None:
        return ()
    return Record(law.memory, {f: Value(literal(x), float) for f, x in law.memory()._asdict().items()})


def _assign(body: Body, memory: Record, new: Record) -> None:
    """New memory in place of the old one. What another part of it held is put aside first."""
    held = [v.text for _, v in scalars(memory)]
    changed = {own: v for own, (_, v) in zip(held, scalars(new), strict=True) if v.text != own}
    for own, v in changed.items():
        if v.text in held:
            changed[own] = body.new(f"{own}_before", float)
            body.emit(f"{changed[own].text} := {v.text};")
    for own, v in changed.items():
        body.emit(f"{own} := {v.text};")


def flat(record: Any) -> list[float]:
    """Numbers of nested records in their order."""
    return [x for part in record for x in (flat(part) if isinstance(part, tuple) else [part])]


def sensed_notes() -> dict[str, str]:
    """What each input is, with its unit."""
    return field_notes(Sensed)


def field_notes(cls: Any) -> dict[str, str]:
    """The comments next to the fields of a record."""
    source = inspect.getsource(cls)
    return {f: plain_text(re.search(rf"^    {f}: float  # (.*)$", source, re.M)[1]) for f in cls._fields}  # type: ignore[index]


def own_notes(law: Any) -> dict[str, str]:
    """What each of a controller's own settings is."""
    return {name: plain_text(setting.meaning) for name, setting in law.settings.items()}


def output_note(name: str) -> str:
    """What an output is, with its unit, in the words of the results."""
    entry = variables.BY_NAME[MEASURED.get(name, name)]
    return plain_text(f"{entry.meaning} [{'-' if entry.unit == '1' else entry.unit}]")


def _remembered() -> str:
    """What the PLC remembers, in the words of its record."""
    return paragraphs(Memory.__doc__ or "").removeprefix("What the PLC remembers: ")
