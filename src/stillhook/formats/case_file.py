"""Case files: one TOML with a crane, a scenario, and settings of the commands that are seldom changed."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

from pydantic import AfterValidator, Field, ValidationError

from stillhook.base.gateway.guard import reader
from stillhook.base.gateway.named_files import named_path
from stillhook.engine.arguments import with_usual_controller
from stillhook.errors import ScenarioError
from stillhook.formats.motion.open import read_ship_motion, read_tip_motion, stored_motion
from stillhook.formats.results import load_run, origin, stored_steps
from stillhook.formats.table.corrections import corrections
from stillhook.library import load_crane
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind, kind_of_toml
from stillhook.library.toml.tree import toml_text
from stillhook.sea.motion.motion import Motion, Profile
from stillhook.sea.motion.words import parse_motion
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.vessel_tip import ANGLES, SIZES, VesselTip
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.tables.table import Flag, Share, Spec, Text, first_problem
from stillhook.units import Length, Speed, quote

Read = TypeVar("Read")
Checked = TypeVar("Checked", bound=Spec)
FASTEST = 10.0
"""Wire speed that a drive may be sized for at most [m/s]: some five times that of fast winches."""
_ADDRESS = re.compile(r"\S+:[0-9]+|inproc://\S+")


def _address(text: str) -> str:
    if not _ADDRESS.fullmatch(text):
        raise ValueError('no address of a Dask scheduler. Write it with its port, such as "tls://10.0.0.1:8786".')
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


class UnitTable(Spec):
    """A table `unit` in a table `tip` with a boom: the motion unit, see `stillhook.MotionUnit`."""

    at: Any = Field(default=None, description="from the point whose motion is given to the motion unit")
    heave_period: Any = Field(default=None, description="corner of its heave filter")
    heave_damping: Any = Field(default=None, description="damping of that filter")
    delay: Any = Field(default=None, description="by which its signals are late")
    noise_heave: Any = Field(default=None, description="noise of heave")
    noise_speed: Any = Field(default=None, description="noise of the heave's speed")
    noise_angle: Any = Field(default=None, description="noise of roll and pitch")
    noise_rate: Any = Field(default=None, description="noise of their rates")
    seed: Any = Field(default=None, description="seed of its noise")
    rotations: Any = Field(default=None, description="how the PLC turns the lever: exact or small-angle")


class VesselTable(Spec):
    """A table `tip` with a boom: motion of the vessel, from a log or in words, and of the boom, see
    `stillhook.VesselTip`."""

    boom: Text = Field(description="boom, its heel pin from the point whose motion is given")
    file: Text | None = Field(default=None, description="log of heave, roll and pitch, seen from this file")
    heave: Any = Field(default=None, description="heave in words; with a log the sign of its heave")
    roll: Any = Field(default=None, description="roll in words")
    pitch: Any = Field(default=None, description="pitch in words")
    surge: Any = Field(default=None, description="surge in words")
    sway: Any = Field(default=None, description="sway in words")
    yaw: Any = Field(default=None, description="yaw in words")
    slew: Any = Field(default=None, description="slewing: first time, last time, angle reached")
    luff: Any = Field(default=None, description="luffing of the main boom, likewise")
    fold: Any = Field(default=None, description="folding of the knuckle boom, likewise")
    unit: Mapping[str, Any] = Field(default_factory=dict, description="table of the motion unit")
    time: Any = Field(default=None, description="column of the times of a log")
    max_gap: Any = Field(default=None, description="longest gap of a log that is bridged")
    start: Any = Field(default=None, description="begin of the part of a log that is used")
    duration: Any = Field(default=None, description="length of the part of a log that is used")
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


@reader(ScenarioError)
def load_case(path: str | Path) -> CaseFile:
    """Read a case file::

        crane = "nov-250t"            # or the path of a crane file, seen from this file
        [scenario]
        load = "100 t"
        s_w  = "100 m"
        mode = "ssc"
        tip  = "sine 2.8 m 12 s"      # or { file = "log.txt", position = ["20 m", "-8 m", "25 m"] }
                                      # or { file = "log.txt", boom = "x=-10 m, ...", unit = { heave_period = "25 s" } }

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
        settings = settings.model_copy(update={"store": str(table.named_path(settings.store, "settings", "store"))})
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
        pairs = 'give pairs of time and speed, such as [["0 s", "0 m/min"], ["10 s", "30 m/min"]].'
        return Profile(_rows(tip["profile"], 2, f"tip.profile: {pairs}"))
    if isinstance(tip, dict) and "boom" in tip:
        return _vessel_tip(tip, folder)
    if not isinstance(tip, dict) or "file" not in tip:
        raise ScenarioError(
            'tip: give a text such as "sine 2.8 m 12 s", a table { file = ..., position = [...] } or { boom = ...,'
            ' roll = ... }, or a velocity profile { profile = [["0 s", "0 m/min"], ["10 s", "30 m/min"], ...] }.'
        )
    source = _checked(TipFile, tip, "tip")
    options = {key: value for key, value in tip.items() if key != "file"}
    path = _named_file(folder, source.file)
    stored = stored_motion(path)
    if stored is not None:
        if options:
            key = next(iter(options))
            raise ScenarioError(f"tip.{key}: {source.file} holds a tip's motion and takes no options. Leave it out.")
        return stored
    position = tuple(source.position) if isinstance(source.position, list) else source.position
    options = {key: value for key, value in options.items() if key not in ("position", "mapping", "columns")}
    return read_tip_motion(path, tip=position, columns=_columns(source, folder), **options)


