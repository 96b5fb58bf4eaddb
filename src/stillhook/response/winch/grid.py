"""Residuals of a winch over tension and length of wire, so that a lowering or a table of loads requires few runs of the
twin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from stillhook.base.progress import Progress
from stillhook.control.registry import DEFAULT_MODE
from stillhook.errors import LiftError
from stillhook.response.winch.duty import Duty
from stillhook.response.winch.identify import identify_residual
from stillhook.response.winch.linear_form import Remnant, Residual, WinchCompliance
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Sensors
from stillhook.units import show


@dataclass(frozen=True, eq=False)
class ResidualGrid:
    """Residuals at tensions F (m,) [N] and lengths of wire s_w (k,) [m], both ascending, of one winch in one mode;
    tables[i][j]."""

    F: tuple[float, ...]
    s_w: tuple[float, ...]
    tables: tuple[tuple[Residual, ...], ...] = field(repr=False)

    def at(self, F: float, s_w: float) -> Residual:
        """The residual at a tension [N] and a length [m] within the grid: its four neighbours mixed, densities in their
        logarithms.

        Errors: LiftError outside the grid.
        """
        for name, value, knots, kind in (("tension", F, self.F, "force"), ("wire", s_w, self.s_w, "length")):
            if not knots[0] <= value <= knots[-1]:
                raise LiftError(
                    f"residual grid: {name} {show(value, kind)} is outside {show(knots[0], kind)} to"
                    f" {show(knots[-1], kind)}. Identify a wider grid."
                )
        i, f = _between(self.F, F)
        j, g = _between(self.s_w, s_w)
        j_1 = min(j + 1, len(self.s_w) - 1)
        low, high = (mixed(row[j], row[j_1], g) for row in (self.tables[i], self.tables[min(i + 1, len(self.F) - 1)]))
        return mixed(low, high, f)


def identify_grid(
    crane: Crane,
    F: Sequence[float],
    s_w: Sequence[float],
    mode: Mode | str = DEFAULT_MODE,
    *,
    sensors: Sensors | None = None,
    threads: int = 2,
    cache: bool = True,
    progress: Progress | None = None,
) -> ResidualGrid:
    """Residuals at every tension F [N] and length s_w [m], both ascending; see `identify_residual` for errors and cost
    of each."""
    for name, values in (("F", F), ("s_w", s_w)):
        if not len(values) or any(b <= a for a, b in pairwise(values)):
            raise LiftError(f"residual grid: {name} must hold one value or more, ascending. Sort them.")
    sensed = sensors or Sensors()

    def identify(force: float, length: float) -> Residual:
        return identify_residual(
            crane, Duty(force, length, sensed), mode, threads=threads, cache=cache, progress=progress
        )

    return ResidualGrid(tuple(F), tuple(s_w), tuple(tuple(identify(force, length) for length in s_w) for force in F))


def _between(knots: Sequence[float], x: float) -> tuple[int, float]:
    """Lower neighbour and share of the upper one."""
    i = int(np.clip(np.searchsorted(knots, x, side="right") - 1, 0, max(len(knots) - 2, 0)))
    return i, 0.0 if len(knots) == 1 else (x - knots[i]) / (knots[i + 1] - knots[i])


def mixed(a: Residual, b: Residual, share: float) -> Residual:
    """Two residuals on the same frequencies and amplitudes as one, `share` of the second."""
    if share == 0.0:
        return a
    if share == 1.0:
        return b
    if a.remnant is None or b.remnant is None or a.compliance is None or b.compliance is None:
        raise LiftError("residual grid: a residual has no remnant or compliance. Identify all of them on the twin.")
    m, n = a.remnant, b.remnant
    kept = min(len(m.sigma_v), len(n.sigma_v))  # the twin may be lost earlier under one load
    S = np.exp((1.0 - share) * np.log(m.S[:, :kept]) + share * np.log(n.S[:, :kept]))
    peak = None if m.peak is None or n.peak is None else (1.0 - share) * m.peak[:, :kept] + share * n.peak[:, :kept]
    gain = (1.0 - share) * m.gain[:kept] + share * n.gain[:kept]
    remnant = Remnant(m.T_z, m.sigma_v[:kept], m.omega, S, gain, peak, m.lasts)
    Y = (1.0 - share) * a.compliance.Y[:, :kept] + share * b.compliance.Y[:, :kept]
    known = [name for name in ("relieved", "p_a") if getattr(a, name) is not None and getattr(b, name) is not None]
    tables = {
        name: (1.0 - share) * getattr(a, name) + share * getattr(b, name)
        for name in ("C", "harmonics", "saturated", *known)
    }
    about = f"between {a.about} and {b.about}"
    return replace(
        a,
        **tables,
        about=about,
        remnant=remnant,
        compliance=WinchCompliance(a.compliance.omega, a.compliance.sigma_v[:kept], Y),
    )
