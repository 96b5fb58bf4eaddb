"""Arguments and options that several commands share, and the case that they describe.

A scheduler's address: the workers of a dask.distributed cluster instead of this machine's threads.

Files that a command leaves in a folder: checked before anything runs, written all or none, and announced.
"""

from __future__ import annotations

import logging
import os
import re
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.base.atomic import check_folder
from stillhook.cli.groups import FOLDER, VERBOSE, WORDS, WRITES
from stillhook.errors import CommandError, MotionError, SimulationError
from stillhook.units import quote

if TYPE_CHECKING:
    from stillhook.formats.case_file import Subject
    from stillhook.report.terminal import Answer
    from stillhook.sea.motion.motion import Motion
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Scenario


def refuse(options: Mapping[str, Any], reason: str) -> None:
    """Refuse options that are given and have no meaning here. Errors: CommandError."""
    for name, value in options.items():
        if value is not None and value is not False:
            raise CommandError(f"{name}: {reason}")


def declared(room: str, folder: str) -> dict[str, bool]:
    """Names that the modules of a room's folder declare, and whether each compensates, read from their text without
    importing them, in the order of lists; with modules of the user those that are registered."""
    from stillhook.base.extensions import VARIABLE

    if os.environ.get(VARIABLE):
        from stillhook.control.registry import CONTROLLERS
        from stillhook.winches.registry import WINCH_TYPES

        laws = {law.name: law.compensates for law in CONTROLLERS.values()}
        return laws if room == "control" else dict.fromkeys(WINCH_TYPES, True)
    modules = []
    for path in sorted((FOLDER.parent / room / folder).glob("*.py")):
        text = path.read_text(encoding="utf-8")
        if name := re.search(r'^NAME = "(.*)"', text, re.MULTILINE):
            order = re.search(r"^ORDER = (.*)", text, re.MULTILINE)
            compensates = not re.search("^COMPENSATES = False", text, re.MULTILINE)
            modules.append((float(order[1]) if order else 0.0, name[1], compensates))
    return {name: compensates for _, name, compensates in sorted(modules, key=lambda module: module[0])}


_CONTROLLERS = declared("control", "controllers")
CONTROLLERS = ", ".join(name for name, compensates in _CONTROLLERS.items() if compensates)
"""Controllers as help lists them."""
USUAL = " Default: the usual ones of the winch type, ns,hs,ssc on a closed circuit."
"""End of the help of an option that names controllers."""
MODES = ", ".join(_CONTROLLERS)
"""Controllers and manual mode as help lists them."""
FACTORS_HELP = "Table of factors on forecast heights: a name, such as dnv-os-h101#B, or a file (TOML, CSV, XLSX)."
PATIENCE = 15.0
"""Time for a scheduler to answer, and then for its first worker [s]."""
PYTHON_POSITION = re.compile(r'tip=\("([^"]+)", "([^"]+)", "([^"]+)"\)')
"""How the readers of logs name the place of a crane tip."""
CASE_POSITION = 'tip = { file = "...", position = ["%s", "%s", "%s"] } in a case file'
"""The same in a case file, around its three lengths."""
CRANE_HELP = "Library crane, or path of a crane file."
MAPPING_HELP = "Mapping file (TOML): which column is what, as stillhook inspect FILE --save MAPPING.toml writes it."
COLUMN_HELP = (
    'A column of the file, as often as needed: name=heading [unit], and "down" where it counts the other way:'
    ' "heave=MRU_Heave_m [m] down".'
)
MOTION_HELP = 'Tip motion: "sine 2.8 m 12 s" (amplitude, period; sums with +), a log, or the tip.json of stillhook tip.'

CraneArgument = Annotated[str, typer.Argument(metavar="CRANE", help=CRANE_HELP)]
SubjectArgument = Annotated[
    str,
    typer.Argument(
        metavar="CRANE|CASE",
        help="Library crane, path of a crane file, or case file: crane, [scenario] and [settings].",
    ),
]
LiftArgument = Annotated[
    str, typer.Argument(metavar="LIFT.toml", help="Lift file, or one of the library's; a wrong name lists them.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in SI units.")]
Out = Annotated[
    Path | None, typer.Option("--out", help="Folder for pictures, tables and numbers; nothing is written without it.")
]
Controllers = Annotated[
    str | None, typer.Option(help=f"Controllers, {CONTROLLERS}, strong-ssc or TOML files, with commas.{USUAL}")
]
Load = Annotated[str | None, typer.Option(help='Payload on the hook (default "100 t").')]
WireOut = Annotated[str | None, typer.Option("--s-w", help='Wire paid out (default "100 m").')]
MotionText = Annotated[str | None, typer.Option("--motion", help=MOTION_HELP)]
Duration = Annotated[str | None, typer.Option(help='Length of the run, such as "300 s".')]
Draws = Annotated[int, typer.Option(help="Draws of what is uncertain; preferably a power of two.")]
Ship = Annotated[
    str | None, typer.Option(help='Where the bow points, clockwise from north, for measured directions: "30 deg".')
]
Record = Annotated[
    str | None,
    typer.Option(help="Of a file of measured waves: one record, its number from 0 or time, 1996-01-05T12:00 (UTC)."),
]
MappingFile = Annotated[Path | None, typer.Option("--mapping", help=MAPPING_HELP)]
Columns = Annotated[list[str] | None, typer.Option("--column", help=COLUMN_HELP)]
Spread = Annotated[float | None, typer.Option(help="Short-crested waves: exponent n of cos^n about the heading.")]


