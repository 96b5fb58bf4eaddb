"""Lift files as a plan reads them: phases with kinds, and in addition seas, rules and weather of the lift.

A plan of the library as files to edit: the plan, and next to it the payload that it names.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, field_validator

from stillhook import units as u
from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.base.choice import nearest
from stillhook.base.gateway.guard import reader
from stillhook.base.gateway.named_files import named_path
from stillhook.engine.certificate import as_if_validated
from stillhook.errors import LiftError, PlanError, WeatherError
from stillhook.formats.lift.forms import in_written_words
from stillhook.formats.lift.place import depth_notes, still_place
from stillhook.formats.lift.rigging_table import read_items
from stillhook.formats.lift.tables import LiftTables, compensator_of, crane_of, motion_unit_of, payload_of, read_lift
from stillhook.formats.lift_file import lifts
from stillhook.formats.weather import description
from stillhook.library.catalogue import weather_file, weathers
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import LIBRARY, FileKind, unknown_name
from stillhook.library.toml.tree import toml_text
from stillhook.plan.definition.capacities import flow_notes
from stillhook.plan.definition.holds import Holds, holds_off, with_holds
from stillhook.plan.definition.lift_plan import (
    Environment,
    LiftPlan,
    WeatherUse,
    check_chart,
    check_sinks,
    check_tips,
    check_wire,
)
from stillhook.plan.definition.load_chart import CapacityStatement, ChartType, CraneChart, LoadChartTable, crane_chart
from stillhook.plan.definition.operation import OperationTable, operation_of
from stillhook.plan.definition.rules import Alternative, RuleSet, own_controllers, usual_alternatives
from stillhook.plan.definition.rules_file import check_limit_texts, load_rules, rules_of, under_water
from stillhook.plan.definition.weights import WeightTable, weight_facts, weight_of
from stillhook.plan.weather.records import check_headings
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.relative import RelativeMotion
from stillhook.spec.crane import Crane, content
from stillhook.spec.lift.joining import Water, joined
from stillhook.spec.lift.lowering import Rigging
from stillhook.spec.lift.phase import LATER, OFF, Phase, PhaseKind
from stillhook.spec.lift.rigging import RiggingTable
from stillhook.spec.validity import Envelope
from stillhook.tables.plausible import implausible_values
from stillhook.tables.sheet import is_table
from stillhook.tables.table import Part, Spec, Text
from stillhook.units import quote, show
from stillhook.validate.certificate.credit import checked
from stillhook.weather.limit_text import mapped
from stillhook.winches.load_path.interface import JointUnit

SHELF = "lifts"
EXAMPLE_CHART = "SYNTHETIC-load-chart.csv"
RULES = "offshore-lift"
LONGEST_NAME, LONGEST_NUMBER, LONGEST_REVISION = 80, 40, 12


class WeatherTable(description.WeatherTable):
    """The table [weather]."""

    ship: Any = Field(default=None, description="direction of the bow, clockwise from north")
    source: Text | None = Field(default=None, description="model, provider and grid point of the weather")
    bias: Text | None = Field(default=None, description="known bias against measurements, in words")


class DocumentTable(Spec):
    """The table [document]: what stands at the head of the decision page and of the limits card."""

    number: Text | None = Field(default=None, max_length=LONGEST_NUMBER, description="number of the document")
    revision: Text | None = Field(default=None, max_length=LONGEST_REVISION, description="its revision, on every page")
    field: Text | None = Field(default=None, max_length=LONGEST_NAME, description="field or site of the lift")
    prepared_by: Text | None = Field(default=None, max_length=LONGEST_NAME, description="who prepared the plan")
    checked_by: Text | None = Field(default=None, max_length=LONGEST_NAME, description="who checked it")


class PlanFile(LiftTables):
    """A plan file."""

    rules: Text = Field(default=RULES, description="set of rules: library name or file")
    alternatives: tuple[Alternative, ...] | None = Field(
        default=None, min_length=1, description="controllers side by side"
    )
    controllers: Mapping[Alternative, Text] = Field(
        default_factory=dict, description="alternative = controller's file, for settings that are not the crane's"
    )
    environment: Part[Environment] = Field(description="table [environment] with Hs, Tp and headings")
    operation: OperationTable = Field(default_factory=OperationTable)
    weather: WeatherTable | None = None
    document: DocumentTable = Field(default_factory=DocumentTable)
    weight: WeightTable | None = None
    capacity: CapacityStatement | None = None
    load_chart: LoadChartTable | None = None
    reconciled: Mapping[str, Text] = Field(
        default_factory=dict, description='"phase/rule" = why runs count where the frequency-domain method allows less'
    )
    synthetic_certificate: Part[Envelope] | None = Field(
        default=None, description="conditions for which the twin is credited as if it had been validated"
    )

    @field_validator("alternatives")
    @classmethod
    def _once(cls, names: tuple[Alternative, ...] | None) -> tuple[Alternative, ...] | None:
        several = names or ()
        twice = next((name for name in several if several.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"{u.quote(twice.value)} is given twice. Write it once.")
        return names


def plans() -> tuple[str, ...]:
    """Names of the library's lifts that can be planned."""
    return tuple(name for name in lifts() if "[environment]" in toml_text(LIBRARY / SHELF / f"{name}.toml"))


