"""What reaches the PLC in each cycle: tip, sensors, operator, mode, faults."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from stillhook import Recorded, Scenario, load_crane, simulate
from stillhook.control.registry import CONTROLLERS, code_of
from stillhook.engine.inputs import (
    THIN,
    TICK,
    CycleInputs,
    hermite_weights,
    mode_codes,
    operator_motion,
    pump_shares,
    scale_weights,
)
from stillhook.spec.scenario import Mode, Operator, PowerLoss, Sensors
from stillhook.winches.records import Tick

CRANE = load_crane("nov-250t")
CYCLE = 0.01
INTEGRAL = 1.0e-6
"""Adaptive quadrature of a speed in pieces [m]."""
ROUNDING = 1.0e-12
SEA = "sine 2 m 12 s"


def drive(**case) -> CycleInputs:
    return CycleInputs(CRANE, Scenario(**({"load": "80 t", "s_w": "200 m", "tip": SEA, "duration": "60 s"} | case)))


def column(rows: np.ndarray, name: str) -> np.ndarray:
    return rows[:, Tick._fields.index(name)]


# Between two cycles


@pytest.mark.slow
@given(st.lists(st.floats(-5.0, 5.0), min_size=6, max_size=6), st.integers(1, 10))
def test_between_two_cycles_the_tip_is_the_quintic_that_fits_both_ends(c, n_sub):
    p = np.polynomial.Polynomial(c)
    v, a = p.deriv(), p.deriv(2)
    ends = np.array([p(0.0), v(0.0), a(0.0), p(CYCLE), v(CYCLE), a(CYCLE)])
    H = scale_weights(hermite_weights(n_sub), CYCLE).reshape(-1, 12)
    t = np.arange(1, 2 * n_sub + 1) * CYCLE / (2 * n_sub)
    assert np.allclose(H[:, :6] @ ends, p(t), atol=1e-11)
    assert np.allclose(H[:, 6:] @ ends, v(t), atol=1e-9)


# Operator


speeds = st.floats(-1.0, 1.0)
gaps = st.sampled_from([0.0, 0.5, 1.3, 7.0])


@pytest.mark.thorough
@given(st.lists(st.tuples(gaps, speeds), min_size=1, max_size=6), st.floats(0.0, 5.0))
def test_what_the_stick_asks_for_in_all_is_the_integral_of_its_speed(steps, start):
    times = start + np.cumsum([g for g, _ in steps])
    knots = [(f"{t!r} s", f"{v!r} m/s") for t, (_, v) in zip(times.tolist(), steps, strict=True)]
    operator = Operator(profile=tuple(knots))
    t = np.array([0.0, 0.7, 3.1, 6.0, 12.5, 30.0])
    _, s = operator_motion(operator, t)
    edges = sorted({0.0, *times.tolist()})
    for time, total in zip(t, s, strict=True):
        pieces = [e for e in edges if e < time] + [float(time)]
        area = sum(quad(lambda x: operator_motion(operator, np.array([x]))[0][0], a, b)[0] for a, b in pairwise(pieces))
        assert total == pytest.approx(area, abs=INTEGRAL)


def test_a_jump_of_the_stick_moves_the_reference_by_nothing_at_that_moment():
    operator = Operator(profile=(("0 s", "0 m/s"), ("10 s", "0 m/s"), ("10 s", "0.5 m/s"), ("20 s", "0.5 m/s")))
    v, s = operator_motion(operator, np.array([9.99, 10.0, 12.0]))
    assert v.tolist() == [0.0, 0.5, 0.5]
    assert s.tolist() == [0.0, 0.0, 1.0]


def test_before_the_first_and_after_the_last_point_the_nearest_speed_holds():
    v, s = operator_motion(Operator(profile=(("5 s", "0.2 m/s"), ("6 s", "0.4 m/s"))), np.array([0.0, 5.0, 6.0, 16.0]))
    assert v.tolist() == [0.2, 0.2, 0.4, 0.4]
    assert s == pytest.approx([0.0, 1.0, 1.3, 5.3])


def test_set_point_steps_ask_for_length_and_for_no_speed():
    v, s = operator_motion(Operator(steps=(("5 s", "0.2 m"), ("8 s", "-0.5 m"))), np.array([4.99, 5.0, 8.0]))
    assert v.tolist() == [0.0, 0.0, 0.0]
    assert s == pytest.approx([0.0, 0.2, -0.3])


# Modes and faults


def test_a_mode_is_in_force_from_its_time_on():
    case = Scenario(load="80 t", s_w="1 m", mode="ns", modes=(("10 s", "hs"), ("20 s", "ssc")))
    codes = mode_codes(case.mode, case.modes, np.array([0.0, 9.99, 10.0, 19.99, 20.0, 99.0]))
    assert codes.tolist() == [code_of(m) for m in (Mode.NS, Mode.NS, Mode.HS, Mode.HS, Mode.SSC, Mode.SSC)]


def test_every_mode_has_its_own_code():
    assert len({law.code for law in CONTROLLERS.values()}) == len(Mode)


@pytest.mark.parametrize("unit", [1, 2, 3])
def test_a_lost_power_unit_takes_its_share_and_the_plc_learns_of_it_later(unit):
    pumps = CRANE.active.pump.D
    loss = PowerLoss(time="10 s", unit=unit, run_down="0.4 s", detection="0.1 s")
    t = np.array([9.99, 10.0, 10.2, 10.4, 50.0])
    there, known = pump_shares(loss, pumps, t)
    left = 1.0 - pumps[unit - 1] / sum(pumps)
    assert there == pytest.approx([1.0, 1.0, 0.5 * (1.0 + left), left, left])
    assert known == pytest.approx([1.0, 1.0, left, left, left])
    assert np.all(pump_shares(None, pumps, t)[0] == 1.0)


# Sensors


def test_a_delayed_tip_is_the_tip_of_that_time_ago():
    rows = drive(sensors=Sensors(delay="0.25 s")).rows(0, 6001)
    for true, seen in (("s", "s_m"), ("v", "v_m"), ("a", "a_m")):
        assert np.allclose(column(rows, seen)[25:], column(rows, true)[:-25], atol=ROUNDING)
        assert np.all(column(rows, seen)[:25] == column(rows, true)[0])


def test_ideal_sensors_see_the_tip_itself():
    rows = drive(modes=(("50 s", "ns"),)).rows(0, 6001)
    for true, seen in (("s", "s_m"), ("v", "v_m"), ("a", "a_m")):
        assert np.array_equal(column(rows, true), column(rows, seen))


def test_noise_has_its_stated_size_and_comes_from_the_seed():
    def seen(seed: int) -> np.ndarray:
        return column(drive(sensors=Sensors(noise_v_tip="0.05 m/s", seed=seed)).rows(0, 6001), "v_m")

    noise = seen(7) - column(drive(modes=(("50 s", "ns"),)).rows(0, 6001), "v")
    assert noise.std() == pytest.approx(0.05, rel=0.05)
    assert abs(noise.mean()) < 0.005
    assert np.array_equal(seen(7), seen(7))
    assert not np.array_equal(seen(7), seen(8))


def test_noise_on_one_signal_leaves_the_noise_of_the_others_as_it_is():
    alone = drive(sensors=Sensors(noise_s_w="1 mm", seed=3)).rows(0, 3001)
    both = drive(sensors=Sensors(noise_s_w="1 mm", noise_F="1 kN", noise_s_tip="1 cm", seed=3)).rows(0, 3001)
    assert np.array_equal(column(alone, "n_s"), column(both, "n_s"))
    assert np.all(column(alone, "n_F") == 0.0)
    assert column(both, "n_F").std() == pytest.approx(1e3, rel=0.1)


def test_a_coarse_signal_moves_in_its_steps():
    seen = column(drive(sensors=Sensors(step_s_tip="1 cm")).rows(0, 6001), "s_m")
    assert np.max(np.abs(seen / 0.01 - np.round(seen / 0.01))) < 1e-9
    assert len(np.unique(np.round(seen, 4))) > 100


# Rows


def test_only_the_tip_is_handed_over_where_only_the_tip_moves_and_the_bits_are_the_same():
    plain = Scenario(load="80 t", s_w="200 m", tip=SEA, duration="40 s", warm_up="10 s")
    same = plain.model_copy(update={"modes": ((20.0, Mode.SSC),)})
    assert CycleInputs(CRANE, plain).cols == THIN
    assert CycleInputs(CRANE, same).cols == TICK == len(Tick._fields)
    a, b = (simulate(CRANE, c) for c in (plain, same))
    for name in ("s_w", "p_a", "e_c", "u_p"):
        assert np.array_equal(a[name].values, b[name].values)


def test_pieces_of_the_drive_join_without_a_seam():
    d = drive(sensors=Sensors(delay="0.1 s", noise_s_tip="1 mm", noise_F="1 kN"))
    whole = d.rows(0, 6001)
    assert np.array_equal(whole, np.vstack([d.rows(0, 1000), d.rows(1000, 5001)]))
    assert np.array_equal(d.first_row(), whole[0])


def test_a_ramped_motion_starts_at_rest():
    s, v, a = drive(ramp="10 s").rows(0, 1)[0]
    assert (s, v, a) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("end", [40.0, 40.004, 40.006, 39.999])
def test_a_record_that_ends_between_two_cycles_is_run_to_its_last_whole_cycle(end):
    t = np.linspace(0.0, end, 81)
    motion = Recorded(t, np.sin(2.0 * math.pi * t / 10.0))
    data = simulate(CRANE, Scenario(load="80 t", s_w="200 m", tip=motion, warm_up="10 s"), every="10 ms")
    assert end - CYCLE < float(data.time[-1]) <= end + ROUNDING
