"""The last part of a step that is steady, and what it is worth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.identify.steady_state.steps import NOISE_LIMIT, Rejected, Window, WindowSettings, sides
from stillhook.statistics.correlated_mean import blocks, mean_and_uncertainty, noise_of, trends
from stillhook.statistics.estimate import NORMAL_95

if TYPE_CHECKING:
    from stillhook.logs.log import Finding, Log


TREND_BLOCKS = 96
"""Samples of a step are put together into so many at most before its drift is looked at."""
MOST_STARTS = 24
"""Starts of the last part that are tried: to 4 % of the step's length."""
HEAD = 1.0
"""Beginning of a stretch that must agree with its rest: a load on its wire swings once [s]."""
JUMP_SIDE, JUMP_CLEAR, JUMP_FAR, JUMP_RATIO = 1.0, 0.5, 2.0, 4.0
"""A jump: means of 1 s before and after differ, four times more than the same two seconds earlier and later; 0.5 s is
left out on both sides of it, in which the pressure swings to its new level [s]."""
MOST_JUMPS = 4
"""Layers that one step is looked through for: 60 s at full speed cross no more."""
FISHER = 0.01
"""Chance of a false alarm of Fisher's test for one frequency in noise (Proc. R. Soc. A 125, 1929)."""
REST = 0.1
"""Part of the mean speed below which the winch is at rest; noise, however large, puts no more than 5 % of the samples
there."""
MIN_DEGREES = 3.0
"""A speed that is not three standard uncertainties from zero has no direction."""
LEVEL_CHANGE = 1.5
"""Drift of a straight line through one change of the converter's level in the middle of a stretch, in levels."""
BAD_KINDS = ("saturated", "stuck", "missing", "gap")


class Search(Protocol):
    """What `windows._Search` offers here."""

    log: Log
    settings: WindowSettings
    held: tuple[str, ...]
    effort_sources: tuple[str, ...]
    t: FloatArray
    v: FloatArray
    e: FloatArray
    channels: FloatArray
    bad: NDArray[np.bool_]
    at: IntArray
    dt: float
    quanta: tuple[float, float]
    floors: tuple[float, float]
    per_bin: float
    slowest: float
    high_effort: float

    def tolerances(self, begin: int, end: int) -> FloatArray: ...
    def name(self, channel: int) -> str: ...
    def text(self, name: str, value: float) -> str: ...
    def means(self, use: IntArray) -> dict[str, float]: ...
    def rejected(self, begin: int, end: int, direction: int, code: str, reason: str) -> Rejected: ...


@dataclass(frozen=True)
class Cut:
    """Bins [begin, end) of a step, and what bounds it: "step" (the ramp), "layer"."""

    begin: int
    end: int
    before: str
    after: str


@dataclass(frozen=True)
class Piece:
    """Bins [begin, end) with their good ones, which have no hole: indices into the search's arrays."""

    begin: int
    end: int
    good: IntArray


def bad_code(findings: Iterable[Finding], names: Sequence[str], start: float, end: float) -> str:
    """What the log's findings call a doubtful stretch."""
    kinds = {f.kind for f in findings if f.signal in names and f.start <= end and f.end >= start}
    return next((k for k in BAD_KINDS if k in kinds), "missing")


def pieces_of(search: Search, cut: Cut, direction: int) -> tuple[list[Piece], list[Rejected]]:
    """A step in parts without holes and jumps, each at least as long as a window; and what is too short, with its
    reason."""
    s, pieces, refused = search.settings, [], []
    last = int(np.searchsorted(search.t, search.t[cut.end - 1] + 0.5 * search.dt - s.guard, "right"))
    inside = np.arange(cut.begin, max(min(last, cut.end), cut.begin + 1))
    good = inside[~search.bad[inside]]
    runs = np.split(good, np.nonzero(np.diff(search.t[good]) > s.largest_hole + search.dt)[0] + 1)
    for run in runs:
        bounded = cut.before if len(run) and run[0] == inside[0] else "hole"
        parts = _at_jumps(search, run, bounded)
        for part, after in parts:
            if _long_enough(search, part):
                pieces.append(Piece(int(part[0]), int(part[-1]) + 1, part))
            else:
                refused.append(_too_short(search, cut, part, inside, direction, jumped=len(parts) > 1, after=after))
    return pieces, refused


