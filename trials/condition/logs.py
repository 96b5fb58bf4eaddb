"""A crane that ages, through logs: python -m trials.condition.logs FOLDER writes its campaigns, for `stillhook
condition FOLDER --out OUT`.

The logs are of the reference plant (`trials.reference_plant`), which shares no law of friction or leakage with the
twin. Oil, wear and seas differ from date to date, the sensors' calibration is the same.
"""

from __future__ import annotations

import datetime
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from trials.campaigns import write_campaign
from trials.campaigns.defects import setting
from trials.campaigns.examples import short_trials
from trials.reference_plant.parameters import ReferenceCrane

FIRST = datetime.date(2027, 1, 15)
CRANE, CAMPAIGNS, EVERY = 7, 8, 110
"""Seed of the crane; campaigns, and days between them."""
FRICTION, SEASON, LEAKAGE = 0.12, 0.04, 0.25
"""Wear of the friction a year from the fourth campaign on, its yearly wave, and wear of the leakage a year."""


def aged(reference: ReferenceCrane, years: float) -> ReferenceCrane:
    """The crane after so many years."""
    begin = 3 * EVERY / 365.25
    worn = FRICTION * max(years - begin, 0.0) + SEASON * np.cos(2.0 * np.pi * years)
    return replace(
        reference,
        friction=reference.friction * (1.0 + float(worn)),
        leakage=reference.leakage * (1.0 + LEAKAGE * years),
    )


def write(folder: Path, campaigns: int = CAMPAIGNS) -> None:
    """The campaigns that are not there yet, each in a folder with its date."""
    plan = short_trials()
    counts = {"motors": plan.crane.active.motor.count, "passive_motors": plan.crane.passive.motor.count}
    made = setting(CRANE, **counts)
    for i in range(campaigns):
        date = FIRST + datetime.timedelta(days=EVERY * i)
        if (folder / date.isoformat() / "campaign.toml").exists():
            continue
        crane = replace(made, reference=aged(made.reference, EVERY * i / 365.25))
        write_campaign(folder / date.isoformat(), plan=replace(plan, date=date), seed=1000 + i, made=crane, threads=1)
        print(f"{date}: friction {crane.reference.friction:.4f}, leakage {crane.reference.leakage:.3f}", flush=True)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
