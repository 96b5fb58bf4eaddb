"""States that come from outside: bytes that can be trusted, and the values that their numbers may have.

Layout: a line "stillhook KIND VERSION", a line of JSON, numbers as little-endian doubles, the SHA-256 of all before.

A range holds everything that a winch can reach, however badly it is driven; beyond it a number is not a state of a
winch but a damaged one. What does not change during a run must be what it is in the session or the export itself.
"""

from __future__ import annotations

import csv
import fnmatch
import hashlib
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.gateway.access import read_bytes
from stillhook.base.gateway.budget import STATE
from stillhook.base.gateway.parse import from_json
from stillhook.errors import SimulationError, UnreadableError
from stillhook.units import quote

DIGEST = 32
"""Bytes of a SHA-256."""


def seal(kind: str, version: int, head: Mapping[str, Any], numbers: Sequence[FloatArray]) -> bytes:
    """Head and numbers as bytes."""
    flat = np.concatenate([np.ravel(a) for a in numbers]) if numbers else np.empty(0)
    line = json.dumps({**head, "numbers": len(flat)}).encode()
    body = f"stillhook {kind} {version}\n".encode() + line + b"\n" + flat.astype("<f8").tobytes()
    return body + hashlib.sha256(body).digest()


def unseal(kind: str, version: int, data: bytes, label: str) -> tuple[dict[str, Any], FloatArray]:
    """Head and numbers of what `seal` gave. Errors: SimulationError, one line that begins with label, for what is no
    such state, of another version of the format, not complete or damaged."""
    name = f"stillhook {kind} ".encode()
    first, _, rest = data.partition(b"\n")
    if not first.startswith(name):
        raise SimulationError(f"{label}: not a saved {kind}. Give what save returned or wrote.")
    if first != name + str(version).encode():
        raise SimulationError(
            f"{label}: {printable(first)} is another format than {version}, which this version of Stillhook reads."
            " Save it again with this version."
        )
    if len(data) < DIGEST or hashlib.sha256(data[:-DIGEST]).digest() != data[-DIGEST:]:
        raise SimulationError(
            f"{label}: damaged or not complete: its checksum is not that of its bytes. Save it again."
        )
    line, _, body = rest[:-DIGEST].partition(b"\n")
    try:
        head = from_json(line)
        count = head["numbers"]
    except (UnreadableError, KeyError, TypeError):
        raise SimulationError(
            f"{label}: damaged: its head is not JSON with a count of numbers. Save it again."
        ) from None
    if type(count) is not int or len(body) != 8 * count:
        raise SimulationError(
            f"{label}: damaged: {len(body)} bytes of numbers, not {printable(count)} times 8. Save it again."
        )
    return head, np.frombuffer(body, dtype="<f8").astype(np.float64)


def bytes_of(state: bytes | str | Path) -> tuple[bytes, str]:
    """A state given as bytes or as the path of its file, and what messages call it. Errors: SimulationError where the
    file cannot be read."""
    if isinstance(state, bytes | bytearray | memoryview):
        return bytes(state), "saved state"
    if not isinstance(state, str | os.PathLike):
        raise SimulationError(f"{quote(state)}: give bytes of Session.save, or the path of a file that it wrote.")
    return read_bytes(state, "file that Session.save wrote", SimulationError, STATE), str(state)


def printable(value: object) -> str:
    """A value out of a damaged state, short and on one line."""
    text = value.decode("ascii", "replace") if isinstance(value, bytes) else repr(value)
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= 40 else f"{text[:37]}..."


def numbers_in(what: str, saved: Any, names: Iterable[str], label: str) -> dict[str, float]:
    """Numbers by name in the head of a saved state. Errors: SimulationError."""
    try:
        numbers = {name: float.fromhex(x) for name, x in saved.items()}
        good = all(map(math.isfinite, numbers.values()))
    except (AttributeError, ValueError, TypeError, OverflowError):
        good = False
    if not good or not set(numbers) <= set(names):
        allowed = ", ".join(names)
        raise SimulationError(
            f"{label}: {what} = {printable(saved)}: finite numbers for names of {allowed} are expected. Save it again."
        )
    return numbers


class Kind(IntEnum):
    """What a number is: in a range; the same as in what it is restored into; a setting, in a range of its own; a whole
    number of PLC cycles; the code of a mode."""

    RANGE = 0
    SAME = 1
    SETTING = 2
    COUNT = 3
    CODE = 4


Range = tuple[float, float]
SHARE: Range = (0.0, 1.0)
PAST_THE_END = 100.0
"""Wire beyond the last turn or above the tip with which a winch may still be carried on [m]."""
SETTING: Range = (0.0, 1.0e6)
CYCLES = 2.0**53
"""Cycles that a double counts one by one: 2.8 million years of 10 ms."""
MOTION, TENSION = "motion", "tension"
"""What the tip of a winch is: its motion, or on a host's wire the tension."""


def _by_name(tip: str) -> dict[str, Range]:
    """Range by a pattern of its name, the first that fits [SI]: the rows of `state_ranges.csv`."""
    lines = (files("stillhook.tables") / "state_ranges.csv").read_text(encoding="utf-8").splitlines()
    rows = [row for row in csv.DictReader(lines) if row["of"] in ("", tip)]
    return {row["pattern"]: (float(row["least"]), float(row["most"])) for row in rows}


