"""A soft PLC acts as the winch's own controller does, and stops the winch when its plant or its bus is gone."""

from __future__ import annotations

import asyncio
import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.live.plants import CASE, CRANE, Direct

from stillhook import Scenario, Session, load_crane
from stillhook.cli.live.plc import _lines
from stillhook.errors import LiveError
from stillhook.export.plc.sequence import Reference, inputs, numbers
from stillhook.live.hil import soft_plc
from stillhook.live.hil.bus import BusError
from stillhook.live.hil.controller import INPUTS, OUTPUTS, SIGNALS, LibraryController
from stillhook.live.hil.cost import LEAST, SETTLE, bus_cost, in_process
from stillhook.live.hil.plc_log import PlcLog, Recorded, read_plc_log
from stillhook.live.hil.script import Script
from stillhook.live.hil.soft_plc import Cycle, Outcome, SoftPlc
from stillhook.report.terminal import Answer, print_in_full

U_P, BRAKE, STATE = (OUTPUTS.index(name) for name in ("u_p", "brake", "state"))


class Quick(LibraryController):
    """The same controller called five times as often as it believes: it counts cycles, not the clock."""

    def __init__(self, mode: str = "ssc") -> None:
        super().__init__(CRANE, mode)
        self.t_cycle = 0.2 * self.t_cycle


class Operator(Script):
    """Releases the joystick in manual mode from cycle 700 on, and acknowledges from cycle 740 on."""

    def __init__(self) -> None:
        super().__init__()
        self.cycle = 0

    def apply(self, time: float, inputs: np.ndarray) -> np.ndarray:
        out = super().apply(time, inputs)
        if self.cycle >= 700:
            out[[INPUTS.index("mode"), INPUTS.index("v_op")]] = 0.0
        out[INPUTS.index("reset")] = float(self.cycle >= 740)
        self.cycle += 1
        return out


def run(
    bus: Direct, path: Path, cycles: int, change: Callable[[int], None] | None = None, script: Script | None = None
) -> tuple[Outcome, Recorded, list[str]]:
    """A run of so many cycles; change is called before each with its number."""
    lines: list[str] = []
    count = itertools.count()

    def done() -> bool:
        k = next(count)
        if change is not None:
            change(k)
        return k >= cycles

    with PlcLog(path) as log:
        outcome = asyncio.run(SoftPlc(bus, Quick(), script or Script(), log, lines.append).run(done))
    return outcome, read_plc_log(path, None, "plc.toml"), lines


@pytest.mark.long
@pytest.mark.parametrize(("crane", "controller"), [("nov-250t", "ssc"), ("nov-100t-electric", "position")])
def test_the_library_as_a_plc_gives_what_the_exported_block_must_give(crane: str, controller: str):
    plc = LibraryController(load_crane(crane), controller)
    for outside, expected in itertools.islice(inputs(plc.block, Reference(plc.block)), 1500):
        assert np.array_equal(plc.cycle(np.array(numbers(outside))), np.array(expected))


@pytest.mark.long
def test_many_cycles_at_once_are_the_bits_of_one_after_another():
    rows = np.array([numbers(o) for o, _ in itertools.islice(inputs(Quick().block, Reference(Quick().block)), 900)])
    one = Quick()
    assert np.array_equal(Quick().cycles(rows), np.array([one.cycle(row) for row in rows]))


@pytest.mark.long
@pytest.mark.parametrize("sensors", [{}, {"noise_F": "5 kN", "delay": "40 ms"}])
def test_a_plc_that_reads_what_the_winch_senses_moves_it_as_its_own_controller_to_the_bit(sensors: dict[str, str]):
    case = Scenario(load="100 t", s_w="100 m", tip="sine 1.5 m 9 s", mode="ssc", sensors=sensors)
    own, plant, plc = Session(CRANE, case), Session(CRANE, case), LibraryController(CRANE, "ssc")
    plant.set("override", 1.0)
    for _ in range(800):
        outputs = plc.cycle(np.concatenate([plant.sensed(), np.ones(len(SIGNALS)), [0.0]]))
        for name in ("u_p", "u_m", "brake"):
            plant.set(name, float(outputs[OUTPUTS.index(name)]))
        own.step()
        plant.step()
    assert [plant.get(n) for n in ("s_w", "p_a", "e_c")] == [own.get(n) for n in ("s_w", "p_a", "e_c")]
    assert abs(own.get("u_p")) > 0.01


