"""The benchmark of controllers: `python -m benchmarks.control [--entry FILE] [--quick] [--json]`.

Minutes on two cores. It may be interrupted: what it ran is kept in --store, and the same command continues from there.
"""

import argparse
import json
import os
import sys
from pathlib import Path

SHIP = Path(__file__).parents[2].with_name("shared") / "data/ship_motion_palmer/NBP1406_seap-2014-08-01.txt"
STORE, OUT = Path("benchmark-runs"), Path("benchmark.png")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.control", description=__doc__)
    parser.add_argument(
        "--entry", type=Path, action="append", default=[], metavar="FILE", help="module, TOML file or FMU"
    )
    parser.add_argument("--quick", action="store_true", help="a sea and four plants, to see that an entry runs")
    parser.add_argument("--json", action="store_true", help="results as JSON in place of the tables")
    parser.add_argument("--store", type=Path, default=STORE, metavar="DIR", help=f"where runs are kept ({STORE})")
    parser.add_argument("--out", type=Path, default=OUT, metavar="FILE", help=f"the figure ({OUT})")
    parser.add_argument("--ship", type=Path, default=SHIP, metavar="FILE", help="measured ship motion, if it is there")
    return parser.parse_args()


def main() -> None:
    given = arguments()
    if missing := next((file for file in given.entry if not file.is_file()), None):
        print(f"--entry {missing}: no such file. Give a controller's module, TOML file or FMU.", file=sys.stderr)
        sys.exit(2)
    modules = [str(file.resolve()) for file in given.entry if file.suffix == ".py"]
    known = os.environ.get("STILLHOOK_EXTENSIONS")
    os.environ["STILLHOOK_EXTENSIONS"] = os.pathsep.join([*modules, *([known] if known else [])])

    # behind the extensions, which are read when stillhook is imported
    from benchmarks.control import report
    from benchmarks.control.course import FULL, QUICK
    from benchmarks.control.deep import deep
    from benchmarks.control.entries import entries_with
    from benchmarks.control.late import late
    from benchmarks.control.margins import margins
    from benchmarks.control.runs import Runner, results
    from stillhook.base.progress import Parts
    from stillhook.errors import StillhookError
    from stillhook.report.terminal import progress_bar

    try:
        entries = entries_with(given.entry)
        size, runner = QUICK if given.quick else FULL, Runner(given.store)
        with progress_bar("benchmark") as bar:
            parts = Parts(bar, {"seas and plants": 80.0, "late": 10.0, "deep": 10.0})
            found = report.outcome(
                results(entries, size, runner, given.ship, parts("seas and plants")),
                margins(entries, size, runner),
                late(entries, size, runner, parts("late")),
                deep(entries, size, runner, parts("deep")),
            )
    except StillhookError as problem:
        print(problem, file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print(f"Interrupted. The same command continues from what is kept in {given.store}.", file=sys.stderr)
        sys.exit(130)
    if given.json:
        print(json.dumps(found))
        return
    report.show(found)
    report.figure(found).savefig(given.out, dpi=90)
    print(f"\n{given.out}")


if __name__ == "__main__":
    main()
