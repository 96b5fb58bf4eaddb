"""`stillhook compare --drives`: which drive for this crane?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.cli.parser import check_out, present
from stillhook.report.formatting import EMPTY, cell, fmt, percent, wrapped
from stillhook.report.terminal import Answer, Line, columns, print_table, progress_bar, say
from stillhook.units import in_unit, number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stillhook.analysis.drives.comparison import DriveComparison, DriveRun
    from stillhook.analysis.drives.costs import CostFile, OwnerRow
    from stillhook.formats.case_file import Subject
    from stillhook.spec.scenario import Scenario

FILES = ("compare-drives.json", "compare-drives.nc", "compare-drives.png")
HEADERS = (
    "drive",
    "error\np-p 30 s",
    "5-95 %\nof draws",
    "effi-\nciency",
    "net kWh\nper h",
    "5-95 %\nof draws",
    "drawn",
    "re-\nturned",
    "top\nspeed",
    "stroke\np-p",
    "installed",
    "numbers\nassumed",
    "status",
)


def compare_drives(
    subject: Subject, case: Scenario, drives: str, *, plan: str | None, out: Path | None, json: bool
) -> bool:
    """Run, print and write the comparison; whether a drive stayed inside every limit."""
    from stillhook.analysis.drives import comparison as analysis
    from stillhook.analysis.drives.costs import load_costs
    from stillhook.analysis.drives.sizing import drives as named

    crane, settings = subject.crane, subject.settings
    costs = load_costs(drives) if drives.strip().lower().endswith(".toml") else None
    names = named(drives) if costs is None else list(costs.drive)
    check_out(out, (*FILES, *(sankey(name) for name in names)))
    lift_plan = None
    if plan is not None:
        from stillhook.plan.planning import plan_with_weather

        lift_plan = plan_with_weather(plan)
    options: dict[str, Any] = {"seed": settings.seed, "v_top": settings.top_speed, "step": subject.step}
    analysis.check_comparison(crane, case, names, settings.draws)
    say("sizing the drives; a winch model that is new to this machine compiles once, in some 20 s each ...")
    with progress_bar("comparing") as bar:
        result = analysis.compare_drives(crane, case, names, n=settings.draws, progress=bar, **options)
    data = result.to_dict()
    if lift_plan is not None:
        from stillhook.plan.planning import days_gained

        with progress_bar("planning") as bar:
            sized = [run.drive for run in result.ordered()]
            data["plan"] = days_gained(lift_plan, sized, full=settings.full_plan, progress=bar)
    rows: tuple[OwnerRow, ...] = ()
    if costs is not None:
        from stillhook.cli.analysis.owner import owner_json, owner_view

        rows = owner_view(result, costs, lift_plan, data.get("plan"))
        data["owner"] = owner_json(rows, costs)
    title = f"{crane.name}, {fmt(case.load, 'mass')}, {fmt(case.s_w, 'length')} of wire out"
    title += f", tip: {case.tip.describe().split(':')[0]}"

    def pictures() -> dict[str, Any]:
        from stillhook.analysis.drives.figures import bars_figure, sankey_figure

        return {FILES[2]: bars_figure(result, title=title)} | {
            sankey(run.name): sankey_figure(run) for run in result.runs
        }

    files = {FILES[0]: data, FILES[1]: result.dataset()} if out is not None else None

    brief = lambda: _answer(result, data, title, rows, costs)
    present(data, out, files, brief=brief, json=json, pictures=pictures, cranes=[crane])
    return result.ok


def sankey(name: str) -> str:
    """File of the energy picture of a drive."""
    return f"energy-{name}.png"


def _answer(
    result: DriveComparison, data: dict[str, Any], title: str, owner: Sequence[OwnerRow], costs: CostFile | None
) -> Answer:
    """Error, net energy, installed power and status of each drive, and which are best; with a table of costs these."""
    runs = result.ordered()
    rows = [
        [
            run.name,
            cell("e_c_pp", run.value("e_c_pp")),
            f"{_kwh(run.energy.net)} kWh/h",
            fmt(run.P_installed, "power", 3),
            run.status,
        ]
        for run in runs
    ]
    best = [result.verdict(name) for name in ("e_c_pp", "energy_net")]
    short = [*columns(["drive", "error p-p", "net energy", "installed", "status"], rows, left=(0, 4)), *best]
    lines: list[Line] = [*short, "Not validated: no certificate."]
    if costs is not None:
        from stillhook.cli.analysis.owner import HEADERS as OF_OWNER
        from stillhook.cli.analysis.owner import owner_remarks, owner_row, owner_title

        heads = [head.replace("-\n", "").replace("\n", " ") for head in OF_OWNER]
        cells = [owner_row(row) for row in owner]
        lines = [
            *columns(heads, cells, left=(0, len(heads) - 1)),
            partial(print_table, OF_OWNER, cells, title=owner_title(costs)),
            *owner_remarks(owner),
            *(partial(wrapped, line) for line in best),
        ]
    lines.append(partial(print_table, HEADERS, [_row(run) for run in runs]))
    lines += [
        partial(wrapped, f"{run.drive.describe()}; top speed stopped by {run.binds}; losses {_losses(run)}")
        for run in runs
    ]
    if "plan" in data:
        lines.append(partial(_print_plan, data["plan"], {run.name: run.label for run in result.runs}))
    lines += [partial(wrapped, line) for line in result.rule]
    notes = [f"{run.name}: {note}" for run in runs for note in run.notes]
    return Answer(title, lines, more="intervals, losses, sizing", notes=notes, shown=0)


def _row(run: DriveRun) -> list[str]:
    e, error, net = run.energy, run.band("e_c_pp"), run.band("energy_net")
    stroke = EMPTY if run.stroke is None else fmt(run.stroke, "length", 3)
    return [
        run.label,
        cell("e_c_pp", run.value("e_c_pp")),
        _band(error.low, error.high, 1e3, "mm"),
        cell("eta_c", run.summary["eta_c"]),
        _kwh(e.net),
        _band(net.low, net.high, in_unit(1.0, "kWh", "energy"), ""),
        _kwh(e.drawn),
        _kwh(e.returned),
        fmt(run.v_w_top, "speed", 3),
        stroke,
        fmt(run.P_installed, "power", 3),
        percent(run.assumed),
        run.status,
    ]


def _kwh(E: float) -> str:
    return number(in_unit(E, "kWh", "energy"), 3)


def _band(low: float, high: float, scale: float, unit: str) -> str:
    return EMPTY if math.isnan(low) else f"{number(scale * low, 3)}-{number(scale * high, 3)} {unit}".strip()


def _losses(run: DriveRun) -> str:
    """The largest losses in kWh per hour."""
    rows = sorted(run.energy.lost.items(), key=lambda row: -row[1])
    return ", ".join(f"{name.replace('_', ' ')} {_kwh(x)}" for name, x in rows[:3]) + " kWh per h"


def _print_plan(plan: dict[str, Any], labels: Mapping[str, str]) -> None:
    over = "no compensation"
    rows = [
        [labels[name], *(_days(row["gained_over"].get(key)) for key in ("none", "cap-80")), _days(row.get("wait"))]
        for name, row in plan["drives"].items()
    ]
    print_table(
        ["drive", f"days a year over\n{over}", "days a year over\n80 % cap", "mean wait of one\noperation [d]"],
        rows,
        title=f"plan {plan['plan']}, {plan['tier']} tier, as modelled",
    )
    wrapped(plan["basis"], "  ")


def _days(value: Any) -> str:
    """A number of days, with its interval where there is one."""
    if value is None:
        return EMPTY
    if isinstance(value, dict):
        ends = f" ({number(value['low'], 3)} to {number(value['high'], 3)})" if "low" in value else ""
        return f"{_days(value['value'])}{ends}"
    return EMPTY if not math.isfinite(value) else number(float(value), 3)
