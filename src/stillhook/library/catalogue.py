"""What the library holds by name: motors, leak tables of pumps, system frictions, payloads, compensators, vessels,
weather."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

from pydantic import Field, ValidationError, model_validator

from stillhook import units as u
from stillhook.base.choice import nearest
from stillhook.base.gateway.guard import reader
from stillhook.errors import LiftError, SeaError, StillhookError, WeatherError
from stillhook.library.toml.file import explain
from stillhook.library.toml.kinds import LIBRARY, FileKind, unknown_name
from stillhook.library.toml.tree import (
    LABELS,
    Tree,
    library_table,
    library_tree,
    parsed,
    shelf,
    sources,
    toml_text,
    tree,
    values,
)
from stillhook.spec.crane import Source, SystemFriction
from stillhook.spec.lift.payload import Payload
from stillhook.tables.sheet import is_table
from stillhook.tables.table import Spec
from stillhook.units import quote
from stillhook.winches.circuits.tables import Motor
from stillhook.winches.load_path.interface import JointUnit
from stillhook.winches.load_path.registry import unit_of

_Table = TypeVar("_Table", bound=Spec)
Result = TypeVar("Result")


class LeakTable(Spec):
    """Total leak conductance of one pump against displacement and shaft speed (Moslatt 2020 tables 2.5 and 2.6).

    ``C[i][j]`` belongs to shaft speed ``omega[i]`` and displacement ``D[j]``, both rising. For another pump size scale
    with its full displacement over ``D_ref``; the table's displacements scale along.
    """

    D_ref: u.Displacement = Field(gt=0, description="full displacement of the measured pump")
    D: tuple[Annotated[u.Displacement, Field(gt=0)], ...] = Field(min_length=2, description="displacements")
    omega: tuple[Annotated[u.Rotation, Field(gt=0)], ...] = Field(min_length=2, description="shaft speeds")
    C: tuple[tuple[Annotated[u.Leakage, Field(ge=0)], ...], ...] = Field(description="total leak conductances")

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        for name, axis in (("D", self.D), ("omega", self.omega)):
            if list(axis) != sorted(set(axis)):
                raise ValueError(f"{name} must rise from entry to entry.")
        if [len(row) for row in self.C] != [len(self.D)] * len(self.omega):
            raise ValueError(f"C needs {len(self.omega)} rows of {len(self.D)} values.")
        return self


def motors() -> tuple[str, ...]:
    """Names of the library's motors."""
    return shelf("motors")


def leak_tables() -> tuple[str, ...]:
    """Names of the library's pump leak tables."""
    return shelf("pumps")


def frictions() -> tuple[str, ...]:
    """Names of the library's system frictions."""
    return shelf("friction")


def without_title(tree: Tree) -> Tree:
    """The numbers of a library file: all but its title."""
    return {key: item for key, item in tree.items() if key != "title"}


def motor(name: str) -> Motor:
    """One motor of the library; SpecError for an unknown name."""
    return _read(Motor, name, values(without_title(library_tree("motors", name, "motor"))))


def system_friction(name: str) -> SystemFriction:
    """One system friction of the library; SpecError for an unknown name."""
    return _read(SystemFriction, name, values(without_title(library_tree("friction", name, "system friction"))))


@functools.cache
def leak_table(name: str) -> LeakTable:
    """One pump leak table of the library; SpecError for an unknown name."""
    data = values(without_title(library_tree("pumps", name, "leak table")))
    return _read(LeakTable, name, data | {"C": list(data["C"].values())})


def _read(model: type[_Table], name: str, data: dict[str, Any]) -> _Table:
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise explain(error, model, f"{name}.toml", data) from None


def payloads() -> tuple[str, ...]:
    """Names of the library's payloads."""
    return shelf("payloads")


@reader(LiftError)
def read_payload(name_or_path: str | Path) -> Payload:
    """A payload of the library by name, or one described in a TOML file.

    A file gives name, mass, and levels or a shape with its dimensions. Parts of an assembly are tables [parts.NAME],
    levels a list of tables.

    Parameters
    ----------
    name_or_path : str or Path
        Name in the library, such as "template-120t", or path of a file.

    Returns
    -------
    Payload
        The payload [SI].

    Raises
    ------
    LiftError
        One line that names the file.

    Examples
    --------
    >>> import stillhook
    >>> stillhook.read_payload("template-120t").mass
    120000.0
    """
    return _described(
        "payloads", name_or_path, FileKind.PAYLOAD, _payload, "Give name, mass and a shape with its dimensions."
    )


