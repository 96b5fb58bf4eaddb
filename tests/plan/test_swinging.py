"""An alternative without a limit because the winch oscillates: the answer says so, and on what it rests."""

from dataclasses import replace

import numpy as np
import pytest
from tests.plan.made_up import made_up

from stillhook import load_crane
from stillhook.plan.answer.metadata import oscillations
from stillhook.plan.definition.lift_plan import Environment
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.report.limits_summary import verdict
from stillhook.plan.report.words import sentence
from stillhook.plan.table import Axes, Chosen
from stillhook.tables.table import SourceKind

ENVIRONMENT = Environment(Hs=("1 m", "2 m"), Tp=("7 s", "12 s"), headings=("165 deg", "180 deg"), spread=4)


@pytest.fixture(scope="module")
def asked():
    alternatives = (Alternative.NONE, Alternative("hs"), Alternative("ssc"))
    return replace(load_plan("template-to-1500m"), environment=ENVIRONMENT, alternatives=alternatives)


def limits(plan, *, zero: tuple[str, str, str] | None) -> Chosen:
    """2 m in every cell, and 0 in three cells of four by this rule of this phase for this alternative."""
    axes = Axes.of(plan)
    shape = (len(axes.alternatives), len(axes.phases), len(axes.rules), *axes.columns)
    Hs = np.full(shape, 2.0)
    if zero is not None:
        alternative, phase, rule = zero
        at = axes.alternatives.index(Alternative(alternative)), axes.phases.index(phase), axes.rules.index(rule)
        Hs[at] = [[0.0, 0.0], [0.0, 2.0]]
    nan = np.full(shape, np.nan)
    return Chosen(axes, Hs, nan, nan, np.full(shape, 2))


def test_the_sentence_says_who_where_how_fast_on_what_it_rests_and_what_to_do(asked):
    (found,) = oscillations(asked, limits(asked, zero=("hs", "landing", "oscillation")))
    line = sentence(found)
    for part in ("HS in 3 of 4 cells: in landing, at 6 m/min", "more than 1 % of the time (assumed)", "stability"):
        assert part in line
    assert "damping of 0.01 (0.005 to 0.1, assumed)" in line


@pytest.mark.parametrize("zero", [None, ("hs", "landing", "load-motion")])
def test_nothing_is_said_where_nothing_or_another_rule_gives_zero(asked, zero):
    assert oscillations(asked, limits(asked, zero=zero)) == []


def test_a_damping_that_was_fitted_is_not_called_assumed(asked):
    crane = load_crane("nov-250t")
    fitted = crane.sources["wire.zeta"].model_copy(update={"kind": SourceKind.FITTED})
    known = replace(asked, crane=crane.model_copy(update={"sources": {**crane.sources, "wire.zeta": fitted}}))
    (found,) = oscillations(known, limits(known, zero=("hs", "landing", "oscillation")))
    assert found["known"] == ["0.005 to 0.1", "fitted"]


def test_the_sentence_stands_on_the_first_page_of_the_report(asked):
    (found,) = oscillations(asked, limits(asked, zero=("hs", "landing", "oscillation")))
    plain = made_up()
    marked = replace(plain, facts={**plain.facts, "remarks": [found, *plain.facts["remarks"]]})
    assert f"{sentence(found)}." in verdict(marked).text
    assert len(verdict(plain).text) == len(verdict(marked).text) - 1
