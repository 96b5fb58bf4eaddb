"""The remnant of a winch from its twin: irregular motions of several periods and sizes, sixteen side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.run import Result
from stillhook.errors import LiftError
from stillhook.response.winch.describing_function import Residual
from stillhook.response.winch.duty import Duty, run_twin, soft, spectra
from stillhook.response.winch.excitation import SETTLED, Irregular
from stillhook.response.winch.remnant import Remnant
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode

SPACING = 0.1
"""Spacing of the series [s]; nothing moves faster than 8 rad/s."""
LOW, HIGH, BANDS = 0.01, 8.0, 18
"""Bands in which the density is taken [rad/s], even in their logarithm."""
FLOOR = 1e-3
"""Least part of a band's power that is remnant: the residue of the estimate of a coherent motion is no better known."""


class Run(NamedTuple):
    """An irregular motion of the tip, and the run of the winch under it on a wire at constant tension."""

    motion: Irregular
    result: Result


def irregular_runs(
    crane: Crane,
    duty: Duty,
    mode: Mode,
    motions: Sequence[Irregular],
    *,
    threads: int = 2,
    progress: Progress | None = None,
) -> list[Run]:
    """The twin under irregular motions of the tip; deviations from the one at which the twin first diverges are left
    out.
    Errors: LiftError where it diverges in the smallest one."""
    cases = [duty.scenario(crane, mode, motion.tip, SETTLED, motion.tip.repeat) for motion in motions]
    results = run_twin(soft(crane, duty), cases, SPACING, threads=threads, progress=progress)
    runs = [Run(motion, result) for motion, result in zip(motions, results, strict=True)]
    end = min((run.motion.sigma_v for run in runs if run.result.ending is not Ending.DONE), default=math.inf)
    if not (kept := [run for run in runs if run.motion.sigma_v < end]):
        raise LiftError(f"residual: {duty.about(crane, mode)}: the twin diverged under the smallest irregular motion.")
    return kept


def identify_remnant(runs: Sequence[Run], sines: Residual) -> Remnant:
    """Remnant and gain that complement the describing function of sines.

    The density is right to about a third in the lowest bands and a tenth in the others (one run of twenty minutes each;
    its random phases are the same every time), its sum over all to a tenth.
    """
    T_z, sigma_v = (sorted({getattr(run.motion, name) for run in runs}) for name in ("T_z", "sigma_v"))
    edges = np.geomspace(LOW, HIGH, BANDS + 1)
    S = np.zeros((len(T_z), len(sigma_v), BANDS))
    gain, peak = np.zeros(len(sigma_v), dtype=complex), np.zeros((len(T_z), len(sigma_v)))
    for k, sigma in enumerate(sigma_v):
        spectra_of_runs = [_Spectra(run, sines) for run in runs if run.motion.sigma_v == sigma]
        gain[k] = _gain(spectra_of_runs)
        S[:, k] = [each.remnant(complex(gain[k]), edges) for each in spectra_of_runs]
        peak[:, k] = [each.peak for each in spectra_of_runs]
    lasts = runs[0].motion.tip.repeat - SETTLED
    return Remnant(np.array(T_z), np.array(sigma_v), np.sqrt(edges[1:] * edges[:-1]), S, gain, peak, lasts)


class _Spectra:
    """Of one run: power of tip and wire end and their cross power by frequency, and C of sines there; powers in m^2."""

    def __init__(self, run: Run, sines: Residual) -> None:
        self.omega, (e, z) = spectra(run.result, ("e_c", "s_tip"), SETTLED)
        self.wire, self.tip = np.abs(e) ** 2, np.abs(z) ** 2
        self.C = sines.gaussian(self.omega, run.motion.sigma_v)
        self.peak = run.result.span[0] / math.sqrt(float(np.sum(self.wire)))
        self.cross: ComplexArray = e * np.conj(z) * np.conj(self.C)

    def remnant(self, gain: complex, edges: FloatArray) -> FloatArray:
        """Density in bands of what does not follow the tip [m^2 s/rad]."""
        rest = self.wire - np.abs(gain * self.C) ** 2 * self.tip
        total, _ = np.histogram(self.omega, edges, weights=self.wire)
        left, _ = np.histogram(self.omega, edges, weights=rest)
        density = np.maximum(left, FLOOR * np.maximum(total, 1e-30)) / np.diff(edges)
        held = np.flatnonzero(
            np.histogram(self.omega, edges)[0]
        )  # a short run may have no frequency in the lowest bands
        return np.asarray(density[held[np.minimum(np.searchsorted(held, np.arange(len(density))), len(held) - 1)]])


def _gain(runs: Sequence[_Spectra]) -> complex:
    """Factor on C with which it explains most of some motions, each counted alike."""
    above = [r.cross.sum() / np.sum(np.abs(r.C) ** 2 * r.tip) for r in runs]
    return complex(np.mean(above))
