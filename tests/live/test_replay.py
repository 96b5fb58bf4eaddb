"""A log as if it happened now: the twin of the crane that wrote it does not deviate, another one does."""

from __future__ import annotations

import contextlib
import math
import re
import socket
import struct
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from tests.live.test_modbus import read_request, write_request

import stillhook
from stillhook.cli.live.twin import _answer_of_replay
from stillhook.errors import LiveError
from stillhook.formats.case_file import CaseFile
from stillhook.live.demo import with_friction
from stillhook.live.live_file import LivePlan
from stillhook.live.servers.modbus import ModbusSettings
from stillhook.live.watch.deviation import LIMITS
from stillhook.live.watch.journal import Entry
from stillhook.live.watch.replay import Moment, Replayed, longest_stretch, replay, scenario_of
from stillhook.live.watch.virtual import Reading
from stillhook.live.watch.windows.criteria import Status, WindowResult
from stillhook.logs.log import read_log
from stillhook.report.terminal import MOST_LINES, print_in_full

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(
    load="100 t", s_w="100 m", tip="sine 1.2 m 7 s", mode="ssc", duration="36 s", warm_up="5 s", ramp="0 s"
)
HEADINGS = {"s_tip": "m", "v_tip": "m/s", "s_w": "m", "p_a": "bar", "p_b": "bar", "u_p": "1", "mode": "1"}
SPEED = 20.0
SPREAD = 1.0e-3
"""Spread of wire out about its standing offset: what averaging over bins of 0.1 s and their curve leave [m]."""


def write_log(path: Path, crane: stillhook.Crane, *, leave_out: slice | None = None) -> Path:
    run = stillhook.simulate(crane, CASE, every="0.05 s", series=True)
    scale = {"bar": 1.0e-5}
    columns = [run["time"].values, *(run[n].values * scale.get(u, 1.0) for n, u in HEADINGS.items())]
    table = np.column_stack(columns)
    if leave_out is not None:
        table = np.delete(table, np.r_[leave_out], axis=0)
    head = ",".join(["time [s]", *(f"{n} [{u}]" for n, u in HEADINGS.items())])
    np.savetxt(path, table, fmt="%.6f", delimiter=",", header=head, comments="")
    return path


MAP = "".join(
    f'[[register]]\nname = "{name}"\naddress = {10 * i}\ntype = "float64"\n'
    for i, name in enumerate(("s_w", "measured.s_w", "alarm.p_a", "virtual_half.s_load"))
)


class Onlooker(threading.Thread):
    """A Modbus client that reads registers of the map as long as there is a server, and tries to write once."""

    def __init__(self, line: str) -> None:
        super().__init__()
        self.port = int(re.search(r":(\d+), writes", line)[1])
        self.seen: list[tuple[float, ...]] = []
        self.refused = b""

    def run(self) -> None:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), timeout=10.0) as of:
            self.refused = self.ask(of, write_request(0, [0, 0, 0, 0]))
            while True:
                values = [struct.unpack(">d", self.ask(of, read_request(3, 10 * i, 4))[9:])[0] for i in range(4)]
                self.seen.append(tuple(values))
                time.sleep(0.02)

    def ask(self, of: socket.socket, frame: bytes) -> bytes:
        of.sendall(struct.pack(">HHHB", 1, 0, len(frame) + 1, 1) + frame)
        answer = of.recv(64)
        if not answer:
            raise OSError
        return answer


