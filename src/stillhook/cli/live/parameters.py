"""`stillhook live parameters`: friction, leakage, displacement, gas and delays of a running winch from its log."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.parser import Columns, Json, Load, MappingFile, present
from stillhook.report.formatting import wrapped
from stillhook.report.terminal import Answer, Cells, Line, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stillhook.live.estimate import FrictionState
    from stillhook.statistics.estimate import Estimate

ROWS = 12
"""Estimates of friction that the table shows at most."""


def parameters(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a crane (CSV, Parquet, MDF4, TDMS, MAT).")],
    crane: Annotated[str, typer.Option(metavar="CRANE|CASE", help="Crane, or case file that names it.")],
    mapping: MappingFile = None,
    column: Columns = None,
    load: Load = None,
    json: Json = False,
) -> None:
    """Follow friction, leakage, displacement, gas charge and delays of a winch through a log of it compensating: each
    against the crane file, with a 95 % interval, and steps.

    Half waves of the last 5 minutes count. Exit code 1 if a step was found, or nothing could be estimated.

    Example: stillhook live parameters log.csv --crane nov-250t --mapping mapping.toml
    """
    from stillhook.formats.case_file import load_subject
    from stillhook.live.estimate import FrictionEstimator, follow_friction
    from stillhook.logs.log import read_log
    from stillhook.logs.understood import signals_of
    from stillhook.units import parse

    of = load_subject(crane)
    weight = None if load is None else parse(load, "mass", "--load")
    read = read_log(log, signals_of(log, mapping, column))
    estimator = FrictionEstimator(of.crane, load=weight)
    states = follow_friction(estimator, {"time": read.t if read.at is None else read.at, **read.signals}, every=30.0)
    last = states[-1]
    data = {"states": [asdict(s) for s in states if s.estimate is not None], "last": asdict(last)}
    present(data, brief=lambda: _answer(states, read.source), json=json)
    others = last.parameters.values()
    nothing = last.estimate is None and all(p.estimate is None for p in others)
    raise typer.Exit(1 if last.alarms or any(p.alarms for p in others) or nothing else 0)


def _answer(states: Sequence[FrictionState], source: str) -> Answer:
    """Friction and the other parameters at the end with 95 % intervals, and alarms."""
    last, known = states[-1], [s for s in states if s.estimate is not None]
    alarms = (*last.alarms, *(a for p in last.parameters.values() for a in p.alarms))
    lines: list[Line] = [f"ALARM at {alarm.t:.0f} s: {alarm.message}" for alarm in alarms] or ["No step was found."]
    if last.estimate is not None:
        loss, system = _of_friction(last)
        lines.append(f"Friction over that of the crane file: all losses {loss}, system friction {system}.")
    lines += [
        Cells(f"{p.meaning}: {_text(p.estimate.value, p.unit)}.")
        for p in last.parameters.values()
        if p.estimate is not None
    ]
    shown = known[:: max(1, -(-len(known) // ROWS))]
    if known and shown[-1] is not known[-1]:
        shown.append(known[-1])
    if rows := [[f"{s.t:.0f}", *_of_friction(s)] for s in shown]:
        header = ["time [s]", "all losses", "system friction, if the motors' loss is as in the file"]
        lines.append(partial(print_table, header, rows, title="Friction over that of the crane file"))
    others = [
        [p.meaning, "" if p.estimate is None else _text(p.estimate.value, p.unit), "; ".join(p.reasons or _doubt(name))]
        for name, p in last.parameters.items()
    ]
    lines.append(partial(print_table, ["parameter", "now", "remark"], others, title="Other parameters"))
    if last.estimate is not None:
        clock = last.estimate.clock
        late = f"{1e3 * clock.offset:.1f} ms, +-{1e3 * clock.t * clock.u:.1f} ms" if clock.found else "not known"
        lines.append(partial(wrapped, f"Rows of the encoder are later than those of the pressures by: {late}."))
    lines += list(dict.fromkeys((*last.reasons, *last.bounds)))
    if last.left_out:
        left_out = ", ".join(f"{n} {reason}" for reason, n in last.left_out.items())
        lines.append(partial(wrapped, f"Half waves left out: {left_out}."))
    return Answer(f"{source}: parameters at the end, with 95 % intervals", lines, more="course over time, remarks")


def _of_friction(of: FrictionState) -> list[str]:
    """All losses and system friction, with their intervals."""
    assert of.estimate is not None
    return [f"{x.value:.3f} ({x.low:.3f} to {x.high:.3f})" for x in (of.estimate.loss, of.estimate.system)]


def _doubt(name: str) -> tuple[str, ...]:
    from stillhook.live.estimate.parameters.catalogue import PROVEN

    return () if name in PROVEN else ("interval not shown to hold",)


def _text(x: Estimate, unit: str) -> str:
    """An estimate as people read it: a delay in ms, an offset in %, a factor as it is."""
    scale, word, digits = {"s": (1e3, " ms", 1), "1": (100.0, " %", 2)}.get(unit, (1.0, "", 3))
    value, low, high = (f"{scale * y:.{digits}f}" for y in (x.value, x.low, x.high))
    return f"{value}{word} ({low} to {high}{word})"
