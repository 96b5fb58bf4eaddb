"""Acceptance criteria: what paper F's table says, what a set of one's own may change, what is refused, and how a measure is judged."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stillhook.errors import StillhookError, ValidateError
from stillhook.validate.criteria.criteria import Criteria, Limit, Requirement, criteria_sets, load_criteria
from stillhook.validate.criteria.judge import judge, outcome_of
from stillhook.validate.criteria.results import MEASURES, RISK, Measure, Outcome, StepNumber, Verdict

ALL = tuple(StepNumber)
MEAN = "e_c_pp_deviation"
OPEN = Verdict.NOT_COVERED


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def loaded(tmp_path: Path, text: str) -> Criteria:
    return load_criteria(written(tmp_path, text))


def own(tmp_path: Path, row: str, head: str = "") -> Criteria:
    """Paper F's set with one row on top."""
    return loaded(tmp_path, f'base = "paper-f"\nversion = "1"\n{head}\n[[criterion]]\n{row}\n')


def line(criteria: Criteria, key: str, *measures: Measure):
    return next(x for x in judge(criteria, measures, ALL) if x.key == key)


# --- paper F -----------------------------------------------------------------------------------------------------------------------------


def test_paper_f_set_holds_every_number_of_its_table_2():
    rows = {c.key: c for c in load_criteria("paper-f").criteria}
    # Key of the row: kind and limit as printed (lengths in m, shares as parts of one).
    printed = {
        "1a": (Limit.AT_LEAST, 2.0),
        "1b": (Limit.AT_LEAST, 2.0),
        "1b-highest": (Limit.AT_LEAST, 0.4),
        "1c-low": (Limit.AT_MOST, 0.5),
        "1c-high": (Limit.AT_LEAST, 2.0),
        "1d": (Limit.AT_LEAST, 1500.0),
        "2a": (Limit.WITHIN, 0.05),
        "2b": (Limit.AT_MOST, 0.05),
        "3-pump": (Limit.AT_MOST, 0.03),
        "3-motor": (Limit.AT_MOST, 0.03),
    }
    for key, (kind, limit) in printed.items():
        assert (rows[key].kind, rows[key].limit) == (kind, pytest.approx(limit)), key
        assert "paper F" in rows[key].source
        assert rows[key].judged
    assert load_criteria("paper-f").settings["window"] == 30.0


@pytest.mark.parametrize("name", criteria_sets())
def test_every_limit_of_our_own_gives_its_reason_and_every_row_a_source(name):
    for c in load_criteria(name).criteria:
        assert c.source
        assert c.reason or not c.source.startswith("ours"), c.key


# --- a set of one's own ------------------------------------------------------------------------------------------------------------------


def test_a_changed_limit_says_what_it_was_and_takes_no_credit_from_the_paper(tmp_path):
    c = own(tmp_path, 'key = "2b"\nat_most = "6 cm"')
    row = next(x for x in c.criteria if x.key == "2b")
    assert (row.limit, row.written, row.source) == (
        pytest.approx(0.06),
        "6 cm",
        "changed in mine.toml; at most 5 cm in paper F table 2",
    )
    assert c.changes == (f"2b: {MEAN} at most 6 cm, required in place of {MEAN} at most 5 cm, required",)
    assert c.name == "mine"


def test_rows_can_be_dropped_added_and_made_stricter_and_all_of_it_is_told(tmp_path):
    c = own(
        tmp_path,
        'key = "own"\nstep = 5\ntitle = "Spread"\nmeasure = "e_c_pp_deviation_s"\nat_most = "20 mm"\nask = "supporting"\nneeded = false',
        'drop = ["2d-correlation"]\n[settings]\nwindow = "20 s"',
    )
    rows = {x.key: x for x in c.criteria}
    assert "2d-correlation" not in rows
    assert (rows["own"].ask, rows["own"].needed, rows["own"].limit) == (Requirement.SUPPORTING, False, 0.02)
    assert c.settings["window"] == 20.0
    assert len(c.changes) == 3


def test_a_judged_row_that_is_only_shown_from_now_on_is_told_as_a_change(tmp_path):
    assert (
        "e_c_pp_deviation at most 5 cm, information in place of"
        in own(tmp_path, 'key = "2b"\njudged = false').changes[0]
    )


