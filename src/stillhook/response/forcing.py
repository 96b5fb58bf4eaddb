"""Forcing by a sea at the crane tip and at the load, as spectra, in words or measured with direction from north."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.sea.spectra.directions import cos_power, relative
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
from stillhook.sea.spectra.parametric import HIGHEST as HIGHEST_SEA
from stillhook.sea.spectra.parametric import LONGEST, SHORTEST, Jonswap, gamma_of
from stillhook.sea.spectra.spectrum import Sea, check_spread
from stillhook.sea.vessel.heave_filter import FilteredMotion
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.rao import Rao, VerticalMotion, wavenumber
from stillhook.statistics.time_lag import over_frequency

PARTS = 8
"""Parts of a measured band: a wire that rings with 1 % of damping at 1.3 rad/s is then integrated to 1e-4 over a band
of 0.01 Hz."""
LOWEST, HIGHEST, STEP = 0.15, 3.0, 0.0075
"""Frequencies on which seas in words are taken [rad/s]: 42 s to 2.1 s, in steps that resolve that ringing."""
OMEGA: FloatArray = np.arange(LOWEST + STEP / 2.0, HIGHEST, STEP)
"""Frequencies of what answers to the waves: the middles of even steps [rad/s]."""


@dataclass(frozen=True, eq=False)
class Forcing:
    """n sea states at m frequencies. omega, width (m,) [rad/s]; tip (n, m) variance of the tip's height in each [m^2];
    wave (n, m) that of the surface above the load [m^2]; cross (n, m) mean of tip times conjugate wave [m^2], complex.
    Rows of a missing sea are NaN. lost: what the heave filter of the motion unit keeps from the PLC, as the tip of a
    forcing, and mixed (n, m) mean of tip times its conjugate [m^2], complex; None where there is no filter.
    """

    omega: FloatArray = field(repr=False)
    width: FloatArray = field(repr=False)
    tip: FloatArray = field(repr=False)
    wave: FloatArray = field(repr=False)
    cross: ComplexArray = field(repr=False)
    lost: Forcing | None = field(default=None, repr=False)
    mixed: ComplexArray | None = field(default=None, repr=False)

    def remaining(self, C: ArrayLike) -> Forcing:
        """With the wire's end for the tip, of a winch that leaves C, complex, of the motion that the PLC is given: all
        of what the filter loses is left. A flat share, of unknown phase, leaves no less than a winch that follows
        exactly."""
        C = np.asarray(C)
        tip, cross = np.abs(C) ** 2 * self.tip, C * self.cross
        if self.lost is not None and self.mixed is not None:
            D = 1.0 - C
            tip = np.maximum(tip + np.abs(D) ** 2 * self.lost.tip + 2.0 * np.real(C * np.conj(D) * self.mixed), 0.0)
            flat = (np.imag(C) == 0.0) & (np.real(C) < 1.0)
            tip = np.where(flat, np.maximum(tip, self.lost.tip), tip)
            cross = cross + D * self.lost.cross
        return replace(self, tip=tip, cross=cross, lost=None, mixed=None)

    def __len__(self) -> int:
        return len(self.tip)

    def deviation(self, order: int = 0) -> FloatArray:
        """Standard deviation of the tip's height (0) [m], speed (1) [m/s] or acceleration (2) [m/s^2] in each sea,
        (n,)."""
        return np.asarray(np.sqrt(over_frequency(self.tip, self.omega[None, :] ** (2 * order))[:, 0]))


def filtered_forcing(of: Callable[[VerticalMotion], Forcing], vessel: Rao, unit: MotionUnit | None) -> Forcing:
    """Forcing of seas, with what the heave filter of a motion unit loses; of: the forcing of something that moves."""
    tip = of(vessel)
    if unit is None:
        return tip
    lost, both, turned = (of(FilteredMotion(vessel, unit, a, b)) for a, b in ((0.0, 1.0), (1.0, 1.0), (1.0, 1j)))
    apart = tip.tip + lost.tip
    return replace(tip, lost=lost, mixed=np.asarray(0.5 * (both.tip - apart) + 0.5j * (turned.tip - apart)))


def forcing_of_series(
    series: SpectrumSeries,
    vessel: VerticalMotion,
    x: float,
    y: float,
    beta: ArrayLike,
    *,
    spread: float | None = None,
    depth: float = math.inf,
    parts: int = PARTS,
) -> Forcing:
    """Forcing of every record of a series of measured spectra.

    Parameters
    ----------
    series : SpectrumSeries
        n records of spectra.
    vessel : Rao
        Its motions per wave.
    x : float
        Place of tip and load from the vessel's reference point, forward [m].
    y : float
        The same, to port [m].
    beta : float or array
        Direction of travel from the bow [rad], one, or one for each record (n,).
    spread : float, optional
        Exponent of cos^n about it [-]; None for long-crested waves.
    depth : float, default inf
        Depth of the water [m].
    parts : int, default 8
        Parts in which a measured band, which is flat, is taken: the transfer functions change within it.

    Returns
    -------
    Forcing
        n sea states at m frequencies, variances of shape (n, m) [m^2].

    Raises
    ------
    SeaError
        For headings of another number.
    """
    headings = np.asarray(beta, dtype=np.float64)
    if headings.ndim and headings.shape != (len(series),):
        raise SeaError(
            f"{series.source}: {headings.size} headings for {len(series)} records. Enter one for all, or one for each."
        )
    omega, width, wave = _parted(series, parts)
    distinct, row = np.unique(np.mod(headings.ravel(), 2.0 * math.pi), return_inverse=True)
    power, cross = (
        np.array(each)
        for each in zip(*(tip_by_wave(omega, vessel, x, y, b, spread, depth) for b in distinct), strict=True)
    )
    rows = row.ravel() if headings.ndim else np.zeros(1, dtype=int)
    return Forcing(omega, width, wave * power[rows], wave, wave * cross[rows])


def _parted(series: SpectrumSeries, parts: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Frequencies (m,), widths (m,) [rad/s] and variances of the surface (n, m) [m^2] of the bands, each in `parts`."""
    offsets = (np.arange(parts) + 0.5) / parts - 0.5
    omega = (series.omega[:, None] + offsets * series.width[:, None]).ravel()
    width = np.repeat(series.width / parts, parts)
    return omega, width, np.repeat(series.S, parts, axis=1) * width


