"""The thesis's way: friction on a grid of speeds with uncertainties that hold, and the complex method, which finds what
least squares finds, inside bounds, the same way every time."""

from __future__ import annotations

import numpy as np
import pytest
from tests.identify.refusals import refused
from tests.identify.staged import LOSS, stage, truth
from tests.identify.test_pairs import BAR, RPM, staircase, window

from stillhook.identify.steady_state.steps import Window
from stillhook.identify.system_friction.fitting.fit import Y_4_LEAST, Problem, Target
from stillhook.identify.system_friction.fitting.model import Y_NAMES, Y, motor_loss_at, system_friction_at
from stillhook.identify.system_friction.thesis import UPPER, Variant, complex_method, on_grid

DRAWS = 4000
# Standard deviations of 4000 draws are known to 1.1 %, covariances to about as much of the variances: four times that.
OF_DRAWS = 0.045
SAME = 1e-6  # relative difference of two costs that are the same minimum


def test_the_grid_has_the_multiples_of_its_step_that_both_directions_enclose() -> None:
    """From 22 rev/min (lowering begins there) to 2000 (hoisting ends there): 25 to 2000; nothing is extrapolated, nothing at zero."""
    assert on_grid(staircase()).speed / RPM == pytest.approx(np.arange(25.0, 2001.0, 25.0))


def test_straight_friction_comes_back_at_every_grid_speed() -> None:
    """Effort linear in speed is interpolated without error, however different the speeds of both directions are."""
    g = on_grid(staircase(leak=1.3))
    assert 0.5 * (g.up - g.down) == pytest.approx((15.0 + 0.005 * g.speed / RPM) * BAR)
    assert 0.5 * (g.up + g.down) == pytest.approx(np.full(len(g.speed), 150.0 * BAR))


@pytest.mark.thorough
def test_uncertainties_and_covariances_on_the_grid_agree_with_draws() -> None:
    """Every window's speed and effort is drawn again 4000 times; neighbours share windows, so covariances count."""
    rng = np.random.default_rng(3)
    v = np.array([18.0, 60.0, 150.0, 410.0])
    up, down = 150.0 + 12.0 + 20.0 * np.exp(-v / 80.0), 150.0 - 12.0 - 20.0 * np.exp(-v * 1.1 / 80.0)

    def stairs(draw: bool) -> list[Window]:
        n = lambda s: s * rng.standard_normal() if draw else 0.0
        ws = [window(a + n(0.8), e + n(0.3), u_v=0.8, u_e=0.3) for a, e in zip(v, up, strict=True)]
        return ws + [window(-1.1 * a + n(0.8), e + n(0.2), u_v=0.8, u_e=0.2) for a, e in zip(v, down, strict=True)]

    g = on_grid(stairs(False))
    draws = [on_grid(stairs(True)) for _ in range(DRAWS)]
    F = np.array([0.5 * (d.up - d.down) for d in draws])
    assert F.std(axis=0) == pytest.approx(g.u_F, rel=OF_DRAWS)
    assert np.abs(g.cov_F - np.cov(F.T)).max() < OF_DRAWS * np.diag(g.cov_F).max()
    assert g.cov_F[0, 1] > 0.1 * g.cov_F[0, 0]


def test_speeds_that_repeat_are_averaged_by_their_uncertainties() -> None:
    up = [window(100.0, 170.0, u_e=0.1), window(101.0, 171.0, u_e=0.1), window(300.0, 175.0)]
    a, b = window(-90.0, 130.0), window(-310.0, 125.0)
    g = on_grid([*up, a, b])
    assert g.up[(g.speed / RPM).round() == 125.0] == pytest.approx(BAR * (170.5 + 4.5 * 24.5 / 199.5))
    part = (125.0 * RPM + a.speed) / (a.speed - b.speed)
    of_down = (1.0 - part) ** 2 * a.u_effort**2 + part**2 * b.u_effort**2
    # Two values 1 bar apart whose uncertainties are 0.1 bar: the mean is known to half their distance, not to 0.07 bar.
    assert 2.0 * np.sqrt(g.cov_F[0, 0] - 0.25 * of_down) > 0.4 * BAR


