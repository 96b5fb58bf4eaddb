"""The one margin of a position loop: of the complete linearised plant with its PLC, on the crane's own wire, least over
displacement, speed, payload and wire paid out.

Three things are kept apart. Places that oscillate without feedback: friction that falls with speed gives the load's
oscillation on its wire more than the wire takes. There no gain has a margin, and the answer is no. Places faster than
those by a Stribeck speed, of each payload, and all places of payloads that do not oscillate: they decide how large K_p
may be. And what oscillates at the crane's own K_p, of all places.

A Stribeck speed faster, because the gain limit falls to nothing towards the speed at which the plant oscillates without
feedback; it comes back as the fall of friction fades, which is over that speed.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from stillhook.analysis.loop_stability.engine_loop import engine_loop, engine_points, has_time, settled
from stillhook.analysis.loop_stability.linearisation import LawMemory, learned, plc_loop
from stillhook.analysis.loop_stability.loops import SampledLoop
from stillhook.analysis.loop_stability.margins import (
    KEPT,
    Margins,
    StableGains,
    Wanted,
    margins,
    stable_gains,
    strongest_estimate,
    strongest_up_to,
)
from stillhook.analysis.loop_stability.places import (
    SLOW,
    Place,
    has_cylinder,
    payloads_of_mode,
    places_of,
    strokes_of,
    tip_speeds,
    wire_range,
)
from stillhook.analysis.steady.limits import Direction, Station, top_of_drive
from stillhook.analysis.steady.operating_point import NoSteadyOperation, OperatingPoint
from stillhook.analysis.steady.steady_state import moves
from stillhook.base.kept.identity import Keyed
from stillhook.engine.pack.winch import pack, plc_record
from stillhook.engine.scenario.followed_law import CYCLE, FollowedLaw
from stillhook.errors import StillhookError
from stillhook.physics.scalar import G
from stillhook.spec.control import own_settings
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario

PAPER_C = 0.95
"""Damping ratio of the wire in paper C, "slightly underdamped", without a measurement [-]."""
NEAR = 1.5
"""Estimates of a gain within this factor of the least are worked out exactly: as far as the grid may be off [-]."""
STEP_PLANT = 0.01
"""What displacements at rest are cut down to [-]: on the safe side, for less displacement leaves less margin,
and few enough to be kept between the candidates of a tuning."""
REMEMBERS = 100.0
"""Time for which a law is followed, to see whether its displacement is constant [s]."""
NEARLY_FULL, SMALL_FEEDBACK, DISPLACEMENT_STANDS = 0.9, 1e-3, 1e-9
"""Feedforward at which it is followed, feedback that it must not leave unanswered, and change of a demanded
displacement that is rounding [-]."""
NO_GAIN = StableGains(0.0, 0.0, math.nan)
"""Of a slow place at which the engine does not become steady; a fast one is beyond the winch, and left out."""


class PlaceLimit(NamedTuple):
    """The loop at a place with the displacement alpha_m [-] (NaN of a drive without one), and the gains at which it
    dies out. loop is None where the engine does not become steady even softly controlled and on a damped wire."""

    place: Place
    alpha_m: float
    loop: SampledLoop | None
    gains: StableGains

    def describe(self) -> str:
        motors = "" if math.isnan(self.alpha_m) else f", motors at {self.alpha_m:.2f}"
        return f"{self.place.describe()}{motors}"


class Governing(NamedTuple):
    """Largest position gain K_p that keeps the margins [1/m], 0 where none does; the place that governs it, None where
    no place decides; all places that were looked at, and those that decide."""

    K_p: float
    governs: PlaceLimit | None
    places: tuple[PlaceLimit, ...]
    decide: tuple[PlaceLimit, ...]

    @property
    def loop(self) -> SampledLoop | None:
        return None if self.governs is None else self.governs.loop

    @property
    def remembers(self) -> bool:
        """Whether the controller remembers the feedback, as in an integral part."""
        return any(p.loop is not None and p.loop.remembered is not None for p in self.places)

    @property
    def no_gain(self) -> tuple[PlaceLimit, ...]:
        return tuple(p for p in self.places if not p.gains.any)

    @property
    def limit(self) -> PlaceLimit | None:
        """The place that decides with the least gain limit."""
        return min(self.decide, key=lambda p: p.gains.high, default=None)

    def oscillates(self, K_p: float) -> tuple[PlaceLimit, ...]:
        """Places at which the plant oscillates with a gain [1/m]."""
        return tuple(p for p in self.places if not p.gains.holds(K_p))

    def margins(self, K_p: float) -> Margins | None:
        """Margins at a gain [1/m], where the gain limit is least among the places that decide."""
        least = self.limit
        return None if least is None or least.loop is None else margins(least.loop, K_p)

    def describe(self) -> str:
        """What governs, in words."""
        if self.governs is None:
            return "no place decides: the complete plant oscillates without feedback at every speed"
        return f"complete plant, {self.governs.describe()}"


def governing(
    crane: Crane,
    mode: Mode,
    kept: Wanted = KEPT,
    *,
    wires: Sequence[float] | None = None,
    loads: Sequence[float] | None = None,
    load: float = math.inf,
    speeds: Sequence[float] | None = None,
    alpha_m: float | None = None,
    delay: float = 0.0,
) -> Governing:
    """The margin of a mode: the place of the complete plant that allows the least gain, of those that decide.

    Parameters: kept gain margin [-], phase margin [rad], sensitivity peak [-], with the delay and with every shorter
    one; wires paid out [m], default from the shortest to all; loads payloads [kg], default from the empty hook to the
    heaviest of the mode, `load` at most; speeds of the tip without sign [m/s], default slow to full; alpha_m [-],
    default where the mode's law puts the motors; delay [s] of the position feedback.
    Errors: StillhookError for a wire that the drum does not hold. Places where nothing holds the load, or the winch is
    not that fast, are left out.
    """
    places = places_of(
        payloads_of_mode(crane, mode, load) if loads is None else loads,
        wire_range(crane) if wires is None else wires,
        tip_speeds(crane) if speeds is None else speeds,
        strokes_of(crane),
    )
    result = place_limits(crane, mode, places, alpha_m=alpha_m, delay=delay)
    decide = deciding(result, stribeck_speed(crane))
    governs, K_p = _strongest(decide, kept)
    return Governing(K_p if governs is not None else 0.0, governs, result, decide)


def stribeck_speed(crane: Crane) -> float:
    """Wire speed over which breakaway friction fades to 1/e, on the outermost layer [m/s]; that of the rod where a
    cylinder compensates."""
    if has_cylinder(crane):
        cylinder: Any = crane.cylinder
        return float(cylinder.friction.v_s * cylinder.falls)
    return float(crane.friction.system.Y_4 * 0.5 * crane.drum.d_max / crane.i_hD)


def deciding(limits: Sequence[PlaceLimit], clear: float) -> tuple[PlaceLimit, ...]:
    """Places that say how large the gain may be: stable without feedback, and clear [m/s] of the speeds at which the
    same payload is not, on any wire."""
    swinging: dict[float, float] = {}
    for p in limits:
        if p.gains.alone:
            swinging[p.place.load] = max(swinging.get(p.place.load, 0.0), abs(p.place.v_tip) + clear)
    return tuple(
        p
        for p in limits
        if p.loop is not None and not p.gains.alone and abs(p.place.v_tip) >= swinging.get(p.place.load, 0.0)
    )


def _strongest(decide: Sequence[PlaceLimit], kept: Wanted) -> tuple[PlaceLimit | None, float]:
    """The place that allows the least gain within the margins, and that gain [1/m]. It is that of the proportional part
    of a law: with an integral part a smaller gain has less phase margin, and there is no largest."""
    loops = [p.loop.proportional for p in decide if p.loop is not None]
    estimates = [(strongest_estimate(loop, kept), i) for i, loop in enumerate(loops)]
    governs, least = None, math.inf
    for estimate, i in sorted(estimates):
        if estimate > NEAR * least:
            break
        K_p = strongest_up_to(loops[i], kept)
        if K_p < least:
            governs, least = decide[i], K_p
    return governs, least


def by_engine(crane: Crane) -> bool:
    """Whether loops are those of the linearised engine: no closed form of the thesis holds for the winch type."""
    return not crane.plant.type.steady_operation


def place_limits(
    crane: Crane, mode: Mode, places: Sequence[Place], *, alpha_m: float | None = None, delay: float = 0.0
) -> tuple[PlaceLimit, ...]:
    """The loops at places and the gains at which they die out; places that the winch does not come to are left out.

    Errors: StillhookError where it comes to none.
    """
    _check_law(crane, mode)
    reached = _reached(crane, places)
    known = learned(crane, mode, ((p.load, p.s_w) for p in reached))
    if by_engine(crane):
        memories = tuple(known[p.load, p.s_w] for p in reached)
        key = _engine_key(crane, mode, reached[0]) if reached else None
        result = () if key is None else _engine_limits(key, mode, reached, memories, delay)
    else:
        station = functools.cache(functools.partial(Station, crane))
        each = (
            _closed_circuit(station(p.load, p.s_w, _way(p)), mode, p, known[p.load, p.s_w], alpha_m, delay)
            for p in reached
        )
        result = tuple(p for p in each if p is not None)
    if not result:
        raise StillhookError(
            f'"{crane.name}": the winch comes to none of the places that were looked at, such as'
            f" {places[0].describe()}. Lower the load or the speed."
        )
    return result


def _check_law(crane: Crane, mode: Mode) -> None:
    """Refuse a law that the linear analysis has no model for: one that feeds no small error back, and one whose
    displacement depends on what it remembers, for which the point at which it settles is not known before a run.

    Errors: StillhookError.
    """
    law = FollowedLaw(crane, mode.law, 0.5 * crane.SWL * G)
    more, less = (law.after(u, law.start(), NEARLY_FULL) for u in (SMALL_FEEDBACK, -SMALL_FEEDBACK))
    if more == less:
        raise StillhookError(f'"{mode}" feeds no small position error back: it has no linear loop. Look at runs.')
    memory = law.start()
    if memory is None or by_engine(crane):
        return
    law, demands = FollowedLaw(crane, mode.law, 0.5 * crane.SWL * G, t_cycle=CYCLE), []
    for _ in range(math.ceil(REMEMBERS / CYCLE)):
        demand, memory = law.after(0.0, memory, NEARLY_FULL)
        demands.append(demand.u_m)
    if max(demands) - min(demands) > DISPLACEMENT_STANDS:
        raise StillhookError(
            f'"{mode}": its displacement of the motors depends on what it remembers, and the linear analysis has no'
            " operating point for it. Look at runs: stillhook run, stillhook map."
        )


def _reached(crane: Crane, places: Sequence[Place]) -> tuple[Place, ...]:
    """Places whose speed the winch holds for good, where its type states how fast that is: faster, its power or heat
    ends the motion, which is not an oscillation."""
    if not hasattr(crane.plant.type.module, "speed_limit"):
        return tuple(places)

    @functools.cache
    def top(load: float, s_w: float, way: Direction) -> float:
        return top_of_drive(crane, load, s_w, way).v_w

    return tuple(p for p in places if abs(p.v_tip) <= top(p.load, p.s_w, _way(p)))


def _way(place: Place) -> Direction:
    """A tip that goes up needs wire."""
    return Direction.LOWERING if place.v_tip > 0.0 else Direction.HOISTING


def _engine_key(crane: Crane, mode: Mode, place: Place) -> Keyed:
    """The crane as the loops of its engine see it: neither the gains of feedforward and position nor
    the leads are in them."""
    case = Scenario(load="0 t", s_w="0 m", mode=mode).model_copy(update={"load": place.load, "s_w": place.s_w})
    packed = pack(crane, case)
    plc = packed.params.plc._replace(gains=None, t_lead=0.0, t_lead_ff=0.0)
    return Keyed(crane, (packed.params._replace(plc=plc), tuple(sorted(packed.settings.items()))))


@functools.lru_cache(maxsize=256)
def _engine_limits(
    keyed: Keyed, mode: Mode, places: tuple[Place, ...], memories: tuple[LawMemory, ...], delay: float
) -> tuple[PlaceLimit, ...]:
    points = engine_points(keyed.machine, mode, places, memories)
    result = []
    for place, point in zip(places, points, strict=True):
        if point is None:
            continue
        if not settled(point):
            if abs(place.v_tip) <= SLOW[-1] and has_time(keyed.machine, place):
                result.append(PlaceLimit(place, math.nan, None, NO_GAIN))
            continue
        loop = engine_loop(point, delay=delay)
        result.append(PlaceLimit(place, math.nan, loop, stable_gains(loop)))
    return tuple(result)


def _closed_circuit(
    station: Station, mode: Mode, place: Place, law_memory: LawMemory, alpha_m: float | None, delay: float
) -> PlaceLimit | None:
    """A place of a winch with the closed circuit of the thesis. Where the law holds the motors still, at any speed
    and load cell do, the loop depends on no setting but the displacement: it is kept between candidates."""
    crane = station.crane
    at = station.displacement(mode)(abs(place.v_tip)) if alpha_m is None else alpha_m
    plc = plc_record(crane)
    stands = not moves(crane, mode) or at >= 1.0
    own = own_settings(crane.control, mode.law)
    seen: Any = plc
    if stands:
        seen = plc._replace(gains=None, motors=None, t_lead=0.0, t_lead_ff=0.0)  # type: ignore[arg-type]
    cut = max(math.floor(at / STEP_PLANT + 1e-9) * STEP_PLANT, STEP_PLANT)
    alpha = cut if stands and alpha_m is None else at
    params = station.winch.params._replace(plc=None)
    keyed = Keyed((crane, station), (params, station.winch.geometry, seen, own))
    result = _closed_circuit_at(keyed, mode, place, law_memory, alpha, delay)
    return None if result is None else PlaceLimit(place, alpha, *result)


@functools.lru_cache(maxsize=8192)
def _closed_circuit_at(
    keyed: Keyed, mode: Mode, place: Place, law_memory: LawMemory, alpha: float, delay: float
) -> tuple[SampledLoop, StableGains] | None:
    """None where pressure or pumps do not suffice."""
    crane, station = keyed.machine
    hoist = station.winch.params.hoist
    undamped = keyed.key[0]._replace(hoist=hoist._replace(wire=hoist.wire._replace(zeta=0.0)))
    same = (crane.plant, undamped, station.winch.geometry, station.sign, place.load, place.s_w)
    point = _operating_point(Keyed(station, same), abs(place.v_tip), alpha)
    if point is None or not point.reachable:
        return None
    point = point._replace(params=point.params._replace(hoist=hoist))
    loop = plc_loop(crane, point, mode=mode, delay=delay, law_memory=law_memory)
    return loop, stable_gains(loop)


@functools.lru_cache(maxsize=8192)
def _operating_point(keyed: Keyed, v: float, alpha: float) -> OperatingPoint | None:
    """Where the winch compensates: no damping of the wire moves it, for the wire keeps its length."""
    try:
        point: OperatingPoint = keyed.machine.at(v, alpha)
    except NoSteadyOperation:
        return None
    return point


def with_wire_damping(crane: Crane, zeta: float) -> Crane:
    """The crane with another damping ratio of its wire [-]."""
    return crane.model_copy(update={"wire": crane.wire.model_copy(update={"zeta": zeta})})
