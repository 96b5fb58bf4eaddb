"""The compliance of a winch from its twin: the same irregular motions of the tip on a soft and on a stiff wire."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stillhook.base.arrays import ComplexArray
from stillhook.base.progress import Progress
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.run import Result
from stillhook.errors import LiftError
from stillhook.response.winch.compliance import WinchCompliance
from stillhook.response.winch.duty import Duty, run_twin, spectra
from stillhook.response.winch.excitation import SETTLED
from stillhook.response.winch.identify.remnant import SPACING, Run
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode

EDGES = np.geomspace(0.2, 8.0, 11)
"""Bands in which the compliance is taken [rad/s]."""
STRETCH, ZETA, SLOW = 0.2, 0.1, 0.1
"""Of the stiff wire: stretch under the mean tension [m], damping ratio, and natural frequency of the mass below it
[rad/s], so low that the mass is at rest while the wire stretches."""
SATURATED = 0.02
"""Share of the time at the pumps' stop above which a run contains no information on small changes."""


def identify_compliance(
    crane: Crane, duty: Duty, mode: Mode, runs: Sequence[Run], *, threads: int = 2, progress: Progress | None = None
) -> WinchCompliance:
    """Y from the cross spectrum of u_soft - u_stiff with F_stiff: the tension is the only difference between two such
    runs.

    runs: motions of rising deviations and results of the winch under them on a soft wire. Sines are not suitable: a
    winch in steady oscillation sticks at other moments. Correct to a tenth or so (another stiffness gives the same).
    Deviations at which the pumps saturate, or the twin is lost, take the values of the last sound one. Errors:
    LiftError where there is no sound one.
    """
    k = duty.F / STRETCH
    stiff = duty.on_spring(crane, k, ZETA)
    cases = [duty.scenario(stiff, mode, run.motion.tip, SETTLED, run.motion.tip.repeat, k / SLOW**2) for run in runs]
    results = run_twin(stiff, cases, SPACING, threads=threads, progress=progress)
    rows: list[ComplexArray] = []
    for run, result in zip(runs, results, strict=True):
        if _sound(run.result) and _sound(result):
            rows.append(_compliance(run.result, result))
        elif rows:
            rows.append(rows[-1])
        else:
            raise LiftError(
                f"residual: {duty.about(crane, mode)}: the winch cannot follow a tip with {run.motion.sigma_v:g} m/s. "
                "Use another mode or load."
            )
    return WinchCompliance(
        np.sqrt(EDGES[1:] * EDGES[:-1]), np.array([run.motion.sigma_v for run in runs]), np.array(rows).T
    )


def _sound(result: Result) -> bool:
    st = result.stats.common
    return result.ending is Ending.DONE and st.slack_cycles == 0.0 and st.saturation_cycles < SATURATED * st.cycles


def _compliance(on_soft: Result, on_stiff: Result) -> ComplexArray:
    """Y in bands [m/N]."""
    omega, (u_a,) = spectra(on_soft, ("e_c",), SETTLED)
    _, (u_b, F) = spectra(on_stiff, ("e_c", "F_w"), SETTLED)
    cross = (u_a - u_b) * np.conj(F)
    parts = [np.histogram(omega, EDGES, weights=x)[0] for x in (cross.real, cross.imag, np.abs(F) ** 2)]
    return np.asarray((parts[0] + 1j * parts[1]) / parts[2])
