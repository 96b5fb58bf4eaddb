"""Friction over speed of any machine that was run to and fro in steps: winch, ram, test bench.

What friction is here: half the difference of effort between both directions at the same speed (Moslatt 2020 eq. 2.4). Everything that
turns with the direction is in it: dry and viscous friction, hysteresis, and whatever brakes the machine on purpose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import IdentifyError
from stillhook.identify.means import NORMAL_95, mean_and_uncertainty
from stillhook.identify.pairs import Pair, pair_windows
from stillhook.identify.steady_records import Rejected, Steady, Window, WindowSettings
from stillhook.identify.windows import effort_of, kind_of, signal_of, steady_windows
from stillhook.io.log import Log
from stillhook.units import KINDS, show

FloatArray = NDArray[np.float64]

SAME_STROKE = 0.05
"""Stretches of one stroke that differ in speed by less are compared as one: friction changes by far less than its uncertainty."""
FEWEST_PLACES = 10
"""Bins that both directions must have on their common way: fewer say nothing of the scatter along it."""


@dataclass(frozen=True)
class CurvePoint:
    """Friction at one speed, from one stretch of each direction; SI of the signals.

    ``speed`` mean magnitude of both; ``friction`` half the difference, ``load`` half the sum of effort; ``u_friction``, ``u_load``
    standard uncertainties; ``way`` ends of the positions that both passed, ``load_way`` load at these ends (none without position).
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
    def interval(self) -> tuple[float, float]:
        """95 % interval of the friction."""
        half = NORMAL_95 * self.u_friction
        return self.friction - half, self.friction + half


@dataclass(frozen=True)
class FrictionCurve:
    """``points`` by speed; ``steady`` stretches used and rejected; ``unpaired`` stretches without a partner; what was asked."""

    source: str
    speed: str
    effort: str
    position: str | None
    kinds: Mapping[str, str]
    points: tuple[CurvePoint, ...]
    steady: Steady
    unpaired: tuple[Rejected, ...]

    def text(self, what: str, value: float, digits: int = 4) -> str:
        """A "speed", "effort" or "position" with its unit; in SI where none is known."""
        kind = self.kinds.get(what, "")
        return show(value, kind, digits) if kind in KINDS else f"{value:.{digits}g}"

    def to_dict(self) -> dict[str, Any]:
        """Everything in SI as plain data for JSON."""
        points = [{**asdict(p), "interval_95": p.interval} for p in self.points]
        rejected = [asdict(r) for r in (*self.steady.rejected, *self.unpaired)]
        return {
            "source": self.source, "speed": self.speed, "effort": self.effort, "position": self.position, "kinds": dict(self.kinds),
            "points": points, "rejected": rejected, "trimmed": [asdict(r) for r in self.steady.trimmed], "time": dict(self.steady.time),
        }  # fmt: skip


def friction_curve(
    log: Log,
    *,
    speed: str = "speed",
    effort: str | FloatArray = "effort",
    position: str | None = None,
    command: str | None = None,
    held: Sequence[str] = (),
    made_of: Sequence[str] = (),
    kinds: Mapping[str, str] | None = None,
    settings: WindowSettings | None = None,
) -> FrictionCurve:
    """Friction over speed with 95 % uncertainty from a staircase log.

    Parameters: log from `read_log`; speed, effort, command, held, made_of, kinds, settings as in `steady_windows`; position name of
    the signal on which the load depends besides the direction (a spring, a slope). With a position, both directions are compared
    place by place on the way that both passed at steady speed, and effort need not be steady in time; the scatter along the way,
    a friction that itself depends on the place included, is in the uncertainty.
    Errors: IdentifyError where a signal is missing or no two stretches can be compared, with the first reasons.
    """
    asked = settings or WindowSettings()
    if position is not None:
        asked = asked.for_effort_of_place()
    known = {"speed": kind_of(log, speed, kinds), "effort": kind_of(log, effort, kinds)}
    named = {**(kinds or {}), **known}
    steady = steady_windows(log, speed, effort, command=command, held=held, made_of=made_of, kinds=named, settings=asked)

    def text(v: float) -> str:
        return show(v, known["speed"], 3) if known["speed"] in KINDS else f"{v:.3g}"

    found = pair_windows(steady.windows, text=text)
    points: list[CurvePoint] = []
    unpaired = list(found.unpaired)
    if position is None:
        points = [CurvePoint(p.speed, p.friction, p.u_friction, p.load, p.u_friction, p.up, p.down) for p in found.pairs]
    else:
        known["position"] = kind_of(log, position, kinds)
        e = effort_of(log, effort)
        x = signal_of(log, position)
        for pair in found.pairs:
            strokes = [_stroke(w, steady.windows) for w in (pair.up, pair.down)]
            point = _place_by_place(log, pair, strokes, e, x)
            if isinstance(point, CurvePoint):
                points.append(point)
                unpaired = [r for r in unpaired if not any(r.start == w.start for w in (*strokes[0], *strokes[1]))]
            else:
                unpaired += [Rejected(w.start, w.end, w.direction, w.speed, w.effort, point, "no common way") for w in (pair.up, pair.down)]
    if not points:
        raise IdentifyError(_nothing(log, steady, unpaired))
    name = effort if isinstance(effort, str) else "effort"
    return FrictionCurve(log.source, speed, name, position, known, tuple(sorted(points, key=lambda p: p.speed)), steady, tuple(unpaired))


def _stroke(w: Window, windows: Sequence[Window]) -> list[Window]:
    """The stretch with those before and after it in the same direction and of the same speed: one way that ripple has split."""
    k = windows.index(w)
    like = [o.direction == w.direction and abs(o.speed - w.speed) <= SAME_STROKE * abs(w.speed) for o in windows]
    first = next((i + 1 for i in range(k - 1, -1, -1) if not like[i]), 0)
    last = next((i for i in range(k + 1, len(windows)) if not like[i]), len(windows))
    return list(windows[first:last])


def _place_by_place(log: Log, pair: Pair, strokes: Sequence[Sequence[Window]], e: FloatArray, x: FloatArray) -> CurvePoint | str:
    """Half difference and half sum along the way that both strokes (hoisting, lowering) passed; or why there is none."""
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
    return CurvePoint(pair.speed, friction, u_friction, float(middle), u_load, pair.up, pair.down, (float(lo), float(hi)), ends)


def _nothing(log: Log, steady: Steady, unpaired: Sequence[Rejected]) -> str:
    reasons = [r.reason for r in (*unpaired, *steady.rejected)]
    first = f", the first because: {reasons[0]}" if reasons else ""
    return (
        f"{log.source}: no speed at which both directions can be compared, among {len(steady.windows)} steady stretches and "
        f"{len(steady.rejected)} rejected ones{first}. Hold each speed longer, in both directions."
    )
