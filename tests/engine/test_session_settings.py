"""Friction, leakage, displacement, gas and controllers change while a winch runs; states are read and written."""

import fnmatch
import random

import numpy as np
import pytest

import stillhook
from stillhook.analysis.effects import scaled
from stillhook.analysis.uncertainty.factors import FACTORS as UNCERTAIN
from stillhook.engine.pack.settings import FACTORS, GAS, SCALED, present, with_value
from stillhook.engine.pack.winch import pack
from stillhook.errors import SimulationError
from stillhook.kernels.build import driver
from stillhook.kernels.lanes import flatten, paths
from stillhook.library import cranes

CRANE = stillhook.load_crane("nov-250t")
OF_PLC = (".plc.*",)
"""What the PLC knows of its winch, which it keeps when the winch wears."""
AUDIT = 0.005
"""Energy that an audit may miss, over that through the winch: a tenth of what a run is refused for."""


def case_on(crane: stillhook.Crane, **more: str) -> stillhook.Scenario:
    """Two fifths of the load in a swell of 0.8 m."""
    standard = {"tip": "sine 0.8 m 9 s", "mode": crane.plant.type.default_mode, "ramp": "3 s"}
    return stillhook.Scenario(load=f"{0.4 * crane.SWL} kg", s_w="80 m", **{**standard, **more})


def session_on(name: str = "nov-250t", **more: str) -> stillhook.Session:
    crane = stillhook.load_crane(name)
    return stillhook.Session(crane, case_on(crane, **more))


def states(session: stillhook.Session) -> list[float]:
    return [session.state(name) for name in session.states]


def scaled_by(crane: stillhook.Crane, name: str, factor: float) -> stillhook.Crane:
    """The crane with every number of its file that a factor of a session moves."""
    return scaled(crane, {path: factor for each in FACTORS[name].scaled for path in present(crane, each)})


def factors_of(session: stillhook.Session) -> list[str]:
    return [name for name in session.parameters if name in FACTORS]


# Settings


def test_every_winch_has_the_factors_of_what_it_has():
    everything = ["friction_factor", "leakage_factor", "displacement_factor", "gas_factor"]
    expected = {
        "nov-250t": everything,
        "nov-250t-secondary": everything,
        "nov-100t-pure-active": everything[:3],
        "utility-20t-open-circuit": everything[:3],
        "nov-100t-cylinder": ["friction_factor", "leakage_factor", "gas_factor"],
        "nov-100t-electric": ["friction_factor"],
    }
    assert {name: factors_of(session_on(name)) for name in expected} == expected


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        (name, factor)
        for name in cranes()
        for factor in ("friction_factor", "leakage_factor")
        if any(present(stillhook.load_crane(name), each) for each in FACTORS[factor].scaled)
    ],
)
def test_a_factor_gives_the_bits_of_a_crane_whose_file_has_it(name, factor):
    session = session_on(name)
    other = scaled_by(stillhook.load_crane(name), factor, 1.3)
    fresh, plain = stillhook.Session(other, case_on(other)), session_on(name)
    session.set(factor, 1.3)
    for each in (session, fresh, plain):
        each.step(cycles=400)
    assert states(session) == states(fresh)
    assert states(session) != states(plain)


@pytest.mark.parametrize("name", cranes())
def test_what_a_factor_leaves_is_what_the_plc_knows(name):
    """Of all that a changed crane file changes, the rest is settings of the PLC: the winch changed as a whole."""
    crane = stillhook.load_crane(name)
    packed, session = pack(crane, case_on(crane)), session_on(name)
    places, before = paths(driver(packed.name, 1).Params), flatten(packed.params)
    for factor in factors_of(session):
        other = crane if factor == GAS else scaled_by(crane, factor, 1.1)
        after = flatten(pack(other, case_on(other), gas_factor=1.1 if factor == GAS else 1.0).params)
        moved = {place for place, a, b in zip(places, before, after, strict=True) if a != b}
        left = {p for p in moved if not any(fnmatch.fnmatchcase(p, each) for each in FACTORS[factor].places)}
        assert moved - left
        assert all(any(fnmatch.fnmatchcase(p, each) for each in OF_PLC) for p in left), (factor, left)


