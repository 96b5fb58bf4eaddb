"""What weight cases and failure cases cost a lift plan: `python -m benchmarks.plan_cost [plan] [--threads 2] [--json]`.

Processor time of one run of all tiers, split by what it reports of itself: parts and their ratio to the plan without
them, so that neither the machine nor other programs on it count. Residuals of the winch come from the disk cache.
"""

import argparse
import json
from collections.abc import Mapping
from time import process_time

from rich.console import Console
from rich.table import Table

from stillhook import Monitor
from stillhook.base.progress import Event
from stillhook.plan import plan
from stillhook.plan.assessments import failures, rigging, sensitivity

PLAN = "template-to-1500m"
FREQUENCY, LOW = "frequency domain: winch residuals", "time domain: low weight case"
LINES, LOW_CASE, SENSITIVITY, BASE = "failures and rigging", "low weight case", "sensitivity", "everything else"


class Stages:
    """Listener of a plan: processor time of each part [s]. The low weight case is the second of the frequency
    domain."""

    def __init__(self) -> None:
        self.spent = dict.fromkeys((BASE, LINES, LOW_CASE, SENSITIVITY), 0.0)
        self.stage, self.part, self.cases, self.since = "", BASE, 0, process_time()

    def __call__(self, event: Event) -> None:
        if event.stage == self.stage:
            return
        now = process_time()
        self.spent[self.part] += now - self.since
        self.stage, self.since = event.stage, now
        self.cases += event.stage == FREQUENCY
        self.part = self._part(event.stage)

    def _part(self, stage: str) -> str:
        first = stage.split(": ")[0]
        if first in (failures.NAME, rigging.NAME):
            return LINES
        if first == sensitivity.NAME:
            return SENSITIVITY
        low = stage.startswith(LOW) or (first == FREQUENCY.split(": ")[0] and self.cases > 1)
        return LOW_CASE if low else BASE


def ratios(spent: Mapping[str, float]) -> dict[str, float]:
    """Time of parts over that of the plan without them [-]."""
    base, lines, low, sensitivity_ = (spent[name] for name in (BASE, LINES, LOW_CASE, SENSITIVITY))
    return {
        LINES: lines / (base + low),
        LOW_CASE: low / base,
        f"{LINES}, {LOW_CASE}": (lines + low) / base,
        SENSITIVITY: sensitivity_ / (base + lines + low),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("plan", nargs="?", default=PLAN)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    plan(args.plan, tier="frequency", threads=args.threads)  # residuals and kernels
    stages = Stages()
    plan(args.plan, threads=args.threads, progress=Monitor(stages))
    stages(Event("end", "", 0, 0, None, 1.0))
    shares = ratios(stages.spent)
    if args.json:
        print(json.dumps({"seconds": stages.spent, "ratios": shares}))
        return
    seconds = Table("part", "processor time", title=f'Lift plan "{args.plan}", {args.threads} threads')
    for name, value in stages.spent.items():
        seconds.add_row(name, f"{value:.1f} s")
    over = Table("part", "of the plan without it")
    for name, value in shares.items():
        over.add_row(name, f"{100.0 * value:.0f} %")
    Console().print(seconds, over)


if __name__ == "__main__":
    main()
