"""A landing stops above the seabed before the last metres: by default, in the runs, and as a phase with its own rules."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stillhook.errors import StillhookError
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.limits import limited
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution
from stillhook.plan.tiers.time_domain.lowering import SeaState, course_of, winch_of
from stillhook.spec.lift.phase import Phase, PhaseKind, WinchMode

pytestmark = pytest.mark.slow

PLAN = """\
crane = "nov-250t"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
start_depth = "280 m"
alternatives = ["none", "cap-80", "ssc"]
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
[water]
depth = "300 m"
[environment]
Hs = ["1 m", "2 m"]
Tp = ["6 s", "9 s"]
headings = ["180 deg"]
[operation]
T_POP = "4 h"
[[phase]]
name = "deep"
kind = "deep"
[[phase]]
name = "landing"
kind = "landing"
"""


def planned(folder: Path, landing: str = "", before: str = "") -> LiftPlan:
    """A plan of a landing from 20 m above the seabed, with more in it or before it."""
    text = PLAN.replace('[[phase]]\nname = "landing"', f'{before}[[phase]]\nname = "landing"') + landing
    path = folder / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return load_plan(path)


def phases_of(plan: LiftPlan, kind: PhaseKind) -> list[Phase]:
    return [phase for phase in plan.phases if phase.kind is kind]


def test_a_landing_stands_off_before_it_unless_it_says_no(tmp_path):
    plan = planned(tmp_path)
    deep, stands, lands = plan.phases
    assert (stands.name, stands.kind, stands.mode) == ("landing, held", PhaseKind.STAND_OFF, WinchMode.AHC)
    assert (stands.z_start, stands.z_end, stands.duration, stands.speed) == (-297.0, -297.0, 300.0, None)
    assert (lands.z_start, lands.z_end, lands.stand_off, lands.mode) == (-280.0, -300.0, 3.0, WinchMode.LANDING)
    assert not any("hold" in note for note in plan.notes)
    without = planned(tmp_path, 'hold = "off"\n')
    assert [phase.kind for phase in without.phases] == [deep.kind, PhaseKind.LANDING]
    assert without.phases[-1].stand_off is None
    assert any('hold = "off" of landing: a stop there is not claimed' in note for note in without.notes)


def test_a_plan_says_how_high_and_how_long(tmp_path):
    plan = planned(tmp_path, 'hold = "12 min"\nstand_off = "5 m"\nmode = "manual"\n')
    (stands,) = phases_of(plan, PhaseKind.STAND_OFF)
    assert (stands.z_start, stands.duration, stands.mode) == (-295.0, 720.0, WinchMode.MANUAL)
    low = planned(tmp_path, before='[[phase]]\nname = "down"\nkind = "lowering"\ndepth = "298 m"\n')
    assert phases_of(low, PhaseKind.STAND_OFF)[0].z_start == -298.0  # no higher than where the landing begins


def test_a_stand_off_of_the_file_takes_the_place_of_the_default(tmp_path):
    own = '[[phase]]\nname = "down"\nkind = "lowering"\ndepth = "296 m"\n'
    own += '[[phase]]\nname = "look"\nkind = "stand-off"\ntime = "20 min"\nlimits = { load-motion = "0.9 m" }\n'
    plan = planned(tmp_path, before=own)
    (stands,) = phases_of(plan, PhaseKind.STAND_OFF)
    assert (stands.name, stands.z_start, stands.duration) == ("look", -296.0, 1200.0)
    assert phases_of(plan, PhaseKind.LANDING)[0].stand_off == 4.0  # from there, though its own height would be 3 m


def test_rules_of_the_motion_hold_while_it_stands_off(tmp_path):
    plan = planned(tmp_path, 'limits = { load-motion = "0.15 m", landing-speed = "0.3 m/s", control-error = "off" }\n')
    (stands,) = phases_of(plan, PhaseKind.STAND_OFF)
    rules = {each.rule.key: each.limit for each in limited(plan, stands, Alternative.SSC)}
    assert rules["load-motion"] == 0.15
    assert "control-error" not in rules
    assert "landing-speed" not in rules
    assert {"dynamic-load", "slack-sling", "oscillation", "saturation"} <= set(rules)


def test_the_landing_is_run_from_its_stand_off_on(tmp_path):
    plan = planned(tmp_path)
    lands = phases_of(plan, PhaseKind.LANDING)[0]
    course = course_of(plan, lands, winch_of(lands, Alternative.SSC))
    still, last = course.programme[0], course.programme[-1]
    assert (still.speed, still.mode) == (0.0, WinchMode.AHC)
    assert still.time is not None
    assert still.time >= 40.0
    assert course.z_0 == -297.0
    assert course.counted == pytest.approx(3.0 / 0.1)
    assert last.speed == 0.1
    assert (course.times, course.counts) == (20.0 / 3.0, 1)
    whole = course_of(plan, replaced(lands, stand_off=None), winch_of(lands, Alternative.SSC))
    assert whole.counted > course.counted


def replaced(phase: Phase, **new: object) -> Phase:
    return phase.model_copy(update=new)


@pytest.mark.parametrize(
    ("landing", "refused"),
    [
        ('stand_off = "-3 m"\n', "stand_off"),
        ('stand_off = "3 km"\n', "stand_off"),
        ('stand_off = "3 min"\n', "stand_off"),
        ('hold = "3 m"\n', "hold"),
        ('[[phase]]\nname = "up"\nkind = "seabed-lift-off"\nstand_off = "3 m"\n', "only landing has"),
    ],
)
def test_a_stand_off_that_cannot_be_is_refused(tmp_path, landing, refused):
    with pytest.raises(StillhookError) as e:
        planned(tmp_path, landing)
    assert refused in str(e.value)
    assert "\n" not in str(e.value)


@pytest.mark.thorough
def test_the_load_moves_more_after_a_stop_than_on_one_way_down():
    """Friction of winch and wire does not reverse while wire goes out faster than the tip moves, and does where it
    stands: the same seas, the example at 1,500 m."""
    plan = load_plan("template-to-1500m")
    stands, lands = plan.phases[-2:]
    straight = replaced(lands, name="straight", stand_off=None)
    plan = replace(plan, phases=(stands, lands, straight))
    cells, spot = Cells(plan, Execution(threads=2)), SeaState(2.0, 6.0, math.pi)
    asks = {phase.name: CellRequest(phase.name, winch_of(phase, Alternative.SSC), spot, 16) for phase in plan.phases}
    cells.request(list(asks.values()))
    moves = {name: cells.runs[ask.cell]["load_pp"] for name, ask in asks.items()}
    assert np.median(moves["straight"]) < 0.06
    assert np.median(moves["landing"]) > 3.0 * np.median(moves["straight"])
    assert (moves["landing, held"] > 0.15).all()
    assert (moves["landing"] > 0.15).mean() > 0.5
