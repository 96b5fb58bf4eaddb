"""The function block of one controller on one crane: what it reads, remembers and commands, and its cycle."""

from __future__ import annotations

import inspect
import re
from typing import Any, NamedTuple

from stillhook import variables
from stillhook._version import __version__
from stillhook.base.choice import choice
from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands, Memory, command, memory_before, observe
from stillhook.control.registry import MANUAL_MODE, Mode
from stillhook.engine.pack.winch import pack
from stillhook.errors import StillhookError
from stillhook.export.plc.program import LREAL, PREFIX, Block, Names, Unit, Variable, literal, plain_text
from stillhook.export.plc.translate import COMPARISON, Body, Library, Record, Value, paragraphs, scalars
from stillhook.kernels.c99.expressions import plain
from stillhook.physics.hydraulics.swash import MotorControl, known_displacement
from stillhook.spec.crane import Crane, own_settings
from stillhook.spec.scenario import Scenario

STARTS = {"f_pump": 1.0, "alpha_m": 1.0, "K_wire": 1.0}
"""Inputs that are 1 until something is connected to them: all pumps, full displacement, outermost layer."""
MEASURED = {"e_c": "e_c_measured"}
"""Outputs that results call otherwise: the PLC knows the tip as its motion unit measures it."""
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
    active = getattr(packed.params, "active", None)
    control = MotorControl(offset=0.0, half_width=0.0, feedback=1.0) if active is None else active.control
    plc, memory = packed.params.plc, packed.memory._replace(mode=0.0, F=0.0)  # both are read in the first cycle
    library = Library()
    parts = [("plc", type(plc), plc), ("control", MotorControl, control)]
    parts += [("own", law.record, own)] if law.record is not None else []
    cls: Any = NamedTuple("Settings", [(name, t) for name, t, _ in parts])  # type: ignore[misc]
    about = f"Settings of {mode.value} on {crane.name}, SI units. Change them here or in the block's input `settings`."
    notes = {law.record: own_notes(law)} if law.record is not None else {}
    whole = library.structure(cls, cls(*(value for _, _, value in parts)), about, notes)
    names = Names()
    inputs = tuple(
        Variable(names.new(name), LREAL, text, literal(STARTS[name]) if name in STARTS else "")
        for name, text in sensed_notes().items()
    )
    outputs = tuple(Variable(names.new(name), LREAL, output_note(name)) for name in ActuatorCommands._fields)
    settings = Variable(names.new("settings"), whole, "initial values are those of this crane")
    first = names.new("first")
    kept = {name: names.new(f"m_{name}") for name in Memory._fields}
    body = Body(library, names)
    reading = Record(Sensed, {f: Value(v.name, float) for f, v in zip(Sensed._fields, inputs, strict=True)})
    m = Record(Memory, {f: Value(own_name, float) for f, own_name in kept.items()})
    law_memory = None
    if law.memory is not None:
        law_memory = Record(law.memory, {f: Value(names.new(f"law_{f}"), float) for f in law.memory._fields})
    given = library.reference(cls, settings.name)
    _cycle(body, reading, m, law, law_memory, given, outputs, first)
    lines = tuple(body.lines)
    used = set(re.findall(r"\w+", "\n".join(lines)))
    variables_of = [
        Variable(first, "BOOL", "TRUE until the first cycle is done", "TRUE"),
        *(
            Variable(own_name, LREAL, "", literal(getattr(memory, f)))
            for f, own_name in kept.items()
            if own_name in used
        ),
    ]
    if law_memory is not None:
        start = law.memory()
        variables_of += [
            Variable(v.text, LREAL, f"memory of {mode.value}: {f}", literal(getattr(start, f)))
            for f, v in law_memory.values.items()
        ]
    title = f"{mode.value}, mode {literal(law.code)}: {law.title}. Mode {literal(0.0)}: {MANUAL_MODE.law.title}."
    rhythm = f"Call it once every {literal(plc.t_cycle)} s. Inputs and outputs are in SI units, hoisting is positive."
    block = Unit(
        library.names.new(PREFIX + law.field),
        plain_text(f"{title}\n{rhythm}\nMemory, m_ before the name: {_remembered()}"),
        "",
        (*inputs, settings),
        outputs,
        (*variables_of, *(v for v in body.variables if v.name in used)),
        lines,
    )
    head = (
        f"Controller {mode.value} of the crane {crane.name}, IEC 61131-3 Structured Text (LREAL, 64 bits).",
        f"Written by Stillhook {__version__} from the equations that it simulates with.",
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
    )


def _cycle(
    body: Body,
    reading: Record,
    m: Record,
    law: Any,
    law_memory: Record | None,
    settings: Record,
    outputs: tuple[Variable, ...],
    first: str,
) -> None:
    """Statements of one cycle, in the order of `stillhook.kernels.plc_alone`: memory before the first one, the known
    displacement, observe, the law in force, command."""
    plc, y = settings.values["plc"], reading.values
    body.emit(f"IF {first} THEN")
    body.depth += 1
    start = body.called(plain(memory_before), [m, y["F"], y["s_w"], y["s_tip"], y["mode"], y["v_op"], plc])
    _assign(body, m, start)
    body.emit(f"{first} := FALSE;")
    body.depth -= 1
    body.emit("END_IF;")
    known = body.called(plain(known_displacement), [y["alpha_m"], m.values["u_m"], settings.values["control"]])
    y = y | {"alpha_m": body.kept(known, "alpha_known")}
    o = body.called(plain(observe), [Record(Sensed, y), m, plc])
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
    drive, new = body.called(plain(command), [o, demand, m, plc])
    drive = body.kept(drive, "drive")
    _assign(body, m, new)
    if law_memory is not None:
        _assign(body, law_memory, after)
    for variable, value in zip(outputs, drive.values.values(), strict=True):
        body.emit(f"{variable.name} := {value.text};")


def _at_start(law: Any) -> Any:
    """Memory of a law before it comes into force."""
    if law.memory is None:
        return ()
    return Record(law.memory, {f: Value(literal(x), float) for f, x in law.memory()._asdict().items()})


def _assign(body: Body, m: Record, new: Record) -> None:
    """New memory in place of the old one. What another field of it held is put aside first."""
    old = {v.text for v in m.values.values()}
    changed = {f: v for f, v in new.values.items() if v.text != m.values[f].text}
    for f, v in changed.items():
        if v.text in old:
            aside = body.new(f, float)
            body.emit(f"{aside.text} := {v.text};")
            changed[f] = aside
    for f, v in changed.items():
        body.emit(f"{m.values[f].text} := {v.text};")


def flat(record: Any) -> list[float]:
    """Numbers of nested records in their order."""
    return [x for part in record for x in (flat(part) if isinstance(part, tuple) else [part])]


def sensed_notes() -> dict[str, str]:
    """What each input is, with its unit: the comments beside the fields of `Sensed`."""
    source = inspect.getsource(Sensed)
    return {f: plain_text(re.search(rf"^    {f}: float  # (.*)$", source, re.M)[1]) for f in Sensed._fields}  # type: ignore[index]


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
