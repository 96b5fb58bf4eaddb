"""OPC UA: with trust everything, without it nothing, and every attempt is in the log."""

from __future__ import annotations

import asyncio
import random
import socket
import stat
from collections.abc import Awaitable, Callable, Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from tests.live.served import Counting

from stillhook.errors import LiveError
from stillhook.live.servers import trust
from stillhook.live.servers.model import NAMESPACE, engineering_units
from stillhook.live.servers.opcua import OpcUaServer, OpcUaSettings, client
from stillhook.live.servers.trust import DAYS, MOST_REJECTED, TrustFolder

pytest.importorskip("asyncua", reason="the extra live is not installed")
pytestmark = pytest.mark.slow

SEED, GARBAGE = 39, 60
PERIODS = 8
"""Periods of publishing over which notifications are counted."""


class Room:
    """One server and two clients, one trusted and one not, in one loop."""

    def __init__(self, folder: Path) -> None:
        self.loop = asyncio.new_event_loop()
        self.served = Counting()
        self.server = OpcUaServer(self.served, "nov-250t", self.served.streamed, OpcUaSettings(folder / "own", port=0))
        self.loop.run_until_complete(self.server.__aenter__())
        self.trusted, self.stranger = TrustFolder(folder / "plc", "plc"), TrustFolder(folder / "stranger", "stranger")
        (self.server.trust.trusted / "plc.der").write_bytes(self.trusted.certificate.read_bytes())

    def run(self, what: Callable[..., Awaitable[Any]], own: TrustFolder | None = None) -> Any:
        """Run with a connected client."""

        async def connected() -> Any:
            async with await client(self.server.url, own or self.trusted, self.server.trust.certificate) as of:
                space = await of.get_namespace_index(NAMESPACE)
                return await what(of, lambda name: of.get_node(f"ns={space};s={name}"))

        return self.loop.run_until_complete(asyncio.wait_for(connected(), 30.0))

    def close(self) -> None:
        self.loop.run_until_complete(self.server.__aexit__(None, None, None))
        self.loop.close()


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Room]:
    made = Room(tmp_path_factory.mktemp("opcua"))
    yield made
    made.close()


@pytest.mark.long
def test_a_trusted_client_reads_a_hundred_values_of_one_cycle(room: Room):
    async def read(of: Any, node: Any) -> list[float]:
        await room.server.publish()
        return await of.read_values([node(name) for name in room.served.names])

    values = room.run(read)
    assert len(values) == 100
    assert set(values[1:]) == {float(room.served.count)}


def test_every_notification_arrives_in_its_order(room: Room):
    async def subscribe(of: Any, node: Any) -> dict[str, list[float]]:
        got: dict[str, list[float]] = {}

        class Handler:
            def datachange_notification(self, node: Any, value: float, data: Any) -> None:
                got.setdefault(node.nodeid.Identifier, []).append(value)

        subscription = await of.create_subscription(50, Handler())
        names = room.served.names[1:]
        await subscription.subscribe_data_change([node(name) for name in names], queuesize=2 * PERIODS)
        for _ in range(PERIODS):
            await room.server.publish()
            await asyncio.sleep(0.05)
        last = float(room.served.count)
        while any(values[-1] < last for values in got.values()) or len(got) < len(names):
            await asyncio.sleep(0.02)
        return got

    got = room.run(subscribe)
    assert len(got) == 99
    for values in got.values():
        assert values[-PERIODS:] == [float(room.served.count - PERIODS + 1 + i) for i in range(PERIODS)]


def test_a_trusted_client_writes_inputs_together_with_their_stamp(room: Room):
    async def write(of: Any, node: Any) -> None:
        await of.write_values([node("Inputs.s_tip"), node("Inputs.v_tip"), node("Inputs.a_tip")], [0.5, 0.1, -0.2])

    before = len(room.served.written)
    room.run(write)
    assert room.served.written[before:] == [{"s_tip": 0.5, "v_tip": 0.1, "a_tip": -0.2}]
    assert room.served.stamps[-1] > 1.7e9


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("s_tip", 0.5, "s_tip is not an input"),
        ("cycle_number", 1.0, "cycle_number is not an input"),
        ("Inputs.s_tip", float("nan"), "s_tip is one finite number"),
        ("Inputs.s_tip", float("inf"), "s_tip is one finite number"),
        ("Inputs.s_tip", "1.0", "s_tip is one finite number"),
        ("Inputs.s_tip", True, "s_tip is one finite number"),
        ("Inputs.s_tip", [1.0, 2.0], "s_tip is one finite number"),
    ],
)
def test_what_is_no_number_for_an_input_is_refused_and_logged(room: Room, name: str, value: Any, reason: str):
    from asyncua import ua

    async def write(of: Any, node: Any) -> None:
        await node(name).write_value(ua.Variant(value))

    before, told = len(room.served.written), len(room.served.told("refused-write"))
    with pytest.raises(ua.UaStatusCodeError):
        room.run(write)
    assert len(room.served.written) == before
    assert reason in room.served.told("refused-write")[told]


