"""Payload on the hook: mass, height, and hydrodynamic coefficients over submergence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.errors import LiftError
from stillhook.physics.scalar import G
from stillhook.spec.crane import Source
from stillhook.spec.lift.assembly import SHAPES, AnyShape, rebuilt_shape, with_shape
from stillhook.spec.lift.shapes import Shape
from stillhook.spec.scenario import RHO_SEA, Number, Record
from stillhook.tables.html import record_html
from stillhook.tables.table import Line

RHO_STEEL = 7850.0
"""Density of steel [kg/m^3]: displaced volume of a payload whose volume is not given."""
LIGHTEST = 5.0
"""Mass over the volume that a payload's outside encloses [kg/m^3] below which mass or dimensions have a wrong unit: an
empty suction anchor has some 250."""
CURVE = 400
"""Points of a curve over submergence."""

LEVELS_OR_SHAPE = f"give either levels or a shape ({', '.join(SHAPES)}) with its dimensions."


class Level(Record):
    """A payload's numbers with its underside `h` under the surface; between levels they are interpolated."""

    h: u.Length = Field(ge=0, description="submergence of the underside")
    V: u.Volume = Field(ge=0, description="displaced volume")
    A33: u.Mass = Field(ge=0, description="added mass in heave")
    A_p: u.Area = Field(ge=0, description="projected area that drag acts on")


class Seabed(Record):
    """How the payload and the seabed take hold of each other. What is not given follows from the payload (assumed).

    Over the bottom, added mass and drag grow by (1 - gap / gap_0)^2 times `added_mass` and `drag`; the soil is a spring
    under the submerged weight that yields by `settlement`, with damping ratio `zeta`, and pushes only.
    """

    settlement: u.Length = Field(default=0.1, gt=0, description="static settlement under the submerged weight")
    zeta: Number = Field(default=0.5, ge=0, description="damping ratio of the payload with its added mass on the soil")
    gap: u.Length | None = Field(
        default=None, gt=0, description="height over which the bottom is felt; area over perimeter of the underside"
    )
    added_mass: Number = Field(default=1.0, ge=0, description="growth of the added mass at touch-down, as part of it")
    drag: Number | None = Field(
        default=None, ge=0, description="growth of the drag at touch-down; from the hatches, else 1"
    )


class LiftOff(Record):
    """What holds the payload to the seabed when it is lifted off again. Recorded for planning; no simulation uses it
    yet."""

    friction: u.Force = Field(default=0.0, ge=0, description="of skirts")
    suction: u.Force = Field(default=0.0, ge=0, description="under base or roof")


class Curve(NamedTuple):
    """Over submergence h [m]: V [m^3], A33 [kg], A_p [m^2]."""

    h: FloatArray
    V: FloatArray
    A33: FloatArray
    A_p: FloatArray


