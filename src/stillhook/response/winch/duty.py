"""Duty of a winch while it compensates, and runs of its twin under motions of the tip.

Excitation of the twin of a winch for its residual: sines and irregular motions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.arguments import STATISTICS_STEP, steps_of_cases
from stillhook.engine.pack.shaft import wire_EA
from stillhook.engine.pack.winch import set_up_for
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import LiftError
from stillhook.kernels.lanes import VL
from stillhook.physics.scalar import G
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import Motion
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import RHO_SEA, Mode, Scenario, Sensors, Water
from stillhook.statistics.time_lag import straightened
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
        known. Its PLC knows the wire that it has."""
        w = crane.wire
        on_spring = w.model_copy(update={"E": w.E * k * (w.L_0 + self.s_w) / wire_EA(w), "zeta": zeta})
        return set_up_for(crane.model_copy(update={"wire": on_spring}), crane)

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
) -> list[ScenarioRun]:
    """Runs with a series, sixteen side by side; spacing of the rows at most [s], in full PLC cycles."""
    rows = max(1, math.floor(spacing / crane.control.t_cycle + 1e-9))
    n_sub = steps_of_cases(crane, cases, STATISTICS_STEP)
    return run_cases(crane, cases, step=n_sub, lanes=VL, every=rows, keep=unchanged, threads=threads, progress=progress)


def fitted(result: ScenarioRun, names: Sequence[str], omega: FloatArray, last: float) -> ComplexArray:
    """Complex amplitudes of some signals at frequencies omega (m,) [rad/s] over the last seconds of a run, in addition
    to a mean and a drift: least squares; shape (m, len(names)), time counted from the start of these seconds."""
    assert result.series is not None
    rows = result.series[-math.floor(last / result.dt) - 1 :, [result.signals.index(name) for name in names]]
    t = result.dt * np.arange(len(rows))
    angles = np.outer(t, omega)
    columns = np.concatenate((np.ones((len(t), 1)), t[:, None] / t[-1] - 0.5, np.cos(angles), -np.sin(angles)), axis=1)
    x = np.linalg.solve(np.einsum("ti,tj->ij", columns, columns), np.einsum("ti,tj->ij", columns, rows))[2:]
    return np.asarray(x[: len(omega)] + 1j * x[len(omega) :])


def spectra(result: ScenarioRun, names: Sequence[str], settled: float) -> tuple[FloatArray, list[ComplexArray]]:
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


SEED = 20
SETTLED = 60.0
"""Part of an irregular motion that is left out at its start [s]."""


@dataclass(frozen=True)
class ExcitationGrid:
    """periods [s] and speeds, amplitudes [m/s], of the sines; mean_periods, zero-crossing periods [s], and deviations
    of speed [m/s] of the irregular motions, and their length [s], start included; all ascending."""

    periods: tuple[float, ...]
    speeds: tuple[float, ...]
    mean_periods: tuple[float, ...]
    deviations: tuple[float, ...]
    length: float

    def motions(self) -> list[Irregular]:
        """The irregular motions, by mean period and within it by deviation; each has separate random phases, always
        the same."""
        pairs = [(T, sigma) for T in self.mean_periods for sigma in self.deviations]
        return [Irregular(T, sigma, _motion(T, sigma, self.length, SEED + n)) for n, (T, sigma) in enumerate(pairs)]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers that identify a grid."""
        return asdict(self)


class Irregular(NamedTuple):
    """An irregular motion of the tip: zero-crossing period [s], deviation of its speed [m/s]."""

    T_z: float
    sigma_v: float
    tip: IrregularTip


def _geometric(low: float, high: float, n: int) -> tuple[float, ...]:
    return tuple(float(x) for x in np.geomspace(low, high, n))


FINE = ExcitationGrid(
    periods=_geometric(2.5, 25.0, 8),
    speeds=_geometric(0.004, 4.0, 2 * VL),
    mean_periods=(4.5, 7.0, 10.5, 15.0),
    deviations=_geometric(0.004, 1.6, 12),
    length=1260.0,
)
"""Periods of ship motion, C changes by a third or less from one to the next; speeds, in whole blocks of runs side by
side, from a winch that sticks to three times what most reach; deviations to a winch that is saturated most of the
time."""
QUICK = ExcitationGrid(
    periods=FINE.periods,
    speeds=_geometric(0.004, 4.0, VL),
    mean_periods=FINE.mean_periods,
    deviations=tuple(FINE.deviations[i] for i in (0, 2, 4, 6, 7, 8, 9, 10)),
    length=660.0,
)
"""A third of the runs, for plans with many winches and duties: its results differ from those of `FINE` by as much as
other random phases do."""


def _motion(T_z: float, sigma_v: float, length: float, seed: int) -> IrregularTip:
    """A JONSWAP motion with this zero-crossing period and deviation of speed, fixed amplitudes, random phases."""
    k = np.arange(1, int(length / 1.5))
    omega = np.asarray(2.0 * math.pi / length * k, dtype=np.float64)
    T_p = 1.3 * T_z
    for _ in range(20):
        S = Jonswap(1.0, T_p, 2.0).density(omega)
        T_p *= T_z / (2.0 * math.pi * math.sqrt(S.sum() / (S @ omega**2)))
    S *= sigma_v**2 / (S @ omega**2)
    phases = np.random.default_rng(seed).random(len(k))
    return IrregularTip(np.concatenate(([0.0], np.sqrt(2.0 * S) * np.exp(2j * math.pi * phases))), length)