def test_a_stranger_gets_no_session_and_the_attempt_is_in_the_log(room: Room):
    from asyncua import ua

    async def read(of: Any, node: Any) -> float:
        return await node("s_w").read_value()

    told = len(room.served.told("refused-session"))
    with pytest.raises(ua.uaerrors.BadUserAccessDenied):
        room.run(read, room.stranger)
    text = room.served.told("refused-session")[told]
    assert "Session refused to 127.0.0.1:" in text
    kept = list(room.server.trust.rejected.glob("*.der"))
    assert [path.read_bytes() for path in kept] == [room.stranger.certificate.read_bytes()]
    assert str(kept[0]) in text


def test_a_stranger_cannot_write_through_a_trusted_session(room: Room):
    """The library hands a live session to any channel that names its number, before it looks at trust: without our own
    `lookup_external_session` this write reached the twin."""
    from asyncua import ua

    async def attack(of: Any, node: Any) -> list[str]:
        item = ua.WriteValue(node("Inputs.s_tip").nodeid, ua.AttributeIds.Value, Value=ua.DataValue(ua.Variant(9.9)))
        write, activate = ua.WriteRequest(), ua.ActivateSessionRequest()
        write.Parameters.NodesToWrite = [item]
        activate.Parameters.ClientSignature.Signature = b"x"
        thief = await client(room.server.url, room.stranger, room.server.trust.certificate)
        await thief.connect_socket()
        await thief.send_hello()
        await thief.open_secure_channel()
        thief.uaclient.protocol.authentication_token = next(iter(room.server._server.iserver._external_sessions))
        answers = []
        for request in (activate, write):
            try:
                await thief.uaclient.protocol.send_request(request)
                answers.append("answered")
            except ua.UaError as problem:
                answers.append(type(problem).__name__)
        thief.disconnect_socket()
        return answers

    before, told = len(room.served.written), len(room.served.told("refused-session"))
    assert "answered" not in room.run(attack)
    assert len(room.served.written) == before
    assert "another channel's session" in " ".join(room.served.told("refused-session")[told:])


def test_without_security_there_is_no_session(room: Room):
    from asyncua import Client, ua

    async def plain() -> None:
        async with Client(room.server.url, timeout=5.0):
            pass

    before = len(room.served.written)
    with pytest.raises((ua.UaError, ConnectionError, asyncio.TimeoutError)):
        room.loop.run_until_complete(plain())
    assert len(room.served.written) == before


def test_withdrawn_trust_ends_writing_at_once(room: Room):
    from asyncua import ua

    path = room.server.trust.trusted / "plc.der"
    data = path.read_bytes()

    async def write(of: Any, node: Any) -> None:
        path.unlink()
        await node("Inputs.s_tip").write_value(0.7)

    before = len(room.served.written)
    try:
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            room.run(write)
    finally:
        path.write_bytes(data)
    assert len(room.served.written) == before
    assert "not trusted" in room.served.told("refused-write")[-1]


def test_garbage_ends_no_server_and_writes_nothing(room: Room):
    """Random bytes, true headers with random bodies, and messages before any channel is open."""
    random_bytes = random.Random(SEED)
    port = int(room.server.url.rsplit(":", 1)[1].split("/")[0])

    async def attack() -> None:
        for i in range(GARBAGE):
            _, writer = await asyncio.open_connection("127.0.0.1", port)
            body = random_bytes.randbytes(random_bytes.randrange(1, 400))
            kind = (b"", b"HELF", b"OPNF", b"MSGF", b"CLOF", b"MSGC")[i % 6]
            header = kind + (len(body) + 8).to_bytes(4, "little") if kind else b""
            writer.write(header + body)
            await writer.drain()
            writer.close()
        await asyncio.sleep(0.05)

    async def read(of: Any, node: Any) -> float:
        return await node("s_w").read_value()

    before = len(room.served.written)
    room.loop.run_until_complete(attack())
    assert len(room.served.written) == before
    assert room.served.told("malformed")
    assert room.run(read) >= 0.0


def test_a_dead_kernel_shows_in_the_status_of_every_value(room: Room):
    async def status(of: Any, node: Any) -> str:
        room.served.alive = False
        await room.server.publish()
        data = await node("s_w").read_data_value(raise_on_bad_status=False)
        room.served.alive = True
        await room.server.publish()
        return f"{data.StatusCode.name} {(await node('s_w').read_data_value()).StatusCode.name}"

    assert room.run(status) == "UncertainLastUsableValue Good"


