"""Motions of a free ship from its wave loads.

    [-omega^2 (M + A) + i omega (B + B_v) + C] H = F        for unit wave amplitude, exp(+i omega t)

M holds mass and inertia about the origin (midship, centreline, still waterline), C hydrostatics and weight, B_v one
number: added linear roll damping, zeta of the critical one 2 sqrt(I C_44), where I = M_44 + A_44 - (M_24 +
A_24)^2/(M_22 + A_22) at roll's natural frequency is the inertia of a roll that is free to sway.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from radiation import RHO, G, Loads
from ships import Ship

from stillhook.sea.vessel.rao import Rao

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
ORIGIN = "midship (half of the waterline's length), centreline, still waterline"
SWAY, HEAVE, ROLL, PITCH = 1, 2, 3, 4
HEADINGS = 2
"""The table has every so many-th heading of the loads."""
ANSWERS = (0.3, 1.6)  # rad/s
ROLL_STEP, ROLL_STEPS = 0.006, 12
"""Frequencies about the peak of roll [rad/s]: a quarter of its half width at 5 % damping apart, three half widths to
each side."""


@dataclass(frozen=True)
class Floating:
    """A ship in its weight: mass [kg], centre of gravity (3,) [m], M and C (6, 6) about the origin."""

    mass: float
    centre: FloatArray
    M: FloatArray
    C: FloatArray


def cross(r: FloatArray) -> FloatArray:
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def floating(ship: Ship, loads: Loads) -> Floating:
    """Weights so that it floats on even keel with its GM: the panels' own volume, so that mass and buoyancy are the
    same to the last kg."""
    mass = RHO * loads.V
    C = loads.C.copy()
    z_G = C[ROLL, ROLL] / (mass * G) - ship.GM  # loads.C has the weight at height 0
    C[ROLL, ROLL] -= mass * G * z_G
    C[PITCH, PITCH] -= mass * G * z_G
    centre = np.array([loads.centre[0], 0.0, z_G])
    S = cross(centre)
    radii = np.array([ship.r_xx * ship.lines.B, ship.r_yy * ship.lines.L, ship.r_zz * ship.lines.L])
    M = np.block([[mass * np.eye(3), -mass * S], [mass * S, mass * np.diag(radii**2) - mass * S @ S]])
    return Floating(mass, centre, M, C)


def between(omega: float, loads: Loads, table: FloatArray) -> FloatArray:
    """A or B at one frequency."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(loads.omega, table)(omega))


def roll_inertia(weights: Floating, A: FloatArray) -> float:
    """Inertia of a roll that is free to sway [kg m^2]; independent of the origin."""
    total = weights.M + A
    return float(total[ROLL, ROLL] - total[SWAY, ROLL] ** 2 / total[SWAY, SWAY])


def natural(weights: Floating, loads: Loads) -> tuple[float, float, float]:
    """Natural frequencies [rad/s] of heave, roll (free to sway) and pitch (free to heave), without damping."""
    periods = []
    for dof in (HEAVE, ROLL, PITCH):
        w = 0.7
        for _ in range(60):
            A = between(w, loads, loads.A)
            inertia = roll_inertia(weights, A) if dof == ROLL else (weights.M + A)[dof, dof]
            w = 0.5 * (w + float(np.sqrt(weights.C[dof, dof] / inertia)))
        periods.append(w)
    return periods[0], periods[1], periods[2]


def roll_damping(ship: Ship, weights: Floating, loads: Loads, zeta: float | None = None) -> tuple[float, float]:
    """Added roll damping [N m s/rad], and the part of the critical one that waves alone carry away."""
    w = natural(weights, loads)[1]
    critical = 2.0 * np.sqrt(roll_inertia(weights, between(w, loads, loads.A)) * weights.C[ROLL, ROLL])
    A, B = between(w, loads, loads.A), between(w, loads, loads.B)
    lever = (weights.M + A)[SWAY, ROLL] / (weights.M + A)[SWAY, SWAY]
    waves = B[ROLL, ROLL] - 2.0 * lever * B[SWAY, ROLL] + lever**2 * B[SWAY, SWAY]
    return float((ship.zeta if zeta is None else zeta) * critical), float(waves / critical)


def finer(loads: Loads, omega: FloatArray) -> Loads:
    """Loads at other frequencies in the same range, by cubic splines."""
    from scipy.interpolate import CubicSpline

    at = lambda table: np.asarray(CubicSpline(loads.omega, table)(omega))
    return replace(loads, omega=omega, A=at(loads.A), B=at(loads.B), F=at(loads.F))


def grid(loads: Loads, roll: float) -> FloatArray:
    """Frequencies of the vessel's table: those of the loads, one more between two of them where a ship answers, and
    more about the narrow peak of roll."""
    between = (loads.omega[1:] + loads.omega[:-1]) / 2.0
    even = np.concatenate([loads.omega, between[(between > ANSWERS[0]) & (between < ANSWERS[1])]])
    about = roll + ROLL_STEP * np.arange(-ROLL_STEPS, ROLL_STEPS + 1)
    apart = np.abs(even[:, None] - about).min(axis=1) > ROLL_STEP / 2.0
    return np.sort(np.concatenate([even[apart], about]))


def rao(ship: Ship, loads: Loads, *, zeta: float | None = None) -> Rao:
    """Motion transfer functions, in Stillhook's convention; zeta in place of the ship's own where it is given."""
    weights = floating(ship, loads)
    damping = np.zeros((6, 6))
    damping[ROLL, ROLL] = roll_damping(ship, weights, loads, zeta)[0]
    loads = finer(loads, grid(loads, natural(weights, loads)[1]))
    H = solved(loads.omega, weights.M + symmetric(loads.A), symmetric(loads.B) + damping, weights.C, loads.F)
    return Rao(ship.title, loads.omega, loads.beta[::HEADINGS], H[:, ::HEADINGS], origin=ORIGIN)


def symmetric(table: FloatArray) -> FloatArray:
    """Reciprocity holds but for the panels' errors."""
    return (table + np.swapaxes(table, 1, 2)) / 2.0


def solved(omega: FloatArray, M: FloatArray, B: FloatArray, C: FloatArray, F: ComplexArray) -> ComplexArray:
    """H (6, m, n) of -omega^2 M H + i omega B H + C H = F; M, B (n, 6, 6), F (n, m, 6)."""
    w = omega[:, None, None]
    H = np.linalg.solve((-(w**2) * M + 1j * w * B + C)[:, None], F[..., None])[..., 0]
    return np.moveaxis(H, -1, 0).swapaxes(1, 2) + 0.0  # no -0 in the files
