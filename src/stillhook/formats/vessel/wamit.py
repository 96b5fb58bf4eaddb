"""Motion transfer functions from WAMIT's numeric output of body motions (`.4`).

Lines of seven numbers: period [s], heading [deg], mode, amplitude, phase [deg], real and imaginary part (WAMIT user
manual 7.4, sections 3.4 and 5.2). Modes 1 to 6 are surge to yaw of the first body, 7 to 12 of the second. Motions are
per wave amplitude: translations as they are, rotations [rad] times the length scale L (ULEN of the .gdf), so that a
rotation per metre is the number over L.

Taken for granted, for the file holds none of it: exp(+i omega t) and phases that lead the incident wave's crest at the
origin x = y = 0; headings are where waves go, counter-clockwise from +x; x forward, y to port, z up; the body's axes
are at that origin (XBODY 0, 0) and not turned; the first column is the period (IPEROUT 1); water is deep unless its
depth is stated; L is 1 m unless it is stated; headings of one side are of a ship the same on the other. The long-wave
test decides: a wrong L, column, sign or order is refused by it, a wrong depth only where waves feel the bottom.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.formats.vessel.supplement import NOTHING, Supplement
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import INSIDE, to_rao, within_one_side
from stillhook.units import quote

COLUMNS = 7
LOOKED_AT = 20  # lines that show what a file is
MOST_MODES = 600
"""Modes of a hundred bodies: a number beyond is no mode."""
SAME_NUMBER = 1e-4  # share by which amplitude and phase may differ from real and imaginary part: six digits are written
FORCES = (".2", ".3")
"""Endings of exciting forces, whose lines look alike."""


def is_wamit(text: str) -> bool:
    """Whether a text begins as a table of motions: seven numbers a line, the third a mode, below at most one header."""
    lines = [line.split() for line in text[:4000].splitlines() if line.strip()][:LOOKED_AT]
    rows = [row for row in (_row(fields) for fields in lines[:-1] or lines) if row is not None]
    return len(rows) > 0 and len(rows) >= len(lines[:-1] or lines) - 1


def _row(fields: list[str]) -> tuple[float, ...] | None:
    """The numbers of a line; None where it is not one of motions."""
    if len(fields) != COLUMNS:
        return None
    try:
        row = tuple(float(v.replace("D", "E").replace("d", "e")) for v in fields)
    except ValueError:
        return None
    return row if row[2] == row[2] // 1 and 1 <= row[2] <= MOST_MODES else None


def read_wamit(path: Path, text: str, stated: Supplement = NOTHING) -> Rao:
    """The vessel in a `.4` file, given its path and text; stated: body, length scale and depth.

    Errors: SeaError of one line for lines that are not seven numbers, several bodies, modes or headings that are
    missing or come twice, and amplitudes that contradict real and imaginary parts.
    """
    if path.suffix.lower() in FORCES:
        raise SeaError(f"{path.name}: holds exciting forces. Give the motions, {path.stem}.4.")
    rows, lines = _rows(path.name, text)
    body = stated.body_of(path.name, "bodies", sorted({int(mode - 1) // 6 + 1 for mode in rows[:, 2]}))
    mode = rows[:, 2] - 6 * (body - 1)
    ours = (mode >= 1) & (mode <= 6) & (rows[:, 0] > 0.0)
    period, degrees, H = _grid(
        path.name, rows[ours], mode[ours].astype(np.intp) - 1, [lines[i] for i in np.flatnonzero(ours)]
    )
    length = 1.0 if stated.length_scale is None else stated.length_scale
    H[3:] /= length
    convention = replace(INSIDE, mirror=within_one_side(np.radians(degrees)))
    depth = math.inf if stated.depth is None else stated.depth
    water = "deep water" if stated.depth is None else f"water of {depth:g} m"
    assumed = "" if stated.length_scale is not None and stated.depth is not None else " (not in the file)"
    return to_rao(
        convention,
        name=path.stem if body == 1 else f"{path.stem}, body {body}",
        omega=2.0 * np.pi / period,
        heading=np.radians(degrees),
        H=H,
        source=f"{path.name} (WAMIT .4)",
        origin="origin of the body's axes, taken to be that of WAMIT's x and y (XBODY 0, 0)",
        notes=(
            f"length scale {length:g} m, {water}{assumed}",
            f"read as WAMIT: {convention.describe()}; first column the period",
        ),
        depth=depth,
    )


def _rows(file: str, text: str) -> tuple[FloatArray, list[int]]:
    """Numbers of all lines, (n, 7), and the number of each line; a header counts for nothing."""
    rows: list[tuple[float, ...]] = []
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        fields = line.split()
        if not fields or (not rows and number == 1 and _row(fields) is None and not _is_number(fields[0])):
            continue
        row = _row(fields)
        if row is None:
            raise SeaError(
                f"{file}: line {number}: {quote(line.strip())} is not period, heading, mode, amplitude, phase, real and"
                " imaginary part. Export the file again."
            )
        if not all(math.isfinite(v) for v in row):
            raise SeaError(f"{file}: line {number}: {quote(line.strip())}: not finite. Export the file again.")
        size = max(abs(row[3]), abs(row[5]), abs(row[6]))
        z = row[3] * complex(math.cos(math.radians(row[4])), math.sin(math.radians(row[4])))
        if abs(z - complex(row[5], row[6])) > SAME_NUMBER * size + SMALLEST:
            raise SeaError(
                f"{file}: line {number}: amplitude {row[3]:g} and phase {row[4]:g} deg are not real part {row[5]:g} and"
                f" imaginary part {row[6]:g}. Export the file again."
            )
        rows.append(row)
        lines.append(number)
    return np.array(rows), lines


SMALLEST = 1e-9
"""Motions below it are noise."""


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _grid(
    file: str, rows: FloatArray, mode: NDArray[np.intp], lines: list[int]
) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Periods [s], headings [deg] and motions (6, headings, periods) of rows in any order."""
    period, k = np.unique(rows[:, 0], return_inverse=True)
    degrees, j = np.unique(rows[:, 1], return_inverse=True)
    count = np.zeros((len(DOFS), len(degrees), len(period)), dtype=np.intp)
    np.add.at(count, (mode, j, k), 1)
    if (count > 1).any():
        first = np.argmax(count[mode, j, k] > 1)
        raise SeaError(f"{file}: line {lines[first]}: {_place(rows[first], mode[first])} comes twice. Keep one.")
    if (count == 0).any():
        d, b, t = np.argwhere(count == 0)[0]
        gap = f"period {period[t]:g} s, heading {degrees[b]:g} deg, mode {d + 1} ({DOFS[d]})"
        raise SeaError(f"{file}: {gap} is missing. Run WAMIT with all six modes free, and export the file again.")
    H = np.empty(count.shape, dtype=np.complex128)
    H[mode, j, k] = rows[:, 5] + 1j * rows[:, 6]
    return period, degrees, H


def _place(row: FloatArray, mode: int) -> str:
    return f"period {row[0]:g} s, heading {row[1]:g} deg, mode {mode + 1} ({DOFS[mode]})"
