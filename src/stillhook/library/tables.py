"""Motors, pump leak tables and system frictions of the library."""

from __future__ import annotations

import functools
from typing import Annotated, Any, Self, TypeVar

from pydantic import Field, ValidationError, model_validator

from stillhook import units as u
from stillhook.library.toml.explain import explain
from stillhook.library.toml.tree import Tree, library_tree, shelf, values
from stillhook.spec.crane import Spec, SystemFriction
from stillhook.winches.circuits.tables import Motor

_Table = TypeVar("_Table", bound=Spec)


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
