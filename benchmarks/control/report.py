"""Tables and figure of the benchmark, from its outcome: of every entry settings and scores by sea, ratios of the error
on drawn plants to that of the reference by sea, and margin, SI; None for a number that there is not."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from benchmarks.control.course import SCORES
from benchmarks.control.entries import REFERENCE
from benchmarks.control.margins import Margin
from benchmarks.control.runs import Result
from stillhook.base.arrays import FloatArray

SHOWN = {
    "e_c_pp": (1e2, "cm", 1),
    "load_pp": (1e2, "cm", 1),
    "p_max": (1e-5, "bar", 0),
    "P_hpu_mean": (1e-3, "kW", 0),
    "omega_m_max": (30.0 / math.pi, "rev/min", 0),
    "travel_p": (1.0, "1/min", 1),
    "travel_m": (1.0, "1/min", 2),
}
"""Factor, unit and decimals with which a score is shown."""
LOSES = 1.02
"""Ratio to the reference from which an entry loses: runs that differ in their noise alone are 1 % apart."""
Outcome = Mapping[str, Mapping[str, Any]]
Rows = tuple[list[str], list[list[str]]]


def outcome(found: Sequence[Result], margins: Sequence[Margin]) -> Outcome:
    """What tables and figure are made from, ready for JSON."""
    return {
        r.entry.name: {
            "settings": {sea: s._asdict() for sea, s in r.settings.items()},
            "scores": r.scores,
            "ratios": {sea: [finite(float(f"{x:.4g}")) for x in q] for sea, q in r.ratios.items()},
            "strict": {sea: [finite(float(f"{x:.4g}")) for x in q] for sea, q in r.strict.items()},
            "margin": {name: x if name == "entry" else finite(x) for name, x in m._asdict().items()},
        }
        for r, m in zip(found, margins, strict=True)
    }


def finite(x: float) -> float | None:
    """A number as JSON may have it."""
    return x if math.isfinite(x) else None


def mean(entry: Mapping[str, Any], score: str) -> float:
    """Of a score over the seas."""
    return float(np.mean([s[score] for s in entry["scores"].values()]))


def all_ratios(entry: Mapping[str, Any], of: str = "ratios") -> FloatArray:
    """Error on drawn plants over that of the reference, all seas; a run that failed counts as beyond any. of: "ratios"
    with the reference's lead of the sea, "strict" with its best lead on each plant."""
    return np.nan_to_num(np.concatenate([np.array(q, float) for q in entry[of].values()]), nan=np.inf)


def scores_table(found: Outcome) -> Rows:
    """Means over the seas."""
    head = ["entry", *(f"{SCORES[s]}, {unit}" for s, (_, unit, _) in SHOWN.items())]
    rows = [
        [name, *(f"{factor * mean(e, s):.{digits}f}" for s, (factor, _, digits) in SHOWN.items())]
        for name, e in found.items()
    ]
    return head, rows


def plants_table(found: Outcome) -> Rows:
    """Ratio to the reference on drawn plants."""
    rows = []
    for name, e in found.items():
        cells = []
        for of in ("ratios", "strict"):
            q = all_ratios(e, of)
            middle, most = np.quantile(q, 0.5), np.quantile(q, 0.95, method="higher")
            cells += [f"{middle:.2f}", f"{most:.2f}", f"{q.max():.2f}", f"{100.0 * np.mean(q > 1.0):.1f} %"]
        rows.append([name, *cells])
    columns = ["median", "95 %", "largest", "above 1.0"]
    return ["entry", *columns, *(f"{name}, strict" for name in columns)], rows


def seas_table(found: Outcome) -> Rows:
    """Error by sea over that of the reference, with the lead that is best; of the reference the error itself."""
    rows = []
    for sea in found[REFERENCE]["scores"]:
        least = found[REFERENCE]["scores"][sea]["e_c_pp"]
        cells = []
        for name, e in found.items():
            x, lead = e["scores"][sea]["e_c_pp"], 1e3 * e["settings"][sea]["lead"]
            shown = f"{1e2 * x:.1f} cm" if name == REFERENCE else f"{x / least:.2f}"
            cells.append(f"{shown} ({lead:.0f} ms)")
        rows.append([sea, *cells])
    return ["sea", *found], rows


