"""The command line: thin commands that call verbs and own no physics.

Exit codes: 0 done; 1 done, but the answer is "no" (limits exceeded); 2 invalid input, reported in one line without a
traceback; 3 an error of Stillhook itself, in one line with the address for a report; 128 and the number of the signal
that ended it (130 Ctrl-C, 143 SIGTERM); 141 the reader of the output has gone.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import io
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import typer
import typer.main

from stillhook._version import __version__
from stillhook.base.signals import forget, received, stopped_by
from stillhook.cli.groups import Entry, Group, Program
from stillhook.cli.names import modern
from stillhook.errors import StillhookError, printed

NO_ROOM = "failed to map segment"
"""What the loader of libraries says where memory is short."""
REFUSED, INTERNAL, INTERRUPTED, UNREAD = 2, 3, 130, 141
DEBUG = "STILLHOOK_DEBUG"
"""Environment variable that shows the traceback of an internal error."""

COMMANDS: dict[str, Entry | Group] = {
    "list": Entry("library", "list_kind"),
    "crane": Entry("library", "show_crane"),
    "run": Entry("runs.simulation", "run"),
    "compare": Entry("runs.simulation", "compare"),
    "envelope": Entry("analysis.envelope", "envelope"),
    "sea": Entry("sea.waves", "sea"),
    "stability": Entry("analysis.stability", "stability"),
    "map": Entry("analysis.maps", "show_map"),
    "tune": Entry("analysis.tune", "tune"),
    "uncertainty": Entry("analysis.uncertainty", "uncertainty"),
    "validate": Entry("runs.validate", "validate"),
    "tip": Entry("sea.tip", "tip"),
    "lower": Entry("runs.simulation", "lower"),
    "response": Entry("sea.response", "response"),
    "plan": Entry("runs.plan", "plan"),
    "demo": Entry("runs.demo", "demo"),
    "report": Entry("runs.plan", "report"),
    "fmu": Entry("export", "fmu"),
    "convert": Entry("export", "convert"),
    "external": Entry("export", "external"),
    "example": Entry("library", "example"),
    "new": Entry("runs.starters", "new"),
    "inspect": Entry("runs.inspect", "inspect"),
    "calc": Entry("analysis.calc", "calc"),
    "thesis": Entry("analysis.thesis", "thesis"),
    "manifest": Entry("runs.manifest", "manifest"),
    "certificate": Entry("runs.certificate", "certificate"),
    "certificate sign": Entry("runs.certificate", "sign"),
    "certificate key": Group(
        "Keys that sign certificates: make one, show them, say whose signatures are trusted.",
        {name: Entry("runs.certificate", f"key_{name}") for name in ("new", "show", "trust")},
    ),
    "condition": Entry("live.condition", "condition"),
    "identify": Group(
        "Friction from tests: motor loss models from supplier maps, system friction from crane logs.",
        {
            "motor": Entry("identify", "motor"),
            "component": Entry("identify", "component"),
            "friction": Entry("identify", "friction"),
            "curve": Entry("identify", "curve"),
        },
    ),
    "friction": Group(
        "Friction sets: sets side by side, their uncertainty in a lift.",
        {"compare": Entry("analysis.friction_sets", "compare"), "draws": Entry("analysis.friction_sets", "draws")},
    ),
    "vessel": Entry("sea.vessel", "vessel"),
    "payload": Entry("sea.payload", "payload"),
    "plc": Group(
        "PLC: a controller as IEC 61131-3 Structured Text with a test sequence; a soft PLC over a bus; a PLC compared.",
        {
            "export": Entry("export", "plc_export"),
            "check": Entry("export", "plc_check"),
            "run": Entry("live.plc", "plc_run"),
            "compare": Entry("live.plc", "plc_compare"),
        },
    ),
    "live": Group(
        "Live twin: beside a PLC in real time, with its history; how well this machine keeps time; a log played back.",
        {
            **{name: Entry("live.twin", name) for name in ("run", "doctor", "replay", "demo")},
            "history": Entry("live.history", "history"),
            "parameters": Entry("live.parameters", "parameters"),
            "residual": Entry("live.residual", "residual"),
        },
    ),
    "weather": Group(
        "Weather: workable windows and waiting, alpha factors, go or no-go from a forecast.",
        {name: Entry("weather.commands", name) for name in ("persistence", "alpha", "forecast", "lift", "show")},
    ),
}
"""Commands and groups of commands, in the order of the help."""


class Stillhook(Program):
    """The program."""

    entries = COMMANDS


app = typer.Typer(
    cls=Stillhook,
    name="stillhook",
    help="Digital twin of hydraulic active-heave-compensated crane winches: keeps the hook still, and quantifies it.",
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"stillhook {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options that belong to no command."""


@functools.cache
def _command() -> Any:
    """The program, built once in a process."""
    return typer.main.get_command(app)


def main() -> None:
    """Entry point of the `stillhook` command."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: more threads only compete with ours
    if not os.environ.get(DEBUG):
        sys.unraisablehook = lambda unraisable: None  # what a library cannot close after an error is no second line
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed by the caller: a file that is opened next must not get its place
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  # open while the process is
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name that the terminal's letters cannot show ends no command
            stream.reconfigure(errors="backslashreplace")
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line; returns the exit code."""
    forget()
    try:
        code = _called(arguments)
    except BaseException as e:
        if received() is not None or isinstance(e, KeyboardInterrupt):  # libraries turn an interrupt into an error
            return _stopped()
        return _report(e)
    if code == INTERRUPTED or received() is not None:  # of what keeps its results so far, and of servers
        return _stopped()
    return code if isinstance(code, int) else 0


