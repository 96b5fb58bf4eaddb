"""The guard's tests and reactions, one by one."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.export.plc.cases import CLOSED, block_of

from stillhook.control.commands import IDLE_MOST, idle_time
from stillhook.control.guard import (
    LAW_FAULT,
    inside,
    inside_or,
    known_mode,
    limited,
    memory_at_start,
    sound_demand,
    sound_memory,
    towards_zero,
)
from stillhook.control.interface import Demand, Sensed
from stillhook.control.plc import ActuatorCommands
from stillhook.engine.pack.guard import guard_settings, time_to_stop
from stillhook.export.plc.sequence import GOOD, Reference
from stillhook.library import cranes, load_crane

NAN, INF = float("nan"), float("inf")
finite = st.floats(allow_nan=False, allow_infinity=False)


class Number:
    """A NaN whose six comparisons with every number have given answers."""

    def __init__(self, answers: tuple[bool, ...]) -> None:
        self.lt, self.le, self.eq, self.ne, self.gt, self.ge = answers

    def __lt__(self, other: object) -> bool:
        return self.lt

    def __le__(self, other: object) -> bool:
        return self.le

    def __eq__(self, other: object) -> bool:
        return self.eq

    def __ne__(self, other: object) -> bool:
        return self.ne

    def __gt__(self, other: object) -> bool:
        return self.gt

    def __ge__(self, other: object) -> bool:
        return self.ge

    __hash__ = None  # type: ignore[assignment]


@pytest.mark.parametrize("answers", list(itertools.product((False, True), repeat=6)))
def test_a_nan_is_inside_no_range_whatever_a_plc_answers(answers):
    """Unless it answers as a number between the ends does: then no comparison tells them apart."""
    lt, le, eq, _, gt, ge = answers
    as_a_number_between = le and ge and not lt and not gt and not eq
    assert inside(Number(answers), -1.0, 1.0) == as_a_number_between
    assert not inside(Number(answers), -1.0, 1.0) or (eq, lt, gt) == (False, False, False)


@given(x=finite, lo=finite, width=st.floats(1e-6, 1e6))
@settings(deadline=None)
def test_a_number_is_inside_a_range_where_it_lies_between_its_ends(x, lo, width):
    hi = lo + width
    if lo < hi:
        assert inside(x, lo, hi) == (lo <= x <= hi)
        assert inside(lo, lo, hi)
        assert inside(hi, lo, hi)


@pytest.mark.parametrize("x", [NAN, INF, -INF])
def test_what_is_no_number_gives_way(x):
    assert inside_or(x, -1e300, 1e300, 7.0) == 7.0


@pytest.mark.parametrize(
    ("mode", "known"), [(0.0, True), (-0.0, True), (5.0, True), (4.0, False), (5.1, False), (-1.0, False), (NAN, False)]
)
def test_manual_and_its_own_are_the_modes_of_a_controller(mode, known):
    assert known_mode(mode, 5.0) is known


@given(x=st.floats(-10.0, 10.0), step=st.floats(1e-3, 1.0))
@settings(deadline=None)
def test_a_ramp_ends_at_zero_and_never_passes_it(x, step):
    y = towards_zero(x, step)
    assert abs(y) == pytest.approx(max(abs(x) - step, 0.0))
    assert x * y >= 0.0


def test_the_idle_time_ends_and_loses_no_cycle():
    t = idle_time(IDLE_MOST, True, 0.01)
    assert t == IDLE_MOST
    assert idle_time(-IDLE_MOST, False, 0.01) == -IDLE_MOST
    assert idle_time(IDLE_MOST - 1.0, True, 1e-4) > IDLE_MOST - 1.0
    assert idle_time(IDLE_MOST, False, 0.01) == -0.01


@pytest.mark.long
@pytest.mark.parametrize("name", cranes())
def test_every_crane_has_ranges_that_its_own_values_at_rest_are_in(name):
    crane = load_crane(name)
    block = block_of(name, crane.plant.type.default_mode.value)
    s = guard_settings(crane, block.plc, block.control)
    for low, high, step, start in zip(s.least, s.most, s.step, s.start, strict=True):
        assert low < high
        assert step > 0.0
        assert inside(start, low, high)
    assert math.isfinite(time_to_stop(s, block.plc))


@pytest.mark.parametrize("wrong", [NAN, INF, -INF, 1e200])
@pytest.mark.parametrize("field", ["u_p", "u_m"])
def test_a_demand_that_is_no_number_leaves_the_last_command(field, wrong):
    block = block_of(CLOSED, "ssc")
    m = block.memory._replace(u_p=0.4, u_m=0.8)
    g = memory_at_start(block.guard)
    demand, after = sound_demand(Demand(0.1, 0.9)._replace(**{field: wrong}), 0.0, m, g)
    assert demand == (0.4, 0.8)
    assert after.fault == LAW_FAULT
    kept, after = sound_demand(Demand(0.1, 0.9), 0.0, m, g)
    assert kept == (0.1, 0.9)
    assert after.fault == 0.0
    assert sound_demand(Demand(0.1, 0.9), 1.0, m, g)[1].fault == LAW_FAULT


@pytest.mark.parametrize("x", [NAN, INF, -INF, 1e9])
def test_commands_that_are_no_numbers_hold_the_winch(x):
    plc = block_of(CLOSED, "ssc").plc
    drive = limited(ActuatorCommands(x, x, x, x, x, x), plc)
    assert (drive.u_p, drive.u_m, drive.brake) == (0.0, 1.0, 1.0)
    assert all(math.isfinite(value) for value in drive)


@pytest.mark.parametrize("field", ["mode", "datum", "F", "p_mean", "u_p", "u_m", "b_p", "b_m", "held", "brake", "idle"])
def test_a_memory_that_is_no_number_is_set_to_rest(field):
    block = block_of(CLOSED, "ssc")
    assert sound_memory(block.memory, 1e6, 2e7, 1.0) == (block.memory, 0.0)
    rest, wrong = sound_memory(block.memory._replace(**{field: NAN}), 1e6, 2e7, 1.0)
    assert wrong == 1.0
    assert (rest.u_p, rest.brake, rest.F, rest.mode) == (0.0, 1.0, 1e6, 0.0)


def seen(**changes: float) -> Sensed:
    y = Sensed(
        s_tip=0.0, v_tip=0.0, a_tip=0.0, v_op=0.0, s_op=0.0, mode=5.0, f_pump=1.0, s_w=100.0, F=1e6, alpha_m=1.0,
        K_wire=1.0, dp=1e7, dp_load=1e7, p_hp=2e7, omega_m=0.0, p_a=1.2e7, p_b=2e6,
    )  # fmt: skip
    return y._replace(**changes)


def test_a_motion_unit_that_fails_for_a_moment_goes_on_at_its_last_speed():
    reference = Reference(block_of(CLOSED, "ssc"))
    for k in range(100):
        reference.step(seen(s_tip=0.002 * k, v_tip=0.2))
    for _ in range(10):
        reference.step(seen(s_tip=NAN, v_tip=NAN, a_tip=NAN))
    used = reference.laws.guard.g.used
    assert used.v_tip == 0.2
    assert used.s_tip == pytest.approx(0.198 + 10 * 0.01 * 0.2)


@pytest.mark.long
def test_a_load_cell_that_is_bad_leaves_the_filtered_load_where_it_is():
    reference = Reference(block_of(CLOSED, "ssc"))
    for k in range(200):
        reference.step(seen(F=1e5 + 1e4 * math.sin(0.05 * k)))
    before = reference.m.F
    assert abs(before - 1e5) < 5e3
    for _ in range(6000):
        out = reference.step(seen(F=INF))
    assert reference.laws.guard.g.used.F == reference.m.F == pytest.approx(before)
    assert out.state == 1.0


@pytest.mark.parametrize("signal", ["dp", "dp_load", "F"])
def test_a_closed_brake_stays_closed_on_bad_pressures_and_a_bad_load_cell(signal):
    block = block_of(CLOSED, "ssc")
    for bad, moves in ((1.0, True), (0.0, False)):
        reference = Reference(block)
        reference.step(seen(mode=0.0))
        quality = GOOD._replace(**{signal: bad})
        for _ in range(15):
            out = reference.step(seen(mode=0.0, v_op=0.1), quality)
        assert (out.brake < 1.0) == moves


def test_with_its_wire_encoder_gone_for_a_moment_the_feedback_stays_as_it_is():
    reference = Reference(block_of(CLOSED, "ssc"))
    for k in range(100):
        held = reference.step(seen(s_tip=0.002 * k, v_tip=0.2)).e_c
    for k in range(100, 110):
        out = reference.step(seen(s_tip=0.002 * k, v_tip=0.2, s_w=NAN))
        assert out.e_c == pytest.approx(held, abs=1e-12)
