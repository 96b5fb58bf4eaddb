"""Stored states of the exchange with a host, in Python and in C, and its time by count."""

import base64
import ctypes
import hashlib
import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.engine.damage import IMPOSSIBLE, damaged
from tests.export.host_clock import added_up
from tests.export.twin.host import HEAD, remade

import stillhook
from stillhook.errors import SimulationError
from stillhook.export.hosts import Exchange, Sample, host_source
from stillhook.export.twin import export

NO_STATE, WRONG_STEP = 6, 2
HOST = 17
"""Numbers of the C state that are the host's."""
YEAR = 365 * 86400 * 100
"""PLC cycles of 10 ms."""


@pytest.fixture(scope="module")
def case() -> stillhook.Scenario:
    return stillhook.Scenario(load="100 t", s_w="100 m", tip="still", mode="ssc")


def sample(t: float, clock: float | None = None) -> Sample:
    """What a host gives after t seconds, at the time that its clock shows."""
    w, F_w = 0.5, 1.01e6 * (1.0 + 0.02 * math.sin(t))
    motion = (20.0 + math.sin(w * t), w * math.cos(w * t), -w * w * math.sin(w * t))
    return Sample(t if clock is None else clock, F_w, *motion)


def ran(nov, case, steps: int = 60, h: float = 0.017) -> Exchange:
    exchange = Exchange(nov, case)
    for i in range(steps):
        exchange.at(sample(i * h), new_step=True)
    return exchange


@pytest.fixture(scope="module")
def exchange(nov, case) -> Exchange:
    return ran(nov, case)


def sealed(data: dict) -> str:
    body = json.dumps(data)
    return json.dumps(
        {"format": "stillhook exchange 2", "sha256": hashlib.sha256(body.encode()).hexdigest(), "body": body}
    )


def refused(exchange: Exchange, text: object, words: str = ".", before: str = "") -> None:
    before = before or exchange.save()
    with pytest.raises(SimulationError, match=words) as problem:
        exchange.restore(text)
    assert "\n" not in str(problem.value)
    assert exchange.save() == before


def test_a_stored_state_goes_on_to_the_bit(nov, case, exchange: Exchange):
    text = exchange.save()
    other = Exchange(nov, case)
    other.restore(text)
    assert other.save() == text
    plain = ran(nov, case)
    for i in range(60, 80):
        assert other.at(sample(i * 0.017), new_step=True) == plain.at(sample(i * 0.017), new_step=True)


@pytest.mark.long
def test_no_damaged_state_is_taken(exchange: Exchange):
    text, n = exchange.save(), 0
    assert sealed(json.loads(json.loads(text)["body"])) == text
    for bad in damaged(text.encode(), 1500):
        refused(exchange, bad.decode("latin-1"), before=text)
        n += 1
    assert n > 1400


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"k": -1}, "k = -1"),
        ({"k": 10**9}, "k = 1000000000"),
        ({"k": 3.0}, "lacks numbers"),
        ({"part": 1.5}, "part 1.5"),
        ({"part": math.nan}, "not JSON of names"),
        ({"v_op": math.inf}, "not JSON of names"),
        ({"first": [0.0, 1e6]}, "lacks numbers"),
        ({"first": [math.nan, 1e6, 0.0, 0.0, 0.0]}, "not JSON of names"),
        ({"first": [0.0, -1e6, 0.0, 0.0, 0.0]}, "tension below 0"),
        ({"sample": [1e3, 1e6, 0.0, 0.0, 0.0]}, "1000 s"),
        ({"state": "not base 85 {"}, "."),
        ({"state": base64.b85encode(b"stillhook session 3\nxx").decode()}, "checksum"),
        ({"state": 7}, "lacks numbers"),
    ],
)
def test_a_host_that_cannot_be_is_refused_though_the_checksum_is_right(exchange: Exchange, change: dict, words: str):
    data = json.loads(json.loads(exchange.save())["body"])
    refused(exchange, sealed({**data, **change}), words)


@pytest.mark.parametrize("text", ["", "{}", "[]", "7", "null", "[" * 100_000, '{"format": "stillhook exchange 2"}'])
def test_text_that_is_no_state_is_refused(exchange: Exchange, text: str):
    refused(exchange, text, "stored state")


def test_the_state_of_an_older_version_is_refused_with_what_to_do(exchange: Exchange):
    refused(exchange, '{"first": [0, 1, 0, 0, 0], "k": 1}', "older version.*Start the simulation again")


