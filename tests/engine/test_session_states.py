"""What comes from outside is checked: a session takes no state but one that it could have saved itself."""

import hashlib
import json

import numpy as np
import pytest
from tests.engine.damage import IMPOSSIBLE, damaged

import stillhook
from stillhook.errors import SimulationError

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", duration="12 s", warm_up="0 s")
CYCLES = 300
YEARS = 50 * 366 * 86400 * 100
"""PLC cycles of 10 ms in 50 years."""


@pytest.fixture(scope="module")
def session():
    made = stillhook.Session(CRANE, CASE)
    made.step(cycles=CYCLES)
    made.set("v_op", 0.1)
    return made


def parts(data: bytes):
    """Format, head, numbers."""
    first, _, rest = data.partition(b"\n")
    line, _, body = rest[:-32].partition(b"\n")
    return first, json.loads(line), np.frombuffer(body).copy()


def remade(first: bytes, head: dict, numbers: np.ndarray) -> bytes:
    """The same with a right checksum."""
    body = first + b"\n" + json.dumps(head).encode() + b"\n" + numbers.tobytes()
    return body + hashlib.sha256(body).digest()


def refused(session, data, match: str = ".") -> None:
    before = session.save()
    with pytest.raises(SimulationError, match=match) as problem:
        session.restore(data)
    assert "\n" not in str(problem.value)
    assert len(str(problem.value)) < 600
    assert session.save() == before


def test_no_damaged_state_is_taken_and_the_session_goes_on(session):
    data = session.save()
    e_c = session.get("e_c")
    n = 0
    for bad in damaged(data, 4000):
        refused(session, bad)
        n += 1
    assert n > 3900
    assert session.get("e_c") == e_c
    session.step()
    other = stillhook.Session(CRANE, CASE)
    other.restore(data)
    other.step()
    assert other.save() == session.save()


def test_no_damaged_file_is_taken(session, tmp_path):
    file = tmp_path / "winch.state"
    session.save(file)
    data = file.read_bytes()
    for bad in damaged(data, 200, seed=2):
        file.write_bytes(bad)
        refused(session, file, "winch.state: ")
    file.write_bytes(data)
    session.restore(file)
    refused(session, tmp_path / "none", "no such file")
    refused(session, tmp_path, "is a folder. Give one file that Session.save wrote")


@pytest.mark.long
@pytest.mark.parametrize("value", IMPOSSIBLE)
def test_no_number_may_be_impossible_though_the_checksum_is_right(session, value):
    first, head, numbers = parts(session.save())
    assert remade(first, head, numbers) == session.save()
    names = [*head["names"]]
    for i, name in enumerate(names):
        x = numbers.copy()
        x[i] = value
        # what is calculated anew, and sums that grow for years, may be large, but are numbers
        if np.isfinite(value) and name.startswith(".st.") and not name.endswith("_cycles"):
            continue
        refused(session, remade(first, head, x), name.removeprefix(".").removeprefix("row.")[:6].replace(".", r"\."))


@pytest.mark.parametrize(
    ("name", "values"),
    [
        (".x.winch.alpha_m", (-0.5, 2.0)),
        (".x.winch.alpha_p", (-2.0, 2.0)),
        (".x.path.s_w", (-500.0, 5000.0)),
        (".x.winch.p_a", (-1e12, 1e12)),
        (".m.brake", (-0.1, 1.1)),
        (".m.mode", (0.5, -1.0, 99.0)),
        (".laws.code", (0.5, 99.0)),
        (".tick.f_pump", (-0.1, 1.1)),
        (".st.common.cycles", (-1.0, 0.5, CYCLES + 2.0, 1e12)),
        (".st.common.slack_cycles", (-1.0, 0.5, CYCLES + 2.0)),
        (".st.limits.relief", (-1.0, CYCLES + 2.0)),
        (".p.hoist.load.W", (0.0, 1.0e6)),
        (".p.plc.gains.K_p", (-1.0, 1e9)),
        (".p.plc.motors.alpha_swl", (0.0, 1.5)),
    ],
)
def test_a_number_outside_its_range_is_named(session, name, values):
    first, head, numbers = parts(session.save())
    for value in values:
        x = numbers.copy()
        x[head["names"].index(name)] = value
        refused(session, remade(first, head, x), rf"no state of this winch: {name[1:]} = ".replace(".", r"\."))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"k": -1}, "k = -1: give a whole number of cycles"),
        ({"k": 2**60}, "k = 1152921504606846976"),
        ({"k": 300.0}, "k = 300.0"),
        ({"k": True}, "k = True"),
        ({"k": 3}, "cycles = 30., allowed is a whole number from 0 to 3"),
        ({"k": None}, "k = None"),
        ({"held": {"v_op": "nan"}}, "held"),
        ({"held": {"v_op": "0x1p99999"}}, "held"),
        ({"held": {"v_op": 0.1}}, "held"),
        ({"held": {"v_op": ["0x1p0"]}}, "held"),
        ({"held": {"K_p": "0x1p0"}}, "held"),
        ({"held": {"mode": "0x1.8p6"}}, "held.*tick.mode = 96"),
        ({"held": {"f_pump": "-0x1p0"}}, "held.*tick.f_pump = -1"),
        ({"held": ["v_op"]}, "held"),
        ({"held": {"override": "0x1p1"}}, "held.*tick.override = 2"),
        ({"changed": None}, "changed = None"),
        ({"changed": {"friction_factor": "nan"}}, "changed"),
        ({"changed": {"friction": "0x1p0"}}, "changed"),
        ({"changed": {"K_p": "0x1p0"}}, "changed"),
        ({"changed": {"gas_factor": "0x1p3"}}, "changed: gas_factor = 8, allowed is 0.1 to 2"),
        ({"changed": {"friction_factor": "0x1p1"}}, r"p.hoist.friction.Y_1 = .*allowed is that of this winch"),
        ({"identity": "0" * 64}, "another crane"),
        ({"names": []}, "other names"),
        ({"numbers": -1}, "bytes of numbers"),
        ({"numbers": 1e300}, "bytes of numbers"),
    ],
)
def test_a_head_that_says_what_cannot_be_is_refused(session, change, words):
    first, head, numbers = parts(session.save())
    body = first + b"\n" + json.dumps({**head, **change}).encode() + b"\n" + numbers.tobytes()
    refused(session, body + hashlib.sha256(body).digest(), words)


