"""A payload as the kernels read it: one record, and its numbers at levels of submergence, one of them at every
horizontal face."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.kept.identity import remembered
from stillhook.errors import LiftError
from stillhook.physics.load_path import payload as kernel
from stillhook.physics.load_path.payload import LEVELS
from stillhook.physics.scalar import G
from stillhook.spec.lift.payload import Payload
from stillhook.units import show

COLUMNS = kernel.WettedLevel._fields
"""Numbers of a level."""
SAME = 1.0e-6
"""Faces that lie closer than this part of `reach` are one."""
BEFORE = 1.0e-12
"""Part of `reach` short of a level at which drag is taken: what a face brings comes in over the level above it,
with any rounding."""
AFTER = 1.0e-6
"""Part of the way to the next level over which the slope of the added mass at a level is taken."""
PLAIN_DRAG_GROWTH = 1.0
"""Growth of the drag at touch-down for payloads without hatches (assumed): the water has to leave sideways."""


class Spread(NamedTuple):
    """How much of something there is at every level, and its first and second moment over the height above the
    underside."""

    m_0: FloatArray
    m_1: FloatArray
    m_2: FloatArray

    def centre(self, otherwise: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Centre above the underside and radius of gyration [m]; where there is nothing those of an even spread over
        the height `otherwise` [m]."""
        some = self.m_0 > 0.0
        m_0 = np.where(some, self.m_0, 1.0)
        y = np.where(some, self.m_1 / m_0, 0.5 * otherwise)
        r_2 = np.where(some, self.m_2 / m_0 - y * y, otherwise**2 / 12.0)
        return y, np.sqrt(np.maximum(r_2, 0.0))


def evenly(amount: FloatArray, at: float, over: FloatArray) -> Spread:
    """An amount spread evenly from the height `at` on over the heights `over` [m]."""
    y = at + 0.5 * over
    return Spread(amount, amount * y, amount * (y * y + over**2 / 12.0))


def total(parts: list[Spread]) -> Spread:
    return Spread(*(np.sum(column, axis=0) for column in zip(*parts, strict=True)))


@remembered
def pack_payload(payload: Payload, rho: float, depth: float) -> tuple[kernel.Payload, FloatArray]:
    """The record and the levels (LEVELS, fields of `WettedLevel`) of a payload over a seabed `depth` [m] down, in water
    of density rho [kg/m^3]. Errors: LiftError where the payload floats, or has more faces than there are levels.
    """
    h = level_heights(payload, rho)
    reach, dh = float(h[-1]), np.diff(h)
    at, short = payload.at(h, rho), np.maximum(h - BEFORE * reach, 0.0)
    slope = np.diff(at.A33) / dh
    after = (payload.at(h[:-1] + AFTER * dh, rho).A33 - at.A33[:-1]) / (AFTER * dh)
    after = np.clip(after, np.minimum(0.0, 2.0 * slope), np.maximum(0.0, 2.0 * slope))
    y_m, r_m, y_d, r_d = centres(payload, h, short, rho)
    rows = np.zeros((LEVELS, len(COLUMNS)))
    rows[:-1, COLUMNS.index("dA33")], rows[:-1, COLUMNS.index("dA33_next")] = after, 2.0 * slope - after
    B = 0.5 * rho * payload.C_D * payload.at(short, rho).A_p
    columns = {"h": h, "V": at.V, "A33": at.A33, "B": B, "y_m": y_m, "r_m": r_m, "y_d": y_d, "r_d": r_d}
    for name, column in columns.items():
        rows[:, COLUMNS.index(name)] = column
    covered = kernel.WettedLevel(*rows[-1].tolist())
    W_sub = submerged_weight(payload, rho)
    bed = payload.seabed
    k_soil = W_sub / bed.settlement
    A33 = covered.A33 * (1.0 + bed.added_mass)
    gap_0 = bed.gap if bed.gap is not None else mouth(payload, rho)
    vent = 0.0 if payload.shape is None else payload.shape.vent_gap
    record = kernel.Payload(
        m=payload.mass,
        W=payload.mass * G,
        H=payload.height,
        rho=rho,
        g=G,
        C_lin=payload.C_lin,
        depth=depth,
        k_soil=k_soil,
        c_soil=2.0 * bed.zeta * math.sqrt(k_soil * (payload.mass + A33)),
        gap_0=gap_0,
        gap_B=gap_0 if vent <= 0.0 else vent,
        bottom_A=bed.added_mass,
        bottom_B=drag_growth(payload, covered.B, rho),
        reach=reach,
    )
    rows.flags.writeable = False
    return record, rows


