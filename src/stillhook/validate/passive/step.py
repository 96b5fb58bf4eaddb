"""Step 6: does the passive circuit of the crane file carry the load as the logs show? Gas, stroke, motors, their
setting, make-up.

Source of the laws: Moslatt 2020 papers C and F. The papers have no such step; every limit is Stillhook's own and is
given in the criteria file with its reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from stillhook.validate.criteria.names import MEASURES
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.check import statements
from stillhook.validate.parameters.segments import parts_of
from stillhook.validate.passive.measures import PassiveEstimates, measures, passive_estimates, table

NONE = "This crane has no passive circuit: nothing is judged."


@dataclass(frozen=True)
class PassiveStep(Step):
    """Step 6 with what its figures need."""

    estimates: PassiveEstimates | None = None


def check_passive(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    """Passive circuit implied by the logs, against the crane file.

    Parameters: campaign with the twin under test; records as read; progress is called with the share done.
    Nothing is refused here: a check whose signals were not logged gives a measure without a value that states what to
    log. A crane without a passive circuit gets one statement.
    """
    if campaign.crane.passive is None:
        nothing = tuple(
            Measure(name, None, m.quantity, note=NONE) for name, m in MEASURES.items() if m.step is StepNumber.PASSIVE
        )
        return PassiveStep(StepNumber.PASSIVE, nothing, (NONE,))
    estimates = passive_estimates(parts_of(campaign, records), progress)
    results = measures(campaign.crane, estimates)
    return PassiveStep(
        StepNumber.PASSIVE,
        results,
        statements(campaign.criteria, results),
        (table(campaign.crane, estimates),),
        _data(estimates),
        estimates,
    )


def _data(estimates: PassiveEstimates) -> dict[str, Any]:
    """Numbers behind the figures, in SI."""
    level, gas, stroke, setting = estimates.level, estimates.gas, estimates.stroke, estimates.setting
    return {
        "level": (
            {}
            if level is None
            else {
                **level.p.to_dict("p"),
                "from_V_acc": level.placed,
                "tests": {test: e.value for test, e in level.tests.items()},
            }
        ),
        "gas": (
            {}
            if gas is None
            else {
                **gas.V.to_dict("V"),
                "R": gas.R,
                "p_dry": gas.dry,
                "tests": {test: e.value for test, e in gas.tests.items()},
            }
        ),
        "stroke": (
            {}
            if stroke is None
            else {"used": stroke.used, "low": stroke.low, "high": stroke.high, "end_time": stroke.at_end}
        ),
        "motors": [
            {
                "test": s.test,
                **s.share.scaled(offset=1.0).to_dict("share"),
                "share_by_load": None if s.by_weight is None else 1.0 + s.by_weight,
                "T_standing": s.standing.value,
                "T_load": s.T_load,
            }
            for s in estimates.shares
        ],
        "setting": ({} if setting is None else setting.gain.scaled(offset=1.0).to_dict("gain")),
    }
