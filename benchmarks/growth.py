"""Whether time grows in proportion and memory stays: more cases, and longer runs.

`python -m benchmarks.growth [--json]`. Every line is a process of its own, for its largest memory. Time is processor
time for each hour that is simulated; what counts are the ratios to the first line of a table.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from typing import Any

from rich.console import Console
from rich.table import Table

from stillhook import Lowering, Scenario, load_crane, read_payload, simulate
from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.realisation import Amplitudes
from stillhook.spec.lift.lowering import InSea

HOUR = 3600.0
CASES = (1_000, 10_000, 100_000)
SECONDS = 40.0
HOURS = (1, 6, 24)
SIDE_BY_SIDE = 16


def many(n: int) -> float:
    """Scenarios of 40 s, statistics alone: hours simulated."""
    crane = load_crane("nov-250t")
    one = Scenario(load="100 t", s_w="300 m", tip="sine 1 m 10 s", mode="ssc", duration=f"{SECONDS} s", warm_up="10 s")
    simulate(crane, [one.model_copy(update={"load": 50e3 + 50e3 * i / n}) for i in range(n)])
    return n * SECONDS / HOUR


def long(hours: int) -> float:
    """Sixteen lifts in deep water that hang for hours in a sea, statistics alone: hours simulated."""
    crane, vessel = load_crane("nov-250t"), read_vessel("construction-vessel-130m")
    duration = hours * HOUR
    lift = Lowering(
        payload=read_payload("template-120t"),
        h_tip="36 m",
        depth="1500 m",
        start_depth="1000 m",
        programme=[{"mode": "ahc", "time": f"{duration} s"}],
        duration=f"{duration} s",
        wire={"nodes": 8},
    )
    sea = parse_sea("jonswap Hs=2 m Tp=9 s", heading="165 deg")
    cases = [InSea(lift, sea, k, vessel, -15.0, -24.0, False, 1.0, Amplitudes.RAYLEIGH) for k in range(SIDE_BY_SIDE)]
    simulate(crane, cases, step="10 ms", sampling="20 ms")
    return SIDE_BY_SIDE * hours


def one_line(kind: str, n: int) -> dict[str, float]:
    """Time and memory of one size, after a small run that compiles."""
    {"many": many, "long": long}[kind](16 if kind == "many" else 1) if n > 16 else None
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    hours = (many if kind == "many" else long)(n)
    spent = time.process_time() - start
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"n": n, "processor": spent, "per_hour": spent / hours, "memory": after * 1024.0, "before": before * 1024.0}


def measured(kind: str, n: int) -> dict[str, Any]:
    """The same in a process of its own."""
    text = f"import json; from benchmarks.growth import one_line; print(json.dumps(one_line({kind!r}, {n})))"
    return dict(
        json.loads(subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    rows = {kind: [measured(kind, n) for n in sizes] for kind, sizes in (("many", CASES), ("long", HOURS))}
    if args.json:
        print(json.dumps(rows))
        return
    titles = {"many": "cases of 40 s on the wire", "long": "hours that 16 lifts hang in deep water"}
    for kind, lines in rows.items():
        table = Table(title=titles[kind])
        for name in ("n", "processor time", "per hour simulated", "over the first", "largest memory", "over the first"):
            table.add_column(name, justify="right")
        for line in lines:
            table.add_row(
                f"{line['n']:,}",
                f"{line['processor']:.1f} s",
                f"{1e3 * line['per_hour']:.1f} ms",
                f"{line['per_hour'] / lines[0]['per_hour']:.2f}",
                f"{line['memory'] / 1e6:.0f} MB",
                f"{line['memory'] / lines[0]['memory']:.2f}",
            )
        Console().print(table)


if __name__ == "__main__":
    main()
