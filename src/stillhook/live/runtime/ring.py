"""Rows of numbers in shared memory: one process writes, others read, and none waits.

A slot has a sequence number, odd while it is written, and a check word over its numbers. A reader that meets a slot in
between, or one that was written over, gets nothing instead of half a row. The check word also holds on processors that
show stores to others out of order.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np

from stillhook.base.arrays import FloatArray

HEAD, SLOT = 8, 2
"""Cells before the first slot, of which the first counts rows; cells of a slot before its numbers."""
CELL = 8
"""Bytes of a cell."""
TRIES = 8
"""How often a reader looks for the newest row before it gives up."""


class Ring:
    """The newest rows, each of `width` numbers. Rows are counted from 0 and never renumbered.

    Parameters: memory of `Ring.size(slots, width)` bytes, all zero for an empty ring; slots: rows that are kept;
    width: numbers in a row.
    """

    def __init__(self, memory: memoryview, slots: int, width: int) -> None:
        ints = np.frombuffer(memory, dtype=np.int64, count=self.size(slots, width) // CELL)
        self._count = ints[:1]
        self._ints = ints[HEAD:].reshape(slots, SLOT + width)
        self._floats: FloatArray = self._ints.view(np.float64)
        self.slots, self.width = slots, width

    @staticmethod
    def size(slots: int, width: int) -> int:
        """Bytes of a ring."""
        return CELL * (HEAD + slots * (SLOT + width))

    def close(self) -> None:
        """Release the memory."""
        del self._count, self._ints, self._floats

    @property
    def count(self) -> int:
        """Rows that were published since the ring was empty."""
        return int(self._count[0])

    def publish(self, row: FloatArray | Sequence[float]) -> None:
        """Add a row. By one writer alone."""
        n = self.count
        slot = n % self.slots
        cells = self._ints[slot]
        cells[0] = 2 * n + 1
        self._floats[slot, SLOT:] = row
        cells[1] = _check(cells[SLOT:], n)
        cells[0] = 2 * n + 2
        self._count[0] = n + 1

    def at(self, n: int) -> FloatArray | None:
        """Row n as a copy; None where it is not complete, or was written over by a later one."""
        slot = n % self.slots
        cells, done = self._ints[slot], 2 * n + 2
        if n < 0 or cells[0] != done:
            return None
        copy = cells.copy()
        if copy[0] != done or cells[0] != done or copy[1] != _check(copy[SLOT:], n):
            return None
        row: FloatArray = copy[SLOT:].view(np.float64)
        return row

    def latest(self) -> tuple[int, FloatArray] | None:
        """Number and copy of the newest complete row; None while there is none.

        A reader that delays the writer's processor must not wait for it: after `TRIES` it goes without.
        """
        for _ in range(TRIES):
            n = self.count - 1
            if n < 0:
                return None
            if (row := self.at(n)) is not None:
                return n, row
        return None

    def since(self, n: int) -> tuple[int, list[FloatArray], int]:
        """Rows from number n: the number of the first, the rows, and how many of them are lost because they were
        written over."""
        end = self.count
        first = max(n, end - self.slots)
        rows = [self.at(i) for i in range(first, end)]
        gone = next((i for i, row in enumerate(rows) if row is not None), len(rows))
        kept: list[FloatArray] = []
        for row in rows[gone:]:
            if row is None:
                break
            kept.append(row)
        return first + gone, kept, max(0, first + gone - n)


class Records(Ring):
    """Byte strings of at most `size` bytes in the same way."""

    def __init__(self, memory: memoryview, slots: int, size: int) -> None:
        super().__init__(memory, slots, self.cells(size))
        self.most = size

    @staticmethod
    def cells(size: int) -> int:
        """Numbers that a byte string of this size takes, its length included."""
        return 1 + -(-size // CELL)

    @staticmethod
    def bytes_of(slots: int, size: int) -> int:
        """Bytes of a ring of records."""
        return Ring.size(slots, Records.cells(size))

    def add(self, data: bytes) -> None:
        """Add a byte string. Errors: ValueError where it is too long."""
        if len(data) > self.most:
            raise ValueError(f"{len(data)} bytes do not go into a record of {self.most}.")
        row = np.zeros(self.width, dtype=np.int64)
        row[0] = len(data)
        row[1:].view(np.uint8)[: len(data)] = np.frombuffer(data, dtype=np.uint8)
        self.publish(row.view(np.float64))

    def records(self, n: int) -> tuple[int, list[bytes], int]:
        """Byte strings from number n: the number of the first, they themselves, and how many are lost."""
        first, rows, lost = self.since(n)
        return first, [self._bytes(row) for row in rows], lost

    def newest(self) -> tuple[int, bytes] | None:
        """Number and content of the newest record; None while there is none."""
        newest = self.latest()
        return None if newest is None else (newest[0], self._bytes(newest[1]))

    @staticmethod
    def _bytes(row: FloatArray) -> bytes:
        cells = row.view(np.int64)
        return cells[1:].tobytes()[: int(cells[0])]


def _check(cells: np.ndarray[tuple[int], np.dtype[np.int64]], n: int) -> int:
    """Check word of the numbers of row n."""
    return zlib.crc32(cells.tobytes(), n & 0xFFFFFFFF)
