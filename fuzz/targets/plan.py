"""Files of a plan and of validation: plan, rules, load chart, weather use, factors, costs, campaigns, criteria."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import stillhook
from fuzz.targets.crane import LIBRARY
from fuzz.targets.registry import Form, Target, files
from stillhook.analysis.drives.costs import load_costs
from stillhook.analysis.uncertainty.draws import load_uncertainty
from stillhook.formats.weather.description import weather_of_file
from stillhook.identify.motor.map import read_map
from stillhook.identify.system_friction.campaign import load_campaign as load_friction_campaign
from stillhook.plan.definition.load_chart import read_load_chart, understood_chart
from stillhook.plan.definition.rules_file import load_rules
from stillhook.plan.file import load_plan
from stillhook.validate.criteria.criteria import load_criteria
from stillhook.validate.data_set.campaign import load_campaign
from stillhook.weather.alpha import load_alpha_table

PACKAGE = Path(stillhook.__file__).parent
FACTORS = b"""defaults = true
[factors]
friction = { lognormal = [1.0, 1.4] }
bulk_modulus = { uniform = [0.6, 1.1] }
delay = { triangular = ["0 ms", "10 ms", "40 ms"] }
inertia = "default"
"""
SITE = b"""file = "site.csv"
time_zone = "UTC+1"
[columns]
Hs = "Hs"
Tp = { column = "Tp", unit = "s" }
"""
LOG = b"time [s];p_a [bar];v_w [m/s]\n0;100;0\n0.1;101;0.1\n0.2;102;0.2\n"


def _lift_plan() -> Iterator[bytes]:
    for file in sorted((LIBRARY / "lifts").glob("*.toml")):
        yield file.read_bytes()


SEA_TRIALS = LIBRARY / "examples" / "sea-trials"


def _campaign(example: str) -> Iterator[bytes]:
    """The library's example with one log for all tests, each a part of it."""
    data = (LIBRARY / "examples" / example / "campaign.toml").read_bytes()
    yield re.sub(rb'"logs/[\w-]+\.csv"', b'"1.csv"', data)
    head, first, *_ = data.split(b"[[test]]")
    yield re.sub(rb'"logs/[\w-]+\.csv"', b'"1.csv"', head + b"[[test]]" + first)


def _path(read: Callable[[str], object]) -> Callable[[Path], object]:
    return lambda path: read(str(path))


TARGETS = (
    Target(
        "plan",
        Form.TOML,
        load_plan,
        "plan.toml",
        seeds=_lift_plan,
        share=3,
        beside={"SYNTHETIC-load-chart.csv": (LIBRARY / "lifts" / "SYNTHETIC-load-chart.csv").read_bytes()},
    ),
    Target(
        "rules",
        Form.TOML,
        load_rules,
        "rules.toml",
        seeds=files(PACKAGE / "plan" / "definition" / "rule_sets", "*.toml"),
        share=2,
    ),
    Target("chart", Form.TABLE, read_load_chart, "chart.csv", seeds=files(LIBRARY / "lifts", "*.csv"), share=2),
    Target(
        "chart-understood",
        Form.TABLE,
        lambda p: understood_chart(str(p)),
        "chart.csv",
        seeds=files(LIBRARY / "lifts", "*.csv"),
    ),
    Target(
        "alpha",
        Form.TOML,
        _path(load_alpha_table),
        "alpha.toml",
        seeds=files(PACKAGE / "weather" / "alpha_tables", "*.toml"),
    ),
    Target(
        "weather-description",
        Form.TOML,
        _path(weather_of_file),
        "site.toml",
        seeds=lambda: iter((SITE,)),
        beside={"site.csv": b"time;Hs;Tp\n2020-01-01 00:00;1;8\n2020-01-01 01:00;1.2;8\n2020-01-01 02:00;1.1;8\n"},
    ),
    Target("factors", Form.TOML, load_uncertainty, "factors.toml", seeds=lambda: iter((FACTORS,))),
    Target("costs", Form.TOML, load_costs, "costs.toml"),
    Target(
        "criteria",
        Form.TOML,
        load_criteria,
        "criteria.toml",
        share=2,
        seeds=files(PACKAGE / "validate" / "criteria" / "criteria_sets", "*.toml"),
    ),
    Target(
        "campaign",
        Form.TOML,
        load_campaign,
        "campaign.toml",
        beside={"1.csv": LOG, "criteria.toml": (SEA_TRIALS / "criteria.toml").read_bytes()},
        share=2,
        seeds=lambda: _campaign("sea-trials"),
    ),
    Target(
        "friction-campaign",
        Form.TOML,
        load_friction_campaign,
        "campaign.toml",
        beside={"1.csv": LOG},
        seeds=lambda: _campaign("friction-tests"),
    ),
    Target("motor-map", Form.TABLE, read_map, "map.csv"),
)