@pytest.mark.long
@pytest.mark.parametrize(("factor", "alarm"), [(1.0, False), pytest.param(3.0, True, marks=pytest.mark.thorough)])
def test_the_twin_of_a_crane_does_not_deviate_from_its_log_and_another_does(factor: float, alarm: bool, tmp_path: Path):
    log = read_log(write_log(tmp_path / "log.csv", with_friction(CRANE, factor)))
    moments: list[Moment] = []
    onlookers: list[Onlooker] = []
    (tmp_path / "map.toml").write_text(MAP)
    modbus = ModbusSettings(tmp_path / "map.toml", port=0, writes=True)
    plan = LivePlan(CaseFile(CRANE, CASE, None, None), tmp_path, 1.0, None, modbus, None)

    def ready(line: str) -> None:
        onlookers.append(Onlooker(line))
        onlookers[-1].start()

    found = replay(CRANE, CASE, log, SPEED, moments.append, plan=plan, ready=ready)
    (onlooker,) = onlookers
    onlooker.join()
    assert onlooker.refused[7] & 0x80
    both = [(simulated, measured) for simulated, measured, *_ in onlooker.seen if math.isfinite(measured)]
    assert len(both) > 3
    assert any(alarmed == 1.0 for *_, alarmed, _ in onlooker.seen) is alarm
    assert found.compared == pytest.approx(CASE.duration - 10.0, abs=1.0)
    assert len(moments) == pytest.approx(found.compared / log.every, abs=1.5)
    assert set(found.rms) == set(LIMITS)
    assert ("p_a" in found.alarms) is alarm
    assert found.failed is alarm
    assert {e.name for e in found.entries if e.sort == "alarm"} == set(found.alarms)
    assert found.not_judged["1d"].startswith("says what a set of tests contains")
    assert {r.name for r in found.virtual} >= {"F_hook", "T_f", "Q_leak", "T_gas"}
    if not alarm:
        assert found.alarms == {}
        s_w = next(d for d in moments[-1].deviations if d.name == "s_w")
        assert abs(s_w.mean) < 0.3 * LIMITS["s_w"]  # a log begins with an error, the twin without
        assert s_w.rms**2 - s_w.mean**2 < SPREAD**2


def test_the_longest_stretch_without_a_gap_is_replayed(tmp_path: Path):
    log = read_log(write_log(tmp_path / "log.csv", CRANE, leave_out=slice(200, 240)))  # 10 to 12 s
    stretch = longest_stretch(log)
    assert stretch.start == pytest.approx(12.0, abs=0.2)
    assert stretch.t[-1] == pytest.approx(24.0, abs=0.3)
    case = scenario_of(stretch, CASE, "log")
    measured = stretch.signals["s_tip"]
    assert case.tip.sample(stretch.t[5:-5])[0] == pytest.approx(measured[5:-5], abs=2e-3)
    assert (case.s_w, case.load, case.mode) == (pytest.approx(stretch.signals["s_w"][0]), CASE.load, CASE.mode)


@pytest.mark.parametrize("speed", [0.0, 0.05, 21.0, float("nan")])
def test_a_speed_that_no_processor_keeps_is_refused(speed: float, tmp_path: Path):
    log = read_log(write_log(tmp_path / "log.csv", CRANE))
    with pytest.raises(LiveError, match=r"--speed .*: give 0\.1 to 20 times"):
        replay(CRANE, CASE, log, speed, print)


def test_a_log_without_the_tip_is_refused_in_one_line(tmp_path: Path):
    path = write_log(tmp_path / "log.csv", CRANE)
    path.write_text(path.read_text().replace("s_tip [m]", "Q_relief [m^3/s]"))
    with pytest.raises(LiveError, match="no s_tip") as problem:
        longest_stretch(read_log(path))
    assert "\n" not in str(problem.value)


def test_what_was_found_is_read_as_tables_and_ends_with_the_cause(capsys: pytest.CaptureFixture[str]):
    lines = [
        WindowResult("p-load-cell", "Load cell", w, 0.1, 0.09, 0.11, "within +-5 %", "10 % (9 to 11 %)", s)
        for w, s in (("30 s", Status.CANNOT_TELL), ("5 min", Status.NOT_OK))
    ]
    entry = Entry(120.0, math.nan, "criterion", "p-load-cell over 5 min", "Load cell: 10 %.")
    reading = Reading("T_f", -800.0, 60.0, False, "criterion p-load-cell over 5 min")
    found = Replayed(
        compared=600.0,
        alarms={"p_a": 43.0},
        rms={"p_a": 21e5},
        late=0,
        scheduling="",
        entries=(entry,),
        summary=((entry, 2),),
        criteria=tuple(lines),
        not_judged={"1d": "coverage"},
        cause="Cause: load other than stated.",
        clock=(0.12, 0.008),
        virtual=(reading,),
    )
    answer = _answer_of_replay(CRANE, found)
    print_in_full(answer)
    out = " ".join(capsys.readouterr().out.split())
    for text in ("ALARM from 43.0 s", "10 % (9 to 11 %)", "cannot tell", "lasts", "120 ms +- 8 ms late", "virtual.T_f"):
        assert text in out
    assert out.endswith("Criteria not met at the end: p-load-cell. Cause: load other than stated.")
    brief = answer.text()
    assert len(brief) <= MOST_LINES
    for line in ("Criteria not met at the end: p-load-cell.", "Cause: load other than stated."):
        assert line in brief
    assert found.failed
