"""Describing function of a winch from its own twin: sines of many periods and speeds, sixteen side by side, and what of them is left."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from stillhook.crane import Crane, content
from stillhook.engine.build import cache_root, results_hash
from stillhook.engine.given import STATISTICS_STEP, steps_per_cycle
from stillhook.engine.lanes import VL
from stillhook.engine.run import Ending, Progress, Result, run_cases
from stillhook.errors import LiftError, StillhookError
from stillhook.physics.scalar import G
from stillhook.plants.state import Signals
from stillhook.response.residual import HARMONICS, Residual
from stillhook.scenario import RHO_SEA, Mode, Scenario, Sensors, Water, mode_of
from stillhook.sea.motion import Sine
from stillhook.units import show
from stillhook.whole import whole_file

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PERIODS = tuple(float(x) for x in np.geomspace(2.5, 25.0, 10))
"""Periods of the sines [s]: those of ship motion; C changes by a quarter or less from one to the next."""
SPEEDS = tuple(float(x) for x in np.geomspace(0.004, 4.0, 2 * VL))
"""Speed amplitudes of the sines [m/s], in whole blocks of runs side by side: from a winch that sticks to three times what most reach."""
SETTLE, WAVES = 30.0, 4
"""Time after which a sine is taken as settled [s], ramp included; whole waves over which the answer is taken."""
SPACING = 0.05
"""Spacing of the series that the answer is taken from [s], or the next shorter one that the PLC cycle allows."""
FORMAT = 1


@dataclass(frozen=True)
class Duty:
    """What the winch holds while it compensates: F mean tension at the winch [N]; m moving mass [kg], at least F/g; s_w wire paid out at
    rest [m], which sets layer and stiffness; sensors between winch and PLC."""

    F: float
    m: float
    s_w: float
    sensors: Sensors = field(default_factory=Sensors)

    def scenario(self, crane: Crane, mode: Mode, a: float, T: float) -> Scenario:
        """A sine of the tip with amplitude a [m] and period T [s]. Tension beyond that of hook and payload is added as payload, moving mass
        beyond it as added mass: the twin's wire is a spring without mass."""
        load = self.F / G - crane.hook_mass
        more = self.m - load - crane.hook_mass
        water = Water.model_construct(volume=0.0, added_mass=more, C_D=0.0, area=0.0, rho=RHO_SEA) if more > 0.0 else None
        return Scenario.model_construct(
            load=load, s_w=self.s_w, tip=Sine.from_si(a, T), mode=mode, duration=SETTLE + WAVES * T, warm_up=SETTLE, water=water,
            sensors=self.sensors,
        )  # fmt: skip


def identify_residual(
    crane: Crane,
    duty: Duty,
    mode: Mode | str = Mode.SSC,
    *,
    periods: Sequence[float] = PERIODS,
    speeds: Sequence[float] = SPEEDS,
    threads: int = 2,
    cache: bool = True,
    progress: Progress | None = None,
) -> Residual:
    """C of a winch in one mode under one duty, from runs of its twin; kept on disk under what it follows from.

    periods [s] and speeds [m/s], both ascending, are those of the sines. cache: look for the same table made before, and keep this one;
    it is found again only for the same crane (names and sources aside), duty, mode, grid and code. Making it takes
    1 to 3 s once the kernels are compiled.
    Valid for the steady answer to sines: transients at a change of mode are not in it. Where a sine drives the twin out of its numbers,
    it and all faster ones of that period are taken from the last sound one, with the wire's end moving by all that the tip moves more.
    Errors: ScenarioError (a load or length that the crane cannot hold), LiftError (a tension that the hook alone exceeds; nothing sound).
    """
    mode = mode_of(mode)
    if not duty.F / G >= crane.hook_mass:
        F, hook = show(duty.F, "force"), show(crane.hook_mass, "mass")
        raise LiftError(f"residual: a tension of {F} is less than the weight of the hook, {hook}. Give the mean tension at the winch.")
    file = cache_root() / "residuals" / f"{_key(crane, duty, mode, periods, speeds)}.npz"
    if cache and (found := _read(file)) is not None:
        return found
    cases = [duty.scenario(crane, mode, v * T / (2.0 * math.pi), T) for T in periods for v in speeds]
    rows = max(1, math.floor(SPACING / crane.control.t_cycle + 1e-9))
    n_sub = steps_per_cycle(crane, None, STATISTICS_STEP)
    results = run_cases(crane, cases, n_sub=n_sub, lanes=VL, every=rows, threads=threads, progress=progress)
    about = f"{crane.name}, {mode.value}, {show(duty.F, 'force')} at the winch, {show(duty.s_w, 'length')} of wire out"
    made = _table(results, periods, speeds, about)
    if cache:
        _write(file, made)
    return made


