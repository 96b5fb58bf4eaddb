"""Limits agree with their runs and their credit, ends of limits are named, steep seas and holds that are off give no
credit, and the report says so."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.plan.manifold import loaded, manifold

from stillhook.errors import PlanError
from stillhook.plan.assessments import hindcast, quality
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.assessments.quality.consistency import cells, credit, neighbours, steep, tiers_apart
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits
from stillhook.plan.planning import answered, plan
from stillhook.plan.report.document import document, marks
from stillhook.plan.report.words import governs
from stillhook.plan.result import PlanResult
from stillhook.plan.table import Axes, Certified, Chosen, End, governed, not_steep, to_chart_end
from stillhook.plan.tiers.time_domain.cells import Execution
from stillhook.plan.weather.value import forecast_limits
from stillhook.report.document import Section, Table, Verdict
from stillhook.report.html import html
from stillhook.sea.spectra.spectrum import highest_sea, steepest, steepness
from stillhook.statistics.extremes import P90, largest
from stillhook.weather.alpha import load_alpha_table
from stillhook.weather.series import Weather

SEAS = """\
[environment]
Hs = ["0.5 m", "1 m", "2 m", "4 m"]
Tp = ["5 s", "8 s"]
headings = ["180 deg"]

[operation]
T_POP = "8 h"

"""
CHART = "radius [m],Hs [m],SWL [t],DAF [1]\n10,2,240,1.3\n30,2,200,1.3\n10,2.5,220,1.3\n30,2.5,180,1.3\n"
CAP, SSC = Alternative.CAP, Alternative.SSC
PHASES = {
    "splash": '[[phase]]\nname = "splash zone"\nkind = "splash-zone"\ndepth = "25 m"\nhold = "off"\n\n',
    "down": '[[phase]]\nname = "down"\nkind = "lowering"\nmode = "ahc"\ndepth = "290 m"\n\n',
    "landing": '[[phase]]\nname = "landing"\nkind = "landing"\nhold = "off"\n\n',
}


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quality")
    (folder / "chart.csv").write_text(CHART, encoding="utf-8")
    chart = '[load_chart]\nfile = "chart.csv"\nradius = "20 m"\n\n'
    return loaded(folder, manifold("none", "cap-80", "ssc") + SEAS + chart + "".join(PHASES.values()))


@pytest.fixture(scope="module")
def result(lift):
    return plan(lift, tier=Tier.FREQUENCY)


def state(lift, *limits, demands=()):
    """The state of a plan of these limits, no certificate anywhere."""
    axes = Axes.of(lift)
    heights = np.unique(lift.environment.table().Hs)
    twin = np.array([[a.twin and p.compensated for p in lift.phases] for a in axes.alternatives])
    covers = np.broadcast_to(~twin[:, :, None, None, None], (*twin.shape, *axes.columns, len(heights)))
    of = answered(lift, axes, Certified(covers, {}, twin), demands, limits)
    return PlanState(lift, of, demands, limits, None, None, None, Execution(), Tier.TIME)


def limits(phase, alternative, tier, **Hs):
    """Limits at 5 and 8 s in head seas."""
    rows = {key.replace("_", "-"): np.array(values) for key, values in Hs.items()}
    return Limits(phase, alternative, tier, np.array([5.0, 8.0]), np.full(2, math.pi), rows, dict(rows), dict(rows))


def peaks(phase, alternative, tension):
    """Demand by runs at 8 s: largest tension [N] by height [m]."""
    Hs = np.array(list(tension))
    seas = Seas(Hs, np.full_like(Hs, 8.0), np.full_like(Hs, math.pi))
    return Demand(phase, alternative, Tier.TIME, seas, {"F_top_max": np.array(list(tension.values()))})


def test_a_limit_below_a_cell_that_uses_little_is_found(lift):
    """Phase "down" of a user's lift: peaks of 1,490 to 1,605 kN at 2 m where 2,525 kN are allowed had a limit of 0.26 m."""
    seen = peaks("down", SSC, {0.0: 600e3, 1.0: 1490e3, 2.0: 1605e3, 4.0: 1700e3})
    wrong = cells(state(lift, limits("down", SSC, Tier.TIME, dynamic_load=(0.26, 0.26)), demands=[seen]))
    (row,) = wrong["failed"]
    assert (row["phase"], row["rule"], row["Tp"], row["Hs"], row["least"]) == ("down", "dynamic-load", 8.0, 0.26, 2.0)
    right = cells(state(lift, limits("down", SSC, Tier.TIME, dynamic_load=(2.5, 2.5)), demands=[seen]))
    assert (right["n"], right["failed"]) == (1, [])


def test_a_cell_above_one_that_is_beyond_says_nothing(lift):
    seen = peaks("down", SSC, {1.0: 9000e3, 2.0: 1000e3})
    assert not cells(state(lift, limits("down", SSC, Tier.TIME, dynamic_load=(0.5, 0.5)), demands=[seen]))["failed"]


