"""Arguments and help of every command: an option of one value appears once, and help shows what is
written in it.

`typer` renders help with rich's markup, which takes "[scenario]" for a style and drops it, and lets the last of
repeated options win. `adopt` puts the classes of this module in place of typer's, for an entire program at once.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import typer
from rich.markup import escape
from typer.core import TyperCommand, TyperGroup

from stillhook.errors import CommandError


def adopt(app: typer.Typer) -> None:
    """Give a program, and the groups within it, these commands."""
    app.info.cls = Group
    for command in app.registered_commands:
        command.cls = Command
    for group in app.registered_groups:
        if group.typer_instance is not None:
            adopt(group.typer_instance)


class Command(TyperCommand):
    """A command whose help keeps its brackets, and that refuses an option of one value given several times."""

    def __init__(self, *names: Any, **settings: Any) -> None:
        super().__init__(*names, **settings)
        _literal(self)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Errors: CommandError for an option of one value that appears several times."""
        _, _, order = self.make_parser(ctx).parse_args(args=list(args))
        refuse_repeated(order)
        return list(super().parse_args(ctx, args))


class Group(TyperGroup):
    """A group of commands whose help keeps its brackets."""

    def __init__(self, *names: Any, **settings: Any) -> None:
        super().__init__(*names, **settings)
        _literal(self)


def refuse_repeated(order: Iterable[Any]) -> None:
    """Parameters in the order in which a command line names them: those of one value at most once. Errors:
    CommandError."""
    seen: list[Any] = []
    for parameter in order:
        one_value = parameter.param_type_name == "option" and not (
            parameter.multiple or parameter.is_flag or parameter.count
        )
        if one_value and parameter in seen:
            raise CommandError(
                f"{parameter.opts[0]} appears {sum(p is parameter for p in order)} times and takes one value. "
                "Give it once; where it takes a list, with commas between the values."
            )
        seen.append(parameter)


def _literal(command: Any) -> None:
    """Escape what rich would take for markup in the help of a command and of its parameters."""
    for part in (command, *command.params):
        for name in ("help", "short_help", "epilog"):
            if text := getattr(part, name, None):
                setattr(part, name, escape(text))
