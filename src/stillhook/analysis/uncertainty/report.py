"""Results of many draws as plain data in SI and as a document: factors, bands, limits, differences, indices,
causes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook.analysis.uncertainty.attribution import Attribution
from stillhook.analysis.uncertainty.bands import Limit, bands, chances, failures, paired_difference, troubles
from stillhook.analysis.uncertainty.sobol import MATTERS, Index, Sensitivity
from stillhook.report.document import Document, Part, Section, Table, Text
from stillhook.report.formatting import cell, change, percent_fixed
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.statistics.estimate import Estimate
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


NAMES = ("e_c_pp", "eta_c", "p_max", "u_p_max", "alpha_m_min")
"""Numbers of the summary with reported bands, where the winch type has them."""
COMPARED = ("e_c_pp", "p_max")
"""Numbers whose paired differences are reported."""
AT_MOST = 0.05
"""Tolerated probability of exceeding a limit unless another is given [-]: the 95 % that bands are reported
for."""


class Verdict(NamedTuple):
    """Whether a case keeps a limit: the chance of going beyond it, and whether that is at most the tolerated one."""

    chance: Estimate
    kept: bool


def verdicts(run: xarray.Dataset, limits: Sequence[Limit], at_most: float = AT_MOST) -> dict[str, dict[str, Verdict]]:
    """Case -> limit in words -> verdict, by the share of the draws itself (its interval is the confidence)."""
    out: dict[str, dict[str, Verdict]] = {str(c): {} for c in run["case"].values}
    for limit in limits:
        for case, chance in chances(run, limit).items():
            out[case][str(limit)] = Verdict(chance, chance.value <= at_most)
    return out


def report(
    run: xarray.Dataset,
    limits: Sequence[Limit] = (),
    at_most: float = AT_MOST,
    pairs: Sequence[tuple[str, str]] = (),
    indices: Sequence[Sensitivity] = (),
) -> dict[str, Any]:
    """Everything as plain data; pairs: cases to compare draw by draw; indices: of
    `stillhook.analysis.uncertainty.sobol`."""
    band, trouble, failed, verdict = (
        bands(run, [name for name in NAMES if name in run]),
        troubles(run),
        failures(run),
        verdicts(run, limits, at_most),
    )
    at_values = json.loads(run.attrs["at_values"])
    cases = {
        c: {
            "at_values": at_values[c],
            "band_90": {name: b._asdict() for name, b in band[c].items()},
            "beyond_limits": _chance(trouble[c]),
            "limits": {
                text: {**_chance(v.chance), "at_most": at_most, "kept": v.kept} for text, v in verdict[c].items()
            },
            "failed": failed[c],
        }
        for c in band
    }
    differences: dict[str, Any] = {}
    for case, other in pairs:
        paired = {name: paired_difference(run, case, other, name) for name in COMPARED if name in run}
        differences[f"{case} / {other}"] = {
            name: {"relative": p.relative._asdict(), "lower": _chance(p.lower)} for name, p in paired.items()
        }
    return {
        "twin": str(run.attrs["twin"]),
        "draws": int(run.sizes["draw"]),
        "seed": int(run.attrs["seed"]),
        "factors": json.loads(run.attrs["factors"]),
        "cases": cases,
        "differences": differences,
        "sensitivity": [_indices(s) for s in indices],
    }


def _chance(share: Estimate) -> dict[str, Any]:
    hits = round(share.value * share.n)
    return {**share.to_dict("share"), "hits": hits, "n": share.n}


def _index(index: Index) -> dict[str, float]:
    return {
        name + end: value
        for name, e in (("first", index.first), ("total", index.total))
        for end, value in (("", e.value), ("_low", e.low), ("_high", e.high))
    }


def _indices(s: Sensitivity) -> dict[str, Any]:
    return {
        "case": s.case,
        "output": s.output,
        "mean": s.mean,
        "deviation": s.deviation,
        "indices": {name: _index(i) for name, i in s.indices.items()},
        "converged": s.converged,
        "change": s.change,
        "runs": s.runs,
        "statements": [*s.words(), s.convergence()],
    }


FEWEST_DRAWS = 20
"""Fewest draws of which one is expected outside either end of a 5 to 95 % band."""
FACTORS = ("uncertain", "distribution", "because")
WORDS = {"e_c_pp": "error", "p_max": "pressure"}
"""What the columns call the numbers of `COMPARED`."""
MULTIPLES = "Numbers without a unit are multiples of the crane's own number."
LIMITS = ("mode", "limit", "draws beyond it", "tolerated", "")


def document(
    crane: Crane,
    case: Scenario,
    factors: Sequence[Sequence[str]],
    data: dict[str, Any],
    indices: Sequence[Sensitivity] = (),
    causes: Attribution | None = None,
) -> Document:
    """factors: name, distribution and reason of each; data: of `stillhook.analysis.uncertainty.report.report`."""
    tip = case.tip.describe().split(":")[0]
    subject = f"{crane.name}, {show(case.load, 'mass')}, {show(case.s_w, 'length')} of wire out, tip: {tip}"
    sampling = f"{data['draws']} draws (seed {data['seed']}), the same for every mode"
    bands = [_bands(label, case_) for label, case_ in data["cases"].items()]
    known = [name for name in COMPARED if all(name in case_["band_90"] for case_ in data["cases"].values())]
    ends = [f"{WORDS[name]}\n{column}" for name in known for column in ("as described", "median", "5 to 95 %")]
    head = ("mode", *ends, "limits of the\nwinch exceeded")
    parts: list[Part] = [Table(head, bands, sampling), *map(Text, _remarks(data, known)), *_limits(data)]
    if data["differences"]:
        columns = [text for name in known for text in _difference_head(WORDS[name])]
        rows = [_difference(text, x) for text, x in data["differences"].items()]
        parts.append(Table(("draw by draw", *columns), rows))
    sections = [
        Section("Factors", [Table(FACTORS, factors), Text(MULTIPLES)]),
        Section(" and ".join(WORDS[name] for name in known).capitalize(), parts),
        *(
            _index_table([s for s in indices if s.output == output])
            for output in dict.fromkeys(s.output for s in indices)
        ),
        *([_causes(causes)] if causes is not None else []),
    ]
    return Document("Uncertainty", sections, name=subject)


def _bands(label: str, case: dict[str, Any]) -> list[str]:
    """A mode: as described, median and band of each number that is compared, and the chance of trouble."""
    row = [label]
    for name in (name for name in COMPARED if name in case["band_90"]):
        band = case["band_90"][name]
        low, high = cell(name, band["low"]), cell(name, band["high"])
        described, median = cell(name, float(case["at_values"][name])), cell(name, band["median"])
        row += [described, median, f"{low.split(' ')[0]} to {high}"]
    return [*row, _chance_text(case["beyond_limits"])]


def _chance_text(chance: dict[str, Any]) -> str:
    """A chance with its interval."""
    share, low, high = (percent_fixed(chance[key], 1) for key in ("share", "low", "high"))
    return f"{share} ({low} to {high})"


def _remarks(data: dict[str, Any], known: Sequence[str]) -> Iterator[str]:
    if data["draws"] < FEWEST_DRAWS:
        yield f"too few draws for a 5 to 95 % band: its ends are the draws themselves. Use {FEWEST_DRAWS} or more."
    for label, case in data["cases"].items():
        if case["beyond_limits"]["share"] == 1.0:
            numbers = f"{' and '.join(WORDS[name] for name in known)} {'are' if len(known) > 1 else 'is'}"
            yield f"{label}: every draw goes beyond a limit of the winch; its {numbers} no working controller's"
    errors = {label: c["band_90"]["e_c_pp"]["high_error"] for label, c in data["cases"].items()}
    if all(math.isfinite(x) for x in errors.values()):
        values = ", ".join(f"{label} {cell('e_c_pp', x)}" for label, x in errors.items())
        yield f"standard error of the 95 % end of the error: {values}"
    for label, case in data["cases"].items():
        if case["failed"]:
            yield f"{label}: {case['failed']} draws diverged; they are in no band, and count as beyond every limit"


def _limits(data: dict[str, Any]) -> list[Table]:
    rows = [
        [label, text, _chance_text(v), percent_fixed(v["at_most"], 1), "kept" if v["kept"] else "exceeded"]
        for label, case in data["cases"].items()
        for text, v in case["limits"].items()
    ]
    return [Table(LIMITS, rows)] if rows else []


def _difference_head(word: str) -> tuple[str, str, str]:
    return f"{word}\nmedian", f"{word}\n5 to 95 %", "lower\nin"


def _difference(text: str, difference: dict[str, Any]) -> list[str]:
    """A pair of modes, see `_difference_head`."""
    row = [text]
    for numbers in difference.values():
        relative, lower = numbers["relative"], numbers["lower"]["share"]
        ends = f"{change(relative['low'])} to {change(relative['high'])}"
        row += [change(relative["median"]), ends, percent_fixed(lower, 0)]
    return row


def _index_table(indices: Sequence[Sensitivity]) -> Section:
    """One output: a row for each factor that matters somewhere, a column for each case."""
    largest: dict[str, float] = {}
    for s in indices:
        for name, x in s.indices.items():
            largest[name] = max(largest.get(name, 0.0), x.total.value)
    ranked = sorted((n for n, x in largest.items() if x >= MATTERS), key=lambda n: -largest[n])
    rest = [n for n in largest if n not in ranked]
    others = f"below {percent_fixed(MATTERS, 0)} everywhere: {', '.join(rest)}" if rest else "no other factor varies"
    rows = [[n, *(_index_text(s, n) for s in indices)] for n in ranked]
    parts: list[Part] = [
        Table(("variance from", *(s.case for s in indices)), rows),
        Text(f"alone (95 % interval), with all that the factor does together with others; {others}"),
        *(Text(f"{s.case}: {s.convergence()}") for s in indices if not s.converged),
    ]
    return Section(f"Causes of the variance of {indices[0].output}", parts)


def _index_text(s: Sensitivity, name: str) -> str:
    """The index of a factor alone with its interval, and with others."""
    x = s.indices.get(name)
    if x is None:
        return "-"
    low, high = max(x.first.low, 0.0), min(x.first.high, 1.0)
    alone, low_text, high_text, total = (
        percent_fixed(v, 0) for v in (max(x.first.value, 0.0), low, high, x.total.value)
    )
    return f"{alone} ({low_text} to {high_text}), {total}"


def _causes(attribution: Attribution) -> Section:
    header = ("cause", "from, to", *(f.name for f in attribution.figures))
    described = [f"{f.show(x)} {f.unit}" for f, x in zip(attribution.figures, attribution.base, strict=True)]
    rows = [["as described", "", *described]]
    for row in attribution.ranking():
        cells = [
            f"{', '.join(f.show(e.values[k]) for e in row.effects)}: {row.verdicts[k]}"
            for k, f in enumerate(attribution.figures)
        ]
        rows.append([row.cause, ", ".join(e.changes[0].end for e in row.effects), *cells])
    title = "Largest effect first: figures at both ends of every factor"
    return Section("Causes of the limits", [Table(header, rows, title), *map(Text, attribution.words())])
