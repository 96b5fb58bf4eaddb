"""Runs whose motors work where nobody fitted their loss say so, with how much of the friction that is."""

import re

import pytest

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.engine.pack.winch import load_record
from stillhook.engine.scenario.checks import CONSIDERABLE, foresee, friction_parts, layer_diameter_at
from stillhook.library import changed

CRANE = load_crane("nov-250t")
PURE = load_crane("nov-100t-pure-active")
SLOW = Sine.from_si(1.0, 12.0)  # 0.52 m/s: 1000 rev/min
FAST = Sine.from_si(2.8, 12.0)  # 2800 rev/min, above the 2500 rev/min of the fit


def said(crane, load, tip, **more):
    case = Scenario(load=load, s_w="15 m", tip=tip, duration="60 s", **more)
    return [n for n in foresee(crane, case).notes if "extrapolation" in n and "losses of" in n]


def test_an_empty_hook_is_carried_by_passive_motors_where_their_loss_was_not_fitted():
    (note,) = said(CRANE, "0 t", SLOW)
    part, total = (float(x) for x in re.match(r"(\d+) of (\d+) N m", note).groups())
    assert 0.5 * total < part < total
    assert "passive motors at 1 % of their displacement, which were fitted from 23 % up" in note


def test_a_load_that_brings_the_passive_motors_into_their_range_brings_no_note():
    assert said(CRANE, "20 t", SLOW)
    assert not said(CRANE, "100 t", SLOW)


def test_motors_that_turn_faster_than_those_of_the_fit_are_named_with_the_speed():
    notes = said(CRANE, "100 t", FAST)
    assert any("passive motors" in n and "fitted up to 2500 rev/min" in n for n in notes)


def test_motors_under_a_higher_pressure_than_those_of_the_fit_are_named():
    lower = changed(PURE, {"active": {"motor": {"dp_loss_max": "100 bar"}}})
    assert not said(PURE, "90 t", SLOW)
    (note,) = said(lower, "90 t", SLOW)
    assert "active motors" in note
    assert "fitted up to 100 bar" in note


def test_a_crane_that_does_not_say_where_its_loss_was_fitted_has_no_note():
    motor = CRANE.passive.motor.model_copy(update={"D_loss_min": None, "n_loss_max": None, "dp_loss_max": None})
    passive = CRANE.passive.model_copy(update={"motor": motor})
    assert not said(CRANE.model_copy(update={"passive": passive}), "0 t", SLOW)


def test_losses_that_are_a_small_part_of_the_friction_are_not_worth_a_note():
    sticky = changed(CRANE, {"friction": {"system": {"Y_2": "500 N m"}}})
    assert not said(sticky, "0 t", SLOW)


@pytest.mark.slow
def test_the_parts_are_the_friction_that_a_run_has():
    """At the highest speed of a slow swing, where nothing accelerates, the run's friction torque is that of the note."""
    case = Scenario(load="0 t", s_w="15 m", tip=SLOW, mode="ssc", duration="72 s", warm_up="36 s")
    run = simulate(CRANE, case, every="0.01 s")
    d = layer_diameter_at(CRANE, case.s_w)
    parts = friction_parts(CRANE, load_record(CRANE, case).W, d, float(run["v_w_max"]), 1.0)
    t_f = abs(
        run["T_f"]
        .sel(time=slice(36.0, None))
        .isel(time=abs(run["v_w"].sel(time=slice(36.0, None))).argmax("time").values)
    )
    assert float(t_f) == pytest.approx(parts[0].total, rel=0.05)  # the active motors' own pressure is left out
    assert parts[1].T_f > CONSIDERABLE * parts[1].total
    assert "losses of the passive motors" in str(run["notes"].values)
