"""Modbus TCP: registers after a map. The protocol has no security, so it listens on loopback unless stated otherwise,
and takes writes only where the map allows them and the program was started for them.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook.base.extras import need
from stillhook.errors import LiveError
from stillhook.live.runtime.sink import event
from stillhook.live.servers.counted import Counted
from stillhook.live.servers.library_log import LibraryLog
from stillhook.live.servers.registers import Access, Register, read_registers
from stillhook.live.servers.served import LOOPBACK, Served, check_address, check_free

if TYPE_CHECKING:
    from pymodbus.constants import ExcCodes
    from pymodbus.server import ModbusTcpServer

PORT = 5020
READS, WRITES = (3, 4), (6, 16)
"""Functions that are served."""
ATTEMPTS = (5, 6, 15, 16, 21, 22, 23)
"""All functions of the protocol that write."""
SOURCE = "modbus"
CLIENTS = 32
"""Connections at most."""
MOST_BYTES = 260
"""Bytes of a request at most, its head included."""


class ModbusSettings(NamedTuple):
    """registers: file of the map; host, port: address to listen on; writes: whether the map's writable rows are."""

    registers: Path
    host: str = LOOPBACK
    port: int = PORT
    writes: bool = False


class ModbusServer:
    """The server, as an asynchronous context. Every unit identifier is the twin's.

    Parameters: served: the twin; settings. Errors: LiveError, one line, for a map or an address that does not do.
    """

    def __init__(self, served: Served, settings: ModbusSettings) -> None:
        need("pymodbus", "Modbus", LiveError)
        check_address(settings.host, settings.port, "modbus")
        self._served, self._settings = served, settings
        self.registers = read_registers(settings.registers, served.names, served.inputs)
        self._refused, self._malformed = Counted(self._tell_refused), Counted(self._tell_malformed)
        self._reason = ""

    async def __aenter__(self) -> ModbusServer:
        from pymodbus.simulator import DataType, SimData, SimDevice

        check_free(self._settings.host, self._settings.port, SOURCE)
        data = [SimData(r.address, count=r.form.words, values=0, datatype=DataType.REGISTERS) for r in self.registers]
        device = SimDevice(id=0, simdata=data, action=self._act)
        settings = self._settings
        async with contextlib.AsyncExitStack() as stack:
            stack.callback(self._malformed.flush)
            stack.callback(self._refused.flush)
            stack.enter_context(LibraryLog(("pymodbus.logging",), "pymodbus", (), self._malformed.add))
            self._server: ModbusTcpServer = _server(device, (settings.host, settings.port), self.answered)
            await self._server.serve_forever(background=True)
            stack.push_async_callback(asyncio.sleep, 0)
            stack.push_async_callback(self._server.shutdown)
            self._stack = stack.pop_all()
        return self

    async def __aexit__(self, *of: object) -> None:
        await self._stack.aclose()

    @property
    def port(self) -> int:
        """Port that it listens on."""
        transport: Any = self._server.transport
        return int(transport.sockets[0].getsockname()[1])

    async def _act(
        self, function: int, start: int, address: int, count: int, registers: list[int], values: Any
    ) -> ExcCodes | None:
        """A request: registers are filled for a read; a write is checked, and handed over whole."""
        from pymodbus.constants import ExcCodes

        if values is None:
            if function in READS:
                self._fill(start, address, address + count, registers)
            return None if function in READS else ExcCodes.ILLEGAL_FUNCTION
        if function not in WRITES:
            return self._refuse(ExcCodes.ILLEGAL_FUNCTION, f"function {function} at {address}: 6 and 16 write")
        if not self._settings.writes:
            return self._refuse(ExcCodes.ILLEGAL_FUNCTION, f"at {address}: started without --allow-writes")
        written: dict[str, float] = {}
        for row in self._rows(address, address + count):
            words = values[row.address - address : row.end - address]
            complete = address <= row.address and row.end <= address + count
            number = row.decode(words) if complete else None
            if row.access is not Access.WRITE or number is None:
                reason = "read only" if row.access is not Access.WRITE else "no number" if complete else "half a number"
                return self._refuse(ExcCodes.ILLEGAL_VALUE, f"{row.name} at {row.address}: {reason}")
            written[row.name] = number
        try:
            self._served.write(written, SOURCE)
        except LiveError as problem:
            return self._refuse(ExcCodes.ILLEGAL_VALUE, str(problem))
        return None

    def _fill(self, start: int, first: int, end: int, registers: list[int]) -> None:
        """Put numbers of the newest cycle, all of the same one, into the registers of a request."""
        row = self._served.latest()
        for each in self._rows(first, end):
            if each.access is Access.READ:
                value = float("nan") if row is None or not self._served.alive else row.values[each.name]
                registers[each.address - start : each.end - start] = each.encode(value)

    def _rows(self, first: int, end: int) -> list[Register]:
        """Rows of the map that a range of addresses touches."""
        return [r for r in self.registers if r.address < end and r.end > first]

    def _refuse(self, code: ExcCodes, reason: str) -> ExcCodes:
        """The answer to a write that is refused."""
        self._reason = reason
        return code

    def answered(self, request: Any, answer: Any) -> None:
        """An event on a write that was refused, by whomever."""
        reason, self._reason = self._reason, ""
        if request.function_code in ATTEMPTS and answer.isError():
            at = f"function {request.function_code} at {request.address}: no such register, or not so many"
            self._refused.add(reason or at)

    def _tell_refused(self, count: int, reason: str) -> None:
        text = f"{count} writes refused, the last {reason}."
        self._served.tell(event(SOURCE, "refused-write", text, count))

    def _tell_malformed(self, count: int, reason: str) -> None:
        text = f"{count} messages dropped or answered with an error, the last: {reason}"
        self._served.tell(event(SOURCE, "malformed", text, count))