@given(st.lists(st.floats(0.1, 4.0), min_size=4, max_size=4))
def test_credit_is_the_lesser_of_twin_and_cap_and_the_gate_finds_less(lift, Hs):
    made = [limits("down", a, Tier.TIME, dynamic_load=Hs[2 * i : 2 * i + 2]) for i, a in enumerate((CAP, SSC))]
    of = state(lift, *made)
    assert not credit(of)["failed"]
    at = of.answered.axes.alternatives.index(SSC)

    def otherwise(Hs):
        other = replace(of.answered.credited, Hs=Hs)
        return replace(of, answered=replace(of.answered, counting={**of.answered.counting, "credited": other}))

    lower = of.answered.credited.Hs.copy()
    lower[at] *= 0.9
    assert len(credit(otherwise(lower))["failed"]) == 2
    higher = of.answered.credited.Hs.copy()
    higher[at] = 5.0
    assert credit(otherwise(higher))["failed"]


def test_a_limit_at_the_last_height_of_the_chart_is_the_end_of_the_chart(lift):
    of = state(lift, *(limits("down", a, Tier.TIME, dynamic_load=(2.0, 2.5)) for a in lift.alternatives))
    g = of.answered.governs["twin"]
    at = of.answered.axes.alternatives.index(SSC)
    assert g.Hs[at, 0].tolist() == [2.0, 2.5]
    assert g.end[at, 0].tolist() == [-1, list(End).index(End.CHART)]
    assert governs("down", "dynamic-load", End.CHART) == "down: end of the load chart"


def test_a_limit_at_the_highest_sea_that_a_certificate_covers_is_the_end_of_its_envelope(lift):
    """A certificate up to 1 m, a cap below it, and a twin that is inside everywhere."""
    axes = Axes.of(lift)
    of = state(lift, limits("landing", CAP, Tier.TIME, control_error=(0.3, 0.3)))
    twin = limits("landing", SSC, Tier.TIME, control_error=(np.inf, np.inf))
    heights = np.unique(lift.environment.table().Hs)
    covers = np.broadcast_to(heights <= 1.0, (len(axes.alternatives), len(axes.phases), *axes.columns, len(heights)))
    made = answered(lift, axes, replace(of.answered.certified, covers=covers), (), [*of.limits, twin])
    g, i = made.governs["credited"], axes.alternatives.index(SSC)
    assert g.Hs[i, 0].tolist() == [1.0, 1.0]
    assert (g.end[i, 0] == list(End).index(End.CERTIFICATE)).all()
    assert governs("landing", "control-error", End.CERTIFICATE) == "landing: end of the certificate's envelope"


def test_what_a_synthetic_certificate_credits_may_not_be_claimed_and_waits_less(lift):
    """The claim is the answer of the same plan without a certificate, limit by limit and wait by wait."""
    lift = replace(lift, environment=lift.environment.model_copy(update={"heading_tolerance": 0.0}))
    made = [limits("down", a, Tier.TIME, dynamic_load=(Hs, Hs)) for a, Hs in ((CAP, 1.0), (SSC, 2.0))]
    less = state(lift, *made)
    covered = replace(less.answered.certified, covers=np.ones_like(less.answered.certified.covers))
    axes, assumed = less.answered.axes, replace(lift, credits_synthetic=True)
    of, real = (answered(each, axes, covered, (), made) for each in (assumed, lift))
    assert (of.claim, real.claim, less.answered.claim) == ("claimable", "credited", "credited")
    assert list(real.governs) == ["twin", "credited"]
    at = axes.alternatives.index(SSC)
    Hs = {name: g.Hs[at, 0].tolist() for name, g in of.governs.items()}
    assert Hs == {"twin": [2.0, 2.0], "credited": [2.0, 2.0], "claimable": [1.0, 1.0]}
    assert np.array_equal(of.governs["claimable"].Hs, less.answered.governs["credited"].Hs, equal_nan=True)

    time = np.datetime64("2001-01-01T00:00:00") + np.arange(6 * 365 * 8) * np.timedelta64(3, "h")
    height = np.repeat([0.4, 1.2, 6.0, 6.0], 16)[np.arange(len(time)) % 64]  # two days, two days and four
    columns = {"H_m0": height, "T_p": np.full(len(time), 6.0)}
    records = Weather(time, columns, 3 * 3600.0, "made up")
    with_weather = [
        replace(less, plan=p, answered=a, records=records, forecast=forecast_limits(p, load_alpha_table(), a.governs))
        for p, a in ((assumed, of), (lift, less.answered))
    ]
    both, alone = (hindcast.assess(each, lambda share: None) for each in with_weather)
    answer = ("windows", "waiting")
    assert json.dumps([both[key] for key in answer]) == json.dumps([alone[key] for key in answer])
    assert "as_credited" not in alone
    claim, credited = (each["waiting"][0]["wait_p50"]["value"] for each in (both, both["as_credited"]))
    assert 0.0 < credited < claim
    titles = [part.title for part in hindcast.parts({hindcast.NAME: both}) if "Waiting" in getattr(part, "title", "")]
    assert ["claimable" in title for title in titles] == [True, False]
    assert "with this certificate if it were real" in titles[1]


