"""Motion transfer functions from the output of AQWA-LINE (`.lis`).

Read are the tables "R.A.O.S-VARIATION WITH WAVE PERIOD/FREQUENCY" of one structure, or those "WITH WAVE DIRECTION"
where a file has only these: per direction and frequency [rad/s]
amplitude and phase [deg] of X, Y, Z [m/m] and RX, RY, RZ [deg/m] "with respect to structure COG"; the depth of the
water, the acceleration of gravity (by which lengths are metres) and the centre of gravity are above them. Where a
direction and frequency come again, as after another pass with linearised damping, the last counts, and a note says so.

Conventions: a positive phase is a motion that comes after the wave's crest at the centre of gravity (Aqwa Reference
Manual, section on phase angles: the crest at the structure's centre of gravity is phase 0, positive phases lag);
directions are where waves go, from X to Y (0 along +X). Taken for granted: X forward, Y to port, Z up, the structure
not turned in the model; directions of one side are of a ship the same on the other. Amplitudes have four decimals:
rotations are within 0.00005 deg/m.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.formats.vessel.supplement import NOTHING, Supplement, finite_numbers, gridded, wrong
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import INSIDE, to_rao, within_one_side
from stillhook.units import quote

TITLES = ("R.A.O.S-VARIATION WITH WAVE PERIOD/FREQUENCY", "R.A.O.S-VARIATION WITH WAVE DIRECTION")
"""Of tables whose lines after the first leave the direction out, and of those that leave period and frequency out."""
_JOB = re.compile(r"^\s*JOB\s+AQWA\b|\bAqwa-Line\b|\bAQWA-LINE\b", re.MULTILINE)
_STRUCTURE = re.compile(r"P A R A M E T E R S\s+F O R\s+S T R U C T U R E\s+(\d+)")
_CENTRE = re.compile(r"STRUCTURE C\.O\.G\.\s+GX=\s*(\S+)\s+GY=\s*(\S+)\s+GZ=\s*(\S+)")
_VALUE = r"[ .]*=\s*([-+.\dEe]+)"
_DEPTH = re.compile(r"WATER\s+DEPTH" + _VALUE)
_GRAVITY = re.compile(r"ACCELERATION\s+DUE\s+TO\s+GRAVITY" + _VALUE)
_SPEED = re.compile(r"FORWARD\s+SPEED" + _VALUE)
METRIC = (9.7, 9.9)  # m/s^2: gravity of a file in metres
NUMBERS = 2 * len(DOFS)
SHORT_WAVE = np.sqrt(2.0 * np.pi * 0.1)
"""Frequency [rad/s] from which three decimals of it are more than two decimals of the period."""
SAME_WAVE = 0.02  # share by which 2 pi over the period may differ from the frequency beyond their rounding
ROUNDED = (0.006, 0.0006)  # s, rad/s: half of the last digit of period and frequency, and a little


_Lines = list[tuple[tuple[float, float], FloatArray]]
"""Lines of tables: direction [deg] and frequency [rad/s]; amplitudes and phases (12,)."""


def is_aqwa(text: str) -> bool:
    """Whether a text is output of AQWA, by its first lines."""
    return _JOB.search(text[:20_000]) is not None


def read_aqwa(path: Path, text: str, stated: Supplement = NOTHING) -> Rao:
    """The vessel in an AQWA `.lis` file, given its path and text; stated: body, the structure's number.

    Errors: SeaError of one line for a file without tables of motions, of several structures, in feet, at speed, or with
    lines that are not read.
    """
    _refuse_units(path.name, text)
    tables = _tables(path.name, text.splitlines())
    body = stated.body_of(path.name, "structures", sorted(tables))
    lines = tables[body]
    omega, degrees, H = _grid(path.name, dict(lines))
    again = sum(not np.array_equal(values, dict(lines)[place]) for place, values in lines)
    convention = replace(INSIDE, time=-1, mirror=within_one_side(np.radians(degrees)))
    centres = _CENTRE.findall(text)
    where = "centre of gravity of the structure"
    if body <= len(centres):
        x, y, z = centres[body - 1]
        where += f", X = {x} m, Y = {y} m, Z = {z} m of the model (Z = 0 is the still waterline)"
    depth = _DEPTH.search(text)
    notes = (
        f"{again} motions are given twice: the last count, as after a pass with linearised damping" if again else "",
        f"read as AQWA: phases lag the crest at the centre of gravity; {replace(convention, time=1).describe()}",
    )
    return to_rao(
        convention,
        name=path.stem if len(tables) == 1 else f"{path.stem}, structure {body}",
        omega=omega,
        heading=np.radians(degrees),
        H=H,
        source=f"{path.name} (AQWA, structure {body})",
        origin=where,
        notes=tuple(note for note in notes if note),
        depth=np.inf if depth is None else float(depth[1]),
    )


def _refuse_units(file: str, text: str) -> None:
    gravity, speed = _GRAVITY.search(text), _SPEED.search(text)
    if gravity is not None and not METRIC[0] < float(gravity[1]) < METRIC[1]:
        raise wrong(file, f"gravity is {gravity[1]}, and metres are read (9.81 m/s^2)", "Run AQWA in kg, m, N.")
    if speed is not None and float(speed[1]) != 0.0:
        raise wrong(file, f"is for a forward speed of {speed[1]}", "Run AQWA at zero forward speed.")


def _tables(file: str, lines: Sequence[str]) -> dict[int, _Lines]:
    """Lines of motions of each structure, by its number: by frequency where the file has these tables, else by
    direction."""
    tables: tuple[dict[int, _Lines], ...] = ({}, {})
    structure = 1
    for i, line in enumerate(lines):
        if match := _STRUCTURE.search(line):
            structure = int(match[1])
        elif line.strip() in TITLES:
            order = TITLES.index(line.strip())
            tables[order].setdefault(structure, []).extend(_table(file, lines, i + 1, left_out=2 - order))
    result = next((by_structure for by_structure in tables if any(by_structure.values())), None)
    if result is None:
        raise wrong(
            file, f"holds no table of motions ({TITLES[0]})", "Run AQWA-LINE to its stage 5, and give its .lis."
        )
    return {body: table for body, table in result.items() if table}


def _table(
    file: str, lines: Sequence[str], start: int, left_out: int
) -> Iterator[tuple[tuple[float, float], FloatArray]]:
    """Lines of a table, from the one below its title to the next page; left_out: numbers before the motions
    of every line but the first of a block (2: period and frequency, 1: direction)."""
    first: FloatArray | None = None
    seen: set[tuple[float, float]] = set()
    for number in range(start, len(lines)):
        head = lines[number].strip()
        if not head or set(head) <= {"-", " "} or head.startswith(("PERIOD", "(SECS)")):
            continue
        if head == "1" or head.startswith("* *"):
            return  # the next page
        fields = head.split()
        before = len(fields) - NUMBERS
        values = finite_numbers(fields)
        if values is None or before not in (3, left_out) or (before < 3 and first is None):
            expected = "period, frequency, direction, and amplitude and phase of six motions, all finite"
            raise wrong(file, f"{quote(head)} is not {expected}", line=number + 1)
        if before == 3 or first is None:
            first = values[:3]
        period, omega, degrees = first
        if before == 2:
            period, omega = values[:2]
        elif before == 1:
            degrees = values[0]
        place = float(degrees), _omega(file, number + 1, float(period), float(omega))
        if place in seen:
            problem = "comes again in its table, or the line that begins its block is lost"
            raise wrong(file, f"{quote(head)} {problem}", line=number + 1)
        seen.add(place)
        yield place, values[-NUMBERS:]
    raise wrong(file, "ends in a table of motions: the file is cut off")


def _omega(file: str, number: int, period: float, omega: float) -> float:
    """The frequency [rad/s] by the column that is rounded less."""
    if period <= 0.0 or omega <= 0.0:
        raise wrong(file, f"period {period:g} s and frequency {omega:g} rad/s must be above 0", line=number)
    rounding = ROUNDED[0] / period + ROUNDED[1] / omega
    if abs(period * omega / (2.0 * np.pi) - 1.0) > SAME_WAVE + rounding:
        raise wrong(file, f"period {period:g} s is not that of {omega:g} rad/s", line=number)
    return omega if omega > SHORT_WAVE else 2.0 * np.pi / period


def _grid(file: str, lines: Mapping[tuple[float, float], FloatArray]) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Frequencies [rad/s], directions [deg] and motions (6, directions, frequencies) as written."""
    degrees, omega = (np.tile(x, len(DOFS)) for x in zip(*lines, strict=True))
    values = np.array(list(lines.values())).T
    scale = np.array([1.0] * 3 + [np.pi / 180.0] * 3)[:, None]
    H = scale * values[::2] * np.exp(1j * np.radians(values[1::2]))
    dof = np.repeat(np.arange(len(DOFS)), len(lines))
    return gridded(
        file, lambda w, b, d: f"frequency {w:.4g} rad/s in direction {b:g} deg", omega, degrees, dof, H.ravel()
    )
