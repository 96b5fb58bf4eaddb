"""The signals of a log on the bins that have a speed, as the search for steady stretches needs them: tolerances,
scales, and words for what is not used."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.errors import IdentifyError
from stillhook.identify.steady_state.steps import Rejected, Window, WindowSettings, runs
from stillhook.statistics.correlated_mean import SHARE_OF_RANGE, converter_step, noise_of
from stillhook.units import KINDS, show
from stillhook.variables import PHYSICAL

if TYPE_CHECKING:
    from stillhook.logs.types import Log

HIGH = 95.0
"""Percentile of a signal's magnitude that represents "high": above settled values, below the spikes of starting and
stopping."""
REST_SHARE = 0.01
"""Part of full speed below which time that nothing else claims is counted as standing."""
RAMP_CHANGE, RAMP_STRAIGHT = 0.3, 0.7
"""Change of speed within a stretch, over its mean, from which it is a ramp, and the least part of the path that is this
change."""
WORTH_REPORTING = 0.5
"""Stretches shorter than this part of the least length are ramps and overshoots, and are counted as such, not
reported one by one."""


LEVEL_CHANGE = 1.5
"""Drift of a straight line through one change of the converter's level in the middle of a stretch, in levels."""
BAD_KINDS = ("saturated", "stuck", "missing", "gap")


