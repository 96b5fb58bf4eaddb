"""What a crane carries at its tip is judged alike by a scenario, a lowering and a plan, the weight of the wire
included: at rest, and in peaks."""

import re
from dataclasses import replace

import pytest
from tests.engine.test_lowering import box

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.capacity import capacity_notes, judged
from stillhook.engine.pack.programme import hanging
from stillhook.errors import LiftError
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import CAPACITIES
from stillhook.plan.definition.load_chart import CapacityStatement
from stillhook.plan.file import load_plan
from stillhook.sea.motion.words import parse_motion
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase


def scenario(load: str, s_w: str):
    return Scenario(load=load, s_w=s_w, mode="ssc", tip="still", duration="12 s", warm_up="10 s")


def words(run) -> list[str]:
    return run["status"].item().split(", ")


def test_the_wire_counts_as_load():
    """By hand: 240 t, a hook of 3 t, and 3,000 m of 36 kg/m, are 351 t on 253 t: 3,442 kN on 2,481 kN."""
    crane = load_crane("deep-250t")
    run = simulate(crane, scenario("240 t", "3000 m"))
    assert (crane.hook_mass, crane.wire.mass_per_length) == (3000.0, 36.0)
    assert "overload" in words(run)
    assert "peak load" not in words(run)
    note = next(n for n in run["notes"].item().split("\n") if n.startswith("overload: "))
    assert "at rest 3442 kN at the crane tip, 1060 kN of it the wire in air" in note
    assert 'and "deep-250t" carries 2481 kN (SWL and hook)' in note
    assert "left out of tension and pressures" in run["notes"].item()


def test_a_load_at_the_swl_in_a_wave_is_a_peak_load_and_no_overload():
    """By hand: 250 t less 2 m of 36 kg/m wire are at rest on what the crane carries. The wave accelerates what the
    compensation leaves of it alone: some per cent, and without the factor of a load chart nobody allows them."""
    still = scenario("249.9 t", "2 m")
    moving = still.model_copy(update={"tip": parse_motion("sine 0.5 m 10 s"), "duration": 60.0})
    crane = load_crane("nov-250t")
    assert words(simulate(crane, still)) == ["ok"]
    run = simulate(crane, moving)
    assert "peak load" in words(run)
    assert "overload" not in words(run)
    note = next(n for n in run["notes"].item().split("\n") if n.startswith("peak load: "))
    carries = (crane.SWL + crane.hook_mass) * G
    factor = float(re.search(r"dynamic factor of (1\.\d\d) or more", note).group(1))
    assert factor - 0.01 <= (run["F_w_max"].item() + 2.0 * 36.0 * G) / carries <= factor
    assert 1.0 < factor < 1.1


def test_a_plan_takes_the_same_capacity_at_rest_and_a_factor_of_it_for_peaks():
    """Without a load chart: 253 t at rest and in peaks, unless the maker states a factor."""
    plan = replace(load_plan("template-to-1500m"), load_chart=None, statement=None)
    crane = plan.crane
    asked = [CAPACITIES[name].find(plan, plan.phases[0], plan.alternatives[0]) for name in ("SWL_tip", "SWL_dynamic")]
    assert [a.value for a in asked] == pytest.approx([253e3 * G, 253e3 * G], rel=1e-12)
    stated = CapacityStatement.model_validate({"dynamic_factor": 1.3, "statement": "letter of the maker"})
    more = CAPACITIES["SWL_dynamic"].find(replace(plan, statement=stated), plan.phases[0], plan.alternatives[0])
    assert more.value == pytest.approx(3.225e6, rel=1e-3)
    assert "letter of the maker" in more.basis
    assert judged(crane, 253e3 * G, 253e3 * G) == []
    assert judged(crane, 253e3 * G, 254e3 * G) == ["peak load"]
    assert judged(crane, 254e3 * G, 254e3 * G) == ["overload"]
    assert capacity_notes(crane, 253e3 * G, 253e3 * G) == []


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
        start_depth=f"{down} m",
        programme=(Phase(mode="manual", speed="1 m/min", depth=f"{down + 1.0} m"),),
        duration="10 s",
    )
    scenario_words = words(simulate(crane, scenario(f"{tonnes} t", f"{down + 15.0} m")))
    assert ("overload" in scenario_words) is over
    if over:
        with pytest.raises(LiftError, match="SWL and hook"):
            simulate(crane, lift)
    else:
        assert not {"overload", "peak load"} & set(words(simulate(crane, lift, every="1 s")))


@pytest.mark.parametrize(("motion", "word"), [("sine 0.1 m 8 s", "peak load"), ("still", "ok")])
def test_a_lowering_tells_peaks_from_what_hangs_at_rest(motion, word):
    """As heavy at rest as the crane carries, but for a tonne: 2,015 m of wire hang on it. A tip that moves does the
    rest."""
    crane, down = load_crane("deep-250t"), 2000.0

    def lift(tonnes: float) -> Lowering:
        return Lowering(
            payload=box(f"{tonnes} t"),
            h_tip="20 m",
            depth="3000 m",
            start_depth=f"{down} m",
            tip=parse_motion(motion),
            programme=(Phase(mode="manual", speed="1 m/min", depth=f"{down + 0.2} m"),),
            duration="40 s",
        )

    free = 252e3 - hanging(crane, lift(100.0), -down).F_tip / G
    run = simulate(crane, lift(100.0 + free / 1e3), every="1 s")
    assert "overload" not in words(run)
    assert ("peak load" in words(run)) is (word == "peak load")
