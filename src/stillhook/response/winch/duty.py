"""Duty of a winch while it compensates, and runs of its twin under motions of the tip."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.arguments import STATISTICS_STEP, steps_per_cycle
from stillhook.engine.scenario.run import Result, run_cases
from stillhook.errors import LiftError
from stillhook.kernels.lanes import VL
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Motion
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import RHO_SEA, Mode, Scenario, Sensors, Water
from stillhook.statistics.series import straightened
from stillhook.units import show


@dataclass(frozen=True)
class Duty:
    """F mean tension at the winch [N]; s_w wire paid out at rest [m], which sets the layer; sensors between winch and
    PLC."""

    F: float
    s_w: float
    sensors: Sensors = field(default_factory=Sensors)

    def on_spring(self, crane: Crane, k: float, zeta: float) -> Crane:
        """The crane with a wire of stiffness k [N/m] and damping ratio zeta: the change of tension is then
        known."""
        w = crane.wire
        EA = w.E * w.fill * math.pi / 4.0 * w.d**2
        return crane.model_copy(
            update={"wire": w.model_copy(update={"E": w.E * k * (w.L_0 + self.s_w) / EA, "zeta": zeta})}
        )

    def scenario(
        self, crane: Crane, mode: Mode, tip: Motion, settled: float, duration: float, more: float = 0.0
    ) -> Scenario:
        """The run of the twin under a motion of the tip; settled time that is not counted [s]; more mass that moves
        without weight [kg]. Tension beyond that of the hook is payload."""
        load = self.F / G - crane.hook_mass
        water = (
            Water.model_construct(volume=0.0, added_mass=more, C_D=0.0, area=0.0, rho=RHO_SEA) if more > 0.0 else None
        )
        return Scenario.model_construct(
            load=load,
            s_w=self.s_w,
            tip=tip,
            mode=mode,
            duration=duration,
            warm_up=settled,
            water=water,
            sensors=self.sensors,
        )

    def about(self, crane: Crane, mode: Mode) -> str:
        """Winch and duty in words."""
        return (
            f"{crane.name}, {mode.value}, {show(self.F, 'force')} at the winch, {show(self.s_w, 'length')} of wire out"
        )

    def check(self, crane: Crane) -> None:
        """Errors: LiftError where the hook alone pulls more than the mean tension."""
        if not self.F / G >= crane.hook_mass:
            F, hook = show(self.F, "force"), show(crane.hook_mass, "mass")
            raise LiftError(
                f"residual: a tension of {F} is less than the weight of the hook, {hook}. Enter the mean tension at the"
                " winch."
            )


STRETCH, DAMPED = 200.0, 0.95
"""Stretch of a wire so soft that the tension is constant [m]: half a metre of motion changes it by 0.25 %; its damping
ratio."""


def soft(crane: Crane, duty: Duty) -> Crane:
    """The crane on a wire so soft that the tension is constant."""
    return duty.on_spring(crane, duty.F / STRETCH, DAMPED)


def run_twin(
    crane: Crane, cases: Sequence[Scenario], spacing: float, *, threads: int = 2, progress: Progress | None = None
) -> list[Result]:
    """Runs with a series, sixteen side by side; spacing of the rows at most [s], in full PLC cycles."""
    rows = max(1, math.floor(spacing / crane.control.t_cycle + 1e-9))
    n_sub = steps_per_cycle(crane, None, STATISTICS_STEP)
    return run_cases(crane, cases, n_sub=n_sub, lanes=VL, every=rows, threads=threads, progress=progress)


def fitted(result: Result, names: Sequence[str], omega: FloatArray, last: float) -> ComplexArray:
    """Complex amplitudes of some signals at frequencies omega (m,) [rad/s] over the last seconds of a run, in addition
    to a mean and a drift: least squares; shape (m, len(names)), time counted from the start of these seconds."""
    assert result.series is not None
    rows = result.series[-math.floor(last / result.dt) - 1 :, [result.signals.index(name) for name in names]]
    t = result.dt * np.arange(len(rows))
    angles = np.outer(t, omega)
    columns = np.concatenate((np.ones((len(t), 1)), t[:, None] / t[-1] - 0.5, np.cos(angles), -np.sin(angles)), axis=1)
    x = np.linalg.solve(np.einsum("ti,tj->ij", columns, columns), np.einsum("ti,tj->ij", columns, rows))[2:]
    return np.asarray(x[: len(omega)] + 1j * x[len(omega) :])


def spectra(result: Result, names: Sequence[str], settled: float) -> tuple[FloatArray, list[ComplexArray]]:
    """Frequencies [rad/s] and complex spectra of some signals of a settled run, a Hann window over it and its drift
    taken off; scaled so that squared sizes add up to the variance."""
    assert result.series is not None
    rows = result.series[round(settled / result.dt) :]
    window = np.hanning(len(rows))
    scale = math.sqrt(2.0 / (len(rows) * float(np.sum(window**2))))
    transforms = []
    for name in names:
        y = straightened(rows[:, result.signals.index(name)])
        transforms.append(np.asarray(scale * np.fft.rfft(window * y)[1:], dtype=np.complex128))
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(rows), result.dt)[1:]
    return np.asarray(omega, dtype=np.float64), transforms