@pytest.mark.parametrize(
    ("speeds", "message"),
    [((100, -100), "hoisting: steady at 1 speeds"), ((100, 200, -300, -400), "no multiple of"), ((), "steady at 0")],
)
def test_what_cannot_be_brought_onto_a_grid_is_refused(speeds: tuple[int, ...], message: str) -> None:
    assert message in refused(on_grid, [window(float(v), 1.0) for v in speeds])


@pytest.fixture
def friction():
    """Cost E of six parameters, their lower bounds, and the least-squares optimum with its cost."""
    points = stage(truth("crane-1"), rng=np.random.default_rng(1))
    T = points.T_f - motor_loss_at(points, LOSS)
    lower = np.array([Y_4_LEAST if n == "Y_4" else 0.0 for n in Y_NAMES])
    E = lambda x: float(np.sum((T - system_friction_at(points, Y(*x))) ** 2))
    return E, lower, Problem(Target(points, T), np.ones(len(points))).best()


@pytest.mark.thorough
@pytest.mark.parametrize("variant", [Variant.KRUS, Variant.COMPLEX_RF])
def test_complex_method_and_least_squares_reach_the_same_cost(friction, variant):
    E, lower, (y, least) = friction
    found = complex_method(E, lower, np.array(UPPER), variant=variant, seed=1)
    assert found.converged
    assert found.cost == pytest.approx(least, rel=SAME)
    assert found.x[3] == pytest.approx(y.Y_4, rel=1e-3)


@pytest.mark.thorough
def test_the_original_method_either_finds_it_or_says_that_it_did_not(friction):
    """Box's own population can fall flat and stop moving (Krus's additions are there for that); it must not call that an answer."""
    E, lower, (_, least) = friction
    runs = [complex_method(E, lower, np.array(UPPER), variant=Variant.BOX, seed=s, most=8000) for s in range(4)]
    assert any(r.converged for r in runs)
    for r in runs:
        assert not r.converged or r.cost == pytest.approx(least, rel=SAME)


@pytest.mark.parametrize("variant", Variant)
def test_every_variant_finds_the_bottom_of_a_bowl_in_its_own_way(variant):
    bowl = lambda x: float(np.sum((x - 0.4) ** 2))
    found = complex_method(bowl, np.zeros(2), np.ones(2), variant=variant, population=12)
    assert found.x == pytest.approx([0.4, 0.4], abs=1e-4)
    others = [complex_method(bowl, np.zeros(2), np.ones(2), variant=v, population=12) for v in Variant if v != variant]
    assert all(not np.array_equal(found.x, other.x) for other in others)


def test_the_minimum_may_lie_on_a_bound_and_no_design_beyond_one_is_tried():
    seen = []
    bowl = lambda x: seen.append(x.copy()) or float((x[0] + 1.0) ** 2 + (x[1] - 0.3) ** 2)
    found = complex_method(bowl, np.zeros(2), np.ones(2), population=12)
    assert found.x == pytest.approx([0.0, 0.3], abs=1e-5)
    assert np.min(seen) >= 0.0
    assert np.max(seen) <= 1.0


def test_a_seed_repeats_another_differs_and_running_out_of_evaluations_is_said():
    bowl = lambda x: float(np.sum((x - 0.4) ** 2))
    a, b, c = (complex_method(bowl, np.zeros(3), np.ones(3), seed=s, most=200) for s in (1, 1, 2))
    assert np.array_equal(a.x, b.x)
    assert not np.array_equal(a.x, c.x)
    assert not a.converged
    assert a.evaluations == b.evaluations >= 200


@pytest.mark.thorough
def test_the_complex_method_finds_the_way_out_of_a_valley_with_ripples():
    ripples = lambda x: float(np.sum((x - 0.3) ** 2) + 0.02 * np.sum(1.0 - np.cos(40.0 * (x - 0.3))))
    found = [complex_method(ripples, np.zeros(2), np.ones(2), seed=s).cost for s in range(10)]
    assert np.median(found) < 1e-6