class Search:
    """The log's signals on the bins that have a speed: times ``t`` [s], speed ``v``, effort ``e`` (n,), ``channels`` of
    speed, effort and held signals (k, n); ``bad`` bins (n,); ``at`` their places in the log; tolerances and
    wording."""

    def __init__(
        self,
        log: Log,
        speed: str,
        effort: str | FloatArray,
        command: str | None,
        held: tuple[str, ...],
        kinds: dict[str, str],
        settings: WindowSettings,
    ) -> None:
        self.log, self.settings, self.speed_name, self.held = log, settings, speed, held
        v, e = signal_of(log, speed), effort_of(log, effort)
        effort_name = effort if isinstance(effort, str) else "effort"
        pressures = (p for p in ("p_a", "p_b") if effort_name == "dp_m" and p in log.signals)
        self.effort_sources = (*pressures, effort) if isinstance(effort, str) else ()
        self.kinds = {h: kind_of(log, h, kinds) for h in held} | {
            "speed": kind_of(log, speed, kinds),
            "effort": kind_of(log, effort_name, kinds) or kinds.get("effort", ""),
        }
        self.speed_lost = self._doubt((speed,)) | ~np.isfinite(v)
        if command is not None:
            self.speed_lost |= ~np.isfinite(signal_of(log, command))
        self.at = np.nonzero(~self.speed_lost)[0]
        if len(self.at) < settings.least_samples:
            raise IdentifyError(f'{log.source}: "{speed}" has {len(self.at)} good samples. Give a log with a speed.')
        self.t = log.t[self.at]
        self.dt = float(np.median(np.diff(log.t)))
        self.v, self.e = v[self.at], e[self.at]
        self.channels = np.stack([self.v, self.e, *(signal_of(log, h)[self.at] for h in held)])
        self.bad = self._doubt((*self.effort_sources, *held))[self.at] | ~np.all(np.isfinite(self.channels), axis=0)
        self.command = None if command is None else signal_of(log, command)[self.at]
        self.all = np.stack([np.asarray(x, dtype=float) for x in log.signals.values()])
        self.holes = np.diff(self.t, prepend=self.t[0]) > max(settings.largest_hole + self.dt, 1.5 * self.dt)
        self._scales(effort_name)

    def _doubt(self, names: Sequence[str]) -> BoolArray:
        doubtful = [self.log.doubtful[name] for name in names if name in self.log.doubtful]
        return np.asarray(np.any([np.zeros(len(self.log.t), dtype=bool), *doubtful], axis=0))

    def _scales(self, effort: str) -> None:
        """Full speed, high effort, steps of the converters, least uncertainties."""
        good_e = self.e[np.isfinite(self.e)]
        self.full_speed = float(np.max(np.abs(self.v)))
        moving = np.abs(self.v) > REST_SHARE * self.full_speed  # high effort is one of a moving winch, however brief
        use = self.e[moving & np.isfinite(self.e)]
        self.high_effort = float(np.percentile(np.abs(use if len(use) else good_e), HIGH)) if len(good_e) else 0.0
        self.per_bin = max(1.0, self.log.rate * self.dt)
        parts = [p for p in self.effort_sources if p in self.log.signals]
        if len(parts) > 2:  # a difference next to the two that it is made of
            parts.remove(effort)
        steps = [converter_step(self.log.signals[p], self.per_bin) for p in parts]
        self.quanta = (converter_step(self.v, self.per_bin), float(np.sqrt(np.sum(np.square(steps)))))
        self.floors = (SHARE_OF_RANGE * self.full_speed, SHARE_OF_RANGE * self.high_effort)
        self.slowest = self.settings.slowest()
        self.at_rest = max(4.0 * noise_of(self.v), REST_SHARE * self.full_speed, self.slowest)

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
        return in_words(value, self.kinds.get(name, ""))

    def never_steady(self, reported: Sequence[Window | Rejected]) -> Iterator[Rejected]:
        """Motions (from standstill to standstill or reversal) of which nothing has been reported yet."""
        direction = np.where(np.abs(self.v) > self.at_rest, np.sign(self.v), 0.0)
        least = self.settings.least_length
        for motion in runs(direction, self.holes):
            start, end = float(self.t[motion.begin]), float(self.t[motion.end - 1])
            length = end - start + self.dt
            if length >= least and not any(w.start < end and w.end > start for w in reported):
                reason = f"moved for {length:.3g} s, at no time at steady speed for {WORTH_REPORTING * least:.3g} s"
                yield self.rejected(motion.begin, motion.end, motion.direction, "short", reason)

    def pause_or_ramp(self, r: Rejected) -> bool:
        """Whether what was taken for a short step is the winch at rest, or on its way from one speed to another."""
        if r.code != "short" or r.direction == 0:
            return False
        a, b = (int(k) for k in np.searchsorted(self.t, (r.start, r.end)))
        v = self.v[a:b]
        if len(v) < 2 or abs(r.speed) <= self.at_rest:
            return True
        net, path = abs(float(v[-1] - v[0])), float(np.sum(np.abs(np.diff(v))))
        return net > RAMP_CHANGE * abs(r.speed) and path < 1.0 / RAMP_STRAIGHT * net

    def bad_speed(self) -> Iterator[Rejected]:
        """Stretches of the log whose speed (or command) is missing or doubtful, where they are as long as a step."""
        for lost in runs(self.speed_lost.astype(float), np.zeros_like(self.speed_lost)):
            start, end = self.log.t[lost.begin] - 0.5 * self.dt, self.log.t[lost.end - 1] + 0.5 * self.dt
            if end - start >= self.settings.least_length:
                code = self.bad_code((self.speed_name,), start, end)
                reason = f"no speed to trust for {end - start:.3g} s ({code})"
                yield Rejected(start, end, 0, np.nan, np.nan, reason, code)

    def bad_code(self, names: Sequence[str], start: float, end: float) -> str:
        """What the log's findings call a doubtful stretch."""
        kinds = {f.kind for f in self.log.findings if f.signal in names and f.start <= end and f.end >= start}
        return next((k for k in BAD_KINDS if k in kinds), "missing")

    def means(self, use: IntArray) -> dict[str, float]:
        """Mean of every signal of the log over these bins; signals without a good one are left out."""
        values = self.all[:, self.at[use]]
        good = np.isfinite(values)
        count = good.sum(axis=1)
        sums = np.where(good, values, 0.0).sum(axis=1)
        return {name: float(s / c) for name, s, c in zip(self.log.signals, sums, count, strict=True) if c}

    def rejected(self, begin: int, end: int, direction: int, code: str, reason: str) -> Rejected:
        """Bins [begin, end) as a stretch that is not used."""
        e = self.e[begin:end]
        e = e[np.isfinite(e)]
        effort = float(e.mean()) if len(e) else np.nan
        return Rejected(*self.ends(begin, end), direction, float(self.v[begin:end].mean()), effort, reason, code)

    def ends(self, begin: int, end: int) -> tuple[float, float]:
        """Where bins [begin, end) start and end [s]."""
        return float(self.t[begin]) - 0.5 * self.dt, float(self.t[end - 1]) + 0.5 * self.dt


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


def in_words(value: float, kind: str, digits: int = 3) -> str:
    """A value with the unit of its kind, in SI where none is known."""
    return show(value, kind, digits) if kind in KINDS else f"{value:.{digits}g}"
