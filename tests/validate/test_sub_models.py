"""Levels of the sub-models of a twin, from the lines of its validation; variants of thesis table 2.7."""

from fnmatch import fnmatch

import pytest

from stillhook.library import cranes, load_crane
from stillhook.spec.sub_models import SUB_MODELS, levels_of, levels_text, parts_of
from stillhook.spec.validity import Certified, Condition
from stillhook.validate import load_criteria

KEYS = [c.key for c in load_criteria("paper-f").criteria]
OF_THE_DATA = ("1a", "1b", "1c-", "1d", "1-", "p-clock", "p-jump", "p-tip-acceleration", "p-reference", "p-rest")
"""Lines that judge the data of the campaign, no part of the twin."""
CRANE = load_crane("nov-250t")
RECORD = {
    "digest": "0" * 64,
    "date": "2026-11-21",
    "criteria": "paper-f version 3",
    "passed": True,
    "synthetic": False,
    "level": 2,
    "variant": 2,
    "version": "0.12.0",
    "code": "0" * 16,
    "content": {},
    "envelope": None,
}


def line(key, verdict="shown", judged=True, failed=False):
    return {"key": key, "verdict": verdict, "judged": judged, "failed": failed}


def test_every_line_that_is_named_is_a_criterion():
    for one in SUB_MODELS.values():
        assert all(any(fnmatch(key, pattern) for key in KEYS) for pattern in one["lines"]), one


def test_every_criterion_of_the_twin_judges_a_sub_model():
    named = [pattern for one in SUB_MODELS.values() for pattern in one["lines"]]
    missing = [key for key in KEYS if not any(fnmatch(key, pattern) for pattern in named)]
    assert [key for key in missing if not key.startswith(OF_THE_DATA)] == [
        "p-leakage-file",
        "4",
        "4-misfit",
        "4-misfit-file",
    ]


@pytest.mark.parametrize(
    ("lines", "level"),
    [
        ([], 1),
        ([line("p-friction")], 2),
        ([line("p-friction", "not shown")], 1),
        ([line("p-friction", "refuted", failed=True)], 1),
        ([line("p-friction", judged=False)], 1),
        ([line("p-lever")], 1),
    ],
)
def test_a_sub_model_is_at_level_2_where_a_judged_line_was_shown(lines, level):
    assert levels_of(CRANE, lines)["friction"] == level


def test_one_line_that_failed_outweighs_one_that_was_shown():
    lines = [line("6-gas"), line("6-motors", "refuted", failed=True)]
    assert levels_of(CRANE, lines)["passive"] == 1
    assert levels_of(CRANE, lines[:1])["passive"] == 2


def test_a_twin_has_the_sub_models_of_its_winch():
    for name in cranes():
        crane = load_crane(name)
        assert ("passive" in parts_of(crane)) == (vars(crane).get("passive") is not None)
        assert ("oil" in parts_of(crane)) == (vars(crane).get("active") is not None)
    assert levels_text({"friction": 2, "wire": 1}) == (
        "level 2: friction of motors and winch; level 1: elasticity of the wire"
    )


def test_a_record_without_levels_keeps_its_seal():
    old, new = Certified.of(**RECORD), Certified.of(**RECORD, sub_models={"friction": 2})
    assert old.sub_models == {}
    assert Certified.model_validate(old.model_dump()) == old
    assert Certified.model_validate(new.model_dump()).sub_models == {"friction": 2}
    with pytest.raises(ValueError, match="changed manually"):
        Certified.model_validate(new.model_dump() | {"sub_models": {"friction": 1}})


def test_a_certificate_is_variant_2_until_batches_are_watched():
    record = Certified.of(**RECORD)
    assert record.variant_now == 2
    assert record.followed(Condition(valid=True, date="2027-01-05", digest="1" * 64)).variant_now == 3
    unverified = Certified.of(**RECORD | {"passed": False, "level": 1, "variant": 1})
    assert unverified.variant_now == 1
