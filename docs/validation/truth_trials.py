"""Campaigns of a known truth through `stillhook validate`, kept in truth-trials.json: half an hour's work that the page is made from.

    python docs/validation/truth_trials.py            run what is not in the file yet
    python docs/validation/truth_trials.py 20         run no more than the next 20 of them
    python docs/validation/truth_trials.py --new      run also what was computed by other code
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from stillhook.errors import StillhookError
from stillhook.validate import validate
from stillhook.validate.certificate_content import versions
from stillhook.validate.lines import StepNumber
from stillhook.validate.report_texts import found_on_the_way
from stillhook.validate.truth import Defect, write_campaign
from stillhook.validate.validation import Validation

STORE = Path(__file__).resolve().parent / "truth-trials.json"
SEEDS = range(100)
APART = range(200, 210)
DEFECT_SEEDS = range(2)
DIGITS = 4
WORKERS = 2
FIGURES = ("2b", "2b-s")
"""Lines whose value and interval are kept."""


class Trial(NamedTuple):
    """One campaign: seed; defect, "" for none; apart: capacitance, leakage and inertia 10 to 30 % off."""

    seed: int
    defect: str = ""
    apart: bool = False

    @property
    def key(self) -> str:
        return "-".join([self.defect or ("apart" if self.apart else "none"), str(self.seed)])


def trials() -> Iterator[Trial]:
    """What to know first comes first."""
    yield from (Trial(DEFECT_SEEDS[0], defect.value) for defect in Defect)
    yield from (Trial(seed) for seed in SEEDS[:10])
    yield from (Trial(seed, apart=True) for seed in APART[:4])
    yield from (Trial(seed, defect.value) for seed in DEFECT_SEEDS[1:] for defect in Defect)
    yield from (Trial(seed) for seed in SEEDS[10:])
    yield from (Trial(seed, apart=True) for seed in APART[4:])


def outcome(trial: Trial) -> dict[str, Any]:
    """What validation says of a campaign, short enough for a file; figures in SI."""
    with TemporaryDirectory() as folder:
        defect = Defect(trial.defect) if trial.defect else None
        written = write_campaign(Path(folder) / "tests", seed=trial.seed, defect=defect, apart=trial.apart)
        truth = tomllib.loads(written.truth.read_text(encoding="utf-8"))["crane"]
        known = {n: _short(truth[n]["value"]) for n in ("capacitance", "leakage", "inertia")}
        try:
            found = validate(written.campaign)
            told = list(dict.fromkeys(t for step in found.steps for t in step.statements)) + found_on_the_way(found)
            return {"truth": known, **_found(found), **({"statements": told} if defect and found.passed else {})}
        except StillhookError as refused:
            return {"truth": known, "refused": str(refused).replace(folder, "")}


def _found(found: Validation) -> dict[str, Any]:
    measures = {line.key: line.measure for line in found.lines if line.key in FIGURES}
    figures = {key: [_short(x) for x in (m.value, m.low, m.high)] for key, m in measures.items() if m is not None}
    tuned = found.step(StepNumber.DYNAMICS).data.get("tuned", {})
    short = {name: [_short(x) for x in (t["factor"], t["low"], t["high"])] for name, t in tuned.items()}
    no = {line.key: line.message for line in found.lines if line.failed}
    return {"passed": found.passed, "no": no, "figures": figures, "tuned": short}


def _short(x: float | None) -> float | None:
    return None if x is None else float(f"{x:.{DIGITS}g}")


def kept() -> dict[str, Any]:
    """Outcomes by key of the trial, each with the code that it was computed by."""
    return json.loads(STORE.read_text(encoding="utf-8")) if STORE.is_file() else {}


def code() -> str:
    now = versions()
    return f"{now['code']}-{now['method']}"


def keep(outcomes: Mapping[str, Any]) -> None:
    """One line an outcome, in the order of the trials."""
    lines = [f"{json.dumps(t.key)}: {json.dumps(outcomes[t.key], ensure_ascii=False)}" for t in trials() if t.key in outcomes]
    STORE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8", newline="\n")


def main(wanted: list[str]) -> None:
    done, now = kept(), code()
    todo = [t for t in trials() if t.key not in done or ("--new" in wanted and done[t.key]["code"] != now)]
    most = next((int(w) for w in wanted if w.isdigit()), len(todo))
    with ProcessPoolExecutor(WORKERS) as pool:
        for trial, found in zip(todo[:most], pool.map(outcome, todo[:most]), strict=True):
            done[trial.key] = {**found, "code": now}
            keep(done)
            print(trial.key, "refused" if "refused" in found else "passed" if found["passed"] else ", ".join(found["no"]), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
