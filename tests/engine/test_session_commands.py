"""Commands from outside: while the override is 1 a winch takes them in place of its PLC's, whatever its type."""

import numpy as np
import pytest

import stillhook
from stillhook.errors import SimulationError
from stillhook.library import cranes

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", ramp="3 s")
COMMANDS = ("u_p", "u_m", "brake")
SIGNALS = ("s_w", "F_w", "v_w", "u_p", "u_m", "brake")


def session_on(name: str, coupling: str = "tip", **more: str) -> stillhook.Session:
    """A library crane at two fifths of its load in a swell of 0.8 m."""
    crane = stillhook.load_crane(name)
    case = stillhook.Scenario(
        load=f"{0.4 * crane.SWL} kg",
        s_w="80 m",
        **{"tip": "sine 0.8 m 9 s", "mode": crane.plant.type.default_mode, "ramp": "3 s", **more},
    )
    return stillhook.Session(crane, case, coupling=coupling)


def signals(session: stillhook.Session) -> list[float]:
    return [session.get(name) for name in SIGNALS]


def driven_by(leader: stillhook.Session, follower: stillhook.Session, cycles: int) -> None:
    """The follower takes the commands that the leader's PLC gives, cycle by cycle, and is seen to do the same."""
    follower.set("override", 1)
    for _ in range(cycles):
        for name in COMMANDS:
            if name in follower.inputs:
                follower.set(name, leader.get(name))
        assert signals(follower) == signals(leader)
        leader.step()
        follower.step()


@pytest.mark.parametrize("name", cranes())
def test_a_winch_that_is_given_its_plcs_commands_has_the_bits_of_its_plc(name):
    leader, follower = session_on(name), session_on(name)
    leader.step(cycles=100)
    follower.step(cycles=100)
    driven_by(leader, follower, 200)
    assert abs(leader.get("s_w") - 80.0) > 0.05
    assert [follower.state(n) for n in follower.states] == [leader.state(n) for n in leader.states]


def test_commands_drive_a_winch_on_a_host_s_wire_as_well():
    leader, follower = session_on("nov-250t", "wire"), session_on("nov-250t", "wire")
    driven_by(leader, follower, 150)


def test_a_winch_obeys_commands_and_not_its_plc():
    """The same tip, the pumps held at a fifth: the wire is hauled in at the speed of that, whatever the PLC wants."""
    session = session_on("nov-250t", mode="manual")
    session.step({"override": 1, "u_p": 0.2, "u_m": 1.0, "brake": 0.0})
    session.set("override", 1)
    session.step(cycles=1000)
    assert [session.get(name) for name in COMMANDS] == [0.2, 1.0, 0.0]
    assert session.get("v_w") == pytest.approx(0.2 / session.get("K_1"), rel=0.15)


def test_a_brake_that_is_commanded_holds_the_load_against_the_pumps():
    session = session_on("nov-250t", tip="still")
    before = session.get("s_w")
    session.step({"override": 1, "u_p": 0.2, "u_m": 1.0, "brake": 1.0})
    session.set("override", 1)
    session.step(cycles=500)
    assert session.get("brake") == 1.0
    assert abs(session.get("s_w") - before) < 0.02


def test_an_override_begins_with_the_commands_of_the_present_time_and_keeps_them():
    session, other = session_on("nov-250t"), session_on("nov-250t")
    session.step(cycles=500)
    other.step(cycles=500)
    before = {name: session.get(name) for name in COMMANDS}
    session.set("override", 1)
    assert {name: session.get(name) for name in COMMANDS} == before
    session.step()
    other.step()
    assert [session.state(n) for n in session.states] == [other.state(n) for n in other.states]
    session.step(cycles=200)
    assert {name: session.get(name) for name in COMMANDS} == before
    session.set("u_p", 0.0)
    assert (session.get("u_p"), session.get("u_m")) == (0.0, before["u_m"])
    session.set("override", 0)
    assert session.get("u_p") != 0.0


def test_a_command_that_a_step_leaves_out_stays_as_it_is():
    session = session_on("nov-250t")
    session.step(cycles=500)
    present = session.get("u_m"), session.get("brake")
    session.step({"override": 1, "u_p": 0.1})
    assert (session.get("u_p"), session.get("u_m"), session.get("brake")) == (0.1, *present)
    session.step({"override": 1, "u_m": 0.9})
    assert (session.get("u_p"), session.get("u_m")) == (0.1, 0.9)
    session.step()
    assert session.get("override") == 0.0
    assert session.get("u_p") != 0.1


def test_commands_of_an_override_that_has_ended_are_not_taken_again():
    session = session_on("nov-250t")
    session.set("override", 1)
    session.set("u_p", -0.4)
    session.set("override", 0)
    session.step(cycles=10)
    present = session.get("u_p")
    session.set("override", 1)
    session.step(cycles=10)
    assert session.get("u_p") == present


