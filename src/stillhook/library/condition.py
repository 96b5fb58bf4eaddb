"""The state of a crane's condition, next to its file: whether its certificate counts for planning, and its history.

`stillhook condition` writes it; whoever reads a crane reads it. Every change is an entry: who, when, why, with hashes
of crane, certificate and logs, and of the entry before. The file carries a checksum as a certificate does, and a
signature where its writer has a key.
"""

from __future__ import annotations

import datetime
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from stillhook.base.atomic import durable_file
from stillhook.base.gateway.guard import reader
from stillhook.base.kept.sealed import SIGNATURE, digest_of, read_sealed, sealed
from stillhook.errors import SpecError
from stillhook.spec.validity import SHORT, Condition
from stillhook.tables.table import Spec, Text
from stillhook.trust.keys import SigningKey
from stillhook.trust.signature import Signed, sign, signature_of
from stillhook.trust.standing import Judgement, judge
from stillhook.trust.trust_list import TrustList

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
    """Contents of the file. checked: date of the last campaign that was read; history: oldest first; signature: of all
    else, as `stillhook.trust.signature.Signature.to_dict`, None for none."""

    format: Text = FORMAT
    crane: Text
    checked: Text
    history: tuple[Entry, ...]
    signature: Mapping[str, str] | None = None

    @property
    def digest(self) -> str:
        """Checksum of the contents without the signature."""
        return digest_of(self.model_dump(mode="json"))

    def text(self) -> str:
        """As the file has it."""
        without = {SIGNATURE} if self.signature is None else None
        return sealed(self.model_dump(mode="json", exclude=without))

    def signed(self, key: SigningKey | None) -> State:
        """With a signature of this key in place of any before; of no key without one."""
        made = None if key is None else sign(Signed.CONDITION, self.digest, key).to_dict()
        return self.model_copy(update={"signature": made})

    def signed_by(self, key: SigningKey) -> bool:
        """Whether its signature, which fits, is one of this key."""
        return self.signature is not None and self.signature["public"] == key.public.raw

    def judged(self, trust: TrustList) -> Judgement:
        """How its signature stands with a trust list."""
        return judge(signature_of(self.signature), Signed.CONDITION, self.digest, trust)


ENDING = ".condition.json"
"""Of the name of a state."""


def state_file(crane_file: Path) -> Path:
    """Place of the state of a crane file: next to it."""
    return crane_file.with_suffix(ENDING)


def is_state(path: Path) -> bool:
    """Whether a file is a state by its name."""
    return path.name.endswith(ENDING)


@reader(SpecError)
def read_state(path: Path) -> State:
    """The state in a file, complete and unchanged. Errors: SpecError of one line."""
    absent = ", and the crane file names it"
    data = read_sealed(path, FORMAT, "a condition's state", _DO, SpecError, absent=absent)
    try:
        state = State.model_validate({name: value for name, value in data.items() if name != "digest"})
        signature = signature_of(state.signature)
        fits = signature is None or signature.fits(Signed.CONDITION, state.digest)
        if fits and all(_chained(state.history)):
            return state
    except (ValidationError, ValueError, RecursionError):
        pass
    raise SpecError(f"{path.name}: was changed after it was written: history or signature does not fit. {_DO}")


def sign_state(path: Path, key: SigningKey) -> State:
    """Sign the state in a file in place of any signature before. Gives it as it is signed now. Errors: as `read_state`;
    SimulationError where it cannot be written."""
    made = read_state(path).signed(key)
    with durable_file(path) as part:
        part.write_text(made.text(), encoding="utf-8")
    return made


def _chained(history: Sequence[Entry]) -> Iterator[bool]:
    """Whether there is an entry, each names the one before, and dates are dates."""
    yield bool(history)
    for before, entry in zip((None, *history), history, strict=False):
        yield entry.previous == (None if before is None else before.digest)
        datetime.date.fromisoformat(entry.date)


def condition_of(path: Path, certificate: Mapping[str, Any], trust: TrustList) -> Condition:
    """What the state in a file says of a certificate (contents of its file), and who vouches for it. Errors: SpecError
    of one line."""
    state = read_state(path)
    last = state.history[-1]
    if last.state == "valid" or not (against := stands(last, certificate)):
        condition = Condition(valid=True, date=state.checked, digest=state.digest)
    else:
        condition = Condition(valid=False, date=last.date, reason=against, digest=state.digest)
    return condition.judged(state.judged(trust))


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
