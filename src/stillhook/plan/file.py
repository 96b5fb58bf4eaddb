"""Plan files: one TOML that names crane, vessel, crane tip, payload, water, phases, seas, rules and weather of a
lift."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import as_file, files
from os.path import isfile
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from stillhook.base.nearest import nearest
from stillhook.errors import PlanError, ScenarioError, WeatherError
from stillhook.formats.lift.file import parts_of, payload_of, water_of
from stillhook.formats.lift.place import boom_of, depth_notes, still_place
from stillhook.formats.toml_fields import Fields, described
from stillhook.formats.weather.file import SENSES
from stillhook.formats.weather.times import ORDERS
from stillhook.library import load_crane
from stillhook.library.toml.file import TomlTable
from stillhook.library.toml.kinds import FileKind, other_kind
from stillhook.library.toml.tree import shelf, toml_text
from stillhook.library.weather import weather_file
from stillhook.plan.definition.compensation import Alternative
from stillhook.plan.definition.feasibility import check_sinks, check_tips, check_wire
from stillhook.plan.definition.lift_plan import ALL, Environment, LiftPlan, WeatherUse
from stillhook.plan.definition.phase_profile import Water, joined
from stillhook.plan.definition.phases import Phase
from stillhook.plan.definition.rules import RuleSet
from stillhook.plan.definition.rules_file import check_limit_texts, load_rules, rules_of
from stillhook.plan.definition.sea_table import spelled
from stillhook.plan.weather.value import check_headings
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.tip import TipPoint
from stillhook.spec.crane import Crane, content
from stillhook.spec.lift.payload import Payload
from stillhook.spec.plausible import implausible_values
from stillhook.units import number, quote
from stillhook.weather.mapped import mapped

SHELF = "plans"
TOP = (
    "name",
    "crane",
    "vessel",
    "payload",
    "rules",
    "alternatives",
    "tip",
    "boom",
    "water",
    "rigging",
    "wire",
    "winch",
    "sensors",
    "environment",
    "operation",
    "weather",
    "phase",
)
OPERATION = ("T_POP", "T_C")
WEATHER = ("file", "ship", "sense", "columns", "time", "date_order")
RULES = "offshore-lift"
LONGEST_NAME = 80
ROUNDED = 1e-3
"""Part of a planned time by which it may have been rounded down."""


def plans() -> tuple[str, ...]:
    """Names of the library's example plans."""
    return shelf(SHELF)


def load_plan(name_or_path: str | Path) -> LiftPlan:
    """Read a plan file::

        crane = "nov-250t"                   # or the path of a crane file, seen from this file
        vessel = "construction-vessel-130m"  # or the path of a vessel file
        payload = "template-120t"            # or the path of a payload file, or a table [payload]

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
        start = "5 m"                        # underside of the payload above still water; negative below
        end = "-25 m"

    A library name ("template-to-1500m") may stand in place of a path. Every other table has defaults, told in
    docs/how-to/describe-a-lift-plan.md. Errors: StillhookError, one line that names file, field, what came and what is
    allowed.
    """
    name = str(name_or_path)
    if name in plans():
        with as_file(files("stillhook.library") / "data" / SHELF / f"{name}.toml") as file:
            return replace(described(file, FileKind.PLAN, _plan), source=name)
    have = f"{', '.join(plans())}"
    if not name.endswith(".toml") and not Path(name_or_path).exists():
        other = other_kind(name, FileKind.PLAN)
        raise PlanError(
            f"No plan {quote(name)}: the library has {have}{nearest(name, plans())} A file's name ends in .toml.{other}"
        )
    if not toml_text(Path(name_or_path)).strip():
        needs = "crane, vessel, payload, [water], [environment] and phases"
        raise PlanError(f"{Path(name_or_path).name}: empty. A plan file names {needs}; copy {have}.")
    return described(name_or_path, FileKind.PLAN, _plan)


