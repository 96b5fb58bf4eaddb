"""Pipes and frames of round members by their dimensions."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.spec.lift.shapes import Body
from stillhook.spec.scenario import Number

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
