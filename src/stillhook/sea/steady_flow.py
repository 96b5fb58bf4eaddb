"""Steady flow past a lift: current over depth on wire and payload, wind on a payload in air.

Directions are from the bow, counter-clockwise, as those of waves, or from north, clockwise, as those of metocean
reports; `sense` says whether they are where the flow goes to or where it comes from. Axes of vectors: x forward, y to
port.
"""

from __future__ import annotations

import math
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.tables.table import Number, Spec

RHO_AIR = 1.226
"""Density of air at 15 deg C [kg/m^3]. Source: DNV-RP-C205, not compared with the printed text."""
T_MEAN, H_MEAN = 600.0, 10.0
"""Averaging time [s] and height [m] of the mean wind speed."""
GUST = 0.047
"""Growth of the wind speed, part of the mean at 10 m, per natural logarithm by which it is averaged over less time.
Source: DNV-RP-C205, not compared with the printed text."""


def _several(value: object) -> object:
    """One text as a list of one."""
    return (value,) if isinstance(value, str | int | float) else value


FlowSpeed = Annotated[float, u.Quantity("wind_speed")]
Depths = Annotated[tuple[u.Length, ...], BeforeValidator(_several)]
Speeds = Annotated[tuple[FlowSpeed, ...], BeforeValidator(_several)]
Angles = Annotated[tuple[u.Angle, ...], BeforeValidator(_several)]


class FlowSense(StrEnum):
    """What a direction means."""

    GOING_TO = "going-to"
    COMING_FROM = "coming-from"

    def towards(self, direction: FloatArray) -> FloatArray:
        """Where the flow goes to [rad]."""
        return direction if self is FlowSense.GOING_TO else direction + math.pi


class FlowReference(StrEnum):
    """What a direction is counted from: the bow, counter-clockwise, or north, clockwise."""

    BOW = "bow"
    NORTH = "north"


class Flow(Spec):
    """Speed and direction, one number for all levels or one a level. Between levels the speed is straight and the
    direction turns the shorter way; beyond the ends both stay."""

    speed: Speeds = Field(min_length=1, description="one for all levels or one a level")
    direction: Angles = Field(min_length=1, description="for all levels or one a level")
    sense: FlowSense = Field(description='what direction means: "going-to" or "coming-from"')
    reference: FlowReference = Field(
        default=FlowReference.BOW,
        description='"bow": directions are counter-clockwise from the bow; "north": clockwise from north',
    )
    ship: u.Angle | None = Field(default=None, description="where the bow points, clockwise from north")

    def _check(self, name: str, levels: tuple[float, ...]) -> None:
        n = len(levels)
        for column in ("speed", "direction"):
            if len(given := getattr(self, column)) not in (1, n):
                raise ValueError(f"{column} has {len(given)} values, {name} {n}. Give one, or one a {name}.")
        if (self.ship is None) is (self.reference is FlowReference.NORTH):
            do = 'Give both ship, where the bow points, and reference = "north", or neither.'
            raise ValueError(
                f"ship is {'missing' if self.ship is None else 'given'} of reference {self.reference}. {do}"
            )
        if min(self.speed) < 0.0:
            raise ValueError("speed is negative. Give 0 or more, and turn the direction.")

    def _speed(self, at: FloatArray | float, levels: tuple[float, ...]) -> FloatArray:
        return np.asarray(np.interp(at, levels, np.broadcast_to(self.speed, len(levels))))

    def _to(self, at: FloatArray | float, levels: tuple[float, ...]) -> FloatArray:
        """Where the flow goes to, counter-clockwise from the bow [rad]."""
        turn = np.unwrap(np.broadcast_to(self.direction, len(levels)))
        to = self.sense.towards(np.asarray(np.interp(at, levels, turn)))
        return to if self.ship is None else np.asarray(self.ship - to)

    def _ways(self) -> str:
        ends = " to ".join(u.show(a, "angle", 4) for a in dict.fromkeys((self.direction[0], self.direction[-1])))
        bow = "" if self.ship is None else f" from north, bow at {u.show(self.ship, 'angle', 4)}"
        return f"{self.sense.replace('-', ' ')} {ends}{bow}"


