"""A lowering as a lift file, with the files that it names next to it: `stillhook.formats.lift_file.load_lift` reads the
same lowering from it, to the last digit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from stillhook.engine.simulate import End
from stillhook.errors import LiftError
from stillhook.formats.lift_file import load_lift
from stillhook.formats.vessel.csv import write_rao_csv
from stillhook.formats.vessel.open import read_vessel
from stillhook.library import crane_toml, cranes, load_crane
from stillhook.library.catalogue import compensators, payloads, read_compensator, read_payload, vessel_file, vessels
from stillhook.library.toml.tree import LABELS
from stillhook.library.write import file_value, joined, leaf_tables, quantity_of, toml_value
from stillhook.sea.spectra.text import sea_text
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import Resolution
from stillhook.spec.crane import Crane
from stillhook.spec.lift.assembly import Assembly
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.lift.payload import Payload
from stillhook.tables.table import Source
from stillhook.units import exact
from stillhook.winches.load_path.interface import JointUnit

LIFT, CRANE, PAYLOAD, COMPENSATOR, VESSEL = "lift.toml", "crane.toml", "payload.toml", "compensator.toml", "vessel.csv"
FILES = (LIFT, CRANE, PAYLOAD, COMPENSATOR, VESSEL)
"""Files that a written lift may have; crane, payload, compensator and vessel where the library has no such one."""


@dataclass(frozen=True, eq=False)
class Run:
    """A lowering and how it is run. case: alone in still water, or in a sea; step, sampling: as `simulate` takes them;
    end: where the run ends."""

    crane: Crane
    case: Lowering | InSea
    step: str
    sampling: str | None = None
    end: End = End.DURATION

    @property
    def lift(self) -> Lowering:
        """The lowering without its sea."""
        return self.case.lift if isinstance(self.case, InSea) else self.case


def write_lift(run: Run, folder: Path, *, remarks: Sequence[str] = ()) -> tuple[str, ...]:
    """Write a run as a lift file into a folder that exists; names of the files. remarks: lines at its top.

    Errors: LiftError for a sea that has no text, or where what was written is not read as the same lowering.
    """
    case, lift = run.case, run.lift
    named = {"name": lift.name, "crane": _crane(run.crane, folder)}
    named |= {"vessel": _vessel(case.rao, folder)} if isinstance(case, InSea) else {}
    named |= {"payload": _payload(lift.payload, folder)}
    named |= {} if lift.compensator is None else {"compensator": _compensator(lift.compensator, folder)}
    named |= {"controller": lift.controller.value, "duration": exact(lift.duration, "time")}
    named |= {"ramp": exact(lift.ramp, "time"), "friction": lift.friction.value, "step": run.step}
    named |= {"end": run.end.value} | ({} if run.sampling is None else {"sampling": run.sampling})
    tip = {"height": exact(lift.h_tip, "length")}
    if isinstance(case, InSea):
        at = {"x": case.x, "y": case.y, "z": lift.h_tip}
        tip = {"at": ", ".join(f"{name}={exact(value, 'length')}" for name, value in at.items())}
    named["start_depth"] = exact(lift.start_depth, "length")
    phases = "\n\n".join("\n".join(["[[phase]]", *_record(phase)]) for phase in lift.programme)
    own = {name: getattr(lift, name) for name in ("rigging", "wire", "winch", "sensors")}
    tables = {
        "": [*(f"# {line}" for line in remarks), *_lines(named)],
        "tip": _lines(tip),
        "water": _lines({"depth": exact(lift.depth, "length"), "rho": exact(lift.rho, "density")}),
        **({"sea": _sea(case)} if isinstance(case, InSea) else {}),
        **({"motion_unit": _unit(case.unit)} if isinstance(case, InSea) and case.unit is not None else {}),
        **{name: _record(record) for name, record in own.items() if record != type(record)()},
        **({} if lift.current is None else {"environment.current": _record(lift.current)}),
    }
    (folder / LIFT).write_text(f"{joined(tables)}\n{phases}\n", encoding="utf-8")
    _check(run, folder / LIFT)
    return tuple(name for name in FILES if (folder / name).is_file())


def _sea(case: InSea) -> list[str]:
    table = {"wave": sea_text(case.sea), "seed": case.seed, "amplitudes": case.amplitudes.value}
    table |= {"repeat": exact(case.period, "time"), "water": case.water, "left": case.left}
    return _lines(table | {"resolution": Resolution.COARSE.value})


def _unit(unit: MotionUnit) -> list[str]:
    assert unit.heave_period is not None
    table = {"heave_period": exact(unit.heave_period, "time"), "heave_damping": unit.heave_damping}
    return _lines({**table, "at": [exact(x, "length") for x in unit.at]})


def _lines(values: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {toml_value(value)}" for key, value in values.items()]


def _record(record: BaseModel) -> list[str]:
    """Lines of a record: its numbers as texts, without what is not there."""
    return [f"{name} = {toml_value(value)}" for name, value in _values(record)]


def _values(record: BaseModel) -> Iterator[tuple[str, Any]]:
    """Fields of a record as a file has them, without what is not there."""
    for name, field in type(record).model_fields.items():
        value = getattr(record, name)
        if isinstance(value, BaseModel):
            yield name, dict(_values(value))
        elif isinstance(value, tuple) and value and all(isinstance(row, BaseModel) for row in value):
            yield name, [dict(_values(row)) for row in value]
        elif value is not None and value is not False and value not in ("", {}):
            yield name, str(value) if isinstance(value, str) else file_value(value, quantity_of(field))


def _crane(crane: Crane, folder: Path) -> str:
    if crane.name in cranes() and load_crane(crane.name) == crane:
        return crane.name
    (folder / CRANE).write_text(crane_toml(crane), encoding="utf-8")
    return CRANE


def _vessel(rao: Rao, folder: Path) -> str:
    known = next((name for name in vessels() if read_vessel(vessel_file(name)).digest == rao.digest), None)
    if known is not None:
        return known
    named = Rao(rao.name or "vessel", rao.omega, rao.beta, rao.H, origin=rao.origin or "not stated", depth=rao.depth)
    write_rao_csv(named, folder / VESSEL, source=rao.source or "not stated")
    return VESSEL


def _compensator(unit: JointUnit, folder: Path) -> str:
    if unit.name in compensators() and read_compensator(unit.name) == unit:
        return unit.name
    (folder / COMPENSATOR).write_text(joined(leaf_tables(unit, unit.sources)), encoding="utf-8")
    return COMPENSATOR


def _payload(payload: Payload, folder: Path) -> str:
    if payload.name in payloads() and read_payload(payload.name) == payload:
        return payload.name
    (folder / PAYLOAD).write_text(_payload_text(payload), encoding="utf-8")
    return PAYLOAD


def _payload_text(payload: Payload) -> str:
    """A payload as a file: the dimensions of its shape beside its own fields, parts and levels as tables."""
    tables = {"": _sourced(payload, payload.sources, skip=("shape", "levels", "seabed", "lift_off", "sources"))}
    shape = payload.shape
    if shape is not None:
        tables[""] = [line for line in tables[""] if not line.startswith("height ")]
        tables[""] += [_line("shape", shape.kind, payload.sources.get("shape")), *_body(shape, payload.sources)]
    if isinstance(shape, Assembly):
        of_file = dict.fromkeys(path.split(".")[1] for path in payload.sources if path.startswith("parts."))
        names = list(of_file) if len(of_file) == len(shape.parts) else [f"part-{i}" for i in range(len(shape.parts))]
        for name, part in zip(names, shape.parts, strict=True):
            place = f"parts.{name}"
            lines = _sourced(part, payload.sources, f"{place}.", skip=("shape",))
            kind = _line("shape", part.shape.kind, payload.sources.get(f"{place}.shape"))
            tables[place] = [*lines, kind, *_body(part.shape, payload.sources, f"{place}.")]
    for i, level in enumerate(payload.levels, 1):
        tables[f"levels.{i}"] = _sourced(level, payload.sources, f"levels.{i}.")
    for name in ("seabed", "lift_off"):
        tables[name] = _sourced(getattr(payload, name), payload.sources, f"{name}.")
    return joined(tables)


def _body(shape: BaseModel, sources: Mapping[str, Source], place: str = "") -> list[str]:
    """Lines of a shape's dimensions."""
    return _sourced(shape, sources, place, skip=("kind", "parts"))


