"""Every measure names the signals that it rests on, and signals that no judged line rests on are listed."""

from dataclasses import replace

import numpy as np
import pytest
from tests.validate.ahc_logs import campaign, record
from tests.validate.passive_logs import SENSORS, checked, records

from stillhook.validate.criteria.criteria import load_criteria
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import MEASURES, StepNumber
from stillhook.validate.report.view import unjudged, unjudged_says
from stillhook.validate.validation import Validation

NO_CONTENT = {"loads", "load_share", "samples_lost", "longest_gap", "samples_doubtful", "clock_drift"}
"""Measures of sampling, of clocks, and of what the campaign states."""


def of(*found, names=()):
    """A validation of step 6 alone, with records that hold more signals."""
    mine = tuple(replace(r, signals={**r.signals, **{n: np.zeros(len(r.t)) for n in names}}) for r in found)
    staged, step = campaign(*mine), checked(mine)
    return Validation(staged, mine, (step,), judge(staged.criteria, step.measures, (StepNumber.PASSIVE,)))


def test_every_measure_names_the_signals_that_it_rests_on():
    assert {name for name, m in MEASURES.items() if not m.signals} == NO_CONTENT
    known = set(SENSORS) | {"V_acc", "mode"}
    assert {s for m in MEASURES.values() for s in m.signals} <= known


@pytest.mark.slow
def test_a_signal_that_no_line_rests_on_is_listed_with_its_tests():
    found = unjudged(of(*records(), names=("f_pump",)))
    assert found["f_pump"] == ("1", "2")
    assert "p_hp" not in found
    assert "F_w" not in found


@pytest.mark.slow
def test_a_signal_that_only_a_line_without_value_would_judge_is_listed():
    left = tuple(n for n in SENSORS if n not in ("alpha_pm", "V_acc"))
    found = unjudged(of(*records(names=left)))
    assert found["alpha_pp"] == ("1", "2")  # the make-up law needs alpha_pm
    assert "p_hp" not in found  # its level is judged


@pytest.mark.slow
def test_a_signal_that_only_a_line_for_information_rests_on_is_listed():
    mine = of(*records())
    without = replace(mine, lines=tuple(replace(line, judged=False) for line in mine.lines))
    assert "p_hp" in unjudged(without)


def test_signals_that_were_made_from_others_are_not_listed():
    one = replace(record(dict(records()[0].signals), name="1"), derived=frozenset({"s_w"}))
    assert "s_w" not in unjudged(of(one))


def test_lines_name_every_test_in_short_and_nothing_is_said_of_single_steps():
    mine = of(*records(), names=("f_pump",))
    assert unjudged_says(mine) == []
    whole = replace(mine, steps=tuple(replace(mine.steps[0], number=n) for n in StepNumber))
    assert "f_pump in every test" in unjudged_says(whole)


def test_criteria_of_the_library_judge_every_signal_of_a_usual_log():
    """Some judged line of the library's set rests on every signal that the how-to asks for."""
    judged = {c.measure for c in load_criteria("paper-f").criteria if c.judged}
    rests = {s for name in judged for s in MEASURES[name].signals}
    assert set(SENSORS) <= rests
