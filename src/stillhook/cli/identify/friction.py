"""`stillhook identify friction`: crane tests in, system friction with its uncertainty out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Json, Out, check_out, say_left_out, write_out
from stillhook.report.terminal import print_document, print_json, progress_bar, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stillhook.identify.system_friction.identify import Friction
    from stillhook.identify.system_friction.measure import Measured


SET, REPORT, NUMBERS, POINTS, STRETCHES = "friction.toml", "report.html", "summary.json", "points.csv", "stretches.csv"
LOG_DPI = 80  # pictures of complete logs in the report: a dozen of them, each a thousand points wide


def friction(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file: crane, signals, and one test a log.")
    ],
    out: Out = None,
    proposals: Annotated[int, typer.Option(min=0, max=20, help="How many further tests to propose.")] = 3,
    json: Json = False,
) -> None:
    """Identify system friction from the logs of crane tests (thesis section 2.3, paper D).

    The campaign's table [fit] has like (set of a similar winch, for what the tests cannot determine), loops of the
    second loop, map (supplier's, to compare with the fitted motor), keep_Y_2, variant and seed.

    Exit code 1 if the data cannot determine what a winch model needs.

    Example: stillhook identify friction my-tests/campaign.toml --out results
    """
    from stillhook.identify.system_friction.identify import friction as identify
    from stillhook.identify.system_friction.report import report

    check_out(out, (SET, REPORT, NUMBERS, POINTS, STRETCHES))
    with progress_bar("reading the logs") as bar:
        result = identify(campaign, proposals=proposals, progress=bar)
    if json:
        from stillhook.identify.system_friction.result import to_dict

        print_json(to_dict(result))
    else:
        print_document(report(result, {}))
    if out is not None:
        write_out(out, dict(sorted(_files(result).items())), quiet=json)
        say_left_out()
    raise typer.Exit(0 if result.usable else 1)


def _files(result: Friction) -> dict[str, Any]:
    """Set, report, numbers, tables and figures by file. A set that must not be used is left out."""
    from stillhook.identify.system_friction.report import figures, report
    from stillhook.identify.system_friction.result import (
        friction_set,
        points_table,
        second_loop_sets,
        stretches_table,
        to_dict,
        warnings,
    )
    from stillhook.library.parameter_sets import set_toml
    from stillhook.report.html import html
    from stillhook.report.pictures import drawn, pngs

    pictures = drawn(lambda: pngs(figures(result)))
    logs = drawn(lambda: pngs({m.test.name: _log_figure(m) for m in result.measured}, LOG_DPI))
    files: dict[str, Any] = {f"{stem}.png": data for stem, data in pictures.items()}
    files |= {REPORT: html(report(result, pictures, logs)), NUMBERS: to_dict(result)}
    files |= {POINTS: points_table(result).to_csv(index=False), STRETCHES: stretches_table(result).to_csv(index=False)}
    if not result.usable:
        say(f"{SET} is not written: the data cannot determine what a winch model needs.")
        return files
    files[SET] = warnings(result) + set_toml(friction_set(result))
    for item in second_loop_sets(result) if result.second is not None else ():
        files[f"{item.name}.toml"] = set_toml(item)
    return files


def _log_figure(m: Measured) -> Figure:
    from stillhook.identify.curve import window_figure

    return window_figure(m.log, "omega_m", "dp_m", m.steady, m.pairs.unpaired, f"test {m.test.name}: {m.log.source}")
