"""What a planner waits for: `python -m benchmarks.plan [--quick] [--threads 2] [--json]`.

The embedded lift plan, from the command line to the finished report, each run a process of its own: the frequency tier,
residuals of the winch recomputed and from the disk cache, then (not with --quick) all tiers. Wall time, and
processor time, which other programs on the machine disturb less; both cores are busy in the twin's tier alone. Kernels
are compiled before.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from stillhook.kernels.build import kernel_hash
from stillhook.kernels.cache import cache_root

PLAN = "template-to-1500m"
QUICK_GOAL, GOAL = 10.0, 120.0
"""Targets: the frequency tier alone, and all tiers to the finished report, on two cores [s]."""


class Spent(NamedTuple):
    """Wall and processor time [s] of one process, and its exit code."""

    name: str
    wall: float
    processor: float
    code: int
    goal: float


def run(name: str, cache: Path, args: list[str], goal: float) -> Spent:
    """One call of the command line."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
    env = {**os.environ, "STILLHOOK_CACHE": str(cache)}
    command = [str(Path(sys.executable).with_name("stillhook")), "plan", PLAN, *args]
    code = subprocess.run(
        command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False
    ).returncode
    wall, after = perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Spent(name, wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, code, goal)


def compiled_only(folder: Path) -> Path:
    """A cache with the kernels of this code and nothing else."""
    for path in cache_root().glob(f"{kernel_hash()}-*"):
        (folder / path.name).symlink_to(path)
    return folder


def measured(*, quick: bool, threads: int) -> list[Spent]:
    """Every call, one after another."""
    run("compiles", cache_root(), ["--tier", "frequency", "--workers", str(threads)], QUICK_GOAL)
    with tempfile.TemporaryDirectory() as folder:
        cache, out = compiled_only(Path(folder)), Path(folder) / "plan"
        common = ["--workers", str(threads)]
        results = [
            run("frequency tier, residuals recomputed", cache, ["--tier", "frequency", *common], QUICK_GOAL),
            run("frequency tier, residuals from the cache", cache, ["--tier", "frequency", *common], QUICK_GOAL),
        ]
        if not quick:
            results.append(run("all tiers, to the finished report", cache, ["--out", str(out), *common], GOAL))
            results.append(run("the same again, runs from the store", cache, ["--out", str(out), *common], GOAL))
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="the frequency tier alone")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    results = measured(quick=args.quick, threads=args.threads)
    if args.json:
        print(json.dumps([spent._asdict() for spent in results]))
        return
    table = Table(
        "run",
        "wall",
        "processor",
        "target",
        "exit code",
        title=f'Lift plan "{PLAN}", {args.threads} threads, seconds',
    )
    for spent in results:
        table.add_row(spent.name, f"{spent.wall:.1f}", f"{spent.processor:.1f}", f"{spent.goal:.0f}", str(spent.code))
    Console().print(table)


if __name__ == "__main__":
    main()
