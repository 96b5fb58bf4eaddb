"""The frequency tier of a lift plan, part by part: `python -m benchmarks.plan_frequency [PLAN] [--json]`.

Wall and processor time of everything that a user waits for, with residuals of the winch recomputed in an empty cache of
their own (kernels compiled, elsewhere), and from the disk cache.
"""

import argparse
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from typing import Any
from unittest.mock import patch

START, CPU = perf_counter(), process_time()
GOAL = 10.0
"""Seconds in which a plan by this tier is to be there, residuals recomputed."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("plan", nargs="?", default="template-to-1500m")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    from stillhook.plan.file import load_plan
    from stillhook.plan.tiers.frequency import demands, forcings, winches_of
    from stillhook.plan.tiers.situations import looked_at
    from stillhook.response.winch import identify as identify_residual

    parts = {"imports": (perf_counter() - START, process_time() - CPU)}

    def timed(name: str, work: Callable[[], Any]) -> Any:
        wall, cpu = perf_counter(), process_time()
        result = work()
        parts[name] = (perf_counter() - wall, process_time() - cpu)
        return result

    plan = timed("plan file", lambda: load_plan(args.plan))
    seas, phases = plan.environment.table(), timed("situations", lambda: looked_at(plan))
    forcing = timed("seas at the tip", lambda: forcings(plan, seas, phases))
    with tempfile.TemporaryDirectory() as folder, patch.object(identify_residual, "cache_root", lambda: Path(folder)):
        winch = timed("residuals, recomputed", lambda: winches_of(plan, phases, plan.alternatives))
        timed("residuals, from disk", lambda: winches_of(plan, phases, plan.alternatives))
    result = timed("demands", lambda: demands(plan, plan.alternatives, seas, phases, forcing, winch))
    new = [v for name, v in parts.items() if name != "residuals, from disk"]
    report = {
        "seas": len(seas),
        "demands": len(result),
        "load of the machine": os.getloadavg()[0],
        "goal [s]": GOAL,
        "wall [s]": sum(w for w, _ in new),
        "processor [s]": sum(c for _, c in new),
        "parts, wall and processor [s]": {name: [round(x, 2) for x in v] for name, v in parts.items()},
    }
    print(
        json.dumps(report, indent=2) if args.json else "\n".join(f"{name}: {value}" for name, value in report.items())
    )


if __name__ == "__main__":
    main()
