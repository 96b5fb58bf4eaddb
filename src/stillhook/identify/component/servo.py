"""The displacement control of a pump or a motor from a log of its command and of the displacement (swivel angle) that
follows: natural frequency, damping, dead time, rates by direction, gain, offset and hysteresis.

The law is that of the twin (`stillhook.physics.hydraulics.swash`), with a gain that the twin does not have. What the
twin takes is fitted with a gain of 1, and without a dead time that may be 0, so that its response is nearest to the
log.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.component.result import DEFAULT, Change, Component, ComponentSettings, Parameter
from stillhook.identify.component.swash_fit import SwashFit, kernel
from stillhook.logs.log import Log
from stillhook.report.formatting import percent_fixed
from stillhook.report.kit import axis, legend, panels
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.statistics.correlated_mean import noise_of
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.left_out import Labels, rms, spread_of_groups, stretches

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNITS: Mapping[str, tuple[str, str]] = {"pump": ("u_p", "alpha_p"), "motor": ("u_m", "alpha_m")}
"""Signals of the command and of the displacement, over full displacement."""
NO_RATE = 1.0e6
START: tuple[tuple[float, float], ...] = ((2.0, 1.0), (5.0, 1.0), (12.0, 0.9), (30.0, 0.9), (70.0, 0.8))
"""Natural frequencies [rad/s] and damping ratios that the search starts from."""
LOW = SwashFit(0.2, 0.15, 0.0, 0.3, -0.5, 0.0, 1e-3, 1e-3)
HIGH = SwashFit(400.0, 10.0, 2.0, 1.7, 0.5, 0.4, NO_RATE, NO_RATE)
STEP = SwashFit(1e-3, 1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-3, 1e-3)
"""Ends of the search, and steps of the derivatives: relative, but dead_time [s], gain, offset and half_width."""
RATES = ("rate", "rate_down")
RELATIVE = ("omega_n", "zeta", *RATES)
UNSEEN, UNSEEN_DEAD_TIME = 0.02, 0.2
"""Half widths that no residual shows, of natural frequency and damping [-] and, in samples, of the dead time: the
command changes somewhere within a sample of the log."""
OF_LAW = {
    "omega_n": ("natural frequency", "frequency"),
    "zeta": ("damping ratio", ""),
    "dead_time": ("dead time", "time"),
    "gain": ("change of displacement over change of command", ""),
    "offset": ("displacement above its command at the middle of the range", ""),
    "half_width": ("half the width of the hysteresis", ""),
    "rate": ("highest rate as the displacement rises", "gain_per_time"),
    "rate_down": ("highest rate as it falls", "gain_per_time"),
}
"""Parameters: meaning and kind of quantity."""
NOT_IN_TWIN: tuple[str, ...] = ("gain", *RATES)
FINE = 0.4
"""Largest product of natural frequency and step of the integration [-]."""
FEWEST_MOVES, LEAST_MOVE = 4, 0.05
"""Moves of the command that a fit needs, and the least of them [-]."""
FEWEST_SAMPLES = 200
REACHED = 0.15
"""Largest relative half width at which a rate counts as seen: a control that is never held back does not show it."""
EXPLAINED = 1.15
"""Misfit over the noise of the measured displacement below which no rate limit is looked for."""
MOST_RUNS = 30
"""Steps of a fit."""
BETTER = 0.98
"""Misfit with rate limits over that without, below which they are kept."""
MOST_LEFT = 0.3
"""Residual over the deviation of the measured displacement beyond which this law is not that of the control."""
SLOWEST_SAMPLING = 0.5
"""Largest product of natural frequency and sampling time [-]: above, a log does not show the response."""
MISSED = 0.005
"""Residual with a gain of 1 that is reported, of full displacement [-]."""
LEAST_PLAY = 0.002
"""Half width of the hysteresis from which its form is of weight [-]."""
CALM = 0.02
"""Offset and hysteresis below which a motor's control counts as closed-loop [-]."""


