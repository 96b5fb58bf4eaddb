"""The function block that makes the crane tip's motion of the signals of a motion unit and of the boom's encoders."""

from __future__ import annotations

import inspect
import re

from stillhook._version import __version__
from stillhook.export.plc.program import LREAL, PREFIX, Names, Program, Unit, Variable, literal, plain_text
from stillhook.export.plc.translate import Body, Library, Record, Value, documentation
from stillhook.kernels.c99.expressions import plain
from stillhook.physics.tip_kinematics import Attitude, BoomLengths, BoomPose, Jet, tip_motion

ANGLES = {
    "slew": "angle from the bow to port [rad]",
    "main": "main boom above the horizontal [rad]",
    "knuckle": "knuckle boom below the line of the main boom [rad]",
}
MOTIONS = {"heave": "up [m]", "roll": "port side up [rad]", "pitch": "bow up [rad]"}
OUTPUTS = {
    "s_tip": "crane tip height above z_0, up positive [m]",
    "v_tip": "its speed [m/s]",
    "a_tip": "its acceleration [m/s^2]",
}
RATES = {"x": "", "v": "v_", "a": "a_"}
"""What stands before the name of a quantity for itself, its rate and its acceleration."""


def tip_block(boom: BoomLengths) -> Program:
    """The function block, with these lengths as the first values of its settings.

    >>> from stillhook.export.plc.tip import tip_block
    >>> tip_block(BoomLengths(0.0, 0.0, 8.0, 0.0, 25.0, 15.0, 30.0, 1.0)).block.name
    'SH_tip'
    """
    library, names = Library(), Names()
    text = "Lengths of the crane, SI units. Change them here or in the block's input `settings`."
    notes = re.sub(r"\s+", " ", inspect.getdoc(BoomLengths) or "")
    structure = library.structure(BoomLengths, boom, plain_text(f"{text}\n{notes}"))
    inputs, records = [], []
    for cls, quantities in ((Attitude, MOTIONS), (BoomPose, ANGLES)):
        jets = {}
        for quantity, meaning in quantities.items():
            own = {
                field: Variable(names.new(f"{mark}{quantity}"), LREAL, _note(meaning, field), literal(0.0))
                for field, mark in RATES.items()
            }
            inputs += list(own.values())
            jets[quantity] = Record(Jet, {field: Value(v.name, float) for field, v in own.items()})
        records.append(Record(cls, jets))
    settings = Variable(names.new("settings"), structure, "initial values are those of this crane")
    outputs = tuple(Variable(names.new(name), LREAL, meaning) for name, meaning in OUTPUTS.items())
    body = Body(library, names)
    result = body.called(plain(tip_motion), [*records, library.reference(BoomLengths, settings.name)])
    for variable, value in zip(outputs, result.values.values(), strict=True):
        body.emit(f"{variable.name} := {value.text};")
    about = f"{documentation(tip_motion)}\nCall it in every cycle before the controller, whose inputs s_tip, v_tip and"
    block = Unit(
        library.names.new(f"{PREFIX}tip"),
        plain_text(f"{about} a_tip take its outputs."),
        "",
        (*inputs, settings),
        outputs,
        tuple(body.variables),
        tuple(body.lines),
    )
    head = (
        "Motion of a crane tip from a motion unit and a boom, IEC 61131-3 Structured Text (LREAL, 64 bits).",
        f"Written by Stillhook {__version__} from the equations that it simulates with.",
    )
    structures, functions = tuple(library.structures.values()), tuple(unit for unit, _ in library.functions.values())
    return Program(head, structures, functions, block)


def _note(meaning: str, field: str) -> str:
    """What an input is, with its unit."""
    unit = meaning[meaning.index("[") + 1 : -1]
    return {"x": meaning, "v": f"its rate [{unit}/s]", "a": f"its acceleration [{unit}/s^2]"}[field]
