"""Detail behind a plan's first page: every cell, every phase by every tier, waiting, the inputs that govern the limits,
and from which landing tolerance, payload and depth on a better controller pays."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.answer.sweep import Pays, answer_of, pays_at
from stillhook.plan.report.figures import ANSWER, drawn
from stillhook.plan.report.limits_summary import alike, limits_table, side_by_side, verdict, waiting
from stillhook.plan.report.words import (
    CREDITED,
    OVER,
    TEXTS,
    TWIN,
    codes,
    few,
    gain,
    governing_of,
    governs,
    height,
    highest,
    leading,
    lines_of,
    named,
    names,
    of_wind_sea,
    phase_code,
    rule_code,
    sentence,
    workable,
)
from stillhook.plan.result import Credit, PlanResult, merged, references
from stillhook.plan.weather.records import IN_WINDOWS
from stillhook.report.document import Bullets, Figure, Part, Table, Text, facts
from stillhook.report.formatting import direction, fixed, fmt, hours, percent
from stillhook.units import number
from stillhook.weather.persistence import MONTHS

if TYPE_CHECKING:
    import xarray

BEHIND, RESEARCH = ("depth", "landing"), ("efficiency", "convergence")
"""Blocks behind the limits, and those that are of no use for approval."""
PERIODS = 10
"""Columns of a table at most."""


def limit_cells(result: PlanResult, figures: Mapping[str, Figure]) -> list[Part]:
    """The table that the operation is run by, of the claimable limits, its figure, and how a cell is read."""
    return [
        limits_table(result, simulated=False),
        *(picture(figures, ANSWER) or ([alike(result)] if figures else [])),
        Text(TEXTS["reading"].format(highest=number(highest(result), 3))),
        *([Text(f"Limiting Hs{of_wind_sea(result)}.")] if of_wind_sea(result) else []),
    ]


def alternatives(result: PlanResult, figures: Mapping[str, Figure]) -> list[Part]:
    """All alternatives side by side, credited and simulated: curves, tables of cells, what governs."""
    cells = [stem for stem in figures if stem.startswith("limits-") and stem != "limits-over-period"]
    return [
        *map(Text, verdict(result).text),
        side_by_side(result),
        *picture(figures, "limits-over-period"),
        *(figures[stem] for stem in cells),
        _governing(result),
    ]


def picture(figures: Mapping[str, Figure], stem: str) -> list[Part]:
    """A figure where it was drawn."""
    return [figures[stem]] if stem in figures else []


def _governing(result: PlanResult) -> Part:
    """How often what governs, for every alternative, as credited."""
    labels, data = names(result.data), result.data.sel(credit=CREDITED)
    pairs_of = {name: Counter(governing_of(data.sel(alternative=name))) for name in labels}
    counted: Counter[tuple[str, str, str]] = sum(pairs_of.values(), Counter())
    rows = []
    for of, _ in counted.most_common():
        code = codes(result, *of)
        what = f"{code}: {governs(*of)}" if code else "no limit up to the highest sea state, or no result"
        rows.append([what, *(str(pairs_of[name].get(of, "")) for name in labels)])
    return Table(("governs, credited", *(named(x) for x in labels)), rows, "What governs, in cells of the table")


def by_phase(result: PlanResult) -> list[Part]:
    """Least limit of every phase by every tier for the leading alternative, and what is credited; every rule's least
    limit."""
    name, data = leading(result), result.data
    columns = few(data.sizes["period"], PERIODS)
    rows: list[list[str]] = []
    strong: list[int] = []
    for phase in names(data, "phase"):
        counts = data["counts"].sel(alternative=name, phase=phase).values
        label = f"{phase_code(result, phase)} {phase}"
        rows_of_tiers = [
            (tier, _of_phase(result, TWIN, [tier], name, phase), counts == tier) for tier in names(data, "tier")
        ]
        rows_of_tiers.append(
            (CREDITED, _of_phase(result, CREDITED, names(data, "tier"), name, phase), np.zeros(0, dtype=bool))
        )
        for by, Hs, at in rows_of_tiers:
            if np.isnan(Hs).all():
                continue
            if by == CREDITED:
                strong.append(len(rows))
            seeds = int(data["n_seeds"].sel(alternative=name, phase=phase).values[at].max()) if at.any() else 0
            worst = np.where(np.isnan(Hs).all(axis=0), np.nan, np.fmin.reduce(Hs, axis=0))
            worst = np.where(np.isposinf(worst) & np.isnan(Hs).any(axis=0), np.nan, worst)
            rows.append([label, by, str(seeds or ""), *(height(float(worst[k]), highest(result)) for k in columns)])
    head = ("phase", "by", "seeds", *(f"{data['period'].values[k]:g} s" for k in columns))
    sentence = (
        f"Least limit over the rules [m] at the worst heading, with {named(name)}: by each tier, and credited (bold),"
        ' which is no more than with the flat cap. "-": the tier does not have the rule that limits there.'
    )
    return [Text(sentence), Table(head, rows, bold_rows=strong), *_by_rule(result, name)]


def _of_phase(result: PlanResult, credit: Credit, tiers: Sequence[str], name: str, phase: str) -> FloatArray:
    """Least limit over some tiers and the rules (heading, period) [m]; NaN where none is determined."""
    values = result.data["Hs_rule"].sel(credit=credit, tier=list(tiers), alternative=name, phase=phase).values
    Hs = np.asarray(values, dtype=float).reshape(-1, *values.shape[-2:])
    least = np.where(np.isnan(Hs).all(axis=0), np.nan, np.where(np.isnan(Hs), np.inf, Hs).min(axis=0))
    if credit == TWIN:  # of a tier that has not the rule that limits by another one
        every = result.data["Hs_rule"].sel(credit=credit, alternative=name, phase=phase)
        limits = np.isfinite(every.transpose("tier", "rule", ...).values).any(axis=0)
        least = np.where(np.isposinf(least) & (np.isnan(Hs) & limits).any(axis=0), np.nan, least)
    if credit == CREDITED and "Hs_steepest" in result.data:
        least = np.minimum(least, result.data["Hs_steepest"].values)
    return np.asarray(least)


def _by_rule(result: PlanResult, name: str) -> list[Part]:
    """Rules that limit anything, with their least limits by every tier and as credited; the others in a sentence."""
    data, tiers, top = result.data, names(result.data, "tier"), highest(result)
    Hs_rule = data["Hs_rule"].sel(alternative=name)
    rows, rest = [], []
    for phase in names(data, "phase"):
        for rule in names(data, "rule"):
            modelled, credited = (Hs_rule.sel(credit=c, phase=phase, rule=rule).values for c in (TWIN, CREDITED))
            code = f"{phase_code(result, phase)} {rule_code(result, rule)}"
            final = np.where(np.isnan(credited), np.inf, credited).min(axis=0)
            if np.isnan(modelled).all() and np.isnan(credited).all():
                continue
            if np.isposinf(final).all() and not np.isfinite(modelled).any():
                rest.append(code)
                continue
            cells = [_lowest(modelled[t], top) for t in range(len(tiers))]
            i, k = np.unravel_index(int(final.argmin()), final.shape)
            at = (
                f"{data['period'].values[k]:g} s, {direction(data['heading'].values[i])}"
                if np.isfinite(final.min())
                else ""
            )
            rows.append([code, governs(phase, rule), *cells, _lowest(credited, top), at])
    inside = f"Inside up to {number(top, 3)} m wherever they are assessed: {', '.join(rest)}."
    header = ("", "phase: rule", *tiers, "credited", "least at")
    title = "Least limit of every rule over all cells, by each tier and credited"
    limits = Table(header, rows, title, bold_columns=[header.index("credited")])
    return [*([limits] if rows else []), *([Text(inside)] if rest else [])]


def _lowest(Hs: FloatArray, top: float) -> str:
    """Least of limits as text; "-" where none is determined."""
    return "-" if np.isnan(Hs).all() else height(float(np.nanmin(Hs)), top)


def weather(result: PlanResult, figures: Mapping[str, Figure]) -> list[Part]:
    """Operability, waiting and what each alternative gains; empty where no weather was given."""
    if "weather" not in result:
        return [Text("The plan has no weather: waiting is not calculated. Add [weather] to the plan file.")]
    return [
        *([Text(f"{TEXTS['synthetic']}.")] if result["weather"].attrs["synthetic"] else []),
        *map(Text, waiting(result)),
        facts(_series(result)),
        year_table(result),
        *picture(figures, "waiting-by-month"),
        _by_month(result),
    ]


def year_table(result: PlanResult) -> Table:
    """How often each alternative can work, how long it waits, and what it gains over the others."""
    block = result["weather"]
    year, over = block.sel(month=0), references(block, result.facts["tiers"])
    rows = []
    for name in names(block):
        for label, credit in lines_of(result, name):
            cells = year.sel(credit=credit, alternative=name)
            vessel, censored = fmt(float(cells["vessel_days"]), digits=3), fixed(float(cells["n_censored"]), 0)
            rows.append([label, *workable(cells), vessel, *(_gains(cells, o) for o in over), censored])
    heads = {"none": "over none", "cap-80": "over cap", "best-classic": "over classic"}
    head = ("", "operability", "mean wait", "P50", "P90", "vessel days", *(heads.get(o, o) for o in over), "censored")
    gained = f"gained over {', '.join(OVER.get(o, o) for o in over)}: vessel days an operation, hours a year"
    synthetic = "SYNTHETIC weather, " if block.attrs["synthetic"] else ""
    return Table(head, merged(rows, result), f"{synthetic}{block.attrs['source']}, whole year; {gained}")


def _gains(cells: Any, over: str) -> str:
    """Days of waiting an operation and workable hours a year that are gained, of a row of the weather block."""
    return f"{gain(cells, over)} d, {_more(float(cells['hours_gained'].sel(over=over)), 0)} h"


def _more(x: float, digits: int) -> str:
    if math.isnan(x):
        return "-"
    rounded = round(x, digits)
    return f"{rounded:+.{digits}f}" if rounded else "0"


def _series(result: PlanResult) -> list[tuple[str, str]]:
    """What the waiting was counted on."""
    block, attrs = result["weather"], result["weather"].attrs
    cells = block.sel(credit=result.claim, alternative=leading(result), month=0)
    n_hours, n_gaps = (fixed(float(cells[key]), 0) for key in ("n_hours", "n_gaps"))
    rows = [
        ("series", f"{attrs['source']}{' (SYNTHETIC)' if attrs['synthetic'] else ''}"),
        ("from, to", f"{attrs['first']} to {attrs['last']}"),
        ("hours, gaps", f"{n_hours} h, {n_gaps} gaps"),
        ("window", f"{hours(attrs.get('window', attrs['T_R']))}: T_R = {hours(attrs['T_R'])} without the lead time"),
    ]
    if "outside" in attrs:
        share = percent(float(attrs["outside"]))
        rows.append(("outside the table", f"{share} of the records: counted as not workable"))
    ship = float(attrs["ship"])
    fixed_at = f"fixed, bow at {direction(ship)} from north"
    free = f"free to turn: one heading through each operation, the best one for each; {IN_WINDOWS}"
    open_ = [("forecast factor", attrs["case_by_case"])] if attrs.get("case_by_case") else []
    heading = ("vessel's heading", free if math.isnan(ship) else fixed_at)
    return [*rows, ("limit", attrs["limit"]), *open_, heading]


def _by_month(result: PlanResult) -> Part:
    block, rows = result["weather"], []
    for month, label in enumerate(MONTHS, start=1):
        cells = block.sel(credit=result.claim, alternative=leading(result), month=month)
        if math.isnan(float(cells["operability"])):
            continue
        counts = [fixed(float(cells[k]), 0) for k in ("n_windows", "n_windows_long_enough", "n_censored")]
        rows.append([label, *workable(cells), *counts])
    header = ("month", "operability", "mean wait", "P50", "P90", "windows", "long enough", "censored")
    return Table(header, rows, f"By month with {named(leading(result))}, {result.claim}")


def behind(result: PlanResult, figures: Mapping[str, Figure], blocks: Sequence[str] = BEHIND) -> list[Part]:
    """Some blocks: those that were computed, and why the others were not."""
    parts: list[Part] = []
    for name in blocks:
        if name in result:
            parts += picture(figures, name) if drawn(result, name) else [Text(TEXTS["captions"]["no-convergence"])]
    reasons = result.facts.get("not_computed", {})
    missing = [f"{n} ({sentence(reasons[n])})" if n in reasons else n for n in blocks if n not in result]
    return [*parts, Text(f"Not computed in this run: {', '.join(missing)}.")] if missing else parts


def tolerance_sweep(result: PlanResult, figures: Mapping[str, Figure]) -> list[Part]:
    """The answer of every payload and depth, a figure, and the best new against the best classic controller."""
    if "sweep" not in result:
        reason = result.facts.get("not_computed", {}).get("sweep", "")
        return [Text(f"Not computed in this run{f': {sentence(reason)}' if reason else ''}.")]
    block = result["sweep"]
    answer = answer_of(block)
    low, high = (number(float(block["height"].values[i]), 3) for i in (0, -1))
    text = TEXTS["sweep"].format(
        phase=answer["phase"], runs=answer["n_runs"], seeds=answer["n_seeds"], low=low, high=high
    )
    control = " The control error of the wire, which has a rule in this plan, is held to the same tolerance."
    left_out = [Text(f"Left out: {'; '.join(answer['left_out'])}.")] if answer["left_out"] else []
    return [
        Text(text + (control if "e_c_pp" in answer["quantities"] else "")),
        Bullets([f"{line[0].upper()}{line[1:]}." for line in answers(block)]),
        *left_out,
        *_table(result),
    ]


def _table(result: PlanResult) -> list[Table]:
    """The best classic and the best new controller at every tolerance, with their intervals; bold where the new one
    lands in higher seas by more than those."""
    block = result["sweep"]
    heights = float(block["height"].values[0]), float(block["height"].values[-1])
    rows: list[list[str]] = []
    strong: list[int] = []
    for v, variant in enumerate(names(block, "variant")):
        last: tuple[list[str], int] | None = None
        for k, each in enumerate(pays_at(block, v)):
            cells: list[str] = []
            for name, Hs in ((each.classic, each.Hs_classic), (each.new, each.Hs_new)):
                value, low, high = (height_in_ladder(float(x), heights) for x in Hs)
                cells += [named(name), value, f"{low} to {high}" if len({value, low, high}) > 1 else ""]
            if (cells, each.verdict) == last:  # tolerances with one answer are one row
                rows[-1][1] = f"{rows[-1][1].partition(' to ')[0]} to {each.tolerance:.3g}"
                continue
            last = cells, each.verdict
            if each.verdict == 1:
                strong.append(len(rows))
            rows.append([variant if k == 0 else "", f"{each.tolerance:.3g}", *cells])
    head = ("payload, depth, period", "tolerance [m]", "classic", "Hs [m]", "95 %", "new", "Hs [m]", "95 %")
    title = "Limiting Hs over the seabed with the best classic and the best new controller; bold: the new one is higher"
    return [Table(head, rows, f"{title} by more than the intervals", bold_rows=strong)] if rows else []


PLACES = {
    "": "as planned",
    "period": "as planned",
    "payload": "other payload",
    "depth": "other depth",
    "delay": "other sensors",
}
"""What a variant is, in words."""


NONE = "the plan does not have a new and a classic controller side by side"


def answers(block: xarray.Dataset) -> list[str]:
    """From which tolerance on a better controller pays, a sentence for each variant."""
    heights = float(block["height"].values[0]), float(block["height"].values[-1])
    rows = [(v, name, pays_at(block, v)) for v, name in enumerate(names(block, "variant"))]
    lines = [
        f"{name} ({PLACES[str(block['varied'].values[v])]}): {in_words(of, heights)}" for v, name, of in rows if of
    ]
    return lines or [NONE]


def in_words(of: Sequence[Pays], heights: tuple[float, float]) -> str:
    """From which tolerance down the best new controller lands in higher seas, from comparisons over rising tolerances,
    one at least; heights: ends of the ladder [m]."""
    better = list(_ranges(of, np.array([each.verdict == 1 for each in of])))
    worse = list(_ranges(of, np.array([each.verdict == -1 for each in of])))
    if better:
        first, last = better[-1]
        text = f"a new controller lands in higher seas {' and '.join(_span(*each) for each in reversed(better))}"
        text += f"; {_against(last, heights)}"
        text += f", and {_against(first, heights)}" if first is not last else ""
    else:
        closest = max(of, key=lambda each: min(each.Hs_new[1], heights[1]) - min(each.Hs_classic[2], heights[1]))
        text = "at no tolerance does a new controller land in higher seas by more than the intervals"
        text += f"; {_against(closest, heights)}"
    if worse:
        text += (
            f". The classic controller lands in higher seas {' and '.join(_span(*each) for each in reversed(worse))}"
        )
    return text


def _ranges(of: Sequence[Pays], true: BoolArray) -> Iterator[tuple[Pays, Pays]]:
    """First and last of every row of neighbours for which something is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], true.astype(int), [0]))))
    for begin, end in edges.reshape(-1, 2):
        yield of[int(begin)], of[int(end) - 1]


def _span(first: Pays, last: Pays) -> str:
    if first is last:
        return f"at a tolerance of {first.tolerance:.3g} m"
    return f"from a tolerance of {last.tolerance:.3g} m down to {first.tolerance:.3g} m"


def _against(each: Pays, heights: tuple[float, float]) -> str:
    new, classic = (
        f"{named(name)} {_limit(Hs, heights)}"
        for name, Hs in ((each.new, each.Hs_new), (each.classic, each.Hs_classic))
    )
    return f"at {each.tolerance:.3g} m: {new} against {classic}"


def _limit(Hs: FloatArray, heights: tuple[float, float]) -> str:
    """A limit with its interval, such as "1.21 m (1.1 to 1.3)"."""
    value, low, high = (height_in_ladder(float(x), heights) for x in Hs)
    return f"{value} m ({low} to {high})" if len({value, low, high}) > 1 else f"{value} m"


def height_in_ladder(Hs: float, heights: tuple[float, float]) -> str:
    """A limit [m] as text: "< 0.4" below the ladder, "> 5" above it."""
    lowest, highest = heights
    if Hs < lowest:
        return f"< {lowest:.3g}"
    return f"> {highest:.3g}" if Hs > highest else f"{Hs:.2f}"
