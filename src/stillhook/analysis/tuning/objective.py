"""What a tuning wants and what it must keep: scenarios, hold-out waves, objectives, limits.

How a set of settings scores: error and pressure over the scenarios, and which limits it breaks.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.axes import value_of
from stillhook.analysis.controllers import learning_time
from stillhook.analysis.loop_stability.governing import Governing, by_engine, governing
from stillhook.analysis.loop_stability.margins import GAIN_MARGIN, PHASE_MARGIN, SENSITIVITY_PEAK, margins
from stillhook.analysis.steady.steady_state import speed_limit
from stillhook.base.kept.identity import Keyed
from stillhook.control.registry import CLASSIC, DEFAULT_MODE
from stillhook.engine.pack.winch import wire_speed_max
from stillhook.engine.scenario.checks import layer_diameter_at
from stillhook.errors import StillhookError
from stillhook.sea.motion.motion import Motion, Sine, Sum
from stillhook.spec.crane import Crane, content
from stillhook.spec.scenario import Mode, Scenario, Sensors
from stillhook.units import parse, quote, show

LOADS, SPEEDS, PERIODS = ("20 %", "60 %"), ("20 m/min", "50 m/min", "75 m/min"), ("8 s", "12 s")
"""Scenarios of a tuning unless others are given: loads as parts of the SWL, peak speeds of the tip, wave periods."""
FASTEST = 0.9
"""Highest of those speeds over that which NS reaches with full pumps: on a slower winch all three shrink to it, so that
leakage and acceleration leave something to tune."""
WARM_UP, COUNTED = 20.0, 32.0
"""Start of every run that is left out, longer by `learning_time`, and what counts [s]: a little more than the window of
the peak-to-peak error."""
HOLD_OUT_PERIODS, PARTS, HOLD_OUT_COUNTED = (6.5, 15.0), 6, 120.0
"""Hold-out waves: so many sines of these periods [s], none of them a tuning's, in random phase; their runs are
longer."""


class Objective(StrEnum):
    """What is made small: mean or largest control error, highest pressure, or half the mean error and half the pressure
    (as parts of those of the start)."""

    ERROR = "error"
    WORST = "worst-error"
    PRESSURE = "pressure"
    BALANCED = "balanced"

    def check(self, crane: Crane) -> None:
        """Errors: StillhookError where the winch type has no pressure, and the objective is nothing else."""
        if self is Objective.PRESSURE and not has_pressure(crane):
            raise StillhookError(
                f'objective "pressure": winch type "{crane.plant}" has no p_max. Choose error, worst-error or balanced,'
                " which is the error alone here."
            )


def has_pressure(crane: Crane) -> bool:
    return any(row.name == PRESSURE for row in crane.plant.type.numbers)


PRESSURE = "p_max"


def pressure_of(row: Mapping[str, Any]) -> float:
    """Highest pressure of a run [Pa]; NaN of a winch type that has none."""
    return float(row.get(PRESSURE, math.nan))


WEIGHTS: Mapping[Objective, tuple[float, float, float]] = {
    Objective.ERROR: (1.0, 0.0, 0.0),
    Objective.WORST: (0.0, 1.0, 0.0),
    Objective.PRESSURE: (0.0, 0.0, 1.0),
    Objective.BALANCED: (0.5, 0.0, 0.5),
}
"""Weights of mean error, largest error and highest pressure in the score; without a pressure the others count."""


@dataclass(frozen=True)
class Limits:
    """What tuned settings must keep: highest pressure p_max [Pa]; gain margin [-], phase margin [rad] and sensitivity
    peak [-] of the position loop with its PLC, in the complete plant on the crane's own wire, slow to fast, from the
    empty hook to the heaviest payload that the mode carries, `load` at most [kg], from the shortest wire to all
    (`stillhook.analysis.loop_stability.governing`); v_w_capacity speed
    with the pumps full, for every load [m/s] (None: that of the start, "speed capacity kept"). Always kept: no
    saturation, no relief valve open, no motor overspeed, no cavitation, no slack wire, in any scenario; and in
    the fast runs nothing that the start does not do there either."""

    p_max: float = math.inf
    gain_margin: float = GAIN_MARGIN
    phase_margin: float = PHASE_MARGIN
    sensitivity_peak: float = SENSITIVITY_PEAK
    v_w_capacity: float | None = None
    load: float = math.inf

    def check(self, crane: Crane) -> None:
        """Errors: StillhookError where a pressure is limited that the winch type does not have."""
        if math.isfinite(self.p_max) and not has_pressure(crane):
            raise StillhookError(f'limit p_max: winch type "{crane.plant}" has no p_max. Leave it out.')

    @property
    def margins(self) -> tuple[float, float, float]:
        return self.gain_margin, self.phase_margin, self.sensitivity_peak


_KINDS = {
    "p_max": ("pressure", "<="),
    "gain_margin": ("", ">="),
    "phase_margin": ("angle", ">="),
    "sensitivity_peak": ("", "<="),
    "v_w_capacity": ("speed", ">="),
    "load": ("mass", "<="),
}
_LIMIT = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(.+?)\s*")


def parse_limits(texts: Iterable[str]) -> Limits:
    """Limits from texts such as "p_max <= 300 bar", "gain_margin >= 2.5", "v_w_capacity >= 100 m/min".

    Errors: StillhookError, UnitError of one line.
    """
    limits, named = Limits(), set[str]()
    for text in texts:
        match = _LIMIT.fullmatch(text)
        allowed = ", ".join(f"{n} {sign} ..." for n, (_, sign) in _KINDS.items())
        if not match or match[1] not in _KINDS or match[2] != _KINDS[match[1]][1]:
            raise StillhookError(f"limit {quote(text)}: write one of {allowed}.")
        name, (kind, _) = match[1], _KINDS[match[1]]
        if name in named:
            raise StillhookError(f"limit {quote(text)}: {name} has a limit already. Write each limit once.")
        named.add(name)
        value = parse(match[3], kind, f"limit {name}") if kind else _plain(match[3], name)
        limits = replace(limits, **{name: value})
    return limits


def _plain(text: str, name: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value > 1.0 or math.isinf(value):
        raise StillhookError(f"limit {name} = {quote(text)}: give a number above 1.")
    return value


def usual_speeds(crane: Crane) -> tuple[str, ...]:
    """Peak speeds for this winch: `SPEEDS`, or less of each on one whose NS cannot follow the highest of them. In whole
    m/min."""
    fastest = max(parse(v, "speed", "speeds") for v in SPEEDS)
    classic = CLASSIC[0] if CLASSIC[0] in crane.plant.type.modes else crane.plant.type.default_mode
    part = min(1.0, FASTEST * top_speed(crane, classic) / fastest)
    return tuple(f"{60.0 * part * parse(v, 'speed', 'speeds'):.0f} m/min" for v in SPEEDS)


def scenarios(
    crane: Crane,
    mode: Mode = DEFAULT_MODE,
    *,
    loads: Sequence[str] = LOADS,
    speeds: Sequence[str] | None = None,
    periods: Sequence[str] = PERIODS,
    s_w: str = "100 m",
    delay: float = 0.0,
) -> list[Scenario]:
    """Every load with every peak speed (default `usual_speeds`) and period, as sines. Loads are masses or parts of the
    SWL ("60 %").

    Errors: StillhookError, UnitError for a text that is not one of these.
    """
    masses = [value_of(load, "mass", "loads", crane.SWL) for load in loads]
    pairs = [
        (parse(v, "speed", "speeds"), parse(T, "time", "periods")) for v in _speeds(crane, speeds) for T in periods
    ]
    if not masses or not pairs:
        raise StillhookError("scenarios: give at least one load, one speed and one period.")
    tips = [peak_sine(v, T) for v, T in pairs]
    return [_case(m, s_w, tip, mode, COUNTED, delay) for m in masses for tip in tips]


def hold_out(
    crane: Crane,
    mode: Mode = DEFAULT_MODE,
    *,
    loads: Sequence[str] = LOADS,
    speeds: Sequence[str] | None = None,
    s_w: str = "100 m",
    delay: float = 0.0,
    seed: int = 0,
) -> list[Scenario]:
    """What the tuning never saw: irregular waves of `PARTS` sines in random phase with the same peak speeds, loads
    between those given.

    `seed` draws periods and phases. The runs count two minutes.
    """
    rng = np.random.default_rng([seed, PARTS])
    masses = sorted(value_of(load, "mass", "loads", crane.SWL) for load in loads)
    between = [0.5 * (a + b) for a, b in pairwise(masses)] or masses
    out = []
    for load in [*between, masses[-1]]:
        for v in _speeds(crane, speeds):
            tip = _irregular(parse(v, "speed", "speeds"), rng, learning_time([mode]))
            out.append(_case(load, s_w, tip, mode, HOLD_OUT_COUNTED, delay))
    return out


def _speeds(crane: Crane, requested: Sequence[str] | None) -> Sequence[str]:
    return usual_speeds(crane) if requested is None else requested


def peak_sine(v: float, T: float) -> Motion:
    if not v > 0.0:
        raise StillhookError(f"speeds: {show(v, 'speed')}: give a peak speed above 0.")
    return Sine.from_si(v * T / (2.0 * math.pi), T, where="scenarios")


def _irregular(v: float, rng: np.random.Generator, learning: float) -> Motion:
    """Sines of like speed in random phase, so large that the tip's highest speed over the run is v; learning as in
    `learning_time`."""
    periods = rng.uniform(*HOLD_OUT_PERIODS, size=PARTS)
    phases = rng.uniform(0.0, 2.0 * math.pi, size=PARTS)

    def motion(v_each: float) -> Motion:
        return Sum([Sine.from_si(v_each * T / (2.0 * math.pi), T, p) for T, p in zip(periods, phases, strict=True)])

    t = np.arange(0.0, WARM_UP + learning + HOLD_OUT_COUNTED, 0.01)
    return motion(v / float(np.max(np.abs(motion(1.0).sample(t)[1]))))


def _case(load: float, s_w: str, tip: Motion, mode: Mode, counted: float, delay: float) -> Scenario:
    warm_up = WARM_UP + learning_time([mode])
    case = Scenario(
        load="0 t",
        s_w=s_w,
        tip=tip,
        mode=mode,
        warm_up=f"{warm_up} s",
        duration=f"{warm_up + counted} s",
        sensors=Sensors(delay=f"{delay!r} s"),
    )
    return case.model_copy(update={"load": load})


OURS = (
    "saturated",
    "relief",
    "overspeed",
    "cavitation",
    "slack",
    "oscillates",
    "unstable",
    "uncompensated",
    "audit",
    "diverged",
    "refused",
)
"""Parts of a status that a controller is to blame for: not what load and motion do to wire and
accumulator."""
SHARES_OF_FASTEST = (0.95, 0.9, 0.85, 0.8, 0.7, 0.6)
"""Peak speeds of the fast runs, as parts of the speed with the pumps full: all settings must
manage the first that the start manages."""
NEAR = 0.01
"""Part by which a limit may be missed and still counts as active."""


class Score(NamedTuple):
    """Result of settings: score objective over that of the start [-]; mean and largest error [m], highest pressure [Pa]
    over the scenarios; per scenario e_c_pp [m], p_max [Pa] and u_p_max [-]; least v_w_capacity [m/s]; broken: the
    limits that are not kept, worst first.
    """

    score: float
    e_c_pp_mean: float
    e_c_pp_worst: float
    p_max: float
    e_c_pp: tuple[float, ...]
    pressures: tuple[float, ...]
    u_p_max: float
    v_w_capacity: float
    broken: tuple[str, ...]


class Fast(NamedTuple):
    """A fast run that tuned settings must manage as the start does: scenario, and what of `OURS` came up in the start's
    run."""

    case: Scenario
    allowed: frozenset[str]


def fast_candidates(crane: Crane, mode: Mode, like: Scenario) -> list[list[Scenario]]:
    """Runs at parts of the speed with the pumps full, fastest first, for each default period; lightest load, wire and
    sensors as in `like`.

    A speed that only a constant speed reaches is not a speed capacity: the motors of SSC need time to stroke.
    """
    load = 0.0 if crane.hook_mass > 0.0 else like.load
    v = top_speed(crane, mode, load) * layer_diameter_at(crane, like.s_w) / crane.drum.d_max
    plain = like.model_copy(update={"load": load, "mode": mode})
    return [
        [plain.model_copy(update={"tip": peak_sine(part * v, parse(T, "time"))}) for part in SHARES_OF_FASTEST]
        for T in PERIODS
    ]


def attributed_limits(status: str) -> frozenset[str]:
    return frozenset(status.split(", ")) & frozenset(OURS)


def scored(
    crane: Crane,
    mode: Mode,
    cases: Sequence[Scenario],
    results: Sequence[Mapping[str, Any]],
    limits: Limits,
    fast: Sequence[Fast] = (),
) -> Score:
    """A set of settings by the summaries of its runs, those of the fast runs last; score is left NaN (see
    `relative`)."""
    results, quick = results[: len(cases)], results[len(cases) :]
    e = tuple(float(s["e_c_pp"]) for s in results)
    p = tuple(pressure_of(s) for s in results)
    capacity = capacity_of(crane, mode, cases)
    broken = [*linear_broken(crane, mode, limits, capacity)]
    for name in OURS:
        bad = sum(name in str(s["status"]).split(", ") for s in results)
        if bad:
            broken.append(f"{name} in {bad} of {len(results)} scenarios")
    for run, summary in zip(fast, quick, strict=True):
        beyond = attributed_limits(str(summary["status"])) - run.allowed
        if beyond:
            broken.append(f"{', '.join(sorted(beyond))} in a fast run ({run.case.tip.describe()})")
    if has_pressure(crane) and not max(p) <= limits.p_max:
        broken.append(f"p_max {show(max(p), 'pressure', 4)} above {show(limits.p_max, 'pressure', 4)}")
    u_p = max(float(s["u_p_max"]) for s in results)
    return Score(
        score=math.nan,
        e_c_pp_mean=float(np.mean(e)),
        e_c_pp_worst=max(e),
        p_max=max(p),
        e_c_pp=e,
        pressures=p,
        u_p_max=u_p,
        v_w_capacity=min(capacity),
        broken=tuple(broken),
    )


def relative(score: Score, start: Score, objective: Objective) -> Score:
    """The score as a part of that of the start."""
    w = WEIGHTS[objective]
    ours, theirs = ((s.e_c_pp_mean, s.e_c_pp_worst, s.p_max) for s in (score, start))
    parts = [(a, a * x / y) for a, x, y in zip(w, ours, theirs, strict=True) if a > 0.0 and not math.isnan(y)]
    return score._replace(score=sum(part for _, part in parts) / sum(a for a, _ in parts))


def capacity_of(crane: Crane, mode: Mode, cases: Sequence[Scenario]) -> list[float]:
    """Speed with the pumps full for every load among the scenarios, on the published diameter [m/s]."""
    return [top_speed(crane, mode, load) for load in sorted({c.load for c in cases})]


def top_speed(crane: Crane, mode: Mode, load: float | None = None) -> float:
    """Highest wire speed of a mode with the pumps full, or at full command [m/s]."""
    return wire_speed_max(crane) if by_engine(crane) else speed_limit(crane, mode, load)


def linear_broken(crane: Crane, mode: Mode, limits: Limits, capacity: Sequence[float]) -> list[str]:
    """Margins that the position loop does not keep, and speed that is missing: the criteria that need no run."""
    out = []
    K_p, most = crane.control.K_p, governing_loop(crane, mode, limits)
    if most.loop is None:
        out.append(f"no gain K_p keeps the margins: {most.describe()}")
    elif K_p > most.K_p:
        m = margins(most.loop, K_p)
        if m.gain_margin < limits.gain_margin:
            out.append(f"gain margin {m.gain_margin:.3g} below {limits.gain_margin:.3g}")
        if m.phase_margin < limits.phase_margin:
            out.append(
                f"phase margin {math.degrees(m.phase_margin):.3g} deg below {math.degrees(limits.phase_margin):.3g} deg"
            )
        if m.stable and m.sensitivity_peak > limits.sensitivity_peak:
            out.append(f"sensitivity peak {m.sensitivity_peak:.4g} above {limits.sensitivity_peak:.3g}")
        out = out or [
            f"K_p {show(K_p, 'gain_per_length', 4)} above {show(most.K_p, 'gain_per_length', 4)}, which the margins"
            " allow"
        ]
        out[-1] += f" ({most.describe()})"
    wanted = limits.v_w_capacity
    if wanted is not None and min(capacity) < wanted * (1.0 - 1e-6):
        out.append(f"speed capacity {show(min(capacity), 'speed', 4)} below {show(wanted, 'speed', 4)}")
    return out


def governing_loop(crane: Crane, mode: Mode, limits: Limits) -> Governing:
    """The loop that allows the least gain within the margins, at the loads up to that of the limits, on every wire. It
    does not depend on the crane's K_p, of which a search tries many."""
    cut = crane.model_copy(update={"control": crane.control.model_copy(update={"K_p": 1.0})})
    return _governing_loop(Keyed(crane, tuple(content(cut).items())), mode, limits.margins, limits.load)


@functools.lru_cache(maxsize=64)
def _governing_loop(keyed: Keyed, mode: Mode, kept: tuple[float, float, float], load: float) -> Governing:
    return governing(keyed.machine, mode, kept, load=load)


def gain_allowed(crane: Crane, mode: Mode, limits: Limits) -> float:
    """Largest K_p that keeps the margins [1/m], 0 where none does; displacements are cut down to whole steps, which is
    on the safe side."""
    return governing_loop(crane, mode, limits).K_p
