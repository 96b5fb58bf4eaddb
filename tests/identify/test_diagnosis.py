"""What the data cannot determine is said plainly, with the test that would resolve it."""

import dataclasses

import numpy as np
import pytest
from tests.identify.staged import CRANE_2, LEVER, LOSS, RPM, STAIR, disturbed, stage, truth

from stillhook.identify.system_friction.diagnosis import design, judge
from stillhook.identify.system_friction.fitting.fit import fit_system, predicted
from stillhook.identify.system_friction.fitting.uncertainty import profile_intervals
from stillhook.physics.scalar import G

SWL = 153e3 * G * LEVER
HEAVY = [t for t in CRANE_2 if t[1] == 77]
EMPTY = [t for t in CRANE_2 if t[1] == 0]
Y = truth("crane-1")


def codes(statements):
    return [s.code for s in statements]


@pytest.mark.slow
def test_a_full_campaign_has_nothing_against_it():
    points = stage(Y, rng=np.random.default_rng(1))
    plan = design(points, SWL)
    assert plan.statements == ()
    assert not any(s.severe for s in judge(points, fit_system(points, LOSS), {}))


@pytest.mark.slow
def test_one_load_is_named_with_the_test_that_resolves_it():
    plan = design(stage(Y, HEAVY), SWL)
    assert codes(plan.statements) == ["one load"]
    assert plan.used == ("Y_1", "Y_5", "Y_6")
    assert "Add a staircase with the empty hook." in plan.statements[0].text
    assert not plan.statements[0].severe


@pytest.mark.slow
def test_the_empty_hook_alone_keeps_the_constant_terms_and_asks_for_a_load():
    plan = design(stage(Y, EMPTY), SWL)
    assert plan.used == ("Y_2", "Y_3", "Y_5")
    assert "Add a staircase with a load near SWL." in plan.statements[0].text


@pytest.mark.slow
def test_one_load_still_predicts_that_load():
    points = stage(Y, HEAVY)
    plan = design(points, SWL)
    fit = fit_system(points, LOSS, used=plan.used)
    error = np.abs(predicted(points, LOSS, fit.y) - points.T_f) / points.T_N
    assert np.max(error) < 0.002


@pytest.mark.slow
def test_a_hook_that_weighs_nothing_has_no_friction_in_proportion_to_it():
    points = dataclasses.replace(stage(Y, EMPTY), T_d=np.zeros(len(stage(Y, EMPTY))))
    plan = design(points, SWL)
    assert plan.used == ("Y_2", "Y_3", "Y_5")
    assert plan.keep_Y_2 is True
    fit = fit_system(points, LOSS, used=plan.used, keep_Y_2=plan.keep_Y_2)
    assert np.all(np.isfinite(fit.covariance))
    assert np.max(np.abs(fit.residual)) < 0.5


@pytest.mark.thorough
def test_friction_below_the_motors_own_loss_is_no_result():
    points = stage(Y, rng=np.random.default_rng(1))
    less = dataclasses.replace(points, dp_up=0.1 * points.dp_up, dp_down=0.1 * points.dp_down)
    fit = fit_system(less, LOSS)
    said = [s for s in judge(less, fit, profile_intervals(less, LOSS, fit)) if s.code == "nothing left"]
    assert len(said) == 1
    assert said[0].severe


@pytest.mark.slow
def test_no_low_speed_forbids_the_set_unless_another_winch_fills_in():
    fast = [n for n in STAIR if n >= 250]
    points = stage(Y, CRANE_2, fast)
    plan = design(points, SWL)
    assert codes(plan.statements) == ["no low speed"]
    assert plan.statements[0].severe
    assert "Y_1" not in plan.used
    like = truth("crane-2")._asdict()
    filled = design(points, SWL, like)
    assert not filled.statements[0].severe
    fit = fit_system(points, LOSS, used=filled.used, prescribed=filled.prescribed)
    assert (fit.y.Y_1, fit.y.Y_3, fit.y.Y_4) == (like["Y_1"], like["Y_3"], like["Y_4"])
    assert set(fit.prescribed) == {"Y_1", "Y_3", "Y_4"}
    assert not {"Y_1", "Y_3", "Y_4"} & set(fit.names)


def test_no_high_speed_and_one_displacement_are_said():
    slow = stage(Y, [t for t in CRANE_2 if t[0] == 215], [n for n in STAIR if n <= 400])
    assert codes(design(slow, SWL).statements) == ["no high speed", "one displacement"]


@pytest.mark.slow
def test_outliers_are_named_by_test_and_speed():
    points = stage(Y, rng=np.random.default_rng(3))
    dp_up = points.dp_up.copy()
    dp_up[30] += 40e5
    points = dataclasses.replace(points, dp_up=dp_up)
    said = [s.text for s in judge(points, fit_system(points, LOSS), {}) if s.code == "outliers"]
    assert len(said) == 1
    assert said[0].startswith(
        f'1 pairs are more than 4 standard uncertainties off: test "{points.names[points.test[30]]}" at'
    )


@pytest.mark.slow
def test_friction_that_no_model_has_is_said_with_the_test_that_shows_it_most():
    points = disturbed(stage(Y), np.random.default_rng(4), 0.02e5, 0.0)
    known = dataclasses.replace(
        points, u_dp=np.full(len(points), 0.02e5), dp_up=points.dp_up + np.where(points.test == 3, 6e5, 0.0)
    )
    said = [s.text for s in judge(known, fit_system(known, LOSS), {}) if s.code == "left over"]
    assert len(said) == 1
    assert 'most in test "4"' in said[0]


@pytest.mark.thorough
def test_a_parameter_that_may_be_zero_is_said_to_be_so():
    points = stage(truth("L4593"), rng=np.random.default_rng(4))
    fit = fit_system(points, LOSS)
    said = [s.text for s in judge(points, fit, profile_intervals(points, LOSS, fit)) if s.code == "not above zero"]
    assert any("Y_3" in text for text in said)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [150, 160])
def test_the_threshold_for_low_speeds_is_where_it_is_said_to_be(speed):
    points = stage(Y, CRANE_2, [speed * 2 / 2.04, *[n for n in STAIR if n >= 250]])
    assert ("no low speed" in codes(design(points, SWL).statements)) == (points.omega.min() > 150 * RPM)
