"""Lift-off from a barge and set-down on a platform: the second hit, impact, the ramp, and compensation against a deck."""

import math

import numpy as np
import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.errors import StillhookError
from stillhook.plan.assessments.failures.bands import without_ahc
from stillhook.plan.definition.capacities import springs
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Seas, Tier
from stillhook.plan.limits import limits_in
from stillhook.plan.planning import plan
from stillhook.plan.report.document import document
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.other_vessel import come_back, deck_speed, hook_on_deck, largest, relative_speed, risen
from stillhook.plan.tiers.situations import looked_at

SEAS = """\
[environment]
Hs = "0.5 m to 4 m by 0.5 m"
Tp = ["8 s"]
headings = ["{heading} deg"]

[operation]
T_POP = "8 h"

"""
OFF = '[[phase]]\nname = "off"\nkind = "lift-off-barge"\nspeed = "30 m/min"\n'
ON = '[[phase]]\nname = "on"\nkind = "set-down-platform"\ndepth = "-9 m"\n'
AIR = '[[phase]]\nname = "over"\nkind = "in-air"\ndepth = "-20 m"\n'
CARRIER = '[rigging]\ncarrier = "another-vessel"\n\n'
AHC, TO_DECK = 'mode = "ahc"\n', 'mode = "ahc"\nreference = "deck"\n'


def other(vessel: str = "supply-vessel-82m", at: str = "x=-20 m, y=0 m", more: str = "") -> str:
    return f'[other_vessel]\nvessel = "{vessel}"\nat = "{at}"\n{more}\n'


def lift(folder, phases: str, *, table: str = "", heading: float = 180.0, carrier: str = CARRIER) -> LiftPlan:
    head = manifold("none", "cap-80", start_depth="-10 m")
    return loaded(folder, head + carrier + table + SEAS.format(heading=f"{heading:g}") + phases)


def seas(heading: float = 180.0, Tp: float = 8.0) -> Seas:
    Hs = np.array([0.5, 1.0, 2.0])
    return Seas(Hs, np.full(3, Tp), np.full(3, math.radians(heading)))


def test_the_same_vessel_at_the_same_place_does_not_move_against_itself(tmp_path):
    """The deck is part of the crane vessel below the tip: no relative motion in any direction, and no tilt but its own
    roll and pitch."""
    table = other("construction-vessel-130m", "x=-15 m, y=-24 m", 'position = "x=0 m, y=0 m"\n')
    of = lift(tmp_path, OFF, table=table, heading=90.0)
    assert np.abs(hook_on_deck(of, of.phases[0], seas(90.0))).max() < 1e-12
    values = closed_form(of, of.phases[0], seas(90.0)).values
    assert (values["rise_ratio"] == 0.0).all()
    assert values["z_rel"] == pytest.approx(np.zeros(3), abs=1e-9)
    assert (
        values["v_carrier"] == relative_speed(seas().Hs, values["v_tip_max"])
    ).all()  # the table's is then the larger
    assert (values["x_rel"] > 0.0).all()  # tip and deck are at different heights, and the vessel rolls between them


def test_two_vessels_far_apart_in_long_waves_move_as_the_wave_says(tmp_path):
    """Waves of 10 s lift both alike: apart by half a wavelength along the waves they move against each other twice
    as much as one of them, apart by a whole one not at all."""
    k = (2.0 * math.pi / 10.0) ** 2 / 9.80665
    half = math.pi / k
    at = {}
    for share in (0.0, 1.0, 2.0):
        place = f'position = "x={share * half:.3f} m, y=0 m"\n'
        of = lift(tmp_path, OFF, table=other("construction-vessel-130m", "x=-15 m, y=-24 m", place))
        assert of.against is not None
        omega, beta = np.array([2.0 * math.pi / 10.0]), np.array([math.pi])
        at[share] = abs(of.against.vertical(omega, beta, -15.0, -24.0)[0, 0])
    tip = abs(of.vessel.vertical(omega, beta, -15.0, -24.0)[0, 0])
    assert at[0.0] == pytest.approx(0.0, abs=1e-12)
    assert at[1.0] == pytest.approx(2.0 * tip, rel=1e-5)
    assert at[2.0] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(("eta", "T", "V"), [(1.0, 8.0, 0.2), (1.0, 8.0, 0.5), (0.4, 5.0, 0.5), (0.4, 5.0, 0.51)])
