"""Step 1: do the crane file's parameters agree with those implied by the logs? By balances, without simulating the twin
where possible.

Source: Moslatt 2020 paper F, "(1) System variables and parameters": correct sizes of pumps, motors, leakage terms,
controller parameters. The paper states no numbers for this step; every limit is Stillhook's own and is given in the
criteria file with its reason.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from stillhook.validate.criteria.criteria import Criteria, Criterion
from stillhook.validate.criteria.judge import in_words, verdict_of
from stillhook.validate.criteria.results import Measure, Step, StepNumber, Verdict
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.circuit.flow import rest_measure
from stillhook.validate.parameters.circuit.leakage import form_says
from stillhook.validate.parameters.estimates import ParameterEstimates, parameter_estimates
from stillhook.validate.parameters.measures import by_name, measures, table
from stillhook.validate.parameters.segments import parts_of


@dataclass(frozen=True)
class ParametersStep(Step):
    """Step 1 with what its figures need."""

    estimates: ParameterEstimates | None = None


def check_parameters(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    """Parameters implied by the logs: transmission, displacements, leakage, settings, clock, load cell, friction and
    tip delay, against the crane.

    Parameters: campaign with the twin under test; records as read; progress is called with the share done.
    Nothing is refused here: a check whose signals were not logged gives a measure without a value that states what to
    log.
    """
    estimates = parameter_estimates(parts_of(campaign, records), progress, records)
    results = (*measures(campaign, estimates), rest_measure(campaign.crane, estimates.rests, records))
    lines = statements(campaign.criteria, results)
    if estimates.balance is not None and estimates.balance.leak.refuted:
        text = form_says(estimates.balance.leak)
        lines = (*lines, f"{text[0].upper()}{text[1:]}.")
    return ParametersStep(
        StepNumber.PARAMETERS, results, lines, (table(campaign, estimates, results),), _data(estimates), estimates
    )


def statements(criteria: Criteria, results: Sequence[Measure]) -> tuple[str, ...]:
    """Statements: exceeded limits first, by utilisation, then what the data leave open, then everything within limits
    in one line, then what the data cannot determine."""
    broken: list[tuple[float, str]] = []
    unknown: dict[str, list[str]] = {}
    fine, wide = [], []
    for name, same in by_name(results).items():
        for c in (c for c in criteria.criteria if c.measure == name):
            met = [(m, verdict_of(c, m)) for m in same]
            wrong = [m for m, verdict in met if verdict is Verdict.REFUTED]
            open_ = [m for m, verdict in met if verdict is Verdict.NOT_SHOWN and m.value is not None]
            if wrong:
                worst = max(wrong, key=lambda m: abs(m.value or 0.0))
                broken.append((abs(worst.value or 0.0) / c.limit, _wrong(c, worst, len(wrong), len(same))))
            elif all(m.value is None for m in same):
                unknown.setdefault(same[0].note, []).append(c.title)
            elif open_:
                wide.append(f"{_small(c.title)} ({in_words(c, _largest(open_))}, limit {c.limit_text})")
            else:
                fine.append(_small(c.title))
    agree = (
        (f"Within limits: {'; '.join(fine) if broken or wide else f'all {len(fine)} checks possible with the data'}.",)
        if fine
        else ()
    )
    unsure = (
        (f"Neither shown nor refuted (part of the interval is beyond the limit): {'; '.join(wide)}.",) if wide else ()
    )
    lacks = (
        f"{'; '.join([titles[0], *(_small(w) for w in titles[1:])])} cannot be determined: {note}."
        for note, titles in unknown.items()
    )
    return (*(text for _, text in sorted(broken, key=lambda b: -b[0])), *unsure, *agree, *lacks)


def _largest(measures: Sequence[Measure]) -> float:
    return max((m.value for m in measures if m.value is not None), key=abs)


def _small(title: str) -> str:
    """A criterion's title inside a sentence."""
    return title[0].lower() + title[1:]


def _wrong(c: Criterion, m: Measure, wrong: int, all_: int) -> str:
    where = f" in {m.test}" if m.test else ""
    many = f" ({wrong} of {all_})" if all_ > 1 else ""
    assert m.value is not None
    cause = f": {m.note}" if m.note else ""
    return f"{c.title}{where}{many}: {in_words(c, m.value)}, limit {c.limit_text}{cause}."


def _data(estimates: ParameterEstimates) -> dict[str, Any]:
    """Data of the figures, by check and test, in SI."""
    b = estimates.balance
    return {
        "r_eff": [
            {
                "test": x.test,
                **x.error.to_dict("error"),
                "layer": x.layer,
                "layer_implied": x.implied,
                "layer_diameter": x.d,
                "layer_diameter_implied": x.d_implied,
                "s_w": x.s_w,
                "from": x.wire,
            }
            for x in estimates.radii
        ],
        "friction": [
            {
                "test": f.test,
                **f.scale.scaled(offset=1.0).to_dict("scale"),
                "T_f": f.mean,
                "T_standing": f.standing.value,
                "inertia_missing": f.inertia.value,
            }
            for f in estimates.frictions
        ],
        "delay": [{"test": d.test, **d.delay.to_dict("delay"), "gain": d.gain.value} for d in estimates.delays],
        "load_cell": [{"test": c.test, **c.force.to_dict("F_w"), "weight": c.weight} for c in estimates.cells],
        "rests": (
            []
            if estimates.rests is None
            else [
                {
                    "test": r.test,
                    "start": r.start,
                    "after": r.after,
                    **r.dp.to_dict("dp"),
                }
                for r in estimates.rests.rests
            ]
        ),
        "flow": (
            {}
            if b is None
            else {
                "ratio": 1.0 + b.ratio.value,
                "leakage": 1.0 + b.leakage.value,
                "C_leak": b.twin_leakage * (1.0 + b.leakage.value),
                "capacitance": 1.0 + b.capacitance.value,
                "alpha_p_zero": b.offset.value,
            }
        ),
    }