def loses(e: Mapping[str, Any], reference: Mapping[str, Any]) -> str:
    """Where an entry is worse than the reference: what, in how many seas, and the worst."""
    out = []
    for score, text in SCORES.items():
        q = {sea: s[score] / max(reference["scores"][sea][score], 1e-9) for sea, s in e["scores"].items()}
        worse = {sea: x for sea, x in q.items() if not x <= LOSES}
        if worse:
            sea = max(worse, key=worse.__getitem__)
            out.append(f"{text}: {len(worse)} of {len(q)} seas, most {worse[sea]:.2f} times ({sea})")
    above = float(np.mean(all_ratios(e) > 1.0))
    if above > 0.0:
        out.append(f"drawn plants: {100.0 * above:.1f} %")
    return "; ".join(out) or "nothing"


def losses_table(found: Outcome) -> Rows:
    """Where each loses against the reference."""
    rows = [[name, loses(e, found[REFERENCE])] for name, e in found.items() if name != REFERENCE]
    return ["entry", "loses against strong SSC"], rows


def margins_table(found: Outcome) -> Rows:
    """Margins of each entry at its largest gain."""
    head = ["entry", "K_p", "gain margin", "phase margin", "delay margin"]
    head += ["twin: error grows by half", "twin: disturbance stays"]
    rows = []
    for name, e in found.items():
        m = Margin(**{key: math.inf if x is None else x for key, x in e["margin"].items()})
        dB, deg = 20.0 * math.log10(m.gain_margin), math.degrees(m.phase_margin)
        twin = [_until(m.factor_grows, m.later_grows), _until(m.factor_stays, m.later_stays)]
        rows.append([name, f"{m.K_p:.3f} 1/m", f"{dB:.1f} dB", f"{deg:.0f} deg", f"{m.delay_margin:.1f} s", *twin])
    return head, rows


def _until(factor: float, later: float) -> str:
    """Factor on K_p, or delay of the pumps' commands."""
    delay = f"{1e3 * later:.0f} ms" if math.isfinite(later) else "no delay"
    return f"{factor:.1f} K_p, {delay}" if math.isfinite(factor) else f"no K_p, {delay}"


TABLES = {
    "scores": scores_table,
    "seas": seas_table,
    "plants": plants_table,
    "margins": margins_table,
    "loses": losses_table,
}


def show(found: Outcome) -> None:
    """All tables on the terminal."""
    console = Console()
    for name, of in TABLES.items():
        head, rows = of(found)
        table = Table(*head, title=name)
        for row in rows:
            table.add_row(*row)
        console.print(table)


def figure(found: Outcome) -> Figure:
    """Error by sea, and the ratio on drawn plants."""
    result = Figure(figsize=(10.0, 7.5), layout="constrained")
    by_sea, by_plant = result.subplots(2, 1)
    seas, width = list(found[REFERENCE]["scores"]), 0.8 / len(found)
    for i, (name, e) in enumerate(found.items()):
        x = np.arange(len(seas)) + (i - 0.5 * (len(found) - 1)) * width
        by_sea.bar(x, [1e2 * e["scores"][sea]["e_c_pp"] for sea in seas], width, label=name)
        q = np.sort(all_ratios(e))
        by_plant.step(q, 100.0 * np.arange(1, len(q) + 1) / len(q), label=name)
    by_sea.set_yscale("log")
    by_sea.set_xticks(range(len(seas)), [sea.replace(", ", "\n") for sea in seas], fontsize="small")
    by_sea.set_ylabel("error at the wire,\npeak to peak [cm]")
    by_sea.legend(ncols=len(found), fontsize="small", frameon=False, loc="upper left")
    by_sea.grid(axis="y", alpha=0.3)
    by_plant.axvline(1.0, color="black", linewidth=0.8)
    by_plant.set_xscale("log")
    by_plant.set_xlabel("error on drawn plants over that of strong SSC [-]")
    by_plant.set_ylabel("share of plants and seas [%]")
    by_plant.grid(alpha=0.3)
    by_plant.legend(fontsize="small", frameon=False)
    return result
