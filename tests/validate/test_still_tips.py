"""A tip that hardly moves shows no lag of the PLC's reference."""

from dataclasses import replace

import pytest
from tests.validate.parameter_logs import LATE, campaign, records

from stillhook.validate.parameters.segments import parts_of
from stillhook.validate.parameters.signals import references

pytestmark = pytest.mark.long


@pytest.mark.parametrize(("height", "known"), [(0.15, False), (0.25, True)])
def test_a_lag_is_told_from_two_decimetres_of_motion_on(height: float, known: bool):
    found = records()
    parts = [
        replace(part, segment=replace(part.segment, s_tip_pp=height))
        for part in parts_of(campaign(*found, delay=LATE), found)
    ]
    assert bool(references(parts)) is known
