"""The frequency road: from seas, by tip, winch and wire, to the load's motion and tension; thousands of sea states at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import LiftError
from stillhook.response.forcing import Forcing
from stillhook.response.hung import Hung
from stillhook.response.linearise import QUANTITIES, answers, drag_of_gaussian
from stillhook.response.residual import Residual
from stillhook.response.statistics import (
    chance_below_zero,
    most_probable_maximum,
    rate_below_zero,
    share_below_zero,
    zero_crossing_period,
)
from stillhook.response.sums import over_frequency
from stillhook.sea.ship_motion import STANDARD_GRAVITY
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SPEEDS = np.geomspace(1e-4, 10.0, 36)
"""Deviations of the payload's speed through the water [m/s] at which everything is worked out; between them in logarithms, to 0.2 %."""
SLOW = np.geomspace(0.01, 8.0, 400)
"""Frequencies on which the remnant of the winch is taken to the load [rad/s]."""
BLOCK = 1024
"""Sea states that are worked out together at most."""
ALIKE = 1.3
"""Factor within which deviations of the tip's speed share one give of the winch, that of their middle."""
LEAST = 1e-300


class Sigmas(NamedTuple):
    """Standard deviations for n sea states: u wire's top end [m], u_rate its speed [m/s]; of `linearise.QUANTITIES` [m, m/s, N, N/s]; drag
    the linear drag of the payload [N s/m]."""

    u: FloatArray
    u_rate: FloatArray
    load: FloatArray
    load_rate: FloatArray
    relative: FloatArray
    top: FloatArray
    top_rate: FloatArray
    sling: FloatArray
    sling_rate: FloatArray
    drag: FloatArray


def road(
    forcing: Forcing, hung: Hung, residual: Residual, *, duration: float = 10800.0, names: Sequence[str] | None = None
) -> xarray.Dataset:
    """Statistics of tip, wire and load in every sea state, compensated and on the brake, as a Dataset over "case".

    Parameters
    ----------
    forcing: the seas at tip and load (`stillhook.response.forcing`).
    hung: what hangs, at one depth (`stillhook.response.hung.hung`).
    residual: what the winch leaves of the tip's motion; `Residual.constant(0.2)` for a compensation of 80 %.
    duration: time for which largest values and chances are told [s]. names: labels of the cases.

    Returns
    -------
    Dataset of names of `stillhook.variables`. A missing sea has NaN everywhere; in a calm one nothing moves.

    Valid while the wire stays taut (`slack_share` small), motions are Gaussian, and the payload is in air or wholly under water. Drag and
    winch are linearised at the deviation of the motion itself: seas of resonance against drag, and largest values under drag, are
    approximate (docs/explanation/frequency-road.md shows by how much). Errors: LiftError for a duration that is none.
    """
    import xarray  # heavy: only where results are labelled

    if not (math.isfinite(duration) and duration > 0.0):
        raise LiftError(f"duration {duration:g} s is not more than 0 s. Give the length of the operation.")
    known = np.isfinite(forcing.tip).all(axis=1)
    z, v, a = (forcing.deviation(order) for order in range(3))
    with_winch, braked = (sigmas(forcing, hung, which) for which in (residual, Residual.constant(1.0)))
    columns = {"sigma_z": z, "sigma_v": v, "sigma_a": a, "T_z": zero_crossing_period(z, v)}
    columns["z_mpm"] = most_probable_maximum(z, columns["T_z"], duration)
    columns["v_mpm"] = most_probable_maximum(v, zero_crossing_period(v, a), duration)
    columns["u_mpm"] = most_probable_maximum(with_winch.u, zero_crossing_period(with_winch.u, with_winch.u_rate), duration)
    columns |= {"sigma_u": with_winch.u, "eta_sigma_wire": _less(with_winch.u, z), "eta_sigma_load": _less(with_winch.load, z)}
    for suffix, s in (("", with_winch), ("_braked", braked)):
        columns |= {f"{name}{suffix}": values for name, values in _of_load(s, hung, duration).items()}
    labels = list(names) if names is not None else [str(i) for i in range(len(forcing))]
    data = xarray.Dataset(
        {name: ("case", np.where(known, values, np.nan), _attrs(name)) for name, values in columns.items()}, coords={"case": labels}
    )
    data.attrs = {"residual": residual.about, "duration": duration, "s_w": hung.s_w, "F_top": hung.F_top, "F_sling": hung.F_sling}
    return data