def _named_file(folder: Path, name: str, where: str = "tip.file") -> Path:
    """A file that a tip's table names. Errors: ScenarioError where it is not in the folder of the case file."""
    return named_path(folder, name, lambda why: ScenarioError(f"{where} = {quote(name)}: {why}"))


def _checked(model: type[Checked], data: Any, where: str) -> Checked:
    """A table of the file. Errors: ScenarioError of one line."""
    try:
        return model.model_validate(data)
    except ValidationError as e:
        raise ScenarioError(first_problem(e, model, data, where).line) from None


def _columns(table: TipFile | VesselTable, folder: Path) -> dict[str, Any]:
    """Columns of a log, those of the table before those of its mapping file."""
    return corrections(None if table.mapping is None else _named_file(folder, table.mapping, "tip.mapping")) | dict(
        table.columns
    )


def _vessel_tip(tip: dict[str, Any], folder: Path) -> Motion:
    """Motion of a tip from that of the vessel."""
    table = _checked(VesselTable, tip, "tip")
    _checked(UnitTable, table.unit, "tip.unit")
    unit = MotionUnit(**table.unit)
    moves: dict[str, Any] = {
        name: _rows(tip[name], 3, f"tip.{name}: give rows of first time, last time and angle reached, such as {MOVES}.")
        for name in ANGLES
        if name in tip
    }
    motions = {name: tip[name] for name in SIZES if name in tip}
    log = {name: tip[name] for name in ("time", "max_gap", "start", "duration") if name in tip}
    if table.file is None:
        if unused := [name for name in (*log, "mapping", "columns") if name in tip]:
            raise ScenarioError(
                f"tip.{unused[0]}: belongs to a log, and none is given. Name it as file, or leave it out."
            )
        for name, value in motions.items():
            if not isinstance(value, str):
                raise ScenarioError(f"tip.{name}: {quote(value)} is not a text such as {EXAMPLES[SIZES[name]]}.")
        return VesselTip(table.boom, **motions, **moves, unit=unit)
    sign = motions.pop("heave", None)
    if motions:
        raise ScenarioError(f"tip.{next(iter(motions))}: {table.file} holds the motion of the vessel. Leave it out.")
    ship = read_ship_motion(_named_file(folder, table.file), heave=sign, columns=_columns(table, folder), **log)
    return VesselTip.from_log(ship, table.boom, **moves, unit=unit)


EXAMPLES = {"length": '"sine 1 m 14 s"', "angle": '"sine 2 deg 12 s"'}


MOVES = '[["30 s", "90 s", "180 deg"]]'


def _rows(rows: Any, n: int, refusal: str) -> Any:
    """Rows of n entries each. Errors: ScenarioError of this line."""
    if not isinstance(rows, list) or not all(isinstance(row, list) and len(row) == n for row in rows):
        raise ScenarioError(refusal)
    return [tuple(row) for row in rows]
