"""Describing function of a winch from its twin: sines of many periods and speeds, sixteen side by side, and their
residuals."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.base.progress import Meter, Progress
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.run import Result
from stillhook.errors import LiftError, ScenarioError, StillhookError
from stillhook.kernels.build import results_hash
from stillhook.kernels.cache import cache_root
from stillhook.response.winch.compliance import WinchCompliance
from stillhook.response.winch.describing_function import HARMONICS, Residual
from stillhook.response.winch.duty import Duty, fitted, run_twin, soft
from stillhook.response.winch.excitation import FINE, QUICK, ExcitationGrid, Irregular
from stillhook.response.winch.identify.compliance import identify_compliance
from stillhook.response.winch.identify.remnant import identify_remnant, irregular_runs
from stillhook.response.winch.remnant import Remnant
from stillhook.sea.motion.motion import Sine
from stillhook.spec.crane import Crane, content
from stillhook.spec.scenario import Mode, mode_of

SETTLE, WAVES = 30.0, 4
"""Time after which a sine is taken as settled [s], ramp included; complete waves over which the answer is taken."""
SINE_SPACING = 0.05
"""Spacing of the series that the answer is taken from [s], or the next shorter one that the PLC cycle allows."""
FOLDER = Path(__file__).resolve().parents[1]
"""Folder of the files that a table depends on, in addition to crane, duty and `results_hash`."""

TABLES = ("omega", "v", "C", "harmonics", "saturated")
OF_CIRCUIT = ("relieved", "p_a")
"""Tables of a winch with an active circuit alone, whose runs have the numbers `OF_RUNS`."""
OF_RUNS = {"relief_time", "p_a_max"}
REMNANT = ("T_z", "sigma_v", "omega", "S", "gain", "peak")
COMPLIANCE = ("omega", "sigma_v", "Y")
BATCHES = 3
"""Times that the twin is run for one residual."""
COMPLIANCE_PERIOD = 1
"""Index of the irregular motions' period that the compliance is taken from: 7 s, where ships move fastest."""


def identify_residual(
    crane: Crane,
    duty: Duty,
    mode: Mode | str = DEFAULT_MODE,
    *,
    excitation: ExcitationGrid = FINE,
    threads: int = 2,
    cache: bool = True,
    progress: Progress | None = None,
    motions: Sequence[Irregular] | None = None,
) -> Residual:
    """C of a winch in one mode under one duty, from runs of its twin; kept on disk under a key of everything it depends
    on.

    excitation: motions of the tip; motions: `excitation.motions()` where they exist already. cache: look for the same
    table identified before, and keep this one; it is reused only for the same crane (names and sources aside), duty,
    mode, motions and code. Identification takes 1 to 3 s once the kernels are compiled.
    Valid for the steady answer to sines: transients at a change of mode are not in it. Where a sine makes the twin
    diverge, it and all faster ones of that period are taken from the last valid one, with the wire's end moving by all
    that the tip moves more.
    Errors: ScenarioError (a load or length that the crane cannot hold), LiftError (manual mode; a tension that the hook
    alone exceeds; nothing sound).
    """
    mode = mode_of(mode)
    if not mode.compensates:
        raise LiftError(
            'residual: mode "manual" does not compensate. Use Residual.constant(1.0), or a mode that compensates.'
        )
    duty.check(crane)
    file = cache_root() / "residuals" / f"{_key(crane, duty, mode, excitation)}.npz"
    if cache and (stored := _read(file)) is not None:
        return stored
    pairs = [(T, v) for T in excitation.periods for v in excitation.speeds]
    cases = [
        duty.scenario(crane, mode, Sine.from_si(v * T / (2.0 * math.pi), T), SETTLE, SETTLE + WAVES * T)
        for T, v in pairs
    ]
    results = run_twin(soft(crane, duty), cases, SINE_SPACING, threads=threads, progress=progress)
    own = {row.name for row in crane.plant.type.numbers}
    sines = _table(results, excitation, duty.about(crane, mode), hydraulic=own >= OF_RUNS)
    runs = irregular_runs(crane, duty, mode, motions or excitation.motions(), threads=threads, progress=progress)
    some = [run for run in runs if run.motion.T_z == excitation.mean_periods[COMPLIANCE_PERIOD]]
    compliance = identify_compliance(crane, duty, mode, some, threads=threads, progress=progress)
    made = replace(sines, remnant=identify_remnant(runs, sines), compliance=compliance)
    if cache:
        _write(file, made)
    return made


class Winch(NamedTuple):
    """A crane with the settings of its controller, its duty and its mode."""

    crane: Crane
    duty: Duty
    mode: Mode


def identify_many(
    winches: Sequence[Winch],
    *,
    excitation: ExcitationGrid = QUICK,
    threads: int = 2,
    cache: bool = True,
    progress: Progress | None = None,
) -> list[Residual | StillhookError]:
    """Residuals of several winches and duties, one after the other on each of the threads; see `identify_residual`. For
    a winch that cannot be run, the error."""
    meter, motions = Meter(len(winches), progress), excitation.motions()

    def one(winch: Winch) -> Residual | StillhookError:
        reached = meter.part(1.0)
        try:
            return identify_residual(
                *winch, excitation=excitation, threads=1, cache=cache, progress=Steps(reached), motions=motions
            )
        except (LiftError, ScenarioError) as problem:
            return problem
        finally:
            reached(1.0)

    with ThreadPoolExecutor(max(threads, 1)) as pool:
        try:
            return list(pool.map(one, winches))
        except BaseException:
            meter.stopped = True
            raise


