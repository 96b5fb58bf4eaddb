"""Draw mutants by a seed, run their tests and say which survive.

python -m trials.mutants --seed 1 --number 100
python -m trials.mutants --file src/stillhook/metrics.py --lines 50-110
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import sys
from pathlib import Path

from trials.mutants.run import Campaign
from trials.mutants.sites import draw, every
from trials.mutants.table import survivors, table
from trials.mutants.tree import ROOT, load_libraries


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m trials.mutants", description=(__doc__ or "").splitlines()[0])
    options.add_argument("--seed", type=int, default=1, help="of the draw (default 1)")
    options.add_argument("--number", type=int, default=100, help="mutants that are drawn (default 100)")
    options.add_argument("--file", help="all mutants of this source instead of a draw")
    options.add_argument("--lines", default="1-500", help="lines of the file, such as 50-110")
    options.add_argument("--again", action="store_true", help="run what survived again, with the present tests")
    options.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="copies that run side by side")
    options.add_argument("--folder", type=Path, default=ROOT / "build" / "mutants", help="where outcomes are kept")
    given = options.parse_args()
    if given.file:
        first, last = map(int, given.lines.split("-"))
        mutants = every(ROOT, given.file, range(first, last + 1))
        name = f"{given.file.replace('/', '-')}-{given.lines}"
    else:
        mutants, name = draw(ROOT, given.seed, given.number), f"seed-{given.seed}"
    given.folder.mkdir(parents=True, exist_ok=True)
    kept = given.folder / f"{name}.jsonl"
    if given.again and kept.is_file():
        shutil.copyfile(kept, kept.with_suffix(".before"))
        lines = [line for line in kept.read_text(encoding="utf-8").splitlines() if '"survived"' not in line]
        kept.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the trees end their runs
    load_libraries()
    outcomes = Campaign(given.folder, given.workers, lambda text: print(text, flush=True)).run(mutants, kept)
    print(f"\n{table(outcomes)}\n{survivors(outcomes)}")


if __name__ == "__main__":
    main()
