"""Steady stretches of a staircase test, found by themselves: what is used, what is not, and why.

Source of the test: Moslatt 2020 section 2.2 and figure 2.5: hoisting and lowering in turn at rising pump command, data
"from the last part of the steady-state situation to ensure stabilized pressures and velocities".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.identify.steady_state.search import WORTH_REPORTING, Search, signal_of
from stillhook.identify.steady_state.steady_tail import Cut, last_part, parts_of, window_of
from stillhook.identify.steady_state.steps import Rejected, Steady, Step, Window, WindowSettings, find_steps

if TYPE_CHECKING:
    from stillhook.logs.types import Log


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
    s = settings or WindowSettings()
    search = Search(log, speed, effort, command, tuple(held), tuple(made_of), dict(kinds or {}), s)
    parts: list[Window | Rejected] = list(search.bad_speed())
    for step in find_steps(search.t, search.v, search.command, search.holes, search.quanta[0], s):
        for cut in _cut_at_layers(search, step, layer_limits, position):
            parts += _from_step(search, cut, step.direction)
    parts = [p for p in parts if isinstance(p, Window) or not search.pause_or_ramp(p)]
    parts += search.never_steady([p for p in parts if isinstance(p, Window) or p.code != "start"])
    parts.sort(key=lambda p: p.start)
    windows = tuple(p for p in parts if isinstance(p, Window))
    trimmed = tuple(p for p in parts if isinstance(p, Rejected) and p.code == "start")
    rejected = tuple(p for p in parts if isinstance(p, Rejected) and p.code != "start")
    return Steady(windows, rejected, trimmed, search.time_by_use(windows, rejected, trimmed))


def _cut_at_layers(search: Search, step: Step, limits: Sequence[float], position: str) -> list[Cut]:
    """The step in parts, none of which holds a change of layer that the caller has named."""
    if not limits:
        return [Cut(step.begin, step.end)]
    wire = signal_of(search.log, position)[search.at][step.begin : step.end]
    layer = np.searchsorted(np.sort(np.asarray(limits, dtype=float)), wire)
    rising = layer[-1] >= layer[0]  # noise crosses no layer twice
    layer = np.maximum.accumulate(layer) if rising else np.minimum.accumulate(layer)
    edges = [0, *(np.nonzero(np.diff(layer))[0] + 1).tolist(), len(layer)]
    return [Cut(step.begin + a, step.begin + b, at_layer=len(edges) > 2) for a, b in pairwise(edges)]


def _from_step(search: Search, cut: Cut, direction: int) -> Iterator[Window | Rejected]:
    """What becomes of one step: windows, parts that were left out, or a reason."""
    length = float(search.t[cut.end - 1] - search.t[cut.begin]) + search.dt
    least = WORTH_REPORTING * search.settings.least_length
    if (length < least or cut.end - cut.begin < 2) and not cut.at_layer:
        return
    for part in parts_of(search, cut, direction):
        if isinstance(part, Rejected):
            yield part
            continue
        tail = last_part(search, part, direction)
        if isinstance(tail, Rejected):
            yield tail
            continue
        use, reason = tail
        window = window_of(search, use, direction)
        yield window
        if isinstance(window, Window) and reason:
            yield search.rejected(int(part[0]), int(use[0]), direction, "start", reason)
