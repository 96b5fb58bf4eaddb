"""Entries: a controller, the settings that it runs with, and the leads that are tried.

An entry of a user is one file: a controller's module as docs/how-to/add-a-controller.md has it, in which
`ENTRY` may be its tables of a crane file and `LEADS` the leads that are tried [s]; or the TOML file of a controller.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.analysis.controllers import Changes, Controller, controller
from stillhook.control.registry import CONTROLLERS, Mode

SHIPPED = ("ns", "hs", "ssc", "ssc-cubic", "ff", "rope")
"""Shipped controllers that are entries, where they are there."""
PUBLISHED, REFERENCE = "ssc-published", "strong-ssc"
"""SSC with the settings of the crane file, which nothing is chosen for; SSC at its best, by which all are measured."""
LEADS = "LEADS"
ENTRY = "ENTRY"


class Entry(NamedTuple):
    """name as in tables; mode of the controller; tables of a crane file with its settings; leads that are tried [s],
    None for those of the benchmark; fixed: runs with the settings of the crane file."""

    name: str
    mode: Mode
    tables: Changes
    leads: Sequence[float] | None = None
    fixed: bool = False


def shipped() -> list[Entry]:
    """Our own controllers."""
    named = [Entry(PUBLISHED, Mode("ssc"), {}, fixed=True), Entry(REFERENCE, Mode("ssc"), {})]
    return named + [Entry(n, Mode(n), {}) for n in SHIPPED if n in CONTROLLERS and n != "ssc"]


def entry(file: Path) -> Entry:
    """The entry of a file; a module's must be among the extensions (`__main__` sees to it)."""
    if file.suffix == ".toml":
        one: Controller = controller(file)
        tables: Any = one.changes
        return Entry(one.name, one.mode, tables)
    law = next(k for k in CONTROLLERS.values() if not k.shipped and k.file == file.resolve())
    module = sys.modules[law.cycle.__module__]
    tables = getattr(module, ENTRY, {})
    return Entry(law.name, Mode(law.name), tables, getattr(module, LEADS, None))