def _called(arguments: list[str]) -> object:
    """What the command gives."""
    arguments, notes = modern(arguments)
    for note in notes:
        print(f"note: {note}.", file=sys.stderr)
    with warnings.catch_warnings():
        warnings.simplefilter("always", FutureWarning)  # old forms of files
        warnings.showwarning = functools.partial(_note, warnings.showwarning)
        code = _command()(arguments, standalone_mode=False)
    sys.stdout.flush()
    return code


def _report(problem: BaseException) -> int:
    """One line on what ended a command, and its exit code."""
    match problem:
        case StillhookError():
            if problem.__cause__ is not None:
                _trace(problem)
            return _refuse_all(problem.lines)
        case OSError():
            return _lost(problem)
        case MemoryError():
            return _exhausted(problem)
        case ImportError() if NO_ROOM in str(problem):
            return _exhausted(MemoryError(f"{problem.name or 'a library'} cannot be loaded"))
        case SystemExit():  # the argument parser's answer to a pipe that nobody reads
            if isinstance(problem.__context__, OSError):
                return _lost(problem.__context__)
            return problem.code if isinstance(problem.code, int) else REFUSED
    if hasattr(problem, "format_message"):  # an error of the argument parser
        line = " ".join(str(problem.format_message()).split()).rstrip(".")
        return _refuse(f"{line}. See --help.") if line else REFUSED
    if isinstance(problem, ModuleNotFoundError):
        from stillhook.base.extras import missing

        if line := missing(problem):
            return _refuse(line)
    if type(problem).__name__ == "Abort":  # what some argument parsers make of an interrupt, others of its exit code
        return _stopped()
    return _failed(problem)


def _note(usual: Callable[..., None], message: Warning | str, category: type[Warning], *place: Any) -> None:
    """A warning about an old form as a note on standard error, any other as usual."""
    if issubclass(category, FutureWarning):
        print(f"note: {message}", file=sys.stderr)
    else:
        usual(message, category, *place)


def _refuse(line: str, code: int = REFUSED) -> int:
    """One line, regardless of what was typed into it."""
    print(f"error: {printed(line)}", file=sys.stderr)
    return code


MOST_LINES = 10
"""Problems of a file that are printed; further ones are counted."""


def _refuse_all(lines: Sequence[str]) -> int:
    """A line for each problem of a file, and how many more there are."""
    for line in lines[:MOST_LINES]:
        _refuse(line)
    if len(lines) > MOST_LINES:
        _refuse(f"{len(lines) - MOST_LINES} more problems. Correct these first.")
    return REFUSED


def _trace(problem: BaseException) -> None:
    """With `DEBUG` the traceback of an exception."""
    if os.environ.get(DEBUG):
        import traceback

        traceback.print_exception(problem)


def _failed(problem: BaseException) -> int:
    """An unexpected exception: type, place and where to report it, or the line of a module of the user; with `DEBUG`
    its traceback before that."""
    import traceback

    from stillhook.base.extensions import place_in_extension

    _trace(problem)

    if blamed := place_in_extension(problem):
        reason = next((line for line in str(problem).splitlines() if line and not line.startswith("Failed in ")), "")
        return _refuse(f"{blamed}: {type(problem).__name__}: {reason.rstrip('.')}. {DEBUG}=1 shows the traceback.")
    last = traceback.extract_tb(problem.__traceback__)[-1]
    place = f"{os.path.basename(last.filename)}, line {last.lineno}"
    from stillhook.units import quote

    message = f" {quote(str(problem))}" if str(problem) else ""
    return _refuse(
        f"Internal error of Stillhook {__version__}: {type(problem).__name__}{message} in {place}. "
        f'Report it with the command and its files (CONTRIBUTING.md, "Report a finding"); {DEBUG}=1 shows the'
        " traceback.",
        INTERNAL,
    )


def _stopped() -> int:
    line, code = stopped_by(received())
    print(line, file=sys.stderr)
    return code


def _exhausted(problem: MemoryError) -> int:
    """Memory that the system does not give; NumPy says how much."""
    problem.__traceback__ = None  # what its frames hold is free again
    reason = f" ({problem})" if str(problem) else ""
    return _refuse(f"not enough memory{reason}. No file was left half-written. Run fewer or shorter cases at once.")


def _lost(problem: OSError) -> int:
    """Output or a file that cannot be used: what is still held back is dropped, so that the interpreter does not try it
    again at its end."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if problem.errno == errno.EPIPE or (problem.errno == errno.EINVAL and problem.filename is None):
        return UNREAD
    if problem.errno in (errno.EMFILE, errno.ENFILE):
        return _refuse("too many files are open. Raise the limit (ulimit -n), or run fewer commands at once.")
    from stillhook.units import quote

    reason = problem.strerror or str(problem)
    if problem.filename is None:
        return _refuse(f"standard output: {reason}. Choose another place for the output.")
    return _refuse(f"{quote(str(problem.filename))}: {reason}. Check the name, your rights and the room there.")
