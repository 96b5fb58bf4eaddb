"""Conventions that tables of vessel motions are written in, and the way into Stillhook's own.

A table says where its axes point, how time goes, what a heading means and whether its other half is a mirror image.
Nothing is guessed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.sea.vessel.floating_body import ARM
from stillhook.sea.vessel.rao import DOFS, TURN, Rao, wavenumber

PORT_STARBOARD = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
"""Signs of the motions seen in a mirror along the centreline: sway, roll and yaw turn over."""
FORE_AND_AFT = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
"""Signs of the motions seen in a mirror across the middle of the ship: surge, pitch and yaw turn over."""
SAME_HEADING = 1e-6  # rad: headings nearer than this are one
WIDEST_GAP = 45  # deg: beyond it motions between two headings are guesses
SYMMETRIC = 0.02
"""Sway [m/m] and roll and yaw [rad/m times 50 m] in head and following sea above which a half table is not that of a
symmetric ship."""


@dataclass(frozen=True)
class Convention:
    """How a table counts.

    x, y, z: where its axes point; they must be right-handed, and rotations right-handed about them. time: +1 for exp(+i
    omega t) (also amplitudes with phase leads), -1 for exp(-i omega t) (also phase lags). waves: headings say where
    waves go to or come from; turn: counter-clockwise or clockwise seen from above; zero: from the bow or from the
    stern. mirror: the table holds one side of a ship that is the same to port and starboard.
    """

    x: Literal["forward", "aft"]
    y: Literal["port", "starboard"]
    z: Literal["up", "down"]
    time: Literal[1, -1]
    waves: Literal["to", "from"]
    turn: Literal["counter-clockwise", "clockwise"]
    zero: Literal["bow", "stern"] = "bow"
    mirror: bool = False

    def __post_init__(self) -> None:
        if not np.prod(self.signs[:3]) > 0.0:
            raise SeaError(
                f"axes x {self.x}, y {self.y}, z {self.z} are left-handed. Right-handed are x forward with y port and z"
                " up or with y starboard and z down, and x aft with y starboard and z up or with y port and z down."
            )

    @property
    def signs(self) -> FloatArray:
        """Signs (6,) that take motions of the table to x forward, y port, z up: rotations turn as their axes do."""
        pairs = ((self.x, "forward"), (self.y, "port"), (self.z, "up"))
        return np.array([1.0 if axis == ours else -1.0 for axis, ours in pairs] * 2)

    def beta(self, heading: FloatArray) -> FloatArray:
        """Direction in which waves travel, counter-clockwise from the bow, in [0, 2 pi), of headings of the table
        [rad]."""
        angle = heading if self.turn == "counter-clockwise" else -heading
        half_turns = (self.waves == "from") + (self.zero == "stern")
        beta = np.mod(angle + half_turns * np.pi, TURN)
        return np.where(beta > TURN - SAME_HEADING, 0.0, beta)

    def describe(self) -> str:
        """The convention in words."""
        time = f"exp({'+' if self.time > 0 else '-'}i omega t)"
        waves = "travel to" if self.waves == "to" else "come from"
        axes = f"x {self.x}, y {self.y}, z {self.z}"
        return f"{time}; {axes}; heading: waves {waves}, {self.turn} from the {self.zero}"


INSIDE = Convention("forward", "port", "up", 1, "to", "counter-clockwise")
"""Stillhook's own."""
SHIPX = Convention("aft", "starboard", "up", 1, "from", "counter-clockwise", mirror=True)
"""ShipX/VERES: heading 0 head sea, 90 from port, 180 following; half a turn about z from Stillhook's own."""
CAPYTAINE = Convention("forward", "port", "up", -1, "to", "counter-clockwise")


