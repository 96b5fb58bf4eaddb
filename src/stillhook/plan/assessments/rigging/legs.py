"""Tension in the legs of a rigging under one hook: a body that hangs by two to four legs and tilts, with its centre of
gravity anywhere in a box."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.spec.lift.rigging import FEWEST_LEGS, MOST_LEGS, Leg

DIRECTIONS = 24
"""Directions in which a tilt is looked at."""
INDETERMINATE_SKEW = 1.25
"""Skew load factor of four legs: each pair of diagonally opposite legs carries that over two of the load (0027/ND
section 5.6, as public text has it)."""


def usual_skew(n_legs: int) -> float:
    """Skew load factor of a rigging that states none: three legs and fewer are determinate."""
    return INDETERMINATE_SKEW if n_legs == MOST_LEGS else 1.0


class Suspension(NamedTuple):
    """Lower ends of the legs, the hook h above them and the centre of gravity c below them [m]."""

    ends: Sequence[Leg]
    h: float
    c: float


def shares(suspension: Suspension, x: float = 0.0, y: float = 0.0) -> FloatArray:
    r"""Tension in every leg over the load on the hook (n,) [-], where the line from hook to centre of gravity goes x, y
    beside the middle at the depth of the centre of gravity [m].

    The legs are concurrent in the hook, so forces balance there and moments about it with them:

    .. math:: \sum_i T_i \hat u_i = F \hat d

    with unit vectors u from the hook along the legs, d towards the centre of gravity. Three legs and fewer are
    determinate; four of equal stiffness share the load with the least squares. Of two legs the body turns about the
    line through their ends, so that only the way along it counts. A negative number is a leg that is slack.
    """
    ends = np.array(suspension.ends, dtype=np.float64)
    if len(ends) == FEWEST_LEGS:
        along = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
        offset = float(np.array([x, y]) @ along)
        U = np.array([ends @ along, [-suspension.h, -suspension.h]]) / np.hypot(suspension.h, ends @ along)
        d = np.array([offset, -(suspension.h + suspension.c)])
        return np.asarray(np.linalg.solve(U, d / np.linalg.norm(d)))
    U = np.column_stack([ends, np.full(len(ends), -suspension.h)]).T
    d = np.array([x, y, -(suspension.h + suspension.c)])
    return np.asarray(np.linalg.lstsq(U / np.linalg.norm(U, axis=0), d / np.linalg.norm(d), rcond=None)[0])


class Worst(NamedTuple):
    """Shares of the legs (n,) in the worst place of the centre of gravity, and that place: corner (x, y) [m] and
    direction of the tilt [rad]; slack: whether a leg is slack anywhere."""

    shares: FloatArray
    corner: tuple[float, float]
    towards: float
    slack: bool


def worst(suspension: Suspension, box: tuple[float, float, float] | None, tilt: float) -> Worst:
    """The largest tension of any leg over the corners of the box and all directions of the tilt [rad]."""
    dx, dy, dz = (0.0, 0.0, 0.0) if box is None else (0.5 * side for side in box)
    turns = [2.0 * math.pi * k / DIRECTIONS for k in range(DIRECTIONS)] if tilt > 0.0 else [0.0]
    cases = []
    for sx, sy, sz, turn in itertools.product((1.0, -1.0), (1.0, -1.0), (1.0, -1.0), turns):
        at = suspension._replace(c=suspension.c + sz * dz)
        reach = (at.h + at.c) * math.tan(tilt)
        x, y = sx * dx + reach * math.cos(turn), sy * dy + reach * math.sin(turn)
        cases.append((shares(at, x, y), (sx * dx, sy * dy), turn))
    share, corner, turn = max(cases, key=lambda case: float(case[0].max()))
    return Worst(share, corner, turn, any(float(case[0].min()) <= 0.0 for case in cases))
