"""Make the committed corpus: `python -m fuzz.distil FOLDER ...`.

Candidates are files of the folders whose names end as the target's file does, what the corpus has, and what campaigns
kept. The shortest come first, and each is kept that runs lines of the package that none before it did. Folders
of tests are a source: `pytest --basetemp FOLDER`, which keeps what they wrote.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

from fuzz.__main__ import STORE
from fuzz.engine import pool
from fuzz.engine.feedback import Lines
from fuzz.engine.guard import Guard
from fuzz.engine.loop import room
from fuzz.targets.registry import Form, Target, targets

LONGEST, MOST = 5000, 12_000
"""Bytes of one input, and of all inputs of a target, that are committed."""
CANDIDATES, SLOW_CANDIDATES = 400, 25
"""Candidates at most, and of forms that are read in a process of its own."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m fuzz.distil", description=__doc__.split("\n\n")[0])
    parser.add_argument("folder", nargs="*", type=Path, help="folders with files")
    parser.add_argument("--target", default="", help="this one alone")
    parser.add_argument("--store", type=Path, default=STORE)
    options = parser.parse_args()
    files = [path for folder in options.folder for path in folder.rglob("*") if path.is_file()]
    for target in targets().values():
        if options.target in ("", target.name):
            file = pool.stored(pool.CORPUS, target.group, target.name)
            kept = pool.inputs(options.store / target.group / target.name / "pool.jsonl")
            made = distilled(target, [*pool.inputs(file), *kept, *_alike(target, files)])
            if made:
                pool.write(file, map(pool.line_of, made))
            print(f"{target.name}: {len(made)} inputs, {sum(map(len, made))} bytes", flush=True)


def _alike(target: Target, files: Iterable[Path]) -> Iterable[bytes]:
    """Contents of files that a target may read."""
    if not target.file:
        return
    ending = Path(target.file).suffix.lower()
    endings = TEXTS if target.form is Form.TABLE else (ending,)
    for path in files:
        if path.name == target.file or path.suffix.lower() in endings:
            yield path.read_bytes()


TEXTS = (".csv", ".txt", ".4", ".lis", ".rao", ".re1", ".yml", ".log", ".asc", ".st", ".xml")
"""Endings of files of lines."""


def distilled(target: Target, candidates: Iterable[bytes]) -> list[bytes]:
    """The inputs that show something new, the shortest first; what the target's seeds show is not new."""
    short = sorted({data for data in candidates if len(data) <= LONGEST}, key=lambda data: (len(data), data))
    most = SLOW_CANDIDATES if target.form in (Form.BINARY, Form.ZIP, Form.NETCDF) else CANDIDATES
    if len(short) > most:
        short = short[:: len(short) // most + 1]
    lines, kept, size = Lines(), [], 0
    with Guard(target, room(target.name, 0)) as guard:
        for place, data in enumerate([*(seeds := list(target.seeds())), *short]):
            before = lines.seen
            with lines:
                outcome = guard.attempt(data)
            if lines.seen > before and outcome.good and place >= len(seeds) and size + len(data) <= MOST:
                kept.append(data)
                size += len(data)
    return kept


if __name__ == "__main__":
    main()
