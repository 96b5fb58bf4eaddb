"""Speed against references, in one table: `python -m benchmarks.run [--json]` (`make bench`).

Every figure is simulated seconds per second. "Wall" is wall-clock time; "per core" is processor time, which
other programs on the machine disturb less. Measurements are interleaved (A B A B ...) and medians are shown. Ratios are
medians of the ratios within a round.
"""

import argparse
import json
import os
import platform
import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numba
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.c_reference import COMMON, WIDTHS, CKernel, compile_c, compiler, gcc_version
from benchmarks.cases import CRANE, Sample, crane, kernel_run, lifts
from benchmarks.scipy_reference import RTOL, SolverRun
from stillhook import Scenario
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.kernels.lanes import VL, flatten

ROUNDS = 7
GOAL = 0.7
"""Our kernel over the generated C, both with sixteen lanes, that we want to reach."""

Job = Callable[[], Sample]


class Row(NamedTuple):
    """One line of the table: simulated seconds per wall second and per second of one core."""

    name: str
    wall: float
    core: float


class Report(NamedTuple):
    """All results of the benchmark."""

    machine: str
    rows: list[Row]
    ratios: dict[str, float]
    differences: dict[str, float]
    notes: list[str]


def complete_run(work: Callable[[], Any], simulated: float) -> Job:
    """A job that times everything that a caller waits for."""

    def job() -> Sample:
        wall, cpu = perf_counter(), process_time()
        work()
        return Sample(simulated, perf_counter() - wall, process_time() - cpu)

    return job


def product_jobs() -> dict[str, Job]:
    """What a user gets: cases in, statistics or series out."""
    c, one, block, many = crane(), lifts(1, 600.0)[0], lifts(VL, 600.0), lifts(2 * VL, 1200.0)

    def single(n_sub: int) -> Job:
        return complete_run(lambda: run_cases(c, [one], step=n_sub, lanes=1, every=10, keep=unchanged)[0], one.duration)

    def batch(cases: list[Scenario], n_sub: int, threads: int) -> Job:
        return complete_run(
            lambda: run_cases(c, cases, step=n_sub, lanes=VL, threads=threads, keep=unchanged),
            sum(s.duration for s in cases),
        )

    jobs = {
        "one trajectory with series, 1 ms": single(10),
        "one trajectory with series, 2 ms": single(5),
        "batch of 16 x 10 min with statistics, 1 ms, 1 thread": batch(block, 10, 1),
        "batch of 32 x 20 min with statistics, 5 ms, 1 thread": batch(many, 2, 1),
    }
    if (os.cpu_count() or 1) > 1:
        jobs["batch of 32 x 20 min with statistics, 5 ms, 2 threads"] = batch(many, 2, 2)
    return jobs


def kernel_jobs(libraries: dict[str, Any]) -> dict[str, Job]:
    """The kernels alone, ours and C's, on the same arrays."""
    jobs: dict[str, Job] = {}
    for lanes, label in ((1, "one lane"), (VL, "16 lanes")):
        cases = lifts(lanes, 400.0 if lanes == 1 else 120.0)
        for n_sub, step in ((10, "1 ms"), (2, "5 ms")):
            kernels = {"ours": None} | {f"C, {w}": CKernel(lib, lanes) for w, lib in libraries.items()}
            for name, kernel in kernels.items():
                jobs[f"kernel, {label}, {step}: {name}"] = lambda c=cases, n=n_sub, k=kernel: (
                    kernel_run(c, n, kernel=k).sample
                )  # type: ignore[misc]
    return jobs


def interleave(jobs: dict[str, Job], rounds: int) -> dict[str, list[Sample]]:
    """Every job once per round, after one round that is not counted."""
    for job in jobs.values():
        job()
    samples: dict[str, list[Sample]] = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            samples[name].append(job())
    return samples


def rows(samples: dict[str, list[Sample]]) -> list[Row]:
    return [
        Row(name, statistics.median(s.simulated / s.wall for s in v), statistics.median(s.simulated / s.cpu for s in v))
        for name, v in samples.items()
    ]


def ratio(samples: dict[str, list[Sample]], a: str, b: str, *, wall: bool = False) -> float:
    """Speed of a over speed of b: the median over the rounds."""
    pairs = zip(samples[a], samples[b], strict=True)
    return statistics.median(
        (x.simulated / (x.wall if wall else x.cpu)) / (y.simulated / (y.wall if wall else y.cpu)) for x, y in pairs
    )


def scipy_rows() -> list[Row]:
    """solve_ivp with machine code and with plain Python for the right-hand side; short, it is slow."""
    case = Scenario(
        load="100 t", s_w="100 m", tip="sine 2.8 m 12 s", mode="ssc", duration="6 s", ramp="2 s", warm_up="0 s"
    )
    brief = case.model_copy(update={"duration": 0.5})
    SolverRun(brief, compiled=True).go("LSODA")
    samples = {}
    for method in ("LSODA", "RK45"):
        samples[f"scipy solve_ivp {method}, rtol {RTOL:g}, compiled rates"] = [
            SolverRun(case, compiled=True).go(method) for _ in range(3)
        ]
    samples[f"scipy solve_ivp LSODA, rtol {RTOL:g}, plain Python rates"] = [
        SolverRun(brief, compiled=False).go("LSODA") for _ in range(3)
    ]
    return rows(samples)


