"""What a case costs when there are many: a map from the shell, ten thousand draws, one worker against two, and what a
task costs in addition to its work. `python -m benchmarks.scale [--json]`. Times depend on the machine; the ratios and
costs per case are what counts.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from stillhook import Crane, Scenario, Sine, load_crane
from stillhook.engine.scenario.run import ScenarioType
from stillhook.engine.simulate import row_of, run_cases
from stillhook.engine.tasks import Task, cut
from stillhook.engine.tasks.carried import answer_to, pack_task, unpack_answer
from stillhook.kernels.build import results_hash
from stillhook.kernels.lanes import VL

ROUNDS = 5
DRAWS, SECONDS = 10_000, 60.0
CLUSTER_CASES, CLUSTER_ROUNDS = 9_600, 3
EMPTY_TASKS = 500


def timed(work: Callable[[], Any]) -> float:
    """Wall seconds."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def map_from_the_shell() -> float:
    """Seconds that `stillhook map nov-250t` takes: 12 speeds x 9 loads x 3 controllers of 30 s, the start of Python
    included."""
    command = [str(Path(sys.executable).with_name("stillhook")), "map", "nov-250t"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # kernels compiled, files in the page cache
    return median(timed(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL)) for _ in range(ROUNDS))


def cranes_of_draws(crane: Crane, n: int) -> list[Crane]:
    """Cranes whose oil and gain differ."""
    a, out = crane.active, []
    for x, y in np.random.default_rng(1).normal(1.0, 0.05, (n, 2)):
        line = a.line.model_copy(update={"bulk_modulus": a.line.bulk_modulus * float(x)})
        control = crane.control.model_copy(update={"K_p": crane.control.K_p * float(y)})
        out.append(crane.model_copy(update={"active": a.model_copy(update={"line": line}), "control": control}))
    return out


def one_case() -> Scenario:
    return Scenario(
        load="100 t", s_w="100 m", tip=Sine(amplitude="2 m", period="12 s"), duration=f"{SECONDS:g} s", warm_up="20 s"
    )


def many_cases(n: int) -> list[Scenario]:
    """Cases that share nothing: each is transferred completely."""
    tips = [Sine(amplitude=f"{1.0 + i / n:.9f} m", period="12 s") for i in range(n)]
    return [Scenario(load="100 t", s_w="100 m", tip=t, duration=f"{SECONDS:g} s", warm_up="20 s") for t in tips]


def workers_against_one(crane: Crane, cases: list[Scenario]) -> tuple[float, float]:
    """Seconds with one worker and with two, medians of interleaved rounds."""
    from distributed import Client, LocalCluster

    times: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(CLUSTER_ROUNDS):
        for workers in times:
            with (
                LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
                Client(cluster) as client,
            ):
                run_cases(crane, cases[: 4 * VL], client=client)
                times[workers].append(timed(lambda: run_cases(crane, cases, client=client)))
    return median(times[1]), median(times[2])


def empty_task() -> float:
    """Seconds that a cluster takes for a task without work."""
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        client.gather(client.map(math.sqrt, range(10), pure=False))
        return timed(lambda: client.gather(client.map(math.sqrt, range(EMPTY_TASKS), pure=False))) / EMPTY_TASKS


def costs(crane: Crane) -> dict[str, float]:
    """Seconds and bytes a case: on the worker, and on the machine that gives the work out."""
    cases = many_cases(52 * VL)
    of = ScenarioType()
    task = Task(of, list(range(len(cases))), [crane] * len(cases), cases, n_sub=2, lanes=VL, every=0, keep=row_of)
    task.run()
    worker = median(timed(task.run) for _ in range(ROUNDS)) / len(cases)
    sent = pack_task(task)
    back = answer_to(sent)

    def submitter() -> None:
        of.check(task.cranes, task.cases)
        cut(of, task.cranes, task.cases, task.indices, VL, 2)
        pack_task(task)
        unpack_answer(back)

    n = len(cases)
    give = median(timed(submitter) for _ in range(ROUNDS)) / n
    return {
        "worker_case": worker,
        "giver_case": give,
        "sent_bytes": len(sent) / n,
        "back_bytes": len(back) / n,
        "task_cases": n,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    wanted = parser.parse_args()
    crane = load_crane("nov-250t")
    run_cases(crane, one_case())
    values: dict[str, float] = {"map_shell": map_from_the_shell()}
    cranes, case = cranes_of_draws(crane, DRAWS), one_case()
    values["draws_10000"] = min(timed(lambda: run_cases(cranes, case)) for _ in range(2))
    values |= costs(crane)
    values["empty_task"] = empty_task()
    values["one_worker"], values["two_workers"] = workers_against_one(crane, many_cases(CLUSTER_CASES))
    values["ratio_two_workers"] = values["one_worker"] / values["two_workers"]
    task = values["task_cases"] * values["worker_case"]
    values["task"] = task
    values["most_workers"] = task / (values["task_cases"] * values["giver_case"] + values["empty_task"])
    if wanted.json:
        print(
            json.dumps(
                {k: round(v, 9) for k, v in values.items()} | {"code": results_hash(), "cores": os.cpu_count()},
                indent=2,
            )
        )
        return
    table = Table("what", "value")
    for name, text in (
        ("stillhook map nov-250t from the shell (324 runs of 30 s)", f"{values['map_shell']:.2f} s"),
        (f"{DRAWS} drawn cranes, {SECONDS:g} s each, 2 threads", f"{values['draws_10000']:.1f} s"),
        ("a case of 60 s on a worker", f"{1e3 * values['worker_case']:.2f} ms"),
        ("the same case on the machine that gives it out", f"{1e6 * values['giver_case']:.0f} us"),
        ("sent, and back, for each case", f"{values['sent_bytes']:.0f} and {values['back_bytes']:.0f} bytes"),
        ("a task", f"{values['task_cases']:.0f} cases, {values['task']:.2f} s"),
        ("a task without work", f"{1e3 * values['empty_task']:.2f} ms"),
        (
            "one Dask worker, two",
            f"{values['one_worker']:.2f} s, {values['two_workers']:.2f} s: {values['ratio_two_workers']:.2f} times",
        ),
        ("workers that one giver keeps busy with cases of 60 s", f"{values['most_workers']:.0f}"),
    ):
        table.add_row(name, text)
    Console().print(table)


if __name__ == "__main__":
    main()