class Payload(Record):
    """A payload in air, water and on the seabed.

    Its numbers over submergence are given as `levels`, which rise from h = 0 to h = height or deeper, or follow from a
    `shape` and its dimensions, which may be given next to the payload's own fields:

        Payload(name="anchor", mass="80 t", shape="suction-anchor", diameter="5 m", height="12 m", wall="30 mm",
        roof="0.3 m", hatch=0.03)
    """

    name: Line
    title: Line = ""
    mass: u.Mass = Field(gt=0, description="mass in air, without hook and rigging")
    height: u.Length = Field(gt=0, description="from the underside to the top")
    C_D: Number = Field(ge=0, description="drag coefficient on A_p")
    C_lin: u.ForcePerSpeed = Field(default=0.0, ge=0, description="linear drag when covered")
    volume: u.Volume | None = Field(
        default=None, gt=0, description="displaced volume of a payload with a shape; mass over that of steel"
    )
    shape: AnyShape | None = None
    levels: tuple[Level, ...] = ()
    seabed: Seabed = Field(default_factory=Seabed)
    lift_off: LiftOff = Field(default_factory=LiftOff)
    source: str = ""
    sources: Mapping[str, Source] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _flat(cls, data: Any) -> Any:
        """Dimensions next to the payload's own fields, or in a table of the shape, become its shape, which gives its
        height and drag coefficient. Levels may be a table of tables."""
        if not isinstance(data, Mapping):
            return data
        if "levels" not in data and "shape" not in data:
            raise ValueError(LEVELS_OR_SHAPE)
        if isinstance(data.get("levels"), Mapping):
            data = {**data, "levels": tuple(data["levels"].values())}
        if isinstance(table := data.get("shape"), Mapping):
            data = {**data, **table, "shape": str(table.get("kind", ""))}
            data.pop("kind", None)
        if not isinstance(data.get("shape"), str):
            return data
        data = with_shape(data, SHAPES, cls)
        shape = data["shape"]
        return {"C_D": shape.default_C_D, **data, "height": f"{shape.tall!r} m"}

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.shape is None) == (not self.levels):
            raise ValueError(LEVELS_OR_SHAPE)
        if self.shape is not None:
            return self._fits(self.shape)
        if self.volume is not None:
            raise ValueError("volume: the levels have it. Remove it.")
        h = [level.h for level in self.levels]
        if h[0] != 0.0 or any(b <= a for a, b in pairwise(h)):
            raise ValueError("levels: h must begin at 0 and rise. Sort them.")
        if h[-1] < self.height * (1.0 - 1e-9):
            raise ValueError(
                f"levels: the last has h = {u.show(h[-1], 'length')}, less than the height"
                f" {u.show(self.height, 'length')}."
            )
        if any(b.V < a.V for a, b in pairwise(self.levels)):
            raise ValueError("levels: V must not fall with h.")
        return self

    def _fits(self, shape: Shape) -> Self:
        if self.displaced > shape.outside:
            V, room = (u.show(x, "volume") for x in (self.displaced, shape.outside))
            limit = "" if self.volume is not None else ", its mass in steel,"
            raise ValueError(
                f"it displaces {V}{limit} and its outside encloses {room}. Check mass, volume and dimensions."
            )
        if self.mass < LIGHTEST * shape.outside < math.inf:
            mass, room = u.show(self.mass, "mass"), f"{shape.outside:.4g} m^3"
            raise ValueError(
                f"it weighs {mass} and its outside encloses {room}: hardly more than air. Check mass and dimensions."
            )
        parts = shape.stated_mass
        if parts > self.mass * (1.0 + 1e-6):
            raise ValueError(
                f"its parts weigh {u.show(parts, 'mass')}, it {u.show(self.mass, 'mass')}. Check the masses and counts."
            )
        return self

    @property
    def displaced(self) -> float:
        """Volume that the covered payload displaces [m^3]."""
        if self.shape is None:
            return self.levels[-1].V
        return self.mass / RHO_STEEL if self.volume is None else self.volume

    def reach(self, rho: float = RHO_SEA) -> float:
        """Submergence beyond which nothing changes any more [m]."""
        return self.levels[-1].h if self.shape is None else self.shape.reach(rho)

    def at(self, h: FloatArray, rho: float = RHO_SEA) -> Curve:
        """Numbers at submergences h [m] in water of density rho. Given levels are joined without overshoot, and hold in
        the water for which they were given."""
        h = np.asarray(h, float)
        if self.shape is None:
            return Curve(h, *(_joined(h, self.levels, field) for field in ("V", "A33", "A_p")))
        return Curve(h, self.displaced * self.shape.share(h), self.shape.added_mass(h, rho), self.shape.area(h))

    def curve(self, rho: float = RHO_SEA, points: int = CURVE) -> Curve:
        """Numbers from the first touch to `reach`, evenly over submergence."""
        return self.at(np.linspace(0.0, self.reach(rho), points), rho)

    def covered(self, rho: float = RHO_SEA) -> Level:
        """Numbers deep under the surface; fields in SI."""
        h, V, A33, A_p = (float(x[0]) for x in self.at(np.array([self.reach(rho)]), rho))
        return Level.model_construct(h=h, V=V, A33=A33, A_p=A_p)

    def drag(self, rho: float = RHO_SEA) -> float:
        """1/2 rho C_D A_p deep under the surface [N s^2/m^2]."""
        return 0.5 * rho * self.C_D * self.covered(rho).A_p

    def _repr_html_(self) -> str:
        """Its numbers, and those that follow from them covered by sea water, for a notebook."""
        under, weight = self.covered(), (self.mass - RHO_SEA * self.displaced) * G
        rows = [
            ("displaced volume", f"{self.displaced:.4g} m^3"),
            ("submerged weight in sea water", u.show(weight, "force", 4)),
            ("added mass in heave", u.show(under.A33, "mass", 4)),
            ("projected area", u.show(under.A_p, "area", 4)),
        ]
        return record_html(self, rows, without=("volume",))

    def to_dict(self) -> dict[str, Any]:
        """Plain SI data that `from_dict` turns into the same payload."""
        return self.model_dump(mode="json")

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Payload:
        """The payload that `to_dict` wrote. Errors: LiftError where it is not one."""
        try:
            raw = dict(data)
            raw["shape"] = None if raw["shape"] is None else rebuilt_shape(raw["shape"])
            raw["levels"] = tuple(Level.model_construct(**level) for level in raw["levels"])
            raw["seabed"] = Seabed.model_construct(**raw["seabed"])
            raw["lift_off"] = LiftOff.model_construct(**raw["lift_off"])
            raw["sources"] = {k: Source(**v) for k, v in raw["sources"].items()}
            return cls.model_construct(**raw)
        except (KeyError, TypeError, ValueError, AttributeError) as problem:
            raise LiftError(f"stored payload: {u.quote(str(problem))} is missing or wrong. Simulate again.") from None


def _joined(h: FloatArray, levels: tuple[Level, ...], field: str) -> FloatArray:
    """One number of given levels at h, joined by cubics that overshoot nowhere (Fritsch and Carlson), held beyond the
    last."""
    from scipy.interpolate import PchipInterpolator

    depths = np.array([level.h for level in levels])
    rows = np.array([getattr(level, field) for level in levels])
    if len(depths) == 1:
        return np.full_like(h, rows[0])
    return np.asarray(PchipInterpolator(depths, rows)(np.clip(h, 0.0, depths[-1])))
