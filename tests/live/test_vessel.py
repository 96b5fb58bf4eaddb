"""The vessel's motion as the input of a live twin, over Modbus, UDP and OPC UA, in place of the tip's."""

from __future__ import annotations

import asyncio
import json
import math
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.live.test_modbus import ask, read_request, write_request

import stillhook
from stillhook.errors import LiveError
from stillhook.live.runtime import Event, Flag, LiveTwin, Task
from stillhook.live.runtime.board import Board
from stillhook.live.runtime.inputs import InputWriter
from stillhook.live.runtime.kernel import Kernel
from stillhook.live.servers.modbus import ModbusServer, ModbusSettings
from stillhook.live.servers.opcua import OpcUaServer, OpcUaSettings, client
from stillhook.live.servers.registers import read_registers
from stillhook.live.servers.trust import TrustFolder
from stillhook.live.servers.udp import UdpServer, UdpSettings
from stillhook.sea.vessel.vessel_tip import GIVEN, NEEDED, VESSEL

pytest.importorskip("pymodbus", reason="the extra live is not installed")
pytest.importorskip("asyncua", reason="the extra live is not installed")
pytestmark = pytest.mark.slow

BOOM = "x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg"
UNIT = stillhook.MotionUnit(heave_period="25 s", delay="20 ms")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip=stillhook.VesselTip(BOOM, unit=UNIT), mode="ssc", ramp="0 s")
CRANE = stillhook.load_crane("nov-250t")
REST = dict.fromkeys(NEEDED, 0.0)
MAP = "".join(
    f'[[register]]\nname = "{name}"\naddress = {2 * i + 100 * (access == "write")}\naccess = "{access}"\n'
    f'unit = "{ {"rad": "deg", "rad/s": "deg/s", "rad/s^2": "deg/s^2"}.get(VESSEL[name][1], VESSEL[name][1]) }"\n'
    for access in ("read", "write")
    for i, name in enumerate(NEEDED)
)


class InProcess:
    """A twin whose kernel is in this process, for servers; its clock is at `now`, and a `cycle` is 10 ms of it."""

    write, latest = LiveTwin.write, LiveTwin.latest
    alive, n = True, 0

    def __init__(self) -> None:
        self._board = Board()
        self.kernel = Kernel(Task(CRANE, CASE), self._board)
        self.names, self.inputs, self.streamed = self.kernel.names, self.kernel._input_names, self.kernel._streamed
        self._writer = InputWriter(self._board.inputs, self.inputs)
        self._inputs = SimpleNamespace(write=lambda values, _, stamp: self._writer.write(values, self.now, stamp))
        self.events: list[Event] = []
        self.now = 100.0

    def cycle(self) -> Mapping[str, float]:
        self.kernel._cycle(self.n, SimpleNamespace(at=lambda n: self.now - 0.01, lateness=lambda n: 0.0), 0.0)
        self.n, self.now = self.n + 1, self.now + 0.01
        row = self.latest()
        assert row is not None
        return row.values

    def tell(self, happened: Event) -> None:
        self.events.append(happened)


@pytest.fixture
def twin() -> Iterator[InProcess]:
    made = InProcess()
    yield made
    made._board.close()


def words(*values: float) -> list[int]:
    return list(struct.unpack(f">{2 * len(values)}H", struct.pack(f">{len(values)}f", *values)))


