"""The equations of winch, load path and PLC at many instants in one call, compiled, for what differentiates them.

They are those of the driver that runs integrate; an instant is a row of all that they depend on.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from stillhook.analysis.loop_stability.linear.differences import Batch
from stillhook.base.arrays import FloatArray
from stillhook.kernels.build import equations
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import paths


def rates_at(driver: Driver, instant: Sequence[Any], columns: Sequence[int]) -> Batch:
    """Time derivatives of all states, that of the bristle among them, by the numbers of an instant (state, commands,
    tip, drum, parameters) in these columns."""
    return _batch(equations(driver).rates_at, numbers_of(instant), columns, equations(driver).RATES)


def cycles_at(driver: Driver, before: Sequence[Any], columns: Sequence[int]) -> Batch:
    """Commands, memory and what the controllers carry after a PLC cycle, by the numbers before it (state, memory,
    controllers, tick, tip, drum, parameters) in these columns."""
    return _batch(equations(driver).cycles_at, numbers_of(before), columns, equations(driver).AFTER)


def numbers_of(records: Sequence[Any]) -> list[float]:
    """The numbers of records, one after the other, as `flatten` has them, in a tenth of its time."""
    kinds: list[Any] = [type(record) for record in records]
    return [number for kind, record in zip(kinds, records, strict=True) for number in _getter(kind)(record)]


@functools.cache
def _getter(cls: Any) -> Callable[[Any], tuple[float, ...]]:
    names = [path[1:] for path in paths(cls)]
    of_all: Any = operator.attrgetter(*names)
    return of_all if len(names) > 1 else lambda record: (of_all(record),)


def _batch(kernel: Any, numbers: Sequence[float], columns: Sequence[int], results: int) -> Batch:
    base, at = np.array(numbers), list(columns)

    def values(points: FloatArray) -> FloatArray:
        rows = np.tile(base, (len(points), 1))
        rows[:, at] = points
        out = np.empty((len(points), results))
        kernel(rows.reshape(-1), out.reshape(-1), len(points))
        return out

    return values