def difference(library: Any, lanes: int) -> float:
    """Largest difference between C's run and ours: of the series relative to each signal's largest value, of the end
    state likewise."""
    cases = lifts(lanes, 60.0)
    ours, theirs = (kernel_run(cases, 2, every=1, kernel=k).block for k in (None, CKernel(library, lanes)))
    a, b = ours.out.reshape(-1, len(ours.d.columns), lanes), theirs.out.reshape(-1, len(ours.d.columns), lanes)
    series = np.max(np.abs(a - b), axis=0) / np.maximum(np.max(np.abs(a), axis=0), 1e-9)
    worst = float(np.max(series))
    for x, y in zip(ours.results(), theirs.results(), strict=True):
        p, q = np.array(flatten(x.stats)), np.array(flatten(y.stats))
        worst = max(worst, float(np.max(np.abs(p - q) / np.maximum(np.abs(p), 1e-6))))
    return worst


def best_builds(samples: dict[str, list[Sample]]) -> list[Row]:
    """Our kernels, and of the C builds of each line the fastest."""
    starts = dict.fromkeys(n.split(":")[0] for n in samples)
    keep = {fastest(samples, s) for s in starts if any(n.startswith(f"{s}: C") for n in samples)}
    return rows({n: v for n, v in samples.items() if n.endswith("ours") or n in keep})


def fastest(samples: dict[str, list[Sample]], start: str) -> str:
    """Name of the fastest of the C builds whose rows begin so."""
    builds = [n for n in samples if n.startswith(f"{start}: C")]
    return max(builds, key=lambda n: statistics.median(s.simulated / s.cpu for s in samples[n]))


def measure(rounds: int = ROUNDS) -> Report:
    """All measurements."""
    notes, ratios, differences = [], {}, {}
    busy = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    if busy > 0.5:
        notes.append(
            f"Other programs were running (load {busy:.1f}): figures by wall time, and the gain of two threads, are too"
            " low."
        )
    product = interleave(product_jobs(), rounds)
    names = list(product)
    if len(names) > 4:
        ratios["2 threads over 1 thread (wall; near-linear is 2)"] = ratio(product, names[4], names[3], wall=True)
        ratios["2 threads over 1 thread, work per second of a core (1 = no loss)"] = ratio(product, names[4], names[3])
    with tempfile.TemporaryDirectory() as folder:
        libraries = {}
        if compiler() is None:
            notes.append("gcc is not installed: no C reference in this run.")
        else:
            built = {w: compile_c(crane().plant.value, Path(folder), f"{COMMON} {f}") for w, f in WIDTHS.items()}
            libraries = {w: lib for w, lib in built.items() if lib is not None}
            notes.append(
                f"C: {gcc_version()}, {COMMON}, compiled for each vector width; the fastest build of each line is"
                " shown."
            )
        kernels = interleave(kernel_jobs(libraries), rounds)
        if libraries:
            for start in dict.fromkeys(n.split(":")[0] for n in kernels):
                ratios[f"ours over C, {start.removeprefix('kernel, ')}"] = ratio(
                    kernels, f"{start}: ours", fastest(kernels, start)
                )
            for lanes in (1, VL):
                worst = max(difference(lib, lanes) for lib in libraries.values())
                differences[f"C against ours, {lanes} lane{'s' if lanes > 1 else ''}, 60 s"] = worst
    reference = scipy_rows()
    best = next(r for r in rows(product) if "5 ms, 1 thread" in r.name)
    ratios["our batch at 5 ms over scipy with compiled rates"] = best.core / max(
        r.core for r in reference if "compiled" in r.name
    )
    return Report(machine(), [*rows(product), *best_builds(kernels), *reference], ratios, differences, notes)


def machine() -> str:
    cpu = llvm.get_host_cpu_name()
    return (
        f"{platform.machine()} {cpu}, {os.cpu_count()} cores, Python {platform.python_version()}, Numba"
        f" {numba.__version__}"
    )


def show(report: Report) -> None:
    console = Console(width=118, soft_wrap=False)
    table = Table(title=f"Simulated seconds per second, {CRANE}\n{report.machine}", title_justify="left")
    table.add_column("measurement")
    table.add_column("wall", justify="right")
    table.add_column("per core", justify="right")
    for r in report.rows:
        table.add_row(r.name, f"{r.wall:,.0f}", f"{r.core:,.0f}")
    console.print(table)
    lines = Table(title="Ratios", title_justify="left", show_header=False)
    lines.add_column()
    lines.add_column(justify="right")
    for name, value in report.ratios.items():
        lines.add_row(name, f"{value:,.2f}")
    console.print(lines)
    for name, value in report.differences.items():
        console.print(f"Largest relative difference, {name}: {value:.1e}")
    for note in report.notes:
        console.print(note)
    against = [v for k, v in report.ratios.items() if k.startswith("ours over C, 16")]
    if against:
        console.print(
            f"Goal: ours over C with 16 lanes at least {GOAL}: {'reached' if min(against) >= GOAL else 'MISSED'}."
        )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.run", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument(
        "--rounds", type=int, default=ROUNDS, help="rounds of interleaved measurements (default %(default)s)"
    )
    options = parser.parse_args()
    report = measure(options.rounds)
    if options.json:
        json.dump({**report._asdict(), "rows": [r._asdict() for r in report.rows]}, sys.stdout, indent=2)
        print()
    else:
        show(report)


if __name__ == "__main__":
    main()