@pytest.mark.long
def test_a_healthy_run_compensates_and_hands_the_winch_back(tmp_path: Path):
    bus = Direct()
    outcome, log, lines = run(bus, tmp_path / "log.csv", 300)
    assert bus.written[-1] == {"override": 0.0}
    assert lines == []
    assert not outcome.stopped
    assert outcome.cycles == len(log.cycles) == 300
    assert np.array_equal(log.inputs[:, len(SIGNALS) : -1], np.ones((300, len(SIGNALS))))
    assert [w["u_p"] for w in bus.written[:-1]] == log.outputs["u_p"][: len(bus.written) - 1].tolist()
    assert np.ptp(log.outputs["u_p"]) > 0.01


@pytest.mark.long
def test_a_plant_that_dies_stops_the_winch_until_it_is_acknowledged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(soft_plc, "AGAIN", 0.05)
    bus = Direct()

    def change(k: int) -> None:
        bus.dead = 100 <= k < 500

    _, log, lines = run(bus, tmp_path / "log.csv", 1000, change, Operator())
    state, u_p, brake = (log.outputs[name] for name in ("state", "u_p", "brake"))
    assert state[:100].max() == 0.0
    assert (state[480], u_p[480], brake[480]) == (2.0, 0.0, 1.0)
    assert (state[650], u_p[650]) == (2.0, 0.0)  # the plant is back, and nobody has acknowledged
    assert state[-1] == 0.0
    assert bus.connections >= 2
    assert [line for line in lines if "lost" in line]
    assert [line for line in lines if "connected again" in line]
    assert [line for line in lines if "stopped the winch (all inputs)" in line]
    assert [line for line in lines if "acknowledged" in line]


@pytest.mark.long
def test_an_image_that_stands_still_is_a_dead_plant(tmp_path: Path):
    bus = Direct()

    def change(k: int) -> None:
        bus.frozen = k >= 100

    outcome, log, _ = run(bus, tmp_path / "log.csv", 700, change)
    assert outcome.stopped
    assert log.inputs[-1, len(SIGNALS) : -1].max() == 0.0
    assert log.outputs["u_p"][-1] == 0.0


@pytest.mark.long
@pytest.mark.parametrize(("name", "stops"), [("s_w", True), ("s_tip", True), ("p_hp", False)])
def test_nan_over_the_bus_makes_that_input_bad_and_no_other(name: str, stops: bool, tmp_path: Path):
    bus = Direct()

    def change(k: int) -> None:
        bus.lost = (f"sensed_{name}",) if k >= 100 else ()

    outcome, log, _ = run(bus, tmp_path / "log.csv", 500, change)
    i = SIGNALS.index(name)
    bad = [SIGNALS[j] for j in np.flatnonzero(log.inputs[-1, len(SIGNALS) : -1] == 0.0)]
    assert bad == [name]
    assert math.isnan(log.inputs[-1, i])
    assert outcome.stopped is stops
    assert all(math.isfinite(x) for w in bus.written for x in w.values())
    assert np.array([list(w.values()) for w in bus.written[:-1]]).min() >= -1.0


@pytest.mark.long
def test_late_answers_delay_no_cycle_and_pile_up_nowhere(tmp_path: Path):
    bus = Direct()
    bus.slow = 0.05  # 25 cycles
    outcome, log, _ = run(bus, tmp_path / "log.csv", 400)
    assert bus.most_waiting == 1
    assert outcome.cycles == 400
    assert outcome.without_answer > 300
    assert log.cycles.tolist() == list(range(400))


