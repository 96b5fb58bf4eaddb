"""Friction over speed of any machine that was run to and fro in steps: winch, ram, test bench.

What friction is here: half the difference of effort between both directions at the same speed (Moslatt 2020 eq. 2.4).
Everything that turns with the direction is in it: dry and viscous friction, hysteresis, and all that brakes the machine
on purpose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.steady_state.pairs import Pair, Pairs, pair_windows
from stillhook.identify.steady_state.search import effort_of, in_words, kind_of, signal_of
from stillhook.identify.steady_state.steps import Rejected, Steady, Window, WindowSettings
from stillhook.identify.steady_state.windows import steady_windows
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.logs.log import Log
from stillhook.report.kit import axis, canvas, legend, panels
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.statistics.correlated_mean import mean_and_uncertainty, students_factor
from stillhook.statistics.estimate import NORMAL_95, Estimate
from stillhook.units import KINDS, in_display

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stillhook.logs.log import Log


SAME_STROKE = 0.05
"""Stretches of one stroke that differ in speed by less are compared as one: friction changes by far less than its
uncertainty."""
FEWEST_VISITS = 3
"""Points from which each can be compared with its neighbours."""
SHORTER = (1.4, 1.0, 0.7)
"""Least lengths of a stretch that are tried in turn where every motion is shorter than the default [s]: down to two
periods of 3 Hz. What a stretch may drift by does not shrink with its length, so a load that changes along the way is
refused as with long
ones."""
FEWEST_BINS = 10
"""Bins of the log that such a least length must hold."""
FEWEST_PLACES = 10
"""Bins that both directions must have on their common way: fewer say nothing of the scatter along it."""


@dataclass(frozen=True)
class CurvePoint:
    """Friction at one speed, from one stretch of each direction; SI of the signals.

    ``speed`` mean magnitude of both; ``friction`` half the difference, ``load`` half the sum of effort; ``u_friction``,
    ``u_load`` standard uncertainties, that of friction with what visits differ by (place, time, temperature), which no
    single visit shows; ``way`` ends of the positions that both passed, ``load_way`` load at these ends (none without
    position).
    """

    speed: float
    friction: float
    u_friction: float
    load: float
    u_load: float
    up: Window
    down: Window
    way: tuple[float, float] | None = None
    load_way: tuple[float, float] | None = None

    @property
    def estimate(self) -> Estimate:
        """The friction with its interval."""
        return Estimate.around(self.friction, NORMAL_95 * self.u_friction)


@dataclass(frozen=True)
class FrictionCurve:
    """``points`` by speed; ``steady`` stretches used and rejected; ``unpaired`` stretches without a partner; names and
    kinds of the signals; ``least_length`` of a stretch [s], ``adapted`` where it is shorter than the default because
    the log holds no speed for longer.
    """

    source: str
    speed: str
    effort: str
    position: str | None
    kinds: Mapping[str, str]
    points: tuple[CurvePoint, ...]
    steady: Steady
    unpaired: tuple[Rejected, ...]
    least_length: float = WindowSettings().least_length
    adapted: bool = False

    def text(self, name: str, value: float, digits: int = 4) -> str:
        """A "speed", "effort" or "position" with its unit; in SI where none is known."""
        return in_words(value, self.kinds.get(name, ""), digits)

    def to_dict(self) -> dict[str, Any]:
        """Everything in SI as plain data for JSON."""
        points = [{**asdict(p), "interval_95": (p.estimate.low, p.estimate.high)} for p in self.points]
        rejected = [asdict(r) for r in (*self.steady.rejected, *self.unpaired)]
        return {
            "source": self.source,
            "speed": self.speed,
            "effort": self.effort,
            "position": self.position,
            "kinds": dict(self.kinds),
            "points": points,
            "rejected": rejected,
            "trimmed": [asdict(r) for r in self.steady.trimmed],
            "least_length": self.least_length,
            "least_length_adapted": self.adapted,
        }


class CurveSettings(NamedTuple):
    """The table [curve] of a mapping file: signals of speed, effort, position and command, and what counts as a steady
    stretch."""

    speed: str = "speed"
    effort: str = "effort"
    position: str | None = None
    command: str | None = None
    steady: WindowSettings | None = None


def curve_settings(mapping: Path) -> CurveSettings:
    return read_toml(mapping, FileKind.MAPPING, IdentifyError, _settings)


def _settings(table: TomlTable) -> CurveSettings:
    fields = dict(table.data.get("curve", {}))
    signals = {name: fields.pop(name) for name in ("speed", "effort", "position", "command") if name in fields}
    steady = WindowSettings(**fields)
    steady.slowest()
    return CurveSettings(**signals, steady=steady if fields else None)


def friction_curve(
    log: Log,
    *,
    speed: str = "speed",
    effort: str | FloatArray = "effort",
    position: str | None = None,
    command: str | None = None,
    kinds: Mapping[str, str] | None = None,
    settings: WindowSettings | None = None,
) -> FrictionCurve:
    """Friction over speed with 95 % uncertainty from a staircase log.

    Parameters
    ----------
    log : Log
        From `read_log`.
    speed : str, default "speed"
        Signal whose sign is the direction, hoisting positive.
    effort : str or array, default "effort"
        Signal that friction shows in, or an array of shape (n,) [SI].
    position : str, optional
        Signal on which the load depends in addition to the direction (a spring, a slope).
    command : str, optional
        Set signal whose changes begin new steps.
    kinds : mapping, optional
        Kinds of quantity (`units.KINDS`) of signals by name, for texts.
    settings : WindowSettings, optional
        As in `steady_windows`. Without a least_length in them, a log whose motions are all too short for the default is
        read with the longest of `SHORTER` that gives a point.

    Returns
    -------
    FrictionCurve
        Points by speed [SI], with the stretches used and rejected.

    Raises
    ------
    IdentifyError
        Where a signal is missing or no two stretches can be compared, with the first reasons.

    Notes
    -----
    With a position, both directions are compared place by place on the way that both passed at steady speed, and effort
    need not be steady in time; the scatter along the way, a friction that itself depends on the place included, is in
    the uncertainty.
    """
    used = settings or WindowSettings()
    if position is not None:
        used = used.for_effort_of_place()
    signal_kinds = {"speed": kind_of(log, speed, kinds), "effort": kind_of(log, effort, kinds)}
    named = {**(kinds or {}), **signal_kinds}
    if position is not None:
        signal_kinds["position"] = kind_of(log, position, kinds)

    def attempt() -> tuple[Steady, list[CurvePoint], list[Rejected]]:
        steady = steady_windows(log, speed, effort, command=command, kinds=named, settings=used)
        matches = pair_windows(steady.windows, text=lambda v: in_words(v, signal_kinds["speed"]))
        if position is not None:
            return steady, *_place_by_place(log, matches, steady.windows, effort, position)
        points = [
            CurvePoint(p.speed, p.friction, p.u_friction, p.load, p.u_friction, p.up, p.down) for p in matches.pairs
        ]
        return steady, points, list(matches.unpaired)

    steady, points, unpaired = attempt()
    adapted = False
    if not points:
        problem = _no_point(log, steady, unpaired)
        all_short = not steady.windows and all(r.code == "short" for r in steady.rejected)
        if all_short and "least_length" not in used.model_fields_set:
            problem += f" Stretches down to {SHORTER[-1]:g} s were tried as well."
            for length in SHORTER:
                if points or length < FEWEST_BINS * float(np.median(np.diff(log.t))):
                    break
                adapted, used = True, used.model_copy(update={"least_length": length})
                steady, points, unpaired = attempt()
        if not points:
            raise IdentifyError(problem)
    return FrictionCurve(
        source=log.source,
        speed=speed,
        effort=effort if isinstance(effort, str) else "effort",
        position=position,
        kinds=signal_kinds,
        points=with_visits(points),
        steady=steady,
        unpaired=tuple(unpaired),
        least_length=used.least_length,
        adapted=adapted,
    )


def with_visits(points: Sequence[CurvePoint]) -> tuple[CurvePoint, ...]:
    """The points by speed, their uncertainty widened by what visits differ by beyond the scatter within each.

    Every point but the first and the last is left out once and compared with the straight line between its neighbours
    in speed. What these differences hold beyond the uncertainties of the three is the variance between visits, one for
    the complete log, with Student's factor for their number; a friction curved between three neighbouring speeds
    counts as such a difference. With fewer than three points no such estimate is possible.
    """
    by_speed = sorted(points, key=lambda p: p.speed)
    if len(by_speed) < FEWEST_VISITS:
        return tuple(by_speed)
    v, f, u = (np.array([getattr(p, name) for p in by_speed]) for name in ("speed", "friction", "u_friction"))
    gap = v[2:] - v[:-2]
    part = np.where(gap > 0.0, (v[1:-1] - v[:-2]) / np.where(gap > 0.0, gap, 1.0), 0.5)
    off = f[1:-1] - (1.0 - part) * f[:-2] - part * f[2:]
    shares = 1.0 + (1.0 - part) ** 2 + part**2
    beyond = off**2 - u[1:-1] ** 2 - ((1.0 - part) * u[:-2]) ** 2 - (part * u[2:]) ** 2
    variance = max(float(np.sum(beyond) / np.sum(shares)), 0.0)
    u_visit = float(np.sqrt(variance)) * students_factor(float(len(off)))
    return tuple(replace(p, u_friction=float(np.hypot(p.u_friction, u_visit))) for p in by_speed)


def _place_by_place(
    log: Log, matches: Pairs, windows: Sequence[Window], effort: str | FloatArray, position: str
) -> tuple[list[CurvePoint], list[Rejected]]:
    """Points of the pairs whose strokes passed a common way, and the stretches that are in none."""
    e, x = effort_of(log, effort), signal_of(log, position)
    points: list[CurvePoint] = []
    unpaired = list(matches.unpaired)
    for pair in matches.pairs:
        strokes = [_stroke(w, windows) for w in (pair.up, pair.down)]
        point = _on_common_way(log, pair, strokes, e, x)
        if isinstance(point, CurvePoint):
            points.append(point)
            unpaired = [r for r in unpaired if not any(r.start == w.start for stroke in strokes for w in stroke)]
        else:
            unpaired += [
                Rejected(w.start, w.end, w.direction, w.speed, w.effort, point, "no common way")
                for w in (pair.up, pair.down)
            ]
    return points, unpaired


def _stroke(w: Window, windows: Sequence[Window]) -> list[Window]:
    """The stretch with those before and after it in the same direction and of the same speed: one way that ripple has
    split."""
    k = windows.index(w)
    like = [o.direction == w.direction and abs(o.speed - w.speed) <= SAME_STROKE * abs(w.speed) for o in windows]
    first = next((i + 1 for i in range(k - 1, -1, -1) if not like[i]), 0)
    last = next((i for i in range(k + 1, len(windows)) if not like[i]), len(windows))
    return list(windows[first:last])


def _on_common_way(
    log: Log, pair: Pair, strokes: Sequence[Sequence[Window]], e: FloatArray, x: FloatArray
) -> CurvePoint | str:
    """Half difference and half sum along the way that both strokes (hoisting, lowering) passed; or why there is
    none."""
    ways = []
    for stroke in strokes:
        inside = np.any([(log.t >= w.start) & (log.t <= w.end) for w in stroke], axis=0)
        use = inside & np.isfinite(x) & np.isfinite(e)
        order = np.argsort(x[use], kind="stable")
        ways.append((x[use][order], e[use][order]))
    (x_up, e_up), (x_down, e_down) = ways
    if min(len(x_up), len(x_down)) < FEWEST_PLACES:
        return f"fewer than {FEWEST_PLACES} bins with a position"
    lo, hi = max(x_up[0], x_down[0]), min(x_up[-1], x_down[-1])
    n = min(int(np.sum((a >= lo) & (a <= hi))) for a in (x_up, x_down))
    if hi <= lo or n < FEWEST_PLACES:
        return f"hoisting and lowering passed {n} bins of the same places at steady speed, {FEWEST_PLACES} are needed"
    at = np.linspace(lo, hi, n)
    up, down = np.interp(at, x_up, e_up), np.interp(at, x_down, e_down)
    friction, u_friction = mean_and_uncertainty(0.5 * (up - down))
    load = 0.5 * (up + down)
    slope, middle = np.polyfit(at - at.mean(), load, 1)
    _, u_load = mean_and_uncertainty(load - slope * (at - at.mean()))
    ends = (float(middle + slope * (lo - at.mean())), float(middle + slope * (hi - at.mean())))
    return CurvePoint(
        pair.speed, friction, u_friction, float(middle), u_load, pair.up, pair.down, (float(lo), float(hi)), ends
    )


def _no_point(log: Log, steady: Steady, unpaired: Sequence[Rejected]) -> str:
    every = (*unpaired, *steady.rejected)
    longest = max((r.end - r.start for r in every if r.code == "short"), default=0.0)
    shorter = (
        f', or take shorter stretches: curve.least_length = "{0.9 * longest:.2g} s" in the mapping file'
        if longest > 0.0
        else ""
    )
    first = f", the first because: {every[0].reason}" if every else ""
    return (
        f"{log.source}: no speed at which both directions can be compared, among {len(steady.windows)} steady stretches"
        f" and {len(steady.rejected)} rejected ones{first}. Hold each speed longer, in both directions{shorter}."
    )


USED, ALONE = ("#009E73", 0.3, "steady, used"), ("#56B4E9", 0.35, "steady, no partner")
EXCLUDED, NOT_USED = ("#E69F00", 0.25, "start left out"), ("#999999", 0.35, "rejected")
"""Colour, opacity and label of the stretches."""
MOST_POINTS = 6000
"""Points of a drawn line: more are not seen, and make the picture slow."""
WORDS_FROM = 0.012
"""Part of the log from which on a rejected stretch is wide enough for its word."""


def window_figure(
    log: Log, speed: str, effort: str, steady: Steady, unpaired: Sequence[Rejected], title: str
) -> Figure:
    """Speed and effort over time with the stretches, see `draw_windows`."""
    figure, axes = panels(2, 1, (12.0, 6.5), title, sharex=True)
    draw_windows(axes[:, 0].tolist(), log, speed, effort, steady, unpaired=unpaired)
    return figure


def draw_windows(
    axes: Sequence[Any],
    log: Log,
    speed: str,
    effort: str | FloatArray,
    steady: Steady,
    *,
    unpaired: Sequence[Rejected] = (),
    kinds: Mapping[str, str] | None = None,
) -> None:
    """Speed over time into the first axes, effort into the second; used stretches green, rejected ones grey with their
    reason in a word, settling orange, those that `pair_windows` found no partner for blue."""
    name = effort if isinstance(effort, str) else "effort"
    alone = {r.start for r in unpaired}
    used = [w for w in steady.windows if w.start not in alone]
    for ax, label, values, kind in (
        (axes[0], speed, signal_of(log, speed), kind_of(log, speed, kinds)),
        (axes[1], name, effort_of(log, effort), kind_of(log, effort, kinds)),
    ):
        t, x = _thinned(log.t, displayed(values, kind))
        ax.plot(t, x, color=COLOURS[0], lw=0.8)
        ax.set_ylabel(labelled(label, kind))
        ax.grid(alpha=0.3)
        _shade(ax, steady, used, unpaired)
    _words(axes[0], steady.rejected, float(log.t[-1] - log.t[0]))
    axes[1].set_xlabel("time [s]")
    axes[1].set_xlim(float(log.t[0]), float(log.t[-1]))
    _legend(axes[0], with_unpaired=bool(unpaired))


def curve_figure(curve: FrictionCurve, log: Log, effort: str | FloatArray) -> Figure:
    """Speed and effort over time with the stretches that were used, and friction over speed with 95 % intervals."""
    figure = canvas(12.0, 10.5, curve.source)
    grid = figure.add_gridspec(3, 1, height_ratios=(1.0, 1.0, 1.4))
    above = figure.add_subplot(grid[0])
    below = figure.add_subplot(grid[1], sharex=above)
    draw_windows((above, below), log, curve.speed, effort, curve.steady, unpaired=curve.unpaired, kinds=curve.kinds)
    kind_v, kind_e = curve.kinds["speed"], curve.kinds["effort"]
    v = displayed(np.array([p.speed for p in curve.points]), kind_v)
    F = displayed(np.array([p.friction for p in curve.points]), kind_e)
    half = displayed(np.array([p.estimate.half for p in curve.points]), kind_e)
    label = "half the difference of both directions, 95 %"
    ax = figure.add_subplot(grid[2])
    ax.errorbar(v, F, yerr=half, fmt="o-", color=COLOURS[0], lw=1.0, ms=4.0, capsize=3.0, label=label)
    axis(ax, labelled("speed", kind_v), labelled("friction", kind_e), zero="x")
    ax.set_ylim(bottom=min(0.0, float(np.min(F - half))))
    ax.grid(alpha=0.3)
    legend(ax)
    return figure


def labelled(name: str, kind: str) -> str:
    return f"{name} [{KINDS[kind].display}]" if kind in KINDS else f"{name} [SI]"


def displayed(values: FloatArray, kind: str) -> FloatArray:
    """SI values in the unit that their kind prints in."""
    if kind not in KINDS:
        return values
    zero = in_display(0.0, kind)
    return np.asarray(values * (in_display(1.0, kind) - zero) + zero, dtype=float)


def _thinned(t: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest value of equal stretches, so that a long log keeps its spikes."""
    size = 2 * len(t) // MOST_POINTS
    if size < 2:
        return t, x
    n = len(t) // size * size
    y = x[:n].reshape(-1, size)
    y = np.where(np.all(np.isnan(y), axis=1, keepdims=True), 0.0, y)
    both = np.stack([np.nanmin(y, axis=1), np.nanmax(y, axis=1)], axis=1).ravel()
    return np.repeat(t[:n].reshape(-1, size).mean(axis=1), 2), both


