"""`stillhook list WHAT`, `stillhook crane NAME`, `stillhook example WHAT OUT`: what the library has by name, the sheet
of a crane, and files to try a command on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from stillhook.cli.parser import CraneArgument, Json, present
from stillhook.errors import CommandError
from stillhook.report.formatting import argument, wrapped
from stillhook.report.terminal import Answer, Cells, Line, columns, print_table, twin_lines
from stillhook.units import quote, show

PLAN, SEA_TRIALS, FRICTION_TESTS, MOTOR_MAP = "plan", "sea-trials", "friction-tests", "motor-map"
LIVE, HIL = "live", "hil"
EXAMPLES = {
    PLAN: "the example plan, to edit",
    SEA_TRIALS: "SYNTHETIC logs of a crane's tests, for validate",
    FRICTION_TESTS: "SYNTHETIC logs of friction tests, for identify friction",
    MOTOR_MAP: "a SYNTHETIC supplier's map, for identify motor",
    LIVE: "a live twin with its register map, for live run",
    HIL: "the same with a soft PLC and a script, for plc run",
}
WHAT_HELP = "; ".join(f"{name}: {text}" for name, text in EXAMPLES.items()) + "."


class Kind(NamedTuple):
    """A kind of thing: the columns of its table with the keys of its JSON, and its rows."""

    columns: dict[str, str]
    rows: Callable[[], list[dict[str, Any]]]


MODELS = ("loss_model", "alternatives")
"""Fields of a motor with other loss models than MJ4, which few have."""


def _cranes() -> list[dict[str, Any]]:
    from stillhook.library import cranes, load_crane

    return [
        {"name": c.name, "title": c.title, "plant": c.plant.value, "SWL": c.SWL, "built": "paper" if c.paper else ""}
        for c in map(load_crane, cranes())
    ]


def _vessels() -> list[dict[str, Any]]:
    from stillhook.formats.vessel.open import read_vessel
    from stillhook.library.catalogue import vessels

    read = [(name, read_vessel(name)) for name in vessels()]
    return [{"vessel": name, "title": rao.name, "origin": rao.origin} for name, rao in read]


def _payloads() -> list[dict[str, Any]]:
    from stillhook.library.catalogue import payloads, read_payload

    read = map(read_payload, payloads())
    return [{"payload": p.name, "title": p.title, "mass": p.mass, "height": p.height} for p in read]


def _compensators() -> list[dict[str, Any]]:
    from stillhook.library.catalogue import compensators, read_compensator

    read = map(read_compensator, compensators())
    return [{"compensator": c.name, "title": c.title, "type": c.type, "mass": c.mass, "travel": c.travel} for c in read]


def _frictions() -> list[dict[str, Any]]:
    from stillhook.identify.compare import provenance
    from stillhook.library import frictions, load_friction, load_losses, motors

    sets = [("system friction", s, s.system) for s in map(load_friction, frictions())]
    every: list[tuple[str, Any, Any]] = [*sets, *(("motor", s, s.motor) for s in map(load_losses, motors()))]
    return [
        {
            "set": item.name,
            "kind": kind,
            "title": item.title,
            "values": values.model_dump(exclude={n for n in MODELS if getattr(values, n, None) is None}),
            "evidence": None if item.evidence is None else item.evidence.model_dump(),
            "sources": provenance(item),
        }
        for kind, item, values in every
    ]


def _controllers() -> list[dict[str, Any]]:
    from stillhook.control.registry import CONTROLLERS

    return [
        {"controller": law.name, "title": law.title, "drives": ", ".join(law.drives)} for law in CONTROLLERS.values()
    ]


def _winches() -> list[dict[str, Any]]:
    from stillhook.winches.registry import WINCH_TYPES

    return [{"winch": each.name, "title": each.title} for each in WINCH_TYPES.values()]


def _lifts() -> list[dict[str, Any]]:
    from stillhook.formats.lift_file import lifts, load_lift
    from stillhook.plan.file import plans

    read = [(name, load_lift(name, moving=False)) for name in lifts()]
    usual, more = "lower, response, payload", plans()
    return [
        {
            "lift": name,
            "title": file.lift.name,
            "crane": file.crane.name,
            "for": f"{usual}, plan" if name in more else usual,
        }
        for name, file in read
    ]


KINDS = {
    "cranes": Kind(
        {"name": "crane", "title": "description", "plant": "winch", "SWL": "SWL", "built": "built"}, _cranes
    ),
    "vessels": Kind({"vessel": "vessel", "title": "what it is", "origin": "reference point"}, _vessels),
    "payloads": Kind({"payload": "payload", "title": "what it is", "mass": "mass", "height": "height"}, _payloads),
    "compensators": Kind(
        {"compensator": "compensator", "title": "what it is", "type": "type", "mass": "mass", "travel": "stroke"},
        _compensators,
    ),
    "frictions": Kind(
        {"set": "set", "kind": "of", "title": "what it is", "evidence": "uncertainty", "sources": "source"}, _frictions
    ),
    "controllers": Kind({"controller": "controller", "title": "what it is", "drives": "for"}, _controllers),
    "winches": Kind({"winch": "winch type", "title": "what it is"}, _winches),
    "lifts": Kind({"lift": "lift", "title": "what it is", "crane": "crane", "for": "for stillhook"}, _lifts),
}
UNITS = {"SWL": "mass", "mass": "mass", "height": "length", "travel": "length"}
"""Kind of quantity of the columns that have one."""


def list_kind(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=f"One of {', '.join(KINDS)}.")], json: Json = False
) -> None:
    """List what the library has by name: cranes, vessels, payloads, compensators, frictions, lifts; and the
    controllers and winch types that may be named.

    Example: stillhook list cranes
    """
    if what not in KINDS:
        raise CommandError(f"list {quote(what)}: choose {', '.join(KINDS)}.")
    kind = KINDS[what]
    rows = kind.rows()
    cells = [[_cell(name, row[name]) for name in kind.columns] for row in rows]
    present(rows, brief=lambda: _answer_of_list(what, kind, rows, cells), json=json)


def _answer_of_list(what: str, kind: Kind, rows: list[dict[str, Any]], cells: list[list[str]]) -> Answer:
    """Names with what they are, as many as find a place, and what to do with one."""
    names = list(kind.columns)
    chosen = [i for i, name in enumerate(names) if name in SHORT]
    shown = cells if len(cells) <= MOST_NAMES else cells[: MOST_NAMES - 1]
    lines: list[Line] = [
        *columns([], [[row[i] for i in chosen] for row in shown], left=range(len(chosen)), most=MOST_NAMES)
    ]
    if hidden := [row[0] for row in cells[len(shown) :]]:
        lines.append(Cells(f"also {', '.join(hidden)}"))
    texts = {i for i, name in enumerate(names) if name in ("title", "origin", "sources")}
    lines.append(partial(print_table, tuple(kind.columns.values()), cells, left=len(names), texts=texts))
    step = OF_KIND.get(what, "")
    first = f"stillhook {step} {rows[0][names[0]]}" if step else ""
    return Answer(f"{what}: {len(rows)} in the library", lines, first, "every column")


MOST_NAMES = 8
SHORT = (
    "name",
    "vessel",
    "payload",
    "compensator",
    "set",
    "controller",
    "winch",
    "lift",
    "title",
    "SWL",
    "mass",
    "crane",
)
"""Columns of a list in its short answer."""
OF_KIND = {
    "cranes": "crane",
    "vessels": "vessel",
    "payloads": "payload",
    "lifts": "lower",
    "frictions": "friction compare",
}
"""Commands that take a name of the list."""


def _cell(name: str, value: Any) -> str:
    if name in UNITS:
        return show(value, UNITS[name])
    if name == "evidence":
        return "" if value is None else "known"
    if name == "sources":
        first, *others = value
        return f"{first}{f' (and {len(others)} more)' if others else ''}"
    return str(value)


def show_crane(name: CraneArgument, json: Json = False) -> None:
    """Print a crane's sheet: every number with its kind and source. Example: stillhook crane nov-250t"""
    from stillhook.engine.certificate import objections, twin_line
    from stillhook.library import load_crane, sheet, sheet_json
    from stillhook.spec.sub_models import levels_text, parts_of
    from stillhook.tables.plausible import implausible_values, marked

    crane = load_crane(name)
    notes = implausible_values(crane)
    certified = {} if crane.certified is None or objections(crane) else crane.certified.sub_models
    levels = {name: certified.get(name, 1) for name in parts_of(crane)}
    levels_line = f"sub-models of the twin: {levels_text(levels)}"
    rows = [(r.field, r.value, r.meaning, r.kind, r.source) for section in sheet(crane) for r in section.rows]

    kinds = Counter(kind for _, _, _, kind, _ in rows if kind)
    wire = f"{crane.drum.layers} layers of wire" if crane.drum.layers else ""
    lines: list[Line] = [
        f"SWL {show(crane.SWL, 'mass')}, hook {show(crane.hook_mass, 'mass')}, {wire}; type {crane.plant.value}.",
        f"{len(rows)} numbers: {', '.join(f'{n} {kind}' for kind, n in kinds.most_common())}.",
        *twin_lines(crane),
        levels_line if certified else partial(wrapped, levels_line),
        *notes,
        partial(print_sheet, rows),
    ]
    step = f"stillhook compare {argument(name)}, for its control error under the usual controllers"
    answer = Answer(f"{crane.name}: {crane.title}", lines, step, "every number with its source")
    more = {"twin": twin_line(crane), "sub_models": levels, "status": marked("ok", notes), "notes": list(notes)}
    present(sheet_json(crane) | more, brief=lambda: answer, json=json)


