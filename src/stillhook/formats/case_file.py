"""Case files: one TOML with a crane, a scenario, and settings of the commands that are seldom changed."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

from pydantic import AfterValidator, Field, ValidationError

from stillhook.engine.arguments import with_usual_controller
from stillhook.errors import ScenarioError
from stillhook.formats.motion.open import read_tip_motion, stored_motion
from stillhook.formats.results import load_run, origin, stored_steps
from stillhook.formats.table.corrections import corrections
from stillhook.library import load_crane
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind, kind_of_toml
from stillhook.library.toml.tree import toml_text
from stillhook.sea.motion.motion import Motion, Profile
from stillhook.sea.motion.text import parse_motion
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.tables.table import Flag, Share, Spec, Text, first_problem
from stillhook.units import Length, Speed

Read = TypeVar("Read")
FASTEST = 10.0
"""Wire speed that a drive may be sized for at most [m/s]: some five times that of fast winches."""
_ADDRESS = re.compile(r"\S+:[0-9]+|inproc://\S+")


def _address(text: str) -> str:
    if not _ADDRESS.fullmatch(text):
        raise ValueError('no address of a Dask scheduler. Write it with its port, such as "tcp://10.0.0.1:8786".')
    return text


class TipFile(Spec):
    """A table `tip` that names a log of motion; what is left out is not passed on."""

    file: Text = Field(description="path of the log, seen from this file")
    position: Any = Field(default=None, description="crane tip from the motion sensor")
    heave: Any = Field(default=None, description="sign of the heave")
    time: Any = Field(default=None, description="column of the times")
    max_gap: Any = Field(default=None, description="longest gap that is bridged")
    start: Any = Field(default=None, description="begin of the part that is used")
    duration: Any = Field(default=None, description="length of the part that is used")
    mapping: Text | None = Field(default=None, description="mapping file of its columns, seen from this file")
    columns: Mapping[str, Any] = Field(default_factory=dict, description="its columns, as in a mapping file")


class Settings(Spec):
    """The table [settings]: how commands work on a case; all are checked, and each command uses those that it has."""

    seed: Annotated[int, Field(strict=True, ge=0)] = Field(default=0, description="seed of random numbers")
    draws: Annotated[int, Field(strict=True, ge=0, le=4096)] = Field(
        default=16, description="draws of compare --drives"
    )
    top_speed: Annotated[Speed, Field(gt=0, le=FASTEST)] | None = Field(
        default=None, description="wire speed that compare --drives sizes drives for"
    )
    full_plan: Flag = Field(default=False, description="compare --plan: the twin in the loop (hours)")
    budget: Annotated[int, Field(strict=True, ge=20)] = Field(default=400, description="runs of each tuning")
    at_most: Share = Field(default=0.05, ge=0, le=1, description="tolerated probability of exceeding a limit")
    faults: tuple[Text, ...] | None = Field(
        default=None,
        description='sensor faults that compare tries, such as ["s_w frozen", "F offset 300 kN"]; [] for the usual',
    )
    fault_limit: Annotated[Length, Field(gt=0, le=1000)] = Field(
        default=1.0, description="wire by which a sensor fault may move the load"
    )
    store: Text | None = Field(
        default=None, description="folder that keeps results as they finish, seen from this file"
    )
    scheduler: Annotated[Text, AfterValidator(_address)] | None = Field(
        default=None, description="address of a Dask scheduler"
    )


class CaseTables(Spec):
    """A case file."""

    crane: Text = Field(description="library name or crane file")
    scenario: Mapping[str, Any] = Field(default_factory=dict, description="table [scenario]")
    settings: Settings = Field(default_factory=Settings, description="table [settings]")
    step: Text | None = Field(default=None, description='time step with a unit, such as "2 ms"')
    every: Text | None = Field(default=None, description='time between stored values with a unit, such as "0.1 s"')


class CaseFile(NamedTuple):
    """A crane, what is done to it, and how finely it is run and stored (None: default)."""

    crane: Crane
    case: Scenario
    step: str | None
    every: str | None


class Subject(NamedTuple):
    """What a command is about: a crane, and of a case file the scenario, its settings and the time step."""

    crane: Crane
    scenario: Mapping[str, Any]  # fields as written, the tip's motion read
    settings: Settings
    step: str | None

    def case(self, usual: Mapping[str, Any], typed: Mapping[str, Any]) -> Scenario:
        """The scenario of the file, or the usual one, with what was typed (None: not) in place of its fields."""
        given = {name: value for name, value in typed.items() if value is not None}
        return with_usual_controller(self.crane, Scenario(**{**(self.scenario or usual), **given}))


def load_subject(name: str) -> Subject:
    """A crane by name or file, or what a case file describes. Errors: StillhookError of one line."""
    path = Path(name)
    if path.suffix == ".toml" and path.is_file() and kind_of_toml(toml_text(path)) is FileKind.CASE:
        return _read(path, _subject)
    return Subject(load_crane(name), {}, Settings(), None)


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
    return _read(path, _case)


def _read(path: str | Path, read: Callable[[TomlTable], Read]) -> Read:
    return read_toml_raising(ScenarioError, path, FileKind.CASE, read, start="A case file needs crane and [scenario].")


def _case(table: TomlTable) -> CaseFile:
    file = table.read(CaseTables)
    if not file.scenario:
        raise table.missing("scenario")
    crane = load_crane(table.relative_toml(file.crane))
    case = Scenario(**scenario_fields(file.scenario, table.path.parent, table.path.stem))
    return CaseFile(crane, with_usual_controller(crane, case), file.step, file.every)


def _subject(table: TomlTable) -> Subject:
    file, folder = table.read(CaseTables), table.path.parent
    fields = scenario_fields(file.scenario, folder, table.path.stem) if file.scenario else {}
    settings = file.settings
    if settings.store is not None:
        settings = settings.model_copy(update={"store": str(folder / settings.store)})
    return Subject(load_crane(table.relative_toml(file.crane)), fields, settings, file.step)


def stored_cases(path: str | Path) -> list[CaseFile]:
    """What a stored run was made from, to be run again with the same steps. Errors: StillhookError."""
    run = load_run(path)
    cranes, cases = origin(run)
    step, every = stored_steps(run)
    return [CaseFile(crane, case, step, every) for crane, case in zip(cranes, cases, strict=True)]


def scenario_fields(table: Mapping[str, Any], folder: Path, name: str) -> dict[str, Any]:
    """Fields of a Scenario from a TOML table, its tip read; files are looked for in the folder."""
    values = {"name": name, **table}
    if "tip" in values:
        values["tip"] = read_tip(values["tip"], folder)
    return values


def read_tip(tip: Any, folder: Path) -> Motion:
    """Tip motion from a text ("sine 2.8 m 12 s") or a table that names a file."""
    if isinstance(tip, str):
        return parse_motion(tip, "tip")
    if isinstance(tip, dict) and set(tip) == {"profile"}:
        return Profile(_pairs(tip["profile"]))
    if not isinstance(tip, dict) or "file" not in tip:
        raise ScenarioError(
            'tip: give a text such as "sine 2.8 m 12 s", a table { file = ..., position = [...] }, or a velocity'
            ' profile { profile = [["0 s", "0 m/min"], ["10 s", "30 m/min"], ...] }.'
        )
    try:
        source = TipFile.model_validate(tip)
    except ValidationError as e:
        raise ScenarioError(first_problem(e, TipFile, tip, "tip").line) from None
    options = {key: value for key, value in tip.items() if key != "file"}
    stored = stored_motion(folder / source.file)
    if stored is not None:
        if options:
            key = next(iter(options))
            raise ScenarioError(f"tip.{key}: {source.file} holds a tip's motion and takes no options. Leave it out.")
        return stored
    position, mapping = options.pop("position", None), options.pop("mapping", None)
    rows = corrections(None if mapping is None else folder / mapping) | dict(options.pop("columns", {}))
    return read_tip_motion(
        folder / source.file, tip=tuple(position) if isinstance(position, list) else position, columns=rows, **options
    )


def _pairs(rows: Any) -> list[tuple[str, str]]:
    if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 2 for r in rows):
        raise ScenarioError(
            'tip.profile: give pairs of time and speed, such as [["0 s", "0 m/min"], ["10 s", "30 m/min"]].'
        )
    return [(r[0], r[1]) for r in rows]
