"""The state of a crane's condition, next to its file: whether its certificate counts for planning, and its history.

`stillhook condition` writes it; whoever reads a crane reads it. Every change is an entry: who, when, why, with hashes
of crane, certificate and logs, and of the entry before. The file carries a checksum as a certificate does, no
signature.
"""

from __future__ import annotations

import datetime
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from stillhook.base.gateway.guard import reader
from stillhook.base.kept.sealed import digest_of, read_sealed, sealed
from stillhook.errors import SpecError
from stillhook.spec.validity import SHORT, Condition
from stillhook.tables.table import Spec, Text

FORMAT = "stillhook condition 1"
_DO = "Restore the file that stillhook condition wrote, or validate again into another folder."


class Entry(Spec):
    """A change of the state. state: after it; when: UTC; who: user and machine; date: of the campaign that it is by;
    reason: one sentence; crane: hash of its content; certificate: its digest; logs: SHA-256 of all that were read by
    then; previous: hash of the entry before, None of the first."""

    state: Literal["valid", "withdrawn"]
    when: Text
    who: Text
    date: Text
    reason: Text
    crane: Text
    certificate: Text
    logs: tuple[Text, ...]
    previous: Text | None = None

    @property
    def digest(self) -> str:
        """Hash of the entry."""
        return hashlib.sha256(json.dumps(self.model_dump(mode="json"), sort_keys=True).encode()).hexdigest()


class State(Spec):
    """Contents of the file. checked: date of the last campaign that was read; history: oldest first."""

    format: Text = FORMAT
    crane: Text
    checked: Text
    history: tuple[Entry, ...]

    @property
    def digest(self) -> str:
        """Checksum of the contents."""
        return digest_of(self.model_dump(mode="json"))

    def text(self) -> str:
        """As the file has it."""
        return sealed(self.model_dump(mode="json"))


def state_file(crane_file: Path) -> Path:
    """Place of the state of a crane file: next to it."""
    return crane_file.with_suffix(".condition.json")


@reader(SpecError)
def read_state(path: Path) -> State:
    """The state in a file, complete and unchanged. Errors: SpecError of one line."""
    absent = ", and the crane file names it"
    data = read_sealed(path, FORMAT, "a condition's state", _DO, SpecError, absent=absent)
    try:
        state = State.model_validate({name: value for name, value in data.items() if name != "digest"})
        if all(_chained(state.history)):
            return state
    except (ValidationError, ValueError, RecursionError):
        pass
    raise SpecError(f"{path.name}: was changed after it was written: its history does not fit. {_DO}")


def _chained(history: Sequence[Entry]) -> Iterator[bool]:
    """Whether there is an entry, each names the one before, and dates are dates."""
    yield bool(history)
    for before, entry in zip((None, *history), history, strict=False):
        yield entry.previous == (None if before is None else before.digest)
        datetime.date.fromisoformat(entry.date)


def condition_of(path: Path, certificate: Mapping[str, Any]) -> Condition:
    """What the state in a file says of a certificate (contents of its file). Errors: SpecError of one line."""
    state = read_state(path)
    last = state.history[-1]
    if last.state == "valid" or not (against := stands(last, certificate)):
        return Condition(valid=True, date=state.checked, digest=state.digest)
    return Condition(valid=False, date=last.date, reason=against, digest=state.digest)


def stands(withdrawal: Entry, certificate: Mapping[str, Any]) -> str:
    """Why a withdrawal suspends a certificate, "" where the certificate gives validity back: a passed one, of a
    later date, of logs that the withdrawal has not seen."""
    if certificate["digest"] == withdrawal.certificate:
        return withdrawal.reason
    short = str(certificate["digest"])[:SHORT]
    seen = [log["test"] for log in certificate["campaign"]["logs"] if log["sha256"] in withdrawal.logs]
    if not certificate["passed"]:
        open_ = "was not passed"
    elif str(certificate["date"]) <= withdrawal.date:
        open_ = f"is of {certificate['date']}, not later than the campaign that showed the drift"
    elif seen:
        open_ = f"rests on logs from before (test {', '.join(seen)})"
    else:
        return ""
    return f"{withdrawal.reason} (certificate {short} {open_}, so it does not give validity back)"
