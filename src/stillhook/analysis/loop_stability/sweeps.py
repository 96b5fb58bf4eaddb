"""Stability over one quantity: sweeps of the published loop and of the complete plant, Bode data, root locus."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.loop_stability.governing import (
    SHORTEST,
    WIRES,
    payloads_of_mode,
    plant_loop_at,
    slow_places,
    with_damped_wire,
)
from stillhook.analysis.loop_stability.margins import gain_limit_of
from stillhook.analysis.loop_stability.models.reduced import gain_limit
from stillhook.analysis.loop_stability.models.transfer import position_loop, sampled
from stillhook.analysis.loop_stability.stability import Stability, published_stability
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import CLASSIC, DEFAULT_MODE
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.spec.crane import Crane
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


VARIED = {Over.LEAKAGE: "C_leak", Over.DAMPING: "B_v", Over.BULK_MODULUS: "bulk_modulus"}
"""Name, in the nomenclature, of the crane's number that a sweep changes."""
TIMES = np.geomspace(0.25, 4.0, 17)
"""Default of those sweeps: the crane's own number times these. No source: wide enough for wear, aeration and a poor
guess."""
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


def slow_sweep(
    crane: Crane,
    values: Sequence[float] | None = None,
    *,
    loads: Sequence[float] | None = None,
    wires: Sequence[float] = (SHORTEST, *WIRES),
    delay: float = 0.0,
) -> xarray.Dataset:
    """Gain limit of the complete plant with PLC where it is slow, over displacement, payload and wire paid out: the
    least of 2 and 5 m/min up and down.

    Parameters: values displacements [-], default from 0.8 alpha_min to 1; loads payloads [kg], default empty hook, 60 %
    of the SWL (the most that HS carries) and SWL; wires [m]; delay [s].
    Returns: Dataset over ("alpha_m", "load", "s_w") with K_p_ms_plc [1/m], 0 where the winch oscillates without
    feedback, NaN where nothing holds the load.
    """
    import xarray

    alphas = (
        np.linspace(0.8 * crane.active.motor.alpha_min, 1.0, 14)
        if values is None
        else np.asarray(list(values), dtype=np.float64)
    )
    masses = (*payloads_of_mode(crane, CLASSIC[-1]), crane.SWL) if loads is None else tuple(loads)
    limits, still = np.full((len(alphas), len(masses), len(wires)), math.nan), with_damped_wire(crane)
    for at in np.ndindex(limits.shape):
        i, j, k = at
        slow = [
            plant_loop_at(still, DEFAULT_MODE, p, alpha_m=float(alphas[i]), delay=delay)
            for p in slow_places(masses[j : j + 1], wires[k : k + 1])
        ]
        limits[at] = min((gain_limit_of(s.loop)[0] for s in slow if s is not None), default=math.nan)
    coords = {"alpha_m": alphas, "load": list(masses), "s_w": list(wires)}
    data = {"K_p_ms_plc": (tuple(coords), limits, attributes("K_p_ms_plc"))}
    return xarray.Dataset(
        data, coords={n: (n, v, attributes(n)) for n, v in coords.items()}, attrs={"crane": crane.name, "delay": delay}
    )


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
    name = VARIED.get(variable, variable.value)
    at = np.asarray(_default(crane, variable) if values is None else list(values), dtype=np.float64)
    rows = [_swept(crane, variable, float(v), alpha_m, delay) for v in at]
    data = {n: (name, [getattr(r, n) for r in rows], attributes(n)) for n in SWEPT}
    fixed = {} if variable is Over.ALPHA_M else {"alpha_m": alpha_m}
    fixed |= {} if variable is Over.DELAY else {"delay": delay}
    return xarray.Dataset(
        data,
        coords={name: (name, at, attributes(name))},
        attrs={"crane": crane.name, "K_p": crane.control.K_p, **fixed},
    )