@pytest.mark.parametrize("Tp", [4.0, 5.0, 8.0, 11.5, 16.0])
def test_the_highest_sea_of_a_period_is_as_steep_as_a_sea_may_be(Tp):
    """DNV-RP-C205: 1/15 up to 8 s, 1/25 from 15 s."""
    assert steepness(highest_sea(Tp), Tp) == pytest.approx(steepest(Tp, "T_p"))
    assert highest_sea(8.0) == pytest.approx(9.80665 * 64.0 / (2.0 * math.pi) / 15.0)


def test_no_limit_is_credited_above_the_steepest_sea_and_the_simulated_one_stays(lift):
    of = state(lift, *(limits("down", a, Tier.TIME, dynamic_load=(np.inf, 2.0)) for a in lift.alternatives))
    credited, twin = (of.answered.governs[name] for name in ("credited", "twin"))
    assert np.isposinf(twin.Hs[:, 0, 0]).all()
    assert credited.Hs[:, 0, 0] == pytest.approx(2.60, abs=0.005)
    assert (credited.end[:, 0, 0] == list(End).index(End.STEEPNESS)).all()
    assert (credited.phase[:, 0, 0] == -1).all()
    assert (credited.Hs[:, 0, 1] == 2.0).all()
    calm = state(lift, *(limits("down", a, Tier.TIME, dynamic_load=(2.0, np.inf)) for a in lift.alternatives))
    above = calm.answered.governs["credited"]  # 6.66 m at 8 s: higher than any sea analysed
    assert np.isposinf(above.Hs[:, 0, 1]).all()
    assert (above.end[:, 0, 1] == list(End).index(End.SEAS)).all()
    facts = steep(of)
    assert (facts["n"], facts["of"]) == (1, 8)  # 4 m at 5 s
    assert facts["cut"] == [{"n": 1, "alternatives": ["none", "cap-80", "ssc"]}]


def test_a_height_of_the_steepest_sea_itself_is_credited(lift):
    axes = Axes.of(lift)
    Hs = np.full((3, len(axes.phases), len(axes.rules), 1, 2), highest_sea(5.0))
    g = not_steep(governed(to_chart_end(lift, Chosen(axes, Hs, Hs, Hs, np.zeros(Hs.shape, dtype=int)))), 4.0)
    assert (g.end == -1).all()


def test_tiers_apart_say_which_counts_and_why(lift):
    rows = [
        limits("down", SSC, tier, dynamic_load=Hs)
        for tier, Hs in ((Tier.FREQUENCY, (1.0, 1.0)), (Tier.TIME, (1.4, 1.6)))
    ]
    rows += [
        limits("splash zone", SSC, tier, slack_sling=Hs)
        for tier, Hs in ((Tier.CLOSED_FORM, (1.0, 1.0)), (Tier.TIME, (1.6, 1.2)))
    ]
    rows += [limits("down", SSC, Tier.CLOSED_FORM, dynamic_load=(0.1, 0.1))]  # of the cap: the closed form has no twin
    of = state(lift, *rows)
    by = {row["phase"]: row for row in tiers_apart(of)}
    assert len(by) == 2
    zone = by["splash zone"]
    assert (zone["n"], zone["of"], zone["counts"], zone["reason"]) == (1, 2, ["time"], "wave-zone")
    assert (by["down"]["n"], by["down"]["counts"], by["down"]["reason"]) == (1, ["frequency"], "lower")
    at = of.answered.axes.rules.index("dynamic-load")
    assert of.answered.modelled.Hs[2, 1, at, 0].tolist() == [1.4, 1.0]
    told = replace(lift, reconciled={("down", "dynamic-load"): "runs of 59 seeds, agreed"})
    (row,) = [row for row in tiers_apart(state(told, *rows)) if row["phase"] == "down"]
    assert (row["counts"], row["reason"]) == (["time"], "runs of 59 seeds, agreed")


def test_neighbours_that_are_far_apart_are_flagged(lift):
    flat = [limits("down", a, Tier.TIME, dynamic_load=(1.0, 1.49)) for a in lift.alternatives]
    assert neighbours(state(lift, *flat)) == []
    (row,) = neighbours(state(lift, *(replace(each, Hs={"dynamic-load": np.array([1.0, 1.6])}) for each in flat)))
    assert (row["Tp"], row["Hs"]) == ([5.0, 8.0], [1.0, 1.6])
    assert row["governs"][0] == {"phase": "down", "rule": "dynamic-load", "end": ""}


