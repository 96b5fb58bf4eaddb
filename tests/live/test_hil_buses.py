"""A soft PLC over the twin's own servers: what it reads is what the winch senses, and nothing moves without trust."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import time
import tomllib
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.live.plants import CRANE, PlantServed

from stillhook.cli import run
from stillhook.control.registry import Mode
from stillhook.errors import LiveError, StillhookError
from stillhook.library.examples import HIL, example_files
from stillhook.live.hil.bus import COMMANDS, FIRST_SENSED, OVERRIDE, BusError, Image
from stillhook.live.hil.modbus import ModbusBus, ModbusBusSettings, blocks
from stillhook.live.hil.opcua import OpcUaBus, OpcUaBusSettings
from stillhook.live.hil.plc_file import read_plc_file
from stillhook.live.live_file import read_live_file
from stillhook.live.runtime.board import IMAGE
from stillhook.live.servers.modbus import ModbusServer, ModbusSettings
from stillhook.live.servers.opcua import OpcUaServer, OpcUaSettings
from stillhook.live.servers.trust import TrustFolder
from stillhook.spec.crane import Crane

PLC_FILE, MODBUS_FILE = "plc.toml", "plc-modbus.toml"
PLC, _, OPCUA = (HIL / PLC_FILE).read_text().partition("\n[opcua]")
OPCUA, MODBUS = f"\n[opcua]{OPCUA}", "\n[modbus]" + (HIL / MODBUS_FILE).read_text().partition("\n[modbus]")[2]
REGISTERS = (HIL / "registers.toml").read_text()

pytest.importorskip("asyncua", reason="the extra live is not installed")
pytest.importorskip("pymodbus", reason="the extra live is not installed")

ELECTRIC = """crane = "nov-100t-electric"
[scenario]
load = "40 t"
s_w = "100 m"
tip = "still"
mode = "position"
"""
COMMAND = {"override": 1.0, "u_p": -0.25, "u_m": 0.75, "brake": 0.0}
FLOAT32 = 2.0**-23
PATIENCE = 90.0


async def used(bus: Any, what: Callable[[Any], Awaitable[Any]]) -> Any:
    """What is done over a connection, which is let go of at the end."""
    await bus.connect()
    try:
        return await what(bus)
    finally:
        await bus.close()


def over_modbus(folder: Path, what: Callable[[ModbusBus], Awaitable[Any]], text: str = "", writes: bool = True) -> Any:
    """Run with a connected bus; the server's plant, and the result."""
    path = folder / "registers.toml"
    path.write_text(text or REGISTERS)
    served = PlantServed()

    async def connected() -> Any:
        async with ModbusServer(served, ModbusSettings(path, port=0, writes=writes)) as server:
            bus = ModbusBus(ModbusBusSettings(path, port=server.port), served.names, served.inputs)
            return await used(bus, what)

    return served, asyncio.run(asyncio.wait_for(connected(), PATIENCE))


def over_opcua(
    folder: Path, what: Callable[[OpcUaBus], Awaitable[Any]], *, trusted: bool = True, sensed: bool = True
) -> Any:
    served = PlantServed(sensed=sensed)

    async def connected() -> Any:
        settings = OpcUaSettings(folder / "twin", port=0)
        async with OpcUaServer(served, CRANE.name, served.streamed, settings) as server:
            bus = OpcUaBus(OpcUaBusSettings(server.url, folder / "plc", server.trust.certificate))
            if trusted:
                (server.trust.trusted / "plc.der").write_bytes(bus.trust.certificate.read_bytes())
            return await used(bus, what)

    return served, asyncio.run(asyncio.wait_for(connected(), PATIENCE))


async def look_and_command(bus: Any) -> list[Image]:
    seen = [await bus.read() for _ in range(3)]
    await bus.write(COMMAND)
    return [*seen, await bus.read()]


@pytest.mark.long
@pytest.mark.parametrize(("over", "rounding"), [(over_modbus, FLOAT32), (over_opcua, 0.0)])
def test_a_plc_reads_what_the_winch_senses_in_this_cycle_and_moves_it(over: Any, rounding: float, tmp_path: Path):
    served, images = over(tmp_path, look_and_command)
    assert served.written[-1] == COMMAND
    assert all(image.good for image in images)
    numbers = [image.get("cycle_number") for image in images]
    assert numbers == sorted(set(numbers))
    expected = np.array([served.newest[name] for name in IMAGE])
    assert images[-1].values[FIRST_SENSED:] == pytest.approx(expected[FIRST_SENSED:], rel=rounding, abs=rounding)
    assert images[-1].get("u_p") == COMMAND["u_p"]


@pytest.mark.long
def test_a_plc_that_is_not_trusted_reads_and_moves_nothing(tmp_path: Path):
    with pytest.raises(
        LiveError, match=r"does not trust this PLC. Copy .*certificate.der into the twin's opcua/trusted"
    ):
        over_opcua(tmp_path, look_and_command, trusted=False)
    assert len(list((tmp_path / "twin" / "rejected").iterdir())) == 1


