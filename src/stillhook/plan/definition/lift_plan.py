"""A lift as it is planned: crane, vessel, payload and phases, the seas it is asked for, and the rules it is judged by.
Frozen.

Whether what a plan names can hang at its crane at all: heights under the tip, reach, weight in water and wire.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.engine.lowering.checks import check_lift
from stillhook.errors import LiftError, PlanError, SeaError, UnitError
from stillhook.plan.definition.phases import CLOSE, Phase, called
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative, RuleSet, Seas
from stillhook.plan.definition.sea_table import expanded, ordered
from stillhook.sea.spectra.parametric import Jonswap, pierson_moskowitz
from stillhook.sea.spectra.spectrum import Sea, Train, WaveSpectrum
from stillhook.sea.spectra.two_peaked import Torsethaugen
from stillhook.sea.vessel.boom import Boom
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.tip import TipPoint, parse_point
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import DeepWire, Lowering, Rigging, Stage, StageMode, WinchSettings
from stillhook.spec.lift.payload import Payload
from stillhook.spec.scenario import Number, Record, Sensors
from stillhook.units import quote, show


class Environment(Record):
    """Seas that limits are asked for. gamma None: by the rule of T_p/sqrt(H_s); spread exponent of cos^n, None for
    long-crested waves.

    Headings are directions of travel from the bow (0 following, 90 coming from starboard, 180 head sea). Limits hold
    for waves within heading_tolerance of each; a table's cell is the worst within it.
    """

    wave: Literal["jonswap", "pm", "torsethaugen"] = "jonswap"
    Hs: tuple[u.Length, ...]
    Tp: tuple[u.Time, ...]
    headings: tuple[u.Angle, ...]
    gamma: Number | None = Field(default=None, ge=1.0, le=7.0)
    spread: Number | None = Field(default=None, ge=1.0, le=200.0)
    heading_tolerance: u.Angle = Field(default=math.radians(15.0), ge=0.0, le=math.pi / 2.0)

    @field_validator("Hs", "Tp", "headings", mode="before")
    @classmethod
    def _from_range(cls, value: object, info: ValidationInfo) -> object:
        return expanded(value, str(info.field_name))

    @field_validator("Hs", "Tp", "headings")
    @classmethod
    def _in_order(cls, values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        return ordered(values, str(info.field_name))

    def spectrum(self, Hs: float, Tp: float) -> WaveSpectrum:
        """Spectrum of a height [m] and a peak period [s]."""
        if self.wave == "pm":
            return pierson_moskowitz(Hs, Tp)
        return Torsethaugen(Hs, Tp) if self.wave == "torsethaugen" else Jonswap(Hs, Tp, self.gamma)

    def sea(self, Hs: float, Tp: float, beta: float) -> Sea:
        """The sea of a cell; beta direction of travel from the bow [rad]."""
        return Sea((Train(self.spectrum(Hs, Tp), beta, self.spread),))

    def table(self) -> Seas:
        """Every cell: heading by heading, period by period, rising height."""
        beta, Tp, Hs = np.meshgrid(np.array(self.headings), np.array(self.Tp), np.array(self.Hs), indexing="ij")
        return Seas(Hs.ravel(), Tp.ravel(), beta.ravel())


@dataclass(frozen=True)
class WeatherUse:
    """Weather that waiting is reckoned on. file: a name of the library or a path; ship: where the bow points, clockwise
    from north [rad], or None where it is free to turn, and keeps the best heading; sense: what the file's directions
    mean, None where the file says so; columns, time, date_order: how the file is to be read where it does not say
    (`stillhook.formats.weather.file.read_weather`).
    """

    file: str
    ship: float | None = None
    sense: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    time: str | None = None
    date_order: str | None = None


@dataclass(frozen=True, eq=False)
class LiftPlan:
    """Everything a plan follows from.

    at: crane tip from the vessel's reference point, h_tip its height above still water [m]; depth of the water [m];
    T_POP planned time of the operation [s] (T_POP_given: not the sum of the phases), T_C
    contingency (None: not assessed, T_R is then twice T_POP); alternatives side by side; digest of every input.
    """

    name: str
    crane: Crane
    vessel: Rao = field(repr=False)
    at: TipPoint
    h_tip: float
    payload: Payload = field(repr=False)
    depth: float
    rho: float
    phases: tuple[Phase, ...]
    environment: Environment
    rules: RuleSet = field(repr=False)
    T_POP: float
    T_C: float | None = None
    T_POP_given: bool = True
    rigging: Rigging = field(default_factory=Rigging)
    wire: DeepWire = field(default_factory=DeepWire)
    winch: WinchSettings = field(default_factory=WinchSettings)
    sensors: Sensors = field(default_factory=Sensors)
    alternatives: tuple[Alternative, ...] = ALTERNATIVES
    weather: WeatherUse | None = None
    source: str = ""
    digest: str = ""
    notes: tuple[str, ...] = ()

    def phase(self, name: str) -> Phase:
        """The phase of this name."""
        return next(p for p in self.phases if p.name == name)

    def tip_of(self, phase: Phase) -> TipPoint:
        """Crane tip in a phase, with its height: the phase's own, else that of the plan."""
        at = self.at if phase.tip is None else parse_point(phase.tip, "tip")
        return TipPoint(at.x, at.y, self.h_tip if at.z is None else at.z)

    def hanging(self, z: float, h_tip: float | None = None) -> Lowering:
        """The payload hanging still with its underside at z [m]: for what looks at weights and stiffness, not a run;
        h_tip [m] of the plan unless given."""
        stand = (Stage(mode=StageMode.MANUAL, time="60 s"),)
        lengths = {"h_tip": self.h_tip if h_tip is None else h_tip, "depth": self.depth, "z_0": z}
        fields: dict[str, Any] = {key: f"{value!r} m" for key, value in lengths.items()}
        fields |= {
            "name": self.name,
            "payload": self.payload,
            "rigging": self.rigging,
            "wire": self.wire,
            "winch": self.winch,
        }
        fields |= {"programme": stand, "duration": "60 s", "rho": f"{self.rho!r} kg/m^3", "sensors": self.sensors}
        return Lowering(**fields)