def test_the_digest_follows_what_is_asked_and_not_how_it_is_written(tmp_path):
    plain = own(tmp_path, 'key = "2b"\nat_most = "6 cm"')
    spaced = own(tmp_path, '# a comment\nkey = "2b"\nat_most   =   "6 cm"')
    other = own(tmp_path, 'key = "2b"\nat_most = "7 cm"')
    assert plain.digest == spaced.digest
    assert len({plain.digest, other.digest, load_criteria("paper-f").digest}) == 3


def test_a_set_without_a_base_gives_everything_itself(tmp_path):
    row = f'[[criterion]]\nkey = "a"\nstep = 5\ntitle = "Mean"\nmeasure = "{MEAN}"\nat_most = "5 cm"\n'
    every = 'window = "30 s"\neta_above = "1 m"\nlayers_apart = 1\nload_apart = "10 %"'
    assert loaded(tmp_path, f'version = "1"\n[settings]\n{every}\n{row}').changes == ()
    with pytest.raises(ValidateError, match=r"settings\.window: missing"):
        loaded(tmp_path, f'version = "1"\n{row}')


NEW = f'key = "x"\nstep = 5\ntitle = "W"\nmeasure = "{MEAN}"'


@pytest.mark.slow
@pytest.mark.parametrize(
    ("row", "told"),
    [
        (NEW.replace("viation", "viatoin") + '\nat_most = "5 cm"', 'did you mean "e_c_pp_deviation"?'),
        ('key = "2b"\nat_most = 5', "at_most"),
        ('key = "2b"\nat_most = "5 bar"', "bar"),
        ('key = "2b"\nat_most = "5 cm"\nat_least = "1 cm"', "exactly one of"),
        (NEW, "exactly one of"),
        ('key = "2b"\nstep = 3', "step"),
        ('key = "2b"\nask = "half"', "it must be 'required' or 'supporting'"),
        ('key = "2b"\nby = "any"', "unknown field"),
        ('key = "2b"\njudged = "yes"', "true or false"),
        ('key = "2b"\nlimit = "5 cm"', "unknown field"),
        ('key = "3-pump"\nat_most = "three %"', "at_most"),
        ('key = "3-pump"\nat_most = true', "at_most"),
        ('key = "3-pump"\nat_most = "nan %"', "at_most"),
        ('key = "3-pump"\nat_most = inf', "at_most"),
        (f'key = "3-pump"\nat_most = "{"9" * 400} %"', "at_most"),
        ('key = "2a"\nwithin = "-5 cm"', "negative"),
        (NEW + '\nat_most = "5 cm"\nsource = "ours"', "reason: missing"),
        ('key = "2b"\ntitle = ""', "it must be a text"),
    ],
)
def test_a_row_that_cannot_be_meant_is_refused_in_one_line(tmp_path, row, told):
    with pytest.raises(StillhookError) as e:
        own(tmp_path, row)
    assert told in str(e.value)
    assert str(e.value).startswith("mine.toml: ")
    assert "\n" not in str(e.value)


SET = 'base = "paper-f"\nversion = "1"\n'


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('base = "paper-g"\nversion = "1"', 'did you mean "paper-f"?'),
        ('base = "paper-f"', "version: missing"),
        (f'{SET}drop = ["2z"]', '"2z"'),
        (f'{SET}drop = "2b"', "it must be a list"),
        (f'{SET}[settings]\nwindows = "30 s"', "window"),
        (f'{SET}[settings]\nwindow = "0 s"', "more than zero"),
        (f"{SET}[settings]\nwindow = 30", "window"),
        ('version = "1"', "Write one table [[criterion]] for each."),
        (f"{SET}criterion = 3", "criterion = 3: it must be a list (one [[criterion]] table for each row)."),
        (f'{SET}[[criterion]]\nkey = "2b"\n[[criterion]]\nkey = "2b"', "is given twice"),
        (f'{SET}drop = ["2b"]\n[[criterion]]\nkey = "2b"', "dropped as well"),
        ("", "empty"),
        ("[[criterion", "not valid TOML"),
    ],
)
def test_a_file_that_is_no_set_is_refused_in_one_line(tmp_path, text, told):
    with pytest.raises(StillhookError) as e:
        loaded(tmp_path, text)
    assert told in str(e.value)
    assert "\n" not in str(e.value)


