"""Weights and rigging of a plan: build-up of the hook load, legs by statics, items, both weight cases, and mistakes in
one line."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.plan.manifold import manifold

from stillhook.errors import StillhookError
from stillhook.formats.lift.rigging_table import read_items
from stillhook.formats.lift_file import load_lift
from stillhook.library.catalogue import read_payload
from stillhook.physics.scalar import G
from stillhook.plan.assessments import rigging
from stillhook.plan.assessments.rigging.legs import Suspension, shares, usual_skew, worst
from stillhook.plan.definition.capacities import CAPACITIES
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.definition.weights import WeightTable, weight_of
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits, limited, limits_in
from stillhook.plan.planning import plan as planned
from stillhook.plan.report.document import write_answer
from stillhook.plan.result import load_plan_result
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.weight_cases import joined, lower_of
from stillhook.report.document import Document, Section, Table
from stillhook.report.html import html
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.rigging import Carrier, DAF_in_air, Leg, RiggingTable

EXACT = 1e-9
PRINTED = 1e-3  # check values have three or four digits
SEAS = """\
[environment]
Hs = "0.5 m to 3 m by 0.5 m"
Tp = ["6 s", "10 s"]
headings = ["180 deg"]

[[phase]]
name = "over the side"
kind = "in-air"

[[phase]]
name = "splash zone"
kind = "splash-zone"

[[phase]]
name = "down"
kind = "lowering"
depth = "100 m"
"""
GEAR = """\
[rigging]
height = "12 m"
points = ["x=5 m, y=4 m", "x=-5 m, y=4 m", "x=-5 m, y=-4 m", "x=5 m, y=-4 m"]
mass = "3 t"
tilt = "2 deg"

[[rigging.item]]
name = "sling"
kind = "sling"
MBL = "2000 kN"
factor = 3.0

[[rigging.item]]
name = "shackle"
kind = "shackle"
WLL = "35 t"
"""
WEIGHT = """\
[weight]
contingency = 1.05
cog_box = ["1 m", "0.6 m", "0.4 m"]
volume_high = "9 m^3"