def test_a_plc_writes_roll_in_degrees_and_reads_it_back(twin: InProcess, tmp_path: Path):
    """The tip goes where roll takes it, y sin(roll) + z cos(roll) - z, and the vessel is in the registers."""
    (tmp_path / "map.toml").write_text(MAP)
    loop = asyncio.new_event_loop()
    twin.cycle()
    of = loop.run_until_complete(
        ModbusServer(twin, ModbusSettings(tmp_path / "map.toml", port=0, writes=True)).__aenter__()
    )
    try:
        (answer,) = ask(loop, of, write_request(100, words(0.5, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
        assert answer[0] == 16
        values = twin.cycle()
        _, y, z = CASE.tip.boom.tip
        roll = math.radians(2.0)
        assert values["s_tip"] == pytest.approx(0.5 + y * math.sin(roll) + z * (math.cos(roll) - 1.0), abs=1e-6)
        (answer,) = ask(loop, of, read_request(3, 6, 2))
        assert struct.unpack(">f", answer[2:])[0] == pytest.approx(2.0, abs=1e-6)
    finally:
        loop.run_until_complete(of.__aexit__(None, None, None))
        loop.close()


def test_the_heave_of_the_unit_is_served_late_and_filtered(twin: InProcess):
    session = stillhook.Session(CRANE, CASE)
    for k in range(1, 101):
        w, t = 2.0 * math.pi / 8.0, 0.01 * k
        heave = (math.sin(w * t), w * math.cos(w * t), -w * w * math.sin(w * t))
        given = {**REST, **dict(zip(GIVEN["heave"], heave, strict=True))}
        twin.kernel._step(given)
        session.step(given)
    served = dict(zip(twin.kernel._read, twin.kernel._values(), strict=False))
    assert {name: served[name] for name in ("heave", "unit_heave", "s_tip", "e_c", "slew")} == {
        name: session.get(name) for name in ("heave", "unit_heave", "s_tip", "e_c", "slew")
    }
    assert served["heave"] == math.sin(w)
    assert 0.05 < abs(served["unit_heave"] - served["heave"]) < 0.5


def test_what_came_last_moves_the_twin_and_the_other_does_not_go_stale(twin: InProcess):
    twin.write({"s_tip": 0.7, "v_tip": 0.0, "a_tip": 0.0}, "plc")
    assert twin.cycle()["s_tip"] == pytest.approx(0.7)
    twin.write({**REST, "heave": 0.3}, "plc")
    values = twin.cycle()
    assert values["s_tip"] == pytest.approx(0.3)
    assert values["heave"] == 0.3
    twin.now += 0.9
    twin.write({**REST, "heave": 0.3}, "plc")
    twin.now += 0.5
    assert not int(twin.cycle()["cycle_flags"]) & Flag.STALE
    twin.now += 0.9
    assert int(twin.cycle()["cycle_flags"]) & Flag.STALE
    twin.write({"s_tip": 0.1, "v_tip": 0.0, "a_tip": 0.0}, "plc")
    assert twin.cycle()["s_tip"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({**REST, "s_tip": 0.0}, "plc: s_tip and heave: give the motion of the tip or that of the vessel."),
        ({**REST, "roll": math.nan}, "plc: roll = nan: give a finite number in SI units."),
        ({"sway": 1.0}, "plc: sway is not an input."),
    ],
)
def test_a_motion_that_is_none_is_not_written(twin: InProcess, given: dict[str, float], line: str):
    with pytest.raises(LiveError) as problem:
        twin.write(given, "plc")
    assert str(problem.value).startswith(line)
    assert "\n" not in str(problem.value)


def test_a_ship_that_capsizes_and_half_a_motion_are_refused_and_counted(twin: InProcess):
    twin.write({**REST, "roll": 57.0}, "plc")
    values = twin.cycle()
    assert int(values["cycle_flags"]) & Flag.REFUSED
    assert not int(values["cycle_flags"]) & Flag.RESET
    (record,) = [r for r in map(Event.from_json, twin._board.events.records(0)[1]) if r.name == "refused-input"]
    assert record.text == "roll = 57: give a value within +-1.0472."
    twin.write({"heave": 0.1, "v_heave": 0.0, "a_heave": 0.0}, "plc")
    assert int(twin.cycle()["cycle_flags"]) & Flag.PARTIAL


def test_a_twin_without_a_boom_has_no_vessel(tmp_path: Path):
    plain = stillhook.Session(CRANE, CASE.model_copy(update={"tip": stillhook.Still()}))
    (tmp_path / "map.toml").write_text(MAP)
    with pytest.raises(
        LiveError, match=r'map.toml: register "heave": name = "heave": no number of this twin. Choose one of s_tip'
    ):
        read_registers(tmp_path / "map.toml", plain.signals, plain.inputs)


@pytest.mark.long
def test_udp_and_opc_ua_take_and_show_the_vessel(twin: InProcess, tmp_path: Path):
    from asyncua import ua

    opcua = OpcUaServer(twin, "nov-250t", twin.streamed, OpcUaSettings(tmp_path / "own", port=0))
    udp = UdpServer(twin, UdpSettings(port=0, writes=True))
    plc = TrustFolder(tmp_path / "plc", "plc")
    twin.cycle()

    async def both() -> tuple[float, Any, str]:
        async with opcua, udp:
            (opcua.trust.trusted / "plc.der").write_bytes(plc.certificate.read_bytes())
            udp._receive(json.dumps({**REST, "heave": 0.2}).encode(), ("127.0.0.1", 1))
            twin.cycle()
            async with await client(opcua.url, plc, opcua.trust.certificate) as of:
                space = await of.get_namespace_index("urn:stillhook:live")
                node = lambda name: of.get_node(f"ns={space};s={name}")
                await opcua.publish()
                heave = await node("heave").read_value()
                (unit,) = await node("roll").get_properties()
                moved = {**REST, "pitch": 0.01}
                await of.write_values([node(f"Inputs.{name}") for name in moved], [*moved.values()])
                path = await node("roll").get_path(as_string=True)
                return heave, await unit.read_value(), "/".join(path)

    heave, unit, path = asyncio.run(both())
    assert heave == 0.2
    assert (unit.UnitId, unit.DisplayName) == (int.from_bytes(b"C81"), ua.LocalizedText("rad"))
    assert "Components" in path
    assert "Vessel" in path
    assert twin.cycle()["s_tip"] == pytest.approx(CASE.tip.boom.tip[0] * 0.01, rel=0.15)
