"""Bounds that the OPC UA library (asyncua 2.1) lacks: of what one message or one connection may cost, whoever it is of.

Without them a message of 60 bytes, from a client without any certificate, keeps the library busy for more than an hour
or takes 16 GB: a list of 2^31 values that take no byte each, or whose negative lengths step back. And a connection
collects all that comes, as long as no message is complete or no answer is read.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import Any

MOST_CHUNK = 65_535
"""Bytes of a chunk at most: the library's own limit, which it compares when the chunk is complete."""
MOST_MESSAGE = 1 << 20
"""Bytes of a message at most: a hundred times one that reads or writes a thousand values."""
MOST_DIMENSIONED = 4096
"""Values of a list with dimensions at most: each dimension copies them."""
PENDING, PATIENCE = 16, 10.0
"""Connections without a session at most, and how long one may go without [s]."""


def bound_decoding() -> None:
    """Refuse a length below none, and a list of more elements than bytes, in every message that is decoded."""
    from asyncua.common import utils
    from asyncua.ua import ua_binary

    if getattr(ua_binary, "bounded_by_stillhook", False):
        return
    read, skip = utils.Buffer.read, utils.Buffer.skip

    def not_back(move: Callable[[Any, int], Any]) -> Callable[[Any, int], Any]:
        def checked(self: Any, size: int) -> Any:
            if size < 0:
                raise utils.NotEnoughData(f"length {size}")
            return move(self, size)

        return checked

    utils.Buffer.read, utils.Buffer.skip = not_back(read), not_back(skip)

    def of_bounded_length(make: Callable[[Any], Callable[[Any], Any]]) -> Callable[[Any], Callable[[Any], Any]]:
        def bounded(kind: Any) -> Callable[[Any], Any]:
            decode = make(kind)

            def checked(data: Any) -> Any:
                if isinstance(data, utils.Buffer):
                    length = ua_binary.Primitives.Int32.unpack(data.copy())
                    if length < -1 or length > len(data):
                        raise utils.NotEnoughData(f"list of {length} in {len(data)} bytes")
                return decode(data)

            return checked

        return functools.cache(bounded)

    for name in ("_create_uatype_array_deserializer", "_create_list_deserializer"):
        setattr(ua_binary, name, of_bounded_length(getattr(ua_binary, name)))
    for each in vars(ua_binary).values():  # what was made before goes without bounds
        if hasattr(each, "cache_clear"):
            each.cache_clear()
    ua_binary.MAX_RESHAPE_ELEMENTS = MOST_DIMENSIONED
    ua_binary.bounded_by_stillhook = True


def bounded_server(**arguments: Any) -> Any:
    """A server of the library whose connections are bounded."""
    from asyncua import Server
    from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol

    class Connection(OPCUAProtocol):  # type: ignore[misc]  # untyped library
        """Collects no more than a chunk, and reads nothing while its answers are not read."""

        since = 0.0

        def connection_made(self, transport: Any) -> None:
            self.since = time.monotonic()
            super().connection_made(transport)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            buffered: bytes = self._buffer  # type: ignore[has-type]
            if len(buffered) > MOST_CHUNK and self.transport is not None:
                self._buffer = b""
                self.transport.abort()

        async def _process_one_msg(self, header: Any, buf: Any) -> bool:
            """Nothing is calculated for a connection that is closed."""
            if self.transport is None or self.transport.is_closing():
                return False
            return bool(await super()._process_one_msg(header, buf))

        def pause_writing(self) -> None:
            if self.transport is not None:
                self.transport.pause_reading()

        def resume_writing(self) -> None:
            if self.transport is not None and not self.transport.is_closing():
                self.transport.resume_reading()

    class Bounded(Server):  # type: ignore[misc]
        """Gives the part that listens such connections."""

        @property
        def bserver(self) -> Any:
            return self._listening

        @bserver.setter
        def bserver(self, listening: BinaryServer | None) -> None:
            self._listening = listening
            if listening is not None:
                listening._make_protocol = lambda: Connection(
                    listening.iserver, listening._policies, listening.clients, listening.closing_tasks, listening.limits
                )

    made = Bounded(**arguments)
    made.limits.max_message_size = MOST_MESSAGE
    made.limits.max_chunk_count = MOST_MESSAGE // MOST_CHUNK + 1
    return made


def close_idle(connections: list[Any], trusts: Callable[[bytes | None], bool]) -> int:
    """Close connections without a session that are too old, and the oldest of too many whose channel has no trusted
    certificate; how many. So no one keeps those away who have a session to come."""
    now = time.monotonic()
    idle = [c for c in connections if c.processor.session is None or not c.processor.session.is_activated()]
    closed = [c for c in idle if now - c.since > PATIENCE]
    if len(idle) - len(closed) > PENDING:
        policies = [(c, c.processor._connection.security_policy) for c in idle if c not in closed]
        strangers = [c for c, policy in policies if not trusts(policy.peer_certificate)]
        closed += sorted(strangers, key=lambda c: c.since)[: len(idle) - len(closed) - PENDING]
    for each in closed:
        each.transport.abort()
    return len(closed)
