"""Runs that allow far more than the frequency-domain method do not count, and the answer says so."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stillhook.plan.answer.spread import governs_of_draws
from stillhook.plan.definition.lift_plan import Environment
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits
from stillhook.plan.planning import answered
from stillhook.plan.report.words import sentence
from stillhook.plan.table import TIERS, Axes, apart_remarks, certified_in, chosen, gathered, lower_where_apart

pytestmark = pytest.mark.slow

HEADING, PERIODS = math.pi, (6.0, 9.0)


@pytest.fixture(scope="module")
def lift():
    environment = Environment(Hs=("1 m", "2 m"), Tp=("6 s", "9 s"), headings=("180 deg",))
    two = (Alternative.NONE, Alternative.SSC)
    return replace(load_plan("template-to-1500m"), environment=environment, alternatives=two)


def limits(phase, alternative, tier, **Hs):
    T, beta = np.array(PERIODS), np.full(2, HEADING)
    rows = {key.replace("_", "-"): np.array(values) for key, values in Hs.items()}
    return Limits(phase, alternative, tier, T, beta, rows, dict(rows), dict(rows))


def judged(lift, phase="landing", alternative=Alternative.SSC, rule="load_motion", runs=(2.0, 0.5), other=(0.3, 0.4)):
    """Limits of a rule by runs and by the frequency-domain method, and what counts of them."""
    rows = ((Tier.FREQUENCY, other), (Tier.TIME, runs))
    table = gathered(Axes.of(lift), [limits(phase, alternative, tier, **{rule: Hs}) for tier, Hs in rows])
    counts = lower_where_apart(lift, table, chosen(table))
    at = (
        lift.alternatives.index(alternative),
        [p.name for p in lift.phases].index(phase),
        table.axes.rules.index(rule.replace("_", "-")),
    )
    return counts.Hs[at][0].tolist(), counts.tier[at][0].tolist(), apart_remarks(lift, table, counts)


def test_the_lower_counts_where_runs_allow_far_more(lift):
    Hs, tier, remarks = judged(lift)
    assert Hs == [0.3, 0.5]
    assert tier == [TIERS.index(Tier.FREQUENCY), TIERS.index(Tier.TIME)]
    (found,) = remarks
    assert (found["phase"], found["rule"], found["alternatives"]) == ("landing", "load-motion", ["SSC"])
    assert (found["n"], found["of"], found["runs"], found["frequency"]) == (1, 2, [2.0, 2.0], [0.3, 0.3])
    assert "runs allow Hs 2.00 m, more than 1.5 times the Hs 0.30 m" in sentence(found)


def test_draws_of_runs_count_as_the_limits_do(lift):
    """Where the lower counts, no draw of the runs lifts it: the weather has the interval of what counts."""
    lift = replace(lift, alternatives=(*lift.alternatives, Alternative.CAP))
    axes = Axes.of(lift)
    rows = [
        limits("landing", Alternative.SSC, tier, load_motion=Hs)
        for tier, Hs in ((Tier.FREQUENCY, (0.3, 0.4)), (Tier.TIME, (2.0, 0.5)))
    ]
    of = answered(lift, axes, certified_in(lift, axes, lift.environment.table()), (), rows)
    draws = np.stack([x * of.limits.Hs[TIERS.index(Tier.TIME)] for x in (0.9, 1.1)])
    Hs = [g["twin"].Hs[axes.alternatives.index(Alternative.SSC), 0].tolist() for g in governs_of_draws(lift, of, draws)]
    assert Hs == [[0.3, pytest.approx(0.45)], [0.3, pytest.approx(0.55)]]


def test_runs_that_find_no_limit_are_far_above_any(lift):
    Hs, _, remarks = judged(lift, runs=(math.inf, math.inf), other=(0.3, math.inf))
    assert Hs == [0.3, math.inf]
    assert "runs allow any Hs of the table" in sentence(remarks[0])


@pytest.mark.parametrize(
    "where",
    [{"alternative": Alternative.NONE}, {"phase": "upper water", "rule": "dynamic_load"}, {"rule": "winch_speed"}],
)
def test_the_lower_counts_of_every_rule_phase_and_alternative(lift, where):
    assert judged(lift, **where)[0] == [0.3, 0.5]


def test_a_reason_in_the_plan_lets_the_runs_count(lift):
    reason = {("landing", "load-motion"): "32 runs, agreed with the surveyor"}
    Hs, _, remarks = judged(replace(lift, reconciled=reason))
    assert (Hs, remarks) == ([2.0, 0.5], [])
    assert judged(replace(lift, reconciled=reason), phase="landing, held")[0] == [0.3, 0.5]


@pytest.mark.parametrize(
    "where",
    [
        {"runs": (0.44, 0.5)},
        {"other": (math.nan, math.nan)},
        {"runs": (0.1, 0.2)},
    ],
)
def test_else_runs_count(lift, where):
    Hs, tier, remarks = judged(lift, **where)
    assert Hs == list(where.get("runs", (2.0, 0.5)))
    assert tier == [TIERS.index(Tier.TIME)] * 2
    assert not remarks
