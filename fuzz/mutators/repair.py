"""Changes within a container, whose checksum is made to fit again: the reader sees the changed values."""

from __future__ import annotations

import gzip
import io
import json
import random
import zipfile
from collections.abc import Callable, Sequence

import numpy as np

from fuzz.mutators import odd
from fuzz.mutators.tokens import INTERESTING, LARGEST, by_lines, by_tokens
from fuzz.mutators.values import changed
from stillhook.base.kept.arrays import packed, read_arrays
from stillhook.base.kept.sealed import DIGITS, EXACT, sealed
from stillhook.engine.saved import DIGEST, seal

Mutator = Callable[[random.Random, bytes, Sequence[bytes]], bytes]
FLOATS = (0.0, -0.0, 1.0, -1.0, float("nan"), float("inf"), float("-inf"), 1e308, -1e308, 5e-324, 1e9, 1e-9)


def by_sealed(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One changed value of a sealed file, with its new digest."""
    tree = changed(r, json.loads(data), lambda: json.loads(r.choice(others or [data])))
    if not isinstance(tree, dict):
        return json.dumps(tree).encode("utf-8", "replace")
    tree.pop("digest", None)
    return sealed(tree, r.choice((DIGITS, DIGITS, EXACT))).encode("utf-8", "replace")


def by_state(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """A changed value of the head, or a changed number, of a saved state, with its new checksum."""
    first, head_line, body = data[:-DIGEST].split(b"\n", 2)
    _, kind, version = first.split(b" ")
    head, numbers = json.loads(head_line), np.frombuffer(body[: len(body) // 8 * 8], dtype="<f8").copy()
    pick = r.randrange(4)
    if pick < 2 or not len(numbers):
        head = changed(r, head, lambda: json.loads(r.choice(others or [data]).split(b"\n", 2)[1]))
    elif pick == 2:
        numbers[r.randrange(len(numbers))] = r.choice((*FLOATS, numbers[r.randrange(len(numbers))] * 10.0))
    else:
        numbers = np.resize(numbers, max(0, len(numbers) + r.choice((-1, 1, 5, -len(numbers)))))
    head = head if isinstance(head, dict) else {"head": head}
    if r.random() < 0.1:  # the count is written by `seal`, and a wrong one has to be written here
        return seal(kind.decode(), int(version), head, [numbers])[: -r.randrange(1, 40)]
    return seal(kind.decode(), int(version), head, [numbers])


def by_gzip(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """A changed text, compressed again."""
    inner = gzip.decompress(data)
    made = r.choice((by_tokens, by_lines))(r, inner, ())
    return gzip.compress(made, 1, mtime=0)


LARGEST_UNPACKED = 20_000_000
"""Bytes of an archive that is changed once more: some changes double it."""


def _refuse_large(archive: zipfile.ZipFile) -> None:
    if sum(info.file_size for info in archive.infolist()) > LARGEST_UNPACKED:
        raise ValueError("changed enough")


def by_zip(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """A changed member of an archive, with its new checksum; or one member less, or one twice."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        _refuse_large(archive)
        members = [(info.filename, archive.read(info)) for info in archive.infolist()]
    at = r.randrange(len(members))
    name, inner = members[at]
    pick = r.randrange(10)
    if pick == 0:
        del members[at]
    elif pick == 1:
        members.append((name, inner * 2))
    elif pick == 2:
        members[at] = (name, b"\0" * r.choice((0, 10_000_000)))
    elif pick == 3:
        members[at] = (r.choice(("../../x", "/x", "", "x" * 300)), inner)
    else:
        members[at] = (name, by_tokens(r, inner[:LARGEST], ()))
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, inner in members:
            archive.writestr(zipfile.ZipInfo(name), inner)
    return out.getvalue()


def by_npz(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """Other values, another shape or type of an array, or a header that fits none."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        _refuse_large(archive)
    arrays = read_arrays(data)
    name = r.choice(list(arrays))
    x, pick = arrays[name], r.randrange(6)
    if pick == 0:
        arrays[name] = x.astype(r.choice(("f4", "f8", "i8", "U9", "V3", "?"))) if x.dtype.kind != "V" else x.view("u1")
    elif pick == 1:
        arrays[name] = np.resize(x, r.choice(((0,), (), (1, 1), (len(x) + 1,), (50, 2))))
    elif pick == 2 and x.dtype.kind == "f" and x.size:
        x.flat[r.randrange(x.size)] = r.choice(FLOATS)
    elif pick == 3 and x.dtype.kind == "U" and x.size:
        texts = x.astype(object)
        texts.flat[r.randrange(x.size)] = json.dumps(odd.value(r)) if r.random() < 0.5 else r.choice(odd.ODD)
        arrays[name] = texts.astype(str)
    elif pick == 4:
        other = r.choice(list(arrays))
        arrays[name], arrays[other] = arrays[other], arrays[name]
    else:
        lie = repr((r.choice((0, 1, 2, 10**7, 10**12, 2**63)),)).encode()
        out = io.BytesIO()
        with (
            zipfile.ZipFile(io.BytesIO(packed(arrays))) as before,
            zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as after,
        ):
            for info in before.infolist():
                inner = before.read(info)
                if info.filename[:-4] == name:  # the header keeps its length
                    inner = inner.replace(b"(2,)", lie, 1).replace(b" " * (len(lie) - 4) + b"\n", b"\n", 1)
                after.writestr(info.filename, inner)
        return out.getvalue()
    return packed(arrays)


def by_packet(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """A frame of Modbus whose length fits what it holds."""
    pick = r.randrange(4)
    body = bytearray(data[7:] or b"\x03\0\0\0\1")
    if pick == 0:
        body[0] = r.randrange(256)
    elif pick == 1 and len(body) > 4:
        at = r.choice((1, 3))
        body[at : at + 2] = r.choice(INTERESTING[:-1]).to_bytes(2, "big")
    elif pick == 2:
        body += r.randbytes(r.randrange(1, 300))
    else:
        body = body[: r.randrange(len(body) + 1)]
    return (
        data[:2].ljust(2, b"\0")
        + b"\0\0"
        + min(len(body) + 1, 65535).to_bytes(2, "big")
        + b"\1"
        + bytes(body[:LARGEST])
    )
