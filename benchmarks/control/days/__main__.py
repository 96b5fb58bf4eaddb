"""What each controller gains in the example plan: `python -m benchmarks.control.days > FILE.json`.

Limits by runs of the twin, which are kept in --store: some twenty minutes on two idle cores. The same command continues
from there.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.control.days.rows import REFERENCES, STRONG, Row, rows
from benchmarks.control.days.worth import YEAR, Weather, Worth, plain
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.planning import plan
from stillhook.plan.result import CREDITS, PlanResult


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.control.days", description=__doc__)
    parser.add_argument("--store", type=Path, default=Path("benchmark-runs"), metavar="DIR", help="where runs are kept")
    given = parser.parse_args()

    @cache
    def planned(of: LiftPlan) -> PlanResult:
        print(f"planning with {', '.join(a.value for a in of.alternatives)} ...", file=sys.stderr, flush=True)
        return plan(of, store=given.store)

    every = rows()
    print(json.dumps(outcome(every, [[planned(of) for of in row.plans] for row in every])))


def outcome(every: list[Row], results: list[list[PlanResult]]) -> dict[str, Any]:
    """Limits, what governs them, days and waiting of every row, simulated and as they may be claimed; over: what it
    gains over others in the same plans, whose runs are the same."""
    first = results[0][0]
    weather = Weather(every[0].plans[0], float(first["weather"].attrs["window"]))
    found: dict[str, Any] = {"Tp": [float(T) for T in first.data["period"].values], "rows": {}}
    for name in ("simulated", "claimable"):
        for row, of in zip(every, results, strict=True):
            cells = [selected(r.data, name, row.alternative, r) for r in of]

            def worth(alternative: Alternative, of: list[PlanResult] = of, name: str = name) -> Worth:
                op_wf = [selected(r.data, name, alternative, r)["op_wf"].values for r in of]
                return weather.worth(np.fmax.reduce(op_wf))

            own = worth(row.alternative)
            others = [a for a in (*REFERENCES, STRONG) if a in of[0].alternatives and a is not row.alternative]
            found["rows"].setdefault(row.name, {})[name] = {
                **limits(cells),
                "days": plain(own.days),
                "days_by_limits": by_limits(selected(of[0]["weather"], name, row.alternative, of[0])),
                "over": {a.value: plain(weather.gained(own, worth(a))) for a in others},
                "wait_p50": plain(own.wait_p50),
                "wait_p90": plain(own.wait_p90),
            }
    return found


def selected(data: Any, name: str, alternative: Alternative, result: PlanResult) -> Any:
    """What data of a result say of an alternative, simulated or as it may be claimed."""
    credit = CREDITS[0] if name == "simulated" else result.claim
    return data.sel(credit=credit, alternative=alternative.value)


def by_limits(year: Any) -> list[float]:
    """Ends of the 95 % interval of workable days of a year that errors of the limits leave, with the first lead."""
    return [round(YEAR * float(year[f"operability_{end}"]), 2) for end in ("low", "high")]


def limits(cells: list[Any]) -> dict[str, Any]:
    """Of the best plan in every sea the limit at the worst heading, by period, and what governs it."""
    Hs = np.stack([c["Hs_limit"].values for c in cells])
    best, at_best = Hs.argmax(axis=0), Hs.max(axis=0)
    worst = at_best.argmin(axis=0)
    found: dict[str, Any] = {"Hs": [round(float(x), 3) if np.isfinite(x) else None for x in at_best.min(axis=0)]}
    for name in ("phase", "rule", "tier"):
        texts = np.stack([c[f"governing_{name}"].values for c in cells])
        found[name] = [str(texts[best[b, T], b, T]) for T, b in enumerate(worst)]
    return found


if __name__ == "__main__":
    main()
