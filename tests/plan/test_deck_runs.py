"""Runs of lift-offs from another vessel and of set-downs: against the closed form of taking up a load, the speeds of deck
and tip at contact, a sine by hand, and in a plan from the search to the report."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.engine.lowering.hoisting_speed import hoisting_speed
from stillhook.engine.simulate import simulate
from stillhook.library.crane_file import changed
from stillhook.physics.scalar import G
from stillhook.plan.assessments.failures.cases import AHC_TRIP
from stillhook.plan.assessments.failures.runs import MOMENTS, FailureRuns, Request, moments
from stillhook.plan.definition.capacities import springs
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.limits import limits_in
from stillhook.plan.planning import plan
from stillhook.plan.report.document import document
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution
from stillhook.plan.tiers.time_domain.lowering import (
    ABOVE_DECK,
    SETTLE,
    SeaState,
    Winch,
    course_of,
    in_sea,
    lowering_of,
    machine_of,
    winch_of,
)
from stillhook.plan.tiers.time_domain.measures import AT_DECK
from stillhook.plan.tiers.time_domain.placing import GOVERNING_MARGIN, Search
from stillhook.plan.tiers.time_domain.tier import refine
from stillhook.sea.motion.motion import Sine
from stillhook.spec.lift.lowering import Rigging
from stillhook.spec.lift.phase import Phase

HEAD = """\
[other_vessel]
vessel = "supply-vessel-82m"
at = "x=-20 m, y=0 m"

[rigging]
carrier = "another-vessel"

[environment]
Hs = "0.5 m to 2 m by 0.5 m"
Tp = ["9 s"]
headings = ["180 deg"]

[operation]
T_POP = "8 h"

[[phase]]
name = "off"
kind = "lift-off-barge"
speed = "{v} m/min"
{how}
[[phase]]
name = "over"
kind = "in-air"
depth = "-20 m"

