"""A lift as it is planned: crane, vessel, payload and phases, the seas to analyse, and the rules to meet.
Frozen.

Whether what a plan names can hang at its crane at all: heights under the tip, reach, weight in water and wire.

Ranges of heights, periods and headings as a plan file writes them: a list, or "0.5 m to 6 m by 0.5 m".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import wraps
from itertools import pairwise
from typing import Any, Concatenate, Literal, ParamSpec, TypeVar

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.analysis.controllers import Controller, controller, strong_ssc
from stillhook.base.arrays import FloatArray
from stillhook.engine.lowering.checks import check_lift
from stillhook.errors import LiftError, PlanError, SeaError, UnitError
from stillhook.plan.definition.load_chart import CapacityStatement, CraneChart
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative, RuleSet, Seas
from stillhook.plan.definition.weights import Weight
from stillhook.sea.spectra.parametric import Jonswap, Torsethaugen, pierson_moskowitz
from stillhook.sea.spectra.spectrum import Sea, Train, WaveSpectrum
from stillhook.sea.steady_flow import Current, Wind
from stillhook.sea.vessel.boom import Boom, TipPoint, parse_point
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.relative import RelativeMotion
from stillhook.spec.crane import Crane
from stillhook.spec.lift.joining import CLOSE
from stillhook.spec.lift.lowering import DeepWire, Lowering, Rigging, WinchSettings
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase, WinchMode, called
from stillhook.spec.lift.rigging import RiggingTable
from stillhook.spec.scenario import Mode, Number, Record, Sensors
from stillhook.tables.html import table
from stillhook.tables.range_text import values_of, with_point
from stillhook.tables.table import Spec
from stillhook.units import quote, show
from stillhook.winches.load_path.interface import JointUnit

P = ParamSpec("P")
Value = TypeVar("Value")
KIND = {"Hs": "length", "Tp": "time", "headings": "angle"}
LOWEST = {"Hs": 0.05, "Tp": 2.0, "headings": 0.0}
HIGHEST = {"Hs": 20.0, "Tp": 30.0, "headings": 2.0 * math.pi}
"""What seas of a table may be: below there is nothing to plan, above no lift."""
MOST = 60
"""Values that a range may have: a step of a wrong unit gives thousands."""
LIKE = {
    "Hs": '"0.5 m to 6 m by 0.5 m", or ["1 m", "2 m"]',
    "Tp": '"5 s to 14 s by 1 s", or ["6 s", "8 s"]',
    "headings": '["150 deg", "180 deg"], or "0 deg to 330 deg by 30 deg"',
}


def expanded(value: object, key: str) -> object:
    """The texts of a range such as "1 m to 6 m by 0.5 m" or of a list (`stillhook.tables.range_text`). Errors:
    ValueError."""
    kind = KIND[key]
    if isinstance(value, list | tuple) and value:
        return tuple(with_point(text) for text in value)
    if not isinstance(value, str):
        raise ValueError(f"give {LIKE[key]}.")
    return values_of(value, kind, MOST)


def ordered(values: tuple[float, ...], key: str) -> tuple[float, ...]:
    """Values of a range or list [SI], rising (headings in the order of the file), none twice. Errors: ValueError."""
    kind = KIND[key]
    if len(values) > MOST:
        raise ValueError(f"{len(values)} values, and {MOST} are the most. Take larger steps.")
    for value in values:
        if not LOWEST[key] <= value <= HIGHEST[key] + 1e-9:
            low, high = show(LOWEST[key], kind), show(HIGHEST[key], kind)
            raise ValueError(f"{show(value, kind)} is not between {low} and {high}.")
    in_order = tuple(v % (2.0 * math.pi) for v in values) if key == "headings" else tuple(sorted(values))
    if any(math.isclose(a, b, abs_tol=1e-9) for a, b in pairwise(sorted(in_order))):
        raise ValueError("a value is given twice. Write it once.")
    return in_order


class Swell(Spec):
    """A swell with the wind sea of a table, the same in every cell: JONSWAP of Hs [m] and Tp [s] that travels to
    heading from the bow [rad]; gamma None: by the rule of T_p/sqrt(H_s); spread as of the wind sea, None for
    long-crested waves.

    In weather it stands for swells up to its height whose period is within Tp_tolerance and whose direction within
    heading_tolerance of its own.
    """

    Hs: u.Length = Field(gt=0.0, le=HIGHEST["Hs"])
    Tp: u.Time = Field(ge=LOWEST["Tp"], le=HIGHEST["Tp"])
    heading: u.Angle
    gamma: Number | None = Field(default=None, ge=1.0, le=7.0)
    spread: Number | None = Field(default=None, ge=1.0, le=200.0)
    heading_tolerance: u.Angle = Field(default=math.radians(15.0), ge=0.0, le=math.pi)
    Tp_tolerance: u.Time = Field(default=2.0, ge=0.0, le=HIGHEST["Tp"])

    @field_validator("heading")
    @classmethod
    def _round(cls, heading: float) -> float:
        return heading % (2.0 * math.pi)

    @property
    def train(self) -> Train:
        """Its waves."""
        return Train(Jonswap(self.Hs, self.Tp, self.gamma), self.heading, self.spread)

    def facts(self) -> dict[str, Any]:
        """By name [SI], and in words."""
        return self.model_dump() | {"text": self.describe()}

    def describe(self) -> str:
        """The swell in words and units."""
        Hs, Tp = show(self.Hs, "length", 3), show(self.Tp, "time", 3)
        spread = "" if self.spread is None else f", cos^{self.spread:g} spread"
        return f"swell of Hs {Hs}, Tp {Tp}, travelling {show(self.heading, 'angle', 4)} from the bow{spread}"


class Environment(Record):
    """Seas to analyse. gamma None: by the rule of T_p/sqrt(H_s); spread exponent of cos^n, None for
    long-crested waves.

    Headings are directions of travel from the bow (0 following, 90 coming from starboard, 180 head sea). Limits hold
    for waves within heading_tolerance of each; a table's cell is the worst within it. swell: a second system besides
    the wind sea whose height the table limits. current and wind: steady, the same in every cell.
    """

    wave: Literal["jonswap", "pm", "torsethaugen"] = "jonswap"
    Hs: tuple[u.Length, ...]
    Tp: tuple[u.Time, ...]
    headings: tuple[u.Angle, ...]
    gamma: Number | None = Field(default=None, ge=1.0, le=7.0)
    spread: Number | None = Field(default=None, ge=1.0, le=200.0)
    heading_tolerance: u.Angle = Field(default=math.radians(15.0), ge=0.0, le=math.pi / 2.0)
    swell: Swell | None = None
    current: Current | None = None
    wind: Wind | None = None

    @field_validator("Hs", "Tp", "headings", mode="before")
    @classmethod
    def _from_range(cls, value: object, info: ValidationInfo) -> object:
        return expanded(value, str(info.field_name))

    @field_validator("Hs", "Tp", "headings")
    @classmethod
    def _in_order(cls, values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        return ordered(values, str(info.field_name))

    @field_validator("current")
    @classmethod
    def _meets(cls, current: Current | None) -> Current | None:
        if current is not None and current.area is None:
            raise ValueError('area: missing, the side of the payload that it meets. Write area = "40 m^2".')
        return current

    def inputs(self) -> dict[str, Any]:
        """What results follow from, as plain data."""
        without = {name for name in ("swell", "current", "wind") if getattr(self, name) is None}
        return self.model_dump(mode="json", exclude=without)

    def spectrum(self, Hs: float, Tp: float) -> WaveSpectrum:
        """Spectrum of a height [m] and a peak period [s]."""
        if self.wave == "pm":
            return pierson_moskowitz(Hs, Tp)
        return Torsethaugen(Hs, Tp) if self.wave == "torsethaugen" else Jonswap(Hs, Tp, self.gamma)

    def sea(self, Hs: float, Tp: float, beta: float) -> Sea:
        """The sea of a cell, swell included; beta direction of travel from the bow [rad]."""
        swell = () if self.swell is None else (self.swell.train,)
        if swell and Hs <= 0.0:
            return Sea(swell)
        return Sea((Train(self.spectrum(Hs, Tp), beta, self.spread), *swell))

    def calm(self, Hs: float) -> bool:
        """Whether a sea of this height [m] is still water."""
        return Hs <= 0.0 and self.swell is None

    @property
    def heights(self) -> tuple[float, ...]:
        """Heights of the table [m], rising, from the swell alone (0) where there is one."""
        return self.Hs if self.swell is None else (0.0, *self.Hs)

    def H_m0(self, Hs: FloatArray) -> FloatArray:
        """Height (n,) [m] of wind seas of Hs (n,) and the swell together."""
        return np.hypot(Hs, 0.0 if self.swell is None else self.swell.Hs)

    def table(self) -> Seas:
        """Every cell by heading, period and rising height; from the swell alone (Hs 0) where there is one."""
        axes = (np.array(self.headings), np.array(self.Tp), np.array(self.heights))
        beta, Tp, Hs = np.meshgrid(*axes, indexing="ij")
        return Seas(Hs.ravel(), Tp.ravel(), beta.ravel())


@dataclass(frozen=True)
class WeatherUse:
    """Weather that waiting is calculated with. file: a name of the library or a path; ship: where the bow points,
    clockwise from north [rad], or None where it is free to turn, and keeps the best heading; sense: what the file's
    directions mean, None where the file says so; columns, time, date_order, time_zone: how the file is to be read where
    it does not say (`stillhook.formats.weather.file.read_weather`); source, bias: what the user says of it.
    """

    file: str
    ship: float | None = None
    sense: str | None = None
    columns: Mapping[str, Any] = field(default_factory=dict)
    time: str | None = None
    date_order: str | None = None
    time_zone: str | None = None
    source: str = ""
    bias: str = ""


@dataclass(frozen=True, eq=False)
class LiftPlan:
    """Everything a plan follows from.

    at: crane tip from the vessel's reference point, h_tip its height above still water [m]; depth of the water [m];
    T_POP planned time of the operation from the issue of the forecast [s] (T_POP_given: not the sum of the phases),
    lead of it before the start [s], parts that an operation which can be halted has, T_C contingency (None: not
    assessed, T_R is then twice T_POP); forecast_factors: table of alpha, name or file; alternatives side by side,
    controllers of those whose settings are not the crane's; credits_synthetic: whether the crane's certificate is one
    that the plan assumes, to show what a validation is worth;
    against: the tip's motion against the vessel that the payload is on (None: not known);
    unit: motion unit whose heave filter takes from what the PLC is given (None: no filter);
    load_chart in place of the crane's one SWL; statement of a dynamic factor of the crane's capacity; gear: legs and
    items of the rigging; weight build-up, whose high case `payload` is, None where none is given; high: of the low case
    the plan of the high one (`low`); compensator that hangs in the alternative phc, linked: whether it hangs (`under`);
    document: number, revision and names for the head of its report; digest of every input.
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
    lead: float = 0.0
    parts: int = 1
    forecast_factors: str | None = None
    rigging: Rigging = field(default_factory=Rigging)
    gear: RiggingTable = field(default_factory=RiggingTable)
    weight: Weight | None = None
    high: LiftPlan | None = field(default=None, repr=False)
    statement: CapacityStatement | None = None
    wire: DeepWire = field(default_factory=DeepWire)
    winch: WinchSettings = field(default_factory=WinchSettings)
    sensors: Sensors = field(default_factory=Sensors)
    alternatives: tuple[Alternative, ...] = ALTERNATIVES
    controllers: Mapping[Alternative, Controller] = field(default_factory=dict)
    weather: WeatherUse | None = None
    load_chart: CraneChart | None = None
    against: RelativeMotion | None = field(default=None, repr=False)
    unit: MotionUnit | None = None
    compensator: JointUnit | None = None
    linked: bool = False
    credits_synthetic: bool = False
    not_claimed: tuple[Phase, ...] = ()
    reconciled: Mapping[tuple[str, str], str] = field(default_factory=dict)
    document: Mapping[str, str] = field(default_factory=dict)
    source: str = ""
    digest: str = ""
    notes: tuple[str, ...] = ()
    memo: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def _repr_html_(self) -> str:
        """What is lifted, where and how long, for a notebook."""
        env = self.environment
        rows = [
            ("crane", self.crane.name),
            ("vessel", self.vessel.name),
            ("payload", f"{self.payload.name}, {show(self.payload.mass, 'mass')}"),
            ("water depth", show(self.depth, "length")),
            ("phases", ", ".join(phase.name for phase in self.phases)),
            ("planned operation period T_POP", f"{self.T_POP / 3600.0:.4g} h"),
            ("contingency T_C", "not assessed" if self.T_C is None else f"{self.T_C / 3600.0:.4g} h"),
            ("sea states", f"Hs {min(env.Hs):g} to {max(env.Hs):g} m, Tp {min(env.Tp):g} to {max(env.Tp):g} s"),
            ("alternatives", ", ".join(self.alternatives)),
            ("rules", f"{self.rules.name} version {self.rules.version}"),
            ("weather", "none" if self.weather is None else self.weather.file),
        ]
        return table(rows, title=f'Lift plan "{self.name}"')

    def once(self, function: Callable[Concatenate[LiftPlan, P], Value], *arguments: P.args, **none: P.kwargs) -> Value:
        """What a function says of this plan and further arguments, calculated once as long as the plan lives."""
        key = (function, *arguments)
        if key not in self.memo:
            self.memo[key] = function(self, *arguments, **none)
        value: Value = self.memo[key]
        return value

    def under(self, alternative: Alternative) -> LiftPlan:
        """The plan as an alternative hangs: with the compensator in the load path under phc, as it is otherwise."""
        linked = alternative is Alternative.PHC and self.compensator is not None
        return self if linked is self.linked else self.once(_with_link, linked)

    def machine(self, alternative: Alternative) -> tuple[Crane, Mode]:
        """The crane as an alternative's controller sets it, and that controller's motor law; the plan's `controllers`
        come first. Strong SSC compensates the delay of the motion signal."""
        return self.once(_machine, alternative)

    @property
    def low(self) -> LiftPlan | None:
        """The plan with the low weight case on the hook; None without a weight build-up, and of that plan itself."""
        return None if self.weight is None or self.high is not None else self.once(_with_low_weight)

    @property
    def of_high(self) -> LiftPlan:
        """The plan of the high weight case: of both cases the one that remembers what weight does not change, and whose
        weight loads are compared with."""
        return self if self.high is None else self.high.under(Alternative.PHC if self.linked else Alternative.NONE)

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
        stand = (Phase(mode=WinchMode.MANUAL, time="60 s"),)
        lengths = {"h_tip": self.h_tip if h_tip is None else h_tip, "depth": self.depth, "start_depth": 0.0 - z}
        fields: dict[str, Any] = {key: f"{value!r} m" for key, value in lengths.items()}
        fields |= {key: getattr(self, key) for key in ("name", "payload", "rigging", "wire", "winch", "sensors")}
        fields |= {"programme": stand, "duration": "60 s", "rho": f"{self.rho!r} kg/m^3"}
        flow = {"compensator": self.compensator if self.linked else None, "current": self.environment.current}
        return Lowering(**fields, **flow, controller=self.crane.plant.type.default_mode)


