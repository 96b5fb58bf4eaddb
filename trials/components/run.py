"""Tables and logs of components of a known truth, with drift and correlated noise, kept in outcomes.json.

    python -m trials.components.run            run what is not in the file yet
    python -m trials.components.run servo-own  run those of a group alone

Each component has two laws: that of the fit, whose parameters are the truth, and one of another form, where the truth
is what the fit gives without noise and drift. Oil warms over a test of leakage, transmitters and feedback drift, noise
is correlated over rows or samples.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from stillhook.base.arrays import FloatArray
from stillhook.identify.component.leak_table import LeakData, Unit
from stillhook.identify.component.leakage import motor_leakage, pump_leakage
from stillhook.identify.component.lines import line_restrictions
from stillhook.identify.component.result import Component
from stillhook.identify.component.servo import servo, swash_log
from stillhook.identify.component.swash_fit import SwashFit, kernel
from stillhook.logs.types import Log
from stillhook.units import parse
from trials import store

STORE = Path(__file__).resolve().parent / "outcomes.json"
SEEDS = range(3000, 3064)  # the intervals were settled on seeds 0 to 15
CM3, RPM, BAR, LMIN = (parse(f"1 {u}", k) for u, k in zip(
    ("cm^3/rev", "rev/min", "bar", "L/min"), ("displacement", "rotation", "pressure", "flow"), strict=True
))  # fmt: skip
C = LMIN / BAR
OWN, OTHER = "own", "other"


class Trial(NamedTuple):
    """One table or log."""

    component: str
    law: str
    seed: int

    @property
    def key(self) -> str:
        return f"{self.component}-{self.law}-{self.seed}"


class Made(NamedTuple):
    """Data as measured, the same without noise and drift, and the truth by name where the law is that of the fit."""

    measured: Callable[[], Component]
    clean: Callable[[], Component]
    truth: Mapping[str, float]


def correlated(rng: np.random.Generator, n: int, length: float) -> FloatArray:
    """Noise of unit deviation, correlated over `length` rows or samples."""
    a = math.exp(-1.0 / length)
    return np.asarray(lfilter([math.sqrt(1.0 - a * a)], [1.0, -a], rng.standard_normal(n + 500))[500:])


def drift(rng: np.random.Generator, n: int) -> FloatArray:
    """A walk, a sinusoid or a warm-up of zero mean and unit span."""
    x = np.linspace(0.0, 1.0, n)
    form = rng.integers(3)
    y = (
        np.cumsum(rng.standard_normal(n)) if form == 0
        else np.sin(2.0 * math.pi * (rng.uniform(0.5, 3.0) * x + rng.uniform())) if form == 1
        else 1.0 - np.exp(-x / rng.uniform(0.1, 0.5))
    )  # fmt: skip
    return np.asarray((y - y.mean()) / max(float(np.ptp(y)), 1e-12) * rng.choice((-1.0, 1.0)))


def leak_rows(rng: np.random.Generator, D: FloatArray, n: FloatArray, dp: FloatArray) -> tuple[FloatArray, ...]:
    """Settings of a test, one axis after the other, in an order of its own."""
    axes = [D, n, dp]
    order = rng.permutation(3)
    grid = np.meshgrid(*(axes[i] for i in order), indexing="ij")
    out = [np.empty(0)] * 3
    for i, values in zip(order, grid, strict=True):
        out[i] = values.ravel()
    return tuple(out)


def disturbed(rng: np.random.Generator, Q: FloatArray) -> FloatArray:
    """A leak with oil that warms by some kelvin over the test, and a flow meter's noise, part of it relative."""
    warm = 1.0 + rng.uniform(0.03, 0.12) * drift(rng, len(Q))
    noise = rng.uniform(0.01, 0.04) * correlated(rng, len(Q), rng.uniform(1.0, 6.0))
    return np.asarray(np.maximum(Q * warm * (1.0 + noise) + 0.02 * LMIN * rng.standard_normal(len(Q)), 0.0))


