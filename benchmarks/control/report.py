"""Tables and figure of the benchmark, from its outcome, SI; None for a number that there is not.

Of every entry ("entries") settings and scores by sea, leads that were tried, ratios of the error on drawn plants to
that of the reference by sea, and margin; errors under late motion units ("late"); the load's motion in deep water
("deep").
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, StrMethodFormatter
from rich.console import Console
from rich.table import Table

from benchmarks.control.course import SCORES
from benchmarks.control.deep import SCORE, Deep
from benchmarks.control.entries import REFERENCE
from benchmarks.control.late import PREDICTED, Late
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
Outcome = Mapping[str, Mapping[str, Mapping[str, Any]]]
Rows = tuple[list[str], list[list[str]]]


def outcome(found: Sequence[Result], margins: Sequence[Margin], late: Sequence[Late], deep: Sequence[Deep]) -> Outcome:
    """What tables and figure are made from, ready for JSON."""
    entries = {
        r.entry.name: {
            "settings": r.settings,
            "leads": r.leads,
            "scores": r.scores,
            "ratios": {sea: [float(f"{x:.4g}") for x in q] for sea, q in r.ratios.items()},
            "strict": {sea: [float(f"{x:.4g}") for x in q] for sea, q in r.strict.items()},
            "margin": m,
        }
        for r, m in zip(found, margins, strict=True)
    }
    parts = {"entries": entries, "late": {x.name: x for x in late}, "deep": {x.name: x for x in deep}}
    plain: Outcome = for_json(parts)
    return plain


def for_json(x: Any) -> Any:
    """Records as mappings, keys as text, and None for a number that is not finite."""
    if hasattr(x, "_asdict"):
        x = x._asdict()
    if isinstance(x, Mapping):
        return {key if isinstance(key, str) else f"{key:g}": for_json(y) for key, y in x.items()}
    if isinstance(x, (list, tuple)):
        return [for_json(y) for y in x]
    return x if not isinstance(x, float) or math.isfinite(x) else None


def mean(entry: Mapping[str, Any], score: str) -> float:
    """Of a score over the seas."""
    return float(np.mean([number(s[score]) for s in entry["scores"].values()]))


def number(x: float | None) -> float:
    """NaN for a number that there is not: of a run that failed."""
    return math.nan if x is None else x


def all_ratios(entry: Mapping[str, Any], of: str = "ratios") -> FloatArray:
    """Error on drawn plants over that of the reference, all seas; a run that failed counts as beyond any. of: "ratios"
    with the reference's lead of the sea, "strict" with its best lead on each plant."""
    return np.nan_to_num(np.concatenate([np.array(q, float) for q in entry[of].values()]), nan=np.inf)


def scores_table(found: Outcome) -> Rows:
    """Means over the seas."""
    entries = found["entries"]
    head = ["entry", *(f"{SCORES[s]}, {unit}" for s, (_, unit, _) in SHOWN.items())]
    rows = [
        [name, *(f"{factor * mean(e, s):.{digits}f}" for s, (factor, _, digits) in SHOWN.items())]
        for name, e in entries.items()
    ]
    return head, rows


def plants_table(found: Outcome) -> Rows:
    """Ratio to the reference on drawn plants."""
    entries = found["entries"]
    rows = []
    for name, e in entries.items():
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
    entries = found["entries"]
    rows = []
    for sea in entries[REFERENCE]["scores"]:
        least = entries[REFERENCE]["scores"][sea]["e_c_pp"]
        cells = []
        for name, e in entries.items():
            x, lead = number(e["scores"][sea]["e_c_pp"]), 1e3 * e["settings"][sea]["lead"]
            shown = f"{1e2 * x:.1f} cm" if name == REFERENCE else f"{x / least:.2f}"
            cells.append(f"{shown} ({lead:.0f} ms)")
        rows.append([sea, *cells])
    return ["sea", *entries], rows


def loses(e: Mapping[str, Any], reference: Mapping[str, Any]) -> str:
    """Where an entry is worse than the reference: what, in how many seas, and the worst."""
    out = []
    for score, text in SCORES.items():
        q = {sea: number(s[score]) / max(reference["scores"][sea][score], 1e-9) for sea, s in e["scores"].items()}
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
    entries = found["entries"]
    rows = [[name, loses(e, entries[REFERENCE])] for name, e in entries.items() if name != REFERENCE]
    return ["entry", "loses against strong SSC"], rows


def margins_table(found: Outcome) -> Rows:
    """Margins of each entry at its largest gain; of an FMU what can be seen from outside."""
    head = ["entry", "K_p", "gain margin", "phase margin", "delay margin"]
    head += ["twin: error grows by half", "twin: disturbance stays"]
    rows = []
    for name, e in found["entries"].items():
        m = Margin(**{key: math.inf if x is None else x for key, x in e["margin"].items()})
        K_p = f"{m.K_p:.3f} 1/m" if math.isfinite(m.K_p) else "-"
        if math.isfinite(m.gain_margin):
            dB, deg = 20.0 * math.log10(m.gain_margin), math.degrees(m.phase_margin)
            cells = [f"{dB:.1f} dB", f"{deg:.0f} deg", f"{m.delay_margin:.1f} s"]
            cells += [_until(m.factor_grows, m.later_grows), _until(m.factor_stays, m.later_stays)]
        else:
            cells = ["-", "-", "-", _factor(m.factor_grows) if math.isfinite(m.K_p) else "-", "-"]
        rows.append([name, K_p, *cells])
    return head, rows


def _until(factor: float, later: float) -> str:
    """Factor on K_p, or delay of the pumps' commands."""
    delay = f"{1e3 * later:.0f} ms" if math.isfinite(later) else "no delay"
    return f"{_factor(factor)}, {delay}"


