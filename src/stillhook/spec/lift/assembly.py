"""Bodies put together, and shapes by their names in a flat table of a file."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.errors import LiftError
from stillhook.spec.lift.members import Frame, Spool
from stillhook.spec.lift.shapes import Body, Box, Disc, Plate, Shape, Share, SuctionAnchor
from stillhook.spec.scenario import Record

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

    Its body's fields may stand beside its own: Part(shape="plate", at="1 m", length="3 m", ...).
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

    The displaced volume follows the parts' masses where all are given, else it lies evenly over the height.
    """

    kind: Literal["assembly"] = "assembly"
    parts: tuple[Part, ...] = Field(min_length=1)

    @field_validator("parts", mode="before")
    @classmethod
    def _named(cls, parts: Any) -> Any:
        """Parts may be a table of tables, each under a name of its own."""
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


SHAPES: dict[str, type[Shape]] = {**BODIES, "assembly": Assembly}
AnyShape = Annotated[Plate | Box | Disc | SuctionAnchor | Spool | Frame | Assembly, Field(discriminator="kind")]


def with_shape(data: Mapping[str, Any], shapes: Mapping[str, type[Shape]], owner: type[Record]) -> dict[str, Any]:
    """Flat data with the fields of the shape that `shape` names taken out of it and put into a shape. Errors:
    LiftError, ScenarioError."""
    name = data.get("shape")
    if not isinstance(name, str):
        return dict(data)
    if name not in shapes:
        close = difflib.get_close_matches(name, shapes, n=1)
        hint = f' Did you mean "{close[0]}"?' if close else ""
        raise LiftError(f"{owner.__name__}.shape = {u.quote(name)}: not one of {', '.join(shapes)}.{hint}")
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
    """The shape whose plain SI data this is. Errors: KeyError, TypeError where it is none."""
    raw = dict(data)
    if raw["kind"] == "assembly":
        raw["parts"] = tuple(
            Part.model_construct(**{**part, "shape": rebuilt_shape(part["shape"])}) for part in raw["parts"]
        )
    return SHAPES[raw["kind"]].model_construct(**raw)
