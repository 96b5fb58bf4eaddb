"""What a user waits for before anything is computed: `python -m benchmarks.start [--json]`.

Each command in a process of its own, its kernels compiled and its results kept from the call before. Processor time,
which other programs on the machine disturb less, the least of several rounds; and its ratio to that of a process that
imports NumPy and does nothing else, measured in the same rounds.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

ROUNDS = 7
REFERENCE = "a process that imports NumPy"
RUNS = [sys.executable, "-m", "stillhook"]
COMMANDS: dict[str, Sequence[str]] = {
    REFERENCE: [sys.executable, "-c", "import numpy"],
    "stillhook --help": [*RUNS, "--help"],
    "stillhook compare": [*RUNS, "compare"],
    "stillhook map (324 runs)": [*RUNS, "map"],
    "stillhook plan --check": [*RUNS, "plan", "template-to-1500m", "--check"],
}


class Started(NamedTuple):
    """Processor time of a command [s], and its ratio to the reference."""

    name: str
    processor: float
    ratio: float


def processor_time(command: Sequence[str]) -> float:
    """Processor time of a process [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | {
        "OPENBLAS_NUM_THREADS": "1"
    }
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measured(rounds: int = ROUNDS) -> list[Started]:
    """Every command once per round, after one round that does not count."""
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for i in range(rounds + 1):
        for name, command in COMMANDS.items():
            spent = processor_time(command)
            if i:
                times[name].append(spent)
    least = {name: min(values) for name, values in times.items()}
    return [Started(name, value, value / least[REFERENCE]) for name, value in least.items()]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    as_json = parser.parse_args().json
    results = measured()
    if as_json:
        print(json.dumps([r._asdict() for r in results], indent=2))
        return
    table = Table("command", "processor [s]", "over NumPy's import")
    for r in results:
        table.add_row(r.name, f"{r.processor:.2f}", f"{r.ratio:.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
