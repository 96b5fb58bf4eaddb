"""`stillhook plc run` and `plc compare`: hardware in the loop."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.groups import WRITES
from stillhook.cli.parser import Json, announce, present
from stillhook.report.terminal import Answer, Line, columns, print_table, say

if TYPE_CHECKING:
    from stillhook.base.arrays import FloatArray
    from stillhook.live.hil.compare import Comparison
    from stillhook.live.hil.cost import BusCost
    from stillhook.live.hil.soft_plc import Outcome

PlcFile = Annotated[
    Path,
    typer.Argument(metavar="PLC.toml", help="PLC file: case, controller, cycle, bus (stillhook example live)."),
]


def plc_run(
    plc_file: PlcFile,
    duration: Annotated[str | None, typer.Option(help="Length of the run; without it until it is stopped.")] = None,
    json: Json = False,
) -> None:
    """Run a soft PLC: a controller at a fixed cycle that moves the live twin's winch over OPC UA or Modbus TCP.

    The twin (stillhook live run) has sensed = true in its live file. A script may change what the PLC reads. Every
    cycle is in the log, for stillhook plc compare. At the end it says what the bus costs: the control error over the
    bus against that in process.

    Example: stillhook plc run plc.toml --duration "60 s"
    """
    import asyncio
    import time

    from stillhook.base.signals import noted
    from stillhook.cli.live.twin import ending
    from stillhook.live.hil.cost import bus_cost
    from stillhook.live.hil.plc_file import read_plc_file
    from stillhook.live.hil.plc_log import PlcLog
    from stillhook.live.hil.soft_plc import SoftPlc
    from stillhook.live.runtime.deadlines import ask_for_real_time

    plan = read_plc_file(plc_file)
    bus, controller = plan.bus(), plan.controller()
    cycle = f"{1e3 * controller.t_cycle:g} ms"
    say(f"{plan.mode} on {plan.crane.name} every {cycle} over {bus.label}. {ask_for_real_time().line}")
    end = ending(duration)
    with PlcLog(plan.log) as log, noted() as stopped:
        plc = SoftPlc(bus, controller, plan.script, log, say)
        outcome = asyncio.run(plc.run(lambda: stopped() or time.monotonic() >= end))
    cost: BusCost | str = "The script changed inputs, or the guard stopped the winch: the cost of the bus is not known."
    if plan.script.empty and not outcome.stopped:
        cost = bus_cost(plan.plant, plan.scenario, outcome.seen)
    numbers = {name: value for name, value in outcome._asdict().items() if isinstance(value, bool | int)}
    trips = {name: _spread(getattr(outcome, name)) for name in ("ages", "reads", "writes")}
    of = {"reason": cost} if isinstance(cost, str) else {**cost._asdict(), "cost": cost.cost}
    data = {"log": str(plan.log), **numbers, **trips, "bus_cost": of}
    title = f"{plan.mode} on {plan.crane.name} every {cycle} over {bus.label}"
    step = f"stillhook plc compare {plan.log} {plc_file}"
    WRITES.set(True)
    answer = Answer(title, _lines(outcome, cost), step, "age of samples, reading and writing")
    present(data, brief=lambda: answer, json=json)
    announce(plan.log.parent, [plan.log.name], quiet=json)


def _spread(values: FloatArray) -> dict[str, float] | None:
    """Median, 99th percentile and largest [s]; None where nothing came."""
    import numpy as np

    kept = values[np.isfinite(values)]
    if not kept.size:
        return None
    p50, p99, largest = np.percentile(kept, (50, 99, 100)).tolist()
    return {"p50": p50, "p99": p99, "largest": largest}


def _lines(outcome: Outcome, cost: BusCost | str) -> list[Line]:
    """How the cycles went, and what the bus costs."""
    counts = (
        f"{outcome.cycles} cycles: {outcome.late} late, {outcome.without_answer} without a new sample,"
        f" {outcome.unconfirmed} without a write, {outcome.reconnected} times connected again."
    )
    stopped = "The guard stopped the winch." if outcome.stopped else ""
    return [partial(_print_trips, outcome), counts, stopped, _cost(cost)]


def _cost(cost: BusCost | str) -> str:
    if isinstance(cost, str):
        return cost
    over, within = 100.0 * cost.e_c_pp, 100.0 * cost.e_c_pp_in_process
    return (
        f"Control error peak to peak {over:.2f} cm over the bus, {within:.2f} cm in process, of {cost.s_tip_pp:.2f}"
        f" m of the tip, {cost.begin:.0f} to {cost.end:.0f} s: the bus costs {100.0 * cost.cost:.2f} cm."
    )


def _print_trips(outcome: Outcome) -> None:
    rows = []
    for name, values in (("age of the sample", outcome.ages), ("reading", outcome.reads), ("writing", outcome.writes)):
        spread = _spread(values)
        rows.append([name, *(["-"] * 3 if spread is None else [f"{1e3 * x:.2f}" for x in spread.values()])])
    print_table(["", "p50", "p99", "largest"], rows, title="Over the bus [ms]")


def plc_compare(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a PLC: of stillhook plc run, or of any other.")],
    plc_file: PlcFile,
    json: Json = False,
) -> None:
    """Compare a PLC with the library, cycle by cycle: the inputs that it saw go through the same controller.

    Rounding of the log and of the bus is separated from real differences. A log of another PLC has its columns in the
    table [signals] of the PLC file. Exit code 1 if they differ.

    Example: stillhook plc compare plc-log.csv plc.toml
    """
    from stillhook.live.hil.compare import compare, stated_steps
    from stillhook.live.hil.plc_file import read_plc_file
    from stillhook.live.hil.plc_log import read_plc_log

    plan = read_plc_file(plc_file)
    recorded = read_plc_log(log, plan.file.signals, plan.path.name)
    steps = {**recorded.steps, **stated_steps(plan.file.resolution, plan.path.name)}
    result = compare(plan.crane, plan.mode, recorded, steps)
    rows = [d._asdict() | {"verdict": d.verdict} for d in result.outputs]
    data = {"same": result.same, "cycles": result.cycles, "outputs": rows, "absent": result.absent}
    present(data, brief=lambda: _answer(result, f"{plan.mode} on {plan.crane.name}"), json=json)
    raise typer.Exit(0 if result.same else 1)


def _answer(result: Comparison, what: str) -> Answer:
    """Whether PLC and library give the same, the largest difference of each output, and the first one."""
    rows = [[d.name, f"{d.largest:.3g} {d.unit}", f"{d.explained:.3g} {d.unit}", d.verdict] for d in result.outputs]
    first = min((d for d in result.outputs if d.first >= 0.0), key=lambda each: each.first, default=None)
    lines: list[Line] = [
        "PLC and library give the same." if result.same else "PLC and library differ.",
        *columns(heads := ["output", "largest", "explained by rounding", "verdict"], rows, left=(0, 3)),
        partial(print_table, heads, rows),
    ]
    if first is not None:
        of = f"{first.name}: PLC {first.plc:.9g}, library {first.library:.9g} {first.unit}"
        lines.append(f"First difference: cycle {first.first:.0f}, {of}.")
    if result.absent:
        lines.append(f"Not in the log: {', '.join(result.absent)}.")
    if result.begins > 0.0:
        lines.append(f"The log begins in mode {result.begins:g}: it is compared as if the PLC started there.")
    return Answer(f"PLC less library ({what}), {result.cycles} cycles", lines)
