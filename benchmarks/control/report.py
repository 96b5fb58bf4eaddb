"""Tables and figure of the benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from benchmarks.control.course import SCORES
from benchmarks.control.entries import REFERENCE
from benchmarks.control.runs import Result

SHOWN = {
    "e_c_pp": (1e2, "cm"),
    "load_pp": (1e2, "cm"),
    "p_max": (1e-5, "bar"),
    "P_hpu_mean": (1e-3, "kW"),
    "omega_m_max": (30.0 / np.pi, "1/min"),
    "travel_p": (1.0, "1/min"),
    "travel_m": (1.0, "1/min"),
}
"""Factor and unit in which a score is shown."""
DIGITS = {"cm": 2, "1/min": 1}
LOSES = 1.02
"""Ratio to the reference from which an entry loses: two runs whose noise differs are 1 % apart."""


def of_reference(found: Sequence[Result]) -> Result:
    return next(r for r in found if r.entry.name == REFERENCE)


def mean(r: Result, score: str) -> float:
    """Of a score over the seas."""
    return float(np.mean([s[score] for s in r.scores.values()]))


def all_ratios(r: Result) -> Any:
    """Error on drawn plants over that of the reference, all seas; a run that failed counts as beyond any."""
    return np.nan_to_num(np.concatenate(list(r.ratios.values())), nan=np.inf)


def scores_table(found: Sequence[Result]) -> tuple[list[str], list[list[str]]]:
    """Means over the seas; of the drawn plants median and 95 % of the ratio, and the share above 1."""
    head = ["entry", *(f"{SCORES[s]}, {unit}" for s, (_, unit) in SHOWN.items())]
    head += ["drawn plants: median", "95 %", "above 1.0"]
    rows = []
    for r in found:
        cells = [f"{factor * mean(r, s):.{DIGITS.get(unit, 0)}f}" for s, (factor, unit) in SHOWN.items()]
        q = all_ratios(r)
        middle, most = np.quantile(q, 0.5), np.quantile(q, 0.95, method="higher")
        rows.append([r.entry.name, *cells, f"{middle:.2f}", f"{most:.2f}", f"{100.0 * np.mean(q > 1.0):.1f} %"])
    return head, rows


def seas_table(found: Sequence[Result]) -> tuple[list[str], list[list[str]]]:
    """Error by sea [cm], with lead [ms] and gain [1/m]; the reference's ratio is 1."""
    seas = list(found[0].scores)
    rows = []
    for sea in seas:
        least = of_reference(found).scores[sea]["e_c_pp"]
        cells = []
        for r in found:
            e, s = r.scores[sea]["e_c_pp"], r.settings[sea]
            cells.append(f"{1e2 * e:.2f} ({e / least:.2f}; {1e3 * s.lead:.0f} ms, {s.K_p:.2f})")
        rows.append([sea, *cells])
    return ["sea", *(r.entry.name for r in found)], rows


def loses(r: Result, reference: Result) -> list[str]:
    """Where an entry is worse than the reference: score, in how many seas, and the worst."""
    out = []
    for score, text in SCORES.items():
        q = {sea: s[score] / max(reference.scores[sea][score], 1e-9) for sea, s in r.scores.items()}
        worse = {sea: x for sea, x in q.items() if not x <= LOSES}
        if worse:
            sea = max(worse, key=worse.__getitem__)
            out.append(f"{text}: {len(worse)} of {len(q)} seas, most {worse[sea]:.2f} ({sea})")
    return out


def losses_table(found: Sequence[Result]) -> tuple[list[str], list[list[str]]]:
    """Where each loses against the reference."""
    reference = of_reference(found)
    others = [r for r in found if r is not reference]
    return ["entry", "loses against strong SSC in"], [
        [r.entry.name, "; ".join(loses(r, reference)) or "nothing"] for r in others
    ]


TABLES = {"scores": scores_table, "seas": seas_table, "loses": losses_table}


def show(found: Sequence[Result]) -> None:
    """All tables on the terminal."""
    console = Console()
    for name, of in TABLES.items():
        head, rows = of(found)
        table = Table(*head, title=name)
        for row in rows:
            table.add_row(*row)
        console.print(table)


def as_dict(found: Sequence[Result]) -> dict[str, Any]:
    """Everything in SI."""
    return {
        r.entry.name: {
            "settings": {sea: s._asdict() for sea, s in r.settings.items()},
            "scores": r.scores,
            "ratios": {sea: q.tolist() for sea, q in r.ratios.items()},
            "above": float(np.mean(all_ratios(r) > 1.0)),
        }
        for r in found
    }


def figure(found: Sequence[Result]) -> Figure:
    """Error by sea, and the ratio on drawn plants."""
    result = Figure(figsize=(10.0, 7.0), layout="constrained", dpi=90)
    by_sea, by_plant = result.subplots(2, 1)
    seas, width = list(found[0].scores), 0.8 / len(found)
    for i, r in enumerate(found):
        x = np.arange(len(seas)) + (i - 0.5 * (len(found) - 1)) * width
        by_sea.bar(x, [1e2 * r.scores[sea]["e_c_pp"] for sea in seas], width, label=r.entry.name)
        q = np.sort(all_ratios(r))
        by_plant.step(q, 100.0 * np.arange(1, len(q) + 1) / len(q), label=r.entry.name)
    by_sea.set_xticks(range(len(seas)), [sea.replace(", ", "\n") for sea in seas])
    by_sea.set_ylabel("error at the wire, peak to peak [cm]")
    by_sea.legend(ncols=4)
    by_plant.axvline(1.0, color="black", linewidth=0.8)
    by_plant.set_xscale("log")
    by_plant.set_xlabel("error on drawn plants over that of strong SSC at its best on each [-]")
    by_plant.set_ylabel("share of plants [%]")
    return result
