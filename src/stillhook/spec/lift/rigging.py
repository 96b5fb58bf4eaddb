"""Rigging as a lift plan assesses it: legs between hook and payload, and what carries their tension, piece by piece."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated, NamedTuple

from pydantic import BeforeValidator, Field, model_validator

from stillhook import units as u
from stillhook.errors import SeaError, UnitError
from stillhook.physics.scalar import G
from stillhook.sea.vessel.boom import parse_point
from stillhook.spec.lift.lowering import Rigging
from stillhook.spec.record import Record
from stillhook.spec.scenario import Number
from stillhook.tables.table import Name, Part, Text

FEWEST_LEGS, MOST_LEGS = 2, 4
STEEPEST, FLATTEST = math.radians(89.0), math.radians(20.0)
"""Angles of a leg to the horizontal between which its tension is a matter of geometry; flatter is a spreader's."""


def load_of(value: object) -> float:
    """A load as force [N]: written as one, "540 kN", or as a mass, "55 t". Errors: ValueError."""
    for kind, factor in (("mass", G), ("force", 1.0)):
        try:
            return u.parse(value, kind) * factor
        except UnitError:
            continue
    units = ", ".join((*u.KINDS["mass"].allowed, *u.KINDS["force"].allowed))
    raise ValueError(f'write a mass or a force, such as "55 t" or "540 kN" (allowed: {units}).')


Load = Annotated[float, BeforeValidator(load_of)]
Legs = Annotated[int, Field(strict=True)]


class Carrier(StrEnum):
    """What a lift in air begins or ends on."""

    OWN_DECK = "own-deck"
    VESSEL = "another-vessel"
    ONSHORE = "onshore"


LIGHTEST_LIFT, LIGHT_LIFT = 3e3, 100e3
"""Static hook load that a lighter lift is taken for, and up to which the DAF in air is a formula [kg]."""
DAF_STEPS: Mapping[Carrier, tuple[float, float, float, float]] = {
    Carrier.OWN_DECK: (1.12, 1.10, 1.08, 1.05),
    Carrier.VESSEL: (1.25, 1.20, 1.15, 1.10),
    Carrier.ONSHORE: (1.05, 1.05, 1.03, 1.03),
}
"""DAF in air above 100 t: up to 300, 1,000 and 2,500 t, and beyond."""


def DAF_in_air(m: float, carrier: Carrier) -> float:
    r"""Dynamic amplification factor of a lift in air by a single crane [-] for a static hook load m [kg].

    .. math:: 1 + 0.25\sqrt{100/SHL} \text{ from another vessel}, \quad 1.07 + 0.05\sqrt{100/SHL} \text{ from the deck}

    up to 100 t, 1.10 onshore, and in steps above. Source: 0027/ND Rev 11 table 5-1, columns offshore, inshore and
    onshore, as a public copy has it; from the deck of the crane vessel onto the seabed the column inshore is taken.
    """
    if m > LIGHT_LIFT:
        return DAF_STEPS[carrier][sum(m > top for top in (300e3, 1000e3, 2500e3))]
    root = math.sqrt(LIGHT_LIFT / max(m, LIGHTEST_LIFT))
    return {Carrier.OWN_DECK: 1.07 + 0.05 * root, Carrier.VESSEL: 1.0 + 0.25 * root, Carrier.ONSHORE: 1.10}[carrier]


class ItemKind(StrEnum):
    """What a piece of rigging is, and with that what it carries: one leg, or all of them."""

    SLING = "sling"
    SHACKLE = "shackle"
    LIFT_POINT = "lift-point"
    MASTER_LINK = "master-link"

    @property
    def of_leg(self) -> bool:
        """Whether it carries one leg."""
        return self is not ItemKind.MASTER_LINK


class RiggingItem(Record):
    """A piece of rigging, alike in every leg. WLL is held against the dynamic load over `dynamic`, MBL against the
    dynamic load times `factor`; of both the worse counts."""

    name: Name = Field(description="what the lift plan calls it")
    kind: ItemKind = ItemKind.SLING
    WLL: Load | None = Field(default=None, gt=0, description='working load limit, such as "55 t" or "540 kN"')
    MBL: Load | None = Field(default=None, gt=0, description='minimum breaking load, such as "200 t"')
    factor: Number | None = Field(default=None, ge=1, le=20, description="safety factor on the breaking load")
    dynamic: Number = Field(
        default=1.0, ge=1, le=3, description="dynamic factor that the WLL covers by its certificate; 1 without one"
    )
    source: str = Field(default="", description="certificate or drawing")

    @model_validator(mode="after")
    def _rated(self) -> RiggingItem:
        if self.WLL is None and self.MBL is None:
            raise ValueError(f"item {u.quote(self.name)}: WLL is missing. Give WLL, or MBL and factor.")
        if (self.MBL is None) != (self.factor is None):
            raise ValueError(f"item {u.quote(self.name)}: MBL and factor are given together. Add the other.")
        return self

    def utilisation(self, T: float) -> float:
        """How much of the item a dynamic load [N] uses [-]."""
        by_WLL = 0.0 if self.WLL is None else T / (self.WLL * self.dynamic)
        return max(by_WLL, 0.0 if self.MBL is None or self.factor is None else T * self.factor / self.MBL)


class Leg(NamedTuple):
    """A leg's lower end from the point below the hook [m]: x along, y across the payload."""

    x: float
    y: float


