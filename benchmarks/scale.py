"""What a case costs when there are many: a map from the shell, ten thousand draws, one worker against two, and what a
task costs beside its work. `python -m benchmarks.scale [--json]`. Times depend on the machine; the ratios and costs per
case are what counts.
"""

import argparse
import json
import math
import os
import pickle
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
from stillhook.engine.scenario import batch as many
from stillhook.engine.scenario.batch import summaries
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


def drawn(crane: Crane, n: int) -> list[Crane]:
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
    """Cases that share nothing: every one goes over the wire whole."""
    tips = [Sine(amplitude=f"{1.0 + i / n:.9f} m", period="12 s") for i in range(n)]
    return [Scenario(load="100 t", s_w="100 m", tip=t, duration=f"{SECONDS:g} s", warm_up="20 s") for t in tips]


def workers_against_one(crane: Crane, cases: list[Scenario]) -> tuple[float, float]:
    """Seconds with one worker and with two, medians of interleaved rounds."""
    from distributed import Client, LocalCluster

    found: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(CLUSTER_ROUNDS):
        for workers in found:
            with (
                LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
                Client(cluster) as client,
            ):
                summaries(crane, cases[: 4 * VL], client=client)
                found[workers].append(timed(lambda: summaries(crane, cases, client=client)))
    return median(found[1]), median(found[2])


def empty_task() -> float:
    """Seconds that a cluster takes for a task without work."""
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        client.gather(client.map(math.sqrt, range(10), pure=False))
        return timed(lambda: client.gather(client.map(math.sqrt, range(EMPTY_TASKS), pure=False))) / EMPTY_TASKS


def costs(crane: Crane) -> dict[str, float]:
    """Seconds and bytes a case: on the worker, and on the machine that gives the work out."""
    cases = many_cases(52 * VL)
    task = many._Task(list(range(len(cases))), [crane] * len(cases), cases, 2)
    many.work(task)
    worker = median(timed(lambda: many.work(task)) for _ in range(ROUNDS)) / len(cases)
    sent = pickle.dumps(task.light(), 5)
    answers = many.work(task)
    back = pickle.dumps(answers, 5)

    def giver() -> None:
        many._check_all(task.cranes, task.cases)
        many._cut(task.cranes, task.cases, task.indices, 2)
        pickle.dumps(task.light(), 5)
        read = pickle.loads(back)
        [read.summary(i) for i in range(len(cases))]

    n = len(cases)
    give = median(timed(giver) for _ in range(ROUNDS)) / n
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
    summaries(crane, one_case())
    found: dict[str, float] = {"map_shell": map_from_the_shell()}
    cranes, case = drawn(crane, DRAWS), one_case()
    found["draws_10000"] = min(timed(lambda: summaries(cranes, case)) for _ in range(2))
    found |= costs(crane)
    found["empty_task"] = empty_task()
    found["one_worker"], found["two_workers"] = workers_against_one(crane, many_cases(CLUSTER_CASES))
    found["ratio_two_workers"] = found["one_worker"] / found["two_workers"]
    task = found["task_cases"] * found["worker_case"]
    found["task"] = task
    found["most_workers"] = task / (found["task_cases"] * found["giver_case"] + found["empty_task"])
    if wanted.json:
        print(
            json.dumps(
                {k: round(v, 9) for k, v in found.items()} | {"code": results_hash(), "cores": os.cpu_count()}, indent=2
            )
        )
        return
    table = Table("what", "value")
    for name, text in (
        ("stillhook map nov-250t from the shell (324 runs of 30 s)", f"{found['map_shell']:.2f} s"),
        (f"{DRAWS} drawn cranes, {SECONDS:g} s each, 2 threads", f"{found['draws_10000']:.1f} s"),
        ("a case of 60 s on a worker", f"{1e3 * found['worker_case']:.2f} ms"),
        ("the same case on the machine that gives it out", f"{1e6 * found['giver_case']:.0f} us"),
        ("sent, and back, for each case", f"{found['sent_bytes']:.0f} and {found['back_bytes']:.0f} bytes"),
        ("a task", f"{found['task_cases']:.0f} cases, {found['task']:.2f} s"),
        ("a task without work", f"{1e3 * found['empty_task']:.2f} ms"),
        (
            "one Dask worker, two",
            f"{found['one_worker']:.2f} s, {found['two_workers']:.2f} s: {found['ratio_two_workers']:.2f} times",
        ),
        ("workers that one giver keeps busy with cases of 60 s", f"{found['most_workers']:.0f}"),
    ):
        table.add_row(name, text)
    Console().print(table)


if __name__ == "__main__":
    main()
