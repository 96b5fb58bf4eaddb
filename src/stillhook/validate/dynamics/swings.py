"""Gradients, periods and damping of every turn: the crane's compared with the twin's, by its file and tuned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.validate.data_set.records.transients import Transient
from stillhook.validate.dynamics.direct import LOOK, Swing, dominant_period, swing_of
from stillhook.validate.dynamics.fitting.fit import Tuning, normalised_rms
from stillhook.validate.dynamics.runs import SIGNALS, DynamicsSegment

A, B = SIGNALS.index("p_a"), SIGNALS.index("p_b")


@dataclass(frozen=True)
class SwingComparison:
    """Swings of all turns: crane, twin as its file has it (before), twin tuned (after); periods of the largest line in
    the spectra of all turns together [s]; misfit before and after: normalised rms of each signal's deviation [-]."""

    crane: tuple[Swing, ...]
    before: tuple[Swing, ...]
    after: tuple[Swing, ...]
    spectral: tuple[float, float, float]
    misfit_before: dict[str, float]
    misfit_after: dict[str, float]

    def gradient(self, line: str, tuned: bool) -> Estimate:
        """Errors of the pressure gradient of line "A" or "B"."""
        pairs = [(c, x) for c, x in zip(self.crane, self._twin(tuned), strict=True) if c.line == line]
        return _errors([(x.gradient, c.gradient) for c, x in pairs])

    def period(self, tuned: bool) -> Estimate:
        """Errors of the period between the first two significant peaks."""
        return _errors([(x.period, c.period) for c, x in zip(self.crane, self._twin(tuned), strict=True)])

    def damping(self, tuned: bool) -> Estimate:
        """Errors of the damping ratio."""
        return _errors([(x.zeta, c.zeta) for c, x in zip(self.crane, self._twin(tuned), strict=True)])

    def _twin(self, tuned: bool) -> tuple[Swing, ...]:
        return self.after if tuned else self.before

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, SI; None where a turn shows nothing."""

        def rows(swings: Sequence[Swing]) -> list[dict[str, Any]]:
            return [
                {"line": s.line, **{n: _plain(getattr(s, n)) for n in ("gradient", "period", "zeta")}} for s in swings
            ]

        return {
            "crane": rows(self.crane),
            "before": rows(self.before),
            "after": rows(self.after),
            "spectral_period": [_plain(x) for x in self.spectral],
            "misfit_before": self.misfit_before,
            "misfit_after": self.misfit_after,
        }


def _plain(x: float) -> float | None:
    return None if math.isnan(x) else x


def _errors(pairs: Sequence[tuple[float, float]]) -> Estimate:
    errors = np.array([x / c - 1.0 for x, c in pairs if math.isfinite(x) and math.isfinite(c) and c != 0.0])
    return Estimate.of_mean(errors, t_factor(len(errors) - 1))


def compare_swings(
    time_segments: Sequence[DynamicsSegment], turns: Sequence[Transient], tuning: Tuning
) -> SwingComparison:
    """The swings of every turn, the crane's and the twin's by one and the same reading; none for a line that was
    not logged."""
    rows: list[list[Swing]] = [[], [], []]
    parts: list[list[FloatArray]] = [[], [], []]
    for time_segment, before, after in zip(time_segments, tuning.before, tuning.after, strict=True):
        nothing = np.full(len(time_segment.t), np.nan)
        crane = tuple(time_segment.measured.get(name, nothing) for name in ("p_a", "p_b"))
        machines = (crane, (before[:, A], before[:, B]), (after[:, A], after[:, B]))
        time = time_segment.record.t[time_segment.first : time_segment.first + len(time_segment.t)]
        for turn in (x for x in turns if time_segment.holds(x)):
            took = slice(turn.first - time_segment.first, turn.last - time_segment.first)
            for k, (p_a, p_b) in enumerate(machines):
                rows[k].append(swing_of(turn, time, p_a, p_b, took))
                look = slice(took.start, min(took.stop, took.start + round(LOOK / time_segment.record.step)))
                parts[k].append((p_a - p_b)[look])
    step = time_segments[0].record.step
    crane_T, before_T, after_T = (
        dominant_period([p for p in series if np.isfinite(p).all()], step) for series in parts
    )
    return SwingComparison(
        crane=tuple(rows[0]),
        before=tuple(rows[1]),
        after=tuple(rows[2]),
        spectral=(crane_T, before_T, after_T),
        misfit_before=dict(normalised_rms(time_segments, tuning.before)),
        misfit_after=dict(normalised_rms(time_segments, tuning.after)),
    )
