"""Rows in shared memory: a reader gets a whole row or none, whatever the writer does meanwhile."""

from __future__ import annotations

import multiprocessing
from multiprocessing.shared_memory import SharedMemory

import numpy as np
import pytest

from stillhook.live.runtime.ring import HEAD, SLOT, Records, Ring

SLOTS, WIDTH = 4, 200


def ring(slots: int = SLOTS, width: int = WIDTH) -> Ring:
    return Ring(memoryview(bytearray(Ring.size(slots, width))), slots, width)


def test_the_newest_row_is_the_last_one_that_was_published():
    of = ring()
    assert of.latest() is None
    for n in range(11):
        of.publish(np.full(WIDTH, float(n)))
    number, row = of.latest()
    assert (number, set(row)) == (10, {10.0})


def test_a_row_that_is_being_written_is_not_read():
    of = ring()
    of.publish(np.ones(WIDTH))
    of._ints[1, 0] = 3  # as the writer leaves it at the begin of row 1
    assert of.at(1) is None
    assert of.latest()[0] == 0


def test_half_a_row_with_the_sequence_of_a_whole_one_is_not_read():
    """What a processor may show that reorders stores: the check word is over the numbers."""
    of = ring()
    of.publish(np.ones(WIDTH))
    of._floats[0, SLOT + WIDTH // 2 :] = 2.0
    assert of.at(0) is None


def test_numbers_come_out_with_their_bits():
    of = ring(width=5)
    row = np.array([np.nan, -0.0, np.inf, 5e-324, 1.0])
    of.publish(row)
    assert of.at(0).tobytes() == row.tobytes()


def test_rows_that_were_written_over_are_counted_as_lost():
    of = ring()
    for n in range(10):
        of.publish(np.full(WIDTH, float(n)))
    first, rows, lost = of.since(2)
    assert (first, [row[0] for row in rows], lost) == (6, [6.0, 7.0, 8.0, 9.0], 4)
    assert of.since(10) == (10, [], 0)


def test_records_are_bytes_of_any_length_up_to_the_most():
    size = 21
    of = Records(memoryview(bytearray(Records.bytes_of(3, size))), 3, size)
    texts = [b"", b"\x00\xff", b"x" * size]
    for text in texts:
        of.add(text)
    assert of.records(0) == (0, texts, 0)
    with pytest.raises(ValueError, match="do not go into a record"):
        of.add(b"x" * (size + 1))


def write_rows(name: str, rows: int) -> None:
    memory = SharedMemory(name)
    of = Ring(memory.buf, SLOTS, WIDTH)
    for n in range(rows):
        of.publish(np.full(WIDTH, float(n)))
    of.close()
    memory.close()


def test_a_row_is_never_torn_while_another_process_writes():
    rows = 30_000
    memory = SharedMemory(create=True, size=Ring.size(SLOTS, WIDTH))
    memory.buf[:] = bytes(len(memory.buf))
    of = Ring(memory.buf, SLOTS, WIDTH)
    process = multiprocessing.get_context("fork").Process(target=write_rows, args=(memory.name, rows))
    process.start()
    seen = set()
    while process.is_alive() or not seen:
        newest = of.latest()
        if newest is not None:
            number, row = newest
            assert (row == number).all()
            seen.add(number)
    process.join()
    assert of.latest()[0] == rows - 1
    assert len(seen) > 10
    of.close()
    memory.close()
    memory.unlink()


def test_an_empty_ring_has_a_head_of_its_own():
    of = ring(slots=1, width=1)
    of.publish([7.0])
    assert of.count == 1
    assert HEAD * 8 == Ring.size(0, 1)
