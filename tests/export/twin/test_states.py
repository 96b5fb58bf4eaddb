"""States of the C core from outside, and its time by count."""

import numpy as np
import pytest
from tests.engine.damage import IMPOSSIBLE, damaged
from tests.export.host_clock import added_up
from tests.export.twin.host import HEAD, NO_STATE, OK, OUT_OF_RANGE, WRONG_STEP, Host, remade

import stillhook
from stillhook.export.twin import export

CYCLES = 300
DAY = 86400 * 100
"""PLC cycles of 10 ms."""
TIP = ("s_tip", "v_tip", "a_tip")
PARTS = ("A", "row", "input", "beginning", "clock", "lowest", "end")


def made(name: str = "nov-250t", contents: str = "plant+controller", coupling: str = "tip", **more: object):
    crane = stillhook.load_crane(name)
    mode = crane.plant.type.default_mode
    case = {"load": f"{0.4 * crane.SWL} kg", "s_w": "100 m", "tip": "still", "mode": mode} | more
    return export(crane, stillhook.Scenario(**case), contents, coupling)


def run(host: Host, cycles: int = CYCLES, first: int = 0, t: float = 0.0) -> float:
    """Steps on a sine; gives the host's own sum of steps."""
    names = {p.name for p in host.export.ports}
    for k in range(first, first + cycles):
        if "s_tip" in names:
            w = 0.5
            host.set(s_tip=np.sin(w * k / 100), v_tip=w * np.cos(w * k / 100), a_tip=-w * w * np.sin(w * k / 100))
        assert host.step(t, 0.01) == OK
        t += 0.01
    return t


@pytest.fixture(scope="module")
def host(compiled) -> Host:
    winch = Host(made(), compiled)
    winch.set(v_op=0.1, K_p=0.4)
    assert winch.start() == OK
    run(winch)
    return winch


def numbers(data: bytes) -> np.ndarray:
    return np.frombuffer(data[HEAD:-4])


def at(host: Host, part: str) -> int:
    return int(host.lib.twin_at(PARTS.index(part)))


def refused(host: Host, data: bytes) -> str:
    before = host.save()
    answer, why = host.try_restore(data)
    assert answer == NO_STATE, data[:40]
    assert why
    assert "\n" not in why
    assert host.save() == before
    return why


def test_the_checksum_is_that_of_zlib_and_a_sound_state_is_taken_to_the_bit(host: Host):
    data = host.save()
    assert remade(data, {}) == data
    assert len(numbers(data)) == at(host, "end")
    host.restore(data)
    assert host.save() == data


def test_no_damaged_state_is_taken_and_the_winch_goes_on(host: Host, compiled):
    data, n = host.save(), 0
    for bad in damaged(data, 4200):
        refused(host, bad)
        n += 1
    assert n > 3900
    other = Host(host.export, compiled)
    other.restore(data)
    run(host, 50, CYCLES, CYCLES * 0.01)
    run(other, 50, CYCLES, CYCLES * 0.01)
    assert other.save() == host.save()
    host.restore(data)


@pytest.mark.parametrize("value", IMPOSSIBLE)
def test_no_number_may_be_impossible_though_the_checksum_is_right(host: Host, value: float):
    data = host.save()
    lane = [host.lib.twin_name(i).decode() for i in range(at(host, "row"))]
    for i in range(len(numbers(data))):
        free = i < len(lane) and lane[i].startswith("st.") and not lane[i].endswith("_cycles")
        bad = remade(data, {i: value})
        if bad != data and not (np.isfinite(value) and (free or i >= at(host, "clock"))):
            refused(host, bad)


def test_a_count_or_a_clock_that_cannot_be_is_refused(host: Host):
    data, clock = host.save(), at(host, "clock")
    for cycles in (-1.0, -1e9, -32.0, 0.5, 2.0**60, CYCLES - 1.0):
        refused(host, remade(data, {clock + 1: cycles}))
    assert "the host's time" in refused(host, remade(data, {clock + 2: CYCLES * 0.01 + 0.005}))
    for offset, values in ((3, (2.0, -1.0, 0.5)), (4, (2.0, 0.5)), (5, (1.0,)), (6, (-1.0, CYCLES + 1.0, 0.5))):
        for x in values:
            refused(host, remade(data, {clock + offset: x}))
    refused(host, remade(data, {clock + 8: -1.0}))  # a sum of squares
    refused(host, remade(data, {at(host, "lowest"): 5.0}))  # above the highest


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("x.winch.alpha_m", (-0.5, 2.0)),
        ("x.path.s_w", (-500.0, 5000.0)),
        ("m.brake", (-0.1, 1.1)),
        ("m.mode", (0.5, -1.0, 99.0)),
        ("st.common.cycles", (-1.0, 0.5, CYCLES + 1.0)),
        ("st.limits.relief", (-1.0, CYCLES + 1.0)),
        ("p.hoist.load.W", (0.0, 1.0e6)),
        ("p.plc.gains.K_p", (-1.0,)),
        ("p.hoist.s_w_0", (101.0,)),
    ],
)
def test_a_number_outside_its_range_is_named(host: Host, name: str, values: tuple[float, ...]):
    data = host.save()
    (i,) = [i for i in range(at(host, "row")) if host.lib.twin_name(i).decode() == name]
    for x in values:
        assert refused(host, remade(data, {i: x})).startswith((f"{name} = ", name.split(".")[-1]))


