"""Damage to a saved state, as a bad disk, a cut file or a host with a wild pointer makes it: for tests alone."""

import random
import struct
from collections.abc import Iterator

IMPOSSIBLE = (float("nan"), float("inf"), -float("inf"), -5e17, 3e200)
"""Values that no number of a state has, whatever it stands for."""


def damaged(data: bytes, count: int, seed: int = 1) -> Iterator[bytes]:
    """States that are not as they were written: bits flipped, cut, extended, blocks swapped, overwritten and moved."""
    chance = random.Random(seed)
    for i in range(count):
        x = bytearray(data)
        at, length = chance.randrange(len(x)), chance.choice((1, 4, 8, 64, 500))
        kind = i % 8
        if kind == 0:
            x[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            del x[at:]
        elif kind == 2:
            x += bytes(chance.randrange(256) for _ in range(length))
        elif kind == 3:
            other = chance.randrange(len(x) - 8)
            a, b = min(at, len(x) - 8), other
            x[a : a + 8], x[b : b + 8] = x[b : b + 8], x[a : a + 8]
        elif kind == 4:
            x[at : at + length] = bytes(len(x[at : at + length]))
        elif kind == 5:
            x[at : at + length] = bytes(chance.randrange(256) for _ in x[at : at + length])
        elif kind == 6:
            del x[at : at + length]
        else:
            at = min(at, len(x) - 8)
            x[at : at + 8] = struct.pack("<d", chance.choice((*IMPOSSIBLE, -1.0, -1e9, 1e9, 2.0**53)))
        if bytes(x) != data:
            yield bytes(x)
