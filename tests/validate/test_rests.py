"""Step 1: both lines of the active circuit at rest on the brake."""

import pytest
from tests.validate.ahc_logs import TWIN
from tests.validate.passive_logs import lines, records, rest_records, rested

from stillhook.spec.crane import Crane
from stillhook.validate.criteria.results import Verdict
from stillhook.validate.parameters.flow import rests

KEY = "p-rest-pressures"


def only(step):
    (m,) = step.measures_of("rest_pressure_difference")
    return m


@pytest.mark.slow
def test_lines_of_a_crane_that_is_its_twin_agree_at_rest():
    step = rested(rest_records())
    assert abs(only(step).value) < 0.5e5
    assert only(step).low < 0.0 < only(step).high
    assert lines(step)[KEY].verdict is Verdict.SHOWN


@pytest.mark.slow
@pytest.mark.parametrize("off", [6e5, -6e5])
def test_a_transmitter_6_bar_off_is_refuted_and_named(off):
    step = rested(rest_records(spoil=lambda log: log | {"p_a": log["p_a"] + off}))
    assert only(step).value == pytest.approx(off, abs=0.5e5)
    assert only(step).low < off < only(step).high
    assert lines(step)[KEY].verdict is Verdict.REFUTED
    assert f"PT A reads 6 bar {'above' if off > 0 else 'below'} PT B at rest; zero of a transmitter" in only(step).note


def test_rests_after_hoisting_and_after_lowering_are_both_there():
    found = rests(TWIN, rest_records())
    assert [r.after for r in found.rests if r.after] == [1, -1, 1, -1]
    assert all(r.seconds > 2.0 for r in found.rests if r.after)


@pytest.mark.slow
def test_heave_compensation_alone_has_no_rest_and_says_what_to_log():
    step = rested(records())
    assert only(step).value is None
    assert "keep the winch on its brake" in only(step).note
    assert lines(step)[KEY].verdict is Verdict.NOT_COVERED


def test_without_a_brake_a_rest_shows_nothing():
    bare = Crane.model_construct(**{**{name: getattr(TWIN, name) for name in Crane.model_fields}, "brake": None})
    assert rests(bare, rest_records()) is None
