"""The complete plant as a linear system at any operating point, by differences of its own equations, alone and closed
by the PLC.

The equations are those that a run integrates (`stillhook.winches`), with the rate of the bristle as an additional
state: stuck it is a spring, sliding it gives the slope of the Stribeck curve. Nothing of the published reduced model is
in here; the two are compared in docs/validation/paper-e-stability.md.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.differences import (
    STEP,
    Batch,
    cycles_at,
    jacobian,
    laws_after,
    numbers_of,
    rates_at,
    slopes,
    steady_tick,
    step_of,
)
from stillhook.analysis.loop_stability.loops import ContinuousLoop, Cycle, SampledLoop, balanced, closed_by_plc
from stillhook.analysis.steady.operating_point import OperatingPoint
from stillhook.base.arrays import FloatArray
from stillhook.base.extras import need
from stillhook.base.kept.identity import Keyed
from stillhook.control.plc import Memory
from stillhook.control.registry import DEFAULT_MODE, ControlLaw, code_of, mode_of_code
from stillhook.engine.arguments import SERIES_STEP, steps_of_cases
from stillhook.engine.pack.winch import controllers_of, losses_of, plc_record
from stillhook.engine.scenario.followed_law import FollowedLaw
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import StillhookError
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.lanes import VL, flatten, paths, unflatten
from stillhook.physics.hydraulics.swash import Servo
from stillhook.physics.load_path.drum import K_wire
from stillhook.spec.crane import Crane, content
from stillhook.spec.scenario import Mode, Scenario
from stillhook.units import show
from stillhook.winches.circuits.tables import NO_LIMIT
from stillhook.winches.records import Tip

if TYPE_CHECKING:
    import control


FREE = 100.0
"""Strokes of the displacement controls while differences are taken: an active motor at its stop then still has both
sides [-]."""
OUTPUTS = ("s_hoisted", "v_w", "omega_m", "alpha_p", "alpha_m", "p_a", "p_b", "dp_m", "F_w", "v_load")
TIP = ("s_tip", "v_tip")


@dataclass(frozen=True)
class Linear:
    """The plant about an operating point: A, B, C, D with the names of states, inputs and outputs (SI).

    States are those of the plant's State; inputs the commands u_p, u_m (and u_pp, u_pm) and the tip's s_tip, v_tip;
    outputs `OUTPUTS`, s_hoisted = -s_w. kinks: derivatives that are not the same on both sides ("p_b by alpha_p"),
    taken as the mean of both.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    kinks: tuple[str, ...]

    def system(self) -> control.StateSpace:
        """As a system of python-control. Errors: StillhookError where the extra `stability` is missing."""
        need("control", "system()", StillhookError)
        import control  # heavy: only where a system is wanted

        return control.ss(
            self.A, self.B, self.C, self.D, states=self.states, inputs=self.inputs, outputs=OUTPUTS, name="plant"
        )

    def modes(self) -> tuple[PlantMode, ...]:
        """Eigenvalues of the plant with damping and the states that take part, the slowest first; of a pair the one
        with the positive imaginary part."""
        poles, right = np.linalg.eig(self.A)
        weight = np.abs(right * np.linalg.pinv(right).T)
        weight /= weight.sum(axis=0)
        result = []
        for i in np.argsort(np.abs(poles)):
            p, size = complex(poles[i]), abs(complex(poles[i]))
            if p.imag >= 0.0:
                shares = tuple((self.states[k], float(weight[k, i])) for k in np.argsort(-weight[:, i]))
                result.append(PlantMode(p, size, -p.real / size if size else math.nan, shares))
        return tuple(result)


class PlantMode(NamedTuple):
    """pole [1/s], that with the positive imaginary part of a pair; omega_0 its magnitude [rad/s]; zeta damping ratio
    [-]; states that take part with the weight of each, the largest first (participation factors, which add up to 1)."""

    pole: complex
    omega_0: float
    zeta: float
    states: tuple[tuple[str, float], ...]

    def share(self, *names: str) -> float:
        """Weight of some states together [-]."""
        return sum(weight for name, weight in self.states if name in names)


