"""A session that is stepped from outside gives what `simulate` gives, and goes on from what it saved."""

import numpy as np
import pytest

import stillhook
from stillhook.engine.pack.winch import pack
from stillhook.errors import SimulationError
from stillhook.physics.load_path.drum import wire_damping, wire_stiffness

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", duration="12 s", warm_up="2 s")
CYCLE = CRANE.control.t_cycle
N = round(12.0 / CYCLE)
SIGNALS = ("e_c", "s_w", "F_w", "u_p", "u_m", "p_a", "omega_m")


def simulated(case):
    return stillhook.simulate(CRANE, case, every=f"{CYCLE} s", series=True)


def test_a_session_gives_the_bits_of_a_simulation():
    run, session = simulated(CASE), stillhook.Session(CRANE, CASE)
    for k in range(N):
        if k % 50 == 0:
            for name in SIGNALS:
                assert session.get(name) == float(run[name][k]), (name, k)
        session.step()
    assert all(session.get(name) == float(run[name][N]) for name in SIGNALS)


def test_motion_given_at_the_end_of_each_step_gives_the_bits_of_the_scenarios_own():
    run, session = simulated(CASE), stillhook.Session(CRANE, CASE)
    for k in range(1, N + 1):
        session.step({name: float(run[name][k]) for name in ("s_tip", "v_tip", "a_tip")})
    assert all(session.get(name) == float(run[name][N]) for name in SIGNALS)


def test_modes_operator_and_noise_happen_as_in_a_simulation():
    case = CASE.model_copy(update={"modes": ((3.0, stillhook.Mode("manual")), (6.0, stillhook.Mode("ns")))})
    case = case.model_copy(update={"sensors": case.sensors.model_copy(update={"noise_s_tip": 0.01})})
    run, session = simulated(case), stillhook.Session(CRANE, case)
    session.step(cycles=N)
    assert all(session.get(name) == float(run[name][N]) for name in SIGNALS)


@pytest.mark.parametrize("by_file", [False, True])
def test_a_restored_session_goes_on_with_the_same_bits(by_file, tmp_path):
    session = stillhook.Session(CRANE, CASE)
    session.step(cycles=400)
    session.set("v_op", 0.1)
    state = tmp_path / "state" if by_file else session.save()
    if by_file:
        session.save(state)
    session.step(cycles=300)
    expected = [session.get(name) for name in SIGNALS]
    other = stillhook.Session(CRANE, CASE)
    other.restore(state)
    other.step(cycles=300)
    assert [other.get(name) for name in SIGNALS] == expected


def test_reading_changes_nothing():
    quiet, read = stillhook.Session(CRANE, CASE), stillhook.Session(CRANE, CASE)
    for _ in range(200):
        read.get("e_c")
        quiet.step()
        read.step()
    assert read.save() == quiet.save()


def test_a_mode_and_a_gain_show_at_once_and_move_the_winch():
    session = stillhook.Session(CRANE, CASE)
    session.step(cycles=500)
    u_p = session.get("u_p")
    session.set("K_p", 2.0 * session.get("K_p"))
    assert session.get("u_p") != u_p
    session.set("mode", "manual")
    session.step(cycles=300)
    assert abs(session.get("v_w")) < 0.01


def test_the_operators_speed_pays_wire_in():
    session = stillhook.Session(CRANE, CASE.model_copy(update={"tip": stillhook.Sine(amplitude="0 m", period="12 s")}))
    session.set("v_op", 0.2)
    session.step(cycles=round(20.0 / CYCLE))
    assert 100.0 - session.get("s_w") == pytest.approx(0.2 * 20.0, rel=0.05)  # less the time in which it speeds up


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda s: s.get("p_q"), "is not a name here"),
        (lambda s: s.set("v_op", float("nan")), "Give a finite value"),
        (lambda s: s.set("v_op", "fast"), "give one number in SI units"),
        (lambda s: s.set("mode", "best"), "choose"),
        (lambda s: s.step({"s_tip": 1.0}), "s_tip without v_tip, a_tip"),
        (lambda s: s.step(cycles=0), "whole number from 1"),
        (lambda s: s.restore(b"something"), "not a saved session"),
        (lambda s: s.restore(s.save()[:-8]), "not complete"),
        (lambda s: s.restore(stillhook.Session(CRANE, CASE.with_mode("ns")).save()), "another crane, scenario"),
    ],
)
def test_bad_input_is_refused_in_one_line_and_changes_nothing(call, text):
    session = stillhook.Session(CRANE, CASE)
    before = session.save()
    with pytest.raises(SimulationError, match=text) as problem:
        call(session)
    assert "\n" not in str(problem.value)
    assert session.save() == before