class Steps:
    """Progress of the batches of runs of a residual as one, from 0 to 1; calls: number of reports, 0 where nothing
    ran."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.calls, self.batch, self.share = progress, 0, 0, 0.0

    def __call__(self, share: float) -> None:
        if share < self.share:
            self.batch = min(self.batch + 1, BATCHES - 1)
        self.calls, self.share = self.calls + 1, share
        if self.progress is not None:
            self.progress((self.batch + share) / BATCHES)


def _table(results: Sequence[Result], excitation: ExcitationGrid, about: str, *, hydraulic: bool) -> Residual:
    """Tables of settled runs under sines; hydraulic: with those of `OF_CIRCUIT`."""
    shape = (len(excitation.periods), len(excitation.speeds))
    omega, v = 2.0 * math.pi / np.array(excitation.periods), np.array(excitation.speeds)
    C, harmonics = np.full(shape, np.nan, dtype=complex), np.zeros((len(HARMONICS), *shape))
    saturated, relieved, p_a = (np.zeros(shape) for _ in range(3))
    for n, result in enumerate(results):
        i, j = divmod(n, len(v))
        if result.ending is Ending.DONE and not (j and np.isnan(C[i, j - 1])):
            C[i, j], harmonics[:, i, j] = answer(result, omega[i])
            st, own = result.stats.common, result.stats
            cycles = max(st.cycles - 1.0, 1.0)
            saturated[i, j] = st.saturation_cycles / cycles
            if hydraulic:
                relieved[i, j], p_a[i, j] = own.limits.relief / cycles, own.extremes.p_a_max
        elif j:
            C[i, j] = np.nan
    if np.isnan(C[:, 0]).any():
        T = excitation.periods[int(np.argmax(np.isnan(C[:, 0])))]
        raise LiftError(
            f"residual: {about}: the twin diverged under the slowest sine of {T:g} s. Simulate such a run separately."
        )
    for i, j in zip(*np.nonzero(np.isnan(C)), strict=True):
        C[i, j] = 1.0 + (C[i, j - 1] - 1.0) * v[j - 1] / v[j]
        harmonics[:, i, j], saturated[i, j] = harmonics[:, i, j - 1] * v[j - 1] / v[j], 1.0
        relieved[i, j], p_a[i, j] = relieved[i, j - 1], p_a[i, j - 1]
    up = slice(None, None, -1)  # periods ascend, frequencies ascend the other way
    made = Residual(omega[up], v, C[up], harmonics[:, up], saturated[up], about)
    return replace(made, relieved=relieved[up], p_a=p_a[up]) if hydraulic else made


def answer(result: Result, omega: float) -> tuple[complex, FloatArray]:
    """C and the size of the harmonics over the tip's, of a settled run under a sine: least squares over its last
    complete waves, with a drift of the wire."""
    orders = np.arange(1, HARMONICS[-1] + 1)
    parts = fitted(
        result, ("e_c", "s_tip"), np.asarray(omega * orders, dtype=np.float64), WAVES * 2.0 * math.pi / omega
    )
    return complex(parts[0, 0] / parts[0, 1]), np.abs(parts[1:, 0] / parts[0, 1])


def _key(crane: Crane, duty: Duty, mode: Mode, excitation: ExcitationGrid) -> str:
    """Key of everything that a table depends on."""
    source = b"".join(path.read_bytes() for path in sorted(FOLDER.rglob("*.py")))
    dependencies = {
        "code": results_hash(),
        "response": hashlib.sha256(source).hexdigest(),
        "crane": content(crane),
        "mode": mode.value,
        "F": duty.F,
        "s_w": duty.s_w,
        "sensors": duty.sensors.model_dump(mode="json"),
        "excitation": excitation.to_dict(),
    }
    return hashlib.sha256(json.dumps(dependencies, sort_keys=True).encode()).hexdigest()[:32]


def _read(file: Path) -> Residual | None:
    """A table identified before; None where there is none, or the file is damaged."""
    with contextlib.suppress(Exception), np.load(file, allow_pickle=False) as data:  # damaged files raise many kinds
        fields = {name: data[name] for name in (*TABLES, *OF_CIRCUIT) if name in data}
        remnant = Remnant(**{name: data[f"remnant_{name}"] for name in REMNANT}, lasts=float(data["lasts"]))
        compliance = WinchCompliance(**{name: data[f"compliance_{name}"] for name in COMPLIANCE})
        return Residual(**fields, about=str(data["about"]), remnant=remnant, compliance=compliance)
    return None


def _write(file: Path, made: Residual) -> None:
    """Keep a table; a folder that cannot be written to is no reason to fail."""
    arrays = {name: getattr(made, name) for name in TABLES}
    arrays |= {name: table for name in OF_CIRCUIT if (table := getattr(made, name)) is not None}
    arrays |= {f"remnant_{name}": getattr(made.remnant, name) for name in REMNANT}
    arrays |= {f"compliance_{name}": getattr(made.compliance, name) for name in COMPLIANCE}
    arrays |= {
        "about": np.array(made.about),
        "lasts": np.array(made.remnant.lasts if made.remnant is not None else math.nan),
    }
    with contextlib.suppress(StillhookError, OSError), atomic_file(file) as part, open(part, "wb") as out:
        np.savez_compressed(out, **arrays)
