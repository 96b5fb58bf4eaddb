"""The program as a tree of commands, each loaded when it is called: help of the program imports none of them."""

from __future__ import annotations

import functools
import inspect
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, NamedTuple, get_type_hints

import typer
import typer.main
from typer.core import TyperCommand, TyperGroup

from stillhook.errors import CommandError

FOLDER = Path(__file__).parent
VERBOSE: ContextVar[bool] = ContextVar("verbose", default=False)
"""Whether the command that runs prints all of its answer, in place of its dozen lines."""
WRITES: ContextVar[bool] = ContextVar("writes", default=False)
"""Whether it may write files, which its dozen lines name."""
VERBOSE_OPTION = Annotated[
    bool, typer.Option("--verbose", help="Print all of the answer: every table, limit and note.")
]


class Entry(NamedTuple):
    """Where a command is."""

    module: str  # within this package
    member: str  # a function

    def load(self) -> Any:
        """Import the function; with the option that all commands have."""
        return with_verbose(getattr(import_module(f"{__package__}.{self.module}"), self.member))


def with_verbose(function: Callable[..., Any]) -> Callable[..., Any]:
    """A command's function with the option --verbose besides its own, which sets `VERBOSE`."""

    @functools.wraps(function)
    def command(*, verbose: bool, **options: Any) -> Any:
        VERBOSE.set(verbose)
        WRITES.set(options.get("out") is not None)
        return function(**options)

    hints = get_type_hints(function, include_extras=True) | {"verbose": VERBOSE_OPTION}
    own = inspect.signature(function).parameters
    option = inspect.Parameter("verbose", inspect.Parameter.KEYWORD_ONLY, default=False)
    parameters = [each.replace(annotation=hints[each.name]) for each in (*own.values(), option)]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = hints
    return command


class Group(NamedTuple):
    """A group of commands, with its help."""

    help: str
    commands: Mapping[str, Entry]


class Commands(dict[str, Any]):
    """Commands and groups by name, each built from its entry when it is looked up first."""

    def __getitem__(self, name: str) -> Any:
        built = super().__getitem__(name)
        if isinstance(built, Entry | Group):
            self[name] = built = build(name, built)
        return built


def build(name: str, entry: Entry | Group) -> Any:
    """Import a command, or those of a group."""
    program = typer.Typer(add_completion=False)
    if isinstance(entry, Entry):
        program.command(name)(entry.load())
    else:
        group = typer.Typer(no_args_is_help=True)
        for each, of in entry.commands.items():
            group.command(each)(of.load())
        program.add_typer(group, name=name, help=entry.help)
    adopt(program)
    return typer.main.get_group(program).commands[name]


def first_paragraph(entry: Entry) -> str:
    """Begin of a function's docstring, read from the file without importing it."""
    source = FOLDER.joinpath(*entry.module.split(".")).with_suffix(".py").read_text(encoding="utf-8")
    result = re.search(rf'^def {entry.member}\(.*?^    """(.*?)(?:\n\n|""")', source, re.MULTILINE | re.DOTALL)
    return inspect.cleandoc(result[1]) if result else ""


def adopt(app: typer.Typer) -> None:
    """Give a program, and the groups within it, these commands."""
    app.info.cls = HelpfulGroup
    for command in app.registered_commands:
        command.cls = Command
    for group in app.registered_groups:
        if group.typer_instance is not None:
            adopt(group.typer_instance)


class Helpful:
    """A command, or a group of them, whose help keeps its brackets: what rich would take for markup is escaped."""

    def __init__(self, *names: Any, **settings: Any) -> None:
        from rich.markup import escape

        super().__init__(*names, **settings)
        for part in (self, *self.params):  # type: ignore[attr-defined]  # of a command of typer
            for name in ("help", "short_help", "epilog"):
                if text := getattr(part, name, None):
                    setattr(part, name, escape(text))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        load_pages()
        super().format_help(ctx, formatter)  # type: ignore[misc]


class Command(Helpful, TyperCommand):
    """A command that refuses an option of one value given several times."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Errors: CommandError for an option of one value that appears several times."""
        _, _, order = self.make_parser(ctx).parse_args(args=list(args))
        refuse_repeated(order)
        return list(super().parse_args(ctx, args))


class HelpfulGroup(Helpful, TyperGroup):
    """A group of such commands."""


class Program(HelpfulGroup):
    """The group at the top: `commands` of its `entries` are built when they are called."""

    entries: Mapping[str, Entry | Group] = {}

    def __init__(self, *names: Any, **settings: Any) -> None:
        super().__init__(*names, **settings)
        self.commands: Any = Commands(self.entries)

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.entries)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """What help and completion show of a command: its name and the first paragraph of its help."""
        if (entry := self.entries.get(cmd_name)) is None:
            return None
        return Command(cmd_name, help=first_paragraph(entry) if isinstance(entry, Entry) else entry.help)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, command, rest = super().resolve_command(ctx, args)
        return name, None if command is None else self.commands[command.name], rest


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


class Later(type):
    """A class that stands for another of the same module and name, which is imported when it is used."""

    def __call__(cls, *args: Any, **settings: Any) -> Any:
        return cls.meant()(*args, **settings)

    def __getattr__(cls, name: str) -> Any:
        return getattr(cls.meant(), name)

    def meant(cls) -> Any:
        return getattr(import_module(cls.__module__), cls.__name__)


UNUSED = {"rich.markdown": "Markdown", "rich.traceback": "Traceback"}
"""Parts of rich that typer imports with its help pages, at a third of the time of `stillhook --help`, for pages in
Markdown and for coloured tracebacks. Stillhook has neither. typer's plain pages (rich_markup_mode = None) need no rich,
and cut the summaries of the commands off."""


@functools.cache
def load_pages() -> None:
    """Import typer's help pages without those parts."""
    absent = [module for module in UNUSED if module not in sys.modules]
    for module in absent:
        sys.modules[module] = ModuleType(module)
        setattr(sys.modules[module], UNUSED[module], Later(UNUSED[module], (), {"__module__": module}))
    try:
        import_module("typer.rich_utils")
    finally:
        for module in absent:
            del sys.modules[module]