@pytest.mark.long
def test_another_client_that_commands_the_winch_ends_the_run(tmp_path: Path):
    bus = Direct()

    def change(k: int) -> None:
        bus.foreign = 0.123 if k % 2 else math.nan

    with pytest.raises(LiveError, match="another client commands the winch"):
        run(bus, tmp_path / "log.csv", 2000, change)
    assert bus.written[-1] == {"override": 0.0}


@pytest.mark.long
def test_a_plant_that_takes_no_commands_ends_the_run_in_one_line(tmp_path: Path):
    bus = Direct()
    bus.refusing = LiveError("direct: refused.")
    with pytest.raises(LiveError, match="refused"):
        run(bus, tmp_path / "log.csv", 50)


@pytest.mark.long
def test_a_plant_that_is_not_there_is_said_before_a_cycle(tmp_path: Path):
    bus = Direct()
    bus.dead = True
    with pytest.raises(BusError, match="no connection"):
        run(bus, tmp_path / "log.csv", 50)


def test_a_log_that_cannot_be_written_is_refused(tmp_path: Path):
    with pytest.raises(LiveError, match="Give log another place"), PlcLog(tmp_path / "none" / "log.csv"):
        pass


# What the bus costs


@pytest.fixture(scope="module")
def own() -> np.ndarray:
    return in_process(CRANE, CASE, SETTLE + LEAST + 2.0)


def seen(own: np.ndarray) -> Iterator[Cycle]:
    for k, (e_c, s_tip) in enumerate(own):
        yield Cycle(k * CRANE.control.t_cycle, e_c, s_tip)


def test_a_bus_that_is_none_costs_nothing_and_an_error_that_grows_by_a_fifth_costs_a_fifth(own: np.ndarray):
    free = bus_cost(CRANE, CASE, list(seen(own)))
    assert free.cost == 0.0
    assert free.s_tip_pp == pytest.approx(3.0, rel=1e-3)
    worse = bus_cost(CRANE, CASE, [c._replace(e_c=1.2 * c.e_c) for c in seen(own)])
    assert worse.cost == pytest.approx(0.2 * free.e_c_pp)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda c: c._replace(s_tip=c.s_tip + 0.01), "did not move as the case file says"),
        (lambda c: c._replace(e_c=math.nan), "did not come over the bus"),
        (lambda c: c._replace(time=0.1 * c.time), "too short"),
        (lambda c: c._replace(time=c.time + 4000.0), "first 3600 s"),
    ],
)
def test_a_cost_that_cannot_be_known_is_not_said(change: Callable[[Cycle], Cycle], reason: str, own: np.ndarray):
    assert reason in bus_cost(CRANE, CASE, [change(c) for c in seen(own)])


def test_a_run_without_cycles_has_no_cost():
    assert "too short" in bus_cost(CRANE, CASE, [])


def test_the_end_of_a_run_says_what_the_bus_cost_or_why_not(own: np.ndarray, capsys: pytest.CaptureFixture[str]):
    times = np.array([0.001, 0.002, 0.004])
    outcome = Outcome(3, 1, 0, 0, 0, times, times, np.array([math.nan]), False, [])
    cost = bus_cost(CRANE, CASE, [c._replace(e_c=1.2 * c.e_c) for c in seen(own)])
    print_in_full(Answer("PLC", _lines(outcome, cost)))
    out = capsys.readouterr().out
    assert f"the bus costs {100 * cost.cost:.2f} cm" in out
    assert "3 cycles: 1 late" in out
    print_in_full(Answer("PLC", _lines(outcome._replace(stopped=True), "It is not known.")))
    out = capsys.readouterr().out
    assert "The guard stopped the winch.\nIt is not known.\n" in out
