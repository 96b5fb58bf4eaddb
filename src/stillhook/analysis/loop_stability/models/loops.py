"""The position loop, cut at its gain, as state space: in continuous time, and as a PLC samples it, exactly and with any
delay.

A loop is the path between the feedback's share of the pump command and the wire hoisted, at K_p = 1 1/m.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import expm, matrix_balance

from stillhook.analysis.loop_stability.models.transfer import loop_matrices
from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import StillhookError
from stillhook.spec.crane import Crane

Transfer = Callable[[ComplexArray], ComplexArray]

CYCLE_ROUNDING = 1e-9
"""Part of a cycle below which a delay is a whole number of cycles: rounding of texts and sums."""
PARALLEL = 1e5
"""Condition of the eigenvectors up to which residues are used: loss of digits, at most five of sixteen."""


@dataclass(frozen=True)
class ContinuousLoop:
    """State space of the loop at K_p = 1, input pump command, output wire hoisted [m]; delay [s] anywhere in the
    loop."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    delay: float = 0.0

    @property
    def nyquist(self) -> float:
        """Highest frequency at which the loop acts [rad/s]: no end."""
        return math.inf

    def modes(self) -> ComplexArray:
        """Open-loop poles [1/s]."""
        return np.linalg.eigvals(self.A).astype(np.complex128)

    def response(self, omega: FloatArray) -> ComplexArray:
        """L(i omega) at K_p = 1; omega [rad/s]."""
        s = np.asarray(1j * omega, dtype=np.complex128)
        return np.asarray(self._transfer(s) * np.exp(-s * self.delay), dtype=np.complex128)

    @cached_property
    def _transfer(self) -> Transfer:
        return _transfer(self.A, self.B, self.C)

    def closed_poles(self, K_p: float) -> ComplexArray:
        """Poles of the closed loop [1/s]. Errors: StillhookError with a delay, which gives infinitely many."""
        if self.delay > 0.0:
            raise StillhookError(
                f"delay {self.delay:g} s: a continuous loop with delay has infinitely many poles. Sample it first."
            )
        return np.linalg.eigvals(self.A - K_p * np.outer(self.B, self.C)).astype(np.complex128)


@dataclass(frozen=True)
class SampledLoop:
    """The loop as the PLC sees it at its cycles of t_cycle [s]: x' = Phi x + Gamma_0 u(k - n) + Gamma_1 u(k - n - 1),
    output C x [m]."""

    Phi: FloatArray
    Gamma_0: FloatArray
    Gamma_1: FloatArray
    C: FloatArray
    t_cycle: float
    n: int = 0

    @property
    def nyquist(self) -> float:
        """Half the sampling frequency [rad/s]."""
        return math.pi / self.t_cycle

    def modes(self) -> ComplexArray:
        """Open-loop poles as those of the continuous loop that they come from [1/s]; poles at z = 0 are left out."""
        z = np.linalg.eigvals(self.Phi).astype(np.complex128)
        return np.asarray(np.log(z[np.abs(z) > 1e-12]) / self.t_cycle, dtype=np.complex128)

    def response(self, omega: FloatArray) -> ComplexArray:
        """L(e^{i omega t_cycle}) at K_p = 1; omega up to the Nyquist frequency [rad/s]."""
        z = np.asarray(np.exp(1j * omega * self.t_cycle), dtype=np.complex128)
        now, before = self._transfers
        total = now(z) + before(z) / z if before is not None else now(z)
        return np.asarray(total * z ** (-self.n), dtype=np.complex128)

    @cached_property
    def _transfers(self) -> tuple[Transfer, Transfer | None]:
        before = _transfer(self.Phi, self.Gamma_1, self.C) if np.any(self.Gamma_1) else None
        return _transfer(self.Phi, self.Gamma_0, self.C), before

    def closed_matrix(self, K_p: float) -> FloatArray:
        """Matrix of one cycle of the closed loop: state, then the commands still on their way, newest first."""
        held = self.n + (1 if np.any(self.Gamma_1) else 0)
        size = len(self.Phi)
        M = np.zeros((size + held, size + held))
        M[:size, :size] = self.Phi
        u = np.zeros(size + held)
        u[:size] = -K_p * self.C
        for past, gamma in ((self.n, self.Gamma_0), (self.n + 1, self.Gamma_1)):
            if past == 0:
                M[:size] += np.outer(gamma, u)
            elif past <= held:
                M[:size, size + past - 1] += gamma
        if held:
            M[size] = u
            M[size + 1 :, size:-1] = np.eye(held - 1)
        return M

    def closed_poles(self, K_p: float) -> ComplexArray:
        """Poles of the closed loop in the z-plane: stable within the unit circle."""
        return np.linalg.eigvals(self.closed_matrix(K_p)).astype(np.complex128)