def case_of(
    subject: Subject,
    usual: Mapping[str, Any],
    load: str | None = None,
    s_w: str | None = None,
    motion: str | None = None,
    duration: str | None = None,
) -> Scenario:
    """The scenario of a command: that of its case file, or the usual one, with the options that were typed."""
    from stillhook.sea.motion.recorded import Recorded

    typed: dict[str, Any] = {"load": load, "s_w": s_w, "duration": duration}
    if motion is not None:
        typed["tip"] = motion_of(motion, duration)
        if duration is not None and isinstance(typed["tip"], Recorded):  # a log is cut as it is read
            usual = {name: value for name, value in usual.items() if name != "duration"}
            del typed["duration"]
    return subject.case(usual, typed)


def motion_of(text: str, duration: str | None = None) -> Motion:
    """A motion text, or the log that it names."""
    from stillhook.sea.motion.words import parse_motion

    if text.strip().split(" ")[0].lower() in ("sine", "still"):
        return parse_motion(text, "--motion")
    if not os.path.exists(text):
        raise MotionError(
            f'--motion {quote(text)}: no such file, and not a motion such as "sine 2.8 m 12 s". Check the path.'
        )
    from stillhook.formats.motion.open import read_tip_motion, stored_motion

    try:
        return stored_motion(text) or read_tip_motion(text, duration=duration)
    except MotionError as e:
        raise typed_position(e, CASE_POSITION) from None


def typed_position(problem: MotionError, form: str) -> MotionError:
    """The refusal of a log, with the place of the crane tip as it is typed: form, around its three lengths."""
    lines = (PYTHON_POSITION.sub(lambda place: form % place.groups(), line) for line in (str(problem), *problem.lines))
    line, *more = lines
    return MotionError(line).with_lines(more)


@contextmanager
def client_of(address: str | None) -> Iterator[Any]:
    """A client of the scheduler at this address, closed at the end; None without an address.

    Errors: SimulationError, one line, where dask.distributed is not installed, the scheduler is beyond this machine and
    not spoken to by TLS, none answers, or it has no workers.
    """
    if address is None:
        yield None
        return

    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError:
        raise SimulationError(
            'scheduler: dask.distributed is not installed. Install it with pip install "stillhook[dask]", here and on'
            " every worker."
        ) from None
    from stillhook.engine.tasks.cluster import check_address, check_certificates  # heavy

    check_address(address)
    check_certificates(address)
    for name in ("distributed", "distributed.client", "distributed.worker"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what it says in pages is said here in a line
    try:
        host, port = get_address_host_port(address)  # a client with no address complains once more when it is collected
        socket.getaddrinfo(host, port)  # a client tries again for `PATIENCE` what no name server knows
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as e:
        reason = " ".join(str(e).split())[:120] or type(e).__name__
        raise SimulationError(
            f"scheduler {quote(address)}: no Dask scheduler answers ({reason})."
            " Start one with dask scheduler, and give its address."
        ) from None
    try:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise SimulationError(
                f"scheduler {quote(address)}: no workers. Start some with dask worker {address}."
            ) from None
        yield client
    finally:
        client.close()


def check_out(out: Path | None, names: Iterable[str]) -> None:
    """Refuse a folder that files of these names cannot be written to, before the work is done. None: nothing to
    write."""
    if out is not None:
        check_folder(out, tuple(names))


def present(
    answer: Any,
    out: Path | None = None,
    files: Mapping[str, Any] | None = None,
    *,
    brief: Callable[[], Answer],
    json: bool,
    show: Callable[[], None] | None = None,
    pictures: Callable[[], Mapping[str, Any]] | None = None,
    cranes: Sequence[Crane] = (),
) -> None:
    """Print an answer: with json in SI, else in brief, with --verbose all of it, as `show` prints it where that is
    given; and write files and pictures of cranes into a folder, as `write_out` does."""
    from stillhook.report.terminal import print_json

    if json:
        print_json(answer)
    elif show is not None and VERBOSE.get():
        show()
    else:
        say_answer(brief())
    if out is not None and files is not None:
        write_out(out, files, pictures=pictures, quiet=json, cranes=cranes)


def say_answer(answer: Answer) -> None:
    """Print an answer in brief; with --verbose all of it."""
    from stillhook.report.terminal import print_answer, print_in_full

    if VERBOSE.get():
        print_in_full(answer)
    else:
        print_answer(answer, files=WRITES.get())


def write_out(
    out: Path,
    files: Mapping[str, Any],
    *,
    quiet: bool,
    hint: bool = True,
    pictures: Callable[[], Mapping[str, Any]] | None = None,
    cranes: Sequence[Crane] = (),
) -> None:
    """Write files by name as `stillhook.formats.results.save_files` does, and announce them unless quiet.

    pictures: draws figures by name; without the extra `report` they are left out, and with hint a line says so.
    cranes: those that the files follow from, for their manifest.
    """
    from stillhook.formats.results import save_files
    from stillhook.spec.crane import identity

    if pictures is not None:
        from stillhook.report.kit import draw_if_possible

        files = {**draw_if_possible(pictures), **files}
    save_files(out, files, WORDS.get(), [identity(crane) for crane in cranes])
    announce(out, files, quiet=quiet)
    if pictures is not None and hint:
        say_left_out()


def say_left_out(*, pdf: bool = False) -> None:
    """Say on standard error which files were left out because the extra `report` is missing. pdf: whether one belongs
    to what the command writes."""
    from stillhook.report.kit import left_out
    from stillhook.report.terminal import say

    if line := left_out(pdf=pdf):
        say(line)


def announce(out: Path, names: Iterable[str], *, quiet: bool = False) -> None:
    """Print which files a folder now has."""
    if quiet:
        return
    if VERBOSE.get():
        print("written: " + ", ".join(str(out / name) for name in names))
    else:
        from stillhook.report.terminal import print_written

        print_written(str(out), list(names))
