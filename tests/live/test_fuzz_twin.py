"""A whole twin under malformed packets to all of its servers at once, as `stillhook live run` starts it.

STILLHOOK_FUZZ_SECONDS: how long; STILLHOOK_FUZZ_SEED: which packets.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import random
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.live.fuzzing import LOOPBACK, attack_tcp, datagrams, modbus_connections, mutated, opcua_connections, requests
from tests.live.test_live_run import example, modbus_count

from stillhook.engine.session import Session
from stillhook.live.live_file import read_live_file
from stillhook.live.servers.modbus import WRITES
from stillhook.live.servers.opcua import client
from stillhook.live.servers.trust import TrustFolder

pytest.importorskip("asyncua", reason="the extra live is not installed")
pytest.importorskip("pymodbus", reason="the extra live is not installed")
pytestmark = pytest.mark.thorough

SECONDS = float(os.environ.get("STILLHOOK_FUZZ_SECONDS", "20"))
SEED = int(os.environ.get("STILLHOOK_FUZZ_SEED", "39"))
GROWTH = 60 * 2**20
"""Memory that the servers' process may take meanwhile [bytes]: the library keeps what it has read of types."""
BOUNDED_LOG = 65.0
"""Events in a second at most, of all servers together: 20 of OPC UA of three kinds, and one each of the others."""


def memory(pid: int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.fixture
def quiet() -> Iterator[None]:
    """The library's warnings of the client that misbehaves stay away, here alone."""
    logger = logging.getLogger("asyncua")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    yield
    logger.setLevel(before)


class Twin:
    """`stillhook live run` on free ports, and its rows as they come over UDP."""

    def __init__(self, folder: Path, *, writes: bool) -> None:
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiver.bind((LOOPBACK, 0))
        self.receiver.settimeout(20.0)
        change = {"port = 4840": "port = 0", "port = 5020": "port = 0"}
        change["to_port = 5031"] = f"port = 0\nto_port = {self.receiver.getsockname()[1]}"
        self.path = example(folder / "twin", change)
        options = ["--allow-writes"] if writes else []
        command = [sys.executable, "-m", "stillhook", "live", "run", str(self.path), *options]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        self.told = folder / "stderr.txt"  # a pipe that nobody reads would hold the twin up
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self.told.open("w"), text=True, env=environment
        )
        lines = [self.process.stdout.readline() for _ in range(3)]
        self.opcua, self.modbus, self.udp = (int(re.search(r"127\.0\.0\.1:(\d+)", line)[1]) for line in lines)
        self.row()
        case = read_live_file(self.path).case
        session = Session(case.crane, case.case)
        moving = ("s_tip", "v_tip", "a_tip", "u_p", "u_m", "brake", "override")
        self.held = [name for name in (*session.inputs, *session.parameters) if name not in moving]

    def row(self) -> dict[str, float]:
        """The newest row."""
        self.receiver.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                self.receiver.recv(65_536)
        self.receiver.settimeout(20.0)
        return json.loads(self.receiver.recv(65_536))

    def events(self) -> list[dict[str, object]]:
        return [json.loads(line) for line in (self.path.parent / "twin" / "events.jsonl").read_text().splitlines()]


def nodes(twin: Twin, own: TrustFolder, until: float, r: random.Random, done: Counter[str]) -> None:
    """Malformed services of a trusted client, none of which writes."""
    whole = requests()
    names = sorted(set(whole) - {"WriteRequest", "CloseSessionRequest", "CloseSecureChannelRequest"})
    certificate = twin.path.parent / "twin" / "opcua" / "own" / "certificate.der"

    async def some() -> None:
        async with await client(f"opc.tcp://{LOOPBACK}:{twin.opcua}/stillhook", own, certificate) as of:
            protocol = of.uaclient.protocol
            for i in range(50):
                data = mutated(r, whole[r.choice(names)])
                protocol.transport.write(protocol._connection.message_to_binary(data, request_id=10_000 + i))
                done["node"] += 1
            await asyncio.sleep(0.02)

    while time.monotonic() < until:
        try:
            asyncio.run(asyncio.wait_for(some(), 30.0))
            done["trusted-session"] += 1
        except Exception as problem:  # the server may close the channel
            done[f"trusted {type(problem).__name__}"] += 1