"""


def written(folder: Path, *tables: str, name: str = "plan.toml") -> Path:
    path = folder / name
    path.write_text(manifold("none", start_depth="-7 m") + "\n".join((*tables, SEAS)), encoding="utf-8")
    return path


def four(theta: float, h: float = 12.0) -> Suspension:
    r = h / math.tan(theta)
    return Suspension([Leg(r * math.cos(a), r * math.sin(a)) for a in np.radians([40.0, 140.0, 220.0, 320.0])], h, 4.0)


class TestBuildUp:
    def test_the_static_hook_load_is_the_check_value(self, tmp_path):
        """SHL = W c + W_r + W_add: 120 t x 1.05 + 6 t = 132 t; times 1.12 147.8 t, times 1.25 165 t."""
        payload = load_plan("template-to-1500m").payload.model_copy(update={"mass": 120e3})
        table = WeightTable.model_validate({"contingency": 1.05})
        weight = weight_of(table, RiggingTable(mass="6 t"), payload, 1025.0)
        assert weight.SHL == pytest.approx(132e3)
        assert weight.SHL * DAF_in_air(weight.SHL, Carrier.OWN_DECK) == pytest.approx(147.8e3, rel=PRINTED)
        assert weight.SHL * DAF_in_air(weight.SHL, Carrier.VESSEL) == pytest.approx(165e3, rel=PRINTED)

    def test_trapped_water_weighs_in_air_and_nothing_in_water(self):
        payload = load_plan("template-to-1500m").payload
        gear, rho = RiggingTable(), 1025.0
        dry, wet = (weight_of(WeightTable.model_validate(t), gear, payload, rho) for t in ({}, {"trapped": "4 m^3"}))
        assert wet.SHL - dry.SHL == pytest.approx(4.0 * rho)
        assert wet.submerged == dry.submerged
        full, empty = wet.high_case, dry.high_case
        assert full.mass - rho * full.displaced == pytest.approx(empty.mass - rho * empty.displaced)

    def test_rigging_of_steel_keeps_seven_eighths_of_its_weight_in_water(self):
        weight = weight_of(None, RiggingTable(mass="8 t"), load_plan("template-to-1500m").payload, 1025.0)
        assert weight.rigging_submerged == pytest.approx(8e3 * (1.0 - 1025.0 / 7850.0))
        assert not weight.stated

    def test_the_low_case_is_as_far_below_as_the_contingency_is_above(self):
        payload = load_plan("template-to-1500m").payload
        weight = weight_of(WeightTable.model_validate({"contingency": 1.1}), RiggingTable(mass="8 t"), payload, 1025.0)
        assert weight.low_case.mass == pytest.approx(0.9 * payload.mass)
        assert weight.high_case.mass == pytest.approx(1.1 * payload.mass + 8e3)
        assert weight.low_case.displaced == pytest.approx(payload.displaced)

    @pytest.mark.parametrize("name", ["template-120t", "manifold-60t", "levels"])
    def test_added_mass_and_drag_stay_as_they_are(self, name):
        rows = [{"h": f"{h} m", "V": f"{2 * h} m^3", "A33": f"{9 * h} t", "A_p": "20 m^2"} for h in (0, 1, 4)]
        given = {"name": "box", "mass": "40 t", "height": "4 m", "C_D": 2.5, "levels": rows}
        payload = Payload(**given) if name == "levels" else read_payload(name)
        weight = weight_of(WeightTable.model_validate({"contingency": 1.2}), RiggingTable(), payload, 1025.0)
        for case in (weight.high_case, weight.low_case):
            assert case.covered().A33 == pytest.approx(payload.covered().A33)
            assert case.drag() == pytest.approx(payload.drag())

    def test_without_a_weight_nothing_changes(self, tmp_path):
        lift = load_plan(written(tmp_path))
        assert (lift.weight, lift.low) == (None, None)
        assert lift.gear == RiggingTable()

    def test_a_run_has_the_spring_of_the_rigging_and_no_more(self, tmp_path):
        sea = '[sea]\nwave = "jonswap Hs=1 m Tp=8 s"\nheading = "180 deg"\n'
        one = load_lift(written(tmp_path, GEAR, WEIGHT, sea)).lift
        other = load_lift(written(tmp_path, '[rigging]\nheight = "12 m"\n', sea)).lift
        assert one.rigging == other.rigging
        assert one.payload.mass == other.payload.mass


class TestAir:
    """0027/ND Rev 11 table 5-1."""

    @pytest.mark.parametrize(
        ("mass", "vessel", "deck"), [(50e3, 1.354, 1.141), (100e3, 1.25, 1.12), (300e3, 1.25, 1.12), (1e6, 1.20, 1.10)]
    )
    def test_factors_are_the_check_values(self, mass, vessel, deck):
        assert DAF_in_air(mass, Carrier.VESSEL) == pytest.approx(vessel, abs=5e-4)
        assert DAF_in_air(mass, Carrier.OWN_DECK) == pytest.approx(deck, abs=5e-4)

    @pytest.mark.parametrize("carrier", list(Carrier))
    def test_a_heavier_lift_has_no_larger_factor(self, carrier):
        factors = [DAF_in_air(m, carrier) for m in np.geomspace(1e3, 5e6, 200)]
        assert all(b <= a + EXACT for a, b in itertools.pairwise(factors))
        assert DAF_in_air(1e3, carrier) == DAF_in_air(3e3, carrier)

    def test_the_rule_takes_it_by_carrier_and_weight(self, tmp_path):
        def limit(*tables: str) -> float:
            lift = load_plan(written(tmp_path, *tables))
            rules = limited(lift, lift.phases[0], Alternative.NONE)
            return next(r.limit for r in rules if r.rule.key == "rigging-daf-air")

        mass = load_plan(written(tmp_path)).payload.mass
        assert limit() == pytest.approx(1.07 + 0.05 * math.sqrt(100e3 / mass))
        assert limit('[rigging]\ncarrier = "another-vessel"\n') == pytest.approx(1.0 + 0.25 * math.sqrt(100e3 / mass))
        assert limit("[rigging]\nDAF_air = 1.6\n") == 1.6
        assert limit('[rigging]\nmass = "20 t"\n') < limit()


class TestLegs:
    def test_determinate_and_indeterminate_legs_are_the_check_values(self):
        """1,450 kN, 62 deg: T = DHL/(4 sin th), with 1.25 513 kN."""
        theta = math.radians(62.0)
        share = shares(four(theta))
        assert share == pytest.approx(np.full(4, 1.0 / (4.0 * math.sin(theta))), rel=EXACT)
        assert usual_skew(4) * 1450e3 * share.max() == pytest.approx(513e3, rel=PRINTED)
        assert [usual_skew(n) for n in (2, 3)] == [1.0, 1.0]

    @pytest.mark.parametrize("n", [2, 3, 4])
    def test_legs_evenly_about_the_hook_share_the_load(self, n):
        gear = RiggingTable(legs=n, angle="55 deg", height="9 m")
        assert [gear.slope(end) for end in gear.ends] == pytest.approx([math.radians(55.0)] * n)
        even = 1.0 / (n * math.sin(math.radians(55.0)))
        assert shares(Suspension(gear.ends, 9.0, 3.0)) == pytest.approx(np.full(n, even), rel=1e-6)

    def test_a_pair_of_four_legs_carries_the_skew_load_factor_over_two(self):
        """As text has it: each pair of opposite legs carries 1.25/2 of the load."""
        theta = math.radians(50.0)
        T = usual_skew(4) * shares(four(theta))
        for pair in ((0, 2), (1, 3)):
            assert sum(T[i] * math.sin(theta) for i in pair) == pytest.approx(1.25 / 2.0)

    @settings(deadline=None, max_examples=60)
    @given(
        st.lists(st.tuples(st.floats(2.0, 8.0), st.floats(-0.5, 0.5)), min_size=3, max_size=4),
        st.floats(4.0, 20.0),
        st.floats(0.0, 6.0),
        st.floats(-0.5, 0.5),
        st.floats(-0.5, 0.5),
    )
    def test_forces_and_moments_balance(self, places, h, c, x, y):
        """Of the body: tensions of the legs at their lower ends, and its weight at the centre of gravity, which points
        from the hook to there; forces sum to nothing, and moments about the first lift point too."""
        n = len(places)
        turns = [2.0 * math.pi * k / n + off for k, (_, off) in enumerate(places)]
        ends = [Leg(r * math.cos(a), r * math.sin(a)) for (r, _), a in zip(places, turns, strict=True)]
        T = shares(Suspension(ends, h, c), x, y)
        P = np.array([[e.x, e.y, 0.0] for e in ends])
        hook, cog = np.array([0.0, 0.0, h]), np.array([x, y, -c])
        pull = np.array([t * (hook - p) / np.linalg.norm(hook - p) for t, p in zip(T, P, strict=True)])
        weight = (cog - hook) / np.linalg.norm(cog - hook)
        assert pull.sum(axis=0) + weight == pytest.approx(np.zeros(3), abs=1e-9)
        moments = np.cross(P - P[0], pull).sum(axis=0) + np.cross(cog - P[0], weight)
        assert moments == pytest.approx(np.zeros(3), abs=1e-8)

    def test_two_legs_balance_in_their_plane(self):
        suspension = Suspension([Leg(3.0, 0.0), Leg(-5.0, 0.0)], 8.0, 2.0)
        T = shares(suspension, 0.4, 0.7)
        hook = np.array([0.0, 8.0])
        pull = sum(
            t * (hook - np.array([e.x, 0.0])) / math.hypot(8.0, e.x) for t, e in zip(T, suspension.ends, strict=True)
        )
        weight = np.array([0.4, -10.0]) / math.hypot(0.4, 10.0)
        assert pull + weight == pytest.approx(np.zeros(2), abs=1e-12)
        assert T == pytest.approx(shares(suspension, 0.4, 0.0))

    def test_a_shift_and_a_tilt_load_the_leg_that_they_go_to(self):
        suspension = four(math.radians(60.0))
        centred = shares(suspension).max()
        box, tilted = (worst(suspension, b, tilt).shares.max() for b, tilt in (((1.0, 0.6, 0.5), 0.0), (None, 0.05)))
        both = worst(suspension, (1.0, 0.6, 0.5), 0.05)
        assert centred < min(box, tilted) < both.shares.max()
        assert not both.slack
        towards = np.argmax(shares(suspension, 0.5, 0.3))
        assert suspension.ends[towards].x > 0.0 < suspension.ends[towards].y


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return planned(written(tmp_path_factory.mktemp("rigging"), GEAR, WEIGHT), tier="closed-form")


@pytest.mark.slow
class TestAssessment:
    def test_legs_carry_the_largest_dynamic_hook_load(self, result):
        of = result.facts[rigging.NAME]
        legs, rows = of["legs"], of["hook_loads"]
        largest = max(rows, key=lambda row: row["dynamic"] or 0.0)
        assert (legs["DHL"], legs["phase"]) == (largest["dynamic"], largest["phase"])
        assert largest["dynamic"] == pytest.approx(largest["DAF"] * of["SHL"] * G)
        theta = math.atan2(12.0, math.hypot(5.0, 4.0))
        assert legs["T_even"] == pytest.approx(1.25 * legs["DHL"] / (4.0 * math.sin(theta)))
        assert legs["T_max"] > legs["T_even"]

    def test_items_are_used_by_their_rated_load(self, result):
        legs = result.facts[rigging.NAME]["legs"]
        sling, shackle = legs["items"]
        assert sling["utilisation"] == pytest.approx(legs["T_max"] * 3.0 / 2000e3)
        assert shackle["utilisation"] == pytest.approx(legs["T_max"] / (35e3 * G))
        assert legs["worst"]["name"] == max(legs["items"], key=lambda item: item["utilisation"])["name"]

    def test_the_tension_at_the_tip_is_within_the_capacity_in_the_seas_of_the_limit(self, result):
        """The rule on it is one of those that the limit is the lowest of."""
        used = [row["utilisation"] for row in result.facts[rigging.NAME]["hook_loads"]]
        assert max(used) <= 1.0 + PRINTED

    def test_static_loads_of_both_cases_differ_by_what_the_build_up_says(self, result):
        of = result.facts[rigging.NAME]
        air = next(row for row in of["hook_loads"] if row["medium"] == "air")
        assert air["static_high"] == pytest.approx(of["weight"]["SHL"] * G)
        assert air["static_low"] == pytest.approx(of["weight"]["low_air"] * G)
        water = next(row for row in of["hook_loads"] if row["medium"] == "water")
        assert water["static_high"] == pytest.approx(of["weight"]["submerged_high"] * G)
        assert water["static_low"] == pytest.approx(of["weight"]["submerged_low"] * G)

    def test_the_report_and_the_sheet_have_every_item(self, result, tmp_path):
        write_answer(result, tmp_path / "out")
        again = load_plan_result(tmp_path / "out")
        section = Section(rigging.TITLE, rigging.parts(again.facts))
        tables = [part for part in Document("", sections=[section]).parts if isinstance(part, Table)]
        assert any("shackle" in str(row) for table in tables for row in table.rows)
        assert "Hook load by phase" in html(Document("", sections=[section]))
        book = openpyxl.load_workbook(tmp_path / "out" / "rigging.xlsx")
        assert [cell.value for cell in book["rigging"]["A"]][-2:] == ["sling", "shackle"]
        read = read_items(tmp_path / "out" / "rigging.xlsx")
        assert [item.name for item in read] == ["sling", "shackle"]
        assert read[0].MBL == pytest.approx(2000e3, rel=1e-4)

    def test_a_plan_without_legs_says_that_nothing_is_assessed(self, tmp_path):
        result = planned(written(tmp_path), tier="closed-form")
        text = html(Document("", sections=[Section(rigging.TITLE, rigging.parts(result.facts))]))
        assert "slings, shackles and lift points are not assessed" in text
        assert "without contingency" in text


@pytest.mark.slow
class TestCases:
    def test_of_both_cases_the_lower_limit_counts_in_every_rule(self, tmp_path):
        path = written(tmp_path, GEAR, WEIGHT)
        lift = load_plan(path)
        result = planned(path, tier="closed-form")
        seas = lift.environment.table()
        for phase in lift.phases:
            both = [limits_in(case, closed_form(case, phase, seas)) for case in (lift, lift.low)]
            for rule in both[0].Hs:
                least = np.fmin(both[0].Hs[rule], both[1].Hs[rule])
                at = result.data["Hs_rule"].sel(
                    credit="twin", tier="closed-form", alternative="none", phase=phase.name, rule=rule
                )
                for T, b, Hs in zip(both[0].Tp, both[0].beta, least, strict=True):
                    shown = float(at.sel(period=T, heading=b, method="nearest"))
                    assert shown == pytest.approx(Hs, rel=1e-12, nan_ok=True)
        slack = [row for row in result.facts[rigging.NAME]["cases"]["low_governs"] if row["rule"] == "slack-sling"]
        assert any(row["phase"] == "splash zone" for row in slack)

    def test_a_lighter_load_falls_slack_in_lower_seas_and_loads_the_crane_less(self, tmp_path):
        lift = load_plan(written(tmp_path, GEAR, WEIGHT))
        phase = lift.phase("splash zone")
        high, low = (limits_in(c, closed_form(c, phase, c.environment.table())).Hs for c in (lift, lift.low))
        assert (low["slack-sling"] < high["slack-sling"]).all()
        assert (low["dynamic-load"] >= high["dynamic-load"]).all()

    def test_the_design_factor_of_the_rigging_is_over_the_weight_of_the_high_case(self, tmp_path):
        lift = load_plan(written(tmp_path, GEAR, WEIGHT))
        assert lift.low.of_high is lift
        weight = CAPACITIES["payload_weight"].find
        assert weight(lift.low, lift.phases[0], Alternative.NONE).value == pytest.approx(lift.payload.mass * G)

    def test_limits_of_columns_of_either_case_are_joined(self):
        def of(Tp, Hs, rule):
            values = np.array(Hs)
            return Limits("deep", Alternative.NONE, Tier.TIME, np.array(Tp), np.zeros(len(Tp)), {rule: values})

        both = lower_of(of([5.0, 6.0], [2.0, np.inf], "slack-sling"), of([6.0, 7.0], [1.5, np.nan], "slack-sling"))
        assert both.Tp.tolist() == [5.0, 6.0, 7.0]
        assert both.Hs["slack-sling"].tolist()[:2] == [2.0, 1.5]
        assert both.low_weight["slack-sling"].tolist() == [False, True, False]
        other = lower_of(of([5.0], [2.0], "dynamic-load"), of([5.0], [1.0], "slack-sling"))
        assert (other.Hs["dynamic-load"][0], other.Hs["slack-sling"][0]) == (2.0, 1.0)


def case_of(high: bool, Hs: list[float], values: dict[str, list[float]]) -> Demand:
    """Runs of one column, or of the low case in it."""
    seas = Seas(np.array(Hs), np.full(len(Hs), 8.0), np.zeros(len(Hs)))
    seeds = np.full(len(Hs), 16 if high else 8)
    of = {q: np.array(x) for q, x in values.items()}
    return Demand("splash zone", Alternative.NONE, Tier.TIME, seas, of, of, of, seeds)


def test_runs_of_both_cases_are_one_demand_in_which_each_judges_what_it_governs():
    high = case_of(True, [1.0, 2.0], {"DAF": [1.2, 1.5], "sling_ratio": [0.5, 0.2]})
    both = joined(high, case_of(False, [1.5], {"sling_ratio": [0.1]}))
    assert both.seas.Hs.tolist() == [1.0, 2.0, 1.5]
    assert np.array_equal(both.values["DAF"], [1.2, 1.5, math.nan], equal_nan=True)
    assert np.array_equal(both.values["sling_ratio"], [math.nan, math.nan, 0.1], equal_nan=True)
    assert both.seeds.tolist() == [16, 16, 8]
    elsewhere = case_of(False, [1.5], {"sling_ratio": [0.1]})
    elsewhere = joined(high, replace(elsewhere, seas=replace(elsewhere.seas, Tp=np.array([9.0]))))
    assert elsewhere.values["sling_ratio"].tolist() == [0.5, 0.2, 0.1]


THROUGH = """\
[environment]
Hs = "0.5 m to 4 m by 0.5 m"
Tp = ["8 s"]
headings = ["180 deg"]

