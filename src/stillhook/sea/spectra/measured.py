"""Measured wave spectra: one record in frequency bands, and a series of them (a year at a buoy) as arrays.

What a band holds is spread evenly over it. Moments are the rectangle rule of the buoys: centre frequency to the power
n, times density, times band width; nothing is added for waves shorter than the last band.

Sea states over time as a height, periods and a direction each, where no spectra were kept: weather tables and
hindcasts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray, fill
from stillhook.errors import SeaError
from stillhook.sea.spectra.directions import Directions, relative
from stillhook.sea.spectra.spectrum import Sea, Train, WaveSpectrum
from stillhook.units import quote


@dataclass(frozen=True, eq=False)
class Measured(WaveSpectrum):
    """A spectrum in m bands: omega (m,) centres and width (m,) [rad/s], ascending; S (m,) [m^2 s/rad]; source says from
    where.

    Errors: SeaError for arrays of unequal length, frequencies that do not ascend, densities that are negative or no
    numbers.
    """

    omega: FloatArray
    width: FloatArray
    S: FloatArray
    source: str = "measured"
    kind: ClassVar[str] = "measured"

    def __post_init__(self) -> None:
        names = ("omega", "width", "S")
        fill(self, **{name: np.array(getattr(self, name), dtype=np.float64) for name in names})
        check_bands(self.omega, self.width, self.source)
        if self.S.shape != self.omega.shape:
            counts = f"{len(self.omega)} bands and {self.S.size} densities"
            raise SeaError(f"{self.source}: {counts}. Give one density per band.")
        if not np.all(np.isfinite(self.S)) or np.any(self.S < 0.0):
            i = int(np.flatnonzero(~(self.S >= 0.0) | ~np.isfinite(self.S))[0])
            problem = f"density {self.S[i]:g} m^2 s/rad at {self.omega[i]:g} rad/s is negative or no number"
            raise SeaError(f"{self.source}: {problem}. Correct the spectrum.")

    def density(self, omega: FloatArray) -> FloatArray:
        omega = np.asarray(omega, dtype=np.float64)
        lower, upper = self.omega - self.width / 2.0, self.omega + self.width / 2.0
        band = np.clip(np.searchsorted(lower, omega, side="right") - 1, 0, len(lower) - 1)
        inside = (omega >= lower[band]) & (omega < upper[band])
        return np.where(inside, self.S[band], 0.0)

    def moment(self, n: int) -> float:
        return float(np.sum(self.omega**n * self.S * self.width))

    def grid(self) -> FloatArray:
        """Band centres; sums with `weights`, the band widths, give the moments."""
        return self.omega

    def weights(self) -> FloatArray:
        return self.width

    @property
    def omega_cut(self) -> float:
        """Upper end of the last band [rad/s]."""
        return float(self.omega[-1] + self.width[-1] / 2.0)

    @property
    def peak_period(self) -> float:
        """Period of the centre of the highest band [s]; NaN where there are no waves."""
        return 2.0 * math.pi / float(self.omega[np.argmax(self.S)]) if self.S.max() > 0.0 else math.nan

    def describe(self) -> str:
        waves = f"Hm0={self.H_m0:.4g} m Tp={self.peak_period:.4g} s" if self.S.max() > 0.0 else "no waves"
        return f"{self.source}: {waves} in {len(self.omega)} bands"

    def to_dict(self) -> dict[str, Any]:
        arrays = {name: [float(x) for x in getattr(self, name)] for name in ("omega", "width", "S")}
        return {"type": self.kind, "source": self.source} | arrays


@dataclass(frozen=True, eq=False)
class SpectrumSeries:
    """n records of spectra in the same m bands, one after the other: a buoy's month or year, or a hindcast point.

    omega, width (m,) [rad/s]; S (n, m) [m^2 s/rad], a complete row of NaN where the record is not valid; time (n,) UTC,
    ascending; valid (n,); source, the file; notes, what the reader had to say (missing records, repeated times);
    directional, if it was measured. Missing and fill values are counted by `valid` and never used.
    """

    omega: FloatArray
    width: FloatArray
    S: FloatArray = field(repr=False)
    time: NDArray[np.datetime64] = field(repr=False)
    valid: NDArray[np.bool_] = field(repr=False)
    source: str = "series"
    notes: tuple[str, ...] = ()
    directional: Directions | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        names = ("omega", "width", "S", "time", "valid")
        fill(self, **{name: np.array(getattr(self, name)) for name in names})
        check_bands(self.omega, self.width, self.source)
        if self.S.shape != (len(self.time), len(self.omega)) or self.valid.shape != self.time.shape:
            counts = f"{len(self.time)} times and {len(self.omega)} bands"
            raise SeaError(f"{self.source}: spectra of shape {self.S.shape} for {counts}.")

    def __len__(self) -> int:
        return len(self.time)

    @property
    def n_valid(self) -> int:
        """Records that can be used."""
        return int(np.count_nonzero(self.valid))

    def moment(self, n: int) -> FloatArray:
        """m_n of each record (n_records,) [m^2 rad^n/s^n]; NaN where not valid. The rectangle rule."""
        return np.asarray(self.S @ (self.omega**n * self.width), dtype=np.float64)

    @property
    def H_m0(self) -> FloatArray:
        """Significant wave height of each record (n_records,) [m]; NaN where not valid."""
        return 4.0 * np.sqrt(self.moment(0))

    @property
    def T_m01(self) -> FloatArray:
        """Mean period 2 pi m_0/m_1 (n_records,) [s]; NaN where not valid or without waves."""
        return _ratio(self.moment(0), self.moment(1))

    @property
    def T_m02(self) -> FloatArray:
        """Zero-crossing period 2 pi sqrt(m_0/m_2) (n_records,) [s]; NaN where not valid or without waves."""
        return 2.0 * np.pi * np.sqrt(_ratio(self.moment(0), self.moment(2)) / (2.0 * np.pi))

    @property
    def T_e(self) -> FloatArray:
        """Energy period 2 pi m_-1/m_0 (n_records,) [s]; NaN where not valid or without waves."""
        return _ratio(self.moment(-1), self.moment(0))

    @property
    def T_p(self) -> FloatArray:
        """Period of the centre of the highest band (n_records,) [s]; NaN where not valid or without waves."""
        S = np.where(np.isnan(self.S), 0.0, self.S)
        return np.where(S.max(axis=1) > 0.0, 2.0 * np.pi / self.omega[np.argmax(S, axis=1)], np.nan)

    def index(self, record: str) -> int:
        """Place of a record that a text names: its number from 0, or its time (UTC, ISO 8601). Errors: SeaError."""
        text = record.strip()
        if text.isdigit():
            if int(text) >= len(self):
                raise SeaError(f"{self.source}: record {text} does not exist. The last one is {len(self) - 1}.")
            return int(text)
        try:
            stamp = datetime.fromisoformat(text.removesuffix("Z"))
            time = np.datetime64(stamp.replace(tzinfo=None) - (stamp.utcoffset() or timedelta(0)), "s")
        except (ValueError, OverflowError):
            problem = f"record {quote(record)} is neither a number nor a time"
            raise SeaError(f"{self.source}: {problem}. Write 12 or 1996-01-05T12:00.") from None
        at = np.flatnonzero(self.time == time)
        if len(at) == 0:
            near = self.time[int(np.argmin(np.abs(self.time - time)))]
            raise SeaError(f"{self.source}: no record at {time}Z. The nearest one is of {near}Z.")
        return int(at[0])

    def spectrum(self, i: int) -> Measured:
        """The i-th record. Errors: SeaError where it is missing."""
        if not self.valid[i]:
            raise SeaError(f"{self.source}: record {i} of {self.time[i]}Z is missing. Choose a valid one.")
        return Measured(self.omega, self.width, self.S[i], f"{self.source} {self.time[i]}Z")

    @property
    def come_from(self) -> FloatArray:
        """Mean direction that each record's waves come from, by variance (n_records,) [rad clockwise from north]; NaN
        where unknown."""
        if self.directional is None:
            return np.full(len(self), np.nan)
        mean = np.sum(self.directional.turn() * self.S * self.width, axis=1)
        return np.where(np.isnan(self.S[:, 0]), np.nan, np.angle(mean) % (2.0 * np.pi))

    def sea(self, i: int, heading: float) -> Sea:
        """The i-th record as a sea about a ship that heads `heading` [rad clockwise from north]: a train for every
        direction.

        Errors: SeaError where the record is missing or directions were not measured.
        """
        if self.directional is None:
            raise SeaError(f"{self.source}: holds no directions. Give the direction of the waves and their spread.")
        spectrum, share = self.spectrum(i), self.directional.shares(i)
        trains = []
        for k, theta in enumerate(self.directional.theta):
            S = spectrum.S * share[:, k]
            if np.any(S > 0.0):
                part = Measured(self.omega, self.width, S, f"{spectrum.source} from {math.degrees(theta):.4g} deg")
                trains.append(Train(part, relative(float(theta), heading)))
        if not trains:
            trains.append(Train(spectrum, 0.0))
        return Sea(tuple(trains))


def _ratio(upper: FloatArray, lower: FloatArray) -> FloatArray:
    """2 pi upper/lower, NaN where lower is not positive."""
    return 2.0 * np.pi * np.divide(upper, lower, out=np.full_like(upper, np.nan), where=lower > 0.0)


def check_bands(omega: FloatArray, width: FloatArray, source: str) -> None:
    """Refuse bands that are not bands. Errors: SeaError."""
    if omega.ndim != 1 or len(omega) < 2 or width.shape != omega.shape:
        counts = f"{omega.size} frequencies and {width.size} band widths"
        raise SeaError(f"{source}: {counts}. Give two or more bands, each with its width.")
    if not np.all(np.isfinite(omega)) or omega[0] <= 0.0 or np.any(np.diff(omega) <= 0.0):
        raise SeaError(f"{source}: frequencies are not positive and ascending. Sort the bands.")
    if not np.all(np.isfinite(width)) or np.any(width <= 0.0):
        raise SeaError(f"{source}: a band width is not positive. Give the width of each band.")


@dataclass(frozen=True, eq=False)
class SeaStates:
    """n sea states, one after the other; every array (n,), NaN where unknown.

    time UTC, ascending; valid, where the height is known; H_m0 [m]; T_p, T_m02 [s]; come_from, where waves come from,
    clockwise from north [rad]; source, the file; notes, what the reader had to say.
    """

    time: NDArray[np.datetime64] = field(repr=False)
    valid: NDArray[np.bool_] = field(repr=False)
    H_m0: FloatArray = field(repr=False)
    T_p: FloatArray = field(repr=False)
    T_m02: FloatArray = field(repr=False)
    come_from: FloatArray = field(repr=False)
    source: str = "sea states"
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.time)

    @property
    def n_valid(self) -> int:
        """Records that can be used."""
        return int(np.count_nonzero(self.valid))
