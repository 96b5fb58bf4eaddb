"""What the page on known defects keeps is what validation says today: one of its campaigns, computed again."""

import pytest
from trials.defects import run as trials

DIGITS = 2e-3
"""Outcomes are kept with four digits, and other processors round otherwise."""


@pytest.mark.thorough
@pytest.mark.parametrize(("seed", "defect"), [(0, "gear")])
def test_a_kept_campaign_comes_out_with_the_same_lines(seed, defect):
    trial = trials.Trial(seed, defect)
    then, now = trials.kept()[trial.key], trials.outcome(trial)
    assert list(now["no"]) == list(then["no"])
    assert {key: x[0] for key, x in now["figures"].items()} == pytest.approx(
        {key: x[0] for key, x in then["figures"].items()}, rel=DIGITS
    )
    assert now["truth"] == then["truth"]
