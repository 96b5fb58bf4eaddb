"""Outcomes of trials that take long, kept beside the pages: one line an outcome, in the order of the trials."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any


def read(store: Path) -> dict[str, Any]:
    """Outcomes by key, each with the code that it was computed by; none where there is no file."""
    return json.loads(store.read_text(encoding="utf-8")) if store.is_file() else {}


def write(store: Path, keys: Iterable[str], outcomes: Mapping[str, Any]) -> None:
    """Those of the keys that there are; an interrupted write leaves the file as it was."""
    lines = [f"{json.dumps(key)}: {json.dumps(outcomes[key], ensure_ascii=False)}" for key in keys if key in outcomes]
    new = store.with_suffix(".json.new")
    new.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8", newline="\n")
    new.replace(store)


def judging_code() -> str:
    """The code that computes and judges. The table of detection limits follows from the trials and is no part of it."""
    from stillhook.validate.certificate.certificate import method_hash, versions  # not for those who only keep a store
    from stillhook.validate.criteria.criteria import LIMITS_FILE

    return f"{versions()['code']}-{method_hash(LIMITS_FILE.name)}"