def test_a_factor_means_what_it_means_in_the_table_of_uncertain_factors():
    for name in ("friction", "rod_friction", "leakage", "gas_pressure"):
        assert tuple(target.path for target in UNCERTAIN[name].targets) == SCALED[name]
        assert all(target.share is not None and target.share(CRANE) == 1.0 for target in UNCERTAIN[name].targets)


@pytest.mark.parametrize("name", cranes())
def test_a_setting_that_is_set_back_leaves_no_trace(name):
    session = session_on(name)
    session.step(cycles=100)
    before = states(session), session.get("F_w")
    for factor in factors_of(session):
        session.set(factor, 1.05)
        assert session.get(factor) == 1.05
        session.set(factor, 1.0)
    assert (states(session), session.get("F_w")) == before
    other = session_on(name)
    other.step(cycles=100)
    for each in (session, other):
        each.step(cycles=100)
    assert states(session) == states(other)


def test_more_leakage_stands_off_in_proportion():
    """A proportional controller holds the load against the leak: its error is the leak over the gain."""
    off = {}
    for factor in (1.0, 2.0):
        session = session_on("nov-100t-pure-active", tip="still", mode="ns")
        session.set("leakage_factor", factor)
        session.step(cycles=4000)
        off[factor] = session.get("e_c")
    assert off[2.0] / off[1.0] == pytest.approx(2.0, rel=0.05)


def test_a_larger_displacement_carries_the_load_with_less_pressure():
    dp = {}
    for factor in (1.0, 1.1):
        session = session_on("nov-100t-pure-active", tip="still", mode="ns")
        session.set("displacement_factor", factor)
        session.step(cycles=4000)
        dp[factor] = session.get("p_a") - session.get("p_b")
    assert dp[1.0] / dp[1.1] == pytest.approx(1.1, rel=0.01)


def test_larger_motors_turn_slower_on_the_flow_that_their_command_asks_for():
    """The flow of an open circuit's full command is what the PLC was set up with."""
    speed = {}
    for factor in (1.0, 1.1):
        session = session_on("utility-20t-open-circuit", tip="still", mode="manual")
        session.set("displacement_factor", factor)
        session.set("v_op", 0.2)
        session.step(cycles=1500)
        speed[factor] = session.get("v_w"), session.get("u_p")
    assert speed[1.0][1] == speed[1.1][1]
    assert speed[1.0][0] / speed[1.1][0] == pytest.approx(1.1, rel=0.01)


def test_larger_secondary_units_hold_a_load_at_a_smaller_setting():
    alpha = {}
    for factor in (1.0, 1.1):
        session = session_on("nov-250t-secondary", tip="still")
        session.set("displacement_factor", factor)
        session.step(cycles=2000)
        alpha[factor] = session.get("alpha_s")
    assert alpha[1.0] / alpha[1.1] == pytest.approx(1.1, rel=0.01)


def test_less_gas_is_less_pressure_at_the_same_oil_and_the_pumps_bring_the_mean_back():
    """The set point is the PLC's and stays: pumps make up for lost gas by oil, which is how a loss is hidden."""
    session = session_on(tip="still")
    session.step(cycles=200)
    p_hp, V_o = session.get("p_hp"), session.state("V_o")
    session.set("gas_factor", 0.9)
    assert session.state("V_o") == V_o
    assert session.get("p_hp") / p_hp == pytest.approx(0.9, rel=0.01)
    session.step(cycles=30_000)
    assert session.state("V_o") > V_o + 0.01
    assert session.get("p_hp") / p_hp > 0.95