def test_a_crane_is_found_by_the_names_of_the_companion_specification(room: Room):
    async def browse(of: Any, node: Any) -> tuple[float, str, set[str]]:
        cranes = "http://opcfoundation.org/UA/CranesHoists/"
        names = {
            uri: await of.get_namespace_index(f"http://opcfoundation.org/UA/{uri}/") for uri in ("DI", "Machinery")
        }
        path = [f"{names['Machinery']}:Machines", f"{await of.get_namespace_index(cranes)}:nov-250t"]
        machine = await of.nodes.objects.get_child(path)
        children = {(await child.read_browse_name()).Name for child in await machine.get_children()}
        model = await machine.get_child([f"{names['DI']}:Identification", f"{names['DI']}:Model"])
        unit = await node("p_a").get_child(["0:EngineeringUnits"])
        return (await unit.read_value()).UnitId, await model.read_value(), children

    unit, model, children = room.run(browse)
    assert unit == int.from_bytes(b"PAL", "big")
    assert model == "digital twin of nov-250t"
    assert children >= {"Identification", "Operational", "MotionDevices", "Components", "Configuration", "Inputs"}


def test_a_unit_without_a_common_code_keeps_its_name():
    unit = engineering_units("m^3/rad")
    assert (unit.UnitId, unit.DisplayName.Text) == (-1, "m^3/rad")


def test_keys_are_their_owners_alone(room: Room):
    own = room.server.trust
    assert stat.S_IMODE(own.key.stat().st_mode) == 0o600
    assert stat.S_IMODE(own.path.stat().st_mode) == 0o700
    own.key.chmod(0o640)
    try:
        with pytest.raises(LiveError, match="others may read it"):
            TrustFolder(own.path)
    finally:
        own.key.chmod(0o600)


def test_a_certificate_that_is_over_is_not_trusted(room: Room, monkeypatch: pytest.MonkeyPatch):
    certificate = room.trusted.certificate.read_bytes()
    assert room.server.trust.trusts(certificate)

    class Later(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> datetime:
            return datetime.now(tz) + timedelta(days=DAYS + 1)

    monkeypatch.setattr(trust, "datetime", Later)
    assert not room.server.trust.trusts(certificate)
    with pytest.raises(LiveError, match=r"over since .* Move own/ away"):
        TrustFolder(room.server.trust.path)


def test_rejected_certificates_do_not_pile_up(tmp_path: Path):
    folder = TrustFolder(tmp_path / "trust")
    for i in range(MOST_REJECTED + 5):
        folder.reject(f"no certificate {i}".encode())
    assert len(list(folder.rejected.iterdir())) == MOST_REJECTED


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"host": "0.0.0.0", "insecure": True}, "without security on 0.0.0.0: allowed on 127.0.0.1 alone"),
        ({"host": "crane.example"}, "give the address of one of this machine's networks"),
        ({"port": 70_000}, "give 1 to 65535"),
    ],
)
def test_an_address_that_does_not_do_is_refused_in_one_line(settings: dict[str, Any], text: str, tmp_path: Path):
    with pytest.raises(LiveError, match=text) as problem:
        OpcUaServer(Counting(), "nov-250t", 4, OpcUaSettings(tmp_path, **settings))
    assert "\n" not in str(problem.value)


@pytest.mark.thorough
def test_without_security_on_request_everyone_on_this_machine_reads_and_a_stranger_with_security_does_not(
    room: Room, tmp_path: Path
):
    from asyncua import Client, ua

    served = Counting()
    server = OpcUaServer(served, "nov-250t", 4, OpcUaSettings(tmp_path / "own", port=0, insecure=True))

    async def both() -> float:
        async with server:
            await server.publish()
            async with Client(server.url, timeout=30.0) as plain:
                space = await plain.get_namespace_index(NAMESPACE)
                value = await plain.get_node(f"ns={space};s=s_w").read_value()
            with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                async with await client(server.url, room.stranger, server.trust.certificate):
                    pass
            return value

    assert room.loop.run_until_complete(both()) == served.count
    assert len(served.told("refused-session")) == 1


def test_a_port_in_use_is_refused_in_one_line(room: Room, tmp_path: Path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        settings = OpcUaSettings(room.server.trust.path, port=taken.getsockname()[1])
        with pytest.raises(LiveError, match=r"Address already in use\. Choose another address or port"):
            room.loop.run_until_complete(OpcUaServer(Counting(), "nov-250t", 4, settings).__aenter__())
