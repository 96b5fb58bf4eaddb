"""Current, wind and swing of a load in a plan: leads against the load chart, the section, and mistakes in one line."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.plan.test_load_chart import HEAD, PLAN, ROWS

from stillhook.cli import run
from stillhook.physics.scalar import G
from stillhook.plan.assessments import sideways
from stillhook.plan.definition.capacities import at_rest, calm, in_current, still_leads, wind_lead
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import limited, limits_in
from stillhook.plan.planning import plan as planned
from stillhook.plan.report.document import document
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.sideways import chain_at
from stillhook.sea.spectra.parametric import Jonswap

CURRENT = """\
[environment.current]
depth = ["0 m", "300 m"]
speed = ["1.0 m/s", "0.2 m/s"]
direction = "270 deg"
sense = "going-to"
area = "40 m^2"

"""
WIND = """\
[environment.wind]
speed = "12 m/s"
direction = "180 deg"
sense = "coming-from"
area = "60 m^2"

"""
DOWN = '\n[[phase]]\nname = "down"\nkind = "lowering"\nmode = "ahc"\n\n[[phase]]\nname = "landing"\nkind = "landing"\n'


def lift(folder: Path, flow: str = CURRENT + WIND, more: str = DOWN, head: str = HEAD, rows: str = ROWS) -> LiftPlan:
    (folder / "chart.csv").write_text(head + rows, encoding="utf-8")
    path = folder / "plan.toml"
    path.write_text(PLAN.replace("[load_chart]", flow + "[load_chart]", 1) + more, encoding="utf-8")
    return load_plan(path)


def test_a_load_in_the_wind_leans_by_the_force_over_what_hangs_on_the_tip(tmp_path):
    """The boom points to starboard; a wind from astern is side-lead."""
    of = lift(tmp_path)
    phase = of.phases[0]
    z = phase.z_start
    mean, gust = (wind_lead(of, phase, z, gust=each) for each in (False, True))
    F = 0.5 * 1.226 * 2.0 * 60.0 * (12.0 * ((z + 0.5 * of.payload.height) / 10.0) ** 0.12) ** 2
    assert math.tan(mean[0]) == pytest.approx(F / at_rest(of, phase, z).F_tip, rel=1e-6)
    assert 1.5 < gust[0] / mean[0] < 3.0  # a step of the pressure by 1.249^2 would give 1 + 2 x 0.56
    still = still_leads(of, phase)
    assert still["side_lead"] >= gust[0]
    assert still["off_lead"] == pytest.approx(0.0, abs=1e-12)


def test_what_flows_across_the_boom_is_side_lead_and_along_it_off_lead(tmp_path):
    of = lift(tmp_path)
    down = next(phase for phase in of.phases if phase.name == "down")
    along = still_leads(of, down)
    across = still_leads(lift(tmp_path, CURRENT.replace("270", "180")), down)
    assert across["side_lead"] == pytest.approx(along["off_lead"])
    assert along["side_lead"] == pytest.approx(0.0, abs=1e-9) == across["off_lead"]
    assert calm(of, down)["off_lead"] == along["off_lead"]


def test_a_current_has_leads_judged_under_water_and_lowers_their_limit(tmp_path):
    bare, of = lift(tmp_path, ""), lift(tmp_path)
    for name in ("down", "landing"):
        phase = of.phase(name)
        assert {"off-lead", "side-lead"} <= {each.rule.key for each in limited(of, phase, Alternative.NONE)}
        assert not {"off-lead", "side-lead"} & {each.rule.key for each in limited(bare, phase, Alternative.NONE)}
    weak = lift(tmp_path, CURRENT.replace("1.0 m/s", "0.1 m/s").replace("0.2 m/s", "0.1 m/s"))
    values = [closed_form(each, each.phase("down"), each.environment.table()).values["off_lead"] for each in (weak, of)]
    assert (values[1] > values[0]).all()
    oblique, head, other = values[1].reshape(3, 2, len(of.environment.Hs))
    assert (oblique[:, -1] > oblique[:, 0]).all()
    assert (other[:, -1] > other[:, 0]).all()
    assert head == pytest.approx(still_leads(of, of.phase("down"))["off_lead"])  # by symmetry, the boom to starboard
    strong = lift(tmp_path, CURRENT.replace("1.0 m/s", "3 m/s").replace('"0.2 m/s"', '"2 m/s"'))
    assert still_leads(strong, strong.phase("down"))["off_lead"] > math.radians(6.0)
    demand = closed_form(strong, strong.phase("down"), strong.environment.table())
    assert (limits_in(strong, demand).Hs["off-lead"] == 0.0).all()  # in every sea state, calm included


def test_in_still_water_the_wire_hangs_as_that_of_a_plan_without_a_current(tmp_path):
    of = lift(tmp_path, CURRENT.replace("1.0 m/s", "0 m/s").replace("0.2 m/s", "0 m/s"))
    for phase in (of.phase("down"), of.phase("landing")):
        shape = in_current(of, phase, phase.z_end)
        assert shape.tension == pytest.approx(at_rest(of, phase, phase.z_end).F_tip, rel=1e-12)
        assert shape.extra == pytest.approx(0.0, abs=1e-9)
        assert not shape.lead().any()


def test_without_either_nothing_of_a_plan_changes(tmp_path):
    bare = lift(tmp_path, "")
    assert "current" not in bare.environment.inputs()
    assert bare.rules.changes == ()
    assert "sideways" not in planned(bare, tier=Tier.CLOSED_FORM).facts


def on_a_light_wire(of: LiftPlan) -> LiftPlan:
    """Hook and wire weigh next to nothing, and nothing stretches."""
    light = replace(of, crane=of.crane.model_copy(update={"hook_mass": 1.0}))
    wire = light.crane.wire.model_copy(update={"mass_per_length": 0.5, "fill": 1e-4, "d": 1e-3, "E": 1e20})
    return replace(light, crane=light.crane.model_copy(update={"wire": wire}))


def test_a_deep_load_has_the_period_of_its_weight_in_water_on_its_mass_with_the_water(tmp_path):
    """A wire that weighs little: 2 pi sqrt((M + A) L / W)."""
    light = on_a_light_wire(lift(tmp_path, CURRENT + WIND))
    phase, z = light.phase("landing"), -250.0
    load = light.payload
    W = (load.mass - light.rho * load.covered(light.rho).V) * G
    L = 36.0 - z - 0.5 * load.height
    mass = load.mass + load.covered(light.rho).A33
    assert chain_at(light, phase, z).periods[0] == pytest.approx(2.0 * math.pi * math.sqrt(mass * L / W), rel=5e-3)


def test_a_load_in_air_swings_as_a_pendulum_of_the_length_to_its_middle(tmp_path):
    light = on_a_light_wire(lift(tmp_path, WIND))
    L = 36.0 - 10.0 - 0.5 * light.payload.height
    period = chain_at(light, light.phase("landing"), 10.0).periods[0]
    assert period == pytest.approx(2.0 * math.pi * math.sqrt(L / G), rel=1e-3)


def test_the_section_has_offsets_periods_and_the_chart(tmp_path):
    of = lift(tmp_path, CURRENT + 'clearance = "1 m"\n\n' + WIND)
    result = planned(of, tier=Tier.CLOSED_FORM)
    facts = result.facts["sideways"]
    deepest = min(facts["current"]["rows"], key=lambda row: row["z"])
    shape = in_current(of, of.phase("landing"), deepest["z"])
    assert deepest["offset"] == shape.offset.tolist()
    assert deepest["offset"][1] < -1.0  # 270 deg from the bow, counter-clockwise: to starboard
    assert 0.0 < deepest["raised"] == pytest.approx(deepest["extra"], rel=0.05)
    assert any(any(row["in_waves"]) for row in facts["pendulum"])
    assert {row["phase"] for row in facts["leads"]} == {"over the side", "down", "landing, held", "landing"}
    assert any("NOT JUDGED in splash" in note for note in facts["not_judged"])
    text = str(document(result, {}))
    for words in ("RESONANCE", "NOT OK", "going to 270 deg", "Lead of the wire against the load chart"):
        assert words in text
    assert sideways.parts({"sideways": facts})


def test_a_chart_without_leads_judges_none_and_says_so(tmp_path):
    rows = "\n".join(",".join(row.split(",")[:4]) for row in ROWS.splitlines()) + "\n"
    facts = planned(lift(tmp_path, rows=rows, head="radius [m],Hs [m],SWL [t],DAF [1]\n"), tier=Tier.CLOSED_FORM).facts
    assert facts["sideways"]["leads"] == []
    assert any("has no limits of them" in note for note in facts["sideways"]["not_judged"])


@pytest.mark.parametrize(
    ("old", "new", "texts"),
    [
        ('area = "40 m^2"', 'area = "-40 m^2"', ["environment.current.area", "-40 m^2"]),
        ('sense = "going-to"\n', "", ["environment.current.sense", "missing"]),
        ('sense = "coming-from"', 'sense = "from"', ["environment.wind.sense", "going-to", "coming-from"]),
        ('"300 m"]', '"200 m"]', ["environment.current.depth", "ends at 200 m", "seabed is at 300 m"]),
        ('["0 m", "300 m"]', '["300 m", "0 m"]', ["environment.current", "begin at 0 m and rise"]),
        ('["0 m", "300 m"]', '["0 m", "10 m", "300 m"]', ["environment.current", "speed has 2 values, depth 3"]),
        ('"1.0 m/s", ', '"-1.0 m/s", ', ["environment.current", "negative"]),
        ('area = "60 m^2"\n', "", ["environment.wind.area", "missing"]),
        ('"12 m/s"', '"12 m"', ["environment.wind.speed", "12 m"]),
        ('"1.0 m/s", "0.2 m/s"', '"8 m/s", "8 m/s"', ["down", "60 deg off the vertical", "Check speed, area and C_D"]),
    ],
)
def test_a_flow_that_cannot_be_is_refused_in_one_line_with_exit_code_2(tmp_path, capsys, old, new, texts):
    flow = CURRENT + WIND
    assert old in flow
    (tmp_path / "chart.csv").write_text(HEAD + ROWS, encoding="utf-8")
    path = tmp_path / "plan.toml"
    path.write_text(
        PLAN.replace("[load_chart]", flow.replace(old, new, 1) + "[load_chart]", 1) + DOWN, encoding="utf-8"
    )
    assert run(["plan", str(path), "--check"]) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line
    for text in ("plan.toml", *texts):
        assert text in line


@pytest.mark.parametrize("gamma", [1.0, 3.3, 5.0])
def test_a_swing_is_looked_for_in_the_periods_that_hold_nearly_all_energy_of_a_sea(gamma: float) -> None:
    """A sea without a marked peak has more of it beside them."""
    Tp = 9.0
    low, high = (part * Tp for part in sideways.BAND)
    omega = np.linspace(0.05, 8.0, 20_000)
    S = Jonswap(2.0, Tp, gamma).density(omega)
    inside = (omega >= 2.0 * math.pi / high) & (omega <= 2.0 * math.pi / low)
    share = S[inside].sum() / S.sum()
    assert share > (0.8 if gamma == 1.0 else 0.86)
    assert 2.0 * math.pi / high < omega[np.argmax(S)] < 2.0 * math.pi / low
