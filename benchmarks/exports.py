"""Speed of an FMU in a host of C beside `simulate`, in one run: `python -m benchmarks.exports [--json]` (`make bench`).

The host gives the tip's motion, steps one PLC cycle and reads four signals, 6000 times a minute of simulated time; the
aim is at most 0.1 s of processor time for 60 s. `simulate` stores the same signals at every cycle.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from time import process_time

import numpy as np

import stillhook
from stillhook.engine.inputs import CycleInputs
from stillhook.export.fmu import write_fmu
from stillhook.export.twin import PLATFORMS, export, own_platform

ROUNDS = 7
AIM = 0.1
SIGNALS = ("e_c", "s_w", "v_w", "F_w")
HOST = Path(__file__).parents[1] / "tests" / "export" / "fmu" / "host.c"


def measured() -> dict[str, float]:
    """Seconds for 60 s: of the host's steps, and of `simulate`; medians."""
    platform = own_platform()
    if platform is None:
        raise SystemExit("no library for this system")
    crane = stillhook.load_crane("nov-250t")
    case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", duration="60 s", ramp="5 s")
    made, drive = export(crane, case), CycleInputs(crane, case)
    tip = np.array([drive.full_row(k)[:3] for k in range(drive.n_ticks + 1)])
    in_c, in_python = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fmu, _ = write_fmu(made, folder / "winch.fmu", platforms=[platform])
        with zipfile.ZipFile(fmu) as archive:
            (member,) = [n for n in archive.namelist() if n.startswith("binaries/")]
            (folder / "winch.lib").write_bytes(archive.read(member))
        np.savetxt(folder / "motion.txt", tip, fmt="%.17g")
        zig = [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[platform].target]
        host = folder / "host"
        subprocess.run([*zig, "-O1", "-w", "-o", str(host), str(HOST), "-ldl"], check=True)
        numbers = [str(made.number(n)) for n in ("s_tip", "v_tip", "a_tip", "input_time", *SIGNALS)]
        line = [str(host), "./winch.lib", made.identity, "motion.txt", repr(made.t_cycle), *numbers]
        for _ in range(ROUNDS):
            done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=True)
            in_c.append(float(done.stderr.split()[-1]))
            start = process_time()
            stillhook.simulate(crane, case, every="10 ms", series=True)
            in_python.append(process_time() - start)
    seconds = {"host_in_c": statistics.median(in_c), "simulate": statistics.median(in_python)}
    return seconds | {"ratio": statistics.median(a / b for a, b in zip(in_c, in_python, strict=True))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    found = measured()
    if parser.parse_args().json:
        print(json.dumps(found))
        return
    print(f"60 s in a host of C: {found['host_in_c']:.3f} s (aim {AIM:g} s); simulate with its series:")
    print(f"{found['simulate']:.3f} s; ratio {found['ratio']:.2f}")


if __name__ == "__main__":
    main()
