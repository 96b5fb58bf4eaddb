"""Options that several commands share.

`--scheduler ADDRESS`: the workers of a dask.distributed cluster instead of this machine's threads.

Files that a command leaves in a folder: checked before anything runs, written all or none, and announced.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from stillhook.base.atomic import check_folder
from stillhook.control.registry import Mode
from stillhook.errors import CommandError, SimulationError
from stillhook.units import quote


def refuse(options: Mapping[str, Any], reason: str) -> None:
    """Refuse options that are given and have no meaning here. Errors: CommandError."""
    for name, value in options.items():
        if value is not None and value is not False:
            raise CommandError(f"{name}: {reason}")


CONTROLLERS = ", ".join(mode.value for mode in Mode if mode.compensates)
"""Controllers as help lists them."""
USUAL = " Default: the usual ones of the winch type, ns,hs,ssc on a closed circuit."
"""End of the help of an option that names controllers."""
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


Spread = Annotated[float | None, typer.Option(help="Short-crested waves: exponent n of cos^n about the heading.")]
LiftArgument = Annotated[
    str, typer.Argument(metavar="LIFT.toml", help="Lift file, or one of the library's; a wrong name lists them.")
]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", help='Address of a Dask scheduler, such as "tcp://10.0.0.1:8786".')
]
FACTORS_HELP = "Table of factors on forecast heights: a name, or a file (TOML, CSV, XLSX)."
PATIENCE = 15.0
"""Time for a scheduler to answer, and then for its first worker [s]."""


@contextmanager
def client_of(address: str | None) -> Iterator[Any]:
    """A client of the scheduler at this address, closed at the end; None without an address.

    Errors: SimulationError, one line, where dask.distributed is not installed, no scheduler answers, or it has no
    workers.
    """
    if address is None:
        yield None
        return

    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError:
        raise SimulationError(
            '--scheduler: dask.distributed is not installed. Install it with pip install "stillhook[dask]", here and on'
            " every worker."
        ) from None
    try:
        get_address_host_port(address)  # a client with no address complains once more when it is collected
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as e:
        reason = " ".join(str(e).split())[:120] or type(e).__name__
        raise SimulationError(
            f"--scheduler {quote(address)}: no Dask scheduler answers ({reason})."
            " Start one with dask scheduler, and give its address."
        ) from None
    try:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise SimulationError(
                f"--scheduler {quote(address)}: no workers. Start some with dask worker {address}."
            ) from None
        yield client
    finally:
        client.close()


def check_out(out: Path | None, names: Iterable[str]) -> None:
    """Refuse a folder that files of these names cannot be written to, before the work is done. None: nothing to
    write."""
    if out is not None:
        check_folder(out, tuple(names))


def write_out(
    out: Path,
    files: Mapping[str, Any],
    *,
    quiet: bool,
    hint: bool = True,
    pictures: Callable[[], Mapping[str, Any]] | None = None,
) -> None:
    """Write files by name as `stillhook.formats.results.save_files` does, and announce them unless quiet.

    pictures: draws figures by name; without the extra `report` they are left out, and with hint a line says so.
    """
    from stillhook.formats.results import save_files

    if pictures is not None:
        from stillhook.report.pictures import drawn

        files = {**drawn(pictures), **files}
    save_files(out, files)
    announce(out, files, quiet=quiet)
    if pictures is not None and hint:
        say_left_out()


def say_left_out(*, pdf: bool = False) -> None:
    """Say on standard error which files were left out because the extra `report` is missing. pdf: whether one belongs
    to what the command writes."""
    from stillhook.report.pictures import left_out
    from stillhook.report.terminal import say

    if line := left_out(pdf=pdf):
        say(line)


def announce(out: Path, names: Iterable[str], *, quiet: bool = False) -> None:
    """Print which files a folder now has."""
    if not quiet:
        print("written: " + ", ".join(str(out / name) for name in names))
