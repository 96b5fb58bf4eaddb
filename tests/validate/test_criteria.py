"""Acceptance criteria: what paper F's table says, what a set of one's own may change, what is refused, and how a measure is judged."""

from pathlib import Path

import pytest

from stillhook.errors import StillhookError, ValidateError
from stillhook.validate.criteria import By, Criteria, Limit, criteria_sets, load_criteria
from stillhook.validate.judging import judge
from stillhook.validate.lines import Measure, StepNumber, Verdict
from stillhook.validate.measures import MEASURES, SETTINGS

ALL = tuple(StepNumber)
MEAN = "e_c_pp_deviation"


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
        "1a": (Limit.AT_LEAST, 2.0), "1b": (Limit.AT_LEAST, 2.0), "1b-highest": (Limit.AT_LEAST, 0.4), "1c-low": (Limit.AT_MOST, 0.5),
        "1c-high": (Limit.AT_LEAST, 2.0), "1d": (Limit.AT_LEAST, 1500.0), "2a": (Limit.WITHIN, 0.05), "2b": (Limit.AT_MOST, 0.05),
        "3-pump": (Limit.AT_MOST, 0.03), "3-motor": (Limit.AT_MOST, 0.03),
    }  # fmt: skip
    for key, (kind, limit) in printed.items():
        assert (rows[key].kind, rows[key].limit) == (kind, pytest.approx(limit)), key
        assert "paper F" in rows[key].source
        assert rows[key].judged
    assert load_criteria("paper-f").settings["window"] == 30.0


def test_the_other_reading_of_the_largest_error_is_shown_and_not_judged():
    rows = {c.key: c for c in load_criteria("paper-f").criteria}
    assert not rows["2a-moment"].judged
    assert rows["2a"].judged


@pytest.mark.parametrize("name", criteria_sets())
def test_every_limit_of_our_own_gives_its_reason_and_every_row_a_source(name):
    for c in load_criteria(name).criteria:
        assert c.source
        assert c.reason or not c.source.startswith("ours"), c.key


def test_every_measure_that_a_criterion_may_name_says_what_it_is():
    for name, m in MEASURES.items():
        assert m.meaning, name
        assert m.step in StepNumber


# --- a set of one's own ------------------------------------------------------------------------------------------------------------------


def test_a_changed_limit_says_what_it_was_and_takes_no_credit_from_the_paper(tmp_path):
    c = own(tmp_path, 'key = "2b"\nat_most = "6 cm"')
    row = next(x for x in c.criteria if x.key == "2b")
    assert (row.limit, row.written, row.source) == (pytest.approx(0.06), "6 cm", "changed in mine.toml; at most 5 cm in paper F table 2")
    assert c.changes == (f"2b: {MEAN} at most 6 cm by value in place of {MEAN} at most 5 cm by value",)
    assert c.name == "mine"


def test_rows_can_be_dropped_added_and_made_stricter_and_all_of_it_is_told(tmp_path):
    c = own(
        tmp_path,
        'key = "own"\nstep = 5\nwhat = "Spread"\nmeasure = "e_c_pp_deviation_s"\nat_most = "20 mm"\nby = "whole"\nneeded = false',
        'drop = ["2d-correlation"]\n[settings]\nwindow = "20 s"',
    )
    rows = {x.key: x for x in c.criteria}
    assert "2d-correlation" not in rows
    assert (rows["own"].by, rows["own"].needed, rows["own"].limit) == (By.WHOLE, False, 0.02)
    assert c.settings["window"] == 20.0
    assert len(c.changes) == 3


def test_a_judged_row_that_is_only_shown_from_now_on_is_told_as_a_change(tmp_path):
    assert "shown only" in own(tmp_path, 'key = "2b"\njudged = false').changes[0]


def test_the_digest_follows_what_is_asked_and_not_how_it_is_written(tmp_path):
    plain = own(tmp_path, 'key = "2b"\nat_most = "6 cm"')
    spaced = own(tmp_path, '# a comment\nkey = "2b"\nat_most   =   "6 cm"')
    other = own(tmp_path, 'key = "2b"\nat_most = "7 cm"')
    assert plain.digest == spaced.digest
    assert len({plain.digest, other.digest, load_criteria("paper-f").digest}) == 3


