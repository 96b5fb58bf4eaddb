"""Lag of one signal behind another, and sums of products, trends and filters of series."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import FloatArray

SPAN = 0.5
"""Span of each of the two means that make a change [s]: short against waves, long against noise."""
PIECE = 25.0
"""Length of the pieces that each give a lag [s]: some waves, so that neighbours are nearly independent."""
FEWEST = 2
"""Pieces for an uncertainty."""
ROUNDS = 6
"""Of linearising: each takes the error of a lag to its square over a wave's period."""
AGAIN = 2
"""Number of corrections by the estimate followed by estimation of the remainder: a drift distorts the pieces that it is
estimated from."""
CLEAR = 0.8
"""Correlation of a piece that counts."""
STEADY = 3.0
"""Times its uncertainty: a smaller drift counts as zero."""


@dataclass(frozen=True)
class Lag:
    """y(t) = gain * x(t - seconds) + constant. seconds: lag of y behind x in the middle of the data [s], with u its
    standard uncertainty; drift: change of the lag over time [-] with u_drift, 0 where it is not significant; middle:
    time of `seconds` [s]; pieces.
    """

    seconds: float
    u: float
    gain: float
    drift: float
    u_drift: float
    middle: float
    pieces: int

    def at(self, t: FloatArray) -> FloatArray:
        """Lag at times [s]."""
        return self.seconds + self.drift * (t - self.middle)


def lag(t: FloatArray, x: FloatArray, y: FloatArray, reach: float) -> Lag | None:
    """Lag of y behind x, both (n,) on the even times t [s], NaN where not known; None where the data do not determine
    it.

    Parameters: reach: largest lag considered, of either sign [s].
    """
    estimate = _once(t, x, y, reach)
    for _ in range(AGAIN):
        if estimate is None:
            return None
        remainder = _once(t, x, shifted(t, y, estimate.at(t), 2.0 * float(t[1] - t[0])), reach)
        if remainder is None:
            return estimate
        seconds = float(estimate.at(np.array(remainder.middle))) + remainder.seconds
        estimate = replace(remainder, seconds=seconds, drift=estimate.drift + remainder.drift)
    return estimate