def test_a_compensator_whose_gas_leaks_leaves_more_of_the_load_to_its_pumps():
    """Its charge is set for the load: a tenth less carries a tenth less."""
    session = session_on("nov-100t-cylinder", tip="still")
    session.step(cycles=500)
    p_hp, dp = session.get("p_hp"), session.get("p_a") - session.get("p_b")
    session.set("gas_factor", 0.9)
    assert session.get("p_hp") / p_hp == pytest.approx(0.9, rel=0.01)
    session.step(cycles=1000)
    assert session.get("p_a") - session.get("p_b") > dp + 0.05 * p_hp


def test_a_setting_of_a_controller_acts_from_the_present_cycle_on():
    """Its share of the pressure is gone at once, and nothing else moves."""
    session, other = (session_on("utility-20t-open-circuit", tip="sine 1.5 m 9 s") for _ in range(2))
    for each in (session, other):
        each.step(cycles=700)
    before = states(session)
    session.set("position.K_dp", 0.0)
    assert session.get("position.K_dp") == 0.0
    assert session.get("u_p") != other.get("u_p")
    assert states(session) == before
    session.set("position.K_dp", other.get("position.K_dp"))
    assert session.get("u_p") == other.get("u_p")
    session.set("position.tau_mean", 2.0 * other.get("position.tau_mean"))
    for each in (session, other):
        each.step(cycles=50)
    assert session.state("position_memory.dp_mean") != other.state("position_memory.dp_mean")


@pytest.mark.parametrize(
    ("name", "path", "value"),
    [
        ("nov-100t-electric", "electric.speed.K", 150.0),
        ("nov-100t-electric", "electric.speed.T_i", 0.3),
        ("nov-250t-secondary", "secondary.drive.K", 6.0),
        ("nov-250t-secondary", "secondary.drive.T_i", 2.0),
        ("utility-20t-open-circuit", "open.drive.jump", 0.01),
        ("utility-20t-open-circuit", "open.drive.dp_nominal", 2.0e6),
    ],
)
def test_a_setting_of_a_drive_gives_the_bits_of_a_crane_whose_file_has_it(name, path, value):
    session, crane = session_on(name), stillhook.load_crane(name)
    other = with_value(crane, path, value)
    fresh, plain = stillhook.Session(other, case_on(other)), session_on(name)
    assert session.get(path) == plain.get(path) != value
    session.set(path, value)
    assert session.get(path) == value
    for each in (session, fresh, plain):
        each.step(cycles=400)
    assert states(session) == states(fresh) != states(plain)
    with pytest.raises(SimulationError, match="give a value from"):
        session.set(path, -1.0)


def test_settings_are_saved_and_kept_and_gone_back_from():
    session, other = session_on(), session_on()
    session.step(cycles=100)
    plain, kept = session.save(), session.keep()
    session.set("friction_factor", 1.5)
    session.set("gas_factor", 0.95)
    worn = session.save()
    session.step(cycles=100)
    expected = states(session)
    other.restore(worn)
    assert (other.get("friction_factor"), other.get("gas_factor")) == (1.5, 0.95)
    other.set("leakage_factor", 2.0)
    other.set("leakage_factor", 1.0)
    other.step(cycles=100)
    assert states(other) == expected
    session.go_back(kept)
    assert session.get("friction_factor") == 1.0
    assert session.save() == plain
    other.restore(plain)
    for each in (session, other):
        each.step(cycles=100)
    assert states(session) == states(other) != expected


