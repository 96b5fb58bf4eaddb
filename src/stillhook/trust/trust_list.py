"""The keys that a user trusts, as a TOML file: of the user (`stillhook.trust.home`), or one that a plan names.

    [[key]]
    name = "Sea trials department"
    valid_from = 2026-01-01          # optional, first day
    valid_until = 2027-12-31         # optional, last day
    revoked = 2026-11-02             # optional; a revoked key is trusted on no day
    reason = "laptop stolen"
    public = '''
    -----BEGIN PUBLIC KEY-----
    ...
    '''

Days are those of UTC. A key that the user's own list revokes is revoked, whatever another list says of it.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from stillhook.base.atomic import atomic_file
from stillhook.base.choice import nearest
from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import TOML
from stillhook.base.gateway.parse import from_toml
from stillhook.errors import TrustError, UnreadableError
from stillhook.trust.home import TRUST, VARIABLE, home, open_to_others, replaceable
from stillhook.trust.keys import PublicKey, checked_name, public_of
from stillhook.units import quote

_HEAD = "# Keys that are trusted; stillhook certificate key trust writes this file.\n"
DAYS = ("valid_from", "valid_until", "revoked")
_FIELDS = ("name", "public", *DAYS, "reason")
LONGEST_REASON = 200
_GIVE = "Correct it, or remove it and trust each key again: stillhook certificate key trust PUBLIC.pem."


def utc_today() -> date:
    """The day of UTC by the clock of this machine."""
    return datetime.now(UTC).date()


@dataclass(frozen=True)
class TrustedKey:
    """A key, what the user calls its owner, the first and the last day on which it is trusted (None: no bound), and the
    day and reason of its revocation."""

    name: str
    public: PublicKey
    valid_from: date | None = None
    valid_until: date | None = None
    revoked: date | None = None
    reason: str = ""

    @classmethod
    def of(cls, name: str, public: PublicKey, first: date | None = None, last: date | None = None) -> TrustedKey:
        """A key that is trusted from a first to a last day. Errors: TrustError."""
        if first is not None and last is not None and last < first:
            raise TrustError(f"{name}: trusted until {last}, which is before {first}. Exchange the days.")
        return cls(checked_name(name), public, first, last)

    def revoking(self, day: date, reason: str) -> TrustedKey:
        """The same key, revoked. Errors: TrustError for a reason that is no printable line."""
        if not reason.strip() or not reason.isprintable() or len(reason) > LONGEST_REASON:
            raise TrustError(f"Reason {quote(reason)}: give one printable line of at most {LONGEST_REASON} characters.")
        return replace(self, revoked=day, reason=reason.strip())

    @property
    def days(self) -> str:
        """When it is trusted, in words."""
        if self.revoked is not None:
            return f"revoked on {self.revoked}: {self.reason or 'no reason stated'}"
        bounds = (("from", self.valid_from), ("until", self.valid_until))
        return " ".join(["trusted", *(f"{word} {day}" for word, day in bounds if day is not None)])


@dataclass(frozen=True)
class TrustList:
    """Keys with their file, which need not exist; clock: the day of today, for tests another one; label: whose list it
    is, for sentences."""

    file: Path
    keys: tuple[TrustedKey, ...] = ()
    clock: Callable[[], date] = field(default=utc_today, repr=False, compare=False)
    label: str = field(default="the user's list", compare=False)

    def entry(self, public: PublicKey) -> TrustedKey | None:
        """What it says of a key, which is the one of the same 32 bytes."""
        return next((each for each in self.keys if each.public.raw == public.raw), None)

    def trusting(self, key: TrustedKey) -> TrustList:
        """With a key, in place of what was said of it before."""
        return replace(self, keys=(*(k for k in self.keys if k.public.raw != key.public.raw), key))

    def with_revocations(self, other: TrustList) -> TrustList:
        """With the revocations of another list, also of keys that this one does not name."""
        return replace(self, keys=(*(k for k in self.keys if not _revoked_in(other, k)), *filter(_revoked, other.keys)))

    def text(self) -> str:
        """Its file."""
        return "\n".join([_HEAD, *map(_block, self.keys)])

    def write(self) -> None:
        """Write its file, in a folder that is closed to others where it is new. Errors: SimulationError where that is
        impossible."""
        with suppress(OSError):  # which the next line says
            self.file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with atomic_file(self.file) as part:
            part.write_text(self.text(), encoding="utf-8", newline="\n")


def users_trust(clock: Callable[[], date] = utc_today) -> TrustList:
    """The keys that the user trusts, none where there is no list yet: a link that leads nowhere is a list that is lost,
    its revocations with it. Errors: TrustError, one line."""
    file = home() / TRUST
    try:
        file.lstat()
    except FileNotFoundError:
        return TrustList(file, clock=clock)
    except OSError as problem:
        raise TrustError(f"{file}: cannot be read ({problem.strerror}). Choose a folder by {VARIABLE}.") from None
    trust = read_trust(file, clock)
    if reason := replaceable(file):
        raise TrustError(f"{file}: could be replaced by another user: {reason}. Close it, and look at who is in it.")
    return trust


def plans_trust(file: Path) -> TrustList:
    """The keys of a list that a plan names, less those that the user's list revokes. Errors: TrustError, one line."""
    named = replace(read_trust(file), label=f"the plan's list {file.name}")
    return named.with_revocations(users_trust())


