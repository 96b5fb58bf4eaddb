"""The position loop, cut at its gain, as state space: in continuous time, and as a PLC samples it, exactly and with any
delay, alone or with the PLC's other loops closed.

A loop is the path between the feedback's share of the pump command and the wire hoisted, at K_p = 1 1/m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import StillhookError

Transfer = Callable[[ComplexArray], ComplexArray]

CYCLE_ROUNDING = 1e-9
"""Part of a cycle below which a delay is a whole number of cycles: rounding of texts and sums."""
PARALLEL = 1e5
"""Condition of the eigenvectors up to which residues are used: loss of digits, at most five of sixteen."""


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class SampledLoop:
    """The loop as the PLC samples it at its cycles of t_cycle [s]: x' = Phi x + Gamma_0 u(k - n) + Gamma_1 u(k - n -
    1), output C x [m]. remembered: states of Phi, from and to, in which a controller remembers the feedback, as in an
    integral part; None where it remembers none of it."""

    Phi: FloatArray
    Gamma_0: FloatArray
    Gamma_1: FloatArray
    C: FloatArray
    t_cycle: float
    n: int = 0
    remembered: tuple[int, int] | None = None

    @cached_property
    def proportional(self) -> SampledLoop:
        """The loop without what the controller remembers of the feedback."""
        if self.remembered is None:
            return self
        forgets = np.ones(len(self.Phi))
        forgets[slice(*self.remembered)] = 0.0
        return replace(self, Gamma_0=self.Gamma_0 * forgets, Gamma_1=self.Gamma_1 * forgets, remembered=None)

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


def balanced(A: FloatArray, B: FloatArray, C: FloatArray, delay: float = 0.0) -> ContinuousLoop:
    """The loop in states of like size (pascals and radians side by side cost digits)."""
    scaled, (scale, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    return ContinuousLoop(scaled, B / scale, C * scale, delay)


def sampled(loop: ContinuousLoop, t_cycle: float, delay: float = 0.0) -> SampledLoop:
    """The loop as a PLC of cycle t_cycle [s] closes it: commands held for a cycle, everything else exact; delay [s]
    adds to the loop's own.

    The delay is that of the complete path around the loop: encoder, bus, computing. It need not be a whole number of
    cycles.
    Source: Astrom and Wittenmark, Computer-Controlled Systems, section 2.3 (sampling of systems with time delay).
    """
    B = loop.B[:, None]
    n, late, early = held(loop.A, B, t_cycle, delay + loop.delay)
    return SampledLoop(hold_matrices(loop.A, B, t_cycle)[0], late[:, 0], early[:, 0], loop.C, t_cycle, n)


def full_cycles(delay: float, t_cycle: float) -> tuple[int, float]:
    """Whole cycles in a delay, and the remainder [s]; a remainder from rounding counts as zero."""
    n = math.floor(delay / t_cycle + CYCLE_ROUNDING)
    rest = delay - n * t_cycle
    return n, rest if rest > CYCLE_ROUNDING * t_cycle else 0.0


def hold_matrices(A: FloatArray, B: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
    """e^{A t} and what a command held for t [s] adds, exactly (one matrix exponential of both)."""
    size, inputs = B.shape
    both = np.zeros((size + inputs, size + inputs))
    both[:size, :size], both[:size, size:] = A, B
    E = scipy.linalg.expm(both * t)
    return E[:size, :size], E[:size, size:]


def held(A: FloatArray, B: FloatArray, t_cycle: float, delay: float) -> tuple[int, FloatArray, FloatArray]:
    """Whole cycles of a delay, and what a command adds in the cycle in which it comes into effect and in the next."""
    n, rest = full_cycles(delay, t_cycle)
    hold = hold_matrices(A, B, t_cycle)[1]
    if rest == 0.0:
        return n, hold, np.zeros_like(hold)
    first = hold_matrices(A, B, t_cycle - rest)[1]
    return n, first, hold - first


def _transfer(A: FloatArray, B: FloatArray, C: FloatArray) -> Transfer:
    """C (s - A)^-1 B as a function of s: by poles and residues, or where the eigenvectors are nearly parallel (a chain
    of held commands) by back substitution in the Schur form, all frequencies at once."""
    poles, right = np.linalg.eig(A)
    if np.linalg.cond(right) < PARALLEL:
        residues = (C @ right) * np.linalg.solve(right, B.astype(np.complex128))
        return lambda s: np.asarray((residues / (s[:, None] - poles)).sum(axis=1), dtype=np.complex128)
    even, (scale, _) = scipy.linalg.matrix_balance(
        A, permute=False, separate=True
    )  # pascals beside radians cost digits
    T, Q = scipy.linalg.schur(even.astype(np.complex128), output="complex")
    b, c, unit = Q.conj().T @ (B / scale), (C * scale) @ Q, np.eye(len(B))

    def solved(s: ComplexArray) -> ComplexArray:
        if len(s) == 1:
            x, _ = scipy.linalg.lapack.ztrtrs(s[0] * unit - T, b)
            return np.asarray([c @ x], dtype=np.complex128)
        x = np.zeros((len(b), len(s)), dtype=np.complex128)
        for i in range(len(b) - 1, -1, -1):
            x[i] = (b[i] + T[i, i + 1 :] @ x[i + 1 :]) / (s - T[i, i])
        return np.asarray(c @ x, dtype=np.complex128)

    return solved


class Cycle(NamedTuple):
    """A cycle of the PLC about a point: commands (m) and what it carries on (r), by state and what was carried (n + r),
    and by the position feedback's share of the speed command."""

    commands: FloatArray
    carried: FloatArray
    commands_by_feedback: FloatArray
    carried_by_feedback: FloatArray