def test_the_second_hit_of_a_sine_is_what_stepping_through_all_instants_gives(eta, T, V):
    omega = 2.0 * math.pi / T
    t = np.linspace(0.0, 3.0 * T, 24001)
    d = V * t + eta * np.sin(omega * t)  # height of the hook over the deck
    back = float((np.maximum.accumulate(d) - d).max())
    assert float(come_back(eta, omega, V)) == pytest.approx(back, abs=2e-5 * eta)
    assert (back < 1e-6) == (eta * omega <= V)


@pytest.mark.parametrize(("eta", "T"), [(1.0, 8.0), (0.3, 5.0)])
def test_from_one_period_on_the_payload_is_clear_where_the_rule_says_so(tmp_path, eta, T):
    """Lifted off at any instant of a sine, at the speed at which twice the amplitude is the rise of one period: never
    below the deck from then on; at EN's K_H of 0.5 it rises by pi amplitudes, 1.57 times as much."""
    omega, V = 2.0 * math.pi / T, 2.0 * eta / T
    t = np.linspace(0.0, 4.0 * T, 4001)
    start = np.linspace(0.0, T, 101)[:, None]
    gained = V * t + eta * (np.sin(omega * (start + t)) - np.sin(omega * start))
    assert gained[:, t >= T].min() >= -1e-12
    assert gained[:, t < T].min() < 0.0  # within the first period it is hit: the rule does not say that it is not
    assert 0.5 * eta * omega * T / (2.0 * eta) == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize(("Hs", "T", "rise"), [(1.4, 4.9, 2.19), (2.7, 5.7, 4.31), (3.6, 6.4, 5.96)])
def test_the_rise_in_one_period_is_that_of_a_public_case(tmp_path, Hs, T, rise):
    """ckunte.net "Offshore crane" (2016): hoisting speed of EN 13852-1 at K_H 0.5 times the period, North West Shelf."""
    long = '[[phase]]\nname = "off"\nkind = "lift-off-barge"\ndepth = "-20 m"\nspeed = "{v} m/s"\n'
    V = 0.5 * float(deck_speed(Hs))
    of = lift(tmp_path, long.format(v=repr(V)), table=other())
    assert float(risen(of.phases[0], np.array([T]))[0]) == pytest.approx(rise, abs=0.006)
    assert rise > Hs


def test_limits_of_the_second_hit_and_of_the_hoisting_speed_are_where_the_demand_meets_them(tmp_path):
    of = lift(tmp_path, OFF, table=other(), heading=90.0)
    phase, table = of.phases[0], of.environment.table()
    limits = limits_in(of, closed_form(of, phase, table)).Hs
    Hs = float(limits["second-hit"][0])
    z = largest(hook_on_deck(of, phase, Seas(np.array([Hs]), np.full(1, 8.0), np.full(1, math.pi / 2.0))), 1800.0)[0]
    sigmas = hook_on_deck(of, phase, table)[:, 0]
    period = 2.0 * math.pi * sigmas[0] / sigmas[1]
    assert 2.0 * z[0] == pytest.approx(min(0.5 * period, 3.0), rel=2e-3)
    assert 0.0 < float(limits["hoisting-speed"][0]) < Hs


