"""The state of the crane in use: withdrawn where drift is shown, given back by a new certificate alone."""

from __future__ import annotations

import datetime
import getpass
import logging
import socket
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from stillhook.base.atomic import durable_file
from stillhook.errors import LiveError
from stillhook.library.certificate import read_certificate
from stillhook.library.condition import Entry, State, read_state, stands, state_file
from stillhook.library.crane_file import beside
from stillhook.library.toml.tree import Leaf, file_tree
from stillhook.live.condition.measured import Measured, hash_of
from stillhook.live.history.journal import lock
from stillhook.spec.crane import Crane
from stillhook.spec.validity import SHORT
from stillhook.trust.results import own_key
from stillhook.validate.data_set.campaign import Campaign

LOG = logging.getLogger("stillhook")


@dataclass(frozen=True)
class Standing:
    """Whether the certificate of the crane in use counts for planning. file: of the state, None where nothing is kept;
    entry: the last of its history; before: the state that was read; reason: why there is no state; todo: what the crane
    file lacks, a sentence."""

    file: Path | None
    state: State | None
    before: State | None = None
    reason: str = ""
    todo: str = ""

    @property
    def entry(self) -> Entry | None:
        return self.state.history[-1] if self.state is not None else None

    @property
    def withdrawn(self) -> bool:
        return self.entry is not None and self.entry.state == "withdrawn"


def crane_file_of(campaign: Campaign) -> Path | None:
    """The crane file that a campaign names, None where it is of the library."""
    path = campaign.file.parent / campaign.crane_name
    return path if campaign.crane_name.endswith(".toml") and path.is_file() else None


def next_state(measured: Sequence[Measured], drifts: Sequence[str]) -> Standing:
    """The state after the last campaign. measured: campaigns by date; drifts: a sentence for each number whose drift is
    shown. Nothing is written. Errors: SpecError for a state that was changed manually."""
    last = measured[-1].campaign
    crane, path = last.crane, crane_file_of(last)
    if path is None:
        return Standing(
            None, None, reason=f"{crane.name} is a crane of the library: it has no certificate to withdraw."
        )
    if crane.certified is None:
        return Standing(None, None, reason=f"{path.name} names no certificate: nothing is valid for planning yet.")
    file, named = state_file(path), file_tree(path)
    certificate, elsewhere = named.get("certificate"), named.get("condition")
    if not isinstance(certificate, Leaf):
        return Standing(
            None, None, reason=f"{path.name} has its certificate from its base: name the base in the campaign."
        )
    todo = f' Add condition = "{file.name}" as the first line of {path.name}: a copy without its state is then refused.'
    if isinstance(elsewhere, Leaf):
        file, todo = beside(path, "condition", str(elsewhere.value)), ""
    data = read_certificate(beside(path, "certificate", str(certificate.value)))
    state = read_state(file) if file.exists() else None
    entry = _change(state, data, crane, measured, drifts)
    checked = last.date.isoformat()
    if state is None and entry is None:
        return Standing(file, None, reason=f"certificate {crane.certified.short} was not passed: nothing to withdraw.")
    history = (*(state.history if state is not None else ()), *([entry] if entry is not None else []))
    return Standing(file, State(crane=crane.name, checked=checked, history=history), state, todo=todo)


def _change(
    state: State | None, data: dict[str, object], crane: Crane, measured: Sequence[Measured], drifts: Sequence[str]
) -> Entry | None:
    """The next entry of the history, None where nothing changes."""
    certified = crane.certified
    assert certified is not None
    last = state.history[-1] if state is not None else None
    after = [m for m in measured if m.campaign.date.isoformat() > certified.date]
    shown = "; ".join(drifts) if after else ""
    if last is not None and last.state == "withdrawn":
        if stands(last, data):
            return None
        reason = f"given back by certificate {certified.short} of {certified.date}"
        return _entry("valid", reason, last, crane, measured)
    if shown:
        return _entry("withdrawn", shown, last, crane, measured)
    if last is None and certified.passed:
        return _entry(
            "valid", f"certificate {certified.short} of {certified.date}, no drift shown since", None, crane, measured
        )
    if last is not None and last.certificate != certified.digest:
        return _entry("valid", f"new certificate {certified.short} of {certified.date}", last, crane, measured)
    return None


def _entry(state: str, reason: str, last: Entry | None, crane: Crane, measured: Sequence[Measured]) -> Entry:
    assert crane.certified is not None
    return Entry.model_validate(
        {
            "state": state,
            "when": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "who": _who(),
            "date": measured[-1].campaign.date.isoformat(),
            "reason": reason,
            "crane": hash_of(crane),
            "certificate": crane.certified.digest,
            "logs": tuple(sorted(_logs(measured))),
            "previous": None if last is None else last.digest,
        }
    )


def _logs(measured: Iterable[Measured]) -> set[str]:
    return {digest for m in measured for digest in m.logs.values()}


def _who() -> str:
    try:
        user = getpass.getuser()
    except (OSError, KeyError):  # a user without a name, as in containers
        user = "unknown"
    return f"{user} on {socket.gethostname() or 'unknown'}"


def write_state(standing: Standing) -> None:
    """Write the state where it says something new. Errors: LiveError where another process writes it, or has written it
    since it was read; SimulationError where it cannot be written."""
    file, state = standing.file, standing.state
    if file is None or state is None or (standing.before is not None and state.digest == standing.before.digest):
        return
    if (held := lock(file.parent, file.with_suffix(".lock").name)) is not None:
        with closing(held):
            if (read_state(file) if file.exists() else None) == standing.before:
                with durable_file(file) as part:
                    part.write_text(_signed(state, standing.before, file).text(), encoding="utf-8")
                return
    raise LiveError(f"{file}: another process writes it, or has since it was read. Run stillhook condition again.")


def _signed(state: State, before: State | None, file: Path) -> State:
    """A state signed by the user's own key, where that signed what was known before as well: nobody signs for what he
    has not written."""
    key = own_key()
    if key is not None and before is not None and not before.signed_by(key):
        file = file.resolve()
        LOG.warning(
            f"{file}: not signed, as what it was before is not signed by {key.name}. Check it, then sign: stillhook"
            f" certificate sign {file}"
        )
        key = None
    return state.signed(key)


def statement(standing: Standing) -> str:
    """The state in one sentence."""
    entry = standing.entry
    if entry is None or standing.state is None:
        return f"Valid for planning: no state. {standing.reason}"
    if entry.state == "withdrawn":
        return (
            f"NOT valid for planning since the campaign of {entry.date}: {entry.reason}. Only a new certificate gives"
            f" validity back (stillhook validate); certificate {entry.certificate[:SHORT]} does not count any more."
            f"{standing.todo}"
        )
    return f"Valid for planning by the campaigns until {standing.state.checked}: {entry.reason}.{standing.todo}"