[[phase]]
name = "on"
kind = "set-down-platform"
depth = "-12 m"
deck = "other-vessel"
speed = "6 m/min"
{how}
"""
TO_DECK = 'mode = "ahc"\nreference = "deck"\n'
TAKEN_UP = 0.08
"""The hook, 3 t on the slings of 60 t, has a momentum of its own, and the joystick's speed is not the drum's."""
CONTACT = 0.03
"""Swing of the payload on its wire as it touches [m/s]."""
A, T = 0.4, 8.0


def lift(folder, v: float = 12.0, how: str = "", alternatives: tuple[str, ...] = ("none",)) -> LiftPlan:
    return loaded(folder, manifold(*alternatives, start_depth="-10 m") + HEAD.format(v=v, how=how))


def calm(of: LiftPlan, phase: Phase, winch: Winch = Winch()):  # noqa: B008 (a record without state)
    return lowering_of(of, phase, course_of(of, phase, winch), machine_of(of, winch)[1])


@pytest.mark.parametrize("v", [12.0, 24.0])
def test_a_drum_that_cannot_slow_down_takes_up_the_load_as_the_closed_form_has_it(tmp_path, v):
    """W + v sqrt(K M), with v of the wire as the slings come taut, off a stiff deck and without damping. The crane's own
    drum slows down, and takes it up with less."""
    of = lift(tmp_path, v)
    heavy = changed(of.crane, {"inertia": {"J_drum": "1.4546e+08 kg m^2", "J_m_eff": "581.7 kg m^2"}})
    K, M = max(springs(of, of.phases[0]))
    stiff, peaks = calm(of, of.phases[0]), []
    assert stiff.deck is not None
    deck = stiff.deck.model_copy(update={"settlement": 0.5e-3})
    stiff = stiff.model_copy(update={"deck": deck, "rigging": Rigging(zeta=0.0)})
    for crane in (heavy, of.crane):
        run = simulate(crane, stiff, every="0.02 s", step="1 ms")
        before_taut = int(np.argmax(run.F_sling.values > 0.0)) - 1
        peaks.append((float(run.F_sling_max) - M * G) / (float(run.v_w[before_taut]) * math.sqrt(K * M)))
    assert peaks[0] == pytest.approx(1.0, abs=TAKEN_UP)
    assert peaks[1] < 0.85 * peaks[0]


def test_off_a_sine_only_what_hoists_slower_than_the_deck_is_hit_again(tmp_path):
    """The line of the hook meets a sine again from some start if it is less steep than A omega (K_H below 1), and from
    none if it is steeper."""
    of = lift(tmp_path)
    lowering = calm(of, of.phases[0])
    assert lowering.deck is not None
    motion = Sine(amplitude=f"{A} m", period=f"{T} s")
    lowering = lowering.model_copy(update={"deck": lowering.deck.model_copy(update={"motion": motion})})
    speed = 2.0 * math.pi / T * A
    found = hoisting_speed(of.crane, lowering, [0.3 * speed, 1.1 * speed], starts=16)
    slow, fast = found.rows
    assert slow.share > 0.0
    assert fast.share == 0.0
    W, (K, M) = of.payload.mass * G, max(springs(of, of.phases[0]))
    assert slow.F_hook < W + (1.0 + TAKEN_UP) * 1.3 * speed * math.sqrt(K * M)


def test_the_wire_is_slack_until_the_hook_is_at_hoisting_speed_and_no_wave_takes_it_up_before(tmp_path):
    of = lift(tmp_path, 30.0)
    course, phase = course_of(of, of.phases[0], Winch()), of.phases[0]
    run = simulate(of.crane, calm(of, phase), every="0.05 s")
    assert float(run.t_lift_off) > SETTLE + phase.speed / 0.1
    before = run.sel(time=slice(None, float(run.t_lift_off) - 0.3))
    assert float(before.v_w[-1]) == pytest.approx(phase.speed, rel=0.02)
    assert float(run.z_load[-1]) == pytest.approx(phase.z_end, abs=0.05)
    assert float(run.duration) > SETTLE + course.counted + ABOVE_DECK - 1.0
    cells = Cells(of, Execution())
    sea = SeaState(2.0, 9.0, math.pi)
    crane, cases = cells.cases(CellRequest(phase.name, Winch(), sea, 8), range(1, 9))
    runs = simulate(crane, cases)
    assert float(runs.t_lift_off.min()) > SETTLE


def test_a_payload_touches_the_deck_of_the_other_vessel_with_what_deck_and_tip_do_then(tmp_path):
    """The hook goes down at lowering speed and with the tip; the deck comes up: their speeds in the same waves."""
    of = lift(tmp_path)
    phase = of.phase("on")
    course = course_of(of, phase, Winch())
    off = []
    for seed in range(1, 7):
        case = in_sea(of, phase, Winch(), course, calm(of, phase), SeaState(1.5, 9.0, math.pi), seed)
        lowering = case.lowering()
        run = simulate(of.crane, lowering, series=False)
        t = np.array([float(run.t_landed)])
        tip, deck = lowering.tip.sample(t)[1], lowering.deck.motion.sample(t)[1]
        off.append(float(run.v_landed) - float(phase.speed + deck[0] - tip[0]))
        assert float(run.v_hit_max) >= float(run.v_landed)
    assert np.abs(off).max() < CONTACT
    assert not np.allclose(off, 0.0, atol=1e-6)


def test_what_a_flat_cap_leaves_of_a_deck_that_is_followed_is_of_the_motion_against_it(tmp_path):
    of = lift(tmp_path, how=TO_DECK, alternatives=("none", "cap-80"))
    phase, sea = of.phases[0], SeaState(1.5, 9.0, math.pi)
    moved = {}
    for alternative in (Alternative.NONE, Alternative.CAP):
        winch = winch_of(phase, alternative)
        moved[alternative] = in_sea(of, phase, winch, course_of(of, phase, winch), calm(of, phase), sea, 3)
    t = np.linspace(20.0, 80.0, 200)
    none, cap = (case.lowering() for case in moved.values())
    tip, deck = none.tip.sample(t)[0], none.deck.motion.sample(t)[0]
    assert np.array_equal(cap.deck.motion.sample(t)[0], deck)
    assert cap.tip.sample(t)[0] - deck == pytest.approx(0.2 * (tip - deck), abs=1e-9)
    earth = moved[Alternative.CAP].lift.deck.model_copy(update={"followed": False})
    alone = replace(moved[Alternative.CAP], lift=moved[Alternative.CAP].lift.model_copy(update={"deck": earth}))
    assert alone.lowering().tip.sample(t)[0] == pytest.approx(0.2 * tip, abs=1e-12)
    assert alone.motion != moved[Alternative.CAP].motion


def test_a_winch_that_follows_the_deck_hits_it_at_the_lowering_speed(tmp_path):
    """Against the earth it hits it with the deck's speed as well, in the same waves."""
    sea, hits = SeaState(1.5, 9.0, math.pi), {}
    for how in (TO_DECK, TO_DECK.replace('reference = "deck"\n', "")):
        of = lift(tmp_path, how=how, alternatives=("ssc",))
        cells, winch = Cells(of, Execution()), winch_of(of.phase("on"), Alternative.SSC)
        cells.request([CellRequest("on", winch, sea, 16)])
        hits[how] = cells.runs["on", winch, sea]["v_hit"]
    follows, earth = hits.values()
    assert np.abs(follows - 0.1).max() < 0.5 * np.abs(earth - 0.1).max()
    assert np.quantile(follows, 0.9) < np.quantile(earth, 0.9)


