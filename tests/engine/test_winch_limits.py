"""Limits of the machine beside its circuits: wire damping, hydraulic power, boost flow, computing delay and holding brake."""

from functools import cache

import numpy as np
import pytest

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.library import changed
from stillhook.spec.lift.lowering import Lowering, Rigging
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Operator, Still

DECREMENT = 0.15
"""Damping ratio from peaks, relative: friction of a winch that gives way by a millimetre adds some, and so does the sampling of peaks."""
STANDS = 0.01
"""Wire that a winch on its brake may lose [m]: the brake's elastic travel, millimetres."""
JERK = 0.25
"""Swing of the tension as the brake opens, over the hook load: less than a fifth of what a sudden load makes (a swing of once the load)."""


@cache
def crane(name: str = "nov-250t"):
    return load_crane(name)


def damped(zeta: float):
    return changed(crane(), {"wire": {"zeta": zeta, "zeta_low": zeta, "zeta_high": zeta}})


def ratio_of(t: np.ndarray, y: np.ndarray) -> float:
    """Damping ratio of a free swing from the decay of its peaks."""
    y = y - y[-1]
    peaks = [i for i in range(1, len(y) - 1) if y[i - 1] < y[i] >= y[i + 1] and y[i] > 0.02 * np.max(y)][:12]
    decrement = np.log(y[peaks[0]] / y[peaks[-1]]) / (len(peaks) - 1)
    return float(decrement / np.hypot(decrement, 2.0 * np.pi))


@pytest.mark.slow
@pytest.mark.parametrize("s_w", ["60 m", "400 m"])
def test_a_load_on_a_braked_winch_swings_with_the_damping_ratio_of_the_wire(s_w):
    """The free swing after the tip has moved by 5 cm and stands again: logarithmic decrement."""
    from stillhook.sea.motion.motion import Profile

    tip = Profile.from_si([0.0, 0.5, 1.0], [0.0, 0.1, 0.0])
    run = simulate(
        damped(0.03),
        Scenario(load="150 t", s_w=s_w, tip=tip, mode="manual", duration="60 s", warm_up="1 s", ramp="0 s"),
        every="0.01 s",
    )
    late = run.time.values > 2.0
    assert ratio_of(run.time.values[late], run.s_load.values[late]) == pytest.approx(0.03, rel=DECREMENT)


@pytest.mark.thorough
def test_simulate_and_lower_damp_the_same_load_on_the_same_wire_alike():
    from stillhook.sea.motion.motion import Profile

    tip = Profile.from_si([0.0, 0.5, 1.0], [0.0, 0.1, 0.0])
    own = damped(0.03)
    levels = tuple({"h": f"{h} m", "V": "0 m^3", "A33": "0 t", "A_p": "0 m^2"} for h in (0.0, 5.0))
    load = Payload(name="box", mass="150 t", height="5 m", C_D=0.0, levels=levels)
    lift = Lowering(
        payload=load,
        rigging=Rigging(zeta=0.0, stiffness="5e9 N/m"),
        tip=tip,
        h_tip="215 m",
        depth="100 m",
        start_depth="0 m",
        programme=(Phase(mode="manual", time="9000 s"),),
        duration="60 s",
        ramp="0 s",
    )
    low = simulate(own, lift, every="10 ms")
    run = simulate(
        own,
        Scenario(load="150 t", s_w="200 m", tip=tip, mode="manual", duration="60 s", warm_up="1 s", ramp="0 s"),
        every="0.01 s",
    )
    ratios = [ratio_of(d.time.values[d.time.values > 2.0], d.s_load.values[d.time.values > 2.0]) for d in (low, run)]
    assert ratios[0] == pytest.approx(ratios[1], rel=DECREMENT)