class Current(Flow):
    """The table [environment.current]: a current over depth, and what it acts on."""

    depth: Depths = Field(default=(0.0,), min_length=1, description="below the surface, rising from 0 to the seabed")
    area: u.Area | None = Field(
        default=None, ge=0, description="side of the payload that the current meets; a plan needs it"
    )
    C_D: Number = Field(default=2.0, ge=0, le=5, description="drag coefficient on it (assumed: a bluff body)")
    C_D_wire: Number = Field(default=1.8, ge=0, le=5, description="drag coefficient of the wire across it (assumed)")
    added_mass: u.Mass | None = Field(
        default=None, ge=0, description="of the payload as it moves sideways; default that in heave (assumed)"
    )
    clearance: u.Length | None = Field(
        default=None, gt=0, description="how far wire and payload may be carried away before they meet something"
    )

    @model_validator(mode="after")
    def _profile(self) -> Self:
        self._check("depth", self.depth)
        if self.depth[0] != 0.0 or any(b <= a for a, b in pairwise(self.depth)):
            raise ValueError("depth must begin at 0 m and rise. Sort the profile, and give the surface.")
        return self

    def short_of(self, bottom: float) -> str:
        """What is wrong where the profile ends above the seabed [m], "" where it does not."""
        if len(self.depth) == 1 or self.depth[-1] >= bottom * (1.0 - 1e-9):
            return ""
        end, seabed = u.show(self.depth[-1], "length"), u.show(bottom, "length")
        return f"the profile ends at {end}, the seabed is at {seabed}. Give the speed there."

    def past(self, z: float) -> float:
        """Speed past a body with its middle at z [m], that at the surface where this is above it [m/s]."""
        return float(self._speed(max(-z, 0.0), self.depth))

    def velocity(self, z: FloatArray | float) -> FloatArray:
        """Velocity (..., 2) of the water at heights z [m] (0 the surface); 0 above it [m/s]."""
        h = np.maximum(-np.asarray(z, dtype=np.float64), 0.0)
        to, wet = self._to(h, self.depth), np.where(np.asarray(z) > 0.0, 0.0, self._speed(h, self.depth))
        return np.stack((wet * np.cos(to), wet * np.sin(to)), axis=-1)

    def describe(self) -> str:
        """The current in words and units."""
        speeds = [u.show(v, "wind_speed", 3) for v in dict.fromkeys((self.speed[0], self.speed[-1]))]
        return f"current of {' at the surface to '.join(speeds)}{' at the seabed' * (len(speeds) > 1)}, {self._ways()}"


class Wind(Flow):
    """The table [environment.wind]: means of 10 minutes, at one height with a power law or over height, and what they
    act on."""

    height: Depths = Field(default=(H_MEAN,), min_length=1, description="above the water, rising; default 10 m")
    exponent: Number = Field(default=0.12, ge=0, le=0.5, description="of the profile of a wind at one height; open sea")
    area: u.Area = Field(ge=0, description="side of payload and rigging that the wind meets")
    C_S: Number = Field(default=2.0, ge=0, le=3, description="shape coefficient on it (assumed: flat sides)")
    gust: u.Time = Field(default=3.0, gt=0, le=T_MEAN, description="shortest gust that the load feels")

    def at(self, z: float, T: float = T_MEAN) -> float:
        r"""Wind speed z [m] above the water, averaged over T [s] up to 600 s [m/s].

        .. math:: U = U_{10}\left[(z/10)^\alpha - 0.047 \ln(T/600)\right]

        Source: DNV-RP-C205, power law and its change with averaging time, not compared with the printed text. A wind
        over height has its speeds in place of the power law.
        """
        if len(self.height) == 1:
            mean, profile = self.speed[0], math.pow(max(z, 1.0) / self.height[0], self.exponent)
            gust = math.pow(H_MEAN / self.height[0], self.exponent)
        else:
            mean, profile, gust = 1.0, float(self._speed(z, self.height)), float(self._speed(H_MEAN, self.height))
        return mean * (profile - gust * GUST * math.log(T / T_MEAN))

    @model_validator(mode="after")
    def _profile(self) -> Self:
        self._check("height", self.height)
        if self.height[0] <= 0.0 or any(b <= a for a, b in pairwise(self.height)):
            raise ValueError("height must be above 0 m and rise. Sort the profile.")
        return self

    def force(self, z: float, T: float = T_MEAN) -> FloatArray:
        r"""Force (2,) on what it meets at z [m] with the wind averaged over T [s], 1/2 rho C_S A U^2 [N]."""
        to = self._to(z, self.height)
        F = 0.5 * RHO_AIR * self.C_S * self.area * self.at(z, T) ** 2
        return np.array((F * math.cos(to), F * math.sin(to)))

    def describe(self) -> str:
        """The wind in words and units."""
        at = dict.fromkeys((0, len(self.height) - 1))
        speeds = [f"{u.show(self.speed[i], 'wind_speed', 3)} (10 min, {self.height[i]:g} m)" for i in at]
        return f"wind of {' to '.join(speeds)}, {self._ways()}"