def _factor(factor: float) -> str:
    return f"{factor:.1f} K_p" if math.isfinite(factor) else "no K_p"


def late_table(found: Outcome) -> Rows:
    """Error by delay of the motion unit, mean over the seas, with the leads that are best."""
    rows = []
    for name, e in found["late"].items():
        cells = []
        for delay, errors in e["errors"].items():
            leads = e["leads"][delay].values()
            cells.append(f"{centimetres(errors.values())} ({span(leads)})")
        rows.append([name, *cells])
    delays = next(iter(found["late"].values()))["errors"]
    return ["entry", *(f"{1e3 * float(delay):.0f} ms late" for delay in delays)], rows


def deep_table(found: Outcome) -> Rows:
    """Motion of the load on a long wire by case, with the lead that is best."""
    deep = found["deep"]
    rows = [
        [case, *(f"{centimetres([e['motions'][case]])} ({span([e['leads'][case]])})" for e in deep.values())]
        for case in next(iter(deep.values()))["motions"]
    ]
    rows.append(["K_p", *(f"{e['K_p']:.3f} 1/m" for e in deep.values())])
    return ["case", *deep], rows


def centimetres(values: Iterable[float | None]) -> str:
    """Mean of lengths; "failed" where one is missing."""
    known = list(values)
    return "failed" if None in known else f"{1e2 * float(np.mean(np.array(known, float))):.1f} cm"


def span(leads: Iterable[float]) -> str:
    """Least and largest of some leads [ms]."""
    known = [1e3 * lead for lead in leads]
    return f"{min(known):.0f} ms" if min(known) == max(known) else f"{min(known):.0f} to {max(known):.0f} ms"


def ends(found: Outcome) -> list[str]:
    """A line for each entry whose best lead is at an end of those that were tried: a better one may be beyond."""
    lines = []
    for name, e in found["entries"].items():
        tried = e["leads"]
        at = [s["lead"] for s in e["settings"].values() if len(tried) > 1 and s["lead"] in (min(tried), max(tried))]
        if at:
            seas = f"{len(at)} of {len(e['settings'])} seas"
            lines.append(f"{name}: its best lead is at an end of those that were tried in {seas} ({span(at)}).")
    return lines


TABLES = {
    "scores": scores_table,
    "seas": seas_table,
    "plants": plants_table,
    "margins": margins_table,
    "late": late_table,
    "deep": deep_table,
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
    for line in ends(found):
        console.print(line)


def figure(found: Outcome) -> Figure:
    """Error by sea, the ratio on drawn plants, error by delay, and the load's motion in deep water."""
    result = Figure(figsize=(10.0, 11.5), layout="constrained")
    axes = result.subplot_mosaic([["seas", "seas"], ["plants", "plants"], ["late", "deep"]])
    colours = {name: f"C{i}" for i, name in enumerate(found["entries"])}
    _bars(axes["seas"], {name: e["scores"] for name, e in found["entries"].items()}, "e_c_pp", colours)
    axes["seas"].set_ylabel("error at the wire,\npeak to peak [cm]")
    axes["seas"].legend(ncols=5, fontsize="small", frameon=False, loc="upper left")
    for name, e in found["entries"].items():
        q = np.sort(all_ratios(e))
        axes["plants"].step(q, 100.0 * np.arange(1, len(q) + 1) / len(q), color=colours[name], label=name)
    axes["plants"].axvline(1.0, color="black", linewidth=0.8)
    axes["plants"].set_xscale("log")
    axes["plants"].set_xlabel("error on drawn plants over that of strong SSC [-]")
    axes["plants"].set_ylabel("share of plants and seas [%]")
    axes["plants"].grid(alpha=0.3)
    for name, e in found["late"].items():
        delays = [1e3 * float(delay) for delay in e["errors"]]
        error = [1e2 * float(np.mean([number(x) for x in of.values()])) for of in e["errors"].values()]
        style = "--" if PREDICTED in name else "-"
        axes["late"].plot(delays, error, style, marker=".", color=colours[name.removesuffix(PREDICTED)], label=name)
    axes["late"].set_xlabel("delay of the motion unit [ms]")
    axes["late"].set_ylabel("error at the wire [cm]")
    axes["late"].set_ylim(bottom=0.0)
    axes["late"].grid(alpha=0.3)
    axes["late"].legend(fontsize="small", frameon=False)
    motions = {name: {case: {SCORE: x} for case, x in e["motions"].items()} for name, e in found["deep"].items()}
    _bars(axes["deep"], motions, SCORE, colours)
    axes["deep"].set_xticks(axes["deep"].get_xticks(), range(1, 1 + len(next(iter(motions.values())))))
    axes["deep"].set_xlabel("case in deep water, as in the table")
    axes["deep"].set_ylabel("motion of the load,\npeak to peak [cm]")
    return result


def _bars(ax: Axes, of: Mapping[str, Mapping[str, Mapping[str, Any]]], score: str, colours: Mapping[str, str]) -> None:
    """A score [m] of entries by case, a group of bars for each case."""
    cases, width = list(next(iter(of.values()))), 0.8 / len(of)
    for i, (name, by_case) in enumerate(of.items()):
        x = np.arange(len(cases)) + (i - 0.5 * (len(of) - 1)) * width
        ax.bar(x, [1e2 * number(by_case[case][score]) for case in cases], width, label=name, color=colours[name])
    ax.set_yscale("log")
    ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    for which in (ax.yaxis.set_major_formatter, ax.yaxis.set_minor_formatter):
        which(StrMethodFormatter("{x:g}"))
    ax.set_xticks(range(len(cases)), [case.replace(", ", "\n") for case in cases], fontsize="small")
    ax.grid(axis="y", alpha=0.3)