def _default(crane: Crane, variable: Over) -> FloatArray:
    nominal = {
        Over.LEAKAGE: crane.active.C_leak,
        Over.DAMPING: crane.control.B_v,
        Over.BULK_MODULUS: crane.active.line.bulk_modulus,
    }
    if variable in nominal:
        return np.asarray(nominal[variable] * TIMES, dtype=np.float64)
    if variable is Over.LAYER:
        return np.arange(1.0, crane.drum.layers + 1.0)
    return np.linspace(0.0, 1.0, 41) if variable is Over.DELAY else np.linspace(0.05, 1.0, 39)


def _swept(crane: Crane, variable: Over, value: float, alpha_m: float, delay: float) -> Stability:
    if variable is Over.ALPHA_M:
        return published_stability(crane, value, None, 0.0, delay, strong=False)
    if variable is Over.LAYER:
        return published_stability(crane, alpha_m, int(value), 0.0, delay, strong=False)
    if variable is Over.DELAY:
        return published_stability(crane, alpha_m, None, 0.0, value, strong=False)
    changes: dict[Over, Mapping[str, Any]] = {
        Over.LEAKAGE: {"active": {"C_leak": f"{value!r} m^3/s/Pa"}},
        Over.DAMPING: {"control": {"B_v": f"{value!r} N m s/rad"}},
        Over.BULK_MODULUS: {"active": {"line": {"bulk_modulus": f"{value!r} Pa"}}},
    }
    return published_stability(changed(crane, changes[variable]), alpha_m, None, 0.0, delay, strong=False)


def bode(
    crane: Crane, alpha_m: float = 1.0, *, K_wire: float = 1.0, delay: float = 0.0, omega: FloatArray | None = None
) -> xarray.Dataset:
    """Magnitude [-] and unwrapped phase [rad] of the cut loop at the crane's K_p over omega [rad/s]: continuous, and
    with PLC and delay."""
    import xarray

    plain = position_loop(crane, alpha_m, K_wire=K_wire)
    with_plc = sampled(plain, crane.control.t_cycle, delay + crane.control.computing)
    w = np.geomspace(0.01, with_plc.nyquist * 0.999, 1200) if omega is None else np.asarray(omega, dtype=np.float64)
    data = {}
    for end, loop in (("", plain), ("_plc", with_plc)):
        L = crane.control.K_p * loop.response(w)
        data[f"loop_gain{end}"] = ("omega", np.abs(L), attributes(f"loop_gain{end}"))
        data[f"loop_phase{end}"] = ("omega", np.unwrap(np.angle(L)), attributes(f"loop_phase{end}"))
    fixed = {"crane": crane.name, "K_p": crane.control.K_p, "alpha_m": alpha_m, "delay": delay}
    return xarray.Dataset(data, coords={"omega": ("omega", w, attributes("omega"))}, attrs=fixed)


def root_locus(
    crane: Crane, alpha_m: float = 1.0, *, K_wire: float = 1.0, K_p: Sequence[float] | None = None
) -> xarray.Dataset:
    """Poles of the published position loop [1/s] over K_p [1/m], each followed along its branch: real and imaginary
    part."""
    import xarray

    loop = position_loop(crane, alpha_m, K_wire=K_wire)
    limit = gain_limit(crane, alpha_m, K_wire).K_p_ms
    at = (
        np.concatenate([[0.0], np.geomspace(1e-3, 3.0, 200) * limit])
        if K_p is None
        else np.asarray(list(K_p), dtype=np.float64)
    )
    poles = [np.sort_complex(loop.closed_poles(float(at[0])))]
    for K in at[1:]:
        poles.append(_followed(poles[-1], loop.closed_poles(float(K))))
    P = np.array(poles)
    names = {"pole_re": P.real, "pole_im": P.imag}
    data = {n: (("K_p", "branch"), v, attributes(n)) for n, v in names.items()}
    return xarray.Dataset(
        data, coords={"K_p": ("K_p", at, attributes("K_p"))}, attrs={"crane": crane.name, "alpha_m": alpha_m}
    )


def _followed(before: NDArray[np.complex128], now: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Poles in the order of those before, each the nearest one."""
    from scipy.optimize import linear_sum_assignment

    _, order = linear_sum_assignment(np.abs(before[:, None] - now[None, :]))
    return np.asarray(now[order], dtype=np.complex128)