def linearise(point: OperatingPoint) -> Linear:
    """A, B, C, D of the plant at an operating point, by central differences.

    Parameters
    ----------
    point : OperatingPoint
        It need not be one of steady operation: any state of the plant will do (`at_state`).

    Returns
    -------
    Linear
        The matrices [SI], with the names of states, inputs and outputs.

    Raises
    ------
    StillhookError
        Where the pumps are beyond their stop: nothing follows them there.

    Notes
    -----
    The drum's layer and effective radius stay constant, as within a PLC cycle. Valid for motions so small that no valve
    opens or closes, no stop is met, and a sliding winch continues to slide: near standstill, where the bristle may
    stick, that is a few micrometres of wire.
    """
    p, u_0 = _free_stops(point.params), point.command
    commands = tuple(n for n in u_0._fields if n.startswith("u_"))
    states, inputs = state_names(point), (*commands, *TIP)
    n, start, rates = len(states), *_rates(point, p, commands)

    def values(rows: FloatArray) -> FloatArray:
        outputs = [_outputs(point, _state(point, row[:n]), commands, row[n:], p) for row in rows]
        return np.hstack((rates(rows), outputs))

    steps = [step_of(name) for name in (*states, *inputs)]
    J, rough = jacobian(values, start, steps)
    names = [*(f"d{s}/dt" for s in states), *OUTPUTS]
    result = tuple(f"{names[i]} by {(*states, *inputs)[j]}" for i, j in rough)
    return Linear(J[:n, :n], J[:n, n:], J[n:, :n], J[n:, n:], states, inputs, result)