def test_a_session_has_no_end():
    session = stillhook.Session(CRANE, CASE)
    session.step(cycles=N + 500)
    assert session.time == pytest.approx(12.0 + 500 * CYCLE)
    assert np.isfinite(session.get("e_c"))


def host_with_a_wire(session, run, hoist, n):
    """A mass on a wire in the host, with the stiffness and damping of the twin's: per cycle the winch's speed is taken as
    it was, the load moves in 20 steps, and the tension at the end goes to the winch."""
    m, W, s_w_0 = hoist.load.m, hoist.load.W, hoist.s_w_0
    c = wire_damping(s_w_0, m, hoist.wire)
    tip = np.array([run[name].values for name in ("s_tip", "v_tip", "a_tip")]).T
    x, v, h, tension = -W / wire_stiffness(s_w_0, hoist.wire), 0.0, CYCLE / 20, []
    for i in range(n):
        s_w, v_w = session.get("s_w"), session.get("v_w")

        def pull(u, tip_0, tip_1, s_w, v_w, x, v):
            s = s_w - u * CYCLE * v_w
            stretch = tip_0[0] + u * (tip_1[0] - tip_0[0]) - (s - s_w_0) - x
            rate = tip_0[1] + u * (tip_1[1] - tip_0[1]) + v_w - v
            return max(wire_stiffness(s, hoist.wire) * stretch + c * rate, 0.0)

        for j in range(20):
            v += h * (pull((j + 0.5) / 20, tip[i], tip[i + 1], s_w, v_w, x, v) - W) / m
            x += h * v
        tension.append(pull(1.0, tip[i], tip[i + 1], s_w, v_w, x, v))
        given = zip(("s_tip", "v_tip", "a_tip"), map(float, tip[i + 1]), strict=True)
        session.step({"F_w": tension[-1], **dict(given)})
    return np.array(tension)


def test_a_host_with_a_wire_of_its_own_has_the_run_of_the_winch_with_its_wire():
    """Exchanged once a cycle: 4e-5 m and 480 N are seen, of a metre and 175 kN."""
    case = CASE.model_copy(update={"ramp": 5.0})
    run, session = simulated(case), stillhook.Session(CRANE, case, coupling="wire")
    tension = host_with_a_wire(session, run, pack(CRANE, case).params.hoist, N)
    assert abs(session.get("s_w") - float(run["s_w"][N])) < 1e-4
    assert np.abs(tension - run["F_w"].values[1:]).max() < 0.01 * np.ptp(run["F_w"].values)


def test_the_tension_of_a_run_moves_the_winch_as_its_own_wire_did():
    """The recorded tension of a run, linear between the cycles, gives that run's winch: to what a millisecond's ripple of
    the tension is between two cycles."""
    run, session = simulated(CASE), stillhook.Session(CRANE, CASE, coupling="wire")
    apart = []
    for k in range(1, N + 1):
        session.step({n: float(run[n][k]) for n in ("s_tip", "v_tip", "a_tip", "F_w")})
        apart.append(session.get("s_w") - float(run["s_w"][k]))
    assert np.abs(apart).max() < 1e-4
    assert np.ptp(run["s_w"].values) > 0.5


def test_an_unknown_coupling_is_refused():
    with pytest.raises(SimulationError, match="choose tip or wire"):
        stillhook.Session(CRANE, CASE, coupling="rope")
