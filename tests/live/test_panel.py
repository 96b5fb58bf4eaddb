"""What the observer says before it knows anything, and which factors it takes from a file."""

import json

import pytest

from stillhook.live.observer.observed import CERTIFIED, factor_in
from stillhook.live.observer.panel import PROPOSAL_BYTES, Proposal


def test_before_the_first_rows_nothing_is_known_and_no_number_is_shown():
    said = json.loads(Proposal(5.0).to_json())
    assert said["known"] is False
    assert said["value"] is None
    assert (said["low"], said["high"], said["steps"]) == (0.0, 0.0, 0)
    assert said["reason"] == "no rows yet"


def test_a_long_reason_does_not_burst_the_message():
    long = Proposal(1.7e9, reason="x" * 9000, step="y" * 9000, deviating="p_a, p_b")
    assert len(long.to_json()) <= PROPOSAL_BYTES


@pytest.mark.parametrize(("kept", "taken"), [(0.31, 0.31), (0.29, None), (2.99, 2.99), (3.01, None), (-1.0, None)])
def test_a_factor_that_no_winch_can_have_is_not_taken_from_a_file(tmp_path, kept, taken):
    """Cranes of one type are within a factor of two; three and more is a sensor or the wrong file."""
    file = tmp_path / "adapted.json"
    file.write_text(json.dumps({"value": kept}))
    assert factor_in(file) == (CERTIFIED if taken is None else taken)