def aged(exchange: Exchange, cycles: int, clock: float) -> None:
    """As if the host had run for so many cycles, on a clock that shows this time."""
    data = json.loads(json.loads(exchange.save())["body"])
    first, _, rest = base64.b85decode(data["state"]).partition(b"\n")
    line, _, body = rest[:-32].partition(b"\n")
    line = json.dumps({**json.loads(line), "k": cycles}).encode()
    state = first + b"\n" + line + b"\n" + body
    state += hashlib.sha256(state).digest()
    data |= {
        "k": cycles,
        "part": 0.0,
        "sample": [clock, *data["sample"][1:]],
        "state": base64.b85encode(state).decode(),
    }
    exchange.restore(sealed(data))


@pytest.mark.parametrize("cycles", [10**8, 10 * YEAR])
def test_a_host_that_adds_up_its_steps_has_the_answers_of_its_first_minute_after_years(nov, case, cycles: int):
    """Ten years on, the host's sum is off by more than a second: cycles follow its steps, one by one."""
    young, old = ran(nov, case, 101, 0.01), ran(nov, case, 101, 0.01)
    clock = added_up(cycles, 0.01)
    aged(old, cycles, clock)
    for i in range(101, 301):
        clock += 0.01
        a, b = young.at(sample(0.01 * i), new_step=True), old.at(sample(0.01 * i, clock), new_step=True)
        assert b.payout == pytest.approx(a.payout, abs=1e-9)
        assert b.s_w == pytest.approx(a.s_w, abs=1e-9)
    assert json.loads(json.loads(old.save())["body"])["k"] == cycles + 200


def test_steps_that_are_no_whole_number_of_cycles_stay_on_the_hosts_clock(nov, case):
    exchange, t = Exchange(nov, case), 0.0
    for _ in range(1000):
        exchange.at(sample(t), new_step=True)
        t += 0.0037
    data = json.loads(json.loads(exchange.save())["body"])
    assert data["k"] + data["part"] == pytest.approx(data["sample"][0] / 0.01, abs=1e-6)


def test_a_host_that_leaps_ahead_is_refused(exchange: Exchange):
    before = exchange.save()
    with pytest.raises(SimulationError, match=r"went ahead from .* give steps of at most 10000 s"):
        exchange.at(sample(0.0, 1e9), new_step=True)
    assert exchange.save() == before


class Native:
    """The library that hosts load, by its plain interface."""

    def __init__(self, file: Path) -> None:
        self.lib = lib = ctypes.CDLL(str(file))
        real, handle = ctypes.c_double, ctypes.c_void_p
        lib.stillhook_new.restype, lib.stillhook_new.argtypes = handle, [real] * 3
        out = ctypes.POINTER(real)
        lib.stillhook_exchange.argtypes = [handle, *[real] * 5, ctypes.c_int, out, out]
        lib.stillhook_size.restype = ctypes.c_int64
        lib.stillhook_save.argtypes = [handle, ctypes.c_char_p]
        lib.stillhook_restore.argtypes = [handle, ctypes.c_char_p, ctypes.c_int64]
        lib.stillhook_why.restype, lib.stillhook_why.argtypes = ctypes.c_char_p, [handle]
        self.winch = lib.stillhook_new(math.nan, 0.0, math.nan)

    def at(self, s: Sample) -> tuple[int, float, float]:
        payout, s_w = ctypes.c_double(), ctypes.c_double()
        answer = self.lib.stillhook_exchange(self.winch, *s, 1, ctypes.byref(payout), ctypes.byref(s_w))
        return answer, payout.value, s_w.value

    def save(self) -> bytes:
        room = ctypes.create_string_buffer(self.lib.stillhook_size())
        self.lib.stillhook_save(self.winch, room)
        return room.raw

    def restore(self, data: bytes) -> int:
        return int(self.lib.stillhook_restore(self.winch, data, len(data)))

    def refuses(self, data: bytes) -> str:
        before = self.save()
        assert self.restore(data) == NO_STATE
        assert self.save() == before
        return str(self.lib.stillhook_why(self.winch).decode())


@pytest.fixture(scope="module")
def library(nov, case, compiled) -> Path:
    return compiled(host_source(export(nov, case, coupling="wire"), "orcaflex"))


