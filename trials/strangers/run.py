"""Runs the commands on draws and checks what must hold.

python -m trials.strangers --draws 200 --first 1 --out FOLDER

A line of JSON a draw is appended to FOLDER/draws.jsonl; draws that are there are not run again. Files of a draw stay in
FOLDER/files, so that what is found can be looked into by hand.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

from rich.console import Console
from rich.progress import track
from rich.table import Table

import stillhook.analysis.controllers
import stillhook.engine.simulate
import stillhook.plan.planning
from stillhook import load_crane, load_lift, load_plan
from stillhook.cli import main as command_line
from stillhook.engine.simulate import dataset_of
from stillhook.errors import StillhookError
from stillhook.plan.definition.rules import Tier
from trials.strangers import checks, run_checks
from trials.strangers.checks import REFUSED, Tally
from trials.strangers.draw import CRANE, LIFT, LOOSE, PLAN, Draw, as_json, draw

LINES = "draws.jsonl"
COMMANDS = ("plan", "lower", "compare", "stability")
"""Commands that are run, in their order."""


@dataclass
class Outcome:
    """What a draw gave: the draw, seconds of each command, exit codes, reasons of refusals, checks by name."""

    drawn: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    codes: dict[str, int] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    checks: dict[str, Tally] = field(default_factory=dict)

    def check(self, name: str, texts: Iterator[str]) -> None:
        """Add what a check finds; one that cannot look at what it was given is a violation as well."""
        tally = self.checks.setdefault(name, Tally())
        try:
            tally.add(texts)
        except Exception as problem:
            tally.add([f"the check failed: {type(problem).__name__}: {problem} {_place(problem)}"])


def _place(problem: Exception) -> str:
    last = traceback.extract_tb(problem.__traceback__)[-1]
    return f"({Path(last.filename).name}:{last.lineno})"


@contextlib.contextmanager
def captured(module: Any, name: str) -> Iterator[list[Any]]:
    """What a function of a module gives while a command runs; the command gets it as well."""
    with listened(module, name) as calls:
        given: list[Any] = []
        yield given
        given += [result for _, result in calls]


@contextlib.contextmanager
def listened(module: Any, name: str) -> Iterator[list[tuple[tuple[Any, ...], Any]]]:
    """Positional arguments and results of the calls of a function of a module, in their order."""
    calls: list[tuple[tuple[Any, ...], Any]] = []
    function = getattr(module, name)

    def listening(*arguments: Any, **options: Any) -> Any:
        result = function(*arguments, **options)
        calls.append((arguments, result))
        return result

    with mock.patch.object(module, name, listening):
        yield calls


def run_command(words: Sequence[str], outcome: Outcome) -> tuple[int, str]:
    """Run `stillhook` with words in this process: exit code and what it printed."""
    out, err = io.StringIO(), io.StringIO()
    began = time.perf_counter()
    code = 0
    with (
        mock.patch.object(sys, "argv", ["stillhook", *words]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            command_line()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException as problem:
            if isinstance(problem, KeyboardInterrupt):
                raise
            code = 4
            print(f"Traceback: {type(problem).__name__}: {problem}", file=err)
    name = words[0]
    outcome.seconds[name] = outcome.seconds.get(name, 0.0) + time.perf_counter() - began
    outcome.codes[name] = max(code, outcome.codes.get(name, 0))
    outcome.check("exit code", checks.exit_code(name, code, err.getvalue()))
    if code == REFUSED:
        outcome.refused[name] = err.getvalue().strip().splitlines()[-1]
    return code, out.getvalue()


def run_draw(drawn: Draw, *, threads: int = 1, commands: Sequence[str] = ()) -> Outcome:
    """All commands on a draw, or some of them, with all checks."""
    outcome = Outcome(dict(as_json(drawn)))
    run_each = {
        "plan": lambda: _plan(drawn, outcome, threads),
        "lower": lambda: _lower(drawn, outcome),
        "compare": lambda: _compare(drawn, outcome),
        "stability": lambda: _stability(drawn, outcome),
    }
    for name in commands or COMMANDS:
        run_each[name]()
    return outcome


def _plan(drawn: Draw, outcome: Outcome, threads: int) -> None:
    file = str(drawn.folder / PLAN)
    module = stillhook.plan.planning
    with captured(module, "plan") as given, listened(module, "PlanState") as states:
        code, _ = run_command(["plan", file, "--json", "--workers", str(threads)], outcome)
    if not given:
        return
    (result,) = given
    demands = states[-1][1].demands if states else ()
    outcome.check("plan: exit code says whether it is workable", checks.answered(result, code))
    outcome.check("plan: everything is computed", checks.computed(result))
    outcome.check("plan: limits within their intervals", checks.ordered(result))
    outcome.check("plan: credited between twin and cap", checks.credited(result))
    outcome.check("plan: credited limit is the least of its rules", checks.least_of_rules(result))
    outcome.check("plan: limits agree with their runs", checks.agrees_with_runs(result, load_plan(file), demands))
    outcome.check("plan: higher limits, more hours", checks.more_is_more(result))
    try:
        loose = stillhook.plan.planning.plan(str(drawn.folder / LOOSE), tier=Tier.FREQUENCY)
    except StillhookError as problem:
        outcome.refused["lenient plan"] = str(problem)
        return
    outcome.check("plan: lenient rules, no lower limits", checks.looser_is_no_lower(result, loose))


def _lower(drawn: Draw, outcome: Outcome) -> None:
    file = str(drawn.folder / LIFT)
    with captured(stillhook.engine.simulate, "simulate") as given:
        run_command(["lower", file, "--json"], outcome)
    if not given:
        return
    (run,) = given
    lift = load_lift(file)
    status, winch = str(run["status"].item()), lift.crane.plant.type
    outcome.check("lower: status and time at limits", run_checks.times(winch, status, run))
    outcome.check("lower: status and signals", run_checks.signals(lift.crane, status, run, 0.0))
    outcome.check("lower: slings, touches, programme", run_checks.lowered(lift.lift, status, run))
    outcome.check("lower: energy", run_checks.energy(run))
    outcome.check("lower: work of gravity is weight by way", run_checks.weight_by_way(lift.crane, lift.lift, run))


def _compare(drawn: Draw, outcome: Outcome) -> None:
    with captured(stillhook.analysis.controllers, "compare") as given:
        code, _ = run_command(drawn.compare, outcome)
    if not given:
        return
    (result,) = given
    right = 0 if result.ok else 1
    outcome.check("compare: exit code says whether any is ok", iter(["" if code == right else f"{code}, not {right}"]))
    crane = result.crane
    for run in result.runs:
        status, series = run.summary["status"], dataset_of([run])
        powers = {k: v * run.t_cycle for k, v in run.stats.power._asdict().items()}
        outcome.check("compare: status and time at limits", run_checks.times(crane.plant.type, status, run.summary))
        outcome.check("compare: status and signals", run_checks.signals(crane, status, series, run.case.warm_up))
        outcome.check("compare: compensates or says not", run_checks.compensates(status, run.summary))
        outcome.check("compare: energy", run_checks.energy(run.summary, powers))


def _stability(drawn: Draw, outcome: Outcome) -> None:
    for place in drawn.places:
        file = str(drawn.folder / CRANE)
        code, out = run_command(["stability", file, *place.words, "--json"], outcome)
        if code == REFUSED:
            continue
        answer = json.loads(out)
        right = 0 if answer["stable"] else 1
        outcome.check("stability: exit code", iter(["" if code == right else f"{code}, stable {answer['stable']}"]))
        crane = load_crane(file)
        outcome.check("stability: stable dies out in the twin", run_checks.dies_out(crane, answer, place))
        outcome.check("stability: near the limit it still does", run_checks.near_the_limit(crane, answer, place))


def as_line(outcome: Outcome) -> str:
    """A draw's line of JSON."""
    return json.dumps({**asdict(outcome), "checks": {k: asdict(v) for k, v in outcome.checks.items()}})


