"""A stream of rows cut into half waves of the winch, and each half wave as a few means.

A half wave is the time between two reversals of the motor speed. What is next to a reversal is left out: there the
bristle of the friction deflects before the winch slides.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.accuracy import F_LAG
from stillhook.live.estimate.balance import Balance, Geometry, Samples
from stillhook.live.estimate.parameters.balances import CLEAR_SIDE as CLEAR_SIDE
from stillhook.live.estimate.parameters.balances import balances
from stillhook.live.estimate.parameters.sums import Sums

BEFORE, AFTER = 0.25, 0.5
"""Time that is left out before and after a reversal [s]: measured, see docs/explanation/following-parameters.md."""
SHORTEST = 1.0
"""Shortest half wave after that [s]: with less its mean is that of the reversals."""
LONGEST = 60.0
"""Longest half wave [s]: beyond it nothing reverses."""
TURNED = 3.0
"""Motor speed from which the winch counts as turning the other way [rad/s]: noise of an encoder is a tenth of it."""
MOVING = 10.0
"""Least motor speed [rad/s], about 100 rev/min: below, the bristle and not the sliding law applies (as
`stillhook.validate.parameters.hoisting`). A half wave begins and ends there, and is left out where it is slower
between."""
SLOWER = 0.1
"""Part of MOVING by which a sample may be slower: noise of the encoder [-]."""
HOLE = 0.5
"""Longest hole in the rows within a half wave [s]."""
MANUAL = 0.0
"""What a PLC calls manual mode (`stillhook.variables`, "mode")."""
AT_STOP = 0.98
"""Pump setting from which the pumps count as saturated [-]."""
AT_RELIEF = 0.97
"""Pressure over that of the relief valve from which it counts as open [-]."""
FEW = 0.05
"""Part of a half wave that may be saturated or unknown [-]."""
NUDGE = 0.02
"""Shift of the clock by which its effect is taken [s]: large against rounding, small against a wave."""
SENSITIVITIES = (
    "F_gain",
    "F_zero",
    "F_lag",
    "alpha_m",
    "alpha_pm",
    "D_m",
    "D_pm",
    "p_a",
    "p_b",
    "p_hp",
    "R_piston",
    "inertia",
    "clock",
)
"""Errors that a half wave's torque depends on, in the order of `HalfWave.effects`."""


class HalfWave(NamedTuple):
    """Means of one half wave. t middle, seconds length of what is averaged [s]; sign of the motion; torque: measured
    loss, hoisting positive [N m]; system, motors: the crane file's, hoisting positive [N m]; effects: change of torque
    less model per unit of each of SENSITIVITIES; speed: mean motor speed [rad/s]; s_w [m]; F force in the wire [N];
    layer."""

    t: float
    seconds: float
    sign: float
    torque: float
    system: float
    motors: float
    effects: FloatArray
    speed: float
    s_w: float
    F: float
    layer: int


class Cut(NamedTuple):
    """What came of one half wave: its means, and sums by balance (`parameters.balances`); or why it is left out."""

    half_wave: HalfWave | None
    sums: Mapping[str, Sums]
    reason: str = ""


Rows = Mapping[str, FloatArray]


def reversals(omega: FloatArray) -> list[tuple[int, int]]:
    """Half waves of a motor speed (n,) [rad/s] that are complete: index of the first sample, and that of the first of
    the next one. Between -TURNED and TURNED the side of before counts."""
    side = np.where(omega > TURNED, 1, np.where(omega < -TURNED, -1, 0))
    turned = np.flatnonzero(side)
    if not len(turned):
        return []
    change = np.flatnonzero(np.diff(side[turned]) != 0)
    marks = []
    for k in change:
        a, b = int(turned[k]), int(turned[k + 1])
        crossing = a + int(np.argmax(np.sign(omega[a : b + 1]) == side[b]))
        marks.append(crossing)
    return list(itertools.pairwise(marks))