def print_sheet(rows: list[tuple[str, str, str, str, str]]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(header_style="bold")
    for title in ("field", "value", "meaning", "kind", "source"):
        table.add_column(title, overflow="fold", no_wrap=title in ("field", "value", "kind"))
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    console = Console()
    (console if console.is_terminal else Console(width=200)).print(table)


def example(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=WHAT_HELP)],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder for the files; of motor-map the CSV file.")],
    json: Json = False,
) -> None:
    """Write files to try a command on, to a place where none are yet.

    Example: stillhook example sea-trials my-tests

    Example: stillhook example plan my-lift
    """
    if what not in EXAMPLES:
        raise CommandError(f"example {quote(what)}: choose {', '.join(EXAMPLES)}.")
    write = {PLAN: _plan, MOTOR_MAP: _map, LIVE: _live, HIL: _hil}.get(what, lambda folder: _campaign(what, folder))
    answer, lines = write(out)
    title, *more = lines
    steps = [line.removeprefix(NEXT) for line in more if line.startswith(NEXT)]
    brief = lambda: Answer(title, [line for line in more if not line.startswith(NEXT)], "; then ".join(steps))
    present(answer, brief=brief, json=json)


NEXT = "next: "
"""Start of lines that say what to do."""


def _plan(out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.plan.file import copy_plan

    first, *rest = copy_plan("template-to-1500m", out)
    written = [str(path) for path in (first, *rest)]
    return {"plan": str(first), "files": written}, [
        f"written: {', '.join(written)}",
        f"next: edit it, and stillhook plan {first} --check",
    ]


def _hil(out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.library.examples import HIL as HIL_FILES
    from stillhook.library.examples import example_files

    written = [str(path) for path in example_files(HIL_FILES, out)]
    live, plc = str(out / "live.toml"), str(out / "plc.toml")
    return {"live": live, "plc": plc, "files": written}, [
        f"written: {', '.join(written)}",
        f"next: stillhook live run {live} --allow-writes",
        f'next: in parallel stillhook plc run {plc} --duration "60 s"',
    ]


def _map(out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.library.examples import example_map

    path = example_map(out)
    return {"map": str(path)}, [f"written: {path}, a SYNTHETIC map", f"next: stillhook identify motor {path}"]


def _live(out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.library.examples import LIVE as LIVE_FILES
    from stillhook.library.examples import example_files

    written = [str(path) for path in example_files(LIVE_FILES, out)]
    live = str(out / "live.toml")
    return {"live": live, "files": written}, [f"written: {', '.join(written)}", f"next: stillhook live run {live}"]


def _campaign(what: str, out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.library import examples

    command, folder = {
        SEA_TRIALS: ("validate", examples.SEA_TRIALS),
        FRICTION_TESTS: ("identify friction", examples.FRICTION_TESTS),
    }[what]
    campaign = examples.example_campaign(folder, out)
    reference = campaign.with_name(examples.REFERENCE_FILE)
    logs = sorted(map(str, (out / "logs").iterdir()))
    return {"campaign": str(campaign), "logs": logs, "reference": str(reference)}, [
        examples.MARK,
        f"written: {campaign}, {out / 'logs'}; the crane that was simulated: {reference}",
        f"next: stillhook {command} {campaign} --out {out / 'result'}",
    ]
