"""A twin with servers, history and encrypted clients for a time: lateness with its causes, notifications against what
was published, and the memory of each process: `python -m trials.endurance.hours FOLDER SECONDS [CLIENTS]`.

As time-lapse, for the memory alone: `... FOLDER SECONDS CLIENTS SPEED PUBLISH`, see `twin.py`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import zlib
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.library.examples import LIVE, example_files
from stillhook.live.history import read, read_events
from stillhook.live.runtime.causes import Cause
from trials.endurance.clients import trust_folders

SAMPLE = 10.0
"""Time between two looks at memory and load [s]."""
SETTLE = 300.0
"""Time after which a process has all that it needs [s]."""
CALM = 5.0
"""Time between the clients' end and the twin's [s]."""


def prepare(folder: Path, clients: int) -> Path:
    """A live file of the twin with every cycle in the history, free ports, and trusted clients."""
    example_files(LIVE, folder)
    path = folder / "live.toml"
    text = path.read_text(encoding="utf-8")
    for port in ("4840", "5020"):
        text = text.replace(f"port = {port}", "port = 0")
    text = text.split("[udp]")[0] + "[history]" + text.split("[history]")[1]  # it asks for rows as OPC UA does
    path.write_text(text.replace('every = "0.1 s"\nsize', 'every = "0 s"\nsize'), encoding="utf-8")
    case = folder / "case.toml"
    case.write_text(case.read_text(encoding="utf-8").replace('"still"', '"sine 1 m 9 s"'), encoding="utf-8")
    trusted = folder / "twin" / "opcua" / "trusted"
    trusted.mkdir(parents=True)
    for each in trust_folders(folder / "twin", clients):
        (trusted / f"{each.path.name}.der").write_bytes(each.certificate.read_bytes())
    return path


def memory(pid: int) -> tuple[float, float]:
    """Resident and private memory of a process [MB]; NaN where it is gone."""
    try:
        rows = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
        sizes = {row.split(":")[0]: int(row.split()[1]) for row in rows[1:]}
        return sizes["Rss"] / 1024.0, (sizes["Private_Clean"] + sizes["Private_Dirty"]) / 1024.0
    except (OSError, KeyError, IndexError, ProcessLookupError):
        return float("nan"), float("nan")


def run(folder: Path, seconds: float, clients: int, *lapse: str) -> dict[str, Any]:
    path = prepare(folder, clients)
    of = folder / "twin"
    words = [sys.executable, "-m", "trials.endurance.twin", str(path), str(seconds + 3600.0), *lapse]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as twin:
        assert twin.stdout is not None
        url = twin.stdout.readline().split()[2].rstrip(",")
        while not (of / "kernel.pid").exists():
            time.sleep(0.1)
        watched = [str(url), str(of), str(of / "opcua" / "own" / "certificate.der"), str(clients), str(seconds)]
        with subprocess.Popen([sys.executable, "-m", "trials.endurance.clients", *watched]) as client:
            pids = {
                "kernel": int((of / "kernel.pid").read_text(encoding="ascii")),
                "servers": twin.pid,
                "clients": client.pid,
            }
            samples = []
            while client.poll() is None:
                sizes = {name: memory(pid) for name, pid in pids.items()}
                samples.append({"time": time.time(), "load": os.getloadavg()[0], "stolen": stolen(), "memory": sizes})
                (folder / "samples.json").write_text(json.dumps(samples), encoding="utf-8")
                time.sleep(SAMPLE)
        time.sleep(CALM)
        twin.send_signal(signal.SIGTERM)
        twin.communicate()
    return judge(folder, samples)


def stolen() -> float:
    """Time that the host took from each processor [s]."""
    fields = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()
    return int(fields[8]) / os.sysconf("SC_CLK_TCK") / (os.cpu_count() or 1)


def judge(folder: Path, samples: list[dict[str, Any]]) -> dict[str, Any]:
    """All figures."""
    kept = read(folder / "twin" / "history", signals=["lateness", "cost", "late_cause", "cycle_number"])
    late, cost = kept.lateness.values, kept.cost.values
    causes = Counter(Cause(int(each)).name.lower() for each in kept.late_cause.values if each)
    quantiles = (0.5, 0.99, 0.999)
    load = [each["load"] for each in samples]
    span = samples[-1]["time"] - samples[0]["time"]
    settled = [each for each in samples if each["time"] - samples[0]["time"] >= min(SETTLE, 0.5 * span)]
    events = Counter(str(each.data.get("name", each.kind)) for each in read_events(folder / "twin" / "history"))
    return {
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
        "cycles": len(late),
        "first_and_last_number": [int(kept.cycle_number.values[0]), int(kept.cycle_number.values[-1])],
        "lateness_ms": [round(1e3 * x, 3) for x in (*np.quantile(late, quantiles), late.max())],
        "cost_ms": [round(1e3 * x, 3) for x in (*np.quantile(cost, quantiles), cost.max())],
        "late": int((late > 2.0e-3).sum()),
        "beyond_10_ms": int((late > 1.0e-2).sum()),
        "causes": dict(causes),
        "load": [round(x, 1) for x in (min(load), float(np.median(load)), max(load))],
        "stolen_share": round((samples[-1]["stolen"] - samples[0]["stolen"]) / span, 5),
        "memory_mb": {name: growth(settled, name) for name in samples[0]["memory"]},
        "events": dict(events),
        "notifications": notifications(folder / "twin"),
    }


def growth(samples: list[dict[str, Any]], name: str) -> dict[str, float]:
    """Private memory of a process once it has all that it needs, and at the end [MB]: medians of a tenth of all;
    and the slope of a straight line through all of them, for a day [MB]."""
    sizes = np.array([each["memory"][name][1] for each in samples])
    at = np.array([each["time"] for each in samples])
    there = np.isfinite(sizes)
    sizes, at = sizes[there], at[there]
    n = max(1, len(sizes) // 10)
    begin, end = float(np.median(sizes[:n])), float(np.median(sizes[-n:]))
    slope = float(np.polyfit(at - at[0], sizes, 1)[0]) * 86400.0 if len(sizes) > 2 else float("nan")
    return {"begin": round(begin, 2), "end": round(end, 2), "growth": round(end - begin, 2), "a_day": round(slope, 1)}


def notifications(folder: Path) -> dict[str, Any]:
    """What each client should have been sent, by what was published, and what came."""
    names = (folder / "names.txt").read_text(encoding="utf-8").splitlines()
    rows = np.frombuffer((folder / "published.bin").read_bytes()).reshape(-1, len(names))
    at = rows[:, names.index("time_utc")]
    stamps = np.array([round(1e6 * datetime.fromtimestamp(x, UTC).timestamp()) for x in at])
    expected = received = wrong = backwards = 0
    found = json.loads((folder / "clients.json").read_text(encoding="utf-8"))["clients"]
    for each in found:
        backwards += each["backwards"]
        for i, name in enumerate(names):
            first, last, count, crc = each["nodes"][name]
            sent = rows[(stamps >= first) & (stamps <= last), i]
            changed = np.flatnonzero(np.diff(sent.view(np.int64), prepend=~sent[:1].view(np.int64)))
            expected, received = expected + len(changed), received + count
            wrong += zlib.crc32(sent[changed].tobytes()) != crc
    between = np.diff(at)
    return {
        "published": len(rows),
        "clients": len(found),
        "nodes": len(names),
        "expected": expected,
        "received": received,
        "nodes_with_another_sequence": wrong,
        "out_of_order": backwards,
        "period_ms": [
            round(1e3 * float(x), 1) for x in (np.median(between), np.quantile(between, 0.999), between.max())
        ],
    }


if __name__ == "__main__" and sys.argv[2] == "judge":
    print(json.dumps(judge(Path(sys.argv[1]), json.loads((Path(sys.argv[1]) / "samples.json").read_text())), indent=1))
elif __name__ == "__main__":
    target = Path(sys.argv[1])
    outcome = run(target, float(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 5, *sys.argv[4:])
    (target / "outcome.json").write_text(json.dumps(outcome, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(outcome, indent=1))
