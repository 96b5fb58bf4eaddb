"""Step 4 on the reference plant: another friction law, lines with two ends, oil that warms, sensors that are late and out of calibration."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from trials.campaigns import sea_trials, write_campaign

from stillhook.validate.data_set.campaign import Kind, load_campaign
from stillhook.validate.data_set.read import read_records
from stillhook.validate.dynamics.check import check_dynamics

CLOSE = {"C_h": 0.05, "C_leak": 0.05, "J_m_eff": 0.05}
"""Asked for by the issue."""
NAMES = {"C_h": "capacitance", "C_leak": "leakage", "J_m_eff": "inertia"}


@pytest.mark.thorough
@pytest.mark.parametrize(("seed", "apart"), [(2, False), (24, True)])
def test_tuned_numbers_are_the_truths_within_five_per_cent_and_their_intervals_hold_them(
    seed: int, apart: bool, tmp_path: Path
) -> None:
    """Near its twin, and 10 to 30 % off it. Turns alone; of 26 campaigns with all tests the leakage was off by 2 % (rms), at most by 5 %."""
    plan = sea_trials()
    plan = replace(plan, tests=tuple(t for t in plan.tests if t.kind is Kind.DYNAMICS))
    written = write_campaign(tmp_path / "c", plan=plan, seed=seed, apart=apart)
    truth = tomllib.loads(written.reference.read_text(encoding="utf-8"))["crane"]
    campaign = load_campaign(written.campaign)
    step = check_dynamics(campaign, read_records(campaign, lambda share: None), lambda share: None)
    for found in step.estimates.tuned:
        true = truth[NAMES[found.name]]["value"]
        assert abs(found.factor.value / true - 1.0) < CLOSE[found.name]
        assert found.factor.low < true < found.factor.high
