"""Bodies put together, and shapes by their names in a flat table of a file.

Pipes and frames of round members by their dimensions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.errors import LiftError
from stillhook.spec.lift.shapes import Body, Box, Disc, Plate, Shape, Share, SuctionAnchor
from stillhook.spec.scenario import Number, Record

C_S_ROUND = 3.0
"""Slamming coefficient of smooth round cylinders, at the least (DNV-RP-N103; check against your edition)."""


class Round(Body):
    """Round horizontal members, flooded, over one or more layers."""

    default_C_D: ClassVar[float] = 1.2
    C_s: Number = Field(
        default=C_S_ROUND, gt=0, description="slamming coefficient, 2 / (rho A_s) dA33/dh at the first touch"
    )
    diameter: u.Length = Field(gt=0, description="outer diameter with coating")
    length: u.Length = Field(gt=0, description="length of all horizontal members together")
    height: u.Length | None = Field(
        default=None, gt=0, description="from the lowest underside to the highest top; else the diameter"
    )

    @property
    def tall(self) -> float:
        return max(self.height or 0.0, self.diameter)

    @property
    def solid_area(self) -> float:
        return self.diameter * self.length

    @property
    def mouth(self) -> float:
        return self.diameter / 2.0

    def outer_mass(self, rho: float) -> float:
        """That of a circular cylinder in two-dimensional flow, as much water as its outside encloses."""
        return rho * math.pi / 4.0 * self.diameter**2 * self.length

    def _layers(self, h: FloatArray) -> FloatArray:
        """Part of the members that the surface has reached [-]: they lie evenly over the height."""
        spread = self.tall - self.diameter
        return np.where(h > 0.0, np.clip(h / spread, 0.0, 1.0) if spread > 0.0 else 1.0, 0.0)

    def area(self, h: FloatArray) -> FloatArray:
        return np.asarray(self.solid_area * self._layers(h))

    def added_mass(self, h: FloatArray, rho: float) -> FloatArray:
        """The rise of one member, averaged over members that lie evenly over the height."""
        spread, rise = self.tall - self.diameter, self.rise(rho)
        if spread <= 0.0:
            return super().added_mass(h, rho)
        top, low = (np.clip(x / rise, 0.0, None) for x in (h, h - spread))
        return np.asarray(self.outer_mass(rho) * rise / spread * (_risen(top) - _risen(low)))

    def reach(self, rho: float) -> float:
        return max(self.tall, self.rise(rho) + self.tall - self.diameter)

    def levels_of_faces(self, rho: float) -> tuple[float, ...]:
        """The lowest member and the highest, each from the touch until its added mass is whole."""
        spread, rise = self.tall - self.diameter, self.rise(rho)
        return 0.0, rise, spread, spread + rise, self.tall


def _risen(x: FloatArray) -> FloatArray:
    """Integral of 1 - (1 - x)^3 from 0, held at 1 beyond x = 1 [-]."""
    inside = np.minimum(x, 1.0)
    return np.asarray(x - 0.25 * (1.0 - (1.0 - inside) ** 4))


class Spool(Round):
    """A horizontal pipe, flooded: straight or bent, its legs far apart."""

    kind: Literal["spool"] = "spool"


class Frame(Round):
    """An open frame of round members that are far apart (three diameters or more): template, protection structure,
    manifold frame."""

    kind: Literal["frame"] = "frame"


BODIES: dict[str, type[Body]] = {
    "plate": Plate,
    "box": Box,
    "disc": Disc,
    "suction-anchor": SuctionAnchor,
    "spool": Spool,
    "frame": Frame,
}


class Part(Record):
    """A part of an assembly: `count` bodies with their undersides `at` above that of the whole, `mass` of each [kg].

    Its body's fields may be given next to its own: Part(shape="plate", at="1 m", length="3 m", ...).
    """

    at: u.Length = Field(default=0.0, ge=0)
    count: Annotated[int, Field(strict=True, ge=1, le=100)] = 1
    mass: u.Mass | None = Field(default=None, gt=0)
    shape: Annotated[Plate | Box | Disc | SuctionAnchor | Spool | Frame, Field(discriminator="kind")]

    @model_validator(mode="before")
    @classmethod
    def _flat(cls, data: Any) -> Any:
        return with_shape(data, BODIES, cls) if isinstance(data, Mapping) else data


class Assembly(Shape):
    """Bodies side by side or above each other; what one does to the water around another is left out.

    The displaced volume follows the parts' masses where all are given, else it is spread evenly over the height.
    """

    kind: Literal["assembly"] = "assembly"
    parts: tuple[Part, ...] = Field(min_length=1)

    @field_validator("parts", mode="before")
    @classmethod
    def _named(cls, parts: Any) -> Any:
        """Parts may be a table of tables, each under its own name."""
        return tuple(parts.values()) if isinstance(parts, Mapping) else parts

    @property
    def tall(self) -> float:
        return max(p.at + p.shape.tall for p in self.parts)

    @property
    def stated_mass(self) -> float:
        return sum(p.count * p.mass for p in self.parts if p.mass is not None)

    @property
    def vent_gap(self) -> float:
        return max(p.shape.vent_gap for p in self._lowest)

    @property
    def contact(self) -> float:
        return min(p.at + p.shape.contact for p in self.parts)

    @property
    def solid_area(self) -> float:
        return sum(p.count * p.shape.solid_area for p in self.parts)

    @property
    def mouth(self) -> float:
        return max(p.shape.mouth for p in self._lowest)

    @property
    def _lowest(self) -> list[Part]:
        low = min(p.at for p in self.parts)
        return [p for p in self.parts if p.at == low]

    def share(self, h: FloatArray) -> FloatArray:
        masses = [p.count * p.mass for p in self.parts if p.mass is not None]
        if len(masses) < len(self.parts):
            return super().share(h)
        return np.asarray(
            sum(m * p.shape.share(h - p.at) for m, p in zip(masses, self.parts, strict=True)) / sum(masses)
        )

    def area(self, h: FloatArray) -> FloatArray:
        return np.asarray(sum(p.count * p.shape.area(h - p.at) for p in self.parts))

    def added_mass(self, h: FloatArray, rho: float) -> FloatArray:
        return np.asarray(sum(p.count * p.shape.added_mass(h - p.at, rho) for p in self.parts))

    def reach(self, rho: float) -> float:
        return max(p.at + p.shape.reach(rho) for p in self.parts)

    @property
    def shares(self) -> tuple[Share, ...]:
        return tuple(Share(p.at, p.count, p.shape) for p in self.parts)

    def vent_drag(self, rho: float) -> float:
        return sum(p.count * p.shape.vent_drag(rho) for p in self._lowest)


class Scaled(Assembly):
    """Bodies with so many times their added mass, at every submergence: for what a limit says to it. No file has it:
    `SHAPES` does not name it."""

    kind: Literal["scaled"] = "scaled"  # type: ignore[assignment]
    factor: Number = Field(gt=0)

    def added_mass(self, h: FloatArray, rho: float) -> FloatArray:
        return np.asarray(self.factor * super().added_mass(h, rho))

    @property
    def shares(self) -> tuple[Share, ...]:
        """So many times the bodies, for centres: those of drag do not depend on it."""
        return tuple(each._replace(n=self.factor * each.n) for each in super().shares)


SHAPES: dict[str, type[Shape]] = {**BODIES, "assembly": Assembly}
AnyShape = Annotated[
    Plate | Box | Disc | SuctionAnchor | Spool | Frame | Assembly | Scaled, Field(discriminator="kind")
]


def with_shape(data: Mapping[str, Any], shapes: Mapping[str, type[Shape]], owner: type[Record]) -> dict[str, Any]:
    """Flat data with the fields of the shape that `shape` names taken out of it and put into a shape. Errors:
    LiftError, ScenarioError."""
    name = data.get("shape")
    if not isinstance(name, str):
        return dict(data)
    if name not in shapes:
        raise LiftError(
            f"{owner.__name__}.shape = {u.quote(name)}: not one of {', '.join(shapes)}{nearest(name, shapes)}"
        )
    cls = shapes[name]
    fields = {key for key in cls.model_fields if key != "kind"}
    stranger = next((key for key in data if key not in fields and key not in owner.model_fields), None)
    if stranger is not None:
        raise LiftError(
            f'{owner.__name__}.{stranger}: unknown field for shape "{name}". Allowed:'
            f" {', '.join([*owner.model_fields, *sorted(fields)])}."
        )
    return {
        **{k: v for k, v in data.items() if k not in fields},
        "shape": cls(**{k: v for k, v in data.items() if k in fields}),
    }


def rebuilt_shape(data: Mapping[str, Any]) -> Shape:
    """The shape whose plain SI data this is. Errors: KeyError, TypeError where it is not one."""
    raw = dict(data)
    if "parts" in raw:
        raw["parts"] = tuple(
            Part.model_construct(**{**part, "shape": rebuilt_shape(part["shape"])}) for part in raw["parts"]
        )
    return (Scaled if raw["kind"] == "scaled" else SHAPES[raw["kind"]]).model_construct(**raw)
