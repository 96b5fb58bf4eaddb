"""Hoisting is set beside lowering: by pairs, and on a grid of speeds, with uncertainties that hold."""

from __future__ import annotations

import numpy as np
import pytest

from stillhook.errors import IdentifyError
from stillhook.identify.steady_state.steps import Window
from stillhook.identify.system_friction.campaign.pairs import on_grid, pair_windows
from stillhook.units import parse, show

RPM = parse("1 rev/min", "rotation")
BAR = 1e5
STEP = 25.0 * RPM
DRAWS = 4000
# Standard deviations of 4000 draws are known to 1.1 %, covariances to about as much of the variances: four times that.
OF_DRAWS = 0.045


def window(v: float, e: float, *, at: float = 0.0, u_v: float = 0.0, u_e: float = 0.1) -> Window:
    """Speed in rev/min with its sign, effort in bar."""
    return Window(at - 5.0, at + 5.0, 1 if v > 0 else -1, v * RPM, u_v * RPM, e * BAR, u_e * BAR, 100)


def staircase(leak: float = 1.1) -> list[Window]:
    ws, t = [], 0.0
    for v in (20.0, 60.0, 150.0, 400.0, 1000.0, 2000.0):
        ws.append(window(v, 150.0 + 15.0 + 0.005 * v, at=t))
        ws.append(window(-leak * v, 150.0 - 15.0 - 0.005 * leak * v, at=t + 30.0))
        t += 60.0
    return ws


def test_neighbours_in_a_staircase_become_pairs() -> None:
    found = pair_windows(staircase())
    assert not found.unpaired
    assert [p.down.middle - p.up.middle for p in found.pairs] == [30.0] * 6
    assert [p.speed for p in found.pairs] == sorted(p.speed for p in found.pairs)


def test_half_difference_is_friction_and_half_sum_is_load() -> None:
    p = pair_windows([window(100.0, 170.0, u_e=0.3), window(-100.0, 130.0, u_e=0.4)]).pairs[0]
    assert (p.friction, p.load, p.u_friction) == pytest.approx((20.0 * BAR, 150.0 * BAR, 0.25 * BAR))


def test_each_window_is_used_once_and_repeats_pair_with_their_own_neighbour() -> None:
    ws = [
        window(v, 160.0, at=t)
        for v, t in ((500.0, 0.0), (-520.0, 40.0), (500.0, 600.0), (-520.0, 640.0), (500.0, 1200.0))
    ]
    found = pair_windows(ws)
    assert [(p.up.middle, p.down.middle) for p in found.pairs] == [(0.0, 40.0), (600.0, 640.0)]
    assert found.unpaired[0].start == 1195.0
    assert "has a closer partner" in found.unpaired[0].reason


def test_the_most_pairs_are_made_even_where_one_could_be_closer() -> None:
    """100 up could take -100, but then -120 would be left alone beside 80: both pairs are within the limit, so both are made."""
    found = pair_windows([window(100.0, 160.0), window(80.0, 160.0), window(-100.0, 140.0), window(-128.0, 140.0)])
    assert len(found.pairs) == 2


def test_a_window_without_partner_is_told_with_the_nearest_speed() -> None:
    def text(v: float) -> str:
        return show(v, "rotation", 3)

    found = pair_windows([window(512.0, 160.0), window(-800.0, 140.0)], text=text)
    assert not found.pairs
    assert found.unpaired[0].reason == "no lowering within 35 % of 512 rev/min; the nearest is 800 rev/min"
    assert pair_windows([window(512.0, 160.0)]).unpaired[0].reason == "no lowering stretch at all"
    assert pair_windows([]).pairs == ()


def test_the_grid_has_the_multiples_of_its_step_that_both_directions_enclose() -> None:
    """From 22 rev/min (lowering begins there) to 2000 (hoisting ends there): 25 to 2000; nothing is extrapolated, nothing at zero."""
    g = on_grid(staircase(), STEP)
    assert g.speed / RPM == pytest.approx(np.arange(25.0, 2001.0, 25.0))


def test_straight_friction_comes_back_at_every_grid_speed() -> None:
    """Effort linear in speed is interpolated without error, however different the speeds of both directions are."""
    g = on_grid(staircase(leak=1.3), STEP)
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

    g = on_grid(stairs(False), STEP)
    draws = [on_grid(stairs(True), STEP) for _ in range(DRAWS)]
    F = np.array([0.5 * (d.up - d.down) for d in draws])
    assert F.std(axis=0) == pytest.approx(g.u_F, rel=OF_DRAWS)
    assert np.abs(g.cov_F - np.cov(F.T)).max() < OF_DRAWS * np.diag(g.cov_F).max()
    assert g.cov_F[0, 1] > 0.1 * g.cov_F[0, 0]


def test_speeds_that_repeat_are_averaged_by_their_uncertainties() -> None:
    ws = [
        window(100.0, 170.0, u_e=0.1),
        window(101.0, 171.0, u_e=0.1),
        window(300.0, 175.0),
        window(-90.0, 130.0),
        window(-310.0, 125.0),
    ]
    g = on_grid(ws, STEP)
    at = g.speed / RPM
    assert g.up[at.round() == 125.0] == pytest.approx(BAR * (170.5 + 4.5 * 24.5 / 199.5))
    # Two values 1 bar apart whose uncertainties are 0.1 bar: the mean is known to half their distance, not to 0.07 bar.
    u_up = 2.0 * np.sqrt(g.cov_F[0, 0] - 0.25 * _down_variance(ws, 125.0))
    assert u_up > 0.4 * BAR


def _down_variance(ws: list[Window], at: float) -> float:
    (a, b) = (w for w in ws if w.direction < 0)
    part = (at * RPM + a.speed) / (a.speed - b.speed)
    return float((1.0 - part) ** 2 * a.u_effort**2 + part**2 * b.u_effort**2)


@pytest.mark.parametrize(
    ("ws", "message"),
    [
        ([window(100.0, 1.0), window(-100.0, 1.0)], "hoisting: steady at 1 speeds"),
        ([window(100.0, 1.0), window(200.0, 1.0), window(-300.0, 1.0), window(-400.0, 1.0)], "no multiple of"),
        ([], "hoisting: steady at 0 speeds"),
    ],
)
def test_what_cannot_be_brought_onto_a_grid_is_refused(ws: list[Window], message: str) -> None:
    with pytest.raises(IdentifyError, match=message):
        on_grid(ws, STEP)


def test_a_step_that_is_no_speed_is_refused() -> None:
    with pytest.raises(IdentifyError, match="step = 0"):
        on_grid(staircase(), 0.0)
