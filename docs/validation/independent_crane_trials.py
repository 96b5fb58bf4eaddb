"""The independent crane's campaigns through `stillhook validate`, kept in independent-crane.json: the page is made from
that file.

    python docs/validation/independent_crane_trials.py            run what is not in the file yet
    python docs/validation/independent_crane_trials.py --new      run also what was computed by other code
    python docs/validation/independent_crane_trials.py precharge  run this case alone (several may be named)

It may be stopped at any time: what is done is in the file. Then `python docs/validation/make.py
independent_crane_results` writes the page.
"""

from __future__ import annotations

import datetime
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import independent_crane
import independent_plant
import independent_plc
import independent_sea_trial
import trial_store
from independent_crane import CASES, Case, write_campaign

from stillhook.errors import StillhookError
from stillhook.validate import validate
from stillhook.validate.validation import Validation

STORE = Path(__file__).resolve().parent / "independent-crane.json"
WORKERS = 2
BY_NAME: Mapping[str, Case] = {case.name: case for case in CASES}


def outcome(case: Case) -> dict[str, Any]:
    """What validation makes of a case, short enough for a file: outcome of the whole; lines that stand in the way, and
    the others that the case is about, each with verdict and message; seconds that simulation and validation took."""
    with TemporaryDirectory() as folder:
        start = time.perf_counter()
        campaign = write_campaign(Path(folder) / "tests", case)
        written = time.perf_counter()
        try:
            result = kept_of(validate(campaign), case)
        except StillhookError as refused:
            result = {"outcome": "not accepted", "message": str(refused).replace(folder, ""), "failed": {}, "lines": {}}
        done = time.perf_counter()
    return {**result, "seconds": {"simulation": round(written - start, 1), "validation": round(done - written, 1)}}


def kept_of(found: Validation, case: Case) -> dict[str, Any]:
    """Outcome, failed lines, and the lines that the case is about."""
    failed = {line.key: [line.verdict.value, line.message] for line in found.lines if line.failed}
    own = {
        line.key: [line.verdict.value, line.message]
        for line in found.lines
        if line.key in case.lines and line.key not in failed
    }
    return {"outcome": found.outcome.value, "failed": failed, "lines": own}


def kept() -> dict[str, Any]:
    """Outcomes by name of the case, each with the code that it was computed by."""
    return trial_store.read(STORE)


def code() -> str:
    """The code that computes: twin and method of validation, and the crane."""
    files = [
        Path(str(m.__file__)) for m in (independent_crane, independent_plant, independent_plc, independent_sea_trial)
    ]
    crane = sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]
    return f"{trial_store.judging_code()}-{crane}"


def main(arguments: Sequence[str]) -> None:
    """Run the cases that are named, all unless named, as far as they are not kept."""
    names = [a for a in arguments if a != "--new"]
    if unknown := [name for name in names if name not in BY_NAME]:
        sys.exit(f'Unknown case "{unknown[0]}". Choose of {", ".join(BY_NAME)}.')
    done, now = kept(), code()
    todo = [
        name for name in names or BY_NAME if name not in done or ("--new" in arguments and done[name]["code"] != now)
    ]
    with ProcessPoolExecutor(max(1, min(WORKERS, len(todo)))) as pool:
        running = {pool.submit(outcome, BY_NAME[name]): name for name in todo}
        for future in as_completed(running):
            name, result = running[future], future.result()
            done[name] = {**result, "code": now, "date": datetime.date.today().isoformat()}
            trial_store.write(STORE, BY_NAME, done)
            spent = sum(result["seconds"].values())
            print(
                f"{name} ({spent:.0f} s): {result['outcome']}; {', '.join(result['failed']) or 'no line failed'}",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
