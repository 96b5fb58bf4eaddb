"""Payloads by their dimensions: displaced volume, added mass and projected area over submergence, from formulas.

Every shape gives the same five things as functions of the depth h of its underside below the surface. The added mass
begins where the first face that stops water is wetted (`contact`), rises there with the slope of the slamming
coefficient, 1/2 rho C_s A_s, and levels out at its value in unbounded water:

    A33(h) = A33 (1 - (1 - x)^3),  x = (h - contact) / l,  l = 3 A33 / (1/2 rho C_s A_s)

so the peak of the momentum force is 1/2 rho C_s A_s v^2, and its sum is the momentum A33 v. For a solid disc l is one
radius. Water inside a body comes on top, evenly over the depth `filling`.

Added mass in heave of plates, discs, tall bodies and perforated ones, in unbounded water.

The formulas are those of DNV-RP-N103 (and the older DNV-RP-H103), appendix and section on added mass, not compared
with the printed text: check against your edition. Coefficients are in the tables below.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.spec.scenario import Number, Record

PLATE_RATIO = (1.0, 2.0, 3.0, 5.0, 10.0, math.inf)
"""Sides b / a of a rectangular plate, a the shorter one."""
PLATE_C_A = (0.579, 0.757, 0.830, 0.897, 0.947, 1.0)
"""Coefficients of a rectangular plate at PLATE_RATIO; the last is the strip of two-dimensional flow."""
PERFORATION_LEAST, PERFORATION_MIDDLE, PERFORATION_MOST = 0.05, 0.34, 0.50
"""Ends of the branches of the perforation factor; it is not known beyond the last."""


def plate(rho: float, a: float, b: float) -> float:
    r"""Added mass of a thin rectangular plate that moves square to itself [kg].

    .. math:: A_{33} = \rho\,C_A\,\tfrac{\pi}{4}a^2 b,\quad a \le b

    Parameters: rho [kg/m^3]; a, b sides in either order [m]. C_A straight in a / b between the values of the table.
    """
    a, b = min(a, b), max(a, b)
    C_A = np.interp(a / b, [1.0 / r for r in reversed(PLATE_RATIO)], list(reversed(PLATE_C_A)))
    return float(rho * C_A * math.pi / 4.0 * a * a * b)


def disc(rho: float, r: float) -> float:
    """Added mass 8/3 rho r^3 of a thin disc of radius r [kg] (Lamb, Hydrodynamics, art. 102)."""
    return 8.0 / 3.0 * rho * r**3


def height_factor(A_p: float, h: float) -> float:
    r"""Growth of a flat body's added mass with its height [-].

    .. math:: 1 + \sqrt{\frac{1-\lambda^2}{2(1+\lambda^2)}},\quad \lambda = \frac{\sqrt{A_p}}{h + \sqrt{A_p}}

    Parameters: A_p projected area [m^2]; h height [m].
    """
    l = math.sqrt(A_p) / (h + math.sqrt(A_p))
    return 1.0 + math.sqrt((1.0 - l * l) / (2.0 * (1.0 + l * l)))


def perforation_factor(p: float) -> float:
    """Part of the added mass that is left with a part p of the area open [-], 0 <= p <= 0.5.

    1 up to 5 %; 0.7 + 0.3 cos(pi (p - 5) / 34) up to 34 % (p in per cent); exp((10 - p) / 28) beyond. As published, the
    last two differ by 1.7 % at 34 %.
    """
    percent = 100.0 * p
    if p <= PERFORATION_LEAST:
        return 1.0
    if p < PERFORATION_MIDDLE:
        return 0.7 + 0.3 * math.cos(math.pi * (percent - 5.0) / 34.0)
    return math.exp((10.0 - percent) / 28.0)


C_S_FLAT = 5.0
"""Slamming coefficient of bodies that are not smooth cylinders, at the least (DNV-RP-N103; check against your
edition)."""
CONTRACTION = 0.62
"""Area of the jet behind a sharp-edged hole as part of the hole: pi / (pi + 2) = 0.611 for a slot, 0.62 measured for
round holes."""
ENGAGED = 0.25
"""Part of the height under a suction anchor's roof over which the roof takes the water inside along (assumed)."""
RISE = 3.0
"""The added mass levels out over three times the length that its first slope would take."""

Open = Annotated[Number, Field(ge=0, le=PERFORATION_MOST)]


class Share(NamedTuple):
    """n bodies of a shape with their undersides `at` above that of the whole [m]."""

    at: float
    n: float
    body: Body