def test_a_set_that_judges_nothing_is_refused_for_it_would_pass_everything(tmp_path):
    keys = [c.key for c in load_criteria("paper-f").criteria if c.judged]
    rows = "".join(f'[[criterion]]\nkey = "{key}"\njudged = false\n' for key in keys)
    with pytest.raises(ValidateError, match="every validation would pass"):
        loaded(tmp_path, f'base = "paper-f"\nversion = "1"\n{rows}')


def test_a_name_that_is_no_set_names_those_that_there_are():
    with pytest.raises(ValidateError, match='did you mean "paper-f"'):
        load_criteria("paperf")


# --- judging -----------------------------------------------------------------------------------------------------------------------------


def test_a_line_is_one_sentence_with_figure_interval_limit_and_data():
    m = Measure(MEAN, 0.0212, "length", 0.018, 0.0251, data="4 load cases, 2140 s, 71 effective windows")
    found = line(load_criteria("paper-f"), "2b", m)
    assert found.verdict is Verdict.SHOWN
    assert found.message == (
        "Mean deviation of the peak-to-peak control error over the moving window: 2.12 cm (95 % interval 1.8 to 2.51 cm), limit at "
        "most 5 cm; 4 load cases, 2140 s, 71 effective windows."
    )


@pytest.mark.parametrize(
    ("key", "measure", "values", "verdict"),
    [("3-pump", "u_p_deviation", (0.01, 0.04), Verdict.REFUTED), ("1b-highest", "load_share", (0.7, 0.3), OPEN)],
)
def test_the_worst_of_several_tests_is_judged_and_named(key, measure, values, verdict):
    """For "at least" the smallest, else the largest."""
    rows = [Measure(measure, x, test=f"test {i}") for i, x in enumerate(values)]
    found = line(load_criteria("paper-f"), key, *rows)
    assert (found.verdict, found.failed, found.measure) == (verdict, True, rows[1])
    assert "in test 1, the worst of 2: " in found.message


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "ends", "verdict"),
    [
        (0.04, (0.03, 0.045), Verdict.SHOWN),
        (0.04, (0.03, 0.05), Verdict.SHOWN),
        (0.04, (0.03, 0.06), Verdict.NOT_SHOWN),
        (0.0681, (0.0178, 0.12), Verdict.NOT_SHOWN),
        (0.07, (0.0501, 0.09), Verdict.REFUTED),
    ],
)
@pytest.mark.parametrize("ask", ["required", "supporting"])
def test_the_interval_alone_gives_the_verdict_whatever_the_row_asks(tmp_path, ask, value, ends, verdict):
    criteria = own(tmp_path, f'key = "2b"\nask = "{ask}"')
    assert line(criteria, "2b", Measure(MEAN, value, "length", *ends)).verdict is verdict


@pytest.mark.parametrize(
    ("limit", "low", "high"),
    [(0.25, -0.6, 0.6), (0.25, -2.0, 0.1), (0.25, 0.2, 0.8), (0.04, 0.0379, 0.0496), (0.05, 0.0178, 0.12)],
)
def test_no_interval_that_holds_a_limit_or_is_wider_than_the_limits_is_ever_shown_or_refuted(
    tmp_path, limit, low, high
):
    criteria = own(tmp_path, f'key = "p-leakage"\nwithin = "{100.0 * limit:g} %"')
    for value in (low, 0.5 * (low + high), high):
        assert line(criteria, "p-leakage", Measure("leakage_error", value, "", low, high)).verdict is Verdict.NOT_SHOWN


