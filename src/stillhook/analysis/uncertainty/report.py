"""Results of many draws: bands with their own uncertainty, chances of going beyond a limit, and paired differences, as
plain data in SI, as a document with indices and causes, and in pictures."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.uncertainty.attribution import Attribution
from stillhook.analysis.uncertainty.sobol import MATTERS, Index, Sensitivity, largest_totals
from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.engine.runner import FAILED, OK
from stillhook.engine.scenario.summary import numbers_of
from stillhook.errors import SpecError
from stillhook.report import kit
from stillhook.report.document import Document, Part, Section, Table, Text
from stillhook.report.formatting import cell, change, percent_fixed
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.statistics.estimate import Estimate
from stillhook.units import in_display, parse, quote, show
from stillhook.variables import BY_NAME, SUMMARY

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


INSIDE = 0.9
"""Share of the draws inside a band: 5 to 95 %."""
LEAST_FOR_ERRORS = 20
"""Draws below which an end of a band has no standard error: hardly one draw is beyond it."""
OFFSET = "offset"
NUMERIC = tuple(v.name for v in SUMMARY if v.name not in ("status", "notes"))


class Band(NamedTuple):
    """Median and the ends of a band, each with its standard error from so few draws; n draws with numbers, failed ones
    without."""

    low: float
    median: float
    high: float
    low_error: float
    median_error: float
    high_error: float
    n: int
    failed: int


class Limit(NamedTuple):
    """A bound on a number of the summary: at most (or at least) a value [SI]."""

    name: str
    at_most: bool
    value: float

    @classmethod
    def of(cls, text: str) -> Limit:
        """From a text such as "e_c_pp <= 10 cm" or "eta_c >= 0.95". Errors: SpecError, UnitError of one line."""
        match = re.fullmatch(r"\s*(\w+)\s*(<=|>=)\s*(\S.*?)\s*", text) if isinstance(text, str) else None
        if match is None:
            raise SpecError(f'limit {quote(text)}: write a name, <= or >=, and a value, such as "e_c_pp <= 10 cm".')
        name, sign, value = match.groups()
        if name not in NUMERIC:
            have = f"there are {', '.join(NUMERIC)}{nearest(name, NUMERIC)}"
            raise SpecError(f"limit {quote(text)}: {quote(name)} is not a result of the summary; {have}")
        kind = BY_NAME[name].kind
        if kind:
            return cls(name, sign == "<=", parse(value, kind, f"limit {name}"))
        try:
            return cls(name, sign == "<=", float(value))
        except ValueError:
            raise SpecError(f"limit {quote(text)}: {quote(value)}: must be a plain number.") from None

    def check(self, crane: Crane) -> None:
        """Errors: SpecError where runs of this crane's winch type have no such number."""
        available = numbers_of(crane)
        if self.name not in available:
            raise SpecError(
                f'limit {self}: winch type "{crane.plant}" of "{crane.name}" has no {self.name}. Choose one of'
                f" {', '.join(available)}."
            )

    def beyond(self, values: FloatArray) -> NDArray[np.bool_]:
        """Which values go beyond it; one that is not there does."""
        return ~(values <= self.value) if self.at_most else ~(values >= self.value)

    def __str__(self) -> str:
        kind = BY_NAME[self.name].kind
        return f"{self.name} {'<=' if self.at_most else '>='} {show(self.value, kind) if kind else self.value}"


def band(values: FloatArray) -> Band:
    """Median and 5-95 % band of the draws that have numbers. Standard errors by Maritz and Jarrett
    (scipy.stats.mstats.mjci).

    They are those of random draws; a Sobol sequence does somewhat better.
    """
    edge = 0.5 * (1.0 - INSIDE)
    finite = values[np.isfinite(values)]
    failed = len(values) - len(finite)
    at = (edge, 0.5, 1.0 - edge)
    low, median, high = np.quantile(finite, at).tolist() if len(finite) else [math.nan] * 3
    errors = _errors(finite, at)
    return Band(
        low=low,
        median=median,
        high=high,
        low_error=errors[0],
        median_error=errors[1],
        high_error=errors[2],
        n=len(finite),
        failed=failed,
    )