BY_NAME: Mapping[str, Mapping[str, Range]] = {tip: _by_name(tip) for tip in (MOTION, TENSION)}
PARAMETERS: Mapping[str, tuple[str, Range]] = {
    **{name: (f"gains.{name}", SETTING) for name in ("K_1", "K_2", "K_p")},
    "u_thr": ("motors.u_thr", SHARE),
    **{name: (f"motors.{name}", (0.001, 1.0)) for name in ("alpha_ns", "alpha_hs", "alpha_swl")},
    **{name: (name, (0.0, 60.0)) for name in ("t_lead", "t_lead_ff", "t_bumpless", "tau_F")},
}
"""Settings of the PLC that may change while it runs: place in `Plc`, and range."""
FIXED = (".p.*", ".plc.*", ".control.*", ".laws.*_settings.*")
COUNTED = (".st.common.cycles", ".st.common.*_cycles", ".st.limits.*")


STATES: Mapping[str, str] = {
    ".x.winch.*": "",
    ".x.path.*": "",
    ".u.*": "command.",
    ".m.*": "plc.",
    ".laws.*_memory*.*": "",
}
"""What a winch carries from cycle to cycle by itself, as patterns of names, and what its names in a session begin
with."""


def states(names: Sequence[str], *, without: Sequence[str] = ()) -> dict[str, int]:
    """Name of every state -> its place among the numbers of a lane, whose names `stillhook.kernels.lanes.paths` has.

    The mode that the PLC remembers is not one: it is an input. A name that winch and load path both have is the
    winch's; the other begins with "path.".
    """
    out: dict[str, int] = {}
    for pattern, prefix in STATES.items():
        for i, place in enumerate(names):
            if fnmatch.fnmatchcase(place, pattern) and place != ".m.mode":
                name = place.removeprefix(".laws.") if place.startswith(".laws.") else place.rpartition(".")[2]
                if name not in without:
                    out[f"path.{name}" if name in out and not prefix else f"{prefix}{name}"] = i
    return out


TIMES = (
    *(f".laws.checks.{part}." for part in ("s.freeze", "s.uses", "s.ends", "k.still", "k.over", "k.left")),
    *(f".laws.guard.g.{part}." for part in ("well", "bad")),
)
"""What guard and checks have for every input that is not its value, so that of the mode is not its code."""


class Ranges(NamedTuple):
    """What is allowed of numbers, one of each for a number: its name, `Kind`, least and most."""

    names: tuple[str, ...]
    kinds: FloatArray
    least: FloatArray
    most: FloatArray

    def at(self, part: slice) -> Ranges:
        """Of some of them."""
        return Ranges(self.names[part], self.kinds[part], self.least[part], self.most[part])


def ranges(names: Sequence[str], *, wire: float, tension: bool, settings: Mapping[int, Range]) -> Ranges:
    """Of the numbers of a lane.

    Parameters: names as `stillhook.kernels.lanes.paths` has them; wire on the full drum [m]; tension: it is given by a
    host in place of the tip's motion; settings: place and range of those that may change.
    """
    table = {".x.path.s_w": (-PAST_THE_END, wire + PAST_THE_END), **BY_NAME[TENSION if tension else MOTION]}
    kinds, ends = np.zeros(len(names)), np.empty((len(names), 2))
    for i, name in enumerate(names):
        ends[i] = next(each for pattern, each in table.items() if fnmatch.fnmatchcase(name, pattern))
        if i in settings:
            kinds[i], ends[i] = Kind.SETTING, settings[i]
        elif any(fnmatch.fnmatchcase(name, pattern) for pattern in FIXED):
            kinds[i] = Kind.SAME
        elif any(fnmatch.fnmatchcase(name, pattern) for pattern in COUNTED):
            kinds[i], ends[i] = Kind.COUNT, (0.0, CYCLES)
        elif name == ".laws.code" or (name.endswith(".mode") and not name.startswith(TIMES)):
            kinds[i] = Kind.CODE
    return Ranges(tuple(names), kinds, ends[:, 0], ends[:, 1])


def wrong(values: FloatArray, own: FloatArray, blank: FloatArray, r: Ranges, k: int, codes: Sequence[float]) -> str:
    """What is wrong with numbers from outside, in a few words about the first; "" where nothing is.

    Parameters: own: those of what they are restored into; blank: those of a run that begins, which are always allowed
    (extremes of nothing yet are not numbers of a winch); k: PLC cycles since the start; codes of the modes.
    """
    kinds = r.kinds
    ranged: BoolArray = (values >= r.least) & (values <= r.most)
    counted: BoolArray = (values >= 0.0) & (values <= k) & (values == np.floor(values))
    good = np.select(
        [kinds == Kind.SAME, kinds == Kind.COUNT, kinds == Kind.CODE],
        [_bits(values) == _bits(own), counted, np.isin(values, codes)],
        ranged,
    )
    good |= (kinds != Kind.SAME) & (_bits(values) == _bits(blank))
    if good.all():
        return ""
    i = int(np.argmax(~good))
    allowed = {
        Kind.SAME: f"that of this winch, {own[i]:.9g}",
        Kind.COUNT: f"a whole number from 0 to {k}",
        Kind.CODE: f"the code of a mode, {', '.join(f'{code:g}' for code in sorted(codes))}",
    }.get(Kind(int(r.kinds[i])), f"{r.least[i]:.9g} to {r.most[i]:.9g}")
    return f"{r.names[i].removeprefix('.')} = {values[i]:.9g}, allowed is {allowed}"


def _bits(values: FloatArray) -> FloatArray:
    """Numbers as they are stored, so that NaN, 0 and -0 are what they are."""
    return np.ascontiguousarray(values).view(np.int64)
