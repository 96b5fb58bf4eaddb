"""A lift-off from another vessel has the hoisting rule of EN 13852-1, its peaks and its off-lead; one from the own deck
has none of them."""

import math

import numpy as np
import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.errors import StillhookError
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Seas, Tier
from stillhook.plan.limits import limited, limits_in
from stillhook.plan.planning import plan
from stillhook.plan.report.document import document
from stillhook.plan.tiers.closed_form import closed_form, remarks
from stillhook.plan.tiers.other_vessel import deck_speed, lead, relative_speed, speed_against_deck
from stillhook.plan.tiers.situations import looked_at

SEAS = """\
[environment]
Hs = "0.5 m to 4 m by 0.5 m"
Tp = ["8 s"]
headings = ["180 deg"]

[operation]
T_POP = "8 h"

[[phase]]
name = "lift-off"
kind = "lift-off"
speed = "30 m/min"

"""
CHART = "radius [m],SWL [t],DAF [1],side_lead [deg],off_lead [deg]\n10,240,1.3,6,12\n40,200,1.3,6,12\n"


OTHER = '[other_vessel]\nvessel = "supply-vessel-82m"\nat = "x=-20 m, y=0 m"\n\n'


def lift(folder, *, other: bool, table: str = "") -> LiftPlan:
    (folder / "chart.csv").write_text(CHART, encoding="utf-8")
    chart = '[load_chart]\nfile = "chart.csv"\npedestal = "x=-15 m, y=-9 m"\n\n'
    carrier = '[rigging]\ncarrier = "another-vessel"\n\n' if other else ""
    return loaded(folder, manifold("none", start_depth="-10 m") + carrier + table + chart + SEAS)


@pytest.mark.parametrize(("K_H", "speeds"), [(0.5, (0.447, 0.757, 0.931)), (0.28, (0.250, 0.424, 0.521))])
def test_the_least_hoisting_speed_is_that_of_the_standard(K_H, speeds):
    """As quoted from EN 13852-1 for Hs 1.4, 2.7 and 3.6 m and a crane tip at rest."""
    assert K_H * relative_speed((1.4, 2.7, 3.6), 0.0) == pytest.approx(speeds, abs=6e-4)


def test_the_rule_of_the_library_is_that_speed(tmp_path):
    """K_H = 0.5: a planned speed of 30 m/min allows a hook of 1 m/s against the deck."""
    of = lift(tmp_path, other=True)
    rule = next(x for x in limited(of, of.phases[0], Alternative.NONE) if x.rule.key == "hoisting-speed")
    assert 0.5 * rule.limit == pytest.approx(of.phases[0].speed)
    demand = closed_form(of, of.phases[0], of.environment.table())
    Hs = float(limits_in(of, demand).Hs["hoisting-speed"][0])
    tip = np.interp(Hs, demand.seas.Hs, demand.values["v_tip_max"])
    assert math.hypot(float(deck_speed(Hs)), tip) == pytest.approx(1.0, rel=5e-3)


def test_a_lift_from_the_own_deck_has_no_such_rule(tmp_path):
    own = lift(tmp_path, other=False)
    keys = {x.rule.key for x in limited(own, own.phases[0], Alternative.NONE)}
    assert "hoisting-speed" not in keys
    values = closed_form(own, own.phases[0], own.environment.table()).values
    assert "v_carrier" not in values
    assert (values["v_lift_off"] == 0.0).all()


def test_the_load_is_taken_up_at_the_speed_against_the_deck(tmp_path):
    """More than from the own deck by sqrt(K M) times the relative speed: as by the same hoisting speed and that."""
    seas = Seas(np.array([0.5, 2.0]), np.full(2, 8.0), np.full(2, math.pi))
    own, other = (
        closed_form(x, x.phases[0], seas).values for x in (lift(tmp_path, other=False), lift(tmp_path, other=True))
    )
    more = other["F_top_max"] - own["F_top_max"]
    assert (more > 0.0).all()
    assert more[1] / more[0] == pytest.approx(other["v_carrier"][1] / other["v_carrier"][0])
    assert "v_lift_off" not in other