def test_given_to_every_step_commands_hold_from_its_end():
    by_step, by_set = session_on("nov-250t"), session_on("nov-250t")
    u_p = 0.3 * np.sin(0.1 * np.arange(1, 200))
    whole = {"override": 1, "u_p": 0.0, "u_m": 1.0, "brake": 0.0}
    by_step.step(whole)
    by_set.step()
    for name, value in whole.items():
        by_set.set(name, value)
    for x in map(float, u_p):
        by_step.step({"override": 1, "u_p": x})
        by_set.step()
        by_set.set("u_p", x)
        assert signals(by_step) == signals(by_set)


def test_a_saved_and_a_kept_override_go_on():
    session, other = session_on("nov-250t"), session_on("nov-250t")
    session.set("override", 1)
    session.set("u_p", 0.3)
    session.step(cycles=50)
    kept, data = session.keep(), session.save()
    session.step(cycles=50)
    expected = signals(session)
    session.go_back(kept)
    other.restore(data)
    for each in (session, other):
        each.step(cycles=50)
        assert signals(each) == expected


@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-pure-active"])
def test_a_winch_that_its_commands_let_run_away_is_saved_and_taken_again(name):
    """Nine tenths of the load on motors at a third, in a sea of 5 m: lines are emptied of all their oil."""
    crane = stillhook.load_crane(name)
    case = stillhook.Scenario(load=f"{0.9 * crane.SWL} kg", s_w="80 m", tip="sine 5 m 5 s", mode="ssc")
    session, other = stillhook.Session(crane, case), stillhook.Session(crane, case)
    for command, value in {"override": 1, "u_p": 1.0, "u_m": 0.3, "brake": 0.0}.items():
        session.set(command, value)
    least = 0.0
    for _ in range(30):
        session.step(cycles=50)
        least = min(least, session.state("p_a"), session.state("p_b"))
        other.restore(session.save())
        assert other.save() == session.save()
    assert least < -5.0e8


@pytest.mark.parametrize(
    ("name", "call", "text"),
    [
        ("nov-250t", lambda s: s.set("u_p", 0.1), "Session.set: u_p while override is 0.*Give override = 1 first"),
        ("nov-250t", lambda s: s.step({"brake": 1.0}), "Session.step: brake while override is 0"),
        ("nov-250t", lambda s: s.step({"override": 0, "u_m": 1.0}), "Session.step: u_m while override is 0"),
        ("nov-250t", lambda s: s.set("override", 0.5), "override = 0.5: give 0 or 1"),
        ("nov-250t", lambda s: s.set("override", 2), "give a value from 0 to 1"),
        ("nov-250t", lambda s: s.set("override", "on"), "give one number"),
        ("nov-250t", lambda s: s.set("override", float("nan")), "Give a finite value"),
        ("nov-250t", lambda s: s.step({"override": 1, "u_p": 1.01}), "u_p = 1.01.*from -1 to 1"),
        ("nov-250t", lambda s: s.step({"override": 1, "u_p": None}), "give one number"),
        ("nov-250t", lambda s: s.step({"override": 1, "u_p": 10**400}), "give one number"),
        ("nov-250t", lambda s: s.step({"override": 1, "u_m": -0.1}), "u_m = -0.1.*from 0 to 1"),
        ("nov-250t", lambda s: s.step({"override": 1, "brake": float("inf")}), "Give a finite value"),
        ("nov-250t", lambda s: s.step({"override": 1, ("u", "p"): 0.0}), "is not a name here"),
        ("nov-250t", lambda s: s.step(["override"]), "as a mapping"),
        ("nov-250t", lambda s: s.set(["u_p"], 0.1), "is not a name here"),
        ("nov-250t", lambda s: s.set("mode", ["ssc"]), "choose"),
        ("nov-100t-electric", lambda s: s.step({"override": 1, "u_m": 1.0}), 'u_m: winch type "electric" takes the sp'),
        ("utility-20t-open-circuit", lambda s: s.set("u_m", 1.0), 'winch type "open-circuit" takes the speed command'),
    ],
)
def test_a_command_that_cannot_be_obeyed_is_refused_in_one_line_and_changes_nothing(name, call, text):
    session = session_on(name)
    before = session.save()
    with pytest.raises(SimulationError, match=text) as problem:
        call(session)
    assert "\n" not in str(problem.value)
    assert session.save() == before


def test_a_crane_without_a_holding_brake_takes_no_command_for_one():
    crane = CRANE.model_copy(update={"brake": None})
    session = stillhook.Session(crane, CASE)
    assert "brake" not in session.inputs
    with pytest.raises(SimulationError, match=r"brake: .* has no holding brake\. Leave it out"):
        session.step({"override": 1, "brake": 1.0})