def _plant(point: OperatingPoint) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A and B by all commands as `linearise` has them, and the wire hoisted by state."""
    commands = tuple(n for n in point.command._fields if n.startswith("u_"))
    start, rates = _rates(point, _free_stops(point.params), commands)
    states = state_names(point)
    names, n = (*states, *commands, *TIP), len(states)
    J = slopes(rates, start, [step_of(name) for name in names])
    hoisted = np.array([-1.0 if name == "s_w" else 0.0 for name in states])
    return J[:, :n], J[:, n : n + len(commands)], hoisted


def _rates(point: OperatingPoint, p: Any, commands: tuple[str, ...]) -> tuple[FloatArray, Batch]:
    """States, commands and tip at the point, and time derivatives of all states by them."""
    if not point.reachable:
        raise StillhookError(
            f"the pump setting would have to be {point.alpha_p:.3g},"
            " beyond the stop; the plant is not linear there. Reduce the speed."
        )
    n, tip = len(state_names(point)), len(point.command)
    columns = [*range(n), *(n + point.command._fields.index(c) for c in commands), n + tip, n + tip + 1]
    instant = (point.state, point.command, point.tip, point.geometry, p)
    return np.array(numbers_of(instant))[columns], rates_at(point.driver, instant, columns)


def state_names(point: OperatingPoint) -> tuple[str, ...]:
    return tuple(path.rpartition(".")[2] for path in paths(type(point.state)))


def _state(point: OperatingPoint, values: Iterable[float]) -> Any:
    return unflatten(type(point.state), (float(v) for v in values))


def at_state(point: OperatingPoint, **changes: float) -> OperatingPoint:
    """The point with some fields of its state changed, such as two pressures above boost; it is then no
    steady one.

    Errors: StillhookError for a field that the state does not have.
    """
    names = state_names(point)
    if unknown := set(changes) - set(names):
        raise StillhookError(f"{', '.join(sorted(unknown))}: not a state. The plant has {', '.join(names)}.")
    values = dict(zip(names, flatten(point.state), strict=True)) | changes
    return point._replace(state=_state(point, values.values()))


def _outputs(point: OperatingPoint, x: Any, commands: tuple[str, ...], inputs: FloatArray, p: Any) -> list[float]:
    *u, s_tip, v_tip = (float(v) for v in inputs)
    geo, w = point.geometry, x.winch
    q = point.driver.path_point(x, geo, Tip(s_tip, v_tip), p)
    c = point.plant.circuit(w, q, point.command._replace(**dict(zip(commands, u, strict=True))), geo, p)
    return [-x.path.s_w, q.v_w, w.omega_m, c.alpha_p, c.alpha_m, w.p_a, w.p_b, w.p_a - w.p_b, q.F_w, x.path.v_load]


def _free_stops(p: Any) -> Any:

    def free(servo: Servo) -> Servo:
        return servo._replace(lo=-FREE, hi=FREE, rate=NO_LIMIT)

    circuits = {name: getattr(p, name) for name in ("active", "passive") if hasattr(p, name)}
    return p._replace(
        **{
            name: circuit._replace(pump_servo=free(circuit.pump_servo), motor_servo=free(circuit.motor_servo))
            for name, circuit in circuits.items()
        }
    )


def plant_loop(linear: Linear) -> ContinuousLoop:
    """The position loop of the complete plant at K_p = 1, without PLC, motors and passive circuit standing at their
    commands (as paper E)."""
    B = linear.B[:, linear.inputs.index("u_p")]
    return balanced(linear.A, B, linear.C[OUTPUTS.index("s_hoisted")])


SEA, SEA_TIME, SEA_GAIN = "sine 0.7 m 9 s", 120.0, 0.1
"""Motion of the tip in which a controller learns, for how long [s], and with which K_p [1/m]."""
SETTLING = 50
"""PLC cycles at the point before it is linearised, at the least, for filters of what is measured."""


def settling_cycles(law: ControlLaw, t_cycle: float) -> int:
    """PLC cycles after which the filters have settled, and a law that comes in late acts as it goes on."""
    return max(SETTLING, math.ceil(law.begins / t_cycle))


LawMemory = tuple[float, ...] | None
"""What a controller remembers, in the order of its Memory; None: what it starts from."""
Hanging = tuple[float, float]
"""Payload [kg] on a wire of a length [m]."""


def learned(crane: Crane, mode: Mode, places: Iterable[Hanging]) -> Mapping[Hanging, LawMemory]:
    """What a controller that learns remembers after a time in a sea, with payloads on wires; None of any other. Of a
    small K_p, so that it does not depend on the gain that is looked for.

    Errors: StillhookError where the winch loses its numbers in that sea: nothing is known of its learned loop.
    """
    each = tuple(dict.fromkeys(places))
    if not mode.law.learns:
        return dict.fromkeys(each)
    calm = crane.model_copy(update={"control": crane.control.model_copy(update={"K_p": SEA_GAIN})})
    known = _known(Keyed(calm, (plc_record(calm), *content(calm).items())), mode)
    if missing := [at for at in each if at not in known]:
        known |= _learn(calm, mode, missing)
    return known


@functools.lru_cache(maxsize=64)
def _known(calm: Keyed, mode: Mode) -> dict[Hanging, LawMemory]:
    """What is known of a crane."""
    return {}


def _learn(crane: Crane, mode: Mode, places: Sequence[Hanging]) -> dict[Hanging, LawMemory]:
    time = SEA_TIME - crane.control.t_cycle  # a run has a PLC cycle at both of its ends
    case = Scenario(load="0 t", s_w="0 m", mode=mode, tip=SEA, duration=f"{time!r} s", warm_up="0 s")
    cases = [case.model_copy(update={"load": load, "s_w": s_w}) for load, s_w in places]
    step, lanes = steps_of_cases(crane, cases, SERIES_STEP), VL if len(cases) > 1 else 1
    runs = run_cases(crane, cases, step=step, lanes=lanes, keep=unchanged)
    if lost := next((run.case for run in runs if run.diverged), None):
        raise StillhookError(
            f'"{crane.name}": "{mode}" learns, and loses its numbers in a sea with {show(lost.load, "mass", 4)} on'
            f" {show(lost.s_w, 'length', 4)} of wire. Look at runs: stillhook run."
        )
    name = f"{mode.law.field}_memory"
    return {at: tuple(getattr(run.laws, name)) for at, run in zip(places, runs, strict=True)}


def plc_loop(
    crane: Crane,
    point: OperatingPoint,
    *,
    mode: Mode | str = DEFAULT_MODE,
    delay: float = 0.0,
    law_memory: LawMemory = None,
) -> SampledLoop:
    """The position loop of the complete plant as the crane's PLC closes it, at K_p = 1: all other loops closed and held
    for a cycle too.

    These are what the controller remembers of the feedback (an integral part), the motors' law through measured alpha_m
    and load cell, the feedforward of alpha_m to the pumps, and the passive circuit's torque control and make-up.
    law_memory is what the controller remembers, default what it starts from. delay [s] is that of the position feedback
    alone; all commands are the PLC's computing time late, and the dead time
    of their displacement controls.
    """
    names = [name for name in point.command._fields if name.startswith("u_")]
    return closed_by_plc(
        _plant(point),
        _control_slopes(_Plc(crane, point, Mode(mode), law_memory), crane),
        t_cycle=crane.control.t_cycle,
        late=lateness_of(crane, names),
        delay=delay,
    )


def lateness_of(crane: Crane, commands: Iterable[str]) -> FloatArray:
    """Time after which each command acts [s]: the PLC's computing time, and the dead time of a displacement control."""
    dead_times = crane.plant.type.dead_times(crane)
    return np.array([crane.control.computing + dead_times.get(name, 0.0) for name in commands])


