"""`stillhook map`: error, pressure, settling time and motor displacement of controllers over load and speed."""

from __future__ import annotations

import math
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import (
    Controllers,
    Json,
    Out,
    SubjectArgument,
    check_out,
    client_of,
    present,
    refuse,
)
from stillhook.errors import SpecError
from stillhook.report.formatting import argument, wrapped
from stillhook.report.terminal import Answer, Line, columns, print_table, progress_bar, started, twin_lines
from stillhook.units import in_display, number, quote, show

if TYPE_CHECKING:
    from stillhook.analysis.maps.result import Map
    from stillhook.sea.motion.motion import Motion
    from stillhook.spec.crane import Crane

SETTLING = "settling"
METRICS = {"e_c_pp": "e_c_pp", "eta_c": "eta_c", "p_max": "p_max", "alpha_m": "alpha_m_min", SETTLING: "settling_time"}
"""Option -> value of a map."""
LABELS = {"e_c_pp": "error", "p_max": "peak pressure", "settling_time": "settling time"}
FILES = ("map.nc", "map.json")
RANGE = 'list, or "A to B by STEP"'


def show_map(
    crane: SubjectArgument = "nov-250t",
    controllers: Controllers = None,
    metric: Annotated[str, typer.Option(help=f"What the table shows: {', '.join(METRICS)}.")] = "e_c_pp",
    loads: Annotated[
        str | None, typer.Option(help=f'Loads: {RANGE}. Default: "20 % to 100 % by 10 %" of the SWL.')
    ] = None,
    speeds: Annotated[
        str | None, typer.Option(help=f'Peak speeds: {RANGE}. Default: "10 m/min to 120 m/min by 10 m/min".')
    ] = None,
    periods: Annotated[
        str | None, typer.Option(help="Period of the sine (default 12 s); several add a dimension.")
    ] = None,
    layer: Annotated[
        list[int] | None, typer.Option(help="Layer in use (default: outermost); repeat it for several.")
    ] = None,
    s_w: Annotated[str | None, typer.Option("--s-w", help="Wire paid out, instead of the middle of a layer.")] = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Map of controllers over load and speed: error, pressure, and where each cannot be used, and why. Exit code 1 if
    none can be anywhere.

    Of a case file are taken: tip (a motion other than a sine, made larger or smaller in every cell), s_w, duration and
    warm_up of each run (30 s and 10 s), step, and where results are kept (settings.store), so that an interrupted map
    continues.

    Example: stillhook map nov-250t --controllers ns,hs,ssc --metric p_max --out maps
    """
    from stillhook.formats.case_file import load_subject

    if metric not in METRICS:
        raise SpecError(f"--metric {quote(metric)}: not one of {', '.join(METRICS)}.")
    check_out(out, FILES)
    subject = load_subject(crane)
    machine = subject.crane
    _check_metric(machine, metric)
    arguments = {"loads": loads, "speeds": speeds, "s_w": s_w or subject.scenario.get("s_w"), "step": subject.step}
    arguments["layers"] = layer[0] if layer is not None and len(layer) == 1 else layer or None
    if metric == SETTLING:
        reason = "a settling test has the tip at rest and its own times, and is not kept. Leave it out."
        times = {f"scenario.{name}": subject.scenario.get(name) for name in ("tip", "duration", "warm_up")}
        refuse({"--periods": periods, **times, "settings.store": subject.settings.store}, reason)
    else:
        arguments |= {name: subject.scenario.get(name) for name in ("duration", "warm_up")}
        arguments |= _waves(subject.scenario.get("tip"), periods) | {"store": subject.settings.store}
    arguments = {name: value for name, value in arguments.items() if value is not None}
    with client_of(subject.settings.scheduler) as client, progress_bar(f"map of {machine.name}") as bar:
        result = _run(machine, controllers, metric, arguments | {"client": client, "progress": started(machine, bar)})

    def pictures() -> dict[str, Any]:
        from stillhook.analysis.maps.figures import figures

        return {f"{name}.png": figure for name, figure in figures(result).items()}

    record = result.record()
    files = None if out is None else dict(zip(FILES, (result.dataset(), record), strict=True))
    brief = lambda: _answer(result, metric)
    present(record, out, files, brief=brief, json=json, pictures=pictures, cranes=[result.crane])
    raise typer.Exit(0 if bool(result.applicable.any()) else 1)


def _check_metric(crane: Crane, metric: str) -> None:
    """Refuse a value that this winch type does not have before anything runs."""
    from stillhook.engine.scenario.summary import numbers_of

    available = [m for m, name in METRICS.items() if m == SETTLING or name in numbers_of(crane)]
    if metric not in available:
        raise SpecError(
            f'--metric {metric}: winch type "{crane.plant}" of "{crane.name}" has no {METRICS[metric]}. Choose'
            f" {', '.join(available)}."
        )


def _waves(tip: Motion | None, periods: str | None) -> dict[str, Any]:
    """Arguments of the map for the motion of the tip; periods that are typed are those of a sine."""
    if periods is not None:
        return {"periods" if "," in periods or " to " in periods else "period": periods}
    return {} if tip is None else {"motion": tip}


def _run(crane: Crane, controllers: str | None, metric: str, arguments: dict[str, Any]) -> Map:
    from stillhook.analysis.controllers import controllers as named
    from stillhook.analysis.controllers import usual_controllers

    chosen = named(controllers or usual_controllers(crane))
    if metric == SETTLING:
        from stillhook.analysis.maps.settling import settling_of

        return settling_of(crane, chosen, **arguments)
    from stillhook.analysis.maps.operability import map_of

    return map_of(crane, chosen, **arguments)


def _answer(result: Map, metric: str) -> Answer:
    """Where each controller is applicable, its median number there, and what limits it most."""
    from collections import Counter

    import numpy as np

    from stillhook.analysis.maps.result import SHOWN

    name, axes = METRICS[metric], result.axes
    words, factor, digits = SHOWN[name]
    rows = []
    for i, (label, summary) in enumerate(result.summary().items()):
        values = result.values[name][i][result.cause[i] == ""]
        shown = [f"{x * factor:.{digits}f}" for x in (np.median(values), values.max())] if values.size else ["-"] * 2
        causes = Counter(str(c) for c in result.cause[i].ravel() if c).most_common(1)
        rows.append(
            [controller_name(label), f"{summary['applicable_share']:.0%}", *shown, causes[0][0] if causes else "-"]
        )
    ends = [show(x, kind) for kind, of in (("mass", axes.loads), ("speed", axes.speeds)) for x in (min(of), max(of))]
    applicable, *against = _comparisons(result)
    lines: list[Line] = [
        *columns(["controller", "applicable", "median", "largest", "most frequent limit"], rows, left=(0, 4)),
        partial(_print, result, name),
        partial(wrapped, f"{applicable}."),
        *(f"{part}." for part in against),
        *twin_lines(result.crane),
        _not_validated(result),
    ]
    title = f"{result.crane.name}: {words}; {ends[0]} to {ends[1]}, {ends[2]} to {ends[3]}"
    step = f"stillhook tune {argument(result.crane.name)}, for each controller with its best tuning"
    cells = f"{len(axes.loads) * len(axes.speeds)} cells of each controller"
    return Answer(title, lines, step, cells, result.about["notes"])


def _print(result: Map, name: str) -> None:
    """A table for every controller, layer and period; then the meaning of the marks."""
    from stillhook.analysis.maps.result import MARKS, SHOWN

    _, factor, digits = SHOWN[name]
    axes, used = result.axes, set()
    print(f"load on the hook down, {result.about['speed_is']} [m/min] across")
    head = ["", *(number(in_display(v, "speed"), 4) for v in axes.speeds)]
    for i, k, j in product(range(len(result.labels)), range(len(axes.layers)), range(len(axes.periods))):
        rows = []
        for m, load in enumerate(axes.loads):
            cells = list(zip(result.values[name][i, m, :, k, j], map(str, result.cause[i, m, :, k, j]), strict=True))
            used |= {cause for _, cause in cells if cause}
            texts = [MARKS.get(c, "never") if c else f"{v * factor:.{digits}f}" for v, c in cells]
            rows.append([show(load, "mass"), *texts])
        layer = axes.layers[k]
        where = [f"{show(axes.s_w[k], 'length', 3)} of wire", *([f"layer {layer}"] if layer else [])]
        print(f"\n{controller_name(result.labels[i])}: {', '.join((*where, *_wave(result, axes.periods[j])))}")
        print_table(head, rows)
    if used:
        available = [c for c in MARKS if c in used]
        marks = (f"{MARKS.get(c, 'never')} = {c}" for c in (*available, *sorted(used - set(available))))
        print(f"not applicable: {'; '.join(marks)}")


def _not_validated(result: Map) -> str:
    """In how many cells a certified twin is not validated; empty for any other."""
    if result.crane.certified is None or "validated" not in result.values:
        return ""
    with_mode = [i for i, mode in enumerate(result.modes) if mode is not None]  # "best classic" is made of others
    inside = result.values["validated"][with_mode] > 0.0
    return (
        f"cells that are not validated: {int((~inside).sum())} of {inside.size}; credit them with 80 % of compensation"
        " at most"
    )


def _wave(result: Map, period: float | None) -> list[str]:
    motion = result.about.get("motion")
    return [] if motion is None else [f"{motion} of {show(period, 'time')}" if period is not None else str(motion)]


def controller_name(label: str) -> str:
    """A controller's name in a heading: an abbreviation in capitals, as pictures have it."""
    from stillhook.analysis.controllers import PLAIN

    capitals = label.upper()
    return capitals if label in PLAIN and PLAIN[label].law.label == capitals else label


def _comparisons(result: Map) -> list[str]:
    """Where each controller can be used, and the new ones against the best classic one."""
    from stillhook.analysis.maps.result import BEST_CLASSIC
    from stillhook.control.registry import CLASSIC

    summary = result.summary()
    parts = [
        "applicable: "
        + ", ".join(f"{controller_name(label)} {s['applicable_share']:.0%}" for label, s in summary.items())
    ]
    for label, mode in zip(result.labels, result.modes, strict=True):
        medians = {name: summary[label].get(f"{name}_change_median", math.nan) for name in LABELS}
        texts = [f"{LABELS[name]} {x:+.0%}" for name, x in medians.items() if math.isfinite(x)]
        if texts and label != BEST_CLASSIC and mode not in CLASSIC:
            parts.append(f"{controller_name(label)} against best classic (median where both apply): {', '.join(texts)}")
    return parts
