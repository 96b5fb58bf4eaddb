"""The control law implied by a crane's commands: its gains and its time shift, by regression of the commands on the
PLC's inputs.

Order of inputs and outputs in the rows of a log: of one PLC cycle, or the outputs of an earlier one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.control.plc import MANUAL
from stillhook.kernels.plc_alone import Commands
from stillhook.statistics.blocks import Fit, fit
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.time_lag import dot
from stillhook.validate.controller.inputs import PlcSegment, derivative
from stillhook.validate.criteria.results import Note
from stillhook.validate.data_set.record import ends_of

SMOOTH = (1.0, 2.0)
"""Widths of the raised cosine that both sides of a regression pass through [s]: the law is linear, so it holds for
smoothed signals as well, and white noise on the inputs, which would bias the gains down, is left with 1.5 and 0.75 % of
its power at 100 Hz. The change of the gains between the widths is included in their intervals."""
NAMES = ("K_1", "K_2", "K_p", "K_op")
ROW = 0.1  # s between the rows of a regression
BLOCK = 20.0  # s: two waves
BLOCK_MANUAL = 5.0  # s: a move of the joystick
SETTLED = 5.0  # time constants of the bumpless start after which a mode change has decayed
MOVES = 0.02  # m/s: standard deviation of the joystick from which its own gain is estimated
REACH = 2.0  # s: largest shift of the commands considered
ROUNDS = 6
FINE = 0.5  # correlation of the fine structure from which it shows the order of the rows
ALONE = 0.5  # of that correlation: limit for the neighbouring cycles, where that of smooth signals is as high
FINE_REACH = 5  # cycles
MOST_CYCLES = 2  # difference of the rows of inputs and outputs of a log


@dataclass(frozen=True)
class Law:
    """Gains implied by the commands: K_1 [s/m], K_2 [s^2/m], K_p [1/m], K_op [s/m] of the joystick; None where not
    determined. seconds of data; spread: standard deviation of the smoothed residual."""

    K_1: Estimate | None
    K_2: Estimate | None
    K_p: Estimate | None
    K_op: Estimate | None
    seconds: float
    spread: float


@dataclass(frozen=True)
class Run:
    """A PLC segment and the commands of the simulated PLC on it."""

    segment: PlcSegment
    simulated: Commands

    @property
    def test(self) -> str:
        """Name of the test."""
        return self.segment.record.test.name

    @property
    def step(self) -> float:
        """Spacing of the samples [s]."""
        return self.segment.record.step

    def logged_u_p(self, cycles: float) -> FloatArray:
        """Logged pump command (n,) at the moment of its inputs; cycles: its lag behind the inputs in the same row."""
        return shifted(self.segment.u_p, -cycles * self.step, self.step)

    def rows(self, *, ahc: bool) -> BoolArray:
        """Samples (n,) of the parts in compensation, or in manual mode, in which no command is saturated and no mode
        change or start from the brake still decays."""
        s, T = self.segment, self.step
        mode = s.seen.mode
        lo, hi = ends_of(s.u_p, self.simulated.u_raw, T)
        free = (s.u_p > lo) & (s.u_p < hi) & (np.abs(self.simulated.u_raw) < 1.0)
        fading = round(SETTLED * s.plc.t_bumpless / T)
        if s.settled is not None:
            free &= s.settled
        if s.memory.mode != mode[0]:
            free[:fading] = False
        free &= s.seen.braked == 0.0
        opened = np.flatnonzero(np.diff(s.seen.braked) < 0.0)
        for k in (*np.flatnonzero(np.diff(mode)), *opened):
            free[k + 1 : k + 1 + fading] = False
        counts = np.zeros(len(mode), dtype=bool)
        for part in s.parts:
            counts[s.within(part)] = True
        chosen: BoolArray = free & counts & ((mode > MANUAL) == ahc)
        return chosen


def smoothed(x: FloatArray, good: BoolArray, width: float, step: float) -> FloatArray:
    """A signal through a raised cosine of this width [s]; NaN within reach of samples that are not good."""
    n = max(1, round(width / step))
    w = np.hanning(n + 2)[1:-1]
    w /= w.sum()
    if len(x) < n:
        return np.full(len(x), np.nan)
    out = np.full(len(x), np.nan)
    at = (n - 1) // 2
    inside = slice(at, at + len(x) - n + 1)
    out[inside] = np.convolve(x, w, "valid")
    bad = np.convolve((~good).astype(float), np.ones(n), "valid") > 0.5
    out[inside][bad] = np.nan
    return out


def shifted(x: FloatArray, by: float, step: float) -> FloatArray:
    """A signal later by a time [s], which may be part of a step; NaN where nothing is known."""
    k = np.arange(len(x)) - by / step
    out: FloatArray = np.interp(k, np.arange(len(x)), x)
    out[(k < -1e-9) | (k > len(x) - 1 + 1e-9)] = np.nan
    return out


def _thin(columns: list[FloatArray], step: float) -> list[FloatArray]:
    every = max(1, round(ROW / step))
    return [c[::every] for c in columns]


def _about_mean(columns: list[FloatArray]) -> list[FloatArray]:
    """Columns about their means over the rows in which all are known: each stretch has an unknown constant (its
    datum)."""
    good = np.isfinite(columns).all(axis=0)
    return [np.where(good, c - c[good].mean(), np.nan) if good.any() else np.full(len(c), np.nan) for c in columns]


def _block(n: int, at: int, length: float = BLOCK) -> NDArray[np.intp]:
    return at + np.asarray(np.arange(n) * ROW // length, dtype=np.intp)


def _raw(run: Run) -> list[FloatArray]:
    """Regressors of K_1, K_2, K_p, K_op, sample by sample."""
    s, seen, tip = run.segment, run.segment.seen, run.simulated
    scale = seen.K_wire * seen.alpha_m / seen.f_pump
    e_c = s.e_c if s.e_c is not None else run.simulated.e_c
    return [-tip.v_tip * scale, -tip.a_tip * scale, -e_c / seen.f_pump, seen.v_op * scale]


def _columns(run: Run, cycles: float, width: float) -> list[FloatArray]:
    """The same and the command that they make up [-], smoothed, thinned, about their means."""
    s, T, simulated = run.segment, run.step, run.simulated
    # what remains of the bumpless start after a mode change
    faded = simulated.u_raw - simulated.u_ff + s.plc.gains.K_p * simulated.e_c / s.seen.f_pump
    x = [*_raw(run), run.logged_u_p(cycles) - faded]
    good = run.rows(ahc=True) & np.isfinite(x[-1])
    return _about_mean(_thin([smoothed(np.nan_to_num(c), good, width, T) for c in x], T))


def law(runs: list[Run], cycles: float = 0.0, *, input_noise: bool = False) -> Law | None:
    """Gains of the compensation implied by the logged pump commands over all these runs; None where too little is
    unsaturated.

    cycles: lag of the logged commands behind the inputs in the same row; input_noise: the logged inputs carry noise
    that the PLC did not see, and which biases the gains down: the intervals then include what remains of it after
    smoothing. The law, unsaturated, is u_p = -(K_1 v_tip + K_2 a_tip) K_wire alpha_m - K_p e_c + K_op v_op K_wire
    alpha_m (Moslatt 2020 E eqs 4 to 6), where K_op = K_1.
    """
    narrow, wide = (_fitted([_columns(r, cycles, w) for r in runs]) for w in SMOOTH)
    if narrow is None:
        return None
    f, names, inverse = narrow
    noise = _noise(runs) if input_noise else dict.fromkeys(NAMES, 0.0)
    bias = inverse @ (f.b * np.array([noise[n] for n in names]))
    estimates = {}
    for i, n in enumerate(names):
        value = float(f.b[i])
        apart = float(wide[0].b[i]) - value if wide is not None and wide[1] == names else 0.0
        estimates[n] = Estimate.around(value, math.hypot(f.half(i), apart, float(bias[i])), f.blocks)
    K_1, K_2, K_p, K_op = (estimates.get(n) for n in NAMES)
    return Law(K_1, K_2, K_p, K_op, seconds=f.rows * ROW, spread=f.sd)


def _noise(runs: list[Run]) -> dict[str, float]:
    """Power of white noise in every smoothed regressor, from the second differences of the raw one."""
    total, count = np.zeros(len(NAMES)), 0
    for run in runs:
        n = max(1, round(SMOOTH[0] / run.step))
        w = np.hanning(n + 2)[1:-1]
        amplification = dot(w, w) / float(w.sum()) ** 2
        good = run.rows(ahc=True)
        use = good[2:] & good[1:-1] & good[:-2]
        total += [amplification * float(np.sum(np.diff(x, 2)[use] ** 2)) / 6.0 for x in _raw(run)]
        count += int(use.sum())
    return dict(zip(NAMES, total / max(count, 1), strict=True))


def _fitted(parts: list[list[FloatArray]]) -> tuple[Fit, list[str], FloatArray] | None:
    """The fit, names of its coefficients, and the inverse of the mean normal matrix."""
    if not parts:
        return None
    columns = [np.concatenate([p[k] for p in parts]) for k in range(5)]
    at, blocks = 0, []
    for p in parts:
        blocks.append(_block(len(p[0]), at))
        at = int(blocks[-1][-1]) + 1 if len(p[0]) else at
    block = np.concatenate(blocks)
    good = np.isfinite(columns).all(axis=0)
    if not good.any():
        return None
    names = [n for n, c in zip(NAMES, columns, strict=False) if n != "K_op" or float(np.std(c[good])) > MOVES]
    chosen = [columns[NAMES.index(n)] for n in names]
    f = fit(chosen, columns[4], block)
    if f is None:
        return None
    rows = [c[good] for c in chosen]
    normal = np.array([[dot(p, q) / len(p) for q in rows] for p in rows])
    return f, names, np.asarray(np.linalg.inv(normal), dtype=np.float64)


def lag(runs: list[Run], *, ahc: bool) -> Estimate | None:
    """Time by which the logged pump commands are later than the simulated ones [s], None where they do not move.

    y(t) = (1 + g) s(t - lag): regression on the simulated command and its slope, both sides smoothed alike, repeated
    with the shifted command until convergence. A wrong K_2 shows as a lag too: K_2 / K_1 is the time by which the
    law leads the waves.
    """
    pairs = [(r.segment.u_p, r.simulated.u_p, r.rows(ahc=ahc), r.step) for r in runs]
    pairs = [p for p in pairs if p[2].any() and float(np.std(p[1][p[2]])) > MOVES]
    if not pairs:
        return None
    by = _coarse(pairs)
    fitted = None
    for _ in range(ROUNDS):
        fitted = _slope_fit(pairs, by, BLOCK if ahc else BLOCK_MANUAL)
        if fitted is None:
            return None
        gain = 1.0 + float(fitted.b[0])
        change = -float(fitted.b[1]) / gain if gain > 0.1 else 0.0
        by = float(np.clip(by + np.clip(change, -0.2, 0.2), -REACH, REACH))
        if abs(change) < 1e-5:
            break
    assert fitted is not None
    return Estimate.around(by, fitted.half(1) / max(abs(1.0 + float(fitted.b[0])), 0.1), fitted.blocks)


Pair = tuple[FloatArray, FloatArray, BoolArray, float]


def _coarse(pairs: list[Pair]) -> float:
    """Shift of highest correlation between measured and simulated command, to 50 ms [s]."""
    tries = np.arange(-REACH, REACH + 0.025, 0.05)
    score = np.zeros(len(tries))
    for y, s, good, step in pairs:
        every = max(1, round(0.05 / step))
        y, s, good, h = y[::every], s[::every], good[::every], every * step
        for i, by in enumerate(tries):
            k = round(by / h)
            a, b = (slice(k, None), slice(None, len(s) - k)) if k >= 0 else (slice(None, k), slice(-k, None))
            use = good[a]
            if not use.any():
                continue
            p, q = y[a][use] - y[a][use].mean(), s[b][use] - s[b][use].mean()
            score[i] += dot(p, q) / max(math.sqrt(dot(p, p) * dot(q, q)), 1e-12)
    return float(tries[int(np.argmax(score))])


def _slope_fit(pairs: list[Pair], by: float, block: float) -> Fit | None:
    parts, blocks, at = [], [], 0
    for y, s, good, step in pairs:
        moved = shifted(s, by, step)
        use = good & np.isfinite(moved)
        moved = np.nan_to_num(moved)
        rise = derivative(moved, step)
        c = _about_mean(_thin([smoothed(x, use, SMOOTH[0], step) for x in (moved, rise, y - moved)], step))
        parts.append(c)
        blocks.append(_block(len(c[0]), at, block))
        at = int(blocks[-1][-1]) + 1
    columns = [np.concatenate([p[k] for p in parts]) for k in range(3)]
    return fit(columns[:2], columns[2], np.concatenate(blocks))


def fine_shift(runs: list[Run]) -> tuple[int, float] | None:
    """Whole cycles by which logged commands are later than the inputs of their row, by the noise common to both; and
    the correlation. Commands repeat the noise of what the PLC read: where the log holds exactly those values, second
    differences correlate at one shift only. None where the log has other noise."""
    score = np.zeros(2 * FINE_REACH + 1)
    p_p = q_q = 0.0
    for run in runs:
        good = run.rows(ahc=True) | run.rows(ahc=False)
        y, s = np.diff(run.segment.u_p, 2), np.diff(run.simulated.u_p, 2)
        use = (good[2:] & good[1:-1] & good[:-2])[FINE_REACH:-FINE_REACH]
        s_mid = s[FINE_REACH:-FINE_REACH][use]
        y_mid = y[FINE_REACH:-FINE_REACH][use]
        q_q += dot(s_mid, s_mid)
        p_p += dot(y_mid, y_mid)
        for i, k in enumerate(range(-FINE_REACH, FINE_REACH + 1)):
            score[i] += dot(y[FINE_REACH + k : len(y) - FINE_REACH + k][use], s_mid)
    if not p_p * q_q > 0.0:
        return None
    score /= np.sqrt(p_p * q_q)
    best = int(np.argmax(score))
    neighbour = max(score[k] for k in (best - 1, best + 1) if 0 <= k < len(score))
    return (best - FINE_REACH, float(score[best])) if score[best] > FINE and neighbour < ALONE * score[best] else None


def significant(e: Estimate, other: float) -> bool:
    """Whether a number is outside an estimate's interval."""
    return abs(e.value - other) > e.half


