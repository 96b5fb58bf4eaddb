"""A passive heave compensator between hook and slings, as a data sheet has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.physics.hydraulics.accumulator import polytropic_ratio
from stillhook.spec.scenario import Number, Record
from stillhook.tables.table import Source
from stillhook.units import show

HALVINGS = 60
"""Steps in which a stroke is sought: to the last digit of any."""


class Compensator(Record):
    """A gas spring between hook and slings. Gas of p_0 and V_0 acts on `area` and draws the rod in; the load draws it
    out, from 0 (fully in) to `stroke` (fully out). The other side of the piston is empty.

    p_0 and V_0 are those with the rod fully in. n is the gas's exponent: 1.0 where it moves so slowly that it stays as
    warm as the sea, 1.4 for nitrogen in waves, up to 1.67 where it is dense and cold. The orifice brakes by `orifice`
    times speed squared, seals by `friction`, whole from the speed v_friction on. The sea presses on `rod_area`, which
    is 0 for a unit that is balanced against it. Masses are those of what hangs on the hook (cylinder) and of what moves
    with the slings (rod). Errors: ScenarioError, one line.
    """

    name: str = ""
    title: str = ""
    stroke: u.Length = Field(gt=0, description="way of the rod")
    area: u.Area = Field(gt=0, description="area of the piston that the gas acts on")
    p_0: u.Pressure = Field(gt=0, description="gas pressure with the rod fully in, absolute")
    V_0: u.Volume = Field(gt=0, description="gas volume with the rod fully in, vessels included")
    n: Number = Field(default=1.4, ge=1.0, le=1.67, description="exponent of the gas")
    orifice: u.ForcePerSpeedSquared = Field(default=0.0, ge=0, description="force per square of the rod's speed")
    friction: u.Force = Field(default=0.0, ge=0, description="friction of the seals")
    v_friction: u.Speed = Field(default=0.01, gt=0, description="speed from which on the seals rub with all of it")
    rod_area: u.Area = Field(default=0.0, ge=0, description="area of the rod that the sea presses in")
    length: u.Length = Field(ge=0, description="from the hook to the slings with the rod fully in")
    mass_cylinder: u.Mass = Field(ge=0, description="what hangs on the hook")
    mass_rod: u.Mass = Field(default=0.0, ge=0, description="what moves with the slings")
    source: str = ""
    sources: Mapping[str, Source] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _gas_is_left(self) -> Self:
        swept = self.area * self.stroke
        if swept >= self.V_0:
            raise ValueError(
                f"V_0 = {show(self.V_0, 'volume')}: the piston sweeps {show(swept, 'volume')} (area times stroke), and"
                " no gas would be left. Give the volume with the rod fully in, vessels included."
            )
        return self

    @property
    def mass(self) -> float:
        """Mass of the whole unit [kg]."""
        return self.mass_cylinder + self.mass_rod

    def pressure(self, s: float) -> float:
        """Gas pressure at a stroke s [m], absolute [Pa]."""
        return self.p_0 * float(polytropic_ratio(1.0 - self.area * s / self.V_0, self.n))

    def force(self, s: float) -> float:
        """Force of the gas at a stroke s [m] [N]."""
        return self.area * self.pressure(s)

    def stiffness(self, s: float) -> float:
        r"""Stiffness of the gas at a stroke s [m], :math:`n p A^2 / V` [N/m]."""
        return self.n * self.pressure(s) * self.area**2 / (self.V_0 - self.area * s)

    def static_stroke(self, F: float) -> float:
        """Stroke at which the gas carries F [N], from 0 to `stroke` [m]; F less the sea's push on the rod where there
        is one."""
        lo, hi = 0.0, self.stroke
        if self.force(lo) >= F:
            return lo
        if self.force(hi) <= F:
            return hi
        ratio = float((self.area * self.p_0 / F) ** (1.0 / self.n))
        return min(max((1.0 - ratio) * self.V_0 / self.area, lo), hi)

    def hanging_stroke(self, F: float, z: float, weight: float) -> float:
        """Stroke with F [N] on the rod [m]; z height of the cylinder's lower end above still water with the rod fully
        in [m], weight that of a cubic metre of water [N/m^3]. The further the rod is out, the less deep is the
        cylinder."""
        lo, hi = 0.0, self.stroke
        for _ in range(HALVINGS):
            s = 0.5 * (lo + hi)
            if self.force(s) + weight * self.rod_area * max(-(z + s), 0.0) < F:
                lo = s
            else:
                hi = s
        return 0.5 * (lo + hi)
