"""Vessel motions as CSV whose head declares its conventions: the open form, and the one that Stillhook's own vessels
are in.

Lines that begin with # declare, one `key: value` each; then a header of columns with units; then one row per heading
and frequency:

    # stillhook vessel motions 1
    # name: Construction vessel 130 m
    # axes: x forward, y port, z up
    # time: exp(+i omega t)
    # heading: waves travel to, counter-clockwise from bow
    # mirror: port-starboard
    # origin: centre of gravity, centreline, still waterline
    # source: Capytaine 3.0.0, hulls/make.py
    # note: roll damping 5 % of critical
    omega [rad/s],heading [deg],surge re [m/m],surge im [m/m],sway re [m/m],...,yaw re [rad/m],yaw im [rad/m]
    0.1,0,...

axes: right-handed; also "x aft, y starboard, z up", "x forward, y starboard, z down". Rotations are right-handed about
them. time (with columns re and im): exp(+i omega t) or exp(-i omega t). phase (with columns "surge amplitude
[m/m],surge phase [deg]" in their place): lead, for amplitude times cos(omega t + phase), or lag.
heading: waves "travel to" or "come from", "counter-clockwise from" or "clockwise from" (seen from above), "bow" or
"stern". mirror: port-starboard, where headings cover one side, both ends included, of a ship that is the same on the
other; none, where they go all round.
origin: the point that moves so and where a wave crest passes at phase 0, in words; its heave in long waves is 1.
depth: of the water, such as 80 m, where it is not deep. source, note: free, note as often as wanted. name, axes, time
or phase, heading, mirror, origin must be there, nothing is assumed. Frequency: "omega [rad/s]", "frequency [Hz]" or
"period [s]"; phases in deg or rad; rotations all in rad/m or all in deg/m. Rows in any order; every heading has every
frequency, once. Blank lines do not count. Columns are separated by comma, semicolon or tab, with the latter two
decimals may have a comma.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.base.choice import nearest
from stillhook.errors import SeaError
from stillhook.formats.table.cells import remark_of
from stillhook.formats.table.columns import split_heading
from stillhook.formats.table.dialect import one_newline
from stillhook.formats.table.text import TextTable, headed_table
from stillhook.formats.vessel.supplement import gridded, wrong
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import Convention, to_rao
from stillhook.units import parse, quote

FIRST = "# stillhook vessel motions"
VERSION = 1
KEYS = ("name", "axes", "time", "phase", "heading", "mirror", "origin", "depth", "source", "note")
FREQUENCIES = {"omega [rad/s]": 1.0, "frequency [Hz]": 2.0 * np.pi, "period [s]": -2.0 * np.pi}
"""Columns of frequency: what makes omega of them; negative where it is divided by the column."""
ANGLES = {"deg": np.pi / 180.0, "rad": 1.0}
_KEY = re.compile(r"#\s*([A-Za-z]+)\s*:\s*(.*?)\s*")
_AXES = re.compile(r"x (forward|aft),? y (port|starboard),? z (up|down)")
_HEADING = re.compile(
    r"waves (travel|going|come|coming) (to|from),? (counter-clockwise|clockwise) from (?:the )?(bow|stern)"
)
_TIMES = {"exp(+i omega t)": 1, "exp(i omega t)": 1, "exp(-i omega t)": -1}
_PHASES = {"lead": 1, "lag": -1}
_MIRRORS = {"port-starboard": True, "none": False}


@dataclass(frozen=True)
class _Head:
    """What a file declares, each with its line, its notes, and its table."""

    declared: Mapping[str, tuple[int, str]]
    notes: tuple[str, ...]
    table: TextTable

    def wrong(self, key: str, allowed: str) -> SeaError:
        line, text = self.declared[key]
        return wrong(self.table.name, f"{key}: {quote(text)}", allowed, line=line)

    def choice(self, key: str, choices: Mapping[str, int]) -> int:
        value = " ".join(self.declared[key][1].lower().split())
        if value not in choices:
            raise self.wrong(key, f"Allowed: {', '.join(choices)}.")
        return choices[value]


def read_rao_csv(path: Path, text: str) -> Rao:
    """The vessel in a CSV with declared conventions, given its path and text. Errors: SeaError of one line."""
    head = _declared(path.name, one_newline(text))
    H, sign = _motions(head, _rotation(head.table))
    convention = _convention(head, sign)
    omega, heading, grid = _grid(head.table, H)
    source = ", ".join(t for t in (f"{path.name} (CSV)", head.declared.get("source", (0, ""))[1]) if t)
    notes = (*head.notes, f"read as CSV: {convention.describe()}")
    name, origin = head.declared["name"][1], head.declared["origin"][1]
    depth = parse(head.declared["depth"][1], "length", f"{path.name}: depth") if "depth" in head.declared else np.inf
    return to_rao(
        convention,
        name=name,
        omega=omega,
        heading=heading,
        H=grid,
        source=source,
        origin=origin,
        notes=notes,
        depth=depth,
    )


def write_rao_csv(rao: Rao, path: str | os.PathLike[str], *, source: str) -> Path:
    """Write a vessel in Stillhook's own convention with all digits, so that the same numbers are read; the file appears
    under its name only when it is complete.

    source: one line on where the numbers are from. The notes of rao stay behind: a reader makes its own.
    """
    declared = {
        "name": rao.name,
        "axes": "x forward, y port, z up",
        "time": "exp(+i omega t)",
        "heading": "waves travel to, counter-clockwise from bow",
        "mirror": "none",
        "origin": rao.origin,
        **({"depth": f"{rao.depth!r} m"} if np.isfinite(rao.depth) else {}),
        "source": source,
    }
    columns = [f"{dof} {part} [{_unit(dof, 'rad')}]" for dof in DOFS for part in ("re", "im")]
    lines = [f"{FIRST} {VERSION}", *(f"# {key}: {remark_of(value)}" for key, value in declared.items())]
    lines.append(",".join(("omega [rad/s]", "heading [rad]", *columns)))
    for j, beta in enumerate(rao.beta):
        for k, w in enumerate(rao.omega):
            parts = np.column_stack([rao.H[:, j, k].real, rao.H[:, j, k].imag]).ravel()
            lines.append(",".join(repr(float(v)) for v in (w, beta, *parts)))
    target = Path(path)
    with atomic_file(target) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target


def _declared(file: str, text: str) -> _Head:
    """The head of a file and its table."""
    declared: dict[str, tuple[int, str]] = {}
    notes: list[str] = []
    for number, line in enumerate(text.split("\n"), start=1):
        if line.startswith(FIRST) and line[len(FIRST) :].strip() != str(VERSION):
            version = quote(line[len(FIRST) :].strip())
            raise wrong(file, f"version {version}, {VERSION} is read", "Get a newer Stillhook.", line=number)
        if not line.startswith(FIRST) and (match := _KEY.fullmatch(line.rstrip().rstrip(",;\t"))):
            _declare(file, number, match[1].lower(), match[2], declared, notes)
    missing = [k for k in ("name", "axes", "heading", "mirror", "origin") if k not in declared]
    if missing:
        do = f"Begin with lines such as {EXAMPLES[missing[0]]}; nothing is assumed."
        raise wrong(file, f"does not state its {', '.join(missing)}", do)
    return _Head(declared, tuple(notes), headed_table(file, text, SeaError, "Give a header of columns and rows below."))


EXAMPLES = {
    "name": '"# name: my vessel"',
    "axes": '"# axes: x forward, y port, z up"',
    "heading": '"# heading: waves travel to, counter-clockwise from bow"',
    "mirror": '"# mirror: port-starboard"',
    "origin": '"# origin: centre of gravity"',
}


def _declare(
    file: str, number: int, key: str, value: str, declared: dict[str, tuple[int, str]], notes: list[str]
) -> None:
    if key not in KEYS:
        do = f"Allowed: {', '.join(KEYS)}{nearest(key, KEYS)}"
        raise wrong(file, f"{quote(key)[1:-1]}: unknown key", do, line=number)
    if key == "note":
        notes.append(value)
        return
    if key in declared:
        raise wrong(file, f"{key} is given twice, first in line {declared[key][0]}", "Keep one.", line=number)
    if not value:
        raise wrong(file, f"{key}: nothing is stated", "State it.", line=number)
    declared[key] = (number, value)


def _unit(dof: str, rotation: str) -> str:
    return "m/m" if dof in DOFS[:3] else f"{rotation}/m"


def _rotation(table: TextTable) -> str:
    """Unit of all rotations."""
    units = {
        c[c.index("[") + 1 : -3]
        for c in table.headings
        for dof in DOFS[3:]
        if c.startswith((f"{dof} re [", f"{dof} amplitude ["))
    }
    if len(units) > 1:
        mixed = " and ".join(f"{u}/m" for u in sorted(units))
        raise SeaError(f"{table.header}: rotations in {mixed}. Give all in one unit.")
    return units.pop() if units <= set(ANGLES) and units else "rad"


def _column(table: TextTable, *names: str) -> tuple[str, FloatArray]:
    """The column that has one of the names, in any case."""
    lower = [c.lower() for c in table.headings]
    matches = [(n, i) for n in names for i, c in enumerate(lower) if c == n.lower()]
    if len(matches) != 1:
        expected = " or ".join(f'"{n}"' for n in names)
        short = {split_heading(n)[0] for n in names}
        similar = [] if matches else [c for c in table.headings if split_heading(c)[0] in short]
        near = f", but {quote(similar[0])}" if similar else ""
        count = "has more than one column" if matches else "has no column"
        raise SeaError(f"{table.header}: {count} {expected}{near}. Name each once, with its unit.")
    name, place = matches[0]
    return name, table.numbers(place)


def _motions(head: _Head, rotation: str) -> tuple[ComplexArray, int]:
    """Transfer functions (6, rows) [m/m, rad/m] as written, and the sign of time."""
    table = head.table
    polar = any(" amplitude" in c.lower() for c in table.headings)
    key, choices, other = ("phase", _PHASES, "time") if polar else ("time", _TIMES, "phase")
    if key not in head.declared or other in head.declared:
        columns = "amplitude and phase" if polar else "re and im"
        line = f'"# {key}: {next(iter(choices))}"'
        raise wrong(table.name, f"columns of {columns} need one line such as {line}, and none of {other}", "State it.")
    H = np.empty((len(DOFS), len(table.rows)), dtype=np.complex128)
    for d, dof in enumerate(DOFS):
        unit = _unit(dof, rotation)
        scale = 1.0 if d < 3 else ANGLES[rotation]
        if polar:
            amplitude = _column(table, f"{dof} amplitude [{unit}]")[1]
            name, phase = _column(table, f"{dof} phase [deg]", f"{dof} phase [rad]")
            H[d] = scale * amplitude * np.exp(1j * phase * ANGLES[name[-4:-1]])
        else:
            re, im = (_column(table, f"{dof} {part} [{unit}]")[1] for part in ("re", "im"))
            H[d] = scale * (re + 1j * im)
    return H, head.choice(key, choices)


def _convention(head: _Head, sign: int) -> Convention:
    axes = _AXES.fullmatch(" ".join(head.declared["axes"][1].lower().split()))
    if axes is None:
        raise head.wrong("axes", 'Write "x forward, y port, z up", with aft, starboard, down where they are so.')
    heading = _HEADING.fullmatch(" ".join(head.declared["heading"][1].lower().split()))
    if heading is None or heading[1] + heading[2] not in ("travelto", "goingto", "comefrom", "comingfrom"):
        raise head.wrong(
            "heading", 'Write "waves travel to, counter-clockwise from bow", or come from, clockwise, stern.'
        )
    mirror = bool(head.choice("mirror", _MIRRORS))
    x, y, z = axes.groups()
    try:
        return Convention(x, y, z, sign, heading[2], heading[3], heading[4], mirror)  # type: ignore[arg-type]
    except SeaError as e:
        raise head.wrong("axes", str(e)) from None


def _grid(table: TextTable, H: ComplexArray) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Frequencies (n,) [rad/s], headings (m,) [rad] as the table counts and transfer functions (6, m, n) of rows in any
    order."""
    name, column = _column(table, *FREQUENCIES)
    if (column <= 0.0).any():
        worst = int(np.argmin(column))
        raise SeaError(f"{table.at(worst)}: {name} is {column[worst]:g}, and must be above 0. Leave the row out.")
    factor = FREQUENCIES[name]
    column_name, degrees = _column(table, "heading [deg]", "heading [rad]")
    unit = column_name[-4:-1]
    place = lambda w, b, d: f"{name.split()[0]} {w:g} at heading {b:g} {unit}"
    dof = np.repeat(np.arange(len(DOFS)), len(column))
    of_waves, of_headings = (np.tile(x, len(DOFS)) for x in (column, degrees))
    waves, headings, grid = gridded(table.name, place, of_waves, of_headings, dof, H.ravel())
    omega = factor * waves if factor > 0.0 else -factor / waves
    return omega, headings * ANGLES[unit], grid
