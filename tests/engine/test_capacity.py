"""What a crane carries at its tip is judged alike by a scenario and a lowering, the weight of the wire included."""

import pytest
from tests.engine.test_lowering import box

from stillhook import Scenario, load_crane, simulate
from stillhook.errors import LiftError
from stillhook.spec.lift.lowering import Lowering, Stage


def scenario(load: str, s_w: str):
    return Scenario(load=load, s_w=s_w, mode="ssc", tip="still", duration="12 s", warm_up="10 s")


def test_the_wire_counts_as_load():
    """240 t at 3,000 m: 108 t of wire."""
    run = simulate(load_crane("deep-250t"), scenario("240 t", "3000 m"))
    assert "overload" in run["status"].item().split(", ")
    assert "1060 kN of it the wire in air" in run["notes"].item()
    assert "left out of tension and pressures" in run["notes"].item()


@pytest.mark.parametrize(
    ("load", "s_w", "over"), [("250 t", "2 m", True), ("249 t", "10 m", False), ("240 t", "300 m", True)]
)
def test_at_the_border_every_metre_of_wire_counts(load, s_w, over):
    """The wire of nov-250t has 36 kg/m."""
    assert ("overload" in simulate(load_crane("nov-250t"), scenario(load, s_w))["status"].item()) is over


@pytest.mark.parametrize(("tonnes", "over"), [(240.0, True), (100.0, False)])
def test_scenario_and_lowering_judge_alike(tonnes, over):
    crane, down = load_crane("deep-250t"), 2000.0
    lift = Lowering(
        payload=box(f"{tonnes} t"),
        h_tip="20 m",
        depth="3000 m",
        z_0=f"{-down} m",
        programme=(Stage(mode="manual", lower="1 m/min", depth=f"{down + 1.0} m"),),
        duration="10 s",
    )
    status = simulate(crane, scenario(f"{tonnes} t", f"{down + 15.0} m"))["status"].item()
    assert ("overload" in status) is over
    if over:
        with pytest.raises(LiftError, match="SWL and hook"):
            simulate(crane, lift)
    else:
        assert "overload" not in simulate(crane, lift, every="1 s")["status"].item()
