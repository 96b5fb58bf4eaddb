"""The alternative phc of a plan: a winch that stands above a passive heave compensator, in every tier that can."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.errors import PlanError, StillhookError
from stillhook.physics.scalar import G
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.limits import limited, limits_in
from stillhook.plan.tiers.closed_form import closed_form, remarks
from stillhook.plan.tiers.frequency import frequency
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution
from stillhook.plan.tiers.time_domain.lowering import SeaState, course_of, machine_of, winch_of
from stillhook.plan.tiers.time_domain.measures import measures
from stillhook.spec.lift.phase import PhaseKind

NONE, PHC = Alternative.NONE, Alternative.PHC
ENDS = "compensator-ends"
SEAS = """
[compensator]
unit = "phc-60t"

[environment]
Hs = ["0.5 m", "1 m", "8 m"]
Tp = ["6 s", "9 s"]
headings = ["180 deg"]

[operation]
T_POP = "8 h"

[[phase]]
name = "through the surface"
kind = "splash-zone"
depth = "25 m"

[[phase]]
name = "down"
kind = "lowering"
mode = "manual"
depth = "280 m"

[[phase]]
name = "landing"
kind = "landing"
"""
UNIT = 6.8e3
"""Mass of the unit [kg]."""


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> LiftPlan:
    return loaded(tmp_path_factory.mktemp("plan"), manifold("none", "phc") + SEAS)


def test_a_plan_with_a_compensator_has_its_alternative(tmp_path: Path) -> None:
    usual = manifold("none", "phc").replace('alternatives = ["none", "phc"]\n', "")
    assert PHC in loaded(tmp_path, usual + SEAS).alternatives
    without = usual + SEAS.replace('[compensator]\nunit = "phc-60t"\n', "")
    assert PHC not in loaded(tmp_path, without).alternatives


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (manifold("none", "phc") + SEAS.replace('[compensator]\nunit = "phc-60t"\n', ""), '"phc" needs a compensator'),
        (manifold("none", "ssc") + SEAS, "[compensator] is given and not used"),
        (manifold("none", "phc") + SEAS.replace("phc-60t", "phc-6t"), 'No compensator "phc-6t"'),
        (
            manifold("none", "phc") + SEAS.replace('unit = "phc-60t"', 'unit = "phc-60t"\np_0 = "9 m"'),
            'unit "m" is not',
        ),
        (manifold("none", "phc") + SEAS.replace('unit = "phc-60t"', "unit = 60"), "give a name of the library"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path: Path, text: str, line: str) -> None:
    with pytest.raises(StillhookError) as problem:
        loaded(tmp_path, text)
    assert line in str(problem.value)
    assert str(problem.value).startswith("plan.toml:")
    assert "\n" not in str(problem.value)


def test_the_unit_is_an_input_of_the_plan(tmp_path: Path, plan: LiftPlan) -> None:
    other = loaded(tmp_path, manifold("none", "phc") + SEAS.replace("phc-60t", 'phc-60t"\np_0 = "100 bar'))
    assert other.digest != plan.digest


def test_the_unit_hangs_in_its_alternative_alone(plan: LiftPlan) -> None:
    assert plan.under(NONE) is plan
    assert plan.hanging(-50.0).compensator is None
    assert plan.under(PHC).hanging(-50.0).compensator is plan.compensator
    assert plan.under(PHC).under(NONE).hanging(-50.0).compensator is None


def test_a_unit_that_does_not_fit_under_the_tip_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="they cannot hang under the crane tip"):
        loaded(tmp_path, manifold("none", "phc", start_depth="-14 m") + SEAS)
    without = SEAS.replace('[compensator]\nunit = "phc-60t"\n', "")
    loaded(tmp_path, manifold("none", "ssc", start_depth="-14 m") + without)


def test_closed_form_counts_its_weight_and_says_that_it_does_not_know_it(plan: LiftPlan) -> None:
    phase, seas = plan.phase("down"), plan.environment.table()
    weights = [closed_form(plan, phase, seas, a).values["F_top_static"][0] for a in (NONE, PHC)]
    assert weights[1] - weights[0] == pytest.approx(UNIT * G, rel=0.05)  # less the wire that the unit stands for
    assert any(each["cause"] == "closed-form-phc" for each in remarks(plan, seas))


def test_the_winch_is_not_asked_for_anything(plan: LiftPlan) -> None:
    """Rules of turning winches and hydraulics are left out, as for none; the rod has one of its own."""
    phase = plan.phase("landing")
    of_phc, of_none = ([each.rule.key for each in limited(plan, phase, a)] for a in (PHC, NONE))
    assert [key for key in of_phc if key != ENDS] == of_none
    assert ENDS in of_phc


@pytest.mark.slow
def test_a_rod_that_comes_to_its_ends_limits_the_sea_by_its_own_rule(plan: LiftPlan) -> None:
    """Higher waves leave it at an end for longer, and the rule of its ends is then met no more; what the load does is
    left open in those seas, what the rod does is not."""
    seas = plan.environment.table()
    found = {(d.phase, d.alternative): d for d in frequency(plan, (NONE, PHC), seas, threads=1)}
    linked = found["landing", PHC]
    share = linked.values["compensator_share"]
    assert "compensator_share" not in found["landing", NONE].values
    assert not np.isnan(share).any()
    assert np.isnan(linked.values["DAF"]).any()
    for _, _, rows in seas.columns:
        assert np.all(np.diff(share[rows]) >= 0.0)
    Hs = dict(zip((T for T, _, _ in seas.columns), limits_in(plan, linked).Hs[ENDS], strict=True))
    assert 0.0 < Hs[9.0] < seas.Hs.max()
    assert Hs[9.0] < Hs[6.0]  # the vessel heaves less in short waves


@pytest.mark.slow
def test_runs_of_the_twin_tell_the_time_of_the_rod_at_its_ends(plan: LiftPlan) -> None:
    """None in a low sea, much in one whose heave is longer than the stroke."""
    cells = Cells(plan, Execution(threads=1))
    phase = plan.phase("down")
    winch = winch_of(phase, PHC)
    low, high = (CellRequest(phase.name, winch, SeaState(Hs, 9.0, math.pi), 4) for Hs in (0.5, 8.0))
    cells.request([low, high])
    course = course_of(plan, phase, winch)
    measure = measures(plan, phase, PHC, winch, course)["compensator_share"]
    rule = next(each for each in limited(plan, phase, PHC) if each.rule.key == ENDS)
    shares = [measure.of_x(measure.values(cells.runs[ask.cell])) for ask in (low, high)]
    assert np.all(shares[0] == 0.0)
    assert np.all(shares[1] > rule.limit)
    assert np.all(shares[1] < 1.0)


@pytest.mark.slow
def test_linear_form_takes_the_swing_of_the_tension_in_short_waves(plan: LiftPlan) -> None:
    """In every phase that the method covers, also those that no winch compensates; and nothing is said of seas in which
    the rod comes to an end of its stroke."""
    found = {(d.phase, d.alternative): d for d in frequency(plan, (NONE, PHC), plan.environment.table(), threads=1)}
    for phase in ("down", "landing"):
        plain, linked = (found[phase, a].values for a in (NONE, PHC))
        assert not np.isnan(plain["DAF"]).any()
        assert not np.isnan(linked["DAF"][:2]).any()
        assert np.isnan(linked["DAF"][5])
        assert not np.isnan(linked["v_tip_max"]).any()
        assert linked["sling_ratio"][1] > plain["sling_ratio"][1]


def test_order_of_alternatives_does_not_matter(plan: LiftPlan) -> None:
    seas = plan.environment.table()
    one = {(d.phase, d.alternative): d for d in frequency(plan, (NONE, PHC), seas, threads=1)}
    other = {(d.phase, d.alternative): d for d in frequency(plan, (PHC, NONE), seas, threads=1)}
    assert one.keys() == other.keys()
    for key, demand in one.items():
        for name, x in demand.values.items():
            assert np.array_equal(x, other[key].values[name], equal_nan=True)


@pytest.mark.slow
def test_runs_of_the_twin_have_the_unit_in_the_load_path(plan: LiftPlan) -> None:
    """The same waves through the surface with it and without: slings keep more of their tension."""
    cells = Cells(plan, Execution(threads=1))
    phase = next(p for p in plan.phases if p.kind is PhaseKind.SPLASH and not p.held)
    spot = SeaState(2.0, 6.0, math.pi)
    asks = [CellRequest(phase.name, winch_of(phase, a), spot, 16) for a in (NONE, PHC)]
    assert machine_of(plan, asks[1].winch)[0] is plan.crane
    cells.request(asks)
    least = [float(np.mean(cells.runs[ask.cell]["F_sling_min"])) for ask in asks]
    assert least[1] > least[0] + 100e3


def test_a_plan_without_it_is_what_it_was(tmp_path: Path) -> None:
    """Without the table nothing hangs, under any alternative."""
    text = manifold("none", "ssc") + SEAS.replace('[compensator]\nunit = "phc-60t"\n', "")
    one = loaded(tmp_path, text)
    assert one.compensator is None
    assert not one.linked
    assert replace(one).under(PHC).hanging(-50.0).compensator is None