@dataclass(frozen=True)
class SwashLog:
    """A command and the displacement that follows, at equal steps h [s]; measured: samples that count."""

    unit: str
    source: str
    t: FloatArray
    u: FloatArray
    alpha: FloatArray
    measured: BoolArray
    h: float

    def follow(self, *fits: SwashFit) -> FloatArray:
        """Displacements (fits, n) that the law gives."""
        P, n = np.array(fits, dtype=float), len(self.u)
        n_sub = max(1, math.ceil(self.h * float(P[:, 0].max()) / FINE))
        out = np.empty((len(fits), n))
        first = float(self.alpha[np.argmax(self.measured)])
        kernel()(self.u, n, self.h, n_sub, P.reshape(-1), len(fits), first, out.reshape(-1))
        return out


def swash_log(log: Log, unit: str | None = None) -> SwashLog:
    """Command and displacement of a log, at equal steps. unit: "pump" or "motor"; default what the log has.

    Errors: IdentifyError where a signal is missing, or the command does not move enough.
    """
    have = [name for name, pair in UNITS.items() if set(pair) <= set(log.signals)]
    if unit is None and len(have) != 1:
        pairs = " or ".join(" and ".join(pair) for pair in UNITS.values())
        state = "of both units" if have else "of neither"
        raise IdentifyError(
            f"{log.source}: command and displacement {state} among {', '.join(log.signals)}. Map {pairs}, over full"
            ' displacement: a feedback in cm^3/rev takes scale = 1/D_max, such as "scale = 0.00465".'
        )
    unit = unit or have[0]
    command, angle = (log.signals[name] for name in UNITS[unit])
    times = log.t if log.at is None else log.at
    h = float(np.median(np.diff(times)))
    t, known, good = np.arange(times[0], times[-1], h), np.isfinite(command), np.isfinite(angle)
    if good.sum() < FEWEST_SAMPLES or not known.any():
        raise IdentifyError(
            f"{log.source}: {int(good.sum())} samples of {UNITS[unit][1]}; {FEWEST_SAMPLES} are needed."
        )
    near = np.minimum(np.searchsorted(times, t - 0.5 * h), len(times) - 1)
    u = np.interp(t, times[known], command[known])
    alpha, measured = angle[near], good[near] & (np.abs(times[near] - t) <= h)
    if (travel := float(np.ptp(u))) < LEAST_MOVE or float(np.sum(np.abs(np.diff(u)))) < FEWEST_MOVES * LEAST_MOVE:
        raise IdentifyError(
            f"{log.source}: the command {UNITS[unit][0]} moves by {travel:.3g} of full displacement; a response needs"
            f" {FEWEST_MOVES} moves of {LEAST_MOVE:g} and more. Check its scale (1 is full), or log steps."
        )
    return SwashLog(unit, log.source, t, u, np.where(measured, alpha, 0.0), measured, h)


@dataclass(frozen=True)
class Fitted:
    """Parameters of a fit, names of those that were free, derivatives (n, p) and residuals (n,) of what counts."""

    values: SwashFit
    free: tuple[str, ...]
    J: FloatArray
    r: FloatArray

    @property
    def rms(self) -> float:
        return rms(self.r)


