"""A target in the loop of Atheris in place of our own: `python -m fuzz.by_atheris sea/vessel-csv --time "10 min"`.

Where Atheris is installed (Linux; `pip install atheris`): its feedback is by edges and comparisons of the package's
bytecode. Targets, bounds, seeds and changes are the same, and findings go to the same store.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import time
from pathlib import Path

import atheris  # type: ignore[import-not-found]

with atheris.instrument_imports(include=["stillhook"]):
    from fuzz.__main__ import STORE, chosen, folder_of, seeds_of, store_fault
    from fuzz.engine.guard import Guard, bound_memory
    from fuzz.engine.loop import LONGEST_KEPT, room
    from fuzz.mutators.choose import mutated
    from stillhook.units import parse


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m fuzz.by_atheris", description=__doc__.split("\n\n")[0])
    parser.add_argument("target", help="as --target of `python -m fuzz`")
    parser.add_argument("--time", default="10 min")
    parser.add_argument("--store", type=Path, default=STORE)
    options = parser.parse_args()
    target, seconds = chosen(options.target)[0], parse(options.time, "time", "--time")
    corpus = folder_of(options.store, target) / "atheris"
    corpus.mkdir(parents=True, exist_ok=True)
    seeds = seeds_of(target, options.store)
    for i, data in enumerate(seeds):
        (corpus / f"seed-{i}").write_bytes(data)
    end, count, known = time.monotonic() + seconds, 0, set[str]()
    bound_memory()
    guard = Guard(target, room(target.name, os.getpid())).__enter__()

    def attempt(data: bytes) -> None:
        nonlocal count
        count += 1
        outcome = guard.attempt(data)
        if not outcome.good and outcome.key not in known:
            known.add(outcome.key)
            store_fault(options.store, target, data, outcome)
        if time.monotonic() > end:
            guard.__exit__()
            print(f"{target.name}: {count} inputs, {len(known)} faults")
            sys.stdout.flush()
            os._exit(1 if known else 0)  # libFuzzer takes any other end for a crash

    def change(data: bytes, longest: int, seed: int) -> bytes:
        return mutated(random.Random(seed), target.form, data, seeds)[:longest]

    settings = [sys.argv[0], str(corpus), "-timeout=600", "-rss_limit_mb=0", "-verbosity=0", f"-max_len={LONGEST_KEPT}"]
    atheris.Setup(settings, attempt, custom_mutator=change)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