def motor(trial: Trial, rng: np.random.Generator) -> Made:
    D_max = rng.uniform(107.0, 280.0) * CM3
    D, n, dp = leak_rows(
        rng,
        D_max * np.array([0.4, 0.6, 0.8, 1.0]),
        RPM * np.array([200.0, 600.0, 1000.0, 1500.0, 2000.0]),
        BAR * np.array([50.0, 100.0, 200.0, 300.0, 350.0]),
    )
    C_1, C_2 = rng.uniform(0.01, 0.05) * C, rng.uniform(3e-6, 15e-6) * C / RPM
    law = C_1 + C_2 * n
    if trial.law == OTHER:
        a, b = rng.uniform(0.6, 1.6), rng.uniform(-0.15, 0.3)
        law = (C_1 + C_2 * n * (n / (1000.0 * RPM)) ** (a - 1.0)) * (dp / (200.0 * BAR)) ** b
        law = law * (1.0 + rng.uniform(-0.2, 0.2) * (D / D_max - 0.7))
    noisy = disturbed(rng, law * dp)
    data = LeakData(Unit.MOTOR, D, n, dp, noisy, None, D_max, trial.key, ())
    clean = LeakData(Unit.MOTOR, D, n, dp, law * dp, None, D_max, trial.key, ())
    return Made(lambda: motor_leakage(data), lambda: motor_leakage(clean), {"C_1": C_1, "C_2": C_2})


def pump(trial: Trial, rng: np.random.Generator) -> Made:
    D_max, part = 355.0 * CM3, np.array([0.2, 0.4, 0.6, 0.8, 1.0])
    speeds = RPM * np.array([1500.0, 2000.0])
    D, n, dp = leak_rows(rng, D_max * part, speeds, BAR * np.array([50.0, 100.0, 175.0, 250.0, 300.0, 350.0]))
    table = C * rng.uniform(0.02, 0.06, (2, 5))
    law = np.array([np.interp(x / D_max, part, table[0 if y == speeds[0] else 1]) for x, y in zip(D, n, strict=True)])
    if trial.law == OTHER:
        law = law * (dp / (200.0 * BAR)) ** rng.uniform(-0.2, 0.4)
    share = rng.uniform(0.5, 0.9)
    Q = law * dp
    noisy = disturbed(rng, Q)
    case = np.maximum(
        (1.0 - share) * Q * noisy / np.maximum(Q, 1e-12) * (1.0 + 0.03 * correlated(rng, len(Q), 4.0)), 0.0
    )
    data = LeakData(Unit.PUMP, D, n, dp, noisy, case, D_max, trial.key, ())
    clean = LeakData(Unit.PUMP, D, n, dp, Q, (1.0 - share) * Q, D_max, trial.key, ())
    names = {f"C_{100 * p:.0f}@{s / RPM:.0f}": table[j, i] for j, s in enumerate(speeds) for i, p in enumerate(part)}
    return Made(lambda: pump_leakage(data), lambda: pump_leakage(clean), names | {"internal_share": share})


def command(rng: np.random.Generator, n: int, h: float, lo: float, hi: float) -> FloatArray:
    """Steps and sinusoids, as swivel tests have them."""
    u, k = np.empty(n), 0
    while k < n:
        m = int(rng.uniform(2.0, 5.0) / h)
        level = rng.uniform(lo, hi)
        t = h * np.arange(m)
        sine = rng.uniform() < 0.3
        wave = 0.3 * (hi - lo) * np.sin(2.0 * math.pi * t / rng.uniform(2.0, 8.0)) if sine else 0.0
        u[k : k + m] = np.clip(level + wave, lo, hi)[: n - k] if sine else level
        k += m
    return u


def swivel(trial: Trial, rng: np.random.Generator) -> Made:
    of_motor = trial.seed % 2 == 1
    h, T = 0.01, 90.0
    n = int(T / h)
    u = command(rng, n, h, *((0.2, 1.0) if of_motor else (-0.9, 0.9)))
    w, z = (
        (rng.uniform(3.0, 9.0), rng.uniform(0.8, 1.2)) if of_motor else (rng.uniform(20.0, 40.0), rng.uniform(0.7, 1.1))
    )
    fit = SwashFit(
        omega_n=w,
        zeta=z,
        dead_time=rng.uniform(0.01, 0.06),
        gain=rng.uniform(0.95, 1.03),
        offset=rng.uniform(0.0, 0.08) if of_motor else 0.0,
        half_width=rng.uniform(0.005, 0.03) if of_motor else 0.0,
        rate=rng.uniform(0.5, 1.0) if of_motor else 1e6,
        rate_down=rng.uniform(0.4, 0.9) if of_motor else 1e6,
    )
    fine = 4
    out, middle = np.empty(n * fine), 0.5 * float(u.max() + u.min())
    held = np.repeat(u, fine) - middle
    at = fit._replace(dead_time=fit.dead_time + 0.5 * h / fine)
    kernel()(held, n * fine, h / fine, 2, np.array(at), 1, float(fit.gain * held[0] + fit.offset), out)
    if trial.law == OTHER:  # a valve before the plate, and a filter in the feedback
        for tau in (rng.uniform(0.1, 0.25) / w, rng.uniform(0.002, 0.01)):
            a = math.exp(-h / fine / tau)
            out = np.asarray(lfilter([1.0 - a], [1.0, -a], out, zi=[a * out[0]])[0])
    alpha, t = out[::fine] + middle, h * np.arange(n)
    noise = rng.uniform(0.002, 0.006) * correlated(rng, n, rng.uniform(1.0, 10.0)) + rng.uniform(0.002, 0.01) * drift(
        rng, n
    )
    log = lambda a: swash_log(
        logged(trial, t, {"u_m" if of_motor else "u_p": u, "alpha_m" if of_motor else "alpha_p": a})
    )
    truth = {name: float(value) for name, value in fit._asdict().items()}
    return Made(lambda: servo(log(alpha + noise)), lambda: servo(log(alpha)), truth)


