"""Outcomes of trials that take long, kept beside their programme: one line an outcome, in the order of the trials; and
the run of what is not kept yet."""

from __future__ import annotations

import datetime
import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")
WORKERS = 2


def read(store: Path) -> dict[str, Any]:
    """Outcomes by key, each with the code that it was computed by; none where there is no file."""
    return json.loads(store.read_text(encoding="utf-8")) if store.is_file() else {}


def write(store: Path, keys: Iterable[str], outcomes: Mapping[str, Any]) -> None:
    """Those of the keys that there are; an interrupted write leaves the file as it was."""
    lines = [f"{json.dumps(key)}: {json.dumps(outcomes[key], ensure_ascii=False)}" for key in keys if key in outcomes]
    new = store.with_suffix(".json.new")
    new.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8", newline="\n")
    new.replace(store)


def write_parts(store: Path, parts: Mapping[str, Any]) -> None:
    """Results of named parts of a programme; those of others stay as they are."""
    store.write_text(json.dumps({**read(store), **parts}, indent=1) + "\n", encoding="utf-8", newline="\n")


def judging_code() -> str:
    """The code that computes and judges. The table of detection limits follows from the trials and is no part of it."""
    from stillhook.validate.certificate.content import method_hash, versions  # not for those who only keep a store
    from stillhook.validate.criteria.criteria import LIMITS_FILE

    return f"{versions()['code']}-{method_hash(LIMITS_FILE.name)}"


def run(
    store: Path,
    trials: Mapping[str, T],
    outcome: Callable[[T], dict[str, Any]],
    code: str,
    arguments: Sequence[str],
    group: Callable[[str], str] = str,
    workers: int = WORKERS,
) -> None:
    """Run trials by key, two at a time by default, and keep each outcome as soon as it is there: those not kept yet;
    with --new also what other code computed; of named groups alone (a key is a group of its own unless `group` says
    its); no more than a given number."""
    done = read(store)
    names = {a for a in arguments if a != "--new" and not a.isdigit()}
    groups = {key: group(key) for key in trials}
    if unknown := sorted(names.difference(groups.values())):
        raise SystemExit(f'Unknown trial "{unknown[0]}". Choose of {", ".join(dict.fromkeys(groups.values()))}.')
    todo = [key for key in trials if key not in done or ("--new" in arguments and done[key]["code"] != code)]
    todo = [key for key in todo if not names or groups[key] in names]
    todo = todo[: next((int(a) for a in arguments if a.isdigit()), None)]
    with ProcessPoolExecutor(max(1, min(workers, len(todo)))) as pool:
        running = {pool.submit(partial(_timed, outcome), trials[key]): key for key in todo}
        for future in as_completed(running):
            key, (found, seconds) = running[future], future.result()
            done[key] = {**found, "code": code, "date": datetime.date.today().isoformat()}
            write(store, trials, done)
            print(f"{key} ({seconds:.0f} s)", flush=True)


def _timed(outcome: Callable[[T], dict[str, Any]], trial: T) -> tuple[dict[str, Any], float]:
    start = time.perf_counter()
    return outcome(trial), time.perf_counter() - start


def states_of(outcomes: Mapping[str, Any]) -> str:
    """By how many states of the code outcomes were computed."""
    states = len({one["code"] for one in outcomes.values()})
    return "one state" if states == 1 else f"{states} states"
