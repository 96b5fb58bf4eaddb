"""Faults of one command line, one after the other: which are tried, and what is wrong after each.

What the command computes before it writes is computed once for all of them: it is held before a call, and a fork of it
has the fault (`injector.Held`).
"""

from __future__ import annotations

import errno
import functools
import itertools
import random
import re
from collections.abc import Callable, Iterable, Iterator, Sequence

from tests.faults.bench import Bench, Tree, is_hidden, is_temporary
from tests.faults.commands import Writes
from tests.faults.injector import Call, Fault, Kind, Outcome

KINDS = (
    *((Kind.FAIL, error) for error in (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EINTR)),
    (Kind.FULL, errno.ENOSPC),
    (Kind.FAIL_ON, errno.EIO),
    (Kind.KILL, 0),
    (Kind.TORN, 0),
)
DEADLY = (Kind.KILL, Kind.TORN)
RANDOM = re.compile(r"-\d+\.part-[a-z0-9_]{8}|(?<=tmp/)[^/]+")
"""What differs between the names of temporary files."""


def distinct(calls: Sequence[Call]) -> list[int]:
    """Numbers, from 1 on, of the calls that differ in kind or file: the first and the last of each."""
    first, last = dict[tuple[str, str], int](), dict[tuple[str, str], int]()
    for number, call in enumerate(calls, 1):
        of = call.kind, RANDOM.sub("-", call.path)
        first.setdefault(of, number)
        last[of] = number
    return sorted({*first.values(), *last.values()})


def faults(numbers: Sequence[int], most: int | None, seed: int) -> list[Fault]:
    """All kinds at calls of these numbers, or some of them: each kind as often, spread over the calls."""
    every = [Fault(kind, at, error) for at in numbers for kind, error in KINDS]
    if most is None or most >= len(every):
        return every
    chance = random.Random(seed)
    kinds = itertools.islice(itertools.cycle(KINDS), most)
    return sorted((Fault(kind, chance.choice(numbers), error) for kind, error in kinds), key=lambda fault: fault.at)