def test_half_an_hour_in_the_wave_zone_asks_more_than_a_passage():
    """Rayleigh: what 90 % of passages stay below, of 17 waves and of 240 [sigma]."""
    assert largest(1.0, 17.0, P90) == pytest.approx(3.19, abs=0.005)
    assert largest(1.0, 240.0, P90) == pytest.approx(3.93, abs=0.005)


@pytest.mark.long
def test_a_hold_that_is_off_is_assessed_and_printed_as_not_claimed(lift, result):
    assert [phase.name for phase in lift.not_claimed] == ["splash zone, held", "landing, held"]
    assert [phase.name for phase in lift.phases] == ["splash zone", "down", "landing"]
    zone, landing = result.facts["quality"]["holds"]
    assert (zone["phase"], zone["claimed"], zone["time"], zone["tier"]) == ("splash zone", False, 1800.0, "closed-form")
    assert (landing["claimed"], landing["time"], landing["tier"]) == (False, 300.0, "frequency")
    page = html(document(result, {}))
    assert "held, NOT CLAIMED" in page
    assert "must not be stopped there" in page
    assert any("a stop there is not claimed" in note for note in result.facts["notes"])


def test_a_claimed_hold_stands_beside_its_passage_with_the_limit_of_one_that_is_not_claimed(tmp_path):
    off = loaded(tmp_path, manifold("none", "cap-80") + SEAS + PHASES["splash"])
    on = loaded(tmp_path, manifold("none", "cap-80") + SEAS + PHASES["splash"].replace('hold = "off"\n', ""))
    rows = [plan(lift, tier=Tier.CLOSED_FORM).facts["quality"]["holds"] for lift in (off, on)]
    assert [[row["claimed"] for row in each] for each in rows] == [[False], [True]]
    assert rows[0][0]["held"] == rows[1][0]["held"]
    assert rows[0][0]["time"] == rows[1][0]["time"] == 1800.0
    assert on.not_claimed == ()


def test_the_report_shows_the_gate_and_marks_a_limit_that_contradicts_its_runs(result):
    facts = {**result.facts}
    sections = document(result, {}).sections
    (section,) = [each for each in sections if isinstance(each, Section) and quality.TITLE in each.title]
    assert isinstance(section.parts[0], Verdict)
    assert section.parts[0].passed
    row = {
        "alternative": "ssc",
        "phase": "down",
        "rule": "dynamic-load",
        "beta": 3.1,
        "Tp": 8.0,
        "Hs": 0.26,
        "least": 2.0,
    }
    facts["quality"] = {**facts["quality"], "checks": [{"check": "cells", "n": 9, "failed": [row]}]}
    wrong = PlanResult(result.data, facts, result.blocks)
    assert "1 LIMITS CONTRADICT THEIR RUNS OR THEIR CREDIT: see the quality of the limits" in marks(wrong)
    verdict, table, *_ = quality.parts(facts)
    assert isinstance(verdict, Verdict)
    assert not verdict.passed
    assert isinstance(table, Table)
    assert table.rows[0][-2:] == ["0.26", "2.00"]


def test_limits_at_the_steepest_sea_are_grey_on_the_page(result):
    data = result.data.copy(deep=True)
    data["governing_end"][:] = "steepness"
    assert 'class="number grey"' in html(document(PlanResult(data, result.facts, result.blocks), {}))


@pytest.mark.parametrize("key", ["down/snap", "up/dynamic-load", "dynamic-load"])
def test_a_reason_for_what_is_no_phase_or_rule_is_refused(tmp_path, key):
    text = manifold("none", "cap-80") + f'[reconciled]\n"{key}" = "agreed"\n\n' + SEAS + PHASES["down"]
    text = text.replace('start_depth = "-5 m"', 'start_depth = "25 m"')
    with pytest.raises(PlanError, match=r'Write "phase/rule" = "reason", such as "down/static-load"') as e:
        loaded(tmp_path, text)
    assert "\n" not in str(e.value)


def test_a_reason_is_read_and_changes_the_digest(tmp_path):
    text = manifold("none", "cap-80") + SEAS + PHASES["down"]
    text = text.replace('start_depth = "-5 m"', 'start_depth = "25 m"')
    plain = loaded(tmp_path, text)
    told = loaded(tmp_path, text.replace("[environment]", '[reconciled]\n"down/snap-load" = "agreed"\n\n[environment]'))
    assert told.reconciled == {("down", "snap-load"): "agreed"}
    assert told.digest != plain.digest


def test_the_example_of_the_library_says_that_its_hold_is_off():
    assert [phase.name for phase in load_plan("template-to-1500m").not_claimed] == ["splash zone, held"]
