"""UDP: rows to one receiver, as JSON or packed, and inputs from it as JSON.

There is no security and no order: a receiver detects by `cycle_number` what is missing. Inputs are taken from the
receiver's address alone, on this machine alone, and only where the program was started for writes: an address is easily
forged.

Packed: "SHR1", the number of values as a little-endian unsigned integer of 4 bytes, the values as little-endian doubles
in the order of the names, which are sent as JSON, {"names": [...]}, before the first row and every second.
"""

from __future__ import annotations

import asyncio
import json
import math
import struct
import time
from collections.abc import Callable
from enum import StrEnum
from typing import Any, NamedTuple

from stillhook.base.gateway.parse import from_json
from stillhook.errors import LiveError, UnreadableError
from stillhook.live.runtime.sink import event
from stillhook.live.servers.counted import Counted
from stillhook.live.servers.served import LOOPBACK, Served, check_address, is_loopback

PORT, RECEIVER = 5030, 5031
EVERY = 0.1
"""Time between two rows [s]."""
NAMES_EVERY = 1.0
"""Time between two lists of names [s]."""
MAGIC = b"SHR1"
MOST_BYTES = 2048
"""Bytes of a message with inputs at most."""
SOURCE = "udp"
TIME = "time"
"""Key of a message's own time stamp, UTC [s]."""


class UdpFormat(StrEnum):
    """How rows are written."""

    JSON = "json"
    PACKED = "packed"


class UdpSettings(NamedTuple):
    """host, port: own address; to_host, to_port: of the receiver; form of rows; every: time between them [s]; writes:
    whether inputs are taken."""

    host: str = LOOPBACK
    port: int = PORT
    to_host: str = LOOPBACK
    to_port: int = RECEIVER
    form: UdpFormat = UdpFormat.JSON
    every: float = EVERY
    writes: bool = False


class UdpServer:
    """The server, as an asynchronous context. Parameters: served: the twin; settings. Errors: LiveError, one line."""

    def __init__(self, served: Served, settings: UdpSettings) -> None:
        check_address(settings.host, settings.port, "udp")
        check_address(settings.to_host, settings.to_port, "udp: to")
        if settings.writes and not is_loopback(settings.to_host):
            raise LiveError(
                f"udp: inputs from {settings.to_host}: an address is easily forged. Take inputs by OPC UA, or from"
                f" {LOOPBACK}."
            )
        self._served, self._settings = served, settings
        self._to = LOOPBACK if settings.to_host == "localhost" else settings.to_host
        self._refused = Counted(self._tell)
        self._named = -math.inf

    async def __aenter__(self) -> UdpServer:
        settings, loop = self._settings, asyncio.get_running_loop()
        try:
            made = await loop.create_datagram_endpoint(
                lambda: _Receiver(self._receive), local_addr=(settings.host, settings.port)
            )
        except OSError as problem:
            raise LiveError(f"udp: {settings.host}:{settings.port}: {problem.strerror}. Choose another port.") from None
        self._transport: asyncio.DatagramTransport = made[0]
        return self

    async def __aexit__(self, *of: object) -> None:
        self._transport.close()
        self._refused.flush()

    @property
    def port(self) -> int:
        """Port that it listens on."""
        return int(self._transport.get_extra_info("sockname")[1])

    async def serve(self, stopped: Callable[[], bool]) -> None:
        """Send the newest row until it is stopped, at whole steps of time."""
        due = time.monotonic()
        while not stopped():
            self.send()
            due = max(due + self._settings.every, time.monotonic())
            await asyncio.sleep(max(0.0, due - time.monotonic()))

    def send(self) -> None:
        """The newest row, once."""
        row = self._served.latest()
        if row is None:
            return
        to = self._to, self._settings.to_port
        names = self._served.names
        if self._settings.form is UdpFormat.JSON:
            finite = {n: v if math.isfinite(v) else None for n, v in row.values.items()}
            self._transport.sendto(json.dumps(finite).encode(), to)
            return
        if time.monotonic() - self._named >= NAMES_EVERY:
            self._transport.sendto(json.dumps({"names": names}).encode(), to)
            self._named = time.monotonic()
        values = [row.values[name] for name in names]
        self._transport.sendto(MAGIC + struct.pack(f"<I{len(values)}d", len(values), *values), to)

    def _receive(self, data: bytes, peer: Any) -> None:
        """A message with inputs: all of it is taken, or nothing."""
        if not self._settings.writes:
            return self._refuse("started without --allow-writes")
        if peer[0] != self._to:
            return self._refuse(f"from {peer[0]}, not the receiver")
        if len(data) > MOST_BYTES:
            return self._refuse(f"{len(data)} bytes, at most {MOST_BYTES} are read")
        try:
            table = from_json(data)
            good = isinstance(table, dict) and bool(table) and all(_is_number(v) for v in table.values())
        except UnreadableError:
            good = False
        if not good:
            return self._refuse("no JSON object of finite numbers")
        values = {name: float(value) for name, value in table.items() if name != TIME}
        try:
            self._served.write(values, SOURCE, float(table.get(TIME, math.nan)))
        except LiveError as problem:
            return self._refuse(str(problem))
        return None

    def _refuse(self, reason: str) -> None:
        self._refused.add(reason)

    def _tell(self, count: int, reason: str) -> None:
        text = f"{count} messages refused, the last: {reason.removesuffix('.')}."
        self._served.tell(event(SOURCE, "refused-write", text, count))


class _Receiver(asyncio.DatagramProtocol):
    def __init__(self, receive: Callable[[bytes, Any], None]) -> None:
        self._receive = receive

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """A message."""
        self._receive(data, addr)


def _is_number(value: object) -> bool:
    """Whether it is one finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False