def to_rao(
    convention: Convention,
    *,
    name: str,
    omega: FloatArray,
    heading: FloatArray,
    H: ComplexArray,
    source: str,
    origin: str,
    notes: tuple[str, ...] = (),
    depth: float = np.inf,
    crest: tuple[float, float] = (0.0, 0.0),
) -> Rao:
    """A table in some convention as a Rao.

    omega (n,) [rad/s]; heading (m,) [rad] as the table counts; H (6, m, n) [m/m, rad/m], in any order of frequencies
    and headings. depth of the water [m]. crest: where the wave crest of phase 0 passes, forward and to port of the
    reference point [m]; phases are moved to it.
    Errors: SeaError for doubled headings or frequencies, for a half table whose sway, roll or yaw do not vanish along
    the centreline, and for a table that does not go all round.
    """
    H = np.asarray(convention.signs[:, None, None] * (H if convention.time > 0 else np.conj(H)))
    beta = convention.beta(heading)
    if len(beta) > 2 and abs(heading[-1] - heading[0] - np.sign(heading[-1] - heading[0]) * TURN) < SAME_HEADING:
        beta, H = beta[:-1], H[:, :-1]  # a table that names its first heading again after one turn
    rows, columns = np.argsort(beta), np.argsort(omega)
    beta, omega, H = beta[rows], omega[columns], H[:, rows][:, :, columns]
    if crest != (0.0, 0.0):
        along = crest[0] * np.cos(beta) + crest[1] * np.sin(beta)
        H = H * np.exp(-1j * wavenumber(omega, depth) * along[:, None])
    twice = np.flatnonzero(np.diff(beta) < SAME_HEADING)
    if len(twice):
        same = np.degrees(beta[twice[0]])
        problem = f"two headings are {same:.6g} deg (waves travel, counter-clockwise from the bow)"
        raise SeaError(f"{source}: {problem}. Keep one.")
    if convention.mirror:
        beta, H = _mirrored(beta, H, source)
        other_side = "the table holds one side, and sway, roll and yaw change sign on the other"
        notes = (f"port and starboard mirrored: {other_side}", *notes)
    gap = float(np.max(np.diff(np.append(beta, beta[0] + TURN)))) if len(beta) > 1 else TURN
    if gap > np.radians(WIDEST_GAP) + SAME_HEADING:
        problem = f"no heading within {np.degrees(gap):.4g} deg of another, up to {WIDEST_GAP} deg is read"
        do = "Give headings all round, or one side of a ship the same on the other (mirror: port-starboard)."
        raise SeaError(f"{source}: {problem}. {do}")
    return Rao(name, omega, beta, H, source=source, notes=notes, origin=origin, depth=depth)


def _mirrored(beta: FloatArray, H: ComplexArray, source: str) -> tuple[FloatArray, ComplexArray]:
    """The whole turn from one side: headings from 0 to 180 deg, or from 180 to 360 deg."""
    along: NDArray[np.bool_] = np.minimum(np.abs(np.sin(beta)), 1.0) < SAME_HEADING
    port = (np.sin(beta) > 0.0) & ~along
    starboard = (np.sin(beta) < 0.0) & ~along
    if port.any() and starboard.any():
        do = "State mirror: none, or keep one side from head to following sea."
        raise SeaError(f"{source}: is declared to hold one side of a symmetric ship and has headings on both. {do}")
    if along.sum() != 2:
        problem = "one side of a symmetric ship goes from head to following sea, both included"
        raise SeaError(f"{source}: {problem}. Give 0 to 180 deg.")
    if worst := _not_symmetric(H[:, along], [1, 3, 5], "head or following sea"):
        raise SeaError(f"{source}: {worst} on both sides is 0. Give headings all round (mirror: none).")
    other = ~along
    mirrored_beta = np.mod(-beta[other], TURN)
    complete_beta = np.concatenate([beta, mirrored_beta])
    both = np.concatenate([H, PORT_STARBOARD[:, None, None] * H[:, other]], axis=1)
    order = np.argsort(complete_beta)
    return complete_beta[order], both[:, order]


def _not_symmetric(H: ComplexArray, turned: list[int], sea: str) -> str:
    """Begin of a refusal of motions (6, m, n) along a plane of symmetry that turn over in its mirror and are not
    nothing there; empty where they are."""
    size = np.abs(H[turned]).max(axis=(1, 2))
    worst = int(np.argmax(size * np.array([1.0, ARM, ARM])))
    if (size * np.array([1.0, ARM, ARM]))[worst] <= SYMMETRIC:
        return ""
    reached = f"{DOFS[turned[worst]]} in {sea} reaches {size[worst]:.3g} per metre of wave"
    return f"{reached}, where that of a ship the same"


def within_one_side(heading: FloatArray) -> bool:
    """Whether headings [rad] cover no more than one side of a ship."""
    return float(np.ptp(heading)) <= np.pi + SAME_HEADING


def mirrored_fore_and_aft(heading: FloatArray, H: ComplexArray, source: str) -> tuple[FloatArray, ComplexArray]:
    """Headings of one side from those of a quarter, of a ship that is the same fore and aft.

    heading (m,) [rad], from the bow or the stern, within one quarter that ends along the ship and in beam sea; H (6, m,
    n) in any sign of time, phases of a crest in the plane of symmetry. Errors: SeaError for headings on both ends,
    without beam sea, and where surge, pitch or yaw in beam sea are not nothing.
    """
    beam: NDArray[np.bool_] = np.abs(np.cos(heading)) < SAME_HEADING
    ahead = np.cos(heading[~beam])
    if beam.sum() != 1 or (ahead.min(initial=0.0) < 0.0 < ahead.max(initial=0.0)):
        problem = "one quarter of a ship with two planes of symmetry goes from 0 to 90 deg, both included"
        raise SeaError(f"{source}: {problem}. Give these headings, or those of one side, 0 to 180 deg.")
    if worst := _not_symmetric(H[:, beam], [0, 4, 5], "beam sea"):
        raise SeaError(f"{source}: {worst} fore and aft is 0. Give headings of one side, 0 to 180 deg.")
    other = np.pi - heading[~beam]
    return np.concatenate([heading, other]), np.concatenate([H, FORE_AND_AFT[:, None, None] * H[:, ~beam]], axis=1)
