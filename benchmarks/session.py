"""What a cycle of a `Session` costs beside the same cycle in a batch run: `python -m benchmarks.session [--json]`
(`make bench`).

Each way of stepping is measured in turn with the kernel of a run of the same cycles and steps on one lane; figures are
processor time, medians of the rounds, and ratios are medians of the ratios within a round. The aim is at most 100 us
for a cycle with inputs and one signal read.
"""

import argparse
import json
import math
import statistics
from collections.abc import Callable
from time import process_time

import stillhook
from benchmarks.cases import crane, kernel_run
from stillhook.engine.arguments import SERIES_STEP

ROUNDS, CYCLES = 15, 3000
AIM = 100.0e-6
CRANE = crane()
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", duration="30 s", warm_up="0 s")
OMEGA = 2.0 * math.pi / 12.0
TIP = [
    {"s_tip": math.sin(x), "v_tip": OMEGA * math.cos(x), "a_tip": -OMEGA * OMEGA * math.sin(x)}
    for x in (OMEGA * CRANE.control.t_cycle * k for k in range(1, CYCLES + 1))
]
ORDERS = [{**tip, "override": 1.0, "u_p": 0.4 * tip["v_tip"], "u_m": 1.0, "brake": 0.0} for tip in TIP]


def scenario_s_own(session: stillhook.Session) -> None:
    for _ in range(CYCLES):
        session.step()


def with_inputs(session: stillhook.Session) -> None:
    for given in TIP:
        session.step(given)


def with_inputs_and_a_signal(session: stillhook.Session) -> None:
    for given in TIP:
        session.step(given)
        session.get("F_w")


def with_commands_and_a_signal(session: stillhook.Session) -> None:
    for given in ORDERS:
        session.step(given)
        session.get("F_w")


WAYS: dict[str, Callable[[stillhook.Session], None]] = {
    "step()": scenario_s_own,
    "step(tip)": with_inputs,
    "step(tip), get": with_inputs_and_a_signal,
    "step(tip and commands), get": with_commands_and_a_signal,
}


def seconds(way: Callable[[stillhook.Session], None], session: stillhook.Session) -> float:
    """Processor time of a cycle [s]."""
    start = process_time()
    way(session)
    return (process_time() - start) / CYCLES


def in_a_batch() -> float:
    """Processor time that the kernel takes for the same cycle in one run [s]."""
    return kernel_run([CASE], round(CRANE.control.t_cycle / SERIES_STEP)).sample.cpu / CYCLES


def measured() -> dict[str, dict[str, float]]:
    """Of each way of stepping: seconds of a cycle, and its ratio to a cycle in a batch; `batch` alone has no ratio."""
    session = stillhook.Session(CRANE, CASE)
    start = session.keep()
    session.step(TIP[0])
    session.get("F_w")
    in_a_batch()
    batch, ways = [], {name: ([], []) for name in WAYS}
    for _ in range(ROUNDS):
        for name, way in WAYS.items():
            batch.append(in_a_batch())
            session.go_back(start)
            each = seconds(way, session)
            ways[name][0].append(each)
            ways[name][1].append(each / batch[-1])
    found = {name: {"seconds": statistics.median(s), "ratio": statistics.median(r)} for name, (s, r) in ways.items()}
    return {"batch": {"seconds": statistics.median(batch), "ratio": 1.0}} | found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    found = measured()
    if parser.parse_args().json:
        print(json.dumps(found))
        return
    for name, row in found.items():
        print(f"{name:30} {row['seconds'] * 1e6:6.1f} us a cycle, {row['ratio']:5.2f} of one in a batch")
    print(f"aim: at most {AIM * 1e6:.0f} us")


if __name__ == "__main__":
    main()
