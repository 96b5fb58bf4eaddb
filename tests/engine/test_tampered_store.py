"""Stored cases that another program wrote, with a checksum that fits: their cases are computed again, in the memory that
the file's size explains."""

import io
import json
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from stillhook.base.gateway import budget
from stillhook.base.kept.arrays import packed, read_arrays
from stillhook.base.kept.checked import write_checked
from stillhook.engine.store import KEY, SUFFIX, Store

NAMES = ("F_w", "s_w")
ONE = bytes([1]) * KEY
HONEST = {
    "keys": np.frombuffer(ONE, f"V{KEY}"),
    "status": np.array(["ok"]),
    "numbers": np.array([[2.0, 3.0]]),
    "notes": np.array([json.dumps(["a note"])]),
}
MOST = 1e6
"""Memory for a file of at most 100 kB that is refused by its headers [bytes]."""


def npz(method: int = zipfile.ZIP_DEFLATED, **members: bytes) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", method, compresslevel=1) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return content.getvalue()


def array(shape: str, dtype: str, data: bytes = b"") -> bytes:
    head = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + data


def found(folder: Path, content: bytes) -> object:
    folder.mkdir(exist_ok=True)
    write_checked(folder / f"{'0' * KEY}{SUFFIX}", content)
    return Store(folder).find([ONE], lambda place: NAMES)


def test_an_honest_file_gives_its_case(tmp_path):
    assert dict(found(tmp_path, packed(HONEST))[0]) == {"status": "ok", "F_w": 2.0, "s_w": 3.0, "notes": ["a note"]}


LIES = [
    npz(keys=array("(1,)", "<U200000000")),
    npz(keys=array("(1000000000000,)", "|V0")),
    npz(keys=array("(1,)", "<f8", bytes(9))),
    npz(keys=array("(100000000,)", "|V32", bytes(1000))),
    npz(keys=array("(1000000000000,)", "<f8", bytes(1000))),
    npz(zipfile.ZIP_BZIP2, keys=array("(1000000,)", "<f8", bytes(8_000_000))),
]


@pytest.mark.parametrize(
    "content",
    [
        *LIES,
        *(packed({**HONEST, name: value}) for name, value in (
            ("keys", np.zeros((1, 1), f"V{KEY}")),
            ("numbers", np.zeros(1)),
            ("numbers", np.zeros((1, 3))),
            ("numbers", np.zeros((1, 2), "f4")),
            ("notes", np.array(["{"])),
            ("notes", np.array(["[" * 100_000])),
            ("notes", np.array(["[1]"])),
            ("status", np.array(["ok", "ok"])),
            ("status", np.array([2**32 - 1], "<u4").view("<U1")),
            ("status", np.array([0x110000], ">u4").view(">U1")),
            ("notes", np.array([0xD800], "<u4").view("<U1")),
        )),
        b"",
    ],
)  # fmt: skip
def test_what_a_store_did_not_write_has_no_case(tmp_path, content):
    assert found(tmp_path, content) == {}


@pytest.mark.parametrize("content", LIES)
def test_what_a_file_claims_takes_no_memory(content):
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=r"claims|packed|fit"):
            read_arrays(content)
        assert tracemalloc.get_traced_memory()[1] < MOST
    finally:
        tracemalloc.stop()


def test_an_archive_that_unpacks_to_more_than_its_size_explains_is_refused(monkeypatch):
    content = packed({"keys": np.zeros(10_000)})
    assert read_arrays(content)["keys"].size == 10_000
    monkeypatch.setattr(budget, "SMALL", 10_000)
    monkeypatch.setattr(budget, "DENSEST", 10)
    with pytest.raises(ValueError, match="claims to hold more"):
        read_arrays(content)
