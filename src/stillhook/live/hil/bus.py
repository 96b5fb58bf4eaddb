"""What is between a soft PLC and its plant: the process image that it reads, and the commands that it writes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiveError
from stillhook.live.runtime.board import IMAGE
from stillhook.live.servers.library_log import LibraryLog

COMMANDS = ("u_p", "u_m", "brake")
"""Outputs of the controller that go to the winch."""
OVERRIDE = "override"
"""1 while the winch takes them."""
PLACE: Mapping[str, int] = {name: i for i, name in enumerate(IMAGE)}
FIRST_SENSED = len(IMAGE) - sum(name.startswith("sensed_") for name in IMAGE)


class BusError(LiveError):
    """An answer that did not come: the connection may be made again."""


class Image(NamedTuple):
    """Numbers of `IMAGE` of one cycle of the plant, NaN for what there is none of; good: whether the plant says that
    they are of now."""

    values: FloatArray
    good: bool

    def get(self, name: str) -> float:
        """One of them."""
        return float(self.values[PLACE[name]])

    @property
    def sensed(self) -> FloatArray:
        """What the controller reads, fields of `Sensed`."""
        return self.values[FIRST_SENSED:]


NOTHING = Image(np.full(len(IMAGE), math.nan), False)


def quiet(logger: str) -> LibraryLog:
    """A context in which a protocol's library writes nothing: what it says is in the errors of the bus."""
    return LibraryLog((logger,), logger, (), lambda text: None)


class Bus(Protocol):
    """A connection to the plant. Every call may raise BusError where the plant does not answer, and LiveError, one
    line, where it refuses."""

    @property
    def label(self) -> str:
        """What it is, for people."""

    async def connect(self) -> None:
        """Make the connection, again where there was one."""

    async def read(self) -> Image:
        """The newest cycle of the plant."""

    async def write(self, values: Mapping[str, float]) -> None:
        """Write inputs of the plant together [SI]."""

    async def close(self) -> None:
        """Release it; raises nothing."""

    def resolution(self, name: str) -> float:
        """Step to which a command is rounded on the way [SI]; 0: none."""