def _server(device: Any, address: tuple[str, int], answered: Callable[[Any, Any], None]) -> ModbusTcpServer:
    """The library's server with bounds; answered: receives each request with its answer. By itself it takes any number
    of connections, forgets what came behind a request before its answer was sent, and collects answers that no one
    reads."""
    from pymodbus.server import ModbusTcpServer
    from pymodbus.server.requesthandler import ServerRequestHandler

    class Connection(ServerRequestHandler):  # type: ignore[misc]  # untyped library
        """Answers every request, in their order. known: whether it has made one that was understood; of too many
        connections the oldest goes that has not."""

        known = False

        def callback_connected(self) -> None:
            super().callback_connected()
            self._waiting: deque[Any] = deque()
            self.max_buffer_size = 1 << 20
            others = [c for c in self.listener.active_connections.values() if c is not self]
            if len(others) >= CLIENTS:
                next((c for c in others if not c.known), self).close()

        def callback_data(self, data: bytes, addr: Any = None) -> int:
            used = 0
            while used < len(data) and (taken := super().callback_data(data[used:], addr)):
                used += taken
                if self.last_pdu:
                    self.known = True
                    self._waiting.append(self.last_pdu)
            return used if len(data) - used <= MOST_BYTES else len(data)

        def handle_later(self) -> None:
            """Called once for every request."""
            if self._waiting:
                self.loop.create_task(self._handle(self._waiting.popleft()))

        async def _handle(self, request: Any) -> None:
            self.last_pdu = request  # the library reads it there, and nothing waits in between
            try:
                await self.handle_request()
            except Exception as problem:  # such as an error's answer that fits in no byte: its function has the bit set
                logging.getLogger("pymodbus.logging").warning("No answer: %s", problem)

        def server_send(self, pdu: Any, addr: Any) -> None:
            if pdu and self.last_pdu:
                answered(self.last_pdu, pdu)
            super().server_send(pdu, addr)

        def send(self, data: bytes, addr: Any = None) -> None:
            kept: bytes = self.recv_buffer  # type: ignore[has-type]
            if self.transport and not self.transport.is_closing():
                super().send(data, addr)
                self.recv_buffer = kept

        def pause_writing(self) -> None:
            if self.transport:
                self.transport.pause_reading()

        def resume_writing(self) -> None:
            if self.transport and not self.transport.is_closing():
                self.transport.resume_reading()

    class Bounded(ModbusTcpServer):  # type: ignore[misc]
        """Makes such connections."""

        def callback_new_connection(self) -> Connection:
            return Connection(self, self.trace_packet, self.trace_pdu, self.trace_connect)

    return Bounded(device, address=address)
