"""Files of a machine and of a lift: crane, case, lift, payload, compensator, sets, controller, state."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import stillhook
from fuzz.targets.registry import Form, Target, files
from stillhook.analysis.controllers import controller
from stillhook.formats.case_file import load_case
from stillhook.formats.lift.rigging_table import read_items
from stillhook.formats.lift_file import load_lift, place_in
from stillhook.formats.table.crane_sheet import crane_file_of_sheet, crane_sheet
from stillhook.library.catalogue import read_compensator, read_payload
from stillhook.library.condition import Entry, State, read_state
from stillhook.library.crane_file import load_crane
from stillhook.library.parameter_sets import load_set
from stillhook.library.write import crane_toml

LIBRARY = Path(stillhook.__file__).parent / "library" / "data"


def _crane(path: Path) -> object:
    """Reading, and writing what was read."""
    return crane_toml(load_crane(path))


def _sheet() -> Iterator[bytes]:
    """A crane as a table."""
    sheet = crane_sheet(load_crane("nov-250t"))
    yield "\n".join(",".join(f'"{cell}"' for cell in row) for row in (sheet.headings, *sheet.rows)).encode()


def _state() -> Iterator[bytes]:
    """A certificate that was given and withdrawn."""
    words = {"when": "2027-03-01T12:00:00Z", "who": "a", "crane": "c", "certificate": "d", "logs": ("l",)}
    first = Entry(state="valid", date="2027-03-01", reason="Passed.", **words)
    second = Entry(state="withdrawn", date="2027-04-01", reason="Drift.", previous=first.digest, **words)
    yield State(crane="c", checked="2027-04-01", history=(first, second)).text().encode()


TARGETS = (
    Target("crane", Form.TOML, _crane, "mine.toml", seeds=files(LIBRARY / "cranes", "*.toml"), share=3),
    Target("case", Form.TOML, load_case, "case.toml", share=3),
    Target("lift", Form.TOML, load_lift, "lift.toml", seeds=files(LIBRARY / "lifts", "*surface.toml"), share=2),
    Target("place", Form.TOML, place_in, "place.toml", share=1),
    Target("payload", Form.TOML, read_payload, "payload.toml", seeds=files(LIBRARY / "payloads", "*.toml"), share=2),
    Target("compensator", Form.TOML, read_compensator, "unit.toml", seeds=files(LIBRARY / "compensators", "*.toml")),
    Target(
        "set",
        Form.TOML,
        load_set,
        "set.toml",
        share=2,
        seeds=lambda: (p.read_bytes() for shelf in ("friction", "motors") for p in (LIBRARY / shelf).glob("*.toml")),
    ),
    Target("controller", Form.TOML, controller, "own.toml"),
    Target("state", Form.SEALED, read_state, "mine.condition.json", seeds=_state),
    Target("rigging", Form.TABLE, read_items, "rigging.csv"),
    Target("crane-sheet", Form.TABLE, crane_file_of_sheet, "crane.csv", seeds=_sheet),
)
