"""A validation as data: everything in SI for JSON, load cases as a table."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.validate.ahc.check import AhcStep
from stillhook.validate.report.envelope import unjudged
from stillhook.validate.report.texts import decisive, risks, segments, sentence
from stillhook.validate.validation import Validation

if TYPE_CHECKING:
    import polars


def to_dict(validation: Validation) -> dict[str, Any]:
    """All results in SI as plain data for JSON; names as in the nomenclature."""
    campaign = validation.campaign
    return {
        "title": campaign.title,
        "date": campaign.date.isoformat(),
        "synthetic": campaign.synthetic,
        "crane": campaign.crane.name,
        "criteria": campaign.criteria.to_dict(),
        "passed": validation.passed,
        "outcome": validation.outcome.value,
        "complete": validation.complete,
        "verdict": sentence(validation),
        "decisive": [line.key for line in decisive(validation)],
        "risks": risks(validation.lines),
        "lines": [line.to_dict() for line in validation.lines],
        "segments": [dataclasses.asdict(s) | {"mode": s.mode.value} for s in segments(validation)],
        "unjudged": {name: list(tests) for name, tests in unjudged(validation).items()} if validation.complete else {},
        "steps": [step.to_dict() for step in validation.steps],
        "tests": [
            {"name": r.test.name, "log": r.test.log.name, "statements": list(r.statements)} for r in validation.records
        ],
    }


def segments_table(validation: Validation) -> polars.DataFrame:
    """Every load case in display units, units in the headings."""
    import polars as pl

    load_cases = segments(validation)
    columns = {
        "test": [s.test for s in load_cases],
        "start [s]": [s.start for s in load_cases],
        "duration [s]": [s.duration for s in load_cases],
        "load [t]": [s.load / 1e3 for s in load_cases],
        "s_w_min [m]": [s.s_w_min for s in load_cases],
        "s_w_max [m]": [s.s_w_max for s in load_cases],
        "s_tip_pp [m]": [s.s_tip_pp for s in load_cases],
        "period [s]": [s.period for s in load_cases],
        "mode": [s.mode.value for s in load_cases],
    }
    return pl.DataFrame(columns)


def deviations_table(validation: Validation) -> polars.DataFrame | None:
    """Every window of step 5, units in the headings; None where there is none. Source: Moslatt 2020 paper F,
    figures 11 to 13."""
    import polars as pl

    parts = [c.windows for step in validation.steps if isinstance(step, AhcStep) for c in step.comparisons]
    if not parts:
        return None
    joined = {
        "test": [w.test for w in parts for _ in w.ends],
        "end of window [s]": np.concatenate([w.ends for w in parts]),
        "s_tip_pp [m]": np.concatenate([w.s_tip_pp for w in parts]),
        "e_c_pp_measured [m]": np.concatenate([w.measured for w in parts]),
        "e_c_pp_simulated [m]": np.concatenate([w.simulated for w in parts]),
        "deviation [m]": np.concatenate([w.x for w in parts]),
        "eta_c_measured": np.concatenate([w.eta_measured for w in parts]),
        "eta_c_simulated": np.concatenate([w.eta_simulated for w in parts]),
    }
    return pl.DataFrame(joined).with_columns(pl.col(pl.Float64).round(6))
