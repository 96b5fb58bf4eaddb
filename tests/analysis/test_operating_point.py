"""Steady operation of the complete plant: its own equations at rest, and the engine's long run to the same place."""

import math
from functools import cache

import pytest

from stillhook import Scenario, load_crane, simulate
from stillhook.analysis.steady.operating_point import operating_point
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.spec.scenario import Operator, Water

CRANES = ("nov-150t", "nov-250t", "nov-100t-pure-active")
SLOW = {"s_w", "s_load", "V_o"}
RATE = 1.0
"""Rates that count as zero: pressures in Pa/s, the rest far smaller. A pressure of 1e7 Pa then stands for months."""
SAME = 1e-9
"""Part within which an exact statement must hold."""
LAG = 0.6e5
"""Pressure by which the engine's end lies off the steady one on active/passive winches [Pa]: their passive motors
follow a gas pressure that keeps drifting, a servo's lag behind. Measured up to 0.35 bar; nothing drifts on a pure
active winch
(below 100 Pa)."""

CALM = {"wire": {"zeta": 0.95, "zeta_low": 0.95, "zeta_high": 0.95}}
"""A wire on which a load does not swing; that of paper C."""

load = cache(load_crane)


def rates(o):
    both = o.driver.rates(o.state, o.command, o.geometry, o.tip, o.params)
    return both.winch._asdict() | both.path._asdict()


def circuit(o):
    q = o.driver.path_point(o.state, o.geometry, o.tip, o.params)
    return o.plant.circuit(o.state.winch, q, o.command, o.geometry, o.params)


@pytest.mark.parametrize("name", CRANES)
@pytest.mark.parametrize("v_w", [-2.5, -1.0, -1e-6, 0.0, 1e-6, 0.2, 1.0, 2.5])
def test_everything_fast_stands_still(name, v_w):
    o = operating_point(load(name), v_w, 0.8, load=60e3, s_w=40.0)
    assert {k: r for k, r in rates(o).items() if k not in SLOW and abs(r) > RATE} == {}
    assert rates(o)["s_w"] == -o.v_w == pytest.approx(-v_w, rel=SAME)


@pytest.mark.parametrize("name", CRANES)
def test_the_bristle_slides_and_is_relaxed_at_standstill(name):
    crane = load(name)
    o = operating_point(crane, 0.5, 0.8, load=60e3, s_w=40.0)
    assert o.plant.bristle_after(circuit(o), o.state.winch, o.params, 1.0) == pytest.approx(o.z, rel=SAME)
    assert operating_point(crane, 0.0, 0.8, load=60e3, s_w=40.0).z == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", CRANES)
@pytest.mark.parametrize("speed", ["-40 m/min", "-10 m/min", "10 m/min", "40 m/min"])
def test_a_long_run_of_the_engine_ends_there(name, speed):
    """The wire is one whose load does not ring: with the library's damping it swings for minutes, and at a crawl sticks
    and slips."""
    crane = changed(load(name), CALM)
    held = Operator(alpha_m=0.8, profile=[("0 s", "0 m/min"), ("5 s", speed)])
    case = Scenario(load="90 t", s_w="60 m", mode="manual", duration="25 s", warm_up="1 s", operator=held)
    end = simulate(crane, case).isel(time=-1)
    o = operating_point(
        crane,
        float(end.v_w),
        0.8,
        load=case.load,
        s_w=float(end.s_w),
        **({"V_o": float(end.V_acc), "alpha_pp": float(end.alpha_pp)} if crane.passive else {}),
    )
    near = LAG if crane.passive else 100.0
    assert float(end.p_a) == pytest.approx(o.p_a, abs=near)
    assert float(end.p_b) == pytest.approx(o.p_b, abs=near)
    assert float(end.alpha_p) == pytest.approx(o.alpha_p, abs=1e-4 if crane.passive else 1e-7)
    assert float(end.T_f) == pytest.approx(o.T_f, rel=1e-3)


def test_friction_costs_pressure_in_both_directions_and_leakage_costs_pump_in_both():
    crane = load("nov-250t")
    up, down = (operating_point(crane, v, 0.8, load=100e3, s_w=20.0) for v in (1.0, -1.0))
    assert up.dp_m > 0.0 > down.dp_m
    assert up.T_f > 0.0 > down.T_f
    for o in (up, down):
        ideal = o.flows.Q_m / (crane.active.pump.D_total * crane.active.pump.omega_p)
        assert abs(o.alpha_p) > abs(ideal)


def test_break_away_needs_more_pressure_than_slow_sliding():
    crane = load("nov-150t")
    assert (
        operating_point(crane, 1e-6, 0.8, load=90e3, s_w=20.0).p_a
        > operating_point(crane, 0.2, 0.8, load=90e3, s_w=20.0).p_a
    )


def test_an_unreachable_speed_is_flagged_and_not_clipped():
    o = operating_point(load("nov-250t"), 2.5, 1.0, load=100e3, s_w=20.0)
    assert o.alpha_p > 1.5
    assert not o.reachable
    assert abs(rates(o)["p_a"]) < RATE


def test_a_pure_active_winch_holds_the_weight_at_standstill():
    crane = load("nov-100t-pure-active")
    o = operating_point(crane, 0.0, 0.9, load=70e3, s_w=20.0)
    assert o.dp_m * crane.active.motor.D_total * 0.9 == pytest.approx(o.F_w * o.geometry.r_eff, rel=SAME)
    assert 0.0 < o.alpha_p < 0.1  # what leaks


def test_passive_motors_carry_the_weight_and_pressure_falls_with_it_to_the_friction_alone():
    crane = load("nov-150t")
    o = operating_point(crane, 0.0, 1.0, load=90e3, s_w=20.0)
    assert 0.0 < o.alpha_pm < 1.0
    assert abs(o.dp_m) < 2e5  # what the standing piston's leakage leaves


def test_drag_pulls_on_the_wire_and_a_sinking_load_lets_it_go_slack():
    crane = load("nov-150t")
    water = Water(volume="10 m^3", C_D=1.2, area="80 m^2")
    still, up, down = (operating_point(crane, v, 1.0, load=20e3, s_w=50.0, water=water).F_w for v in (0.0, 0.5, -0.5))
    assert down < still < up
    with pytest.raises(StillhookError, match="slack"):
        operating_point(crane, -2.0, 1.0, load=20e3, s_w=50.0, water=water)
    compensating = operating_point(crane, -2.0, 1.0, load=20e3, s_w=50.0, water=water, v_tip=2.0)
    assert compensating.F_w == still


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"alpha_m": 0.0}, "above 0 and at most 1"),
        ({"v_w": math.nan}, "finite"),
        ({"load": math.inf}, "finite"),
        ({"load": 400e3}, "exceeds the SWL"),
        ({"s_w": 1e4}, "more than"),
        ({"s_w": 1e6}, "it must be between 0 m and 20000 m"),
    ],
)
def test_refusals_say_what_came_and_what_is_allowed(asked, told):
    given = {"v_w": 1.0, "alpha_m": 0.8, "load": 50e3, "s_w": 20.0} | asked
    with pytest.raises(StillhookError, match=told):
        operating_point(load("nov-250t"), given.pop("v_w"), given.pop("alpha_m"), **given)