def _plan(table: Mapping[str, Any], file: Path) -> LiftPlan:
    top = Fields(table, "", PlanError)
    top.refuse_unknown(TOP)
    top.need("crane", "vessel", "payload", "water", "environment")
    depth, rho = water_of(top)
    payload = payload_of(top, file.parent)
    check_sinks(payload, rho)
    rules = _rules(top, file.parent)
    phases = joined(_phases(table.get("phase"), rules), Water(depth, payload.reach(rho)))
    for phase in phases:
        rules_of(rules, phase)  # refuses limits that cannot be
    T_POP, T_C, notes = _operation(top, phases)
    environment = _environment(top)
    parts = {
        "environment": environment,
        "alternatives": _alternatives(top),
        "weather": _weather(top, file.parent),
        **parts_of(table),
    }
    crane = load_crane(top.path_or_name("crane", file.parent))
    at, vessel = _place(top, file.parent)
    plan = LiftPlan(
        name=_label(Fields({"name": file.stem, **table}, "", PlanError)),
        crane=crane,
        vessel=vessel,
        at=at,
        h_tip=_height(at),
        payload=payload,
        depth=depth,
        rho=rho,
        phases=phases,
        rules=rules,
        T_POP=T_POP,
        T_C=T_C,
        T_POP_given=not notes,
        source=file.name,
        notes=(
            *notes,
            *_ideal(table, phases),
            *depth_notes(vessel, max(environment.Tp), depth),
            *_doubts(crane, payload, parts),
        ),
        **parts,
    )
    check_tips(plan, boom_of(top) if "boom" in top else None)
    check_wire(plan)
    if plan.weather is not None:
        check_headings(plan, plan.weather.ship, plan.weather.ship is not None)
    return replace(plan, digest=_digest(plan))


def _place(top: Fields, folder: Path) -> tuple[TipPoint, Rao]:
    """Crane tip with its height, and vessel."""
    if "motion" in Fields(top.table.get("tip", {}), "tip.", PlanError):
        raise PlanError(
            "tip.motion: stands in place of vessel and sea, and a plan asks for many seas. Give tip.at, or a table"
            " [boom]."
        )
    place = still_place(top, folder)
    if place.at is None or place.vessel is None:
        raise PlanError(
            'tip: its place is missing. Write [tip] with at = "x=-20 m, y=-18 m, z=30 m", or a table [boom].'
        )
    return TipPoint(place.at.x, place.at.y, place.h_tip), place.vessel


def _height(at: TipPoint) -> float:
    assert at.z is not None
    return at.z


def _phases(rows: Any, rules: RuleSet) -> tuple[Phase, ...]:
    if not isinstance(rows, list) or not rows or not all(isinstance(row, Mapping) for row in rows):
        raise PlanError(
            "phase: none. Write each as a table [[phase]] with name, kind, start, end; a plan has at least one"
            " [[phase]]."
        )
    return tuple(_phase(row, i, rules) for i, row in enumerate(rows, 1))


def _phase(row: Mapping[str, Any], number: int, rules: RuleSet) -> Phase:
    fields = Fields({"name": row.get("kind", ""), **row}, f"phase {number}: ", PlanError)
    name = _label(fields)
    if not isinstance(row.get("limits", {}), Mapping):
        raise fields.wrong(
            "limits", 'give a table of texts, such as { landing-speed = "0.3 m/s", control-error = "off" }.'
        )
    table = TomlTable(Path(), {"phase": [{"name": name, **row}]}, PlanError, ("phase", 0, "limits"))
    check_limit_texts(row.get("limits", {}), table, rules)
    try:
        return Phase(**fields.table)
    except ScenarioError as e:
        text = str(e).removeprefix("Phase.")
        raise PlanError(text if text.startswith("phase ") else f"phase {number} ({quote(name)}): {text}") from None


def _label(fields: Fields) -> str:
    """A name as it can stand in tables and pictures."""
    name = fields.text("name")
    if len(name) > LONGEST_NAME or not name.isprintable():
        raise fields.wrong("name", f"give a name of one line and at most {LONGEST_NAME} letters.")
    return name


def _rules(top: Fields, folder: Path) -> RuleSet:
    return load_rules(top.path_or_name("rules", folder) if "rules" in top else RULES)


def _operation(top: Fields, phases: tuple[Phase, ...]) -> tuple[float, float | None, tuple[str, ...]]:
    """T_POP, T_C [s], and what was assumed."""
    table = Fields(top.table.get("operation", {}), "operation.", PlanError)
    table.refuse_unknown(OPERATION)
    phases_take = sum(phase.duration or 0.0 for phase in phases)
    T_POP, T_C = table.quantity("T_POP", "hours"), table.quantity("T_C", "hours")
    if T_C is not None and T_C < 0.0:
        raise table.wrong("T_C", "a contingency is no less than 0 h.")
    hours = f"{number(phases_take / 3600.0, 3)} h"
    if T_POP is None:
        return phases_take, T_C, (f"operation.T_POP is not given: the sum of the phases stands for it, {hours}",)
    if phases_take > T_POP * (1.0 + ROUNDED):
        raise table.wrong("T_POP", f"the phases alone take {hours}. Give more, or leave it out.")
    return T_POP, T_C, ()


