"""Steps of a staircase: stretches of one direction in which speed (and the command) does not ramp.

Inputs and results of the search for steady stretches.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stillhook import units as u
from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import IdentifyError, UnitError
from stillhook.statistics.correlated_mean import OF_SECOND_DIFFERENCES, noise_of
from stillhook.tables.table import first_problem

Rest = Annotated[float, Field(strict=True, ge=0, lt=1)]
Share = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=True)]


class WindowSettings(BaseModel):
    """Engineering limits of a steady stretch. Times are text with a unit; shares are plain numbers. Errors:
    IdentifyError.

    A trend counts against a stretch only where it is larger than its tolerance *and* larger than the noise explains;
    the defaults are therefore limits of what matters for friction, not of what a certain log's noise allows to be seen.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    least_length: u.Time = Field(
        default=2.0, gt=0, description="shortest stretch: two periods of a load that oscillates on its wire at 1 Hz"
    )
    least_samples: int = Field(
        default=3, ge=3, description="fewest bins: below three drift cannot be distinguished from noise"
    )
    guard: u.Time = Field(
        default=0.3, ge=0, description="left out before the end of a step, and next to holes: three PLC bins of 0.1 s"
    )
    smoothing: u.Time = Field(
        default=0.5, gt=0, description="half width over which speed is averaged to distinguish a step from a ramp"
    )
    bridge: u.Time = Field(
        default=1.5, ge=0, description="longest disturbance of speed inside one step: one period of 0.7 Hz"
    )
    largest_hole: u.Time = Field(
        default=0.5, gt=0, description="longest stretch of missing or doubtful bins inside a step"
    )
    spare: Rest = Field(
        default=1.0 / 3.0,
        description=(
            "part of a stretch without visible drift that is left out at its start: a decay hides in noise before it"
            " has ended, with the same sign in every step, and the means of hundreds of steps would show it"
        ),
    )
    speed_rate: Share = Field(
        default=0.03, description="change of speed per second, over speed, above which the winch is ramping"
    )
    speed_drift: Share = Field(
        default=0.01, description="drift of speed within a stretch, over its speed; friction changes by far less"
    )
    effort_drift: Share = Field(
        default=0.005, description="drift of effort, over its high value: 1 bar in 200; inf: speed alone decides"
    )
    held_drift: Share = Field(
        default=0.01, description="drift of a held signal (displacement), over its value: 2 cm^3/rev in 215"
    )
    command_step: Share = Field(
        default=0.005, description="change of command that begins a new step, over its largest value"
    )
    effort_jump: Share = Field(
        default=0.01, description="sudden step of effort at steady speed (wire layer), over the log's high effort"
    )
    oscillation: Share = Field(default=0.1, description="amplitude of one frequency, over speed or high effort")
    doubtful: Share = Field(default=0.1, description="largest share of missing or doubtful bins in a stretch")
    standstill: Share = Field(default=0.2, description="largest share of a stretch at rest: more is stick-slip")
    least_speed: str | None = Field(
        default=None, description="slowest speed that is used, such as 20 rev/min; none: what noise allows"
    )

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as e:
            raise IdentifyError(first_problem(e, type(self), data, type(self).__name__).line) from None

    def for_effort_of_place(self) -> Self:
        """The same, but for an effort that changes along the way: it may drift and jump, so speed alone decides."""
        return self.model_copy(update={"effort_drift": float("inf"), "effort_jump": float("inf")})

    def slowest(self) -> float:
        """``least_speed`` in SI, a rotation or a travel; 0 where none is given. Errors: IdentifyError."""
        if self.least_speed is None:
            return 0.0
        for kind in ("rotation", "speed"):
            try:
                return u.parse(self.least_speed, kind)
            except UnitError:
                continue
        raise IdentifyError(
            f'WindowSettings: least_speed = {u.quote(self.least_speed)}: write a speed such as "20 rev/min" or "2'
            ' m/min".'
        )


@dataclass(frozen=True)
class Window:
    """A steady stretch that is used.

    ``start``, ``end`` [s] of the log; ``direction`` +1 hoisting (speed > 0), -1 lowering; ``speed``, ``effort`` means
    with their signs [SI]; ``u_speed``, ``u_effort`` standard uncertainties of the means: 1.96 of them hold 95 %,
    for any correlation of the noise and however few samples there were; ``n`` bins; ``others`` means of the log's other
    signals.
    """

    start: float
    end: float
    direction: int
    speed: float
    u_speed: float
    effort: float
    u_effort: float
    n: int
    others: Mapping[str, float] = field(default_factory=dict)

    @property
    def middle(self) -> float:
        return 0.5 * (self.start + self.end)


