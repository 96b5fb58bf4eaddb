"""Fuzz the targets in turn until the time is over: `python -m fuzz --time "1 h"`; a later call continues.

Every target runs in a process of its own for some seconds at a time, so that one that dies or blocks is a finding and
not the end. Inputs worth keeping, findings and tallies are kept in build/fuzz.
"""

from __future__ import annotations

import argparse
import fnmatch
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fuzz.engine import pool
from fuzz.engine.guard import Kind, Outcome, bound_memory
from fuzz.engine.loop import Campaign, Tally, room
from fuzz.targets.registry import GROUPS, Target, targets
from stillhook.errors import StillhookError
from stillhook.units import parse

STORE = Path("build/fuzz")
SLICE = 60.0
"""Time of a target of share 1 in one round [s]."""
PATIENCE = 600.0
"""A process that answers so much too late [s] is blocked; on a busy machine it takes minutes to start."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code 1 where a fault was found."""
    options = _parser().parse_args(arguments)
    chosen = _chosen(options.target)
    if options.list:
        print("\n".join(f"{t.group:10} {t.name:24} {t.form.value}" for t in chosen))
        return 0
    if options.one:
        return _one(chosen[0], options.store, options.seconds, options.seed)
    try:
        seconds = parse(options.time, "time", "--time")
    except StillhookError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    if options.summary:
        seconds = 0.0
    try:
        _rounds(chosen, options.store, seconds)
    except KeyboardInterrupt:
        print("stopped")
    return _summary(chosen, options.store)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__.split("\n\n")[0])
    parser.add_argument("--target", default="*", help="name or pattern, such as 'crane', 'log-*' or 'sea/*'")
    parser.add_argument("--time", default="1 h", help="how long, such as '10 min'")
    parser.add_argument("--store", type=Path, default=STORE, help="folder of inputs and findings")
    parser.add_argument("--list", action="store_true", help="the targets")
    parser.add_argument("--summary", action="store_true", help="what earlier calls found")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, default=SLICE, help=argparse.SUPPRESS)
    parser.add_argument("--seed", type=int, default=0, help=argparse.SUPPRESS)
    return parser


def _chosen(pattern: str) -> list[Target]:
    group = pattern.partition("/")[0]
    of = targets([group] if group in GROUPS else GROUPS)
    chosen = [t for t in of.values() if any(fnmatch.fnmatchcase(x, pattern) for x in (t.name, f"{t.group}/{t.name}"))]
    if not chosen:
        sys.exit(f"error: --target {pattern!r}: no such target. --list shows them.")
    return chosen


def _rounds(chosen: Sequence[Target], store: Path, seconds: float) -> None:
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        shares = sum(t.share for t in chosen)
        scale = min(SLICE, left / shares)
        for target in chosen:
            if time.monotonic() < end:
                _slice(target, store, max(1.0, target.share * scale))


def _slice(target: Target, store: Path, seconds: float) -> None:
    """One target for some time, in a process of its own; its tally and findings are added to the store."""
    totals = _totals(store, target)
    seed = int(totals.get("rounds", 0))
    command = [
        sys.executable,
        "-m",
        "fuzz",
        "--one",
        "--target",
        f"{target.group}/{target.name}",
        "--store",
        str(store),
    ]
    command += ["--seconds", f"{seconds:.3f}", "--seed", str(seed)]
    begun = time.monotonic()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        folder = room(target.name, process.pid)
        try:
            out, said = process.communicate(timeout=seconds + PATIENCE)
            died = "" if process.returncode == 0 else f"the process ended with {process.returncode}: {said[-300:]!r}"
        except subprocess.TimeoutExpired:
            died, out = "the process was blocked", ""
        except BaseException:
            process.kill()
            raise
        finally:
            process.kill()
            current = folder / (target.file or "input")
            last = current.read_bytes() if current.exists() else b""
            shutil.rmtree(folder.parent, ignore_errors=True)
    tally: dict[str, Any] = Tally(hang=1, seconds=time.monotonic() - begun).to_dict() if died else json.loads(out)
    if died:
        _store_fault(store, target, last, Outcome(Kind.HANG if not out else Kind.ESCAPE, died, died[:40]))
    for name, value in tally.items():
        most = name in ("lines", "kept", "peak", "slowest")
        totals[name] = max(totals.get(name, 0), value) if most else totals.get(name, 0) + value
    totals["rounds"] = seed + 1
    file = _folder(store, target) / "totals.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(totals), encoding="utf-8")
    print(
        f"{time.strftime('%H:%M:%S')} {target.name}: {tally['inputs']} inputs in {tally['seconds']:.0f} s,"
        f" {totals['inputs']} in all, {totals['lines']} lines, {len(_faults(store, target))} faults",
        flush=True,
    )


def _one(target: Target, store: Path, seconds: float, seed: int) -> int:
    """A slice, in its own process: the tally goes to standard output."""
    folder = _folder(store, target)
    start = [*pool.inputs(pool.stored(pool.CORPUS, target.group, target.name)), *target.seeds()]
    start += pool.inputs(pool.stored(pool.CRASHES, target.group, target.name)) + pool.inputs(folder / "pool.jsonl")
    campaign = Campaign(
        target,
        room(target.name, os.getpid()),
        seed,
        found=lambda data, outcome: _store_fault(store, target, data, outcome),
        kept=lambda data: pool.append(folder / "pool.jsonl", pool.line_of(data)),
    )
    bound_memory()
    tally = campaign.run(list(dict.fromkeys(start)) or [b""], seconds=seconds)
    print(json.dumps(tally.to_dict()))
    return 0


def _folder(store: Path, target: Target) -> Path:
    return store / target.group / target.name


def _totals(store: Path, target: Target) -> dict[str, Any]:
    return next(pool.rows(_folder(store, target) / "totals.json"), {})


def _faults(store: Path, target: Target) -> dict[str, dict[str, Any]]:
    return {row["key"]: row for row in pool.rows(_folder(store, target) / "faults.jsonl")}


def _store_fault(store: Path, target: Target, data: bytes, outcome: Outcome) -> None:
    if outcome.key not in _faults(store, target):
        line = pool.line_of(data, key=outcome.key, kind=outcome.kind, line=outcome.line)
        pool.append(_folder(store, target) / "faults.jsonl", line)


COLUMNS = ("target", "inputs", "read", "refused", "escapes", "hangs", "lines", "peak MB", "slowest s")


def _summary(chosen: Sequence[Target], store: Path) -> int:
    """A table of all that was done, and a line for each fault."""
    print("| " + " | ".join(COLUMNS) + " |\n|" + "---|" * len(COLUMNS))
    sums = [0] * 5
    faults = 0
    for target in chosen:
        t = _totals(store, target)
        counts = [int(t.get(name, 0)) for name in ("inputs", "read", "refused", "escape", "hang")]
        sums = [a + b for a, b in zip(sums, counts, strict=True)]
        more = (str(t.get("lines", 0)), f"{t.get('peak', 0) / 1e6:.0f}", f"{t.get('slowest', 0.0):.2g}")
        print("| " + " | ".join([target.name, *map(str, counts), *more]) + " |")
    print("| " + " | ".join(["all", *map(str, sums), "", "", ""]) + " |")
    for target in chosen:
        for row in _faults(store, target).values():
            faults += 1
            print(f"{target.name}: {row['kind']}: {row['line']}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