def _table(results: Sequence[Result], periods: Sequence[float], speeds: Sequence[float], about: str) -> Residual:
    shape = (len(periods), len(speeds))
    omega, v = 2.0 * math.pi / np.array(periods), np.array(speeds)
    C, harmonics = np.full(shape, np.nan, dtype=complex), np.zeros((len(HARMONICS), *shape))
    saturated = np.zeros(shape)
    for n, result in enumerate(results):
        i, j = divmod(n, len(speeds))
        if result.ending is Ending.DONE and not (j and np.isnan(C[i, j - 1])):
            C[i, j], harmonics[:, i, j] = answer(result, omega[i])
            saturated[i, j] = result.stats.saturation_cycles / max(result.stats.cycles - 1.0, 1.0)
        elif j:
            C[i, j] = np.nan
    if np.isnan(C[:, 0]).any():
        T = periods[int(np.argmax(np.isnan(C[:, 0])))]
        raise LiftError(f"residual: {about}: the twin lost its numbers under the slowest sine of {T:g} s. Look at such a run by itself.")
    for i, j in zip(*np.nonzero(np.isnan(C)), strict=True):
        C[i, j] = 1.0 + (C[i, j - 1] - 1.0) * v[j - 1] / v[j]
        harmonics[:, i, j], saturated[i, j] = harmonics[:, i, j - 1] * v[j - 1] / v[j], 1.0
    up = slice(None, None, -1)  # periods ascend, frequencies ascend the other way
    return Residual(omega[up], v, C[up], harmonics[:, up], saturated[up], about)


def answer(result: Result, omega: float) -> tuple[complex, FloatArray]:
    """C and the size of the harmonics over the tip's, of a settled run under a sine: least squares over its last whole waves, with a drift
    of the wire beside them."""
    assert result.series is not None
    n = math.floor(WAVES * 2.0 * math.pi / omega / result.dt)
    rows = result.series[-n - 1 :]
    t = result.dt * np.arange(len(rows))
    orders = np.arange(1, HARMONICS[-1] + 1)
    waves = np.exp(1j * np.outer(omega * t, orders))
    columns = np.concatenate((np.ones((len(t), 1)), t[:, None] - t.mean(), waves.real, -waves.imag), axis=1)
    y = rows[:, [Signals._fields.index("e_c"), Signals._fields.index("s_tip")]]
    x = np.linalg.lstsq(columns, y, rcond=None)[0][2:]
    parts = x[: len(orders)] + 1j * x[len(orders) :]
    return complex(parts[0, 0] / parts[0, 1]), np.abs(parts[1:, 0] / parts[0, 1])


def _key(crane: Crane, duty: Duty, mode: Mode, periods: Sequence[float], speeds: Sequence[float]) -> str:
    """Name of everything that a table follows from."""
    own = b"".join(Path(__file__).with_name(name).read_bytes() for name in ("identify_residual.py", "residual.py"))
    what = {
        "code": results_hash(), "own": hashlib.sha256(own).hexdigest(), "format": FORMAT, "crane": content(crane), "mode": mode.value, "F": duty.F, "m": duty.m,
        "s_w": duty.s_w, "sensors": duty.sensors.model_dump(mode="json"), "periods": list(periods), "speeds": list(speeds),
    }  # fmt: skip
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:32]


def _read(file: Path) -> Residual | None:
    """A table made before; None where there is none, or the file is damaged."""
    with contextlib.suppress(OSError, ValueError, KeyError, EOFError, BadZipFile, LiftError), np.load(file, allow_pickle=False) as data:
        return Residual(data["omega"], data["v"], data["C"], data["harmonics"], data["saturated"], str(data["about"]))
    return None


def _write(file: Path, made: Residual) -> None:
    """Keep a table; a folder that cannot be written to is no reason to fail."""
    with contextlib.suppress(StillhookError, OSError), whole_file(file) as part, open(part, "wb") as out:
        np.savez_compressed(
            out, omega=made.omega, v=made.v, C=made.C, harmonics=made.harmonics, saturated=made.saturated, about=np.array(made.about)
        )
