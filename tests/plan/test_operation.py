"""Times of an operation: from the issue of the forecast on, and of its longest part where it can be halted."""

from pathlib import Path

import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.errors import StillhookError
from stillhook.plan.planning import plan as planned
from stillhook.weather.alpha import alpha_of, load_alpha_table

H = 3600.0
PLAN = (
    manifold("none")
    + """\
[environment]
Hs = ["1 m", "2 m", "3 m"]
Tp = ["6 s", "12 s"]
headings = ["165 deg", "180 deg", "195 deg"]

[operation]
OPERATION

[[phase]]
name = "splash"
kind = "splash-zone"
hold = "off"

[[phase]]
name = "wait"
kind = "lowering"
mode = "manual"
depth = "100 m"
planned = "5 h"

[[phase]]
name = "down"
kind = "lowering"
mode = "manual"
depth = "200 m"
planned = "3 h"
"""
)


def lift(folder: Path, operation: str):
    return loaded(folder, PLAN.replace("OPERATION", operation))


def test_lead_time_is_added_to_what_is_planned(tmp_path):
    made = lift(tmp_path, 'T_POP = "12 h"\nT_C = "12 h"\nlead = "8 h"')
    assert (made.T_POP, made.lead, made.parts) == (20 * H, 8 * H, 1)
    assert not any("operation.lead" in note or "T_C" in note for note in made.notes)


@pytest.mark.slow
@pytest.mark.parametrize("lead", ["0 h", "30 min"])
def test_a_forecast_may_be_issued_at_the_start_or_shortly_before(tmp_path, lead):
    made = lift(tmp_path, f'T_POP = "12 h"\nT_C = "12 h"\nlead = "{lead}"')
    assert made.T_POP == 12 * H + made.lead
    assert made.lead == {"0 h": 0.0, "30 min": 0.5 * H}[lead]


def test_factor_and_window_are_those_of_the_time_from_the_issue(tmp_path):
    result = planned(lift(tmp_path, 'T_POP = "12 h"\nT_C = "12 h"\nlead = "8 h"'), tier="closed-form")
    operation = result.facts["operation"]
    assert "swell_wf" not in operation  # the forecast of a plan without a swell has none
    assert (operation["T_POP"], operation["T_R"], operation["window"]) == (20 * H, 32 * H, 24 * H)
    cells = [row for row in result.facts["limits"] if row["Hs_limit"] >= 1.0]
    assert cells
    table = load_alpha_table()
    for row in cells:
        Hs = min(row["Hs_limit"], 3.0)
        assert row["alpha"] == pytest.approx(alpha_of(table, Hs, 24 * H).alpha)  # the row up to 24 h


def test_a_forecast_without_a_stated_lead_and_a_short_contingency_are_noted(tmp_path):
    notes = lift(tmp_path, 'T_POP = "12 h"\nT_C = "2 h"').notes
    assert any("operation.lead is not given: the forecast is taken as issued at the start" in note for note in notes)
    assert any("contingency T_C 2 h is short: at least 6 h and half of T_POP" in note for note in notes)


HALTED = 'safe_after = ["wait"]\ntime_to_safe = "1 h"\nlead = "2 h"\nT_C = "8 h"'


def test_an_operation_that_can_be_halted_is_planned_by_its_longest_part(tmp_path):
    whole = lift(tmp_path, 'lead = "2 h"\nT_C = "8 h"')
    splash = whole.phase("splash").counted
    assert whole.T_POP == pytest.approx(2 * H + splash + 8 * H)
    halted = lift(tmp_path, HALTED)
    assert halted.T_POP == pytest.approx(2 * H + (splash + 5 * H) + 1 * H)
    assert (halted.parts, halted.T_POP < whole.T_POP) == (2, True)
    assert any("longest of 2 parts between safe conditions" in note and "2.6.9.3" in note for note in halted.notes)


def test_a_part_is_no_shorter_than_the_time_between_forecasts_and_never_longer_than_the_operation(tmp_path):
    splash = lift(tmp_path, HALTED).phase("splash").counted
    assert lift(tmp_path, HALTED + '\nforecast_every = "6 h"').T_POP == pytest.approx(2 * H + 6 * H + 1 * H)
    assert lift(tmp_path, HALTED + '\nforecast_every = "24 h"').T_POP == pytest.approx(2 * H + splash + 8 * H)


@pytest.mark.parametrize(
    ("operation", "says"),
    [
        ('safe_after = ["wate"]\ntime_to_safe = "1 h"', '"wate" is not one of splash, wait; did you mean "wait"'),
        ('safe_after = ["down"]\ntime_to_safe = "1 h"', "It is the last phase"),
        ('safe_after = ["wait"]', "safe_after: give time_to_safe"),
        (
            'safe_after = ["wait"]\ntime_to_safe = "1 h"\nT_POP = "12 h"',
            'operation.T_POP = "12 h": is the time of the complete operation',
        ),
        ('time_to_safe = "1 h"', 'operation.time_to_safe = "1 h": belongs to safe_after'),
        ('forecast_every = "6 h"', 'operation.forecast_every = "6 h": belongs to safe_after'),
        ('lead = "-1 h"', "lead"),
        ("lead = 8", "lead"),
    ],
)
def test_times_that_cannot_be_are_refused_in_one_line(tmp_path, operation, says):
    with pytest.raises(StillhookError) as caught:
        lift(tmp_path, operation)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_plan_names_its_table_of_factors(tmp_path):
    named = lift(tmp_path, 'T_POP = "12 h"\nforecast_factors = "dnv-os-h101#A"')
    assert planned(named, tier="closed-form").facts["operation"]["alpha_table"]["name"] == "dnv-os-h101#A"
    over = planned(named, tier="closed-form", alpha="dnv-rules-1996").facts["operation"]["alpha_table"]
    assert (over["name"], over["edition"]) == ("dnv-rules-1996", "January 1996")
    (tmp_path / "own.csv").write_text("# level: ours\nT_POP [h],Hs [m],alpha [1]\n12,1,0.5\n12,2,0.6\n")
    own = planned(lift(tmp_path, 'T_POP = "12 h"\nforecast_factors = "own.csv"'), tier="closed-form")
    assert own.facts["operation"]["alpha_table"]["level"] == "ours"