def test_a_set_without_a_base_gives_everything_itself(tmp_path):
    settings = "\n".join(f'{n} = "{v}"' for n, v in {"window": "30 s", "eta_above": "1 m"}.items())
    missing = set(SETTINGS) - {"window", "eta_above"}
    row = f'[[criterion]]\nkey = "a"\nstep = 5\nwhat = "Mean"\nmeasure = "{MEAN}"\nat_most = "5 cm"\n'
    if missing:  # settings that other steps have brought since
        with pytest.raises(ValidateError, match="missing"):
            loaded(tmp_path, f'version = "1"\n[settings]\n{settings}\n{row}')
    else:
        assert loaded(tmp_path, f'version = "1"\n[settings]\n{settings}\n{row}').changes == ()
    with pytest.raises(ValidateError, match="settings: window: missing"):
        loaded(tmp_path, f'version = "1"\n{row}')


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ('key = "x"\nstep = 5\nwhat = "W"\nmeasure = "e_c_pp_deviatoin"\nat_most = "5 cm"', 'did you mean "e_c_pp_deviation"?'),
        ('key = "2b"\nat_most = 5', "at_most"),
        ('key = "2b"\nat_most = "5 bar"', "bar"),
        ('key = "2b"\nat_most = "5 cm"\nat_least = "1 cm"', "exactly one of"),
        ('key = "x"\nstep = 5\nwhat = "W"\nmeasure = "e_c_pp_deviation"', "exactly one of"),
        ('key = "2b"\nstep = 3', "step"),
        ('key = "2b"\nby = "half"', "value, whole, any"),
        ('key = "2b"\njudged = "yes"', "true or false"),
        ('key = "2b"\nlimit = "5 cm"', "unknown field"),
        ('key = "3-pump"\nat_most = "three %"', "at_most"),
        ('key = "3-pump"\nat_most = true', "at_most"),
        ('key = "3-pump"\nat_most = "nan %"', "at_most"),
        ('key = "3-pump"\nat_most = nan', "at_most"),
        ('key = "3-pump"\nat_most = inf', "at_most"),
        (f'key = "3-pump"\nat_most = "{"9" * 400} %"', "at_most"),
        ('key = "2a"\nwithin = "-5 cm"', "negative"),
        ('key = "x"\nstep = 5\nwhat = "W"\nmeasure = "e_c_pp_deviation"\nat_most = "5 cm"\nsource = "ours"', "reason: missing"),
        ('key = "2b"\nwhat = ""', "give a text"),
    ],
)
def test_a_row_that_cannot_be_meant_is_refused_in_one_line(tmp_path, row, told):
    with pytest.raises(StillhookError) as e:
        own(tmp_path, row)
    assert told in str(e.value)
    assert str(e.value).startswith("mine.toml: ")
    assert "\n" not in str(e.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('base = "paper-g"\nversion = "1"', 'did you mean "paper-f"?'),
        ('base = "paper-f"', "version: missing"),
        ('base = "paper-f"\nversion = "1"\ndrop = ["2z"]', '"2z"'),
        ('base = "paper-f"\nversion = "1"\ndrop = "2b"', "list of keys"),
        ('base = "paper-f"\nversion = "1"\n[settings]\nwindows = "30 s"', "window"),
        ('base = "paper-f"\nversion = "1"\n[settings]\nwindow = "0 s"', "more than zero"),
        ('base = "paper-f"\nversion = "1"\n[settings]\nwindow = 30', "window"),
        ('version = "1"', "one [[criterion]] a row"),
        ('base = "paper-f"\nversion = "1"\ncriterion = 3', "one [[criterion]] a row"),
        ('base = "paper-f"\nversion = "1"\n[[criterion]]\nkey = "2b"\n[[criterion]]\nkey = "2b"', "comes twice"),
        ('base = "paper-f"\nversion = "1"\ndrop = ["2b"]\n[[criterion]]\nkey = "2b"', "dropped as well"),
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
    with pytest.raises(ValidateError, match="everything would pass"):
        loaded(tmp_path, f'base = "paper-f"\nversion = "1"\n{rows}')


def test_a_name_that_is_no_set_names_those_that_there_are():
    with pytest.raises(ValidateError, match='did you mean "paper-f"'):
        load_criteria("paperf")


# --- judging -----------------------------------------------------------------------------------------------------------------------------


def test_a_line_is_one_sentence_with_figure_interval_limit_and_data():
    m = Measure(MEAN, 0.0212, "length", 0.018, 0.0251, data="4 load cases, 2140 s, 71 effective windows")
    found = line(load_criteria("paper-f"), "2b", m)
    assert found.verdict is Verdict.PASS
    assert found.said == (
        "Mean deviation of the peak-to-peak control error over the moving window: 2.12 cm (95 % interval 1.8 to 2.51 cm), at most 5 cm is "
        "asked; 4 load cases, 2140 s, 71 effective windows."
    )


def test_the_worst_of_several_tests_is_judged_and_named():
    found = line(load_criteria("paper-f"), "3-pump", Measure("u_p_deviation", 0.01, test="test 1"), Measure("u_p_deviation", 0.04, test="test 2"))
    assert found.verdict is Verdict.FAIL
    assert found.no
    assert "in test 2, the worst of 2: 4 %, at most 3 % is asked" in found.said


def test_for_at_least_the_smallest_is_the_worst():
    found = line(load_criteria("paper-f"), "1b-highest", Measure("load_share", 0.7, test="a"), Measure("load_share", 0.3, test="b"))
    assert found.verdict is Verdict.FAIL
    assert found.measure is not None
    assert found.measure.test == "b"


@pytest.mark.parametrize(
    ("by", "ends", "verdict"),
    [
        ("value", (0.03, 0.06), Verdict.PASS),
        ("whole", (0.03, 0.06), Verdict.FAIL),
        ("whole", (0.03, 0.045), Verdict.PASS),
        ("any", (0.045, 0.06), Verdict.PASS),
    ],
)
def test_an_interval_counts_as_the_row_says(tmp_path, by, ends, verdict):
    criteria = own(tmp_path, f'key = "2b"\nby = "{by}"')
    assert line(criteria, "2b", Measure(MEAN, 0.04, "length", *ends)).verdict is verdict


def test_by_any_a_measure_fails_only_where_all_of_its_interval_misses(tmp_path):
    criteria = own(tmp_path, 'key = "2b"\nby = "any"')
    assert line(criteria, "2b", Measure(MEAN, 0.07, "length", 0.045, 0.09)).verdict is Verdict.PASS
    assert line(criteria, "2b", Measure(MEAN, 0.07, "length", 0.055, 0.09)).verdict is Verdict.FAIL


def test_by_any_an_interval_that_no_value_could_fail_with_tells_nothing():
    criteria = load_criteria("paper-f")  # 3-K_p: within +-20 %, by any, not needed
    wide = line(criteria, "3-K_p", Measure("K_p_deviation", -0.6, "", -1.3, 0.1))
    assert (wide.verdict, wide.no) == (Verdict.NOT_SHOWN, False)
    assert "too wide to tell" in wide.said
    assert line(criteria, "3-K_p", Measure("K_p_deviation", 0.25, "", 0.15, 0.35)).verdict is Verdict.PASS
    assert line(criteria, "3-K_p", Measure("K_p_deviation", 0.9, "", 0.3, 1.5)).verdict is Verdict.FAIL


def test_within_is_of_zero_either_way():
    criteria = load_criteria("paper-f")
    for value, verdict in ((-0.06, Verdict.FAIL), (0.06, Verdict.FAIL), (-0.04, Verdict.PASS)):
        assert line(criteria, "2a", Measure("e_c_max_difference", value, "length")).verdict is verdict


@pytest.mark.parametrize("value", [None, float("nan")])
def test_data_that_cannot_tell_are_a_no_where_the_criterion_is_needed(value):
    found = line(load_criteria("paper-f"), "2b", Measure(MEAN, value, "length", note="s_tip is not in the log"))
    assert found.verdict is Verdict.NOT_SHOWN
    assert found.no
    assert "s_tip is not in the log" in found.said


def test_a_step_that_found_nothing_at_all_is_a_no():
    found = line(load_criteria("paper-f"), "2b")
    assert (found.verdict, found.no) == (Verdict.NOT_SHOWN, True)


def test_what_is_not_needed_does_not_count_where_the_data_cannot_tell(tmp_path):
    criteria = own(tmp_path, 'key = "2b"\nneeded = false')
    assert not line(criteria, "2b", Measure(MEAN, None, "length", note="no")).no
    both = (Measure(MEAN, None, "length", test="a", note="no"), Measure(MEAN, 0.2, "length", test="b"))
    assert line(criteria, "2b", *both).no


def test_one_test_that_cannot_tell_outweighs_those_that_pass_but_not_one_that_fails():
    criteria = load_criteria("paper-f")
    unknown, good, bad = (Measure("u_p_deviation", x, test=t) for x, t in ((None, "a"), (0.01, "b"), (0.1, "c")))
    assert line(criteria, "3-pump", unknown, good).verdict is Verdict.NOT_SHOWN
    assert line(criteria, "3-pump", unknown, good, bad).verdict is Verdict.FAIL


def test_a_row_that_is_not_judged_is_told_and_never_a_no():
    found = line(load_criteria("paper-f"), "2a-moment", Measure("e_c_deviation_max", 0.4, "length"))
    assert (found.verdict, found.no) == (Verdict.TOLD, False)
    assert "not judged" in found.said


def test_only_steps_that_were_taken_are_judged():
    assert {x.step for x in judge(load_criteria("paper-f"), (), (StepNumber.AHC,))} == {StepNumber.AHC}


def test_a_figure_at_the_limit_itself_meets_it():
    assert line(load_criteria("paper-f"), "2b", Measure(MEAN, 0.05, "length")).verdict is Verdict.PASS
