"""`stillhook live history`: what a twin beside a crane has stored."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.parser import Json, present, refuse
from stillhook.report.formatting import counted
from stillhook.report.terminal import Answer, Cells, print_table, say

SHOWN_EVENTS = 20


def history(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a history; a twin may write it now.")],
    start: Annotated[
        str | None, typer.Option("--from", help="UTC from which on, such as 2026-11-28T13:00 (default all).")
    ] = None,
    end: Annotated[str | None, typer.Option("--to", help="UTC before which, such as 2026-11-28T14:00.")] = None,
    signals: Annotated[str | None, typer.Option(help="Columns, with commas (default all).")] = None,
    every: Annotated[str | None, typer.Option(help='Evenly spaced, such as "1 s" (default as stored).')] = None,
    out: Annotated[Path | None, typer.Option("--out", help="File to write: .csv, .nc, .parquet, .mat or .mf4.")] = None,
    check: Annotated[bool, typer.Option("--check", help="Read every byte and report what is damaged.")] = False,
    json: Json = False,
) -> None:
    """Print what a history holds and its last events, and write a range of it to a file.

    With --check exit code 1 if a file is not as it was written.

    Example: stillhook live history twin --from 2026-11-28T13:00 --to 2026-11-28T14:00 --signals p_a,F_w --out hour.csv
    """
    from stillhook.live.history import check as damaged
    from stillhook.live.history import describe, overview, read, read_events, save

    if out is None:
        refuse({"--signals": signals, "--every": every}, "belongs to --out.")
    found = overview(folder)
    events = read_events(folder, start=start, end=end)
    harm = damaged(folder) if check else []
    if out is not None:
        names = None if signals is None else [name.strip() for name in signals.split(",") if name.strip()]
        run = read(folder, start=start, end=end, signals=names, every=every)
        save(run, out)
        for line in filter(None, run.attrs["left_out"].split("\n")):
            say(line)
    written = {} if out is None else {"written": str(out), "left_out": run.attrs["left_out"].split("\n")}
    listed = [{**event._asdict(), "data": dict(event.data)} for event in events]
    lines = describe(found)

    last = [Cells(f"Last event {event.when}, {event.kind.value}: {event.text}") for event in events[-1:]]
    shown = events[-SHOWN_EVENTS:]
    rows = [[event.when, str(event.row), event.kind.value, event.text] for event in shown]
    title = f"Events, the last {len(shown)} of {len(events)}"
    damage = f"DAMAGED: {'; '.join(harm)}" if harm else "No damage found." if check else ""
    table = partial(print_table, ["time", "row", "kind", "event"], rows, title=title, texts={2, 3})
    more = f"the last of {counted(len(events), 'event')}"
    answer = Answer(lines[0], [damage, *lines[1:], *last, table], more=more)
    data = {**found.to_dict(), "events_in_range": listed, "damaged": harm, **written}
    present(data, brief=lambda: answer, json=json)
    if out is not None and not json:
        print(f"written: {out}, {run.sizes['time']} rows")
    raise typer.Exit(1 if harm else 0)
