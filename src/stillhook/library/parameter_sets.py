"""Parameter sets with their uncertainty: system frictions and motor losses, of the library or of your own."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import Field, ValidationError, field_validator, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.base.choice import nearest
from stillhook.base.gateway.guard import reader
from stillhook.base.gateway.named_files import named_path
from stillhook.errors import SpecError
from stillhook.library.toml.file import explain
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.loss_map import with_map
from stillhook.library.toml.tree import (
    EVIDENCE,
    Leaf,
    Tree,
    library_table,
    parsed,
    shelf,
    sources,
    toml_text,
    tree,
    values,
)
from stillhook.library.write import file_value, joined, leaf_tables, toml_value
from stillhook.spec.crane import Source, SourceKind, SystemFriction
from stillhook.tables.table import Number, Spec, Text
from stillhook.units import quote
from stillhook.winches.circuits.losses import X_NAMES, loss_names
from stillhook.winches.circuits.tables import Motor

SYMMETRY = 1e-6
"""Relative difference across the diagonal that is rounding of a written matrix."""
SEMIDEFINITE = 1e-6
"""Most negative eigenvalue of the correlations that is rounding of a written matrix."""
RANGES = {"omega_m": "rotation", "T_d": "drum_torque", "dp_m": "pressure", "D_m": "displacement"}
"""Ranges that the data may name, and their kinds of quantity."""

Row = Annotated[tuple[Number, ...], Field(min_length=1)]
Pair = Field(default=None, description="range of the data")


class Evidence(Spec):
    """Data that a set was fitted to. covariance in SI, rows and columns in the order of names; dof degrees of freedom
    left by the fit; omega_m, T_d, dp_m, D_m ranges of the data; statements what the data cannot determine, one sentence
    each."""

    names: tuple[Text, ...] = Field(min_length=1, description="parameters that were fitted")
    covariance: tuple[Row, ...] = Field(
        min_length=1, description="covariance of the parameters in SI, in the order of names"
    )
    dof: Number = Field(gt=0, description="degrees of freedom of the fit")
    data: Text = Field(description="data of the fit")
    omega_m: tuple[u.Rotation, u.Rotation] | None = Pair
    T_d: tuple[u.Torque, u.Torque] | None = Pair
    dp_m: tuple[u.Pressure, u.Pressure] | None = Pair
    D_m: tuple[u.Displacement, u.Displacement] | None = Pair
    statements: tuple[Text, ...] = Field(default=(), description="what the data cannot determine")

    @field_validator(*RANGES)
    @classmethod
    def _rises(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and value[0] > value[1]:
            raise ValueError("its second value is below its first. Write the lower end first.")
        return value

    @model_validator(mode="after")
    def _is_a_covariance(self) -> Self:
        n = len(self.names)
        if len(set(self.names)) < n:
            raise ValueError("names: a name is given twice. Name each parameter once.")
        if len(self.covariance) != n or any(len(row) != n for row in self.covariance):
            sizes = ", ".join(map(str, sorted({len(row) for row in self.covariance})))
            counts = f"{len(self.covariance)} rows of {sizes} values for {n} names"
            raise ValueError(f"covariance: {counts}. Give {n} rows of {n}.")
        if problem := _not_a_covariance(self.matrix):
            raise ValueError(f"covariance: {problem}")
        return self

    @classmethod
    def fitted(
        cls,
        names: Sequence[str],
        covariance: FloatArray,
        *,
        dof: float,
        data: str,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        statements: Sequence[str] = (),
    ) -> Evidence:
        """The evidence of a fit from its numbers, all in SI; ranges by the names of `RANGES`. Errors: SpecError."""
        ends = {k: [f"{float(x)!r} {u.KINDS[RANGES[k]].si}" for x in pair] for k, pair in (ranges or {}).items()}
        table = {
            "names": list(names),
            "covariance": np.asarray(covariance, dtype=np.float64).tolist(),
            "dof": float(dof),
            "data": data,
        }
        evidence = evidence_of({**table, **ends, "statements": list(statements)}, tuple(names), "fit")
        assert evidence is not None
        return evidence

    @property
    def matrix(self) -> FloatArray:
        """The covariance, shape (n, n), SI."""
        return np.array(self.covariance, dtype=np.float64)

    def deviation(self, name: str) -> float:
        """Standard deviation of a parameter [SI]; 0 where it was not fitted."""
        return math.sqrt(self.covariance[self.names.index(name)][self.names.index(name)]) if name in self.names else 0.0


def _not_a_covariance(C: FloatArray) -> str:
    """Why a square matrix is not a covariance; "" where it is one."""
    scale = np.sqrt(np.abs(np.diag(C)))
    if np.any(np.diag(C) < 0.0):
        return "a variance on its diagonal is negative. Give variances and covariances."
    unit = np.where(scale > 0.0, scale, 1.0)
    R = C / np.outer(unit, unit)
    if np.max(np.abs(R - R.T)) > SYMMETRY:
        return "it is not symmetric. Give the covariance of each pair twice."
    least = float(np.linalg.eigvalsh(0.5 * (R + R.T))[0])
    if least < -SEMIDEFINITE:
        problem = f"it is not positive semidefinite (least eigenvalue of its correlations {least:.3g})"
        return f"{problem}. Give a covariance matrix."
    return ""


def evidence_of(table: Any, allowed: tuple[str, ...], label: str) -> Evidence | None:
    """The evidence in a set's file, None where there is none; allowed names of its parameters."""
    if table is None:
        return None
    if not isinstance(table, Mapping):
        fields = ", ".join(Evidence.model_fields)
        raise SpecError(f"{label}: {EVIDENCE} = {quote(table)}: must be a table, with {fields}.")
    try:
        evidence = Evidence.model_validate(table)
    except ValidationError as error:
        raise explain(error, Evidence, f"{label}: {EVIDENCE}", table) from None
    for name in evidence.names:
        if name not in allowed:
            raise SpecError(f"{label}: {EVIDENCE}.names: {quote(name)} is not one of {', '.join(allowed)}.")
    return evidence


