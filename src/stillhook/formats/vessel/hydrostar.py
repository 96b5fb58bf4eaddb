"""Motion transfer functions as HydroStar writes them: a `.rao` file for each motion.

Lines with # declare constants (depth of the water, point of the incident wave, forward speed, reference point of the
body), RAOTYPE, COMPONENT, UNIT, NBHEADING and HEADING [deg]; then rows of frequency [rad/s], an amplitude for each
heading, and a phase [deg] for each heading. The six motions (RAOTYPE Motion, COMPONENT 1 to 6, or 11 to 66) are six
files of one folder: any of them stands for all, and files of other types are left alone.

The form is that which Bureau Veritas's own library Snoopy writes and reads, and HAMS writes. Taken for granted:
x forward, y to port, z up; headings are where waves go, counter-clockwise from the bow (180 head sea); phases lead the
crest at the point of the incident wave, exp(+i omega t), as in the files of HAMS. Headings of one side are of a ship
the same on the other.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import RECORDS
from stillhook.errors import SeaError
from stillhook.formats.vessel.supplement import finite_numbers, wrong
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import INSIDE, to_rao, within_one_side
from stillhook.units import quote

_MOTION = re.compile(r"^#\s*RAOTYPE\s*:\s*Motion\s*$", re.MULTILINE | re.IGNORECASE)
_TYPE = re.compile(r"^#\s*RAOTYPE\s*:\s*(\S*)", re.MULTILINE)
_KEYS = {
    "COMPONENT": re.compile(r"^#\s*COMPONENT\s*:\s*(\d+)", re.MULTILINE),
    "UNIT": re.compile(r"^#\s*UNIT\s*:\s*(\S+)", re.MULTILINE),
    "HEADING": re.compile(r"^#\s*HEADING\s+(.*)$", re.MULTILINE),
}
_NUMBER = r"([-+.\dEe]+)"
_SPEED = re.compile(rf"Forward speed\s*:\s*{_NUMBER}")
_DEPTH = re.compile(rf"Waterdepth\s*:\s*{_NUMBER}")
_WAVE = re.compile(rf"Ref\.pt incident wave\s*:\s*\(\s*{_NUMBER}\s+{_NUMBER}\s*\)")
_POINT = re.compile(rf"Reference point of body\s*\d*\s*:\s*\(\s*{_NUMBER}\s+{_NUMBER}\s+{_NUMBER}\s*\)")
UNITS = {"m/m": 1.0, "rad/m": 1.0, "deg/m": np.pi / 180.0}
"""Units of motions: what makes m/m and rad/m of them."""


@dataclass(frozen=True)
class _Motion:
    """One motion: degrees of freedom from 0, frequencies [rad/s], headings [deg], H (headings, frequencies), and the
    text above the rows."""

    file: str
    dof: int
    omega: FloatArray
    degrees: FloatArray
    H: ComplexArray
    head: str


def is_hydrostar(text: str) -> bool:
    """Whether a text is a file of HydroStar."""
    return "#NBHEADING" in text[:4000].replace(" ", "") and _TYPE.search(text[:4000]) is not None


def read_hydrostar(path: Path, text: str) -> Rao:
    """The vessel in six `.rao` files of a folder, given one of them. Errors: SeaError of one line for a file that is no
    motion, motions that are missing or there twice, at speed, or not of the same headings and frequencies."""
    _motion(path.name, text)  # first what is wrong with the file that was given
    motions = [_motion(name, content) for name, content in _motion_files(path, text)]
    by_dof = {d: [m for m in motions if m.dof == d] for d in range(len(DOFS))}
    for d, result in by_dof.items():
        if len(result) > 1:
            twice = " and ".join(m.file for m in result[:2])
            raise wrong(path.name, f"{DOFS[d]} is in {twice} of its folder", "Keep the six files of one run there.")
    if missing := [DOFS[d] for d, result in by_dof.items() if not result]:
        problem = f"{', '.join(missing)} is missing: no other .rao file of its folder holds it"
        raise wrong(path.name, problem, "Put the files of all six motions in one folder.")
    six = [result[0] for result in by_dof.values()]
    for m in six[1:]:
        if not (np.array_equal(m.omega, six[0].omega) and np.array_equal(m.degrees, six[0].degrees)):
            raise wrong(m.file, f"has other frequencies or headings than {six[0].file}", "Export all six together.")
        if _constants(m) != _constants(six[0]):
            raise wrong(m.file, f"has another depth, speed or point than {six[0].file}", "Export all six together.")
    return _vessel(path, six)


def _vessel(path: Path, six: Sequence[_Motion]) -> Rao:
    speed, depth, wave, point = _constants(six[0])
    if speed:
        raise wrong(path.name, f"is for {speed:g} m/s forward", "Run HydroStar at zero forward speed.")
    degrees = six[0].degrees
    convention = replace(INSIDE, mirror=within_one_side(np.radians(degrees)))
    x, y, z = point
    return to_rao(
        convention,
        name=path.parent.resolve().name or path.stem,
        omega=six[0].omega,
        heading=np.radians(degrees),
        H=np.array([m.H for m in six]),
        source=f"{path.name} and five more (HydroStar)",
        origin=f"x = {x:g} m, y = {y:g} m, z = {z:g} m of HydroStar's axes (reference point of the body)",
        notes=(f"read as HydroStar: phases lead; {convention.describe()}",),
        depth=depth,
        crest=(wave[0] - x, wave[1] - y),
    )


def _motion_files(path: Path, text: str) -> list[tuple[str, str]]:
    """Names and texts of the motions in the folder of a file, itself first."""
    result = [(path.name, text)]
    for other in sorted(path.parent.glob("*")):
        if other.suffix.lower() != ".rao" or other.name == path.name or not other.is_file():
            continue
        content = read_text(other, "file of motions", SeaError, RECORDS, errors="replace")
        if _MOTION.search(content[:4000]):
            result.append((other.name, content))
    return result


def _constants(m: _Motion) -> tuple[float, float, tuple[float, float], tuple[float, float, float]]:
    """Forward speed [m/s], depth [m], point of the incident wave (x, y) and of the body (x, y, z) [m]."""
    speed, depth, wave, point = (key.search(m.head) for key in (_SPEED, _DEPTH, _WAVE, _POINT))
    if point is None or wave is None:
        what = "Reference point of body" if point is None else "Ref.pt incident wave"
        raise wrong(m.file, f'does not state "{what}", about which the motions are')
    depth_and_speed = ("0" if depth is None else depth[1], "0" if speed is None else speed[1])  # 0, -1: deep
    numbers = finite_numbers((*depth_and_speed, *wave.groups(), *point.groups()))
    if numbers is None:
        raise wrong(m.file, "a depth, speed or point is not a number")
    h, v, *places = map(float, numbers)
    return v, h if h > 0.0 else np.inf, (places[0], places[1]), (places[2], places[3], places[4])


def _motion(file: str, text: str) -> _Motion:
    """One file. Errors: SeaError of one line."""
    lines = text.splitlines()
    head = "\n".join(line for line in lines if line.lstrip().startswith("#"))
    kind = _TYPE.search(head)
    if not _MOTION.search(head):
        came = quote(kind[1]) if kind else "none"
        raise wrong(file, f"RAOTYPE {came}", "Give a file of the motions (RAOTYPE Motion).")
    result = {key: pattern.search(head) for key, pattern in _KEYS.items()}
    if missing := [key for key, match in result.items() if match is None]:
        raise wrong(file, f"does not state {', '.join(missing)}")
    component, unit, heading = (match[1].strip() for match in result.values() if match is not None)
    if len(set(component)) != 1 or len(component) > 2 or component[0] not in "123456":
        raise wrong(file, f"COMPONENT {component} is not a motion, 1 to 6")
    if unit not in UNITS or (unit == "m/m") != (int(component[0]) <= 3):
        allowed = "m/m" if int(component[0]) <= 3 else "deg/m or rad/m"
        raise wrong(file, f"UNIT {quote(unit)} of {DOFS[int(component[0]) - 1]}, {allowed} is read")
    degrees = finite_numbers(heading.split())
    if degrees is None:
        raise wrong(file, f"HEADING {quote(heading[:60])} is not a list of numbers")
    rows = _rows(file, lines, len(degrees))
    count = len(degrees)
    H = UNITS[unit] * rows[:, 1 : 1 + count] * np.exp(1j * np.radians(rows[:, 1 + count :]))
    return _Motion(file, int(component[0]) - 1, rows[:, 0], degrees, np.asarray(H.T, dtype=np.complex128), head)


def _rows(file: str, lines: Sequence[str], count: int) -> FloatArray:
    """Rows of frequencies above 0, (n, 1 + 2 headings)."""
    rows = []
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        fields = line.split()
        if len(fields) != 1 + 2 * count:
            expected = f"{1 + 2 * count} are needed: frequency, {count} amplitudes and {count} phases"
            raise wrong(file, f"{len(fields)} numbers, {expected}", line=number)
        omega, values = finite_numbers(fields[:1]), finite_numbers(fields)
        if omega is not None and omega[0] <= 0.0:
            continue  # the ends of the scale: zero and infinite frequency
        if values is None:
            raise wrong(file, f"{quote(line.strip()[:60])} is not finite numbers", line=number)
        rows.append(values)
    if len(rows) < 2:
        raise wrong(file, f"holds {len(rows)} frequencies, two and more are needed")
    return np.array(rows)
