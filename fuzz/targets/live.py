"""Files and wires of the live twin: live, PLC, script, registers, events, histories, logs of a PLC; UDP and Modbus."""

from __future__ import annotations

import asyncio
import functools
import math
import random
import socket
import struct
import tempfile
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.targets.crane import LIBRARY
from fuzz.targets.registry import Form, Target
from stillhook.errors import LiveError
from stillhook.library.toml.file import read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.live.condition.sources import EventsFile, gather
from stillhook.live.hil import plc_log
from stillhook.live.hil.plc_file import read_plc_file
from stillhook.live.hil.script import read_script
from stillhook.live.history.contents import check, overview
from stillhook.live.history.events import Event
from stillhook.live.history.journal import JOURNAL
from stillhook.live.history.reading import read
from stillhook.live.history.writer import History
from stillhook.live.live_file import read_live_file
from stillhook.live.observer.observed import factor_in
from stillhook.live.runtime.board import SENSED, STATUS
from stillhook.live.runtime.twin import Row
from stillhook.live.servers.modbus import ModbusServer, ModbusSettings
from stillhook.live.servers.registers import read_registers
from stillhook.live.servers.udp import UdpServer, UdpSettings

NAMES = tuple(dict.fromkeys((*STATUS, *SENSED, "time", "s_w", "s_tip", "v_tip", "a_tip", "p_a", "mode")))
INPUTS = ("s_tip", "v_tip", "a_tip", "v_op", "mode", "K_p")
MAP = "".join(
    f'[[register]]\nname = "{name}"\naddress = {10 * i}\ntype = "float32"\naccess = "{access}"\n'
    for i, (name, access) in enumerate((("s_w", "read"), ("s_tip", "write"), ("p_a", "read")))
).encode()
EVENTS = b"""[[event]]
date = 2027-03-01
what = "repair"
numbers = ["friction"]
"""
EXAMPLES = LIBRARY / "examples"
BESIDE = {
    name: (EXAMPLES / "hil" / name).read_bytes()
    for name in ("case.toml", "registers.toml", "script.toml", "live.toml", "plc.toml")
}


class Served:
    """A twin that stands still."""

    names, inputs, streamed, alive = NAMES, INPUTS, 4, True

    def latest(self) -> Row:
        return Row(1, dict.fromkeys(NAMES, 1.0))

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        """A write is refused as the twin does."""
        for name, value in values.items():
            if name not in INPUTS or not math.isfinite(value):
                raise LiveError(f"{name}: no input.")

    def tell(self, happened: Event) -> None:
        assert all(c.isprintable() for c in happened.text)


class Servers:
    """Modbus and UDP in a thread of their own; problems: what their loop did not catch."""

    def __init__(self) -> None:
        self.problems: list[BaseException] = []
        self.started = threading.Event()
        threading.Thread(target=lambda: asyncio.run(self._serve()), daemon=True).start()
        if not self.started.wait(30.0):
            raise TimeoutError("the servers did not start")

    async def _serve(self) -> None:
        asyncio.get_running_loop().set_exception_handler(self._failed)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "map.toml"
            file.write_bytes(MAP)
            served: Any = Served()
            settings = ModbusSettings(file, port=0, writes=True)
            async with (
                ModbusServer(served, settings) as modbus,
                UdpServer(served, UdpSettings(port=0, writes=True)) as udp,
            ):
                self.port, self.udp = modbus.port, udp
                self.started.set()
                await asyncio.Event().wait()

    def _failed(self, _loop: object, context: dict[str, Any]) -> None:
        self.problems.append(context.get("exception") or RuntimeError(context["message"]))

    def check(self) -> None:
        if self.problems:
            raise self.problems.pop()


servers = functools.cache(Servers)