SUFFIX = ".toml"
FRICTION, MOTORS = "friction", "motors"
OF_SHELF = {FRICTION: FileKind.FRICTION, MOTORS: FileKind.MOTOR}
ANY = "set"
"""Where a set of either kind may be named."""
LOSS_RANGE = ("D_loss_min", "n_loss_max", "dp_loss_max")
"""Fields of a motor with the range in which its loss was fitted; where a set has evidence, its ranges give it."""
Y_NAMES = tuple(SystemFriction.model_fields)


@dataclass(frozen=True)
class FrictionSet:
    """A system friction (Moslatt 2020 eq. 2.7) with the source of every value and, where it was identified, its
    evidence."""

    name: str
    title: str
    system: SystemFriction
    sources: Mapping[str, Source]
    evidence: Evidence | None = None


@dataclass(frozen=True)
class LossSet:
    """A motor with its torque loss, sources and evidence; the evidence is about the parameters of its model, or about
    X_1 to X_5 of MJ4 (Moslatt 2020 eq. 2.12) on the same map."""

    name: str
    title: str
    motor: Motor
    sources: Mapping[str, Source]
    evidence: Evidence | None = None


_Set = TypeVar("_Set", bound=FrictionSet | LossSet)


def is_path(name: str) -> bool:
    """Whether the name of a set is the path of a file."""
    return name.endswith(SUFFIX)


@reader(SpecError)
def load_friction(name_or_path: str | Path) -> FrictionSet:
    """A system friction by its name in the library, or from a file. Errors: SpecError, UnitError, one line."""
    label, table = _table(FRICTION, name_or_path, "friction set")
    return _set(FrictionSet, label, table, user=_is_file(FRICTION, name_or_path))


@reader(SpecError)
def load_losses(name_or_path: str | Path) -> LossSet:
    """A motor by its name in the library, or from a file. Errors: SpecError, UnitError, one line."""
    label, table = _table(MOTORS, name_or_path, "motor")
    return _set(LossSet, label, table, user=_is_file(MOTORS, name_or_path))