@reader(PlanError)
def load_plan(name_or_path: str | Path) -> LiftPlan:
    """Read a lift file with the seas to analyse::

        crane = "nov-250t"                   # or the path of a crane file, seen from this file
        vessel = "construction-vessel-130m"  # or the path of a vessel file
        payload = "template-120t"            # or the path of a payload file, or a table [payload]

        start_depth = "-5 m"                 # underside of the payload below still water; negative above

        [tip]
        at = "x=-15 m, y=-24 m, z=36 m"      # or a table [boom]

        [water]
        depth = "1500 m"

        [environment]
        Hs = "0.5 m to 6 m by 0.5 m"         # or a list of texts
        Tp = "5 s to 14 s by 1 s"
        headings = ["150 deg", "180 deg"]

        [[phase]]
        name = "splash zone"
        kind = "splash-zone"
        depth = "25 m"                       # where it ends

    Every other table has defaults, listed in docs/how-to/describe-a-lift-plan.md.

    Parameters
    ----------
    name_or_path : str or Path
        Name in the library ("template-to-1500m"), or path of the file.

    Returns
    -------
    LiftPlan
        The lift, its phases and its seas.

    Raises
    ------
    StillhookError
        One line that names file, field, what came and what is allowed.

    Examples
    --------
    >>> import stillhook
    >>> plan = stillhook.load_plan("template-to-1500m")
    >>> plan.name, [phase.name for phase in plan.phases][:3]
    ('Template of 120 t to 1,500 m', ['lift-off', 'over the side', 'splash zone'])
    """
    name = str(name_or_path)
    if name in lifts():
        with as_file(files("stillhook.library") / "data" / SHELF / f"{name}.toml") as file:
            return replace(read_toml(file, FileKind.LIFT, PlanError, _plan), source=name)
    if not name.endswith(".toml") and not Path(name_or_path).exists():
        raise PlanError(unknown_name("plan", name, plans(), FileKind.LIFT))
    if not toml_text(Path(name_or_path)).strip():
        needs = "crane, vessel, payload, [water], [environment] and phases"
        raise PlanError(f"{Path(name_or_path).name}: empty. A plan names {needs}; copy {', '.join(plans())}.")
    return read_toml(name_or_path, FileKind.LIFT, PlanError, in_written_words(_plan))