def _fit(log: SwashLog, start: SwashFit, free: tuple[str, ...], use: BoolArray) -> Fitted:
    """Least squares of the displacement from a start; use: samples that count."""
    from scipy.optimize import least_squares  # heavy

    places = [SwashFit._fields.index(name) for name in free]
    lo, hi, step = (np.array(x)[places] for x in (LOW, HIGH, STEP))
    log_of = np.array([name in RELATIVE for name in free])

    def forward(x: FloatArray) -> SwashFit:
        values = np.where(log_of, np.exp(np.where(log_of, x, 0.0)), x)
        return start._replace(**{name: float(value) for name, value in zip(free, values, strict=True)})

    def backward(y: FloatArray) -> FloatArray:
        return np.where(log_of, np.log(np.maximum(y, 1e-12)), y)

    ends = backward(lo), backward(hi)

    def rows(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        moves = np.where(x + step < ends[1], step, -step)
        y = log.follow(*(forward(each) for each in (x, *(x + row for row in np.diag(moves)))))[:, use]
        return y[0] - log.alpha[use], ((y[1:] - y[0]) / moves[:, None]).T

    x_0 = np.clip(backward(np.array(start)[places]), ends[0] + 1e-9, ends[1] - 1e-9)
    found = least_squares(
        lambda x: log.follow(forward(x))[0][use] - log.alpha[use],
        x_0,
        jac=lambda x: rows(x)[1],
        bounds=ends,
        x_scale="jac",
        max_nfev=MOST_RUNS,
        ftol=1e-7,
        xtol=1e-6,
    )
    r, J = rows(found.x)
    return Fitted(forward(found.x), free, J, r)


def _best(log: SwashLog, free: tuple[str, ...], use: BoolArray, fixed: SwashFit) -> Fitted:
    """The best fit of several starts; rates join where they make it better."""
    basic = tuple(name for name in free if name not in RATES)
    trial = [fixed._replace(omega_n=w, zeta=z) for w, z in START]
    misfit = np.mean((log.follow(*trial)[:, use] - log.alpha[use]) ** 2, axis=1)
    best = min((_fit(log, trial[i], basic, use) for i in np.argsort(misfit)[:2]), key=lambda f: f.rms)
    if not set(RATES) & set(free) or best.rms < EXPLAINED * noise_of(log.alpha[use]):
        return best
    smooth = np.gradient(np.convolve(log.alpha, np.full(5, 0.2), "same"), log.h)[use]
    fastest = np.quantile(smooth, 0.99), -np.quantile(smooth, 0.01)
    rates = {name: max(float(v), 1e-2) for name, v in zip(RATES, fastest, strict=True)}
    start = best.values._replace(**rates, omega_n=min(1.5 * best.values.omega_n, 100.0))
    limited = _fit(log, start, (*basic, *RATES), use)
    seen = tuple(name for name in RATES if _is_seen(limited, name))
    if len(seen) == 1:
        lost = {name: NO_RATE for name in RATES if name not in seen}
        limited = _fit(log, limited.values._replace(**lost), (*basic, *seen), use)
    return limited if seen and limited.rms < BETTER * best.rms else best


def _is_seen(fit: Fitted, name: str) -> bool:
    """Whether the log holds samples at a rate limit, and more than its noise of them."""
    J = fit.J[:, fit.free.index(name)]
    return bool(np.sum(J**2) > (2.0 * fit.rms / REACHED) ** 2)


def servo(log: SwashLog, settings: ComponentSettings = DEFAULT) -> Component:
    """Displacement control of a pump or a motor.

    Errors: IdentifyError where the log is sampled too slowly for its response.
    """
    use, fixed, pump = log.measured, SwashFit(5.0, 1.0, 0.0, 1.0, 0.0, 0.0, NO_RATE, NO_RATE), log.unit == "pump"
    middle = 0.5 * float(log.u.max() + log.u.min())
    shifted = replace(log, u=log.u - middle, alpha=log.alpha - middle * use)
    fit = _best(shifted, tuple(OF_LAW), use, fixed)
    groups = _groups(shifted, use)
    estimates = _estimates(fit, groups, log.h)
    start, left_out = fit.values._replace(gain=1.0), NOT_IN_TWIN
    if estimates["dead_time"].low <= 0.0:
        start, left_out = start._replace(dead_time=0.5 * log.h), (*left_out, "dead_time")
    if pump:
        start, left_out = start._replace(half_width=0.0), (*left_out, "half_width")
    twin = _fit(shifted, start, tuple(name for name in fit.free if name not in left_out), use)
    if fit.values.omega_n * log.h > SLOWEST_SAMPLING:
        raise IdentifyError(
            f"{log.source}: one sample in {1e3 * log.h:.3g} ms does not show a response of"
            f" {fit.values.omega_n:.3g} rad/s. Log at {1e3 * 0.1 / fit.values.omega_n:.2g} ms and faster."
        )
    scatter = float(np.std(log.alpha[use]))
    notes, left = list[str](), fit.rms / scatter
    if left > MOST_LEFT:
        notes.append(f"the law leaves {percent_fixed(left, 0)} of the displacement's deviation: not this control's law")
    response = shifted.follow(fit.values)[0]
    speed = np.gradient(response, log.h)
    for name, fastest in zip(RATES, (float(speed.max()), float(-speed.min())), strict=True):
        if name not in estimates:
            notes.append(f"{OF_LAW[name][0]}: not reached, at least {fastest:.3g} 1/s")
    notes.append(
        f"with a gain of 1, as the twin has it: omega_n {twin.values.omega_n:.4g} rad/s, zeta {twin.values.zeta:.3g},"
        f" dead time {1e3 * _dead_time(twin, log.h):.3g} ms, residual {percent_fixed(twin.rms, 2)} of full displacement"
        f" ({percent_fixed(fit.rms, 2)} with the gain)"
    )
    if twin.rms > max(1.5 * fit.rms, MISSED):
        notes.append(
            f"a gain of {fit.values.gain:.3g} is not that of the twin's control: check the scales of command and"
            " displacement"
        )
    if estimates["half_width"].low > LEAST_PLAY:
        notes.append(
            "hysteresis is taken as play in front of the plate: as dry friction of the plate it raises omega_n, zeta"
            " and dead_time by up to a tenth, beyond their intervals"
        )
    changes, more = _changes(log, settings, twin, estimates)
    return Component(
        component="servo",
        source=log.source,
        rows=int(use.sum()),
        parameters=tuple(Parameter(name, *OF_LAW[name], e, _status(name, e)) for name, e in estimates.items()),
        held_out=_left_out(shifted, fit, groups, scatter),
        notes=(*notes, *more),
        twin=(
            "the twin takes omega_n, zeta, dead time, rates by direction; of motors in open loop offset and hysteresis",
            "it has no gain: its numbers are those of a fit without it",
            "the dead time counts from the logged command: of a PLC's log it contains the computing time of the cycle",
        ),
        changes=changes,
        figures=lambda: {"servo": _figure(log, response + middle)},
        settings=settings,
        usable=left <= MOST_LEFT,
    )


def _status(name: str, e: Estimate) -> str:
    if name in ("omega_n", "zeta"):
        return "" if e.half < abs(e.value) else "not determined"
    return "" if e.low > 0.0 or e.high < 0.0 else "may be 0"


def _groups(log: SwashLog, use: BoolArray) -> dict[str, Labels]:
    """Stretches of time with equal travel of the command, and of equal length."""
    travel = np.abs(np.gradient(log.u))[use]
    return {
        "moves": stretches(int(use.sum()), weight=travel + 1e-3 * travel.mean() + 1e-12),
        "time": stretches(int(use.sum())),
    }


def _estimates(fit: Fitted, groups: Mapping[str, Labels], h: float) -> dict[str, Estimate]:
    """Parameters with their intervals, the widest of all groupings; those of positive ones on their logarithms. A rate
    that one stretch alone shows, or that is hardly reached, is none."""
    spreads = _spreads(fit, fit.free, groups)
    names = fit.free if spreads else tuple(name for name in fit.free if name not in RATES)
    spreads = spreads or _spreads(fit, names, groups)
    out = {}
    for i, name in enumerate(names):
        value, n = getattr(fit.values, name), len(fit.r)
        half = max((math.sqrt(max(float(C[i, i]), 0.0)) for C in spreads), default=math.nan)
        if name in RATES and not half <= REACHED:
            continue
        unseen = {"dead_time": UNSEEN_DEAD_TIME * h, "omega_n": UNSEEN, "zeta": UNSEEN}
        half = math.hypot(half, unseen.get(name, 0.0))
        if name in RELATIVE:
            edge = min(half, 5.0) if math.isfinite(half) else half
            out[name] = Estimate(value, value * math.exp(-edge), value * math.exp(edge), n)
        elif name in ("dead_time", "half_width"):
            late = 0.5 * h if name == "dead_time" else 0.0  # a command held over a sample, taken as linear between
            value, low, high = (max(value - late + x, 0.0) for x in (0.0, -half, half))
            out[name] = Estimate(value, low, high, n)
        else:
            out[name] = Estimate.around(value, half, n)
    return out


def _spreads(fit: Fitted, names: tuple[str, ...], groups: Mapping[str, Labels]) -> list[FloatArray]:
    J = fit.J[:, [fit.free.index(name) for name in names]]
    return [C for of in groups.values() if (C := spread_of_groups(J, -fit.r, of)) is not None]


def _left_out(log: SwashLog, fit: Fitted, groups: Mapping[str, Labels], scatter: float) -> dict[str, float]:
    """Residual of each half of the log by the parameters of the other half, over the displacement's deviation."""
    half = np.zeros(len(log.u), dtype=bool)
    half[log.measured] = groups["moves"] % 2 == 0
    squares = 0.0
    for part, rest in ((half, log.measured & ~half), (log.measured & ~half, half)):
        values = _fit(log, fit.values, fit.free, part).values
        squares += float(np.sum((log.follow(values)[0][rest] - log.alpha[rest]) ** 2))
    return {"every other stretch": math.sqrt(squares / int(log.measured.sum())) / scatter}


def _dead_time(fit: Fitted, h: float) -> float:
    """Dead time of a command that is held over a sample of h [s], which the fit takes as linear between samples."""
    return max(fit.values.dead_time - 0.5 * h, 0.0)


def _changes(
    log: SwashLog, settings: ComponentSettings, twin: Fitted, estimates: Mapping[str, Estimate]
) -> tuple[dict[str, Change], list[str]]:
    """Fields of a crane file, and what it cannot take."""
    v, unit, notes = twin.values, log.unit, list[str]()
    place = f"{settings.circuit}.{unit}"
    changes: dict[str, Change] = {
        f"{place}.servo.omega_n": (v.omega_n, "frequency"),
        f"{place}.servo.zeta": (v.zeta, None),
        **({f"{place}.servo.dead_time": (_dead_time(twin, log.h), "time")} if "dead_time" in twin.free else {}),
    }
    for name, field in zip(RATES, ("rate_max", "rate_down"), strict=True):
        if name in estimates:
            changes[f"{place}.servo.{field}"] = (getattr(v, name), "gain_per_time")
    if unit == "pump" or settings.circuit == "passive":
        if abs(v.offset) > CALM:
            notes.append(f"offset {v.offset:+.3g}: the twin's {settings.circuit} {unit}s have none")
        return changes, notes
    if abs(v.offset) <= CALM and 2.0 * v.half_width <= CALM:
        return changes, ["offset and hysteresis within 2 % of full displacement: a closed-loop control"]
    if v.offset < 0.0:
        notes.append(f"offset {v.offset:+.3g}: the twin takes one above the command only; it is left at 0")
    changes[f"{place}.variant"] = ("open-loop-feedback", None)
    changes[f"{place}.offset"] = (max(v.offset, 0.0), None)
    changes[f"{place}.hysteresis"] = (2.0 * v.half_width, None)
    return changes, notes


def _figure(log: SwashLog, model: FloatArray) -> Figure:
    """Command, displacement and model over time (Moslatt 2020 figures C10, F6); displacement over command (E13)."""
    figure, axes = panels(1, 2, (12.0, 4.8), f"{log.source}: displacement control of a {log.unit}")
    left, right = axes[0]
    u, alpha, law = 100.0 * log.u, 100.0 * np.where(log.measured, log.alpha, np.nan), 100.0 * model
    t = log.t - log.t[0]
    left.plot(t, u, "--", color=GREY, lw=1.0, label="command")
    for ax, x, width in ((left, t, 1.0), (right, u, 0.8)):
        ax.plot(x, alpha, "-", color=COLOURS[0], lw=width, label="measured")
        ax.plot(x, law, "-", color=COLOURS[1], lw=width, label="law")
    axis(left, "time [s]", "displacement [% of full]")
    axis(right, "command [% of full]", "displacement [% of full]")
    legend(left)
    return figure