@reader(SpecError)
def load_set(name_or_path: str | Path) -> FrictionSet | LossSet:
    """A set of either kind, distinguished by its name in the library or by what the file holds."""
    if str(name_or_path) in shelf(FRICTION):
        return load_friction(name_or_path)
    if str(name_or_path) in shelf(MOTORS):
        return load_losses(name_or_path)
    if not is_path(str(name_or_path)):
        names = (*shelf(FRICTION), *shelf(MOTORS))
        have = f"{', '.join(names)}{nearest(str(name_or_path), names)}"
        raise SpecError(f"set {quote(str(name_or_path))}: the library has {have} A file's name ends in .toml.")
    label, table = _table(FRICTION, name_or_path, ANY)
    kind: type[FrictionSet | LossSet] = LossSet if "D_max" in table or "loss" in table else FrictionSet
    return _set(kind, label, table, user=True)


def set_values(shelf_name: str, name: str, where: str, folder: Path) -> Tree:
    """The values of a set that a crane file names, as a tree with sources, title and evidence left out; folder of that
    crane file.

    Errors: SpecError that names where, if there is no such set; what is wrong with the set itself is said in its own
    name.
    """
    label, table = _table(shelf_name, name, where, folder)
    if is_path(name):
        kind: type[FrictionSet | LossSet] = FrictionSet if shelf_name == FRICTION else LossSet
        _set(kind, label, table, user=True)
    return _tree(label, table, user=is_path(name))


def known_torques(name: str, where: str, folder: Path) -> Tree:
    """Drum torques between which a friction set was identified, as T_d_min and T_d_max, where its file says so."""
    label, table = _table(FRICTION, name, where, folder)
    evidence = evidence_of(table.get(EVIDENCE), Y_NAMES, label)
    if evidence is None or evidence.T_d is None:
        return {}
    source = Source(text=f"range of the data of {label}", kind=SourceKind.FITTED)
    return {f"T_d_{end}": Leaf(f"{T_d!r} N m", source) for end, T_d in zip(("min", "max"), evidence.T_d, strict=True)}


def known_losses(name: str, where: str, folder: Path) -> Tree:
    """Range in which a motor's loss was identified, as D_loss_min and so on; empty where its file has no evidence."""
    label, table = _table(MOTORS, name, where, folder)
    if EVIDENCE not in table:
        return {}
    ends = loss_range(_set(LossSet, label, table, user=is_path(name)).evidence)
    source = Source(text=f"range of the data of {label}", kind=SourceKind.FITTED)
    return {name: Leaf(value, source) for name, value in ends.items()}


def loss_range(evidence: Evidence | None) -> dict[str, str]:
    """Ends of the data that a motor's loss was fitted to, as the fields of a motor name them."""
    if evidence is None:
        return {}
    ends: dict[str, str] = {}
    if evidence.D_m is not None:
        ends["D_loss_min"] = f"{evidence.D_m[0]!r} m^3/rad"
    if evidence.omega_m is not None:
        ends["n_loss_max"] = f"{max(map(abs, evidence.omega_m))!r} rad/s"
    if evidence.dp_m is not None:
        ends["dp_loss_max"] = f"{max(map(abs, evidence.dp_m))!r} Pa"
    return ends


def set_toml(item: FrictionSet | LossSet) -> str:
    """A set as the text of its file, which `load_set` reads back alike."""
    spec = item.system if isinstance(item, FrictionSet) else item.motor
    tables = leaf_tables(spec, item.sources)
    tables[""].insert(0, f"title = {toml_value(item.title)}")
    if item.evidence is not None:
        tables[EVIDENCE] = list(_evidence_lines(item.evidence))
    return joined(tables)


