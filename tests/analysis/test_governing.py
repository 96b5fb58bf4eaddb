"""One margin: of the complete plant on the crane's own wire, least over displacement, speed, payload and wire."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from stillhook import Crane, Scenario, load_crane
from stillhook.analysis.controllers import controller, strong_ssc
from stillhook.analysis.loop_stability.governing import (
    Governing,
    PlaceLimit,
    deciding,
    governing,
    place_limits,
    stribeck_speed,
    with_wire_damping,
)
from stillhook.analysis.loop_stability.loops import SampledLoop, balanced, sampled
from stillhook.analysis.loop_stability.margins import (
    KEPT,
    StableGains,
    gain_limit_of,
    margins,
    stable_gains,
    strongest_up_to,
)
from stillhook.analysis.loop_stability.places import SLOW, Place, payloads_of_mode, places_of, tip_speeds, wire_range
from stillhook.analysis.loop_stability.transfer import position_loop
from stillhook.analysis.loop_stability.verdict import verdict
from stillhook.analysis.tuning.objective import Limits, gain_allowed, linear_broken
from stillhook.engine.scenario.checks import foresee
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.spec.scenario import Mode

CRANE = load_crane("nov-250t")
SHORT = {"wires": (100.0,), "loads": (0.0, 150e3)}
"""A part of all places, for speed."""
SAME = 1e-6


# Between which gains a loop dies out


def second_order(zeta: float, omega: float = 3.0, T: float = 0.05) -> SampledLoop:
    """An integrator beside an oscillator of its own, sampled: the feedback reaches both."""
    A = np.zeros((3, 3))
    A[1, 2], A[2, 1], A[2, 2] = 1.0, -(omega**2), -2.0 * zeta * omega
    return sampled(balanced(A, np.array([1.0, 0.0, 1.0]), np.array([1.0, 0.0, 1.0])), T)


def grid_of_stable_gains(loop: SampledLoop) -> list[float]:
    """Gains at which the closed loop's poles lie within the unit circle, one by one."""
    return [K for K in np.geomspace(1e-3, 1e3, 400) if np.max(np.abs(loop.closed_poles(K))) < 1.0]


@pytest.mark.parametrize("zeta", [0.05, -0.05, -0.2])
def test_a_loop_dies_out_between_its_two_gains_and_nowhere_below(zeta: float) -> None:
    """Negative damping that the feedback makes up for: stable from a least gain on (conditionally)."""
    loop = second_order(zeta)
    found, stable = stable_gains(loop), grid_of_stable_gains(loop)
    assert found.alone is (zeta < 0.0)
    assert found.any
    step = 1.05
    assert found.low == pytest.approx(stable[0], rel=step - 1.0) or (zeta > 0.0 and found.low == 0.0)
    assert found.high == pytest.approx(stable[-1], rel=step - 1.0)
    assert found.holds(math.sqrt(stable[0] * stable[-1]))
    assert not found.holds(found.high * step)


def test_the_published_loop_has_one_limit() -> None:
    loop = sampled(position_loop(CRANE, 0.6), 0.01)
    assert stable_gains(loop) == StableGains(0.0, *gain_limit_of(loop))


@pytest.mark.slow
def test_a_loaded_winch_that_is_slow_is_stabilised_by_no_gain() -> None:
    (at,) = place_limits(CRANE, Mode.SSC, [Place(250e3, 100.0, 2.0 / 60.0)])
    assert not at.gains.any
    assert at.loop is not None
    assert grid_of_stable_gains(at.loop) == []


# Places that decide


def made(load: float, s_w: float, v: float, low: float, high: float) -> PlaceLimit:
    loop = SimpleNamespace()
    return PlaceLimit(Place(load, s_w, v), 1.0, loop, StableGains(low, high, 1.0))  # type: ignore[arg-type]


def test_places_decide_a_stribeck_speed_beyond_the_swinging_ones_of_their_payload() -> None:
    swings = made(100e3, 15.0, 0.1, 0.0, 0.0)
    near, far = made(100e3, 2000.0, 0.19, 0.0, 0.01), made(100e3, 2000.0, -0.21, 0.0, 0.5)
    slow, light = made(100e3, 15.0, 0.01, 0.0, 0.2), made(0.0, 15.0, 0.01, 0.0, 2.0)
    assert deciding([swings, near, far, slow, light], 0.1) == (far, light)
    assert deciding([near, far], 0.1) == (near, far)
    held = made(100e3, 15.0, 0.1, 0.1, 0.3)  # stable with a gain, and not without
    assert deciding([held, near], 0.1) == ()


