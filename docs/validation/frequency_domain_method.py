"""The frequency-domain method compared with lowerings in time: on the brake and compensated, from the surface to
2,900 m, with eight seeds each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from blocks import Blocks, percent, sayings

from stillhook import load_crane
from stillhook.engine.simulate import simulate
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import read_payload, vessel_file
from stillhook.response.forcing import Forcing
from stillhook.response.frequency_domain import sigmas
from stillhook.response.suspended_load import (
    End,
    Rod,
    SuspendedLoad,
    natural_periods,
    static_stretch,
    suspended_load,
    transfers,
)
from stillhook.response.winch.identify import identify_residual
from stillhook.response.winch.linear_form import Residual
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.realisation import realise, tip_motion, wave_field
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase

SLOW_PAGE = True
CRANE, VESSEL = load_crane("deep-250t"), read_vessel(vessel_file("construction-vessel-130m"))
X, Y, BETA = -20.0, 18.0, math.radians(150.0)
LENGTH, SETTLED, SEEDS = 1260.0, 150.0, 8
SHOWN = (("load", "s_load", 1e3), ("top", "F_w", 1e-3), ("sling", "F_sling", 1e-3))
LINEAR = 0.02


class Case(NamedTuple):
    payload: str
    z: float
    H_s: float
    T_p: float
    mode: str
    reason: str


CASES = [Case(*row) for row in sayings("frequency_domain_method")["case"]]


class Pair(NamedTuple):
    """Deviations of one case: load; tip [m]; computed by the method and in time, u first, then as SHOWN (SI);
    scatter of the mean of the seeds [-]."""

    case: Case
    load: SuspendedLoad
    tip: float
    computed: list[float]
    time: list[float]
    scatter: list[float]
    slack: float


def compared(case: Case) -> Pair:
    sea = Sea((Train(Jonswap(case.H_s, case.T_p, 2.0), BETA),))
    lifts, parts = [], []
    for seed in range(SEEDS):
        waves = realise(sea, LENGTH, seed)
        tip = tip_motion(waves, VESSEL, X, Y)
        here, there = tip.amplitudes[waves.harmonic], waves.elevation(X, Y)
        parts.append((np.abs(here) ** 2 / 2.0, np.abs(there) ** 2 / 2.0, here * np.conj(there) / 2.0))
        field = None if case.z > 0.0 else wave_field(waves, X, Y)
        stage = Phase(mode=case.mode, time=f"{LENGTH} s")
        sea_state = {"tip": tip, "waves": field, "h_tip": "30 m", "depth": "3000 m", "start_depth": f"{-case.z} m"}
        times = {"programme": (stage,), "duration": f"{LENGTH} s"}
        lifts.append(Lowering(payload=read_payload(case.payload), **sea_state, **times))
    run = simulate(CRANE, lifts, series=True)
    h = suspended_load(CRANE, lifts[0], case.z)
    residual = identify_residual(CRANE, h.duty) if case.mode == "ahc" else Residual.constant(1.0)
    tip_, wave, cross = (np.mean([p[i] for p in parts], axis=0)[None, :] for i in range(3))
    found = sigmas(
        Forcing(waves.omega, np.full(len(waves.omega), 2.0 * math.pi / LENGTH), tip_, wave, cross), h, residual
    )
    kept = run.sel(time=slice(SETTLED, None))
    in_time = [
        spread(kept[column].values) for column in ("e_c" if case.mode == "ahc" else "s_tip", *(c for _, c, _ in SHOWN))
    ]
    computed = [float(found.u[0]), *(float(getattr(found, q)[0]) for q, _, _ in SHOWN)]
    slack = float(np.mean(run["sling_slack_time"].values)) / LENGTH
    return Pair(
        case, h, math.sqrt(float(tip_.sum())), computed, [m for m, _ in in_time], [s for _, s in in_time], slack
    )


def spread(rows: Sequence[np.ndarray]) -> tuple[float, float]:
    """Root of the mean variance of some series without their drift, and the scatter of that mean as part of it."""
    t = np.linspace(-1.0, 1.0, len(rows[0]))
    variances = np.array([np.var(y - np.polynomial.Polynomial.fit(t, y, 1)(t)) for y in rows])
    return math.sqrt(variances.mean()), float(variances.std(ddof=1) / variances.mean() / 2.0 / math.sqrt(len(rows)))


def closed_forms() -> tuple[float, float, float]:
    """How far the exact rod is off its equation of modes, a sum of pieces, and a chain of masses solved apart [-]."""
    rod, end = Rod(L=3000.0, EA=836e6, mu=36.0, w=300.0), End(m=100e3, A33=50e3)
    T = natural_periods(rod, end, 3)
    nu = 2.0 * math.pi / T * rod.L * math.sqrt(rod.mu / rod.EA)
    worst = float(np.max(np.abs(nu * np.tan(nu) / (rod.mass / end.moving) - 1.0)))
    x = (np.arange(10_000) + 0.5) / 10_000
    pieces = float(np.sum((1e6 + rod.w * rod.L * (1.0 - x)) / rod.EA)) * rod.L / 10_000
    stretch = static_stretch(rod, 1e6) / pieces - 1.0
    n, omega = 1000, 2.0 * math.pi / 8.0
    k, m = rod.EA / rod.L * n, np.append(np.full(n - 1, rod.mass / n), rod.mass / n / 2.0 + end.moving)
    A = np.diag(2.0 * k - omega**2 * m) - np.diag(np.full(n - 1, k), 1) - np.diag(np.full(n - 1, k), -1)
    A[-1, -1] -= k
    chain = np.linalg.solve(A, np.append(k, np.zeros(n - 1)))[-1]
    gain = float(np.real(transfers(omega, rod, end).load_u)) / chain - 1.0
    return worst, abs(stretch), abs(gain)


def compute() -> tuple[Blocks, None]:
    pairs = [compared(case) for case in CASES]

    def worst(wanted: Sequence[Pair], first: int = 1) -> float:
        return max(abs(r / t - 1.0) for p in wanted for r, t in zip(p.computed[first:], p.time[first:], strict=True))

    modes, stretch, gain = closed_forms()
    linear, drag, deep = worst(pairs[:3]), worst(pairs[3:5]), worst(pairs[5:7], 0)
    short = worst(pairs[9:])
    scatter = max(s for p in pairs for s in p.scatter[1:])
    return {
        "claims": locals(),
        "cases": pairs,
        "scatter": [
            ("largest scatter of a mean over the seeds", percent(scatter, digits=1)),
            ("slings slack in time, largest share", percent(max(p.slack for p in pairs), digits=2)),
        ],
    }, None