def _modbus(data: bytes) -> None:
    """Bytes on a connection, then an honest request on another, which is answered."""
    for sent, answered in ((data, False), (struct.pack(">HHHBBHH", 7, 0, 6, 1, 3, 0, 2), True)):
        with socket.create_connection(("127.0.0.1", servers().port), timeout=10.0) as of:
            of.sendall(sent)
            of.shutdown(socket.SHUT_WR) if not answered else None
            answer = of.recv(300)
            if answered and answer[:2] != b"\0\7":
                raise ConnectionError(f"answered {answer!r}")
    servers().check()


def _datagram(data: bytes) -> None:
    servers().udp._receive(data, ("127.0.0.1", 1))
    servers().check()


def _events(path: Path) -> None:
    read_toml(path, FileKind.EVENTS, LiveError, lambda table: table.read(EventsFile).event)


def _history(path: Path) -> None:
    overview(path.parent)
    check(path.parent)
    read(path.parent)


def _frames() -> Iterator[bytes]:
    for function, address, count in (
        (3, 0, 2),
        (4, 20, 2),
        (6, 10, 1),
        (3, 0, 125),
        (16, 10, 2),
        (23, 0, 2),
        (43, 0, 1),
    ):
        yield struct.pack(">HHHBBHH", 1, 0, 6, 1, function, address, count)
    yield struct.pack(">HHHBBHHBf", 1, 0, 11, 1, 16, 10, 2, 4, 0.5)


def _datagrams() -> Iterator[bytes]:
    from tests.live.fuzzing import datagrams

    made = datagrams(random.Random(1))
    yield from (b'{"s_tip": 0.5, "v_tip": 0.1, "time": 1764340000.0}', *(next(made)[1] for _ in range(40)))


def _examples(name: str) -> Iterator[bytes]:
    """Those of the library."""
    return (path.read_bytes() for path in sorted(EXAMPLES.rglob(name)))


def _journal() -> Iterator[bytes]:
    """A history of some rows."""
    with tempfile.TemporaryDirectory() as folder:
        with History(folder, ("s_w", "p_a", "e_c")) as history:
            history.append(1.7e9 + np.arange(5.0), np.ones((5, 3)))
        yield (Path(folder) / JOURNAL).read_bytes()


def _plc_log() -> Iterator[bytes]:
    """Two cycles of every column that is asked for."""
    names = dict.fromkeys((*plc_log.STATUS, *plc_log.INPUTS, *plc_log.NEEDED))
    rows = [",".join(str(i if name == "cycle" else 0.01 * i) for name in names) for i in range(5)]
    yield "\n".join([",".join(f"{n} [{plc_log.STATUS.get(n) or plc_log.unit(n)}]" for n in names), *rows]).encode()


TARGETS = (
    Target("live", Form.TOML, read_live_file, "twin.toml", beside=BESIDE, seeds=lambda: _examples("live.toml")),
    Target("plc", Form.TOML, read_plc_file, "soft.toml", beside=BESIDE, seeds=lambda: _examples("plc*.toml")),
    Target("script", Form.TOML, read_script, "steps.toml", beside=BESIDE, seeds=lambda: _examples("script.toml")),
    Target(
        "registers",
        Form.TOML,
        lambda p: read_registers(p, NAMES, INPUTS),
        "map.toml",
        seeds=lambda: iter((MAP, *_examples("registers.toml"))),
    ),
    Target("events", Form.TOML, _events, "events.toml", seeds=lambda: iter((EVENTS,))),
    Target("condition-sources", Form.TOML, lambda p: gather([p.parent]), "campaign.toml", share=0.5),
    Target("plc-log", Form.TABLE, lambda p: plc_log.read_plc_log(p, None, "plc.toml"), "plc-log.csv", seeds=_plc_log),
    Target("adapted", Form.JSON, factor_in, "adapted.json", seeds=lambda: iter((b'{"value": 1.1}',)), share=0.3),
    Target("history", Form.BINARY, _history, JOURNAL, seeds=_journal),
    Target("datagram", Form.JSON, _datagram, seeds=_datagrams, share=2),
    Target("modbus", Form.PACKET, _modbus, seeds=_frames),
)
