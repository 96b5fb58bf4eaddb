"""The command line: thin commands that call verbs and own no physics.

Exit codes: 0 done; 1 done, but the answer is "no" (limits exceeded); 2 invalid input, reported in one line without a
traceback; 3 an error of Stillhook itself, in one line with the address for a report; 130 interrupted; 141 nobody reads
the output any more.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import io
import os
import sys
from collections.abc import Callable
from typing import Annotated, Any

import typer
import typer.main

from stillhook._version import __version__
from stillhook.base.extensions import place_in_extension
from stillhook.cli import crane, demo, identify, plan, simulation, validate
from stillhook.cli.analysis import envelope, maps, stability, tune, uncertainty
from stillhook.cli.identify import friction_sets as friction
from stillhook.cli.parser import adopt
from stillhook.cli.sea import payload, response, tip, vessel
from stillhook.cli.sea import waves as sea
from stillhook.cli.weather import commands as weather
from stillhook.errors import StillhookError
from stillhook.units import quote

REFUSED, INTERNAL, INTERRUPTED, UNREAD = 2, 3, 130, 141
DEBUG = "STILLHOOK_DEBUG"
"""Environment variable that shows the traceback of an internal error."""

app = typer.Typer(
    name="stillhook",
    help="Digital twin of hydraulic active-heave-compensated crane winches: keeps the hook still, and quantifies it.",
    no_args_is_help=True,
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


COMMANDS: dict[str, Callable[..., None]] = {
    "cranes": crane.list_cranes,
    "crane": crane.show_crane,
    "run": simulation.run,
    "compare": simulation.compare,
    "envelope": envelope.envelope,
    "sea": sea.sea,
    "stability": stability.stability,
    "map": maps.show_map,
    "tune": tune.tune,
    "uncertainty": uncertainty.uncertainty,
    "validate": validate.validate,
    "tip": tip.tip,
    "lower": simulation.lower,
    "response": response.response,
    "plan": plan.plan,
    "demo": demo.demo,
    "report": plan.report,
}
"""Commands in the order of the help."""
for _name, _function in COMMANDS.items():
    app.command(_name)(_function)
app.add_typer(crane.app, name="calc")
app.add_typer(validate.app, name="certificate")
app.add_typer(identify.app, name="identify")
app.add_typer(friction.app, name="friction")
app.add_typer(vessel.app, name="vessel")
app.add_typer(payload.app, name="payload")
app.add_typer(weather.app, name="weather")
adopt(app)


@functools.cache
def _command() -> Any:
    """All commands, built once in a process."""
    return typer.main.get_command(app)


def main() -> None:
    """Entry point of the `stillhook` command."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: more threads only compete with ours
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name that the terminal's letters cannot show ends no command
            stream.reconfigure(errors="backslashreplace")
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line; returns the exit code."""
    try:
        code = _command()(arguments, standalone_mode=False)
        if sys.stdout is not None:  # closed by the caller
            sys.stdout.flush()
    except StillhookError as e:
        return _refuse(str(e))
    except OSError as e:
        return _lost(e)
    except SystemExit as e:  # the argument parser's answer to a pipe that nobody reads
        return (
            _lost(e.__context__)
            if isinstance(e.__context__, OSError)
            else e.code
            if isinstance(e.code, int)
            else REFUSED
        )
    except Exception as e:
        if hasattr(e, "format_message"):  # an error of the argument parser
            return (
                _refuse(f"{' '.join(str(e.format_message()).split()).rstrip('.')}. See --help.")
                if str(e.format_message())
                else REFUSED
            )
        if type(e).__name__ == "Abort":  # what some argument parsers make of an interrupt, others of its exit code
            return _stopped()
        return _failed(e)
    except KeyboardInterrupt:
        return _stopped()
    if code == INTERRUPTED:
        return _stopped()
    return code if isinstance(code, int) else 0


def _refuse(line: str, code: int = REFUSED) -> int:
    """One line, whatever was typed into it."""
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)
    print(f"error: {shown}", file=sys.stderr)
    return code


def _failed(problem: Exception) -> int:
    """An unexpected exception: type, place and where to report it, or the line of a module of the user; with `DEBUG`
    its traceback before that."""
    import traceback

    if os.environ.get(DEBUG):
        traceback.print_exception(problem)
    if blamed := place_in_extension(problem):
        reason = next((line for line in str(problem).splitlines() if line and not line.startswith("Failed in ")), "")
        return _refuse(f"{blamed}: {type(problem).__name__}: {reason.rstrip('.')}. {DEBUG}=1 shows the traceback.")
    last = traceback.extract_tb(problem.__traceback__)[-1]
    place = f"{os.path.basename(last.filename)}, line {last.lineno}"
    message = f" {quote(str(problem))}" if str(problem) else ""
    return _refuse(
        f"Internal error of Stillhook {__version__}: {type(problem).__name__}{message} in {place}. "
        f'Report it with the command and its files (CONTRIBUTING.md, "Report a finding"); {DEBUG}=1 shows the'
        " traceback.",
        INTERNAL,
    )


def _stopped() -> int:
    print("stopped: no file was left half-written", file=sys.stderr)
    return INTERRUPTED


def _lost(problem: OSError) -> int:
    """Output that cannot be written: what is still held back is dropped, so that the interpreter does not try it again
    at its end."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if problem.errno in (errno.EPIPE, errno.EINVAL):
        return UNREAD
    return _refuse(
        f"{problem.filename or 'standard output'}: {problem.strerror or problem}. Choose another place for the output."
    )
