"""The linear form of a winch from its twin: describing function, remnant and compliance."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.kept.arrays import packed, read_arrays
from stillhook.base.kept.checked import OTHER, Kept, note, read_checked, write_checked
from stillhook.base.kept.sources import PACKAGE
from stillhook.base.progress import Meter, Progress
from stillhook.engine.pack.shaft import wire_EA
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.errors import LiftError, ScenarioError, StillhookError
from stillhook.kernels.build import model_hash
from stillhook.kernels.cache import SHIPPED, cache_root
from stillhook.response.winch.duty import (
    FINE,
    QUICK,
    SETTLED,
    Duty,
    ExcitationGrid,
    Irregular,
    fitted,
    run_twin,
    soft,
    spectra,
)
from stillhook.response.winch.linear_form import HARMONICS, Remnant, Residual, WinchCompliance
from stillhook.sea.motion.motion import Sine
from stillhook.spec.crane import Crane, content, rounded
from stillhook.spec.scenario import Mode, mode_of
from stillhook.units import show

SPACING = 0.1
"""Spacing of the series [s]; nothing moves faster than 8 rad/s."""
LOW, HIGH, BANDS = 0.01, 8.0, 18
"""Bands in which the density is taken [rad/s], even in their logarithm."""
FLOOR = 1e-3
"""Least part of a band's power that is remnant: the residue of the estimate of a coherent motion is no better known."""


class Run(NamedTuple):
    """An irregular motion of the tip, and the run of the winch under it on a wire at constant tension."""

    motion: Irregular
    result: ScenarioRun


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
    end = min((run.motion.sigma_v for run in runs if run.result.diverged), default=math.inf)
    if not (sound := [run for run in runs if run.motion.sigma_v < end]):
        raise LiftError(f"residual: {duty.about(crane, mode)}: the twin diverged under the smallest irregular motion.")
    return sound


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
        energy, _ = np.histogram(self.omega, edges, weights=rest)
        density = np.maximum(energy, FLOOR * np.maximum(total, 1e-30)) / np.diff(edges)
        filled = np.flatnonzero(
            np.histogram(self.omega, edges)[0]
        )  # a short run may have no frequency in the lowest bands
        return np.asarray(
            density[filled[np.minimum(np.searchsorted(filled, np.arange(len(density))), len(filled) - 1)]]
        )


def _gain(runs: Sequence[_Spectra]) -> complex:
    """Factor on C with which it explains most of some motions, each counted alike."""
    above = [r.cross.sum() / np.sum(np.abs(r.C) ** 2 * r.tip) for r in runs]
    return complex(np.mean(above))


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
    if mode.law.yields:  # its loop is set for the wire that there is, and swings on a stiffer one
        k = min(k, wire_EA(crane.wire) / (crane.wire.L_0 + duty.s_w))
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


def _sound(result: ScenarioRun) -> bool:
    st = result.stats.common
    return not result.diverged and st.slack_cycles == 0.0 and st.saturation_cycles < SATURATED * st.cycles


def _compliance(on_soft: ScenarioRun, on_stiff: ScenarioRun) -> ComplexArray:
    """Y in bands [m/N]."""
    omega, (u_a,) = spectra(on_soft, ("e_c",), SETTLED)
    _, (u_b, F) = spectra(on_stiff, ("e_c", "F_w"), SETTLED)
    cross = (u_a - u_b) * np.conj(F)
    parts = [np.histogram(omega, EDGES, weights=x)[0] for x in (cross.real, cross.imag, np.abs(F) ** 2)]
    return np.asarray((parts[0] + 1j * parts[1]) / parts[2])