def append(file: Path, line: str) -> None:
    """Append a line in one write, so that a run that stops leaves whole lines."""
    with open(file, "ab", buffering=0) as stream:
        stream.write(f"{line}\n".encode())
        os.fsync(stream.fileno())


def known(file: Path) -> list[dict[str, Any]]:
    """Lines of draws that are there; a last line that is cut is left out."""
    rows = []
    for line in file.read_text(encoding="utf-8").splitlines() if file.is_file() else ():
        with contextlib.suppress(json.JSONDecodeError):
            rows.append(json.loads(line))
    return rows


def totals(rows: Sequence[dict[str, Any]]) -> dict[str, Tally]:
    """Checks of all draws, lines with their seed."""
    out: dict[str, Tally] = {}
    for row in rows:
        for name, tally in row["checks"].items():
            of = out.setdefault(name, Tally())
            of.checked, of.violated = of.checked + tally["checked"], of.violated + tally["violated"]
            of.lines += [f"seed {row['drawn']['seed']} ({row['drawn']['winch']}): {line}" for line in tally["lines"]]
    return out


def report(rows: Sequence[dict[str, Any]], console: Console) -> bool:
    """Refusals, violations and the table of checks; whether nothing was violated."""
    for row in rows:
        for name, reason in row["refused"].items():
            console.print(f"seed {row['drawn']['seed']}, {name} refused: {reason}", markup=False, highlight=False)
    table = Table("check", "checked", "violated", title=f"{len(rows)} draws")
    found = totals(rows)
    for name, tally in found.items():
        table.add_row(name, f"{tally.checked:,}", f"{tally.violated:,}")
        for line in tally.lines:
            console.print(f"{name}: {line}", markup=False, highlight=False)
    console.print(table)
    seconds = sum(sum(row["seconds"].values()) for row in rows)
    console.print(f"{seconds:.0f} s in commands, {sum(len(row['refused']) for row in rows)} commands refused")
    return not any(tally.violated for tally in found.values())


def main(arguments: Sequence[str] | None = None) -> int:
    """The program. Exit code 1 where anything is violated."""
    parser = argparse.ArgumentParser(prog="python -m trials.strangers", description=__doc__)
    parser.add_argument("--draws", type=int, default=200, help="how many draws")
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--out", type=Path, required=True, help="folder of results and of the files drawn")
    parser.add_argument("--threads", type=int, default=1, help="threads of a plan")
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=COMMANDS, help="which to run")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    file, console = options.out / LINES, Console(stderr=True)
    done = {row["drawn"]["seed"] for row in known(file)}
    seeds = range(options.first, options.first + options.draws)
    for seed in track([s for s in seeds if s not in done], "strangers", console=console):
        drawn = draw(seed, options.out / "files" / str(seed))
        outcome = run_draw(drawn, threads=options.threads, commands=options.commands)
        append(file, as_line(outcome))
    return 0 if report([row for row in known(file) if row["drawn"]["seed"] in seeds], Console(width=118)) else 1
