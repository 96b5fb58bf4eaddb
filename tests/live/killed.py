"""A process whose children write a history and are killed: `python killed.py FOLDER SEED`, a life for each line on
standard input; it answers with the last row that the child had acknowledged.

A row is a cycle of a session, whose state is saved with the last row of each batch.
"""

from __future__ import annotations

import os
import random
import signal
import struct
import sys
import time
from pathlib import Path

import duckdb  # noqa: F401  # loaded before the children are made: on a busy machine none would live so long
from tests.live.histories import COLUMNS, START, numbers

import stillhook
from stillhook.live.history import Budget, History, archive

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc")
SESSION = stillhook.Session(CRANE, CASE)
SPACING = 61.0
"""Between two rows [s]: an hour is soon full."""
LONGEST_LIFE = 0.6
"""[s]"""


def live(folder: Path, pipe: int) -> None:
    """Restore, then write, save and archive until somebody kills."""
    session = SESSION
    with History(folder, COLUMNS, budget=Budget()) as history:
        row, state = history.last_row, history.last_state("twin")
        if state is not None:
            assert state.row == row
            session.restore(state.data)
        while True:
            n = 1 + row % 7
            session.step(cycles=n)
            times = [START + SPACING * (row + i) for i in range(n)]
            row = history.append(times, numbers(row + 1, n), states={"twin": session.save()})
            os.write(pipe, struct.pack("<q", row))
            if row % 5 == 0:
                archive(folder)


def main(folder: Path, seed: int) -> None:
    SESSION.step()
    SESSION.restore(stillhook.Session(CRANE, CASE).save())
    draw = random.Random(seed)
    for _ in sys.stdin:
        out, into = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(out)
            try:
                live(folder, into)
            finally:
                os._exit(1)
        os.close(into)
        time.sleep(draw.uniform(0.0, LONGEST_LIFE))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        acknowledged = b""
        while piece := os.read(out, 65536):
            acknowledged += piece
        os.close(out)
        whole = acknowledged[: len(acknowledged) // 8 * 8]
        print(struct.unpack("<q", whole[-8:])[0] if whole else 0, os.WTERMSIG(status), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