def _long_enough(search: Search, part: IntArray) -> bool:
    s = search.settings
    if len(part) < s.least_samples:
        return False
    span = float(search.t[part[-1]] - search.t[part[0]]) + search.dt
    covered = int(part[-1]) - int(part[0]) + 1
    return span >= s.least_length * (1.0 - 1e-9) and len(part) >= (1.0 - s.doubtful) * covered


def _too_short(
    search: Search, cut: Cut, part: IntArray, inside: IntArray, direction: int, *, jumped: bool, after: str
) -> Rejected:
    """Why a part of a step gives no window."""
    least = f"a window needs {search.settings.least_length:.3g} s and {search.settings.least_samples} samples"
    begin, end = (int(part[0]), int(part[-1]) + 1) if len(part) else (int(inside[0]), int(inside[-1]) + 1)
    span = float(search.t[end - 1] - search.t[begin]) + search.dt
    lost = search.bad[inside]
    if len(part) == 0 or np.any(search.bad[begin:end]) or (np.any(lost) and after == "hole"):
        code = bad_code(
            search.log.findings, (*search.effort_sources, *search.held), search.t[inside[0]], search.t[inside[-1]]
        )
        seconds = (float(np.sum(lost)) * search.dt, len(inside) * search.dt)
        reason = f"{code}: {seconds[0]:.3g} s of {seconds[1]:.3g} s cannot be trusted; {least}"
        return search.rejected(begin, end, direction, code, reason)
    if jumped or cut.before == "layer" or cut.after == "layer":
        return search.rejected(
            begin, end, direction, "layer change", f"{span:.3g} s next to a change of layer; {least}"
        )
    if _at_hole(search, cut):
        return search.rejected(begin, end, direction, "gap", f"{span:.3g} s next to a gap in the log; {least}")
    return search.rejected(begin, end, direction, "short", f"{span:.3g} s at steady speed; {least}")


def _at_hole(search: Search, cut: Cut) -> bool:
    """Whether samples are missing at an end of the step."""
    t = search.t
    wide = search.settings.largest_hole + search.dt
    before = cut.begin > 0 and t[cut.begin] - t[cut.begin - 1] > wide
    return before or (cut.end < len(t) and t[cut.end] - t[cut.end - 1] > wide)


def _at_jumps(search: Search, run: IntArray, bounded: str) -> list[tuple[IntArray, str]]:
    """A run split where effort jumps at steady speed, with what each part begins after."""
    if len(run) == 0:
        return [(run, bounded)]
    t = search.t[run]
    jumps = find_jumps(t, search.e[run], search.settings.effort_jump * search.high_effort)
    out, begin, after = [], 0, bounded
    for at in jumps:
        out.append((run[begin : int(np.searchsorted(t, t[at] - JUMP_CLEAR))], after))
        begin, after = int(np.searchsorted(t, t[at] + JUMP_CLEAR)), "jump"
    out.append((run[begin:], after))
    return [(part, name) for part, name in out if len(part)] or [(run, bounded)]


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