SINKS = 0.01
"""Share of its weight that a payload must keep under water."""


def check_sinks(payload: Payload, rho: float) -> None:
    """Refuse a payload that floats, or does but for `SINKS` of its weight: no wire would be held taut."""
    displaced = rho * payload.displaced
    if displaced > (1.0 - SINKS) * payload.mass:
        volume, water, mass = show(payload.displaced, "volume"), show(displaced, "mass"), show(payload.mass, "mass")
        reason = f"it weighs {mass} and its {volume} displace {water} of water"
        raise PlanError(f"payload {quote(payload.name)}: it floats, or nearly: {reason}. Check mass and volume.")


def check_tips(plan: LiftPlan, boom: Boom | None) -> None:
    """The crane reaches every place that a phase names, and what hangs fits under it."""
    room = plan.payload.height + plan.rigging.height
    for phase in plan.phases:
        try:
            at = plan.tip_of(phase)
            if phase.tip is not None and boom is not None:
                boom.reaching(at.x, at.y, at.z)
        except (SeaError, UnitError) as e:
            raise PlanError(f"{called(phase)}: {e}") from None
        assert at.z is not None
        highest = max(z for z in (phase.start, phase.end) if z is not None)
        free = at.z - room - highest
        if free <= 0.0:
            raise PlanError(
                f"{called(phase)}: underside at {show(highest, 'length')}, payload and rigging {show(room, 'length')}"
                f" high: they cannot hang under the crane tip at {show(at.z, 'length')}. Raise the tip, or lower the"
                " heights."
            )


def check_wire(plan: LiftPlan) -> None:
    """The crane may carry the payload, and has wire for the deepest phase."""
    deepest = min(plan.phases, key=lambda phase: min(phase.start or 0.0, phase.end or 0.0))
    z = max(min(deepest.start or 0.0, deepest.end or 0.0), -plan.depth + CLOSE)
    try:
        check_lift(plan.crane, plan.hanging(z))
    except LiftError as e:
        raise PlanError(f"{called(deepest)}: {str(e).replace('z_0 = ', 'underside at ')}") from None
