"""Modbus TCP: registers after a map. The protocol knows no security, so it listens on loopback unless told otherwise,
and takes writes only where the map allows them and the program was started for them.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook.base.extras import need
from stillhook.errors import LiveError
from stillhook.live.runtime.sink import event
from stillhook.live.servers.library_log import LibraryLog
from stillhook.live.servers.registers import Access, Register, read_registers
from stillhook.live.servers.served import LOOPBACK, Served, check_address, check_free

if TYPE_CHECKING:
    from pymodbus.constants import ExcCodes
    from pymodbus.server import ModbusTcpServer

PORT = 5020
READS, WRITES = (3, 4), (6, 16)
"""Functions that are served."""
SOURCE = "modbus"
QUIET = 1.0
"""Least time between two events on refused requests [s]."""


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
        self._refused, self._reported = 0, -QUIET

    async def __aenter__(self) -> ModbusServer:
        from pymodbus.server import ModbusTcpServer
        from pymodbus.simulator import DataType, SimData, SimDevice

        check_free(self._settings.host, self._settings.port, SOURCE)
        tell = lambda text: self._served.tell(event(SOURCE, "malformed", text))
        data = [SimData(r.address, count=r.form.words, values=0, datatype=DataType.REGISTERS) for r in self.registers]
        device = SimDevice(id=0, simdata=data, action=self._act)
        settings = self._settings
        async with contextlib.AsyncExitStack() as stack:
            stack.enter_context(LibraryLog(("pymodbus.logging",), "pymodbus", (), tell))
            self._server: ModbusTcpServer = ModbusTcpServer(device, address=(settings.host, settings.port))
            await self._server.serve_forever(background=True)
            stack.push_async_callback(asyncio.sleep, 0)
            stack.push_async_callback(self._server.shutdown)
            self._stack = stack.pop_all()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, of: TracebackType | None
    ) -> None:
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
            whole = address <= row.address and row.end <= address + count
            number = row.decode(words) if whole else None
            if row.access is not Access.WRITE or number is None:
                reason = "read only" if row.access is not Access.WRITE else "no number" if whole else "half a number"
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
        """The answer to a write that is refused, and an event: the first at once, later ones counted."""
        self._refused += 1
        if time.monotonic() - self._reported >= QUIET:
            text = f"{self._refused} writes refused, the last {reason}."
            self._served.tell(event(SOURCE, "refused-write", text, self._refused))
            self._refused, self._reported = 0, time.monotonic()
        return code