def _errors(values: FloatArray, at: tuple[float, ...]) -> list[float]:
    """Standard errors of quantiles; those of a number that does not vary are 0, those of few draws NaN."""
    from scipy.stats.mstats import mjci  # heavy

    if len(values) < LEAST_FOR_ERRORS:
        return [math.nan] * len(at)
    if np.ptp(values) == 0.0:
        return [0.0] * len(at)
    return [float(x) for x in mjci(values, prob=at)]


def bands(run: xarray.Dataset, names: Sequence[str]) -> dict[str, dict[str, Band]]:
    """Case -> name -> band, of a Dataset of `monte_carlo`."""
    return {str(c): {name: band(run[name].sel(case=c).values) for name in names} for c in run["case"].values}


def chance(holds: NDArray[np.bool_]) -> Estimate:
    """The share of draws for which something holds, with its interval."""
    return Estimate.of_share(int(np.count_nonzero(holds)), len(holds))


def chances(run: xarray.Dataset, limit: Limit) -> dict[str, Estimate]:
    """Case -> share of all draws beyond the limit; a draw that diverged is beyond every limit."""
    return {str(c): chance(limit.beyond(run[limit.name].sel(case=c).values)) for c in run["case"].values}


def troubles(run: xarray.Dataset) -> dict[str, Estimate]:
    """Case -> share of all draws that went beyond a limit of the winch: status is neither "ok" nor a standing offset
    alone, which pure active winches have by design and which shows in e_c_mean."""
    return {
        str(c): chance(~np.isin(run["status"].sel(case=c).values.astype(str), (OK, OFFSET))) for c in run["case"].values
    }


def failures(run: xarray.Dataset) -> dict[str, int]:
    """Case -> draws without numbers."""
    status = {str(c): run["status"].sel(case=c).values.astype(str) for c in run["case"].values}
    return {c: int(np.count_nonzero(np.isin(of, list(FAILED)))) for c, of in status.items()}


class Paired(NamedTuple):
    """One case against another, draw by draw: band of the relative difference, and the share of draws in which it is
    lower."""

    relative: Band
    lower: Estimate


def paired_difference(run: xarray.Dataset, case: str, other: str, name: str) -> Paired:
    """A number of one case over that of another, less 1, draw by draw: common draws cancel what both share."""
    a, b = (run[name].sel(case=c).values for c in (case, other))
    return Paired(band(a / b - 1.0), chance(a < b))


NAMES = ("e_c_pp", "eta_c", "p_max", "u_p_max", "alpha_m_min")
"""Numbers of the summary with reported bands, where the winch type has them."""
COMPARED = ("e_c_pp", "p_max")
"""Numbers whose paired differences are reported."""
AT_MOST = 0.05
"""Tolerated probability of exceeding a limit unless another is given [-]: the 95 % that bands are reported
for."""


def report(
    run: xarray.Dataset,
    limits: Sequence[Limit] = (),
    at_most: float = AT_MOST,
    pairs: Sequence[tuple[str, str]] = (),
    indices: Sequence[Sensitivity] = (),
) -> dict[str, Any]:
    """Everything as plain data; pairs: cases to compare draw by draw; indices: of
    `stillhook.analysis.uncertainty.sobol`."""
    at_values, trouble, failed = json.loads(run.attrs["at_values"]), troubles(run), failures(run)
    beyond = {str(limit): chances(run, limit) for limit in limits}
    cases = {
        case: {
            "at_values": at_values[case],
            "band_90": {name: b._asdict() for name, b in of_case.items()},
            "beyond_limits": _chance(trouble[case]),
            "limits": {
                text: {**_chance(share[case]), "at_most": at_most, "kept": share[case].value <= at_most}
                for text, share in beyond.items()
            },
            "failed": failed[case],
        }
        for case, of_case in bands(run, [name for name in NAMES if name in run]).items()
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
    }