def _plan(table: TomlTable) -> LiftPlan:
    table, file = read_lift(table, PlanFile)
    depth, rho = file.water.depth, file.water.rho
    payload = payload_of(file, table)
    weight = weight_of(file.weight, file.rigging, payload, rho)
    if weight is not None:
        check_sinks(weight.low_case, rho)
        payload = weight.high_case
    check_sinks(payload, rho)
    rules = under_water(load_rules(table.relative_toml(file.rules)), file.environment.current)
    for i, phase in enumerate(file.phase):
        check_limit_texts(phase.limits, table.at("phase", i, "limits"), rules)
        _label(phase.name, table.at("phase", i))
    holds = Holds(*(rules.settings[name] for name in ("hold", "stop", "stand_off")))
    try:
        rows = joined(file.phase, file.start_depth, Water(depth, payload.reach(rho)))
    except LiftError as problem:
        raise PlanError(str(problem)).with_lines(problem.lines) from None
    standing = rules.of(PhaseKind.STAND_OFF)
    phases = with_holds(rows, holds, depth, standing)
    for phase in phases:
        rules_of(rules, phase)  # refuses limits that cannot be
    operation = operation_of(file.operation, table.at("operation"), phases)
    weather = None if file.weather is None else _weather(file.weather, table.path.parent)
    crane = _certified(checked(crane_of(file, table), recompute=False), file.synthetic_certificate, table)
    at, h_tip, vessel, against = _place(file, table)
    unit = compensator_of(file, table)
    alternatives = _alternatives(file, table, crane, unit)
    chart = _chart(file, table, crane)
    plan = LiftPlan(
        name=_label(file.name or table.path.stem, table),
        crane=crane,
        vessel=vessel,
        at=at,
        h_tip=h_tip,
        against=against,
        payload=payload,
        depth=depth,
        rho=rho,
        phases=phases,
        environment=file.environment,
        rules=rules,
        T_POP=operation.T_POP,
        T_C=file.operation.T_C,
        T_POP_given=operation.stated,
        lead=operation.lead,
        parts=operation.parts,
        forecast_factors=_factors(file.operation, table),
        rigging=file.rigging.spring,
        gear=_gear(file, table),
        weight=weight,
        statement=_statement(file, table, chart),
        wire=file.wire,
        winch=file.winch,
        sensors=file.sensors,
        unit=motion_unit_of(file),
        alternatives=alternatives,
        controllers=own_controllers(file.controllers, alternatives, crane, table),
        compensator=unit,
        weather=weather,
        load_chart=chart,
        credits_synthetic=file.synthetic_certificate is not None,
        not_claimed=holds_off(rows, holds, depth, standing),
        reconciled=_reconciled(file.reconciled, table, phases, rules),
        document=file.document.model_dump(exclude_none=True),
        source=table.path.name,
    )
    notes = (
        *operation.notes,
        *(() if plan.unit is None else (plan.unit.note,)),
        *_ideal(file, phases),
        *_not_held(file.phase),
        *depth_notes(vessel, max(file.environment.Tp), depth),
        *_cases(plan),
        *_doubts(plan),
        *flow_notes(plan),
        *(() if chart is None else chart.notes(phases, file.environment.current, file.environment.wind)),
    )
    plan = replace(plan, notes=notes)
    for each in dict.fromkeys(plan.under(a) for a in plan.alternatives):
        check_tips(each, None if file.boom is None else file.boom.boom)
        check_wire(each)
    check_chart(plan)
    if plan.weather is not None:
        check_headings(plan, plan.weather.ship, plan.weather.ship is not None)
    return replace(plan, digest=_digest(plan))


def _reconciled(
    reasons: Mapping[str, str], table: TomlTable, phases: tuple[Phase, ...], rules: RuleSet
) -> dict[tuple[str, str], str]:
    """Phase and rule -> the reason of the file."""
    names, keys, result = [phase.name for phase in phases], [rule.key for rule in rules.rules], {}
    for text, reason in reasons.items():
        phase, _, rule = text.rpartition("/")
        for value, allowed in ((phase, names), (rule, keys)):
            if value not in allowed:
                raise table.at("reconciled").wrong(
                    f'{quote(value)} does not exist{nearest(value, allowed)} Write "phase/rule" = "reason", such as'
                    f' "{names[-1]}/{keys[0]}".',
                    text,
                )
        result[phase, rule] = reason
    return result


def _place(file: PlanFile, table: TomlTable) -> tuple[TipPoint, float, Rao, RelativeMotion | None]:
    """Crane tip, its height above still water [m], vessel, and its motion against another."""
    if file.tip.motion is not None:
        raise PlanError(
            "tip.motion: replaces vessel and sea, and a plan needs many seas. Give tip.at, or a table [boom]."
        )
    if file.vessel is None:
        raise table.missing("vessel")
    place = still_place(file, table)
    if place.at is None or place.vessel is None:
        raise PlanError(
            'tip: its place is missing. Write [tip] with at = "x=-20 m, y=-18 m, z=30 m", or a table [boom].'
        )
    return TipPoint(place.at.x, place.at.y, place.h_tip), place.h_tip, place.vessel, place.against


def _alternatives(file: PlanFile, table: TomlTable, crane: Crane, unit: JointUnit | None) -> tuple[Alternative, ...]:
    """Alternatives side by side: those of the file, else the usual ones, with a compensator where there is one."""
    named = file.alternatives
    if named is None:
        return (*usual_alternatives(crane), *(() if unit is None else (Alternative.PHC,)))
    if Alternative.PHC in named and unit is None:
        raise table.wrong(
            '"phc" needs a compensator. Write a table [compensator] with unit = "phc-150t".', "alternatives"
        )
    if Alternative.PHC not in named and unit is not None:
        raise table.wrong('[compensator] is given and not used. Add "phc", or leave the table out.', "alternatives")
    if Alternative.CAP not in named and any(a.twin for a in named):
        return (*named, Alternative.CAP)  # what may be credited of a winch without a certificate
    return named