@pytest.mark.long
def test_a_twin_without_a_process_image_is_refused_with_what_to_write(tmp_path: Path):
    with pytest.raises(LiveError, match="sensed = true"):
        over_opcua(tmp_path, look_and_command, sensed=False)


def test_a_twin_that_takes_no_writes_over_modbus_says_so(tmp_path: Path):
    with pytest.raises(LiveError, match="--allow-writes"):
        over_modbus(tmp_path, look_and_command, writes=False)


@pytest.mark.long
def test_a_kernel_that_is_gone_gives_no_good_image(tmp_path: Path):
    async def look(bus: Any) -> Image:
        return await bus.read()

    original = PlantServed.latest
    try:
        PlantServed.latest = lambda self: (setattr(self, "alive", False), original(self))[1]
        for over in (over_modbus, over_opcua):
            _, image = over(tmp_path, look)
            assert not image.good
    finally:
        PlantServed.latest = original


def test_a_server_that_goes_away_is_a_lost_connection(tmp_path: Path):
    path = tmp_path / "registers.toml"
    path.write_text(REGISTERS)
    served = PlantServed()

    async def gone() -> None:
        server = ModbusServer(served, ModbusSettings(path, port=0, writes=True))
        async with server:
            bus = ModbusBus(ModbusBusSettings(path, port=server.port), served.names, served.inputs)
            await bus.connect()
            await bus.read()
        with pytest.raises(BusError, match="Modbus TCP"):
            await bus.read()
        with pytest.raises(BusError, match="no connection"):
            await bus.connect()
        await bus.close()

    asyncio.run(asyncio.wait_for(gone(), PATIENCE))


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ('name = "sensed_s_w"', 'name = "s_w"', "no row sensed_s_w, which the controller reads"),
        ('name = "cycle_number"', 'name = "lateness"', "no row cycle_number"),
        ('name = "brake"\naddress = 206', 'name = "v_op"\naddress = 206', "no row brake, which the PLC commands"),
        ('address = 202\ntype = "float32"', 'address = 202\ntype = "uint16"\nscale = 0.001', "does not hold 1"),
        ('address = 202\ntype = "float32"', 'address = 202\ntype = "int16"\nscale = 0.00001', "does not hold 1"),
        ("address = 202", "address = 201", "Move one"),
    ],
)
def test_a_map_that_a_plc_cannot_use_is_refused_before_anything_moves(old: str, new: str, line: str, tmp_path: Path):
    text = REGISTERS
    assert old in text
    with pytest.raises(StillhookError, match=line):
        over_modbus(tmp_path, look_and_command, text.replace(old, new))


def test_commands_in_small_registers_are_rounded_to_their_counts(tmp_path: Path):
    text = REGISTERS.replace('address = 202\ntype = "float32"', 'address = 202\ntype = "int16"\nscale = 0.0001')

    async def command(bus: ModbusBus) -> float:
        await bus.write({**COMMAND, "u_p": 0.123456})
        return bus.resolution("u_p")

    served, resolution = over_modbus(tmp_path, command, text)
    assert resolution == 0.0001
    assert {name: value for each in served.written for name, value in each.items()}["u_p"] == pytest.approx(0.1235)


def test_registers_that_follow_one_another_go_in_one_message(tmp_path: Path):
    async def messages(bus: ModbusBus) -> tuple[int, int, int]:
        rows = [row for block in bus._reads for row in block]
        return len(bus._reads), len(bus._writes), len(blocks(rows, 8))

    _, (reads, writes, short) = over_modbus(tmp_path, messages)
    assert (reads, writes) == (1, 1)
    assert short > 4


# Files


def test_the_example_maps_all_that_a_plc_reads_and_commands():
    rows = tomllib.loads(REGISTERS)["register"]
    of = {access: tuple(row["name"] for row in rows if row["access"] == access) for access in ("read", "write")}
    assert of == {"read": tuple(IMAGE), "write": (OVERRIDE, *COMMANDS)}


def test_the_example_is_a_twin_a_plc_on_each_bus_and_a_script(tmp_path: Path):
    example_files(HIL, tmp_path / "hil")
    live = read_live_file(tmp_path / "hil" / "live.toml")
    assert live.sensed
    assert {live.opcua.host, live.modbus.host} == {"127.0.0.1"}
    plan = read_plc_file(tmp_path / "hil" / MODBUS_FILE)
    assert plan.mode == "ssc"
    assert plan.crane.control.t_cycle == 0.02
    assert plan.plant.control.t_cycle == 0.01
    assert plan.crane.control.t_lead_ff is None
    (tmp_path / "hil" / "late.toml").write_text(PLC.replace('"0 ms"', '"15 ms"'))
    late = read_plc_file(tmp_path / "hil" / "late.toml").crane.control
    assert late.t_lead_ff - late.t_lead == pytest.approx(0.015)
    assert plan.controller().t_cycle == 0.02
    assert plan.bus().label == "Modbus TCP 127.0.0.1:5020"
    with pytest.raises(LiveError, match="Start the twin once"):
        read_plc_file(tmp_path / "hil" / PLC_FILE).bus()
    TrustFolder(tmp_path / "hil" / "twin" / "opcua")
    assert "signed and encrypted" in read_plc_file(tmp_path / "hil" / PLC_FILE).bus().label
    with pytest.raises(LiveError, match="already"):
        example_files(HIL, tmp_path / "hil")


