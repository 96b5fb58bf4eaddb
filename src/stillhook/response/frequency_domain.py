"""The frequency-domain method: from seas, through tip, winch and wire, to the motion and tension of the load; thousands
of sea states at once.

Standard deviations of wire, load and tensions in many sea states: drag linearised in each, winch and waves
included.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import LiftError
from stillhook.physics.scalar import G
from stillhook.response.forcing import Forcing
from stillhook.response.suspended_load import QUANTITIES, SuspendedLoad, answers, drag_of_gaussian
from stillhook.response.winch.linear_form import Residual
from stillhook.statistics.extremes import (
    chance_below_zero,
    most_probable_maximum,
    rate_below_zero,
    share_below_zero,
    zero_crossing_period,
)
from stillhook.statistics.time_lag import over_frequency
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray


SPEEDS = np.geomspace(1e-4, 10.0, 36)
"""Deviations of the payload's speed through the water [m/s] at which everything is calculated; between them in
logarithms, to 0.2 %."""
RATES = np.geomspace(1e-3, 3.0, 16)
"""Deviations of the speed of a compensator's rod [m/s] at which its damping is taken."""
SLOW = np.geomspace(0.01, 8.0, 400)
"""Frequencies on which the remnant of the winch is taken to the load [rad/s]."""
BLOCK = 1024
"""Largest number of sea states that are calculated together."""
COARSE = 5
"""Step through `SPEEDS` of the first, coarse search."""
STILL_WATER = 1e-7
"""Variance of the speed of water at the load, over that of the tip, below which waves do not reach it."""
LEAST = 1e-300


class Sigmas(NamedTuple):
    """Standard deviations for n sea states: u wire's top end [m], u_rate its speed [m/s]; of `linearise.QUANTITIES` [m,
    m/s, N, N/s]; drag the linear drag of the payload [N s/m]."""

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


class Strokes(NamedTuple):
    """Of a passive heave compensator in n sea states: deviations of its stroke [m] and of the rod's speed [m/s], and
    its linear damping [N s/m]."""

    stroke: FloatArray
    rate: FloatArray
    c: FloatArray


def sigmas(forcing: Forcing, load: SuspendedLoad, residual: Residual) -> Sigmas:
    """Standard deviations in every sea state; 0 in a calm one, NaN in a missing one, with a passive heave compensator
    where the load has one."""
    return compensated_sigmas(forcing, load, residual)[0]


def compensated_sigmas(forcing: Forcing, load: SuspendedLoad, residual: Residual) -> tuple[Sigmas, Strokes | None]:
    """As `sigmas`, and what the rod of a passive heave compensator does; None where there is none, or it is at an
    end of its stroke.

    Orifice and seals agree with the motion where the rod, damped as for some speed, has the deviation of that speed:
    that is searched among `RATES`, from above. The rod's speed follows from the force on it at its mean frequency.
    """
    link = load.link
    if link is None or not link.moves:
        return _sigmas(forcing, load, residual), None
    levels = RATES if link.lossy else RATES[:1]
    damping = link.damping(levels)
    each = [_sigmas(forcing, replace(load, end=replace(load.end, c_s=float(c))), residual) for c in damping]
    force, rate = (np.array([getattr(s, name) for s in each]) for name in ("sling", "sling_rate"))
    omega = np.divide(rate, force, out=np.zeros_like(rate), where=force > 0.0)
    give = 1.0 / np.hypot(load.end.k_s, omega * damping[:, None])
    rows = np.concatenate([np.array(each), np.stack([force * give, rate * give], axis=1)], axis=1)
    place, share = _agreement(2.0 * np.log(np.maximum(rows[:, -1].T, LEAST)), levels)
    sea, upper = np.arange(len(forcing)), np.minimum(place + 1, len(levels) - 1)
    out = rows[place, :, sea] + share[:, None] * (rows[upper, :, sea] - rows[place, :, sea])
    c = damping[place] + share * (damping[upper] - damping[place])
    return Sigmas(*out[:, :-2].T), Strokes(out[:, -2], out[:, -1], c)