def _certified(crane: Crane, envelope: Envelope | None, table: TomlTable) -> Crane:
    """The crane with a certificate that no one issued, for the conditions that a plan assumes to be validated."""
    if envelope is None:
        return crane
    if crane.certified is not None:
        raise table.wrong("the crane has a certificate of its own. Remove this table.", "synthetic_certificate")
    return as_if_validated(crane, envelope)


def _chart(file: PlanFile, table: TomlTable, crane: Crane) -> CraneChart | None:
    """The load chart that the plan names."""
    if file.load_chart is None:
        return None
    path = table.relative_file(file.load_chart.file, "load_chart", "file")
    return crane_chart(file.load_chart, path, crane, None if file.boom is None else file.boom.boom)


def _gear(file: PlanFile, table: TomlTable) -> RiggingTable:
    """Legs and items of the rigging, those of a table that it names among them."""
    gear = file.rigging
    if gear.items is None:
        return gear
    items = read_items(table.relative_file(gear.items, "rigging", "items"))
    return gear.model_copy(update={"items": None, "item": items})


def _statement(file: PlanFile, table: TomlTable, chart: CraneChart | None) -> CapacityStatement | None:
    """Who states a dynamic factor of the capacity, where the load chart does not."""
    if file.capacity is not None and chart is not None and (chart.states_factor or chart.type is ChartType.DYNAMIC):
        has = "has dynamic factors of its own" if chart.states_factor else "is dynamic, and is not multiplied"
        raise table.wrong(f"the load chart {has}. Remove this table, or correct the chart.", "capacity")
    return file.capacity


def _label(name: str, table: TomlTable) -> str:
    """A name as it can be printed in tables and pictures."""
    if not name.strip() or len(name) > LONGEST_NAME or not name.isprintable():
        raise table.wrong(f"give a name of one line and at most {LONGEST_NAME} letters.", "name")
    return name


def _factors(operation: OperationTable, table: TomlTable) -> str | None:
    """Table of forecast factors that the plan names: of the library, or a file next to it."""
    name = operation.forecast_factors
    if name is None:
        return None
    file, _, key = name.partition("#")
    near = table.named_path(file, "operation", "forecast_factors")
    return f"{near}{f'#{key}' if key else ''}" if near.suffix else name


def _ideal(file: PlanFile, phases: tuple[Phase, ...]) -> tuple[str, ...]:
    """That the winch's signals are without delay and noise, where it compensates and nothing else is stated."""
    if "sensors" in file.model_fields_set or not any(phase.compensated for phase in phases):
        return ()
    return ("sensors are taken as ideal, without delay and noise: give [sensors] with those of your crane",)


def _not_held(phases: tuple[Phase, ...]) -> tuple[str, ...]:
    """Which passages and landings the file takes without a stop."""
    off = " and ".join(phase.name for phase in phases if phase.hold == 0.0)
    return (f'hold = "{OFF}" of {off}: a stop there is not claimed, and must not be made',) if off else ()


def _cases(plan: LiftPlan) -> tuple[str, ...]:
    """The two weights that the rules are judged for."""
    if plan.weight is None:
        return ()
    w = plan.weight
    high, low = (show(m, "mass") for m in (w.SHL, w.net * w.low))
    parts = " + ".join(show(m, "mass") for m in (w.rigging, w.extra) if m > 0.0)
    build_up = f"{show(w.net, 'mass')} x {w.contingency:g}{' + ' if parts else ''}{parts}"
    return (f"weight in air: high case {high} ({build_up}), low case {low}; every rule is judged for both",)


def _doubts(plan: LiftPlan) -> tuple[str, ...]:
    """Notes on numbers outside of what was ever built."""
    parts: dict[str, BaseModel] = {"crane": plan.crane, "payload": plan.payload, "environment": plan.environment}
    parts |= {} if plan.compensator is None else {"compensator": plan.compensator}
    parts |= {"rigging": plan.rigging, "wire": plan.wire, "winch": plan.winch, "sensors": plan.sensors}
    return tuple(note for name, part in parts.items() for note in implausible_values(part, name))


