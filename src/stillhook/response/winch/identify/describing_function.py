"""Describing function of a winch from its own twin: sines of many periods and speeds, sixteen side by side, and what of
them is left."""

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
from stillhook.base.atomic import whole_file
from stillhook.base.progress import Progress
from stillhook.engine.scenario.run import Ending, Meter, Result
from stillhook.errors import LiftError, ScenarioError, StillhookError
from stillhook.kernels.build import results_hash
from stillhook.kernels.cache import cache_root
from stillhook.response.winch.compliance import Give
from stillhook.response.winch.describing_function import HARMONICS, Residual
from stillhook.response.winch.duty import Duty, fitted, run_twin, soft
from stillhook.response.winch.excitation import FINE, QUICK, Asked, Irregular
from stillhook.response.winch.identify.compliance import identify_give
from stillhook.response.winch.identify.remnant import identify_remnant, irregular_runs
from stillhook.response.winch.remnant import Remnant
from stillhook.sea.motion.motion import Sine
from stillhook.spec.crane import Crane, content
from stillhook.spec.scenario import Mode, mode_of

SETTLE, WAVES = 30.0, 4
"""Time after which a sine is taken as settled [s], ramp included; whole waves over which the answer is taken."""
SPACING = 0.05
"""Spacing of the series that the answer is taken from [s], or the next shorter one that the PLC cycle allows."""
FOLDER = Path(__file__).resolve().parents[1]
"""Room of the files that a table follows from beside crane, duty and `results_hash`."""

TABLES = ("omega", "v", "C", "harmonics", "saturated", "relieved", "p_a")
REMNANT = ("T_z", "sigma_v", "omega", "S", "gain", "peak")
GIVE = ("omega", "sigma_v", "Y")
BATCHES = 3
"""Times that the twin is run for one residual."""
GIVE_PERIOD = 1
"""Which of the irregular motions' periods the give is taken from: 7 s, where ships move fastest."""


def identify_residual(
    crane: Crane,
    duty: Duty,
    mode: Mode | str = Mode.SSC,
    *,
    asked: Asked = FINE,
    threads: int = 2,
    cache: bool = True,
    progress: Progress | None = None,
    motions: Sequence[Irregular] | None = None,
) -> Residual:
    """C of a winch in one mode under one duty, from runs of its twin; kept on disk under what it follows from.

    asked: motions of the tip; motions, those of `asked.motions()` where they are at hand. cache: look for the same
    table made before, and keep this one; it is found again only for the same crane (names and sources aside), duty,
    mode, motions and code. Making it takes 1 to 3 s once the kernels are compiled.
    Valid for the steady answer to sines: transients at a change of mode are not in it. Where a sine drives the twin out
    of its numbers, it and all faster ones of that period are taken from the last sound one, with the wire's end moving
    by all that the tip moves more.
    Errors: ScenarioError (a load or length that the crane cannot hold), LiftError (manual mode; a tension that the hook
    alone exceeds; nothing sound).
    """
    mode = mode_of(mode)
    if mode is Mode.MANUAL:
        raise LiftError(
            'residual: mode "manual" compensates nothing. Take Residual.constant(1.0), or a mode that compensates.'
        )
    duty.check(crane)
    file = cache_root() / "residuals" / f"{_key(crane, duty, mode, asked)}.npz"
    if cache and (found := _read(file)) is not None:
        return found
    pairs = [(T, v) for T in asked.periods for v in asked.speeds]
    cases = [
        duty.scenario(crane, mode, Sine.from_si(v * T / (2.0 * math.pi), T), SETTLE, SETTLE + WAVES * T)
        for T, v in pairs
    ]
    results = run_twin(soft(crane, duty), cases, SPACING, threads=threads, progress=progress)
    sines = _table(results, asked, duty.about(crane, mode))
    runs = irregular_runs(crane, duty, mode, motions or asked.motions(), threads=threads, progress=progress)
    some = [run for run in runs if run.motion.T_z == asked.mean_periods[GIVE_PERIOD]]
    give = identify_give(crane, duty, mode, some, threads=threads, progress=progress)
    made = replace(sines, remnant=identify_remnant(runs, sines), give=give)
    if cache:
        _write(file, made)
    return made


class Winch(NamedTuple):
    """A crane as its controller sets it, what it holds, and its mode."""

    crane: Crane
    duty: Duty
    mode: Mode


