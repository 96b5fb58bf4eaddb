"""Motion transfer functions as ShipX/VERES writes them (`.re1`).

Six lines of text, then numbers: density, gravity; Lpp, breadth, draught; LCG (aft of Lpp/2) and VCG; how many speeds,
headings, frequencies and degrees of freedom; per speed: speed, sinkage, trim, and where motions are given (x aft of
Lpp/2, z above the keel); per heading [deg]: per frequency [rad/s]: number of the degree of freedom, real and imaginary
part, six times. Translations [m/m], rotations [rad/m], exp(+i omega t), x aft, y to starboard, z up; heading 0 head
sea, 90 waves from port, 180 following sea; a wave crest at the reference point at phase 0. The file contains nothing
about this: the long-wave limits confirm signs, phases and units (`stillhook.sea.vessel.rao`), the order of bow and
stern is VERES's own. Headings up to 180 deg are one side of a ship that is the same on the other. Only the zero-speed
part is read: a crane vessel at work is stationary."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.formats.vessel.supplement import EXPORT, finite_numbers, wrong
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import SHIPX, to_rao
from stillhook.units import quote

TITLES = 6  # lines of text before the numbers
LARGEST_TABLE = 20_000_000  # values: far beyond any table, far below what fills a memory
LONGEST_SHIP = 600.0  # m
STANDSTILL = 0.05  # m/s


@dataclass
class _Reader:
    """Lines of numbers, taken one after another; every error names the line."""

    name: str
    lines: Iterator[tuple[int, str]]
    last: int = 0
    line: str = ""

    def numbers(self, count: int, content: str, *, exact: bool = False) -> list[float]:
        if not self.goes_on():
            problem = f"ends after line {self.last}, where {content} should follow: the file is cut off"
            raise wrong(self.name, problem)
        fields = self.line.split()
        if len(fields) < count or (exact and len(fields) != count):
            raise self.wrong(f"{quote(self.line.strip())} where {content} should be ({count} numbers)")
        values = finite_numbers(fields[:count])
        if values is None:
            raise self.wrong(f"{quote(self.line.strip())} is not {content}, all finite")
        return [float(v) for v in values]

    def goes_on(self) -> bool:
        """Whether there is a line that is not blank; it is taken."""
        for number, line in self.lines:
            if line.strip():
                self.last, self.line = number, line
                return True
        return False

    def wrong(self, problem: str, do: str = EXPORT) -> SeaError:
        return wrong(self.name, problem, do, line=self.last)


def read_re1(path: Path, text: str) -> Rao:
    """The vessel in a `.re1` file, given its path and text. Errors: SeaError of one line for files that are cut off,
    lack degrees of freedom, hold no zero speed, or whose headings or frequencies are out of order."""
    lines = text.splitlines()
    r = _Reader(path.name, iter(list(enumerate(lines, start=1))[TITLES:]), min(len(lines), TITLES))
    if lines and "TRANSFER FUNCTION" in lines[0].upper() and "MOTION" not in lines[0].upper():
        raise wrong(path.name, f"{quote(lines[0].strip())}: not the motions", "Give the .re1, not the forces (.re8).")
    r.numbers(2, "density and gravity")
    L, B, T = r.numbers(3, "Lpp, breadth and draught")
    if not (L <= LONGEST_SHIP and B <= L and T <= L and min(L, B, T) > 0.0):
        raise r.wrong(f"Lpp {L:g} m, breadth {B:g} m, draught {T:g} m are not those of a ship", "Lengths are in m.")
    _, VCG = r.numbers(2, "LCG and VCG")
    speeds, headings, frequencies = _counts(r)
    for _ in range(speeds):
        speed, _, _, x_aft, z_keel = r.numbers(5, "speed, sinkage, trim and reference point")
        degrees, omega, H = _table(r, headings, frequencies)
        if abs(speed) <= STANDSTILL:
            break
    else:
        problem = f"holds no zero speed, only up to {speed:g} m/s"
        raise wrong(path.name, problem, "Run ShipX at zero speed: vessels at work are stationary.")
    if r.goes_on() and speeds == 1:
        raise r.wrong(f"continues after its {headings} headings", "Check the counts in its line 10.")
    above = z_keel - T
    waterline = "in" if abs(above) < 0.005 else f"{abs(above):.4g} m {'above' if above > 0.0 else 'below'}"
    origin = (
        f"{abs(x_aft):.6g} m {'aft' if x_aft >= 0.0 else 'forward'} of Lpp/2, centreline, {z_keel:.6g} m above the keel"
        f" ({waterline} the still waterline)"
    )
    notes = (
        f"Lpp {L:.6g} m, breadth {B:.6g} m, draught {T:.6g} m, centre of gravity {VCG:.4g} m above the keel",
        f"read as ShipX/VERES: {SHIPX.describe()}",
    )
    one_side = float(np.max(degrees)) <= 180.0
    convention = SHIPX if one_side else replace(SHIPX, mirror=False)
    title = lines[2].partition(":")[2].strip() or path.stem
    source = f"{path.name} (ShipX/VERES .re1, zero speed)"
    return to_rao(
        convention, name=title, omega=omega, heading=np.radians(degrees), H=H, source=source, origin=origin, notes=notes
    )


def _counts(r: _Reader) -> tuple[int, int, int]:
    raw = r.numbers(4, "numbers of speeds, headings, frequencies and degrees of freedom")
    speeds, headings, frequencies, dofs = (int(v) for v in raw)
    if min(raw) < 1 or any(v != int(v) for v in raw) or speeds * headings * frequencies * dofs > LARGEST_TABLE:
        raise r.wrong(f"{', '.join(f'{v:g}' for v in raw)} are not counts of a table")
    if dofs != len(DOFS):
        raise r.wrong(f"{dofs} degrees of freedom, six are needed ({', '.join(DOFS)})")
    return speeds, headings, frequencies


def _table(r: _Reader, headings: int, frequencies: int) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Headings [deg], frequencies [rad/s] and transfer functions (6, headings, frequencies) of one speed."""
    degrees, omega = np.empty(headings), np.empty(frequencies)
    H = np.empty((len(DOFS), headings, frequencies), dtype=np.complex128)
    for j in range(headings):
        degrees[j] = r.numbers(1, f"heading {j + 1} of {headings}", exact=True)[0]
        if j and degrees[j] <= degrees[j - 1]:
            raise r.wrong(f"heading {degrees[j]:g} deg after {degrees[j - 1]:g} deg: headings must ascend")
        for k in range(frequencies):
            w = r.numbers(1, f"frequency {k + 1} of {frequencies} at heading {degrees[j]:g} deg", exact=True)[0]
            if (j and w != omega[k]) or (j == 0 and k and w <= omega[k - 1]) or w <= 0.0:
                raise r.wrong(f"frequency {w:g} rad/s: every heading has the same, ascending")
            omega[k] = w
            for d, dof in enumerate(DOFS):
                number, re, im = r.numbers(3, f"degree of freedom {d + 1} ({dof}), real and imaginary part", exact=True)
                if number != d + 1:
                    raise r.wrong(f"degree of freedom {number:g} where {d + 1} ({dof}) should be")
                H[d, j, k] = complex(re, im)
    return degrees, omega, H