def sweep(bench: Bench, writes: Writes, most: int | None, seed: int = 1) -> tuple[int, list[str]]:
    """Faults that were tried, and what was wrong after each. most: how many, None: all kinds at all calls that
    differ."""
    arguments, new = bench.complete(writes)
    old: Tree = {name: content if content is None else b"of an earlier run" for name, content in new.items()}
    number, problems = 0, list[str]()
    given = bench.given(writes)
    for state in [given, old] if writes.over else [given]:
        some = most and -(-most // (1 + writes.over))
        one = Sweep(bench, writes, arguments, state, new)
        number += one.run(some, seed)
        one.run_again()
        problems += [f"{'over' if state is old else 'new'}: {each}" for each in one.problems]
    return number, problems


class Sweep:
    """Faults of a command line that begins with some files. new: the files when nothing fails."""

    def __init__(self, bench: Bench, writes: Writes, arguments: Sequence[str], state: Tree, new: Tree) -> None:
        self.bench, self.writes, self.arguments, self.state, self.new = bench, writes, arguments, state, new
        self.problems: list[str] = []
        self._again: dict[object, tuple[str, Tree]] = {}

    def run(self, most: int | None, seed: int) -> int:
        """How many faults were tried. Those before which the command cannot be held are whole runs."""
        self._start = self.bench.reset(self.state)
        whole, known = list[Fault](), False
        with self.bench.injector.held(self.arguments, self.bench.environment) as held:
            if known := held.before(1):
                chosen, calls = self._chosen(held.run, most, seed)
                self.bench.reset(self.state)
                for hold, group in itertools.groupby(chosen, functools.partial(_before, calls)):
                    if hold == 1 or held.before(hold):
                        here = self.bench.tree()
                        self._each([Fault(at=hold), *group], here, held.run)
                        self.bench.reset(here)
                    else:
                        whole += group
        self.bench.reset(self.state)
        if not known:
            chosen, _ = self._chosen(lambda: self.bench.run(self.arguments), most, seed)
            whole = chosen
        self._each(whole, self._start, lambda fault: self.bench.run(self.arguments, fault))
        return len(chosen)

    def _chosen(self, run: Callable[[], Outcome], most: int | None, seed: int) -> tuple[list[Fault], list[Call]]:
        """Faults to try, and the calls among which they are."""
        done, calls = self.bench.injector.logged(run)
        assert done.code == self.writes.code, done.err
        return faults(distinct(calls), most, seed), calls

    def run_again(self) -> None:
        """The command once more after each fault that left something, on what it left: a run sees no more of temporary
        files than their names."""
        for text, after in self._again.values():
            self._rerun(text, after)

    def _each(self, faults: Iterable[Fault], here: Tree, run: Callable[[Fault], Outcome]) -> None:
        for fault in faults:
            self.bench.reset(here)
            done = run(fault)
            after = self.bench.tree()
            text = f"{fault} ({done.struck}): exit {done.code}"
            wrong = [*_said(self.writes, fault, done), *self._left(fault, done, after)]
            self.problems += [f"{text}: {each}" for each in wrong]
            if done.code != self.writes.code and after != self._start and not wrong:
                self._again.setdefault(_seen(after), (text, after))

    def _rerun(self, text: str, after: Tree) -> None:
        self.bench.reset(after)
        self.bench.age(after)
        again = self.bench.run(self.arguments)
        tree = self.bench.tree()
        self.problems += [f"{text}: not swept: {name}" for name in tree if is_hidden(name) and name in after]
        complete = not self.writes.over and again.code == 2 and all(after.get(n) == x for n, x in self.new.items())
        if not complete and (again.code != self.writes.code or _lasting(tree) != _lasting(self.new)):
            self.problems.append(f"{text}: run again: {again.code} {again.err[-200:]}")

    def _left(self, fault: Fault, done: Outcome, after: Tree) -> Iterator[str]:
        """What is wrong with the files."""
        start, new = self._start, self.new
        may_leave = fault.kind in (*DEADLY, Kind.FAIL_ON) or done.struck == "unlink"
        may_change = self.writes.parts or may_leave or done.struck == "fsync"  # of the folder: the file is there then
        for name in sorted(after.keys() | new.keys() | start.keys()):
            content = after.get(name, b"-")
            if is_temporary(name):
                if name in after and name not in start and not may_leave:
                    yield f"left: {name}"
            elif done.code == self.writes.code:
                if name not in new or content != new[name]:
                    yield f"not as it is to be: {name}"
            elif content not in (start.get(name, b"-"), new.get(name, b"-")):
                yield f"neither old nor new: {name}"
            elif done.code == 2 and content != start.get(name, b"-") and not may_change:
                yield f"changed by a command that failed: {name}"


def _before(calls: Sequence[Call], fault: Fault) -> int:
    """Number of the last call until that of a fault before which a command can be held."""
    return max(n for n, call in enumerate(calls[: fault.at], 1) if n == 1 or not (call.open or call.others))


def _said(writes: Writes, fault: Fault, done: Outcome) -> Iterator[str]:
    """What is wrong with exit code and lines."""
    if fault.kind not in (Kind.NONE, Kind.FULL) and not done.fired:  # a full disk still renames
        yield "did not happen"
    if any(word in done.err for word in ("Traceback", "Exception ignored", "Internal error")):
        yield f"no line: {done.err[-500:]}"
    if fault.kind in DEADLY and done.fired and done.code == -9:
        return
    errors = [line for line in done.lines if line.startswith("error: ")]
    if done.code not in (writes.code, 2) or (done.code == 2) != (len(errors) == 1):
        yield f"exit code and lines: {done.err[-300:]}"


def _lasting(tree: Tree) -> Tree:
    return {name: content for name, content in tree.items() if not is_temporary(name)}


def _seen(tree: Tree) -> object:
    """What a run can see of these files."""
    return frozenset(_lasting(tree).items()), frozenset(RANDOM.sub("-", name) for name in tree if is_hidden(name))
