"""A crane's winch as the C source that other programs compile: records, tables, kernels, and core.c around them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook import units
from stillhook.control.guard import FINITE, guard_at_start
from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands
from stillhook.control.registry import ControlLaw
from stillhook.control.sensors import Sensor, sensor_named
from stillhook.engine.arguments import SERIES_STEP, check_step, steps_per_cycle
from stillhook.engine.certificate import objections
from stillhook.engine.inputs import hermite_weights, scale_weights
from stillhook.engine.pack.guard import guard_in, guard_settings, motor_control
from stillhook.engine.pack.winch import pack, water_around
from stillhook.engine.runner import nothing
from stillhook.engine.saved import SETTING, Kind, Ranges, ranges
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.run import Ready, first_lane
from stillhook.errors import ExportError
from stillhook.export.twin import ports as p
from stillhook.export.twin.vessel_tip import GIVEN, tip_of_vessel
from stillhook.kernels import plc_alone
from stillhook.kernels.build import driver, interpreted
from stillhook.kernels.c99.expressions import SubsetError
from stillhook.kernels.c99.source import Translator, entry_types
from stillhook.kernels.lanes import flatten, offset, paths, size
from stillhook.physics.scalar import G
from stillhook.sea.vessel.vessel_tip import VESSEL as MEANINGS
from stillhook.sea.vessel.vessel_tip import VesselTip, lengths
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.spec.validity import EDGE, Envelope
from stillhook.winches.records import Tick

BOTH, PLANT, CONTROLLER = "plant+controller", "plant", "controller"
CONTENTS = (BOTH, PLANT, CONTROLLER)
TIP, WIRE, VESSEL = "tip", "wire", "vessel"
COUPLINGS = (TIP, WIRE, VESSEL)
NEVER = 2**62
"""Stands for a cycle that never comes: no windows are kept, and none is the last."""
SHORTEST_TEXT = 256
HERE = Path(__file__).parent


@dataclass(frozen=True)
class Export:
    """A winch for other programs.

    ports: variables, whose place in the list is the value reference; source: C99 text of everything, all of it static
    (`core.h` says what it offers); identity: SHA-256 of the source; t_cycle: PLC cycle, of which a step is a whole
    number [s]; identifier: name of the crane in C; modes: code -> name of every controller that it holds.
    """

    crane: Crane
    case: Scenario
    contents: str
    coupling: str
    ports: tuple[p.Port, ...]
    source: str
    identity: str
    t_cycle: float
    identifier: str
    modes: dict[int, str]

    def port(self, name: str) -> p.Port:
        """A variable by its name. Errors: KeyError."""
        return next(each for each in self.ports if each.name == name)

    def number(self, name: str) -> int:
        """Value reference of a variable. Errors: KeyError."""
        for i, each in enumerate(self.ports):
            if each.name == name:
                return i
        raise KeyError(name)


def export(
    crane: Crane, case: Scenario, contents: str = BOTH, coupling: str = TIP, *, step: str | None = None
) -> Export:
    """A crane's winch for other programs.

    Parameters: crane; case: load, water, wire out and mode with which it begins, and the controllers of its modes (its
    motion, duration and operator are the host's); contents: "plant+controller", "plant" or "controller"; coupling:
    "tip" (motion of the crane tip in), "wire" (also the tension at the tip in; wire out and its speed out), or "vessel"
    (heave, roll and pitch in, and the angles of the boom: the case's tip is a `stillhook.VesselTip`); step:
    integration step as in `stillhook.simulate`.

    Errors: ExportError, one line, for what cannot be exported; ScenarioError as in `stillhook.simulate`.
    """
    _known("contents", contents, CONTENTS)
    _known("coupling", coupling, COUPLINGS)
    if contents == CONTROLLER and coupling != TIP:
        raise ExportError(f"coupling {coupling}: a controller alone has no wire and no tip. Leave the coupling out.")
    check(crane, case)
    _check_case(case)
    tip = _vessel(case, coupling)
    if interpreted():
        raise ExportError("NUMBA_DISABLE_JIT is set: kernels are not translated. Unset it.")
    n_sub = steps_per_cycle(crane, step, SERIES_STEP)
    ready = Ready.of(crane, case)
    check_step(ready.winch, ready.drive.t_cycle / n_sub)
    try:
        made = (
            _controller(crane, ready)
            if contents == CONTROLLER
            else _winch(crane, ready, contents, coupling, n_sub, tip)
        )
    except SubsetError as problem:
        raise ExportError(
            f'"{crane.name}": a winch type or controller of it is outside what is translated to C: {problem}'
        ) from None
    laws = p.laws_of(crane, ready.winch.extra_controllers)
    parts = [_part("core.h"), made.text, *_tables(crane, made, laws)]
    parts += [_part(f"{name}.c") for name in ("motion", "core", "reading", "state")]
    body = "\n".join(parts)
    identity = hashlib.sha256(body.encode()).hexdigest()
    return Export(
        crane=crane,
        case=case,
        contents=contents,
        coupling=coupling,
        ports=made.ports,
        source=f'#define SH_IDENTITY "{identity}"\n{body}',
        identity=identity,
        t_cycle=crane.control.t_cycle,
        identifier=p.identifier(crane.name),
        modes={round(law.code): law.name for law in laws},
    )


def _part(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _known(what: str, value: str, allowed: Sequence[str]) -> None:
    if value not in allowed:
        raise ExportError(f"{what} = {units.quote(value)}: choose {', '.join(allowed[:-1])} or {allowed[-1]}.")


def _vessel(case: Scenario, coupling: str) -> VesselTip | None:
    """The boom and its motion unit where the vessel moves the tip. Errors: ExportError for a case without, and for what
    a host's motion unit does."""
    if coupling == WIRE and isinstance(case.tip, VesselTip) and case.tip.unit.passes:
        return case.tip  # for hosts whose vessel is seen by a motion unit
    if coupling != VESSEL:
        return None
    if not isinstance(case.tip, VesselTip):
        raise ExportError("coupling vessel: the case's tip has no boom. Give a case with [scenario.tip] boom.")
    if not case.tip.unit.passes:
        raise ExportError(
            "unit: filter, delay and noise of the motion unit are not exported, since unit_heave, roll and pitch are"
            " what the PLC reads. Leave them out of the case and make them in the host."
        )
    return case.tip


def _check_case(case: Scenario) -> None:
    """Refuse what only a run of Stillhook does, rather than leave it out in silence."""
    s = case.sensors
    if any((s.delay, s.noise_s_tip, s.noise_v_tip, s.noise_a_tip, s.noise_s_w, s.noise_F, s.step_s_tip, s.step_v_tip)):
        raise ExportError(
            "sensors: delay, noise and steps of the motion unit are not exported, since inputs are what the PLC reads."
            " Leave them out of the case and make them in the host."
        )
    if s.disturbed:
        raise ExportError(
            f"sensors: errors of {', '.join(s.disturbed)} are not exported. Leave the tables out of the case and make"
            " them in the host."
        )
    if case.power_loss is not None:
        raise ExportError(
            "power_loss: a host gives it by the inputs f_pump, f_known and f_passive. Leave it out of the case."
        )
    if case.commands is not None:
        raise ExportError('commands: a host gives them to the plant alone (contents "plant"). Leave them out.')


@dataclass(frozen=True)
class Made:
    """What differs between a winch and a controller: C text, ports, and numbers of the tables."""

    text: str
    ports: tuple[p.Port, ...]
    limits: list[p.Limit]
    names: tuple[str, ...]  # inputs
    record: list[float]
    row: list[float]
    beginning: list[float]
    defines: dict[str, int]
    columns: list[tuple[int, int]]
    lane: Ranges  # what the numbers of a lane may be
    of_row: Ranges  # and those of a row
    wire_out: int = 0  # place of s_w in a lane
    quintic: Sequence[float] = ()


def _translated(entries: dict[str, Any]) -> str:
    translator = Translator(static=True)
    for name, function in entries.items():
        fn = getattr(function, "py_func", function)
        translator.function(fn, entry_types(fn), export=name)
    return translator.source().replace("static void sh_", "static SH_UNUSED void sh_")


def _winch(crane: Crane, ready: Ready, contents: str, coupling: str, n_sub: int, tip: VesselTip | None) -> Made:
    """Winch with its PLC, or, by commands from outside, without."""
    wire = coupling == WIRE
    winch, case = ready.winch, ready.drive.case
    both = contents == BOTH
    d = driver(
        winch.name,
        1,
        winch.setup._replace(path=("host",) if wire else (), guarded=both, checks=both and winch.setup.checks),
        winch.extra_controllers,
    )
    tick = Tick(*ready.drive.full_row(0, still=True))._replace(v_op=0.0, s_op=0.0)
    if contents == PLANT:
        tick = tick._replace(override=1.0, u_m=1.0)
    if wire:
        tick = tick._replace(s=float(winch.params.hoist.load.W), s_m=0.0, v_m=0.0, a_m=0.0)
    allowed: Any = guard_settings(crane, winch.params.plc, motor_control(winch.params), hosted=True)
    # the path of the operator is the core's own, and has no end
    least, most = allowed.least._replace(s_op=-FINITE), allowed.most._replace(s_op=FINITE)
    allowed = allowed._replace(least=least, most=most)
    guards = guard_in(crane, winch.params) | {"guard": guard_at_start(allowed)} if both else {}
    record = flatten(first_lane(d, winch, tick, guards))
    units_of = crane.plant.type.pump_units(crane)
    shares = (("f_pump", "f_known") if units_of[0] else ()) + (("f_passive",) if units_of[1] else ())
    moved = tuple(MEANINGS) if coupling == VESSEL else p.MOTION
    names = (*(("F_w",) if wire else ()), *moved, "v_op", "mode", *shares)
    names += p.COMMANDS if contents == PLANT else ()
    where = [p.columns(name, wire=wire) for name in names]
    row = [float(x) for x in tick]
    starts = {name: row[first] for name, (first, _) in zip(names, where, strict=True) if first >= 0}
    starts |= {} if tip is None or wire else {name: getattr(tip.boom, f) for name, f in POSE.items()}
    laws = p.laws_of(crane, winch.extra_controllers)
    with_settings: list[ControlLaw | Sensor] = [*laws, *map(sensor_named, winch.setup.sensors)]
    passed = p.limits(crane, d)
    params, law_at = offset(d.Lane, "p", 1), offset(d.Lane, "laws", 1)
    guard = law_at + offset(d.LawRecord, "guard", 1) if both else 0
    found = (
        *p.inputs(names, starts, laws),
        *(p.guards(guard) if both else ()),
        *p.beginnings(crane, case, load=not wire and _load_is_free(crane, case)),
        p.port("input_time", "fixed", ("SH_OF_OPTION", 0), kind="integer", start=1.0, least=0.0, most=1.0),
        *p.settings(
            type(winch.params.plc), params + _first(d.Params, ".plc"), record, with_settings, d.LawRecord, law_at
        ),
        *p.outputs(d, passed, set(names), laws),
        *(p.guard_outputs(guard) if both else ()),
        *(p.readings("output", "SH_OF_SENSED") if contents == PLANT else ()),
    )
    entries = {f"sh_kernel_{name}": getattr(d, name) for name in ("run", "at_rest", "prepare")}
    if contents == PLANT:
        entries["sh_kernel_read"] = d.read
    if tip is not None:
        entries["sh_kernel_tip"] = tip_of_vessel
    defines = {
        "SENSED": size(Sensed),
        "STATES": size(d.State),
        "N_SUB": n_sub,
        "READS": int(contents == PLANT),
        "TICK": offset(d.Lane, "tick", 1),
        "MOTION": Tick._fields.index("s_m"),
        "TRUE": -1 if wire else 0,
        "TENSION": 0 if wire else -1,
        "VESSEL": GIVEN if coupling == VESSEL else 0,
        "BOOM": 0 if tip is None else GIVEN,
        "SPEED": Tick._fields.index("v_op"),
        "MODE_COLUMN": Tick._fields.index("mode"),
    }
    y = offset(d.Lane, "y", 1) + d.Signals._fields.index("s_w")
    full = float(winch.params.hoist.drum.L_full)
    lane = ranges(paths(d.Lane), wire=full, tension=wire, settings=_settings(found))
    at_tick = offset(d.Lane, "tick", 1)
    return Made(
        text=_translated(entries) + ("" if tip is None else _boom(tip)),
        ports=found,
        limits=passed,
        names=names,
        record=record,
        row=row,
        beginning=[case.load, crane.hook_mass, *water_around(case), case.s_w],
        defines=defines,
        columns=where,
        lane=lane,
        of_row=lane.at(slice(at_tick, at_tick + len(Tick._fields))),
        wire_out=y,
        quintic=scale_weights(hermite_weights(n_sub), ready.drive.t_cycle).tolist(),
    )


POSE = {"slew": "slew", "main": "main_angle", "knuckle": "knuckle_angle"}


def _boom(tip: VesselTip) -> str:
    """Lengths of the boom from the point of the motion, and from the motion unit; what is given on a level ship; and
    where the tip is then, from the motion unit."""
    boom, unit = tip.boom, tip.unit
    level = [0.0] * 9 + [x for f in POSE.values() for x in (getattr(boom, f), 0.0, 0.0)] + [0.0] * 3
    arrays = {
        "sh_boom": [*lengths(boom), *lengths(boom, unit.at, unit.exact)],
        "sh_level": level,
        "sh_lever": [a - b for a, b in zip(boom.tip, unit.at, strict=True)],
    }
    return "".join(f"SH_UNUSED {_array(name, values, const=False)}" for name, values in arrays.items())


def _settings(ports: Iterable[p.Port]) -> dict[int, tuple[float, float]]:
    """Places in a lane of what may change while it runs, with their ranges in a saved state."""
    lane = (each for each in ports if each.place[0] == "SH_OF_LANE")
    return {each.place[1]: (max(each.least, -SETTING[1]), min(each.most, SETTING[1])) for each in lane}


def _first(record: type, path: str) -> int:
    """Place of the first number of a part of a record."""
    return next(i for i, each in enumerate(paths(record)) if each.startswith(f"{path}."))


def _load_is_free(crane: Crane, case: Scenario) -> bool:
    """Whether nothing but what hangs from the wire follows from the load: not so where an accumulator is charged for
    it."""

    def rest(load: float) -> list[float]:
        params = pack(crane, case.model_copy(update={"load": load})).params
        kind: type = type(params.hoist.load)
        return flatten(params._replace(hoist=params.hoist._replace(load=nothing(kind))))

    return rest(case.load) == rest(0.5 * case.load + 1.0)


def _controller(crane: Crane, ready: Ready) -> Made:
    """The PLC alone."""
    winch = ready.winch
    extra = winch.extra_controllers
    k = plc_alone.kernel(extra, crane.plant.type.control, True, crane.control.guard is not None, winch.setup.predicts)
    control, plc = motor_control(winch.params), winch.params.plc
    guard = guard_at_start(guard_settings(crane, plc, control, hosted=True))
    guards = guard_in(crane, winch.params) | {"guard": guard}
    record = flatten(k.Lane(winch.memory, k.laws.blank(winch.settings, **guards), plc, control))
    law_at = offset(k.Lane, "laws", 1)
    at = law_at + offset(k.laws.Record, "guard", 1)
    laws = p.laws_of(crane, extra)
    names = tuple(f"sensed_{name}" for name in Sensed._fields)
    starts = dict.fromkeys(("sensed_f_pump", "sensed_alpha_m", "sensed_K_wire"), 1.0)
    starts |= {"sensed_mode": winch.memory.mode, "sensed_F": winch.memory.F, "sensed_s_w": winch.s_w}
    starts |= {"sensed_p_hp": winch.memory.p_mean}
    found = (
        *p.inputs(names, starts, laws),
        *p.guards(at),
        p.port("input_time", "fixed", ("SH_OF_OPTION", 0), kind="integer", start=1.0, least=1.0, most=1.0),
        *p.settings(type(plc), offset(k.Lane, "plc", 1), record, laws, k.laws.Record, law_at),
        *p.commands(),
        *p.motion(),
        *p.guard_outputs(at),
    )
    return Made(
        text=_translated({"sh_kernel_begin": k.begin, "sh_kernel_once": k.once}),
        ports=found,
        limits=[],
        names=names,
        record=record,
        row=[starts.get(name, 0.0) for name in names],
        beginning=[0.0],
        defines={
            "ALONE": 1,
            "SENSED": size(ActuatorCommands),
            "STATES": offset(k.Lane, "plc", 1),
            "MOTION": 0,
            "TRUE": -1,
            "TENSION": -1,
            "VESSEL": 0,
            "SPEED": -1,
            "MODE_COLUMN": Sensed._fields.index("mode"),
        },
        columns=[(i, -1) for i in range(len(names))],
        lane=ranges(paths(k.Lane), wire=p.ANY, tension=False, settings=_settings(found)),
        of_row=ranges([f".row.{name}" for name in names], wire=p.ANY, tension=False, settings={}),
    )


def _tables(crane: Crane, made: Made, laws: list[ControlLaw]) -> Iterator[str]:
    """Sizes, records and the table of variables."""
    envelope = _envelope(crane)
    sizes = {
        "LANE": len(made.record),
        "ROW": len(made.row),
        "INPUTS": len(made.names),
        "BEGINNING": len(made.beginning),
        "VARIABLES": len(made.ports),
        "LIMITS": len(made.limits),
        "MODES": len(laws),
        "CERTIFIED": int(envelope is not None),
        "WIRE_OUT": made.wire_out,
        "MODE_INPUT": [name.removeprefix("sensed_") for name in made.names].index("mode"),
        "NEVER": f"{NEVER}LL",
        "TEXT_LENGTH": SHORTEST_TEXT + sum(len(each.word) + 2 for each in made.limits),
        **made.defines,
    }
    yield "".join(f"#define SH_{name} {value}\n" for name, value in sizes.items())
    yield f"#define SH_T_CYCLE {_number(crane.control.t_cycle)}\n#define SH_G {_number(G)}\n"
    yield _array("sh_record", made.record)
    yield _array("sh_first_row", made.row)
    yield _array("sh_first_input", [made.row[first] for first, _ in made.columns])
    yield _array("sh_beginning", made.beginning)
    yield _array("sh_modes", [law.code for law in laws])
    if made.quintic:
        yield _array("sh_quintic", made.quintic, const=False)
    validated = [float(envelope is not None and law.name in envelope.modes) for law in laws]
    yield _array("sh_validated", validated)
    yield _array("sh_share", [float(name in p.SHARES) for name in made.names])
    ranges = [(0.0, 0.0)] * 4 if envelope is None else list(envelope.ranges().values())
    yield _array("sh_least", [lo - EDGE * abs(lo) for lo, _ in ranges])
    yield _array("sh_most", [hi + EDGE * abs(hi) for _, hi in ranges])
    entries = (
        f"{{{first}, {second}, {int(name in p.COMMANDS)}}}"
        for name, (first, second) in zip(made.names, made.columns, strict=True)
    )
    yield _rows("sh_entry sh_entries", entries)
    yield _rows("sh_limit sh_limits", (f'{{"{each.word}", {each.at}}}' for each in made.limits))
    yield _rows("sh_place sh_places", (f"{{{kind}, {at}}}" for kind, at in (each.place for each in made.ports)))
    yield _rows("sh_number sh_numbers", _numbers(made.lane))
    yield _rows("sh_number sh_row_numbers", _numbers(made.of_row))
    yield _rows("sh_variable sh_variables", (_variable(each) for each in made.ports))


def _numbers(r: Ranges) -> Iterator[str]:
    """What the numbers of a lane or a row may be, and what messages call them."""
    for name, kind, least, most in zip(*r, strict=True):
        text = name.removeprefix(".")
        yield f'{{"{text}", SH_IS_{Kind(int(kind)).name}, {_number(least)}, {_number(most)}}}'


def _envelope(crane: Crane) -> Envelope | None:
    """For what the twin is validated; None where it is not."""
    certified = crane.certified
    return None if certified is None or certified.synthetic or objections(crane) else certified.envelope


def _variable(port: p.Port) -> str:
    causality, kind = f"SH_{port.causality.upper()}", f"SH_{port.kind.upper()}"
    return f'{{"{port.name}", {causality}, {kind}, {_number(port.least)}, {_number(port.most)}}}'


def _rows(name: str, rows: Iterable[str]) -> str:
    kept = list(rows) or ["{0}"]
    return f"static const {name}[{len(kept)}] = {{\n    " + ",\n    ".join(kept) + "};\n"


def _array(name: str, values: Iterable[float], *, const: bool = True) -> str:
    numbers = [_number(x) for x in values] or ["0"]
    lines = [", ".join(numbers[i : i + 4]) for i in range(0, len(numbers), 4)]
    text = ",\n    ".join(lines)
    return f"static {'const ' if const else ''}double {name}[{len(numbers)}] = {{\n    {text}}};\n"


def _number(x: float) -> str:
    """A number that reads back to the same double."""
    return repr(float(x))
