"""The cases that are measured: sixteen different lifts on one crane."""

from dataclasses import replace
from time import perf_counter, thread_time
from typing import Any, NamedTuple

from stillhook import Scenario, load_crane
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.kernels.build import driver
from stillhook.spec.crane import Crane

CRANE = "nov-250t"
MODES = ("ns", "hs", "ssc", "ssc-cubic")


def crane() -> Crane:
    return load_crane(CRANE)


def lift(i: int, duration: float) -> Scenario:
    """Number i of a family of lifts that differ in load, motion, mode and wire out."""
    return Scenario(
        load=f"{20 + 7 * (i % 12)} t",
        s_w=f"{60 + 20 * (i % 16)} m",
        tip=f"sine {1.0 + 0.1 * (i % 16):.1f} m {10 + i % 4} s",
        mode=MODES[i % len(MODES)],
        duration=f"{duration} s",
    )


def lifts(n: int, duration: float) -> list[Scenario]:
    return [lift(i, duration) for i in range(n)]


class Sample(NamedTuple):
    """One measurement: simulated time [s] of all cases together, wall time and processor time [s] that it took."""

    simulated: float
    wall: float
    cpu: float


class KernelRun(NamedTuple):
    """A block after its run, and the time spent in the kernel alone."""

    block: ScenarioBlock
    sample: Sample


def kernel_run(cases: list[Scenario], n_sub: int, *, every: int = 0, kernel: Any = None) -> KernelRun:
    """The cases side by side through one block; `kernel` replaces the compiled `run` and `at_rest` (None: ours)."""
    c = crane()
    block = ScenarioBlock([Ready.of(c, s) for s in cases], lanes=len(cases), n_sub=n_sub, every=every)
    ours = driver(c.plant.value, len(cases))
    spent = [0.0, 0.0]
    run = ours.run if kernel is None else kernel.run

    def timed(*args: Any) -> None:
        wall, cpu = perf_counter(), thread_time()
        run(*args)
        spent[0] += perf_counter() - wall
        spent[1] += thread_time() - cpu

    block.d = replace(ours, run=timed)
    for _ in block.steps():
        pass
    return KernelRun(block, Sample(len(cases) * cases[0].duration, spent[0], spent[1]))
