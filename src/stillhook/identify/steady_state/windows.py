"""Steady stretches of a staircase test, found by themselves: what is used, what is not, and why.

Source of the test: Moslatt 2020 section 2.2 and figure 2.5: hoisting and lowering in turn at rising pump command, data
"from the last part of the steady-state situation to ensure stabilized pressures and velocities".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.identify.steady_state.search import LEVEL_CHANGE, WORTH_REPORTING, Search, signal_of
from stillhook.identify.steady_state.steps import (
    NOISE_LIMIT,
    Rejected,
    Steady,
    Step,
    Window,
    WindowSettings,
    find_steps,
    sides,
)
from stillhook.statistics.correlated_mean import blocks, mean_and_uncertainty, noise_of, trends
from stillhook.statistics.estimate import NORMAL_95

if TYPE_CHECKING:
    from stillhook.logs.types import Log

TREND_BLOCKS = 96
"""Samples of a step are put together into so many at most before its drift is looked at."""
MOST_STARTS = 24
"""Starts of the last part that are tried: to 4 % of the step's length."""
HEAD = 1.0
"""Beginning of a stretch that must agree with its rest: a load on its wire oscillates once [s]."""
JUMP_SIDE, JUMP_CLEAR, JUMP_FAR, JUMP_RATIO = 1.0, 0.5, 2.0, 4.0
"""A jump: means of 1 s before and after differ, four times more than the same two seconds earlier and later; 0.5 s is
left out on both sides of it, in which the pressure settles to its new level [s]."""
MOST_JUMPS = 4
"""Layers that one step is looked through for: 60 s at full speed cross no more."""
FISHER = 0.01
"""Chance of a false alarm of Fisher's test for one frequency in noise (Proc. R. Soc. A 125, 1929)."""
REST = 0.1
"""Part of the mean speed below which the winch is at rest; noise, however large, puts no more than 5 % of the samples
there."""
MIN_DEGREES = 3.0
"""A speed that is not three standard uncertainties from zero has no direction."""


def steady_windows(
    log: Log,
    speed: str,
    effort: str | FloatArray,
    *,
    command: str | None = None,
    held: Sequence[str] = (),
    layer_limits: Sequence[float] = (),
    kinds: Mapping[str, str] | None = None,
    settings: WindowSettings | None = None,
) -> Steady:
    """Steady stretches of a log.

    Parameters: speed signal whose sign is the direction (hoisting positive); effort signal that friction shows in,
    "dp_m" also where only p_a and p_b are there, or an array of shape (n,) in SI; command set signal whose changes
    begin new steps; held signals that must stay (displacement); layer_limits wire out s_w at which the wire changes its
    layer [m]: no stretch runs across one; kinds units.KINDS of signals by name, for texts ("effort" itself may be
    named). Every step is averaged over the longest last part in which speed, effort and held signals do not drift:
    beyond their tolerance *and* beyond their noise.
    Errors: IdentifyError for a name that the log does not have, or no sample to work on.
    """
    s = settings or WindowSettings()
    search = Search(log, speed, effort, command, tuple(held), dict(kinds or {}), s)
    parts: list[Window | Rejected] = list(search.bad_speed())
    for step in find_steps(search.t, search.v, search.command, search.holes, search.quanta[0], s):
        for part in _cut_at_layers(search, step, layer_limits):
            parts += _from_step(search, part)
    parts = [p for p in parts if isinstance(p, Window) or not search.pause_or_ramp(p)]
    parts += search.never_steady([p for p in parts if isinstance(p, Window) or p.code != "start"])
    parts.sort(key=lambda p: p.start)
    windows = tuple(p for p in parts if isinstance(p, Window))
    trimmed = tuple(p for p in parts if isinstance(p, Rejected) and p.code == "start")
    rejected = tuple(p for p in parts if isinstance(p, Rejected) and p.code != "start")
    return Steady(windows, rejected, trimmed)


def _cut_at_layers(search: Search, step: Step, limits: Sequence[float]) -> list[Step]:
    """The step in parts, none of which holds a change of layer that the caller has named."""
    if not limits:
        return [step]
    wire = signal_of(search.log, "s_w")[search.at][step.begin : step.end]
    layer = np.searchsorted(np.sort(np.asarray(limits, dtype=float)), wire)
    rising = layer[-1] >= layer[0]  # noise crosses no layer twice
    layer = np.maximum.accumulate(layer) if rising else np.minimum.accumulate(layer)
    edges = [0, *(np.nonzero(np.diff(layer))[0] + 1).tolist(), len(layer)]
    pairs = pairwise(edges)
    return [Step(step.begin + a, step.begin + b, step.direction, at_layer=len(edges) > 2) for a, b in pairs]


