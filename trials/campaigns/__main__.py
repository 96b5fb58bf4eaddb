"""Synthetic campaigns as folders of logs.

python -m trials.campaigns sea-trials OUT --seed 3 --defect leakage --size 0.5 --crane my-crane.toml
python -m trials.campaigns friction-tests OUT --plan L4593 --duration "6 min" --reference crane-1
python -m trials.campaigns motor-map OUT.csv --motor A6VM280 --seed 2
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from stillhook.errors import StillhookError
from stillhook.library import cranes, load_crane, load_set
from stillhook.library.draws import crane_with
from trials.campaigns import WrittenCampaign, friction, trials, write_campaign
from trials.campaigns.defects import DEFECTS, Defect, size_of
from trials.campaigns.motor_map import synthetic_map, write_map
from trials.campaigns.plc_log import Instruments, Noise


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="trials.campaigns", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    of = parser.add_subparsers(dest="what", required=True)
    sea, tests, motor = (of.add_parser(name) for name in ("sea-trials", "friction-tests", "motor-map"))
    for each in (sea, tests, motor):
        each.add_argument("out", type=Path)
        each.add_argument("--seed", type=int, default=0, help="another seed: another crane, sea and noise")
    sea.add_argument("--crane", default="nov-250t", help="twin under test: library crane, or crane file")
    sea.add_argument("--real", help="crane file of the logs in place of the twin; not with a reference plant")
    sea.add_argument("--defect", choices=list(DEFECTS))
    sea.add_argument("--size", help='of the defect: 0.03, or "0.2 s" of a time')
    sea.add_argument("--apart", action="store_true", help="capacitance, leakage and inertia deviate by 10 to 30 %%")
    tests.add_argument("--plan", choices=list(friction.CAMPAIGNS), default="crane-2-extended")
    tests.add_argument("--noise", type=Noise, choices=list(Noise), default=Noise.TYPICAL)
    tests.add_argument("--duration", default="20 min", help="of each test")
    tests.add_argument("--layer", type=int, help="layer of wire (default: outermost that the pressures allow)")
    tests.add_argument("--reference", action="append", help="friction or motor set that the crane really has")
    motor.add_argument("--motor", default="A6VM215", help="motor of the library whose MJ4 loss it starts from")
    return parser


def sea_trials(given: argparse.Namespace) -> WrittenCampaign:
    defect = Defect(given.defect) if given.defect else None
    size = size_of(defect, given.size, "--size") if defect and given.size else None
    plan = trials(given.crane if given.crane in cranes() else load_crane(given.crane))
    real = load_crane(given.real) if given.real else None
    return write_campaign(given.out, plan=plan, seed=given.seed, defect=defect, size=size, apart=given.apart, real=real)


def friction_tests(given: argparse.Namespace) -> WrittenCampaign:
    plan = friction.campaign_plan(given.plan)
    sets = [load_set(name) for name in given.reference or ()]
    crane = crane_with(load_crane(plan.crane), *sets) if sets else None
    instruments = Instruments(given.noise, given.seed)
    return friction.write_campaign(
        plan, given.out, instruments=instruments, reference=crane, duration=given.duration, layer=given.layer
    )


def main(words: Sequence[str] | None = None) -> int:
    given = arguments().parse_args(words)
    try:
        if given.what == "motor-map":
            print(f"written: {write_map(synthetic_map(given.motor, seed=given.seed), given.out)}")
            return 0
        written = sea_trials(given) if given.what == "sea-trials" else friction_tests(given)
    except StillhookError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    print(*written.notes, f"written: {written.campaign}, with the crane in {written.reference}", sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
