"""A soft PLC as a Modbus TCP client of the twin, by the same register map. The protocol has no security."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.extras import need
from stillhook.errors import LiveError
from stillhook.live.hil.bus import COMMANDS, OVERRIDE, BusError, Image, quiet
from stillhook.live.runtime.board import IMAGE
from stillhook.live.servers.modbus import PORT
from stillhook.live.servers.registers import Access, Register, read_registers
from stillhook.live.servers.served import LOOPBACK

ANSWER = 0.5
"""Time for an answer [s]."""
MOST_READ, MOST_WRITTEN = 125, 123
"""Registers of one message."""
OPTIONAL = ("time", "time_utc", "e_c", "u_p")
"""Numbers of the image that a map may leave out."""


class ModbusBusSettings(NamedTuple):
    """registers: file of the map, that of the twin; host, port: of the server."""

    registers: Path
    host: str = LOOPBACK
    port: int = PORT


class ModbusBus:
    """The bus. names, inputs: what the twin serves and takes. Errors: LiveError, one line, where the map has no row for
    something that the controller reads or commands."""

    def __init__(self, settings: ModbusBusSettings, names: Sequence[str], inputs: Sequence[str]) -> None:
        need("pymodbus", "Modbus", LiveError)
        rows = read_registers(settings.registers, names, inputs)
        self._settings = settings
        self.label = f"Modbus TCP {settings.host}:{settings.port}"
        read = {r.name: r for r in rows if r.access is Access.READ and r.name in IMAGE}
        self._written = {r.name: r for r in rows if r.access is Access.WRITE and r.name in (OVERRIDE, *COMMANDS)}
        where = settings.registers.name
        for name in IMAGE:
            if name not in read and name not in OPTIONAL:
                raise LiveError(f'{where}: no row {name}, which the controller reads. Add it with access = "read".')
        for name in (OVERRIDE, *COMMANDS):
            of = self._written.get(name)
            if of is None:
                raise LiveError(f'{where}: no row {name}, which the PLC commands. Add it with access = "write".')
            if any(of.decode(of.encode(x)) is None for x in (1.0, -1.0 if name == "u_p" else 0.0)):
                raise LiveError(f"{where}: {name}: {of.form} with this scale does not hold 1 (u_p: -1 to 1). Widen it.")
        self._reads, self._writes = blocks(read.values(), MOST_READ), blocks(self._written.values(), MOST_WRITTEN)
        self._client: Any = None
        self._quiet = contextlib.ExitStack()

    async def connect(self) -> None:
        """As of `Bus`."""
        from pymodbus.client import AsyncModbusTcpClient

        await self.close()
        self._quiet.enter_context(quiet("pymodbus.logging"))
        self._client = AsyncModbusTcpClient(
            self._settings.host, port=self._settings.port, timeout=ANSWER, retries=0, reconnect_delay=0
        )
        if not await self._client.connect():
            raise BusError(f"{self.label}: no connection. Start the twin: stillhook live run.")

    async def read(self) -> Image:
        """As of `Bus`."""
        values = np.full(len(IMAGE), math.nan)
        for block in self._reads:
            first, count = block[0].address, block[-1].end - block[0].address
            answer = await self._call(lambda c, f=first, n=count: c.read_input_registers(f, count=n))
            if answer.isError():
                raise LiveError(f"{self.label}: refused to read {count} registers from {first} ({answer}).")
            for row in block:
                value = row.decode(answer.registers[row.address - first : row.end - first])
                values[IMAGE.index(row.name)] = math.nan if value is None else value
        return Image(values, not math.isnan(values[0]))

    async def write(self, values: Mapping[str, float]) -> None:
        """As of `Bus`."""
        for block in self._writes:
            if not all(row.name in values for row in block):
                block = [row for row in block if row.name in values]
            for part in blocks(block, MOST_WRITTEN):
                words = [word for row in part for word in row.encode(values[row.name])]
                first = part[0].address
                answer = await self._call(lambda c, f=first, w=words: c.write_registers(f, w))
                if answer.isError():
                    raise LiveError(
                        f"{self.label}: refused to write registers from {first} ({answer}). Start the twin with"
                        " --allow-writes."
                    )

    async def _call(self, request: Any) -> Any:
        if self._client is None or not self._client.connected:
            raise BusError(f"{self.label}: not connected.")
        try:
            return await request(self._client)
        except Exception as problem:
            raise BusError(f"{self.label}: no answer ({type(problem).__name__} {problem}).") from None

    async def close(self) -> None:
        """As of `Bus`."""
        self._quiet.close()
        made, self._client = self._client, None
        if made is not None:
            with contextlib.suppress(Exception):
                made.close()

    def resolution(self, name: str) -> float:
        """As of `Bus`: a count of its register, or what a float32 resolves at 1."""
        row = self._written[name]
        return row.factor if row.form.integer else (2.0**-24 if row.form.words == 2 else 0.0)


def blocks(rows: Any, most: int) -> list[list[Register]]:
    """Rows in messages: those that follow one another without a gap, up to so many registers."""
    out: list[list[Register]] = []
    for row in sorted(rows, key=lambda r: r.address):
        if out and row.address == out[-1][-1].end and row.end - out[-1][0].address <= most:
            out[-1].append(row)
        else:
            out.append([row])
    return out