def test_a_plc_file_is_read_without_the_search_for_the_gain_of_strong_ssc(tmp_path: Path, monkeypatch):
    folder = tmp_path / "hil"
    example_files(HIL, folder)
    searches = []

    def searched(crane: Crane, mode: Mode, delay: float = 0.0) -> tuple[float, str]:
        searches.append(delay)
        return 0.3, "made up"

    monkeypatch.setattr("stillhook.analysis.controllers.strong_gain", searched)
    (folder / "late.toml").write_text(PLC.replace('"0 ms"', '"15 ms"'))
    plan = read_plc_file(folder / "late.toml")
    assert (plan.mode, searches) == ("ssc", [])
    assert plan.crane.control.K_p == plan.plant.control.K_p == 0.3
    assert searches == [0.015, 0.0]  # of the PLC and of the twin, each once
    (folder / "case.toml").write_text(ELECTRIC)
    with pytest.raises(LiveError, match=r'late\.toml: controller = "strong-ssc": "ssc" is for another kind of drive'):
        read_plc_file(folder / "late.toml")


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ('"strong-ssc"', '"scc"', "choose one of manual"),
        ('"20 ms"', '"20 m"', "cycle"),
        ('"20 ms"', '"0 ms"', "cycle"),
        ('"0 ms"', '"2 s"', "command_delay"),
        ('"case.toml"', '"none.toml"', "no such file"),
        ('# script = "script.toml"', 'script = "none.toml"', "no such file"),
        ('"library"', '"basic"', "choose library or structured-text"),
        ('"library"', '"none.st"', "no such file"),
        (MODBUS, "", "give one bus"),
        (MODBUS, MODBUS + OPCUA, "give one bus"),
        ('"registers.toml"', '"none.toml"', "no such file"),
        ('"registers.toml"', '"case.toml"', "is a case file, not a register map"),
        (PLC, "speed = 1\n" + PLC, "speed"),
        (PLC, "", "case: missing"),
    ],
)
def test_what_a_plc_file_says_wrong_is_refused_in_one_line(
    old: str, new: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    example_files(HIL, tmp_path / "hil")
    path = tmp_path / "hil" / MODBUS_FILE
    text = path.read_text().replace(MODBUS_FILE, PLC_FILE)
    assert old in text
    path.write_text(text.replace(old, new))
    assert run(["plc", "run", str(path), "--duration", "1 s"]) == 2
    error = capsys.readouterr().err
    assert line in error
    assert sum(each.startswith("error") for each in error.splitlines()) == (
        2 if line == "case: missing" else 1
    )  # a line a problem
    assert not (tmp_path / "hil" / "plc-log.csv").exists()


def test_a_plc_without_a_twin_ends_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    example_files(HIL, tmp_path / "hil")
    path = tmp_path / "hil" / MODBUS_FILE
    path.write_text(path.read_text() + "port = 1\n")
    assert run(["plc", "run", str(path), "--duration", "1 s"]) == 2
    assert "no connection. Start the twin: stillhook live run." in capsys.readouterr().err


# The whole of it


@pytest.mark.long
def test_a_twin_and_a_plc_in_processes_of_their_own_and_the_plc_is_killed(tmp_path: Path):
    example_files(HIL, tmp_path / "hil")
    folder = tmp_path / "hil"
    live, plc = folder / "live.toml", folder / MODBUS_FILE
    live.write_text(live.read_text().replace("[opcua]\n", "") + "port = 0\n")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "stillhook"]
    twin = [*command, "live", "run", str(live), "--allow-writes"]
    with subprocess.Popen(twin, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment) as of:
        try:
            port = of.stdout.readline().split(":")[1].split(",")[0]
            plc.write_text(plc.read_text() + f"port = {port}\n")
            ran = subprocess.run(
                [*command, "plc", "run", str(plc), "--duration", "3 s", "--json"],
                capture_output=True, text=True, env=environment, timeout=PATIENCE, check=False,
            )  # fmt: skip
            assert ran.returncode == 0, ran.stderr
            outcome = json.loads(ran.stdout)
            assert outcome["cycles"] > 10
            assert "too short" in outcome["bus_cost"]["reason"]
            log, events = folder / "plc-log.csv", folder / "twin" / "events.jsonl"
            assert run(["plc", "compare", str(log), str(plc)]) == 0
            log.unlink()
            with subprocess.Popen(
                [*command, "plc", "run", str(plc)], stderr=subprocess.DEVNULL, env=environment
            ) as killed:
                wait_for(lambda: log.exists() and log.read_text().count("\n") > 60)
                killed.kill()
            wait_for(lambda: any('"stale"' in line and "u_p" in line for line in events.read_text().splitlines()[-5:]))
            assert of.poll() is None
        finally:
            of.terminate()
            of.wait(PATIENCE)
    assert of.returncode == 143  # ended by SIGTERM


def wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.1)
