"""Writes the examples of the package (`stillhook.library.examples`) again, the same content to the bit:
short campaigns, of which every second or twentieth sample is kept.

python -m trials.campaigns.examples
"""

from __future__ import annotations

import json
import lzma
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas

from stillhook.library.examples import DATA, FRICTION_TESTS, MOTOR_MAP, SEA_TRIALS
from trials.campaigns import friction, write_campaign
from trials.campaigns.motor_map import synthetic_map, write_map
from trials.campaigns.plc_log import AHC_COLUMNS, COLUMNS, Column, WrittenCampaign, decimals, unit_factor
from trials.campaigns.schedule import Plan, sea_trials

TIME_STEP = 1e-4
"""Resolution of the time stamps [s]."""
DURATION, GROWTH = {"2": 150.0}, {"2": 110.0}
"""Lengths of tests with heave compensation, and time in which their sea grows [s]; 75 s and 10 s for the others."""
CRITERIA = """# Criteria of this example: a complete sea trial takes 1500 s.
base = "paper-f"
version = "example"

[[criterion]]
key = "1d"
at_least = "300 s"
source = "a short example; paper-f asks for 1500 s"
"""


def short_trials() -> Plan:
    """The sea trials, shortened."""
    plan = sea_trials()
    tests = [
        test
        if test.sea is None
        else replace(
            test,
            duration=DURATION.get(test.name, 75.0),
            sea=replace(test.sea, ramp=GROWTH.get(test.name, 10.0)),
        )
        for test in plan.tests
    ]
    return replace(plan, tests=tuple(tests))


def write_sea_trials(out: Path) -> None:
    """Example of `stillhook validate`, with a sample every 20 ms."""
    with TemporaryDirectory() as folder:
        written = write_campaign(Path(folder) / "tests", plan=short_trials())
        store(written, AHC_COLUMNS, out, every=2)
    text = (out / "campaign.toml").read_text(encoding="utf-8")
    text = text.replace("synthetic = true\n", 'synthetic = true\ncriteria = "criteria.toml"\n')
    (out / "campaign.toml").write_text(text, encoding="utf-8")
    (out / "criteria.toml").write_text(CRITERIA, encoding="utf-8")


def write_friction_tests(out: Path) -> None:
    """Example of `stillhook identify friction`, with a sample every 200 ms."""
    with TemporaryDirectory() as folder:
        plan = friction.campaign_plan("crane-2-extended")
        written = friction.write_campaign(plan, Path(folder) / "tests", duration="4 min")
        store(written, COLUMNS, out, every=20)


def store(written: WrittenCampaign, columns: Sequence[Column], out: Path, *, every: int) -> None:
    """Every so many samples of a campaign in the form of `stillhook.library.examples`."""
    steps = {"Time": (TIME_STEP, 1.0)}
    steps |= {c.heading: (written.sensors[c.name].step, unit_factor(c)) for c in columns}
    logs = {path.stem: pandas.read_csv(path, comment="#").iloc[::every] for path in written.logs}
    table = pandas.concat(logs.values())
    counts = np.array([np.round(table[heading] * unit / step) for heading, (step, unit) in steps.items()])
    differences = np.diff(counts.astype(np.int32), axis=1, prepend=np.int32(0))
    index = {
        "columns": {heading: (step, unit, decimals(step / unit)) for heading, (step, unit) in steps.items()},
        "samples": {name: len(log) for name, log in logs.items()},
    }
    out.mkdir(parents=True, exist_ok=True)
    (out / "logs.json").write_text(json.dumps(index, indent=1) + "\n", encoding="utf-8")
    with lzma.open(out / "logs.npy.xz", "wb", preset=9 | lzma.PRESET_EXTREME) as file:
        np.save(file, differences)
    for path in (written.campaign, written.reference):
        shutil.copyfile(path, out / path.name)


def main(out: Path = DATA) -> None:
    """All examples."""
    write_sea_trials(out / SEA_TRIALS.name)
    write_friction_tests(out / FRICTION_TESTS.name)
    write_map(synthetic_map(), out / MOTOR_MAP.name)


if __name__ == "__main__":
    main()
