"""Kill any process of a running twin at any moment: `python -m trials.endurance.kills FOLDER KILLS [SEED]`.

The whole of `stillhook live run` runs: kernel, servers, history, archiver. A client reads what the journal and the file
of the state acknowledge, and makes writes that are refused. After each kill every row of the history is held against a
session of this process, bit by bit, and so is the state from which the twin goes on.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

import stillhook
from stillhook.engine.saved import unseal
from stillhook.errors import LiveError
from stillhook.library.examples import LIVE, example_files
from stillhook.live.history import History, HistorySink, check, overview, read, read_events
from stillhook.live.live_file import read_live_file
from stillhook.live.runtime.state import LiveState, newest_state

VICTIMS = ("kernel", "servers", "archiver", "all")
LONGEST_LIFE = 8.0
"""Time to a kill, from the first row that is acknowledged or from the kill before, at most [s]."""
EARLY = 0.3
"""Share of kills that may come before a twin is ready."""
ATTEMPT = 1.2
"""Time between two refused writes [s]: those within a second are one event."""
LEAST_ROWS = 100
"""Rows of the last life."""
PATIENCE = 60.0
OLD = 3600.0 * 400_000.0
"""Begin of hours that an archiver has to move [s since 1970]."""
POLITE = 10
"""What an archiver gives up of its priority."""


class Reference:
    """The winch of the twin, in this process: its numbers at each cycle, and its state."""

    def __init__(self, live_file: Path) -> None:
        case = read_live_file(live_file).case
        self.session = stillhook.Session(case.crane, case.case, step=case.step)
        self.names = (*self.session.signals, *(n for n in self.session.parameters if n not in self.session.signals))
        self.rows: list[list[float]] = []
        self.states: dict[int, bytes] = {}

    def until(self, k: int, keep: int | None = None) -> None:
        """Step to cycle k; keep: a cycle whose state is wanted."""
        while len(self.rows) <= k:
            if self.rows:
                self.session.step()
            self.rows.append([self.session.get(name) for name in self.names])
            self.states[len(self.rows) - 1] = self.session.save()
            self.states.pop(len(self.rows) - 1 - 1000, None)


class Crew:
    """The processes of a twin, and what they have acknowledged."""

    def __init__(self, folder: Path, seed: int) -> None:
        example_files(LIVE, folder)
        self.live_file, self.of = folder / "live.toml", folder / "twin"
        text = self.live_file.read_text(encoding="utf-8").split("[opcua]")
        modbus = text[1].split("[modbus]")[1].split("[udp]")[0].replace("port = 5020", "port = 0")
        self.live_file.write_text(f'{text[0]}[modbus]{modbus}[history]\nevery = "0 s"\nsize = 1\n', encoding="utf-8")
        case = folder / "case.toml"
        case.write_text(case.read_text(encoding="utf-8").replace('"still"', '"sine 1 m 9 s"'), encoding="utf-8")
        self.draw, self.reference = random.Random(seed), Reference(self.live_file)
        self.history = self.of / "history"
        self.servers: subprocess.Popen[str] | None = None
        self.port = self.attempts = self.old = 0
        self.attempted = -np.inf
        self.row = self.state = self.number = 0
        self.events: dict[int, str] = {}
        self.killed: Counter[str] = Counter()

    def start(self, old_hours: int) -> None:
        """Start all of it; old_hours: full hours in the journal that the archiver finds."""
        if old_hours:
            with History(self.history, ["F_w"]) as history:
                for _ in range(old_hours):
                    self.old += 1
                    history.append(OLD + 3600.0 * self.old + np.arange(3.0), np.full((3, 1), float(self.old)))
        words = [sys.executable, "-m", "stillhook", "live", "run", str(self.live_file)]
        self.servers = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.port = 0

    def processes(self) -> dict[str, int]:
        """Those of the twin that run, by what they are."""
        assert self.servers is not None
        found = {} if self.servers.poll() is not None else {"servers": self.servers.pid}
        for path in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError, ValueError):
                parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
                if parent == self.servers.pid and b"spawn_main" in (path / "cmdline").read_bytes():
                    polite = os.getpriority(os.PRIO_PROCESS, int(path.name)) >= POLITE
                    found["archiver" if polite else "kernel"] = int(path.name)
        return found

    def live_until(self, row: int, state: int) -> None:
        """Note what is acknowledged until that row and that state are, however slow the machine."""
        limit = time.monotonic() + PATIENCE
        while (self.row < row or self.number < state) and not self.over:
            assert time.monotonic() < limit, f"row {row} and state {state} are not acknowledged within {PATIENCE:g} s"
            self.note()
            self.attempt()
            time.sleep(0.02)

    def live(self, seconds: float, victim: str) -> None:
        """Note what is acknowledged for a time: from now on, more often from the first row of this life on; that of an
        archiver is up to its end."""
        row, limit = self.row, time.monotonic() + PATIENCE
        early = victim != "archiver" and self.draw.random() < EARLY
        end = time.monotonic() + seconds if early else None
        while (end is None or time.monotonic() < end) and time.monotonic() < limit and not self.over:
            self.note()
            self.attempt()
            if victim == "archiver" and "archiver" in self.processes():
                time.sleep(self.draw.uniform(0.0, 1.5))
                return
            if end is None and victim != "archiver" and self.row > row:
                end = time.monotonic() + seconds
            time.sleep(0.02)

    def note(self) -> None:
        """What journal and file of the state have now."""
        with contextlib.suppress(LiveError):
            there = overview(self.history)
            self.row = max(self.row, there.last_row)
            if self.draw.random() < 0.1:
                self.events |= {each.number: each.text for each in read_events(self.history)}
        with contextlib.suppress(OSError, LiveError):
            state = LiveState.from_bytes(self.of / "state.bin")
            assert state.number >= self.number
            self.number, self.state = state.number, cycle_of(state)

    def attempt(self) -> None:
        """A write that is refused, now and then: answered, it is in the log."""
        assert self.servers is not None
        assert self.servers.stdout is not None
        if not self.port and (self.events or self.row) and self.servers.poll() is None:
            os.set_blocking(self.servers.stdout.fileno(), False)
            found = re.search(r"Modbus TCP 127\.0\.0\.1:(\d+)", self.servers.stdout.readline() or "")
            self.port = int(found[1]) if found else 0
        if self.port and time.monotonic() - self.attempted > ATTEMPT:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 5.0) as client:
                client.sendall(struct.pack(">HHHBBHH", 1, 0, 6, 1, 6, 100, 1))
                self.attempts += len(client.recv(64)) > 0
            self.attempted = time.monotonic()

    def kill(self, victim: str) -> str:
        """Kill by SIGKILL whom there is, and wait until nobody is left where the servers are."""
        there = self.processes()
        pids = list(there.values()) if victim == "all" else [there[victim]] if victim in there else []
        if not pids:
            return "nobody"
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.killed[victim] += 1
        if "servers" in there and there["servers"] in pids:
            assert self.servers is not None
            self.servers.wait()
            end = time.monotonic() + PATIENCE
            while any(os.path.exists(f"/proc/{pid}") for pid in there.values()):
                assert time.monotonic() < end, there
                time.sleep(0.02)
        return victim

    @property
    def over(self) -> bool:
        """Whether the servers' process ended."""
        return self.servers is None or self.servers.poll() is not None

    def judge(self, whole: bool) -> int:
        """Hold everything that was acknowledged against what there is; whole: nobody runs, so the state stands still.
        Returns how many rows there are."""
        if not (self.history / "journal.sqlite").exists():
            assert self.row == 0
            return 0
        run = read(self.history)
        rows = run["row"].values
        assert rows.tolist() == list(range(1, len(rows) + 1)), "a row is missing or there twice"
        assert len(rows) >= self.row, "acknowledged rows are lost"
        assert run.attrs["left_out"] == ""
        events = {each.number: each.text for each in read_events(self.history)}
        assert self.events.items() <= events.items(), "acknowledged events are lost"
        lines = (self.of / "events.jsonl").read_text(encoding="utf-8").splitlines() if self.attempts else []
        logged = sum(row["value"] for row in map(json.loads, lines) if row["name"] == "refused-write")
        assert logged >= self.attempts, "a refused write is not in the log"
        if "t_winch" in run:
            self.judge_rows(run)
        if whole and (self.of / "state.bin").exists():
            state, problem = newest_state(self.of / "state.bin", HistorySink(self.history).last_state())
            assert state is not None
            assert problem == ""
            assert state.number >= self.number, "an acknowledged state is lost"
            self.number, self.state = state.number, cycle_of(state)
            self.reference.until(self.state)
            assert state.session == self.reference.states[self.state], "the state is another one"
        return len(rows)

    def judge_rows(self, run: Any) -> None:
        """Each row against the reference, to the bit; each start against the state before it."""
        of_twin = np.isfinite(run.t_winch.values)
        old = run.F_w.values[~of_twin]
        assert sorted(old.tolist()) == sorted(3 * [float(i + 1) for i in range(self.old)])
        k = np.round(run.t_winch.values[of_twin] / self.reference.session.cycle).astype(int)
        if not len(k):
            return
        self.reference.until(int(k.max()))
        expected = np.array(self.reference.rows)[k]
        for i, name in enumerate(self.reference.names):
            assert run[name].values[of_twin].tobytes() == expected[:, i].tobytes(), name
        steps = np.diff(k)
        begins = np.flatnonzero(run.cycle_number.values[of_twin][1:] == 0.0)
        assert set(np.flatnonzero(steps != 1)) <= set(begins), "the twin's time jumps without a start"


