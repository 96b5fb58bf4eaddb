"""Inputs from outside: what is in force, how old it is, and what holds when nothing comes any more."""

from __future__ import annotations

import math

import pytest

from stillhook.live.runtime.board import INPUT_CELLS, MOST_INPUTS
from stillhook.live.runtime.inputs import CARRIED, COAST, RATES, Inputs, InputWriter, Motion, carried
from stillhook.live.runtime.ring import Ring

NAMES = ("s_tip", "v_tip", "a_tip", "v_op", "mode", "K_p")
STREAMED, TIMEOUT = 4, 1.0
MOVING = {"s_tip": 1.0, "v_tip": 0.5, "a_tip": -0.2}


@pytest.fixture
def both() -> tuple[InputWriter, Inputs]:
    slots, width = 4, INPUT_CELLS * MOST_INPUTS
    of = Ring(memoryview(bytearray(Ring.size(slots, width))), slots, width)
    return InputWriter(of, NAMES), Inputs(of, NAMES, STREAMED, TIMEOUT)


def test_a_motion_is_carried_by_its_own_acceleration():
    t = CARRIED / 2.0
    assert carried(Motion(1.0, 0.5, -0.2), t) == pytest.approx((1.0 + 0.5 * t - 0.1 * t**2, 0.5 - 0.2 * t, -0.2))


def test_a_motion_that_ends_comes_to_rest_without_a_jump():
    """Height and speed go on smoothly where the carrying ends, and speed is the height's rate all along."""
    sample, step = Motion(1.0, 0.5, -0.2), 1.0e-6
    for age in (CARRIED, 2.0 * CARRIED, 1.0, 3.0):
        before, after = carried(sample, age - step), carried(sample, age + step)
        assert after.s - before.s == pytest.approx(2.0 * step * carried(sample, age).v, rel=1e-4)
        assert after.v == pytest.approx(before.v, abs=1e-5)
    end = carried(sample, 60.0)
    assert end.v == pytest.approx(0.0, abs=1e-12)
    assert abs(end.s - 1.0) < 0.5 * (CARRIED + COAST)


def test_what_was_written_together_is_in_force_together(both: tuple[InputWriter, Inputs]):
    writer, inputs = both
    writer.write({"mode": 5.0, "K_p": 0.2}, 10.0)
    inputs.read()
    assert inputs.due(10.0, 0.0) == {"mode": 5.0, "K_p": 0.2}
    assert inputs.due(10.01, 0.0) == {}
    assert inputs.motion(10.0) == {}


def test_half_a_motion_is_said_and_not_used(both: tuple[InputWriter, Inputs]):
    writer, inputs = both
    writer.write({"s_tip": 1.0, "v_tip": 0.0}, 10.0)
    inputs.read()
    assert inputs.partial
    assert inputs.motion(10.0) == {}


def test_streamed_inputs_go_stale_and_settings_do_not(both: tuple[InputWriter, Inputs]):
    writer, inputs = both
    writer.write({**MOVING, "mode": 5.0}, 10.0)
    inputs.read()
    inputs.due(10.0 + TIMEOUT, 0.0)
    assert inputs.stale == frozenset()
    inputs.due(10.001 + TIMEOUT, 0.0)
    assert inputs.stale == set(MOVING)
    writer.write(MOVING, 12.0)
    inputs.read()
    inputs.due(12.0, 0.0)
    assert inputs.stale == frozenset()


@pytest.mark.parametrize("name", RATES)
def test_a_silent_operator_or_plc_lets_go_of_the_winch(name: str):
    slots, width = 4, INPUT_CELLS * MOST_INPUTS
    of = Ring(memoryview(bytearray(Ring.size(slots, width))), slots, width)
    writer, inputs = InputWriter(of, RATES), Inputs(of, RATES, len(RATES), TIMEOUT)
    writer.write({name: 0.3}, 10.0)
    inputs.read()
    assert inputs.due(10.0, 0.0) == {name: 0.3}
    assert inputs.due(11.1, 0.0) == {name: 0.0}
    assert inputs.due(11.2, 0.0) == {}
    writer.write({name: 0.3}, 12.0)
    inputs.read()
    assert inputs.due(12.0, 0.0) == {name: 0.3}


def test_commands_that_were_handed_back_change_nothing_and_do_not_go_stale():
    slots, width = 4, INPUT_CELLS * MOST_INPUTS
    of = Ring(memoryview(bytearray(Ring.size(slots, width))), slots, width)
    names = ("override", "u_p")
    writer, inputs = InputWriter(of, names), Inputs(of, names, 2, TIMEOUT)
    writer.write({"override": 1.0, "u_p": 0.5}, 10.0)
    inputs.read()
    inputs.due(10.0, 0.0)
    writer.write({"override": 0.0}, 10.1)
    inputs.read()
    assert inputs.due(10.1, 0.0) == {"override": 0.0}
    assert inputs.due(12.0, 0.0) == {}
    assert (inputs.stale, inputs.age) == (frozenset(), 0.0)
    writer.write({"override": 1.0, "u_p": 0.5}, 13.0)
    inputs.read()
    assert inputs.due(13.0, 0.0) == {"override": 1.0, "u_p": 0.5}
    assert inputs.due(14.1, 0.0) == {"u_p": 0.0}


def test_the_delay_of_the_source_is_by_its_own_stamp(both: tuple[InputWriter, Inputs]):
    writer, inputs = both
    offset = 1.7e9
    writer.write(MOVING, 10.0, stamp=offset + 9.96)
    inputs.read()
    inputs.due(10.0, offset)
    assert inputs.source_delay == pytest.approx(0.04, abs=1e-6)


def test_a_saved_motion_goes_on_at_its_age(both: tuple[InputWriter, Inputs]):
    writer, inputs = both
    writer.write(MOVING, 10.0)
    inputs.read()
    saved = inputs.saved(10.3)
    other = Inputs(Ring(memoryview(bytearray(Ring.size(2, 1))), 2, 1), NAMES, STREAMED, TIMEOUT)
    other.resume(saved, 500.0)
    assert other.motion(500.0) == pytest.approx(inputs.motion(10.3))


def test_a_clock_that_runs_faster_ages_inputs_faster():
    slots, width = 4, INPUT_CELLS * MOST_INPUTS
    of = Ring(memoryview(bytearray(Ring.size(slots, width))), slots, width)
    inputs = Inputs(of, NAMES, STREAMED, TIMEOUT, 10.0)
    InputWriter(of, NAMES).write(MOVING, 10.0)
    inputs._seen = 0
    inputs.read()
    assert inputs.motion(10.005)["v_tip"] == pytest.approx(0.5 - 0.2 * 0.05)
    inputs.due(10.11, 0.0)
    assert inputs.stale
    assert math.isclose(inputs.age, 1.1, abs_tol=1e-9)