def remembered(function: Callable[Concatenate[LiftPlan, P], Value]) -> Callable[Concatenate[LiftPlan, P], Value]:
    """A function of a plan that is calculated once as long as the plan lives, for the same further arguments."""

    @wraps(function)
    def known(plan: LiftPlan, /, *arguments: P.args, **none: P.kwargs) -> Value:
        return plan.once(function, *arguments, **none)

    return known


def _with_link(plan: LiftPlan, linked: bool) -> LiftPlan:
    """The plan with or without the compensator in the load path."""
    return replace(plan, linked=linked)


def _machine(plan: LiftPlan, alternative: Alternative) -> tuple[Crane, Mode]:
    if alternative in plan.controllers:
        own = plan.controllers[alternative]
    elif alternative is Alternative.STRONG_SSC:
        own = strong_ssc(plan.crane, delay=plan.sensors.delay)
    else:
        own = controller(alternative.value)
    return own.on(plan.crane), own.mode


def _with_low_weight(plan: LiftPlan) -> LiftPlan:
    """The plan in the low weight case."""
    assert plan.weight is not None
    return replace(plan, payload=plan.weight.low_case, high=plan)


def check_chart(plan: LiftPlan) -> None:
    """The load chart has a capacity at the radius of every phase."""
    used = plan.load_chart
    if used is None:
        return
    for phase in plan.phases:
        if not used.at(plan.tip_of(phase)):
            radius = show(used.radius_of(plan.tip_of(phase)), "length")
            low, high = (show(r, "length") for r in used.chart.reach)
            raise PlanError(
                f"{called(phase)}: the crane tip is at a radius of {radius}, and {used.chart.name} goes from {low} to"
                f" {high}. Move the tip, or extend the chart."
            )
        if used.radius is not None and phase.tip is not None:
            raise PlanError(
                f"{called(phase)}: has another tip, and load_chart.radius is that of the plan's. Give"
                " load_chart.pedestal in its place."
            )


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
    if plan.linked and plan.compensator is not None:
        room += plan.compensator.shortest + plan.compensator.travel
    for phase in plan.phases:
        try:
            at = plan.tip_of(phase)
            assert at.z is not None
            if phase.tip is not None and boom is not None:
                boom.reaching(at.x, at.y, at.z)
        except (SeaError, UnitError) as e:
            raise PlanError(f"{called(phase)}: {e}") from None
        highest = max(z for z in (phase.z_start, phase.z_end) if z is not None)
        free = at.z - room - highest
        if free <= 0.0:
            raise PlanError(
                f"{called(phase)}: underside {show(highest, 'length')} above the water, payload and rigging"
                f" {show(room, 'length')} high: they cannot hang under the crane tip at {show(at.z, 'length')}. Raise"
                " the tip, or give more depth."
            )


def check_wire(plan: LiftPlan) -> None:
    """The crane may carry the payload, and has wire for the deepest phase."""
    deepest = min(plan.phases, key=lambda phase: min(phase.z_start or 0.0, phase.z_end or 0.0))
    z = max(min(deepest.z_start or 0.0, deepest.z_end or 0.0), -plan.depth + CLOSE)
    try:
        check_lift(plan.crane, plan.hanging(z))
    except LiftError as e:
        raise PlanError(f"{called(deepest)}: {str(e).replace('start_depth = ', 'underside at ')}") from None


def described(phase: Phase) -> dict[str, Any]:
    """A phase as plain data."""
    names = ("name", "start_depth", "depth", "speed", "duration", "held", "compensated")
    kind = "" if phase.kind is None else phase.kind.value
    return {name: getattr(phase, name) for name in names} | {
        "kind": kind,
        "mode": phase.mode.value,
        "limits": dict(phase.limits),
    }