def forcing_of_seas(
    seas: Sea | Sequence[Sea], vessel: VerticalMotion, x: float, y: float, *, depth: float = math.inf
) -> Forcing:
    """Forcing of one sea or several, each of one train of waves or more; directions are theirs.

    Parameters
    ----------
    seas : Sea or sequence of Sea
        n seas.
    vessel : Rao
        Its motions per wave.
    x : float
        Place of tip and load from the vessel's reference point, forward [m].
    y : float
        The same, to port [m].
    depth : float, default inf
        Depth of the water [m].

    Returns
    -------
    Forcing
        n sea states at m frequencies, variances of shape (n, m) [m^2].

    Raises
    ------
    SeaError
        For an empty list.
    """
    listed = [seas] if isinstance(seas, Sea) else list(seas)
    if not listed:
        raise SeaError("seas: the list is empty. Enter at least one sea.")
    omega = OMEGA
    shape = (len(listed), len(omega))
    tip, wave, mixed = np.zeros(shape), np.zeros(shape), np.zeros(shape, dtype=complex)
    transfers: dict[tuple[float, float | None], tuple[FloatArray, ComplexArray]] = {}
    for n, sea in enumerate(listed):
        for train in sea.trains:
            key = (train.beta, train.spread)
            if key not in transfers:
                transfers[key] = tip_by_wave(omega, vessel, x, y, *key, depth)
            S = train.spectrum.density(omega) * STEP
            tip[n] += transfers[key][0] * S
            mixed[n] += transfers[key][1] * S
            wave[n] += S
    return Forcing(omega, np.full(len(omega), STEP), tip, wave, mixed)


def tip_by_wave(
    omega: FloatArray,
    vessel: VerticalMotion,
    x: float,
    y: float,
    beta: float,
    spread: float | None,
    depth: float = math.inf,
) -> tuple[FloatArray, ComplexArray]:
    """Variance of the tip, and mean of tip times conjugate wave above the load, both per variance of the waves, (m,)
    each; depth of the water [m], which sets the wave's phase there (the vessel's motions are those of its file)."""
    theta, share = (np.zeros(1), np.ones(1)) if spread is None else cos_power(check_spread(spread))
    directions = beta + theta
    R = vessel.vertical(omega, directions, x, y)
    along = x * np.cos(directions) + y * np.sin(directions)
    wave = np.exp(-1j * np.outer(along, wavenumber(omega, depth)))
    return share @ np.abs(R) ** 2, share @ (R * np.conj(wave))


BLOCK = 256
"""Records whose shares of directions are held at a time."""
DIGITS = 2
"""Digits after the point of gamma where it follows from height and period: the rule itself is no better."""

GRID = 720
"""Directions round the circle, half a degree apart: whole degrees, and the directions within a short-crested sea about
them."""
GAMMA_CHANGES = (3.6, 5.0)
"""T_p/sqrt(H_s) between which gamma changes, 5 before and 1 beyond. Source: DNV-RP-C205; check against your edition."""


