"""What the manifest of a store costs: `python -m benchmarks.manifest [--json]`.

64 lifts of 300 s in a new store, each time in a new process, as the hash of the package is taken once in one. Processor
time of the manifest over that of all else, the median of several rounds: other programs disturb a ratio least.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import process_time

ROUNDS = 7
LIFTS, DURATION = 64, "300 s"
AIM = 0.01
"""Share of the run."""


def sample(folder: Path) -> tuple[float, float]:
    """Processor time of the run without its manifest, and of the manifest [s]."""
    from stillhook import Scenario, Sine, load_crane
    from stillhook.engine import store
    from stillhook.engine.simulate import run_cases

    crane, tip = load_crane("nov-250t"), Sine(height="2 m", period="12 s")
    cases = [Scenario(load=f"{50 + i} t", s_w="487 m", mode="ssc", duration=DURATION, tip=tip) for i in range(LIFTS)]
    run_cases(crane, cases[:1], step=2)  # the kernel is loaded
    taken: list[float] = []
    add_parts = store.add_parts

    def timed(*given: object) -> None:
        begin = process_time()
        add_parts(*given)  # type: ignore[arg-type]
        taken.append(process_time() - begin)

    store.add_parts = timed  # type: ignore[assignment]
    begin = process_time()
    run_cases(crane, cases, step=2, store=folder)
    return process_time() - begin - sum(taken), sum(taken)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--sample", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.sample:
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(sample(Path(folder) / "store")))
        return
    command = [sys.executable, "-m", "benchmarks.manifest", "--sample"]
    samples = [json.loads(subprocess.check_output(command)) for _ in range(ROUNDS)]
    run, manifest = (median(each[i] for each in samples) for i in (0, 1))
    share = median(each[1] / each[0] for each in samples)
    if given.json:
        print(json.dumps({"run": run, "manifest": manifest, "share": share, "aim": AIM}))
    else:
        print(f"{LIFTS} lifts of {DURATION}: {run:.3f} s; manifest {1e3 * manifest:.1f} ms, {100 * share:.2f} %")


if __name__ == "__main__":
    main()
