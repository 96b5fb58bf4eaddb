"""Step 0: what the data cover, and how sound they are."""

from dataclasses import replace

import numpy as np
import pytest
from tests.validate.ahc_logs import campaign, record
from tests.validate.crane_logs import ahc, read, signals, with_clock, write

from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import MEASURES, StepNumber, Verdict
from stillhook.validate.data_set.campaign import load_campaign
from stillhook.validate.data_set.check import check_data, different
from stillhook.validate.data_set.read import read_records

STEP = 0.01


def waves(height, seconds=200.0, s_w=487.0, period=8.0):
    t = np.arange(round(seconds / STEP)) * STEP
    tip = 0.5 * height * np.sin(2.0 * np.pi * t / period)
    return {"s_tip": tip, "s_w": s_w + tip, "u_p": tip, "e_c_measured": 0.0 * t}


def checked(*records):
    return check_data(campaign(*records), records, lambda share: None)


def value(step, name):
    return step.measures_of(name)[0].value


def cases():
    """Lengths, loads and motions like those of paper F table 3."""
    return (
        record(waves(0.4), name="1", load=82e3),
        record(waves(1.1, 1500.0), name="2", load=94e3),
        record(waves(2.2, s_w=2314.0), name="3", load=164e3),
        record(waves(1.5, s_w=2281.0), name="4", load=162e3),
    )


def test_the_data_set_of_paper_f_covers_what_it_asks():
    step = checked(*cases())
    assert (value(step, "wire_lengths"), value(step, "loads")) == (2.0, 2.0)
    assert value(step, "load_share") == pytest.approx(0.656, abs=1e-3)
    assert value(step, "s_tip_pp_low") == pytest.approx(0.4, rel=0.01)
    assert value(step, "s_tip_pp_high") == pytest.approx(2.2, rel=0.01)
    assert value(step, "data_length") == pytest.approx(2100.0, abs=0.1)
    lines = judge(campaign().criteria, step.measures, (StepNumber.DATA,))
    assert not any(line.failed for line in lines)


@pytest.mark.parametrize(
    ("records", "failed"),
    [
        (cases()[:2], {"1a", "1b", "1b-highest", "1c-high"}),
        (cases()[2:], {"1a", "1b", "1c-low", "1d"}),
        (cases()[1:2], {"1a", "1b", "1b-highest", "1c-low", "1c-high", "1d"}),
    ],
)
def test_what_is_not_covered_fails(records, failed):
    lines = judge(campaign().criteria, checked(*records).measures, (StepNumber.DATA,))
    assert {line.key for line in lines if line.failed} == failed
    assert {line.key for line in lines if line.verdict is Verdict.NOT_COVERED and line.judged} == failed
    assert all("which the tests do not reach" in line.message for line in lines if line.failed)


@pytest.mark.slow
def test_a_submerged_load_counts_with_what_hangs_on_the_wire(tmp_path):
    path = write(tmp_path, ahc(), test='load = "90 t"\nwater = { volume = "20 m^3" }')
    plan = load_campaign(path)
    step = check_data(plan, read_records(plan, lambda share: None), lambda share: None)
    assert value(step, "load_share") == pytest.approx((90.0 - 20.5) / 250.0)
    assert step.measures_of("load_share")[0].data == "90 t on the hook, 69.5 t of it in water"


def test_most_values_that_are_apart_are_counted():
    assert different([1.0, 1.6, 2.1, 3.0], 1.0) == [0, 2]
    assert different([10.3, 2.98, 2.82, 10.35], 1.0) == [2, 0]
    assert different([float("nan"), 2.0], 1.0) == [1]
    assert different([1.0, 2.0, 3.0], 1.0) == [0, 1, 2]
    assert different([], 1.0) == []


def test_a_tip_at_rest_is_no_small_motion():
    quiet = waves(1.0)
    quiet["s_tip"][:8000] = 0.001 * np.random.default_rng(0).standard_normal(8000)
    assert value(checked(record(quiet)), "s_tip_pp_low") >= 0.1
    still = checked(record({name: 0.0 * x + 487.0 for name, x in waves(1.0).items()}))
    assert value(still, "s_tip_pp_low") is None
    assert still.measures_of("s_tip_pp_low")[0].note == "the tip moves for the duration of a window in no load case"


def test_without_any_load_case_every_line_says_what_to_log():
    step = checked(replace(record(waves(1.0)), segments=()))
    lines = {line.key: line for line in judge(campaign().criteria, step.measures, (StepNumber.DATA,))}
    assert all(lines[key].failed for key in ("1a", "1b", "1b-highest", "1c-low", "1c-high", "1d"))
    assert "log 60 s or more of heave compensation without interruption" in lines["1a"].message


@pytest.mark.slow
def test_lost_samples_gaps_and_doubtful_samples_are_measured(tmp_path):
    frame = ahc(170.0)
    frame = frame[(frame["Time"] < 70.0) | (frame["Time"] >= 90.0)]
    frame = frame[(frame["Time"] < 30.0) | (frame["Time"] >= 30.15)]
    found = read(tmp_path, frame)
    step = check_data(campaign(found), (found,), lambda share: None)
    assert value(step, "longest_gap") == pytest.approx(20.0, abs=0.02)
    assert value(step, "samples_lost") == pytest.approx(20.15 / 170.0, rel=0.01)
    assert value(step, "samples_doubtful") == pytest.approx(0.15 / 150.0, rel=0.2)
    (row,) = step.tables[0].rows
    assert row[:2] == ("1", "ahc")


@pytest.mark.slow
@pytest.mark.parametrize(("drift", "no"), [(2e-5, False), (5e-3, True)])
def test_a_clock_that_drifts_is_measured_and_one_that_no_sound_clock_is_fails(tmp_path, drift, no):
    frame = ahc(170.0)
    frame = frame.assign(T2=np.round(frame["Time"].to_numpy() * (1.0 + drift), 5))
    found = read(tmp_path, frame, rows=signals(**with_clock("s_tip", "v_tip", "a_tip")))
    step = check_data(campaign(found), (found,), lambda share: None)
    (measure,) = step.measures_of("clock_drift")
    assert measure.value == pytest.approx(drift, rel=0.02, abs=5e-6)
    assert measure.low <= measure.value <= measure.high
    (line,) = [line for line in judge(campaign().criteria, step.measures, (StepNumber.DATA,)) if line.key == "1-clock"]
    assert line.failed is no


def test_measures_and_data_are_known_and_go_to_json():
    step = checked(*cases())
    assert {m.name for m in step.measures} <= set(MEASURES)
    for m in step.measures:
        assert m.quantity == MEASURES[m.name].quantity
        assert m.data or m.value is None
