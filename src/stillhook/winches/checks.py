"""Whether a user's module is a winch type: each fault is one line with file and attribute. See
`stillhook.winches.interface`; the shipped ones are checked by a test."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

from stillhook.base import contract
from stillhook.base.contract import NAME, TEXT, Contract, Rule, fault, is_number
from stillhook.control.interface import DISPLACEMENT, SPEED, Sensed
from stillhook.control.plant import Hydraulics
from stillhook.control.plc import ActuatorCommands, Memory
from stillhook.control.registry import source_of
from stillhook.errors import SpecError
from stillhook.physics.hydraulics.swash import Servo
from stillhook.physics.records import fields
from stillhook.tables.table import Spec
from stillhook.units import KINDS, quote
from stillhook.winches.interface import (
    RECORDS,
    OtherMotors,
    PartSpeed,
    Stiffness,
    Stroke,
    Undeclared,
    Winch,
)
from stillhook.winches.load_path import host
from stillhook.winches.load_path.registry import check_path
from stillhook.winches.records import CommonSignals, Geometry, Tick, Tip

WINCH = Contract("A winch type", Winch, Undeclared, source_of)
RESERVED = ("truth",)
"""Names of plants that are no winch type: the reference plant for synthetic logs."""


def _positive(value: Any) -> bool:
    return is_number(value) and value > 0.0


def _not_negative(value: Any) -> bool:
    return is_number(value) and value >= 0.0


def _all_are(kind: type, test: Callable[[Any], bool] = lambda each: True) -> Callable[[Any], bool]:
    """Whether a value is a list or tuple of such."""
    return lambda value: isinstance(value, list | tuple) and all(isinstance(x, kind) and test(x) for x in value)


def _pair_of(test: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, tuple) and len(value) == 2 and all(map(test, value))


def _is_stiffness(value: Any) -> bool:
    if not isinstance(value, Stiffness) or not any(map(_positive, value.rates.values())):
        return False
    return all(map(_not_negative, (*value.rates.values(), value.viscous, value.dry, value.n_max)))


GIVES = {
    "motors": Rule(
        _all_are(object, lambda m: _positive(getattr(m, "count", 0)) and is_number(getattr(m, "J", ""))),
        "a tuple of sets of motors, each with count and J",
    ),
    "full_speed": Rule(_positive, "a number above 0 [rad/s]"),
    "stiffness": Rule(
        _is_stiffness,
        "a Stiffness of numbers, 0 or above, with at least one of rates above 0 [1/s]",
    ),
    "lag": Rule(_not_negative, "a number, 0 or above [s]"),
    "full_wire_speed": Rule(lambda v: v is None or _positive(v), "a number above 0 [m/s], or None"),
    "least_displacement": Rule(lambda v: _positive(v) and v <= 1.0, "a number above 0, at most 1 [-]"),
    "pump_units": Rule(_pair_of(_all_are(object, _positive)), "two tuples of numbers above 0"),
    "pump_flows": Rule(_pair_of(_not_negative), "a pair of numbers, 0 or above [m^3/s]"),
    "hydraulics": Rule(
        lambda v: isinstance(v, Hydraulics) and all(map(_not_negative, v)),
        "a stillhook.control.plant.Hydraulics of numbers, 0 or above",
    ),
    "pump_speed": Rule(lambda v: v is None or _positive(v), "a number above 0 [rad/s], or None"),
    "charge": Rule(_not_negative, "a number, 0 or above [Pa]"),
    "other_motors": Rule(_all_are(OtherMotors), "a list of OtherMotors"),
    "refusal": Rule(lambda v: v == "" or contract.is_text(v), "a text of one line, or an empty one"),
    "notes": Rule(_all_are(str, contract.is_text), "a list of texts of one line"),
    "part_speeds": Rule(_all_are(PartSpeed), "a list of PartSpeed"),
    "stroke": Rule(lambda v: v is None or isinstance(v, Stroke), "a Stroke, or None"),
}
"""What functions on a crane must give, where they are those of the user."""


def _finite(record: Any) -> bool:
    """Whether a record holds finite numbers alone."""
    return all(_finite(each) if isinstance(each, tuple) else is_number(each) for each in record)


def check_module(module: ModuleType) -> None:
    """A module is a winch type. Errors: SpecError."""
    WINCH.check(module)
    for name, rule in RECORDS.items():
        contract.check_record(module, name, rule)
    _check_numbers(module)
    contract.check_values(module, _values(module))
    try:
        check_path(module.PATH)
    except SpecError as problem:
        raise SpecError(f"{contract.file_of(module).name}: PATH: {problem}") from None
    for check in (_check_names, _check_rows, _check_limits, _check_pairs):
        check(module)


def check_result(module: ModuleType, name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function on a crane gives. Errors: SpecError where it is nothing that it may give."""
    value = function(*arguments)
    if name in GIVES and not GIVES[name].holds(value):
        raise fault(module, f"{name} gave {quote(value)}", f"It must give {GIVES[name].allowed}")
    return value


