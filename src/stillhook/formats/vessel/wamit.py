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

from stillhook.base.arrays import FloatArray
from stillhook.formats.vessel.supplement import NOTHING, Supplement, finite_numbers, gridded, wrong
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import INSIDE, to_rao, within_one_side
from stillhook.units import quote

COLUMNS = 7
LOOKED_AT = 20  # lines that show what a file is
MOST_MODES = 600
"""Modes of a hundred bodies: a number beyond is not a mode."""
SAME_NUMBER = 1e-4  # share by which amplitude and phase may differ from real and imaginary part: six digits are written
SMALLEST = 1e-9  # motions below it are noise
FORCES = (".2", ".3")
"""Endings of exciting forces, whose lines look alike."""


def is_wamit(text: str) -> bool:
    """Whether a text begins as a table of motions: seven numbers a line, the third a mode, below at most one header."""
    lines = [line.split() for line in text[:4000].splitlines() if line.strip()][:LOOKED_AT]
    rows = [row for row in (_row(fields) for fields in lines[:-1] or lines) if row is not None]
    return len(rows) > 0 and len(rows) >= len(lines[:-1] or lines) - 1


def _row(fields: list[str]) -> FloatArray | None:
    """The numbers of a line; None where it is not one of motions."""
    row = finite_numbers(fields) if len(fields) == COLUMNS else None
    return row if row is not None and row[2] == row[2] // 1 and 1 <= row[2] <= MOST_MODES else None


def read_wamit(path: Path, text: str, stated: Supplement = NOTHING) -> Rao:
    """The vessel in a `.4` file, given its path and text; stated: body, length scale and depth.

    Errors: SeaError of one line for lines that are not seven numbers, several bodies, modes or headings that are
    missing or given twice, and amplitudes that contradict real and imaginary parts.
    """
    if path.suffix.lower() in FORCES:
        raise wrong(path.name, "holds exciting forces", f"Give the motions, {path.stem}.4.")
    rows = _rows(path.name, text)
    body = stated.body_of(path.name, "bodies", sorted({int(mode - 1) // 6 + 1 for mode in rows[:, 2]}))
    mode = rows[:, 2] - 6 * (body - 1)
    ours = (mode >= 1) & (mode <= 6) & (rows[:, 0] > 0.0)
    place = lambda T, b, d: f"period {T:g} s, heading {b:g} deg, mode {d + 1} ({DOFS[d]})"
    values = rows[ours, 5] + 1j * rows[ours, 6]
    period, degrees, H = gridded(path.name, place, rows[ours, 0], rows[ours, 1], mode[ours].astype(np.intp) - 1, values)
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


def _rows(file: str, text: str) -> FloatArray:
    """Numbers of all lines, (n, 7); a header counts for nothing."""
    rows: list[FloatArray] = []
    for number, line in enumerate(text.splitlines(), start=1):
        fields = line.split()
        if not fields or (not rows and number == 1 and _row(fields) is None and finite_numbers(fields[:1]) is None):
            continue
        row = _row(fields)
        if row is None:
            expected = "period, heading, mode, amplitude, phase, real and imaginary part, all finite"
            raise wrong(file, f"{quote(line.strip())} is not {expected}", line=number)
        size = max(abs(row[3]), abs(row[5]), abs(row[6]))
        z = row[3] * complex(math.cos(math.radians(row[4])), math.sin(math.radians(row[4])))
        if abs(z - complex(row[5], row[6])) > SAME_NUMBER * size + SMALLEST:
            parts = f"real part {row[5]:g} and imaginary part {row[6]:g}"
            raise wrong(file, f"amplitude {row[3]:g} and phase {row[4]:g} deg are not {parts}", line=number)
        rows.append(row)
    return np.array(rows)
