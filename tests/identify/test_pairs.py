"""Hoisting stretches are paired with lowering ones."""

from __future__ import annotations

import math

import pytest

from stillhook.identify.steady_state.pairs import pair_windows
from stillhook.identify.steady_state.steps import Window
from stillhook.units import parse, show

RPM = parse("1 rev/min", "rotation")
BAR = 1e5


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


@pytest.mark.parametrize(("lowering", "pairs"), [(1.41, 1), (1.43, 0), (0.71, 1), (0.69, 0)])
def test_speeds_more_than_a_third_apart_are_not_a_pair(lowering: float, pairs: int) -> None:
    """35 % of the mean of both: a ratio of 1.35 / 0.65 to the halves, 1.424 and 0.702."""
    found = pair_windows([window(100.0, 160.0), window(-100.0 * lowering, 140.0)])
    assert len(found.pairs) == pairs
    assert len(found.unpaired) == 2 - 2 * pairs


def test_speeds_apart_by_just_the_limit_are_a_pair_and_of_two_the_nearer_is_taken(monkeypatch) -> None:
    """With a limit of a half, which binary fractions meet exactly."""
    monkeypatch.setattr("stillhook.identify.steady_state.pairs.LARGEST_DIFFERENCE", 0.5)

    def turning(v: float) -> Window:
        return Window(0.0, 10.0, int(math.copysign(1, v)), v, 0.0, 1e7, 1e4, 100)

    assert len(pair_windows([turning(1.25), turning(-0.75)]).pairs) == 1
    assert len(pair_windows([turning(1.25), turning(-0.749)]).pairs) == 0
    found = pair_windows([turning(1.25), turning(-1.25), turning(-0.75)])
    assert [(p.up.speed, p.down.speed) for p in found.pairs] == [(1.25, -1.25)]
    assert found.unpaired[0].reason == "every hoisting stretch near 0.75 (SI) has a closer partner"


def test_of_equal_speeds_the_one_nearer_in_time_is_the_partner() -> None:
    """Two minutes count as much as the largest difference of speed: 10 % nearer in speed does not pay for an hour."""
    near, far = window(-110.0, 140.0, at=40.0), window(-100.0, 140.0, at=3600.0)
    assert pair_windows([window(100.0, 160.0), near, far]).pairs[0].down == near
    soon, later = window(-130.0, 140.0, at=40.0), window(-100.0, 140.0, at=60.0)
    assert pair_windows([window(100.0, 160.0), soon, later]).pairs[0].down == later