REMEMBERED = ("F", "p_mean", "u_m")
"""What the PLC carries from cycle to cycle: filtered load cell, mean accumulator pressure, the motors' last command;
and what the controller remembers."""


def remembering(laws: Any, mode: Mode, law_memory: LawMemory) -> Any:
    """What controllers carry, with the memory of one."""
    if law_memory is None:
        return laws
    name = f"{mode.law.field}_memory"
    return laws._replace(**{name: type(getattr(laws, name))(*law_memory)})


class _Plc:
    """The PLC's cycle about an operating point, with the controller of a mode in force."""

    def __init__(self, crane: Crane, point: OperatingPoint, mode: Mode, law_memory: LawMemory = None) -> None:
        extra_controllers, settings = controllers_of(crane, (mode,))
        self.point, self.tick, self.winch = point, steady_tick(mode, *point.tip), crane.plant.type
        self.driver = driver(crane.plant.value, 1, Setup(losses=losses_of(crane)), extra_controllers)
        self.laws = self.driver.laws.blank(settings)._replace(code=code_of(mode))
        self.laws = remembering(self.laws, mode, law_memory)
        self.carried = [i for i, path in enumerate(paths(type(self.laws))) if "_memory." in path]

    def memory(self, alpha_m: float) -> Memory:
        """Memory at rest with the motors at alpha_m [-]."""
        p_mean = self.winch.mean_pressure(self.point.state.winch, self.point.params)
        at_rest = Memory(*(0.0,) * len(Memory._fields))
        return at_rest._replace(
            mode=self.tick.mode, F=self.point.F_w, p_mean=p_mean, u_m=alpha_m, held=alpha_m, stroke=1.0
        )


