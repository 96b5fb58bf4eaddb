"""The program as a tree of commands, each loaded when it is called, and their help: that of the program and of groups
imports none of them."""

from __future__ import annotations

import functools
import inspect
import re
import shutil
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_type_hints

import typer
import typer.main
from typer.core import TyperCommand, TyperGroup
from typer.models import ArgumentInfo, OptionInfo

from stillhook.base.gateway.inputs import collecting
from stillhook.errors import CommandError

FOLDER = Path(__file__).parent
VERBOSE: ContextVar[bool] = ContextVar("verbose", default=False)
"""Whether the command that runs prints all of its answer, in place of its dozen lines."""
WRITES: ContextVar[bool] = ContextVar("writes", default=False)
"""Whether it may write files, which its dozen lines name."""
WORDS: ContextVar[str] = ContextVar("words", default="")
"""How it is called, such as "plc export": what its manifest says of the files."""
VERBOSE_OPTION = Annotated[
    bool, typer.Option("--verbose", help="Print all of the answer: every table, limit and note.")
]


class Entry(NamedTuple):
    """Where a command is."""

    module: str  # within this package
    member: str  # a function

    def load(self, words: str = "") -> Any:
        """Import the function; with the option that all commands have. words: how it is called."""
        return with_verbose(getattr(import_module(f"{__package__}.{self.module}"), self.member), words)


def with_verbose(function: Callable[..., Any], words: str) -> Callable[..., Any]:
    """A command's function with the option --verbose besides its own, which sets `VERBOSE`."""

    @functools.wraps(function)
    def command(*, verbose: bool, **options: Any) -> Any:
        VERBOSE.set(verbose)
        WORDS.set(words)
        WRITES.set(options.get("out") is not None)
        with collecting(options):
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

    def __init__(self, entries: Mapping[str, Entry | Group], words: tuple[str, ...]) -> None:
        super().__init__(entries)
        self.words = words  # how the group that they are in is called

    def __getitem__(self, name: str) -> Any:
        built = super().__getitem__(name)
        if isinstance(built, Entry | Group):
            self[name] = built = build(name, built, self.words)
        return built


def build(name: str, entry: Entry | Group, words: tuple[str, ...] = ()) -> Any:
    """A command, imported; or a group, whose commands are imported when they are called."""
    if isinstance(entry, Entry):
        single = typer.Typer(add_completion=False)
        single.command(name, cls=Command)(entry.load(" ".join((*words, name))))
        return typer.main.get_command(single)
    content = {"entries": entry.commands, "words": (*words, name)}
    kind: Any = type("Subgroup", (Program,), content)
    group = typer.Typer(cls=kind, name=name, help=entry.help, add_completion=False)
    group.callback()(lambda: None)
    return typer.main.get_command(group)


def first_paragraph(entry: Entry) -> str:
    """Begin of a function's docstring, read from the file without importing it."""
    source = FOLDER.joinpath(*entry.module.split(".")).with_suffix(".py").read_text(encoding="utf-8")
    result = re.search(rf'^def {entry.member}\(.*?^    """(.*?)(?:\n\n|""")', source, re.MULTILINE | re.DOTALL)
    return inspect.cleandoc(result[1]) if result else ""


def page(words: Sequence[str], text: str, entry: Entry | None, commands: Mapping[str, str]) -> str:
    """A page of help, as wide as the terminal and at most `WIDEST`: usage, what it does, examples (a line each, never
    folded), arguments, options, commands with their help. It is read from the function's signature: the parser of
    the command line is not built for it."""
    width = min(shutil.get_terminal_size().columns, WIDEST)
    parameters = [] if entry is None else list(inspect.signature(entry.load()).parameters.values())
    arguments = [_argument(p) for p in parameters if isinstance(_mark(p), ArgumentInfo)]
    options = [_option(p) for p in parameters if isinstance(_mark(p), OptionInfo)]
    called = ["stillhook", *words, *(name for name, _ in arguments), "COMMAND ..." if commands else "[OPTIONS]"]
    lines = _folded(f"Usage: {' '.join(called)}", width, "  ")
    about, *examples = re.split(r"\bExample: ", text)
    for paragraph in about.strip().split("\n\n"):
        lines += ["", *_folded(paragraph, width)]
    if examples:
        lines += ["", "Examples:", *(f"  {' '.join(each.split())}" for each in examples)]
    program = [("--version", "Print the version.")] if not words else []
    shown = {"Arguments": arguments, "Options": [*options, *program, ("--help", "Show this page.")]}
    for title, rows in (shown | {"Commands": [(n, _first_sentence(t)) for n, t in commands.items()]}).items():
        lines += ["", f"{title}:", *_rows(rows, width)] if rows else []
    return "\n".join(lines)