def test_failures_at_a_lift_off_begin_while_the_load_is_taken_up(tmp_path):
    """A brake that closes then lets the drum yield no more: the hook load is above that of the same waves without a
    failure, and no run before the wire is taut counts for more than a period."""
    of = lift(tmp_path, how=TO_DECK, alternatives=("ssc",))
    phase, sea, Tp = of.phases[0], SeaState(1.0, 9.0, math.pi), 9.0
    winch = winch_of(phase, Alternative.SSC)
    course = course_of(of, phase, winch)
    begins = moments(phase, course, Tp)
    assert len(begins) == MOMENTS
    assert begins[0] > course.counted - 3.0 / phase.speed - Tp
    cells = Cells(of, Execution())
    cells.request([CellRequest(phase.name, winch, sea, 16)])
    runs = FailureRuns(cells, Alternative.SSC)
    trip = Request(AHC_TRIP, phase.name, sea)
    runs.request([trip])
    numbers = runs.runs[trip]
    assert np.isfinite(numbers["duration"]).all()
    assert numbers["F_w_max"].max() > cells.runs[phase.name, winch, sea]["F_w_max"].max()
    assert np.nanmax(numbers["v_hit_max"]) > 0.0  # what is stopped over a deck is hit by it


@pytest.mark.long
def test_the_search_runs_a_deck_no_higher_than_what_the_closed_form_alone_judges_and_names_what_runs_judge(tmp_path):
    of = lift(tmp_path, 15.0)
    table = of.environment.table()
    predicted = [limits_in(of, closed_form(of, phase, table)) for phase in of.phases]
    tier = refine(of, predicted, search=Search(seeds=8, most_seeds=8))
    off = next(each for each in tier.limits if each.phase == "off")
    by_runs = {key for key, Hs in off.Hs.items() if not np.isnan(Hs).all()}
    assert {"rigging-daf-air"} <= by_runs <= {"dynamic-load", "rigging-daf-air", "second-hit-speed", "impact-speed"}
    assert set(next(each for each in tier.demands if each.phase == "off").values) == set(AT_DECK)
    by_form = next(each for each in predicted if each.phase == "off").Hs
    alone = min(float(by_form[key][0]) for key in ("hoisting-speed", "second-hit", "deck-tilt"))
    highest = max(float(Hs) for demand in tier.demands if demand.phase == "off" for Hs in demand.seas.Hs)
    assert highest <= GOVERNING_MARGIN * alone + 0.05
    assert float(off.Hs["rigging-daf-air"][0]) > float(by_form["rigging-daf-air"][0])
    assert all(tier.reasons[name]["cause"] != "no-ground" for name in ("off", "on"))


@pytest.mark.thorough
def test_a_plan_runs_both_phases_and_their_failures_and_shows_runs_beside_the_closed_form(tmp_path):
    of = lift(tmp_path, how=TO_DECK, alternatives=("none", "ssc"))
    result = plan(of, tier=Tier.TIME, store=tmp_path / "runs")
    data = result.data["Hs_rule"].sel(credit="twin", tier="time", alternative="none")
    assert not np.isnan(data.sel(phase="off", rule="rigging-daf-air")).any()
    assert not np.isnan(data.sel(phase="off", rule="second-hit-speed")).all()
    rows = result.facts["other_vessel"]["by_runs"]
    assert [row["phase"] for row in rows] == ["off", "on"]
    off, on = rows
    assert off["closed"]["F_top_max"] > off["F_top_max"][1] > off["F_top_max"][0] > of.payload.mass * G
    assert 0.0 <= off["second_hits"] <= 1.0
    assert on["second_hits"] is None
    assert on["v_landed"][0] > 0.0
    trip = next(case for case in result.facts["failures"]["cases"] if case["key"] == AHC_TRIP)
    assert {row["phase"] for row in trip["rows"]} == {"off", "on"}
    assert all(row["used"] is not None for row in trip["rows"])
    text = str(document(result, {}).sections)
    assert "Runs at the decks" in text
    assert "no run has a deck" not in text