def lines(trial: Trial, rng: np.random.Generator) -> Made:
    h, n = 0.02, 9000
    t = h * np.arange(n)
    Q = 1500.0 * LMIN * np.asarray(lfilter([0.02], [1.0, -0.98], command(rng, n, h, -1.0, 1.0)))
    R_1, R_2 = rng.uniform(5e-4, 3e-3) * BAR / LMIN, rng.uniform(1e-6, 5e-6) * BAR / LMIN**2
    drop = R_1 * Q + R_2 * Q * np.abs(Q)
    if trial.law == OTHER:  # Blasius in the pipes, blocks as an orifice
        drop = np.sign(Q) * (R_1 * 1000.0 * LMIN * np.abs(Q / (1000.0 * LMIN)) ** 1.75 + R_2 * Q**2)
    drop = drop + rng.uniform(0.5e8, 3e8) * np.gradient(Q, h)
    base = {"a": 150.0 * BAR + 60.0 * BAR * drift(rng, n), "b": 25.0 * BAR + 0.0 * t}

    def made(noise: float) -> Component:
        def err() -> FloatArray:
            walk = rng.uniform(0.1, 0.4) * BAR * drift(rng, n) + rng.normal(0.0, 0.3 * BAR)
            return noise * (0.2 * BAR * correlated(rng, n, 5.0) + walk)

        signals = {"Q_line": Q}
        for line, sign in (("a", 1.0), ("b", -1.0)):
            signals[f"p_{line}_pump"] = base[line] + 0.5 * sign * drop + err()
            signals[f"p_{line}_motor"] = base[line] - 0.5 * sign * drop + err()
        return line_restrictions(logged(trial, t, signals))

    truth = {f"R_{k}_{line}": R for k, R in ((1, R_1), (2, R_2)) for line in "ab"}
    return Made(lambda: made(1.0), lambda: made(0.0), truth)


def logged(trial: Trial, t: FloatArray, signals: Mapping[str, FloatArray]) -> Log:
    h = float(t[1] - t[0])
    return Log(trial.key, t, dict(signals), {}, (), (), 1.0 / h, len(t), h)


COMPONENTS: Mapping[str, Callable[[Trial, np.random.Generator], Made]] = {
    "motor": motor,
    "pump": pump,
    "servo": swivel,
    "lines": lines,
}
TRIALS = {
    trial.key: trial for component in COMPONENTS for law in (OWN, OTHER) for seed in SEEDS
    for trial in (Trial(component, law, seed),)
}  # fmt: skip


def outcome(trial: Trial) -> dict[str, Any]:
    """Which intervals hold the truth, how wide they are and how far off: over the truth, or of full displacement
    where that may be 0."""
    made = COMPONENTS[trial.component](trial, np.random.default_rng([trial.seed, len(trial.component), len(trial.law)]))
    result = made.measured()
    if trial.law == OWN:
        truth = dict(made.truth)
    else:
        clean = made.clean()
        truth = {p.name: p.estimate.value for p in clean.parameters}
    judged = [p for p in result.parameters if p.name in truth and p.name in made.truth]
    of_full = ("offset", "half_width", "gain")
    size = {p.name: 1.0 if p.name in of_full else max(abs(truth[p.name]), 1e-300) for p in judged}
    return {
        "inside": {p.name: bool(p.estimate.contains(truth[p.name])) for p in judged},
        "half": {p.name: float(f"{p.estimate.half / size[p.name]:.4g}") for p in judged},
        "error": {p.name: float(f"{abs(p.estimate.value - truth[p.name]) / size[p.name]:.4g}") for p in judged},
        "usable": result.usable,
    }


def kept() -> dict[str, Any]:
    """Outcomes that are there."""
    return store.read(STORE)


if __name__ == "__main__":
    store.run(STORE, TRIALS, outcome, store.judging_code(), sys.argv[1:], group=lambda key: key.rpartition("-")[0])
