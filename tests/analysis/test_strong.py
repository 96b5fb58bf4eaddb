"""Strong SSC: keeps its margins, does not ring, beats published SSC on error, and pays with a little pressure."""

from __future__ import annotations

import math

import pytest

from stillhook import Crane, Scenario, load_crane, simulate
from stillhook.analysis.controllers import controller, lateness, strong_ssc
from stillhook.analysis.loop_stability.governing import governing
from stillhook.analysis.loop_stability.loops import sampled
from stillhook.analysis.loop_stability.margins import margins
from stillhook.analysis.loop_stability.transfer import position_loop
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.simulate import run_cases
from stillhook.errors import StillhookError
from stillhook.library import changed, cranes
from stillhook.thesis.ringing import rms_above

pytestmark = pytest.mark.slow

CRANE = load_crane("nov-250t")
CALM = changed(CRANE, {"wire": {"zeta": 0.95, "zeta_low": 0.95, "zeta_high": 0.95}})
"""A wire on which the load does not ring (that of paper C)."""
FAST = Scenario(load="100 t", s_w="100 m", tip="sine 2.5 m 12 s", duration="80 s")
HEAVY = Scenario(load="200 t", s_w="100 m", tip="sine 1.6 m 10 s", duration="80 s")
RINGING, LOAD_RINGS = 0.5, 1.0
"""Frequency above which pressure is ringing and not the wave's [Hz]: the circuit's own lies at 1.2 to 2 Hz, waves below
0.2 Hz. 200 t on 100 m of the library's wire swing at 0.8 Hz for minutes: above 1 Hz is the circuit alone."""
MORE_RINGING = 1.25
"""Strong SSC may ring so much more than published SSC [-]; measured 1.0 to 1.1. Without damping it would be many times
as much."""
MORE_PRESSURE, LOAD_SWINGS = 1.05, 1.10
"""Price in pressure [-]; measured 2 to 3 %, and 4 to 9 % with the load's swing on the library's wire, which a stronger
gain follows more."""
LEFT = 0.75
"""What is left of the error of published SSC [-]; measured 0.4 on the calm wire, 0.67 on the library's, which allows half
of the gain."""
OFF_BEST = 1.5
"""How far from the best lead's error that of the rule may lie [-]: what is left beyond is leakage, which no lead
belongs to."""


CLOSED = tuple(name for name in cranes() if load_crane(name).plant.type.steady_operation)


@pytest.mark.thorough
@pytest.mark.parametrize("name", CLOSED)
def test_it_keeps_the_margins_of_the_complete_plant_and_of_the_published_loop(name: str) -> None:
    crane = load_crane(name)
    strong = controller("strong-ssc").on(crane)
    found = governing(crane, DEFAULT_MODE)
    loops = [p.loop for p in found.decide]
    published = position_loop(strong, strong.active.motor.alpha_min)
    for loop in (*loops, sampled(published, strong.control.t_cycle, strong.control.computing)):
        assert loop is not None
        m = margins(loop, strong.control.K_p)
        assert m.stable
        assert m.gain_margin >= 2.0
        assert m.phase_margin >= math.radians(45.0)
        assert m.sensitivity_peak <= 2.0
    assert strong.control.K_p > crane.control.K_p


def test_a_late_motion_signal_lengthens_the_lead_by_as_much_and_leaves_the_gain() -> None:
    now, late = strong_ssc(CRANE).on(CRANE), strong_ssc(CRANE, delay=0.1).on(CRANE)
    assert late.control.K_p == now.control.K_p
    assert lateness(CRANE, delay=0.1) - lateness(CRANE) == pytest.approx(0.1)
    assert CRANE.control.t_cycle / 2.0 < lateness(CRANE) < CRANE.control.t_cycle * 3.0


@pytest.mark.parametrize(
    ("crane", "price"), [(CALM, MORE_PRESSURE), (CRANE, LOAD_SWINGS)], ids=["calm wire", "library"]
)
@pytest.mark.parametrize("case", [FAST, HEAVY])
def test_it_takes_error_off_published_ssc_for_a_little_pressure(case: Scenario, crane: Crane, price: float) -> None:
    published, strong = run_cases([crane, strong_ssc(crane).on(crane)], case)
    assert strong["status"] == published["status"] == "ok"
    assert strong["e_c_pp"] < LEFT * published["e_c_pp"]
    assert published["p_max"] < strong["p_max"] < price * published["p_max"]


@pytest.mark.parametrize(("crane", "frequency"), [(CALM, RINGING), (CRANE, LOAD_RINGS)], ids=["calm wire", "library"])
def test_it_does_not_ring_on_the_whole_twin(crane: Crane, frequency: float) -> None:
    def ringing(crane: Crane) -> float:
        run = simulate(crane, HEAVY, every="0.02 s")
        return rms_above(run, "p_a", frequency=frequency, start=30.0)

    assert ringing(strong_ssc(crane).on(crane)) < MORE_RINGING * ringing(crane)


@pytest.mark.parametrize("delay", [0.0, 0.1])
def test_the_lead_of_the_rule_is_near_the_best_one(delay: float) -> None:
    strong = strong_ssc(CRANE, delay=delay).on(CRANE)
    rule = strong.control.t_lead
    assert rule is not None
    leads = [rule, delay, *(delay + x for x in (0.01, 0.02, 0.03, 0.045))]
    machines = [strong.model_copy(update={"control": strong.control.model_copy(update={"t_lead": t})}) for t in leads]
    sensed = FAST.model_copy(update={"sensors": FAST.sensors.model_copy(update={"delay": delay})})
    ours, none, *others = [s["e_c_pp"] for s in run_cases(machines, sensed)]
    assert ours < none
    assert ours < OFF_BEST * min(others)


@pytest.mark.parametrize("delay", [-0.1, 2.0, math.nan])
@pytest.mark.parametrize("name", ["delay", "command_delay"])
def test_a_delay_that_is_none_is_refused(delay: float, name: str) -> None:
    with pytest.raises(StillhookError, match=f"^{name} = .* 0 up to 1 s"):
        strong_ssc(CRANE, **{name: delay})
