"""Controllers compared: tables of docs/validation/controllers-compared.md from the outcome beside this file, which
`python -m benchmarks.control --json > benchmarks/control/outcome.json` writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from blocks import Blocks, Table, save

from benchmarks.control import report
from benchmarks.control.course import MARGIN
from benchmarks.control.entries import REFERENCE
from benchmarks.control.late import PREDICTED

SCRIPT = "controllers_compared"
OUTCOME = Path(__file__).with_name("outcome.json")
LIMIT, ABOVE, ROPE = 0.6, 0.05, 0.3
"""Ratio to strong SSC that was asked for in every irregular sea; share of drawn plants that may be above 1; ratio of
the load's motion on a long wire [-]."""


def compute() -> tuple[Blocks, Any]:
    found = json.loads(OUTCOME.read_text(encoding="utf-8"))
    ff, reference = found["entries"]["ff"], found["entries"][REFERENCE]
    ratio = {sea: s["e_c_pp"] / reference["scores"][sea]["e_c_pp"] for sea, s in ff["scores"].items()}
    jonswap = [x for sea, x in ratio.items() if sea.startswith("Hs")]
    plants = report.all_ratios(ff)
    deep = found["deep"]
    rope = {case: x / deep[REFERENCE]["motions"][case] for case, x in deep["rope"]["motions"].items()}
    resonant = [x for case, x in rope.items() if "2000 m" in case and "Tp 6 s" in case]
    numbers = {
        "least": min(jonswap),
        "most": max(jonswap),
        "ship": ratio.get("measured ship", np.nan),
        "above": float(np.mean(plants > 1.0)),
        "within": float(np.quantile(plants, 0.95, method="higher")),
        "strict": float(np.mean(report.all_ratios(ff, "strict") > 1.0)),
        "margin": ff["margin"]["gain_margin"],
        "K_p": ff["margin"]["K_p"],
        "K_p_reference": reference["margin"]["K_p"],
        "late": late_gain(found, REFERENCE),
        "late_ff": late_gain(found, "ff"),
        "rope_6s": ", ".join(f"{x:.2f}" for x in resonant),
        "rope_6s_most": max(resonant),
        "rope_least": min(rope.values()),
        "rope_most": max(rope.values()),
        "MARGIN": MARGIN,
    }
    return {"claims": numbers, **{name: Table(*of(found)) for name, of in report.TABLES.items()}}, found


def late_gain(found: report.Outcome, name: str) -> float:
    """Error of an entry with prediction over that without, at the longest delay, mean of the seas [-]."""
    predicted, extrapolated = ([*found["late"][n]["errors"].values()][-1] for n in (name + PREDICTED, name))
    return float(np.mean([*predicted.values()]) / np.mean([*extrapolated.values()]))


def draw(found: report.Outcome) -> None:
    save(report.figure(found), "controllers-compared.png")