def closed_by_plc(
    plant: tuple[FloatArray, FloatArray, FloatArray],
    cycle: Cycle,
    *,
    t_cycle: float,
    late: FloatArray,
    delay: float = 0.0,
) -> SampledLoop:
    """The position loop at K_p = 1 with all other loops of the PLC closed, sampled exactly.

    Parameters: plant A (n, n), B (n, m) by all commands, C (n,) the wire hoisted; cycle; t_cycle; late (m,) time after
    which each command acts, computing and dead time of its displacement control; delay of the position feedback [s].

    A command acts as late whether it follows from the load cell, measured pressures, the displacement or the position
    feedback; `delay` is of the latter alone. What the feedback does to a controller's memory comes as late as the
    quickest command, at most a cycle more, which takes margin and gives none.
    Source: Astrom and Wittenmark, Computer-Controlled Systems, section 2.3 (sampling of systems with time delay).
    """
    (A, B, C), (K, M, g, h) = plant, cycle
    size, carried, commands = len(A), len(M), B.shape[1]
    times, remembers = sorted(set(late.tolist())), bool(np.any(h))
    each = {time: B * (late == time) for time in times}
    own = _by_cycle((held(A, B_late, t_cycle, time) for time, B_late in each.items()))
    fed = _by_cycle(held(A, (B_late @ g)[:, None], t_cycle, delay + time) for time, B_late in each.items())
    n, part = full_cycles(delay + times[0], t_cycle)
    acts = [past for past, gamma in fed.items() if np.any(gamma)]
    n = n if remembers or not acts else min(acts)
    history = max((past for past, gamma in own.items() if np.any(gamma)), default=0)
    chain = max(max(acts, default=n) - n, 1) - 1  # feedback that acts later than in the next cycle is kept
    total = size + carried + history * commands + (chain + 1 if chain else 0)
    Phi, by = np.zeros((total, total)), np.zeros((2, total))
    Phi[:size, :size] = hold_matrices(A, B, t_cycle)[0]
    Phi[size : size + carried, : size + carried] = M
    for past, gamma in own.items():
        if past == 0:
            Phi[:size, : size + carried] += gamma @ K
        elif past <= history:
            at = size + carried + (past - 1) * commands
            Phi[:size, at : at + commands] += gamma
    if history:
        at, end = size + carried, size + carried + history * commands
        Phi[at : at + commands, : size + carried] = K
        Phi[at + commands : end, at : end - commands] = np.eye((history - 1) * commands)
    for past in acts:
        if past <= n + 1:
            by[past - n, :size] += fed[past][:, 0]
        else:
            Phi[:size, total - chain - 2 + past - n] += fed[past][:, 0]
    if chain:
        by[0, total - chain - 1] = 1.0
        Phi[total - chain :, total - chain - 1 : total - 1] = np.eye(chain)
    if remembers:
        by[:, size : size + carried] += np.outer([1.0 - part / t_cycle, part / t_cycle], h)
    states = (size, size + carried) if remembers else None
    return SampledLoop(Phi, by[0], by[1], np.concatenate([C, np.zeros(total - size)]), t_cycle, n, states)


def _by_cycle(parts: Iterable[tuple[int, FloatArray, FloatArray]]) -> dict[int, FloatArray]:
    """What commands add together, by the cycles since they were calculated."""
    out: dict[int, FloatArray] = {}
    for n, first, next_ in parts:
        for past, gamma in ((n, first), (n + 1, next_)):
            out[past] = out[past] + gamma if past in out else gamma
    return out