SETTLE, WAVES = 30.0, 4
"""Time after which a sine is taken as settled [s], ramp included; complete waves over which the answer is taken."""
SINE_SPACING = 0.05
"""Spacing of the series that the answer is taken from [s], or the next shorter one that the PLC cycle allows."""
FOLDER = "response/winch"
"""Folder of the files that a table depends on, in addition to crane, duty and `model_hash`."""
DIGITS = 9
"""Digits of a number that count in the key of a table: machines round the last ones differently."""
KEPT = "residuals"
"""Folder of tables, in the cache and in what a wheel is made with."""

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
    mode: Mode | str | None = None,
    *,
    excitation: ExcitationGrid = FINE,
    threads: int = 2,
    cache: bool = True,
    progress: Progress | None = None,
    motions: Callable[[], Sequence[Irregular]] | None = None,
) -> Residual:
    """C of a winch in one mode under one duty, from runs of its twin; kept on disk under a key of everything it depends
    on.

    excitation: motions of the tip; motions: makes `excitation.motions()`, or has them already. cache: look for the same
    table identified before, here or when the wheel was made, and keep this one; it is reused only for the same crane
    (names and sources aside), duty, mode, motions and code. Identification takes 1 to 3 s once the kernels are
    compiled.
    Valid for the steady answer to sines: transients at a change of mode are not in it. Where a sine makes the twin
    diverge, it and all faster ones of that period are taken from the last valid one, with the wire's end moving by all
    that the tip moves more.
    Errors: ScenarioError (a load or length that the crane cannot hold), LiftError (manual mode; a tension that the hook
    alone exceeds; nothing sound).
    """
    mode = crane.plant.type.default_mode if mode is None else mode_of(mode)
    if not mode.compensates:
        raise LiftError(
            'residual: mode "manual" does not compensate. Use Residual.constant(1.0), or a mode that compensates.'
        )
    duty.check(crane)
    name = f"{_key(crane, duty, mode, excitation)}.npz"
    file = cache_root() / KEPT / name
    if cache and (stored := _read(SHIPPED / KEPT / name) or _read(file)) is not None:
        return stored
    pairs = [(T, v) for T in excitation.periods for v in excitation.speeds]
    cases = [
        duty.scenario(crane, mode, Sine.from_si(v * T / (2.0 * math.pi), T), SETTLE, SETTLE + WAVES * T)
        for T, v in pairs
    ]
    results = run_twin(soft(crane, duty), cases, SINE_SPACING, threads=threads, progress=progress)
    numbers = {row.name for row in crane.plant.type.numbers}
    sines = _table(results, excitation, duty.about(crane, mode), hydraulic=numbers >= OF_RUNS)
    runs = irregular_runs(crane, duty, mode, (motions or excitation.motions)(), threads=threads, progress=progress)
    fast = [run for run in runs if run.motion.T_z == excitation.mean_periods[COMPLIANCE_PERIOD]]
    compliance = identify_compliance(crane, duty, mode, fast, threads=threads, progress=progress)
    content = _packed(replace(sines, remnant=identify_remnant(runs, sines), compliance=compliance))
    if cache:
        with contextlib.suppress(StillhookError, OSError):  # a folder that cannot be written to
            write_checked(file, content)
    return _unpacked(content)  # what is read the next time: its arrays are in the same order in memory


class Winch(NamedTuple):
    """A crane with the settings of its controller, its duty and its mode."""

    crane: Crane
    duty: Duty
    mode: Mode


def identify_many(
    winches: Sequence[Winch],
    *,
    threads: int = 2,
    progress: Progress | None = None,
) -> list[Residual | StillhookError]:
    """Residuals of several winches and duties, one after the other on each of the threads; see `identify_residual`. For
    a winch that cannot be run, the error."""
    meter, motions = Meter(len(winches), progress, of=len(winches)), functools.cache(QUICK.motions)

    def one(winch: Winch) -> Residual | StillhookError:
        reached = meter.part(1.0)
        try:
            return identify_residual(*winch, excitation=QUICK, threads=1, progress=Steps(reached), motions=motions)
        except (LiftError, ScenarioError) as problem:
            return problem
        finally:
            reached(1.0)
            meter.finish(f"{winch.mode} on {show(winch.duty.s_w, 'length')} of wire")

    with ThreadPoolExecutor(max(threads, 1)) as pool:
        try:
            return list(pool.map(one, winches))
        except BaseException:
            meter.stopped = True
            raise


