"""Section of a plan's report: from which tolerance, payload and depth on a better controller pays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.answer.sweep import Pays, answer_of, pays_at
from stillhook.plan.report.words import TEXTS, named, names, sentence
from stillhook.plan.result import PlanResult
from stillhook.report.document import Bullets, Part, Table, Text
from stillhook.units import number

if TYPE_CHECKING:
    import xarray


def tolerance_sweep(result: PlanResult, figures: Mapping[str, bytes]) -> list[Part]:
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
        for k, each in enumerate(pays_at(block, v)):
            if each.verdict == 1:
                strong.append(len(rows))
            cells = []
            for name, Hs in ((each.classic, each.Hs_classic), (each.new, each.Hs_new)):
                value, low, high = (height_in_ladder(float(x), heights) for x in Hs)
                cells += [named(name), value, f"{low} to {high}" if len({value, low, high}) > 1 else ""]
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
