"""Closed form, capacities and credit on the example: limits, signs, and agreement with other roads."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stillhook.analysis.steady.limits import Direction, Station
from stillhook.engine.simulate import simulate
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import CAPACITIES, at_rest, calm, jerk, static_tension
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative, Seas
from stillhook.plan.file import load_plan
from stillhook.plan.limits import limited, limits_of
from stillhook.plan.table import inside
from stillhook.plan.tiers.closed_form import closed_form, remarks, valid, way
from stillhook.plan.tiers.frequency import frequency
from stillhook.plan.tiers.time_domain.lowering import SeaState, course_of, in_sea, lowering_of, machine_of, winch_of
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.spec.scenario import Mode
from stillhook.spec.validity import CAP

pytestmark = pytest.mark.slow

HEAD = math.pi
SPECTRA = 0.005  # deviations from spectra sampled alike; largest values from the same periods
ONE_PERIOD = 0.12  # a harmonic at the mean period in place of a spectrum, far above the load's natural period

HEIGHTS = np.array([0.0, 0.5, 1.0, 2.0, 3.0, 4.0])
SEAS = Seas(HEIGHTS, np.full(6, 9.0), np.full(6, HEAD))


@pytest.fixture(scope="module")
def plan():
    """The example, of a crane without any certificate."""
    found = load_plan("template-to-1500m")
    return replace(found, crane=found.crane.model_copy(update={"certified": None}), credits_synthetic=False)


def of_kind(plan, kind):
    return next(p for p in plan.phases if p.kind is kind)


def with_seabed(plan):
    """The phase of lifting off the seabed, which the example does not have."""
    return Phase(
        name="up", kind="seabed-lift-off", start_depth="1500 m", depth="1499 m", speed="12 m/min", planned="60 s"
    )


def test_a_calm_asks_what_hangs_there_at_rest(plan):
    for phase in (*plan.phases, with_seabed(plan)):
        still, found = calm(plan, phase), closed_form(plan, phase, SEAS).values
        for quantity, value in found.items():
            if quantity == "snap_load" or (
                phase.kind is PhaseKind.SPLASH and quantity not in ("F_top_static", "v_tip_max")
            ):
                continue  # through still water the payload is lowered, and that has drag
            assert float(value[0]) == pytest.approx(still[quantity], rel=1e-3, abs=1e-9), (phase.name, quantity)


def test_more_sea_asks_for_more_in_every_phase(plan):
    for phase in plan.phases:
        for quantity, value in closed_form(plan, phase, SEAS).values.items():
            rising = -value if quantity == "sling_ratio" else value
            assert (np.diff(rising) >= -1e-9 * np.abs(value).max()).all(), (phase.name, quantity)


def test_the_cap_leaves_a_fifth_of_the_motion_and_changes_nothing_where_nothing_follows(plan):
    deep, splash = of_kind(plan, PhaseKind.DEEP), of_kind(plan, PhaseKind.SPLASH)
    none, cap, twin = (
        closed_form(plan, deep, SEAS, a).values for a in (Alternative.NONE, Alternative.CAP, Alternative.SSC)
    )
    assert cap["e_c_pp"] == pytest.approx((1.0 - CAP) * none["e_c_pp"])
    assert (cap["F_top_max"][1:] < none["F_top_max"][1:]).all()
    assert cap["v_w_demand"] == pytest.approx(none["v_w_demand"])  # what the winch follows is all of the tip's motion
    assert all(twin[q] is cap[q] for q in cap)
    assert (
        closed_form(plan, splash, SEAS, Alternative.CAP).values
        is closed_form(plan, splash, SEAS, Alternative.NONE).values
    )


def test_a_winch_that_stands_leaves_all_of_the_tip_s_motion_and_the_cap_a_fifth(plan):
    """Wire and load then move with the tip, crest to trough: the control error has its height, and its seas."""
    deep = of_kind(plan, PhaseKind.DEEP)
    stands, cap = (closed_form(plan, deep, SEAS, a).values for a in (Alternative.NONE, Alternative.CAP))
    assert stands["s_tip_pp"][1:].min() > 0.0
    assert stands["e_c_pp"] == pytest.approx(stands["s_tip_pp"])
    assert cap["e_c_pp"] == pytest.approx((1.0 - CAP) * stands["s_tip_pp"])


def test_the_method_is_valid_between_the_steepest_waves_and_long_ones(plan):
    seas = Seas(np.array([0.0, 2.0, 6.0, 2.0, 2.0]), np.array([5.0, 9.0, 6.0, 4.0, 25.0]), np.full(5, HEAD))
    assert valid(plan, seas).tolist() == [True, True, False, False, False]
    (found,) = (each for each in remarks(plan, seas) if each["cause"] == "closed-form-range")
    assert (found["n"], found["of"], found["phases"]) == (3, 5, ["splash zone"])


def test_what_a_reader_should_know_is_a_cause_each_with_the_phases_that_it_is_of(plan):
    phases = {each["cause"]: each["phases"] for each in remarks(plan, SEAS)}
    assert phases["closed-form-twin"] == ["lower water", "deep", "landing, held", "landing"]
    assert "closed-form-twin" not in {
        e["cause"] for e in remarks(replace(plan, alternatives=(Alternative.NONE,)), SEAS)
    }


def test_the_way_ends_where_the_statics_of_a_lowering_are(plan):
    landing = of_kind(plan, PhaseKind.LANDING)
    found = way(plan, landing)
    assert float(found.F_top.max()) == pytest.approx(static_tension(plan, landing))
    assert float(found.W[-1, 0]) == pytest.approx((plan.payload.mass - plan.rho * plan.payload.displaced) * G)
    wire = plan.crane.wire.mass_per_length * G * 1500.0
    assert static_tension(plan, landing) < plan.payload.mass * G + plan.crane.hook_mass * G + wire


def test_slamming_on_the_way_sums_up_to_the_added_mass(plan):
    found = way(plan, of_kind(plan, PhaseKind.SPLASH))
    z, slope = found.z[:, 0], found.dA33[:, 0]
    A33 = plan.payload.covered(plan.rho).A33
    assert -np.trapezoid(slope, z) == pytest.approx(A33, rel=0.03)  # slopes at 0.05 m, the steeper side at every kink


def test_tip_and_load_move_as_on_the_frequency_domain_method_where_the_wire_is_stiff_to_the_waves(plan):
    deep = of_kind(plan, PhaseKind.DEEP)
    seas = Seas(np.array([1.0, 1.0]), np.array([12.0, 14.0]), np.full(2, HEAD))
    spectral = frequency(replace(plan, phases=(deep,)), [Alternative.NONE], seas)[0].values
    sheet = closed_form(plan, deep, seas).values
    for quantity in ("v_tip_max", "s_tip_pp"):
        assert sheet[quantity] == pytest.approx(spectral[quantity], rel=SPECTRA)
    assert sheet["load_pp"] == pytest.approx(spectral["load_pp"], rel=ONE_PERIOD)


def test_through_the_surface_the_method_lies_on_the_safe_side_of_every_seed_of_the_twin(plan):
    splash, none = of_kind(plan, PhaseKind.SPLASH), Alternative.NONE
    winch = winch_of(splash, none)
    course, (crane, mode) = course_of(plan, splash, winch), machine_of(plan, winch)
    calm_run = lowering_of(plan, splash, course, mode)
    cases = [in_sea(plan, splash, winch, course, calm_run, SeaState(1.5, 9.0, HEAD), seed) for seed in range(1, 4)]
    runs = simulate(crane, cases, threads=2)
    found = closed_form(plan, splash, Seas(np.array([1.5]), np.array([9.0]), np.array([HEAD]))).values
    assert runs.F_w_max.values.max() < float(found["F_top_max"][0])
    assert runs.DAF.values.max() < float(found["DAF"][0])
    least = (plan.payload.mass - plan.rho * plan.payload.displaced) * G
    assert runs.F_sling_min.values.min() / least > float(found["sling_ratio"][0])


def test_taking_up_the_load_costs_in_proportion_to_the_speed_and_only_where_it_is_lifted_off(plan):
    lift_off, deep = of_kind(plan, PhaseKind.LIFT_OFF), of_kind(plan, PhaseKind.DEEP)
    assert jerk(plan, lift_off, 0.4) == pytest.approx(2.0 * jerk(plan, lift_off, 0.2))
    assert jerk(plan, deep, 0.4) == 0.0


def test_a_payload_that_the_seabed_holds_asks_for_more_than_its_weight(plan):
    held = plan.payload.model_copy(update={"lift_off": plan.payload.lift_off.model_copy(update={"suction": 2e5})})
    phase = with_seabed(plan)
    for quantity in ("F_top_static", "F_top_max"):
        more, less = (closed_form(p, phase, SEAS).values[quantity] for p in (replace(plan, payload=held), plan))
        assert more - less == pytest.approx(np.full(6, 2e5), rel=1e-6)


def test_the_winch_is_as_fast_as_full_pumps_turn_it_at_the_load_and_layer(plan):
    deep, crane = of_kind(plan, PhaseKind.DEEP), plan.crane
    still = at_rest(plan, deep, deep.z_end)
    for alternative, mode in ((Alternative.NS, Mode.NS), (Alternative.SSC, Mode.SSC)):
        top = CAPACITIES["v_top"].find(plan, deep, alternative)
        assert "stopped by pump flow" in top.basis
        stations = [Station(crane, still.F_tip / G - crane.hook_mass, still.s_w, way) for way in Direction]
        used = [abs(s.at(top.value, s.displacement(mode)(top.value)).alpha_p) for s in stations]
        assert max(used) == pytest.approx(1.0, abs=1e-6)
    assert CAPACITIES["v_top"].find(plan, deep, Alternative.NONE) is None
    tops = {a: CAPACITIES["v_top"].find(plan, deep, a).value for a in ALTERNATIVES if a is not Alternative.NONE}
    assert tops[Alternative.CAP] == max(tops[Alternative.NS], tops[Alternative.HS])
    assert tops[Alternative.NS] < tops[Alternative.SSC]
    assert tops[Alternative.SSC] == pytest.approx(tops[Alternative.STRONG_SSC])


def test_a_load_beyond_the_swl_or_beyond_a_mode_leaves_no_speed_and_says_why(plan):
    heavy = plan.payload.model_copy(update={"mass": 230e3})
    deep = of_kind(plan, PhaseKind.DEEP)
    beyond = CAPACITIES["v_top"].find(replace(plan, payload=heavy), deep, Alternative.SSC)
    assert beyond.value == 0.0
    assert "more than the SWL" in beyond.basis
    middle = plan.payload.model_copy(update={"mass": 150e3})
    hs = CAPACITIES["v_top"].find(replace(plan, payload=middle), deep, Alternative.HS)
    assert hs.value == 0.0
    assert "hs may not be used, for load of the mode" in hs.basis


def test_a_payload_too_heavy_at_depth_is_refused_by_static_load_whatever_the_sea(plan):
    heavy, deep = replace(plan, payload=plan.payload.model_copy(update={"mass": 240e3})), of_kind(plan, PhaseKind.DEEP)
    found = limits_of(closed_form(heavy, deep, SEAS), limited(heavy, deep, Alternative.NONE), calm(heavy, deep))
    assert found.Hs["static-load"].tolist() == [0.0]
    fine = limits_of(closed_form(plan, deep, SEAS), limited(plan, deep, Alternative.NONE), calm(plan, deep))
    assert fine.Hs["static-load"].tolist() == [math.inf]


def test_rules_of_the_winch_are_left_out_where_there_is_no_winch_to_judge(plan):
    def keys(phase, alternative):
        return {each.rule.key for each in limited(plan, phase, alternative)}

    deep, splash = of_kind(plan, PhaseKind.DEEP), of_kind(plan, PhaseKind.SPLASH)
    assert "winch-speed" not in keys(deep, Alternative.NONE)
    assert keys(deep, Alternative.CAP) - keys(deep, Alternative.NONE) == {"winch-speed"}
    assert {"saturation", "accumulator-stroke", "peak-pressure"} <= keys(deep, Alternative.SSC)
    assert len({frozenset(keys(splash, a)) for a in ALTERNATIVES}) == 1


def test_dynamic_capacity_is_the_swl_where_nobody_states_a_factor(plan):
    each = {x.rule.key: x for x in limited(plan, of_kind(plan, PhaseKind.DEEP), Alternative.SSC)}
    assert each["dynamic-load"].limit == each["static-load"].limit == pytest.approx(2.481e6, rel=1e-3)
    assert each["dynamic-load"].basis.startswith("SWL 250 t and hook 3 t")
    assert each["dynamic-load"].basis.endswith("no dynamic factor is stated")


def test_a_heavy_payload_uses_more_of_the_accumulator_and_less_motion_fits(plan):
    deep = of_kind(plan, PhaseKind.DEEP)
    heavy = replace(plan, payload=plan.payload.model_copy(update={"mass": 180e3}))
    s, less = (CAPACITIES["s_stroke"].find(p, deep, Alternative.SSC).value for p in (plan, heavy))
    assert less < s
    acc, passive = plan.crane.passive.accumulator, plan.crane.passive
    assert s * static_tension(plan, deep) == pytest.approx(
        acc.V_stroke * (acc.gas.p_0 - passive.p_lp)
    )  # work is pressure times volume


def test_without_a_certificate_no_sea_is_covered_and_the_reason_is_told(plan):
    deep, splash = of_kind(plan, PhaseKind.DEEP), of_kind(plan, PhaseKind.SPLASH)
    found = inside(plan, deep, Alternative.SSC, SEAS)
    assert not found[0].any()
    assert "no certificate" in found[1][0]
    for phase, alternative in ((splash, Alternative.SSC), (deep, Alternative.CAP), (deep, Alternative.NONE)):
        assert inside(plan, phase, alternative, SEAS)[0].all()
