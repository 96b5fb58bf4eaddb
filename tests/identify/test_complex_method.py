"""Box's complex method and Krus's variants: they find what least squares finds, inside bounds, the same way every time."""

import numpy as np
import pytest
from tests.identify.refusals import refused
from tests.identify.staged import LOSS, stage, truth

from stillhook.identify.system_friction.fitting.fit import Y_4_LEAST, Problem, Target
from stillhook.identify.system_friction.fitting.model import Y_NAMES, Y, motor_loss_at, system_friction_at
from stillhook.identify.system_friction.identify import UPPER
from stillhook.statistics.complex_method import Variant, complex_method

SAME = 1e-6  # relative difference of two costs that are the same minimum


def friction_cost(points):
    T = points.T_f - motor_loss_at(points, LOSS)
    return (lambda x: float(np.sum((T - system_friction_at(points, Y(*x))) ** 2))), Problem(
        Target(points, T), np.ones(len(points))
    )


@pytest.mark.thorough
@pytest.mark.parametrize("variant", [Variant.KRUS, Variant.COMPLEX_RF])
def test_complex_method_and_least_squares_reach_the_same_cost(variant):
    points = stage(truth("crane-1"), rng=np.random.default_rng(1))
    E, problem = friction_cost(points)
    y, least = problem.best()
    lower = np.array([Y_4_LEAST if n == "Y_4" else 0.0 for n in Y_NAMES])
    found = complex_method(E, lower, np.array(UPPER), variant=variant, seed=1)
    assert found.converged
    assert found.cost == pytest.approx(least, rel=SAME)
    assert found.x[3] == pytest.approx(y.Y_4, rel=1e-3)


@pytest.mark.thorough
def test_the_original_method_either_finds_it_or_says_that_it_did_not():
    """Box's own population can fall flat and stop moving (Krus's additions are there for that); it must not call that an answer."""
    points = stage(truth("crane-1"), rng=np.random.default_rng(1))
    E, problem = friction_cost(points)
    lower = np.array([Y_4_LEAST if n == "Y_4" else 0.0 for n in Y_NAMES])
    runs = [complex_method(E, lower, np.array(UPPER), variant=Variant.BOX, seed=s, most=8000) for s in range(4)]
    assert any(r.converged for r in runs)
    for r in runs:
        assert not r.converged or r.cost == pytest.approx(problem.best()[1], rel=SAME)


def test_the_minimum_may_lie_on_a_bound():
    found = complex_method(
        lambda x: float((x[0] + 1.0) ** 2 + (x[1] - 0.3) ** 2), np.zeros(2), np.ones(2), population=12
    )
    assert found.x[0] == pytest.approx(0.0, abs=1e-12)
    assert found.x[1] == pytest.approx(0.3, abs=1e-5)


@pytest.mark.slow
def test_it_stays_inside_the_bounds():
    seen = []
    complex_method(lambda x: seen.append(x.copy()) or float(np.sum((x - 2.0) ** 2)), np.zeros(3), np.ones(3), most=2000)
    assert np.min(seen) >= 0.0
    assert np.max(seen) <= 1.0


@pytest.mark.slow
def test_a_seed_repeats_and_another_differs():
    bowl = lambda x: float(np.sum((x - 0.4) ** 2))
    a, b, c = (complex_method(bowl, np.zeros(3), np.ones(3), seed=s) for s in (1, 1, 2))
    assert np.array_equal(a.x, b.x)
    assert a.evaluations == b.evaluations
    assert not np.array_equal(a.x, c.x)


@pytest.mark.thorough
def test_krus_finds_the_way_out_of_a_valley_with_ripples():
    ripples = lambda x: float(np.sum((x - 0.3) ** 2) + 0.02 * np.sum(1.0 - np.cos(40.0 * (x - 0.3))))
    found = [complex_method(ripples, np.zeros(2), np.ones(2), variant=Variant.KRUS, seed=s).cost for s in range(10)]
    assert np.median(found) < 1e-6


def test_running_out_of_evaluations_is_said():
    found = complex_method(lambda x: float(np.sum(x**2)), np.zeros(4), np.ones(4), most=60)
    assert not found.converged
    assert found.evaluations >= 60


@pytest.mark.parametrize(
    ("upper", "population", "line"),
    [
        (np.zeros(2), 36, "a lower bound is not below its upper bound. Give bounds in order."),
        (np.ones(6), 7, "a population of 7 for 6 parameters. Take 8 or more."),
    ],
)
def test_bad_settings_are_refused_in_one_line(upper, population, line):
    problem = refused(complex_method, lambda x: 0.0, np.zeros(len(upper)), upper, population=population)
    assert problem == f"complex method: {line}"
