"""Step 6: does the passive circuit of the crane file carry the load as the logs say? Gas, stroke, motors, their
setting, make-up.

Source of the laws: Moslatt 2020 papers C and F. The papers have no such step; every limit is ours and stands in the
criteria file with its reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from stillhook.validate.criteria.names import MEASURES
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.check import said
from stillhook.validate.parameters.segments import parts_of
from stillhook.validate.passive.found import PassiveFindings, passive_by
from stillhook.validate.passive.measures import measures
from stillhook.validate.passive.rows import table

NONE = "This crane has no passive circuit: there is nothing to judge."


@dataclass(frozen=True)
class PassiveStep(Step):
    """Step 6 with what its figures need."""

    findings: PassiveFindings | None = None


def check_passive(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    """What the logs say of the passive circuit, against the crane file.

    Parameters: campaign with the twin under test; records as read; progress is called with the share done.
    Nothing is refused here: a check whose signals were not logged gives a measure without a value, and says what to
    log. A crane without a passive circuit gets one statement.
    """
    if campaign.crane.passive is None:
        nothing = tuple(
            Measure(name, None, m.quantity, note=NONE) for name, m in MEASURES.items() if m.step is StepNumber.PASSIVE
        )
        return PassiveStep(StepNumber.PASSIVE, nothing, (NONE,))
    found = passive_by(parts_of(campaign, records), progress)
    told = measures(campaign.crane, found)
    return PassiveStep(
        StepNumber.PASSIVE, told, said(campaign.criteria, told), (table(campaign.crane, found),), _data(found), found
    )


def _data(found: PassiveFindings) -> dict[str, Any]:
    """Numbers behind the figures, in SI."""
    level, gas, stroke, setting = found.level, found.gas, found.stroke, found.setting
    return {
        "level": (
            {}
            if level is None
            else {
                "p": level.p.value,
                "low": level.p.low,
                "high": level.p.high,
                "from_V_acc": level.placed,
                "tests": {test: e.value for test, e in level.tests.items()},
            }
        ),
        "gas": (
            {}
            if gas is None
            else {
                "V": gas.V.value,
                "low": gas.V.low,
                "high": gas.V.high,
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
                "share": 1.0 + s.share.value,
                "low": 1.0 + s.share.low,
                "high": 1.0 + s.share.high,
                "share_by_load": None if s.by_weight is None else 1.0 + s.by_weight,
                "T_standing": s.standing.value,
                "T_load": s.T_load,
            }
            for s in found.shares
        ],
        "setting": (
            {}
            if setting is None
            else {
                "gain": 1.0 + setting.gain.value,
                "low": 1.0 + setting.gain.low,
                "high": 1.0 + setting.gain.high,
            }
        ),
    }