class RiggingTable(Rigging):
    """The table [rigging] of a plan: the spring of a run, and legs and items that a plan assesses."""

    legs: Legs | None = Field(
        default=None, ge=FEWEST_LEGS, le=MOST_LEGS, description="slings from the hook to the payload"
    )
    angle: u.Angle | None = Field(default=None, description="of a leg to the horizontal, in place of points")
    points: tuple[Text, ...] | None = Field(
        default=None, description='lift points seen from the point below the hook, such as "x=5 m, y=4 m"'
    )
    mass: u.Mass = Field(default=0.0, ge=0, description="of everything between hook and payload, in air")
    mass_submerged: u.Mass | None = Field(
        default=None, ge=0, description="the same less buoyancy; default that of steel"
    )
    skew: Number | None = Field(
        default=None, ge=1, le=2, description="skew load factor; default 1.25 of four legs, 1.0 of fewer"
    )
    tilt: u.Angle = Field(default=0.0, ge=0, le=math.radians(15.0), description="of the payload on the hook")
    carrier: Carrier = Field(default=Carrier.OWN_DECK, description="what the lift in air begins or ends on")
    DAF_air: Number | None = Field(
        default=None, ge=1, le=3, description="design DAF of rigging and lift points in air, in place of the standard's"
    )
    items: Text | None = Field(default=None, description="table of items next to this file, CSV or XLSX")
    item: tuple[Part[RiggingItem], ...] = Field(default=(), description="[[rigging.item]] tables in place of a file")
    source: str = Field(default="assumed", description="drawing or certificate of the rigging")

    @model_validator(mode="after")
    def _hangs(self) -> RiggingTable:
        if self.angle is not None and not FLATTEST <= self.angle <= STEEPEST:
            low, high = (u.show(x, "angle") for x in (FLATTEST, STEEPEST))
            came = u.show(self.angle, "angle")
            raise ValueError(f"angle {came} is not between {low} and {high} to the horizontal. Check its sense.")
        if self.points is not None:
            self._check_points()
        elif self.legs is not None and self.angle is None:
            raise ValueError('legs are given, and not how they hang. Give angle, such as "62 deg", or points.')
        elif self.angle is not None and self.legs is None:
            raise ValueError("angle is given, and not of how many legs. Give legs, 2 to 4.")
        if self.item and self.items is not None:
            raise ValueError("items and [[rigging.item]] are both given. Keep one.")
        if (self.item or self.items is not None) and not self.n_legs:
            raise ValueError("items are given, and not the legs that they are in. Give legs and angle, or points.")
        if self.mass_submerged is not None and self.mass_submerged > self.mass:
            raise ValueError("mass_submerged is more than mass. Check both.")
        return self

    def _check_points(self) -> None:
        legs = self.ends
        if self.angle is not None:
            raise ValueError("angle and points are both given. Keep one: points and height give the angle.")
        if not FEWEST_LEGS <= len(legs) <= MOST_LEGS or self.legs not in (None, len(legs)):
            wanted = "2 to 4" if self.legs is None else str(self.legs)
            raise ValueError(f"points: {len(legs)} are given. Write {wanted}, one a leg.")
        if self.height <= 0.0:
            raise ValueError("points need height, from the hook down to the payload's top. Give it.")
        if any(not FLATTEST <= self.slope(leg) <= STEEPEST for leg in legs):
            low, high = (u.show(x, "angle") for x in (FLATTEST, STEEPEST))
            raise ValueError(
                f"points: a leg is not between {low} and {high} to the horizontal. Check height and points."
            )
        if not encloses(legs, Leg(0.0, 0.0)):
            raise ValueError("points: the hook is not above their base. Give them from the point below the hook.")

    @property
    def n_legs(self) -> int:
        """Number of legs; 0 where the file has none."""
        return len(self.points) if self.points is not None else self.legs or 0

    @property
    def ends(self) -> tuple[Leg, ...]:
        """Lower ends of the legs; of an angle alone evenly about the hook. Errors: ValueError for a point that is
        none."""
        if self.points is not None:
            try:
                places = [parse_point(text, "points") for text in self.points]
            except (SeaError, UnitError) as problem:
                raise ValueError(str(problem)) from None
            return tuple(Leg(at.x, at.y) for at in places)
        if self.angle is None:
            return ()
        n, r = self.n_legs, self.height / math.tan(self.angle)
        turns = [2.0 * math.pi * (k + (0.5 if n == MOST_LEGS else 0.0)) / n for k in range(n)]
        return tuple(Leg(r * math.cos(turn), r * math.sin(turn)) for turn in turns)

    def slope(self, leg: Leg) -> float:
        """Angle of a leg to the horizontal [rad]."""
        return math.atan2(self.height, math.hypot(*leg))

    @property
    def spring(self) -> Rigging:
        """What a run has of the rigging."""
        return Rigging.model_construct(**{name: getattr(self, name) for name in Rigging.model_fields})


def encloses(legs: tuple[Leg, ...], at: Leg) -> bool:
    """Whether a place is inside the base that lift points span; of two: between them, along their line."""
    if len(legs) == 2:
        a, b = legs
        along = ((at.x - a.x) * (b.x - a.x) + (at.y - a.y) * (b.y - a.y)) / math.dist(a, b) ** 2
        return 0.0 < along < 1.0
    middle = Leg(sum(leg.x for leg in legs) / len(legs), sum(leg.y for leg in legs) / len(legs))
    around = sorted(legs, key=lambda leg: math.atan2(leg.y - middle.y, leg.x - middle.x))
    sides = zip(around, (*around[1:], around[0]), strict=True)
    return all((b.x - a.x) * (at.y - a.y) - (b.y - a.y) * (at.x - a.x) > 0.0 for a, b in sides)
