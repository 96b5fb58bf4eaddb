"""`stillhook condition`: a crane over years, from dated campaigns."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from stillhook.base.gateway.inputs import collecting
from stillhook.cli.parser import Json, Out, announce, present, refuse, say_left_out
from stillhook.errors import CommandError
from stillhook.report.document import Document, Table, words
from stillhook.report.formatting import wrapped
from stillhook.report.terminal import answer_of, columns, print_document, progress_bar


def condition(
    campaigns: Annotated[
        list[Path], typer.Argument(metavar="CAMPAIGN...", help="Campaign files of validate, or folders that hold them.")
    ],
    out: Out = None,
    watch: Annotated[
        str | None, typer.Option(help='Continue, and look for new campaigns this often: "10 min". Ends with Ctrl-C.')
    ] = None,
    json: Json = False,
) -> None:
    """Follow a crane through dated campaigns: friction, leakage, gas charge, lines and inertia with trends, the time to
    their limits, a crane file for each date, and whether its certificate still counts for planning.

    With --out what is known is kept, and the state is written beside the crane file, where stillhook plan reads it.
    Exit code 1 if drift is shown, validity is withdrawn or a campaign of a folder was refused.

    Example: stillhook condition 2026/campaign.toml 2027/campaign.toml --out condition

    Example: stillhook condition campaigns --out condition --watch "10 min"
    """
    from stillhook.units import parse

    if watch is None:
        raise typer.Exit(0 if _pass(campaigns, out, json=json) else 1)
    refuse({"--json": json}, "prints one answer, and --watch continues. Leave one of the two out.")
    if out is None:
        raise CommandError("--watch: it keeps its state in a folder. Give --out FOLDER.")
    every = parse(watch, "time", "--watch")
    if not every >= 1.0:
        raise CommandError(f"--watch {watch}: look at most once a second, such as 10 min.")
    before: tuple[str, ...] | None = None
    while True:
        with collecting({"campaigns": campaigns}):  # of each look by itself: logs may change between two
            before = _look(campaigns, out, before)
        time.sleep(every)


def _pass(campaigns: list[Path], out: Path | None, *, json: bool) -> bool:
    """Follow once."""
    from stillhook.live.condition.follow import follow_condition
    from stillhook.live.condition.outputs import check_out, document, save_condition, to_dict

    if out is not None:
        check_out(out)
    with progress_bar("following") as bar:
        result = follow_condition(campaigns, out, progress=bar)
    written = save_condition(result, out) if out is not None else ()
    full = document(result)
    brief = lambda: answer_of(full, more="every number, basis", lines=trends(full))
    present(to_dict(result), brief=brief, json=json, show=lambda: print_document(full))
    if written and out is not None and not json:
        announce(out, [*(name for name in written if not name.startswith("crane-")), "crane files"])
    if out is not None:
        say_left_out()
    return result.fine


def trends(full: Document) -> Sequence[str]:
    """Each followed number today, and the time until its limit."""
    table = next(part for part in full.front if isinstance(part, Table))
    rows = [[words(row[i]) for i in (0, 2, 4)] for row in table.rows]
    return columns(["number", "today", "time to limit"], rows, left=(0, 1, 2))


def _look(campaigns: list[Path], out: Path, before: tuple[str, ...] | None) -> tuple[str, ...]:
    """Follow again where there is something new; a folder that is away is waited for. Gives what was there."""
    from stillhook.errors import StillhookError
    from stillhook.live.condition.follow import follow_condition
    from stillhook.live.condition.outputs import document, save_condition
    from stillhook.live.condition.sources import gather

    try:
        gathered = gather(campaigns, out=out, vanished=True)
        certified = [c.crane.certified.short for c in gathered.campaigns if c.crane.certified is not None]
        files = [*(str(c.file) for c in gathered.campaigns), *certified, *map(repr, gathered.events)]
        present = (*files, *gathered.refused, *gathered.waiting)
        if present == before or not gathered.campaigns:
            if present != before:
                wrapped(f"waiting: {'; '.join(gathered.waiting) or 'no campaign yet'}")
            return present
        result = follow_condition(campaigns, out, vanished=True)
        save_condition(result, out)
        print_document(document(result))
    except StillhookError as problem:  # of this look: the next one may find it mended
        present = (str(problem),)
        if present != before:
            wrapped(f"not followed: {problem}")
    return present