def test_the_damper_follows_the_length_of_the_wire():
    """The ratio is that of the swing on the wire that is out, not of that at the start of the run."""
    from stillhook.engine.pack.winch import pack
    from stillhook.winches.load_path.load import drum_geometry

    began_short, began_long = (pack(crane(), Scenario(load="100 t", s_w=s)).params.hoist for s in ("50 m", "900 m"))
    for s_w in (50.0, 400.0, 900.0):
        assert drum_geometry(s_w, began_short).c == drum_geometry(s_w, began_long).c
    assert drum_geometry(900.0, began_long).c < 0.5 * drum_geometry(50.0, began_long).c


# Holding brake


@pytest.mark.slow
def test_a_winch_at_rest_on_its_brake_does_not_feed_the_swing_of_a_deep_load():
    """On the circuits alone the passive motors follow the load cell late, and a resonant swing of the load grows."""
    tip = Sine(amplitude="0.2 m", period="2.4 s")  # that of the load on its wire
    case = Scenario(load="60 t", s_w="1300 m", tip=tip, mode="manual", duration="400 s", warm_up="300 s")
    held, free = (simulate(c, case) for c in (crane(), crane().model_copy(update={"brake": None})))
    assert float(held.F_w_max - held.F_w_min) > 0.5 * float(held.F_w[0])  # the load swings
    assert np.ptp(held.s_w.values) < STANDS
    assert np.ptp(free.s_w.values) > 10.0 * STANDS


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-pure-active"])
def test_the_brake_holds_the_load_for_as_long_as_the_joystick_rests(name):
    run = simulate(
        crane(name),
        Scenario(load="80 t", s_w="200 m", tip=Sine(amplitude="0.5 m", period="8 s"), mode="manual", duration="600 s"),
    )
    assert np.ptp(run.s_w.values) < STANDS
    assert np.all(run.brake.values == 1.0)


@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-pure-active"])
def test_the_brake_opens_without_a_jerk_once_the_motors_carry_the_load(name):
    stick = Operator(profile=(("10 s", "0 m/min"), ("12 s", "10 m/min")))
    run = simulate(
        crane(name),
        Scenario(load="80 t", s_w="200 m", mode="manual", duration="40 s", warm_up="1 s", operator=stick),
        every="0.01 s",
    )
    after = run.time.values > 10.0
    W = float(run.F_w[0])
    assert np.ptp(run.F_w.values[after]) < JERK * W
    assert run.s_w.values[after].max() < float(run.s_w[1000]) + STANDS  # it does not drop before it hoists
    assert float(run.brake[-1]) == 0.0
    assert float(run.v_w[-1]) > 0.0


def test_the_brake_closes_only_once_the_winch_stands():
    stick = Operator(profile=(("5 s", "0 m/min"), ("7 s", "30 m/min"), ("15 s", "30 m/min"), ("16 s", "0 m/min")))
    run = simulate(
        crane(),
        Scenario(load="80 t", s_w="200 m", mode="manual", duration="40 s", warm_up="1 s", operator=stick),
        every="0.01 s",
    )
    closing = (run.brake.values > 0.0) & (run.time.values > 8.0)
    assert np.max(np.abs(run.v_w.values[closing])) < 0.02
    assert float(run.brake[-1]) == 1.0


def test_compensation_begins_from_the_brake_without_an_error():
    """The reference is set where the wire is when the brake lets go, not where it was when the button was pressed."""
    case = Scenario(
        load="80 t", s_w="200 m", tip=Still(), mode="manual", modes=(("20 s", "ssc"),), duration="60 s", warm_up="1 s"
    )
    run = simulate(crane(), case, every="0.01 s")
    assert float(run.brake[-1]) == 0.0
    assert np.max(np.abs(run.e_c.values[run.time.values > 21.0])) < STANDS


# Hydraulic power units, boost


