"""PLC files: which controller runs on which crane, how often, on which bus, and what the columns of its log are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from stillhook.analysis.controllers import STRONG, strong_ssc
from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import PROGRAM
from stillhook.control.registry import DEFAULT_MODE, Mode
from stillhook.engine.session import Session
from stillhook.errors import LiveError
from stillhook.formats.case_file import load_case
from stillhook.library import changed
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind
from stillhook.live.hil.bus import Bus
from stillhook.live.hil.controller import Controller, LibraryController
from stillhook.live.hil.modbus import ModbusBus, ModbusBusSettings
from stillhook.live.hil.opcua import OpcUaBus, OpcUaBusSettings
from stillhook.live.hil.script import Script, read_script
from stillhook.live.live_file import Port
from stillhook.live.runtime.board import SENSED, STATUS
from stillhook.live.runtime.inputs import ordered
from stillhook.live.servers import modbus, opcua
from stillhook.live.servers.served import LOOPBACK
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.tables.table import Spec, Text
from stillhook.units import Time

FASTEST, SLOWEST = 1.0e-3, 0.2
"""Cycle at least and at most [s]."""
LOG = "plc-log.csv"
LIBRARY, TEXT = "library", "structured-text"


class PlcOpcUaTable(Spec):
    """The table [opcua]."""

    url: Text = Field(default=f"opc.tcp://{LOOPBACK}:{opcua.PORT}/stillhook", description="address of the twin")
    folder: Text = Field(description="folder of the PLC's own certificate, seen from this file")
    server: Text = Field(description="the twin's certificate, which the PLC trusts, seen from this file")


class PlcModbusTable(Spec):
    """The table [modbus]."""

    registers: Text = Field(description="register map of the twin, seen from this file")
    host: Text = Field(default=LOOPBACK, description="address of the twin")
    port: Port = Field(default=modbus.PORT, description="port of the twin")


class PlcTables(Spec):
    """A PLC file."""

    case: Text = Field(description="case file with crane and scenario of the twin, seen from this file")
    controller: Text = Field(description=f"controller, or {STRONG}")
    cycle: Annotated[Time, Field(ge=FASTEST, le=SLOWEST)] | None = Field(
        default=None, description="time of a cycle; default that of the crane"
    )
    command_delay: Annotated[Time, Field(ge=0.0, le=1.0)] = Field(
        default=0.0, description="by which the bus makes commands late: added to the lead of the feedforward"
    )
    program: Text = Field(
        default=LIBRARY,
        description="library; structured-text: its export, compiled; or a .st file, seen from this file",
    )
    log: Text = Field(default=LOG, description="log of every cycle, seen from this file")
    script: Text | None = Field(default=None, description="script of the inputs, seen from this file")
    opcua: PlcOpcUaTable | None = Field(default=None, description="OPC UA; one of the two buses")
    modbus: PlcModbusTable | None = Field(default=None, description="Modbus TCP; one of the two buses")
    signals: Mapping[str, Any] | None = Field(default=None, description="columns of a log of another PLC")
    resolution: Mapping[str, Any] = Field(default_factory=dict, description="steps to which numbers are rounded")


@dataclass(frozen=True)
class PlcPlan:
    """What a PLC file says. of_case: the crane of its case; of_file: with cycle and lead of this file; scenario, log
    and script; file: its values; table: where they are written."""

    of_case: Crane
    of_file: Crane
    scenario: Scenario
    log: Path
    script: Script
    file: PlcTables
    table: TomlTable

    @property
    def mode(self) -> str:
        """Name of the motor law that the PLC runs."""
        return DEFAULT_MODE.value if self._strong else self.file.controller

    @cached_property
    def crane(self) -> Crane:
        """The crane with the settings that the PLC runs; those of strong SSC are searched for here, which takes
        seconds, and kept. Errors: StillhookError where no gain keeps the margins."""
        if not self._strong:
            return self.of_file
        return strong_ssc(self.of_file, command_delay=self.file.command_delay).on(self.of_file)

    @cached_property
    def plant(self) -> Crane:
        """The crane that the twin moves, with its own controller. Errors: as `crane`."""
        return strong_ssc(self.of_case).on(self.of_case) if self._strong else self.of_case

    @property
    def _strong(self) -> bool:
        return self.file.controller == STRONG

    @property
    def path(self) -> Path:
        """The file."""
        return self.table.path

    def controller(self) -> Controller:
        """The controller, at its start. Errors: LiveError, PlcError of one line."""
        program = self.file.program
        if program == LIBRARY:
            return LibraryController(self.crane, self.mode)
        from stillhook.live.hil.structured_text import CompiledText

        if program == TEXT:
            return CompiledText(self.crane, self.mode)
        if not program.endswith(".st"):
            raise self.table.wrong(f"choose {LIBRARY} or {TEXT}, or give a file whose name ends in .st.", "program")
        text = read_text(self.table.relative_file(program, "program"), "program", LiveError, PROGRAM)
        return CompiledText(self.crane, self.mode, text)

    def bus(self) -> Bus:
        """The bus that the file names. Errors: LiveError where it names none, or two."""
        of = self.file
        if of.opcua is not None and of.modbus is None:
            folder = self.table.named_folder(of.opcua.folder, "opcua", "folder")
            server = self.table.named_path(of.opcua.server, "opcua", "server")
            return OpcUaBus(OpcUaBusSettings(of.opcua.url, folder, server))
        if of.modbus is not None and of.opcua is None:
            registers = self.table.relative_file(of.modbus.registers, "modbus", "registers")
            session = Session(self.plant, self.scenario)
            inputs, _ = ordered((*session.inputs, *session.vessel_inputs), session.parameters)
            names = (*STATUS, *session.signals, *inputs, *SENSED)
            settings = ModbusBusSettings(registers, of.modbus.host, of.modbus.port)
            return ModbusBus(settings, tuple(dict.fromkeys(names)), inputs)
        raise LiveError(f"{self.path.name}: give one bus, a table [opcua] or a table [modbus].")


def read_plc_file(path: str | Path) -> PlcPlan:
    """Read a PLC file. Errors: StillhookError of one line."""
    return read_toml_raising(LiveError, path, FileKind.PLC, _plan, start="Copy one: stillhook example live FOLDER.")


def _plan(table: TomlTable) -> PlcPlan:
    file = table.read(PlcTables)
    case = load_case(table.relative_file(file.case, "case"))
    names = [*(each.value for each in Mode), STRONG]
    if file.controller not in names:
        raise table.wrong(f"choose one of {', '.join(names)}.", "controller")
    crane = case.crane
    if file.cycle is not None:
        crane = changed(crane, {"control": {"t_cycle": _ms(file.cycle)}})
    if file.controller == STRONG:
        if reason := crane.plant.type.mode_refusal(DEFAULT_MODE):
            raise table.wrong(reason, "controller")
    elif file.command_delay > 0.0:
        crane = changed(crane, {"control": {"t_lead_ff": _ms(crane.control.feedforward_lead + file.command_delay)}})
    script = Script() if file.script is None else read_script(table.relative_file(file.script, "script"))
    return PlcPlan(case.crane, crane, case.case, table.named_path(file.log, "log"), script, file, table)


def _ms(time: float) -> str:
    return f"{1e3 * time:.9g} ms"
