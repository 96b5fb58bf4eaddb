"""The table of detection limits: it follows from the kept trials, and certificates print it as it is."""

from trials.campaigns import Defect
from trials.campaigns.defects import DEFECTS
from trials.defects import detection_limits as limits
from trials.defects import run as trials

from stillhook.validate.certificate.content import method_hash
from stillhook.validate.criteria.criteria import LIMITS_FILE, NONE, DetectionLimit, DetectionLimits, detection_limits


def outcomes(defect: Defect, caught: dict[float, tuple[bool, bool]]) -> dict[str, dict]:
    """Trials of a defect with two seeds at each size: whether a line of theirs stood in the way."""
    made = {}
    for size, both in caught.items():
        for seed, no in enumerate(both):
            made[limits.trial_of(defect, size, seed).key] = {
                "no": {"line": "it is off"} if no else {},
                "code": "x",
                "date": "2026-01-02",
            }
    return made


def test_the_kept_table_is_that_of_the_kept_trials():
    assert limits.text_of(limits.table_of(trials.kept())) == LIMITS_FILE.read_text(encoding="utf-8")


def test_a_limit_is_the_size_from_which_on_no_campaign_slips_through():
    sizes = DEFECTS[Defect.GEAR].ladder
    caught = dict(zip(sizes, ((True, True), (True, False), (True, True), (True, True)), strict=True))
    found = {row.defect: row for row in limits.limits(outcomes(Defect.GEAR, caught))}
    assert list(found) == ["gear"]
    assert found["gear"].smallest == sizes[2]  # the smallest size was caught, but not the next one
    assert found["gear"].smallest_text == "gear ratio motor to drum +1.5% against the twin's"


def test_a_defect_that_nothing_detects_is_listed_with_the_largest_size_tried():
    caught = dict.fromkeys(DEFECTS[Defect.BOOST].ladder, (True, False))
    (row,) = limits.limits(outcomes(Defect.BOOST, caught))
    table = DetectionLimits("x", "2026-01-02", 3, 0, (row,))
    assert row.smallest is None
    assert list(table.sentences())[1:] == [
        "Not detected: boost pressure -40% against the twin's (the largest size tried)."
    ]


def test_a_ladder_with_a_trial_missing_has_no_limit_yet():
    some = outcomes(Defect.GEAR, dict.fromkeys(DEFECTS[Defect.GEAR].ladder, (True, True)))
    some.popitem()
    assert list(limits.limits(some)) == []


def test_both_signs_of_a_ladder_have_limits_of_their_own():
    caught = {-1.0: (True, True), 1.0: (False, False)}
    found = list(limits.limits(outcomes(Defect.ACTIVE_COUNT, caught)))
    assert [row.smallest for row in found] == [None, -1.0]


def test_a_gap_counts_where_it_is_named_and_a_refused_campaign_is_detected():
    assert limits.detected(Defect.GAP, {"no": {}, "statements": ["no samples for 20 s"]})
    assert not limits.detected(Defect.GEAR, {"no": {}, "statements": ["no samples for 20 s"]})
    assert limits.detected(Defect.GEAR, {"refused": "signs contradict each other"})


def test_what_is_written_is_read_again(tmp_path, monkeypatch):
    rows = (
        DetectionLimit("gear", 0.015, 0.02, 'gear "a"', "gear b", 2),
        DetectionLimit("boost", None, -0.4, "boost", "boost", 2),
    )
    table = DetectionLimits("x-y", "2026-01-02", 100, 3, rows)
    file = tmp_path / "limits.toml"
    file.write_text(limits.text_of(table))
    monkeypatch.setattr("stillhook.validate.criteria.criteria.LIMITS_FILE", file)
    assert detection_limits.__wrapped__() == table


def test_a_certificate_without_trials_says_so():
    assert list(DetectionLimits("", "", 0, 0, ()).sentences()) == [NONE]


def test_the_table_is_part_of_the_method_but_not_of_the_code_that_the_trials_ran_with():
    assert method_hash() != method_hash(LIMITS_FILE.name)
    assert trials.code().endswith(method_hash(LIMITS_FILE.name))


def test_every_defect_has_steps_that_are_made_to_see_it():
    assert set(trials.SEEN_BY) == set(Defect)
    keys = [t.key for t in trials.trials()]
    assert len(keys) == len(set(keys))
    assert len([t for t in trials.trials() if not t.defect and not t.apart]) == 100