@pytest.mark.long
def test_the_library_takes_its_own_states_and_no_damaged_ones(library: Path):
    winch, other = Native(library), Native(library)
    other.restore(winch.save())  # before the first sample
    for i in range(60):
        assert winch.at(sample(0.017 * i))[0] == 0
    data = winch.save()
    assert other.restore(data) == 0
    assert other.save() == data
    for bad in damaged(data, 2000):
        assert winch.refuses(bad)
    for i in range((len(data) - HEAD - 4) // 8):
        for value in IMPOSSIBLE[:3]:
            if (bad := remade(data, {i: value})) != data:
                winch.refuses(bad)
    for i, value in ((0, 0.0), (0, 0.5), (1, 2.0), (3, 1.0), (6, -1.0), (15, 1.5), (15, -1.0), (10, 500.0)):
        if i != 3:
            winch.refuses(remade(data, {i: value}))
    assert "mode" in winch.refuses(remade(data, {3: 1.0, 4: 55.0}))
    assert [other.at(sample(0.017 * i)) for i in range(60, 90)] == [winch.at(sample(0.017 * i)) for i in range(60, 90)]


def test_the_library_serves_a_host_that_adds_up_its_steps_for_years(library: Path):
    young, old = Native(library), Native(library)
    for i in range(101):
        young.at(sample(0.01 * i))
        old.at(sample(0.01 * i))
    data, cycles = old.save(), 10 * YEAR
    numbers = np.frombuffer(data[HEAD:-4])
    (clock,) = [
        i
        for i in range(HOST, len(numbers) - 2)
        if numbers[i] == 0.0 and numbers[i + 1] == 100.0 and abs(numbers[i + 2] - 1.0) < 1e-9
    ]
    t = added_up(cycles, 0.01)
    assert old.restore(remade(data, {clock + 1: cycles, clock + 2: cycles * 0.01, 10: t, 15: 0.0})) == 0
    for i in range(101, 301):
        t += 0.01
        (_, payout, s_w), (answer, payout_old, s_w_old) = young.at(sample(0.01 * i)), old.at(sample(0.01 * i, t))
        assert answer == 0
        assert payout_old == pytest.approx(payout, abs=1e-9)
        assert s_w_old == pytest.approx(s_w, abs=1e-9)
    assert np.frombuffer(old.save()[HEAD:-4])[clock + 1] == cycles + 200


def test_what_the_library_refuses_changes_nothing(library: Path):
    winch = Native(library)
    for i in range(20):
        winch.at(sample(0.02 * i))
    before = winch.save()
    assert winch.at(sample(0.0, 1e9))[0] == WRONG_STEP
    assert winch.at(sample(0.4)._replace(v_tip=math.nan))[0] != 0
    assert winch.at(sample(0.1))[0] == WRONG_STEP
    assert winch.save() == before


class Simo:
    """The external force of SIMO, called as SIMO does, at times of single precision."""

    def __init__(self, file: Path, start: float) -> None:
        self.force, self.start = ctypes.CDLL(str(file)).gfexfo_, start
        self.force.restype = None

    def at(self, i: int, h: float) -> float:
        """Force on the load after i steps of h [kN]."""
        t = i * h
        info, info_r = np.zeros(12, np.int32), np.zeros(6, np.float32)
        info[[2, 4, 5, 7, 8]] = 2, 2, i + 1, 1, 1
        info_r[:2] = self.start + t, h
        bodies, ends = np.array([1, 2], np.int32), np.array([0, 0, 30, 0, 0, 2, 0], np.float32)
        state, stor, error = np.zeros(24), np.zeros(9, np.float32), np.zeros(1, np.int32)
        state[2], state[14] = 0.5 * (1.0 - math.cos(0.5 * t)), 30.0 - 2.0 - 100.0
        none, reals, ints = np.zeros(1), np.array([7], np.int32), np.array([2], np.int32)
        p = [none, none, none, none, info, info_r, none, none, none, bodies, ends, none, none, none, none, ints, reals]
        p += [none, none, none, state, none, none, stor, error]
        self.force(*(x.ctypes.data_as(ctypes.c_void_p) for x in p))
        assert error[0] == 0
        return float(stor[2])


@pytest.mark.long
def test_simo_may_run_for_weeks_though_its_time_is_of_single_precision(nov, case, compiled, tmp_path: Path):
    """After 23 days single precision holds times an eighth of a second apart; substeps of 50 ms are told apart."""
    forces, library = [], compiled(host_source(export(nov, case, coupling="wire"), "simo"))
    for start in (0.0, 2.0e6):
        host = Simo(shutil.copy(library, tmp_path / f"{start:.0f}.lib"), start)  # each has a winch of its own
        forces.append(np.array([host.at(i, 0.05) for i in range(80)]))
    assert np.ptp(forces[0]) > 10.0
    assert np.abs(forces[1] - forces[0]).max() < 1e-3
