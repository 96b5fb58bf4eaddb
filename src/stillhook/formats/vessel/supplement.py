"""What readers of vessel files share: refusals, tables on a grid, and what a file of motions leaves open, stated by the
user in a vessel description, a TOML next to the file.

    motions = "hull.nc"                                # the file, seen from the description
    mass = "9000 t"                                    # Capytaine without inertia_matrix
    radii = ["8 m", "30 m", "31 m"]                    # of gyration about the centre of gravity: roll, pitch, yaw
    centre_of_gravity = ["-1 m", "0 m", "2.5 m"]       # x, y, z of the mesh
    vessel_type = "Barge"                              # OrcaFlex
    draught = "Transit"                                # OrcaFlex
    body = 2                                           # AQWA, WAMIT
    length_scale = "1 m"                               # WAMIT (ULEN)
    depth = "80 m"                                     # WAMIT

The description is valid wherever a vessel file is named: on the command line, in lift files and in plans.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from stillhook import units as u
from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.sea.vessel.rao import DOFS
from stillhook.tables.table import Count, Spec, Text

EXPORT = "Export the file again."


def wrong(file: str, problem: str, do: str = EXPORT, *, line: int | None = None) -> SeaError:
    """The refusal of a file, or of one of its lines."""
    return SeaError(f"{file}: {'' if line is None else f'line {line}: '}{problem}. {do}")


def finite_numbers(fields: Sequence[str]) -> FloatArray | None:
    """Numbers of a line, those of Fortran too; None where one is not a number, or not finite."""
    try:
        values = np.array([float(v.replace("D", "E").replace("d", "e")) for v in fields])
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def gridded(
    file: str,
    place: Callable[[float, float, int], str],
    waves: FloatArray,
    headings: FloatArray,
    dof: NDArray[np.intp],
    values: ComplexArray,
) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Waves (n,) and headings (m,), ascending, and values (6, m, n) of rows in any order, each of a wave, a heading and
    a degree of freedom. place: words for these three. Errors: SeaError where one is missing, or is given twice."""
    w, k = np.unique(waves, return_inverse=True)
    b, j = np.unique(headings, return_inverse=True)
    count = np.zeros((len(DOFS), len(b), len(w)), dtype=np.intp)
    np.add.at(count, (dof, j, k), 1)
    for problem, bad in (("is missing", count == 0), ("is given twice", count > 1)):
        if bad.any():
            d, m, n = np.argwhere(bad)[0]
            raise wrong(
                file, f"{place(w[n], b[m], int(d))} {problem}: every heading has every frequency and motion, once"
            )
    H = np.empty(count.shape, dtype=np.complex128)
    H[dof, j, k] = values
    return w, b, H


class Supplement(Spec):
    """What the user states of a file of motions; None: not stated."""

    vessel_type: Text | None = Field(default=None, description="vessel type of an OrcaFlex model")
    draught: Text | None = Field(default=None, description="draught of that vessel type")
    body: Count | None = Field(default=None, description="number of the body or structure, from 1")
    mass: u.Mass | None = Field(default=None, gt=0, description="mass of the vessel")
    radii: tuple[u.Length, u.Length, u.Length] | None = Field(
        default=None, description="radii of gyration of roll, pitch and yaw about the centre of gravity"
    )
    centre_of_gravity: tuple[u.Length, u.Length, u.Length] | None = Field(
        default=None, description="x, y, z of the centre of gravity in the file's axes"
    )
    length_scale: u.Length | None = Field(default=None, gt=0, description="length scale (ULEN)")
    depth: u.Length | None = Field(default=None, gt=0, description="depth of the water")

    @property
    def stated(self) -> tuple[str, ...]:
        """Names of what is stated here."""
        return tuple(name for name in Supplement.model_fields if getattr(self, name) is not None)

    def allow(self, file: str, form: str, *names: str) -> None:
        """Refuse what a form of file has no use for. Errors: SeaError of one line."""
        for name in self.stated:
            if name not in names:
                allowed = f"They take {', '.join(names)}" if names else "They state everything themselves"
                raise SeaError(f"{file}: {name} is stated, and {form} have no use for it. {allowed}. Leave it out.")

    def body_of(self, file: str, noun: str, bodies: Sequence[int]) -> int:
        """The body to read of those that a file holds; noun: what the file calls them, in the plural. Errors: SeaError
        of one line."""
        names = ", ".join(map(str, bodies))
        if self.body is None and len(bodies) > 1:
            raise SeaError(f"{file}: holds {noun} {names}. {description(file, f'body = {bodies[0]}')}")
        if self.body is not None and self.body not in bodies:
            raise SeaError(f"{file}: holds {noun} {names}, and body = {self.body} is stated. Correct it.")
        return bodies[0] if self.body is None else self.body


NOTHING = Supplement()
"""Nothing is stated in addition to the file."""


def description(file: str, *lines: str) -> str:
    """What to write where a file leaves something open: the lines of a vessel description."""
    return f'Write a vessel description (TOML) with motions = "{file}", {", ".join(lines)}, and give it instead.'


class VesselDescription(Supplement):
    """A vessel description as it is written."""

    motions: Text = Field(description="file of motions, seen from this file")


def read_description(path: Path) -> tuple[Path, Supplement]:
    """The file of motions that a description names, and what is stated of it. Errors: SeaError or UnitError."""
    return read_toml(path, FileKind.VESSEL, SeaError, _description, start='Write motions = "FILE".')


def _description(table: TomlTable) -> tuple[Path, Supplement]:
    stated = table.read(VesselDescription)
    if stated.radii is not None and min(stated.radii) <= 0.0:
        raise table.wrong("radii of gyration are above 0 m. Correct them.", "radii")
    file = table.relative_file(stated.motions, "motions")
    if file.suffix.lower() == ".toml":
        raise table.wrong("is TOML as well. Name the file that holds the motions.", "motions")
    return file, stated