def check_params(module: ModuleType, params: Any) -> None:
    """What `pack` gave, and what follows from it at rest. Errors: SpecError."""
    if not isinstance(params, module.Params) or not _finite(params):
        raise fault(module, f"pack gave {quote(params)}", "It must give Params, whose numbers are finite")
    check_result(module, "stiffness", module.stiffness, params)
    with contextlib.suppress(ZeroDivisionError, OverflowError):  # kernels go on with infinity there
        _check_at_rest(module, params)


def _check_at_rest(module: ModuleType, p: Any) -> None:
    """What the equations give for a load at rest, called as the engine does before a run. Errors: SpecError."""

    def result_of(name: str, kind: Any, *arguments: Any) -> Any:
        value = getattr(module, name)(*arguments)
        if not (is_number(value) if kind is float else isinstance(value, kind)):
            raise fault(module, f"{name} gave {quote(value)}", f"It must give a {kind.__name__}")
        return value

    path, s_w = module.PATH, p.hoist.s_w_0
    tick = Tick(**dict.fromkeys(Tick._fields, 0.0))._replace(f_pump=1.0, f_known=1.0, f_passive=1.0)
    m = Memory(**dict.fromkeys(Memory._fields, 0.0))._replace(F=p.hoist.load.W, u_m=1.0, held=1.0, stroke=1.0)
    drive = ActuatorCommands(u_p=0.0, u_m=1.0, u_ff=0.0, u_raw=0.0, e_c=0.0, brake=0.0)
    geo = result_of("geometry", Geometry, s_w, p)
    x, y = result_of("start", module.State, s_w, tick, p), path.start(s_w, tick, p)
    q = path.at(result_of("wire_speed", float, x, geo), y, geo, Tip(0.0, 0.0), p)
    r = result_of("sense", Sensed, x, y, q, m, tick, geo, p)
    commanded = result_of("actuate", tuple, drive, r, x, m, m, tick, geo, p)
    kinds = (module.Command, Memory, ActuatorCommands)
    if len(commanded) != len(kinds) or not all(map(isinstance, commanded, kinds)):
        raise fault(module, f"actuate gave {quote(commanded)}", "It must give (Command, Memory, ActuatorCommands)")
    u = commanded[0]
    x = result_of("settle", module.State, x, q, u, tick, geo, p)
    c = result_of("circuit", module.Circuit, x, q, u, geo, p)
    result_of("rates", module.State, c, x, q, u, geo, p)
    result_of("limits", module.Limits, c, x, q, u, p)
    result_of("powers", module.Powers, c, x, q, p)
    result_of("stored_energy", float, c, x, geo, p)
    if hasattr(module, "bristle_after"):
        result_of("bristle_after", float, c, x, p, 1.0e-3)
    signals = result_of("signals", module.Signals, c, x, q, u, geo, p)
    every = SimpleNamespace(**dict.fromkeys(CommonSignals._fields, 0.0), **signals._asdict())
    result_of("fold_extremes", module.Extremes, module.BLANK, every)


def _values(module: ModuleType) -> dict[str, Rule]:
    """What each value of a module must be."""
    numbers = _numbers(module)
    powers = contract.names_of(module.Powers._fields, "fields of Powers")
    return {
        "NAME": Rule(lambda v: NAME.holds(v) and v not in RESERVED, f"{NAME.allowed}, and not {', '.join(RESERVED)}"),
        "TITLE": TEXT,
        "TABLES": Rule(
            lambda v: _is_models(v) or (isinstance(v, tuple) and all(map(contract.is_text, v))),
            "models of tables by name, each a stillhook.tables.table.Spec, or a tuple of names of known tables",
        ),
        "PATH": Rule(lambda v: isinstance(v, ModuleType), "a module, such as stillhook.winches.load_path.load"),
        "SUPPLIED": contract.names_of(module.Powers._fields, "fields of Powers", least=1),
        "WITHIN": powers,
        "BLANK": Rule(lambda v: isinstance(v, module.Extremes) and _finite(v), "an Extremes of numbers"),
        "SHOWN": Rule(
            lambda v: (
                isinstance(v, dict) and set(v) <= set(numbers) and all(isinstance(head, str) for head in v.values())
            ),
            f"heads of columns by name, of {', '.join(numbers)}",
        ),
        "CONTROL": contract.one_of(DISPLACEMENT, SPEED),
        "TUNED": Rule(
            lambda v: (
                isinstance(v, dict) and all(_is_field(module, p) for p in v) and all(map(contract.is_range, v.values()))
            ),
            "pairs of numbers that rise [SI], by path of a number in a table of TABLES",
        ),
        "SERVOS": Rule(
            lambda v: isinstance(v, dict) and all(_is_servo(module, u, pair) for u, pair in v.items()),
            "pairs of a path of a table in TABLES and of a Servo in Params, by field of Command",
        ),
        "PER_MOTOR": Rule(
            lambda v: isinstance(v, tuple) and all(_is_field(module, path) for path in v),
            "a tuple of paths of tables in TABLES",
        ),
    }


