"""What each controller gains in the example plan: `python -m benchmarks.control.days [--tier time] > FILE.json`.

A few minutes of processor time in the frequency domain, some half an hour by runs of the twin, which are kept in
--store.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.control.days.rows import LEADS, MIDDLE, REFERENCES, Row, rows
from benchmarks.control.days.worth import Weather, Worth, plain
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Tier
from stillhook.plan.planning import plan
from stillhook.plan.result import CREDITS, PlanResult


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.control.days", description=__doc__)
    parser.add_argument("--tier", choices=(Tier.FREQUENCY.value, Tier.TIME.value), default=Tier.FREQUENCY.value)
    parser.add_argument("--store", type=Path, default=Path("benchmark-runs"), help="where runs of tier time are kept")
    given = parser.parse_args()
    tier = Tier(given.tier)
    store = given.store if tier is Tier.TIME else None

    @cache
    def planned(of: LiftPlan) -> PlanResult:
        print(f"planning with {', '.join(a.value for a in of.alternatives)} ...", file=sys.stderr, flush=True)
        return plan(of, tier=tier, store=store)

    every = rows(LEADS if tier is Tier.FREQUENCY else MIDDLE)
    print(json.dumps(outcome(every, [[planned(of) for of in row.plans] for row in every]), indent=1))


def outcome(every: list[Row], results: list[list[PlanResult]]) -> dict[str, Any]:
    """Limits, what governs them, days and waiting of every row, simulated and as they may be claimed."""
    first = results[0][0]
    weather = Weather(every[0].plans[0], float(first["weather"].attrs["window"]))
    found: dict[str, Any] = {"Tp": [float(T) for T in first.data["period"].values], "rows": {}}
    known: dict[tuple[str, str], Worth] = {}
    for credit in (CREDITS[0], first.claim):
        for row, of in zip(every, results, strict=True):
            cells = [r.data.sel(credit=credit, alternative=row.alternative.value) for r in of]
            worth = weather.worth(np.fmax.reduce([c["op_wf"].values for c in cells]))
            known[credit, row.name] = worth
            entry = limits(cells) | {"days": plain(worth.days)}
            entry |= {"wait_p50": plain(worth.wait_p50), "wait_p90": plain(worth.wait_p90)}
            entry["over"] = {
                a.value: plain(weather.gained(worth, known[credit, a.value]))
                for a in REFERENCES
                if (credit, a.value) in known
            }
            name = "simulated" if credit == CREDITS[0] else "claimable"
            found["rows"].setdefault(row.name, {})[name] = entry
    return found


def limits(cells: list[Any]) -> dict[str, Any]:
    """Of the best plan in every sea the limit at the worst heading, by period, and what governs it."""
    Hs = np.stack([c["Hs_limit"].values for c in cells])
    best = Hs.argmax(axis=0)
    at_best = Hs.max(axis=0)
    worst = at_best.argmin(axis=0)
    found: dict[str, Any] = {"Hs": [round(float(x), 3) if np.isfinite(x) else None for x in at_best.min(axis=0)]}
    for name in ("phase", "rule", "tier"):
        texts = np.stack([c[f"governing_{name}"].values for c in cells])
        found[name] = [str(texts[best[b, T], b, T]) for T, b in enumerate(worst)]
    return found


if __name__ == "__main__":
    main()
