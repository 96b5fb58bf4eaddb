"""The command line: thin commands that call verbs and own no physics.

Exit codes: 0 done; 1 done, but the answer is "no" (limits exceeded); 2 bad input, said in one line without a traceback.
"""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from stillhook._version import __version__
from stillhook.cli import calc, cranes, runs
from stillhook.errors import StillhookError

app = typer.Typer(
    name="stillhook",
    help="Digital twin of hydraulic active-heave-compensated crane winches: keeps the hook still, and says how still.",
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
    version: Annotated[bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)] = False,
) -> None:
    """Options that belong to no command."""


cranes.register(app)
runs.register(app)
app.add_typer(calc.app, name="calc")


def main() -> None:
    """Entry point of the `stillhook` command."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line; returns the exit code."""
    try:
        code = app(arguments, standalone_mode=False)
    except StillhookError as e:
        return _refuse(str(e))
    except KeyboardInterrupt:
        print("stopped: nothing was written", file=sys.stderr)
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except Exception as e:
        if hasattr(e, "format_message"):  # an error of the argument parser
            return _refuse(f"{' '.join(str(e.format_message()).split())} See --help.") if str(e.format_message()) else 2
        if type(e).__name__ == "Abort":
            return 130
        raise
    return code if isinstance(code, int) else 0


def _refuse(line: str) -> int:
    print(f"error: {line}", file=sys.stderr)
    return 2
