"""The position loop of any winch type out of its running engine: linearised where the winch compensates a slow tip.

No closed form of the thesis holds for these types. The engine itself is run until it is steady, and its equations and
the cycle of its PLC are then differentiated about the state that it has come to.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.differences import (
    STEP,
    cycles_at,
    laws_after,
    numbers_of,
    rates_at,
    slopes,
    steady_tick,
    step_of,
)
from stillhook.analysis.loop_stability.linearisation import LawMemory, lateness_of, remembering, settling_cycles
from stillhook.analysis.loop_stability.loops import Cycle, SampledLoop, closed_by_plc
from stillhook.analysis.loop_stability.places import has_cylinder
from stillhook.base.arrays import FloatArray
from stillhook.base.kept.identity import Keyed
from stillhook.control.registry import code_of
from stillhook.engine.arguments import STATISTICS_STEP, steps_of_cases
from stillhook.engine.pack.winch import drum_record, gains, pack
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import VL, flatten, paths
from stillhook.physics.load_path.drum import wire_usable
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Profile
from stillhook.spec.crane import Crane, content
from stillhook.spec.scenario import Mode, Scenario
from stillhook.winches.records import Tick, Tip

RISE, SETTLED = 5.0, 20.0
"""Time in which the tip reaches its speed, and after which the winch is taken to be steady [s]."""
STROKE_USED = 0.45
"""How far from its middle a stroke may be in a run [-], short of an end."""
OIL_USED = 0.3
"""Part of what an accumulator gives that a run may take [-]."""
SHIFT = 20.0
"""Time in which a stroke comes to where the run begins [s]."""
TRAVEL = 10.0
"""Most wire that moves until then [m]: layer and stiffness of the wire are then those of the place."""
SOFT = 2.0
"""Time constant of the position loop while the engine comes to a point [s]: soft against all loops of drive and PLC,
and fast enough to be settled."""
CALM = 0.95
"""Damping ratio of the wire while the engine comes to a point [-]: a steady point does not depend on it, and with the
crane's own a load that rings would still ring there."""
STORES = ("V_", "E", "theta")
"""How states begin that hold oil, energy or heat for many waves: they are constant while the loop is judged. A rail
whose pressure falls takes more oil for the same torque, so it falls faster; that is slow, and no oscillation."""
UNSETTLED = 0.05
"""Speed of load or wire against the tip's, over it, above which a point is not steady [-]."""
UNSETTLED_RATE = 0.15
"""Acceleration of the load over the tip's speed, above which it is not either [1/s]: a few times that of a wire that
grows longer, a third of that of a load which swings slowly by a twentieth of the speed."""
REMEMBERED = ("F", "p_mean", "u_m", "held")
"""What the PLC carries from cycle to cycle besides the memory of the controller: filtered load cell, mean accumulator
pressure, the motors' last command, and what the drive filters (the open circuit's pressure drop)."""


class EnginePoint(NamedTuple):
    """A winch that compensates a tip of constant speed: its driver and plant, and where the engine has come to. SI."""

    crane: Crane
    plant: ModuleType
    driver: Driver
    params: Any
    state: Any
    command: Any
    memory: Any
    laws: Any
    tick: Tick
    tip: Tip
    geometry: Any


def engine_points(
    crane: Crane,
    mode: Mode,
    places: Sequence[tuple[float, float, float, float]],
    memories: Sequence[LawMemory] | None = None,
) -> list[EnginePoint | None]:
    """The engine at places of payload [kg], wire paid out [m], speed of the tip, up positive [m/s], and where a stroke
    that limits the winch is: the tip from its middle, up positive, over the stroke [-]; None where the run
    diverges. memories: what the controller remembers at each, default what it starts from.

    The position feedback is soft, so that an unstable one does not hide the point. Slow states (oil in an accumulator,
    a store, a temperature) are where the run has left them.
    """
    soft = crane.control.model_copy(update={"K_p": gains(crane).K_1 / SOFT})
    calm = crane.wire.model_copy(update={"zeta": max(CALM, crane.wire.zeta)})
    softened = crane.model_copy(update={"control": soft})
    settling = softened.model_copy(update={"wire": calm})
    return [
        None if result.diverged else _point(softened, case, result, place, law_memory)
        for (case, result), place, law_memory in zip(
            _settled(Keyed(settling, tuple(content(settling).items())), mode, tuple(places)),
            places,
            memories or [None] * len(places),
            strict=True,
        )
    ]


