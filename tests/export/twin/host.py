"""A host of the C core in Python, by ctypes: for tests alone."""

import ctypes
import functools
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

from stillhook.export.twin import Export

SHIM = Path(__file__).with_name("shim.c")
OK, DIVERGED, WRONG_STEP, NO_NUMBER, OUT_OF_RANGE, NOT_NOW, NO_STATE = range(7)


HEAD = 80
"""Bytes of a state before its numbers: kind, identity, count of the numbers."""


def remade(data: bytes, changes: dict[int, float]) -> bytes:
    """A state with other numbers at these places, and a right checksum, by zlib."""
    body = bytearray(data[:-4])
    for at, x in changes.items():
        struct.pack_into("<d", body, HEAD + 8 * at, x)
    return bytes(body) + struct.pack("<I", zlib.crc32(bytes(body)))


def library(export: Export, compiled: Callable[..., Path], *flags: str) -> ctypes.CDLL:
    """The compiled core of an export."""
    lib = ctypes.CDLL(str(compiled(f"{export.source}\n{SHIM.read_text(encoding='utf-8')}", flags)))
    pointer, number, text = ctypes.c_void_p, ctypes.c_double, ctypes.c_char_p
    for name, result, arguments in (
        ("new", pointer, []),
        ("free", None, [pointer]),
        ("size", ctypes.c_int64, []),
        ("identity", text, []),
        ("find", ctypes.c_int, [text]),
        ("set", ctypes.c_int, [pointer, ctypes.c_int, number]),
        ("get", number, [pointer, ctypes.c_int]),
        ("text", text, [pointer, ctypes.c_int]),
        ("start", ctypes.c_int, [pointer, number]),
        ("step", ctypes.c_int, [pointer, number, number]),
        ("time", number, [pointer]),
        ("state_size", ctypes.c_int64, []),
        ("save", None, [pointer, text]),
        ("restore", ctypes.c_int, [pointer, text, ctypes.c_int64, text]),
        ("put", None, [pointer, ctypes.c_int64, number]),
        ("at", ctypes.c_int64, [ctypes.c_int]),
        ("name", text, [ctypes.c_int]),
    ):
        function = getattr(lib, f"twin_{name}")
        function.restype, function.argtypes = result, arguments
    return lib


class Host:
    """One instance of an export; flags: "-O2" for long runs."""

    def __init__(self, export: Export, compiled: Callable[..., Path], *flags: str) -> None:
        self.export, self.lib = export, library(export, compiled, *flags)
        self.at = self.lib.twin_new()

    def __del__(self) -> None:
        if hasattr(self, "at"):
            self.lib.twin_free(self.at)

    @functools.cache  # noqa: B019
    def number(self, name: str) -> int:
        found = self.lib.twin_find(name.encode())
        assert found == self.export.number(name)
        return int(found)

    def try_set(self, name: str, value: float) -> int:
        return int(self.lib.twin_set(self.at, self.number(name), value))

    def set(self, **values: float) -> None:
        for name, value in values.items():
            assert self.try_set(name, value) == OK, name

    def get(self, name: str) -> float:
        return float(self.lib.twin_get(self.at, self.number(name)))

    def text(self, name: str) -> str:
        return str(self.lib.twin_text(self.at, self.number(name)).decode())

    def start(self, time: float = 0.0) -> int:
        return int(self.lib.twin_start(self.at, time))

    def step(self, time: float, h: float) -> int:
        return int(self.lib.twin_step(self.at, time, h))

    def time(self) -> float:
        return float(self.lib.twin_time(self.at))

    def save(self) -> bytes:
        room = ctypes.create_string_buffer(self.lib.twin_state_size())
        self.lib.twin_save(self.at, room)
        return room.raw

    def try_restore(self, state: bytes) -> tuple[int, str]:
        """The answer, and what was wrong."""
        why = ctypes.create_string_buffer(300)
        answer = self.lib.twin_restore(self.at, state, len(state), why)
        return int(answer), why.value.decode()

    def restore(self, state: bytes) -> None:
        answer, why = self.try_restore(state)
        assert answer == OK, why
