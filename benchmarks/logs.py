"""How fast are crane logs read, and with how much memory? `python -m benchmarks.logs [MB]`.

Twelve logs of twenty minutes at 100 Hz with twenty columns, and one log of so many MB (200 unless given) whose memory
is watched.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from stillhook.logs.log import mapping_from, read_log

LOGS, MINUTES, RATE, COLUMNS = 12, 20, 100, 20
MAPPING = {
    "time": {"column": "time", "unit": "s"},
    "p_a": {"column": "PT101", "unit": "bar", "range": ["0 bar", "400 bar"]},
    "p_b": {"column": "PT102", "unit": "bar"},
    "omega_m": {"column": "speed", "unit": "rev/min"},
    "u_p": {"column": "command", "unit": "%"},
    "alpha_m": {"column": "alpha", "unit": "%"},
    "s_w": {"column": "wire", "unit": "m"},
}


def table(rows: int, start: float, rng: np.random.Generator) -> pd.DataFrame:
    """A staircase with noise, and columns that nobody wants."""
    t = start + np.arange(rows) / RATE
    u = np.sign(np.sin(2.0 * np.pi * t / 48.0)) * np.clip(0.1 + 0.02 * np.floor((t % 1200.0) / 48.0), 0.0, 0.6)
    columns = {
        "time": t,
        "PT101": 150.0 + 15.0 * u + 0.5 * rng.standard_normal(rows),
        "PT102": 25.0 + 0.5 * rng.standard_normal(rows),
        "speed": 2000.0 * u + 3.0 * rng.standard_normal(rows),
        "command": 100.0 * u,
        "alpha": 80.0 + 0.1 * rng.standard_normal(rows),
        "wire": 100.0 - 5.0 * np.cumsum(u) / RATE / 60.0,
    }
    return pd.DataFrame(columns | {f"other{i}": rng.standard_normal(rows) for i in range(COLUMNS - len(columns))})


def campaign(folder: Path) -> None:
    """Twelve logs, one after the other."""
    rng = np.random.default_rng(1)
    paths = [folder / f"log{i:02d}.csv" for i in range(LOGS)]
    for path in paths:
        table(MINUTES * 60 * RATE, 0.0, rng).to_csv(path, index=False, float_format="%.4f")
    mapping = mapping_from(MAPPING, "benchmark")
    size = sum(path.stat().st_size for path in paths) / 1e6
    for turn in ("first", "again"):
        begin = time.perf_counter()
        samples = sum(read_log(path, mapping).samples for path in paths)
        seconds = time.perf_counter() - begin
        print(f"{LOGS} logs, {samples} samples, {size:.0f} MB, {turn}: {seconds:.2f} s ({size / seconds:.0f} MB/s)")


def long_log(folder: Path, megabytes: float) -> None:
    """One long log; how much memory reading it takes beyond what was in use before."""
    path, rng, start, rows = folder / "long.csv", np.random.default_rng(2), 0.0, 200_000
    with path.open("wb") as stream:
        while stream.tell() < megabytes * 1e6:
            table(rows, start, rng).to_csv(stream, index=False, header=start == 0.0, float_format="%.4f")
            start += rows / RATE
    subprocess.run([sys.executable, "-m", "benchmarks.logs", "read", str(path)], check=True)


def peak_memory() -> float:
    """Largest memory of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def read(path: Path) -> None:
    """Reads a log in a separate process and reports how its peak memory grows with the rows read."""
    peaks: list[float] = []
    begin = time.perf_counter()
    log = read_log(
        path,
        mapping_from(MAPPING, "benchmark"),
        progress=lambda share: peaks.append(peak_memory()),
    )
    seconds = time.perf_counter() - begin
    size, half = path.stat().st_size / 1e6, peaks[len(peaks) // 2]
    print(f"one log, {log.samples} samples, {size:.0f} MB: {seconds:.2f} s, {len(log.t)} bins")
    print(
        f"peak memory {peaks[0]:.0f} MB after the first piece, {half:.0f} MB half-way, {peak_memory():.0f} MB at"
        " the end"
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["read"]:
        read(Path(sys.argv[2]))
        sys.exit()
    with tempfile.TemporaryDirectory() as name:
        campaign(Path(name))
        long_log(Path(name), float(sys.argv[1]) if len(sys.argv) > 1 else 200.0)
