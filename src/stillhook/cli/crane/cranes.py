"""`stillhook cranes`, `stillhook crane NAME`."""

from __future__ import annotations

from typing import Annotated

import typer

from stillhook.cli.options import Json
from stillhook.report.terminal import print_implausible, print_json, print_table, print_twin


def register(app: typer.Typer) -> None:
    app.command("cranes")(list_cranes)
    app.command("crane")(show_crane)


def list_cranes(json: Json = False) -> None:
    """List the cranes of the library. Example: stillhook cranes"""
    from stillhook.library import cranes, load_crane
    from stillhook.units import show

    known = [load_crane(name) for name in cranes()]
    if json:
        print_json([{"name": c.name, "title": c.title, "plant": c.plant.value, "SWL": c.SWL} for c in known])
        return
    print_table(
        ("crane", "description", "winch", "SWL"),
        [(c.name, c.title, c.plant.value, show(c.SWL, "mass")) for c in known],
        left=3,
    )


def show_crane(
    name: Annotated[str, typer.Argument(help="Library name, or path of a crane file (TOML).")],
    json: Json = False,
) -> None:
    """Print a crane's sheet: every number with its kind and source. Example: stillhook crane nov-250t"""
    from stillhook.engine.validity import twin_line
    from stillhook.library import load_crane, sheet, sheet_json
    from stillhook.tables.plausible import implausible_values, marked

    crane = load_crane(name)
    notes = implausible_values(crane)
    if json:
        print_json(sheet_json(crane) | {"twin": twin_line(crane), "status": marked("ok", notes), "notes": list(notes)})
        return
    print(f"{crane.name}: {crane.title}")
    print_twin(crane)
    print_implausible(crane)
    rows = [(r.field, r.value, r.meaning, r.kind, r.source) for section in sheet(crane) for r in section.rows]
    print_sheet(rows)


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
