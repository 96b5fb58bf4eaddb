"""How long does a validation take, from files to certificate? `python -m benchmarks.validation`.

A synthetic campaign like paper F table 3 (2200 s of heave compensation at 100 Hz, and the tests of limits and
dynamics), read, validated and certified in a process of its own that starts from cached kernels; and by itself, step by
step, as parts of reading the logs.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from trials.campaigns import write_campaign

from stillhook.validate import load_campaign, validate
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.data_set.read import read_records
from stillhook.validate.validation import STEPS

GOAL = 30.0
"""Seconds of wall time on two cores that all of it may take."""
COMMAND = "import sys; sys.argv[0] = 'stillhook'; from stillhook.cli import main; main()"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        written = write_campaign(Path(folder) / "tests")
        validate(written.campaign)  # compiles
        begin = time.perf_counter()
        command = [
            sys.executable,
            "-c",
            COMMAND,
            "validate",
            str(written.campaign),
            "--out",
            str(Path(folder) / "out"),
            "--json",
        ]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        total = time.perf_counter() - begin
        campaign = load_campaign(written.campaign)
        begin = time.perf_counter()
        records = read_records(campaign, lambda share: None)
        reading = time.perf_counter() - begin
        logged = sum(s.duration for r in records if r.test.kind is Kind.AHC for s in r.segments)
        print(
            f"{logged:.0f} s of heave compensation on {os.cpu_count()} cores: {total:.1f} s from files to certificate"
        )
        print(f"({GOAL:.0f} s allowed), {logged / total:.0f} times as fast as the crane.")
        print(f"Reading the logs takes {reading:.2f} s; over that:")
        for number, step in STEPS.items():
            begin = time.perf_counter()
            step.check(campaign, records, lambda share: None)
            print(f"  step {int(number)}: {(time.perf_counter() - begin) / reading:.1f}")


if __name__ == "__main__":
    main()