def _from_step(search: Search, step: Step) -> Iterator[Window | Rejected]:
    """What becomes of one step: windows, parts that were left out, or a reason."""
    length = float(search.t[step.end - 1] - search.t[step.begin]) + search.dt
    least = WORTH_REPORTING * search.settings.least_length
    if (length < least or step.end - step.begin < 2) and not step.at_layer:
        return
    direction = step.direction
    for part in _parts_of(search, step):
        if isinstance(part, Rejected):
            yield part
            continue
        tail = _last_part(search, part, direction)
        if isinstance(tail, Rejected):
            yield tail
            continue
        use, reason = tail
        window = _window_of(search, use, direction)
        yield window
        if isinstance(window, Window) and reason:
            yield search.rejected(int(part[0]), int(use[0]), direction, "start", reason)


def _parts_of(search: Search, step: Step) -> Iterator[IntArray | Rejected]:
    """A step in parts without holes and jumps, each the good bins of a stretch at least as long as a window; what is
    too short with its reason."""
    s = search.settings
    last = int(np.searchsorted(search.t, search.t[step.end - 1] + 0.5 * search.dt - s.guard, "right"))
    inside = np.arange(step.begin, max(min(last, step.end), step.begin + 1))
    good = inside[~search.bad[inside]]
    for run in np.split(good, np.nonzero(np.diff(search.t[good]) > s.largest_hole + search.dt)[0] + 1):
        parts = _at_jumps(search, run)
        for i, part in enumerate(parts):
            after_hole = i == 0 and not (len(run) and run[0] == inside[0])
            if _long_enough(search, part):
                yield part
            else:
                yield _too_short(search, step, part, inside, jumped=len(parts) > 1, after_hole=after_hole)


def _long_enough(search: Search, part: IntArray) -> bool:
    s = search.settings
    if len(part) < s.least_samples:
        return False
    span = float(search.t[part[-1]] - search.t[part[0]]) + search.dt
    covered = int(part[-1]) - int(part[0]) + 1
    return span >= s.least_length * (1.0 - 1e-9) and len(part) >= (1.0 - s.doubtful) * covered


def _too_short(
    search: Search, step: Step, part: IntArray, inside: IntArray, *, jumped: bool, after_hole: bool
) -> Rejected:
    begin, end = (int(part[0]), int(part[-1]) + 1) if len(part) else (int(inside[0]), int(inside[-1]) + 1)
    span = float(search.t[end - 1] - search.t[begin]) + search.dt
    lost = search.bad[inside]
    if len(part) == 0 or np.any(search.bad[begin:end]) or (np.any(lost) and after_hole):
        names = (*search.effort_sources, *search.held)
        code = search.bad_code(names, search.t[inside[0]], search.t[inside[-1]])
        text = f"{code}: {np.sum(lost) * search.dt:.3g} s of {len(inside) * search.dt:.3g} s cannot be trusted"
    elif jumped or step.at_layer:
        code, text = "layer change", f"{span:.3g} s next to a change of layer"
    elif _at_hole(search, step):
        code, text = "gap", f"{span:.3g} s next to a gap in the log"
    else:
        code, text = "short", f"{span:.3g} s at steady speed"
    needed = f"a window needs {search.settings.least_length:.3g} s and {search.settings.least_samples} samples"
    return search.rejected(begin, end, step.direction, code, f"{text}; {needed}")


def _at_hole(search: Search, step: Step) -> bool:
    """Whether samples are missing at an end of the step."""
    t = search.t
    wide = search.settings.largest_hole + search.dt
    before = step.begin > 0 and t[step.begin] - t[step.begin - 1] > wide
    return before or (step.end < len(t) and t[step.end] - t[step.end - 1] > wide)


def _at_jumps(search: Search, run: IntArray) -> list[IntArray]:
    t = search.t[run]
    jumps = find_jumps(t, search.e[run], search.settings.effort_jump * search.high_effort)
    parts, begin = [], 0
    for at in jumps:
        parts.append(run[begin : int(np.searchsorted(t, t[at] - JUMP_CLEAR))])
        begin = int(np.searchsorted(t, t[at] + JUMP_CLEAR))
    parts.append(run[begin:])
    return [part for part in parts if len(part)] or [run]