def test_the_load_is_taken_up_as_a_mass_on_a_spring_that_is_pulled(tmp_path):
    """W + v sqrt(K M) against the motion of a payload on a spring whose end rises steadily, stepped in time."""
    of = lift(tmp_path, OFF, table=other(), heading=90.0)
    values = closed_form(of, of.phases[0], seas(90.0)).values
    K, m = max(springs(of, of.phases[0]))
    v = float(values["v_carrier"][2]) + of.phases[0].speed
    dt, z, rate, F, most, W = 1e-5, 0.0, 0.0, 0.0, 0.0, m * 9.80665
    for i in range(200_000):
        F = K * (v * i * dt - z)
        lifted = F > W or z > 0.0
        rate += dt * (F - W) / m if lifted else 0.0
        z += dt * rate
        most = max(most, F)
    assert most - W == pytest.approx(v * math.sqrt(K * m), rel=1e-3)
    own = lift(tmp_path, OFF.replace("-barge", ""), carrier="")
    calm = closed_form(own, own.phases[0], seas(90.0)).values
    assert float((values["F_top_max"] - calm["F_top_max"])[2]) == pytest.approx(
        (v - of.phases[0].speed) * math.sqrt(K * m), rel=1e-9
    )


def test_a_set_down_on_a_fixed_platform_is_hit_at_the_speed_of_the_tip_and_of_lowering(tmp_path):
    of = lift(tmp_path, AIR + ON, carrier="", heading=90.0)
    values = closed_form(of, of.phases[1], seas(90.0)).values
    assert values["v_landed"] - of.phases[1].speed == pytest.approx(values["v_tip_max"], rel=1e-12)
    assert values["z_rel"] == pytest.approx(values["s_tip_pp"] / 2.0, rel=1e-12)
    assert (values["deck_tilt"] == 0.0).all()
    assert "rise_ratio" not in values
    Hs = float(limits_in(of, closed_form(of, of.phases[1], of.environment.table())).Hs["deck-motion"][0])
    z = np.interp(Hs, of.environment.Hs, closed_form(of, of.phases[1], of.environment.table()).values["z_rel"])
    assert z == pytest.approx(0.75, rel=5e-3)


def test_a_payload_that_the_deck_falls_away_from_is_taken_up_again_unless_the_wire_is_paid_out_faster(tmp_path):
    slow, fast = (
        lift(tmp_path, AIR + ON + f'speed = "{v}"\n', carrier="", heading=90.0) for v in ("3 m/min", "200 m/min")
    )
    a, b = (closed_form(of, of.phases[1], seas(90.0)).values for of in (slow, fast))
    assert (a["v_landed"] < b["v_landed"]).all()
    assert (a["F_top_max"] > b["F_top_max"]).all()


@pytest.mark.long
@pytest.mark.parametrize("kind", ["off", "on"])
def test_compensation_against_the_deck_leaves_a_fifth_and_against_the_earth_the_decks_motion(tmp_path, kind):
    def of(how: str) -> tuple[LiftPlan, dict[str, np.ndarray]]:
        phases = OFF + how if kind == "off" else AIR + ON + 'deck = "other-vessel"\n' + how
        plan_ = lift(tmp_path, phases, table=other(), heading=90.0)
        return plan_, dict(closed_form(plan_, plan_.phases[-1], seas(90.0), Alternative.CAP).values)

    (plain, none), (_, earth), (_, deck) = of(""), of(AHC), of(TO_DECK)
    assert deck["z_rel"] == pytest.approx(0.2 * none["z_rel"], rel=1e-12)
    assert (earth["z_rel"] > deck["z_rel"]).all()
    tip = none["s_tip_pp"] / 2.0
    assert (earth["z_rel"] < none["z_rel"] + 0.8 * tip + 1e-9).all()  # whatever the phase of what the winch leaves
    assert deck["x_rel"] == pytest.approx(none["x_rel"])  # a winch does nothing sideways
    assert (deck["v_w_demand"] > none["v_w_demand"]).all()
    assert (deck["load_pp"] > 0.0).all()  # it follows the deck, and with that moves in the air
    lost = closed_form(plain, plain.phases[-1], seas(90.0), Alternative.NONE).values
    assert lost["z_rel"] == pytest.approx(none["z_rel"])


