"""Forcing by waves whose direction was measured from north: spectra with directions of their own, and heights with periods alone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import SeaError
from stillhook.response.forcing import HIGHEST, LOWEST, PARTS, STEP, Forcing, tip_by_wave
from stillhook.sea.directions import relative
from stillhook.sea.measured import SpectrumSeries
from stillhook.sea.parametric import HIGHEST as HIGHEST_SEA
from stillhook.sea.parametric import LONGEST, SHORTEST, Jonswap, gamma_of, peak_period_of
from stillhook.sea.rao import Rao
from stillhook.sea.states import SeaStates

FloatArray = NDArray[np.float64]

BLOCK = 256
"""Records whose shares of directions are held at a time."""
DIGITS = 2
"""Digits after the point of gamma where it follows from height and period: the rule itself is no better."""


def forcing_of_directional(series: SpectrumSeries, vessel: Rao, x: float, y: float, ship: float, *, parts: int = PARTS) -> Forcing:
    """Forcing of every record of spectra that hold their directions, about a ship that heads `ship` [rad clockwise from north].

    As `stillhook.response.forcing.forcing_of_series`, with every band shared out over directions as it was measured. A record with waves
    of unknown direction counts as missing. Errors: SeaError where no directions were measured.
    """
    directions = series.directional
    if directions is None:
        raise SeaError(f"{series.source}: holds no directions. Give the direction of the waves from the bow.")
    offsets = (np.arange(parts) + 0.5) / parts - 0.5
    omega = (series.omega[:, None] + offsets * series.width[:, None]).ravel()
    width = np.repeat(series.width / parts, parts)
    each = [tip_by_wave(omega, vessel, x, y, relative(float(theta), ship), None) for theta in directions.theta]
    power = np.array([p for p, _ in each]).reshape(len(each), -1, parts).transpose(1, 0, 2)  # band, direction, part
    cross = np.array([c for _, c in each]).reshape(len(each), -1, parts).transpose(1, 0, 2)
    wave = np.repeat(series.S, parts, axis=1) * width
    tip, mixed = np.empty_like(wave), np.empty(wave.shape, dtype=complex)
    for i in range(0, len(series), BLOCK):
        rows = slice(i, min(i + BLOCK, len(series)))
        share = np.array([directions.shares(n) for n in range(rows.start, rows.stop)])
        share = np.where(series.S[rows, :, None] == 0.0, 0.0, share).transpose(1, 0, 2)  # band, record, direction
        for out, by in ((tip, power), (mixed, cross)):
            out[rows] = (share @ by).transpose(1, 0, 2).reshape(rows.stop - rows.start, -1)
    unknown = np.isnan(tip).any(axis=1)
    tip, mixed, wave = tip * wave, mixed * wave, wave.copy()
    for array in (tip, mixed, wave):
        array[unknown] = np.nan
    return Forcing(omega, width, tip, wave, mixed)


def forcing_of_states(
    states: SeaStates, vessel: Rao, x: float, y: float, *, beta: float | None = None, ship: float | None = None, spread: float | None = None
) -> Forcing:
    """Forcing of sea states of which height, period and perhaps direction are known, as JONSWAP spectra with gamma by their steepness.

    beta: direction of travel from the bow for all [rad]; or ship: where the bow points, clockwise from north [rad], for the direction that
    each record's waves come from. spread: exponent of cos^n. The peak period is used where there is one, else the zero-crossing period.
    Records without height, period (of waves that have a height) or needed direction are missing; so are those that no sea can be.
    Errors: SeaError where neither or both of beta and ship are given, or nothing is left.
    """
    if (beta is None) == (ship is None):
        raise SeaError(f"{states.source}: give the direction of the waves from the bow, or where the bow points; one of them.")
    omega = np.arange(LOWEST + STEP / 2.0, HIGHEST, STEP)
    headings = np.full(len(states), beta) if ship is None else relative(states.come_from, ship)
    wave = _waves(states, omega)
    wave[~np.isfinite(headings) & (np.nan_to_num(states.H_m0) > 0.0)] = np.nan
    which, row = np.unique(np.where(np.isfinite(headings), headings, 0.0), return_inverse=True)
    power, cross = (np.array(each) for each in zip(*(tip_by_wave(omega, vessel, x, y, float(b), spread) for b in which), strict=True))
    if not np.isfinite(wave).any():
        raise SeaError(f"{states.source}: no record has what is needed: height, period, and a direction where --ship is given.")
    return Forcing(omega, np.full(len(omega), STEP), wave * power[row.ravel()], wave, wave * cross[row.ravel()])


def _waves(states: SeaStates, omega: FloatArray) -> FloatArray:
    """Variance of the surface in each frequency (n, m) [m^2]; NaN rows where the state is not known."""
    wave = np.full((len(states), len(omega)), np.nan)
    for i in np.flatnonzero(states.valid):
        H_s, T_p, T_z = float(states.H_m0[i]), float(states.T_p[i]), float(states.T_m02[i])
        if H_s == 0.0:
            wave[i] = 0.0
            continue
        if not math.isfinite(T_p) and T_z > 0.0:
            T_p = peak_period_of(T_z, H_s)
        if 0.0 < H_s <= HIGHEST_SEA and SHORTEST <= T_p <= LONGEST:
            wave[i] = Jonswap(H_s, T_p, round(gamma_of(H_s, T_p), DIGITS)).density(omega) * STEP
    return wave
