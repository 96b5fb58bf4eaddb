"""Fuzz the targets in turn until the time is over: `python -m fuzz --time "1 h"`; a later call continues.

Every target runs in a process of its own for some seconds at a time, so that one that dies or blocks is a finding and
not the end. Inputs worth keeping, findings and tallies are kept in build/fuzz.
"""

from __future__ import annotations

import argparse
import fnmatch
import functools
import hashlib
import json
import os
import select
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fuzz.engine import pool
from fuzz.engine.guard import PACKAGE, Kind, Outcome, bound_memory
from fuzz.engine.loop import Campaign, Tally, room
from fuzz.targets.registry import GROUPS, Target, targets
from stillhook.base.gateway.budget import MEMORY, TIME
from stillhook.errors import StillhookError
from stillhook.units import parse

STORE = Path("build/fuzz")
READERS = {TIME: "20 s", MEMORY: "2 GB"}
"""Bounds of the processes that read binary files, in place of those for files of users."""
PATIENCE = 600.0
"""A process that answers so much too late [s] is blocked; on a busy machine it takes minutes to start."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code 1 where a fault was found."""
    options = _parser().parse_args(arguments)
    of = chosen(options.target)
    if options.list:
        print("\n".join(f"{t.group:10} {t.name:24} {t.form.value}" for t in of))
        return 0
    try:
        seconds, longest = parse(options.time, "time", "--time"), parse(options.slice, "time", "--slice")
    except StillhookError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    if options.summary:
        seconds = 0.0
    try:
        _rounds(of, options.store, seconds, longest)
    except KeyboardInterrupt:
        print("stopped")
    return _summary(of, options.store)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__.split("\n\n")[0])
    parser.add_argument("--target", default="*", help="names or patterns with commas, such as 'crane,log-*,sea/*'")
    parser.add_argument("--time", default="1 h", help="how long, such as '10 min'")
    parser.add_argument("--slice", default="20 s", help="time of a target of share 1 in one round")
    parser.add_argument("--store", type=Path, default=STORE, help="folder of inputs and findings")
    parser.add_argument("--list", action="store_true", help="the targets")
    parser.add_argument("--summary", action="store_true", help="what earlier calls found")
    return parser


def chosen(patterns: str) -> list[Target]:
    """Targets by name, or by group and name."""
    each = patterns.split(",")
    groups = {pattern.partition("/")[0] for pattern in each}
    found = [
        t
        for t in targets(sorted(groups) if groups <= set(GROUPS) else GROUPS).values()
        if any(fnmatch.fnmatchcase(x, pattern) for x in (t.name, f"{t.group}/{t.name}") for pattern in each)
    ]
    if not found:
        sys.exit(f"error: --target {patterns!r}: no such target. --list shows them.")
    return found