def _ideal(table: Mapping[str, Any], phases: tuple[Phase, ...]) -> tuple[str, ...]:
    """That the winch's signals are without delay and noise, where it compensates and nothing else is said."""
    if "sensors" in table or not any(phase.compensated for phase in phases):
        return ()
    return ("sensors are taken as ideal, without delay and noise: give [sensors] with those of your crane",)


def _doubts(crane: Crane, payload: Payload, records: Mapping[str, Any]) -> tuple[str, ...]:
    """Notes on numbers outside of what was ever built."""
    parts = {"payload": payload, **records}
    notes_of_parts = [implausible_values(part, name) for name, part in parts.items() if isinstance(part, BaseModel)]
    return tuple(note for notes in (implausible_values(crane, "crane"), *notes_of_parts) for note in notes)


def _environment(top: Fields) -> Environment:
    table = Fields(top.table["environment"], "environment.", PlanError)
    table.need("Hs", "Tp", "headings")
    fields = {
        key: spelled(table, key) if key in ("Hs", "Tp", "headings") else value for key, value in table.table.items()
    }
    if (
        fields.get("spread") is not None
        and isinstance(fields["spread"], int)
        and not isinstance(fields["spread"], bool)
    ):
        fields["spread"] = float(fields["spread"])
    try:
        return Environment(**fields)
    except ScenarioError as e:
        raise PlanError("environment." + str(e).removeprefix("Environment.")) from None


def _alternatives(top: Fields) -> tuple[Alternative, ...]:
    """In the order of the file, none twice."""
    if "alternatives" not in top:
        return ALL
    names = top.table["alternatives"]
    if not isinstance(names, list) or not names or not all(isinstance(x, str) for x in names):
        raise top.wrong("alternatives", f"give a list of some of {', '.join(ALL)}.")
    for name in names:
        if name not in list(Alternative):
            raise PlanError(
                f"alternatives: {quote(name)} is not one of {', '.join(ALL)}{nearest(name, [a.value for a in ALL])}"
            )
        if names.count(name) > 1:
            raise PlanError(f"alternatives: {quote(name)} comes twice. Write it once.")
    return tuple(Alternative(name) for name in names)


def _weather(top: Fields, folder: Path) -> WeatherUse | None:
    if "weather" not in top:
        return None
    table = Fields(top.table["weather"], "weather.", PlanError)
    table.refuse_unknown(WEATHER)
    name = table.text("file")
    file = str(folder / name) if isfile(folder / name) else name
    try:
        weather_file(file)
    except WeatherError as e:
        raise PlanError(f"weather.file: {e}") from None
    sense = table.text("sense") if "sense" in table else None
    if sense is not None and sense not in SENSES:
        raise table.wrong("sense", f"is not one of {', '.join(SENSES)}{nearest(sense, SENSES)}")
    headings = table.table.get("columns", {})
    if not isinstance(headings, dict):
        raise table.wrong("columns", 'give a table such as { Hs = "wave height (cm)" }.')
    try:
        columns = mapped(headings, "weather.columns")
    except WeatherError as e:
        raise PlanError(str(e)) from None
    order = table.text("date_order") if "date_order" in table else None
    if order is not None and order not in ORDERS:
        raise table.wrong("date_order", f"is not one of {', '.join(ORDERS)}.")
    time = table.text("time") if "time" in table else None
    ship = parse_direction(table.table["ship"], "weather.ship") if "ship" in table else None
    return WeatherUse(file, ship, sense, columns, time, order)


def _digest(plan: LiftPlan) -> str:
    """SHA-256 of everything that numbers follow from; names of files and notes are none."""
    content_of_plan = {
        "crane": content(plan.crane),
        "vessel": plan.vessel.digest.hex(),
        "at": [plan.at.x, plan.at.y, plan.h_tip],
        "payload": plan.payload.to_dict(),
        "water": [plan.depth, plan.rho],
        "phases": [phase.model_dump(mode="json") for phase in plan.phases],
        "environment": plan.environment.model_dump(mode="json"),
        "rules": plan.rules.digest,
        "operation": [plan.T_POP, plan.T_C],
        **{key: getattr(plan, key).model_dump(mode="json") for key in ("rigging", "wire", "winch", "sensors")},
        "alternatives": [a.value for a in plan.alternatives],
    }
    return hashlib.sha256(json.dumps(content_of_plan, sort_keys=True).encode()).hexdigest()