def identify_many(
    winches: Sequence[Winch],
    *,
    asked: Asked = QUICK,
    threads: int = 2,
    cache: bool = True,
    progress: Progress | None = None,
) -> list[Residual | StillhookError]:
    """Residuals of several winches and duties, one after the other on each of the threads; see `identify_residual`. Of
    a winch that cannot be asked, what was wrong."""
    meter, motions = Meter(len(winches), progress), asked.motions()

    def one(winch: Winch) -> Residual | StillhookError:
        reached = meter.part(1.0)
        try:
            return identify_residual(
                *winch, asked=asked, threads=1, cache=cache, progress=Steps(reached), motions=motions
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
    """Progress of the batches of runs of a residual as one, from 0 to 1; calls: how often it was told, 0 where nothing
    ran."""

    def __init__(self, told: Progress | None) -> None:
        self.told, self.calls, self.batch, self.share = told, 0, 0, 0.0

    def __call__(self, share: float) -> None:
        if share < self.share:
            self.batch = min(self.batch + 1, BATCHES - 1)
        self.calls, self.share = self.calls + 1, share
        if self.told is not None:
            self.told((self.batch + share) / BATCHES)


def _table(results: Sequence[Result], asked: Asked, about: str) -> Residual:
    shape = (len(asked.periods), len(asked.speeds))
    omega, v = 2.0 * math.pi / np.array(asked.periods), np.array(asked.speeds)
    C, harmonics = np.full(shape, np.nan, dtype=complex), np.zeros((len(HARMONICS), *shape))
    saturated, relieved, p_a = (np.zeros(shape) for _ in range(3))
    for n, result in enumerate(results):
        i, j = divmod(n, len(v))
        if result.ending is Ending.DONE and not (j and np.isnan(C[i, j - 1])):
            C[i, j], harmonics[:, i, j] = answer(result, omega[i])
            st = result.stats
            cycles = max(st.cycles - 1.0, 1.0)
            saturated[i, j], relieved[i, j], p_a[i, j] = (
                st.saturation_cycles / cycles,
                st.relief_cycles / cycles,
                st.p_a_max,
            )
        elif j:
            C[i, j] = np.nan
    if np.isnan(C[:, 0]).any():
        T = asked.periods[int(np.argmax(np.isnan(C[:, 0])))]
        raise LiftError(
            f"residual: {about}: the twin lost its numbers under the slowest sine of {T:g} s. Look at such a run by"
            " itself."
        )
    for i, j in zip(*np.nonzero(np.isnan(C)), strict=True):
        C[i, j] = 1.0 + (C[i, j - 1] - 1.0) * v[j - 1] / v[j]
        harmonics[:, i, j], saturated[i, j] = harmonics[:, i, j - 1] * v[j - 1] / v[j], 1.0
        relieved[i, j], p_a[i, j] = relieved[i, j - 1], p_a[i, j - 1]
    up = slice(None, None, -1)  # periods ascend, frequencies ascend the other way
    return Residual(omega[up], v, C[up], harmonics[:, up], saturated[up], about, relieved=relieved[up], p_a=p_a[up])


def answer(result: Result, omega: float) -> tuple[complex, FloatArray]:
    """C and the size of the harmonics over the tip's, of a settled run under a sine: least squares over its last whole
    waves, with a drift of the wire beside them."""
    orders = np.arange(1, HARMONICS[-1] + 1)
    parts = fitted(
        result, ("e_c", "s_tip"), np.asarray(omega * orders, dtype=np.float64), WAVES * 2.0 * math.pi / omega
    )
    return complex(parts[0, 0] / parts[0, 1]), np.abs(parts[1:, 0] / parts[0, 1])


def _key(crane: Crane, duty: Duty, mode: Mode, asked: Asked) -> str:
    """Name of everything that a table follows from."""
    own = b"".join(path.read_bytes() for path in sorted(FOLDER.rglob("*.py")))
    what = {
        "code": results_hash(),
        "own": hashlib.sha256(own).hexdigest(),
        "crane": content(crane),
        "mode": mode.value,
        "F": duty.F,
        "s_w": duty.s_w,
        "sensors": duty.sensors.model_dump(mode="json"),
        "asked": asked.to_dict(),
    }
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:32]


def _read(file: Path) -> Residual | None:
    """A table made before; None where there is none, or the file is damaged."""
    with contextlib.suppress(Exception), np.load(file, allow_pickle=False) as data:  # of a damaged file many kinds come
        fields = {name: data[name] for name in TABLES}
        remnant = Remnant(**{name: data[f"remnant_{name}"] for name in REMNANT}, lasts=float(data["lasts"]))
        give = Give(**{name: data[f"give_{name}"] for name in GIVE})
        return Residual(**fields, about=str(data["about"]), remnant=remnant, give=give)
    return None


def _write(file: Path, made: Residual) -> None:
    """Keep a table; a folder that cannot be written to is no reason to fail."""
    arrays = {name: getattr(made, name) for name in TABLES} | {
        f"remnant_{name}": getattr(made.remnant, name) for name in REMNANT
    }
    arrays |= {f"give_{name}": getattr(made.give, name) for name in GIVE}
    arrays |= {
        "about": np.array(made.about),
        "lasts": np.array(made.remnant.lasts if made.remnant is not None else math.nan),
    }
    with contextlib.suppress(StillhookError, OSError), whole_file(file) as part, open(part, "wb") as out:
        np.savez_compressed(out, **arrays)
