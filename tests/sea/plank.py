"""A plank that is on the water and follows it: motions in closed form at any frequency and heading, for tests of tables of them."""

from __future__ import annotations

import numpy as np

from stillhook.sea.vessel.rao import Rao, wavenumber

LENGTH, BREADTH = 60.0, 16.0  # m
OMEGA = np.linspace(0.1, 2.2, 43)
BETA = np.radians(np.arange(0.0, 360.0, 10.0))


def plank_motions(omega: np.ndarray, beta: np.ndarray) -> np.ndarray:
    """H (6, m, n): mean and mean slope of the water's motion under the plank, for exp(i omega t - i k (x cos beta + y sin beta))."""
    k = wavenumber(np.asarray(omega, dtype=float))[None, :]
    c, s = np.cos(beta)[:, None], np.sin(beta)[:, None]
    u, v = 0.5 * k * LENGTH * c, 0.5 * k * BREADTH * s
    mean = _mean(u) * _mean(v)
    along, across = -1j * k * c * _slope(u) * _mean(v), -1j * k * s * _slope(v) * _mean(u)
    return np.array([-1j * c * mean, -1j * s * mean, mean + 0j, across, -along, -1j * s * along])


def _mean(u: np.ndarray) -> np.ndarray:
    return np.sinc(u / np.pi)


def _slope(u: np.ndarray) -> np.ndarray:
    """Least-squares slope of exp(-i q x) over the length by -i q: 3 (sin u - u cos u)/u^3, 1 at 0."""
    near = np.abs(u) < 1e-2
    w = np.where(near, 1.0, u)
    return np.where(near, 1.0 - u**2 / 10.0, 3.0 * (np.sin(w) - w * np.cos(w)) / w**3)


def plank(omega: np.ndarray = OMEGA, beta: np.ndarray = BETA) -> Rao:
    return Rao("plank", omega, beta, plank_motions(omega, beta), origin="middle")