@pytest.mark.slow
def test_the_pumps_take_no_more_power_than_the_units_have_and_the_run_says_so():
    small = changed(crane(), {"hpu": {"P_max": "300 kW"}})
    case = Scenario(load="100 t", s_w="100 m", tip=Sine(amplitude="2.8 m", period="12 s"), mode="ns", duration="100 s")
    free, held = simulate(crane(), case), simulate(small, case)
    assert float(free.P_hpu_max) > 450e3
    assert "power" not in free.status.item()
    assert "power" in held.status.item()
    assert float(held.power_time) > 1.0
    assert float(held.P_hpu_max) < 1.5 * 300e3  # the oil swings faster than the pumps swivel
    assert float(held.e_c_pp) > float(free.e_c_pp)  # what the limit costs


@pytest.mark.parametrize(
    ("name", "load", "table", "P"),
    [
        ("nov-250t", "100 t", "active", 20e3),
        ("nov-250t-secondary", "200 t", "secondary", 20e3),
        ("nov-100t-cylinder", "80 t", "cylinder", 15e3),  # the accumulator carries the load
        ("utility-20t-open-circuit", "15 t", "open", 20e3),
    ],
)
def test_power_units_that_come_to_their_torque_first_stop_there_and_are_named(
    name: str, load: str, table: str, P: float
):
    """At the pumps' one speed a torque is a power: the run is that with the power, to the bit."""
    omega = getattr(crane(name), table).pump.omega_p
    torque = changed(crane(name), {"hpu": {"T_max": f"{P / omega!r} N m"}})
    power = changed(crane(name), {"hpu": {"P_max": f"{P / omega * omega!r} W"}})
    tip, mode = Sine(amplitude="1 m", period="10 s"), crane(name).plant.type.default_mode
    case = Scenario(load=load, s_w="100 m", mode=mode, tip=tip, duration="30 s", warm_up="5 s")
    by_torque, by_power = simulate(torque, case), simulate(power, case)
    assert "power" in by_torque.status.item()
    assert "the torque of the power units" in by_torque.notes.item()
    assert "the torque of the power units" not in by_power.notes.item()
    np.testing.assert_array_equal(by_torque.v_w.values, by_power.v_w.values)


def test_power_that_nobody_takes_back_is_named():
    """A load that is lowered drives the pumps."""
    stick = Operator(profile=(("0 s", "0 m/min"), ("10 s", "-60 m/min")))
    case = Scenario(load="200 t", s_w="100 m", mode="manual", duration="60 s", warm_up="20 s", operator=stick)
    run = simulate(crane(), case)
    assert float(run.P_hpu_min) < -crane().hpu.P_back
    assert "power" in run.status.item()


def test_a_boost_pump_that_is_too_small_runs_out_and_the_low_side_falls():
    weak = changed(crane("nov-100t-pure-active"), {"active": {"boost": {"Q_max": "20 L/min"}}})
    case = Scenario(load="80 t", s_w="100 m", tip=Sine(amplitude="1 m", period="8 s"), mode="ns", duration="80 s")
    run, usual = simulate(weak, case), simulate(crane("nov-100t-pure-active"), case)
    assert "boost" in run.status.item()
    assert float(run.boost_time) > 1.0
    assert float(run.p_min) < float(usual.p_min) - 5e5
    assert "boost" not in usual.status.item()


@pytest.mark.slow
def test_commands_take_effect_as_late_as_the_plc_calculates():
    """Without feedback the wire does the same one cycle later."""
    tip = Sine(amplitude="1 m", period="10 s")
    case = Scenario(load="20 t", s_w="100 m", tip=tip, mode="level-1", duration="80 s")
    at_once, late = (
        simulate(changed(crane(), {"control": {"compute_share": t, "K_p": "0.001 1/m"}}), case, every="0.01 s")
        for t in (0.0, 1.0)
    )
    lags = range(5)
    misfit = [np.ptp(late.v_w.values[4000 + k : 7000 + k] - at_once.v_w.values[4000:7000]) for k in lags]
    assert lags[int(np.argmin(misfit))] == 1  # rows are a cycle of 10 ms apart
