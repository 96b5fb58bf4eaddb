"""What a user waits for before anything is computed: `python -m benchmarks.start [--json]`.

Each command in a process of its own, its kernels compiled and its results kept from the call before. Processor time,
which other programs on the machine disturb less, the median and the least of several rounds; the ratio of the least to
that of a process that imports NumPy and does nothing else, measured in the same rounds; and the aim, which is of a
machine that has nothing else to do.

The quick plan with nothing kept but compiled kernels is measured in a cache folder of its own, a few rounds only; its
aim is of the clock, on two cores. A checkout identifies its winches then (some 10 s), which a wheel brings.
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from stillhook.analysis.kept import FOLDER as CAPACITIES
from stillhook.kernels.cache import VARIABLE, cache_root
from stillhook.response.winch.identify import KEPT as RESIDUALS

ROUNDS = 7
REFERENCE = "a process that imports NumPy"
RUNS = [sys.executable, "-m", "stillhook"]
COMMANDS: dict[str, Sequence[str]] = {
    REFERENCE: [sys.executable, "-c", "import numpy"],
    "stillhook --help": [*RUNS, "--help"],
    "stillhook plan --help": [*RUNS, "plan", "--help"],
    "stillhook compare --help": [*RUNS, "compare", "--help"],
    "stillhook live run --help": [*RUNS, "live", "run", "--help"],
    "stillhook compare": [*RUNS, "compare"],
    "stillhook map (324 runs)": [*RUNS, "map"],
    "stillhook plan --check": [*RUNS, "plan", "template-to-1500m", "--check"],
}


AIMS = {
    "stillhook --help": 0.15,
    "stillhook plan --help": 0.2,
    "stillhook compare --help": 0.2,
    "stillhook live run --help": 0.2,
    "stillhook compare": 0.9,
    "stillhook map (324 runs)": 1.0,
    "stillhook plan --check": 1.0,
}
"""Processor time of the second call and later ones [s]."""
FRESH = "stillhook plan --quick, nothing kept, by the clock"
FRESH_AIM, FRESH_ROUNDS = 5.0, 3


class Started(NamedTuple):
    """Time of a command [s]: median and least, the ratio of the least to the reference, and the aim."""

    name: str
    median: float
    least: float
    ratio: float
    aim: float | None


class Spent(NamedTuple):
    """What a process took: processor time and by the clock [s]."""

    processor: float
    wall: float


def spent(command: Sequence[str], more: Mapping[str, str] | None = None) -> Spent:
    """What a process takes; more: environment of its own."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | {
        "OPENBLAS_NUM_THREADS": "1",
        **(more or {}),
    }
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Spent(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall)


def measured(rounds: int = ROUNDS) -> list[Started]:
    """Every command once per round, after one round that does not count; then the quick plan."""
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for i in range(rounds + 1):
        for name, command in COMMANDS.items():
            processor = spent(command).processor
            if i:
                times[name].append(processor)
    reference = min(times[REFERENCE])
    walls = [fresh().wall for _ in range(FRESH_ROUNDS)]
    rows = [(name, values, AIMS.get(name)) for name, values in times.items()] + [(FRESH, walls, FRESH_AIM)]
    return [Started(name, median(x), min(x), min(x) / reference, aim) for name, x, aim in rows]


def fresh() -> Spent:
    """The quick plan where only compiled kernels are kept."""
    with tempfile.TemporaryDirectory() as folder:
        for kept in (path for path in cache_root().iterdir() if path.name not in (RESIDUALS, CAPACITIES)):
            copy = shutil.copytree if kept.is_dir() else shutil.copy2
            copy(kept, Path(folder) / kept.name)
        return spent([*RUNS, "plan", "template-to-1500m", "--tier", "frequency"], {VARIABLE: folder})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    as_json = parser.parse_args().json
    results = measured()
    if as_json:
        print(json.dumps([r._asdict() for r in results], indent=2))
        return
    table = Table("command", "median [s]", "least [s]", "over NumPy's import", "aim [s]")
    for r in results:
        aim = "" if r.aim is None else f"{r.aim:g}"
        table.add_row(r.name, f"{r.median:.2f}", f"{r.least:.2f}", f"{r.ratio:.1f}", aim)
    Console().print(table)


if __name__ == "__main__":
    main()
