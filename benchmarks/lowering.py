"""Speed of lowerings: `python -m benchmarks.lowering`. Simulated seconds per second of one core (processor time), after
compilation."""

import statistics
from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from stillhook import load_crane
from stillhook.engine.simulate import run_cases, simulate, unchanged
from stillhook.kernels.lanes import VL
from stillhook.sea.motion.motion import Sine
from stillhook.sea.vessel.realisation import WaveField
from stillhook.spec.lift.lowering import DeepWire, Lowering
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase

ROUNDS = 3
HOUR = 3600.0


def template() -> Payload:
    """A plain structure of 100 t."""
    levels = tuple(
        {"h": f"{h} m", "V": f"{4 * h} m^3", "A33": f"{30 * h} t", "A_p": f"{8 * h} m^2"} for h in (0.0, 5.0)
    )
    return Payload(name="template", mass="100 t", height="5 m", C_D=2.5, levels=levels)


def water(duration: float) -> WaveField:
    """A regular wave of 0.5 m and 8 s on 22 levels of deep water, sampled every 0.1 s."""
    omega, dt = 2.0 * np.pi / 8.0, 0.1
    t = np.arange(round(duration / dt) + 2)[:, None] * dt
    down = np.exp(-(omega**2) / 9.80665 * 2.0 * (np.exp(0.2 * np.arange(22)) - 1.0))
    c, s = 0.5 * np.cos(omega * t), 0.5 * np.sin(omega * t)
    return WaveField(
        dt=dt, eta=c[:, 0], eta_dot=-omega * s[:, 0], w=-omega * s * down, a=-(omega**2) * c * down, z_0=2.0, ds=0.2
    )


def hour_at_depth(i: int) -> Lowering:
    """One hour of compensation at 3,000 m on 20 elements of wire."""
    return Lowering(
        payload=template(),
        tip=Sine(amplitude=f"{0.6 + 0.02 * i} m", period=f"{8 + 0.2 * i} s"),
        h_tip="25 m",
        depth="3100 m",
        start_depth="3000 m",
        programme=(Phase(mode="ahc", time=f"{HOUR - 60} s"),),
        duration=f"{HOUR} s",
        wire=DeepWire(nodes=20),
    )


def through_the_splash_zone(i: int) -> Lowering:
    """Ten minutes from air to 50 m through waves, in splash mode and compensated."""
    stages = (Phase(mode="splash", speed="6 m/min", depth="15 m"), Phase(mode="ahc", speed="12 m/min", depth="50 m"))
    return Lowering(
        payload=template(),
        tip=Sine(amplitude=f"{0.6 + 0.02 * i} m", period=f"{8 + 0.2 * i} s"),
        waves=water(600.0),
        h_tip="25 m",
        depth="300 m",
        start_depth="-2 m",
        programme=stages,
        duration="600 s",
        wire=DeepWire(nodes=20),
    )


def rate(work: Callable[[], Any], simulated: float) -> float:
    """Simulated over processor time, median of some rounds; the first one compiles and does not count."""
    work()
    spent = []
    for _ in range(ROUNDS):
        start = process_time()
        work()
        spent.append(process_time() - start)
    return simulated / statistics.median(spent)


def main() -> None:
    crane = load_crane("deep-250t")
    table = Table(
        "lowering", "times real time", "target", title=f'"{crane.name}", 20 elements of wire, step 5 ms, one core'
    )
    for name, make, duration, goals in (
        ("one hour of AHC at 3,000 m", hour_at_depth, HOUR, ("1,000", "8,000")),
        ("splash zone in waves, 10 min", through_the_splash_zone, 600.0, ("1,000", "")),
    ):
        one, many = make(0), [make(i) for i in range(VL)]
        alone = rate(lambda: run_cases(crane, [one], step=2, lanes=1, keep=unchanged), duration)  # noqa: B023
        batch = rate(lambda: simulate(crane, many, threads=1, on_failure="mark"), VL * duration)  # noqa: B023
        table.add_row(f"{name}, alone", f"{alone:,.0f}", goals[0])
        table.add_row(f"{name}, {VL} side by side", f"{batch:,.0f}", goals[1])
    Console().print(table)


if __name__ == "__main__":
    main()
