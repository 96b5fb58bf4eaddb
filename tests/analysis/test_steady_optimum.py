"""Steady operation under a law that senses the displacement itself, against the twin in waves so long that each moment
is nearly steady."""

import math

import numpy as np
import pytest

from stillhook import Scenario, load_crane, simulate
from stillhook.analysis.loop_stability.sweeps import motor_pole_figure
from stillhook.analysis.loop_stability.transfer import motor_poles
from stillhook.analysis.steady.steady_state import speed_limit, steady

CRANE = load_crane("nov-250t")
PERIOD = 60.0
LEAKAGE = 0.08
"""Share of the pumps that leakage takes at most, which the ideal machine does not have."""


@pytest.mark.slow
@pytest.mark.parametrize("v", [1.3, 1.5])
def test_the_displacement_is_that_of_the_twin_but_for_leakage(v: float):
    tip = f"sine {0.5 * v * PERIOD / math.pi:.4f} m {PERIOD:g} s"
    case = Scenario(load="60 t", s_w="500 m", tip=tip, mode="ssc-optimal", duration="110 s", warm_up="40 s")
    run = simulate(CRANE, case, every="50 ms").sel(time=slice(40.0, None))
    fastest = int(np.argmax(np.abs(run.v_tip.values)))
    assert 1.0 - LEAKAGE < float(run.alpha_m[fastest]) / steady(CRANE, v, "ssc-optimal").alpha_m <= 1.0


@pytest.mark.parametrize("name", ["nov-250t", "nov-150t", "nov-100t-pure-active"])
def test_pumps_are_never_full_below_the_speed_limit(name: str):
    crane = load_crane(name)
    for v in np.linspace(0.0, 0.999 * speed_limit(crane, "ssc-optimal"), 40):
        at = steady(crane, v, "ssc-optimal")
        assert not at.saturated
        assert at.u_p <= max(0.9, v / speed_limit(crane, "ssc-optimal")) + 1e-9  # what it may take of the flow


@pytest.mark.parametrize("v", [0.5, 1.4, 1.9])
def test_a_law_by_the_speed_alone_leaves_the_motors_their_own_poles(v: float):
    poles = motor_poles(CRANE, v, mode="ssc-optimal")
    assert np.allclose(poles, motor_poles(CRANE, 0.0, mode="ns"))


@pytest.mark.slow
def test_its_poles_are_in_the_picture():
    labels = [text.get_text() for text in motor_pole_figure(CRANE).axes[0].get_legend().get_texts()]
    assert sum("ssc-optimal" in label for label in labels) == 2
    assert len(labels) == 6  # laws that are alike in steady motion share a line
