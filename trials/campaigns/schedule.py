"""The tests of a campaign: paper F table 3 in heave compensation, a test beyond the speed limit, and quick turns
without load.

Irregular motion of a crane tip: sines with heights of a sea's spectrum, at frequencies that never come round.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.pack.winch import drum_record, wire_speed_max
from stillhook.library import load_crane
from stillhook.physics.load_path.drum import wire_usable
from stillhook.sea.motion.motion import Motion, Ramped, Sine, Still, Sum
from stillhook.sea.motion.recorded import window_spans
from stillhook.spec.crane import Crane
from stillhook.spec.lift.payload import RHO_STEEL
from stillhook.spec.scenario import Mode, Operator, Scenario, Sensors, Water
from stillhook.units import show
from stillhook.validate.data_set.campaign import Kind
from stillhook.variables import WINDOW

GAMMA = 3.3
"""Peakedness of the spectrum (mean JONSWAP)."""
LOWEST, HIGHEST = 0.55, 2.0
"""Band of frequencies over that of the peak: a hull follows no shorter waves."""
PER_SECOND = 0.06
FEWEST, MOST = 24, 90
"""Sines: so many a second of the run, within these bounds."""
STEP = 0.2
"""Spacing at which the largest peak-to-peak is looked for [s]."""


def irregular(period: float, duration: float, ramp: float, highest: float, rng: np.random.Generator) -> Sum:
    """Tip motion with a peak period [s] whose largest peak-to-peak over 30 s of a run is `highest` [m]; ramp of the run
    [s].

    Frequencies are drawn within even bands, so that the motion does not repeat itself. Source: JONSWAP spectrum
    (Hasselmann et al. 1973) of peak factor 3.3; heights then scaled.
    """
    n = int(np.clip(round(PER_SECOND * duration), FEWEST, MOST))
    edges = np.linspace(LOWEST, HIGHEST, n + 1)
    r = rng.uniform(edges[:-1], edges[1:])
    width = np.where(r < 1.0, 0.07, 0.09)
    S = r**-5.0 * np.exp(-1.25 * r**-4.0) * GAMMA ** np.exp(-0.5 * ((r - 1.0) / width) ** 2)
    size, phases = np.sqrt(S * np.diff(edges)), rng.uniform(0.0, 2.0 * np.pi, n)
    unit = _sum(size, period / r, phases)
    return _sum(size * highest / _largest(unit, duration, ramp), period / r, phases)


def _sum(sizes: np.ndarray, periods: np.ndarray, phases: np.ndarray) -> Sum:
    return Sum([Sine.from_si(float(a), float(T), float(p)) for a, T, p in zip(sizes, periods, phases, strict=True)])


def _largest(motion: Motion, duration: float, ramp: float) -> float:
    """Largest peak-to-peak over a moving window of 30 s [m]."""
    s = Ramped.from_si(motion, ramp).sample(np.arange(0.0, duration, STEP))[0]
    return float(window_spans(s, round(WINDOW / STEP) + 1).max())


DATE = datetime.date(2026, 11, 21)
"""Date on the campaign and its certificate: fixed, so that the same seed gives the same bytes."""
SWL_OF_PAPER = 250e3
ADDED_MASS = 0.6
"""Added mass of a test load over the mass of the water that it displaces (assumed: a compact body)."""
DRAG = 1.2
"""Drag coefficient of a test load (assumed: a compact body with edges)."""
SIDE = 1.6
"""Area of a test load over its volume to the power of 2/3 (assumed: flat slabs)."""
WARM_UP = 5.0


@dataclass(frozen=True)
class Sea:
    """Tip motion: height range from which the largest peak-to-peak over 30 s is drawn [m]; period of the peak [s]; ramp
    [s]."""

    lowest: float
    highest: float
    period: float
    ramp: float = 10.0


@dataclass(frozen=True)
class PlannedTest:
    """One test. load payload without the hook [kg]; s_w wire out at the start [m]; sea: None: the tip does not move."""

    name: str
    kind: Kind
    load: float
    s_w: float
    duration: float
    mode: Mode
    sea: Sea | None = None
    operator: Operator = field(default_factory=Operator)

    @property
    def water(self) -> Water | None:
        """What the water does to a test load of steel, as the campaign states it; nothing where there is no load."""
        if self.load == 0.0:
            return None
        V = round(self.load / RHO_STEEL, 3)
        mass, area = round(ADDED_MASS * 1025.0 * V / 1e3, 2), round(SIDE * V ** (2.0 / 3.0), 2)
        return Water(volume=f"{V} m^3", added_mass=f"{mass} t", C_D=DRAG, area=f"{area} m^2")

    def case(self, sensors: Sensors, seed: int, number: int) -> Scenario:
        """The test as it is run: number of the test in its campaign, which has its own sea for every seed."""
        return Scenario(
            name=self.name,
            load=show(self.load, "mass", 12),
            s_w=show(self.s_w, "length", 12),
            tip=self.tip(seed, number),
            mode=self.mode,
            duration=f"{self.duration!r} s",
            ramp=f"{self.sea.ramp if self.sea else 0.0!r} s",
            warm_up=f"{WARM_UP!r} s",
            water=self.water,
            operator=self.operator,
            sensors=sensors,
        )

    def tip(self, seed: int, number: int) -> Motion:
        """The crane tip's motion."""
        if self.sea is None:
            return Still()
        rng = np.random.default_rng([seed, number, 1])
        s = self.sea
        return irregular(s.period, self.duration, s.ramp, rng.uniform(s.lowest, s.highest), rng)