@pytest.mark.parametrize(
    ("key", "measure", "value", "low", "high", "expected"),
    [
        ("2b", MEAN, 0.0681, 0.0178, 0.12, (Verdict.NOT_SHOWN, True)),
        ("2b", MEAN, 0.03, 0.01, 0.06, (Verdict.NOT_SHOWN, True)),
        ("p-tip-delay", "tip_delay_error", 0.0437, 0.0379, 0.0496, (Verdict.NOT_SHOWN, True)),
        ("p-tip-delay", "tip_delay_error", 0.035, 0.02, 0.05, (Verdict.NOT_SHOWN, False)),
        ("p-tip-delay", "tip_delay_error", 0.15, 0.13, 0.17, (Verdict.REFUTED, True)),
    ],
)
def test_a_required_line_blocks_while_it_is_not_shown_and_a_supporting_one_where_its_estimate_misses_the_limit(
    key, measure, value, low, high, expected
):
    found = line(load_criteria("paper-f"), key, Measure(measure, value, MEASURES[measure].quantity, low, high))
    assert (found.verdict, found.failed) == expected


def test_of_several_tests_a_refuted_one_comes_before_one_that_is_wide_and_that_before_one_that_agrees():
    criteria = load_criteria("paper-f")
    refuted, open_, near = (
        Measure("tip_delay_error", value, "time", value - half, value + half, test)
        for value, half, test in ((0.06, 0.01, "refuted"), (0.03, 0.2, "open"), (0.035, 0.001, "near"))
    )
    for found, worst in (((refuted, open_, near), "refuted"), ((open_, near), "open"), ((near,), "near")):
        result = line(criteria, "p-tip-delay", *found)
        assert result.measure is not None
        assert (result.measure.test, result.figures) == (worst, len(found))


def test_the_risks_are_of_one_line_and_grow_with_the_tests_whose_worst_is_judged():
    criteria = load_criteria("paper-f")
    found = line(criteria, "p-lever", *(Measure("lever_error", 0.0, "", -0.001, 0.001, str(i)) for i in range(4)))
    assert (found.consumer_risk, found.producer_risk) == (0.025, 0.1)
    by_value = line(criteria, "2a", Measure("e_c_max_difference", 0.01, "length"))
    assert (by_value.figures, by_value.consumer_risk, by_value.producer_risk) == (0, None, None)


@pytest.mark.thorough
def test_the_stated_risks_hold_for_true_figures_at_the_limit():
    """Figures drawn about a true value at the limit, with their 95 % intervals: shown and refuted each in 2.5 % of the draws."""
    criteria, half, draws = load_criteria("paper-f"), 1.96 * 0.01, 4000
    values = 0.25 + 0.01 * np.random.default_rng(1).standard_normal(draws)
    verdicts = [
        line(criteria, "p-leakage", Measure("leakage_error", x, "", x - half, x + half)).verdict for x in values
    ]
    for verdict in (Verdict.SHOWN, Verdict.REFUTED):
        assert verdicts.count(verdict) / draws == pytest.approx(RISK, abs=4.0 * (RISK / draws) ** 0.5)


def test_what_the_form_of_a_law_leaves_is_part_of_the_interval_and_is_printed():
    found = line(load_criteria("paper-f"), "p-leakage", Measure("leakage_error", 0.17, "", 0.05, 0.29, structural=0.1))
    assert found.verdict is Verdict.NOT_SHOWN
    assert "(95 % interval 5 to 29 %, of which +- 10 % from the form of the law)" in found.message


def test_the_outcome_is_refuted_before_not_shown_before_passed():
    criteria = load_criteria("paper-f")
    good = line(criteria, "2b", Measure(MEAN, 0.02, "length", 0.01, 0.03))
    wide = line(criteria, "2c", Measure("eta_c_deviation_high", 0.04, "", 0.02, 0.06))
    bad = line(criteria, "2a", Measure("e_c_max_difference", 0.2, "length"))
    loose = line(criteria, "3-K_p", Measure("K_p_deviation", 0.1, "", -0.2, 0.4))
    info = line(criteria, "2b-s", Measure("e_c_pp_deviation_s", 0.02, "length"))
    assert outcome_of((good, loose, info)) is Outcome.PASSED
    assert outcome_of((good, wide)) is Outcome.NOT_SHOWN
    assert outcome_of((loose,)) is Outcome.NOT_SHOWN  # a certificate of nothing that was shown certifies nothing
    assert outcome_of((good, wide, bad)) is Outcome.REFUTED
    assert outcome_of((info,)) is Outcome.NOT_JUDGED


