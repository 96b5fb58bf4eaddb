"""Samples of a winch whose loss differs from its file by a law that is written here, and models of them."""

from __future__ import annotations

from functools import cache

import numpy as np

from stillhook.library import load_crane
from stillhook.live.residual import LearningLog, Model, Sea, train
from stillhook.live.residual.samples import BIN, Samples

CRANE = load_crane("nov-250t")
TORQUE = 30.0
"""Size of what the law leaves over [N m]."""
NOISE = 6.0
"""Noise of a sample [N m], correlated over some seconds."""


def law(omega: np.ndarray) -> np.ndarray:
    """What adaptation leaves over: a curve over speed that no single factor takes off [N m]."""
    speed = np.abs(omega) / 60.0
    return TORQUE * np.sign(omega) * (1.5 * speed - 1.0 + 0.5 * np.cos(3.0 * speed))


def samples(seed: int, *, size: float = 1.0, noise: float = NOISE, fastest: float = 110.0, n: int = 1500) -> Samples:
    """Samples of one log of its own sea; size: times the law."""
    rng = np.random.default_rng(seed)
    t = BIN * np.arange(n)
    phase = 2.0 * np.pi * (t / rng.uniform(8.0, 12.0) + rng.uniform())
    omega = rng.uniform(0.8, 1.0) * fastest * np.sin(phase)
    omega = np.where(np.abs(omega) < 10.0, 10.0 * np.where(omega < 0.0, -1.0, 1.0), omega)
    white = rng.normal(size=n + 10)
    wander = noise * np.convolve(white, np.ones(10) / np.sqrt(10.0), "valid")[:n]
    load = 0.6e6 + 0.4e6 * (seed % 3)
    return Samples(
        t=t,
        left=size * law(omega) + wander,
        modelled=900.0 * np.sign(omega),
        omega=omega,
        rate=np.gradient(omega, BIN),
        F=load + 1e4 * rng.normal(size=n),
        alpha_m=np.full(n, 0.8) + 0.05 * rng.normal(size=n),
        alpha_pm=np.full(n, load / 3e6) + 0.01 * rng.normal(size=n),
        layer=np.full(n, float(5 + seed % 2)),
        warm=1.0 - np.exp(-t / 1200.0),
    )


def logs(campaigns: int, *, size: float = 1.0, noise: float = NOISE, first: int = 0) -> list[LearningLog]:
    """Two logs of each campaign, no two seas alike."""
    return [
        LearningLog(f"{k}-{i}", f"day {k}", Sea(1.0 * 1.3 ** (2 * k + i), 9.0), f"{k}-{i}", x)
        for k in range(first, first + campaigns)
        for i in range(2)
        for x in [samples(100 * k + i, size=size, noise=noise)]
    ]


@cache
def learned(size: float = 1.0) -> Model:
    """A model of six campaigns."""
    return train(CRANE, logs(6, size=size))[0]
