"""`stillhook payload`: what is suspended from the hook, and what water makes of it."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import typer

from stillhook.cli.parser import Json, Out, check_out, present
from stillhook.errors import LiftError
from stillhook.report.formatting import display_number, display_unit, variable
from stillhook.report.terminal import Answer, Cells, Line, print_table, print_values
from stillhook.units import parse, quote

RHO = "1025 kg/m^3"
LIGHT, DENSE = 900.0, 1300.0  # kg/m^3: fresh water to brine, and some room
OUT_FILES = ("payload.png", "payload.json")
PAYLOAD_HELP = "Payload of the library or its file (TOML), or a lift and its file."
COLUMNS = ("h", "V", "A33", "dA33", "B")
EVERY = 16  # of the levels, on the printed table


def payload(
    name: Annotated[str, typer.Argument(help=PAYLOAD_HELP, metavar="PAYLOAD|FILE")],
    rho: Annotated[str | None, typer.Option(help=f"Density of the water (default {RHO}, or that of the lift).")] = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Weight in water, added mass, drag, slamming and sinking speed of a payload, over submergence, with the source of
    every number.

    Example: stillhook payload suction-anchor-85t
    """
    from stillhook.formats.lift_file import is_lift, payload_in
    from stillhook.library.catalogue import read_payload
    from stillhook.report.payload_sheet import payload_figure, payload_numbers
    from stillhook.tables.plausible import implausible_values

    load, of_lift = payload_in(name) if is_lift(name) else (read_payload(name), None)
    density = of_lift if rho is None and of_lift is not None else parse(rho or RHO, "density", "--rho")
    if not LIGHT <= density <= DENSE:
        raise LiftError(
            f"--rho = {quote(rho)}: is not the density of sea water, {LIGHT:g} to {DENSE:g} kg/m^3. Check the unit."
        )
    check_out(out, OUT_FILES)
    answer = payload_numbers(load, density) | {"notes": list(implausible_values(load))}
    picture, numbers = OUT_FILES
    pictures = lambda: {picture: payload_figure(load, rho=density)}
    present(answer, out, {numbers: answer}, brief=lambda: _answer(answer), json=json, pictures=pictures)


def _answer(answer: dict[str, Any]) -> Answer:
    """The payload's numbers, by name and unit, and what to check."""
    values, levels = {k: v for k, v in answer.items() if isinstance(v, float)}, answer["levels"]
    text = ", ".join(f"{n} {variable(n, v)}" for n, v in values.items())
    header = [f"{name} [{display_unit(name) or '-'}]" for name in COLUMNS]
    dust = {name: 1e-9 * max(abs(level[name]) for level in levels) for name in COLUMNS}
    rows = [
        [display_number(name, level[name] if abs(level[name]) > dust[name] else 0.0, 4) for name in COLUMNS]
        for level in levels[::EVERY]
    ]
    stated = [(s["field"], s["kind"], s["source"]) for s in answer["sources"]]
    check = "Coefficients follow DNV-RP-N103, not compared with a printed edition: check them against yours. Results of"
    lines: list[Line] = [
        Cells(f"{text}."),
        partial(print_values, values),
        partial(print_table, header, rows, left=0, title="Over submergence: every sixteenth level"),
        partial(print_table, ("field", "kind", "source"), stated, left=3),
        *answer["notes"],
        f"{check} a model test or CFD take precedence." if answer["shape"] != "levels" else "",
    ]
    title = f"{answer['payload']}: {answer['title'] or 'payload of your own'} ({answer['shape']})"
    return Answer(title, lines, more="meanings, coefficients over submergence, sources")
