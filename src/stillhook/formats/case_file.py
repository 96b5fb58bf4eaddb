"""Case files: one TOML with a crane and a scenario."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.errors import ScenarioError, SpecError, StillhookError
from stillhook.formats.motion.open import read_tip_motion, stored_motion
from stillhook.formats.results import load_run, origin, stored_steps
from stillhook.library import load_crane
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.sea.motion.motion import Motion, Profile
from stillhook.sea.motion.text import parse_motion
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, PowerLoss, Scenario, Sensors, Water
from stillhook.units import quote

TOP = ("crane", "scenario", "step", "every")
TIP_FILE = ("file", "position", "heave", "time", "max_gap", "start", "duration")
TABLES: Mapping[str, type] = {"water": Water, "sensors": Sensors, "operator": Operator, "power_loss": PowerLoss}


class CaseFile(NamedTuple):
    """A crane, what is done to it, and how finely it is run and stored (None: default)."""

    crane: Crane
    case: Scenario
    step: str | None
    every: str | None


def load_case(path: str | Path) -> CaseFile:
    """Read a case file::

        crane = "nov-250t"            # or the path of a crane file, seen from this file
        [scenario]
        load = "100 t"
        s_w  = "100 m"
        mode = "ssc"
        tip  = "sine 2.8 m 12 s"      # or { file = "log.txt", position = ["20 m", "-8 m", "25 m"] }

    Errors: StillhookError, one line that names file, field, what came and what is allowed.
    """
    file = Path(path)
    data = _read(file)
    try:
        _refuse_unknown(data, TOP, "")
        for name in ("crane", "scenario"):
            if name not in data:
                raise ScenarioError(f"{name}: missing. A case file needs crane and [scenario].")
        crane = load_crane(_crane_name(data["crane"], file.parent))
        if not isinstance(data["scenario"], dict):
            raise ScenarioError("scenario: give a table [scenario].")
        case = build_scenario(data["scenario"], file.parent, file.stem)
        for name in ("step", "every"):
            if not isinstance(data.get(name, ""), str):
                raise ScenarioError(f'{name} = {quote(data[name])}: give a text with a unit, such as "2 ms".')
        return CaseFile(crane, case, data.get("step"), data.get("every"))
    except StillhookError as e:
        raise type(e)(f"{file.name}: {e}") from None


def stored_cases(path: str | Path) -> list[CaseFile]:
    """What a stored run was made from, to be run again with the same steps. Errors: StillhookError."""
    run = load_run(path)
    cranes, cases = origin(run)
    step, every = stored_steps(run)
    return [CaseFile(crane, case, step, every) for crane, case in zip(cranes, cases, strict=True)]


def demo_cases() -> list[CaseFile]:
    """The package's own cases, in the order of their files."""
    shelf = files("stillhook.library") / "data" / "demo"
    with as_file(shelf) as folder:
        return [load_case(path) for path in sorted(folder.glob("*.toml"))]


def build_scenario(table: Mapping[str, Any], folder: Path, name: str) -> Scenario:
    """A Scenario from a TOML table; files are looked for next to the case file."""
    values = {"name": name, **table}
    if "tip" in values:
        values["tip"] = read_tip(values["tip"], folder)
    for key, cls in TABLES.items():
        if key in values:
            if not isinstance(values[key], dict):
                raise ScenarioError(f"{key}: give a table [scenario.{key}].")
            values[key] = cls(**values[key])
    return Scenario(**values)


def read_tip(tip: Any, folder: Path) -> Motion:
    """Tip motion from a text ("sine 2.8 m 12 s") or a table that names a file."""
    if isinstance(tip, str):
        return parse_motion(tip, "tip")
    if isinstance(tip, dict) and "profile" in tip:
        _refuse_unknown(tip, ("profile",), "tip.")
        return Profile(_pairs(tip["profile"]))
    if not isinstance(tip, dict) or "file" not in tip:
        raise ScenarioError(
            'tip: give a text such as "sine 2.8 m 12 s", a table { file = ..., position = [...] }, or a velocity'
            ' profile { profile = [["0 s", "0 m/min"], ["10 s", "30 m/min"], ...] }.'
        )
    _refuse_unknown(tip, TIP_FILE, "tip.")
    stored = stored_motion(folder / str(tip["file"]))
    if stored is not None:
        _refuse_unknown(tip, ("file",), f"tip: {tip['file']} holds a tip's motion and takes no options; ")
        return stored
    options = {k: v for k, v in tip.items() if k not in ("file", "position")}
    position = tuple(tip["position"]) if isinstance(tip.get("position"), list) else tip.get("position")
    return read_tip_motion(folder / str(tip["file"]), tip=position, **options)


def _pairs(rows: Any) -> list[tuple[str, str]]:
    if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 2 for r in rows):
        raise ScenarioError(
            'tip.profile: give pairs of time and speed, such as [["0 s", "0 m/min"], ["10 s", "30 m/min"]].'
        )
    return [(r[0], r[1]) for r in rows]


def _read(file: Path) -> dict[str, Any]:
    try:
        return parsed(toml_text(file), file.name, FileKind.CASE, start="A case file needs crane and [scenario].")
    except SpecError as e:
        raise ScenarioError(str(e)) from None


def _refuse_unknown(table: Mapping[str, Any], allowed: tuple[str, ...], place: str) -> None:
    for key in table:
        if key not in allowed:
            raise ScenarioError(f"{place}{quote(key)[1:-1]}: unknown field. Allowed: {', '.join(allowed)}.")


def _crane_name(value: Any, folder: Path) -> str:
    if not isinstance(value, str):
        raise ScenarioError(f"crane = {quote(value)}: give a library name or the path of a crane file.")
    neighbour = str(folder / value)
    return neighbour if value.endswith(".toml") and os.path.isfile(neighbour) else value