class Shape(Record):
    """What every shape answers."""

    default_C_D: ClassVar[float] = 2.5

    @property
    @abstractmethod
    def tall(self) -> float:
        """Height from the underside to the top [m]."""

    @property
    def outside(self) -> float:
        """Volume that its outside encloses, which no displaced volume can exceed [m^3]; infinite where the shape does
        not say."""
        return math.inf

    @property
    def stated_mass(self) -> float:
        """Mass of the parts that say theirs [kg]."""
        return 0.0

    @property
    def vent_gap(self) -> float:
        """Height over the seabed at which the gap is as wide as the openings through which water leaves [m]; 0: no
        openings."""
        return 0.0

    @property
    def contact(self) -> float:
        """Depth of the underside at which the first face that stops water is wetted [m]."""
        return 0.0

    @property
    @abstractmethod
    def solid_area(self) -> float:
        """Projected area that stops water, openings left out [m^2]."""

    @property
    def mouth(self) -> float:
        """Area over perimeter of the underside: at this height over the seabed the gap is as wide as the underside
        [m]."""
        return 0.5 * math.sqrt(self.solid_area / math.pi)

    def share(self, h: FloatArray) -> FloatArray:
        """Part of the displaced volume that is under the surface [-]; h depth of the underside [m]."""
        return np.clip(h / self.tall, 0.0, 1.0)

    @abstractmethod
    def area(self, h: FloatArray) -> FloatArray:
        """Projected area that drag acts on [m^2]."""

    @abstractmethod
    def added_mass(self, h: FloatArray, rho: float) -> FloatArray:
        """Added mass with the underside h under the surface [kg]."""

    @abstractmethod
    def reach(self, rho: float) -> float:
        """Depth beyond which nothing changes any more [m]."""

    @property
    @abstractmethod
    def shares(self) -> tuple[Share, ...]:
        """The bodies that it is made of."""

    def faces(self, rho: float) -> list[float]:
        """Depths of the underside at which the surface meets a horizontal face, or something else begins or ends [m];
        not in order."""
        return [share.at + h for share in self.shares for h in share.body.levels_of_faces(rho)]

    def vent_drag(self, rho: float) -> float:
        """Quadratic drag of the water that has to leave through openings once the underside is on the seabed [N
        s^2/m^2]; 0: none."""
        return 0.0


class Body(Shape):
    """One body. `C_s` is the slamming coefficient on the area that hits the water."""

    C_s: Number = Field(
        default=C_S_FLAT, gt=0, description="slamming coefficient, 2 / (rho A_s) dA33/dh at the first touch"
    )

    @abstractmethod
    def outer_mass(self, rho: float) -> float:
        """Added mass of the flow around the body in unbounded water [kg]."""

    def inner_mass(self, rho: float) -> float:
        """Water inside that goes along with the covered body [kg]."""
        return 0.0

    @property
    def filling(self) -> float:
        """Depth below `contact` over which the water inside is taken along [m]."""
        return 0.0

    def rise(self, rho: float) -> float:
        """Depth below `contact` over which the added mass of the outer flow rises [m]."""
        return RISE * self.outer_mass(rho) / (0.5 * rho * self.C_s * self.solid_area)

    def area(self, h: FloatArray) -> FloatArray:
        return np.where(h > self.contact, self.solid_area, 0.0)

    def added_mass(self, h: FloatArray, rho: float) -> FloatArray:
        below = np.clip(h - self.contact, 0.0, None)
        outer = self.outer_mass(rho) * (1.0 - (1.0 - np.clip(below / self.rise(rho), 0.0, 1.0)) ** 3)
        inner = self.inner_mass(rho) * np.clip(below / self.filling, 0.0, 1.0) if self.filling > 0.0 else 0.0
        return np.asarray(outer + inner)

    def reach(self, rho: float) -> float:
        return max(self.tall, self.contact + max(self.rise(rho), self.filling))

    @property
    def shares(self) -> tuple[Share, ...]:
        return (Share(0.0, 1, self),)

    def levels_of_faces(self, rho: float) -> tuple[float, ...]:
        """As `faces`, of this body alone [m]."""
        return 0.0, self.contact, self.contact + self.filling, self.contact + self.rise(rho), self.tall


class Rectangle(Body):
    """What a plate and a box have in common."""

    length: u.Length = Field(gt=0)
    width: u.Length = Field(gt=0)
    height: u.Length = Field(gt=0, description="thickness with its stiffeners")
    perforation: Open = Field(default=0.0, description="open part of length x width")

    @property
    def tall(self) -> float:
        return self.height

    @property
    def solid_area(self) -> float:
        return self.length * self.width * (1.0 - self.perforation)

    @property
    def outside(self) -> float:
        return self.length * self.width * self.height

    @property
    def mouth(self) -> float:
        return self.length * self.width / (2.0 * (self.length + self.width))

    def outer_mass(self, rho: float) -> float:
        solid = plate(rho, self.length, self.width) * height_factor(self.length * self.width, self.height)
        return solid * perforation_factor(self.perforation)


class Plate(Rectangle):
    """A flat rectangular plate, solid or perforated, such as a mud-mat."""

    kind: Literal["plate"] = "plate"