def test_without_a_place_that_decides_there_is_no_gain_and_no_margin() -> None:
    swings = made(100e3, 15.0, 0.1, 0.0, 0.0)
    found = Governing(0.0, None, (swings,), ())
    assert found.margins(0.1) is None
    assert found.limit is None
    assert found.oscillates(0.1) == found.no_gain == (swings,)
    assert "at every speed" in found.describe()


def test_every_dimension_is_looked_at() -> None:
    places = places_of(payloads_of_mode(CRANE, Mode.NS), wire_range(CRANE), tip_speeds(CRANE))
    assert {0.0, CRANE.SWL} < {p.load for p in places}
    assert {round(60.0 * p.v_tip, 3) for p in places} > {s * v for v in (0.5, 1, 2, 5, 10) for s in (-1.0, 1.0)}
    assert max(abs(p.v_tip) for p in places) > 1.0
    assert max(p.s_w for p in places) > 2000.0 > 15.0 == min(p.s_w for p in places)
    assert payloads_of_mode(CRANE, Mode.NS, 50e3)[-1] == 50e3
    assert payloads_of_mode(CRANE, Mode.HS)[-1] == pytest.approx(0.6 * CRANE.SWL)


# The margin


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ns", "hs", "ssc"])
def test_no_place_that_decides_allows_less_gain_than_the_one_that_governs(name: str) -> None:
    found = governing(CRANE, Mode(name), **SHORT)
    assert found.K_p > 0.0
    for place in found.decide:
        assert place.loop is not None
        m = margins(place.loop, found.K_p)
        assert m.gain_margin >= KEPT[0] * (1.0 - SAME)
        assert m.phase_margin >= KEPT[1] * (1.0 - SAME)
        assert m.sensitivity_peak <= KEPT[2] * (1.0 + SAME)
    assert found.limit is not None
    assert found.margins(0.1).gain_margin == pytest.approx(found.limit.gains.high / 0.1, rel=SAME)  # type: ignore[union-attr]


@pytest.mark.slow
def test_the_verdict_is_by_the_crane_s_own_wire_and_paper_c_s_stands_beside_it() -> None:
    found = verdict(CRANE, **SHORT)
    assert not found.ok
    assert found.found.no_gain
    places = {p.place for p in found.found.no_gain}
    assert found.found.limit is not None
    assert found.found.limit.place not in places  # never a margin and "no gain" of one place
    damping = {d.whose: d for d in found.damping}
    assert damping["crane"].zeta == 0.01
    assert damping["paper C"].zeta == 0.95
    assert damping["paper C"].no_gain < damping["crane"].no_gain <= damping["least"].no_gain
    table = found.table()
    assert table["stable"] is False
    assert table["published"]["K_p_ms"] == pytest.approx(2.026039, abs=5e-7)
    light = verdict(CRANE, loads=(0.0,), wires=(100.0,))
    assert light.ok
    assert light.margins.gain_margin > 2.0  # type: ignore[union-attr]