[[phase]]
name = "splash zone"
kind = "splash-zone"
hold = "off"
"""


@pytest.mark.long
def test_the_twin_runs_the_low_case_where_slack_governs(tmp_path):
    """Its limit is that of the low case as a plan of its own: the same seas, the same runs."""
    text = manifold("none", start_depth="-1 m") + "\n".join((GEAR, WEIGHT, THROUGH))
    (tmp_path / "both.toml").write_text(text, encoding="utf-8")
    lift = load_plan(tmp_path / "both.toml")
    both, low = (planned(case, tier="time") for case in (lift, replace(lift.low, weight=None, high=None)))

    def limit(result, rule):
        return float(result.data["Hs_rule"].sel(credit="twin", tier="time", rule=rule).squeeze())

    cases = both.facts[rigging.NAME]["cases"]
    assert cases["runs_low"] > 0
    assert any(row["tier"] == "time" and row["rule"] == "slack-sling" for row in cases["low_governs"])
    assert limit(both, "slack-sling") == pytest.approx(limit(low, "slack-sling"), rel=EXACT)
    assert limit(both, "snap-load") < math.inf  # of the high case: the low one is within it up to the highest sea


ITEM = '[[rigging.item]]\nname = "sling"\n'
LEGS = '[rigging]\nlegs = 4\nangle = "60 deg"\n'


@pytest.mark.parametrize(
    ("tables", "texts"),
    [
        ((LEGS.replace("60", "0"),), ["rigging", "angle 0 deg is not between 20 deg and 89 deg"]),
        ((LEGS.replace("60", "90"),), ["rigging", "angle 90 deg is not between"]),
        ((LEGS.replace("60 deg", "1.05"),), ["rigging.angle", "no unit"]),
        ((LEGS.replace("legs = 4", "legs = 5"),), ["rigging.legs = 5", "4"]),
        ((LEGS.replace("legs = 4", "legs = 1"),), ["rigging.legs = 1", "2"]),
        (("[rigging]\nlegs = 3\n",), ["rigging", "not how they hang"]),
        (('[rigging]\nangle = "60 deg"\n',), ["rigging", "Give legs, 2 to 4"]),
        ((LEGS + 'points = ["x=1 m, y=0 m"]\n',), ["rigging", "angle and points are both given"]),
        (('[rigging]\npoints = ["x=1 m, y=0 m"]\n',), ["rigging", "points: 1 are given"]),
        (('[rigging]\npoints = ["x=3 m, y=0 m", "x=9 m, y=0 m"]\n',), ["rigging", "not above their base"]),
        (('[rigging]\npoints = ["x=3 m, y=0 m", "x=-3 t, y=0 m"]\n',), ["rigging", "points", "unit"]),
        ((LEGS, ITEM), ['item "sling": WLL is missing']),
        ((LEGS, ITEM + 'MBL = "200 t"\n'), ['item "sling": MBL and factor are given together']),
        ((LEGS, ITEM + 'WLL = "200 m"\n'), ["WLL", "write a mass or a force"]),
        (('[rigging]\nheight = "10 m"\n', ITEM + 'WLL = "55 t"\n'), ["rigging", "not the legs"]),
        (("[weight]\ncontingency = 0.95\n",), ["weight.contingency = 0.95", "1"]),
        (('[weight]\nnet = "60"\n',), ["weight.net", "no unit"]),
        ((LEGS, '[weight]\ncog_box = ["40 m", "1 m", "1 m"]\n'), ["weight.cog_box: 40 m along x"]),
        (('[weight]\ncog_box = ["1 m", "1 m"]\n',), ["weight.cog_box"]),
        (
            ('[weight]\nvolume_low = "9 m^3"\nvolume_high = "8 m^3"\n',),
            ["weight.volume_low", "is more than volume_high"],
        ),
        (('[weight]\nvolume_high = "70 m^3"\n',), ["it floats, or nearly"]),
        (('[rigging]\nmass = "1 t"\nmass_submerged = "2 t"\n',), ["rigging", "mass_submerged is more than mass"]),
        (("[capacity]\ndynamic_factor = 1.3\n",), ["capacity.statement: missing"]),
    ],
)
def test_a_mistake_is_one_line(tables, texts, tmp_path):
    with pytest.raises(StillhookError) as caught:
        load_plan(written(tmp_path, *tables))
    text = str(caught.value)
    assert "\n" not in text
    for part in texts:
        assert part in text, text


class TestSheet:
    def read(self, tmp_path, text):
        (tmp_path / "rigging.csv").write_text(text, encoding="utf-8")
        return read_items(tmp_path / "rigging.csv")

    def test_a_planners_sheet_is_read_in_tonnes_and_kilonewtons(self, tmp_path):
        rows = "Component;Type;WLL (t);MBL [kN];Factor [1];Certificate\n"
        rows += (
            "Sling 13,6 m;Sling;;2400;3;C-17\nShackle;shackles;55,5;;;\nRing;Master link;120;;;\nEye;Padeyes;100;;;\n"
        )
        sling, shackle, ring, eye = self.read(tmp_path, rows)
        assert (sling.name, sling.MBL, sling.factor, sling.source) == ("Sling 13,6 m", 2400e3, 3.0, "C-17")
        assert eye.name == "Eye"
        assert shackle.WLL == pytest.approx(55.5e3 * G)
        assert not ring.kind.of_leg
        assert eye.kind == "lift-point"

    @pytest.mark.parametrize(
        ("text", "parts"),
        [
            ("kind,WLL [t]\nsling,5\n", ["rigging.csv", "no column", "item"]),
            ("item,kind\nsling,sling\n", ["no column", "WLL"]),
            ("item,WLL\nsling,5\n", ['column "WLL" has no unit']),
            ("item,WLL [m]\nsling,5\n", ['unit "m" is not one of']),
            ("item,WLL [t]\nsling,5\nshackle,\n", ["row 3", 'item "shackle": WLL is missing']),
            ("item,kind,WLL [t]\nsling,rope,5\n", ["row 2", 'kind "rope" is not one of sling, shackle']),
            ("item,WLL [t]\nsling,five\n", ["five", "finite number"]),
        ],
    )
    def test_a_mistake_names_its_row(self, text, parts, tmp_path):
        with pytest.raises(StillhookError) as caught:
            self.read(tmp_path, text)
        assert "\n" not in str(caught.value)
        for part in parts:
            assert part in str(caught.value), str(caught.value)

    def test_a_plan_names_the_sheet(self, tmp_path):
        (tmp_path / "gear.csv").write_text("item,WLL [t]\nsling,50\n", encoding="utf-8")
        lift = load_plan(written(tmp_path, LEGS + 'items = "gear.csv"\n'))
        assert [item.name for item in lift.gear.item] == ["sling"]
        with pytest.raises(StillhookError, match="no such file next to this file"):
            load_plan(written(tmp_path, LEGS + 'items = "other.csv"\n'))


class TestCapacity:
    CHART = "radius [m],SWL [t],DAF [1]\n10,240,1.3\n30,140,1.3\n"
    TABLE = '[load_chart]\nfile = "chart.csv"\npedestal = "x=-15 m, y=-9 m"\n'

    def dynamic(self, folder, *tables, chart=CHART):
        (folder / "chart.csv").write_text(chart, encoding="utf-8")
        lift = load_plan(written(folder, *tables))
        find = (CAPACITIES[name].find for name in ("SWL_dynamic", "SWL_tip"))
        high, rated = (f(lift, lift.phases[0], Alternative.NONE) for f in find)
        return high.value / rated.value, high.basis

    def test_a_static_chart_is_multiplied_by_its_factor_and_a_dynamic_one_is_not(self, tmp_path):
        assert self.dynamic(tmp_path, self.TABLE)[0] == pytest.approx(1.3)
        factor, basis = self.dynamic(tmp_path, self.TABLE + 'type = "dynamic"\n')
        assert (factor, basis.endswith("the chart is dynamic")) == (1.0, True)

    def test_a_chart_without_factors_takes_a_statement(self, tmp_path):
        plain = self.CHART.replace(",DAF [1]", "").replace(",1.3", "")
        stated = '[capacity]\ndynamic_factor = 1.2\nstatement = "manual 4.2"\n'
        assert self.dynamic(tmp_path, self.TABLE, chart=plain)[0] == 1.0
        factor, basis = self.dynamic(tmp_path, self.TABLE, stated, chart=plain)
        assert (factor, "manual 4.2" in basis) == (pytest.approx(1.2), True)
        with pytest.raises(StillhookError, match="capacity: the load chart has dynamic factors"):
            self.dynamic(tmp_path, self.TABLE, stated)

    def test_what_states_a_capacity_is_part_of_what_an_answer_follows_from(self, tmp_path):
        lift = load_plan(written(tmp_path))
        stated = load_plan(written(tmp_path, '[capacity]\ndynamic_factor = 1.2\nstatement = "manual"\n'))
        assert stated.digest != lift.digest
        assert replace(lift, statement=stated.statement).statement is stated.statement
