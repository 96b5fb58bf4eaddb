"""What hangs on the hook: mass, height, and how water takes hold of it as it goes under."""

from __future__ import annotations

from pydantic import Field

from stillhook import units as u
from stillhook.scenario import Number, Record


class Level(Record):
    """A payload's numbers with its underside `h` under the surface; between levels they are interpolated."""

    h: u.Length = Field(ge=0, description="submergence of the underside")
    V: u.Volume = Field(ge=0, description="displaced volume")
    A33: u.Mass = Field(ge=0, description="added mass in heave")
    A_p: u.Area = Field(ge=0, description="projected area that drag acts on")


class Payload(Record):
    """A payload in air, water and on the seabed. `levels` rise from h = 0 to h = height."""

    name: str
    mass: u.Mass = Field(gt=0, description="mass in air, without hook and rigging")
    height: u.Length = Field(gt=0, description="from the underside to the top")
    C_D: Number = Field(ge=0, description="drag coefficient on A_p")
    levels: tuple[Level, ...] = ()
    source: str = ""