def _weather(weather: WeatherTable, folder: Path) -> WeatherUse:
    """Weather that waiting is calculated with."""
    beside = named_path(folder, weather.file, lambda why: PlanError(f"weather.file = {quote(weather.file)}: {why}"))
    file, where = weather.file if weather.file in weathers() else str(beside), "weather.file: "
    weather = weather.with_times()
    if file.endswith(".toml") and is_table(Path(file)):  # a description, over which the plan's own words win
        file, stated = description.described(file)
        own = weather.model_dump(exclude={"file"}, exclude_none=True, exclude_defaults=True)
        words = stated.model_dump(include=set(description.WeatherTable.model_fields), exclude_none=True)
        weather = WeatherTable.model_validate(words | own | {"columns": {**stated.columns, **weather.columns}})
    try:
        weather_file(file)
        where = ""
        columns = mapped(weather.columns, "weather.columns")
    except WeatherError as e:
        raise PlanError(f"{where}{e}") from None
    ship = None if weather.ship is None else parse_direction(weather.ship, "weather.ship")
    times = weather.time, weather.date_order, weather.time_zone
    return WeatherUse(file, ship, weather.sense, columns, *times, weather.source or "", weather.bias or "")


def _digest(plan: LiftPlan) -> str:
    """SHA-256 of everything that numbers follow from; names of files and notes are none."""
    content_of_plan: dict[str, Any] = {
        "crane": content(plan.crane),
        "vessel": plan.vessel.digest.hex(),
        "at": [plan.at.x, plan.at.y, plan.h_tip],
        "payload": plan.payload.to_dict(),
        "water": [plan.depth, plan.rho],
        "phases": [
            phase.model_dump(mode="json", exclude={name for name in LATER if not getattr(phase, name)})
            for phase in plan.phases
        ],
        "environment": plan.environment.inputs(),
        "rules": plan.rules.digest,
        "operation": [plan.T_POP, plan.T_C, *([plan.lead] if plan.lead else [])],
        **{key: getattr(plan, key).model_dump(mode="json") for key in ("rigging", "wire", "winch", "sensors")},
        "alternatives": [a.value for a in plan.alternatives],
    }
    content_of_plan |= {} if plan.unit is None else {"motion_unit": plan.unit.to_dict()}
    content_of_plan |= {} if plan.against is None else {"other_vessel": plan.against.other.inputs()}
    content_of_plan |= {} if plan.compensator is None else {"compensator": plan.compensator.model_dump(mode="json")}
    if plan.weight is not None:
        content_of_plan["weight"] = weight_facts(plan.weight)
    if gear := plan.gear.model_dump(mode="json", exclude=set(Rigging.model_fields), exclude_defaults=True):
        content_of_plan["gear"] = gear
    content_of_plan |= {} if plan.statement is None else {"capacity": plan.statement.model_dump(mode="json")}
    if plan.controllers:
        content_of_plan["controllers"] = {a.value: k.changes_on(plan.crane) for a, k in plan.controllers.items()}
    if plan.reconciled:
        content_of_plan["reconciled"] = sorted((*at, reason) for at, reason in plan.reconciled.items())
    if plan.load_chart is not None:
        content_of_plan["load_chart"] = plan.load_chart.inputs()
    return hashlib.sha256(json.dumps(content_of_plan, sort_keys=True).encode()).hexdigest()


def copy_plan(name: str, folder: Path) -> tuple[Path, ...]:
    """Write a plan of the library, its payload and a SYNTHETIC load chart into a folder; the copy refers to that
    payload. Returns the paths.

    Errors: PlanError for a name that there is not, or a file that is there already; SimulationError where nothing can
    be written.
    """
    if name not in plans():
        raise PlanError(f"No plan {quote(name)} to copy: the library has {', '.join(plans())}{nearest(name, plans())}")
    shelf = files("stillhook.library") / "data"
    text = (shelf / SHELF / f"{name}.toml").read_text(encoding="utf-8")
    payload = next(line.split('"')[1] for line in text.splitlines() if line.startswith("payload = "))
    edited = text.replace(f'payload = "{payload}"', f'payload = "{payload}.toml"  # next to this file')
    texts = {
        f"{name}.toml": edited.replace(f"stillhook plan {name} ", f"stillhook plan {name}.toml "),
        f"{payload}.toml": (shelf / "payloads" / f"{payload}.toml").read_text(encoding="utf-8"),
        EXAMPLE_CHART: (shelf / SHELF / EXAMPLE_CHART).read_text(encoding="utf-8"),
    }
    for file in texts:
        if (folder / file).exists():
            raise PlanError(f"{folder / file}: is there already, and may be yours. Give another folder.")
    check_folder(folder, tuple(texts))
    with atomic_folder(folder) as part:
        for file, content in texts.items():
            (part / file).write_text(content, encoding="utf-8")
    return tuple(folder / file for file in texts)