Loop = ContinuousLoop | SampledLoop


def position_loop(crane: Crane, alpha_m: float = 1.0, *, K_wire: float = 1.0) -> ContinuousLoop:
    """The published position loop, without PLC and delay (Moslatt 2020 paper E eqs 14 to 20); see
    `stillhook.analysis.loop_stability.models.transfer`."""
    return balanced(*loop_matrices(crane, alpha_m, K_wire=K_wire))


def balanced(A: FloatArray, B: FloatArray, C: FloatArray, delay: float = 0.0) -> ContinuousLoop:
    """The loop in states of like size (pascals and radians side by side cost digits)."""
    scaled, (scale, _) = matrix_balance(A, permute=False, separate=True)
    return ContinuousLoop(scaled, B / scale, C * scale, delay)


def sampled(loop: ContinuousLoop, t_cycle: float, delay: float = 0.0) -> SampledLoop:
    """The loop as a PLC of cycle t_cycle [s] closes it: commands held for a cycle, everything else exact; delay [s]
    adds to the loop's own.

    The delay is that of the complete path around the loop: encoder, bus, computing. It need not be a whole number of
    cycles.
    Source: Astrom and Wittenmark, Computer-Controlled Systems, section 2.3 (sampling of systems with time delay).
    """
    n, rest = full_cycles(delay + loop.delay, t_cycle)
    Phi, hold = hold_matrices(loop.A, loop.B[:, None], t_cycle)
    if rest == 0.0:
        return SampledLoop(Phi, hold[:, 0], np.zeros(len(Phi)), loop.C, t_cycle, n)
    _, early = hold_matrices(loop.A, loop.B[:, None], t_cycle - rest)
    return SampledLoop(Phi, early[:, 0], hold[:, 0] - early[:, 0], loop.C, t_cycle, n)


def full_cycles(delay: float, t_cycle: float) -> tuple[int, float]:
    """Whole cycles in a delayand the remainder [s]; a remainder from rounding counts as zero."""
    n = math.floor(delay / t_cycle + CYCLE_ROUNDING)
    rest = delay - n * t_cycle
    return n, rest if rest > CYCLE_ROUNDING * t_cycle else 0.0


def hold_matrices(A: FloatArray, B: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
    """e^{A t} and what a command held for t [s] adds, exactly (one matrix exponential of both)."""
    size, inputs = B.shape
    both = np.zeros((size + inputs, size + inputs))
    both[:size, :size], both[:size, size:] = A, B
    E = expm(both * t)
    return E[:size, :size], E[:size, size:]


def _transfer(A: FloatArray, B: FloatArray, C: FloatArray) -> Transfer:
    """C (s - A)^-1 B as a function of s: by poles and residues, or by solving where the eigenvectors are nearly
    parallel."""
    poles, right = np.linalg.eig(A)
    if np.linalg.cond(right) < PARALLEL:
        residues = (C @ right) * np.linalg.solve(right, B.astype(np.complex128))
        return lambda s: np.asarray((residues / (s[:, None] - poles)).sum(axis=1), dtype=np.complex128)

    def solved(s: ComplexArray) -> ComplexArray:
        M = s[:, None, None] * np.eye(len(A)) - A
        x = np.linalg.solve(M, np.broadcast_to(B.astype(np.complex128)[:, None], (len(s), len(A), 1)))
        return np.asarray((C @ x[:, :, 0].T), dtype=np.complex128)

    return solved
