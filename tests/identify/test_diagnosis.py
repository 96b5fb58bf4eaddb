"""What the data cannot determine is said plainly, with the test that would resolve it."""

import dataclasses

import numpy as np
import pytest
from tests.identify.staged import CRANE_2, LEVER, LOSS, RPM, STAIR, disturbed, stage, truth

from stillhook.identify.system_friction import diagnosis
from stillhook.identify.system_friction.diagnosis import design, judge
from stillhook.identify.system_friction.fitting.fit import fit_system, predicted
from stillhook.identify.system_friction.fitting.uncertainty import profile_intervals
from stillhook.library import frictions
from stillhook.library import system_friction as published
from stillhook.physics.scalar import G

SWL = 153e3 * G * LEVER
HEAVY = [t for t in CRANE_2 if t[1] == 77]
EMPTY = [t for t in CRANE_2 if t[1] == 0]
Y = truth("crane-1")


def codes(statements):
    return [s.code for s in statements]


def judged(points, code, *, profiles=False):
    """What is said of a fit to these points under this code."""
    fit = fit_system(points, LOSS)
    intervals = profile_intervals(points, LOSS, fit) if profiles else {}
    return [s for s in judge(points, fit, intervals) if s.code == code]


@pytest.mark.slow
def test_a_full_campaign_has_nothing_against_it():
    points = stage(Y, rng=np.random.default_rng(1))
    assert design(points, SWL).statements == ()
    assert not any(s.severe for s in judge(points, fit_system(points, LOSS), {}))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tests", "used", "advice"),
    [
        (HEAVY, ("Y_1", "Y_5", "Y_6"), "Add a staircase with the empty hook."),
        (EMPTY, ("Y_2", "Y_3", "Y_5"), "Add a staircase with a load near SWL."),
    ],
    ids=["heavy", "empty hook"],
)
def test_one_load_is_named_with_the_test_that_resolves_it_and_predicts_that_load(tests, used, advice):
    points = stage(Y, tests)
    plan = design(points, SWL)
    (statement,) = plan.statements
    assert (statement.code, statement.severe, plan.used) == ("one load", False, used)
    assert advice in statement.text
    fit = fit_system(points, LOSS, used=plan.used, keep_Y_2=plan.keep_Y_2)
    assert np.max(np.abs(predicted(points, LOSS, fit.y) - points.T_f)) < 0.002 * np.max(points.T_N)


@pytest.mark.slow
def test_a_hook_that_weighs_nothing_has_no_friction_in_proportion_to_it():
    points = dataclasses.replace(stage(Y, EMPTY), T_d=np.zeros(len(stage(Y, EMPTY))))
    plan = design(points, SWL)
    assert (plan.used, plan.keep_Y_2) == (("Y_2", "Y_3", "Y_5"), True)
    fit = fit_system(points, LOSS, used=plan.used, keep_Y_2=plan.keep_Y_2)
    assert np.all(np.isfinite(fit.covariance))
    assert np.max(np.abs(fit.residual)) < 0.5


@pytest.mark.thorough
def test_friction_below_the_motors_own_loss_is_no_result():
    points = stage(Y, rng=np.random.default_rng(1))
    less = dataclasses.replace(points, dp_up=0.1 * points.dp_up, dp_down=0.1 * points.dp_down)
    (statement,) = judged(less, "nothing left", profiles=True)
    assert statement.severe


@pytest.mark.slow
def test_no_low_speed_forbids_the_set_unless_another_winch_fills_in():
    lost, like = ("Y_1", "Y_3", "Y_4"), truth("crane-2")._asdict()
    points = stage(Y, CRANE_2, [n for n in STAIR if n >= 250])
    plan, filled = design(points, SWL), design(points, SWL, like)
    assert codes(plan.statements) == codes(filled.statements) == ["no low speed"]
    assert (plan.statements[0].severe, filled.statements[0].severe) == (True, False)
    assert "Y_1" not in plan.used
    fit = fit_system(points, LOSS, used=filled.used, prescribed=filled.prescribed)
    assert fit.prescribed == {n: like[n] for n in lost} == {n: getattr(fit.y, n) for n in lost}
    assert not {*lost} & {*fit.names}


def test_no_high_speed_and_one_displacement_are_said():
    slow = stage(Y, [t for t in CRANE_2 if t[0] == 215], [n for n in STAIR if n <= 400])
    assert codes(design(slow, SWL).statements) == ["no high speed", "one displacement"]


@pytest.mark.slow
def test_outliers_are_named_by_test_and_speed():
    points = stage(Y, rng=np.random.default_rng(3))
    far = np.arange(len(points)) == 30
    (statement,) = judged(dataclasses.replace(points, dp_up=points.dp_up + 40e5 * far), "outliers")
    name = points.names[points.test[30]]
    assert statement.text.startswith(f'1 pairs are more than 4 standard uncertainties off: test "{name}" at')


@pytest.mark.slow
def test_friction_that_no_model_has_is_said_with_the_test_that_shows_it_most():
    points = disturbed(stage(Y), np.random.default_rng(4), 0.02e5, 0.0)
    more = np.where(points.test == 3, 6e5, 0.0)
    known = dataclasses.replace(points, u_dp=np.full(len(points), 0.02e5), dp_up=points.dp_up + more)
    (statement,) = judged(known, "left over")
    assert 'most in test "4"' in statement.text


@pytest.mark.thorough
def test_a_parameter_that_may_be_zero_is_said_to_be_so():
    points = stage(truth("L4593"), rng=np.random.default_rng(4))
    assert any("Y_3" in s.text for s in judged(points, "not above zero", profiles=True))


@pytest.mark.slow
@pytest.mark.parametrize("speed", [150, 160])
def test_the_threshold_for_low_speeds_is_where_it_is_said_to_be(speed):
    points = stage(Y, CRANE_2, [speed * 2 / 2.04, *[n for n in STAIR if n >= 250]])
    assert ("no low speed" in codes(design(points, SWL).statements)) == (points.omega.min() > 150 * RPM)


@pytest.mark.parametrize(
    ("factor", "unusual"), [(0.39, True), (0.41, False), (1.0, False), (2.49, False), (2.51, True)]
)
def test_friction_far_from_that_of_every_published_winch_is_unusual(monkeypatch, factor, unusual):
    """With one published winch: 2.5 times its friction, or a part of that, is where it begins."""
    monkeypatch.setattr(diagnosis, "frictions", lambda: ["crane-1"])
    monkeypatch.setattr(diagnosis, "published", lambda name: None)
    monkeypatch.setattr(diagnosis.Y, "of", lambda published: 1.0)
    monkeypatch.setattr(diagnosis, "system_friction", lambda omega, T_d, y: np.full(len(T_d), 100.0 * y))
    points = stage(Y, rng=np.random.default_rng(1))
    assert [s.code for s in diagnosis.unlike(points, factor)] == ["unusual"] * unusual


def test_the_friction_of_the_only_published_winch_itself_is_not_unusual(monkeypatch):
    """Whatever the factor: with 1 it is on both edges."""
    monkeypatch.setattr(diagnosis, "UNLIKE", 1.0)
    monkeypatch.setattr(diagnosis, "frictions", lambda: [frictions()[0]])
    assert diagnosis.unlike(stage(Y, rng=np.random.default_rng(1)), diagnosis.Y.of(published(frictions()[0]))) == ()