@dataclass(frozen=True)
class Plan:
    """A campaign. crane: the twin under test; crane_name as the campaign file names it, "" where a crane file is
    written next to it."""

    title: str
    crane: Crane
    crane_name: str
    tests: tuple[PlannedTest, ...]
    source: str
    date: datetime.date = DATE


def sea_trials(crane: str | Crane = "nov-250t") -> Plan:
    """Tests like those of Moslatt 2020 paper F table 3, on a crane of the library or your own.

    Cases 1 to 4 have the printed loads, lengths and durations on a crane of 250 t; on another one loads go with the
    SWL, wire out with the wire on the drum. Case 1 is in normal-speed mode, so that the motors are also seen at rest
    at less than full displacement, the others in SSC. "limits" drives the joystick beyond the winch's speed both ways;
    the plateaus are long enough to be steady. "dynamics" is quick turns of an empty hook near the tip. Case 2 grows
    into its sea over five minutes and so covers small motions as well (table 2, 1c).
    """
    name = crane if isinstance(crane, str) else ""
    twin = load_crane(crane) if isinstance(crane, str) else crane
    load = twin.SWL / SWL_OF_PAPER
    wire = wire_usable(drum_record(twin)) / wire_usable(drum_record(load_crane("nov-250t")))
    v = wire_speed_max(twin)

    def ahc(number: str, t: float, s_w: float, duration: float, mode: Mode, sea: Sea) -> PlannedTest:
        return PlannedTest(number, Kind.AHC, round(load * t, 1) * 1e3, round(wire * s_w), duration, mode, sea)

    half_load, middle = round(load * 82.0, 1) * 1e3, round(wire * 500.0)
    tests = (
        ahc("1", 82.0, 487.0, 200.0, Mode("ns"), Sea(1.4, 1.8, 9.0)),
        ahc("2", 94.0, 487.0, 1500.0, Mode("ssc"), Sea(2.1, 2.5, 10.0, ramp=300.0)),
        ahc("3", 164.0, 2314.0, 200.0, Mode("ssc"), Sea(2.0, 2.3, 9.0)),
        ahc("4", 162.0, 2281.0, 300.0, Mode("ssc"), Sea(1.5, 2.0, 10.0)),
        PlannedTest("limits", Kind.LIMITS, half_load, middle, 86.0, MANUAL_MODE, None, beyond(2.3 * v)),
        PlannedTest("dynamics", Kind.DYNAMICS, 0.0, 15.0, 88.0, MANUAL_MODE, None, turns(v)),
    )
    title = f"Sea trials like paper F table 3 of {twin.name}"
    return Plan(title, twin, name, tests, "Moslatt 2020 paper F table 3; rest assumed")


def _profile(legs: tuple[tuple[float, float], ...]) -> Operator:
    """A joystick that goes to each speed [m/s] within the time [s] given with it, from rest."""
    times = accumulate(dt for dt, _ in legs)
    return Operator(
        profile=[("0 s", "0 m/s"), *((f"{t:.9g} s", f"{v:.9g} m/s") for t, (_, v) in zip(times, legs, strict=True))]
    )


def beyond(v: float) -> Operator:
    """Hoist and lower twice at v [m/s], beyond what the pumps can give, with plateaus of 12 s; rests in between."""
    one = ((3.0, v), (12.0, v), (3.0, 0.0), (3.0, 0.0), (3.0, -v), (12.0, -v), (3.0, 0.0), (3.0, 0.0))
    return _profile(((2.0, 0.0), *one, *one))


def turns(v: float) -> Operator:
    """Quick turns at a fifth to half of the winch's speed v [m/s], up and down in turn."""
    legs: list[tuple[float, float]] = [(3.0, 0.0)]
    for part in (0.2, 0.35, 0.5, 0.28):
        for side in (1.0, -1.0):
            legs += [(0.3, side * part * v), (6.0, side * part * v), (0.3, 0.0), (4.0, 0.0)]
    return _profile(tuple(legs))


@dataclass(frozen=True)
class Run:
    """One test as it was run: its case, time (n,) [s], true signals (n,) by name [SI], and its status."""

    case: Scenario
    time: FloatArray
    signals: dict[str, FloatArray]
    status: str
