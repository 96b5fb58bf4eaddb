"""Store the results of the cases, or list what differs from the stored ones.

python tests/frozen/freeze.py                    store every case, remove files without a case
python tests/frozen/freeze.py sea tip            store these
python tests/frozen/freeze.py --check            list differences (path, old, new); exit code 1 if there are any
python tests/frozen/freeze.py --check --numbers  only numbers that differ: for a change that renames keys and rewords texts
"""

import argparse
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["STILLHOOK_CONFIG"] = os.devnull  # no key and no trust list of whoever runs it
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from tests.frozen import record  # noqa: E402
from tests.frozen.cases import CASES, result  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="cases; all if left out")
    parser.add_argument("--check", action="store_true", help="list differences, store nothing")
    parser.add_argument("--numbers", action="store_true", help="with --check: only numbers")
    parser.add_argument("--most", type=int, default=20, help="with --check: differences printed of each case")
    options = parser.parse_args()
    unknown = set(options.names) - CASES.keys()
    if unknown:
        parser.error(f"Unknown case {', '.join(sorted(unknown))}. Choose from {', '.join(CASES)}.")
    names = options.names or list(CASES)
    return check(names, options.numbers, options.most) if options.check else freeze(names)


def freeze(names: list[str]) -> int:
    failed = []
    for i, name in enumerate(names, 1):
        start = time.perf_counter()
        try:
            value = result(name)
        except Exception as problem:
            failed.append(name)
            print(f"{i:3d}/{len(names)}  {name:32s} failed: {type(problem).__name__}: {problem}", flush=True)
            continue
        record.store(name, value)
        size = record.path_of(name).stat().st_size
        print(
            f"{i:3d}/{len(names)}  {name:32s} {time.perf_counter() - start:6.2f} s {size / 1024:7.1f} KiB", flush=True
        )
    record.store(record.MACHINE, record.machine())
    for name in sorted(record.stored_names() - CASES.keys()):
        record.path_of(name).unlink()
        print(f"removed {name}: no such case")
    return 1 if failed else 0


def check(names: list[str], numbers: bool, most: int) -> int:
    """Exact on the machine that stored the results, within the tolerances on others."""
    exact, total = record.same_machine(), 0
    print(f"Compared {'to the bit' if exact else 'within tolerances: another machine stored the results'}.")
    for name in names:
        if not record.path_of(name).exists():
            print(f"{name}: nothing stored")
            total += 1
            continue
        found = list(record.differences(record.stored(name), result(name), exact=exact))
        if numbers:
            found = [d for d in found if record.is_number(d.old) and record.is_number(d.new)]
        total += len(found)
        print(f"{name}: {len(found) or 'no'} difference{'' if len(found) == 1 else 's'}", flush=True)
        for difference in found[:most]:
            print(f"    {difference}")
        if len(found) > most:
            print(f"    ... and {len(found) - most} more")
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main())
