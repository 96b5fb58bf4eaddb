"""Campaigns of tests as their files describe them: the part of a log that a test takes, and where the hook is: `depth`
below the water line and `h_tip` of the crane tip above it, from which the wire's weight follows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.base.gateway.access import first_bytes
from stillhook.engine.pack.lift import wire_carried
from stillhook.errors import StillhookError
from stillhook.formats.table.dialect import head_text
from stillhook.library.toml.file import TomlTable
from stillhook.spec.crane import Crane
from stillhook.tables.table import Name, Spec, Text
from stillhook.units import quote, show

MARK = "SYNTHETIC"
"""Of a campaign, in its title, and of a log, in a remark at its head: simulated, measured on no crane."""
REMARKS = ("#", "//", "%")
HEAD = 1 << 14
"""Bytes of a log in which its remarks are looked for."""


class LoggedTest(Spec):
    """A table [[test]] of a campaign file."""

    name: Name | None = Field(default=None, description="its name; default its number")
    log: Text = Field(description="path of its log, seen from this file")
    s_w: u.Length | None = Field(default=None, ge=0, description="wire out at the start")
    depth: u.Length | None = Field(
        default=None, ge=0, description="of the hook below the water line at the start; of a hook in air give h_tip"
    )
    h_tip: u.Length | None = Field(default=None, ge=0, description="height of the crane tip above the water line")
    signals: Mapping[str, Any] | None = Field(default=None, description="columns of its log")
    start: u.Time = Field(default=-math.inf, description="begin of the part of the log that counts")
    end: u.Time = Field(default=math.inf, description="end of the part of the log that counts")

    @field_validator("end")
    @classmethod
    def _after_start(cls, end: float, info: ValidationInfo) -> float:
        start = info.data.get("start", -math.inf)
        if not start < end:
            raise ValueError(f"must come after start {start:g} s.")
        return end


class PartOfLog(Protocol):
    """A test that takes a part of a log."""

    @property
    def name(self) -> str: ...
    @property
    def log(self) -> Path: ...
    @property
    def start(self) -> float: ...
    @property
    def end(self) -> float: ...


def marked_logs(tests: Sequence[PartOfLog]) -> list[str]:
    """Names of logs in text that say at their head that they were simulated: by `MARK` in a remark. A log that cannot
    be read says nothing here, and is refused where it is read."""
    names = []
    for log in dict.fromkeys(test.log for test in tests):
        with suppress(StillhookError):
            _, head = first_bytes(log, HEAD, "log file", StillhookError)
            lines = head_text(head)[1].split("\n")
            marked = any(MARK in line for line in lines if line.lstrip(' \t"').startswith(REMARKS))
            names += [log.name] if marked else []
    return names


@dataclass(frozen=True)
class HookDepth:
    """depth: of the hook below the water line at the start of the test [m]; h_tip: height of the crane tip above the
    water line [m]; None where the file does not state it. place, error: for messages."""

    depth: float | None
    h_tip: float | None
    place: str
    error: type[StillhookError]

    def wire_out(self) -> float:
        """Wire from tip to hook where nothing else states it [m]. Errors: one of the campaign file where depth or h_tip
        is missing."""
        if self.depth is None or self.h_tip is None:
            other = "h_tip" if self.h_tip is None else "depth"
            has = "depth" if self.h_tip is None else "h_tip"
            raise self.error(
                f"{self.place}{has}: alone it does not determine the wire out. Give {other} too, or s_w, or map"
                " the signal"
                " s_w."
            )
        return self.depth + self.h_tip

    def tip_height(self, s_w: float) -> float:
        """Height of the crane tip above the water line [m]; s_w: wire from tip to hook at the start of the test [m].

        Errors: one of the campaign file where depth, h_tip and s_w are one too many, or the hook is deeper than the
        wire is long.
        """
        if self.depth is None:
            assert self.h_tip is not None
            return self.h_tip
        out = show(s_w, "length")
        if self.h_tip is not None:
            raise self.error(
                f"{self.place}depth and h_tip: both given where the wire out ({out}) is known as well. Leave one of"
                " them out."
            )
        if self.depth > s_w:
            raise self.error(
                f"{self.place}depth {show(self.depth, 'length')}: more than the wire out, {out}. Check depth and s_w."
            )
        return s_w - self.depth


def hook_depth(row: LoggedTest, table: TomlTable) -> HookDepth | None:
    """The fields depth and h_tip of a test; None where it has neither."""
    if row.depth is None and row.h_tip is None:
        return None
    return HookDepth(row.depth, row.h_tip, f"{table.place()}: ", table.error)


def check_names(tests: Sequence[PartOfLog], error: type[StillhookError]) -> None:
    """Refuse tests of one name, whose results could not be distinguished."""
    names = [test.name for test in tests]
    twice = next((n for n in names if names.count(n) > 1), None)
    if twice is not None:
        raise error(f"test: the name {quote(twice)} is given twice. Give every test its own.")


def check_parts(tests: Sequence[PartOfLog], error: type[StillhookError]) -> None:
    """Refuse two tests that take the same part of the same log: it would count twice."""
    for i, a in enumerate(tests):
        for b in tests[:i]:
            if a.log.resolve() == b.log.resolve() and a.start < b.end and b.start < a.end:
                raise error(
                    f'test "{a.name}": log = {quote(a.log.name)} is that of test "{b.name}" as well, and would count'
                    " twice. Name another log, or give each its own start and end."
                )


def wire_text(crane: Crane, s_w: float, h_tip: float) -> str:
    """The wire's part of a load, in words."""
    out = max(s_w, 0.0)
    wet = max(out - h_tip, 0.0)
    mass = show(wire_carried(crane, s_w, h_tip), "mass", 3)
    return (
        f"{mass} of wire ({show(out - wet, 'length', 4)} in air, {show(wet, 'length', 4)} in water less its buoyancy)"
    )