def _rounds(of: Sequence[Target], store: Path, seconds: float, longest: float) -> None:
    """Rounds of all targets until the time is over, each for its share, those with the fewest inputs first; longest: a
    slice of share 1 [s]."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        shares = sum(t.share for t in of)
        scale = min(longest, left / shares)
        for target in sorted(of, key=lambda t: int(_totals(store, t).get("inputs", 0))):
            if time.monotonic() < end:
                _slice(target, store, max(1.0, target.share * scale))


def _slice(target: Target, store: Path, seconds: float) -> None:
    """One target for some time, in a process of its own; its tally and findings are added to the store."""
    folder = folder_of(store, target)
    folder.mkdir(parents=True, exist_ok=True)
    totals = _totals(store, target)
    seed = int(totals.get("rounds", 0))
    begun = time.monotonic()
    answer, sent = os.pipe()
    process = os.fork()
    if process == 0:  # the package is imported already, which takes as long as thousands of inputs
        os.environ.update(READERS)
        try:
            os.write(sent, json.dumps(_campaign(target, store, seconds, seed).to_dict()).encode())
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    os.close(sent)
    ready, _, _ = select.select([answer], [], [], seconds + PATIENCE)
    out = os.read(answer, 65_536) if ready else b""
    if not out:
        os.kill(process, signal.SIGKILL)
    os.close(answer)
    _, status = os.waitpid(process, 0)
    place = room(target.name, process)
    if out:
        tally = json.loads(out)
    else:
        died = f"the process ended with status {status}" if ready else "the process was blocked"
        current = place / (target.file or "input")
        last = current.read_bytes() if current.exists() else b""
        store_fault(store, target, last, Outcome(Kind.ESCAPE if ready else Kind.HANG, died, died))
        tally = Tally(escape=int(bool(ready)), hang=int(not ready), seconds=time.monotonic() - begun).to_dict()
    shutil.rmtree(place.parent, ignore_errors=True)
    for name, value in tally.items():
        most = name in ("lines", "kept", "peak", "reader_peak", "slowest")
        totals[name] = max(totals.get(name, 0), value) if most else totals.get(name, 0) + value
    totals["rounds"] = seed + 1
    (folder / "totals.json").write_text(json.dumps(totals), encoding="utf-8")
    print(
        f"{time.strftime('%H:%M:%S')} {target.name}: {tally['inputs']} inputs in {tally['seconds']:.0f} s,"
        f" {totals['inputs']} in all, {totals['lines']} lines, {len(_faults(store, target))} faults",
        flush=True,
    )


def _campaign(target: Target, store: Path, seconds: float, seed: int) -> Tally:
    """A slice, in its own process; what it had seen is kept for the next, which begins where it ended."""
    folder = folder_of(store, target)
    start = seeds_of(target, store)
    seen: dict[str, Any] = next(pool.rows(folder / "seen.json"), {})
    campaign = Campaign(
        target,
        room(target.name, os.getpid()),
        seed,
        found=lambda data, outcome: store_fault(store, target, data, outcome),
        kept=lambda data: pool.append(folder / "pool.jsonl", pool.line_of(data)),
        seen=seen if seen.get("code") == _code() else {},
    )
    bound_memory()
    tally = campaign.run(start, seconds=seconds)
    (folder / "seen.json").write_text(json.dumps({"code": _code(), **campaign.showed()}), encoding="utf-8")
    return tally


def seeds_of(target: Target, store: Path) -> list[bytes]:
    """Inputs to begin with: of the corpus, of the target, of what once escaped, and of campaigns before."""
    kept = [pool.stored(folder, target.group, target.name) for folder in (pool.CORPUS, pool.CRASHES)]
    kept.append(folder_of(store, target) / "pool.jsonl")
    return list(dict.fromkeys([*target.seeds(), *(data for file in kept for data in pool.inputs(file))])) or [b""]


@functools.cache
def _code() -> str:
    """A hash of the package."""
    digest = hashlib.sha256()
    for path in sorted(Path(PACKAGE).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def folder_of(store: Path, target: Target) -> Path:
    return store / target.group / target.name


def _totals(store: Path, target: Target) -> dict[str, Any]:
    return next(pool.rows(folder_of(store, target) / "totals.json"), {})


def _faults(store: Path, target: Target) -> dict[str, dict[str, Any]]:
    return {row["key"]: row for row in pool.rows(folder_of(store, target) / "faults.jsonl")}


def store_fault(store: Path, target: Target, data: bytes, outcome: Outcome) -> None:
    if outcome.key not in _faults(store, target):
        line = pool.line_of(data, key=outcome.key, kind=outcome.kind, line=outcome.line)
        pool.append(folder_of(store, target) / "faults.jsonl", line)


COLUMNS = ("target", "inputs", "read", "refused", "escapes", "hangs", "lines", "peak MB", "slowest s")


def _summary(of: Sequence[Target], store: Path) -> int:
    """A table of all that was done, and a line for each fault."""
    print("| " + " | ".join(COLUMNS) + " |\n|" + "---|" * len(COLUMNS))
    sums = [0] * 5
    faults = 0
    for target in of:
        t = _totals(store, target)
        counts = [int(t.get(name, 0)) for name in ("inputs", "read", "refused", "escape", "hang")]
        sums = [a + b for a, b in zip(sums, counts, strict=True)]
        more = (str(t.get("lines", 0)), f"{t.get('peak', 0) / 1e6:.0f}", f"{t.get('slowest', 0.0):.2g}")
        print("| " + " | ".join([target.name, *map(str, counts), *more]) + " |")
    print("| " + " | ".join(["all", *map(str, sums), "", "", ""]) + " |")
    for target in of:
        for row in _faults(store, target).values():
            faults += 1
            print(f"{target.name}: {row['kind']}: {row['line']}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
