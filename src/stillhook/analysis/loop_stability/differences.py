"""Central differences of the engine's own equations: half widths by what a variable is, where a function has a kink.

The equations of winch, load path and PLC are those of the driver that runs integrate, compiled and at many instants in
one call; an instant is a row of all that they depend on.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.registry import code_of
from stillhook.kernels.build import equations
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import flatten, paths, unflatten
from stillhook.spec.scenario import Mode
from stillhook.winches.records import Tick

Batch = Callable[[FloatArray], FloatArray]
"""A function of many points at once: (points, variables) -> (points, values)."""

STEP = {
    "alpha": 1e-6,
    "alpha_dot": 1e-4,
    "p": 100.0,
    "V_o": 1e-7,
    "omega_m": 1e-4,
    "s_w": 1e-6,
    "z": 1e-7,
    "s_load": 1e-6,
    "v_load": 1e-5,
    "u": 1e-6,
    "s_tip": 1e-6,
    "v_tip": 1e-5,
    "F": 10.0,
}
"""Half widths of the central differences, SI, by kind of variable: about 1e-6 of what a lift moves, where truncation
and rounding are both below 1e-6 of the derivative (tested at a quarter and at four times the step)."""
SMOOTH = 1e-3
"""Largest relative difference of a derivative from that at a quarter of the step; above it the point sits on a kink of
the plant."""
RELATIVE = 1e-6
"""Half width over the size of a variable of no known kind [-]."""


def step_of(name: str, value: float = 0.0) -> float:
    """Half width of the difference for a variable: by its name, or for one of no known kind by its size now."""
    if name in STEP:
        return STEP[name]
    if name.startswith("p_"):
        return STEP["p"]
    if name.startswith("u_"):
        return STEP["u"]
    if name.startswith("alpha"):
        return STEP["alpha_dot"] if name.endswith("_dot") else STEP["alpha"]
    return RELATIVE * max(1.0, abs(value))


def jacobian(f: Batch, x: FloatArray, steps: Sequence[float]) -> tuple[FloatArray, list[tuple[int, int]]]:
    """Central differences of f at x, and the elements (row, column) that differ from those at a quarter of the step by
    more than `SMOOTH`, or on both sides of the point: there the function has a kink."""
    h, rough = np.asarray(steps), []
    centre = f(x[None, :])[0]
    J = slopes(f, x, steps)
    near_up, near_down = _both_sides(f, x, h / 4.0)
    near, sides = (near_up - near_down) / (h / 2.0), np.abs((near_up - centre[:, None]) - (centre[:, None] - near_down))
    for j in range(len(x)):
        noise = 1e-13 * np.abs(centre) / h[j]
        size = np.abs(J[:, j]) + 1e-9 * np.max(np.abs(J[:, j])) + noise / SMOOTH
        off = np.maximum(np.abs(near[:, j] - J[:, j]), sides[:, j] / (h[j] / 4.0) / 2.0)
        rough += [(int(i), j) for i in np.nonzero(off > SMOOTH * size)[0]]
    return J, rough


def slopes(f: Batch, x: FloatArray, steps: Sequence[float]) -> FloatArray:
    """Central differences of f at x as `jacobian` takes them, without looking for kinks: half the work."""
    h = np.asarray(steps)
    up, down = _both_sides(f, x, h)
    return (up - down) / (2.0 * h)


def _both_sides(f: Batch, x: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """f with each variable moved up and down by h (n,): (values, n) each."""
    n = len(x)
    rows = np.tile(x, (2 * n, 1))
    j = np.arange(n)
    rows[j, j] += h
    rows[n + j, j] -= h
    values = f(rows)
    return values[:n].T, values[n:].T


def steady_tick(mode: Mode, s: float, v: float) -> Tick:
    """What comes from outside the PLC while the tip moves at a constant speed v [m/s], now at s [m]."""
    still = Tick(*(0.0,) * len(Tick._fields))
    return still._replace(s=s, v=v, s_m=s, v_m=v, mode=code_of(mode), f_pump=1.0, f_known=1.0, f_passive=1.0)


def rates_at(driver: Driver, instant: Sequence[Any], columns: Sequence[int]) -> Batch:
    """Time derivatives of all states, that of the bristle among them, by the numbers of an instant (state, commands,
    tip, drum, parameters) in these columns."""
    return _batch(equations(driver).rates_at, numbers_of(instant), columns, equations(driver).RATES)


def cycles_at(driver: Driver, before: Sequence[Any], columns: Sequence[int]) -> Batch:
    """Commands, memory and what the controllers carry after a PLC cycle, by the numbers before it (state, memory,
    controllers, tick, tip, drum, parameters) in these columns."""
    return _batch(equations(driver).cycles_at, numbers_of(before), columns, equations(driver).AFTER)


def laws_after(driver: Driver, before: Sequence[Any], cycles: int) -> Any:
    """What controllers carry after PLC cycles at an instant that stands: before (state, memory, controllers, tick, tip,
    drum, parameters) as in `cycles_at`; of the controllers what they remember moves."""
    laws = before[2]
    carried = np.array([i for i, path in enumerate(paths(type(laws))) if "_memory." in path], dtype=int)
    if not len(carried):
        return laws
    kernel, row = equations(driver), np.array(numbers_of(before))
    start, size = len(numbers_of(before[:2])), len(numbers_of((laws,)))
    after = np.empty(kernel.AFTER)
    for _ in range(cycles):
        kernel.cycles_at(row, after, 1)
        row[start + carried] = after[-size:][carried]
    return unflatten(type(laws), iter(row[start : start + size].tolist()))


def numbers_of(records: Sequence[Any]) -> list[float]:
    """The numbers of records, one after the other, as `flatten` has them, in a tenth of its time."""
    kinds: list[Any] = [type(record) for record in records]
    return [number for kind, record in zip(kinds, records, strict=True) for number in _getter(kind)(record)]


@functools.cache
def _getter(cls: Any) -> Callable[[Any], tuple[float, ...]]:
    names = [path[1:] for path in paths(cls)]
    of_all: Any = operator.attrgetter(*names)
    if len(names) == 1:
        return lambda record: (of_all(record),)

    def numbers(record: Any) -> tuple[float, ...]:
        try:
            values: tuple[float, ...] = of_all(record)
        except AttributeError:  # another loss model than the record's class has
            return tuple(flatten(record))
        return values

    return numbers


def _batch(kernel: Any, numbers: Sequence[float], columns: Sequence[int], results: int) -> Batch:
    base, at = np.array(numbers), list(columns)

    def values(points: FloatArray) -> FloatArray:
        rows = np.tile(base, (len(points), 1))
        rows[:, at] = points
        out = np.empty((len(points), results))
        kernel(rows.reshape(-1), out.reshape(-1), len(points))
        return out

    return values
