"""Margins out of the running engine: those of the closed circuit come out as its own linearisation has them, and a
winch beyond its limit swings in a run."""

from __future__ import annotations

import numpy as np
import pytest

from stillhook import Scenario, load_crane, simulate
from stillhook.analysis.loop_stability.engine_loop import engine_loop, engine_points
from stillhook.analysis.loop_stability.governing import (
    Place,
    governing,
    plant_loop_at,
    slow_places,
    with_damped_wire,
)
from stillhook.analysis.loop_stability.margins import gain_limit_of
from stillhook.analysis.loop_stability.stability import engine_stability
from stillhook.control.registry import Mode
from stillhook.errors import StillhookError
from stillhook.sea.motion.motion import Profile
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator

OF_ITS_OWN = 0.01
"""Gain limit of the engine over that at the exact operating point [-]: the run has settled to 1 % of its speed, and the
accumulator has moved from mid stroke."""
DRIVES = ("nov-100t-electric", "nov-250t-secondary", "nov-100t-cylinder", "utility-20t-open-circuit")


@pytest.mark.parametrize("mode", [Mode.NS, Mode.SSC])
@pytest.mark.parametrize("name", ["nov-100t-pure-active", "nov-250t"])
def test_a_closed_circuit_has_the_same_limit_as_by_its_own_linearisation(name: str, mode: Mode) -> None:
    crane = with_damped_wire(load_crane(name))
    places = slow_places((0.0, 0.5 * crane.SWL), (100.0,), (2.0 / 60.0,))
    for place, point in zip(places, engine_points(crane, mode, places), strict=True):
        own = plant_loop_at(crane, mode, place)
        assert point is not None
        assert own is not None
        limit, omega = gain_limit_of(engine_loop(point))
        theirs, omega_own = gain_limit_of(own.loop)
        assert limit == pytest.approx(theirs, rel=OF_ITS_OWN)
        assert omega == pytest.approx(omega_own, rel=OF_ITS_OWN)


def with_gain(crane: Crane, K_p: float) -> Crane:
    return crane.model_copy(update={"control": crane.control.model_copy(update={"K_p": K_p})})


def swing(crane: Crane, place: Place) -> float:
    """Standard deviation of the control error over the last part of a step's answer [m], the tip at a slow speed."""
    tip = Profile([("0 s", "0 m/min"), ("5 s", "2 m/min"), ("45 s", "2 m/min"), ("50 s", "0 m/min")])
    case = Scenario(
        load=f"{place.load!r} kg",
        s_w=f"{place.s_w!r} m",
        tip=tip,
        mode="position",
        operator=Operator(steps=(("10 s", "1 cm"),)),
        duration="40 s",
        warm_up="30 s",
    )
    return float(simulate(crane, case, on_failure="mark").e_c_std)


@pytest.mark.thorough
@pytest.mark.parametrize("name", DRIVES)
def test_beyond_the_limit_a_drive_swings_and_below_it_does_not(name: str) -> None:
    crane = with_damped_wire(load_crane(name))
    found = engine_stability(crane, wires=(100.0,), loads=(0.3 * crane.SWL,))
    calm, wild = (swing(with_gain(crane, f * found.K_p_ms_plc), found.place) for f in (0.7, 1.4))
    assert wild > 10.0 * calm or not np.isfinite(wild)


@pytest.mark.parametrize("name", DRIVES)
def test_every_drive_of_the_library_keeps_a_gain_margin_of_two(name: str) -> None:
    crane = load_crane(name)
    found = engine_stability(crane)
    assert found.ok
    assert found.gain_margin_plc >= 2.0
    assert governing(crane, crane.plant.type.default_mode).K_p >= found.K_p_strong * (1.0 - 1e-9)


def test_a_delay_lowers_the_limit_of_a_drive_without_resonance() -> None:
    crane = load_crane("nov-100t-electric")
    prompt, late = (engine_stability(crane, delay=delay).K_p_ms_plc for delay in (0.0, 0.1))
    assert late < prompt


def test_a_speed_that_is_no_number_is_one_line() -> None:
    with pytest.raises(StillhookError, match="give a finite speed"):
        engine_stability(load_crane("nov-100t-electric"), v_tip=float("nan"))
