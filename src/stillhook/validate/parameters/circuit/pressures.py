"""Pressures of the closed circuit: boost on the lower line, relief on the higher one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.jackknife_regression import fit
from stillhook.units import parse
from stillhook.validate.parameters.segments import LogPart, by_test

APART = parse("10 bar", "pressure")
"""Difference of the lines from which the lower one is held by boost and flushing alone [Pa]."""


@dataclass(frozen=True)
class Pressures:
    """One test. low: mean of the lower line while the lines are apart, less the twin's boost pressure [Pa], None where
    they never are; high: highest pressure over the relief setting, less 1; least: lowest pressure [Pa]."""

    test: str
    low: Estimate | None
    high: float
    least: float


def pressures(parts: Sequence[LogPart]) -> tuple[Pressures, ...]:
    """The lines' pressures in every test that has both."""
    out = []
    for test, same in by_test([p for p in parts if p.has("p_a", "p_b")]).items():
        a, b = (np.concatenate([p[name][::10] for p in same]) for name in ("p_a", "p_b"))
        block = np.concatenate([p.blocks(p.t[::10]) for p in same])
        active = same[0].params.active
        apart = np.abs(a - b) > APART
        fitted = fit((np.ones_like(a),), np.where(apart, np.minimum(a, b), np.nan), block)
        low = (
            None
            if fitted is None
            else Estimate.around(float(fitted.b[0]) - active.boost.p, fitted.half(0), fitted.blocks)
        )
        high, least = float(np.nanmax(np.maximum(a, b))), float(np.nanmin(np.minimum(a, b)))
        out.append(Pressures(test, low, high / active.relief.p - 1.0, least))
    return tuple(out)


def passive_pressure(parts: Sequence[LogPart]) -> tuple[float, float] | None:
    """Mean of p_hp in the heave-compensated tests, and the twin's pressure at mid stroke [Pa]; None where it was not
    logged."""
    signals = [p["p_hp"] for p in parts if p.has("p_hp") and p.crane.passive is not None]
    if not signals:
        return None
    passive = parts[0].crane.passive
    assert passive is not None
    values: FloatArray = np.concatenate(signals)
    return float(np.nanmean(values)), passive.accumulator.gas.p_0