def _described(
    shelf_name: str,
    name_or_path: str | Path,
    kind: FileKind,
    read: Callable[[Mapping[str, Any], str, bool], Result],
    start: str,
) -> Result:
    """What `read` makes of a table of the library, by its name, or of a user's file; start: what an empty one needs.
    Errors: LiftError of one line that names the file."""
    name, noun = str(name_or_path), shelf_name.removesuffix("s")
    if name in shelf(shelf_name):
        return read(library_table(shelf_name, name, noun), f"{name}.toml", False)
    path = Path(name)
    if path.suffix != ".toml":
        raise LiftError(unknown_name(noun, name, shelf(shelf_name), kind))
    try:
        return read(parsed(toml_text(path), path.name, kind, start=start), path.name, True)
    except StillhookError as problem:
        line = str(problem)
        raise LiftError(line if line.startswith((path.name, quote(name))) else f"{path.name}: {line}") from None


def _payload(table: Mapping[str, Any], label: str, user: bool) -> Payload:
    fields = tree(_without_lists(table), label, user=user)
    plain_values = values(fields)
    text = plain_values.get("source")
    whole_file = f"given in {label}" if user and isinstance(text, str) and text.strip() else ""
    stated = {
        path: Source(text=str(text), kind=source.kind) if whole_file and source.text == whole_file else source
        for path, source in sources(fields)
        if path not in LABELS and path != "source"
    }
    return Payload(**{"name": Path(label).stem, **plain_values, "sources": stated})


def _without_lists(table: Mapping[str, Any]) -> dict[str, Any]:
    """Lists of tables as tables of tables, numbered from 1, so that each of their values can have a source."""
    out: dict[str, Any] = {}
    for key, item in table.items():
        if isinstance(item, list) and item and all(isinstance(row, Mapping) for row in item):
            item = {str(i): row for i, row in enumerate(item, 1)}
        out[key] = _without_lists(item) if isinstance(item, Mapping) else item
    return out


def compensators() -> tuple[str, ...]:
    """Names of the library's passive heave compensators."""
    return shelf("compensators")


@reader(LiftError)
def read_compensator(name_or_path: str | Path, changes: Mapping[str, Any] | None = None) -> JointUnit:
    """A passive heave compensator of the library by name, or one described in a TOML file.

    Parameters
    ----------
    name_or_path : str or Path
        Name in the library, such as "phc-150t", or path of a file.
    changes : mapping, optional
        Fields that are other here, such as the pressure it is charged to for a lift, {"p_0": "90 bar"}.

    Returns
    -------
    JointUnit
        The compensator [SI].

    Raises
    ------
    LiftError
        One line that names the file.

    Examples
    --------
    >>> import stillhook
    >>> stillhook.read_compensator("phc-150t", {"p_0": "90 bar"}).stroke
    4.0
    """
    start = "Give its stroke, area, p_0 and V_0."
    changed = dict(changes or {})

    def read(table: Mapping[str, Any], label: str, user: bool) -> tuple[JointUnit, dict[str, Any]]:
        fields = tree(table, label, user=user)
        stated = {
            path: source
            for path, source in sources(fields)
            if path not in (*LABELS, "type", "source") and path not in changed
        }
        own = {"name": Path(label).stem, **values(fields), "sources": stated}
        return unit_of(own), own

    unit, own = _described("compensators", name_or_path, FileKind.COMPENSATOR, read, start)
    return unit_of({**own, **changed}) if changed else unit


def vessels() -> tuple[str, ...]:
    """Names of the library's vessels."""
    return shelf("vessels", ".csv")


def vessel_file(name: str) -> Path:
    """The file of a library vessel, for `stillhook.formats.vessel.open.read_vessel`.

    Errors: SeaError of one line that names the vessels there are.
    """
    if name not in vessels():
        raise SeaError(f"No vessel {quote(name)}: the library has {', '.join(vessels())}{nearest(name, vessels())}")
    return LIBRARY / "vessels" / f"{name}.csv"


def weathers() -> tuple[str, ...]:
    """Names of the library's weather."""
    return shelf("weather", ".csv.gz")


def weather_file(name_or_path: str) -> Path:
    """The file of library weather, or a path of one's own as it is.

    Errors: WeatherError of one line that names what there is, for what is neither a name nor a file.
    """
    if name_or_path in weathers():
        return LIBRARY / "weather" / f"{name_or_path}.csv.gz"
    path = Path(name_or_path)
    if not is_table(path):
        have = f"{', '.join(weathers()) or 'none'}{nearest(name_or_path, weathers())}"
        raise WeatherError(f"{quote(name_or_path)}: no such file, and no weather of the library, which has {have}")
    return path