@pytest.mark.parametrize(
    ("name", "call", "text"),
    [
        ("nov-250t", lambda s: s.set("friction_factor", float("nan")), "friction_factor.*Give a finite value"),
        ("nov-250t", lambda s: s.set("friction_factor", "more"), "give one number"),
        ("nov-250t", lambda s: s.set("friction_factor", -0.1), "give a value from 0 to 20"),
        ("nov-250t", lambda s: s.set("leakage_factor", 1e6), "give a value from 0 to 100"),
        ("nov-250t", lambda s: s.set("displacement_factor", 0.0), "give a value from 0.5 to 1.5"),
        ("nov-250t", lambda s: s.set("gas_factor", None), "give one number"),
        ("nov-250t", lambda s: s.set("friction", 1.0), "is not a name here. Choose one of s_tip"),
        ("nov-100t-electric", lambda s: s.set("leakage_factor", 1.0), "is not a name here"),
        ("nov-100t-electric", lambda s: s.get("gas_factor"), "is not a name here"),
        ("nov-100t-electric", lambda s: s.set("position.K_dp", -1.0), "position.K_dp = -1.*give a value from 0"),
        ("nov-250t", lambda s: s.set("position.K_dp", 0.0), "is not a name here"),
        ("nov-250t", lambda s: s.state("p_c"), "'?.?p_c.* is not a name here. Choose one of alpha_p"),
        ("nov-250t", lambda s: s.state(None), "is not a name here"),
        ("nov-250t", lambda s: s.set_states({"p_a": float("nan")}), "p_a.*Give a finite value"),
        ("nov-250t", lambda s: s.set_states({"p_a": "high"}), "p_a.*give one number"),
        ("nov-250t", lambda s: s.set_states({"alpha_m": 1.2}), "alpha_m = 1.2: give a value from -0.05 to 1.05"),
        ("nov-250t", lambda s: s.set_states({"s_w": 1e5}), "s_w = 100000.*give a value from -100"),
        ("nov-250t", lambda s: s.set_states({"p_a": 1e7, "V_o": -20.0}), "V_o = -20"),
        ("nov-250t", lambda s: s.set_states({"p_a": 1e7, "mode": 1.0}), "is not a name here"),
        ("nov-250t", lambda s: s.set_states([("p_a", 1e7)]), "give values by name, as a mapping"),
        ("nov-250t", lambda s: s.set_states({("p_a",): 1e7}), "is not a name here"),
    ],
)
def test_what_no_winch_can_have_is_refused_in_one_line_and_changes_nothing(name, call, text):
    session = session_on(name)
    session.step(cycles=20)
    before = session.save()
    with pytest.raises(SimulationError, match=text) as problem:
        call(session)
    assert "\n" not in str(problem.value)
    assert len(str(problem.value)) < 600
    assert session.save() == before


def test_a_law_that_the_step_cannot_follow_is_refused_before_it_runs():
    session = stillhook.Session(CRANE, case_on(CRANE), step="10 ms")
    session.step(cycles=20)
    before, lines = states(session), []
    for factor, value in (("leakage_factor", 100.0), ("displacement_factor", 1.5), ("friction_factor", 20.0)):
        try:
            session.set(factor, value)
        except SimulationError as problem:
            lines.append(str(problem))
        session.set(factor, 1.0)
    assert any("is too long for this crane" in line and "\n" not in line for line in lines), lines
    assert states(session) == before


@pytest.mark.long
@pytest.mark.parametrize("name", cranes())
def test_no_setting_within_its_range_loses_the_numbers(name):
    """Hard driven at every end of every range: it runs on, or says in one line that the step is too long."""
    refused = []
    for factor in factors_of(session_on(name)):
        for value in (FACTORS[factor].least, FACTORS[factor].most):
            session = session_on(name)
            session.step(cycles=50)
            try:
                session.set(factor, value)
            except SimulationError as problem:
                refused.append(str(problem))
            session.step(cycles=300)
            assert np.isfinite(states(session)).all(), (factor, value)
    assert all("is too long for this crane" in line for line in refused), refused


ODD = (
    float("nan"),
    float("inf"),
    None,
    "x",
    b"1",
    [],
    {},
    (),
    True,
    10**400,
    1j,
    1e308,
    -1e308,
    -0.0,
    5e-324,
    object(),
)
"""What a host passes by mistake."""
CALLS = (
    lambda s, name, value: s.set(name, value),
    lambda s, name, value: s.get(name),
    lambda s, name, value: s.state(name),
    lambda s, name, value: s.set_states({name: value, s.states[0]: 0.5}),
    lambda s, name, value: s.set_states(value),
    lambda s, name, value: s.step({name: value, "override": 1, "u_p": 0.4}),
    lambda s, name, value: s.step({"override": value, "v_op": 0.1}),
    lambda s, name, value: s.step(cycles=5),
)


