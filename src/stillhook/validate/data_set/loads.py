"""The load on the hook of a test: as stated, or from the load cell; and its changes by the load cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.lift import wire_carried
from stillhook.errors import ValidateError
from stillhook.logs.campaign import wire_text
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.validate.criteria.notes import Note
from stillhook.validate.data_set.campaign import CraneTest

BLOCK = 1.0
"""Length of the blocks for medians [s]."""
SPAN = 20.0
"""Least duration of a constant load [s]: two waves, over which the forces of heave compensation average out."""
STEP = 0.05
"""Change of the load cell's level that counts as another load [part of the weight of SWL and hook]: waves leave 1 to 2
%."""
APART = 0.1
"""Difference between stated load and load cell that is reported [part of the stated weight]; step 1 examines it in
detail."""


LEAST_HOOK = 0.5
"""Least part of the hook's weight on the wire, whatever is submerged."""


@dataclass(frozen=True)
class LoadSegment:
    """Samples [first, last) with one load; F: level of the load cell in them [N], NaN without one."""

    first: int
    last: int
    F: float


def load_segments(F: FloatArray | None, n: int, step: float, crane: Crane) -> list[LoadSegment]:
    """Parts of n samples, `step` [s] apart, with constant load; between two of them the load is lifted or set down.

    Parameters: F (n,) load cell [N], or None.
    """
    if F is None or not np.isfinite(F).any():
        return [LoadSegment(0, n, np.nan)]
    size = max(1, round(BLOCK / step))
    blocks = np.array([_median(F[a : a + size]) for a in range(0, n, size)])
    limit, least = STEP * (crane.SWL + crane.hook_mass) * G, max(1, round(SPAN / BLOCK))
    level = np.array([_median(blocks[max(0, i - least // 2) : i + least // 2 + 1]) for i in range(len(blocks))])
    plateaus = _plateaus(level, limit, least)
    out = [LoadSegment(a * size, min(n, b * size), _median(blocks[a:b])) for a, b in plateaus]
    return out or [LoadSegment(0, n, _median(F))]


def _plateaus(level: FloatArray, limit: float, least: int) -> list[tuple[int, int]]:
    """Runs in which the level stays within the limit of its median for the least duration; shorter ones are changes."""
    out: list[tuple[int, int]] = []
    a = 0
    while a < len(level):
        b = a + 1
        while b < len(level) and not abs(level[b] - _median(level[a:b])) > limit:
            b += 1
        # a slow change follows its own median for a while
        steady = np.flatnonzero(np.abs(level[a:b] - _median(level[a:b])) <= limit)
        first, last = a + int(steady[0]), a + int(steady[-1]) + 1
        if last - first >= least or (not out and b == len(level)):
            out.append((first, last))
        a = b
    if len(out) == 1 and out[0][1] - out[0][0] > len(level) - least:  # a remainder at an end is no other load
        return [(0, len(level))]
    return out


def with_wire(test: CraneTest, crane: Crane, signals: Mapping[str, FloatArray], part: slice) -> tuple[CraneTest, str]:
    """The test with the load of a part (payload and weight of the wire out) and a statement about it; unchanged where
    the file states no payload.

    Errors: ValidateError where depth and wire out contradict each other, or the winch would carry more than the SWL.
    """
    if test.hook is None or test.payload is None:
        return test, ""
    s_w = signals["s_w"] if "s_w" in signals else np.zeros(0)
    if np.isfinite(s_w).any():
        h_tip = test.hook.tip_height(float(s_w[np.isfinite(s_w)][0]))
        out = _median(s_w[part]) if np.isfinite(s_w[part]).any() else _median(s_w)
    elif test.s_w is not None:
        h_tip, out = test.hook.tip_height(test.s_w), test.s_w
    else:
        out, h_tip = test.hook.wire_out(), float(test.hook.h_tip or 0.0)
    load = test.payload + wire_carried(crane, out, h_tip)
    of = {"test": test.name, "payload": test.payload, "wire": wire_text(crane, out, h_tip), "load": load}
    if load > crane.SWL:
        raise ValidateError(Note("payload-over-swl", crane=crane.name, SWL=crane.SWL, **of))
    return replace(test, load=load), Note("payload-and-wire", **of)


def load_of(part: LoadSegment, all_of: list[LoadSegment], test: CraneTest, crane: Crane) -> tuple[float, str]:
    """Payload of a segment [kg] and a statement, "" where it is as stated. Errors: ValidateError where unknown."""
    buoyancy = test.water.rho * test.water.volume if test.water is not None else 0.0
    shown = (part.F / G + buoyancy) - crane.hook_mass
    of = {"test": test.name, "F": part.F}
    if test.load is not None:
        weight = (test.load + crane.hook_mass - buoyancy) * G
        if len(all_of) == 1 or part is min(all_of, key=lambda s: abs(s.F - weight)):
            apart = np.isfinite(part.F) and abs(part.F - weight) > APART * weight
            return test.load, Note("cell-apart", weight=weight, **of) if apart else ""
    if not np.isfinite(part.F):
        raise ValidateError(Note("load-missing", test=test.name))
    if part.F < LEAST_HOOK * crane.hook_mass * G or shown > crane.SWL * (1.0 + STEP):
        raise ValidateError(Note("cell-implausible", crane=crane.name, hook=crane.hook_mass, SWL=crane.SWL, **of))
    load = max(0.0, shown)
    return load, Note("load-by-cell" if test.load is None else "other-load-by-cell", test=test.name, load=load)


def _median(x: FloatArray) -> float:
    good = x[np.isfinite(x)]
    return float(np.median(good)) if len(good) else np.nan


def standing(parts: list[LoadSegment], n: int) -> NDArray[np.bool_]:
    """(n,) samples with constant load."""
    out = np.zeros(n, np.bool_)
    for part in parts:
        out[part.first : part.last] = True
    return out
