"""A linearised plant closed by the PLC's cycle: commands held for a cycle, each a computing time late."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.transfer import SampledLoop, full_cycles, hold_matrices
from stillhook.base.arrays import FloatArray


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
    computing: float,
    delay: float = 0.0,
) -> SampledLoop:
    """The position loop at K_p = 1 with all other loops of the PLC closed, sampled exactly.

    Parameters: plant A (n, n), B (n, m) by all commands, C (n,) the wire hoisted; cycle; t_cycle, computing time and
    delay of the position feedback [s].

    All commands of a cycle take effect a computing time after it, those of the load cell, of measured pressures and of
    the displacement as well as the position feedback's; `delay` is of the latter alone. What the feedback does to a
    controller's memory comes a computing time late too, at most a cycle, which takes margin and gives none.
    Source: Astrom and Wittenmark, Computer-Controlled Systems, section 2.3 (sampling of systems with time delay).
    """
    (A, B, C), (K, M, g, h) = plant, cycle
    size, carried, commands = len(A), len(M), B.shape[1]
    n_own, own_late, own_early = _held(A, B, t_cycle, computing)
    n, by_late, by_early = _held(A, (B @ g)[:, None], t_cycle, delay + computing)
    history = n_own + (1 if np.any(own_early) else 0)
    total = size + carried + history * commands
    Phi = np.zeros((total, total))
    Phi[:size, :size] = hold_matrices(A, B, t_cycle)[0]
    Phi[size : size + carried, : size + carried] = M
    for past, gamma in ((n_own, own_late), (n_own + 1, own_early)):
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
    late, early = (np.concatenate([by[:, 0], pad]) for by in (by_late, by_early))
    remembers = bool(np.any(h))
    if remembers:
        part = full_cycles(delay + computing, t_cycle)[1] / t_cycle
        late[size : size + carried] += (1.0 - part) * h
        early[size : size + carried] += part * h
    states = (size, size + carried) if remembers else None
    return SampledLoop(Phi, late, early, np.concatenate([C, pad]), t_cycle, n, states)


def _held(A: FloatArray, B: FloatArray, t_cycle: float, delay: float) -> tuple[int, FloatArray, FloatArray]:
    """Whole cycles of a delay, and what a command adds in the cycle in which it comes into effect and in the next."""
    n, rest = full_cycles(delay, t_cycle)
    hold = hold_matrices(A, B, t_cycle)[1]
    if rest == 0.0:
        return n, hold, np.zeros_like(hold)
    first = hold_matrices(A, B, t_cycle - rest)[1]
    return n, first, hold - first


__all__ = ["Cycle", "closed_by_plc"]