@pytest.mark.parametrize("writes", [False, True], ids=["refused", "allowed"])
def test_a_twin_lives_through_malformed_packets_and_takes_nothing_from_them(quiet: None, tmp_path: Path, writes: bool):
    twin = Twin(tmp_path, writes=writes)
    own = TrustFolder(tmp_path / "plc", "plc")
    folder = twin.path.parent / "twin" / "opcua" / "trusted"
    (folder / "plc.der").write_bytes(own.certificate.read_bytes())
    functions = tuple(f for f in range(256) if f not in WRITES) if writes else tuple(range(256))
    done: Counter[str] = Counter()

    def stranger(until: float) -> None:
        r = random.Random(SEED)
        connections = opcua_connections(r)
        while time.monotonic() < until:
            done.update({f"opcua {k}": n for k, n in attack_tcp(twin.opcua, connections, 20, r).items()})

    def registers(until: float) -> None:
        r = random.Random(SEED + 1)
        connections = modbus_connections(r, functions)
        while time.monotonic() < until:
            done.update({f"modbus {k}": n for k, n in attack_tcp(twin.modbus, connections, 20, r).items()})

    def packets(until: float) -> None:
        several = datagrams(random.Random(SEED + 2))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as of:
            while time.monotonic() < until:
                word, data = next(several)
                of.sendto(data, (LOOPBACK, twin.udp))
                done[f"udp {word}"] += 1
                time.sleep(1e-3)

    try:
        quiet = twin.row()
        before, count, kept = {n: quiet[n] for n in twin.held}, modbus_count(twin.modbus), memory(twin.process.pid)
        until = time.monotonic() + SECONDS
        works = [
            threading.Thread(target=stranger, args=(until,)),
            threading.Thread(target=registers, args=(until,)),
            threading.Thread(target=packets, args=(until,)),
            threading.Thread(target=nodes, args=(twin, own, until, random.Random(SEED + 3), done)),
        ]
        for each in works:
            each.start()
        for each in works:
            each.join()
        assert twin.process.poll() is None
        assert modbus_count(twin.modbus) > count
        after = twin.row()
        assert {n: after[n] for n in twin.held} == before
        assert (after["input_age"], after["refused_inputs"], after["missed_cycles"]) == (0.0, 0.0, 0.0)
        grown = memory(twin.process.pid) - kept
        report = {n: (quiet[n], after[n]) for n in ("cycle_number", "late_cycles", "overrun_cycles", "worst_lateness")}
        events = twin.events()
        print(
            f"\n{SECONDS:g} s: {sum(done.values())} attempts, {grown / 2**20:.1f} MiB, {len(events)} events, {report}"
        )
        print(dict(sorted(done.items())))
        print(Counter(f"{e['source']} {e['name']}" for e in events))
        assert grown < GROWTH
        assert len(events) < BOUNDED_LOG * (SECONDS + 10.0)
        assert {"malformed", "refused-session", "refused-write"} <= {str(e["name"]) for e in events}
        asyncio.run(read(twin, own))
    finally:
        twin.process.send_signal(signal.SIGTERM)
        out, _ = twin.process.communicate(timeout=60.0)
        twin.receiver.close()
    err = twin.told.read_text()
    assert twin.process.returncode == 0, err[-2000:]
    assert "Traceback" not in out + err
    print(out)


async def read(twin: Twin, own: TrustFolder) -> None:
    certificate = twin.path.parent / "twin" / "opcua" / "own" / "certificate.der"
    async with await client(f"opc.tcp://{LOOPBACK}:{twin.opcua}/stillhook", own, certificate) as of:
        space = await of.get_namespace_index("urn:stillhook:live")
        assert await of.get_node(f"ns={space};s=cycle_number").read_value() > 0.0