def _control_slopes(plc: _Plc, crane: Crane) -> Cycle:
    """Commands and memory of a cycle by state and memory before it, K_p = 0, and by the feedback: rows as the commands,
    and as `REMEMBERED` with what the controller carries."""
    point, settings = plc.point, plc_record(crane)
    p = _free_stops(point.params)._replace(plc=settings._replace(gains=settings.gains._replace(K_p=0.0)))
    memory = plc.memory(point.u_m)
    before = (point.state, memory, plc.laws, plc.tick, point.tip, point.geometry, p)
    law = mode_of_code(plc.tick.mode).law
    plc.laws = laws_after(plc.driver, before, settling_cycles(law, settings.t_cycle))
    before = (point.state, memory, plc.laws, plc.tick, point.tip, point.geometry, p)
    states, numbers = state_names(point), np.array(numbers_of(before))
    n, u, fields = len(states), len(point.command), memory._fields
    remembered = [fields.index(r) for r in REMEMBERED] + [len(fields) + i for i in plc.carried]
    varied = [*range(n), *(n + i for i in remembered)]
    given = [i for i, name in enumerate(point.command._fields) if name.startswith("u_")]
    results = [*given, *(u + i for i in remembered)]
    steps = [STEP["u"] * max(1.0, abs(numbers[n + len(fields) + i])) for i in plc.carried]
    J = slopes(
        cycles_at(plc.driver, before, varied),
        numbers[varied],
        [*(step_of(name) for name in states), STEP["F"], STEP["p"], STEP["u"], *steps],
    )[results]
    by_feedback = _law_slopes(crane, point, law, getattr(plc.laws, f"{law.field}_memory", None))
    g = np.array([by_feedback[0].get(name, 0.0) for name in (n for n in point.command._fields if n.startswith("u_"))])
    h = np.array([*(0.0,) * len(REMEMBERED), *by_feedback[1]])
    return Cycle(J[: len(given)], J[len(given) :], g, h)


FEEDBACK_STEP, FEEDBACK_DIGITS = 1e-3, 9
"""Half width of the differences by the feedback [-], and decimals that are certain: a law that adds it to the
command has exactly 1."""


def _law_slopes(
    crane: Crane, point: OperatingPoint, law: ControlLaw, memory: Any
) -> tuple[dict[str, float], list[float]]:
    """What a law demands of pumps and motors, by name, and what it remembers, by the position feedback, with a memory
    (None of a law without): of the law alone, for pumps at their stop follow nothing."""
    ratio = float(K_wire(point.geometry.d, point.params.hoist.drum))
    at = {"F": point.F_w, "K_wire": ratio, "alpha_m": point.alpha_m, "v_tip": point.tip.v}
    followed = FollowedLaw(crane, law, **at)
    u_ff = -followed.plc.gains.K_1 * point.tip.v * ratio * point.alpha_m
    (more, kept_more), (less, kept_less) = (followed.after(u, memory, u_ff) for u in (FEEDBACK_STEP, -FEEDBACK_STEP))

    def slope(a: float, b: float) -> float:
        return float(np.round((a - b) / (2.0 * FEEDBACK_STEP), FEEDBACK_DIGITS))

    demands = {name: slope(getattr(more, name), getattr(less, name)) for name in ("u_p", "u_m")}
    return demands, [slope(a, b) for a, b in zip(kept_more or (), kept_less or (), strict=True)]


def settled_displacement(crane: Crane, point_at: Callable[[float], OperatingPoint], mode: Mode | str) -> OperatingPoint:
    """The operating point at which a mode's own law holds the motors where they are.

    point_at gives the point at a displacement [-]. Errors: as point_at.
    """
    lo, hi = crane.active.motor.alpha_min, 1.0

    def wish(alpha_m: float) -> float:
        plc, at = _Plc(crane, point := point_at(alpha_m), Mode(mode)), (point.tip, point.geometry, point.params)
        return float(plc.driver.control(point.state, plc.memory(alpha_m), plc.laws, plc.tick, *at)[0].u_m)

    if wish(hi) >= hi:
        return point_at(hi)
    if wish(lo) <= lo:
        return point_at(lo)
    from scipy.optimize import brentq

    return point_at(float(brentq(lambda a: a - wish(a), lo, hi, xtol=1e-12, rtol=1e-13)))
