"""Central differences of the engine's own equations: half widths by what a variable is, and where a function has a
kink."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from stillhook.base.arrays import FloatArray

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