WIDEST, NAMES = 100, 28
"""Columns of a page of help, and of the names in it at most."""


def _mark(parameter: inspect.Parameter) -> Any:
    """What typer holds of a parameter."""
    return next((m for m in parameter.annotation.__metadata__ if isinstance(m, ArgumentInfo | OptionInfo)), None)


def _argument(parameter: inspect.Parameter) -> tuple[str, str]:
    """Name of an argument, in brackets where it may be left out, and its help."""
    mark, name = _mark(parameter), parameter.name.upper()
    name = str(mark.metavar or name)
    optional = parameter.default is not inspect.Parameter.empty and not name.startswith("[")
    return f"[{name}]" if optional else name, mark.help or ""


def _option(parameter: inspect.Parameter) -> tuple[str, str]:
    """Names of an option, and its help with the default."""
    mark, default = _mark(parameter), parameter.default
    declared = [name for name in (mark.default, *(mark.param_decls or ())) if isinstance(name, str)]
    names = ", ".join(declared or [f"--{parameter.name.replace('_', '-')}"])
    text = " ".join((mark.help or "").split())
    if parameter.annotation.__origin__ is bool:
        return names, text
    if default is inspect.Parameter.empty:
        text += " [required]"
    elif default not in (None, "") and "default" not in text.lower():
        text += f" [default: {default}]"
    return f"{names} VALUE", text


def _first_sentence(text: str) -> str:
    return re.split(r"(?<=[.)]) (?=[A-Z])", " ".join(text.split()))[0]


def _rows(rows: Iterable[tuple[str, str]], width: int) -> Iterator[str]:
    """Names with their texts, folded next to them."""
    rows = list(rows)
    names = min(max(len(name) for name, _ in rows), NAMES)
    for name, text in rows:
        first, *others = _folded(text, width - names - 4) or [""]
        beside = len(name) <= names
        yield from [] if beside else [f"  {name}"]
        yield f"  {name if beside else '':<{names}}  {first}".rstrip()
        yield from (f"{'':<{names + 4}}{line}" for line in others)


def _folded(text: str, width: int, indent: str = "") -> list[str]:
    joined = " ".join(text.split())
    return textwrap.wrap(joined, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


class Command(TyperCommand):
    """A command that refuses an option of one value given several times."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Errors: CommandError for an option of one value that appears several times."""
        _, _, order = self.make_parser(ctx).parse_args(args=list(args))
        refuse_repeated(order)
        return list(super().parse_args(ctx, args))


class Program(TyperGroup):
    """A group of commands: those of its `entries` are built when they are called, and their help without that."""

    entries: Mapping[str, Entry | Group] = {}
    words: tuple[str, ...] = ()  # how it is called

    def __init__(self, *names: Any, **settings: Any) -> None:
        super().__init__(*names, **settings)
        self.commands: Any = Commands(self.entries, self.words)

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.entries)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """What completion shows of a command: its name and the first paragraph of its help."""
        if (entry := self.entries.get(cmd_name)) is None:
            return None
        return Command(cmd_name, help=outline(entry))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Help is printed before anything else is read; also without a command."""
        args = two_words(self.entries, args)
        if not args or (text := requested(self.words, self.entries, args)):
            print(text if args else self.get_help(ctx))
            ctx.exit(0 if args else 2)
        return list(super().parse_args(ctx, args))

    def get_help(self, ctx: Any) -> str:
        return page(self.words, self.help or "", None, {name: outline(entry) for name, entry in self.entries.items()})

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, command, others = super().resolve_command(ctx, args)
        return name, None if command is None else self.commands[command.name], others


def two_words(entries: Mapping[str, Entry | Group], args: Sequence[str]) -> list[str]:
    """A command line whose command has two words, where one of the first word alone exists too, with both in one."""
    both = " ".join(args[:2])
    return [both, *args[2:]] if both in entries else list(args)


def requested(words: tuple[str, ...], entries: Mapping[str, Entry | Group], args: Sequence[str]) -> str:
    """The page of help that a command line requests; empty without."""
    args = two_words(entries, args)
    name, typed = args[0], args[1 : args.index("--")] if "--" in args else args[1:]
    if (entry := entries.get(name)) is None or "--help" not in typed:
        return ""
    if isinstance(entry, Entry):
        return page((*words, name), inspect.cleandoc(entry.load().__doc__ or ""), entry, {})
    if typed[0] == "--help":
        return page((*words, name), entry.help, None, {each: outline(of) for each, of in entry.commands.items()})
    return requested((*words, name), entry.commands, typed)


def outline(entry: Entry | Group) -> str:
    """First paragraph of a command's help, or the help of a group."""
    return first_paragraph(entry) if isinstance(entry, Entry) else entry.help


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
