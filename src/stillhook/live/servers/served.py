"""What a server needs of the twin, and what it says of a signal."""

from __future__ import annotations

import ipaddress
import math
import socket
from collections.abc import Iterable, Mapping
from typing import Protocol

from stillhook.errors import LiveError
from stillhook.live.runtime.board import SENSED, STATUS
from stillhook.live.runtime.sink import Event
from stillhook.live.runtime.twin import Row
from stillhook.live.watch.deviation import Deviation
from stillhook.live.watch.virtual import MEANINGS
from stillhook.sea.vessel.vessel_tip import VESSEL
from stillhook.units import quote
from stillhook.variables import BY_NAME

LOOPBACK = "127.0.0.1"
SETTINGS: Mapping[str, tuple[str, str]] = {
    "s_op": ("m", "hoisting positive: integral of the operator's speed"),
    "f_pump": ("1", "share of the pumps that run"),
    "alpha_ns": ("1", "displacement of the motors at normal speed"),
    "alpha_hs": ("1", "displacement of the motors at high speed"),
    "alpha_swl": ("1", "least displacement of the motors that holds the SWL"),
    "t_lead": ("s", "lead of the feedforward"),
    "t_bumpless": ("s", "time of a change of mode"),
    "tau_F": ("s", "time constant of the load's filter"),
    "friction_factor": ("1", "system friction over that of the crane file"),
}
"""Unit and meaning of inputs and settings that are not signals."""
MOVED: Mapping[str, str] = {
    "m": "length",
    "m/s": "speed",
    "m/s^2": "acceleration",
    "rad": "angle",
    "rad/s": "angle_rate",
    "rad/s^2": "angle_acceleration",
}
"""Kind of a number of the vessel's motion by its unit."""
MEASURED, AGE, DEVIATION, ALARM = "measured", "age", "deviation", "alarm"
"""What servers show of a signal beside the twin's own: measured.s_w, age.s_w [s], deviation.s_w (rms over a window),
alarm.s_w (0, 1)."""
VIRTUAL, HALF = "virtual", "virtual_half"
"""Of a virtual sensor: virtual.T_f, NaN where it is not valid, and virtual_half.T_f, half of its 95 % interval."""
CRITERIA = "criteria"
"""alarm.criteria is 1 while a criterion of validation is not met in some window."""


class Served(Protocol):
    """The twin as servers have it: a `LiveTwin`, or what stands for one."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers of a row."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names that may be written."""

    @property
    def alive(self) -> bool:
        """Whether the kernel's process runs."""

    def latest(self) -> Row | None:
        """The newest cycle."""

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        """Hand inputs over. Errors: LiveError."""

    def tell(self, happened: Event) -> None:
        """Pass an event on."""

    def pump(self) -> None:
        """Pass rows and events on; to be called several times a second."""


def compared(deviations: Iterable[Deviation]) -> dict[str, float]:
    """What servers show of deviations."""
    shown: dict[str, float] = {}
    for d in deviations:
        shown |= {f"{DEVIATION}.{d.name}": d.rms, f"{ALARM}.{d.name}": float(d.alarm)}
    return shown


def about(name: str) -> tuple[str, str]:
    """Unit and meaning of a number."""
    if "." in name:
        side, _, signal = name.partition(".")
        unit, meaning = about(signal)
        return {ALARM: "1", AGE: "s"}.get(side, unit), f"{side}: {meaning}"
    if name in SENSED and name not in BY_NAME:
        unit, meaning = about(name.removeprefix("sensed_"))
        return unit, f"as the PLC reads it: {meaning}"
    if name in STATUS:
        return STATUS[name].unit, STATUS[name].meaning
    if name in BY_NAME:
        v = BY_NAME[name]
        return v.unit or "1", f"{v.meaning}; {v.sign}" if v.sign else v.meaning
    if name in VESSEL:
        meaning, unit = VESSEL[name]
        return unit, meaning
    return SETTINGS.get(name) or MEANINGS.get(name, ("1", ""))


def kind_of(name: str) -> str:
    """Kind of quantity of a number, "" where it has none."""
    if name in VESSEL:
        return MOVED[VESSEL[name][1]]
    of = BY_NAME.get(name, BY_NAME.get(name.removeprefix("sensed_")))
    return "" if of is None else of.kind


def is_loopback(host: str) -> bool:
    """Whether an address is this machine's own alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_free(host: str, port: int, where: str) -> None:
    """Errors: LiveError where another program listens there already, or the address is not this machine's."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as problem:
            raise LiveError(f"{where}: {host}:{port}: {problem.strerror}. Choose another address or port.") from None


def check_address(host: str, port: int, where: str) -> None:
    """Errors: LiveError for what is not an address to listen on. Port 0 takes a free one."""
    try:
        ipaddress.ip_address("127.0.0.1" if host == "localhost" else host)
    except ValueError:
        raise LiveError(
            f'{where}: host = {quote(host)}: give the address of one of this machine\'s networks, such as "{LOOPBACK}".'
        ) from None
    if not 0 <= port <= 65535:
        raise LiveError(f"{where}: port = {port}: give 1 to 65535, or 0 for a free one.")