def read_trust(file: Path, clock: Callable[[], date] = utc_today) -> TrustList:
    """The list of a file. Errors: TrustError, one line."""
    text = read_text(file, "list of trusted keys", TrustError, TOML)
    if rights := open_to_others(file, 0o022):
        raise TrustError(f"{file}: others may change it (rights {rights}). Take them away: chmod 644 {file}.")
    try:
        data = from_toml(text)
    except UnreadableError as problem:
        raise TrustError(f"{file.name}: not TOML ({problem}). {_GIVE}") from None
    rows = data.get("key", [])
    if {*data} - {"key"} or not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise TrustError(f"{file.name}: a list of trusted keys has tables [[key]] and nothing else. {_GIVE}")
    keys = tuple(_key(row, f"{file.name}: key {i}") for i, row in enumerate(rows, 1))
    if twice := next((k for i, k in enumerate(keys) if any(k.public.raw == o.public.raw for o in keys[:i])), None):
        raise TrustError(f"{file.name}: the key of {quote(twice.name)} is there twice. Leave one of them out.")
    return TrustList(file, keys, clock)


def _key(row: dict[str, Any], place: str) -> TrustedKey:
    for name in row:
        if name not in _FIELDS:
            raise TrustError(
                f"{place}: {quote(name)}: unknown field{nearest(name, _FIELDS)} Allowed: {', '.join(_FIELDS)}."
            )
    for name in ("name", "public"):
        if not isinstance(row.get(name), str):
            raise TrustError(f'{place}: {name} is missing, or no text. Write {name} = "...".')
    for name in DAYS:
        if name in row and type(row[name]) is not date:
            raise TrustError(f"{place}: {name} = {quote(row[name])}: give a day without quotes, such as 2026-11-21.")
    reason = row.get("reason", "")
    if not isinstance(reason, str) or not reason.isprintable():
        raise TrustError(f"{place}: reason = {quote(reason)}: give a text of one printable line.")
    try:
        key = TrustedKey.of(
            row["name"], public_of(row["public"], "public"), row.get("valid_from"), row.get("valid_until")
        )
    except TrustError as problem:
        raise TrustError(f"{place}: {problem}") from None
    return replace(key, revoked=row.get("revoked"), reason=reason)


def _revoked(key: TrustedKey) -> bool:
    return key.revoked is not None


def _revoked_in(other: TrustList, key: TrustedKey) -> bool:
    of = other.entry(key.public)
    return of is not None and _revoked(of)


def _block(key: TrustedKey) -> str:
    """Lines of a key."""
    days = [f"{name} = {day}" for name in DAYS if (day := getattr(key, name)) is not None]
    reason = [f"reason = {_quoted(key.reason)}"] if key.reason else []
    public = f"public = '''\n{PublicKey(key.public.raw).pem()}'''"
    return "\n".join(["[[key]]", f"name = {_quoted(key.name)}", *days, *reason, public, ""])


def _quoted(text: str) -> str:
    """A printable text as a string of TOML, which JSON's strings are as well."""
    return json.dumps(text, ensure_ascii=False)