def _sourced(
    record: BaseModel, sources: Mapping[str, Source], place: str = "", *, skip: Sequence[str] = ()
) -> list[str]:
    """Lines of a record, each number with its source where it has one."""
    rows = [(name, value) for name, value in _values(record) if name not in skip]
    return [_line(name, value, None if name in LABELS else sources.get(place + name)) for name, value in rows]


def _line(name: str, value: Any, source: Source | None) -> str:
    if source is None:
        return f"{name} = {toml_value(value)}"
    kind, text = toml_value(source.kind.value), toml_value(source.text)
    return f"{name} = {{ value = {toml_value(value)}, kind = {kind}, source = {text} }}"


def _check(run: Run, path: Path) -> None:
    """Errors: LiftError where the file is not read as the same lowering."""
    read, lift = load_lift(path, moving=False), run.lift
    plain = {"tip", "waves", "payload", "compensator"}
    same = {
        "crane": _numbers(read.crane) == _numbers(run.crane),
        "payload": _numbers(read.lift.payload) == _numbers(lift.payload),
        "compensator": _numbers(read.lift.compensator) == _numbers(lift.compensator),
        "lift": read.lift.model_dump(exclude=plain) == lift.model_dump(exclude=plain),
    }
    if isinstance(run.case, InSea):
        same["sea"] = read.sea == run.case.sea
        same["vessel"] = read.vessel is not None and _alike(read.vessel, run.case.rao)
    wrong = ", ".join(name for name, equal in same.items() if not equal)
    if wrong:
        raise LiftError(f"{path}: {wrong} cannot be written exactly. Please report it with the plan.")


def _alike(a: Rao, b: Rao) -> bool:
    return a.depth == b.depth and all(np.array_equal(getattr(a, x), getattr(b, x)) for x in ("omega", "beta", "H"))


def _numbers(model: BaseModel | None) -> Any:
    """A record without names and sources."""
    return None if model is None else model.model_dump(exclude={"name", "title", "source", "sources"})