def last_part(search: Search, piece: Piece) -> tuple[IntArray, str] | str:
    """Bins of the longest last part without drift, and why the beginning was left out; or "code|reason" where there is
    none."""
    s, tolerance = search.settings, search.tolerances(piece.begin, piece.end)
    idx = _without_ramp(search, piece.good, float(tolerance[0]) / LEVEL_CHANGE)
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
        return _not_steady(search, worst[:, -1], tr.drift[:, -1], float(t[-1] - t[starts[-1]]))
    first = 0 if len(fails) == 0 else int(fails[-1]) + 1
    hidden = tr.goes_on(first, tolerance)
    if np.any(hidden > 1.0) and tr.span[first] < 2.0 * s.least_length:  # longer ones show their own drift
        drift = hidden * np.where(hidden > 0.0, tolerance, 0.0)
        return _not_steady(search, hidden, drift, float(t[-1] - t[starts[first]]))
    k = first + (_most_certain(x[:2], starts[first:]) if np.isfinite(tolerance[1]) else 0)
    start = int(starts[k])
    if np.isfinite(tolerance[1]):
        start = min(start + round(s.spare * (n - start)), max(latest, start))
    use = idx[len(idx) - (n - start) * size :] if start else idx
    if start == 0:
        return use, ""
    off = np.mean(x[:, :start], axis=1) - np.mean(x[:, start:], axis=1)
    bad = int(np.argmax(np.abs(off) / tolerance))
    moved, name = float(off[bad]), search.name(bad)
    reason = f"settling: {name} was on average {search.text(name, moved)} off for {t[start] - t[0]:.3g} s"
    return use, reason


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


def _not_steady(search: Search, worst: FloatArray, drift: FloatArray, span: float) -> str:
    bad = int(np.argmax(worst))
    name, limit = search.name(bad), abs(drift[bad]) / worst[bad] if worst[bad] else 0.0
    code = "displacement moved" if bad > 1 else "settling"
    verb = "moved" if bad > 1 else "still drifted"
    return (
        f"{code}|{name} {verb} by {search.text(name, drift[bad])} over the last {span:.3g} s; allowed is"
        f" {search.text(name, limit)}"
    )


def window_of(search: Search, piece: Piece, use: IntArray, direction: int) -> Window | Rejected:
    """The window, or why its mean says nothing about steady friction."""
    s = search.settings
    v, e = search.v[use], search.e[use]
    speed, u_speed = mean_and_uncertainty(v, step=search.quanta[0], per_bin=search.per_bin, floor=search.floors[0])
    effort, u_effort = mean_and_uncertainty(e, step=search.quanta[1], per_bin=search.per_bin, floor=search.floors[1])
    begin, end = int(use[0]), int(use[-1]) + 1

    def text(x: float) -> str:
        return search.text("speed", x)

    if abs(speed) < search.slowest:
        return search.rejected(
            begin, end, direction, "too slow", f"{text(speed)} is below the least speed {text(search.slowest)}"
        )
    if abs(speed) < MIN_DEGREES * u_speed:
        reason = f"{text(speed)} is not known better than to {text(NORMAL_95 * u_speed)} (95 %)"
        return search.rejected(begin, end, direction, "too slow", reason)
    sticking = float(np.mean(np.abs(v) < REST * abs(speed)))
    if sticking > s.standstill:
        reason = f"stick-slip: at rest for {100 * sticking:.0f} % of the time, {text(speed)} on average"
        return search.rejected(begin, end, direction, "too slow", reason)
    for name, x, scale in (("speed", v, abs(speed)), ("effort", e, search.high_effort)):
        if name == "effort" and not np.isfinite(s.effort_drift):
            continue
        amplitude, period = oscillation(search.t[use], x, s.oscillation * scale)
        if amplitude > s.oscillation * scale:
            limit = search.text(name, s.oscillation * scale)
            reason = (
                f"{name} swings by +-{search.text(name, amplitude)} with a period of {period:.3g} s; allowed is {limit}"
            )
            return search.rejected(begin, end, direction, "oscillating", reason)
    others = search.means(use)
    start, stop = float(search.t[begin]) - 0.5 * search.dt, float(search.t[end - 1]) + 0.5 * search.dt
    return Window(start, stop, direction, speed, u_speed, effort, u_effort, len(use), others)


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