def cycle_of(state: LiveState) -> int:
    """Cycle at which a state was saved."""
    return int(unseal("session", 3, state.session, "")[0]["k"])


def campaign(folder: Path, victims: list[str], seed: int = 39, longest: float = LONGEST_LIFE) -> dict[str, Any]:
    """Kill one after another, at last a twin of LEAST_ROWS more. Returns what happened. Errors: AssertionError where
    something acknowledged is lost."""
    crew, rows, begun = Crew(folder, seed), 0, time.monotonic()
    try:
        for number, victim in enumerate(victims):
            killed = "nobody"
            while killed == "nobody":
                if victim == "archiver" and not crew.over:  # has work after a start alone
                    crew.kill("all")
                    crew.judge(whole=True)
                if crew.over:
                    crew.start(crew.draw.randrange(1, 4) if victim == "archiver" else 0)
                crew.live(crew.draw.uniform(0.0, longest), victim)
                killed = crew.kill(victim)
            rows = crew.judge(whole=crew.over)
            print(f"{number + 1}: {killed} at {crew.state} cycles, {rows} rows, {crew.attempts} attempts", flush=True)
        if crew.over:
            crew.start(0)
        crew.live_until(crew.row + LEAST_ROWS, len(victims) + 1)
        crew.kill("all")
        rows = crew.judge(whole=True)
    finally:
        crew.kill("all")
    assert check(crew.history) == []
    return {
        "killed": dict(crew.killed),
        "seconds": round(time.monotonic() - begun),
        "rows": rows,
        "events": len(read_events(crew.history)),
        "attempts": crew.attempts,
        "states": crew.number,
        "cycles": crew.state,
        "files": overview(crew.history).files,
    }


if __name__ == "__main__":
    target, kills, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 39
    shutil.rmtree(target, ignore_errors=True)
    drawn = random.Random(seed).choices(VICTIMS, k=kills)
    print(json.dumps(campaign(target, drawn, seed)))
