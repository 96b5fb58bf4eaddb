"""Directions of waves, once: what a file or forecast means by one, and what a ship makes of it.

Inside, a geographic direction is where waves come from, clockwise from true north [rad]. Relative to a ship it is beta,
the direction in which they travel, counter-clockwise from the bow: 0 following, pi/2 coming from starboard, pi head
sea, 3 pi/2 coming from port. A ship's heading is where its bow points, clockwise from true north.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import SeaError
from stillhook.units import parse, quote

Angles = TypeVar("Angles", float, NDArray[np.float64])

FULL = 2.0 * math.pi


def parse_direction(text: object, where: str = "direction") -> float:
    """A direction as text with its unit, within one turn [rad]. Errors: UnitError; SeaError outside 0 to 360 deg; one
    line."""
    value = parse(text, "angle", where)
    if not 0.0 <= value <= FULL * (1.0 + 1e-12):
        raise SeaError(f"{where} = {quote(text)}: not between 0 deg and 360 deg. Give the direction within one turn.")
    return value


class DirectionSense(Enum):
    """What the numbers of a file say."""

    FROM_NORTH = "coming from, clockwise from north"
    TO_NORTH = "going to, clockwise from north"
    FROM_EAST = "coming from, counter-clockwise from east"
    TO_EAST = "going to, counter-clockwise from east"


def coming_from(direction: Angles, sense: DirectionSense) -> Angles:
    """Where waves come from, clockwise from north [rad, 0 to 2 pi], of a direction [rad] that is meant in `sense`."""
    match sense:
        case DirectionSense.FROM_NORTH:
            return wrapped(direction)
        case DirectionSense.TO_NORTH:
            return wrapped(direction + math.pi)
        case DirectionSense.FROM_EAST:
            return wrapped(math.pi / 2.0 - direction)
        case DirectionSense.TO_EAST:
            return wrapped(1.5 * math.pi - direction)


def relative(come_from: Angles, heading: Angles | float) -> Angles:
    """beta [rad, 0 to 2 pi] of waves that come from `come_from` [rad clockwise from north] on a ship that heads
    `heading` [same].

    Waves from dead ahead (come_from = heading) are a head sea: pi. Waves from starboard (heading + pi/2) travel to
    port: pi/2. Its own inverse: of beta and the heading it is where the waves come from.
    """
    return wrapped(heading + math.pi - come_from)


def wrapped(angle: Angles) -> Angles:
    """The angle within 0 to 2 pi [rad]."""
    return angle % FULL