def _evidence_lines(e: Evidence) -> Iterator[str]:
    yield f"names = {toml_value(list(e.names))}"
    yield "covariance = [  # SI, in the order of names"
    yield from (f"  [{', '.join(repr(float(x)) for x in row)}]," for row in e.covariance)
    yield "]"
    yield f"dof = {e.dof!r}"
    yield f"data = {toml_value(e.data)}"
    for name, kind in RANGES.items():
        if (ends := getattr(e, name)) is not None:
            yield f"{name} = {toml_value(file_value(ends, kind))}"
    yield "statements = ["
    yield from (f"  {toml_value(s)}," for s in e.statements)
    yield "]"


def _table(
    shelf_name: str, name_or_path: str | Path, where: str, folder: Path | None = None
) -> tuple[str, dict[str, Any]]:
    """Label for errors and the parsed tables of a set's file; folder: of the file that names it, None for the user."""
    if not isinstance(name_or_path, str | Path) or not str(name_or_path).strip():
        have = ", ".join(shelf(shelf_name))
        raise SpecError(f"{where} = {quote(name_or_path)}: give a name ({have}) or the path of a .toml file.")
    if not _is_file(shelf_name, name_or_path):
        try:
            return f"{name_or_path}{SUFFIX}", library_table(shelf_name, str(name_or_path), where)
        except SpecError as problem:
            raise SpecError(f"{problem} A file's name ends in .toml.") from None
    path = Path(name_or_path)
    if folder is not None:
        path = named_path(folder, str(path), lambda why: SpecError(f"{where} = {quote(str(name_or_path))}: {why}"))
    try:
        text = toml_text(path)
    except SpecError as problem:
        line = str(problem).removeprefix(f"{quote(str(path))}: ")
        raise SpecError(f"{where} = {quote(str(name_or_path))}: {line}") from None
    if not text.strip():
        raise SpecError(f"{path.name}: empty. Copy a set of the library, or let stillhook identify write one.")
    table = parsed(text, path.name, *(OF_SHELF.values() if where == ANY else (OF_SHELF[shelf_name],)))
    at, key = table.get("loss_model"), "map"
    if isinstance(at, dict) and isinstance(at.get(key), dict):
        at, key = at[key], "value"
    if isinstance(at, dict) and str(at.get(key)).endswith(".csv"):  # seen from this file
        name = at[key]
        wrong = lambda why: SpecError(f"{path.name}: loss_model.map = {quote(name)}: {why}")
        at[key] = named_path(path.parent, name, wrong)
    return path.name, table


def _is_file(shelf_name: str, name_or_path: str | Path) -> bool:
    return isinstance(name_or_path, Path) or (name_or_path not in shelf(shelf_name) and is_path(name_or_path))


def _tree(label: str, table: Mapping[str, Any], *, user: bool) -> Tree:
    numbers = {key: value for key, value in table.items() if key not in (EVIDENCE, "title")}
    return with_map(tree(numbers, label, user=user), label, Path())


def _set(kind: type[_Set], label: str, table: dict[str, Any], *, user: bool) -> _Set:
    """The set in the tables of a file. Errors: SpecError, UnitError, one line."""
    model = SystemFriction if kind is FrictionSet else Motor
    node = _tree(label, table, user=user)
    data = values(node)
    try:
        spec = model.model_validate(data)
    except ValidationError as error:
        raise explain(error, model, label, data) from None
    allowed = dict.fromkeys((*X_NAMES, *loss_names(spec.law))) if isinstance(spec, Motor) else Y_NAMES
    evidence = evidence_of(table.get(EVIDENCE), tuple(allowed), label)
    return kind(label.removesuffix(SUFFIX), _title(label, table), spec, dict(sources(node)), evidence)  # type: ignore[arg-type]


def _title(label: str, table: Mapping[str, Any]) -> str:
    title = table.get("title", label.removesuffix(SUFFIX))
    if not isinstance(title, str) or not title.strip():
        raise SpecError(f"{label}: title = {quote(title)}: give a text.")
    return title


def save_set(item: FrictionSet | LossSet, path: str | Path) -> Path:
    """Write a set as a file that a crane file can name, complete or not at all. Errors: SimulationError."""
    target = Path(path)
    text = set_toml(item)
    with atomic_file(target) as part:
        part.write_text(text, encoding="utf-8")
    return target
