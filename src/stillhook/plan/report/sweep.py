"""Section of a plan's report: from which tolerance, payload and depth on a better controller pays."""

from __future__ import annotations

from collections.abc import Mapping

from stillhook.plan.answer.sweep import answer_of, height_in_ladder, pays_at
from stillhook.plan.report.detail import picture
from stillhook.plan.report.words import TEXTS, named, names
from stillhook.plan.result import PlanResult
from stillhook.report.document import Bullets, Part, Table, Text
from stillhook.report.formatting import direction
from stillhook.units import number


def tolerance_sweep(result: PlanResult, figures: Mapping[str, bytes]) -> list[Part]:
    """The answer of every payload and depth, a figure, and the best new against the best classic controller."""
    if "sweep" not in result:
        reason = result.facts.get("not_computed", {}).get("sweep", "")
        return [Text(f"Not computed in this run{f': {reason}' if reason else ''}.")]
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
        Bullets([f"{line[0].upper()}{line[1:]}." for line in answer["answer"]]),
        *left_out,
        *picture(figures, "sweep", f"waves at {direction(block.attrs['beta'])}"),
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
