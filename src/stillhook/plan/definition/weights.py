"""Weight of what is lifted: build-up of the static hook load, and the low and the high case that a plan holds for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from pydantic import Field

from stillhook import units as u
from stillhook.errors import PlanError
from stillhook.spec.lift.assembly import Assembly
from stillhook.spec.lift.payload import RHO_STEEL, Payload
from stillhook.spec.lift.rigging import RiggingTable
from stillhook.tables.table import Number, Spec, Text
from stillhook.units import quote, show


class WeightTable(Spec):
    """The table [weight]."""

    net: u.Mass | None = Field(default=None, gt=0, description="net weight in air; default the payload's mass")
    contingency: Number = Field(default=1.0, ge=1.0, le=1.5, description="factor on the net weight in the high case")
    low: Number | None = Field(
        default=None, gt=0.5, le=1.0, description="factor on the net weight in the low case; default 2 - contingency"
    )
    added: u.Mass = Field(default=0.0, ge=0, description="weight in addition in the high case, such as marine growth")
    trapped: u.Volume = Field(default=0.0, ge=0, description="water inside that is lifted out with it, high case")
    volume_low: u.Volume | None = Field(
        default=None, gt=0, description="least displaced volume, high submerged case; default the payload's"
    )
    volume_high: u.Volume | None = Field(
        default=None, gt=0, description="largest displaced volume, low submerged case; default the payload's"
    )
    cog_box: tuple[u.Length, u.Length, u.Length] | None = Field(
        default=None, description="length, width and height of the box that holds the centre of gravity"
    )
    source: Text = Field(default="assumed", description="weight report")


@dataclass(frozen=True)
class Weight:
    """Weight build-up of a plan [kg], volumes [m^3]. payload as its file has it; net, contingency factor, added,
    trapped water and rigging as in `WeightTable` and `RiggingTable`; low: factor of the low case; cog_box: extents (x,
    y, z) [m]; stated: whether the plan has a table [weight]; source of its numbers.

    The high case has contingency, what is added, trapped water and rigging, and the least displaced volume; the low one
    the net weight times `low`, the largest volume and no rigging: a sling hangs by its upper end.
    """

    payload: Payload = field(repr=False)
    net: float
    contingency: float = 1.0
    low: float = 1.0
    added: float = 0.0
    trapped: float = 0.0
    rigging: float = 0.0
    rigging_submerged: float = 0.0
    volumes: tuple[float, float] = (0.0, 0.0)
    rho: float = 1025.0
    cog_box: tuple[float, float, float] | None = None
    stated: bool = True
    source: str = ""

    @property
    def design(self) -> float:
        """Design weight: net times contingency."""
        return self.net * self.contingency

    @property
    def extra(self) -> float:
        """W_add: what is added, and the trapped water."""
        return self.added + self.rho * self.trapped

    @property
    def SHL(self) -> float:
        """Static hook load in air of the high case, SHL = W c + W_r + W_add."""
        return self.design + self.rigging + self.extra

    @property
    def submerged(self) -> tuple[float, float]:
        """Static hook load under water, low and high case; wire and hook are the crane's."""
        high = self.design + self.added - self.rho * self.volumes[0] + self.rigging_submerged
        return self.net * self.low - self.rho * self.volumes[1], high

    @property
    def high_case(self) -> Payload:
        """The payload, and with it the rigging, in the high case."""
        V_rigging = (self.rigging - self.rigging_submerged) / self.rho
        return weighing(self.payload, self.SHL, self.volumes[0] + self.trapped + V_rigging)

    @property
    def low_case(self) -> Payload:
        """The payload in the low case."""
        return weighing(self.payload, self.net * self.low, self.volumes[1])


def weight_of(table: WeightTable | None, rigging: RiggingTable, payload: Payload, rho: float) -> Weight | None:
    """The weight build-up of a plan in water of density rho [kg/m^3]; None where neither [weight] nor a mass of the
    rigging is given. Errors: PlanError, one line."""
    if table is None and rigging.mass == 0.0:
        return None
    t = table or WeightTable()
    V = payload.displaced
    volumes = (t.volume_low or min(V, t.volume_high or V), t.volume_high or max(V, t.volume_low or V))
    if volumes[0] > volumes[1]:
        low, high = (show(v, "volume") for v in volumes)
        raise PlanError(f"weight.volume_low: {low} is more than volume_high {high}. Check both.")
    if payload.shape is not None and volumes[1] + t.trapped > payload.shape.outside:
        came, room = show(volumes[1] + t.trapped, "volume"), show(payload.shape.outside, "volume")
        raise PlanError(
            f"weight: {quote(payload.name)} displaces {came} with the water inside, and its outside encloses {room}."
            " Check volume_high and trapped."
        )
    wet = rigging.mass_submerged
    return Weight(
        payload,
        net=t.net or payload.mass,
        contingency=t.contingency,
        low=t.low or 2.0 - t.contingency,
        added=t.added,
        trapped=t.trapped,
        rigging=rigging.mass,
        rigging_submerged=rigging.mass * (1.0 - rho / RHO_STEEL) if wet is None else wet,
        volumes=volumes,
        rho=rho,
        cog_box=_box(t, rigging),
        stated=table is not None,
        source=t.source,
    )


def _box(table: WeightTable, rigging: RiggingTable) -> tuple[float, float, float] | None:
    """The box of the centre of gravity. Errors: PlanError where it is not inside the base of the lift points."""
    box = table.cog_box
    if box is None:
        return None
    if min(box) < 0.0:
        raise PlanError("weight.cog_box: an extent is below 0. Give length, width and height of the box.")
    for side, at in zip(("x", "y"), (0, 1), strict=True):
        ends = [leg[at] for leg in rigging.ends]
        base = 2.0 * min(max(ends, default=0.0), -min(ends, default=0.0))
        if ends and base > 1e-9 and box[at] >= base:
            came, room = show(box[at], "length"), show(base, "length")
            raise PlanError(f"weight.cog_box: {came} along {side}, and the lift points reach {room}. Check both.")
    return box


def weighing(payload: Payload, mass: float, volume: float) -> Payload:
    """A payload of another mass [kg], parts in proportion, and displaced volume [m^3]; added mass and drag stay."""
    shape, factor = payload.shape, mass / payload.mass
    if shape is None:
        k = volume / payload.displaced
        levels = tuple(level.model_copy(update={"V": k * level.V}) for level in payload.levels)
        return payload.model_copy(update={"mass": mass, "levels": levels})
    if isinstance(shape, Assembly):
        parts = [p.model_copy(update={"mass": None if p.mass is None else factor * p.mass}) for p in shape.parts]
        shape = shape.model_copy(update={"parts": tuple(parts)})
    return payload.model_copy(update={"mass": mass, "volume": volume, "shape": shape})


def weight_facts(weight: Weight) -> dict[str, Any]:
    """The build-up as plain data [kg, m^3, m]."""
    low, high = weight.submerged
    return {
        "net": weight.net,
        "contingency": weight.contingency,
        "design": weight.design,
        "added": weight.added,
        "trapped": weight.rho * weight.trapped,
        "rigging": weight.rigging,
        "rigging_submerged": weight.rigging_submerged,
        "SHL": weight.SHL,
        "low_factor": weight.low,
        "low_air": weight.net * weight.low,
        "submerged_low": low,
        "submerged_high": high,
        "volumes": list(weight.volumes),
        "cog_box": None if weight.cog_box is None else list(weight.cog_box),
        "stated": weight.stated,
        "source": weight.source,
    }