@pytest.mark.parametrize(
    ("key", "measure", "value", "verdict"),
    [
        ("2a", "e_c_max_difference", -0.06, Verdict.REFUTED),
        ("2a", "e_c_max_difference", 0.06, Verdict.REFUTED),
        ("2a", "e_c_max_difference", -0.04, Verdict.SHOWN),
        ("2b", MEAN, 0.05, Verdict.SHOWN),
        ("2a-moment", "e_c_deviation_max", 0.4, Verdict.INFO),
    ],
)
def test_a_figure_without_an_interval_is_judged_by_its_value(key, measure, value, verdict):
    """Within is of zero either way, the limit itself meets it, and a line for information never fails."""
    found = line(load_criteria("paper-f"), key, Measure(measure, value, "length"))
    assert (found.verdict, found.failed) == (verdict, verdict is Verdict.REFUTED)


@pytest.mark.parametrize("value", [None, float("nan")])
def test_data_that_cannot_tell_are_a_no_where_the_criterion_is_needed(value):
    found = line(load_criteria("paper-f"), "2b", Measure(MEAN, value, "length", notes=("s_tip is not in the log",)))
    assert found.verdict is Verdict.NOT_COVERED
    assert found.failed
    assert "s_tip is not in the log" in found.message


@pytest.mark.parametrize("name", ["paper-f", "any-drive"])
def test_what_the_tests_lack_refutes_nothing(name):
    """A campaign without small waves was "REFUTED" by 1c-low: a gap in the data says nothing of the crane."""
    criteria = load_criteria(name)
    counted = [c for c in criteria.criteria if MEASURES[c.measure].coverage]
    assert {"1a", "1b", "1b-highest", "1c-low", "1c-high", "1d", "1-doubtful", "4"} <= {c.key for c in counted}
    for c in counted:
        beyond = 0.0 if c.kind is Limit.AT_LEAST else 100.0
        found = line(criteria, c.key, Measure(c.measure, beyond, c.quantity))
        assert found.verdict is (Verdict.NOT_COVERED if c.judged else Verdict.INFO)
        assert found.failed is c.judged
        assert outcome_of((found,)) is not Outcome.REFUTED
    for c in criteria.criteria:
        assert line(criteria, c.key).verdict is (Verdict.NOT_COVERED if c.judged else Verdict.INFO)


def test_what_the_data_cannot_detect_is_stated_with_its_interval_and_neither_shown_nor_in_the_way():
    criteria = load_criteria("paper-f")
    wide = Measure("tip_delay_error", 0.098, "time", -0.08, 0.276, notes=("too weak",), undetectable=True)
    found = line(criteria, "p-tip-delay", wide)
    assert (found.verdict, found.judged, found.failed) == (Verdict.NOT_COVERED, False, False)
    assert "98 ms (95 % interval -80 to 276 ms), not detectable with these data" in found.message
    assert found.to_dict()["measure"]["undetectable"] is True
    assert line(criteria, "p-tip-delay", replace(wide, undetectable=False)).failed  # judged, it blocks


def test_what_is_not_needed_does_not_count_where_the_data_cannot_tell(tmp_path):
    criteria = own(tmp_path, 'key = "2b"\nneeded = false')
    assert not line(criteria, "2b", Measure(MEAN, None, "length", notes=("no",))).failed
    both = (Measure(MEAN, None, "length", test="a", notes=("no",)), Measure(MEAN, 0.2, "length", test="b"))
    assert line(criteria, "2b", *both).failed


def test_one_test_that_cannot_tell_outweighs_those_that_pass_but_not_one_that_fails():
    criteria = load_criteria("paper-f")
    unknown, good, bad = (Measure("u_p_deviation", x, test=t) for x, t in ((None, "a"), (0.01, "b"), (0.1, "c")))
    assert line(criteria, "3-pump", unknown, good).verdict is Verdict.NOT_COVERED
    assert line(criteria, "3-pump", unknown, good, bad).verdict is Verdict.REFUTED


def test_only_steps_that_were_taken_are_judged():
    assert {x.step for x in judge(load_criteria("paper-f"), (), (StepNumber.AHC,))} == {StepNumber.AHC}
