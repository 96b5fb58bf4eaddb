"""The independent crane's campaigns through `stillhook validate`, kept in outcomes.json, which the page is made from.

    python -m trials.independent_crane.run            run what is not in the file yet
    python -m trials.independent_crane.run --new      run also what was computed by other code
    python -m trials.independent_crane.run precharge  run this case alone (several may be named)

It may be stopped at any time: what is done is in the file. Then `python docs/validation/make.py independent_crane`
writes the page.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from stillhook.errors import StillhookError
from stillhook.validate import validate
from stillhook.validate.validation import Validation
from trials import store
from trials.independent_crane.crane import CASES, Case, write_campaign

STORE = Path(__file__).resolve().parent / "outcomes.json"
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
    return store.read(STORE)


def code() -> str:
    """The code that computes: twin and method of validation, and the crane."""
    files = [STORE.with_name(f"{name}.py") for name in ("crane", "plant", "plc", "sea_trial")]
    crane = sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]
    return f"{store.judging_code()}-{crane}"


if __name__ == "__main__":
    store.run(STORE, BY_NAME, outcome, code(), sys.argv[1:])