def test_the_core_is_safe_where_a_count_is_overwritten_in_memory(host: Host, compiled):
    """A wild pointer of the host: the core writes inside of its own memory, whatever the count is."""
    data = host.save()
    for cycles in (-1.0, -33.0, -3e9, 2.0**62, float("nan"), float("inf"), 1e300):
        other = Host(host.export, compiled)
        other.restore(data)
        other.lib.twin_put(other.at, at(host, "clock") + 1, cycles)
        other.step(other.time(), 0.01)
        other.get("valid")


@pytest.mark.long
def test_a_state_of_another_winch_kind_or_version_is_refused(host: Host, compiled):
    for other in (made(load="90 t"), made("nov-100t-cylinder"), made(contents="controller"), made(coupling="wire")):
        winch = Host(other, compiled)
        assert winch.start() == OK
        assert "another crane, case or version" in refused(host, winch.save())
    data = bytearray(host.save())
    data[7] = ord("1")
    assert "another version of the format" in refused(host, bytes(data))
    data[0] = ord("X")
    assert "no state of this kind" in refused(host, bytes(data))
    refused(host, b"")


@pytest.mark.parametrize(
    ("name", "contents", "coupling"),
    [
        ("nov-100t-cylinder", "plant+controller", "tip"),
        ("nov-100t-electric", "plant", "wire"),
        ("nov-250t", "controller", "tip"),
        pytest.param("nov-250t-secondary", "plant+controller", "wire", marks=pytest.mark.thorough),
        pytest.param("utility-20t-open-circuit", "plant", "tip", marks=pytest.mark.thorough),
    ],
)
def test_every_kind_of_export_takes_its_own_states_and_no_damaged_ones(name, contents, coupling, compiled):
    winch = Host(made(name, contents, coupling), compiled)
    blank = winch.save()
    winch.restore(blank)  # before the start
    for bad in damaged(blank, 200, seed=4):
        refused(winch, bad)
    assert winch.start() == OK
    run(winch, 120)
    data = winch.save()
    other = Host(winch.export, compiled)
    other.restore(data)
    assert other.save() == data
    for bad in damaged(data, 400, seed=5):
        refused(winch, bad)
    for i in range(len(numbers(data))):
        refused(winch, remade(data, {i: float("nan")}))
    run(winch, 20, 120, 1.2)
    run(other, 20, 120, 1.2)
    assert other.save() == winch.save()


def aged(host: Host, cycles: int, host_time: float, time_0: float = 0.0) -> None:
    """As if it had run for so many cycles on a clock that shows host_time."""
    clock = at(host, "clock")
    host.restore(remade(host.save(), {clock: time_0, clock + 1: float(cycles), clock + 2: host_time}))


@pytest.mark.parametrize("cycles", [10**8, 365 * DAY, 20 * 365 * DAY, 50 * 365 * DAY])
@pytest.mark.parametrize("h", [0.01, 0.03, 0.1])
def test_a_host_that_adds_up_its_steps_is_served_for_years_and_its_drift_is_not_ours(host: Host, cycles: int, h: float):
    before, n = host.save(), round(h / 0.01)
    t = added_up(cycles // n, h)
    aged(host, cycles // n * n, t)
    for _ in range(200):
        assert host.step(t, h) == OK
        t += h
    assert host.time() == (cycles // n * n + 200 * n) * 0.01
    for beside in (0.005, -0.005, 0.0025 * 1.2, 0.01, -0.01, 1.0):
        assert host.step(t + beside, h) == WRONG_STEP, beside
    assert host.step(t, h + 0.005) == WRONG_STEP
    assert host.step(host.time(), h) == OK  # by the count, as a host does that multiplies
    host.restore(before)


def test_a_clock_that_runs_from_another_time_is_served_and_one_that_cannot_tell_cycles_apart_is_not(compiled):
    for start in (1.7e9, -1.7e9):  # seconds since 1970
        winch = Host(made(), compiled)
        assert winch.start(start) == OK
        t = start
        for _ in range(2000):
            assert winch.step(t, 0.01) == OK
            t += 0.01
        assert winch.step(t + 0.005, 0.01) == WRONG_STEP
    winch = Host(made(), compiled)
    assert winch.start(1e14) == OUT_OF_RANGE


def test_a_host_whose_steps_are_a_little_off_is_refused_before_it_is_late(compiled):
    winch, h, t = Host(made(), compiled), 0.01 + 0.5e-6, 0.0
    assert winch.start() == OK
    answers = []
    for _ in range(10):
        answers.append(winch.step(t, h))
        t += h
    assert WRONG_STEP in answers
