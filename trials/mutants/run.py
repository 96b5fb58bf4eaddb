"""Runs the tests of mutants, in some trees side by side, and keeps every outcome as it comes."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from trials.mutants.choice import Choice
from trials.mutants.sites import Mutant
from trials.mutants.traces import Traces
from trials.mutants.tree import OVER, PASSED, ROOT, STOPPED, Ended, Run, Tree

KERNEL_ROOMS = ("physics", "control", "winches", "kernels")
"""Rooms whose sources are compiled: every change of one compiles the kernels anew."""
QUICK_FIRST = 30.0
"""Quick tests and stored answers that run the function of a mutant, as they were traced: without a trace they take some
half as long [s of the processor]."""
BUDGET, COMPILING = 45.0, 60.0
"""All tests of a mutant, and what is more where kernels are compiled [s of the processor]: the next does not begin."""
MOST = 6
"""Test files of one mutant, after those."""


class Outcome(NamedTuple):
    """What became of a mutant: killed, stopped (it hangs, which counts as killed) or survived; the test that failed, or
    the test files that did not; seconds of the processor; the line that was changed."""

    mutant: Mutant
    status: str
    by: str
    cpu: float
    text: str

    @property
    def dead(self) -> bool:
        return self.status != "survived"


class Campaign:
    """Mutants of the present sources, in a folder where outcomes are kept."""

    def __init__(self, folder: Path, workers: int, report: Callable[[str], None]) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "cache").mkdir(mode=0o700, exist_ok=True)
        self._report, self._choice = report, Choice(ROOT)
        self._trees = [Tree(folder, number) for number in range(workers)]
        self._traces = Traces(self._trees[0].root, folder)
        self._traces.update(report, workers)

    def run(self, mutants: Sequence[Mutant], kept: Path) -> list[Outcome]:
        """Outcomes in the order of the mutants; those that the file of kept outcomes holds are not run again. A test
        that fails without the mutant too has killed none: its mutants are run once more without it."""
        outcomes = read(kept)
        failing: set[str] = set()
        while left := [m for m in mutants if m not in outcomes]:
            self._run(left, kept, outcomes, len(mutants), failing)
            killers = {outcomes[m].by for m in left if outcomes[m].status == "killed"}
            failing |= (new := self._failing(sorted(killers)))
            for m in left:
                if outcomes[m].status == "killed" and outcomes[m].by in new:
                    self._report(f"{outcomes[m].by} fails without a mutant too")
                    del outcomes[m]
        return [outcomes[m] for m in mutants]

    def _run(
        self, left: Sequence[Mutant], kept: Path, outcomes: dict[Mutant, Outcome], number: int, failing: set[str]
    ) -> None:
        jobs = iter(left)
        with kept.open("a", encoding="utf-8") as file:
            for outcome in self._side_by_side(lambda tree: self._mutants(tree, jobs, failing)):
                file.write(json.dumps(outcome) + "\n")
                file.flush()
                m = outcome.mutant
                outcomes[m] = outcome
                done = f"{len(outcomes)}/{number} {outcome.status:8} {outcome.cpu:5.1f} s"
                self._report(f"{done} {m.file}:{m.line} {m.change}  [{outcome.by}]")

    def _mutants(self, tree: Tree, jobs: Iterator[Mutant], failing: set[str]) -> Iterator[Outcome | None]:
        for mutant in jobs:
            quick = self._traces.tests(mutant.file, mutant.line, QUICK_FIRST)
            tests = self._choice.tests(mutant.file, quick)[:MOST]
            compiles = mutant.file.split("/")[2] in KERNEL_ROOMS
            lines = (ROOT / mutant.file).read_text(encoding="utf-8").splitlines()
            tree.change(mutant, compiles)
            left_out = [f"--deselect={test}" for test in failing]
            first = Run(["-x", *left_out, *dict.fromkeys(test.split("::")[0] for test in quick)], quick)
            then = [Run(["-x", *left_out, test]) for test in tests]
            tree.start([first, *then] if quick else then, BUDGET + COMPILING * compiles)
            while (end := tree.ended()) is None:
                yield None
            tree.restore(mutant)
            yield Outcome(
                mutant,
                *verdict(end, [f"{len(quick)} quick tests", *tests]),
                round(end.cpu, 1),
                lines[mutant.line - 1].strip(),
            )

    def _failing(self, killers: Sequence[str]) -> set[str]:
        """Those of the tests that fail in a tree without a mutant."""
        tests = [killer for killer in killers if "::" in killer]
        if not tests:
            return set()
        tree = self._trees[0]
        tree.start([Run(tests)], 10.0 * BUDGET)
        while (end := tree.ended()) is None:
            time.sleep(0.1)
        return {test for test in tests if test in failed(end.text)}

    def _side_by_side(self, work: Callable[[Tree], Iterator[Outcome | None]]) -> Iterator[Outcome]:
        """Outcomes of all trees, as they come."""
        running = [work(tree) for tree in self._trees]
        try:
            while running:
                for each in list(running):
                    try:
                        outcome = next(each)
                    except StopIteration:
                        running.remove(each)
                        continue
                    if outcome is not None:
                        yield outcome
                time.sleep(0.05)
        finally:
            for tree in self._trees:
                tree.stop()


def failed(output: str) -> list[str]:
    """Tests, or files that cannot be imported, that the summary of pytest names. Names of cases may hold blanks."""
    return re.findall(r"^(?:FAILED|ERROR) (\S+?\[.*?\](?= - |$)|\S+)", output, re.MULTILINE)


def verdict(end: Ended, tests: Iterable[str]) -> tuple[str, str]:
    """Status and cause of a run with a mutant."""
    if end.code in (PASSED, OVER):
        return "survived", ", ".join(tests) + (" (as many as there was time for)" if end.code == OVER else "")
    if end.code == STOPPED:
        return "stopped", end.text.rsplit("\n", 1)[-1]
    return "killed", next(iter(failed(end.text)), f"exit code {end.code}")


def read(kept: Path) -> dict[Mutant, Outcome]:
    """Outcomes of a file, the last of each mutant; a line cut short by a kill is left out."""
    found: dict[Mutant, Outcome] = {}
    for line in kept.read_text(encoding="utf-8").splitlines() if kept.is_file() else ():
        try:
            mutant, *rest = json.loads(line)
        except ValueError:
            continue
        outcome = Outcome(Mutant(*mutant), *rest)
        found[outcome.mutant] = outcome
    return found