def _of_load(s: Sigmas, hung: Hung, duration: float) -> dict[str, FloatArray]:
    """What is told of load and tensions."""
    pairs = ((s.load, s.load_rate), (s.top, s.top_rate), (s.sling, s.sling_rate))
    T_load, T_top, T_sling = (zero_crossing_period(a, b) for a, b in pairs)
    rate = rate_below_zero(hung.F_sling, s.sling, T_sling)
    return {
        "sigma_load": s.load,
        "sigma_v_load": s.load_rate,
        "load_mpm": most_probable_maximum(s.load, T_load, duration),
        "sigma_F_top": s.top,
        "sigma_F_sling": s.sling,
        "F_top_mpm": hung.F_top + most_probable_maximum(s.top, T_top, duration),
        "DAF": (hung.F_sling + most_probable_maximum(s.sling, T_sling, duration)) / (hung.end.m * STANDARD_GRAVITY),
        "slack_share": share_below_zero(hung.F_sling, s.sling),
        "slack_rate": rate,
        "slack_chance": chance_below_zero(rate, duration),
    }


def _less(sigma: FloatArray, z: FloatArray) -> FloatArray:
    """1 - sigma/z; NaN where the tip stands still."""
    return 1.0 - np.divide(sigma, z, out=np.full_like(z, np.nan), where=z > 0.0)


def _attrs(name: str) -> dict[str, str]:
    row = BY_NAME[name.removesuffix("_braked")]
    braked = ", with the winch on its brake" if name.endswith("_braked") else ""
    return {"units": row.unit, "long_name": f"{row.meaning}{braked}"}


def sigmas(forcing: Forcing, hung: Hung, residual: Residual) -> Sigmas:
    """Standard deviations in every sea state; 0 in a calm one, NaN in a missing one.

    Drag and motion agree where the speed through the water with the drag of some speed has the deviation of that speed. That is looked for
    among `SPEEDS`, from above: with more drag there is less motion, so there is one such place.
    """
    n = len(forcing)
    out = np.full((len(Sigmas._fields), n), np.nan)
    v = forcing.deviation(1)
    out[:, v == 0.0] = 0.0
    trial = SPEEDS if hung.B > 0.0 else SPEEDS[:1]
    drag = hung.C_lin + drag_of_gaussian(hung.B, trial, hung.V)
    for rows in _blocks(v, residual):
        tables = _Tables(forcing, hung, drag, residual, float(np.sqrt(v[rows[0]] * v[rows[-1]])))
        for i in range(0, len(rows), BLOCK):
            out[:, rows[i : i + BLOCK]] = _block(forcing, rows[i : i + BLOCK], trial, drag, tables, residual)
    return Sigmas(*out)


def _blocks(v: FloatArray, residual: Residual) -> list[NDArray[np.intp]]:
    """Moving sea states by rising speed of the tip, in blocks of about the same speed where the give of the winch hangs on it."""
    rising = np.argsort(v, kind="stable")
    rising = rising[v[rising] > 0.0]
    if residual.give is None or not len(rising):
        return [rising] if len(rising) else []
    step = np.floor(np.log(v[rising] / v[rising[0]]) / math.log(ALIKE))
    return np.split(rising, np.flatnonzero(np.diff(step)) + 1)


