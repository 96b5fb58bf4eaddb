"""A complete table of lifts in the time domain: `python -m benchmarks.lift_table [--share 0.07] [--threads 2]
[--json]`.

The deep phase of the embedded lift plan, half an hour of compensation at 1,500 m in every sea of its table (12 heights,
10 periods, 3 headings) and 10 seeds: 3,600 lifts as a plan runs them (step, nodes of the wire, interval of statistics),
tip motions made as they are run. --share
runs as many of its columns and extrapolates to all of them; processor time is what counts where others use the machine.
The share of the compiled kernel is reported; the remainder is what faster code around it could save.
"""

import argparse
import json
import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter, process_time, thread_time
from typing import Any

from stillhook.engine.lowering.run import setup_of
from stillhook.engine.simulate import simulate
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.lanes import VL
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.file import load_plan
from stillhook.plan.tiers.time_domain.lowering import nodes_of, sampling_of, step_of
from stillhook.spec.lift.lowering import DeepWire, InSea
from stillhook.spec.lift.phase import Phase

PLAN, PHASE = "template-to-1500m", "deep"
SEEDS = 10
HALF_AN_HOUR = 1800.0
GOAL = 60.0
"""Target: wall time of the complete table on two cores [s]."""


def table(plan: LiftPlan, seeds: int = SEEDS) -> list[InSea]:
    """Every lift of the table."""
    programme = (Phase(mode="ahc", time=f"{HALF_AN_HOUR + 60.0!r} s"),)
    hanging = plan.hanging(plan.phase(PHASE).z_start or 0.0)
    wire = DeepWire(nodes=nodes_of(plan, plan.phase(PHASE)))
    lift = hanging.model_copy(update={"programme": programme, "duration": HALF_AN_HOUR, "wire": wire})
    seas, e = plan.environment.table(), plan.environment
    cells = zip(seas.Hs.tolist(), seas.Tp.tolist(), seas.beta.tolist(), strict=True)
    return [
        InSea(lift, e.sea(*cell), seed, plan.vessel, plan.at.x, plan.at.y) for cell in cells for seed in range(seeds)
    ]


@contextmanager
def timed(plant: str, setup: Setup) -> Iterator[Callable[[], float]]:
    """Processor time that the kernel takes meanwhile [s], on all threads."""
    module = driver(plant, VL, setup)
    run, lock, spent = module.run, threading.Lock(), [0.0]

    def kernel(*args: Any) -> None:
        start = thread_time()
        run(*args)
        with lock:
            spent[0] += thread_time() - start

    module.run = kernel  # type: ignore[attr-defined]
    try:
        yield lambda: spent[0]
    finally:
        module.run = run  # type: ignore[attr-defined]


def measured(plan: LiftPlan, *, share: float, threads: int) -> dict[str, float]:
    """Speed of a share of the table; times in seconds."""
    cases = table(plan)
    every, column = max(1, round(1.0 / share)), SEEDS * len(plan.environment.Hs)
    some = [case for i, case in enumerate(cases) if i // column % every == every // 2]
    step, sampling = f"{step_of(plan)!r} s", f"{sampling_of(plan)!r} s"
    simulate(plan.crane, some[:1], step=step)  # compiles
    with timed(plan.crane.plant.value, setup_of(cases[0].lift)) as kernel:
        wall, cpu = perf_counter(), process_time()
        run = simulate(plan.crane, some, step=step, sampling=sampling, threads=threads)
        wall, cpu = perf_counter() - wall, process_time() - cpu
        alone = kernel()
    simulated = len(some) * HALF_AN_HOUR
    return {
        "n_cases": len(cases),
        "n_run": len(some),
        "n_failed": int((run.status == "diverged").sum()),
        "wall": wall,
        "processor": cpu,
        "kernel": alone,
        "kernel_share": alone / cpu,
        "times_real": simulated / cpu,
        "times_real_kernel": simulated / alone,
        "whole_table_2_cores": math.ceil(len(cases) / len(some) * cpu / 2.0),
        "whole_table_wall": math.ceil(len(cases) / len(some) * wall),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=0.07, help="part of the table that is run")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    values = measured(load_plan(PLAN), share=args.share, threads=args.threads)
    if args.json:
        print(json.dumps(values))
        return
    print(
        f"{values['n_run']:.0f} of {values['n_cases']:.0f} lifts of half an hour in {values['wall']:.1f} s,"
        f" {values['n_failed']:.0f} failed"
    )
    print(
        f"a core runs {values['times_real']:,.0f} times real time, the kernel alone {values['times_real_kernel']:,.0f}",
        end=" ",
    )
    print(f"({100.0 * values['kernel_share']:.0f} % of the processor time)")
    print(f"complete table: {values['whole_table_2_cores']:.0f} s on two idle cores; target {GOAL:.0f} s")


if __name__ == "__main__":
    main()
