"""Campaigns that are given one by one or found in a folder; what people have stated of the crane between them."""

from __future__ import annotations

import datetime
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator

from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import TOML
from stillhook.base.gateway.inputs import note_input
from stillhook.base.gateway.named_files import allowing
from stillhook.base.gateway.parse import from_toml
from stillhook.errors import LiveError, StillhookError, UnreadableError
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.live.condition.followed import FOLLOWED
from stillhook.tables.table import Spec, Text
from stillhook.units import quote
from stillhook.validate.data_set.campaign import Campaign, load_campaign

CAMPAIGN, EVENTS = "campaign.toml", "events.toml"
"""Names of the files that a folder is searched for."""
SETTLED = 30.0
"""Seconds since the last write to a campaign in a folder from which it counts as complete."""


class Event(Spec):
    """A table [[event]]. A repair changes the crane, a sensor its reading alone."""

    date: Annotated[datetime.date, Field(strict=True)]
    what: Literal["repair", "sensor"] = Field(description="repair: of the crane; sensor: changed or calibrated")
    numbers: tuple[Text, ...] = Field(min_length=1, description="numbers that it can have changed")
    note: Text | None = Field(default=None, description="who did what")

    @field_validator("numbers")
    @classmethod
    def _known(cls, numbers: tuple[str, ...]) -> tuple[str, ...]:
        if unknown := [name for name in numbers if name not in FOLLOWED]:
            raise ValueError(f"{quote(unknown[0])}: no number that is followed. Choose of {', '.join(FOLLOWED)}.")
        return numbers


class EventsFile(Spec):
    """What was done to a crane between its campaigns."""

    event: tuple[Event, ...] = ()


@dataclass(frozen=True)
class Gathered:
    """campaigns by date; refused: one line each; waiting: campaigns of a folder that are not complete, with the
    reason."""

    campaigns: tuple[Campaign, ...]
    events: tuple[Event, ...]
    refused: tuple[str, ...]
    waiting: tuple[str, ...]


def gather(sources: Sequence[str | Path], *, out: Path | None = None, vanished: bool = False) -> Gathered:
    """Read the campaigns.

    Parameters: sources: campaign files, and folders with campaigns at any depth, each in its `campaign.toml`; out: a
    folder that is not searched; vanished: whether a folder may be away for a while, as while it is watched.
    A folder that is given allows campaigns to name files anywhere in it (`stillhook.base.gateway.named_files`).
    A file that is given and cannot be read is an error; one in a folder is refused in a line, and the others count.
    Errors: StillhookError of one line.
    """
    campaigns: list[Campaign] = []
    events: list[Event] = []
    refused, waiting = [], []
    folders = [path for path in map(Path, sources) if path.is_dir()]
    with allowing(folders):
        for source in map(Path, sources):
            if source.is_file():
                campaigns.append(load_campaign(source))
                continue
            if not source.is_dir():
                if vanished:
                    waiting.append(f"{source}: not there now")
                    continue
                raise LiveError(f"{source}: no such campaign file or folder. Check the path.")
            if (source / EVENTS).is_file():
                note_input(source / EVENTS)
                events += _events(source / EVENTS)
            for file in _campaigns_in(source, out):
                if reason := _incomplete(file):
                    waiting.append(f"{file}: {reason}")
                    continue
                note_input(file)
                try:
                    campaigns.append(load_campaign(file))
                except StillhookError as problem:
                    refused.append(f"{file}: {problem}")
    once = {c.file.resolve(): c for c in campaigns}
    ordered = sorted(once.values(), key=lambda c: (c.date, str(c.file)))
    return Gathered(tuple(ordered), tuple(sorted(events, key=lambda e: e.date)), tuple(refused), tuple(waiting))


def _campaigns_in(folder: Path, out: Path | None) -> Iterable[Path]:
    inside = out.resolve() if out is not None else None
    for file in sorted(folder.rglob(CAMPAIGN)):
        if inside is None or inside not in file.resolve().parents:
            yield file


def _events(path: Path) -> tuple[Event, ...]:
    def read(table: TomlTable) -> tuple[Event, ...]:
        return table.read(EventsFile).event

    return read_toml(path, FileKind.EVENTS, LiveError, read)


def _incomplete(file: Path) -> str:
    """Why a campaign in a folder is not complete yet, "" where it is: a log is missing or empty, or something was
    written a moment ago."""
    paths = [file]
    try:
        tests = from_toml(read_text(file, "campaign", LiveError, TOML)).get("test", [])
        paths += [file.parent / t["log"] for t in tests if isinstance(t, dict) and isinstance(t.get("log"), str)]
    except (LiveError, UnreadableError, TypeError):
        pass  # half written, or broken: its age says which
    for path in paths:
        try:
            of = path.stat()
        except OSError:
            return f"{path.name} is not there yet"
        if not of.st_size:
            return f"{path.name} is empty"
        if 0.0 <= time.time() - of.st_mtime < SETTLED:
            return f"{path.name} was written less than {SETTLED:g} s ago"
    return ""