@functools.lru_cache(maxsize=8)
def _settled(
    settling: Keyed, mode: Mode, places: tuple[tuple[float, float, float, float], ...]
) -> tuple[tuple[Scenario, Any], ...]:
    """Runs to places, with their results: the same for every damping of the wire up to `CALM`."""
    crane = settling.machine
    cases = [_case(crane, mode, *place) for place in places]
    n_sub = steps_of_cases(crane, cases, STATISTICS_STEP)
    results = run_cases(crane, cases, step=n_sub, lanes=VL if len(cases) > 1 else 1, keep=unchanged)
    return tuple(zip(cases, results, strict=True))


def _case(crane: Crane, mode: Mode, load: float, s_w: float, v_tip: float, at: float) -> Scenario:
    """A run that ends with s_w of wire out [m], or as near as the drum allows, and a stroke at its part `at` [-]. It is
    whole PLC cycles long, so that the tip is where the state of its end belongs to."""
    stroke, shift = _stroke(crane, load), 0.0
    before, t_cycle = 0.0 if stroke is None else SHIFT, crane.control.t_cycle
    duration = math.floor((before + _time(crane, load, v_tip, at)) / t_cycle + 1e-6) * t_cycle
    speed, time = f"{v_tip!r} m/s", duration - before
    moved = v_tip * (time - 0.5 * RISE)
    course = [(0.0, "0 m/s"), (RISE, speed), (time + RISE, speed), (time + 2.0 * RISE, "0 m/s")]
    if stroke is not None:
        shift = at * stroke - moved
        to_shift = f"{shift / (SHIFT - RISE)!r} m/s"
        course = [(0.0, "0 m/s"), (RISE, to_shift), (SHIFT - RISE, to_shift), (SHIFT, "0 m/s")] + [
            (SHIFT + t, v) for t, v in course[1:]
        ]
    start = min(max(s_w - moved - shift, 0.0), wire_usable(drum_record(crane)))
    tip = Profile([(f"{t!r} s", v) for t, v in course])
    return Scenario(
        load=f"{float(load)!r} kg",
        s_w=f"{float(start)!r} m",
        tip=tip,
        mode=mode,
        duration=f"{duration!r} s",
        warm_up="0 s",
        ramp="0 s",
    )


def _stroke(crane: Crane, load: float) -> float | None:
    """Motion of the tip that a compensating cylinder takes [m]; None without one."""
    stroke = crane.plant.type.stroke(crane, (load + crane.hook_mass) * G)
    return None if stroke is None or not has_cylinder(crane) else float(stroke.length)


def _time(crane: Crane, load: float, v_tip: float, at: float) -> float:
    """Time that a run takes to its point at constant speed [s]: less where the winch is fast, or a stroke ends (that of
    a cylinder, or what an accumulator gives)."""
    stroke = crane.plant.type.stroke(crane, (load + crane.hook_mass) * G)
    travel = TRAVEL
    if stroke is not None:
        used = STROKE_USED + math.copysign(at, at * v_tip) if has_cylinder(crane) else OIL_USED
        travel = used * float(stroke.length)
    return min(SETTLED, 0.5 * RISE + travel / abs(v_tip))


def has_time(crane: Crane, place: tuple[float, float, float, float]) -> bool:
    """Whether a run to a place is long enough to become steady: a fast one is not, nor one from near a stroke's end."""
    load, _, v_tip, at = place
    return _time(crane, load, v_tip, at) >= SETTLED


def _point(
    crane: Crane, case: Scenario, result: Any, place: tuple[float, float, float, float], law_memory: LawMemory
) -> EnginePoint:
    """Where a run has come to, with the commands of the next cycle."""
    packed = pack(crane, case)
    d = driver(packed.name, 1, Setup(losses=packed.setup.losses), packed.extra_controllers)
    laws = remembering(d.laws.blank(packed.settings)._replace(code=code_of(case.mode)), case.mode, law_memory)
    load, _, v_tip, at = place
    stroke = _stroke(crane, load)
    s_tip = v_tip * (case.duration - 0.5 * RISE) if stroke is None else at * stroke
    tick = steady_tick(case.mode, s_tip, v_tip)
    tip, geometry = Tip(s_tip, v_tip), d.geometry(result.state.path.s_w, packed.params)
    law = case.mode.law
    if law_memory is not None or law.begins > 0.0:
        before = (result.state, result.memory, laws, tick, tip, geometry, packed.params)
        laws = laws_after(d, before, settling_cycles(law, crane.control.t_cycle))
    # a second cycle on the first one's memory: the filters have the state that they are asked about
    u, memory, laws, _ = d.control(result.state, result.memory, laws, tick, tip, geometry, packed.params)
    return EnginePoint(crane, packed.plant, d, packed.params, result.state, u, memory, laws, tick, tip, geometry)


