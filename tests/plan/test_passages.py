"""In passages openings of relief valves count, not a share of the time."""

from tests.plan.manifold import loaded, manifold

from stillhook.plan.definition.rules import Alternative
from stillhook.plan.limits import limited, passage

SEAS = """\
[environment]
Hs = ["1 m", "2 m"]
Tp = ["8 s"]
headings = ["180 deg"]

[operation]
T_POP = "8 h"

"""
WAY = """\
[[phase]]
name = "short"
kind = "lowering"
mode = "ahc"
depth = "40 m"
speed = "6 m/min"

[[phase]]
name = "long"
kind = "lowering"
mode = "ahc"
depth = "290 m"
speed = "6 m/min"

[[phase]]
name = "deep"
kind = "deep"
time = "2 min"

"""


def keys(plan, name):
    return {each.rule.key for each in limited(plan, plan.phase(name), Alternative.SSC)}


def test_a_short_way_has_no_share_of_time_and_keeps_the_peak_pressure(tmp_path):
    """0.1 % of a passage of 2 min is one opening of a valve."""
    plan = loaded(tmp_path, manifold("none", "cap-80", "ssc", start_depth="30 m") + SEAS + WAY)
    lasts = {phase.name: phase.duration for phase in plan.phases}
    assert lasts == {"short": 100.0, "long": 2500.0, "deep": 120.0}
    assert [name for name in lasts if passage(plan, plan.phase(name))] == ["short"]
    assert "relief-time" not in keys(plan, "short")
    assert "peak-pressure" in keys(plan, "short")
    assert "relief-time" in keys(plan, "long") & keys(plan, "deep")


def test_a_limit_of_the_phase_itself_holds_in_a_passage(tmp_path):
    text = WAY.replace('depth = "40 m"', 'depth = "40 m"\nlimits = { relief-time = "1 %" }')
    plan = loaded(tmp_path, manifold("none", "cap-80", "ssc", start_depth="30 m") + SEAS + text)
    rule = next(x for x in limited(plan, plan.phase("short"), Alternative.SSC) if x.rule.key == "relief-time")
    assert rule.limit == 0.01