APART = 0.3  # of a cycle: tolerance of a joystick's lag to an integer number of cycles to show the order of the rows
LATE = 0.5  # of a cycle, beyond MOST_CYCLES: a larger lag is not due to the order of rows


@dataclass(frozen=True)
class Rows:
    """cycles: by which logged commands are later than the inputs in their row; evidence: "fine", "joystick" or "waves";
    waves, joystick: lag behind the simulated commands in compensation and manual mode [s]; step: cycle of the log
    [s]."""

    cycles: int
    evidence: str
    waves: Estimate | None
    joystick: Estimate | None
    step: float
    correlation: float = 0.0

    @property
    def late(self) -> bool:
        """Whether the lag of the commands exceeds what the order of rows can cause."""
        return self.waves is not None and abs(self.waves.value) > (MOST_CYCLES + LATE) * self.step

    @property
    def aligned(self) -> float:
        """Cycles by which inputs and commands are aligned for the gains: the complete lag where it is not due to the
        order of rows."""
        return self.waves.value / self.step if self.late and self.waves is not None else float(self.cycles)

    @property
    def description(self) -> Note:
        """Order of the rows, and by what."""
        evidence = Note(f"by-{self.evidence}", correlation=self.correlation)
        if self.cycles == 0:
            return Note("rows-alike", evidence=evidence)
        return Note("rows-apart", n=abs(self.cycles), cycles=self.cycles, evidence=evidence)


def rows_of(runs: Sequence[Run], waves: Estimate | None, joystick: Estimate | None) -> Rows:
    """The order of the rows, by the best evidence available."""
    step = runs[0].step
    fine = fine_shift(list(runs))
    if fine is not None and abs(fine[0]) <= MOST_CYCLES:
        return Rows(fine[0], "fine", waves, joystick, step, fine[1])
    if joystick is not None and joystick.half < APART * step:
        k = round(joystick.value / step)
        if abs(joystick.value / step - k) < APART and abs(k) <= MOST_CYCLES:
            return Rows(k, "joystick", waves, joystick, step)
    k = round(waves.value / step) if waves is not None else 0
    return Rows(k if abs(k) <= MOST_CYCLES else 0, "waves", waves, joystick, step)