def settled(point: EnginePoint) -> bool:
    """Whether the engine has become steady: wire and load keep pace with the tip. A winch that sticks and slips even
    with a soft loop on a damped wire does not."""
    rates = point.driver.rates(point.state, point.command, point.geometry, point.tip, point.params).path
    tip = point.tip
    apart = max(abs(rates.s_w - tip.v), abs(point.state.path.v_load)) / abs(tip.v)
    return bool(apart < UNSETTLED and abs(rates.v_load) / abs(tip.v) < UNSETTLED_RATE)


class EngineLinear(NamedTuple):
    """The plant about a point: A by its states, B by all commands; names of both."""

    A: FloatArray
    B: FloatArray
    states: tuple[str, ...]
    commands: tuple[str, ...]


def engine_linear(point: EnginePoint) -> EngineLinear:
    """The equations of winch and load path differentiated about a point, the bristle as a state of its own."""
    states = tuple(path.rpartition(".")[2] for path in paths(type(point.state)))
    commands = tuple(point.command._fields)
    n, m = len(states), len(commands)
    start = np.array([*flatten(point.state), *point.command])
    names = (*states, *commands)
    steps = [step_of(name, value) for name, value in zip(names, start, strict=True)]
    instant = (point.state, point.command, point.tip, point.geometry, point.params)
    J = slopes(rates_at(point.driver, instant, range(n + m)), start, steps)
    return EngineLinear(J[:, :n], J[:, n:], states, commands)


def engine_loop(point: EnginePoint, *, delay: float = 0.0) -> SampledLoop:
    """The position loop at K_p = 1 as the PLC closes it; every other loop of drive and PLC is closed. delay [s] of the
    position feedback, to which the PLC's computing time and dead times are added."""
    linear = engine_linear(point)
    cycle = _control_slopes(point, linear.states)
    A, B, K, M = _standing(linear, cycle.commands, cycle.carried)
    out = np.zeros(len(linear.states))
    out[linear.states.index("s_w")] = -1.0
    cycle = cycle._replace(commands=K, carried=M)
    late = lateness_of(point.crane, linear.commands)
    return closed_by_plc((A, B, out), cycle, t_cycle=point.crane.control.t_cycle, late=late, delay=delay)


def _standing(
    linear: EngineLinear, K: FloatArray, M: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A, B and the slopes of the PLC with what is constant while the loop is judged: stores, and the stiffness of the
    wire, so that wire paid out and a load that follows leave no trace but the output."""
    names = linear.states
    stands = np.array([name.startswith(STORES) for name in names])
    A, B = linear.A.copy(), linear.B.copy()
    K, M = K.copy(), M.copy()
    for matrix in (A, K, M):
        matrix[:, names.index("s_w")] = matrix[:, names.index("s_load")]
        matrix[:, : len(names)][:, stands] = 0.0
    A[stands], B[stands] = 0.0, 0.0
    return A, B, K, M


def _control_slopes(point: EnginePoint, states: tuple[str, ...]) -> Cycle:
    """One PLC cycle: commands, and what is carried on, by state, by what was carried, and by the position feedback's
    share u_fb of the speed command.

    The soft feedback with which the point was come to stays in force, for commands need not be linear in the speed
    command (spool with overlap); what it makes of s_w is taken out by `_standing`.
    """
    before = (point.state, point.memory, point.laws, point.tick, point.tip, point.geometry, point.params)
    numbers, fields = np.array(numbers_of(before)), point.memory._fields
    n, u = len(states), len(point.command)
    carried = [i for i, path in enumerate(paths(type(point.laws))) if "_memory." in path]
    remembered = [fields.index(r) for r in REMEMBERED] + [len(fields) + i for i in carried]
    varied = [*range(n), *(n + i for i in remembered)]
    names = (*states, *REMEMBERED, *("" for _ in carried))
    start = numbers[varied]
    steps = [step_of(name, value) for name, value in zip(names, start, strict=True)]
    results = [*range(u), *(u + i for i in remembered)]
    J = slopes(cycles_at(point.driver, before, varied), start, steps)[results]
    h, K_p, datum = STEP["u"], point.params.plc.gains.K_p, point.memory.datum
    moved = np.array([[datum - h / K_p], [datum + h / K_p]])
    more, less = cycles_at(point.driver, before, [n + fields.index("datum")])(moved)[:, results]
    by_feedback = (more - less) / (2.0 * h)
    by_feedback[u : u + len(REMEMBERED)] = 0.0
    return Cycle(J[:u], J[u:], by_feedback[:u], by_feedback[u:])