@pytest.mark.slow
def test_a_wire_that_rings_longer_allows_no_more_gain() -> None:
    crane = load_crane("nov-250t-secondary")
    limits = []
    for zeta in (0.005, 0.01, 0.1, 0.95):
        (at,) = place_limits(with_wire_damping(crane, zeta), Mode.POSITION, [Place(crane.SWL, 205.0, 2.0 / 60.0)])
        limits.append(at.gains.high)
    assert limits == sorted(limits)
    assert limits[0] < 0.7 * limits[-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "share", "s_w", "old_K_p"),
    [
        ("nov-250t-secondary", 1.0, 100.0, 1.0),
        ("utility-20t-open-circuit", 1.0, 100.0, 2.0),
        ("nov-100t-cylinder", 1.0, 15.0, 0.4),
    ],
)
def test_gains_that_shipped_before_are_found_to_oscillate(name: str, share: float, s_w: float, old_K_p: float) -> None:
    """They kept margins with a wire damping of 0.95, and swung in the twin on the crane's own wire."""
    crane = load_crane(name)
    without = {"control": {"position": {"K_dp": "0 1/bar"}}}
    old = {
        "nov-250t-secondary": {"secondary": {"drive": {"K": "15 1/s"}}, "control": {"tau_F": "0.5 s"}},
        "utility-20t-open-circuit": {"open": {"drive": {"share": 0.9}}} | without,
        "nov-100t-cylinder": without,
    }
    was = changed(crane, old[name])
    found = place_limits(was, Mode.POSITION, places_of((share * crane.SWL,), (s_w,), (2.0 / 60.0,)))
    assert min(p.gains.high for p in found) < old_K_p
    now = place_limits(crane, Mode.POSITION, places_of((share * crane.SWL,), (s_w,), (2.0 / 60.0,)))
    assert all(p.gains.high >= 2.0 * crane.control.K_p for p in now)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", ["nov-250t-secondary", "utility-20t-open-circuit", "nov-100t-cylinder", "nov-100t-electric"]
)
def test_the_library_s_own_gains_keep_the_margins(name: str) -> None:
    """K_p makes no place oscillate. The open circuit creeps unevenly at up to 1 m/min under its SWL without feedback, and
    with its gain too."""
    crane = load_crane(name)
    found = governing(crane, Mode.POSITION)
    assert crane.control.K_p <= found.K_p * (1.0 + SAME)
    swinging = found.oscillates(crane.control.K_p)
    assert all(p.gains.alone and p.place.load == crane.SWL and abs(p.place.v_tip) <= 1.0 / 60.0 for p in swinging)
    assert len(swinging) <= (6 if name == "utility-20t-open-circuit" else 0)


@pytest.mark.slow
def test_tuning_and_strong_ssc_take_the_one_margin() -> None:
    limits = Limits(load=0.0)
    assert gain_allowed(CRANE, Mode.SSC, limits) == governing(CRANE, Mode.SSC, load=0.0).K_p
    wild = changed(CRANE, {"control": {"K_p": "0.9 1/m"}})
    broken = linear_broken(wild, Mode.SSC, limits, [1.0])
    assert broken[0].startswith("gain margin")
    assert "complete plant" in broken[-1]
    assert linear_broken(CRANE, Mode.SSC, limits, [1.0]) == []


@pytest.mark.thorough
def test_strong_ssc_keeps_the_margin_wherever_a_place_decides() -> None:
    found = governing(CRANE, Mode.SSC)
    strong = strong_ssc(CRANE).on(CRANE).control.K_p
    assert strong == pytest.approx(found.K_p, abs=1e-4)
    assert (
        CRANE.control.K_p < strong < strongest_up_to(sampled(position_loop(CRANE, 0.6), 0.01))
    )  # the published loop alone allows twice as much
    assert controller("strong-ssc").on(CRANE).control.K_p == strong


@pytest.mark.slow
def test_settings_that_the_loop_does_not_know_of_do_not_change_it() -> None:
    other = changed(CRANE, {"control": {"K_1": "0.9 s/m", "K_p": "0.3 1/m", "t_lead": "20 ms", "t_lead_ff": "40 ms"}})
    assert governing(other, Mode.NS, **SHORT).K_p == governing(CRANE, Mode.NS, **SHORT).K_p


def test_the_speed_by_which_friction_fades_is_that_of_the_printed_motor_speed() -> None:
    """229 rev/min at the motor, on the outer diameter of 5.1 m and a ratio of 501.6."""
    assert stribeck_speed(CRANE) == pytest.approx(229.0 / 501.6 * math.pi * 5.1 / 60.0, rel=1e-3)
    assert SLOW[0] < stribeck_speed(CRANE) < SLOW[-1]


def test_the_note_of_a_run_names_the_published_limit() -> None:
    hot = changed(CRANE, {"control": {"K_p": "1.1 1/m"}})
    case = Scenario(load="150 t", s_w="100 m", mode="hs", tip="sine 0.5 m 10 s", duration="60 s")
    assert any("published loop, motors at 0.60" in note for note in foresee(hot, case).notes)


@pytest.mark.parametrize("v", [0.0, math.nan])
def test_a_speed_at_which_nothing_slides_is_one_line(v: float) -> None:
    crane: Crane = load_crane("nov-100t-electric")
    for ask in (lambda: verdict(crane, v_tip=v), lambda: verdict(CRANE, v_tip=v)):
        with pytest.raises(StillhookError, match="a winch at rest sticks"):
            ask()
