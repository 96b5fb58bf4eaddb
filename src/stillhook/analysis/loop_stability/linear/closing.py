"""A linearised plant closed by the PLC's cycle: commands held for a cycle, each a computing time late."""

from __future__ import annotations

import numpy as np

from stillhook.analysis.loop_stability.transfer import SampledLoop, full_cycles, hold_matrices
from stillhook.base.arrays import FloatArray


def closed_by_plc(
    plant: tuple[FloatArray, FloatArray, FloatArray],
    cycle: tuple[FloatArray, FloatArray, FloatArray],
    *,
    t_cycle: float,
    computing: float,
    delay: float = 0.0,
) -> SampledLoop:
    """The position loop at K_p = 1 with all other loops of the PLC closed, sampled exactly.

    Parameters: plant A (n, n), B (n, m) by all commands, C (n,) the wire hoisted; cycle K (m, n + r) and M (r, n + r),
    commands and what the PLC carries on by state and what was carried, and g (m,), the commands by the position
    feedback's share; t_cycle, computing time and delay of the position feedback [s].

    All commands of a cycle take effect a computing time after it, those of the load cell, of measured pressures and of
    the displacement as well as the position feedback's; `delay` is of the latter alone.
    Source: Astrom and Wittenmark, Computer-Controlled Systems, section 2.3 (sampling of systems with time delay).
    """
    (A, B, C), (K, M, g) = plant, cycle
    size, carried, commands = len(A), len(M), B.shape[1]
    n_own, late, early = _held(A, B, t_cycle, computing)
    n, by_late, by_early = _held(A, (B @ g)[:, None], t_cycle, delay + computing)
    history = n_own + (1 if np.any(early) else 0)
    total = size + carried + history * commands
    Phi = np.zeros((total, total))
    Phi[:size, :size] = hold_matrices(A, B, t_cycle)[0]
    Phi[size : size + carried, : size + carried] = M
    for past, gamma in ((n_own, late), (n_own + 1, early)):
        if past == 0:
            Phi[:size, : size + carried] += gamma @ K
        elif past <= history:
            at = size + carried + (past - 1) * commands
            Phi[:size, at : at + commands] += gamma
    if history:
        at = size + carried
        Phi[at : at + commands, : size + carried] = K
        Phi[at + commands :, at : total - commands] = np.eye((history - 1) * commands)
    pad = np.zeros(total - size)
    return SampledLoop(
        Phi,
        np.concatenate([by_late[:, 0], pad]),
        np.concatenate([by_early[:, 0], pad]),
        np.concatenate([C, pad]),
        t_cycle,
        n,
    )


def _held(A: FloatArray, B: FloatArray, t_cycle: float, delay: float) -> tuple[int, FloatArray, FloatArray]:
    """Whole cycles of a delay, and what a command adds in the cycle in which it comes into effect and in the next."""
    n, rest = full_cycles(delay, t_cycle)
    hold = hold_matrices(A, B, t_cycle)[1]
    if rest == 0.0:
        return n, hold, np.zeros_like(hold)
    first = hold_matrices(A, B, t_cycle - rest)[1]
    return n, first, hold - first


__all__ = ["closed_by_plc"]
