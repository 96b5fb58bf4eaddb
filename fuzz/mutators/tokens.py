"""Changes of bytes, tokens and lines."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence

from fuzz.mutators import odd

LARGEST = 200_000
"""Bytes of an input at most."""
_NUMBER = re.compile(rb"[-+]?(?:\d+[\d.,_]*|\.\d+)(?:[eE][-+]?\d+)?")
_TOKEN = re.compile(rb"[A-Za-z_][\w.^/-]*|\d[\d.]*|[^\w\s]|\s+")
NESTS = (b"[", b"{", b"(", b'{"a":', b"a.", b"[[", b"{a=", b"- ", b"&a [*a,", b"<a>", b"not ", b"+")
INTERESTING = (0, 1, 2, 7, 8, 16, 32, 64, 100, 127, 128, 255, 256, 1000, 4096, 32767, 32768, 65535, 65536)


def encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogateescape")


def by_bytes(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One change that knows nothing of the form."""
    made, n = bytearray(data), len(data)
    at, pick = r.randrange(n + 1), r.randrange(9)
    length = min(r.choice((1, 1, 2, 4, 8, 30, 200)), n - at)
    if pick == 0 and n:
        made[at % n] ^= 1 << r.randrange(8)
    elif pick == 1:
        del made[at : at + length]
    elif pick == 2:
        del made[at:]
    elif pick == 3:
        made[at:at] = r.choice(odd.BYTES)
    elif pick == 4:
        made[at:at] = made[at : at + length] * r.choice((1, 2, 20, 300))
    elif pick == 5:
        size = r.choice((1, 2, 4, 8))
        number = r.choice((*INTERESTING, -1, 2**31 - 1, 2**63 - 1)) & (256**size - 1)
        made[at : at + size] = number.to_bytes(size, r.choice(("little", "big")))
    elif pick == 6:
        made[at : at + length] = r.randbytes(r.randrange(1, 20))
    else:
        other = r.choice(others) if others else data
        begin = r.randrange(len(other) + 1)
        made[at : at + (length if pick == 7 else n)] = other[begin : begin + r.choice((4, 20, 100, 2000))]
    return bytes(made[:LARGEST])


def by_tokens(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One change of a word, a number or a unit of a text."""
    pick = r.randrange(10)
    if pick < 3 and (spans := [m.span() for m in _NUMBER.finditer(data)]):
        begin, end = r.choice(spans)
        return data[:begin] + encoded(odd.number(r)) + data[end:]
    spans = [m.span() for m in _TOKEN.finditer(data)]
    if not spans:
        return encoded(r.choice(odd.ODD))
    if pick == 3 and r.random() < 0.1:
        at = r.choice(spans)[0]
        return data[:at] + r.choice(NESTS) * r.choice((5, 100, 3000)) + data[at:]
    begin, end = r.choice(spans)
    token = data[begin:end]
    if pick < 4:
        new = encoded(r.choice(odd.units()))
    elif pick < 5:
        new = encoded(r.choice(odd.ODD))
    elif pick < 6:
        new = b""
    elif pick < 7:
        new = token * r.choice((2, 2, 3, 50))
    elif pick < 8:
        new = encoded(odd.quantity(r))
    elif pick < 9:
        first, last = r.choice(spans)
        new = data[first:last]
    else:
        other = r.choice(others) if others else data
        pieces = _TOKEN.findall(other)
        begin_of = r.randrange(len(pieces)) if pieces else 0
        new = token + b"".join(pieces[begin_of : begin_of + r.choice((1, 2, 5, 12))])
    return (data[:begin] + new + data[end:])[:LARGEST]


def by_lines(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One change of whole lines, or of a column of a table."""
    lines = data.split(b"\n")
    at, pick = r.randrange(len(lines)), r.randrange(10)
    if pick == 0:
        del lines[at]
    elif pick == 1:
        lines[at:at] = [lines[at]] * r.choice((1, 1, 2, 40))
    elif pick == 2:
        other = r.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    elif pick == 3:
        lines[at:at] = r.choice(others or [data]).split(b"\n")[: r.choice((1, 3, 10))]
    elif pick == 4:
        del lines[at : at + r.choice((2, 10, len(lines)))]
    elif pick == 5:
        return data.replace(b"\n", r.choice((b"\r\n", b"\r", b"", b"\n\n")))
    elif pick == 6:
        old, new = r.sample((b",", b";", b"\t", b" ", b"|", b"."), 2)
        return data.replace(old, new)
    elif pick == 7:
        lines[at] = r.choice((b" ", b"#", b"-", b'"', b"[", b"")) + lines[at]
    elif pick == 8:
        cells = lines[at].split(b",")
        if r.random() < 0.5:
            cells.insert(r.randrange(len(cells) + 1), encoded(r.choice((odd.number(r), r.choice(odd.ODD)))))
        else:
            del cells[r.randrange(len(cells))]
        lines[at] = b",".join(cells)
    else:
        coding = r.choice(("utf-16", "utf-16-be", "utf-8-sig", "utf-32", "latin-1", "cp1252"))
        return data.decode("latin-1").encode(coding, "replace")[:LARGEST]
    return b"\n".join(lines)[:LARGEST]
