"""Stability over one quantity: sweeps of the published loop and of the complete plant, and Bode data."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.governing import PAPER_C, place_limits, with_wire_damping
from stillhook.analysis.loop_stability.loops import sampled
from stillhook.analysis.loop_stability.places import payloads_of_mode, places_of
from stillhook.analysis.loop_stability.stability import Stability, stability
from stillhook.analysis.loop_stability.transfer import position_loop
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import CLASSIC, DEFAULT_MODE
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.spec.crane import Crane
from stillhook.units import KINDS
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


class Over(StrEnum):
    """What a sweep goes over."""

    ALPHA_M = "alpha_m"
    LAYER = "layer"
    LEAKAGE = "leakage"
    DAMPING = "damping"
    BULK_MODULUS = "bulk_modulus"
    DELAY = "delay"


TIMES = np.geomspace(0.25, 4.0, 17)
"""Default of those sweeps: the crane's own number times these. No source: wide enough for wear, aeration and a poor
guess."""


class Axis(NamedTuple):
    """What varies along a sweep: name in the nomenclature, kind of quantity ("": a pure number), label of pictures,
    default values for a crane [SI], and the number of the crane that it changes, as a dotted path."""

    name: str
    kind: str
    label: str
    default: Callable[[Crane], FloatArray]
    path: str = ""


AXES: Mapping[Over, Axis] = {
    Over.ALPHA_M: Axis("alpha_m", "", "motor displacement [-]", lambda crane: np.linspace(0.05, 1.0, 39)),
    Over.LAYER: Axis("layer", "", "layer", lambda crane: np.arange(1.0, crane.drum.layers + 1.0)),
    Over.LEAKAGE: Axis(
        "C_leak", "leakage", "leakage [L/min/bar]", lambda crane: crane.active.C_leak * TIMES, "active.C_leak"
    ),
    Over.DAMPING: Axis(
        "B_v",
        "viscous_torque",
        "viscous friction B_v [N m s/rad]",
        lambda crane: crane.control.B_v * TIMES,
        "control.B_v",
    ),
    Over.BULK_MODULUS: Axis(
        "bulk_modulus",
        "pressure",
        "bulk modulus [bar]",
        lambda crane: crane.active.line.bulk_modulus * TIMES,
        "active.line.bulk_modulus",
    ),
    Over.DELAY: Axis("delay", "time", "delay of the position feedback [s]", lambda crane: np.linspace(0.0, 1.0, 41)),
}
SWEPT = (
    "K_p_ms",
    "omega_c",
    "omega_0",
    "zeta",
    "gain_margin",
    "phase_margin",
    "delay_margin",
    "sensitivity_peak",
    "K_p_ms_plc",
    "gain_margin_plc",
    "phase_margin_plc",
    "delay_margin_plc",
    "sensitivity_peak_plc",
)


SWEPT_WIRE = 100.0
"""Wire paid out in sweeps of the slow plant [m]: that of the usual scenarios."""
SWEPT_SPEEDS = (2.0 / 60.0, 5.0 / 60.0)
"""Tip speeds of them [m/s], both directions."""


def slow_sweep(
    crane: Crane,
    values: Sequence[float] | None = None,
    *,
    loads: Sequence[float] | None = None,
    delay: float = 0.0,
) -> xarray.Dataset:
    """Gain limit of the complete plant with PLC where it is slow, over the wire's damping (the crane's own and that of
    paper C), displacement and payload, with 100 m of wire paid out: the least of 2 and 5 m/min up and down.

    Parameters: values displacements [-], default from 0.8 alpha_min to 1; loads payloads [kg], default empty hook, 60 %
    of the SWL (the most that HS carries) and SWL; delay [s].
    Returns: Dataset over ("wire_zeta", "alpha_m", "load") with K_p_ms_plc [1/m], 0 where the winch oscillates without
    feedback, NaN where nothing holds the load.
    """
    import xarray

    alphas = np.linspace(0.8 * crane.active.motor.alpha_min, 1.0, 14) if values is None else np.asarray(values)
    heaviest = payloads_of_mode(crane, CLASSIC[-1], shares=(0.0, 1.0))
    masses = (*heaviest, crane.SWL) if loads is None else tuple(loads)
    dampings = (crane.wire.zeta, PAPER_C)
    limits = np.full((len(dampings), len(alphas), len(masses)), math.nan)
    for at in np.ndindex(limits.shape):
        h, i, j = at
        machine = with_wire_damping(crane, dampings[h])
        places = places_of(masses[j : j + 1], (SWEPT_WIRE,), SWEPT_SPEEDS)
        with contextlib.suppress(StillhookError):
            result = place_limits(machine, DEFAULT_MODE, places, alpha_m=float(alphas[i]), delay=delay)
            limits[at] = min(0.0 if p.gains.alone else p.gains.high for p in result)
    coords = {"wire_zeta": list(dampings), "alpha_m": alphas, "load": list(masses)}
    data = {"K_p_ms_plc": (tuple(coords), limits, attributes("K_p_ms_plc"))}
    attrs = {"crane": crane.name, "delay": delay, "s_w": SWEPT_WIRE}
    return xarray.Dataset(data, coords={n: (n, v, attributes(n)) for n, v in coords.items()}, attrs=attrs)


def sweep(
    crane: Crane,
    over: Over | str = Over.ALPHA_M,
    values: Sequence[float] | None = None,
    *,
    alpha_m: float = 1.0,
    delay: float = 0.0,
) -> xarray.Dataset:
    """Gain limit, eigenfrequency, damping and margins of the published loop over one quantity.

    Parameters: over "alpha_m", "layer", "leakage" (C_leak), "damping" (B_v), "bulk_modulus" or "delay"; values in SI,
    default a range about the crane's own; alpha_m of the sweeps over something else [-]; delay [s].
    Returns: Dataset over that quantity, variables as in `Stability`.
    Errors: StillhookError for an unknown quantity or a value outside its range.
    """
    import xarray

    if over not in tuple(Over):
        raise StillhookError(f'over = "{over}": choose one of {", ".join(Over)}.')
    variable = Over(over)
    name = AXES[variable].name
    at = np.asarray(AXES[variable].default(crane) if values is None else list(values), dtype=np.float64)
    rows = [_swept(crane, variable, float(v), alpha_m, delay) for v in at]
    data = {n: (name, [getattr(r, n) for r in rows], attributes(n)) for n in SWEPT}
    fixed = {} if variable is Over.ALPHA_M else {"alpha_m": alpha_m}
    fixed |= {} if variable is Over.DELAY else {"delay": delay}
    return xarray.Dataset(
        data,
        coords={name: (name, at, attributes(name))},
        attrs={"crane": crane.name, "K_p": crane.control.K_p, **fixed},
    )


def _swept(crane: Crane, variable: Over, value: float, alpha_m: float, delay: float) -> Stability:
    axis, machine = AXES[variable], crane
    if axis.path:
        changes: Any = f"{value!r} {KINDS[axis.kind].si}"
        for name in reversed(axis.path.split(".")):
            changes = {name: changes}
        machine = changed(crane, changes)
    return stability(
        machine,
        value if variable is Over.ALPHA_M else alpha_m,
        layer=int(value) if variable is Over.LAYER else None,
        delay=value if variable is Over.DELAY else delay,
        strong=False,
    )


def bode(crane: Crane, alpha_m: float = 1.0, *, delay: float = 0.0, omega: FloatArray | None = None) -> xarray.Dataset:
    """Magnitude [-] and unwrapped phase [rad] of the cut loop at the crane's K_p over omega [rad/s]: continuous, and
    with PLC and delay."""
    import xarray

    plain = position_loop(crane, alpha_m)
    with_plc = sampled(plain, crane.control.t_cycle, delay + crane.control.computing)
    w = np.geomspace(0.01, with_plc.nyquist * 0.999, 1200) if omega is None else np.asarray(omega, dtype=np.float64)
    data = {}
    for end, loop in (("", plain), ("_plc", with_plc)):
        L = crane.control.K_p * loop.response(w)
        data[f"loop_gain{end}"] = ("omega", np.abs(L), attributes(f"loop_gain{end}"))
        data[f"loop_phase{end}"] = ("omega", np.unwrap(np.angle(L)), attributes(f"loop_phase{end}"))
    fixed = {"crane": crane.name, "K_p": crane.control.K_p, "alpha_m": alpha_m, "delay": delay}
    return xarray.Dataset(data, coords={"omega": ("omega", w, attributes("omega"))}, attrs=fixed)
