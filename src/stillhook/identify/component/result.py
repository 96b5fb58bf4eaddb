"""What the identification of a component gives: parameters with intervals, held-out errors, and the crane file that
takes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field, ValidationError

from stillhook import units as u
from stillhook.base.gateway.named_files import named_path
from stillhook.errors import IdentifyError
from stillhook.library import crane_toml, cranes, load_crane
from stillhook.library.crane_file import changed
from stillhook.library.leakage import stated_leak
from stillhook.library.toml.file import explain, is_library_name
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.library.write import joined, toml_value
from stillhook.spec.crane import Crane, SourceKind
from stillhook.statistics.estimate import Estimate
from stillhook.tables.table import Spec, Text
from stillhook.units import quote, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE = "component"


class Kind(StrEnum):
    """Components that are identified from data of their own."""

    MOTOR_LEAKAGE = "motor-leakage"
    PUMP_LEAKAGE = "pump-leakage"
    SERVO = "servo"
    LINES = "lines"


class ComponentSettings(Spec):
    """Table [component] of a mapping file: what neither the log nor the table says."""

    base: Text | None = Field(default=None, description="crane, by name or file, whose file takes the result")
    circuit: str = Field(default="active", pattern="^(active|passive)$", description="circuit that the component is in")
    D_max: u.Displacement | None = Field(default=None, gt=0, description="full displacement of one unit")
    V_dead: u.Volume | None = Field(
        default=None, ge=0, description="oil left in all cylinders of one unit at the end of a full stroke"
    )
    bulk_modulus: u.Pressure | None = Field(default=None, gt=0, description="bulk modulus of the oil")


DEFAULT = ComponentSettings()
Change = tuple[Any, str | None]
"""A value of a crane file [SI] and its kind of quantity, None for a ratio or a text."""


def component_settings(mapping: Path | None) -> ComponentSettings:
    """The table [component] of a mapping file; what holds without one. Errors: IdentifyError, UnitError, one line."""
    if mapping is None:
        return ComponentSettings()
    data = parsed(toml_text(mapping), mapping.name, FileKind.MAPPING).get(TABLE, {})
    where = f"{mapping.name}: {TABLE}"
    if not isinstance(data, Mapping):
        raise IdentifyError(f"{where} = {quote(data)}: write a table with {', '.join(ComponentSettings.model_fields)}.")
    try:
        settings = ComponentSettings.model_validate(data)
    except ValidationError as problem:
        raise explain(problem, ComponentSettings, where, data, IdentifyError) from None
    if settings.base is not None and not is_library_name(settings.base):
        base = settings.base
        path = named_path(mapping.parent, base, lambda why: IdentifyError(f"{where}.base = {quote(base)}: {why}"))
        settings = settings.model_copy(update={"base": str(path)})
    return settings


def base_crane(settings: ComponentSettings, needs: str = "") -> Crane | None:
    """The crane that takes the result, None where none is named. needs: what only a crane can say; then one must be.
    Errors: IdentifyError, SpecError."""
    if settings.base is None:
        if needs:
            raise IdentifyError(f'{needs}. Write base = "nov-250t", or your crane file, in [{TABLE}] of the mapping.')
        return None
    crane = load_crane(settings.base)
    if settings.circuit not in crane.circuits:
        have = ", ".join(crane.circuits) or "none"
        raise IdentifyError(f"{TABLE}.circuit = {quote(settings.circuit)}: {crane.name} has no such circuit ({have}).")
    return crane


@dataclass(frozen=True)
class Parameter:
    """A number of a component with its 95 % interval; kind of quantity ("" for a ratio)."""

    name: str
    meaning: str
    kind: str
    estimate: Estimate
    status: str = ""


@dataclass(frozen=True)
class Component:
    """What data say of one component.

    parameters; held_out: rms of what was not fitted, over the mean of what was measured, by what was left out [-];
    notes; twin: what a crane's twin does with it; changes: tables of a crane file with values [SI] and kinds of
    quantity, {} where it takes none; figures by file stem; usable: whether a crane file may take it."""

    component: str
    source: str
    rows: int
    parameters: tuple[Parameter, ...]
    held_out: Mapping[str, float]
    notes: tuple[str, ...]
    twin: tuple[str, ...]
    changes: Mapping[str, Change]
    figures: Callable[[], Mapping[str, Figure]]
    settings: ComponentSettings = DEFAULT
    usable: bool = True

    def __getitem__(self, name: str) -> Estimate:
        """A parameter by its name."""
        return next(p.estimate for p in self.parameters if p.name == name)


def crane_with(result: Component, crane: Crane) -> Crane:
    """A crane with the numbers of a component in it.

    Parameters
    ----------
    result : Component
        From `identify_component`.
    crane : Crane
        The crane that takes them.

    Returns
    -------
    Crane
        The same with the numbers of the result; the active circuit's total leak follows its parts.

    Raises
    ------
    SpecError, UnitError
        One line, where the crane does not take them.
    """
    return changed(crane, _tree(result, all_changes(result, crane)))


def all_changes(result: Component, crane: Crane) -> dict[str, Change]:
    """Everything that differs in a crane file: the active circuit's total leak follows its parts."""
    changes = dict(result.changes)
    place = f"{result.settings.circuit}.pump"
    if f"{place}.table.omega" in changes and crane.circuits[result.settings.circuit].pump.leak_scale is not None:
        changes[f"{place}.leak_scale"] = (1.0, None)  # the table is of the pumps as they are now
    if any(path.startswith("active.") for path in changes) and result.component.endswith("leakage"):
        made = changed(crane, _tree(result, changes))
        changes["active.C_leak"] = (stated_leak(made.active), "leakage")
    return changes