def _shade(ax: Any, steady: Steady, used: Sequence[Window], unpaired: Sequence[Rejected]) -> None:
    from matplotlib.collections import PolyCollection  # one for all of a kind: hundreds of spans take seconds

    groups: tuple[Sequence[Window | Rejected], ...] = (steady.rejected, steady.trimmed, unpaired, used)
    for parts, (colour, alpha, _) in zip(groups, (NOT_USED, EXCLUDED, ALONE, USED), strict=True):
        boxes = [((p.start, 0.0), (p.start, 1.0), (p.end, 1.0), (p.end, 0.0)) for p in parts]
        spans = PolyCollection(boxes, transform=ax.get_xaxis_transform(), color=colour, alpha=alpha, lw=0)
        ax.add_collection(spans, autolim=False)


def _words(ax: Any, rejected: Sequence[Rejected], length: float) -> None:
    for r in rejected:
        if r.end - r.start > WORDS_FROM * length:
            place = {"transform": ax.get_xaxis_transform(), "rotation": 90, "ha": "center", "va": "bottom"}
            ax.text(0.5 * (r.start + r.end), 0.02, r.code, fontsize="x-small", color=GREY, **place)


def _legend(ax: Any, *, with_unpaired: bool) -> None:
    from matplotlib.patches import Patch

    shown = (USED, ALONE, EXCLUDED, NOT_USED) if with_unpaired else (USED, EXCLUDED, NOT_USED)
    handles = [Patch(color=colour, alpha=alpha, label=label) for colour, alpha, label in shown]
    ax.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize="small", frameon=False)