def test_the_deck_is_off_by_its_distance_and_across_the_boom_by_half_of_it(tmp_path):
    assert math.tan(float(lead(2.0, 20.0))) == pytest.approx(5.5 / 20.0)
    assert math.tan(float(lead(2.0, 20.0, 0.5))) == pytest.approx(2.75 / 20.0)
    of = lift(tmp_path, other=True)
    values = closed_form(of, of.phases[0], of.environment.table()).values
    assert (values["off_lead"] > values["side_lead"]).all()
    assert float(values["off_lead"][-1]) >= math.atan(8.5 / 26.0)


def test_another_vessel_is_assessed_by_the_closed_form_alone_and_the_report_says_so(tmp_path):
    of = lift(tmp_path, other=True)
    assert looked_at(of) == []
    assert "closed-form-other-vessel" in {each["cause"] for each in remarks(of, of.environment.table())}
    result = plan(of, tier=Tier.CLOSED_FORM)
    assert "v_carrier" in {row["quantity"] for row in result.facts["rules"]["rows"]}


def test_with_transfer_functions_the_larger_of_both_speeds_counts(tmp_path):
    """The computed speed is of a linear motion: as high as the sea; that of EN 13852-1 saturates. Which of them is the
    larger depends on period and heading, and the larger is never below either."""
    of, plain = lift(tmp_path, other=True, table=OTHER), lift(tmp_path, other=True)
    seas = Seas(np.array([1.0, 2.0, 1.0, 4.0]), np.array([8.0, 8.0, 8.0, 8.0]), np.radians([180.0, 180.0, 90.0, 90.0]))
    computed = speed_against_deck(of, of.phases[0], seas, 1800.0)
    assert computed[1] == pytest.approx(2.0 * computed[0], rel=2e-3)
    with_both, table = (closed_form(x, x.phases[0], seas).values["v_carrier"] for x in (of, plain))
    assert with_both == pytest.approx(np.maximum(computed, table))
    assert with_both[3] > table[3]
    assert with_both[0] == table[0]
    assert of.digest != plain.digest


def test_the_report_has_both_speeds_and_the_other_vessel_among_its_inputs(tmp_path):
    of = lift(tmp_path, other=True, table=OTHER)
    result = plan(of, tier=Tier.CLOSED_FORM)
    facts = result.facts["other_vessel"]
    row = facts["rows"][0]
    assert len(row["v_computed"]) == len(row["v_table"]) == len(facts["Hs"])
    assert row["v_table"] != row["v_computed"]
    assert "other vessel" in {each["item"] for each in result.facts["inputs"]}
    assert "closed-form-other-vessel-moves" in {each["cause"] for each in remarks(of, of.environment.table())}
    assert any("Lift-off from another vessel" in section.title for section in document(result, {}).sections)
    assert "other_vessel" not in plan(lift(tmp_path, other=True), tier=Tier.CLOSED_FORM).facts


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("supply-vessel-82m", "supply-vessel-99m", "other_vessel.vessel"),
        ("x=-20 m, y=0 m", "x=-20 m", "other_vessel.at"),
        ('y=0 m"', 'y=0 m"\nheading = "400 deg"', "other_vessel.heading"),
        ('y=0 m"', 'y=0 m"\nposition = "x=1 m, y=2 m, z=3 m"', "other_vessel.position"),
        ('y=0 m"', 'y=0 m"\ndepth = "3 m"', "depth"),
    ],
)
def test_what_is_wrong_with_the_other_vessel_is_one_line(tmp_path, old, new, line):
    with pytest.raises(StillhookError, match=line) as problem:
        lift(tmp_path, other=True, table=OTHER.replace(old, new))
    assert "\n" not in str(problem.value)


def test_a_payload_on_the_own_deck_is_on_no_other_vessel(tmp_path):
    with pytest.raises(StillhookError, match=r'rigging\.carrier is "own-deck".*another-vessel'):
        lift(tmp_path, other=False, table=OTHER)