def _once(t: FloatArray, x: FloatArray, y: FloatArray, reach: float) -> Lag | None:
    step = float(t[1] - t[0]) if len(t) > 1 else 1.0
    span = max(1, round(SPAN / step))
    dx, dy = changes(x, span), changes(y, span)
    start = _coarse(dx, dy, round(reach / step)) * step
    size = max(4 * span + 1, round(PIECE / step))
    pieces = []
    for a in range(0, max(1, len(t) - size // 2), size):
        part = slice(a, min(len(t), a + size))
        one = _piece(t, dx, dy, part, start, reach)
        if one is not None:
            pieces.append((float(np.mean(t[part])), *one))
    if len(pieces) < FEWEST:
        return None
    at, seconds, gain = np.array(pieces).T
    middle = float(np.mean(at))
    drift, u_drift = _slope(at - middle, seconds)
    if abs(drift) < STEADY * u_drift or len(pieces) < 2 * FEWEST:
        drift = 0.0
    lags = seconds - drift * (at - middle)
    off = np.abs(lags - np.median(lags))
    good = lags[off <= 5.0 * max(1.4826 * float(np.median(off)), 1e-3 * step)]
    if len(good) < FEWEST:
        return None
    u = float(np.std(good, ddof=1) / np.sqrt(len(good)))
    return Lag(float(np.mean(good)), u, float(np.median(gain)), drift, u_drift, middle, len(good))


def shifted(t: FloatArray, y: FloatArray, seconds: FloatArray, longest: float) -> FloatArray:
    """y as it would be without a lag [s] that may change over time; NaN where a hole of y longer than `longest` [s]
    reaches."""
    finite = np.isfinite(y)
    if finite.sum() < 2:
        return np.full(len(y), np.nan)
    at, stamps = t + seconds, t[finite]
    after = np.clip(np.searchsorted(stamps, at), 1, len(stamps) - 1)
    hole = (stamps[after] - stamps[after - 1] > longest) | (at < stamps[0] - longest) | (at > stamps[-1] + longest)
    return np.where(hole, np.nan, np.interp(at, stamps, y[finite]))


def changes(x: FloatArray, span: int) -> FloatArray:
    """Mean over the next `span` samples less that over the last ones: a change with little noise, even about its
    moment."""
    kernel = np.concatenate([np.full(span, 1.0), [0.0], np.full(span, -1.0)]) / span
    out = np.full(len(x), np.nan)
    if len(x) > 2 * span:
        out[span:-span] = np.convolve(x, kernel, mode="valid")
    return out


def _coarse(dx: FloatArray, dy: FloatArray, reach: int) -> int:
    """Integer lag of dy with the highest correlation [samples]."""
    a, b = np.nan_to_num(dx), np.nan_to_num(dy)
    size = 1 << (2 * len(a)).bit_length()
    c = np.fft.irfft(np.fft.rfft(b, size) * np.conj(np.fft.rfft(a, size)), size)
    lags = np.arange(-reach, reach + 1)
    return int(lags[np.argmax(c[lags])]) if len(a) > reach else 0


def _piece(
    t: FloatArray, dx: FloatArray, dy: FloatArray, part: slice, start: float, reach: float
) -> tuple[float, float] | None:
    """Lag and gain of one piece, by linearising about the lag found so far."""
    slope, late = np.gradient(dx, t), dy[part]
    seconds, gain = start, 1.0
    for _ in range(ROUNDS):
        at = t[part] - seconds
        X, S = np.interp(at, t, dx, np.nan, np.nan), np.interp(at, t, slope, np.nan, np.nan)
        ok = np.isfinite(X) & np.isfinite(S) & np.isfinite(late)
        if ok.sum() < 0.5 * len(at):
            return None
        X, S, Y = X[ok], S[ok], late[ok]
        gain, bent = _fitted(X - X.mean(), S - S.mean(), Y - Y.mean())
        if not gain > 0.0:
            return None
        seconds -= bent / gain
        if abs(seconds - start) > reach:
            return None
    size = float(np.std(X) * np.std(Y))
    return (seconds, float(gain)) if np.mean((X - X.mean()) * (Y - Y.mean())) > CLEAR * size > 0.0 else None


def _fitted(X: FloatArray, S: FloatArray, Y: FloatArray) -> tuple[float, float]:
    """Y = gain X + bent S by least squares; sums rather than matrix products, whose rounding depends on the number of
    threads."""
    xx, xs, ss = float(np.sum(X * X)), float(np.sum(X * S)), float(np.sum(S * S))
    xy, sy = float(np.sum(X * Y)), float(np.sum(S * Y))
    det = xx * ss - xs * xs
    return ((ss * xy - xs * sy) / det, (xx * sy - xs * xy) / det) if det > 0.0 else (0.0, 0.0)


def _slope(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope of a line and its standard uncertainty."""
    if len(x) < 3:
        return 0.0, np.inf
    s = float(np.sum(x * (y - y.mean())) / np.sum(x * x))
    residual = y - y.mean() - s * x
    return s, float(np.sqrt(np.sum(residual**2) / (len(x) - 2) / np.sum(x * x)))


SMALL = 200_000
"""Multiplications in a product that OpenBLAS does not spread over threads (its threshold is 262,144)."""


def dot(a: FloatArray, b: FloatArray) -> float:
    """Sum of products of two columns (n,)."""
    return float(np.sum(a * b))


def over_frequency(a: FloatArray, b: FloatArray) -> FloatArray:
    """Sums over the last axis, (n, s): a (n, m), b (s, m)."""
    rows, out = max(1, SMALL // b.size), np.empty((len(a), len(b)))
    for i in range(0, len(a), rows):
        np.matmul(a[i : i + rows], b.T, out=out[i : i + rows])
    return out


def straightened(y: FloatArray) -> FloatArray:
    """A series less its mean and the straight line through it."""
    t = np.linspace(-1.0, 1.0, len(y))
    y = y - np.sum(y) / len(y)
    return np.asarray(y - t * (np.sum(t * y) / np.sum(t * t)))


def low_pass(x: FloatArray, k: float) -> FloatArray:
    """First-order lag of a sampled signal that starts settled, (n,); k part of the way that it goes in one sample."""
    from scipy.signal import lfilter  # heavy: only where logs are made or checked

    return np.asarray(lfilter([k], [1.0, k - 1.0], x, zi=[(1.0 - k) * x[0]])[0])