def _leaf(result: Component, value: Any, kind: str | None) -> dict[str, Any]:
    text = f"identify component {result.component}: {result.source}"
    return {"value": _rounded(value, kind), "kind": SourceKind.FITTED.value, "source": text}


def _rounded(value: Any, kind: str | None) -> Any:
    """A value as a crane file has it, to six digits."""
    if isinstance(value, tuple):
        return [_rounded(each, kind) for each in value]
    if isinstance(value, str):
        return value
    return float(f"{value:.6g}") if kind is None else f"{u.in_display(value, kind):.6g} {u.KINDS[kind].display}"


def _tree(result: Component, changes: Mapping[str, Change]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for path, (value, kind) in changes.items():
        *tables, name = path.split(".")
        branch = out
        for table in tables:
            branch = branch.setdefault(table, {})
        branch[name] = _leaf(result, value, kind)
    return out


def crane_file(result: Component, crane: Crane) -> str:
    """A crane file that takes the result, and is read wherever it is: of a crane of the library its name, and what
    differs; of a user's crane file all of it. Errors: as `crane_with`."""
    made, changes = crane_with(result, crane), all_changes(result, crane)
    if result.settings.base not in cranes():
        return crane_toml(made)
    tables: dict[str, list[str]] = {"": [f"base = {toml_value(result.settings.base)}"]}
    for path, (value, kind) in changes.items():
        table, _, name = path.rpartition(".")
        tables.setdefault(table, []).append(f"{name} = {toml_value(_leaf(result, value, kind))}")
    return joined(tables)


def interval(p: Parameter) -> list[str]:
    """Value and ends of a parameter, as a reader wants them."""
    e = p.estimate
    text: Callable[[float], str] = lambda x: "-" if not np.isfinite(x) else show(x, p.kind, 4) if p.kind else f"{x:.4g}"
    return [text(e.value), text(e.low), text(e.high)]


def to_dict(result: Component) -> dict[str, Any]:
    """Everything in SI, ready for JSON."""
    out = {name: getattr(result, name) for name in ("component", "source", "rows", "usable")}
    of = {
        p.name: p.estimate.to_dict()
        | {"unit": u.KINDS[p.kind].si if p.kind else "1", "meaning": p.meaning, "status": p.status}
        for p in result.parameters
    }
    return out | {"parameters": of, **{name: getattr(result, name) for name in ("held_out", "notes", "twin")}}
