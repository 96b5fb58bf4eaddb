"""Where the frequency-domain method analyses a phase: the complete way, all of its time, and the depths of resonance."""

from __future__ import annotations

import json
import math
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from stillhook.cli import run
from stillhook.engine.pack.programme import wire_strength
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.file import load_plan
from stillhook.plan.report.checked import checked, checked_plan
from stillhook.plan.tiers.situations import EVERY, resonance_depth, situations
from stillhook.report.terminal import print_document
from stillhook.spec.lift.phase import PhaseKind

ROD = 0.02
"""LIFT.md's spring with a third of the wire's mass leaves out slings and hook, and is itself within a per cent of the rod."""


@cache
def plan() -> LiftPlan:
    return load_plan("template-to-1500m")


@pytest.mark.slow
def test_times_of_all_situations_are_the_time_of_the_phase() -> None:
    for phase in plan().phases:
        if phase.kind is not PhaseKind.SPLASH:
            assert sum(s.time for s in situations(plan(), phase)) == pytest.approx(phase.duration)


@pytest.mark.slow
def test_a_phase_is_looked_at_from_end_to_end_without_long_gaps() -> None:
    for phase in plan().phases:
        heights = [s.z for s in situations(plan(), phase)]
        if heights:
            assert (heights[0], heights[-1]) == (phase.z_start, phase.z_end)
            assert all(0.0 < a - b <= EVERY for a, b in pairwise(heights)) or phase.z_end > phase.z_start


def test_nothing_is_linear_where_the_surface_cuts_the_payload() -> None:
    assert situations(plan(), plan().phase("splash zone")) == ()


@pytest.mark.slow
def test_a_lowering_is_looked_at_where_the_load_is_in_resonance_with_the_seas() -> None:
    depth = resonance_depth(plan(), 5.0)
    found = situations(plan(), plan().phase("lower water"))
    assert any(s.z == pytest.approx(-depth, abs=0.1) for s in found)
    assert any(s.T_0 == pytest.approx(5.0, abs=1e-4) for s in found)


def test_resonance_is_where_a_mass_on_a_spring_has_the_period() -> None:
    depth, p = resonance_depth(plan(), 5.5), plan()
    EA, _ = wire_strength(p.crane)
    L = depth + p.h_tip - p.payload.height - p.rigging.height
    moving = p.payload.mass + p.payload.covered(p.rho).A33 + p.crane.hook_mass + p.crane.wire.mass_per_length * L / 3.0
    T_0 = 2.0 * math.pi * math.sqrt(moving * (L + p.crane.wire.L_0) / EA)
    assert pytest.approx(5.5, rel=ROD) == T_0


def test_resonance_with_long_waves_is_nowhere_in_this_water() -> None:
    assert math.isnan(resonance_depth(plan(), 9.0))


def test_the_tip_of_a_phase_is_where_its_situations_are() -> None:
    (first, *_) = situations(plan(), plan().phase("lift-off"))
    assert (first.x, first.y) == (-30.0, -2.0)


@pytest.mark.thorough
def test_a_check_tells_phases_times_rules_and_weather(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", "template-to-1500m", "--check", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    names = [phase.name for phase in plan().phases]
    assert [row["name"] for row in answer["phases"]] == names
    assert {row["phase"] for row in answer["limits"]} == set(names)
    assert answer["T_R"] == 2.0 * answer["T_POP"] >= 2.0 * answer["T_phases"]
    assert answer["weather"]["n"] > 8 * 365 * 9
    print_document(checked_plan(checked(plan())))
    told = capsys.readouterr().out
    assert all(word in told for word in (*names, "weather restricted", "SYNTHETIC", "landing-speed", "360 seas"))


@pytest.mark.slow
def test_an_example_is_copied_once_and_never_over_what_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["example", "plan", str(tmp_path / "mine")]) == 0
    assert sorted(path.name for path in (tmp_path / "mine").iterdir()) == [
        "SYNTHETIC-load-chart.csv",
        "template-120t.toml",
        "template-to-1500m.toml",
    ]
    assert run(["example", "plan", str(tmp_path / "mine")]) == 2
    assert "is there already" in capsys.readouterr().err
