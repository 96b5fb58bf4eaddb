"""UDP: rows to one receiver, inputs from it alone; garbage does no harm."""

from __future__ import annotations

import asyncio
import json
import random
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from tests.live.served import Counting

from stillhook.errors import LiveError
from stillhook.live.servers.udp import MAGIC, MOST_BYTES, UdpFormat, UdpServer, UdpSettings

SEED, GARBAGE = 39, 300


class Link:
    """A server and its receiver."""

    def __init__(self, *, writes: bool = True, form: UdpFormat = UdpFormat.JSON, to_host: str = "localhost") -> None:
        self.loop, self.served = asyncio.new_event_loop(), Counting()
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiver.bind(("127.0.0.1", 0))
        self.receiver.settimeout(5.0)
        port = self.receiver.getsockname()[1]
        settings = UdpSettings(port=0, to_host=to_host, to_port=port, form=form, writes=writes)
        self.server = UdpServer(self.served, settings)
        self.loop.run_until_complete(self.server.__aenter__())

    def send(self, data: bytes) -> None:
        self.receiver.sendto(data, ("127.0.0.1", self.server.port))
        self.loop.run_until_complete(asyncio.sleep(0.002))

    def row(self) -> bytes:
        async def send() -> None:
            self.server.send()

        self.loop.run_until_complete(send())
        return self.receiver.recv(65_536)

    def close(self) -> None:
        self.loop.run_until_complete(self.server.__aexit__(None, None, None))
        self.loop.run_until_complete(asyncio.sleep(0))
        self.loop.close()
        self.receiver.close()


@contextmanager
def link(**settings: object) -> Iterator[Link]:
    made = Link(**settings)
    try:
        yield made
    finally:
        made.close()


def test_a_row_is_one_cycle_by_name():
    with link() as of:
        row = json.loads(of.row())
        assert set(row) == set(of.served.names)
        assert row["cycle_number"] == of.served.count


def test_a_packed_row_has_the_order_of_its_names():
    with link(form=UdpFormat.PACKED) as of:
        names = json.loads(of.row())["names"]
        data = of.receiver.recv(65_536)
        assert data[:4] == MAGIC
        (count,) = struct.unpack("<I", data[4:8])
        values = struct.unpack(f"<{count}d", data[8:])
        assert dict(zip(names, values, strict=True))["cycle_number"] == of.served.count
        assert of.row()[:4] == MAGIC  # names come now and then alone


def test_inputs_come_in_with_their_own_stamp():
    with link() as of:
        of.send(b'{"s_tip": 1, "v_tip": 0.5, "a_tip": 0, "time": 1.7e9}')
        assert of.served.written == [{"s_tip": 1.0, "v_tip": 0.5, "a_tip": 0.0}]
        assert of.served.stamps == [1.7e9]


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "no JSON object"),
        (b"{", "no JSON object"),
        (b"[1, 2]", "no JSON object"),
        (b'{"s_tip": NaN}', "no JSON object of finite numbers"),
        (b'{"s_tip": 1e999}', "no JSON object of finite numbers"),
        (b'{"s_tip": 1' + b"0" * 400 + b"}", "no JSON object of finite numbers"),
        (b'{"s_tip": true}', "no JSON object of finite numbers"),
        (b'{"s_tip": "1"}', "no JSON object of finite numbers"),
        (b"[" * 2000, "no JSON object"),
        (b" " * (MOST_BYTES + 1), "at most 2048 are read"),
        (b"\xff\xfe\x00", "no JSON object"),
    ],
)
def test_what_is_no_input_is_refused_and_logged(data: bytes, reason: str):
    with link() as of:
        of.send(data)
        assert of.served.written == []
        assert reason in of.served.told("refused-write")[0]


def test_without_the_option_nothing_is_written():
    with link(writes=False) as of:
        of.send(b'{"s_tip": 1}')
        assert of.served.written == []
        assert "started without --allow-writes" in of.served.told("refused-write")[0]


def test_another_sender_writes_nothing():
    with link() as of, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.2", 0))
        other.sendto(b'{"s_tip": 1}', ("127.0.0.1", of.server.port))
        of.loop.run_until_complete(asyncio.sleep(0.02))
        assert of.served.written == []
        assert "from 127.0.0.2, not the receiver" in of.served.told("refused-write")[0]


def test_garbage_ends_no_server_and_writes_nothing():
    random_bytes = random.Random(SEED)
    with link() as of:
        for _ in range(GARBAGE):
            of.receiver.sendto(random_bytes.randbytes(random_bytes.randrange(0, 500)), ("127.0.0.1", of.server.port))
        of.loop.run_until_complete(asyncio.sleep(0.1))
        assert of.served.written == []
        assert json.loads(of.row())["cycle_number"] == of.served.count


def test_inputs_from_another_machine_are_refused_from_the_start():
    with pytest.raises(LiveError, match="an address is easily forged") as problem:
        UdpServer(Counting(), UdpSettings(to_host="192.0.2.7", writes=True))
    assert "\n" not in str(problem.value)