def _is_models(tables: Any) -> bool:
    return isinstance(tables, dict) and all(
        isinstance(name, str) and name.isidentifier() and isinstance(model, type) and issubclass(model, Spec)
        for name, model in tables.items()
    )


def _is_field(module: ModuleType, path: Any) -> bool:
    """Whether a path leads to a field of a table of a module; of known tables, whose models are above, the first word
    counts alone."""
    if not isinstance(path, str):
        return False
    head, *rest = path.split(".")
    model = module.TABLES.get(head) if isinstance(module.TABLES, dict) else None
    for name in rest if model is not None else ():
        field = getattr(model, "model_fields", {}).get(name)
        if field is None:
            return False
        model = field.annotation
    return head in module.TABLES


def _is_servo(module: ModuleType, command: Any, pair: Any) -> bool:
    """Whether a pair is the table and the record of a displacement control, and a command one that it can follow."""
    if command not in module.Command._fields or not isinstance(pair, tuple) or len(pair) != 2:
        return False
    record, names = module.Params, str(pair[1]).split(".")
    for name in names:
        record = dict(fields(record)).get(name) if hasattr(record, "_fields") else None
    return record is Servo and _is_field(module, pair[0])


def _numbers(module: ModuleType) -> list[str]:
    """Names of its own numbers of a run."""
    return [*module.Extremes._fields, *(f"{name}_time" for name in module.Limits._fields)]


def _check_names(module: ModuleType) -> None:
    """No name of a record is one of those that it is joined with. Errors: SpecError."""
    powers = (*module.PATH.Powers._fields, *host.Powers._fields)
    for record, taken in (("Signals", CommonSignals._fields), ("Powers", powers)):
        for name in getattr(module, record)._fields:
            if name in taken:
                raise fault(module, f"{record}.{name} is there already, of every winch or its load path", "Rename it")


def _check_numbers(module: ModuleType) -> None:
    """Every number of a run has a name of its own. Errors: SpecError."""
    for name, times in Counter(_numbers(module)).items():
        if times > 1:
            raise fault(module, f"Extremes.{name} is also the time of Limits.{name[:-5]}", "Rename one")


def _check_rows(module: ModuleType) -> None:
    """Kinds, units and meanings of signals and extremes. Errors: SpecError."""
    for record in ("Signals", "Extremes"):
        for name, row in contract.marks_of(getattr(module, record), RECORDS[record].mark).items():
            if row.kind not in ("", *KINDS):
                raise fault(module, f"{record}.{name}: unknown kind {row.kind!r}", f'Choose "" or {", ".join(KINDS)}')
            unit = KINDS[row.kind].si if row.kind else "1"
            if row.unit != unit:
                do = f'A {row.kind or "plain number"} is in "{unit}"'
                raise fault(module, f"{record}.{name}: unit {row.unit!r}", do)
            _check_meaning(module, f"{record}.{name}", row.meaning)


def _check_limits(module: ModuleType) -> None:
    """Words for limits. Errors: SpecError."""
    for name, cause in contract.marks_of(module.Limits, RECORDS["Limits"].mark).items():
        if not contract.is_text(cause.status) or cause.status == "ok" or "," in cause.status:
            do = 'It must be words for a run\'s status, without a comma, and not "ok"'
            raise fault(module, f"Limits.{name}: status {cause.status!r}", do)
        _check_meaning(module, f"Limits.{name}", cause.meaning)


def _check_meaning(module: ModuleType, place: str, meaning: Any) -> None:
    if not contract.is_text(meaning):
        raise fault(module, f"{place}: meaning {meaning!r}", f"It must be {TEXT.allowed}")


def _check_pairs(module: ModuleType) -> None:
    """What only makes sense together. Errors: SpecError."""
    within = getattr(module, "WITHIN", ())
    into = [name for name in within if name in module.SUPPLIED]
    if within and (len(into) in (0, len(within)) or len(into) == len(module.SUPPLIED)):
        do = "WITHIN names what goes in and what goes out inside the winch; SUPPLIED has something from outside besides"
        raise fault(module, f"WITHIN = {within!r}, SUPPLIED = {module.SUPPLIED!r}", do)
    has_z, advances = "z" in module.State._fields, hasattr(module, "bristle_after")
    if has_z != advances:
        wrong = "State.z without bristle_after" if has_z else "bristle_after without State.z"
        raise fault(module, wrong, "A bristle needs both: State.z, and the function that advances it")
