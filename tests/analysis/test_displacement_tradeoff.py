"""Displacement against error, pressure and travel: what the motion alone takes of pressure, gains, fronts, outcome."""

import math

import pytest
from benchmarks.control import course
from benchmarks.displacement import OUTCOME
from benchmarks.displacement.motion import highest_pressure
from benchmarks.displacement.points import FF, OPTIMAL, PUBLISHED, STRONG, all_points, optimal, point_of, usual
from benchmarks.displacement.scoring import CHOSEN_IN, HELD_OUT, cases, gains, summary
from tests.scripts import PAGES, script
from trials.store import read

from stillhook import Scenario, Sine, load_crane
from stillhook.analysis.steady.operating_point import operating_point
from stillhook.engine.simulate import run_cases
from stillhook.library import changed

CRANE = load_crane(course.CRANE)
make = script(PAGES / "make.py")
STORED = read(OUTCOME)["curves"]
SPEED_VARIES = 0.02
"""Share by which pressure differs between 0.81 and 1 of the fastest speed [-]."""


def sine(amplitude: float, period: float) -> Scenario:
    return Scenario(
        load="100 t",
        s_w="487 m",
        tip=f"sine {amplitude:g} m {period:g} s",
        mode="level-1",
        warm_up="80 s",
        duration="200 s",
    )


def test_a_motion_without_acceleration_takes_the_pressure_of_steady_operation():
    """A swell of ten minutes about its fastest moment: friction, load and leakage of that speed, inertia nothing."""
    v, T = 0.5, 600.0
    fastest = f"{-360.0 * 140.0 / T:g} deg"
    swell = Sine(amplitude=f"{v * T / (2.0 * math.pi):g} m", period=f"{T:g} s", phase=fastest)
    case = sine(1.0, 10.0).model_copy(update={"tip": swell})
    point = operating_point(CRANE, -v, 1.0, load=case.load, s_w=case.s_w, v_tip=v)
    assert highest_pressure(CRANE, case) == pytest.approx(max(point.p_a, point.p_b), rel=SPEED_VARIES)


def test_no_run_at_full_displacement_has_less_pressure_than_the_motion_takes():
    """FF follows a long sine within 2 cm: its highest pressure is that of the motion and a little more."""
    case = sine(1.0, 12.0)
    machine = changed(CRANE, {"control": {"u_thr": 0.97, "t_lead": "15 ms"}})
    (row,) = run_cases([machine], [case.with_mode(usual(FF, FF).law)])
    assert 1.0 <= row["p_max"] / highest_pressure(CRANE, case) < 1.2


def test_more_load_and_more_motion_take_more_pressure():
    light, heavy = (highest_pressure(CRANE, sine(1.0, 10.0).model_copy(update={"load": m})) for m in (4e4, 1.8e5))
    slow, fast = (highest_pressure(CRANE, sine(a, 10.0)) for a in (0.5, 1.5))
    assert light < heavy
    assert slow < fast


def test_all_but_published_ssc_have_the_gain_of_the_margin():
    points = [usual(PUBLISHED, "ssc"), usual(STRONG, "ssc"), optimal(), optimal(w_Q=1.0, w_s=0.3)]
    published, strong, *optima = gains(CRANE, points)
    assert published == CRANE.control.K_p
    assert strong == course.largest_gain(CRANE, usual(STRONG, "ssc").law)
    assert optima == [strong, strong]


def test_settings_are_shown_in_seas_and_seeds_that_they_were_not_chosen_in():
    assert not {*HELD_OUT.work, *HELD_OUT.calm} & {*CHOSEN_IN.work, *CHOSEN_IN.calm}
    assert not {*HELD_OUT.seeds} & {*CHOSEN_IN.seeds}
    assert len(cases(CRANE, HELD_OUT)) == 14


def test_a_summary_counts_errors_of_working_seas_and_efficiency_of_calm_ones():
    n = len(CHOSEN_IN.work)
    names = (
        "e_c_pp",
        "load_pp",
        "P_hpu_mean",
        "saturated",
        "travel_p",
        "travel_m",
        "p_max",
        "P_hpu_max",
        "omega_m_max",
    )
    work = [dict.fromkeys(names, float(i)) | {"eta_c": 0.5} for i in range(n)]
    found = summary([*work, dict.fromkeys(names, 99.0) | {"eta_c": 0.9}], CHOSEN_IN)
    assert found["e_c_pp"] == (n - 1) / 2.0
    assert found["p_max"] == n - 1.0
    assert found["eta_calm"] == 0.9


def test_the_outcome_is_that_of_the_points_of_the_programme():
    points = {p.key: p for p in all_points()}
    assert set(STORED) == set(points)
    assert all(point_of(one) == points[key] for key, one in STORED.items())


def test_no_point_of_a_front_is_beaten_by_another():
    page = make.module_of("displacement_tradeoff")
    optima = page.of_family(STORED, OPTIMAL)
    for name, q in page.QUANTITIES.items():
        sign = 1.0 if q.less else -1.0
        for one in page.front(optima, name, less=q.less):
            e, x = one["chosen_in"]["e_c_pp"], sign * one["chosen_in"][name]
            assert not any(p["chosen_in"]["e_c_pp"] < e and sign * p["chosen_in"][name] <= x for p in optima)
