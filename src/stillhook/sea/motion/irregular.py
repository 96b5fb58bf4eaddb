"""Irregular motion of the crane tip: harmonics of one long period, summed by FFT and joined by a smooth curve."""

from __future__ import annotations

import binascii
import math
import zlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ArrayRecord, ComplexArray, FloatArray, decode_array, encode_array, fill
from stillhook.errors import MotionError
from stillhook.sea.motion.motion import Motion, Sample

FINE = 0.05
"""Angle between two nodes of the curve for the fastest harmonic [rad]: height, speed and acceleration of that harmonic
are then right to 3e-13, 2e-11 and 4e-9 of their amplitudes, of every slower one better (quintic Hermite, errors of
order 6, 5 and 4)."""
COARSE = 0.35
"""The same for runs in great numbers: 4e-8, 3e-7 and 1e-5 of the fastest harmonic's amplitudes, a thousandth of what
the winch leaves."""
SHORTEST_REPEAT, LONGEST_REPEAT = 1.0, 86400.0  # s: below is no sea, above is no sea state


@dataclass(frozen=True, init=False, eq=False)
class IrregularTip(ArrayRecord, Motion):
    r"""A motion made of harmonics of one period T, after which it repeats exactly.

    .. math:: s(t) = \mathrm{Re} \sum_{k=0}^{n} c_k e^{i \omega_k t}, \qquad \omega_k = 2\pi k/T

    Parameters: amplitudes c (n + 1,) complex [m], c_0 the mean height (real); repeat T [s]; source and report in words;
    fine, the angle between nodes [rad], `FINE` or coarser.
    Height, speed and acceleration are those of one curve, twice smoothly differentiable, through the exact values of
    all three at even nodes: they are exact derivatives of one another, and right to the errors stated at `FINE`. Known
    over one period, 0 to T: what comes later is the same again and states nothing new, so runs may not be longer;
    `sample` itself takes any time.
    Errors: MotionError for amplitudes that are not numbers, and a period outside 1 s to 24 h.
    """

    amplitudes: ComplexArray = field(repr=False)
    repeat: float
    source: str
    report: str = field(repr=False)
    fine: float = FINE
    kind: ClassVar[str] = "irregular"

    def __init__(
        self, amplitudes: ArrayLike, repeat: float, *, source: str = "", report: str = "", fine: float = FINE
    ) -> None:
        place = source or "IrregularTip"
        try:
            c = np.array(amplitudes, dtype=np.complex128)
        except (TypeError, ValueError):
            do = "Give one complex number [m] for each harmonic."
            raise MotionError(f"{place}: amplitudes are not numbers. {do}") from None
        if c.ndim != 1 or len(c) < 2 or not np.isfinite(c).all() or c[0].imag != 0.0:
            raise MotionError(f"{place}: give finite amplitudes of the mean (real) and of one harmonic or more.")
        if not SHORTEST_REPEAT <= repeat <= LONGEST_REPEAT:
            allowed = f"between {SHORTEST_REPEAT:g} s and {LONGEST_REPEAT:g} s"
            raise MotionError(f"{place}: repeat {repeat:g} s is not {allowed}. Check its unit.")
        fill(self, amplitudes=c, repeat=float(repeat), source=source, report=report, fine=fine)

    @property
    def duration(self) -> float:
        return self.repeat

    @property
    def omega(self) -> FloatArray:
        """Angular frequencies of the harmonics [rad/s], 0 first."""
        return np.asarray(2.0 * math.pi / self.repeat * np.arange(len(self.amplitudes)), dtype=np.float64)

    def deviation(self, order: int = 0) -> float:
        """Standard deviation over one period of height (0) [m], speed (1) [m/s] or acceleration (2) [m/s^2], exact."""
        return math.sqrt(float(np.sum(np.abs(self.amplitudes[1:]) ** 2 * self.omega[1:] ** (2 * order))) / 2.0)

    @cached_property
    def nodes(self) -> tuple[float, FloatArray, FloatArray, FloatArray]:
        """Spacing of the nodes h [s]; height s, and s' h and s'' h^2 at each (N,), all heights [m]."""
        n = _fast_length(len(self.amplitudes) * 2.0 * math.pi / self.fine)
        h = self.repeat / n
        iw = 1j * h * self.omega
        s, v, a = (synthesis(c, n) for c in (self.amplitudes, iw * self.amplitudes, iw**2 * self.amplitudes))
        return h, s, v, a

    def sample(self, t: ArrayLike) -> Sample:
        h, *nodes = self.nodes
        x = np.asarray(t, dtype=np.float64) / h
        node = np.floor(x)
        x = x - node
        i = node.astype(np.intp) % len(nodes[0])
        (s, v, a), (s_1, v_1, a_1) = (row[i] for row in nodes), (row[(i + 1) % len(row)] for row in nodes)
        d, e, f = s_1 - s - v - a / 2.0, v_1 - v - a, a_1 - a
        q2, q3, q4, q5 = a / 2.0, 10.0 * d - 4.0 * e + f / 2.0, -15.0 * d + 7.0 * e - f, 6.0 * d - 3.0 * e + f / 2.0
        height = s + x * (v + x * (q2 + x * (q3 + x * (q4 + x * q5))))
        speed = v + x * (2.0 * q2 + x * (3.0 * q3 + x * (4.0 * q4 + x * (5.0 * q5))))
        return height, speed / h, (2.0 * q2 + x * (6.0 * q3 + x * (12.0 * q4 + x * (20.0 * q5)))) / h**2

    def times(self, factor: float) -> IrregularTip:
        """The same motion with heights times a factor of 0 or more."""
        report = f"{self.report} Scaled by {factor:.6g}.".strip()
        return IrregularTip(self.amplitudes * factor, self.repeat, source=self.source, report=report, fine=self.fine)

    def describe(self) -> str:
        origin, sigma = f" in {self.source}" if self.source else "", f"{self.deviation():.3g} m"
        return f"irregular motion{origin}: standard deviation {sigma}, repeats after {self.repeat:.6g} s"

    def to_dict(self) -> dict[str, Any]:
        """Amplitudes as base64 of zlib of little-endian float64, exact to the bit: some 16 to 20 bytes a harmonic."""
        words = {"type": self.kind, "source": self.source, "report": self.report, "repeat": self.repeat}
        coarser = {} if self.fine == FINE else {"fine": self.fine}
        columns = {"re": encode_array(self.amplitudes.real), "im": encode_array(self.amplitudes.imag)}
        return {**words, **coarser, **columns}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The motion that `to_dict` stored."""
        try:
            re, im = decode_array(data["re"]), decode_array(data["im"])
            words = {name: str(data.get(name, "")) for name in ("source", "report")}
            return cls(re + 1j * im, float(data["repeat"]), **words, fine=float(data.get("fine", FINE)))
        except (KeyError, TypeError, AttributeError, ValueError, binascii.Error, zlib.error) as problem:
            raise MotionError(
                f"stored motion: {type(problem).__name__}: amplitudes are not what a run stores. Generate it again."
            ) from problem


def synthesis(c: ComplexArray, n: int) -> FloatArray:
    """Re sum c_k exp(2 pi i k j/n) at j = 0 .. n - 1, along the last axis; n over twice the number of harmonics."""
    half = 0.5 * n * c
    half[..., 0] = n * c[..., 0].real
    return np.fft.irfft(half, n)


def _fast_length(least: float) -> int:
    """A number of samples not below this whose FFT is fast: 4, 5, 6, 7 or 8 times a power of two."""
    power = 1 << max(0, math.floor(math.log2(least)) - 2)
    return power * math.ceil(least / power)
