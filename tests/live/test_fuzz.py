"""Malformed packets and nodes: no server ends, nothing is written, memory stays bounded, every attempt is in the log."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import random
import socket
import struct
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.live.fuzzing import (
    LOOPBACK,
    attack_tcp,
    bombs,
    datagrams,
    message,
    modbus_connections,
    mutated,
    opcua_connections,
    requests,
)
from tests.live.served import Counting
from tests.live.test_modbus import MAP, S_TIP, read_request, write_request

from stillhook.live.servers import bounds, modbus
from stillhook.live.servers.counted import LONGEST, Counted
from stillhook.live.servers.modbus import ModbusServer, ModbusSettings
from stillhook.live.servers.opcua import OpcUaServer, OpcUaSettings, client
from stillhook.live.servers.trust import TrustFolder
from stillhook.live.servers.udp import UdpServer, UdpSettings

pytest.importorskip("asyncua", reason="the extra live is not installed")
pytest.importorskip("pymodbus", reason="the extra live is not installed")
pytestmark = pytest.mark.slow

SEED = 39
SHORT = {"opcua": 60, "modbus": 60, "udp": 200, "nodes": 40}
LONG = {"opcua": 3000, "modbus": 3000, "udp": 20_000, "nodes": 3000}
UNREAD = 300_000
"""Requests whose answers nobody reads: more than the buffers of a machine hold."""
GROWTH = 100 * 2**20
"""Memory that a campaign may take [bytes]: the smallest bomb without bounds takes 16 GB."""


def resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class Servers:
    """All servers of one twin in a thread of their own; of Modbus and UDP one that takes writes and one that does not."""

    def __init__(self, folder: Path) -> None:
        self.served = Counting()
        (folder / "map.toml").write_text(MAP)
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiver.bind((LOOPBACK, 0))
        self.receiver.settimeout(5.0)
        self.folder = folder
        self.stack = contextlib.AsyncExitStack()
        self.over = False
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.started = threading.Event()
        self.thread.start()
        assert self.started.wait(120.0)
        self.trusted = TrustFolder(folder / "plc", "plc")
        (self.opcua.trust.trusted / "plc.der").write_bytes(self.trusted.certificate.read_bytes())

    def _run(self) -> None:
        with asyncio.Runner() as runner:
            self.loop = runner.get_loop()
            runner.run(self._serve())

    async def _serve(self) -> None:
        async with self.stack:
            enter, to = self.stack.enter_async_context, self.receiver.getsockname()[1]
            own = OpcUaSettings(self.folder / "own", port=0)
            self.opcua = await enter(OpcUaServer(self.served, "nov-250t", self.served.streamed, own))
            self.closed, self.open = [
                await enter(ModbusServer(self.served, ModbusSettings(self.folder / "map.toml", port=0, writes=writes)))
                for writes in (False, True)
            ]
            self.udp_closed, self.udp_open = [
                await enter(UdpServer(self.served, UdpSettings(port=0, to_port=to, writes=writes)))
                for writes in (False, True)
            ]
            self.started.set()
            await self.opcua.serve(lambda: self.over)

    @property
    def opcua_port(self) -> int:
        return self.opcua._server.bserver.port

    def stop(self) -> None:
        self.over = True
        self.thread.join(30.0)
        assert not self.thread.is_alive()
        self.receiver.close()

    def counted(self, name: str, source: str) -> int:
        return round(sum(e.value for e in self.served.events if e.name == name and e.source == source))

    def run(self, what: Any) -> Any:
        """Run with the connected client of the trusted PLC, in a loop of its own."""

        async def connected() -> Any:
            async with await client(self.opcua.url, self.trusted, self.opcua.trust.certificate) as of:
                return await what(of)

        return asyncio.run(asyncio.wait_for(connected(), 60.0))

    def answers(self) -> bool:
        """Whether honest clients of every server are served."""

        async def read(of: Any) -> float:
            space = await of.get_namespace_index("urn:stillhook:live")
            return await of.get_node(f"ns={space};s=s_w").read_value()

        assert self.run(read) > 0.0
        for of in (self.closed, self.open):
            assert len(ask(of.port, read_request(3, 1, 2))) == 6
        for of in (self.udp_closed, self.udp_open):
            self.loop.call_soon_threadsafe(of.send)
            assert json.loads(self.receiver.recv(65_536))["s_w"] > 0.0
        return True


def ask(port: int, *frames: bytes, pipelined: bool = False) -> bytes:
    """Answer to the last of some Modbus requests, without its head."""
    whole = [struct.pack(">HHHB", i, 0, len(frame) + 1, 1) + frame for i, frame in enumerate(frames)]
    with socket.create_connection((LOOPBACK, port), timeout=5.0) as of:
        for data in [b"".join(whole)] if pipelined else whole:
            of.sendall(data)
            if not pipelined:
                answer = receive(of)
        if pipelined:
            answer = [receive(of) for _ in whole][-1]
    return answer


def receive(of: socket.socket) -> bytes:
    size = struct.unpack(">HHHB", of.recv(7, socket.MSG_WAITALL))[2] - 1
    return of.recv(size, socket.MSG_WAITALL)


@pytest.fixture(scope="module")
def servers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Servers]:
    made = Servers(tmp_path_factory.mktemp("fuzz"))
    yield made
    made.stop()


@pytest.fixture(autouse=True)
def no_log_is_kept() -> Iterator[None]:
    """The test runner keeps every record with its traceback, which is more than the servers take."""
    before = [(handler, handler.level) for handler in logging.getLogger().handlers]
    for handler, _ in before:
        handler.setLevel(logging.CRITICAL + 1)
    yield
    for handler, level in before:
        handler.setLevel(level)


CAMPAIGNS = [pytest.param(SHORT, id="short"), pytest.param(LONG, id="long", marks=pytest.mark.thorough)]


@pytest.mark.long
@pytest.mark.parametrize("counts", CAMPAIGNS)
def test_opc_ua_garbage_of_strangers_ends_nothing_and_writes_nothing(servers: Servers, counts: dict[str, int]):
    r, before, memory = random.Random(SEED), len(servers.served.written), resident()
    done = attack_tcp(servers.opcua_port, opcua_connections(r), counts["opcua"], r)
    assert done["null-list"] > 0
    assert servers.answers()
    assert servers.served.written[before:] == []
    assert servers.served.told("malformed")
    assert resident() - memory < GROWTH
    assert all(c.isprintable() for e in servers.served.events for c in e.text)


@pytest.mark.long
@pytest.mark.parametrize("name", list(bombs()))
def test_a_small_message_that_would_keep_a_reader_busy_is_refused(servers: Servers, name: str):
    r, memory = random.Random(SEED), resident()
    attack_tcp(servers.opcua_port, iter([(name, [message(r, bombs()[name])])]), 1, r)
    with socket.create_connection((LOOPBACK, servers.opcua_port), timeout=5.0) as of:
        of.sendall(message(r, requests()["GetEndpointsRequest"]))
        assert of.recv(4) == b"MSGF"
    assert resident() - memory < GROWTH


@pytest.mark.parametrize("counts", CAMPAIGNS)
def test_malformed_nodes_of_a_trusted_client_change_nothing_but_inputs(servers: Servers, counts: dict[str, int]):
    r, memory, whole = random.Random(SEED), resident(), requests()
    space = servers.opcua._server.iserver.aspace._nodes
    nodes, before = set(space), len(servers.served.written)
    names = sorted(set(whole) - {"CloseSessionRequest", "CloseSecureChannelRequest", "CreateSessionRequest"})

    async def some(of: Any) -> None:
        protocol = of.uaclient.protocol
        for i in range(20):
            body = whole[r.choice(names)]
            data = body if r.random() < 0.1 else mutated(r, body)
            protocol.transport.write(protocol._connection.message_to_binary(data, request_id=10_000 + i))
        await asyncio.sleep(0.01)

    for _ in range(counts["nodes"] // 20):
        with contextlib.suppress(Exception):  # the server may close the channel
            servers.run(some)
    assert servers.answers()
    assert set(space) == nodes
    assert all(w.keys() <= set(servers.served.inputs) for w in servers.served.written[before:])
    assert resident() - memory < GROWTH


@pytest.mark.parametrize("counts", CAMPAIGNS)
def test_modbus_garbage_ends_nothing_and_writes_nothing(servers: Servers, counts: dict[str, int]):
    """With writes allowed every function but those that write is tried; without, all of them."""
    r, before, memory = random.Random(SEED), len(servers.served.written), resident()
    attack_tcp(servers.closed.port, modbus_connections(r), counts["modbus"], r)
    reading = tuple(f for f in range(256) if f not in modbus.WRITES)
    true_heads = ("functions", "protocol", "counts")  # in the others random bytes may be a write by chance
    some = ((word, sent) for word, sent in modbus_connections(r, reading) if word in true_heads)
    attack_tcp(servers.open.port, some, counts["modbus"], r)
    assert servers.answers()
    assert servers.served.written[before:] == []
    assert resident() - memory < GROWTH


@pytest.mark.parametrize("counts", CAMPAIGNS)
def test_datagrams_that_are_no_inputs_end_nothing_and_write_nothing(servers: Servers, counts: dict[str, int]):
    r, before, memory = random.Random(SEED), len(servers.served.written), resident()
    packets = datagrams(r)
    for _ in range(counts["udp"]):
        _, data = next(packets)
        for of in (servers.udp_closed, servers.udp_open):
            servers.receiver.sendto(data, (LOOPBACK, of.port))
    assert servers.answers()
    # an unknown name is refused by the twin itself, which stands for itself here
    assert [w for w in servers.served.written[before:] if w.keys() <= set(servers.served.inputs)] == []
    assert resident() - memory < GROWTH


@pytest.mark.long
def test_every_refused_write_is_counted_in_the_log(servers: Servers):
    before = servers.counted("refused-write", "modbus")
    frames = [write_request(10, S_TIP), struct.pack(">BHH", 6, 12, 1), struct.pack(">BHH", 6, 0, 1)] * 5
    beside = {
        "coil": struct.pack(">BHH", 5, 10, 0xFF00),
        "coils": struct.pack(">BHHBB", 15, 10, 1, 1, 1),
        "mask": struct.pack(">BHHH", 22, 12, 0, 1),
        "both": struct.pack(">BHHHHBH", 23, 0, 1, 12, 1, 2, 5),
        "no such register": write_request(500, [1]),
        "behind the last": write_request(65_535, [1]),
    }
    frames += beside.values()
    assert ask(servers.closed.port, *frames)[0] & 0x80
    assert ask(servers.closed.port, *frames, pipelined=True)[0] & 0x80
    wait_for(lambda: servers.counted("refused-write", "modbus") >= before + 2 * len(frames))
    before = servers.counted("refused-write", "udp")
    for _ in range(7):
        servers.receiver.sendto(b'{"s_tip": 1}', (LOOPBACK, servers.udp_closed.port))
    wait_for(lambda: servers.counted("refused-write", "udp") >= before + 7)
    r, before = random.Random(SEED), servers.counted("refused-write", "opcua")
    for _ in range(30):
        with socket.create_connection((LOOPBACK, servers.opcua_port), timeout=5.0) as of:
            of.sendall(message(r, requests()["WriteRequest"]))
            assert of.recv(4) == b"MSGF"
    wait_for(lambda: servers.counted("refused-write", "opcua") >= before + 30)


def test_a_write_to_many_nodes_is_one_event(servers: Servers):
    from asyncua import ua

    async def write(of: Any) -> None:
        values = [ua.WriteValue(ua.NodeId(f"\x1b[2J{i}", 2), ua.AttributeIds.Value) for i in range(500)]
        await of.uaclient.write(ua.WriteParameters(values))

    told = len(servers.served.told("refused-write"))
    servers.run(write)
    texts = servers.served.told("refused-write")[told:]  # also what an earlier test left to tell
    assert sum("and 499 more" in text for text in texts) == 1
    assert all(text.isprintable() for text in texts)


def test_pipelined_requests_are_all_answered_in_their_order(servers: Servers):
    before = len(servers.served.written)
    writes = [struct.pack(">BHH", 6, 12, value) for value in range(1, 60)]
    answer = ask(servers.open.port, *writes, read_request(3, 12, 1), pipelined=True)
    assert answer == struct.pack(">BBH", 3, 2, 59)
    assert [round(1000 * w["v_tip"]) for w in servers.served.written[before:]] == list(range(1, 60))


def test_idle_connections_do_not_keep_a_plc_from_its_session(servers: Servers):
    idle = [socket.create_connection((LOOPBACK, servers.opcua_port)) for _ in range(bounds.PENDING + 10)]
    try:
        assert servers.answers()
        wait_for(lambda: len(servers.opcua._server.bserver.clients) <= bounds.PENDING)
    finally:
        for each in idle:
            each.close()


def test_modbus_closes_silent_connections_beyond_its_limit_and_keeps_a_plc_that_it_knows(servers: Servers):
    frame = read_request(3, 1, 2)
    frame = struct.pack(">HHHB", 1, 0, len(frame) + 1, 1) + frame
    with socket.create_connection((LOOPBACK, servers.closed.port), timeout=5.0) as plc:
        plc.sendall(frame)
        assert len(receive(plc)) == 6
        more = [socket.create_connection((LOOPBACK, servers.closed.port)) for _ in range(modbus.CLIENTS + 20)]
        try:
            more[0].settimeout(5.0)
            assert more[0].recv(1) == b""  # closed
            assert len(ask(servers.closed.port, read_request(3, 1, 2))) == 6
            plc.sendall(frame)
            assert len(receive(plc)) == 6
            assert len(servers.closed._server.active_connections) <= modbus.CLIENTS + 1
        finally:
            for each in more:
                each.close()
    wait_for(lambda: not servers.closed._server.active_connections)
    assert servers.answers()


def test_a_client_that_reads_no_answers_is_not_served_on(servers: Servers):
    memory, request = resident(), message(random.Random(SEED), requests()["GetEndpointsRequest"])
    with socket.create_connection((LOOPBACK, servers.opcua_port)) as of:
        of.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        of.settimeout(0.3)
        sent = 0
        with contextlib.suppress(OSError):
            while sent < UNREAD:
                of.sendall(request[:16] + struct.pack("<I", sent + 1) + request[20:])
                sent += 1
    assert sent < UNREAD
    assert resident() - memory < GROWTH


def test_a_chunk_that_never_ends_is_dropped(servers: Servers):
    with socket.create_connection((LOOPBACK, servers.opcua_port), timeout=5.0) as of:
        of.sendall(b"MSGF" + struct.pack("<I", 2**32 - 1))
        with pytest.raises(OSError):
            of.sendall(bytes(10**9))


def test_sessions_that_were_never_opened_do_not_pile_up(servers: Servers):
    r, whole = random.Random(SEED), requests()["CreateSessionRequest"]
    frames = [message(r, whole, number=1 + i) for i in range(100)]
    sessions = servers.opcua._server.iserver._external_sessions
    before = len(sessions)  # of trusted clients that went, with a subscription: they have a minute to come again
    with socket.create_connection((LOOPBACK, servers.opcua_port), timeout=5.0) as of:
        of.sendall(b"".join(frames))
        assert of.recv(4) == b"MSGF"
        assert len(sessions) < before + 10


def test_nobody_registers_another_server_as_the_twin(servers: Servers):
    from asyncua import Client, ua

    async def register() -> list[str]:
        async def attempt(of: Any) -> None:
            spoofed = ua.RegisteredServer(ServerUri=servers.opcua.trust.uri, DiscoveryUrls=["opc.tcp://198.51.100.7"])
            spoofed.ServerNames = [ua.LocalizedText("x")]
            with pytest.raises(ua.UaStatusCodeError):
                await of.uaclient.register_server(spoofed)

        of = Client(servers.opcua.url)
        await of.connect_socket()
        await of.send_hello()
        await of.open_secure_channel()
        await attempt(of)
        found = await of.uaclient.find_servers(ua.FindServersParameters())
        of.disconnect_socket()
        return [url for each in found for url in each.DiscoveryUrls]

    assert "198.51.100.7" not in " ".join(asyncio.run(register()))


def test_a_stranger_is_logged_where_its_certificate_cannot_be_kept(tmp_path: Path):
    folder = TrustFolder(tmp_path / "trust")
    folder.rejected.rmdir()
    folder.rejected.write_text("no folder")
    assert "could not be kept" in folder.reject(b"certificate")
    folder.trusted.rmdir()
    assert not folder.trusts((tmp_path / "trust" / "own" / "certificate.der").read_bytes())


@pytest.mark.long
def test_a_flood_is_told_by_its_number_and_nothing_of_it_is_lost(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("stillhook.live.servers.counted.time", SimpleNamespace(monotonic=lambda: 100.0))
    told: list[int] = []
    texts: set[str] = set()
    counted = Counted(lambda count, text: texts.add(text) or told.append(count), burst=3)
    for _ in range(1000):
        counted.add("\x1b[2J\n\ud800" * 1000)
    assert told == [1, 1, 1]
    counted.flush()
    assert told == [1, 1, 1, 997]
    counted.flush()
    assert sum(told) == 1000
    assert all(text.isprintable() and len(text) <= LONGEST for text in texts)


def wait_for(what: Any) -> None:
    end = 500
    while not what():
        end -= 1
        assert end
        threading.Event().wait(0.02)