def forcing_of_directional(
    series: SpectrumSeries, vessel: VerticalMotion, x: float, y: float, ship: float, *, parts: int = PARTS
) -> Forcing:
    """Forcing of every record of spectra that hold their directions, about a ship that heads `ship` [rad clockwise from
    north].

    As `stillhook.response.forcing.forcing_of_series`, with every band shared out over directions as it was measured. A
    record with waves of unknown direction counts as missing. Errors: SeaError where no directions were measured.
    """
    directions = series.directional
    if directions is None:
        raise SeaError(f"{series.source}: contains no directions. Enter the direction of the waves from the bow.")
    omega, width, wave = _parted(series, parts)
    each = [tip_by_wave(omega, vessel, x, y, relative(float(theta), ship), None) for theta in directions.theta]
    power = np.array([p for p, _ in each]).reshape(len(each), -1, parts).transpose(1, 0, 2)  # band, direction, part
    cross = np.array([c for _, c in each]).reshape(len(each), -1, parts).transpose(1, 0, 2)
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
    states: SeaStates,
    vessel: VerticalMotion,
    x: float,
    y: float,
    *,
    beta: float | None = None,
    ship: float | None = None,
    spread: float | None = None,
) -> Forcing:
    """Forcing of sea states of which height, period and perhaps direction are known, as JONSWAP spectra with gamma by
    their steepness.

    beta: direction of travel from the bow for all [rad]; or ship: where the bow points, clockwise from north [rad], for
    the direction that each record's waves come from, taken to whole degrees. spread: exponent of cos^n. The peak period
    is used where there is one, else the zero-crossing period.
    Records without height, period (of waves that have a height) or required direction are missing; so are those that
    are physically impossible.
    Errors: SeaError where neither or both of beta and ship are given, or nothing is left.
    """
    if (beta is None) == (ship is None):
        raise SeaError(
            f"{states.source}: enter either the direction of the waves from the bow, or the heading of the bow."
        )
    omega = OMEGA
    if ship is None:
        beta = 0.0 if beta is None else beta
        place, valid = np.zeros(len(states), dtype=int), np.ones(len(states), dtype=bool)
    else:
        beta, valid = relative(0.0, ship), np.isfinite(states.come_from)
        place = -GRID * np.round(np.degrees(np.where(valid, states.come_from, 0.0))).astype(int) // 360
    wave = _waves(states, omega)
    wave[~valid & (np.nan_to_num(states.H_m0) > 0.0)] = np.nan
    distinct, row = np.unique(place, return_inverse=True)
    power, cross = _about(omega, vessel, x, y, float(beta), distinct, spread)
    if not np.isfinite(wave).any():
        raise SeaError(f"{states.source}: no record has height, period and, where --ship is given, a direction.")
    return Forcing(omega, np.full(len(omega), STEP), wave * power[row.ravel()], wave, wave * cross[row.ravel()])


def _about(
    omega: FloatArray,
    vessel: VerticalMotion,
    x: float,
    y: float,
    beta: float,
    place: NDArray[np.intp],
    spread: float | None,
) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Result of `tip_by_wave` for headings beta + place steps of the grid, (k, m) each: long-crested waves of each
    direction are calculated once and shared by all headings whose waves reach it."""
    theta, share = (np.zeros(1), np.ones(1)) if spread is None else cos_power(check_spread(spread))
    indices = place[:, None] + np.rint(theta * GRID / (2.0 * np.pi)).astype(int)
    used, at = np.unique(indices % GRID, return_inverse=True)
    each = [tip_by_wave(omega, vessel, x, y, beta + 2.0 * np.pi * float(k) / GRID, None) for k in used]
    power, cross = np.array([p for p, _ in each]), np.array([c for _, c in each])
    at = at.reshape(indices.shape)
    return np.array([share @ power[rows] for rows in at]), np.array([share @ cross[rows] for rows in at])


def _waves(states: SeaStates, omega: FloatArray) -> FloatArray:
    """Variance of the surface in each frequency (n, m) [m^2]; NaN rows where the state is not known."""
    wave = np.full((len(states), len(omega)), np.nan)
    peak = np.where(np.isfinite(states.T_p), states.T_p, _peak_periods(states.T_m02, states.H_m0))
    for i in np.flatnonzero(states.valid):
        H_s, T_p = float(states.H_m0[i]), float(peak[i])
        if H_s == 0.0:
            wave[i] = 0.0
        elif 0.0 < H_s <= HIGHEST_SEA and SHORTEST <= T_p <= LONGEST:
            wave[i] = Jonswap(H_s, T_p, round(gamma_of(H_s, T_p), DIGITS)).density(omega) * STEP
    return wave


def _peak_periods(T_z: FloatArray, H_s: FloatArray) -> FloatArray:
    """Peak periods of JONSWAP spectra of zero-crossing periods T_z and heights H_s (n,), gamma by steepness [s]; NaN
    where one is unknown.

    T_z/sqrt(H_s) follows from T_p/sqrt(H_s) alone: straight where gamma is constant, by a table between.
    """
    place = np.linspace(*GAMMA_CHANGES, 29)
    crossing = np.array([Jonswap(1.0, float(r)).T_m02 for r in place])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = T_z / np.sqrt(H_s)
    straight = np.where(x < crossing[0], x * place[0] / crossing[0], x * place[-1] / crossing[-1])
    inside = (x >= crossing[0]) & (x <= crossing[-1])
    return np.asarray(np.sqrt(H_s) * np.where(inside, np.interp(x, crossing, place), straight))