class _Tables:
    """What every sea state shares: squared answers (s, m) by quantity for s drags, and answers to the remnant."""

    def __init__(self, forcing: Forcing, hung: Hung, drag: FloatArray, residual: Residual, sigma_v: float) -> None:
        def give(omega: FloatArray) -> ComplexArray:
            return np.zeros(len(omega), complex) if residual.give is None else residual.give.at(omega, sigma_v)

        at_drags = answers(forcing.omega, hung, drag[:, None], give(forcing.omega))
        self.by_u = {q: np.abs(a.u) ** 2 for q, a in at_drags.items()}
        self.waves = bool(np.any(hung.decay(forcing.omega) ** 2 > 1e-9))
        self.both = {q: 2.0 * a.u * np.conj(a.wave) for q, a in at_drags.items()} if self.waves else {}
        self.by_wave = {q: np.abs(a.wave) ** 2 for q, a in at_drags.items()} if self.waves else {}
        self.remnant: dict[str, FloatArray] = {}
        if residual.remnant is not None:
            slow = answers(SLOW, hung, drag[:, None], give(SLOW))
            self.remnant = {q: residual.remnant.integrated(np.abs(a.u) ** 2, SLOW) for q, a in slow.items()}
            self.remnant["u"] = residual.remnant.integrated(np.ones((1, len(SLOW))), SLOW)
            self.remnant["u_rate"] = residual.remnant.integrated(SLOW[None, :] ** 2, SLOW)


def _block(
    forcing: Forcing, rows: NDArray[np.intp], trial: FloatArray, drag: FloatArray, tables: _Tables, residual: Residual
) -> FloatArray:
    """Rows of `Sigmas` for some sea states, (10, len(rows))."""
    omega, tip = forcing.omega, forcing.tip[rows]
    v = np.sqrt(over_frequency(tip, omega[None, :] ** 2)[:, 0])
    T_z = 2.0 * np.pi * np.sqrt(tip.sum(axis=1)) / v
    C = residual.gaussian(omega, v)
    wire = np.abs(C) ** 2 * tip
    cross = C * forcing.cross[rows] if tables.waves else None

    def rest(name: str) -> FloatArray:
        return residual.remnant.at(tables.remnant[name], v, T_z) if residual.remnant is not None else np.zeros((len(rows), len(trial)))

    def variance(q: str, s: slice) -> FloatArray:
        """At some of the drags, in logarithms, (len(rows), s)."""
        total = over_frequency(wire, tables.by_u[q][s]) + rest(q)[:, s]
        if cross is not None:
            both = tables.both[q][s]
            total += over_frequency(cross.real, both.real) - over_frequency(cross.imag, both.imag)
            total += over_frequency(forcing.wave[rows], tables.by_wave[q][s])
        return np.asarray(np.log(np.maximum(total, LEAST)))

    place, share = _agreement(variance("relative", slice(None)), trial)
    own, used = np.arange(len(rows)), slice(int(place.min()), int(place.max()) + 2)
    low, high = place - used.start, np.minimum(place + 1, len(trial) - 1) - used.start
    fast = over_frequency(wire, omega[None, :] ** 2)[:, 0]
    out = [np.sqrt(wire.sum(axis=1) + rest("u")[:, 0]), np.sqrt(fast + rest("u_rate")[:, 0])]
    for q in QUANTITIES:
        y = variance(q, used)
        out.append(np.exp(0.5 * (y[own, low] + share * (y[own, high] - y[own, low]))))
    x = np.log(np.maximum(drag[used], LEAST))
    return np.array([*out, np.where(drag[place] > 0.0, np.exp(x[low] + share * (x[high] - x[low])), 0.0)])


def _agreement(y: FloatArray, trial: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Place among the trial speeds, and share of the next one, at which a speed and its answer agree; y (n, s) logarithms of variances."""
    if len(trial) == 1:
        return np.zeros(len(y), dtype=np.intp), np.zeros(len(y))
    gap = 0.5 * y - np.log(trial)
    faster = gap > 0.0  # the answer is faster than the trial speed
    last = len(trial) - 2
    place = np.where(faster.any(axis=1), len(trial) - 1 - np.argmax(faster[:, ::-1], axis=1), 0)
    place = np.minimum(place, last)
    own = np.arange(len(y))
    fall = gap[own, place] - gap[own, place + 1]
    return place, np.clip(gap[own, place] / np.where(fall > 0.0, fall, 1.0), 0.0, 1.0)
