"""What a caller gives to a run, checked and in numbers, and numbers of runs as columns of a Dataset.

Is the step short enough? Step times fastest eigenvalue of the packed plant, before anything runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from stillhook import units
from stillhook._version import __version__
from stillhook.engine.pack.winch import Packed, pack
from stillhook.errors import ScenarioError, SpecError
from stillhook.kernels.build import kernel_hash
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.load_path.drum import wire_damping
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.scenario import Scenario
from stillhook.variables import attributes
from stillhook.winches.interface import Stiffness
from stillhook.winches.load_path.load import Hoist, drum_geometry, shaft_inertia_without_wire

if TYPE_CHECKING:
    import xarray

RK4_LIMIT = 2.6
"""Largest |h lambda| that is accepted; the method itself is stable up to 2.785 (negative real axis) and 2.83 (imaginary
axis)."""

MOST_STEPS = 10000
"""Steps per PLC cycle beyond which a run would never end."""

SUBSTEPS = (1, 2, 4, 5, 8)
"""Times a power of ten: steps per cycle that give a step with few digits."""


def fastest_rates(packed: Packed, c: float | None = None) -> dict[str, float]:
    """Upper bounds of the fast modes that the Runge-Kutta step has to follow [1/s]; the bristle is stepped exactly.

    c damping of the wire [N s/m], default that of the load on it.
    """
    p = packed.params
    h, stiffness = p.hoist, packed.plant.stiffness(p)
    J = shaft_inertia_without_wire(h)
    rates = {
        **stiffness.rates,
        "bristle with its damping": (h.bristle.sigma_1 + (h.bristle.sigma_0 * J) ** 0.5) / J,
        **_hoist_rates(h, J, stiffness.n_max, float(wire_damping(h.s_w_0, h.load.m, h.wire)) if c is None else c),
        "viscous friction against the winch's inertia": (h.n_motors * h.friction.Y_5 + stiffness.viscous) / J,
    }
    if h.bristle.regular > 0.5:
        rates["regularised friction"] = dry_level_bound(packed) * h.bristle.i_omega_r * drum_geometry(packed.s_w, h).i_J
    return rates


def _hoist_rates(h: Hoist, J: float, n_max: float, c: float) -> dict[str, float]:
    """Wire, with its damping c [N s/m], and load, and drag at the highest speed that the motors can give the wire."""
    r_eff = 0.5 * h.drum.d_max * h.i_i
    k = h.wire.EA / (h.wire.L_0 + h.s_w_0)
    mass = 1.0 / (1.0 / h.load.m + r_eff**2 / J)
    return {
        "wire with its damping": c / mass + (k / mass) ** 0.5,
        "drag of the water": 2.0 * h.load.b * math.hypot(n_max * r_eff, h.load.U) * h.load.i_m,
    }


def dry_level_bound(packed: Packed) -> float:
    """Upper bound of the dry friction of the whole winch [N m]: at rest, motors at full displacement, active pressure
    at relief."""
    h = packed.params.hoist
    T_d = h.load.W * 0.5 * h.drum.d_max
    stiffness: Stiffness = packed.plant.stiffness(packed.params)
    return float(h.n_motors * system_friction_dry(0.0, T_d, h.friction) + stiffness.dry)


def substeps(t_cycle: float, longest: float) -> int:
    """Steps per PLC cycle for a step of at most `longest` [s]: the least number that gives a step with few digits."""
    least = math.ceil(min(t_cycle / longest, 1e12) * (1.0 - 1e-9))
    scale = 1
    while True:
        for part in SUBSTEPS:
            if part * scale >= least:
                return part * scale
        scale *= 10


def check_step(packed: Packed, step: float) -> None:
    """Refuse a step that the integration cannot follow. Errors: SpecError naming the fastest mode and the step to
    take."""
    name, rate = max(fastest_rates(packed).items(), key=lambda i: i[1])
    if rate * step <= RK4_LIMIT:
        return
    raise SpecError(
        f"step {step * 1e3:.3g} ms is too long for this crane: {name} has {rate:.0f} 1/s, step times rate"
        f" {rate * step:.2f} (allowed {RK4_LIMIT}). {step_advice(packed.params.plc.t_cycle, RK4_LIMIT / rate)}"
    )


def step_advice(t_cycle: float, longest: float) -> str:
    """What to do where a step of at most `longest` [s] is needed, in a sentence."""
    parts = substeps(t_cycle, longest)
    if parts > MOST_STEPS:
        return "Check the number behind it."
    return f'Use a step of "{t_cycle / parts * 1e3:.6g} ms" or less.'


Case = Scenario | Lowering | InSea
T = TypeVar("T", bound=Case)
SCENARIO = (Scenario,)
ANY_CASE = (Scenario, Lowering, InSea)
"""Classes of cases."""

SERIES_STEP = 2e-3
STATISTICS_STEP = 5e-3
"""Default steps [s]. Proven in docs/validation/step-size.md: within 0.1 mm of wire and 0.2 bar of peak pressure of a
0.1 ms reference."""

EVERY = 0.1
"""Default spacing of a stored series [s]."""

MOST_THREADS = 1024

_NO_CRANE = "crane = {}: not a Crane. Read one with load_crane, by name or path."


def paired(crane: Crane | Sequence[Crane], case: T | Sequence[T], kinds: Any = SCENARIO) -> tuple[list[Crane], list[T]]:
    """Cranes and cases in pairs; one of either is combined with all of the other. kinds: classes that a case may have.

    Errors: ScenarioError, SpecError.
    """
    if isinstance(crane, Crane) or not isinstance(crane, Iterable) or isinstance(crane, str):
        cases = checked_cases(crane, case, kinds)  # type: ignore[arg-type]
        return [crane] * len(cases), cases  # type: ignore[list-item]
    cranes = list(crane)
    if not cranes:
        raise SpecError("simulate: the list of cranes is empty. Give at least one Crane.")
    first = cranes[0]
    cases = checked_cases(first, case, kinds)
    for i, each in enumerate(cranes):
        if not isinstance(each, Crane):
            raise SpecError(_NO_CRANE.format(units.quote(each)))
        if each.plant is not first.plant or each.control.t_cycle != first.control.t_cycle:
            a, b = (f"{c.plant} with a PLC cycle of {units.show(c.control.t_cycle, 'time')}" for c in (first, each))
            raise SpecError(
                f'simulate: crane 0 "{first.name}" is {a}, crane {i} "{each.name}" {b}. Run winches of one kind'
                " together."
            )
    if isinstance(case, kinds):
        return cranes, cases * len(cranes)
    if len(cases) != len(cranes):
        raise ScenarioError(
            f"simulate: {len(cranes)} cranes and {len(cases)} cases. Give one case, or one for each crane."
        )
    return cranes, cases


def checked_cases(crane: Crane, case: T | Sequence[T], kinds: Any = SCENARIO) -> list[T]:
    """The cases as a list. Errors: ScenarioError, SpecError where something else was given."""
    if not isinstance(crane, Crane):
        raise SpecError(_NO_CRANE.format(units.quote(crane)))
    if isinstance(case, kinds):
        return [with_usual_controller(crane, case)]
    cases: list[Any] = list(case) if isinstance(case, Iterable) else [case]
    names = " or ".join(kind.__name__ for kind in kinds)
    if not cases:
        raise ScenarioError(f"simulate: the list of cases is empty. Give at least one {names}.")
    for i, each in enumerate(cases):
        if not isinstance(each, kinds):
            raise ScenarioError(f"case {i} = {units.quote(each)}: not a {names}. Give one {names}, or a list of them.")
    return [with_usual_controller(crane, each) for each in cases]


def with_usual_controller(crane: Crane, case: T) -> T:
    """The case with the usual controller of the crane's winch type where it names none and its default is for another
    kind of drive."""
    if isinstance(case, InSea):
        return replace(case, lift=with_usual_controller(crane, case.lift))  # type: ignore[return-value]
    name = "mode" if isinstance(case, Scenario) else "controller"
    winch = crane.plant.type
    if name in case.model_fields_set or getattr(case, name) in winch.modes:
        return case
    return case.model_copy(update={name: winch.default_mode})  # type: ignore[return-value]


def check_threads(threads: int) -> None:
    """Errors: ScenarioError where this is not a number of threads."""
    if type(threads) is not int or not 1 <= threads <= MOST_THREADS:
        raise ScenarioError(f"threads = {units.quote(threads)}: give a whole number from 1 to {MOST_THREADS}.")


def steps_per_cycle(crane: Crane, step: str | None, default: float = SERIES_STEP) -> int:
    """Steps per PLC cycle for a step given as text, or for the default [s] where there is none.

    Errors: ScenarioError where the step is not a whole part of the cycle.
    """
    t_cycle = crane.control.t_cycle
    if step is None:
        return substeps(t_cycle, default)
    h = units.parse(step, "time", "step")
    n = round(t_cycle / h) if h > 0.0 else 0
    if n < 1 or abs(n * h - t_cycle) > 1e-9 * t_cycle or n > MOST_STEPS:
        raise ScenarioError(
            f'step = "{step}" is not a whole part of the PLC cycle {units.show(t_cycle, "time")}. '
            f'Use for instance "{t_cycle / 5 * 1e3:g} ms" or "{t_cycle / 2 * 1e3:g} ms".'
        )
    return n


def steps_of_cases(crane: Crane | Sequence[Crane], cases: Sequence[Scenario], longest: float) -> int:
    """Steps per PLC cycle of at most `longest` [s] that the integration of every case can follow; crane that of all
    cases, or one for each."""
    cranes = [crane] * len(cases) if isinstance(crane, Crane) else crane
    pairs = zip(cranes, cases, strict=True)
    fastest = max((max(fastest_rates(pack(each, case)).values()) for each, case in pairs), default=0.0)
    least, t_cycle = steps_per_cycle(cranes[0], None, longest), cranes[0].control.t_cycle
    if not t_cycle * fastest <= MOST_STEPS * RK4_LIMIT:
        raise SpecError(
            f"step: the fastest mode has {fastest:.3g} 1/s, which takes more than {MOST_STEPS} steps in a PLC cycle of"
            f" {units.show(t_cycle, 'time')}. Check the number behind it, or give a step."
        )
    return max(least, substeps(t_cycle, RK4_LIMIT / fastest)) if fastest > 0.0 else least


def cycles(crane: Crane, every: str | None, name: str = "every") -> int:
    """PLC cycles in a spacing given as text, or in the default one; name of the argument. Errors: ScenarioError where
    it is not a whole number of them."""
    t_cycle = crane.control.t_cycle
    if every is None:
        return math.ceil(EVERY / t_cycle * (1.0 - 1e-9))
    dt = units.parse(every, "time", name)
    n = round(dt / t_cycle)
    if n < 1 or abs(n * t_cycle - dt) > 1e-9 * dt:
        raise ScenarioError(f'{name} = "{every}" is not a whole number of PLC cycles of {units.show(t_cycle, "time")}.')
    return n


def summary_columns(summaries: Sequence[Mapping[str, Any]], *, single: bool) -> dict[str, Any]:
    """Numbers of every run as variables of a Dataset, over "case" unless there is one run alone."""
    columns: dict[str, Any] = {}
    for name in summaries[0]:
        values = [("; ".join(s[name]) if name == "notes" else s[name]) for s in summaries]
        columns[name] = ((), values[0], attributes(name)) if single else (("case",), values, attributes(name))
    return columns


def labelled(
    columns: dict[str, Any],
    coords: dict[str, Any],
    attrs: Mapping[str, Any],
    *,
    step: float,
    single: bool,
    runs: Sequence[Any],
) -> xarray.Dataset:
    """Numbers of runs, and the series of those that have one, as a Dataset with what repeats the run; step [s]. Beyond
    the end of the shorter series is NaN."""
    import xarray  # heavy: not wanted for the command line's first table

    dt = max((run.dt for run in runs), default=0.0)
    if runs:
        names = next(run.signals for run in runs if run.signals)  # a refused case has none
        table = np.full((len(runs), max(len(run.series) for run in runs), len(names)), np.nan)
        for i, run in enumerate(runs):
            if run.signals:
                table[i, : len(run.series)] = run.series
        dims = ("time",) if single else ("case", "time")
        columns |= {
            name: (dims, table[0, :, j] if single else table[:, :, j], attributes(name)) for j, name in enumerate(names)
        }
        coords["time"] = "time", np.arange(table.shape[1]) * dt, {"units": "s", "long_name": "time"}
    repeats = {
        "single": int(single),
        "stillhook_version": __version__,
        "stillhook_kernel": kernel_hash(),
        "step": step,
        "every": dt,
    }
    return xarray.Dataset(columns, coords=coords, attrs={**attrs, **repeats})
