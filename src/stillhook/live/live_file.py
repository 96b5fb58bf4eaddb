"""Live files: a twin, where its state is kept, and which servers it has."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import Field

from stillhook.base.extras import need
from stillhook.errors import LiveError
from stillhook.formats.case_file import CaseFile, load_case
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind
from stillhook.live.history import Budget
from stillhook.live.observer.settings import AdaptTable, MeasuredTable, ObserverSettings, settings_of
from stillhook.live.runtime.inputs import TIMEOUT
from stillhook.live.servers import modbus, opcua, udp
from stillhook.live.servers.modbus import ModbusSettings
from stillhook.live.servers.opcua import OpcUaSettings
from stillhook.live.servers.served import LOOPBACK
from stillhook.live.servers.udp import UdpFormat, UdpSettings
from stillhook.tables.table import Spec, Text
from stillhook.units import Time

Port = Annotated[int, Field(strict=True, ge=0, le=65_535)]
SHORTEST, LONGEST = 0.05, 3600.0
"""Time-out of inputs at least and at most [s]."""
FASTEST = 0.01
"""Time between two rows over UDP at least [s]."""
LEAST_SIZE, MOST_SIZE, MOST_DAYS = 0.1, 1.0e5, 3.65e4
"""Of a history [GB, days]."""


class OpcUaTable(Spec):
    """The table [opcua]."""

    host: Text = Field(default=LOOPBACK, description="address to listen on")
    port: Port = Field(default=opcua.PORT, description="port; 0: a free one")


class ModbusTable(Spec):
    """The table [modbus]."""

    registers: Text = Field(description="register map, seen from this file")
    host: Text = Field(default=LOOPBACK, description="address to listen on")
    port: Port = Field(default=modbus.PORT, description="port; 0: a free one")


class UdpTable(Spec):
    """The table [udp]."""

    host: Text = Field(default=LOOPBACK, description="own address")
    port: Port = Field(default=udp.PORT, description="own port; 0: a free one")
    to_host: Text = Field(default=LOOPBACK, description="address of the receiver")
    to_port: Port = Field(default=udp.RECEIVER, description="port of the receiver")
    format: UdpFormat = Field(default=UdpFormat.JSON, description="json or packed")
    every: Annotated[Time, Field(ge=FASTEST, le=LONGEST)] = Field(default=udp.EVERY, description="time between rows")


class HistoryTable(Spec):
    """The table [history]."""

    every: Annotated[Time, Field(ge=0.0, le=LONGEST)] = Field(
        default=0.1, description="time between two rows; 0: every cycle"
    )
    days: Annotated[float, Field(gt=0.0, le=MOST_DAYS)] | None = Field(
        default=None, description="days that are kept; without it as the size allows"
    )
    size: Annotated[float, Field(ge=LEAST_SIZE, le=MOST_SIZE)] = Field(
        default=20.0, description="largest size in GB; the oldest hours go first"
    )


class LiveTables(Spec):
    """A live file."""

    case: Text = Field(description="case file with crane and scenario, seen from this file")
    folder: Text = Field(description="folder for state, certificates and events, seen from this file")
    timeout: Annotated[Time, Field(ge=SHORTEST, le=LONGEST)] = Field(default=TIMEOUT, description="age of stale inputs")
    sensed: bool = Field(default=False, description="serve what a PLC reads, for hardware in the loop", strict=True)
    opcua: OpcUaTable | None = Field(default=None, description="OPC UA server; without the table there is none")
    modbus: ModbusTable | None = Field(default=None, description="Modbus server; without the table there is none")
    udp: UdpTable | None = Field(default=None, description="UDP sender; without the table there is none")
    history: HistoryTable | None = Field(default=None, description="history; without the table there is none")
    measured: MeasuredTable | None = Field(default=None, description="what the crane measures; without it nothing")
    adapt: AdaptTable | None = Field(default=None, description="friction that follows the crane; without it none does")


class LivePlan(NamedTuple):
    """What a live file says: crane and scenario, folder, time-out of inputs [s], settings of the servers, the
    history: PLC cycles from row to row, and what it may hold; sensed: whether what a PLC reads is served; and what the
    crane measures."""

    case: CaseFile
    folder: Path
    timeout: float
    opcua: OpcUaSettings | None
    modbus: ModbusSettings | None
    udp: UdpSettings | None
    history: tuple[int, Budget] | None = None
    sensed: bool = False
    observer: ObserverSettings | None = None


def read_live_file(path: str | Path, *, writes: bool = False, insecure: bool = False) -> LivePlan:
    """Read a live file; writes: whether Modbus and UDP take inputs; insecure: OPC UA also without security.

    Errors: StillhookError of one line.
    """
    read = lambda table: _plan(table, writes=writes, insecure=insecure)
    return read_toml_raising(LiveError, path, FileKind.LIVE, read, start="Copy one: stillhook example live FOLDER.")


def _plan(table: TomlTable, *, writes: bool, insecure: bool) -> LivePlan:
    file = table.read(LiveTables)
    case = load_case(table.relative_file(file.case, "case"))
    folder = table.named_folder(file.folder, "folder")
    of_opcua = of_modbus = of_udp = None
    if file.opcua is not None:
        of_opcua = OpcUaSettings(folder / "opcua", file.opcua.host, file.opcua.port, insecure)
    if file.modbus is not None:
        registers = table.relative_file(file.modbus.registers, "modbus", "registers")
        of_modbus = ModbusSettings(registers, file.modbus.host, file.modbus.port, writes)
    if file.udp is not None:
        u = file.udp
        of_udp = UdpSettings(u.host, u.port, u.to_host, u.to_port, u.format, u.every, writes)
    kept = None
    if file.history is not None:
        need("duckdb", "[history]", LiveError)
        h = file.history
        every = max(1, round(h.every / case.crane.control.t_cycle))
        kept = every, Budget(bytes=round(1e9 * h.size), days=h.days)
    observer = settings_of(table, file.measured, file.adapt, case.crane)
    return LivePlan(case, folder, file.timeout, of_opcua, of_modbus, of_udp, kept, file.sensed, observer)
