"""Files to try hardware in the loop with: a twin, its register map, two soft PLCs and a script."""

from __future__ import annotations

from pathlib import Path

from stillhook.live.hil.bus import COMMANDS, OVERRIDE
from stillhook.live.live_file import CASE_FILE, LIVE_FILE, REGISTERS_FILE, write_files
from stillhook.live.runtime.board import IMAGE
from stillhook.live.servers.registers import Form

PLC_FILE, MODBUS_FILE, SCRIPT_FILE = "plc.toml", "plc-modbus.toml", "script.toml"
LIVE = f"""\
# The twin as the plant of a PLC: stillhook live run {LIVE_FILE} --allow-writes
case = "{CASE_FILE}"
folder = "twin"
sensed = true               # serve what a PLC reads, sensors included

[opcua]

[modbus]
registers = "{REGISTERS_FILE}"
"""
CASE = """\
crane = "nov-250t"

[scenario]
load = "100 t"
s_w = "100 m"
tip = "sine 1.5 m 9 s"
mode = "ssc"
"""
PLC = f"""\
# A soft PLC: stillhook plc run {PLC_FILE} --duration "60 s"
case = "{CASE_FILE}"           # crane and scenario, those of the twin
controller = "strong-ssc"
cycle = "20 ms"
command_delay = "0 ms"       # commands act so much later than in the plant's next cycle
program = "library"          # or "structured-text": the exported text, compiled
log = "plc-log.csv"          # every cycle: stillhook plc compare plc-log.csv {PLC_FILE}
# script = "{SCRIPT_FILE}"
"""
OPCUA = """
[opcua]                      # the twin has to trust plc/own/certificate.der: copy it into twin/opcua/trusted
folder = "plc"
server = "twin/opcua/own/certificate.der"
"""
MODBUS = f"""
[modbus]                     # no security: on this machine alone
registers = "{REGISTERS_FILE}"
"""
SCRIPT = """\
# What the PLC reads, changed on the way; times since its start. One of value, points, offset, noise, stuck, lost a row.
[[input]]
name = "v_op"
at = "10 s"
until = "20 s"
points = [["0 s", "0 m/s"], ["2 s", "0.2 m/s"], ["8 s", "0.2 m/s"], ["10 s", "0 m/s"]]

[[input]]
name = "s_w"                # the encoder drops out for longer than the guard bridges: the winch is stopped
at = "30 s"
until = "31 s"
lost = true

[[input]]                   # acknowledged: joystick released, mode manual, rising edge of reset
name = "mode"
at = "36 s"
until = "40 s"
value = "manual"

[[input]]
name = "reset"
at = "38 s"
until = "39 s"
value = 1
"""


def example_hil(out: Path) -> list[Path]:
    """Write the files into a folder without them. Errors: LiveError, SimulationError."""
    texts = {LIVE_FILE: LIVE, PLC_FILE: PLC + OPCUA, MODBUS_FILE: PLC.replace(PLC_FILE, MODBUS_FILE) + MODBUS}
    return write_files(out, texts | {CASE_FILE: CASE, REGISTERS_FILE: registers(), SCRIPT_FILE: SCRIPT})


def registers() -> str:
    """A register map of what a PLC reads and commands, each in one message."""
    lines = ["# Register map for a PLC. What it reads and what it commands follow one another without a gap."]
    for access, first, names in (("read", 0, IMAGE), ("write", 200, (OVERRIDE, *COMMANDS))):
        address = first
        for name in names:
            form = {"cycle_number": Form.UINT32, "time": Form.FLOAT64, "time_utc": Form.FLOAT64}.get(name, Form.FLOAT32)
            lines += ["", "[[register]]", f'name = "{name}"', f"address = {address}", f'type = "{form}"']
            lines += [f'access = "{access}"']
            address += form.words
    return "\n".join(lines) + "\n"
