"""Steady stretches of a staircase test, found by themselves: what is used, what is not, and why.

Source of the test: Moslatt 2020 section 2.2 and figure 2.5: hoisting and lowering in turn at rising pump command, data
"from the last part of the steady-state situation to ensure stabilized pressures and velocities".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.steady_state.steady_tail import (
    LEVEL_CHANGE,
    Cut,
    Piece,
    bad_code,
    last_part,
    pieces_of,
    window_of,
)
from stillhook.identify.steady_state.steps import Rejected, Steady, Step, Window, WindowSettings, find_steps
from stillhook.statistics.correlated_mean import SHARE_OF_RANGE, converter_step, noise_of
from stillhook.units import KINDS, show
from stillhook.variables import PHYSICAL

if TYPE_CHECKING:
    from stillhook.logs.log import Log

__all__ = ["Rejected", "Steady", "Window", "WindowSettings", "steady_windows"]


HIGH = 95.0
"""Percentile of a signal's magnitude that represents "high": above settled values, below the spikes of starting and
stopping."""
REST_SHARE = 0.01
"""Part of full speed below which time that nothing else claims is counted as standing."""
RAMP_CHANGE, RAMP_STRAIGHT = 0.3, 0.7
"""Change of speed within a stretch, over its mean, from which it is a ramp, and the least part of the path that is this
change."""
WORTH_TELLING = 0.5
"""Stretches shorter than this part of the least length are ramps and overshoots, and are counted as such, not
reported one by one."""


def steady_windows(
    log: Log,
    speed: str,
    effort: str | FloatArray,
    *,
    command: str | None = None,
    held: Sequence[str] = (),
    made_of: Sequence[str] = (),
    layer_limits: Sequence[float] = (),
    position: str = "s_w",
    kinds: Mapping[str, str] | None = None,
    settings: WindowSettings | None = None,
) -> Steady:
    """Steady stretches of a log.

    Parameters: log as `read_log` gives it; speed name of the signal whose sign is the direction (hoisting positive);
    effort name of the signal that friction shows in, "dp_m" also where only p_a and p_b are there, or an array of shape
    (n,) in SI; command name of a set signal whose changes begin new steps; held names of signals that must stay
    (displacement); made_of signals behind an effort array, whose doubtful bins count as the effort's; layer_limits
    values of `position` at which the wire changes its layer [m]: no stretch runs across one; kinds units.KINDS of
    signals by name, for texts ("effort" itself may be named). Every step is averaged over the longest last part in
    which speed, effort and held signals do not drift: beyond their tolerance *and* beyond their noise. Errors:
    IdentifyError for a name that the log does not have, or no sample to work on.
    """
    search = _Search(
        log, speed, effort, command, tuple(held), tuple(made_of), dict(kinds or {}), settings or WindowSettings()
    )
    windows: list[Window] = []
    rejected: list[Rejected] = list(search.bad_speed())
    trimmed: list[Rejected] = []
    for step in search.steps():
        for cut in _cut_at_layers(search, step, layer_limits, position):
            for window in _from_step(search, cut, step.direction):
                if isinstance(window, Window):
                    windows.append(window)
                else:
                    (trimmed if window.code == "start" else rejected).append(window)
    rejected = [r for r in rejected if not search.pause_or_ramp(r)]
    rejected += search.never_steady([*windows, *rejected])
    key = lambda r: r.start
    time = search.time_by_use(windows, rejected, trimmed)
    return Steady(
        tuple(sorted(windows, key=key)), tuple(sorted(rejected, key=key)), tuple(sorted(trimmed, key=key)), time
    )


class _Search:
    """The log's signals on the bins that have a speed, with tolerances and wording."""

    def __init__(
        self,
        log: Log,
        speed: str,
        effort: str | FloatArray,
        command: str | None,
        held: tuple[str, ...],
        made_of: tuple[str, ...],
        kinds: dict[str, str],
        settings: WindowSettings,
    ) -> None:
        self.log, self.settings, self.held = log, settings, held
        v = self.signal(speed)
        e, name, parts = self._effort(effort, made_of)
        self.effort_sources = parts
        self.kinds = {
            "speed": kind_of(log, speed, kinds),
            "effort": kind_of(log, name, kinds) or kinds.get("effort", ""),
        }
        self.kinds.update({h: kind_of(log, h, kinds) for h in held})
        doubtful_speed = self.doubt((speed,)) | ~np.isfinite(v)
        if command is not None:
            doubtful_speed |= ~np.isfinite(self.signal(command))
        self.speed_name, self.speed_lost = speed, doubtful_speed
        self.at = np.nonzero(~doubtful_speed)[0]
        if len(self.at) < settings.least_samples:
            raise IdentifyError(f'{log.source}: "{speed}" has {len(self.at)} good samples. Give a log with a speed.')
        self.t = log.t[self.at]
        self.dt = float(np.median(np.diff(log.t)))
        self.v, self.e = v[self.at], e[self.at]
        self.channels = np.stack([self.v, self.e, *(self.signal(h)[self.at] for h in held)])
        self.bad = (self.doubt((*parts, *held))[self.at]) | ~np.all(np.isfinite(self.channels), axis=0)
        self.command = None if command is None else self.signal(command)[self.at]
        self.all = np.stack([np.asarray(x, dtype=float) for x in log.signals.values()])
        self._scales(speed, name)

    def _effort(self, effort: str | FloatArray, made_of: tuple[str, ...]) -> tuple[FloatArray, str, tuple[str, ...]]:
        if not isinstance(effort, str):
            return effort_of(self.log, effort), "effort", made_of
        pressures = tuple(p for p in ("p_a", "p_b") if effort == "dp_m" and p in self.log.signals)
        return effort_of(self.log, effort), effort, (*pressures, effort)

    def signal(self, name: str) -> FloatArray:
        return signal_of(self.log, name)

    def doubt(self, names: Sequence[str]) -> BoolArray:
        out = np.zeros(len(self.log.t), dtype=bool)
        for name in names:
            out |= self.log.doubtful.get(name, False)
        return out

    def _scales(self, speed: str, effort: str) -> None:
        """Full speed, high effort, steps of the converters, least uncertainties."""
        good_e = self.e[np.isfinite(self.e)]
        self.full_speed = float(np.max(np.abs(self.v)))
        moving = (
            np.abs(self.v) > REST_SHARE * self.full_speed
        )  # high effort is one of a moving winch, however long it was
        use = self.e[moving & np.isfinite(self.e)]
        self.high_effort = float(np.percentile(np.abs(use if len(use) else good_e), HIGH)) if len(good_e) else 0.0
        named = self.settings.resolution
        self.per_bin = max(1.0, self.log.rate * self.dt)
        step_v = named[speed] if speed in named else converter_step(self.v, self.per_bin)
        parts = [p for p in self.effort_sources if p in self.log.signals]
        if len(parts) > 2:  # a difference next to the two that it is made of
            parts.remove(effort)
        steps = [named[p] if p in named else converter_step(self.log.signals[p], self.per_bin) for p in parts]
        step_e = named[effort] if effort in named else float(np.sqrt(np.sum(np.square(steps))))
        self.quanta = (step_v, step_e)
        self.floors = (SHARE_OF_RANGE * self.full_speed, SHARE_OF_RANGE * self.high_effort)
        self.slowest = self.settings.slowest()

    def tolerances(self, begin: int, end: int) -> FloatArray:
        """Drift that is let pass, by channel; never below what one change of the converter's level looks like."""
        s = self.settings
        level = np.abs(np.sort(self.channels[:, begin:end], axis=1)[:, (end - begin) // 2])
        out = s.held_drift * level
        out[0] = max(s.speed_drift * level[0], SHARE_OF_RANGE * self.full_speed, LEVEL_CHANGE * self.quanta[0])
        out[1] = max(s.effort_drift * self.high_effort, LEVEL_CHANGE * self.quanta[1])
        return np.asarray(np.maximum(out, np.finfo(float).tiny), dtype=float)

    def name(self, channel: int) -> str:
        return ("speed", "effort", *self.held)[channel]

    def text(self, name: str, value: float) -> str:
        """A value with its unit, or in SI where the unit is not known."""
        kind = self.kinds.get(name, "")
        return show(value, kind, 3) if kind in KINDS else f"{value:.3g}"

    def holes(self) -> BoolArray:
        """True where too much time is between a bin and the one before."""
        out = np.zeros(len(self.t), dtype=bool)
        out[1:] = np.diff(self.t) > max(self.settings.largest_hole + self.dt, 1.5 * self.dt)
        return out

    def steps(self) -> list[Step]:
        return find_steps(self.t, self.v, self.command, self.holes(), self.quanta[0], self.settings)

    def never_steady(self, reported: Sequence[Window | Rejected]) -> Iterator[Rejected]:
        """Motions (from standstill to standstill or reversal) of which nothing has been reported yet."""
        label = np.where(np.abs(self.v) > self.at_rest(), np.sign(self.v), 0.0)
        cuts = np.nonzero((np.diff(label) != 0.0) | self.holes()[1:])[0] + 1
        for a, b in pairwise([0, *cuts.tolist(), len(label)]):
            length = float(self.t[b - 1] - self.t[a]) + self.dt
            if label[a] == 0.0 or length < self.settings.least_length:
                continue
            if not any(w.start < self.t[b - 1] and w.end > self.t[a] for w in reported):
                reason = (
                    f"moved for {length:.3g} s, at no time at steady speed for"
                    f" {WORTH_TELLING * self.settings.least_length:.3g} s"
                )
                yield self.rejected(a, b, int(label[a]), "short", reason)

    def pause_or_ramp(self, r: Rejected) -> bool:
        """Whether what was taken for a short step is the winch at rest, or on its way from one speed to another."""
        if r.code != "short" or r.direction == 0:
            return False
        a, b = (int(k) for k in np.searchsorted(self.t, (r.start, r.end)))
        v = self.v[a:b]
        if len(v) < 2 or abs(r.speed) <= self.at_rest():
            return True
        net, path = abs(float(v[-1] - v[0])), float(np.sum(np.abs(np.diff(v))))
        return net > RAMP_CHANGE * abs(r.speed) and path < 1.0 / RAMP_STRAIGHT * net

    def at_rest(self) -> float:
        """Speed below which the winch is taken to stand [SI]."""
        return max(4.0 * noise_of(self.v), REST_SHARE * self.full_speed, self.slowest)

    def bad_speed(self) -> Iterator[Rejected]:
        """Stretches of the log whose speed (or command) is missing or doubtful, where they are as long as a step."""
        for a, b in true_runs(self.speed_lost):
            start, end = self.log.t[a] - 0.5 * self.dt, self.log.t[b - 1] + 0.5 * self.dt
            if end - start >= self.settings.least_length:
                code = bad_code(self.log.findings, (self.speed_name,), start, end)
                yield Rejected(
                    start, end, 0, np.nan, np.nan, f"no speed to trust for {end - start:.3g} s ({code})", code
                )

    def means(self, use: NDArray[np.intp]) -> dict[str, float]:
        """Mean of every signal of the log over these bins; signals without a good one are left out."""
        values = self.all[:, self.at[use]]
        good = np.isfinite(values)
        count = good.sum(axis=1)
        sums = np.where(good, values, 0.0).sum(axis=1)
        return {name: float(s / c) for name, s, c in zip(self.log.signals, sums, count, strict=True) if c}

    def rejected(self, begin: int, end: int, direction: int, code: str, reason: str) -> Rejected:
        v, e = self.v[begin:end], self.e[begin:end]
        e = e[np.isfinite(e)]
        start, stop = self.t[begin] - 0.5 * self.dt, self.t[end - 1] + 0.5 * self.dt
        return Rejected(
            float(start), float(stop), direction, float(v.mean()), float(e.mean()) if len(e) else np.nan, reason, code
        )

    def time_by_use(
        self, windows: Sequence[Window], rejected: Sequence[Rejected], trimmed: Sequence[Rejected]
    ) -> dict[str, float]:
        """Seconds of the log by what became of them."""
        labels = ("changing speed", "standing", "rejected", "trimmed", "used")
        state = np.zeros(len(self.log.t), dtype=int)
        state[self.at[np.abs(self.v) < self.at_rest()]] = 1
        for value, parts in ((2, rejected), (3, trimmed), (4, windows)):
            for part in parts:
                a, b = np.searchsorted(self.log.t, (part.start, part.end))
                state[a:b] = value
        out = {label: float(np.sum(state == i)) * self.dt for i, label in enumerate(labels)}
        out["no samples"] = max(float(self.log.t[-1] - self.log.t[0]) + self.dt - len(self.log.t) * self.dt, 0.0)
        return out


def signal_of(log: Log, name: str) -> FloatArray:
    """A signal of the log, shape (n,). Errors: IdentifyError naming those that it has."""
    if name not in log.signals:
        available = ", ".join(sorted(log.signals))
        raise IdentifyError(f'{log.source}: no signal "{name}". It has {available}. Name it in the mapping.')
    return np.asarray(log.signals[name], dtype=float)


def effort_of(log: Log, effort: str | FloatArray) -> FloatArray:
    """The effort of every bin, shape (n,): a signal, p_a - p_b for "dp_m" where only those are there, or the array that
    is given."""
    if not isinstance(effort, str):
        values = np.asarray(effort, dtype=float)
        if values.shape != log.t.shape:
            raise IdentifyError(
                f"effort: {values.shape} values for {log.t.shape} samples. Give one for each bin of the log."
            )
        return values
    if effort == "dp_m" and effort not in log.signals and "p_a" in log.signals:
        return signal_of(log, "p_a") - signal_of(log, "p_b")
    return signal_of(log, effort)


def kind_of(log: Log, name: str | FloatArray, kinds: Mapping[str, str] | None = None) -> str:
    """Key of units.KINDS of a signal: as the caller says, as the mapping states, as the variable of that name; "" where
    nothing does."""
    if not isinstance(name, str):
        name = "effort"
    if kinds and name in kinds:
        return kinds[name]
    return log.kind(name) or (PHYSICAL[name].kind if name in PHYSICAL else "")


def true_runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Half-open runs of True."""
    edges = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    return list(zip(np.nonzero(edges > 0)[0].tolist(), np.nonzero(edges < 0)[0].tolist(), strict=True))


def _cut_at_layers(search: _Search, step: Step, limits: Sequence[float], position: str) -> list[Cut]:
    """The step in parts, none of which holds a change of layer that the caller has named."""
    if not limits:
        return [Cut(step.begin, step.end, "step", "step")]
    where = search.signal(position)[search.at][step.begin : step.end]
    layer = np.searchsorted(np.sort(np.asarray(limits, dtype=float)), where)
    layer = (
        np.maximum.accumulate(layer) if layer[-1] >= layer[0] else np.minimum.accumulate(layer)
    )  # noise crosses no layer twice
    edges = [0, *(np.nonzero(np.diff(layer))[0] + 1).tolist(), len(layer)]
    return [
        Cut(step.begin + a, step.begin + b, "step" if a == 0 else "layer", "step" if b == len(layer) else "layer")
        for a, b in pairwise(edges)
    ]


def _from_step(search: _Search, cut: Cut, direction: int) -> Iterator[Window | Rejected]:
    """What becomes of one step: windows, parts that were left out, or a reason."""
    s = search.settings
    length = float(search.t[cut.end - 1] - search.t[cut.begin]) + search.dt
    if (length < WORTH_TELLING * s.least_length or cut.end - cut.begin < 2) and cut.before == cut.after == "step":
        return
    pieces, refused = pieces_of(search, cut, direction)
    yield from refused
    for piece in pieces:
        yield from _from_piece(search, piece, direction)


def _from_piece(search: _Search, piece: Piece, direction: int) -> Iterator[Window | Rejected]:
    tail = last_part(search, piece)
    if isinstance(tail, str):
        code, reason = tail.split("|", 1)
        yield search.rejected(piece.begin, piece.end, direction, code, reason)
        return
    use, reason = tail
    window = window_of(search, piece, use, direction)
    yield window
    if isinstance(window, Window) and reason:
        yield search.rejected(piece.begin, int(use[0]), direction, "start", reason)
