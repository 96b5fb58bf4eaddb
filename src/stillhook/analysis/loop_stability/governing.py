"""Which position loop holds: the published one, or the complete plant linearised at the slow operating points that a
mode visits.

The published loop has a viscous coefficient B_v for all friction. In the plant friction falls with speed when the winch
is slow (Stribeck), the more so under load, and that takes damping away; a small displacement leaves least of it. Of
both the one that allows less gain governs.

Slow under a heavy load the plant may oscillate whatever the gain: sticking and slipping excite the load's oscillation
on its wire, whose own damping is small. That cycle (millimetres of wire) is neither made nor stopped by the position
loop. Limits of the gain are therefore those of the plant whose load does not ring (`with_damped_wire`), and the places
where the real one swings are named.

Does a loaded winch oscillate at low speed? The gain limit of the complete plant where friction falls with speed.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from stillhook.analysis.loop_stability.engine_loop import engine_loop, engine_points
from stillhook.analysis.loop_stability.linearisation import plc_loop
from stillhook.analysis.loop_stability.margins import (
    GAIN_MARGIN,
    PHASE_MARGIN,
    SENSITIVITY_PEAK,
    gain_limit_of,
    strongest_up_to,
)
from stillhook.analysis.loop_stability.transfer import SampledLoop, position_loop, sampled
from stillhook.analysis.steady.limits import Direction, Station
from stillhook.analysis.steady.operating_point import NoSteadyOperation
from stillhook.analysis.steady.steady_state import motor_law, moves
from stillhook.engine.pack.winch import drum_record, pack, plc_record
from stillhook.errors import StillhookError
from stillhook.physics.load_path.drum import wire_usable
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario
from stillhook.units import show

SLOW = (2.0 / 60.0, 5.0 / 60.0)
"""Tip speeds that are looked at, in both directions [m/s], 2 and 5 m/min: there friction falls with speed most."""
WIRES = (100.0,)
"""Wire paid out at which margins are kept unless others are given [m]: that of the usual scenarios."""
SHORTEST = 15.0
"""Shortest wire paid out that is looked at [m]."""
KEPT = (GAIN_MARGIN, PHASE_MARGIN, SENSITIVITY_PEAK)
"""Gain margin [-], phase margin [rad], sensitivity peak [-]."""
CALM = 0.95
"""Damping ratio of a wire on which the load does not ring [-]: that of paper C."""
STEP, STEP_PLANT = 0.005, 0.01
"""What displacements are cut down to for the margins of the published loop and of the plant [-]: on the safe side, for
less displacement leaves less margin, and few enough to be kept between the candidates of a tuning."""


class Place(NamedTuple):
    """Where the winch compensates: payload load [kg], wire paid out s_w [m], constant speed of the tip v_tip, up
    positive [m/s]."""

    load: float
    s_w: float
    v_tip: float

    def describe(self) -> str:
        """In words, such as "150 t at 2 m/min on 100 m of wire, tip going up"."""
        way = "up" if self.v_tip > 0.0 else "down"
        load = show(self.load, "mass", 4) if self.load > 0.0 else "empty hook"
        return (
            f"{load} at {show(abs(self.v_tip), 'speed', 3)} on {show(self.s_w, 'length', 4)} of wire, tip going {way}"
        )


class Governing(NamedTuple):
    """Largest position gain K_p that keeps the margins [1/m], 0 where the winch oscillates without feedback though its
    load does not ring; the governing loop, with its PLC, at the displacement alpha_m [-] (NaN of a drive without one);
    place: where the complete plant stands, None for the published loop; swings: places where the plant oscillates
    whatever the gain."""

    K_p: float
    loop: SampledLoop
    alpha_m: float
    place: Place | None
    swings: tuple[Place, ...] = ()

    def describe(self) -> str:
        """The loop in words."""
        if self.place is None:
            return f"published loop, motors at {self.alpha_m:.2f}"
        motors = "" if math.isnan(self.alpha_m) else f", motors at {self.alpha_m:.2f}"
        return f"complete plant, {self.place.describe()}{motors}"


def with_damped_wire(crane: Crane) -> Crane:
    """The crane with a wire on which the load does not ring."""
    wire = crane.wire
    return crane if wire.zeta >= CALM else crane.model_copy(update={"wire": wire.model_copy(update={"zeta": CALM})})


def heaviest_payload(crane: Crane, mode: Mode) -> float:
    """Heaviest payload that a mode carries [kg]: HS 60 % of the SWL (paper C), the others all of it."""
    return mode.law.swl_share * crane.SWL


def wire_range(crane: Crane) -> tuple[float, ...]:
    """Short, middle and long wire paid out [m]; the middle one is the geometric mean."""
    longest = wire_usable(drum_record(crane))
    shortest = min(SHORTEST, longest)
    return (shortest, math.sqrt(shortest * longest), longest)


def payloads_of_mode(crane: Crane, mode: Mode, most: float = math.inf) -> tuple[float, ...]:
    """Empty hook, where there is one, and the heaviest payload that a mode carries, `most` at most [kg]."""
    heaviest = min(heaviest_payload(crane, mode), most)
    return (0.0, heaviest) if crane.hook_mass > 0.0 and heaviest > 0.0 else (heaviest,)


def slow_places(loads: Sequence[float], wires: Sequence[float], speeds: Sequence[float] = SLOW) -> tuple[Place, ...]:
    """Every payload [kg] on each length of wire [m], at speeds of the tip of both signs [m/s]."""
    return tuple(
        Place(m, s_w, sign * v)
        for m in dict.fromkeys(loads)
        for s_w in dict.fromkeys(wires)
        for v in speeds
        for sign in (1.0, -1.0)
    )


class PlantLoop(NamedTuple):
    """The position loop of the complete plant at a place with its PLC, and the displacement alpha_m [-] at which the
    motors stand."""

    loop: SampledLoop
    alpha_m: float


def plant_loop_at(
    crane: Crane, mode: Mode, place: Place, *, alpha_m: float | None = None, delay: float = 0.0
) -> PlantLoop | None:
    """The loop at a place; None where nothing holds this load at this speed.

    Parameters: alpha_m displacement [-], default where the mode's own law puts the motors; delay [s] of the position
    feedback.
    """
    station = _station(crane, place)
    at = station.displacement(mode)(abs(place.v_tip)) if alpha_m is None else alpha_m
    loop = _loop(crane, station, mode, place.v_tip, at, delay)
    return None if loop is None else PlantLoop(loop, at)


def _loop(
    crane: Crane, station: Station, mode: Mode, v_tip: float, alpha_m: float, delay: float = 0.0
) -> SampledLoop | None:
    """None where pressure or pumps do not suffice."""
    try:
        point = station.at(abs(v_tip), alpha_m)
    except NoSteadyOperation:
        return None
    return plc_loop(crane, point, mode=mode, delay=delay) if point.reachable else None


def governing(
    crane: Crane,
    mode: Mode,
    kept: tuple[float, float, float] = KEPT,
    *,
    wires: Sequence[float] = WIRES,
    load: float = math.inf,
) -> Governing:
    """The loop that holds for a mode: of the published loop at its least displacement on the outermost layer, and of
    the complete plant at the slow places that the mode visits (`payloads_of_mode`, `slow_places`), the one that allows
    the least gain. Margins are kept with the computing time and with every shorter one, as in
    `stillhook.analysis.loop_stability.margins.strongest_gain`.

    Parameters: kept gain margin [-], phase margin [rad], sensitivity peak [-]; wires paid out [m]; load heaviest
    payload [kg].
    Errors: StillhookError for a wire that the drum does not hold. Places where nothing holds the load are left out.
    """
    holds, swings = largest_gain(crane, mode, kept, wires=wires, load=load), []
    if by_engine(crane):
        places = slow_places(payloads_of_mode(crane, mode, load), wires)
        return holds._replace(swings=_engine_swings(_engine_key(crane, mode, places[0]), mode, places))
    for place in slow_places(payloads_of_mode(crane, mode, load), wires):
        real = _plant(crane, mode, place, kept)
        if real is not None and real.K_p == 0.0:
            swings.append(place)
    return holds._replace(swings=tuple(swings))


def largest_gain(
    crane: Crane,
    mode: Mode,
    kept: tuple[float, float, float] = KEPT,
    *,
    wires: Sequence[float] = WIRES,
    load: float = math.inf,
) -> Governing:
    """As `governing`, without looking for places where the plant swings: half the work.

    Of a winch type without the closed circuit of the thesis the loop is that of the running engine.
    """
    if by_engine(crane):
        return _of_engine(crane, mode, kept, wires, load)
    margins, still = [_published(crane, mode, kept)], with_damped_wire(crane)
    for place in slow_places(payloads_of_mode(crane, mode, load), wires):
        damped = _plant(still, mode, place, kept)
        if damped is not None:
            margins.append(damped)
    return min(margins, key=lambda g: g.K_p)


def by_engine(crane: Crane) -> bool:
    """Whether margins are those of the linearised engine: no closed form of the thesis holds for the winch type."""
    return not crane.plant.type.steady_operation


def engine_loops(
    crane: Crane, mode: Mode, places: Sequence[Place], *, delay: float = 0.0
) -> list[tuple[Place, SampledLoop]]:
    """The loops of the running engine at places; those that it does not come to are left out. Errors: StillhookError
    where it comes to none."""
    loops = _engine_loops(_engine_key(crane, mode, places[0]), mode, tuple(places), delay)
    if not loops:
        raise StillhookError(
            f'"{crane.name}": the winch diverges at every place that was looked at, such as {places[0].describe()}.'
            " Check the settings of its drive."
        )
    return list(loops)


def _engine_key(crane: Crane, mode: Mode, place: Place) -> _Keyed:
    """The crane as the loops of its engine see it: neither gains of feedforward and position nor t_lead are in them."""
    case = Scenario(load="0 t", s_w="0 m", mode=mode).model_copy(update={"load": place.load, "s_w": place.s_w})
    packed = pack(crane, case)
    plc = packed.params.plc._replace(gains=None, t_lead=0.0)
    return _Keyed(crane, (packed.params._replace(plc=plc), tuple(sorted(packed.settings.items()))))


@functools.lru_cache(maxsize=256)
def _engine_loops(
    keyed: _Keyed, mode: Mode, places: tuple[Place, ...], delay: float
) -> tuple[tuple[Place, SampledLoop], ...]:
    points = engine_points(keyed.machine, mode, places)
    pairs = zip(places, points, strict=True)
    return tuple((place, engine_loop(point, delay=delay)) for place, point in pairs if point is not None)


def _of_engine(
    crane: Crane, mode: Mode, kept: tuple[float, float, float], wires: Sequence[float], load: float
) -> Governing:
    """The place of the running engine that allows the least gain, with a load that does not ring on its wire."""
    places, damped = slow_places(payloads_of_mode(crane, mode, load), wires), with_damped_wire(crane)
    return _engine_governing(_engine_key(damped, mode, places[0]), mode, places, kept)


@functools.lru_cache(maxsize=4096)
def _engine_governing(
    keyed: _Keyed, mode: Mode, places: tuple[Place, ...], kept: tuple[float, float, float]
) -> Governing:
    loops = engine_loops(keyed.machine, mode, places)
    found = [Governing(strongest_up_to(loop, *kept), loop, math.nan, place) for place, loop in loops]
    return min(found, key=lambda g: g.K_p)


@functools.lru_cache(maxsize=4096)
def _engine_swings(keyed: _Keyed, mode: Mode, places: tuple[Place, ...]) -> tuple[Place, ...]:
    return tuple(place for place, loop in engine_loops(keyed.machine, mode, places) if swings_alone(loop))


def swings_alone(loop: SampledLoop) -> bool:
    """Whether a loop oscillates without any position feedback."""
    return gain_limit_of(loop)[0] == 0.0


def _published(crane: Crane, mode: Mode, kept: tuple[float, float, float]) -> Governing:
    a, c = crane.active, crane.control
    key = (
        crane.inertia.J_m_eff,
        crane.i_hD,
        crane.drum.d_max,
        a.line,
        a.pump.D_total,
        a.pump.omega_p,
        a.pump.servo,
        a.motor.D_total,
    )
    cut = _cut(least_displacement(crane, mode), STEP)
    loop, K_p = _published_at(_Keyed(crane, (*key, a.C_leak, c.B_v, c.t_cycle, c.computing)), cut, kept)
    return Governing(K_p, loop, cut, None)


def _plant(crane: Crane, mode: Mode, place: Place, kept: tuple[float, float, float]) -> Governing | None:
    """The same of the plant. Where the law holds the motors still, whatever speed and load cell do, the loop
    depends on no setting but the displacement: it is kept between candidates."""
    station = _station(crane, place)
    at, plc = station.displacement(mode)(abs(place.v_tip)), plc_record(crane)
    stands = not moves(crane, mode) or at >= 1.0
    seen: Any = plc._replace(gains=None, motors=None, t_lead=0.0) if stands else plc  # type: ignore[arg-type]
    alpha = _cut(at, STEP_PLANT) if stands else at
    params = station.winch.params._replace(plc=None)
    loop, K_p = _plant_at(_Keyed((crane, station), (params, station.winch.geometry, place, seen)), mode, alpha, kept)
    return None if loop is None else Governing(K_p, loop, alpha, place)


def _cut(alpha: float, step: float) -> float:
    return max(math.floor(alpha / step + 1e-9) * step, step)


def _station(crane: Crane, place: Place) -> Station:
    if not (math.isfinite(place.v_tip) and place.v_tip != 0.0):
        raise StillhookError(f"v_tip = {place.v_tip:g} m/s: a winch at rest sticks. Give a finite speed that is not 0.")
    return Station(crane, place.load, place.s_w, Direction.LOWERING if place.v_tip > 0.0 else Direction.HOISTING)


class _Keyed:
    """A machine as a loop sees it: equal where its loop is equal, whatever its settings."""

    def __init__(self, machine: Any, key: tuple[Any, ...]) -> None:
        self.machine, self.key = machine, key

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Keyed) and self.key == other.key


@functools.lru_cache(maxsize=4096)
def _published_at(keyed: _Keyed, alpha: float, kept: tuple[float, float, float]) -> tuple[SampledLoop, float]:
    control = keyed.machine.control
    loop = sampled(position_loop(keyed.machine, alpha), control.t_cycle, control.computing)
    return loop, strongest_up_to(loop, *kept)


@functools.lru_cache(maxsize=4096)
def _plant_at(
    keyed: _Keyed, mode: Mode, alpha: float, kept: tuple[float, float, float]
) -> tuple[SampledLoop | None, float]:
    crane, station = keyed.machine
    loop = _loop(crane, station, mode, keyed.key[2].v_tip, alpha)
    return (None, math.inf) if loop is None else (loop, strongest_up_to(loop, *kept))


def least_displacement(crane: Crane, mode: Mode) -> float:
    """Smallest displacement of the motors that this law may use on the outermost layer, where the margins are least
    [-]."""
    return min(motor_law(crane, mode)(u_ff) for u_ff in (0.0, 1.0))


class SlowLimit(NamedTuple):
    """Least gain limit K_p_ms with PLC [1/m] among slow speeds of either sign; tip speed [m/s] and displacement [-] of
    that point, its payload [kg] and wire paid out [m]."""

    K_p_ms: float
    v_tip: float
    alpha_m: float
    load: float
    s_w: float

    @property
    def place(self) -> Place:
        """Operating point of the plant."""
        return Place(self.load, self.s_w, self.v_tip)


def slow_limit(
    crane: Crane, mode: Mode, *, load: float | None = None, s_w: float | None = None, delay: float = 0.0
) -> SlowLimit | None:
    """The position gain with which the winch oscillates at low speed in this mode; None where no slow point can be
    held.

    The published loop has a viscous coefficient instead of friction and does not know of this: break-away friction
    falls with speed, which takes damping away, most where a small displacement makes pressure per torque large. SSC is
    at full displacement there, HS is not.
    Parameters: load payload [kg], default empty hook and the heaviest that the mode carries; s_w wire paid out [m],
    default short, middle and long wire; delay of the position feedback [s].
    The load does not ring on its wire here; its oscillation whatever the gain is in
    `stillhook.analysis.loop_stability.governing.Governing.swings`. Valid: small oscillations about a sliding winch;
    beyond the limit they grow to a limit cycle of stick and slip.
    """
    machine = with_damped_wire(crane)
    wires = wire_range(machine) if s_w is None else (s_w,)
    places = slow_places(payloads_of_mode(machine, mode) if load is None else (load,), wires)
    if by_engine(crane):
        found = engine_loops(machine, mode, places, delay=delay)
        return min(SlowLimit(gain_limit_of(l)[0], p.v_tip, math.nan, p.load, p.s_w) for p, l in found)
    limits = []
    for place in places:
        loop = plant_loop_at(machine, mode, place, delay=delay)
        if loop is not None:
            limits.append(
                SlowLimit(
                    K_p_ms=gain_limit_of(loop.loop)[0],
                    v_tip=place.v_tip,
                    alpha_m=loop.alpha_m,
                    load=place.load,
                    s_w=place.s_w,
                )
            )
    return min(limits, default=None)


__all__ = ["SLOW", "SlowLimit", "slow_limit"]
