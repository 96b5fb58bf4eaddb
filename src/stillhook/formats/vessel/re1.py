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

    def numbers(self, count: int, content: str, *, exact: bool = False) -> list[float]:
        for number, line in self.lines:
            if not line.strip():
                continue
            self.last = number
            fields = line.split()
            if len(fields) < count or (exact and len(fields) != count):
                text = quote(line.strip())
                raise SeaError(
                    f"{self.name}: line {number}: {text} where {content} should be ({count} numbers). Export the file"
                    " again."
                )
            try:
                return [self._finite(text, number) for text in fields[:count]]
            except ValueError:
                raise SeaError(
                    f"{self.name}: line {number}: {quote(line.strip())} is not {content}. Export the file again."
                ) from None
        raise SeaError(
            f"{self.name}: ends after line {self.last}, where {content} should follow: the file is cut off. Export it"
            " again."
        )

    def _finite(self, text: str, number: int) -> float:
        value = float(text.replace("D", "E").replace("d", "e"))
        if not np.isfinite(value):
            raise SeaError(f"{self.name}: line {number}: {quote(text)} is not a finite number. Export the file again.")
        return value


def read_re1(path: Path, text: str) -> Rao:
    """The vessel in a `.re1` file, given its path and text. Errors: SeaError of one line for files that are cut off,
    lack degrees of freedom, hold no zero speed, or whose headings or frequencies are out of order."""
    lines = text.splitlines()
    r = _Reader(path.name, iter(list(enumerate(lines, start=1))[TITLES:]), min(len(lines), TITLES))
    if lines and "TRANSFER FUNCTION" in lines[0].upper() and "MOTION" not in lines[0].upper():
        raise SeaError(
            f"{path.name}: {quote(lines[0].strip())}: not the motions. Give the .re1, not the forces (.re8)."
        )
    r.numbers(2, "density and gravity")
    L, B, T = r.numbers(3, "Lpp, breadth and draught")
    if not (L <= LONGEST_SHIP and B <= L and T <= L and min(L, B, T) > 0.0):
        raise SeaError(
            f"{path.name}: line {r.last}: Lpp {L:g} m, breadth {B:g} m, draught {T:g} m are not those of a ship."
            " Lengths are"
            " in m."
        )
    _, VCG = r.numbers(2, "LCG and VCG")
    speeds, headings, frequencies = _counts(r)
    for _ in range(speeds):
        speed, _, _, x_aft, z_keel = r.numbers(5, "speed, sinkage, trim and reference point")
        degrees, omega, H = _table(r, headings, frequencies)
        if abs(speed) <= STANDSTILL:
            break
    else:
        raise SeaError(
            f"{path.name}: holds no zero speed, only up to {speed:g} m/s. Run ShipX at zero speed: vessels at work"
            " are stationary."
        )
    if _has_more(r) and speeds == 1:
        raise SeaError(
            f"{path.name}: line {r.last}: continues after its {headings} headings. Check the counts in its line 10."
        )
    origin = (
        f"{abs(x_aft):.6g} m {'aft' if x_aft >= 0.0 else 'forward'} of Lpp/2, centreline, {z_keel:.6g} m above the keel"
        f" ({_against(z_keel, T)})"
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
        raise SeaError(
            f"{r.name}: line {r.last}: {', '.join(f'{v:g}' for v in raw)} are not counts of a table. Export the file"
            " again."
        )
    if dofs != len(DOFS):
        raise SeaError(
            f"{r.name}: line {r.last}: {dofs} degrees of freedom, six are needed ({', '.join(DOFS)}). Export all of"
            " them."
        )
    return speeds, headings, frequencies


def _table(r: _Reader, headings: int, frequencies: int) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Headings [deg], frequencies [rad/s] and transfer functions (6, headings, frequencies) of one speed."""
    degrees, omega = np.empty(headings), np.empty(frequencies)
    H = np.empty((len(DOFS), headings, frequencies), dtype=np.complex128)
    for j in range(headings):
        degrees[j] = r.numbers(1, f"heading {j + 1} of {headings}", exact=True)[0]
        if j and degrees[j] <= degrees[j - 1]:
            out_of_order = f"heading {degrees[j]:g} deg after {degrees[j - 1]:g} deg"
            raise SeaError(f"{r.name}: line {r.last}: {out_of_order}: headings must ascend. Export it again.")
        for k in range(frequencies):
            w = r.numbers(1, f"frequency {k + 1} of {frequencies} at heading {degrees[j]:g} deg", exact=True)[0]
            if (j and w != omega[k]) or (j == 0 and k and w <= omega[k - 1]) or w <= 0.0:
                raise SeaError(
                    f"{r.name}: line {r.last}: frequency {w:g} rad/s: every heading has the same, ascending. Export it"
                    " again."
                )
            omega[k] = w
            for d, dof in enumerate(DOFS):
                number, re, im = r.numbers(3, f"degree of freedom {d + 1} ({dof}), real and imaginary part", exact=True)
                if number != d + 1:
                    instead = f"degree of freedom {number:g} where {d + 1} ({dof}) should be"
                    raise SeaError(f"{r.name}: line {r.last}: {instead}. Export all six, in order.")
                H[d, j, k] = complex(re, im)
    return degrees, omega, H


def _has_more(r: _Reader) -> bool:
    for number, line in r.lines:
        if line.strip():
            r.last = number
            return True
    return False


def _against(z_keel: float, T: float) -> str:
    above = z_keel - T
    if abs(above) < 0.005:
        return "in the still waterline"
    return f"{abs(above):.4g} m {'above' if above > 0.0 else 'below'} the still waterline"