SHOWN = {"e_c_pp": ("control error peak-to-peak [mm]", "diameter"), "p_max": ("peak pressure [bar]", "pressure")}
"""Numbers of the figures, their labels and the kind that gives their display unit; those that a winch type does not
have are left out."""
SHARE = 100.0
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
    compared = [name for name in COMPARED if all(name in case_["band_90"] for case_ in data["cases"].values())]
    ends = [f"{WORDS[name]}\n{column}" for name in compared for column in ("as described", "median", "5 to 95 %")]
    head = ("mode", *ends, "limits of the\nwinch exceeded")
    parts: list[Part] = [Table(head, bands, sampling), *map(Text, _remarks(data, compared)), *_limits(data)]
    if data["differences"]:
        columns = [
            text for name in compared for text in (f"{WORDS[name]}\nmedian", f"{WORDS[name]}\n5 to 95 %", "lower\nin")
        ]
        rows = [_difference(text, x) for text, x in data["differences"].items()]
        parts.append(Table(("draw by draw", *columns), rows))
    sections = [
        Section("Factors", [Table(FACTORS, factors), Text(MULTIPLES)]),
        Section(" and ".join(WORDS[name] for name in compared).capitalize(), parts),
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
    share, low, high = (percent_fixed(chance[key], 1) for key in ("share", "low", "high"))
    return f"{share} ({low} to {high})"


def _remarks(data: dict[str, Any], compared: Sequence[str]) -> Iterator[str]:
    if data["draws"] < FEWEST_DRAWS:
        yield f"too few draws for a 5 to 95 % band: its ends are the draws themselves. Use {FEWEST_DRAWS} or more."
    for label, case in data["cases"].items():
        if case["beyond_limits"]["share"] == 1.0:
            numbers = f"{' and '.join(WORDS[name] for name in compared)} {'are' if len(compared) > 1 else 'is'}"
            yield f"{label}: every draw goes beyond a limit of the winch; its {numbers} no working controller's"
    errors = {label: c["band_90"]["e_c_pp"]["high_error"] for label, c in data["cases"].items()}
    if all(math.isfinite(x) for x in errors.values()):
        values = ", ".join(f"{label} {cell('e_c_pp', x)}" for label, x in errors.items())
        yield f"standard error of the 95 % end of the error: {values}"
    for label, case in data["cases"].items():
        if case["failed"]:
            lost = f"{case['failed']} draws diverged or were refused"
            yield f"{label}: {lost}; they are in no band, and count as beyond every limit"


def _limits(data: dict[str, Any]) -> list[Table]:
    rows = [
        [label, text, _chance_text(v), percent_fixed(v["at_most"], 1), "kept" if v["kept"] else "exceeded"]
        for label, case in data["cases"].items()
        for text, v in case["limits"].items()
    ]
    return [Table(LIMITS, rows)] if rows else []


def _difference(text: str, difference: dict[str, Any]) -> list[str]:
    """A pair of modes: for each number that is compared median, band, and the share of draws in which it is lower."""
    row = [text]
    for numbers in difference.values():
        relative, lower = numbers["relative"], numbers["lower"]["share"]
        ends = f"{change(relative['low'])} to {change(relative['high'])}"
        row += [change(relative["median"]), ends, percent_fixed(lower, 0)]
    return row


def _index_table(indices: Sequence[Sensitivity]) -> Section:
    """One output: a row for each factor that matters somewhere, a column for each case."""
    largest = largest_totals(indices)
    ranked = [n for n, x in largest.items() if x >= MATTERS]
    others = [n for n in dict.fromkeys(n for s in indices for n in s.indices) if n not in ranked]
    below = f"below {percent_fixed(MATTERS, 0)} everywhere: {', '.join(others)}" if others else "no other factor varies"
    rows = [[n, *(_index_text(s, n) for s in indices)] for n in ranked]
    parts: list[Part] = [
        Table(("variance from", *(s.case for s in indices)), rows),
        Text(f"alone (95 % interval), with all that the factor does together with others; {below}"),
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


def band_figure(run: xarray.Dataset, title: str = "", limits: Sequence[Limit] = ()) -> Figure:
    """Every draw of every case as a point, its median and 5-95 % band, the crane at its nominal values, and limits as
    lines."""
    cases = [str(c) for c in run["case"].values]
    shown = [name for name in SHOWN if name in run]
    at_values, results = json.loads(run.attrs["at_values"]), bands(run, shown)
    size = (5.0 * len(shown), 1.6 + 0.75 * len(cases))
    figure, axes = kit.panels(1, len(shown), size, title, grid="x", sharey=True)
    axes = axes.ravel()
    for ax, name in zip(axes, shown, strict=True):
        words, kind = SHOWN[name]
        for y, (case, colour) in enumerate(colours_of(cases).items()):
            values = kit.display(run[name].sel(case=case).values, kind)
            spread = 0.16 * (np.argsort(np.argsort(run["factor_value"].values[:, 0])) / max(len(values) - 1, 1) - 0.5)
            ax.plot(values, y + 0.22 + spread, ".", color=colour, alpha=0.45, ms=4, mew=0)
            b = results[case][name]
            low, median, high = kit.display((b.low, b.median, b.high), kind)
            of_band, of_base = ("5 to 95 %", "as described") if y == 0 else (None, None)
            ax.plot([low, high], [y - 0.08, y - 0.08], color=colour, lw=5, solid_capstyle="butt", label=of_band)
            ax.plot(median, y - 0.08, "|", color="white", ms=9, mew=2)
            ax.plot(kit.display(at_values[case][name], kind), y - 0.28, "^", color=GREY, ms=6, label=of_base)
        for limit in (limit for limit in limits if limit.name == name):
            ax.axvline(in_display(limit.value, kind), color=GREY, ls="--", lw=1)
        ax.set(xlabel=words, yticks=range(len(cases)), ylim=(len(cases) - 0.5, -0.5))
        ax.set_yticklabels([c.upper() if len(c) < 4 else c for c in cases])
    axes[-1].legend(fontsize="small", frameon=False, loc="best")
    return figure


def index_figure(results: Sequence[Sensitivity], title: str = "") -> Figure:
    """Shares of the variance of each uncertain number, first and (lighter) total order, with 95 % intervals.

    Numbers whose total index is below `MATTERS` in every panel are left out.

    Parameters
    ----------
    results : sequence of Sensitivity
        From `stillhook.analysis.sensitivity`.
    title : str, default ""
        Above the figure.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    largest = largest_totals(results)
    names = [name for name, x in largest.items() if x >= MATTERS] or list(largest)[:1]
    cases, outputs = list(dict.fromkeys(s.case for s in results)), list(dict.fromkeys(s.output for s in results))
    size = (4.2 * len(cases) + 1.0, len(outputs) * (0.34 * len(names) + 1.1) + 0.6)
    figure, axes = kit.panels(len(outputs), len(cases), size, title, grid="x", sharex=True, sharey=True)
    axes = axes.ravel()
    for s in results:
        ax = axes[outputs.index(s.output) * len(cases) + cases.index(s.case)]
        _bars(ax, s, names)
        output = SHOWN[s.output][0].split(" [")[0] if s.output in SHOWN else s.output
        ax.set_title(f"{s.case}: {output}", fontsize="small")
    for ax in axes[-len(cases) :]:
        ax.set_xlabel("share of the variance [%]")
    if with_bars := [ax for ax in axes[: len(cases)] if ax.get_legend_handles_labels()[0]]:
        with_bars[-1].legend(fontsize="small", frameon=False, loc="lower right")
    return figure


def _bars(ax: Any, s: Sensitivity, names: Sequence[str]) -> None:
    for y, name in enumerate(names):
        if (x := s.indices.get(name)) is None:
            continue
        labels = ("with interactions (total)", "alone (first order)", "95 % of the first") if y == 0 else (None,) * 3
        ax.barh(y, SHARE * x.total.value, height=0.7, color=COLOURS[5], alpha=0.5, label=labels[0])
        ax.barh(y, SHARE * max(x.first.value, 0.0), height=0.4, color=COLOURS[0], label=labels[1])
        ax.plot([SHARE * x.first.low, SHARE * x.first.high], [y, y], color="black", lw=1, label=labels[2])
    ax.set_yticks(range(len(names)), names)
    ax.set(ylim=(len(names) - 0.5, -0.5), xlim=(-0.1 * SHARE, 1.1 * SHARE))
    ax.axvline(0.0, color=GREY, lw=0.8)