def test_compensation_that_is_lost_at_a_deck_is_in_the_limit_without_it(tmp_path):
    """Page 1 says up to which sea loads stay within limits with AHC lost: not more than the lift-off without it."""
    of = lift(tmp_path, OFF.replace("30 m", "6 m") + TO_DECK, table=other(), heading=90.0)
    lost = without_ahc(of, [], [], np.zeros(1), 0.0, fast=False)["steady"]["loads"]
    assert lost["phase"] == "off"
    limits = limits_in(of, closed_form(of, of.phases[0], of.environment.table())).Hs
    assert lost["Hs_from"] == min(float(x[0]) for x in limits.values())
    credited = limits_in(of, closed_form(of, of.phases[0], of.environment.table(), Alternative.CAP)).Hs
    assert min(float(x[0]) for x in credited.values()) > lost["Hs_from"]


def test_a_plan_from_barge_to_platform_names_its_criteria_and_shows_both_speeds(tmp_path):
    of = lift(tmp_path, OFF + TO_DECK + AIR + ON, table=other())
    assert [phase.name for phase, _ in looked_at(of)] == ["over"]
    result = plan(of, tier=Tier.CLOSED_FORM)
    keys = {row["key"] for row in result.facts["rules"]["rows"]}
    assert {"second-hit", "hoisting-speed", "impact-speed", "deck-motion", "deck-offset", "deck-tilt"} <= keys
    facts = result.facts["other_vessel"]
    assert [row["phase"] for row in facts["rows"]] == ["off", "on"]
    off, on = facts["rows"]
    assert off["v_credited"] == pytest.approx([0.2 * v for v in off["v_computed"]])
    assert "v_table" not in on
    assert off["z_back"][-1] > off["z_back"][0] >= 0.0
    (taken,) = facts["taken_up"]
    assert taken["ramp"] == pytest.approx(taken["stretch"] / 0.5)
    text = str([section for section in document(result, {}).sections if "set-down on a deck" in section.title])
    assert "Second hit and clearance after lift-off" in text


@pytest.mark.parametrize(
    ("phases", "table", "carrier", "line"),
    [
        (OFF, "", CARRIER, "other_vessel: missing"),
        (AIR + ON + 'deck = "other-vessel"\n', "", "", "other_vessel: missing"),
        (OFF, other(), "", r'rigging\.carrier is "own-deck"'),
        (OFF + 'deck = "fixed"\n', other(), CARRIER, "deck belongs to set-down-platform"),
        (OFF + 'reference = "deck"\n', other(), CARRIER, "reference belongs to lift-off-barge"),
        (AIR + 'reference = "earth"\n', "", "", "reference belongs to lift-off-barge"),
        (OFF + 'mode = "landing"\n', other(), CARRIER, "lift-off-barge has one of manual, ahc"),
        (AIR + ON.replace('depth = "-9 m"\n', ""), "", "", "depth: missing"),
        (AIR + ON.replace("-9 m", "-30 m"), "", "", "it goes down"),
        (AIR + ON + 'deck = "jacket"\n', "", "", "deck"),
    ],
)
def test_what_is_wrong_with_a_deck_is_one_line(tmp_path, phases, table, carrier, line):
    with pytest.raises(StillhookError, match=line) as problem:
        lift(tmp_path, phases, table=table, carrier=carrier)
    assert "\n" not in str(problem.value)


def test_a_set_down_on_another_vessel_needs_no_other_carrier(tmp_path):
    of = lift(tmp_path, AIR + ON + 'deck = "other-vessel"\n', table=other(), carrier="")
    values = closed_form(of, of.phases[1], seas()).values
    assert (values["v_landed"] > of.phases[1].speed + values["v_tip_max"]).all()
    assert (values["deck_tilt"] > 0.0).all()