@pytest.mark.long
@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-cylinder", "nov-100t-electric"])
def test_no_name_and_no_value_makes_a_session_crash_or_forget(name):
    """Calls at random: a refusal is one line and changes nothing, and what stands after any call is saved and taken
    again."""
    chance, session, other = random.Random(7), session_on(name), session_on(name)
    begin, refusals = session.save(), 0
    names = [*session.inputs, *session.parameters, *session.signals, *session.states, "nope", "u_m", None, 3]

    def any_value() -> object:
        if chance.random() < 0.3:
            return chance.choice(ODD)
        return chance.choice((chance.uniform(-1.0, 1.0), 10.0 ** chance.uniform(-6.0, 9.0), "ssc", "position"))

    for _ in range(400):
        before, line = session.save(), ""
        try:
            chance.choice(CALLS)(session, chance.choice(names), any_value())
        except SimulationError as problem:
            line = str(problem)
            refusals += 1
        if "is not a number at" in line:
            session.restore(begin)
        elif line:
            assert session.save() == before
        assert "\n" not in line
        data = session.save()
        other.restore(data)
        assert other.save() == data
    assert 100 < refusals < 390


# States


@pytest.mark.parametrize("name", cranes())
def test_a_winch_that_takes_over_every_state_of_another_goes_on_as_it_does(name):
    session, other = session_on(name), session_on(name)
    other.set("friction_factor", 1.5)
    for each in (session, other):
        each.step(cycles=400)
    other.set("friction_factor", 1.0)
    assert states(session) != states(other)
    other.set_states({each: session.state(each) for each in session.states})
    assert states(session) == states(other)
    for each in (session, other):
        each.step(cycles=200)
    assert states(session) == states(other)


def test_writing_a_state_as_it_is_changes_nothing():
    session = session_on()
    session.step(cycles=200)
    before = session.save()
    session.set_states({name: session.state(name) for name in session.states})
    session.set_states({})
    assert session.save() == before


def test_a_state_shows_at_once_and_what_follows_from_it_as_well():
    session = session_on(tip="still", mode="manual")
    session.step(cycles=100)
    F_w, K = session.get("F_w"), session.state("s_w")
    session.set_states({"s_w": K + 0.05, "p_a": 1.5e7})
    assert session.get("s_w") == K + 0.05
    assert session.get("p_a") == pytest.approx(1.5e7)
    assert session.get("F_w") < 0.9 * F_w
    session.set_states({"s_w": K, "s_load": session.state("s_load")})
    assert session.get("F_w") == pytest.approx(F_w)


def test_a_load_that_the_host_has_is_no_state_of_its_winch():
    session = stillhook.Session(CRANE, case_on(CRANE), coupling="wire")
    assert "s_w" in session.states
    assert {"s_load", "v_load"}.isdisjoint(session.states)
    with pytest.raises(SimulationError, match="is not a name here"):
        session.set_states({"s_load": 1.0})


@pytest.mark.parametrize("name", cranes())
def test_energy_that_a_hand_puts_in_is_not_found_missing(name):
    """A state or a law changed from outside adds energy that no power brought: the audit leaves it out."""
    session = session_on(name)
    session.step(cycles=300)
    session.set_states({"v_load": session.state("v_load") + 0.5})
    session.step(cycles=200)
    if "gas_factor" in session.parameters:
        session.set("gas_factor", 0.95)
    session.step(cycles=500)
    st, winch = session._block.part("st", 0), session._block.ready[0].crane.plant.type
    supplied, consumed = winch.energies(st.power)
    missing = (supplied - consumed) * session.cycle - (st.common.E_end - st.common.E_start)
    assert abs(missing) < AUDIT * st.common.through * session.cycle