def test_names_that_are_swapped_and_numbers_that_lack_are_refused(session):
    first, head, numbers = parts(session.save())
    names = head["names"][1::-1] + head["names"][2:]
    refused(session, remade(first, {**head, "names": names}, numbers), "other names")
    refused(session, remade(first, {**head, "numbers": len(numbers) - 1}, numbers[:-1]), "numbers in place of")


def test_states_of_another_kind_crane_case_step_or_version_are_refused(session):
    other = stillhook.load_crane("nov-100t-cylinder")
    case = CASE.model_copy(update={"mode": stillhook.Mode("position"), "load": 50e3})
    for made in (
        stillhook.Session(other, case),
        stillhook.Session(CRANE, CASE.with_mode("ns")),
        stillhook.Session(CRANE, CASE, step="1 ms"),
        stillhook.Session(CRANE, CASE, coupling="wire"),
    ):
        refused(session, made.save(), "another crane, scenario, step or version")
    refused(session, b"stillhook session 1\n{}\n", "stillhook session 1 is another format than 3")
    refused(session, b"", "not a saved session")
    refused(session, b"stillhook session 3\n" + b"[" * 100_000, "checksum")
    body = b"stillhook session 3\n" + b"[" * 100_000
    refused(session, body + hashlib.sha256(body).digest(), "not JSON")


def test_any_state_that_is_taken_steps_on_or_says_that_it_cannot(session):
    """Numbers changed within what is possible: a winch in a strange state, and no crash."""
    first, head, numbers = parts(session.save())
    before, chance, taken, lines = session.save(), np.random.default_rng(3), 0, []
    for _ in range(300):
        x = numbers.copy()
        for i in chance.integers(0, len(x), 3):
            x[i] *= chance.choice((-1.0, 0.0, 0.5, 1.01, 2.0, 1e3))
        try:
            session.restore(remade(first, head, x))
            taken += 1
            session.step(cycles=3)
            assert np.isfinite(session.get("F_w"))
        except SimulationError as problem:
            lines.append(str(problem))
    session.restore(before)
    assert not any("\n" in line for line in lines)
    assert taken > 20


@pytest.mark.parametrize(
    "name", ["nov-100t-cylinder", "nov-100t-electric", "nov-250t-secondary", "utility-20t-open-circuit"]
)
@pytest.mark.parametrize("coupling", ["tip", "wire"])
def test_what_a_hard_driven_winch_of_any_kind_saves_is_taken_again_to_the_bit(name, coupling):
    crane = stillhook.load_crane(name)
    case = stillhook.Scenario(load=f"{0.9 * crane.SWL} kg", s_w="60 m", tip="sine 5 m 7 s", mode="position", ramp="1 s")
    made, other = (stillhook.Session(crane, case, coupling=coupling) for _ in range(2))
    made.set("v_op", 3.0)
    for k in range(8):
        made.step(cycles=50)
        made.set("mode", "manual" if k % 3 else "position")
        made.set("f_pump", 0.3 + 0.1 * k)
        other.restore(made.save())
        assert other.save() == made.save()
    assert (made.step(cycles=20), other.step(cycles=20)) == (None, None)
    assert other.save() == made.save()


def test_a_session_of_fifty_years_counts_its_cycles(session):
    """The count of a state moved ahead, as no test waits so long: time is the count times the cycle, and goes on."""
    first, head, numbers = parts(session.save())
    before = session.save()
    at = [i for i, name in enumerate(head["names"]) if name == ".st.common.cycles"]
    numbers[at] = YEARS
    session.restore(remade(first, {**head, "k": YEARS}, numbers))
    session.step(cycles=3)
    assert session.time == (YEARS + 3) * CRANE.control.t_cycle
    assert np.isfinite(session.get("e_c"))
    _, head, numbers = parts(session.save())
    assert head["k"] == YEARS + 3
    assert numbers[at] == YEARS + 3
    session.restore(before)


def test_what_is_kept_in_memory_goes_back_in_its_own_session_alone(session):
    kept, data = session.keep(), session.save()
    session.step(cycles=5)
    session.go_back(kept)
    assert session.save() == data
    with pytest.raises(SimulationError, match="another session"):
        stillhook.Session(CRANE, CASE).go_back(kept)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("f_pump", -0.5, "f_pump = -0.5: give a value from 0 to 1"),
        ("K_p", -1.0, "K_p = -1.*give a value from 0"),
        ("alpha_ns", 0.0, "alpha_ns = 0.*0.001 to 1"),
        ("s_tip", 1e9, "s_tip = 1000000000.*-1e"),
    ],
)
def test_nothing_is_set_that_a_saved_state_may_not_hold(session, name, value, words):
    before = session.save()
    with pytest.raises(SimulationError, match=words):
        session.set(name, value)
    assert session.save() == before