def find_jumps(t: FloatArray, e: FloatArray, least: float) -> list[int]:
    """Indices at which the level of e changes suddenly, by time: a jump, no drift, and not the first seconds of a
    step."""
    if len(t) < 8 or t[-1] - t[0] < JUMP_FAR + 2.0 * JUMP_SIDE:
        return []
    before, after, _, count = sides(t, e, JUMP_SIDE)
    size = np.abs(after - before)
    visible = (
        (size > least) & (size > NOISE_LIMIT * noise_of(e) * np.sqrt(2.0 / count)) & (count >= min(3.0, count.max()))
    )
    visible &= t > t[0] + JUMP_FAR + JUMP_SIDE
    out: list[int] = []
    while np.any(visible) and len(out) < MOST_JUMPS:
        k = int(np.argmax(np.where(visible, size, 0.0)))
        far = [int(np.searchsorted(t, t[k] + sign * JUMP_FAR)) for sign in (-1.0, 1.0)]
        if all(JUMP_RATIO * size[j] <= size[k] for j in far if 0 < j < len(t) - 1):
            out.append(k)
        visible &= np.abs(t - t[k]) > JUMP_FAR
    return sorted(out)


def _last_part(search: Search, part: IntArray, direction: int) -> tuple[IntArray, str] | Rejected:
    """Bins of the longest last part without drift, and why the beginning was left out; or why there is none."""
    s, tolerance = search.settings, search.tolerances(int(part[0]), int(part[-1]) + 1)
    idx = _without_ramp(search, part, float(tolerance[0]) / LEVEL_CHANGE)
    averages = blocks(np.concatenate([search.t[idx][None, :], search.channels[:, idx]]), TREND_BLOCKS)
    t, x = averages[0], averages[1:]
    n = len(t)
    size = -(-len(idx) // TREND_BLOCKS)
    latest = min(int(np.searchsorted(t, t[-1] + size * search.dt - s.least_length + 1e-6, "right")) - 1, n - 3)
    starts = np.unique(np.linspace(0, max(latest, 0), MOST_STARTS).astype(np.intp))
    tr = trends(t, x, starts, HEAD)
    worst = tr.worst(tolerance)
    fails = np.nonzero(np.any(worst > 1.0, axis=0))[0]
    if len(fails) and fails[-1] == len(starts) - 1:
        span = float(t[-1] - t[starts[-1]])
        return _not_steady(search, part, direction, worst[:, -1], tr.drift[:, -1], span)
    first = 0 if len(fails) == 0 else int(fails[-1]) + 1
    hidden = tr.goes_on(first, tolerance)
    if np.any(hidden > 1.0) and tr.span[first] < 2.0 * s.least_length:  # longer ones show their own drift
        drift = hidden * np.where(hidden > 0.0, tolerance, 0.0)
        return _not_steady(search, part, direction, hidden, drift, float(t[-1] - t[starts[first]]))
    k = first + (_most_certain(x[:2], starts[first:]) if np.isfinite(tolerance[1]) else 0)
    start = int(starts[k])
    if np.isfinite(tolerance[1]):
        start = min(start + round(s.spare * (n - start)), max(latest, start))
    use = idx[len(idx) - (n - start) * size :] if start else idx
    if start == 0:
        return use, ""
    off = np.mean(x[:, :start], axis=1) - np.mean(x[:, start:], axis=1)
    bad = int(np.argmax(np.abs(off) / tolerance))
    name = search.name(bad)
    return use, f"settling: {name} was on average {search.text(name, off[bad])} off for {t[start] - t[0]:.3g} s"


def _without_ramp(search: Search, idx: IntArray, limit: float) -> IntArray:
    """Without the beginning of the next ramp, which is too slow to show at once where the converter is coarse or the
    noise large."""
    bins = max(3, round(search.settings.smoothing / search.dt))
    fewest = max(search.settings.least_samples, round(search.settings.least_length / search.dt), 4 * bins)
    while len(idx) - bins >= fewest:
        tail, before = search.v[idx[-bins:]], search.v[idx[-4 * bins : -bins]]
        off = abs(float(tail.mean() - before.mean()))
        if off <= max(limit, NOISE_LIMIT * float(before.std()) / np.sqrt(bins)):
            break
        idx = idx[:-bins]
    return idx


def _most_certain(x: FloatArray, starts: IntArray) -> int:
    """Which of the starts gives the best known means of speed and effort: the least variance over count, each against
    its best.

    Source: White, An effective truncation heuristic for bias reduction in simulation output, Simulation 69 (1997): the
    marginal standard error rule, which looks for the start in the first half as here. It takes the end of a decay away
    that is still within the tolerances.
    """
    n = x.shape[1]
    starts = starts[: len(starts) // 2 + 1]
    r = x - x[:, -1:]
    sums, squares = (np.cumsum(y[:, ::-1], axis=1)[:, ::-1][:, starts] for y in (r, r * r))
    count = n - starts
    spread = np.maximum(squares - sums**2 / count, 0.0) / count**2
    least = np.min(spread, axis=1, keepdims=True)
    return int(np.argmin(np.sum(spread / np.where(least > 0.0, least, 1.0), axis=0)))


def _not_steady(
    search: Search, part: IntArray, direction: int, worst: FloatArray, drift: FloatArray, span: float
) -> Rejected:
    """The part with what drifts most in it; worst: drift over tolerance, drift in SI, both (channels,); span [s]."""
    k = int(np.argmax(worst))
    name, limit = search.name(k), abs(drift[k]) / worst[k] if worst[k] else 0.0
    code, verb = ("displacement moved", "moved") if k > 1 else ("settling", "still drifted")
    reason = (
        f"{name} {verb} by {search.text(name, drift[k])} over the last {span:.3g} s; allowed is"
        f" {search.text(name, limit)}"
    )
    return search.rejected(int(part[0]), int(part[-1]) + 1, direction, code, reason)


def _window_of(search: Search, use: IntArray, direction: int) -> Window | Rejected:
    """The window, or why its mean says nothing about steady friction."""
    s = search.settings
    v, e = search.v[use], search.e[use]
    speed, u_speed = mean_and_uncertainty(v, step=search.quanta[0], per_bin=search.per_bin, floor=search.floors[0])
    effort, u_effort = mean_and_uncertainty(e, step=search.quanta[1], per_bin=search.per_bin, floor=search.floors[1])
    begin, end = int(use[0]), int(use[-1]) + 1

    def too_slow(reason: str) -> Rejected:
        return search.rejected(begin, end, direction, "too slow", reason)

    shown = search.text("speed", speed)
    if abs(speed) < search.slowest:
        return too_slow(f"{shown} is below the least speed {search.text('speed', search.slowest)}")
    if abs(speed) < MIN_DEGREES * u_speed:
        return too_slow(f"{shown} is not known better than to {search.text('speed', NORMAL_95 * u_speed)} (95 %)")
    sticking = float(np.mean(np.abs(v) < REST * abs(speed)))
    if sticking > s.standstill:
        return too_slow(f"stick-slip: at rest for {100 * sticking:.0f} % of the time, {shown} on average")
    for name, x, scale in (("speed", v, abs(speed)), ("effort", e, search.high_effort)):
        if name == "effort" and not np.isfinite(s.effort_drift):
            continue
        amplitude, period = oscillation(search.t[use], x, s.oscillation * scale)
        if amplitude > s.oscillation * scale:
            reason = (
                f"{name} swings by +-{search.text(name, amplitude)} with a period of {period:.3g} s; allowed is"
                f" {search.text(name, s.oscillation * scale)}"
            )
            return search.rejected(begin, end, direction, "oscillating", reason)
    start, stop = search.ends(begin, end)
    return Window(start, stop, direction, speed, u_speed, effort, u_effort, len(use), search.means(use))


def oscillation(t: FloatArray, x: FloatArray, least: float) -> tuple[float, float]:
    """Amplitude and period of the strongest frequency, (0, 0) where it is below `least` or may be noise (Fisher's
    test).

    Only frequencies with two periods or more in the stretch count: one is a drift.
    """
    r = x - x.mean()
    if np.sqrt(2.0 * np.mean(r * r)) <= least or len(x) < 8:
        return 0.0, 0.0
    power = np.abs(np.fft.rfft(r)[1:]) ** 2
    k = 1 + int(np.argmax(power[1:]))
    m = len(power)
    if power[k] / power.sum() < 1.0 - (FISHER / m) ** (1.0 / (m - 1)):
        return 0.0, 0.0
    near = float(np.sum(power[max(k - 1, 0) : k + 2]))
    return float(2.0 * np.sqrt(near)) / len(x), float(t[-1] - t[0]) / (k + 1) * len(x) / max(len(x) - 1, 1)
