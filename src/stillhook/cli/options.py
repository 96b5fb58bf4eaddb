"""Options that several commands have alike."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.control.registry import Mode

CONTROLLERS = ", ".join(mode.value for mode in Mode if mode.compensates)
"""Controllers as help lists them."""
MODES = ", ".join(Mode)
"""Controllers and manual mode as help lists them."""

Json = Annotated[bool, typer.Option("--json", help="Print JSON in SI units.")]
Step = Annotated[str | None, typer.Option(help="Integration step (default 5 ms).")]
Store = Annotated[
    Path | None, typer.Option(help="Folder that keeps results as they finish; an interrupted run continues from it.")
]
Out = Annotated[
    Path | None, typer.Option("--out", help="Folder for NetCDF, pictures and JSON; nothing is written without it.")
]