def _sigmas(forcing: Forcing, load: SuspendedLoad, residual: Residual) -> Sigmas:
    """Standard deviations in every sea state; 0 in a calm one, NaN in a missing one.

    Drag and motion agree where the speed through the water with the drag of some speed has the deviation of that speed.
    That is searched among `SPEEDS`, from above: with more drag there is less motion, so there is one such place.
    Where the compliance of the winch depends on the tip's speed, a sea state is calculated with that of a lower and of
    a higher speed, and interpolated.
    """
    out = np.full((len(Sigmas._fields), len(forcing)), np.nan)
    v = forcing.deviation(1)
    moving = np.flatnonzero(v > 0.0)
    out[:, np.isfinite(v)] = 0.0
    if not len(moving):
        return Sigmas(*out)
    seas, levels = _Seas(forcing, load, residual), _levels(v[moving], residual)
    trial = seas.trials(moving, float(levels[len(levels) // 2]))
    place = np.interp(np.log(v[moving]), np.log(levels), np.arange(len(levels)))
    for k, level in enumerate(levels):
        part = np.maximum(1.0 - np.abs(place - k), 0.0)
        near = part > 0.0
        if near.any():
            out[:, moving[near]] += part[near] * seas.at(moving[near], float(level), trial)
    return Sigmas(*out)


def _levels(v: FloatArray, residual: Residual) -> FloatArray:
    """Deviations of the tip's speed at which the compliance of the winch is taken, for seas of deviations v: those of
    its table about them."""
    if residual.compliance is None:
        return np.ones(1)
    knots = residual.compliance.sigma_v
    first = max(int(np.searchsorted(knots, v.min(), side="right")) - 1, 0)
    return np.asarray(knots[first : max(int(np.searchsorted(knots, v.max())), first) + 1])


class _Seas:
    """Sea states on one load and winch, and the numbers shared by all of them."""

    def __init__(self, forcing: Forcing, load: SuspendedLoad, residual: Residual) -> None:
        self.forcing, self.load, self.residual = forcing, load, residual
        tip, wave = (np.nansum(each, axis=0) * forcing.omega**2 for each in (forcing.tip, forcing.wave))
        self.waves = float(np.sum(wave * load.decay(forcing.omega) ** 2)) > STILL_WATER * float(np.sum(tip))
        self.v = forcing.deviation(1)
        C = np.zeros(forcing.tip.shape, dtype=complex)
        moving = self.v > 0.0
        for some in _blocks(np.flatnonzero(moving)):
            C[some] = residual.gaussian(forcing.omega, self.v[some])
        remains = forcing.remaining(C)
        self.wire, self.cross = remains.tip, remains.cross if self.waves else None
        self.slow = self.places = None
        if residual.remnant is not None:
            still = np.where(moving, self.v, 1.0)
            self.slow = residual.remnant.on(SLOW)
            self.places = residual.remnant.places(still, 2.0 * np.pi * forcing.deviation() / still)

    def trials(self, rows: NDArray[np.intp], level: float) -> FloatArray:
        """Those of `SPEEDS` among which drag and motion agree in these seas, with one to spare at both ends."""
        if self.load.B <= 0.0:
            return SPEEDS[:1]
        coarse = SPEEDS[::COARSE]
        tables = _Tables(self, level, coarse, ("relative",))
        places = [_agreement(_Block(tables, some).relative(), coarse)[0] for some in _blocks(rows)]
        low, high = (COARSE * int(f([f(p) for p in places])) for f in (np.min, np.max))
        return SPEEDS[max(low - 1, 0) : high + COARSE + 2]

    def at(self, rows: NDArray[np.intp], level: float, trial: FloatArray) -> FloatArray:
        """Rows of `Sigmas` for some sea states with the compliance at one speed of the tip, (10, len(rows))."""
        tables = _Tables(self, level, trial)
        parts = [_Block(tables, some).sigmas() for some in _blocks(rows)]
        if any(each is None for each in parts):
            return self.at(rows, level, SPEEDS)
        return np.concatenate([each for each in parts if each is not None], axis=1)


def _blocks(rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    return [rows[i : i + BLOCK] for i in range(0, len(rows), BLOCK)]


class _Tables:
    """Shared by all sea states: squared answers (s, m) by quantity for s trial speeds, and answers to the remnant."""

    def __init__(self, seas: _Seas, level: float, trial: FloatArray, quantities: Collection[str] = QUANTITIES) -> None:
        forcing, load, residual = seas.forcing, seas.load, seas.residual
        self.seas, self.trial = seas, trial
        self.drag = load.C_lin + drag_of_gaussian(load.B, trial, load.V, load.U)

        def compliance(omega: FloatArray) -> ComplexArray:
            return (
                np.zeros(len(omega), complex) if residual.compliance is None else residual.compliance.at(omega, level)
            )

        at_drags = answers(forcing.omega, load, self.drag[:, None], compliance(forcing.omega), quantities)
        self.by_u = {q: np.abs(a.u) ** 2 for q, a in at_drags.items()}
        self.both = {q: 2.0 * a.u * np.conj(a.wave) for q, a in at_drags.items()} if seas.waves else {}
        self.by_wave = {q: np.abs(a.wave) ** 2 for q, a in at_drags.items()} if seas.waves else {}
        self.remnant: dict[str, FloatArray] = {}
        if seas.slow is not None:
            slow = answers(SLOW, load, self.drag[:, None], compliance(SLOW), quantities)
            powers = {q: np.abs(a.u) ** 2 for q, a in slow.items()} | {
                "u": np.ones((1, len(SLOW))),
                "u_rate": SLOW[None, :] ** 2,
            }
            self.remnant = {q: _integrated(seas.slow, power) for q, power in powers.items()}


def _integrated(density: FloatArray, power: FloatArray) -> FloatArray:
    """Variances (j, k, s) of densities (j, k, m) with powers (s, m)."""
    return over_frequency(density.reshape(-1, density.shape[-1]), power).reshape(*density.shape[:2], len(power))


class _Block:
    """Some sea states, calculated together."""

    def __init__(self, tables: _Tables, rows: NDArray[np.intp]) -> None:
        self.t, self.rows = tables, rows
        seas = tables.seas
        self.wire = seas.wire[rows]
        self.cross = None if seas.cross is None else seas.cross[rows]
        self.places = None if seas.places is None else seas.places.rows(rows)

    def rest(self, q: str) -> FloatArray:
        """Variance of an answer to the remnant."""
        return np.zeros((len(self.rows), 1)) if self.places is None else self.places.at(self.t.remnant[q])

    def variance(self, q: str, s: slice) -> FloatArray:
        """Of one of `QUANTITIES` at some of the trial speeds, in logarithms, (len(rows), s)."""
        t, rest = self.t, self.rest(q)
        total = over_frequency(self.wire, t.by_u[q][s]) + (rest[:, s] if rest.shape[1] > 1 else rest)
        if self.cross is not None:
            both = t.both[q][s]
            total += over_frequency(self.cross.real, both.real) - over_frequency(self.cross.imag, both.imag)
            total += over_frequency(t.seas.forcing.wave[self.rows], t.by_wave[q][s])
        return np.asarray(np.log(np.maximum(total, LEAST)))

    def relative(self) -> FloatArray:
        """Of the speed through the water, at all trial speeds."""
        return self.variance("relative", slice(None))

    def sigmas(self) -> FloatArray | None:
        """Rows of `Sigmas`, (10, len(rows)); None where drag and motion agree outside of the trial speeds."""
        trial, drag = self.t.trial, self.t.drag
        y = self.relative()
        if len(trial) not in (1, len(SPEEDS)) and not _within(y, trial):
            return None
        place, share = _agreement(y, trial)
        each, used = np.arange(len(self.rows)), slice(int(place.min()), int(place.max()) + 2)
        low, high = place - used.start, np.minimum(place + 1, len(trial) - 1) - used.start
        fast = over_frequency(self.wire, self.t.seas.forcing.omega[None, :] ** 2)[:, 0]
        out = [np.sqrt(self.wire.sum(axis=1) + self.rest("u")[:, 0]), np.sqrt(fast + self.rest("u_rate")[:, 0])]
        for q in QUANTITIES:
            y = self.variance(q, used)
            out.append(np.exp(0.5 * (y[each, low] + share * (y[each, high] - y[each, low]))))
        x = np.log(np.maximum(drag[used], LEAST))
        return np.array([*out, np.where(drag[place] > 0.0, np.exp(x[low] + share * (x[high] - x[low])), 0.0)])


def _within(y: FloatArray, trial: FloatArray) -> bool:
    """Whether every answer is faster than the first trial speed, unless that is the first of all, and slower than the
    last."""
    slow, fast = 0.5 * y[:, 0] > np.log(trial[0]), 0.5 * y[:, -1] <= np.log(trial[-1])
    return bool((slow.all() or trial[0] == SPEEDS[0]) and (fast.all() or trial[-1] == SPEEDS[-1]))


def _agreement(y: FloatArray, trial: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Place among the trial speeds, and share of the next one, at which a speed and its answer agree; y (n, s)
    logarithms of variances."""
    if len(trial) == 1:
        return np.zeros(len(y), dtype=np.intp), np.zeros(len(y))
    gap = 0.5 * y - np.log(trial)
    faster = gap > 0.0  # the answer is faster than the trial speed
    last = len(trial) - 2
    place = np.where(faster.any(axis=1), len(trial) - 1 - np.argmax(faster[:, ::-1], axis=1), 0)
    place = np.minimum(place, last)
    each = np.arange(len(y))
    fall = gap[each, place] - gap[each, place + 1]
    return place, np.clip(gap[each, place] / np.where(fall > 0.0, fall, 1.0), 0.0, 1.0)


def frequency_response(
    forcing: Forcing, load: SuspendedLoad, residual: Residual, *, duration: float = 10800.0
) -> xarray.Dataset:
    """Statistics of tip, wire and load in every sea state, compensated and on the brake, as a Dataset over "case".

    Parameters: forcing the seas at tip and load; load the suspended load at one depth; residual the tip's motion that
    remains at the wire's end, `Residual.constant(0.2)` for a compensation of 80 %; duration time for which largest
    values and chances are calculated [s]. A missing sea has NaN everywhere; in a calm one nothing moves.
    Valid while the wire stays taut (`slack_share` small), motions are Gaussian, and the payload is in air or completely
    submerged. Drag and winch are linearised at the deviation of the motion itself: seas of resonance against drag,
    and largest values under drag, are approximate (docs/explanation/frequency-domain-method.md shows by how much).
    Errors: LiftError for a duration that is not positive.
    """
    import xarray  # heavy: only where results are labelled

    if not (math.isfinite(duration) and duration > 0.0):
        raise LiftError(f"duration {duration:g} s must be longer than 0 s. Enter the length of the operation.")
    valid = np.isfinite(forcing.tip).all(axis=1)
    z, v, a = (forcing.deviation(order) for order in range(3))
    (with_winch, strokes), (braked, strokes_braked) = (
        compensated_sigmas(forcing, load, winch) for winch in (residual, Residual.constant(1.0))
    )
    columns = {"sigma_z": z, "sigma_v": v, "sigma_a": a, "T_z": zero_crossing_period(z, v)}
    columns["z_mpm"] = most_probable_maximum(z, columns["T_z"], duration)
    columns["v_mpm"] = most_probable_maximum(v, zero_crossing_period(v, a), duration)
    columns["u_mpm"] = most_probable_maximum(
        with_winch.u, zero_crossing_period(with_winch.u, with_winch.u_rate), duration
    )
    columns |= {
        "sigma_u": with_winch.u,
        "eta_sigma_wire": _less(with_winch.u, z),
        "eta_sigma_load": _less(with_winch.load, z),
    }
    for suffix, s, way in (("", with_winch, strokes), ("_braked", braked, strokes_braked)):
        columns |= {f"{name}{suffix}": values for name, values in _of_load(s, load, duration).items()}
        if way is not None:
            columns |= {f"{name}{suffix}": values for name, values in _of_stroke(way, duration).items()}
    labels = [str(i) for i in range(len(forcing))]
    data = xarray.Dataset(
        {name: ("case", np.where(valid, values, np.nan), attributes_of(name)) for name, values in columns.items()},
        coords={"case": labels},
    )
    data.attrs = {
        "residual": residual.about,
        "duration": duration,
        "s_w": load.s_w,
        "F_top": load.F_top,
        "F_sling": load.F_sling,
    }
    return data


def _of_load(s: Sigmas, load: SuspendedLoad, duration: float) -> dict[str, FloatArray]:
    """Statistics of load motion and tensions."""
    pairs = ((s.load, s.load_rate), (s.top, s.top_rate), (s.sling, s.sling_rate))
    T_load, T_top, T_sling = (zero_crossing_period(a, b) for a, b in pairs)
    rate = rate_below_zero(load.F_sling, s.sling, T_sling)
    return {
        "sigma_load": s.load,
        "sigma_v_load": s.load_rate,
        "load_mpm": most_probable_maximum(s.load, T_load, duration),
        "sigma_F_top": s.top,
        "sigma_F_sling": s.sling,
        "F_top_mpm": load.F_top + most_probable_maximum(s.top, T_top, duration),
        "DAF": (load.F_sling + most_probable_maximum(s.sling, T_sling, duration)) / (load.end.m * G),
        "slack_share": share_below_zero(load.F_sling, s.sling),
        "slack_rate": rate,
        "slack_chance": chance_below_zero(rate, duration),
    }


def _of_stroke(way: Strokes, duration: float) -> dict[str, FloatArray]:
    """Statistics of the stroke of a compensator about that at rest."""
    T = zero_crossing_period(way.stroke, way.rate)
    return {"sigma_s_c": way.stroke, "s_c_mpm": most_probable_maximum(way.stroke, T, duration)}


def _less(sigma: FloatArray, z: FloatArray) -> FloatArray:
    """1 - sigma/z; NaN where the tip does not move."""
    return 1.0 - np.divide(sigma, z, out=np.full_like(z, np.nan), where=z > 0.0)


def attributes_of(name: str) -> dict[str, str]:
    """Unit and meaning of a number, also of one with the winch on its brake, for a Dataset."""
    row = BY_NAME[name.removesuffix("_braked")]
    braked = ", with the winch on its brake" if name.endswith("_braked") else ""
    return {"units": row.unit, "long_name": f"{row.meaning}{braked}"}