def level_heights(payload: Payload, rho: float) -> FloatArray:
    """Submergence of every level [m]: one at each face of a shape, or at each level that was given, the rest even
    between them.

    Nothing changes beyond the last. Errors: LiftError where there are more faces than levels.
    """
    reach = payload.reach(rho)
    faces = [level.h for level in payload.levels] if payload.shape is None else payload.shape.faces(rho)
    marks = [0.0]
    for h in sorted(faces):
        if marks[-1] + SAME * reach < h < reach * (1.0 - SAME):
            marks.append(h)
    marks.append(reach)
    if len(marks) > LEVELS:
        raise LiftError(
            f'Payload "{payload.name}": {len(marks)} different heights at which something begins or ends, and at most'
            f" {LEVELS} are kept apart. Join parts, or give fewer levels."
        )
    gaps, parts = np.diff(marks), np.ones(len(marks) - 1, dtype=int)
    while parts.sum() < LEVELS - 1:
        parts[np.argmax(gaps / parts)] += 1
    inside = [np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(marks), parts, strict=True)]
    return np.append(np.concatenate(inside), reach)


def centres(
    payload: Payload, h: FloatArray, short: FloatArray, rho: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """y_m, r_m, y_d, r_d of `WettedLevel` at the levels h [m], drag as it is just short of them.

    The displaced volume sits where each level adds it. Added mass and drag are those of the flow about a body: each
    body's is spread evenly over its wet height, and that of a payload which was given by levels over its own.
    """
    at = payload.at(h, rho)
    wet = np.clip(h, 0.0, payload.height)
    if payload.shape is None:
        added, drag = evenly(at.A33, 0.0, wet), evenly(payload.at(short, rho).A_p, 0.0, wet)
    else:
        shares = [(s, np.clip(h - s.at, 0.0, s.body.tall)) for s in payload.shape.shares]
        added = total([evenly(s.n * s.body.added_mass(h - s.at, rho), s.at, over) for s, over in shares])
        drag = total([evenly(s.n * s.body.area(short - s.at), s.at, over) for s, over in shares])
    first = evenly(np.full_like(h, at.V[0]), 0.0, wet)
    dV = np.diff(at.V)
    lo, hi = h[:-1], h[1:]
    moments = (dV, dV * (lo + hi) / 2.0, dV * (lo * lo + lo * hi + hi * hi) / 3.0)
    later = Spread(*(np.concatenate([[0.0], np.cumsum(m)]) for m in moments))
    mass = total([Spread(*(rho * m for m in first)), Spread(*(rho * m for m in later)), added])
    return *mass.centre(wet), *drag.centre(wet)


def wetted_at(h: float, rows: FloatArray) -> kernel.Wetted:
    """A payload's numbers at the submergence h [m], from its levels."""
    j = min(max(int(np.searchsorted(rows[:, 0], h, side="right")) - 1, 0), LEVELS - 2)
    return kernel.wetted(h, kernel.WettedLevel(*rows[j]), kernel.WettedLevel(*rows[j + 1]))


def submerged_weight(payload: Payload, rho: float) -> float:
    """Weight less buoyancy of the covered payload [N]. Errors: LiftError where it floats."""
    V = payload.covered(rho).V
    if rho * V >= payload.mass:
        weighs, displaces = show(payload.mass, "mass"), show(rho * V, "mass")
        raise LiftError(
            f'Payload "{payload.name}": it floats, for it weighs {weighs} and displaces {displaces} of water. '
            "Give a larger mass or a smaller volume."
        )
    return (payload.mass - rho * V) * G


def mouth(payload: Payload, rho: float) -> float:
    """Height over the seabed at which the gap under the payload is as wide as its underside [m]: area over
    perimeter."""
    if payload.shape is not None:
        return payload.shape.mouth
    A_p = payload.covered(rho).A_p
    return 0.5 * math.sqrt(A_p / math.pi) if A_p > 0.0 else payload.height


def drag_growth(payload: Payload, B: float, rho: float) -> float:
    """Growth of the drag at touch-down [-]: as given, else so that all water under it leaves through its hatches, else
    assumed."""
    if payload.seabed.drag is not None:
        return payload.seabed.drag
    vent = 0.0 if payload.shape is None else payload.shape.vent_drag(rho)
    return max(vent / B - 1.0, 0.0) if vent > 0.0 and B > 0.0 else PLAIN_DRAG_GROWTH
