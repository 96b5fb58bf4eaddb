"""Coverage of the stated 95 % intervals, from logs to parameters: `python -m benchmarks.coverage
[campaigns]`.

Each campaign is run by the twin with its own noise (0.5 bar, 0.2 % of speed, 12-bit converters), written, read, and
identified blind.
"""

import sys
import tempfile

import numpy as np
from trials.campaigns.friction import campaign_plan, write_campaign
from trials.campaigns.plc_log import Instruments, Noise

from stillhook import identify
from stillhook.identify.system_friction.fitting.fit import predicted, predicted_sd
from stillhook.identify.system_friction.fitting.model import Y_NAMES, Y
from stillhook.library import system_friction
from stillhook.statistics.estimate import t_factor

CASES = {"L4593": "L4593", "crane-2": "crane-2"}
MINUTES = 10.0


def campaign(name: str, reference: Y, seed: int) -> tuple[dict[str, bool], float]:
    """Whether each parameter's interval holds the reference value, and the share of the band of predicted friction that
    does."""
    with tempfile.TemporaryDirectory() as folder:
        instruments = Instruments(noise=Noise.TYPICAL, seed=seed)
        plan = campaign_plan(name)
        written = write_campaign(plan, folder, instruments=instruments, duration=f"{MINUTES:g} min")
        r = identify.friction(written.campaign, proposals=0)
    inside = {n: i.contains(getattr(reference, n)) for n, i in r.intervals.items()}
    off = np.abs(predicted(r.points, r.loss, r.fit.y) - predicted(r.points, r.loss, reference))
    return inside, float(np.mean(off <= t_factor(r.fit.dof) * predicted_sd(r.points, r.fit)))


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    for name, fitted in CASES.items():
        reference = Y.of(system_friction(fitted))
        outcomes = [campaign(name, reference, seed) for seed in range(count)]
        shares = {n: [inside[n] for inside, _ in outcomes if n in inside] for n in Y_NAMES}
        text = ", ".join(f"{n} {np.mean(v):.0%}" for n, v in shares.items() if v)
        print(f"{name}, {count} campaigns: {text}; predicted friction {np.mean([band for _, band in outcomes]):.1%}")


if __name__ == "__main__":
    main()