@dataclass(frozen=True)
class Rejected:
    """A stretch that is not used, and why: ``code`` for programs, ``reason`` with its numbers for people."""

    start: float
    end: float
    direction: int
    speed: float
    effort: float
    reason: str
    code: str


@dataclass(frozen=True)
class Steady:
    """Result of ``steady_windows``.

    ``windows`` used, by time; ``rejected`` whole steps (or stretches as long as one) that gave no window; ``trimmed``
    beginnings of used steps that were left out.
    """

    windows: tuple[Window, ...]
    rejected: tuple[Rejected, ...]
    trimmed: tuple[Rejected, ...] = ()


NOISE_LIMIT = 4.0
"""Standard deviations of noise above which a change of speed is one."""
SWINGS = 4.0
"""How much longer speed is averaged where it swings: twice over 2 s, a complete period of 0.5 Hz, the slowest swing
of a load."""
TO_AND_FRO = 3.0
"""Path of the speed over its net change that makes a swing: once up, down and up again."""
NOISE_AROUND = 21
"""Samples from which the noise around one is taken: more than twice those that a change of speed disturbs."""
STANDSTILL = 1e-4
"""Part of full speed below which the winch is at rest."""
SAME_LEVEL = 0.03
"""Stretches within this part of their speed belong to one step that a disturbance has split."""


@dataclass(frozen=True)
class Step:
    """Bins [begin, end) of one step or of a part of it; direction +1 or -1; at_layer: a change of layer, not a ramp,
    bounds it on one side or both."""

    begin: int
    end: int
    direction: int
    at_layer: bool = False


def noise_along(x: FloatArray) -> FloatArray:
    """Standard deviation of the noise around every sample, since noise of a speed grows with it: shape (n,)."""
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

    def to_and_fro(s: Step) -> bool:
        return float(np.sum(np.abs(np.diff(v[s.begin : s.end])))) > TO_AND_FRO * abs(float(v[s.end - 1] - v[s.begin]))

    complete = [s for s in fine if t[s.end - 1] - t[s.begin] + dt >= settings.least_length]
    steps = complete + [s for s in swung if to_and_fro(s) and not _overlaps(s, complete)]
    return sorted(steps + [s for s in fine if not _overlaps(s, steps)], key=lambda s: s.begin)


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
    steady &= np.abs(smooth) > np.maximum(NOISE_LIMIT * noise / 2.0, STANDSTILL * full)
    u_step, u_smooth = np.inf, smooth
    if command is not None:
        before, after, _, n_u = sides(t, command, h)
        u_step = settings.command_step * float(np.max(np.abs(command)))
        steady &= np.abs(after - before) <= np.maximum(u_step, NOISE_LIMIT * noise_of(command) * np.sqrt(2.0 / n_u))
        u_smooth = 0.5 * (before + after)
    pieces = runs(np.where(steady, np.sign(smooth), 0.0), holes)
    levels = [(float(np.mean(v[p.begin : p.end])), float(np.mean(u_smooth[p.begin : p.end]))) for p in pieces]
    return _joined(t, pieces, levels, holes, sigma, u_step, settings)


def runs(direction: FloatArray, holes: BoolArray) -> list[Step]:
    """Runs of bins of one direction, not 0, that no hole interrupts."""
    cuts = np.nonzero((np.diff(direction) != 0.0) | holes[1:])[0] + 1
    ends = [0, *cuts.tolist(), len(direction)]
    return [Step(a, b, int(direction[a])) for a, b in pairwise(ends) if direction[a] != 0.0]


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
    for piece, (v, command) in zip(pieces, levels, strict=True):
        if out:
            last, (v0, u0) = out[-1]
            fewest = min(piece.end - piece.begin, last.end - last.begin)
            noise = NOISE_LIMIT * float(sigma[piece.begin]) / np.sqrt(fewest)
            same = abs(v - v0) <= SAME_LEVEL * max(abs(v), abs(v0)) + noise and abs(command - u0) <= u_step
            near = t[piece.begin] - t[last.end - 1] <= settings.bridge and not np.any(holes[last.end : piece.begin + 1])
            if same and near and piece.direction == last.direction:
                a, b = last.end - last.begin, piece.end - piece.begin
                out[-1] = (
                    Step(last.begin, piece.end, last.direction),
                    ((a * v0 + b * v) / (a + b), (a * u0 + b * command) / (a + b)),
                )
                continue
        out.append((piece, (v, command)))
    return [step for step, _ in out]