def cut(rows: Rows, omega: FloatArray, first: int, last: int, offset: float, balance: Balance, reach: float) -> Cut:
    """The half wave from sample `first` to `last` of the motor speed. rows (n,) with "time" and, where known,
    "alpha_p"; omega as logged [rad/s]; offset of the encoder's clock [s]; reach: rows to either side that may be looked
    at [s]."""
    t = rows["time"]
    start, end = t[first] + AFTER, t[last] - BEFORE  # by the encoder's clock
    moving = first + np.flatnonzero(np.abs(omega[first:last]) > MOVING)
    if not len(moving):
        return Cut(None, {}, "too little speed")
    start, end = max(start, t[moving[0]]) - offset, min(end, t[moving[-1]]) - offset
    if end - start < SHORTEST:
        return Cut(None, {}, "half waves too short")
    a, b = np.searchsorted(t, [start, end])
    part = slice(int(a), int(b))
    inside = {name: x[part] for name, x in rows.items()}
    when = inside["time"]
    if len(when) < 5 or np.diff(when).max() > HOLE or when[0] - start > HOLE or end - when[-1] > HOLE:
        return Cut(None, {}, "holes in the log")
    near = slice(int(np.searchsorted(t, start + offset - reach)), int(np.searchsorted(t, end + offset + reach)))
    t_near, omega_near = t[near], omega[near]
    known = np.isfinite(omega_near)
    if known.mean() < 1.0 - FEW:
        return Cut(None, {}, "motor speed unknown")
    t_near, omega_near = t_near[known], omega_near[known]

    def speed(shift: float) -> FloatArray:
        return np.interp(when + offset + shift, t_near, omega_near)

    s_w = float(np.nanmean(inside["s_w"]))
    if (reason := _left_out(inside, speed(0.0), balance, s_w)) is not None:
        return Cut(None, {}, reason)
    inside = {name: _bridged(when, x) for name, x in inside.items()}
    geo = balance.geometry(s_w)
    wave = _means(inside, when, speed, balance, geo, s_w)
    of = balances(inside, when, speed(0.0), balance)
    return Cut(wave, {name: Sums(wave.t, wave.seconds, wave.sign, wave.speed, G) for name, G in of.items()})


def _left_out(inside: Rows, omega: FloatArray, balance: Balance, s_w: float) -> str | None:
    """Why the samples of a half wave say nothing of friction; None where they do."""
    if "mode" in inside and (inside["mode"] == MANUAL).any():
        return "manual mode"
    if "brake" in inside and (np.nan_to_num(inside["brake"]) > 0.0).any():
        return "brake closed"
    for name in balance.needed:
        if not np.isfinite(inside[name]).mean() > 1.0 - FEW:
            return f"{name} unknown"
    if np.abs(omega).min() < (1.0 - SLOWER) * MOVING or omega.min() < 0.0 < omega.max():
        return "too little speed"
    if "alpha_p" in inside and (np.abs(inside["alpha_p"]) > AT_STOP).mean() > FEW:
        return "pumps saturated"
    relief = AT_RELIEF * balance.params.active.relief.p
    if (np.maximum(inside["p_a"], inside["p_b"]) > relief).mean() > FEW:
        return "relief valve open"
    low, high = float(np.nanmin(inside["s_w"])), float(np.nanmax(inside["s_w"]))
    if not (np.isfinite(low) and balance.geometry(low).layer == balance.geometry(high).layer):
        return "wire changes its layer"
    return None


def _bridged(t: FloatArray, x: FloatArray) -> FloatArray:
    good = np.isfinite(x)
    return x if good.all() or not good.any() else np.interp(t, t[good], x[good])


def _mean(t: FloatArray, x: FloatArray) -> float:
    """Mean over time by trapezoids."""
    return float(np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(t)) / (t[-1] - t[0]))


def _means(
    x: Rows, t: FloatArray, speed: Callable[[float], FloatArray], balance: Balance, geo: Geometry, s_w: float
) -> HalfWave:
    """Means over a half wave of samples x at times t [s]; speed: motor speed at these times, so much later [rad/s]."""
    omega, seconds = speed(0.0), float(t[-1] - t[0])

    def model_and_inertia(omega: FloatArray) -> tuple[Samples, float, float]:
        s = balance.samples(x, omega, geo)
        return s, _mean(t, s.system + s.motors), geo.J * float(omega[-1] - omega[0]) / seconds

    s, _, inertia = model_and_inertia(omega)
    system, motors = _mean(t, s.system), _mean(t, s.motors)
    early, late = model_and_inertia(speed(-NUDGE)), model_and_inertia(speed(NUDGE))
    wire = _mean(t, s.wire)
    lag = -geo.r_eff * float(x["F_w"][-1] - x["F_w"][0]) / seconds  # torque per second of the cell's lag
    active, passive = _mean(t, s.active), _mean(t, s.passive)
    of_clock = (-(late[2] - early[2]) - (late[1] - early[1])) / (2.0 * NUDGE)
    per_load = _mean(t, s.per_load)
    F = wire / geo.r_eff
    effects = np.array(
        [
            -wire - per_load,
            -geo.r_eff - per_load / max(abs(F), 1.0),
            lag,
            _mean(t, s.per_alpha_m),
            _mean(t, s.per_alpha_pm),
            active,
            passive,
            _mean(t, s.per_p),
            -_mean(t, s.per_p),
            _mean(t, s.per_p_hp),
            _mean(t, s.piston),
            -inertia,
            of_clock,
        ]
    )
    return HalfWave(
        t=0.5 * float(t[0] + t[-1]),
        seconds=seconds,
        sign=float(np.sign(omega.mean())),
        torque=active + passive - wire + F_LAG * lag - inertia,
        system=system,
        motors=motors,
        effects=effects,
        speed=float(np.abs(omega).mean()),
        s_w=s_w,
        F=F,
        layer=geo.layer,
    )
