"""Speed against an earlier version: `python -m benchmarks.against v0.8.0` (any commit that git knows).

Both versions stay loaded in a process each and take turns, job by job, on one core; the figure is the median of the
ratios within a round (processor time, earlier over present: above 1 is faster than before).
"""

import argparse
import io
import json
import os
import statistics
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from time import process_time
from typing import Any

from rich.console import Console
from rich.table import Table

ROUNDS = 9
ROOT = Path(__file__).resolve().parents[1]


def jobs() -> dict[str, Callable[[], Any]]:
    """What is timed, by name, with the version of Stillhook that this process imports."""
    import stillhook
    from stillhook import Scenario, load_crane, simulate

    crane = load_crane("nov-250t")
    modes = ("ns", "hs", "ssc")
    cases = [
        Scenario(load=f"{40 + i} t", s_w="100 m", tip="sine 1 m 9 s", mode=modes[i % 3], duration="600 s")
        for i in range(48)
    ]
    lower: Any = getattr(stillhook, "lower", simulate)  # 0.8.0 had a function of its own
    file = stillhook.load_lift("template-through-the-surface")
    seeds = [stillhook.load_lift("template-through-the-surface", seed=seed).lift for seed in range(16)]
    return {
        "48 runs of 10 min": lambda: simulate(crane, cases, threads=1),
        "one run of 10 min with series": lambda: simulate(crane, cases[0]),
        "16 lowerings through the surface": lambda: lower(file.crane, seeds, threads=1),
    }


def child() -> None:
    """Answers every name of a job on standard input with the seconds that it took."""
    ready = jobs()
    for job in ready.values():
        job()  # compiles
    print(json.dumps(list(ready)), flush=True)
    for line in sys.stdin:
        start = process_time()
        ready[line.strip()]()
        print(process_time() - start, flush=True)


class Version:
    """A version of Stillhook in a process of its own."""

    def __init__(self, source: Path) -> None:
        env = {**os.environ, "PYTHONPATH": os.pathsep.join((str(source), str(ROOT))), "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.against", "--child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=env,
            cwd=source.parent,
        )
        self.names: list[str] = json.loads(self._answer())

    def time(self, name: str) -> float:
        """Processor time of one job [s]."""
        assert self.process.stdin is not None
        print(name, file=self.process.stdin, flush=True)
        return float(self._answer())

    def _answer(self) -> str:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            sys.exit("A version stopped; its message is above.")
        return line


def unpacked(commit: str, folder: str) -> Path:
    """The sources of a commit."""
    packed = subprocess.run(["git", "archive", commit, "src"], cwd=ROOT, capture_output=True)
    if packed.returncode:
        sys.exit(packed.stderr.decode().strip())
    with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
        archive.extractall(folder, filter="data")
    return Path(folder) / "src"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("commit", nargs="?", help="earlier version, as git names it")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help=f"rounds of interleaved measurements ({ROUNDS})")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        child()
        return
    if options.commit is None:
        parser.error("name the earlier version, such as v0.8.0")
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        then, now = Version(unpacked(options.commit, folder)), Version(ROOT / "src")
        for version in (then, now):
            stack.callback(version.process.kill)
        table = Table("job", "earlier [s]", "present [s]", "earlier / present", title=f"Against {options.commit}")
        for name in now.names:
            pairs = [(then.time(name), now.time(name)) for _ in range(options.rounds)]
            ratio = statistics.median(a / b for a, b in pairs)
            before, after = (statistics.median(column) for column in zip(*pairs, strict=True))
            table.add_row(name, f"{before:.3f}", f"{after:.3f}", f"{ratio:.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()
