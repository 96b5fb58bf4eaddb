"""`stillhook new WHAT OUT`: a starter file that a command reads as it is, with units and allowed values."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from stillhook.base.atomic import atomic_file
from stillhook.cli.parser import Json, present
from stillhook.errors import CommandError
from stillhook.report.terminal import Answer
from stillhook.units import quote


class What(NamedTuple):
    """A kind of starter: what it is, the shelf of the library that it can begin from, where it begins by default,
    its writer (path and beginning to text), and the commands that read it."""

    meaning: str
    shelf: str
    usual: str
    write: Callable[[Path, str], str]
    commands: tuple[str, ...]


def _starter(model: Any, data: Mapping[str, Any], head: Sequence[str], **options: Any) -> str:
    from stillhook.library.toml.starter import Starter

    return Starter(**options).text(model, data, head)


def _crane(out: Path, like: str) -> str:
    from stillhook.library import load_crane
    from stillhook.library.toml.tree import Leaf
    from stillhook.library.write import crane_tree
    from stillhook.spec.crane import Crane, SourceKind

    base = load_crane(like)
    kinds: dict[str, str] = {}

    def plain(tree: Mapping[str, Any], path: str = "") -> dict[str, Any]:
        result: dict[str, Any] = {}
        for name, node in tree.items():
            if isinstance(node, Leaf) and node.source.kind is not SourceKind.USER:
                kinds[f"{path}{name}"] = f"{node.source.kind.value} in {like}"
            result[name] = node.value if isinstance(node, Leaf) else plain(node, f"{path}{name}.")
        return result

    data = plain(crane_tree(base)) | {"name": out.stem, "title": f"Our crane, after {like}"}
    head = (
        f"A crane of your own. Every value below is that of {like} until you remove its # and write yours, best with",
        'its source: SWL = { value = "250 t", kind = "datasheet", source = "drawing 12" }. kind: published, datasheet,',
        "fitted, derived, assumed or user. A plain value counts as yours, without a source.",
    )
    hidden, on = frozenset({"sources", "certified"}), frozenset({"name", "title"})
    text = _starter(Crane, data, head, hidden=hidden, off=True, on=on, remark=kinds)
    first = text.index("\nname = ")
    return f'{text[:first]}\nbase = "{like}"{text[first:]}'


def _payload(out: Path, like: str) -> str:
    from stillhook.library.toml.tree import library_table
    from stillhook.spec.lift.assembly import BODIES, SHAPES, Assembly, Part
    from stillhook.spec.lift.payload import Payload

    def of_table(node: Any) -> Any:
        """Values with what they are from until they are replaced."""
        if isinstance(node, Mapping) and "value" in node:
            return dict(node) | {"source": f"{like}: replace"}
        return {key: of_table(value) for key, value in node.items()} if isinstance(node, Mapping) else node

    def flat(model: type[Any], data: Mapping[str, Any]) -> Sequence[type[Any]]:
        shape = data.get("shape", {})
        name = str(shape.get("value") if isinstance(shape, Mapping) else shape)
        of: dict[Any, Mapping[str, Any]] = {Payload: SHAPES, Part: BODIES}
        return (of[model][name],) if name in of.get(model, {}) else ()

    data = of_table(library_table("payloads", like, "payload")) | {
        "name": out.stem,
        "title": f"Our payload, after {like}",
    }
    shape = data.get("shape", {}).get("value")
    head = (
        f"A payload of your own, with the numbers of {like}: replace each with its source; a plain value is yours.",
        f"shape: {', '.join(SHAPES)}; each has its dimensions (docs/how-to/describe-a-payload.md).",
    )
    hidden = {"sources", "levels", "source", "kind"} | (set() if shape is None or shape == "assembly" else {"parts"})
    hidden |= {"Payload.height"} if issubclass(SHAPES.get(shape, Payload), Assembly) else set()
    return _starter(Payload, data, head, hidden=frozenset(hidden), flat=flat)


def _lift(out: Path, like: str) -> str:
    from stillhook.formats.lift.tables import LiftTables
    from stillhook.library.toml.tree import library_table
    from stillhook.plan.file import PlanFile, plans

    data = library_table("lifts", like, "lift")
    data["name"] = out.stem
    head = (
        f"A lift of your own, with the numbers of {like}: an example, no operation. Replace each.",
        "crane, vessel and payload: names of the library (stillhook list cranes) or files seen from this one.",
    )
    model = PlanFile if like in plans() else LiftTables
    return _starter(model, data, head, hidden=frozenset({"synthetic_certificate"}))


def _campaign(out: Path, like: str) -> str:
    from stillhook.library.examples import DATA, MARK
    from stillhook.validate.data_set.campaign import CampaignFile

    data = tomllib.loads((DATA / like / "campaign.toml").read_text(encoding="utf-8"))
    head = (
        f"{MARK}, so that it validates as it is. Put your logs in place of logs/, then name crane, columns and tests.",
        "Remove synthetic = true with the last of these logs; criteria: a library name, or a file in the same folder.",
    )
    return _starter(CampaignFile, data, head)


def _drives(out: Path, like: str) -> str:
    from stillhook.analysis.drives.costs import CostFile, DriveTable
    from stillhook.winches.registry import WINCH_TYPES

    cells = dict.fromkeys(DriveTable.model_fields, "")
    tables = {"year": ("hours", "operations", "vessel", "write_off"), "energy": ("grid", "hydraulic", "returned")}
    data: dict[str, Any] = {name: dict.fromkeys(keys, "") for name, keys in tables.items()}
    data["drive"] = {name: dict(cells) for name in WINCH_TYPES}
    head = (
        "What each drive costs, in one currency. A cell that is not known stays empty, and each sum lists what it",
        "leaves out. Delete the drives that are not compared.",
    )
    return _starter(CostFile, data, head)


KINDS: Mapping[str, What] = {
    "crane": What("a crane on the base of a library crane", "cranes", "nov-250t", _crane, ("crane {}", "compare {}")),
    "lift": What(
        "a lift with its seas", "lifts", "template-to-1500m", _lift, ("plan {} --check", "plan {} --tier frequency")
    ),
    "campaign": What(
        "crane tests to validate, with SYNTHETIC logs in a folder",
        "examples",
        "sea-trials",
        _campaign,
        ("validate {}",),
    ),
    "payload": What("a payload by its dimensions", "payloads", "suction-anchor-85t", _payload, ("payload {}",)),
    "drives": What("what drives cost, for an owner", "", "", _drives, ("compare nov-250t --drives {}",)),
}
WHAT_HELP = "; ".join(f"{name}: {what.meaning}" for name, what in KINDS.items()) + "."


def new(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=WHAT_HELP)],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="File to write (TOML); of campaign the folder.")],
    like: Annotated[
        str | None, typer.Argument(metavar="LIKE", help="Name of the library to begin from (crane, lift, payload).")
    ] = None,
    json: Json = False,
) -> None:
    """Write a starter file of your own: complete as it is, with units, bounds and choices next to every field.

    Example: stillhook new crane my-crane.toml nov-100t-electric
    """
    from stillhook.library.toml.tree import shelf

    if what not in KINDS:
        raise CommandError(f"new {quote(what)}: choose {', '.join(KINDS)}.")
    kind = KINDS[what]
    names = shelf(kind.shelf) if kind.shelf and what != "campaign" else ()
    if like is not None and like not in names:
        allowed = f"choose {', '.join(names)}" if names else "leave it out"
        raise CommandError(f"new {what}: LIKE {quote(like)}: {allowed}.")
    first = like or kind.usual
    written = _campaign_folder(out, first) if what == "campaign" else _one_file(out, kind.write(out, first))
    commands = kind.commands
    if what == "lift":
        from stillhook.plan.file import plans

        commands = commands if first in plans() else ("lower {}",)
    steps = [f"stillhook {command.format(written)}" for command in commands]
    answer = Answer(f"written: {written}", step="; then ".join(steps))
    present({"file": str(written), "like": first, "next": steps}, brief=lambda: answer, json=json)


def _one_file(out: Path, text: str) -> Path:
    if out.suffix.lower() != ".toml":
        raise CommandError(f"{out}: name a file that ends in .toml.")
    if out.exists():
        raise CommandError(f"{out}: is there already. Choose another name.")
    with atomic_file(out) as part:
        part.write_text(text, encoding="utf-8")
    return out


def _campaign_folder(out: Path, like: str) -> Path:
    """The example's logs with a campaign file that says what each field means."""
    from stillhook.library.examples import DATA, example_campaign

    text = _campaign(out, like)
    file = example_campaign(DATA / like, out)
    with atomic_file(file) as part:
        part.write_text(text, encoding="utf-8")
    return file
