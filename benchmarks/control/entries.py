"""Entries: a controller, the settings that it runs with, and the leads that are tried.

An entry of a user is one file: a controller's module as docs/how-to/add-a-controller.md has it, in which
`ENTRY` may be its tables of a crane file and `LEADS` the leads that are tried [s]; the TOML file of a controller; or an
FMU with a controller in it (`fmu`).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.control.fmu import GAIN, LEADS_OF, ControllerFmu, controller_fmu
from stillhook.analysis.controllers import Changes, Controller, controller
from stillhook.control.registry import CONTROLLERS, DEFAULT_MODE, Mode
from stillhook.errors import SpecError

SHIPPED = ("ns", "hs", "ssc", "ssc-cubic", "ssc-optimal", "ssc-scheduled", "ff", "rope")
"""Shipped controllers that are entries, where they are there."""
PUBLISHED, REFERENCE = "ssc-published", "strong-ssc"
"""SSC with the settings of the crane file, which nothing is chosen for; SSC at its best, by which all are measured."""
LEADS = "LEADS"
ENTRY = "ENTRY"
PREDICTS: Changes = {"control": {"prediction": {"kind": "modes"}}}


class Entry(NamedTuple):
    """name as in tables; mode of the controller; tables of a crane file with its settings; leads that are tried [s],
    None for those of the benchmark; fixed: runs with the settings of the crane file; fmu: what calculates the commands
    in place of the mode."""

    name: str
    mode: Mode
    tables: Changes
    leads: Sequence[float] | None = None
    fixed: bool = False
    fmu: ControllerFmu | None = None

    @property
    def own(self) -> bool:
        """Whether it is a user's."""
        return self.fmu is not None or self.name not in (PUBLISHED, REFERENCE, *SHIPPED)

    @property
    def takes_lead(self) -> bool:
        """Whether leads are tried."""
        return not self.fixed if self.fmu is None else LEADS_OF[0] in self.fmu.tunable

    @property
    def takes_gain(self) -> bool:
        """Whether K_p can be set."""
        return self.fmu is None or GAIN in self.fmu.tunable


def shipped() -> list[Entry]:
    """Our own controllers."""
    named = [Entry(PUBLISHED, Mode("ssc"), {}, fixed=True), Entry(REFERENCE, Mode("ssc"), {})]
    return named + [Entry(n, Mode(n), {}) for n in SHIPPED if n in CONTROLLERS and n != "ssc"]


def entries_with(files: Sequence[Path]) -> list[Entry]:
    """Our own controllers, and those in files. Errors: StillhookError."""
    found = [*shipped(), *map(entry, files)]
    names = [e.name for e in found]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SpecError(f'Two entries are called "{twice}". Rename a file, or the NAME in it.')
    return found


def entry(file: Path) -> Entry:
    """The entry of a file; a module's must be among the extensions (`__main__` sees to it). Errors: StillhookError."""
    if file.suffix == ".toml":
        one: Controller = controller(file)
        tables: Any = one.changes
        return Entry(one.name, one.mode, tables)
    if file.suffix == ".fmu":
        return Entry(file.stem, Mode(DEFAULT_MODE), {}, fmu=controller_fmu(file))
    law = next(k for k in CONTROLLERS.values() if not k.shipped and k.file == file.resolve())
    module = sys.modules[law.cycle.__module__]
    tables = getattr(module, ENTRY, {})
    return Entry(law.name, Mode(law.name), tables, getattr(module, LEADS, None))
