"""Steps of a staircase: stretches of one direction in which speed (and the command) does not ramp."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.identify.steady_state.records import WindowSettings
from stillhook.statistics.correlated_mean import OF_SECOND_DIFFERENCES, noise_of

NOISE_LIMIT = 4.0
"""Standard deviations of noise above which a change of speed is one."""
SWINGS = 4.0
"""How much longer speed is averaged where it swings: twice over 2 s, a complete period of 0.5 Hz, the slowest swing
of a load."""
TO_AND_FRO = 3.0
"""Path of the speed over its net change that makes a swing: once up, down and up again."""
NOISE_AROUND = 21
"""Samples from which the noise around one is taken: more than twice those that a change of speed disturbs."""
SAME_LEVEL = 0.03
"""Stretches within this part of their speed belong to one step that a disturbance has split."""


@dataclass(frozen=True)
class Step:
    """Bins [begin, end) of one step; direction +1 or -1."""

    begin: int
    end: int
    direction: int


def noise_along(x: FloatArray) -> FloatArray:
    """The same around every sample, since noise of a speed grows with it: shape (n,)."""
    from scipy.ndimage import median_filter

    if len(x) < 4:
        return np.zeros(len(x))
    around = median_filter(np.abs(np.diff(x, 2)), size=min(NOISE_AROUND, len(x) - 2), mode="nearest")
    return np.asarray(np.pad(around, 1, mode="edge") * OF_SECOND_DIFFERENCES, dtype=float)


def sides(t: FloatArray, x: FloatArray, h: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Means over (t-h, t) and (t, t+h), each with the bin itself; the distance of their middles; bins in the smaller
    side."""
    n = len(t)
    index = np.arange(n)
    lo, hi = np.searchsorted(t, t - h * (1.0 + 1e-9), "left"), np.searchsorted(t, t + h * (1.0 + 1e-9), "right")
    cx, ct = np.concatenate([[0.0], np.cumsum(x)]), np.concatenate([[0.0], np.cumsum(t)])
    before, after = index + 1 - lo, hi - index
    left, right = (cx[index + 1] - cx[lo]) / before, (cx[hi] - cx[index]) / after
    apart = (ct[hi] - ct[index]) / after - (ct[index + 1] - ct[lo]) / before
    return left, right, apart, np.minimum(before, after).astype(float)


def find_steps(
    t: FloatArray, v: FloatArray, command: FloatArray | None, holes: BoolArray, quantum: float, settings: WindowSettings
) -> list[Step]:
    """Steps by time. Where speed swings too much to see one, it is looked for once more with the swinging smoothed out.

    Parameters: t bin centres [s], v speed, command (or none), all finite, shape (n,); holes True where something is
    missing between this bin and the one before, shape (n,); quantum step of the converter of the speed, 0 where it has
    none.
    """
    if len(t) < settings.least_samples:
        return []
    dt = float(np.median(np.diff(t)))
    fine = _find(t, v, command, holes, quantum, max(settings.smoothing, 1.01 * dt), settings)
    left, right, _, _ = sides(t, v, 0.5 * SWINGS * settings.smoothing)
    swung = _find(
        t, 0.5 * (left + right), command, holes, quantum, max(SWINGS * settings.smoothing, 1.01 * dt), settings
    )
    coarse = [s for s in swung if _swings(v[s.begin : s.end])]
    complete = [s for s in fine if t[s.end - 1] - t[s.begin] + dt >= settings.least_length]
    steps = complete + [s for s in coarse if not _overlaps(s, complete)]
    return sorted(steps + [s for s in fine if not _overlaps(s, steps)], key=lambda s: s.begin)


def _swings(v: FloatArray) -> bool:
    """Whether speed goes to and fro, and not just from one value to another."""
    return float(np.sum(np.abs(np.diff(v)))) > TO_AND_FRO * abs(float(v[-1] - v[0]))


def _overlaps(step: Step, others: list[Step]) -> bool:
    return any(step.begin < o.end and o.begin < step.end for o in others)


def _find(
    t: FloatArray,
    v: FloatArray,
    command: FloatArray | None,
    holes: BoolArray,
    quantum: float,
    h: float,
    settings: WindowSettings,
) -> list[Step]:
    """Steps as they show when speed is averaged over h on both sides."""
    left, right, apart, count = sides(t, v, h)
    sigma = noise_along(v)
    noise = np.maximum(sigma * np.sqrt(2.0 / count), quantum / NOISE_LIMIT * (1.0 + 1e-6))
    smooth = 0.5 * (left + right)
    full = float(np.max(np.abs(smooth)))
    steady = np.abs(right - left) <= np.maximum(settings.speed_rate * np.abs(smooth) * apart, NOISE_LIMIT * noise)
    steady &= np.abs(smooth) > np.maximum(
        NOISE_LIMIT * noise / 2.0, 1e-4 * full
    )  # a ten-thousandth of full speed is standstill
    u_step, u_smooth = 0.0, smooth
    if command is not None:
        before, after, _, n_u = sides(t, command, h)
        u_step = settings.command_step * float(np.max(np.abs(command)))
        steady &= np.abs(after - before) <= np.maximum(u_step, NOISE_LIMIT * noise_of(command) * np.sqrt(2.0 / n_u))
        u_smooth = 0.5 * (before + after)
    pieces = _runs(steady, np.sign(smooth), holes)
    levels = [(float(np.mean(v[p.begin : p.end])), float(np.mean(u_smooth[p.begin : p.end]))) for p in pieces]
    return _joined(t, pieces, levels, holes, sigma, u_step if command is not None else np.inf, settings)


def _runs(steady: BoolArray, direction: FloatArray, holes: BoolArray) -> list[Step]:
    """Runs of steady bins of one direction that no hole interrupts."""
    label = np.where(steady, direction, 0.0)
    cuts = np.nonzero((np.diff(label) != 0.0) | holes[1:])[0] + 1
    ends = [0, *cuts.tolist(), len(label)]
    return [Step(a, b, int(label[a])) for a, b in pairwise(ends) if label[a] != 0.0]


def _joined(
    t: FloatArray,
    pieces: list[Step],
    levels: list[tuple[float, float]],
    holes: BoolArray,
    sigma: FloatArray,
    u_step: float,
    settings: WindowSettings,
) -> list[Step]:
    """Pieces of one step put together again: same direction, speed and command, a short disturbance between them, no
    hole."""
    out: list[tuple[Step, tuple[float, float]]] = []
    for piece, (v, u) in zip(pieces, levels, strict=True):
        if out:
            last, (v0, u0) = out[-1]
            fewest = min(piece.end - piece.begin, last.end - last.begin)
            noise = NOISE_LIMIT * float(sigma[piece.begin]) / np.sqrt(fewest)
            same = abs(v - v0) <= SAME_LEVEL * max(abs(v), abs(v0)) + noise and abs(u - u0) <= u_step
            near = t[piece.begin] - t[last.end - 1] <= settings.bridge and not np.any(holes[last.end : piece.begin + 1])
            if same and near and piece.direction == last.direction:
                a, b = last.end - last.begin, piece.end - piece.begin
                out[-1] = (
                    Step(last.begin, piece.end, last.direction),
                    ((a * v0 + b * v) / (a + b), (a * u0 + b * u) / (a + b)),
                )
                continue
        out.append((piece, (v, u)))
    return [step for step, _ in out]
