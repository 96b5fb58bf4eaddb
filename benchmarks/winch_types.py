"""Speed of every winch type beside the active/passive winch, in one run: `python -m benchmarks.winch_types [--json]`
(`make bench`).

Sixteen lanes with statistics alone at the default step, on one core. "Per state" divides the time of a simulated second
by the number of states of winch and load path; the aim is at most twice the active/passive winch's. Measurements are
interleaved, ratios are medians of the ratios within a round.
"""

import argparse
import json
import statistics
from time import process_time
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from stillhook import Scenario, load_crane
from stillhook.engine.arguments import STATISTICS_STEP, steps_per_cycle
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.kernels.build import driver
from stillhook.kernels.lanes import VL, size
from stillhook.library import cranes
from stillhook.spec.crane import Crane

BASE = "active-passive"
ROUNDS = 7
DURATION = 300.0
AIM = 2.0


class Row(NamedTuple):
    """A winch type: crane; states of winch and load path; simulated seconds per second of one core; processor time over
    that of the active/passive winch, whole and per state [-]."""

    plant: str
    crane: str
    states: int
    speed: float
    time_ratio: float
    state_ratio: float


def lifts(crane: Crane) -> list[Scenario]:
    """Sixteen lifts that differ in load and motion, at a third of the winch's capacity on average."""
    return [
        Scenario(
            load=f"{crane.SWL * (0.1 + 0.03 * i)!r} kg",
            s_w=f"{60 + 10 * i} m",
            tip=f"sine {0.4 + 0.02 * i:.2f} m {9 + i % 4} s",
            mode=crane.plant.type.default_mode,
            duration=f"{DURATION} s",
        )
        for i in range(VL)
    ]


def measured() -> list[Row]:
    """Every winch type that the library has a crane of."""
    by_plant: dict[str, Crane] = {}
    for name in cranes():
        by_plant.setdefault(str(load_crane(name).plant), load_crane(name))
    cases = {plant: lifts(crane) for plant, crane in by_plant.items()}
    times: dict[str, list[float]] = {plant: [] for plant in by_plant}
    for turn in range(ROUNDS + 1):  # the first is not counted
        for plant, crane in by_plant.items():
            n_sub = steps_per_cycle(crane, None, STATISTICS_STEP)
            start = process_time()
            run_cases(crane, cases[plant], step=n_sub, lanes=VL, threads=1, keep=unchanged)
            if turn:
                times[plant].append(process_time() - start)
    states = {plant: size(driver(plant, VL).State) for plant in by_plant}
    rows = []
    for plant, crane in by_plant.items():
        ratio = statistics.median(a / b for a, b in zip(times[plant], times[BASE], strict=True))
        speed = VL * DURATION / statistics.median(times[plant])
        of_state = ratio * states[BASE] / states[plant]
        rows.append(Row(plant, crane.name, states[plant], speed, ratio, of_state))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    rows = measured()
    if parser.parse_args().json:
        print(json.dumps([row._asdict() for row in rows], indent=2))
        return
    table = Table("winch type", "crane", "states", "times real time", "time, x", "per state, x")
    for row in rows:
        within = "" if row.state_ratio <= AIM else " (!)"
        table.add_row(
            row.plant,
            row.crane,
            str(row.states),
            f"{row.speed:,.0f}",
            f"{row.time_ratio:.2f}",
            f"{row.state_ratio:.2f}{within}",
        )
    Console().print(table)
    print(f"x: over {BASE}, processor time of one core; the aim per state is {AIM:g}.")


if __name__ == "__main__":
    main()