class Steps:
    """Progress of the batches of runs of a residual as one, from 0 to 1."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.batch, self.share = progress, 0, 0.0

    def __call__(self, share: float) -> None:
        if share < self.share:
            self.batch = min(self.batch + 1, BATCHES - 1)
        self.share = share
        if self.progress is not None:
            self.progress((self.batch + share) / BATCHES)


def _table(results: Sequence[ScenarioRun], excitation: ExcitationGrid, about: str, *, hydraulic: bool) -> Residual:
    """Tables of settled runs under sines; hydraulic: with those of `OF_CIRCUIT`."""
    shape = (len(excitation.periods), len(excitation.speeds))
    omega, v = 2.0 * math.pi / np.array(excitation.periods), np.array(excitation.speeds)
    C, harmonics = np.full(shape, np.nan, dtype=complex), np.zeros((len(HARMONICS), *shape))
    saturated, relieved, p_a = (np.zeros(shape) for _ in range(3))
    for n, result in enumerate(results):
        i, j = divmod(n, len(v))
        if not result.diverged and not (j and np.isnan(C[i, j - 1])):
            C[i, j], harmonics[:, i, j] = answer(result, omega[i])
            st, stats = result.stats.common, result.stats
            cycles = max(st.cycles - 1.0, 1.0)
            saturated[i, j] = st.saturation_cycles / cycles
            if hydraulic:
                relieved[i, j], p_a[i, j] = stats.limits.relief / cycles, stats.extremes.p_a_max
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
    table = Residual(omega[up], v, C[up], harmonics[:, up], saturated[up], about)
    return replace(table, relieved=relieved[up], p_a=p_a[up]) if hydraulic else table


def answer(result: ScenarioRun, omega: float) -> tuple[complex, FloatArray]:
    """C and the size of the harmonics over the tip's, of a settled run under a sine: least squares over its last
    complete waves, with a drift of the wire."""
    orders = np.arange(1, HARMONICS[-1] + 1)
    parts = fitted(
        result, ("e_c", "s_tip"), np.asarray(omega * orders, dtype=np.float64), WAVES * 2.0 * math.pi / omega
    )
    return complex(parts[0, 0] / parts[0, 1]), np.abs(parts[1:, 0] / parts[0, 1])


def _key(crane: Crane, duty: Duty, mode: Mode, excitation: ExcitationGrid) -> str:
    """Key of everything that a table depends on."""
    dependencies = {
        "code": model_hash(),
        "response": _code(),
        "crane": content(crane, digits=DIGITS),
        "mode": mode.value,
        "duty": rounded([duty.F, duty.s_w, duty.sensors.model_dump(mode="json")], DIGITS),
        "excitation": excitation.to_dict(),
    }
    return hashlib.sha256(json.dumps(dependencies, sort_keys=True).encode()).hexdigest()[:32]


@functools.cache
def _code() -> str:
    """Hash of the code of this folder."""
    return PACKAGE.hash(PACKAGE.inside((FOLDER,), (".py",)))


def _read(file: Path) -> Residual | None:
    """A table identified before; None where there is none, or, with a note, the file is damaged."""
    content = read_checked(file, Kept.RESIDUAL)
    if content is None:
        return None
    try:
        return _unpacked(content)
    except Exception:  # of what another program wrote, many kinds come
        note(file, OTHER, Kept.RESIDUAL)
        return None


def _packed(residual: Residual) -> bytes:
    """A table as bytes."""
    arrays = {name: getattr(residual, name) for name in TABLES}
    arrays |= {name: table for name in OF_CIRCUIT if (table := getattr(residual, name)) is not None}
    arrays |= {f"remnant_{name}": getattr(residual.remnant, name) for name in REMNANT}
    arrays |= {f"compliance_{name}": getattr(residual.compliance, name) for name in COMPLIANCE}
    arrays |= {
        "about": np.array(residual.about),
        "lasts": np.array(residual.remnant.lasts if residual.remnant is not None else math.nan),
    }
    return packed(arrays)


def _unpacked(content: bytes) -> Residual:
    """The table that `_packed` was given. Errors: many kinds, of what another program wrote."""
    data = read_arrays(content)
    fields = {name: data[name] for name in (*TABLES, *OF_CIRCUIT) if name in data}
    remnant = Remnant(**{name: data[f"remnant_{name}"] for name in REMNANT}, lasts=float(data["lasts"]))
    compliance = WinchCompliance(**{name: data[f"compliance_{name}"] for name in COMPLIANCE})
    return Residual(**fields, about=str(data["about"]), remnant=remnant, compliance=compliance)


def mixed(a: Residual, b: Residual, share: float) -> Residual:
    """Two residuals on the same frequencies and amplitudes as one, `share` of the second."""
    if share == 0.0:
        return a
    if share == 1.0:
        return b
    if a.remnant is None or b.remnant is None or a.compliance is None or b.compliance is None:
        raise LiftError("residuals: one has no remnant or compliance. Identify all of them on the twin.")
    m, n = a.remnant, b.remnant
    n_sigma = min(len(m.sigma_v), len(n.sigma_v))  # the twin may be lost earlier under one load
    S = np.exp((1.0 - share) * np.log(m.S[:, :n_sigma]) + share * np.log(n.S[:, :n_sigma]))
    peak = (
        None if m.peak is None or n.peak is None else (1.0 - share) * m.peak[:, :n_sigma] + share * n.peak[:, :n_sigma]
    )
    gain = (1.0 - share) * m.gain[:n_sigma] + share * n.gain[:n_sigma]
    remnant = Remnant(m.T_z, m.sigma_v[:n_sigma], m.omega, S, gain, peak, m.lasts)
    Y = (1.0 - share) * a.compliance.Y[:, :n_sigma] + share * b.compliance.Y[:, :n_sigma]
    optional = [name for name in ("relieved", "p_a") if getattr(a, name) is not None and getattr(b, name) is not None]
    tables = {
        name: (1.0 - share) * getattr(a, name) + share * getattr(b, name)
        for name in ("C", "harmonics", "saturated", *optional)
    }
    about = f"between {a.about} and {b.about}"
    return replace(
        a,
        **tables,
        about=about,
        remnant=remnant,
        compliance=WinchCompliance(a.compliance.omega, a.compliance.sigma_v[:n_sigma], Y),
    )