class Box(Rectangle):
    """A box whose bottom and top are closed or perforated alike, flooded as it goes down: a protection cover, a
    cabinet.

    The water inside moves with it as far as the perforation allows.
    """

    kind: Literal["box"] = "box"
    wall: u.Length = Field(default=0.0, ge=0, description="thickness of bottom, top and sides")

    @property
    def filling(self) -> float:
        return self.height

    def inner_mass(self, rho: float) -> float:
        inside = math.prod(max(side - 2.0 * self.wall, 0.0) for side in (self.length, self.width, self.height))
        return rho * inside * perforation_factor(self.perforation)


class Disc(Body):
    """A flat round plate, solid or perforated."""

    kind: Literal["disc"] = "disc"
    diameter: u.Length = Field(gt=0)
    height: u.Length = Field(gt=0, description="thickness with its stiffeners")
    perforation: Open = Field(default=0.0, description="open part of the disc")

    @property
    def _gross_area(self) -> float:
        return math.pi / 4.0 * self.diameter**2

    @property
    def tall(self) -> float:
        return self.height

    @property
    def solid_area(self) -> float:
        return self._gross_area * (1.0 - self.perforation)

    @property
    def outside(self) -> float:
        return self._gross_area * self.height

    @property
    def mouth(self) -> float:
        return self.diameter / 4.0

    def outer_mass(self, rho: float) -> float:
        solid = disc(rho, self.diameter / 2.0) * height_factor(self._gross_area, self.height)
        return solid * perforation_factor(self.perforation)


class SuctionAnchor(Body):
    """A cylinder with an open underside and a roof with hatches.

    Air leaves through the hatches. Once the roof meets the water inside it takes it along, as far as the hatches allow,
    over the depth `engaged`, a quarter of the height under the roof unless given (assumed): a shorter one slams harder,
    by the momentum of that water. On the seabed all of it has to leave through the hatches.
    """

    kind: Literal["suction-anchor"] = "suction-anchor"
    diameter: u.Length = Field(gt=0, description="outer diameter")
    height: u.Length = Field(gt=0, description="from the skirt's tip to the top of the roof")
    wall: u.Length = Field(gt=0, description="thickness of the skirt")
    roof: u.Length = Field(gt=0, description="thickness of the roof with its stiffeners")
    hatch: Number = Field(gt=0, le=PERFORATION_MOST, description="open area of the hatches as part of the inner area")
    engaged: u.Length | None = Field(
        default=None, gt=0, description="depth over which the roof takes the water inside along; a quarter"
    )

    @model_validator(mode="after")
    def _hollow(self) -> SuctionAnchor:
        if 2.0 * self.wall >= self.diameter:
            raise ValueError(
                f"wall {u.show(self.wall, 'length')} leaves no room inside a diameter of"
                f" {u.show(self.diameter, 'length')}."
            )
        if self.roof >= self.height:
            raise ValueError(
                f"roof {u.show(self.roof, 'length')} must be thinner than the height {u.show(self.height, 'length')}."
            )
        return self

    @property
    def _outer(self) -> float:
        return math.pi / 4.0 * self.diameter**2

    @property
    def _inner(self) -> float:
        return math.pi / 4.0 * (self.diameter - 2.0 * self.wall) ** 2

    @property
    def tall(self) -> float:
        return self.height

    @property
    def contact(self) -> float:
        return self.height - self.roof

    @property
    def solid_area(self) -> float:
        return self._outer - self.hatch * self._inner

    @property
    def outside(self) -> float:
        return self._outer * self.height

    @property
    def mouth(self) -> float:
        return self.diameter / 4.0

    @property
    def filling(self) -> float:
        return self.engaged or ENGAGED * self.contact

    def outer_mass(self, rho: float) -> float:
        solid = disc(rho, self.diameter / 2.0) * height_factor(self._outer, self.height)
        return solid * perforation_factor(self.hatch)

    def inner_mass(self, rho: float) -> float:
        return rho * self._inner * self.contact * perforation_factor(self.hatch)

    def share(self, h: FloatArray) -> FloatArray:
        skirt, roof = self.contact * (self._outer - self._inner), self.roof * self.solid_area
        wet = np.clip(h / self.contact, 0.0, 1.0) * skirt + np.clip((h - self.contact) / self.roof, 0.0, 1.0) * roof
        return np.asarray(wet / (skirt + roof))

    def area(self, h: FloatArray) -> FloatArray:
        return np.where(h > self.contact, self.solid_area, np.where(h > 0.0, self._outer - self._inner, 0.0))

    @property
    def vent_gap(self) -> float:
        return self.hatch * self._inner / (math.pi * self.diameter)

    def vent_drag(self, rho: float) -> float:
        return 0.5 * rho * self._inner * (1.0 / (CONTRACTION * self.hatch)) ** 2
